//! Splines meet their constraints, for any of them.

use instep_motion::spline::{Cubic, CubicSpline, Ends, Quintic, QuinticSpline, State, ViaPoint};
use proptest::prelude::*;

const EPS: f64 = 1e-9;

fn close(a: [f64; 2], b: [f64; 2]) -> bool {
    a.iter().zip(&b).all(|(a, b)| (a - b).abs() <= EPS * (1.0 + a.abs().max(b.abs())))
}

fn pair() -> impl Strategy<Value = [f64; 2]> {
    [-10.0..10.0, -10.0..10.0]
}

fn state() -> impl Strategy<Value = State<2>> {
    (pair(), pair(), pair()).prop_map(|(position, velocity, acceleration)| State { position, velocity, acceleration })
}

/// Durations from a control tick's tens to seconds.
fn span() -> impl Strategy<Value = f64> {
    0.2..3.0
}

proptest! {
    #[test]
    fn cubic_meets_both_ends(t in span(), p0 in pair(), v0 in pair(), p1 in pair(), v1 in pair()) {
        let cubic = Cubic::between(t, (p0, v0), (p1, v1)).unwrap();
        prop_assert!(close(cubic.position(0.0), p0) && close(cubic.velocity(0.0), v0));
        prop_assert!(close(cubic.position(t), p1) && close(cubic.velocity(t), v1));
        prop_assert!(close(cubic.position(t + 1.0), p1) && close(cubic.position(-1.0), p0));
    }

    #[test]
    fn quintic_meets_both_ends(t in span(), a in state(), b in state()) {
        let quintic = Quintic::between(t, &a, &b).unwrap();
        for (time, want) in [(0.0, a), (t, b)] {
            prop_assert!(close(quintic.position(time), want.position));
            prop_assert!(close(quintic.velocity(time), want.velocity));
            prop_assert!(close(quintic.acceleration(time), want.acceleration));
        }
    }

    #[test]
    fn via_point_meets_the_eight_constraints(
        start in pair(), via in pair(), end in pair(), v in pair(), t1 in span(), t2 in span(),
    ) {
        let curve = ViaPoint::new(start, (t1, via), (t2, end), v).unwrap();
        prop_assert!(close(curve.position(0.0), start) && close(curve.velocity(0.0), [0.0; 2]));
        prop_assert!(close(curve.position(t1), via));
        prop_assert!(close(curve.position(t1 + t2), end) && close(curve.velocity(t1 + t2), v));
        // The same from the left: the first cubic alone, reached by a time just below.
        let before = f64::from_bits(t1.to_bits() - 1);
        prop_assert!(close(curve.position(before), via));
        prop_assert!(close(curve.velocity(before), curve.velocity(t1)));
        prop_assert!(close(curve.acceleration(before), curve.acceleration(t1)));
    }

    #[test]
    fn cubic_spline_is_c2_through_its_knots(
        points in prop::collection::vec((span(), pair()), 2..9), v0 in pair(), v1 in pair(), clamped in any::<bool>(),
    ) {
        let mut t = -1.0;
        let knots: Vec<_> = points.iter().map(|(dt, p)| { t += dt; (t, *p) }).collect();
        let ends = if clamped { Ends::Clamped(v0, v1) } else { Ends::Natural };
        let spline = CubicSpline::through(&knots, ends).unwrap();
        for (t, p) in &knots {
            prop_assert!(close(spline.position(*t), *p));
        }
        for (t, _) in &knots[1..knots.len() - 1] {
            // A step so short that the third derivative cannot show at this accuracy.
            let before = t - 1e-13;
            prop_assert!(close(spline.velocity(before), spline.velocity(*t)));
            prop_assert!(close(spline.acceleration(before), spline.acceleration(*t)));
        }
        let (first, last) = (knots[0].0, knots[knots.len() - 1].0);
        if clamped {
            prop_assert!(close(spline.velocity(first), v0) && close(spline.velocity(last), v1));
        } else {
            prop_assert!(close(spline.acceleration(first), [0.0; 2]) && close(spline.acceleration(last), [0.0; 2]));
        }
    }

    #[test]
    fn quintic_spline_meets_every_knot(points in prop::collection::vec((span(), state()), 2..6)) {
        let mut t = 0.5;
        let knots: Vec<_> = points.iter().map(|(dt, s)| { t += dt; (t, *s) }).collect();
        let spline = QuinticSpline::through(&knots).unwrap();
        for (t, s) in &knots {
            prop_assert!(close(spline.position(*t), s.position));
            prop_assert!(close(spline.velocity(*t), s.velocity));
            prop_assert!(close(spline.acceleration(*t), s.acceleration));
        }
    }

    #[test]
    fn derivatives_are_derivatives(t in span(), a in state(), b in state(), s in 0.1..0.9_f64) {
        let quintic = Quintic::between(t, &a, &b).unwrap();
        let (at, h) = (s * t, 1e-5);
        let (p, q) = (quintic.position(at + h), quintic.position(at - h));
        let v = quintic.velocity(at);
        for i in 0..2 {
            prop_assert!(((p[i] - q[i]) / (2.0 * h) - v[i]).abs() < 1e-4 * (1.0 + v[i].abs()));
        }
    }
}

