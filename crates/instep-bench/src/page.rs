//! The benchmark's HTML page.

use instep_report::{
    Axis, Column, Matrix, MatrixCell, MatrixRow, Measure, Plot, Report, Series, SummaryItem, Table, Verdict,
};
use instep_sim::{NamedRate, Rate};

use crate::cell::{CellResult, Kicked};
use crate::directions::Directions;
use crate::table::{Row, percent, rows_over_seeds, text_table};

/// Scenarios with more directions than this are random, and get no row for each.
const MOST_DIRECTIONS: usize = 20;

/// A file beside the page that shows one kick of a cell: the cell's engine, robot and scenario, what it shows, its name.
#[derive(Debug, Clone, PartialEq)]
pub struct Shown {
    /// Engine, robot and scenario.
    pub cell: [String; 3],
    /// What it shows.
    pub label: String,
    /// File name, relative to the page.
    pub file: String,
}

/// One page: the matrix of engines and robots by scenarios, the directions, and links to the kicks that are `shown`; `notes`
/// stand at its end.
#[must_use]
pub fn page(cells: &[CellResult], sweeps: &[Directions], shown: &[Shown], notes: Vec<String>) -> Report {
    let rows = rows_over_seeds(cells);
    let sum = |count: fn(&Row) -> usize| rows.iter().map(count).sum::<usize>();
    let (requests, refused) = (sum(|row| row.requests), sum(|row| row.refused));
    let (invalid, violations) = (sum(|row| row.audit_invalid), sum(|row| row.limit_violations));
    let share = |good: usize, all: usize| percent(&NamedRate::of("", good, all)) + " %";
    let count = |good: fn(&Kicked) -> bool| {
        cells.iter().flat_map(|cell| &cell.outcomes).filter(|outcome| outcome.as_ref().is_ok_and(good)).count()
    };
    let kicked = requests - refused;
    Report {
        title: "KickBench".into(),
        subtitle: "engines and robots by scenarios; every rate with its 95 % interval".into(),
        summary: vec![
            SummaryItem::new("Requests", requests.to_string(), Verdict::Neutral, format!("{kicked} accepted")),
            SummaryItem::new("Delivered", share(count(|k| k.delivered), requests), Verdict::Neutral, "of all requests"),
            SummaryItem::new("Hit", share(count(|k| k.hit), kicked), Verdict::Neutral, "of the accepted"),
            SummaryItem::new("Upright", share(count(|k| k.upright), kicked), Verdict::Neutral, "of the accepted"),
            SummaryItem::new("Failed the audit", invalid.to_string(), Verdict::Neutral, "kicks that touched the ball"),
            SummaryItem::new("Beyond a limit", violations.to_string(), Verdict::Neutral, "joints, over all kicks"),
        ],
        matrix: (!rows.is_empty()).then(|| matrix(&rows, shown)),
        tables: if sweeps.is_empty() { Vec::new() } else { vec![summary(sweeps), each(sweeps)] },
        plots: plots(sweeps),
        notes,
        ..Report::default()
    }
}

/// A measure and how it is read off a row.
type Reading = (Measure, fn(&Row) -> [Option<f64>; 3]);

