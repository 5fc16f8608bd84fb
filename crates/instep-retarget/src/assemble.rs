//! From positions at the clip's rate to a reference: speeds, momentum, contacts, the ball's place, and what is wrong.

use std::collections::BTreeMap;

use instep_motion::phase::KickPhases;
use instep_motion::reference::{Knot, Reference, ReferenceKind, Source};
use instep_robot::{Robot, RobotData};
use nalgebra::Vector3;

use crate::stance::Stance;

/// A robot's motion at the clip's rate, before it becomes a reference.
pub(crate) struct Motion<'a> {
    pub robot: &'a Robot,
    /// 7 + n a frame.
    pub positions: Vec<Vec<f64>>,
    pub stances: &'a [Stance],
    /// Frames a second.
    pub rate: f64,
    /// In the clip's time.
    pub phases: KickPhases,
}

impl Motion<'_> {
    /// Worst violation by family; see [`crate::kinematic::Retargeted::violations`].
    pub(crate) fn violations(&self) -> BTreeMap<&'static str, f64> {
        let mut worst: BTreeMap<&'static str, f64> = BTreeMap::new();
        let mut note = |family, value: f64| {
            let entry = worst.entry(family).or_insert(0.0);
            *entry = entry.max(value);
        };
        let mut data = self.robot.data();
        let mut first: Vec<Option<Vector3<f64>>> = vec![None; self.stances.len()];
        let mut v = vec![0.0; self.robot.nv()];
        for (frame, q) in self.positions.iter().enumerate() {
            data.set_position(q);
            for (joint, angle) in self.robot.joints.iter().zip(&q[7..]) {
                note("joint_limit", (joint.range[0] - angle).max(angle - joint.range[1]));
            }
            self.velocity(&data, frame as f64, &mut v);
            for (joint, speed) in self.robot.joints.iter().zip(&v[6..]) {
                note("joint_speed", speed.abs() / joint.speed - 1.0);
            }
            for contact in &self.robot.contacts {
                note("penetration", contact.radius - data.point(&contact.at).z);
            }
            for (stance, first) in self.stances.iter().zip(&mut first) {
                if (stance.start..stance.end).contains(&frame) {
                    let contact = &self.robot.contacts[stance.point];
                    let at = data.point(&contact.at);
                    let start = first.get_or_insert(at);
                    note("stance_slip", (at - *start).xy().norm());
                    note("stance_height", (at.z - contact.radius).abs());
                }
            }
            for &pair in &self.robot.self_collision {
                note("self_collision", -data.capsule_gap(pair).1);
            }
        }
        worst
    }

    /// Position at a frame that need not be whole: 7 + n.
    fn position(&self, data: &RobotData, frame: f64) -> Vec<f64> {
        let last = self.positions.len() - 1;
        let below = (frame.floor().max(0.0) as usize).min(last);
        let above = (below + 1).min(last);
        let mut q = self.positions[below].clone();
        let share = frame - below as f64;
        if share > 1e-9 && above > below {
            let mut step = vec![0.0; self.robot.nv()];
            data.difference_into(&q, &self.positions[above], 1.0, &mut step);
            data.integrate(&mut q, &step, share);
        }
        q
    }

    /// Speed at a frame, from the frames a step before and after: 6 + n.
    fn velocity(&self, data: &RobotData, frame: f64, v: &mut [f64]) {
        let last = (self.positions.len() - 1) as f64;
        let (before, after) = ((frame - 1.0).max(0.0), (frame + 1.0).min(last));
        let (from, to) = (self.position(data, before), self.position(data, after));
        data.difference_into(&from, &to, (after - before) / self.rate, v);
    }

    /// The reference with `rate` knots a second, one of them at the impact, and the origin under the ball; the
    /// positions moved to that origin; and where the origin was.
    pub(crate) fn reference(
        mut self,
        kind: ReferenceKind,
        source: Source,
        rate: f64,
        ball_radius: f64,
    ) -> (Reference, Vec<Vec<f64>>, Vector3<f64>) {
        let mut data = self.robot.data();
        let impact = self.phases.t_impact * self.rate;
        let at_impact = self.position(&data, impact);
        let ball = place_ball(self.robot, &mut data, &at_impact, &self.phases, ball_radius);
        let origin = Vector3::new(ball.x, ball.y, 0.0);
        for q in &mut self.positions {
            q[0] -= origin.x;
            q[1] -= origin.y;
        }

        let stride = self.rate / rate;
        let before = (impact / stride + 1e-9).floor();
        let start = impact - before * stride;
        let last = (self.positions.len() - 1) as f64;
        let count = ((last - start) / stride + 1e-9).floor() as usize + 1;
        let mut v = vec![0.0; self.robot.nv()];
        let knots = (0..count)
            .map(|k| {
                let frame = (start + k as f64 * stride).clamp(0.0, last);
                let q = self.position(&data, frame);
                self.velocity(&data, frame, &mut v);
                data.set_state(&q, &v);
                let stands = |point: usize| {
                    let frame = frame.round() as usize;
                    self.stances.iter().any(|s| s.point == point && (s.start..s.end).contains(&frame))
                };
                Knot {
                    base_position: [q[0], q[1], q[2]],
                    base_orientation: [q[3], q[4], q[5], q[6]],
                    base_velocity: [v[0], v[1], v[2]],
                    base_angular_velocity: [v[3], v[4], v[5]],
                    joints: q[7..].to_vec(),
                    joint_velocities: v[6..].to_vec(),
                    contacts: (0..self.robot.contacts.len()).map(stands).collect(),
                    forces: Vec::new(),
                    torques: Vec::new(),
                    com: data.com().into(),
                    momentum: data.momentum(),
                }
            })
            .collect();
        let clip_start = start / self.rate;
        let shifted = |t: f64| (t - clip_start).max(0.0);
        let phases = KickPhases {
            kick_foot: self.phases.kick_foot,
            t_plant: shifted(self.phases.t_plant),
            t_swing: shifted(self.phases.t_swing),
            t_lock: shifted(self.phases.t_lock),
            t_impact: shifted(self.phases.t_impact),
        };
        let reference = Reference {
            format: Reference::FORMAT,
            robot: self.robot.name.clone(),
            kind,
            source: Source { clip_start, ..source },
            rate,
            ball: [0.0, 0.0, ball_radius],
            phases,
            joint_names: self.robot.joints.iter().map(|joint| joint.name.clone()).collect(),
            contact_names: self.robot.contacts.iter().map(|contact| contact.name.clone()).collect(),
            knots,
        };
        (reference, self.positions, origin)
    }
}