#[test]
fn a_cubic_is_reproduced_by_the_clamped_spline() {
    let f = |t: f64| [t * t * t - 2.0 * t, 1.0 - t * t];
    let v = |t: f64| [3.0 * t * t - 2.0, -2.0 * t];
    let knots: Vec<_> = [-1.0, 0.3, 0.5, 2.0].map(|t| (t, f(t))).into();
    let spline = CubicSpline::through(&knots, Ends::Clamped(v(-1.0), v(2.0))).unwrap();
    for i in 0..=30 {
        let t = -1.0 + 0.1 * f64::from(i);
        assert!(close(spline.position(t), f(t)) && close(spline.velocity(t), v(t)), "{t}");
    }
}

/// Paper 5's system (12), its second right-hand side mended, solved by an independent method.
#[test]
fn via_point_solves_the_mended_system_of_paper_5() {
    let (t1, t2, start, via, end) = (0.4, 0.7, -0.1, 0.05, 0.12);
    #[rustfmt::skip]
    let m = nalgebra::Matrix5::new(
        1.0, t1, 0.0, 0.0, 0.0,
        0.0, 0.0, 1.0, t2, t2 * t2,
        0.0, 0.0, 1.0, 2.0 * t2, 3.0 * t2 * t2,
        2.0 * t1, 3.0 * t1 * t1, -1.0, 0.0, 0.0,
        2.0, 6.0 * t1, 0.0, -2.0, 0.0,
    );
    let right = nalgebra::Vector5::new((via - start) / (t1 * t1), (end - via) / t2, 0.0, 0.0, 0.0);
    let a = m.lu().solve(&right).unwrap();
    let curve = ViaPoint::new([start], (t1, [via]), (t2, [end]), [0.0]).unwrap();
    for i in 0..=20 {
        let (s, t) = (t1 * f64::from(i) / 20.0, t2 * f64::from(i) / 20.0);
        let first = start + a[0] * s * s + a[1] * s * s * s;
        let second = via + a[2] * t + a[3] * t * t + a[4] * t * t * t;
        assert!((curve.position(s)[0] - first).abs() < 1e-12);
        assert!((curve.position(t1 + t)[0] - second).abs() < 1e-12);
    }
}

#[test]
fn spans_that_are_not_positive_are_refused() {
    for t in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(Cubic::between(t, ([0.0], [0.0]), ([1.0], [0.0])).is_err());
        assert!(Quintic::between(t, &State::at_rest([0.0]), &State::at_rest([1.0])).is_err());
        assert!(ViaPoint::new([0.0], (t, [1.0]), (1.0, [2.0]), [0.0]).is_err());
        assert!(CubicSpline::through(&[(0.0, [0.0]), (t, [1.0])], Ends::Natural).is_err());
    }
    assert!(CubicSpline::through(&[(0.0, [0.0])], Ends::Natural).is_err());
}
