//! The report of a tuning: before and after, the parameters, convergence, and the parameters' ways.

use instep_bench::table::{Row, text_table};
use instep_report::{Axis, Cell, Column, Plot, Report, Series, SummaryItem, Table, Verdict};

use crate::evaluate::Summary;
use crate::run::Tuned;

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |v| format!("{v:.digits$}"))
}

/// One page; `bench` holds KickBench's rows before and after.
#[must_use]
pub fn page(tuned: &Tuned, bench: [&[Row]; 2]) -> Report {
    let [before, after] = &tuned.measured;
    let label = tuned.objective.label();
    let better = after.cost < before.cost;
    let good = |good: bool| if good { Verdict::Good } else { Verdict::Bad };
    let upright = after.upright().unwrap_or(0.0);
    let trials = tuned.history.last().map_or(0, |last| last.trials);
    Report {
        title: format!("{} on {}: {}", tuned.engine, tuned.robot, tuned.title),
        subtitle: format!("CMA-ES, scenario {}, seed {}", tuned.scenario, tuned.seed),
        summary: vec![
            SummaryItem::new(
                label,
                number(after.objective, 3),
                good(better),
                format!("{} before", number(before.objective, 3)),
            ),
            SummaryItem::new("Upright", format!("{:.1} %", 100.0 * upright), good(upright >= 0.98), ""),
            SummaryItem::new("Generations", tuned.history.len().to_string(), Verdict::Neutral, ""),
            SummaryItem::new(
                "Trials",
                trials.to_string(),
                Verdict::Neutral,
                format!("in {:.1} min", tuned.seconds / 60.0),
            ),
        ],
        tables: vec![comparison(tuned), parameters(tuned), kick_bench(bench)],
        plots: plots(tuned),
        notes: vec![
            "Before and after are measured on cases that neither the search nor the choice of its result has seen. A \
             kick counts when the ball is hit, the impact passes the audit and the robot stands to the end; everything \
             else costs a penalty. Distance and speed are asked at the greatest ball speed that the engine accepts in \
             each case, accuracy and time at the scenario's."
                .into(),
        ],
        ..Report::default()
    }
}

fn comparison(tuned: &Tuned) -> Table {
    let row = |name: &str, s: &Summary| {
        vec![
            Cell::from(name),
            s.cases.to_string().into(),
            s.refused.to_string().into(),
            s.missed.to_string().into(),
            s.fell.to_string().into(),
            s.invalid.to_string().into(),
            number(s.upright().map(|share| 100.0 * share), 1).into(),
            number(s.objective, 3).into(),
            number(s.median, 3).into(),
            format!("{:.3}", s.cost).into(),
        ]
    };
    let label = tuned.objective.label();
    let mut columns = vec![Column::text("settings")];
    columns.extend(["cases", "refused", "missed", "fell", "audit failed", "upright %"].map(Column::number));
    columns.extend([format!("mean {label}"), format!("median {label}"), "mean cost".into()].map(Column::number));
    Table {
        title: "Before and after".into(),
        columns,
        rows: vec![row("before", &tuned.measured[0]), row("after", &tuned.measured[1])],
    }
}

fn parameters(tuned: &Tuned) -> Table {
    let [before, after] = &tuned.values;
    Table {
        title: "Parameters".into(),
        columns: vec![
            Column::text("parameter"),
            Column::number("least"),
            Column::number("greatest"),
            Column::number("before"),
            Column::number("after"),
        ],
        rows: (0..tuned.names.len())
            .map(|i| {
                let [low, high] = tuned.bounds[i];
                let mut row = vec![Cell::from(tuned.names[i].as_str())];
                row.extend([low, high, before[i], after[i]].map(|value| Cell::from(value.to_string())));
                row
            })
            .collect(),
    }
}

fn kick_bench([before, after]: [&[Row]; 2]) -> Table {
    let (head, old) = text_table(before);
    let (_, new) = text_table(after);
    let mut columns = vec![Column::text("settings")];
    columns.extend(head.iter().enumerate().map(|(i, t)| if i < 3 { Column::text(*t) } else { Column::number(*t) }));
    let row = |name: &str, cells: &Vec<String>| {
        let mut row = vec![Cell::from(name)];
        row.extend(cells.iter().map(|cell| Cell::from(cell.as_str())));
        row
    };
    let rows = old.iter().zip(&new).flat_map(|(old, new)| [row("before", old), row("after", new)]).collect();
    Table { title: "KickBench, at the scenarios' own speeds".into(), columns, rows }
}

fn plots(tuned: &Tuned) -> Vec<Plot> {
    let line = |value: &dyn Fn(usize) -> f64| -> Vec<[f64; 2]> {
        (0..tuned.history.len()).map(|g| [(g + 1) as f64, value(g)]).collect()
    };
    let plot = |title: String, y_label: &str, series: Vec<Series>| Plot {
        title,
        x_label: "generation".into(),
        y_label: y_label.into(),
        axis: Axis::Other,
        series,
        ..Plot::default()
    };
    let history = &tuned.history;
    let mut plots = vec![
        plot(
            "Cost".into(),
            "mean over the cases, penalties included",
            vec![
                Series::points("best sample", line(&|g| history[g].best)),
                Series::points("median sample", line(&|g| history[g].median)).dashed(),
            ],
        ),
        plot("Kicks that count".into(), "share", vec![Series::points("all samples", line(&|g| history[g].good))]),
        plot(
            "Spread".into(),
            "standard deviation / share of the bounds",
            tuned
                .names
                .iter()
                .enumerate()
                .map(|(i, name)| Series::points(name.as_str(), line(&|g| history[g].spread[i])))
                .collect(),
        ),
    ];
    plots.extend(tuned.names.iter().enumerate().map(|(i, name)| {
        let [low, high] = tuned.bounds[i];
        let deviation = |g: usize| history[g].spread[i] * (high - low);
        plot(
            name.clone(),
            "mean, and a standard deviation to both sides",
            vec![
                Series::points("mean", line(&|g| history[g].values[i])),
                Series::points("above", line(&|g| history[g].values[i] + deviation(g))).dashed(),
                Series::points("below", line(&|g| history[g].values[i] - deviation(g))).dashed(),
            ],
        )
    }));
    plots
}
