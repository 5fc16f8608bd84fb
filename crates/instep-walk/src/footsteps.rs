//! Where to step next: the linear inverted pendulum with angular momentum about the contact as its state.
//!
//! Source: Y. Gong, J. W. Grizzle, Zero dynamics, pendulum models, and angular momentum in feedback control of bipedal
//! locomotion (2021), their one-step-ahead law: the foot is put where the momentum at the end of the *next* step comes out as
//! wanted. Momentum L about the contact is continuous through a touchdown at constant height, and nearly free of the ankle.
//!
//! State of one axis: p, centre of mass from the contact (m), and w = (L_y, -L_x) / (m H) (m/s). p' = w, w' = lambda^2 p.
//! Predicts to the end of the step and one step on; knows no obstacles. When the foothold is out of reach, the time of the step is changed
//! (in the spirit of M. Khadiv, A. Herzog, S. A. A. Moosavian, L. Righetti, Walking control based on step timing adaptation, IEEE
//! T-RO 36, 2020): a search over a few rates for the least momentum that is left over.

use instep_motion::phase::Side;
use nalgebra::{Rotation2, Vector2};

use crate::settings::{GRAVITY, Gait};

/// The pendulum and the wanted gait.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pendulum {
    /// sqrt(g / H), 1/s.
    pub lambda: f64,
    /// Time of a step, s.
    pub step_time: f64,
    /// Distance between the feet across, m.
    pub width: f64,
    /// Share of the momentum error that a step takes away: 1 is the source's dead beat, less is gentler.
    pub alpha: f64,
}

/// State from the contact, in the axes of the heading at the next touchdown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PendulumState {
    /// Centre of mass from the contact, m.
    pub position: Vector2<f64>,
    /// (L_y, -L_x) / (m H), m/s.
    pub momentum: Vector2<f64>,
}

impl Pendulum {
    /// Of a gait.
    #[must_use]
    pub fn of(gait: &Gait) -> Self {
        Self { lambda: (GRAVITY / gait.height).sqrt(), step_time: gait.step_time, width: gait.width, alpha: gait.alpha }
    }

    /// The state `time` (s) later.
    #[must_use]
    pub fn ahead(&self, state: &PendulumState, time: f64) -> PendulumState {
        let (sh, ch) = ((self.lambda * time).sinh(), (self.lambda * time).cosh());
        PendulumState {
            position: state.position * ch + state.momentum * (sh / self.lambda),
            momentum: state.position * (self.lambda * sh) + state.momentum * ch,
        }
    }

    /// Momentum at the end of the step on foot `next` of a gait with the mean velocity `velocity` (m/s).
    #[must_use]
    pub fn wanted(&self, velocity: Vector2<f64>, next: Side) -> Vector2<f64> {
        let half = 0.5 * self.lambda * self.step_time;
        let mean = velocity * (half / half.tanh());
        mean + Vector2::new(0.0, self.sway(next))
    }

    /// The part of the momentum across that comes from stepping from foot to foot: at the end of the step on foot `next`.
    #[must_use]
    pub fn sway(&self, next: Side) -> f64 {
        let outward = if next == Side::Left { 1.0 } else { -1.0 };
        -outward * 0.5 * self.width * self.lambda * (0.5 * self.lambda * self.step_time).tanh()
    }

    /// Where to put foot `next` from the contact of the step that ends `left` (s) from now, m, for the mean velocity
    /// `velocity` of a gait that turns at `turn` (rad/s) and whose touchdowns add `touchdown` (m/s) to the momentum. With `alpha` below 1 some of the present momentum is kept; the
    /// wanted momentum makes up for it, so that the periodic gait comes out as wanted whatever `alpha`.
    #[must_use]
    pub fn foothold(
        &self,
        state: &PendulumState,
        left: f64,
        velocity: Vector2<f64>,
        turn: f64,
        touchdown: Vector2<f64>,
        next: Side,
    ) -> Vector2<f64> {
        let end = self.ahead(state, left);
        let (sh, ch) = ((self.lambda * self.step_time).sinh(), (self.lambda * self.step_time).cosh());
        // w_next = w_des + (1 - alpha) ch w_now; w_now is to be that of this step's end, w_next that of the next one's, turned.
        let kept = (1.0 - self.alpha) * ch;
        let turned = Rotation2::new(turn * self.step_time);
        let wanted = turned * self.wanted(velocity, next) - self.wanted(velocity, next.other()) * kept;
        let start = (wanted - (end.momentum * self.alpha + touchdown) * ch) / (self.lambda * sh);
        end.position - start
    }

