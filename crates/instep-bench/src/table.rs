//! From cells to the table: one row a cell, or one row for all seeds of a cell, as Markdown, CSV and JSON.

use std::collections::{BTreeMap, BTreeSet};

use instep_sim::NamedRate;
use serde::Serialize;

use crate::cell::{CellResult, DELIVERED_SPEED, Kicked};

/// One row. The names of the fields are KickBench's file format. Each rate is three keys, `…_low` and `…_high` being its 95 %
/// interval (Wilson).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Engine.
    pub engine: String,
    /// Robot.
    pub robot: String,
    /// Scenario.
    pub scenario: String,
    /// Seed, or "all".
    pub seed: SeedName,
    /// The first seed of all.
    pub seed_first: u64,
    /// How many requests.
    pub requests: usize,
    /// How many were refused.
    pub refused: usize,
    /// Why: the cause's name and how often.
    pub refused_why: BTreeMap<String, usize>,
    /// Accepted over all requests.
    #[serde(flatten)]
    pub accepted: NamedRate,
    /// Hits over accepted requests; null when none was accepted.
    #[serde(flatten)]
    pub hit: NamedRate,
    /// Kicks that ended standing over accepted requests.
    #[serde(flatten)]
    pub upright: NamedRate,
    /// Kicks that were what had been asked over all requests.
    #[serde(flatten)]
    pub delivered: NamedRate,
    /// Requests that the robot's geometry and joint speeds allow, over all; null where kicks do not start from the stand.
    #[serde(flatten)]
    pub allowed: NamedRate,
    /// Kicks that were what had been asked over those requests.
    #[serde(flatten)]
    pub delivered_of_allowed: NamedRate,
    /// Median of the fastest balls that they allow, m/s.
    pub bound_ball_speed_median: Option<f64>,
    /// Kicks that touched the ball and whose re-run at a quarter of the step led to the same, over those that touched it.
    #[serde(flatten)]
    pub converged: NamedRate,
    /// Median of the audited ball speeds, m/s.
    pub ball_speed_median: Option<f64>,
    /// Median of the audited ball speeds over the asked ones.
    pub speed_ratio_median: Option<f64>,
    /// Median speed of the striking point just before the contact, m/s; and the least.
    pub foot_speed_median: Option<f64>,
    /// See `foot_speed_median`.
    pub foot_speed_min: Option<f64>,
    /// Median of the absolute direction error of hits, deg.
    pub direction_error_median_deg: Option<f64>,
    /// 90th percentile of the same, deg.
    pub direction_error_p90_deg: Option<f64>,
    /// The greatest, deg.
    pub direction_error_max_deg: Option<f64>,
    /// Median distance that the ball rolls, m.
    pub distance_median: Option<f64>,
    /// Quartiles of the audited ball speeds over the asked ones.
    pub speed_ratio_quartiles: [Option<f64>; 2],
    /// Median time from the request to the contact, s.
    pub contact_median_s: Option<f64>,
    /// Median time of a plan, s.
    pub plan_p50_s: Option<f64>,
    /// 99th percentile of the time of a plan, s.
    pub plan_p99_s: Option<f64>,
    /// Median time of a tick, s (of the slowest cell).
    pub tick_p50_s: f64,
    /// 99th percentile of the time of a tick, s (of the slowest cell).
    pub tick_p99_s: f64,
    /// Kicks that touched the ball and failed the audit.
    pub audit_invalid: usize,
    /// Joints beyond torque or speed limits, over all trials.
    pub limit_violations: usize,
    /// The constants in which the worlds of its trials were not the robot's default one.
    pub world_changes: BTreeSet<String>,
}

/// A seed, or all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub enum SeedName {
    /// One seed.
    One(u64),
    /// All seeds together.
    All(AllSeeds),
}

/// Serialised as "all".
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum AllSeeds {
    /// All seeds.
    #[serde(rename = "all")]
    All,
}

impl std::fmt::Display for SeedName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::One(seed) => write!(f, "{seed}"),
            Self::All(_) => f.write_str("all"),
        }
    }
}

/// The `share` quantile by the nearest rank.
#[must_use]
pub fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    values.retain(|v| v.is_finite());
    values.sort_by(f64::total_cmp);
    let rank = (share * values.len() as f64).ceil().max(1.0) as usize;
    values.get(rank - 1).copied()
}

/// One row a cell.
#[must_use]
pub fn rows(cells: &[CellResult]) -> Vec<Row> {
    cells.iter().map(|cell| row(&[cell], SeedName::One(cell.key.seed))).collect()
}

/// One row for all seeds of the same engine, robot and scenario, in the cells' order.
#[must_use]
pub fn rows_over_seeds(cells: &[CellResult]) -> Vec<Row> {
    let key = |cell: &CellResult| (cell.key.engine.clone(), cell.key.robot.clone(), cell.key.scenario.clone());
    groups(cells, key).iter().map(|group| row(group, SeedName::All(AllSeeds::All))).collect()
}

