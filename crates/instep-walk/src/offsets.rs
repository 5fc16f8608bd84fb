//! What the pendulum leaves out, learned from step to step: offset-free footholds.
//!
//! The pendulum says p' = w and w' = lambda^2 p ([`crate::footsteps`]). A robot whose inertial sensor is tilted, whose trunk leans, whose
//! swing leg weighs something, or that walks up a slope obeys p' = w - xi, w' = lambda^2 (p + delta) instead, with offsets
//! that hardly change from one step to the next; its feet do not come down quite where they were sent, and under a long foot the centre of
//! pressure wanders. In p + delta and w - xi it is nearly the same pendulum; what is left is how far a step's end is from where it was to be,
//! and how far its mean velocity is from the one that belongs to that end. Planning with these needs no integrator on the speed, which
//! would wind up: the offsets are means over two finished steps, followed slowly and within limits.
//!
//! Source: own; the idea is that of offset-free predictive control (Pannocchia, Rawlings, Disturbance models for offset-free
//! model-predictive control, AIChE Journal 49, 2003). Knows nothing of what a disturbance lasts: a push counts as a part of what it did.

use nalgebra::{Rotation2, Vector2};

use crate::footsteps::PendulumState;

/// Share of what a step shows that is learned from it.
const SHARE: f64 = 0.35;
/// Most that two steps may differ from what is known, and most that is learned altogether, as shares of the pendulum's length (delta)
/// and of its speed sqrt(g H) (xi, touchdown).
const MOST: [f64; 2] = [0.05, 0.12];

/// Least and greatest time of a step that is believed, as shares of the planned one.
const TIME: [f64; 2] = [0.7, 1.2];

/// The offsets, in the heading's axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Offsets {
    /// delta: what is to be added to the place of the centre of mass from the contact, m.
    pub position: Vector2<f64>,
    /// xi: what is to be taken from the momentum, m/s; beyond what is fed forward.
    pub momentum: Vector2<f64>,
    /// What touchdown and step add to the momentum at the end of the step, over its growth: m/s.
    pub touchdown: Vector2<f64>,
    /// How much faster the pendulum walks than the robot, by the momentum at the end of a step, m/s.
    pub speed: Vector2<f64>,
    /// How long a step really takes, s: a foot that comes down early takes its way in less time.
    pub step_time: f64,
}

/// Learns [`Offsets`] while the robot steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Learner {
    /// Known so far.
    pub offsets: Offsets,
    lambda: f64,
    step_time: f64,
    /// Of the present step: first and last state with their times, sums over time of position and momentum.
    first: Option<(f64, PendulumState)>,
    last: (f64, PendulumState),
    sums: PendulumState,
    /// Momentum that the next step is to end with as far as the pendulum knows, and the heading in whose axes all of this is, rad.
    planned: (Vector2<f64>, f64),
    /// The same of the present step, planned at the end of the last one.
    expected: Option<(Vector2<f64>, f64)>,
    /// xi fed forward over the step, m/s.
    fed: Vector2<f64>,
    /// What the step before showed: left and right differ, and only their mean drives the gait away.
    before: Option<Offsets>,
}

impl Learner {
    /// For a pendulum with `lambda` (1/s) that steps every `step_time` (s).
    #[must_use]
    pub fn new(lambda: f64, step_time: f64) -> Self {
        let zero = PendulumState { position: Vector2::zeros(), momentum: Vector2::zeros() };
        Self {
            offsets: Offsets {
                position: zero.position,
                momentum: zero.momentum,
                touchdown: zero.momentum,
                speed: zero.momentum,
                step_time,
            },
            lambda,
            step_time,
            first: None,
            last: (0.0, zero),
            sums: zero,
            planned: (zero.momentum, 0.0),
            expected: None,
            fed: Vector2::zeros(),
            before: None,
        }
    }

    /// The state in which the pendulum is an exact one; `fed` (m/s) is what is known of xi beforehand.
    #[must_use]
    pub fn corrected(&self, state: &PendulumState, fed: Vector2<f64>) -> PendulumState {
        PendulumState {
            position: state.position + self.offsets.position,
            momentum: state.momentum - fed - self.offsets.momentum,
        }
    }

    /// A tick of a step at `time` (s) in the axes of `heading` (rad): the state as measured, xi as fed forward, and the corrected state
    /// that the next step is to begin with.
    pub fn look(&mut self, time: f64, heading: f64, state: &PendulumState, fed: Vector2<f64>, begins: &PendulumState) {
        if self.first.is_none() {
            self.first = Some((time, *state));
            self.sums = PendulumState { position: Vector2::zeros(), momentum: Vector2::zeros() };
        } else {
            let period = time - self.last.0;
            let mean = |a: Vector2<f64>, b: Vector2<f64>| (a + b) * (0.5 * period);
            self.sums.position += mean(self.last.1.position, state.position);
            self.sums.momentum += mean(self.last.1.momentum, state.momentum);
        }
        self.last = (time, *state);
        let angle = self.lambda * self.offsets.step_time;
        self.planned = (begins.momentum * angle.cosh() + begins.position * (self.lambda * angle.sinh()), heading);
        self.fed = fed;
    }