    /// Where the support foot of the step that is `steps` from now stands, from the present contact, m, when the gait of
    /// `velocity` goes on straight ahead; `support` is the present one, and `left` (s) of its step are left; `touchdown` as for
    /// [`Self::foothold`]. Affine in `velocity`.
    #[must_use]
    pub fn contact_after(
        &self,
        state: &PendulumState,
        left: f64,
        velocity: Vector2<f64>,
        touchdown: Vector2<f64>,
        support: Side,
        steps: usize,
    ) -> Vector2<f64> {
        let (mut state, mut left, mut next) = (*state, left, support.other());
        let mut contact = Vector2::zeros();
        for _ in 0..steps {
            let foothold = self.foothold(&state, left, velocity, 0.0, touchdown, next);
            let end = self.ahead(&state, left);
            contact += foothold;
            state = PendulumState { position: end.position - foothold, momentum: end.momentum + touchdown };
            (left, next) = (self.step_time, next.other());
        }
        contact
    }
}

/// Rates of the swing that are looked at, as powers of [`STEP`] of the nominal one.
const POWERS: std::ops::RangeInclusive<i32> = -2..=8;
/// See [`POWERS`].
const STEP: f64 = 1.08;
/// What a change of the rate costs beside the square of the momentum error over sqrt(g H), for the square of its logarithm.
const HASTE: f64 = 0.02;

/// How far a foot can be put from the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// Ahead and back, m.
    pub ahead: f64,
    /// Across, least and greatest, m: no crossing, no split.
    pub across: [f64; 2],
}

impl Reach {
    /// The foothold of `foot` nearest to `step` that can be reached.
    #[must_use]
    pub fn clip(&self, step: Vector2<f64>, foot: Side) -> Vector2<f64> {
        let outward = if foot == Side::Left { 1.0 } else { -1.0 };
        let [near, far] = self.across;
        Vector2::new(step.x.clamp(-self.ahead, self.ahead), outward * (outward * step.y).clamp(near, far))
    }
}

/// A step that is to be made: how fast its phase runs (1/s), where to (m, from the contact, in the axes of its end).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan {
    /// 1/s.
    pub rate: f64,
    /// m.
    pub step: Vector2<f64>,
}

