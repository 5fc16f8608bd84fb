//! What the summary says of its trials.
#![allow(clippy::unwrap_used)]

use super::*;

fn tried(speed: Option<f64>, direction: Option<f64>, link_error: f64) -> Tried {
    Tried {
        seed: 1,
        completed: false,
        link_error,
        hit: false,
        converged: false,
        ball_speed: speed,
        direction_error_deg: direction,
        upright: false,
        fell_at: None,
        audit_invalid: false,
        limit_violations: 2,
        torque_reversals: 0.0,
        beyond: vec![],
    }
}

#[test]
fn rates_medians_and_spread_are_over_all_trials() {
    let each = vec![
        Tried { completed: true, upright: true, hit: true, converged: true, ..tried(Some(10.0), Some(-4.0), 0.1) },
        Tried { upright: true, hit: true, ..tried(Some(12.0), Some(1.0), 0.2) },
        Tried { upright: true, audit_invalid: true, ..tried(None, None, 0.3) },
        tried(Some(11.0), Some(2.0), 0.6),
    ];
    let found = summary(each);
    assert_eq!(found.trials, 4);
    for (rate, share) in [(found.completed, 0.25), (found.upright, 0.75), (found.hit, 0.5), (found.converged, 0.25)] {
        assert_eq!(rate.share(), Some(share), "{rate:?}");
    }
    assert!((found.link_error_mean - 0.3).abs() < 1e-12);
    // Of the trials: sqrt((0.04 + 0.01 + 0 + 0.09) / 4).
    assert!((found.link_error_deviation - 0.035f64.sqrt()).abs() < 1e-12, "{}", found.link_error_deviation);
    assert_eq!((found.ball_speed_median, found.direction_error_median_deg), (Some(11.0), Some(2.0)));
    assert_eq!((found.audit_invalid, found.limit_violations), (1, 8));
    let json = serde_json::to_value(&found).unwrap();
    for key in ["completed_rate", "upright_rate", "hit_rate", "converged_rate"] {
        for end in ["", "_low", "_high"] {
            assert!(json[format!("{key}{end}")].is_number(), "{key}{end}");
        }
    }
}

#[test]
fn the_median_of_an_even_number_lies_between_the_middle_two() {
    assert_eq!(median([3.0, 1.0, 2.0].into_iter()), Some(2.0));
    assert_eq!(median([4.0, 1.0, 3.0, 2.0].into_iter()), Some(2.5));
    assert_eq!(median(std::iter::empty()), None);
}

#[test]
fn each_trial_has_its_seed_and_where_they_are_spread_its_start() {
    let all = Evaluation { trials: 4, seed: 10, start: 0.1, ..Evaluation::default() };
    let third = all.single(2, 1.1, 0.02);
    assert_eq!((third.trials, third.seed, third.start, third.spread), (1, 12, 0.1, false));
    let spread = Evaluation { spread: true, ..all };
    let starts: Vec<f64> = (0..4).map(|index| spread.single(index, 1.1, 0.02).start).collect();
    // A quarter of the second that is left each, at whole control periods.
    for (start, right) in starts.iter().zip([0.1, 0.34, 0.6, 0.84]) {
        assert!((start - right).abs() < 1e-9, "{starts:?}");
    }
}