/// Where the ball's centre must lie, on the ground, for the kicking foot to meet it in the position `q`: just touching,
/// and beside the foot so that the push goes along x as nearly as it can.
fn place_ball(robot: &Robot, data: &mut RobotData, q: &[f64], phases: &KickPhases, radius: f64) -> Vector3<f64> {
    data.set_position(q);
    let leg = robot.leg(phases.kick_foot);
    let foot = data.link_position(leg.foot);
    let mut best: Option<(f64, Vector3<f64>)> = None;
    for step in -40..=40 {
        let y = foot.y + 0.002 * f64::from(step);
        // The ball comes from far ahead; the geom that it meets first decides.
        let touch =
            leg.strike.iter().filter_map(|&geom| touch(data, geom, y, radius)).max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((x, sideways)) = touch else { continue };
        if best.is_none_or(|(least, _)| sideways.abs() < least) {
            best = Some((sideways.abs(), Vector3::new(x, y, radius)));
        }
    }
    best.map_or_else(|| Vector3::new(foot.x + radius, foot.y, radius), |(_, centre)| centre)
}

/// The x at which a ball on the ground at `y` touches a capsule from ahead, and the y part of the push on it.
fn touch(data: &RobotData, geom: usize, y: f64, radius: f64) -> Option<(f64, f64)> {
    let (axis, thickness) = data.capsule(geom);
    let reach = radius + thickness;
    let mut first: Option<(f64, f64)> = None;
    for i in 0..=20 {
        let point = axis[0] + (axis[1] - axis[0]) * (f64::from(i) / 20.0);
        let (dy, dz) = (y - point.y, radius - point.z);
        let room = reach * reach - dy * dy - dz * dz;
        if room > 0.0 {
            let x = point.x + room.sqrt();
            if first.is_none_or(|(most, _)| x > most) {
                first = Some((x, dy / reach));
            }
        }
    }
    first
}
