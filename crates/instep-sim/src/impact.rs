//! What happened between foot and ball: watched at every near step, evaluated once the ball is free again.
//!
//! Definitions (facts/physics-of-the-kick.md). The impact starts with the first contact and ends with the last one
//! before a pause of [`PAUSE`]. Its normal n is the direction of the impulse on the ball; its striking point is that of
//! the largest force, fixed to the link that gave it. Restitution is (ball's speed after - point's speed after) /
//! (point's speed before - ball's speed before) along n; effective mass is 1 / (n^T J M^-1 J^T n) of the free robot.

use instep_robot::{LinkPoint, Robot, RobotData};
use nalgebra::Vector3;
use serde::Serialize;

use crate::settings::Ball;
use crate::world::{BallState, World};

/// A pause in contact (s) after which the impact is over. A later touch is another one.
pub const PAUSE: f64 = 0.010;

/// The state of robot and ball at one instant.
#[derive(Debug, Clone, PartialEq, Default)]
struct Instant {
    time: f64,
    q: Vec<f64>,
    v: Vec<f64>,
    ball: Option<BallState>,
    work: f64,
}

impl Instant {
    fn take(&mut self, world: &World) {
        self.time = world.time();
        self.q.clear();
        self.q.extend_from_slice(world.q());
        self.v.clear();
        self.v.extend_from_slice(world.v());
        self.ball = Some(world.ball());
        self.work = world.motor_work();
    }
}

/// Watches a world's near steps for the first impact.
#[derive(Debug, Clone, Default)]
pub struct ImpactWatch {
    last: Instant,
    start: Option<Instant>,
    end: Instant,
    last_contact: f64,
    largest_force: f64,
    link: usize,
    point: Vector3<f64>,
    over: bool,
    touches: usize,
}

impl ImpactWatch {
    /// A watch that has seen nothing.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// When the first contact started, s.
    #[must_use]
    pub fn started(&self) -> Option<f64> {
        self.start.as_ref().map(|start| start.time)
    }

    /// How often the robot touched the ball, with pauses in between.
    #[must_use]
    pub fn touches(&self) -> usize {
        self.touches
    }

    /// Called before a near step.
    pub(crate) fn before(&mut self, world: &World) {
        self.last.take(world);
    }

    /// Called after a near step, whose contacts are those at its start.
    pub(crate) fn after(&mut self, world: &World) {
        let mut force = 0.0;
        let mut strongest = 0.0;
        for (link, point, on_ball) in world.ball_strikes() {
            let strength = on_ball.norm();
            force += strength;
            if !self.over && strength > self.largest_force.max(strongest) {
                strongest = strength;
                self.link = link;
                self.point = point;
            }
        }
        self.largest_force = self.largest_force.max(strongest);
        if force <= 0.0 {
            return;
        }
        if self.start.is_none() {
            self.start = Some(self.last.clone());
            self.touches = 1;
        } else if self.last.time - self.last_contact > PAUSE {
            self.over = true;
            self.touches += 1;
        }
        self.last_contact = world.time();
        if !self.over {
            self.end.take(world);
        }
    }

    /// Whether the first impact is over at `time` (s).
    #[must_use]
    pub fn is_over(&self, time: f64) -> bool {
        self.start.is_some() && (self.over || time - self.last_contact > PAUSE)
    }

    /// The first impact, if there was one, with `data` as scratch space of the same robot.
    #[must_use]
    pub fn impact(&self, robot: &Robot, ball: &Ball, data: &mut RobotData) -> Option<Impact> {
        let start = self.start.as_ref()?;
        let (ball_before, ball_after) = (start.ball?, self.end.ball?);
        let before = Vector3::from(ball_before.velocity);
        let after = Vector3::from(ball_after.velocity);
        let normal = (after - before).try_normalize(1e-9)?;

        // The striking point was found somewhere in the impact, in the world: fix it to its link by the state before.
        data.set_state(&start.q, &start.v);
        let local = data.link_matrix(self.link).transpose() * (self.point - data.link_position(self.link));
        let striker = LinkPoint { link: self.link, point: local };
        let point_before = data.point_velocity(&striker);
        let effective_mass = data.effective_mass(&striker, &normal);
        let kinetic_before = data.kinetic_energy() + ball_energy(ball, &ball_before);
        let height_before = data.com().z * robot.mass() + ball_before.position[2] * ball.mass;

        data.set_state(&self.end.q, &self.end.v);
        let point_after = data.point_velocity(&striker);
        let kinetic_after = data.kinetic_energy() + ball_energy(ball, &ball_after);
        let height_after = data.com().z * robot.mass() + ball_after.position[2] * ball.mass;

        let approach = (point_before - before).dot(&normal);
        Some(Impact {
            time: start.time,
            duration: self.end.time - start.time,
            link: robot.link_name(self.link).to_owned(),
            point: self.point.into(),
            normal: normal.into(),
            foot_speed: point_before.norm(),
            foot_speed_normal: point_before.dot(&normal),
            effective_mass,
            restitution: (after - point_after).dot(&normal) / approach,
            ball_velocity: ball_after.velocity,
            kinetic_before,
            kinetic_after,
            motor_work: self.end.work - start.work,
            gravity_work: 9.81 * (height_before - height_after),
            touches: self.touches,
        })
    }
}

/// Kinetic energy of a thin-shelled ball, J.
fn ball_energy(ball: &Ball, state: &BallState) -> f64 {
    let inertia = 2.0 / 3.0 * ball.mass * ball.radius * ball.radius;
    0.5 * ball.mass * Vector3::from(state.velocity).norm_squared()
        + 0.5 * inertia * Vector3::from(state.angular_velocity).norm_squared()
}

/// One impact of the robot on the ball; SI units, world frame.
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
    /// Speed of the striking point just before, m/s.
    pub foot_speed: f64,
    /// Its part along the normal, m/s.
    pub foot_speed_normal: f64,
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
    /// Work of the motors during the impact, J.
    pub motor_work: f64,
    /// Work of gravity during the impact, J.
    pub gravity_work: f64,
    /// How often the robot touched the ball in the whole trial.
    pub touches: usize,
}

impl Impact {
    /// Ball's speed just after, m/s.
    #[must_use]
    pub fn ball_speed(&self) -> f64 {
        Vector3::from(self.ball_velocity).norm()
    }
}
