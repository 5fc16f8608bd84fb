//! The closed loop: PID on the centre of pressure, separately in x and y, with anti-windup (paper 2, section 3.5), and
//! damping by the inertial sensor (its section 6).
//!
//! The paper's error is the distance of the centre of pressure from the middle of the foot; ours is that from the
//! planned one, which is the same at rest and right when the body accelerates. The output shifts the wanted centre of
//! mass against the error. The inertial sensor's tilt and rate become a moment at the support ankle. Readings that
//! are not finite are left out.

use nalgebra::Vector3;

use crate::whole_body::{Feedback, Pid};

/// One PID controller with clamped output and conditional integration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PidState {
    gains: Pid,
    integral: f64,
    last: Option<f64>,
}

impl PidState {
    pub(crate) fn new(gains: Pid) -> Self {
        Self { gains, integral: 0.0, last: None }
    }

    /// The output for `error` after `dt` (s).
    pub(crate) fn step(&mut self, error: f64, dt: f64) -> f64 {
        let g = self.gains;
        let rate = self.last.map_or(0.0, |last| (error - last) / dt);
        self.last = Some(error);
        let integral = self.integral + error * dt;
        let free = g.p * error + g.i * integral + g.d * rate;
        let output = free.clamp(-g.limit, g.limit);
        // Anti-windup: the integral grows only while the output is free or the error brings it back.
        if free == output || (free > output) != (error > 0.0) {
            self.integral = integral;
        }
        output
    }

    /// Lets the output fade while there is nothing to control.
    fn fade(&mut self, share: f64) -> f64 {
        self.integral *= share;
        self.last = None;
        (self.gains.i * self.integral).clamp(-self.gains.limit, self.gains.limit)
    }
}

/// The state of the loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Balance {
    settings: Feedback,
    x: PidState,
    y: PidState,
    /// First and second stage of the low-pass on the output.
    first: [f64; 2],
    shift: [f64; 2],
}

impl Balance {
    pub(crate) fn new(settings: Feedback) -> Self {
        let (x, y) = (PidState::new(settings.x), PidState::new(settings.y));
        Self { settings, x, y, first: [0.0; 2], shift: [0.0; 2] }
    }

    /// The same without memory.
    pub(crate) fn fresh(&self) -> Self {
        Self::new(self.settings)
    }

    /// Shift of the centre of mass, m, from the measured and the planned centre of pressure in the support sole's frame.
    /// `active`: a kick is under way; `steady`: the support foot stands flat.
    pub(crate) fn shift(
        &mut self,
        measured: Option<[f64; 2]>,
        planned: [f64; 2],
        (active, steady): (bool, bool),
        dt: f64,
    ) -> [f64; 2] {
        if !self.settings.on {
            return [0.0; 2];
        }
        let measured = measured.filter(|m| active && m.iter().chain(&planned).all(|v| v.is_finite()));
        let wanted = match measured {
            // While the foot rocks on an edge its centre of pressure says nothing of the body's place.
            Some(_) if !steady => self.first,
            Some(measured) => [-self.x.step(measured[0] - planned[0], dt), -self.y.step(measured[1] - planned[1], dt)],
            // Nothing to control: the integral fades within about a third of a second.
            None => {
                let share = (1.0 - 3.0 * dt).max(0.0);
                [-self.x.fade(share), -self.y.fade(share)]
            }
        };
        // To move the centre of mass one way, the centre of pressure must first go the other way by (h / g) times the
        // acceleration: without two poles here the loop would shake itself.
        let share = dt / (self.settings.filter + dt);
        for ((first, shift), wanted) in self.first.iter_mut().zip(&mut self.shift).zip(wanted) {
            *first += share * (wanted - *first);
            *shift += share * (*first - *shift);
        }
        self.shift
    }

    /// Moment on the body in the base frame, N m, against a tilt (rotation vector, rad) and a rate (rad/s), both in the
    /// base frame; `mgh` in N m; `limits` are the largest moments about x and y, N m.
    pub(crate) fn moment(&self, tilt: &Vector3<f64>, rate: &Vector3<f64>, mgh: f64, limits: [f64; 2]) -> Vector3<f64> {
        let s = &self.settings;
        if !s.on {
            return Vector3::zeros();
        }
        let wanted = -(tilt * s.tilt + rate * s.rate) * mgh;
        if !(wanted.x + wanted.y).is_finite() {
            return Vector3::zeros();
        }
        let [x, y] = limits.map(|limit| limit * s.moment);
        Vector3::new(wanted.x.clamp(-x, x), wanted.y.clamp(-y, y), 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_integral_stops_at_the_limit_and_comes_back_at_once() {
        let mut pid = PidState::new(Pid { p: 0.0, i: 1.0, d: 0.0, limit: 0.01 });
        for _ in 0..1000 {
            assert!(pid.step(0.05, 0.01) <= 0.01);
        }
        // Without anti-windup the integral would be 0.5 and need ten seconds to come back.
        let mut steps = 0;
        while pid.step(-0.05, 0.01) > 0.0 {
            steps += 1;
        }
        assert!(steps < 30, "{steps}");
    }

    #[test]
    fn each_gain_acts_with_its_own_sign() {
        let out = |p: f64, i: f64, d: f64| {
            let mut pid = PidState::new(Pid { p, i, d, limit: 1.0 });
            pid.step(0.01, 0.01);
            pid.step(0.03, 0.01)
        };
        // Error 0.03, its integral 0.0004, its rate 2: an error that grows is answered with more, not with less.
        assert!((out(0.5, 0.0, 0.0) - 0.015).abs() < 1e-12);
        assert!((out(0.0, 50.0, 0.0) - 0.02).abs() < 1e-12);
        assert!((out(0.0, 0.0, 0.1) - 0.2).abs() < 1e-12);
    }

    #[test]
    fn a_lean_forward_moves_the_body_back() {
        let pid = Pid { p: 0.3, i: 0.5, d: 0.0, limit: 0.02 };
        let on = Feedback {
            on: true,
            x: pid,
            y: pid,
            filter: 0.0,
            tilt: 1.0,
            rate: 0.1,
            moment: 0.5,
            catch: 0.1,
            follow_ball: false,
        };
        let mut balance = Balance::new(on);
        let shift = balance.shift(Some([0.02, -0.01]), [0.0, 0.0], (true, true), 0.01);
        assert!(shift[0] < 0.0 && shift[1] > 0.0);
        assert_eq!(
            Balance::new(Feedback { on: false, ..on }).shift(Some([0.02, 0.0]), [0.0; 2], (true, true), 0.01),
            [0.0; 2]
        );
        let nan = balance.shift(Some([f64::NAN, 0.0]), [0.0; 2], (true, true), 0.01);
        assert!(nan.iter().all(|s| s.is_finite()));
    }
}
