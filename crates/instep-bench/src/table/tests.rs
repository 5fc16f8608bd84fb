//! What a row of the table says of its cells.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::cell::CellKey;

fn kicked(speed: f64, asked: f64, error_deg: f64) -> Kicked {
    Kicked {
        hit: true,
        delivered: false,
        converged: false,
        upright: false,
        ball_speed: Some(speed),
        asked_speed: asked,
        foot_speed: None,
        direction_error: Some(error_deg.to_radians()),
        distance: speed,
        contact: Some(speed),
        audit_invalid: false,
        violations: 2,
        turn: 0.0,
        turn_error: None,
        forecast: None,
        precision: 0.0,
        grounded: 0,
        broken_off: None,
    }
}

fn cell(scenario: &str, seed: u64, outcomes: Vec<Result<Kicked, String>>) -> CellResult {
    let plan_times = (1..=outcomes.len()).map(|i| i as f64 * seed as f64).collect();
    CellResult {
        key: CellKey {
            engine: "dynamic".into(),
            robot: "nao".into(),
            scenario: scenario.into(),
            seed,
            requests: outcomes.len(),
            fingerprint: 0,
        },
        outcomes,
        bounds: Vec::new(),
        asked: Vec::new(),
        plan_times,
        tick_times: [seed as f64, 10.0 * seed as f64],
        world_changes: std::iter::once(format!("changed by {scenario}")).collect(),
    }
}

#[test]
fn rates_are_of_what_they_say_and_refusals_count_by_cause() {
    let good = Kicked { delivered: true, converged: true, upright: true, ..kicked(1.0, 2.0, -4.0) };
    let missed = Kicked {
        hit: false,
        ball_speed: None,
        direction_error: None,
        contact: None,
        upright: true,
        ..kicked(9.0, 2.0, 0.0)
    };
    let invalid =
        Kicked { hit: false, audit_invalid: true, ball_speed: None, direction_error: None, ..kicked(3.0, 2.0, 0.0) };
    let outcomes = vec![
        Ok(good),
        Ok(kicked(2.0, 2.0, 8.0)),
        Ok(missed),
        Ok(invalid),
        Err("too_far".into()),
        Err("too_far".into()),
    ];
    let row = rows(&[cell("straight", 3, outcomes)]).remove(0);
    assert_eq!((row.requests, row.refused, row.refused_why["too_far"]), (6, 2, 2));
    // Accepted and delivered of all, hit and upright of the accepted, converged of those that touched the ball.
    for (rate, share) in [
        (row.accepted, 4.0 / 6.0),
        (row.delivered, 1.0 / 6.0),
        (row.hit, 2.0 / 4.0),
        (row.upright, 2.0 / 4.0),
        (row.converged, 1.0 / 3.0),
    ] {
        assert!((rate.share().unwrap() - share).abs() < 1e-12, "{rate:?} {share}");
    }
    assert_eq!((row.ball_speed_median, row.speed_ratio_median), (Some(1.0), Some(0.5)));
    assert_eq!(row.speed_ratio_quartiles, [Some(0.5), Some(1.0)]);
    let degrees = |value: Option<f64>, right: f64| (value.unwrap() - right).abs() < 1e-9;
    assert!(degrees(row.direction_error_median_deg, 4.0) && degrees(row.direction_error_p90_deg, 8.0), "{row:?}");
    // Of hits alone, and of every contact.
    assert_eq!((row.distance_median, row.contact_median_s), (Some(1.0), Some(2.0)));
    assert_eq!((row.audit_invalid, row.limit_violations), (1, 8));
    assert_eq!((row.plan_p50_s, row.plan_p99_s), (Some(9.0), Some(18.0)));
    assert_eq!((row.tick_p50_s, row.tick_p99_s), (3.0, 30.0));
    assert_eq!(row.seed, SeedName::One(3));
}

#[test]
fn rows_over_seeds_and_the_overview_put_together_what_belongs_together() {
    let one = |scenario, seed, speed| cell(scenario, seed, vec![Ok(kicked(speed, 1.0, 0.0))]);
    let cells = [one("straight", 5, 1.0), one("match", 5, 2.0), one("straight", 4, 3.0)];
    let over = rows_over_seeds(&cells);
    let told: Vec<_> = over.iter().map(|r| (r.scenario.as_str(), r.requests, r.seed_first)).collect();
    assert_eq!(told, [("straight", 2, 4), ("match", 1, 5)]);
    assert_eq!((over[0].ball_speed_median, over[0].tick_p99_s), (Some(1.0), 50.0));
    assert_eq!(over[0].seed, SeedName::All(AllSeeds::All));
    let all = overview(&cells);
    assert_eq!((all.len(), all[0].scenario.as_str(), all[0].requests), (1, "all", 3));
    assert_eq!(all[0].world_changes.len(), 2);
    assert_eq!((SeedName::One(7).to_string(), over[0].seed.to_string()), ("7".into(), "all".into()));
}

#[test]
fn a_rate_is_shown_in_per_cent_with_its_interval() {
    assert_eq!(percent(&NamedRate::of("hit_rate", 9, 10)), "90 (60-98)");
    assert_eq!(percent(&NamedRate::of("hit_rate", 0, 0)), "-");
    let text = overview_markdown(&[cell("straight", 1, vec![Ok(kicked(1.5, 2.0, 3.0)), Err("too_far".into())])]);
    let line = text.lines().nth(2).unwrap();
    assert_eq!(line, "| dynamic | nao | 2 | 50 (9-91) | 100 (21-100) | 0 (0-79) | 0 (0-66) | 0.75 | 3.0/3.0 | 0 |");
    let rows = rows(&[cell("straight", 1, vec![Ok(kicked(1.5, 2.0, 3.0))])]);
    let (head, body) = text_table(&rows);
    assert_eq!(head.len(), body[0].len());
    assert_eq!(body[0][9..], ["1.50 (0.75)", "3.0/3.0", "1.50", "1.50", "1000.0/1000.0", "1000000/10000000", "0", "2"]);
}

#[test]
fn what_a_robot_allows_is_counted_apart_from_what_an_engine_delivers() {
    let delivered = Kicked { delivered: true, ..kicked(1.0, 1.0, 0.0) };
    let outcomes = vec![Ok(delivered), Ok(kicked(1.0, 1.0, 0.0)), Err("too_far".into()), Err("too_fast".into())];
    // The third is just below 0.8 of what was asked, the fourth is out of reach.
    let bounds = vec![Some(2.0), Some(0.8), Some(0.79), None];
    let cell = CellResult { bounds, asked: vec![1.0; 4], ..cell("match", 1, outcomes) };
    let row = &rows(&[cell])[0];
    let share = |rate: &NamedRate| rate.rate.unwrap().share;
    assert_eq!((share(&row.allowed), share(&row.delivered_of_allowed)), (0.5, 0.5));
    assert_eq!(row.bound_ball_speed_median, Some(0.8));
}
