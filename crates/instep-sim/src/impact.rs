//! What happened between robot and ball: every touch watched at every step, evaluated once the trial is over.
//!
//! Definitions (facts/physics-of-the-kick.md). A touch starts with the first contact and ends with the last one before a
//! pause of [`PAUSE`]. Its normal n is the direction of the impulse on the ball; its striking point is that of the largest
//! force, fixed to the link that gave it. Along n, restitution is what ball and point part at over what they approached each
//! other at; effective mass is 1 / (n^T J M^-1 J^T n) of the free robot as its model says. Energies are those of the robot that
//! is in the world, whose masses may differ from its model's.

use instep_robot::{LinkPoint, RobotData};
use nalgebra::Vector3;
use serde::Serialize;

use crate::world::{BallState, World};

/// A pause in contact (s) after which a touch is over. A later contact is another touch.
pub const PAUSE: f64 = 0.010;

/// The state of robot and ball at one instant.
#[derive(Debug, Clone, PartialEq, Default)]
struct Instant {
    time: f64,
    q: Vec<f64>,
    v: Vec<f64>,
    ball: Option<BallState>,
    motor_work: f64,
    push_work: f64,
}

impl Instant {
    fn take(&mut self, world: &World) {
        self.time = world.time();
        self.q.clear();
        self.q.extend_from_slice(world.q());
        self.v.clear();
        self.v.extend_from_slice(world.v());
        self.ball = Some(world.ball());
        self.motor_work = world.motor_work();
        self.push_work = world.push_work();
    }
}

/// One touch as it was watched.
#[derive(Debug, Clone)]
struct Touch {
    before: Instant,
    after: Instant,
    impulse: Vector3<f64>,
    depth: f64,
    largest_force: f64,
    link: usize,
    point: Vector3<f64>,
}

/// Watches a world's steps for touches of robot and ball.
#[derive(Debug, Clone, Default)]
pub struct ImpactWatch {
    last: Instant,
    touches: Vec<Touch>,
}

impl ImpactWatch {
    /// A watch that has seen nothing.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Called before a step.
    pub(crate) fn before(&mut self, world: &World) {
        self.last.take(world);
    }

    /// Called after a step, whose contacts are those at its start.
    pub(crate) fn after(&mut self, world: &World) {
        let strikes = || world.ball_strikes().filter(|strike| strike.force.norm() > 0.0);
        if strikes().next().is_none() {
            return;
        }
        if self.touches.last().is_none_or(|touch| self.last.time - touch.after.time > PAUSE) {
            self.touches.push(Touch {
                before: self.last.clone(),
                after: Instant::default(),
                impulse: Vector3::zeros(),
                depth: 0.0,
                largest_force: 0.0,
                link: 0,
                point: Vector3::zeros(),
            });
        }
        let Some(touch) = self.touches.last_mut() else { return };
        for strike in strikes() {
            let strength = strike.force.norm();
            touch.impulse += strike.force * (world.time() - self.last.time);
            touch.depth = touch.depth.max(strike.depth);
            if strength > touch.largest_force {
                (touch.largest_force, touch.link, touch.point) = (strength, strike.link, strike.point);
            }
        }
        touch.after.take(world);
    }

    /// Whether the ball is free at `time` (s): not touched yet, or not for [`PAUSE`].
    #[must_use]
    pub fn is_free(&self, time: f64) -> bool {
        self.touches.last().is_none_or(|touch| time - touch.after.time > PAUSE)
    }

    /// Every touch in order, with `data` as scratch space of the same robot. Leaves `world` in another state.
    #[must_use]
    pub fn touches(&self, world: &mut World, data: &mut RobotData) -> Vec<Impact> {
        self.touches.iter().filter_map(|touch| touch.impact(world, data)).collect()
    }
}

impl Touch {
    fn impact(&self, world: &mut World, data: &mut RobotData) -> Option<Impact> {
        let (before, after) = (&self.before, &self.after);
        let (ball_before, ball_after) = (before.ball?, after.ball?);
        let normal = self.impulse.try_normalize(1e-12)?;
        // The striking point was found somewhere in the touch, in the world: fix it to its link by the state before.
        data.set_state(&before.q, &before.v);
        let local = data.link_matrix(self.link).transpose() * (self.point - data.link_position(self.link));
        let striker = LinkPoint { link: self.link, point: local };
        let point_before = data.point_velocity(&striker);
        let effective_mass = data.effective_mass(&striker, &normal);
        data.set_state(&after.q, &after.v);
        let point_after = data.point_velocity(&striker);
        let along = |ball: &BallState, point: Vector3<f64>| (Vector3::from(ball.velocity) - point).dot(&normal);
        let [kinetic_before, potential_before] = world.energy(&before.q, &before.v, &ball_before);
        let [kinetic_after, potential_after] = world.energy(&after.q, &after.v, &ball_after);
        Some(Impact {
            time: before.time,
            duration: after.time - before.time,
            link: world.robot().link_name(self.link).to_owned(),
            point: self.point.into(),
            normal: normal.into(),
            impulse: self.impulse.norm(),
            depth: self.depth,
            foot_speed: point_before.norm(),
            foot_speed_normal: point_before.dot(&normal),
            approach: -along(&ball_before, point_before),
            effective_mass,
            restitution: along(&ball_after, point_after) / -along(&ball_before, point_before),
            ball_velocity: ball_after.velocity,
            kinetic_before,
            kinetic_after,
            motor_work: after.motor_work - before.motor_work,
            push_work: after.push_work - before.push_work,
            gravity_work: potential_before - potential_after,
        })
    }
}

/// One touch of the robot on the ball; SI units, world frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Impact {
    /// When it started, s.
    pub time: f64,
    /// From first to last contact, s.
    pub duration: f64,
    /// The link that struck with the largest force.
    pub link: String,
    /// Where, m.
    pub point: [f64; 3],
    /// Direction of the impulse on the ball.
    pub normal: [f64; 3],
    /// The impulse on the ball, N s.
    pub impulse: f64,
    /// How deep ball and robot went into one another, m.
    pub depth: f64,
    /// Speed of the striking point just before, m/s.
    pub foot_speed: f64,
    /// Its part along the normal, m/s.
    pub foot_speed_normal: f64,
    /// The same beside the ball's own speed: what the two approached each other at, m/s.
    pub approach: f64,
    /// Effective mass of the striking point along the normal, kg.
    pub effective_mass: f64,
    /// Effective restitution, motors included.
    pub restitution: f64,
    /// Ball's velocity just after, m/s.
    pub ball_velocity: [f64; 3],
    /// Kinetic energy of robot and ball before, J.
    pub kinetic_before: f64,
    /// Kinetic energy of robot and ball after, J.
    pub kinetic_after: f64,
    /// Work of the motors meanwhile, J.
    pub motor_work: f64,
    /// Work of pushes from outside meanwhile, J.
    pub push_work: f64,
    /// Work of gravity meanwhile, J.
    pub gravity_work: f64,
}

impl Impact {
    /// Kinetic energy that neither motors nor pushes nor gravity gave, J; negative where it was lost.
    #[must_use]
    pub fn energy_gain(&self) -> f64 {
        self.kinetic_after - self.kinetic_before - self.motor_work - self.push_work - self.gravity_work
    }
}
