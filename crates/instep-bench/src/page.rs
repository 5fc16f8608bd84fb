//! The benchmark's HTML page.

use instep_report::{Cell, Column, Report, SummaryItem, Table, Verdict};

use crate::table::{Row, text_table};

/// One page for the table; `notes` stand at its end.
#[must_use]
pub fn page(rows: &[Row], notes: Vec<String>) -> Report {
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
        ],
        notes,
        ..Report::default()
    }
}