fn measures() -> Vec<Reading> {
    fn interval(rate: &NamedRate) -> [Option<f64>; 3] {
        let of = |part: fn(&Rate) -> f64| rate.rate.as_ref().map(|rate| 100.0 * part(rate));
        [of(|rate| rate.share), of(|rate| rate.low), of(|rate| rate.high)]
    }
    let measure =
        |name: &str, about: &str, shade, digits| Measure { name: name.into(), about: about.into(), shade, digits };
    let per_cent = [50.0, 100.0];
    vec![
        (
            measure(
                "delivered, %",
                "Of all requests: accepted, hit, upright, valid, within 15 degrees, 0.8 of the speed or more.",
                [0.0, 100.0],
                0,
            ),
            |row| interval(&row.delivered),
        ),
        (measure("accepted, %", "Requests that the engine did not refuse.", [0.0, 100.0], 0), |row| {
            interval(&row.accepted)
        }),
        (
            measure(
                "hit, %",
                "Of the accepted: the ball left with 0.3 of the asked speed or more, and the audit believes it.",
                per_cent,
                0,
            ),
            |row| interval(&row.hit),
        ),
        (measure("upright, %", "Of the accepted: the robot stood to the end.", per_cent, 0), |row| {
            interval(&row.upright)
        }),
        (
            measure(
                "converged, %",
                "Of the kicks that touched the ball: run again at a quarter of the step, they led to the same.",
                per_cent,
                0,
            ),
            |row| interval(&row.converged),
        ),
        (measure("ball speed of asked", "Median over valid kicks, with the quartiles.", [0.5, 1.0], 2), |row| {
            let [low, high] = row.speed_ratio_quartiles;
            [row.speed_ratio_median, low, high]
        }),
        (
            measure(
                "direction off, deg",
                "Median of the absolute error of hits, and its 90th percentile.",
                [15.0, 0.0],
                1,
            ),
            |row| [row.direction_error_median_deg, row.direction_error_median_deg, row.direction_error_p90_deg],
        ),
        (measure("time to contact, s", "Median from the request to the contact.", [3.0, 0.8], 2), |row| {
            [row.contact_median_s, None, None]
        }),
        (
            measure(
                "plan, ms",
                "Median, and 99th percentile, of the time that a plan takes on one thread.",
                [100.0, 1.0],
                1,
            ),
            |row| [row.plan_p50_s, row.plan_p50_s, row.plan_p99_s].map(|time| time.map(|s| 1e3 * s)),
        ),
    ]
}

fn matrix(rows: &[Row], shown: &[Shown]) -> Matrix {
    let (mut names, mut columns): (Vec<(&str, &str)>, Vec<&str>) = (Vec::new(), Vec::new());
    for row in rows {
        let (name, column) = ((row.robot.as_str(), row.engine.as_str()), row.scenario.as_str());
        if !names.contains(&name) {
            names.push(name);
        }
        if !columns.contains(&column) {
            columns.push(column);
        }
    }
    names.sort_unstable();
    let readings = measures();
    let cell = |row: &Row| MatrixCell {
        values: readings.iter().map(|(_, read)| read(row)).collect(),
        details: details(row),
        links: shown
            .iter()
            .filter(|s| s.cell == [&row.engine, &row.robot, &row.scenario].map(Clone::clone))
            .map(|s| (s.label.clone(), s.file.clone()))
            .collect(),
    };
    let rows = names.iter().map(|&(robot, engine)| MatrixRow {
        name: format!("{engine} \u{b7} {robot}"),
        cells: columns
            .iter()
            .map(|column| {
                rows.iter().find(|r| r.robot == robot && r.engine == engine && r.scenario == *column).map(cell)
            })
            .collect(),
    });
    Matrix {
        title: "Engines and robots by scenarios".into(),
        rows: rows.collect(),
        columns: columns.iter().map(ToString::to_string).collect(),
        measures: readings.iter().map(|(measure, _)| measure.clone()).collect(),
    }
}

/// All that is known of a row, for people.
fn details(row: &Row) -> Vec<(String, String)> {
    let (head, body) = text_table(std::slice::from_ref(row));
    let cells = body.into_iter().flatten();
    let mut details: Vec<(String, String)> = head.iter().map(ToString::to_string).zip(cells).skip(3).collect();
    details.push(("converged %".into(), percent(&row.converged)));
    if row.refused > 0 {
        let causes = row.refused_why.iter().map(|(cause, count)| format!("{cause} {count}")).collect::<Vec<_>>();
        details.push(("refused".into(), causes.join(", ")));
    }
    if !row.world_changes.is_empty() {
        details.push(("changed world".into(), row.world_changes.iter().cloned().collect::<Vec<_>>().join(", ")));
    }
    details
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

/// The scenarios whose directions are taken in turn: few, so that a plot's legend stays short.
fn swept(sweeps: &[Directions]) -> impl Iterator<Item = &Directions> {
    let taken = |sweep: &&Directions| {
        let asked = &sweep.directions;
        (3..=MOST_DIRECTIONS).contains(&asked.len()) && asked.iter().all(|d| d.asked_deg % 10.0 == 0.0)
    };
    sweeps.iter().filter(taken)
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