/// One row for all scenarios and seeds of the same engine and robot: the scenario's name is "all".
#[must_use]
pub fn overview(cells: &[CellResult]) -> Vec<Row> {
    let key = |cell: &CellResult| (cell.key.engine.clone(), cell.key.robot.clone());
    let all = |group: &Vec<&CellResult>| Row { scenario: "all".into(), ..row(group, SeedName::All(AllSeeds::All)) };
    groups(cells, key).iter().map(all).collect()
}

/// Cells with the same key together, in the order of their first ones.
fn groups<K: PartialEq>(cells: &[CellResult], key: impl Fn(&CellResult) -> K) -> Vec<Vec<&CellResult>> {
    let mut groups: Vec<Vec<&CellResult>> = Vec::new();
    for cell in cells {
        match groups.iter_mut().find(|group| key(group[0]) == key(cell)) {
            Some(group) => group.push(cell),
            None => groups.push(vec![cell]),
        }
    }
    groups
}

fn row(cells: &[&CellResult], seed: SeedName) -> Row {
    let first = &cells[0].key;
    let outcomes = || cells.iter().flat_map(|cell| &cell.outcomes);
    let kicked: Vec<&Kicked> = outcomes().filter_map(|outcome| outcome.as_ref().ok()).collect();
    let mut refused_why = BTreeMap::new();
    for name in outcomes().filter_map(|outcome| outcome.as_ref().err()) {
        *refused_why.entry(name.clone()).or_insert(0) += 1;
    }
    let requests = outcomes().count();
    let bounds = || cells.iter().flat_map(|cell| cell.outcomes.iter().zip(&cell.bounds).zip(&cell.asked));
    let judged = bounds().count();
    let possible = bounds().filter(|((_, bound), asked)| bound.is_some_and(|bound| bound >= DELIVERED_SPEED * **asked));
    let possible: Vec<_> =
        possible.map(|((outcome, _), _)| outcome.as_ref().is_ok_and(|kick| kick.delivered)).collect();
    let delivered_of = possible.iter().filter(|delivered| **delivered).count();
    let count = |good: fn(&Kicked) -> bool| kicked.iter().filter(|kick| good(kick)).count();
    let touched = count(|kick| kick.contact.is_some());
    let of = |value: fn(&Kicked) -> Option<f64>, share: f64| {
        quantile(kicked.iter().filter_map(|k| value(k)).collect(), share)
    };
    let ratio = |k: &Kicked| k.ball_speed.map(|v| v / k.asked_speed);
    let error = |k: &Kicked| k.direction_error.map(|e| e.to_degrees().abs());
    let plans = |share: f64| quantile(cells.iter().flat_map(|c| c.plan_times.iter().copied()).collect(), share);
    let tick = |i: usize| cells.iter().map(|cell| cell.tick_times[i]).fold(0.0, f64::max);
    Row {
        engine: first.engine.clone(),
        robot: first.robot.clone(),
        scenario: first.scenario.clone(),
        seed,
        seed_first: cells.iter().map(|cell| cell.key.seed).min().unwrap_or(0),
        requests,
        refused: requests - kicked.len(),
        refused_why,
        accepted: NamedRate::of("accepted_rate", kicked.len(), requests),
        hit: NamedRate::of("hit_rate", count(|kick| kick.hit), kicked.len()),
        upright: NamedRate::of("upright_rate", count(|kick| kick.upright), kicked.len()),
        delivered: NamedRate::of("delivered_rate", count(|kick| kick.delivered), requests),
        allowed: NamedRate::of("allowed_rate", possible.len(), judged),
        delivered_of_allowed: NamedRate::of("delivered_of_allowed_rate", delivered_of, possible.len()),
        bound_ball_speed_median: quantile(bounds().filter_map(|((_, bound), _)| *bound).collect(), 0.5),
        converged: NamedRate::of("converged_rate", count(|kick| kick.converged), touched),
        ball_speed_median: of(|k| k.ball_speed, 0.5),
        speed_ratio_median: of(ratio, 0.5),
        speed_ratio_quartiles: [of(ratio, 0.25), of(ratio, 0.75)],
        foot_speed_median: of(|k| k.foot_speed, 0.5),
        foot_speed_min: of(|k| k.foot_speed, 0.0),
        direction_error_median_deg: of(error, 0.5),
        direction_error_p90_deg: of(error, 0.9),
        direction_error_max_deg: of(error, 1.0),
        distance_median: of(|k| k.hit.then_some(k.distance), 0.5),
        contact_median_s: of(|k| k.contact, 0.5),
        plan_p50_s: plans(0.5),
        plan_p99_s: plans(0.99),
        tick_p50_s: tick(0),
        tick_p99_s: tick(1),
        audit_invalid: kicked.iter().filter(|k| k.audit_invalid).count(),
        limit_violations: kicked.iter().map(|k| k.violations).sum(),
        world_changes: cells.iter().flat_map(|cell| cell.world_changes.iter().cloned()).collect(),
    }
}