    /// The foot came down. A step that was cut short teaches nothing.
    pub fn touch_down(&mut self) {
        let Some((start, first)) = self.first.take() else { return };
        let (end, last) = self.last;
        let time = end - start;
        let expected = self.expected.replace(self.planned);
        if time < 0.5 * self.step_time {
            return;
        }
        let angle = self.lambda * self.offsets.step_time;
        let ends = self.corrected(&last, self.fed).momentum;
        let expected = expected.map_or(ends, |(momentum, heading)| Rotation2::new(heading - self.planned.1) * momentum);
        let way = (last.position - first.position) / time;
        let square = self.lambda * self.lambda;
        let seen = Offsets {
            position: (last.momentum - first.momentum) / (square * time) - self.sums.position / time,
            momentum: self.sums.momentum / time - way - self.fed,
            touchdown: (ends - expected) / angle.cosh(),
            speed: ends * ((0.5 * angle).tanh() / (0.5 * angle)) - way,
            step_time: time,
        };
        if let Some(before) = self.before.replace(seen) {
            let length = crate::settings::GRAVITY / square;
            let speed = (crate::settings::GRAVITY * length).sqrt();
            let known = &mut self.offsets;
            learn(&mut known.position, 0.5 * (before.position + seen.position), length);
            learn(&mut known.momentum, 0.5 * (before.momentum + seen.momentum), speed);
            learn(&mut known.touchdown, 0.5 * (before.touchdown + seen.touchdown), speed);
            learn(&mut known.speed, 0.5 * (before.speed + seen.speed), speed);
            let [least, greatest] = TIME.map(|share| share * self.step_time);
            let mean = (0.5 * (before.step_time + seen.step_time)).clamp(least, greatest);
            known.step_time += SHARE * (mean - known.step_time);
        }
    }

    /// A step that does not count: a stand, a push, a kick.
    pub fn forget_step(&mut self) {
        (self.first, self.before, self.expected) = (None, None, None);
    }
}

/// Follows `seen` slowly: `scale` is what its limits are shares of.
fn learn(known: &mut Vector2<f64>, seen: Vector2<f64>, scale: f64) {
    for axis in 0..2 {
        let error = (seen[axis] - known[axis]).clamp(-MOST[0] * scale, MOST[0] * scale);
        known[axis] = (known[axis] + SHARE * error).clamp(-MOST[1] * scale, MOST[1] * scale);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::footsteps::Pendulum;
    use instep_motion::phase::Side;

    /// How a robot differs from the pendulum: offsets, how far beside its footholds it lands (m), how far its centre of pressure wanders
    /// in a step (m), how much too early its feet come down (ms).
    #[derive(Debug, Clone, Copy)]
    struct Real {
        delta: Vector2<f64>,
        xi: Vector2<f64>,
        landing: Vector2<f64>,
        wanders: f64,
        early: i32,
    }

    /// Walks it; the mean velocity of its last steps, m/s.
    fn walk(velocity: Vector2<f64>, real: &Real) -> Vector2<f64> {
        let mut pendulum = Pendulum { lambda: 3.73, step_time: 0.4, width: 0.2, alpha: 0.9 };
        let mut learner = Learner::new(pendulum.lambda, pendulum.step_time);
        let mut state = PendulumState { position: Vector2::new(0.0, 0.1), momentum: Vector2::zeros() };
        let (mut side, mut way, mut marks) = (Side::Right, Vector2::zeros(), Vec::new());
        let (count, period) = (400 - real.early, 0.001);
        for step in 0..60 {
            side = side.other();
            let mut foothold = Vector2::zeros();
            pendulum.step_time = learner.offsets.step_time;
            for tick in 0..=count {
                let time = f64::from(tick) * period;
                let left = (pendulum.step_time - time).max(0.0);
                let known = learner.corrected(&state, Vector2::zeros());
                let Offsets { touchdown, speed, .. } = learner.offsets;
                foothold = pendulum.foothold(&known, left, velocity + speed, 0.0, touchdown, side);
                let end = pendulum.ahead(&known, left);
                let begins = PendulumState { position: end.position - foothold, momentum: end.momentum };
                learner.look(f64::from(step) + time, 0.0, &state, Vector2::zeros(), &begins);
                if tick < count {
                    let share = f64::from(tick) / f64::from(count) - 0.5;
                    let delta = real.delta - Vector2::new(real.wanders * share, 0.0);
                    let moved = PendulumState { position: state.position + delta, momentum: state.momentum - real.xi };
                    let moved = pendulum.ahead(&moved, period);
                    state = PendulumState { position: moved.position - delta, momentum: moved.momentum + real.xi };
                }
            }
            state.position -= foothold + real.landing;
            way += foothold + real.landing;
            learner.touch_down();
            marks.push(way);
        }
        (marks[59] - marks[39]) / (20.0 * f64::from(count) * period)
    }

    #[test]
    fn speed_comes_out_as_asked_whatever_the_offsets() {
        let (asked, zero) = (Vector2::new(0.8, 0.1), Vector2::zeros());
        let exact = Real { delta: zero, xi: zero, landing: zero, wanders: 0.0, early: 0 };
        let (delta, xi, landing) = (Vector2::new(0.02, -0.01), Vector2::new(0.08, 0.03), Vector2::new(-0.015, 0.01));
        for real in [
            exact,
            Real { delta, ..exact },
            Real { xi, ..exact },
            Real { landing, ..exact },
            Real { wanders: 0.08, ..exact },
            Real { early: 40, ..exact },
            Real { delta, xi, landing, wanders: 0.05, early: 30 },
        ] {
            let mean = walk(asked, &real);
            assert!((mean - asked).norm() < 5e-3, "{mean} with {real:?}");
        }
    }

    #[test]
    fn one_wild_step_teaches_little() {
        let mut known = Vector2::zeros();
        learn(&mut known, Vector2::new(10.0, -10.0), 0.7);
        assert!(known.amax() <= SHARE * MOST[0] * 0.7 + 1e-12);
    }
}
