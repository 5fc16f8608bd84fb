//! What a summary says of its cases, and what a kick costs.
#![allow(clippy::unwrap_used)]

use super::*;

fn kicked(distance: f64) -> Kicked {
    Kicked {
        hit: true,
        delivered: true,
        converged: true,
        upright: true,
        ball_speed: Some(2.0 * distance),
        asked_speed: 1.0,
        foot_speed: None,
        direction_error: Some(-0.1 * distance),
        distance,
        contact: Some(3.0 * distance),
        audit_invalid: false,
        violations: 0,
        turn: 0.0,
        turn_error: None,
        forecast: None,
        precision: 0.0,
        grounded: 0,
        broken_off: None,
    }
}

#[test]
fn a_cost_is_the_objective_with_less_for_better() {
    let kick = kicked(0.5);
    for (objective, cost, shown) in [
        (Objective::Distance, -0.5, 0.5),
        (Objective::Speed, -1.0, 1.0),
        (Objective::Accuracy, 0.05f64.to_degrees(), 0.05f64.to_degrees()),
        (Objective::Time, 1.5, 1.5),
    ] {
        assert!((objective.cost(&kick) - cost).abs() < 1e-12, "{objective:?}");
        assert!((objective.shown(objective.cost(&kick)) - shown).abs() < 1e-12, "{objective:?}");
        assert!(objective.penalty() > 5.0 * cost.abs(), "{objective:?}");
    }
    let missed = Kicked { ball_speed: None, direction_error: None, contact: None, ..kick };
    for objective in [Objective::Speed, Objective::Accuracy, Objective::Time] {
        assert!(objective.cost(&missed).is_nan(), "{objective:?}");
    }
}

#[test]
fn a_summary_counts_each_case_where_it_belongs() {
    let outcomes = [
        (Ok(kicked(1.0)), -1.0),
        (Ok(kicked(2.0)), -2.0),
        (Ok(kicked(6.0)), -6.0),
        (Ok(Kicked { upright: false, ..kicked(9.0) }), 10.0),
        (Ok(Kicked { hit: false, ..kicked(9.0) }), 10.0),
        (Ok(Kicked { hit: false, audit_invalid: true, upright: false, ..kicked(9.0) }), 11.0),
        (Err("too_far".to_owned()), 15.0),
        (Err("too_fast".to_owned()), 15.0),
    ];
    let tried = outcomes.map(|(outcome, cost)| Tried { outcome, cost });
    let summary = Summary::new(Objective::Distance, &tried);
    assert_eq!((summary.cases, summary.good, summary.refused), (8, 3, 2));
    assert_eq!((summary.missed, summary.fell, summary.invalid), (1, 2, 1));
    assert_eq!((summary.cost, summary.objective, summary.median), (6.5, Some(3.0), Some(2.0)));
    // Of the six that were accepted four stood.
    assert!((summary.upright().unwrap() - 4.0 / 6.0).abs() < 1e-12);
    assert_eq!(summary.causes(), "2 refused, 1 missed, 2 fell, 1 failed the audit");
    let refused = Summary::new(Objective::Distance, &tried[6..]);
    assert_eq!((refused.upright(), refused.objective, refused.median), (None, None, None));
}