/// A rate in per cent with its interval: "93 (84-97)".
#[must_use]
pub fn percent(rate: &NamedRate) -> String {
    rate.rate.map_or_else(
        || "-".to_owned(),
        |r| format!("{:.0} ({:.0}-{:.0})", 100.0 * r.share, 100.0 * r.low, 100.0 * r.high),
    )
}

/// The table with one line for each engine and robot.
#[must_use]
pub fn overview_markdown(cells: &[CellResult]) -> String {
    let head = [
        "engine",
        "robot",
        "requests",
        "accepted %",
        "hit %",
        "upright %",
        "delivered %",
        "ball speed of asked",
        "off deg p50/p90",
        "audit failed",
    ];
    let number = |value: Option<f64>, digits: usize| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.digits$}"));
    let mut text = format!("| {} |\n|{}\n", head.join(" | "), "---|".repeat(head.len()));
    for r in overview(cells) {
        let line = [
            r.engine.clone(),
            r.robot.clone(),
            r.requests.to_string(),
            percent(&r.accepted),
            percent(&r.hit),
            percent(&r.upright),
            percent(&r.delivered),
            number(r.speed_ratio_median, 2),
            format!("{}/{}", number(r.direction_error_median_deg, 1), number(r.direction_error_p90_deg, 1)),
            r.audit_invalid.to_string(),
        ];
        text += &format!("| {} |\n", line.join(" | "));
    }
    text
}

/// Headings and cells of the table for people; which seed a row is of stands only in CSV and JSON.
#[must_use]
pub fn text_table(rows: &[Row]) -> (Vec<&'static str>, Vec<Vec<String>>) {
    let head = vec![
        "engine",
        "robot",
        "scenario",
        "requests",
        "accepted %",
        "hit %",
        "upright %",
        "delivered %",
        "of allowed %",
        "ball m/s (of asked)",
        "off deg p50/p90",
        "rolled m",
        "contact s",
        "plan ms p50/p99",
        "tick us p50/p99",
        "audit failed",
        "beyond limits",
    ];
    let number = |value: Option<f64>, factor: f64, digits: usize| {
        value.map_or_else(|| "-".to_owned(), |v| format!("{:.digits$}", v * factor))
    };
    let pair = |a: Option<f64>, b: Option<f64>, factor: f64, digits: usize| {
        format!("{}/{}", number(a, factor, digits), number(b, factor, digits))
    };
    let body = rows
        .iter()
        .map(|r| {
            vec![
                r.engine.clone(),
                r.robot.clone(),
                r.scenario.clone(),
                r.requests.to_string(),
                percent(&r.accepted),
                percent(&r.hit),
                percent(&r.upright),
                percent(&r.delivered),
                percent(&r.delivered_of_allowed),
                format!("{} ({})", number(r.ball_speed_median, 1.0, 2), number(r.speed_ratio_median, 1.0, 2)),
                pair(r.direction_error_median_deg, r.direction_error_p90_deg, 1.0, 1),
                number(r.distance_median, 1.0, 2),
                number(r.contact_median_s, 1.0, 2),
                pair(r.plan_p50_s, r.plan_p99_s, 1e3, 1),
                pair(Some(r.tick_p50_s), Some(r.tick_p99_s), 1e6, 0),
                r.audit_invalid.to_string(),
                r.limit_violations.to_string(),
            ]
        })
        .collect();
    (head, body)
}

/// The table as Markdown.
#[must_use]
pub fn markdown(rows: &[Row]) -> String {
    let (head, body) = text_table(rows);
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let mut text = line(&head.iter().map(ToString::to_string).collect::<Vec<_>>());
    text += &format!("|{}\n", "---|".repeat(head.len()));
    body.iter().for_each(|cells| text += &line(cells));
    text
}

/// The table as comma-separated values, with full precision.
#[must_use]
pub fn csv(rows: &[Row]) -> String {
    let mut text = String::new();
    for (i, row) in rows.iter().enumerate() {
        let Ok(serde_json::Value::Object(fields)) = serde_json::to_value(row) else { continue };
        if i == 0 {
            text += &fields.keys().cloned().collect::<Vec<_>>().join(",");
            text.push('\n');
        }
        let cells = fields.values().map(|value| match value {
            serde_json::Value::Null => String::new(),
            serde_json::Value::String(text) => text.clone(),
            serde_json::Value::Array(list) => list.iter().map(ToString::to_string).collect::<Vec<_>>().join(" "),
            serde_json::Value::Object(map) => map.iter().map(|(k, v)| format!("{k}:{v}")).collect::<Vec<_>>().join(" "),
            other => other.to_string(),
        });
        text += &cells.collect::<Vec<_>>().join(",");
        text.push('\n');
    }
    text
}

/// The table as a JSON object: `rows` hold one object for each engine, robot and scenario, `seeds` one for each seed of those.
#[must_use]
pub fn json(cells: &[CellResult]) -> serde_json::Value {
    serde_json::json!({ "rows": rows_over_seeds(cells), "seeds": rows(cells) })
}

#[cfg(test)]
mod tests;
