//! Where to step next: the linear inverted pendulum with angular momentum about the contact as its state.
//!
//! Source: Y. Gong, J. W. Grizzle, Zero dynamics, pendulum models, and angular momentum in feedback control of bipedal
//! locomotion (2021), their one-step-ahead law: the foot is put where the momentum at the end of the *next* step comes out as
//! wanted. Momentum L about the contact is continuous through a touchdown at constant height, and nearly free of the ankle.
//!
//! State of one axis: p, centre of mass from the contact (m), and w = (L_y, -L_x) / (m H) (m/s). p' = w, w' = lambda^2 p.
//! Predicts to the end of the step and one step on; knows no obstacles.

use instep_motion::phase::Side;
use nalgebra::{Rotation2, Vector2};

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
    /// `velocity` of a gait that turns at `turn` (rad/s). With `alpha` below 1 some of the present momentum is kept; the
    /// wanted momentum makes up for it, so that the periodic gait comes out as wanted whatever `alpha`.
    #[must_use]
    pub fn foothold(
        &self,
        state: &PendulumState,
        left: f64,
        velocity: Vector2<f64>,
        turn: f64,
        next: Side,
    ) -> Vector2<f64> {
        let end = self.ahead(state, left);
        let (sh, ch) = ((self.lambda * self.step_time).sinh(), (self.lambda * self.step_time).cosh());
        // w_next = w_des + (1 - alpha) ch w_now; w_now is to be that of this step's end, w_next that of the next one's, turned.
        let kept = (1.0 - self.alpha) * ch;
        let turned = Rotation2::new(turn * self.step_time);
        let wanted = turned * self.wanted(velocity, next) - self.wanted(velocity, next.other()) * kept;
        let start = (wanted - end.momentum * (self.alpha * ch)) / (self.lambda * sh);
        end.position - start
    }

    /// Where the support foot of the step that is `steps` from now stands, from the present contact, m, when the gait of
    /// `velocity` goes on straight ahead; `support` is the present one, and `left` (s) of its step are left. Affine in
    /// `velocity`.
    #[must_use]
    pub fn contact_after(
        &self,
        state: &PendulumState,
        left: f64,
        velocity: Vector2<f64>,
        support: Side,
        steps: usize,
    ) -> Vector2<f64> {
        let (mut state, mut left, mut next) = (*state, left, support.other());
        let mut contact = Vector2::zeros();
        for _ in 0..steps {
            let foothold = self.foothold(&state, left, velocity, 0.0, next);
            let end = self.ahead(&state, left);
            contact += foothold;
            state = PendulumState { position: end.position - foothold, momentum: end.momentum };
            (left, next) = (self.step_time, next.other());
        }
        contact
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn walk(alpha: f64, velocity: Vector2<f64>, steps: usize) -> (Vector2<f64>, f64, Vector2<f64>) {
        let pendulum = Pendulum { lambda: (9.81_f64 / 0.705).sqrt(), step_time: 0.4, width: 0.2, alpha };
        let mut state = PendulumState { position: Vector2::new(0.02, 0.09), momentum: Vector2::new(0.3, -0.2) };
        let (mut side, mut contact) = (Side::Right, Vector2::zeros());
        let (mut before, mut width) = (Vector2::zeros(), 0.0);
        let mut end = PendulumState { position: Vector2::zeros(), momentum: Vector2::zeros() };
        for _ in 0..steps {
            side = side.other();
            let step = pendulum.foothold(&state, pendulum.step_time, velocity, 0.0, side);
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
            let foothold = pendulum.foothold(&state, 0.4, Vector2::new(0.0, 0.3), 0.0, side);
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
