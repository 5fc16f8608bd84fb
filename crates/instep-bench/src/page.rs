//! The benchmark's HTML page.

use instep_report::{Axis, Cell, Column, Plot, Report, Series, SummaryItem, Table, Verdict};

use crate::directions::Directions;
use crate::table::{Row, text_table};

/// Scenarios with more directions than this are random, and get no row for each.
const MOST_DIRECTIONS: usize = 20;

/// One page for the table and the directions; `notes` stand at its end.
#[must_use]
pub fn page(rows: &[Row], sweeps: &[Directions], notes: Vec<String>) -> Report {
    let (head, body) = text_table(rows);
    let columns =
        head.iter().enumerate().map(|(i, title)| if i < 3 { Column::text(*title) } else { Column::number(*title) });
    let judged = |column: usize, text: &str, row: &Row| {
        let verdict = match column {
            5 => row.hit_rate.map(|rate| rate >= 0.98),
            6 => row.upright_rate.map(|rate| rate >= 0.98),
            13 => Some(row.audit_invalid == 0),
            14 => Some(row.limit_violations == 0),
            _ => None,
        };
        let verdict = verdict.map_or(Verdict::Neutral, |good| if good { Verdict::Good } else { Verdict::Bad });
        Cell::judged(text, verdict)
    };
    let cells = body.iter().zip(rows).map(|(texts, row)| {
        texts.iter().enumerate().map(|(column, text)| judged(column, text, row)).collect::<Vec<_>>()
    });
    let why = rows.iter().filter(|row| row.refused > 0).map(|row| {
        let causes = row.refused_why.iter().map(|(cause, count)| format!("{cause} {count}")).collect::<Vec<_>>();
        vec![
            Cell::from(row.engine.as_str()),
            row.robot.as_str().into(),
            row.scenario.as_str().into(),
            causes.join(", ").into(),
        ]
    });
    let requests: usize = rows.iter().map(|row| row.requests).sum();
    let refused: usize = rows.iter().map(|row| row.refused).sum();
    Report {
        title: "KickBench".into(),
        subtitle: "engines x robots x scenarios x seeds".into(),
        summary: vec![
            SummaryItem::new("Requests", requests.to_string(), Verdict::Neutral, ""),
            SummaryItem::new("Accepted", (requests - refused).to_string(), Verdict::Neutral, ""),
        ],
        tables: vec![
            Table { title: "Results".into(), columns: columns.collect(), rows: cells.collect() },
            Table {
                title: "Why requests were refused".into(),
                columns: ["engine", "robot", "scenario", "causes"].map(Column::text).to_vec(),
                rows: why.collect(),
            },
            summary(sweeps),
            each(sweeps),
        ],
        plots: plots(sweeps),
        notes,
        ..Report::default()
    }
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |v| format!("{v:.digits$}"))
}

/// One row a scenario.
fn summary(sweeps: &[Directions]) -> Table {
    let names = ["engine", "robot", "scenario"].map(Column::text);
    let numbers = ["offset, deg", "spread, deg", "rank correlation of forecast and error"].map(Column::number);
    let rows = sweeps.iter().map(|sweep| {
        vec![
            sweep.engine.as_str().into(),
            sweep.robot.as_str().into(),
            sweep.scenario.as_str().into(),
            number(sweep.offset_deg, 2).into(),
            number(sweep.spread_deg, 2).into(),
            number(sweep.rank_correlation, 2).into(),
        ]
    });
    Table {
        title: "Direction of the ball".into(),
        columns: names.into_iter().chain(numbers).collect(),
        rows: rows.collect(),
    }
}

/// The scenarios whose directions are taken in turn.
fn swept(sweeps: &[Directions]) -> impl Iterator<Item = &Directions> {
    sweeps.iter().filter(|sweep| (3..=MOST_DIRECTIONS).contains(&sweep.directions.len()))
}

/// One row a direction.
fn each(sweeps: &[Directions]) -> Table {
    let names = ["engine", "robot", "scenario"].map(Column::text);
    let numbers =
        ["asked, deg", "kicks", "hits", "offset, deg", "spread, deg", "worst, deg", "rolled, m", "forecast g"];
    let rows = swept(sweeps).flat_map(|sweep| {
        sweep.directions.iter().map(|d| {
            vec![
                sweep.engine.as_str().into(),
                sweep.robot.as_str().into(),
                sweep.scenario.as_str().into(),
                format!("{:.0}", d.asked_deg).into(),
                d.requests.to_string().into(),
                d.hits.to_string().into(),
                number(d.offset_deg, 2).into(),
                number(d.spread_deg, 2).into(),
                number(d.worst_deg, 2).into(),
                number(d.rolled, 2).into(),
                number(d.forecast, 3).into(),
            ]
        })
    });
    Table {
        title: "Each direction".into(),
        columns: names.into_iter().chain(numbers.map(Column::number)).collect(),
        rows: rows.collect(),
    }
}

/// Paper 3's figure 5: error of the direction and way of the ball over the asked direction.
fn plots(sweeps: &[Directions]) -> Vec<Plot> {
    let plot = |title: &str, unit: &str, value: fn(&crate::directions::Direction) -> Option<f64>| {
        let series: Vec<Series> = swept(sweeps)
            .map(|sweep| {
                let points = sweep.directions.iter().filter_map(|d| Some([d.asked_deg, value(d)?])).collect();
                Series::points(format!("{} {} {}", sweep.engine, sweep.robot, sweep.scenario), points)
            })
            .collect();
        let (title, x_label, y_label) = (title.into(), "asked direction, deg".into(), unit.into());
        Plot { title, x_label, y_label, axis: Axis::Other, series, ..Plot::default() }
    };
    if swept(sweeps).next().is_none() {
        return Vec::new();
    }
    vec![
        plot("Offset of the ball's direction", "deg", |d| d.offset_deg),
        plot("Way of the ball", "m", |d| d.rolled),
        plot("Forecast g", "", |d| d.forecast),
    ]
}