impl Pendulum {
    /// The rate at which a step goes on of which `ahead` is left of its phase, and its foothold: `nominal` (1/s) unless that is out of
    /// reach. `foothold` gives the wanted one for the time that is left (s).
    pub fn time(
        &self,
        ahead: f64,
        nominal: f64,
        reach: &Reach,
        foot: Side,
        mut foothold: impl FnMut(&Self, f64) -> Vector2<f64>,
    ) -> Plan {
        let to_momentum = self.lambda * (self.lambda * self.step_time).sinh() * self.lambda / GRAVITY;
        let mut judge = |power: i32| {
            let rate = nominal * STEP.powi(power);
            let wanted = foothold(self, (ahead / rate).max(0.0));
            let step = reach.clip(wanted, foot);
            let haste = f64::from(power) * STEP.ln();
            ((wanted - step).norm_squared() * to_momentum.powi(2) + HASTE * haste * haste, Plan { rate, step })
        };
        let (cost, plan) = judge(0);
        if cost == 0.0 {
            return plan;
        }
        let better = POWERS.map(judge).min_by(|a, b| a.0.total_cmp(&b.0));
        better.map_or(plan, |(_, plan)| plan)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_out_of_reach_is_made_sooner_and_one_in_reach_in_its_time() {
        let pendulum = Pendulum { lambda: 3.73, step_time: 0.4, width: 0.2, alpha: 0.9 };
        let reach = Reach { ahead: 0.65, across: [0.1, 0.55] };
        let plan = |momentum: f64| {
            let state = PendulumState { position: Vector2::new(0.0, 0.08), momentum: Vector2::new(0.0, momentum) };
            pendulum.time(0.7, 2.5, &reach, Side::Left, |pendulum, left| {
                pendulum.foothold(&state, left, Vector2::zeros(), 0.0, Vector2::zeros(), Side::Left)
            })
        };
        let calm = plan(0.0);
        assert!((calm.rate - 2.5).abs() < 1e-12 && calm.step.y < 0.55, "{calm:?}");
        let pushed = plan(0.7);
        assert!(pushed.rate > 2.8 && pushed.step.y <= 0.55, "{pushed:?}");
    }

    fn walk(alpha: f64, velocity: Vector2<f64>, steps: usize) -> (Vector2<f64>, f64, Vector2<f64>) {
        let pendulum = Pendulum { lambda: (9.81_f64 / 0.705).sqrt(), step_time: 0.4, width: 0.2, alpha };
        let mut state = PendulumState { position: Vector2::new(0.02, 0.09), momentum: Vector2::new(0.3, -0.2) };
        let (mut side, mut contact) = (Side::Right, Vector2::zeros());
        let (mut before, mut width) = (Vector2::zeros(), 0.0);
        let mut end = PendulumState { position: Vector2::zeros(), momentum: Vector2::zeros() };
        for _ in 0..steps {
            side = side.other();
            let step = pendulum.foothold(&state, pendulum.step_time, velocity, 0.0, Vector2::zeros(), side);
            end = pendulum.ahead(&state, pendulum.step_time);
            before = contact + end.position;
            state = PendulumState { position: end.position - step, momentum: end.momentum };
            contact += step;
            width = step.y.abs();
            end = pendulum.ahead(&state, pendulum.step_time);
        }
        let mean = (contact + end.position - before) / pendulum.step_time;
        (mean, width, end.momentum - pendulum.wanted(velocity, side))
    }

    #[test]
    fn with_alpha_one_the_momentum_is_there_after_one_step() {
        let (_, _, error) = walk(1.0, Vector2::new(0.7, 0.1), 1);
        assert!(error.norm() < 1e-12, "{error}");
    }

    #[test]
    fn speed_and_width_come_out_as_wanted_whatever_alpha() {
        for alpha in [0.8, 0.9, 1.0] {
            let (mean, width, _) = walk(alpha, Vector2::new(1.2, 0.0), 41);
            assert!((mean - Vector2::new(1.2, mean.y)).norm() < 1e-6, "{alpha}: {mean}");
            assert!((width - 0.2).abs() < 1e-6, "{alpha}: {width}");
        }
    }

    #[test]
    fn sideways_the_mean_over_two_steps_is_the_wanted_velocity() {
        let pendulum = Pendulum { lambda: 3.7, step_time: 0.4, width: 0.2, alpha: 0.9 };
        let mut state = PendulumState { position: Vector2::new(0.0, 0.1), momentum: Vector2::zeros() };
        let (mut side, mut way, mut mark) = (Side::Right, 0.0, [0.0; 2]);
        for step in 0..60 {
            side = side.other();
            let foothold = pendulum.foothold(&state, 0.4, Vector2::new(0.0, 0.3), 0.0, Vector2::zeros(), side);
            let end = pendulum.ahead(&state, 0.4);
            state = PendulumState { position: end.position - foothold, momentum: end.momentum };
            way += foothold.y;
            if step >= 58 {
                mark[step - 58] = foothold.y;
            }
        }
        assert!((mark[0] + mark[1] - 0.3 * 0.8).abs() < 1e-6, "{mark:?}, {way}");
    }
}
