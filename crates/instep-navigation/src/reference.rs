//! Waypoints in time: a path becomes a pose for each stage of the prediction, at speeds that the robot has.
//!
//! C0 interpolation as in paper 4 (IV-D-1), with the speed limited by direction (a humanoid is slow sideways), by its
//! acceleration, and by what is left to the goal; the heading turns no faster than the robot. It starts at the predicted
//! state, not at the present one: else the delay would make the robot slower.

use instep_field::wrap;
use serde::{Deserialize, Serialize};

use crate::model::{DT, STAGES, State};
use crate::problem::Reference;
use crate::settings::RobotLimits;

/// Where to look on the way.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Facing {
    /// Along the path; near its end to the goal's heading.
    #[default]
    Path,
    /// Always this way, walking sideways where need be, rad.
    Hold(f64),
    /// At a point (the ball), m.
    Point([f64; 2]),
}

/// Share of the robot's limits that a reference uses: the rest corrects errors.
const USED: f64 = 0.9;
/// Speed per metre that is left, 1/s.
const CLOSING: f64 = 1.2;
/// How far ahead on the path the robot looks, m.
const LOOK_AHEAD: f64 = 0.4;

/// Point at `s` metres along a path, from its start.
pub(crate) fn along(path: &[[f64; 2]], s: f64) -> [f64; 2] {
    let mut left = s.max(0.0);
    for pair in path.windows(2) {
        let step = [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]];
        let length = step[0].hypot(step[1]);
        if left <= length && length > 0.0 {
            return [pair[0][0] + step[0] * left / length, pair[0][1] + step[1] * left / length];
        }
        left -= length;
    }
    path.last().copied().unwrap_or_default()
}

/// Length of a path and the place on it nearest to a point, m.
pub(crate) fn project(path: &[[f64; 2]], point: [f64; 2]) -> (f64, f64) {
    let (mut length, mut best, mut at) = (0.0, f64::INFINITY, 0.0);
    for pair in path.windows(2) {
        let step = [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]];
        let size = step[0].hypot(step[1]);
        if size > 0.0 {
            let off = [point[0] - pair[0][0], point[1] - pair[0][1]];
            let share = ((off[0] * step[0] + off[1] * step[1]) / (size * size)).clamp(0.0, 1.0);
            let distance = (off[0] - share * step[0]).hypot(off[1] - share * step[1]);
            if distance < best {
                (best, at) = (distance, length + share * size);
            }
        }
        length += size;
    }
    (length, at)
}

/// What to follow from `state` along `path` to a goal with heading `goal_heading`, no faster than `speed`.
pub(crate) fn along_path(
    path: &[[f64; 2]],
    state: &State,
    (goal_heading, facing, turn_in): (f64, Facing, f64),
    speed: f64,
    limits: &RobotLimits,
) -> Reference {
    let mut reference = Reference::default();
    let (length, mut s) = project(path, [state.pose[0], state.pose[1]]);
    let mut at = along(path, s);
    let mut heading = state.pose[2];
    let ahead = along(path, s + 0.1);
    let direction = (ahead[1] - at[1]).atan2(ahead[0] - at[0]) - heading;
    // How fast it already goes along the path.
    let mut v = (state.velocity[0] * direction.cos() + state.velocity[1] * direction.sin()).max(0.0);
    for i in 0..STAGES {
        let left = (length - s).max(0.0);
        let look = along(path, s + LOOK_AHEAD);
        let way = [look[0] - at[0], look[1] - at[1]];
        let direction = if left > 1e-6 { way[1].atan2(way[0]) } else { heading };
        let wanted = match facing {
            Facing::Hold(angle) => angle,
            Facing::Point(point) => (point[1] - at[1]).atan2(point[0] - at[0]),
            Facing::Path if left < turn_in => goal_heading,
            Facing::Path => direction,
        };
        let most = USED * limits.turn * DT;
        let turned = heading + wrap(wanted - heading).clamp(-most, most);
        let off = wrap(direction - 0.5 * (heading + turned));
        let mut fastest = (USED * limits.speed_toward(off)).min(speed);
        if facing == Facing::Path && left >= turn_in && off.abs() > 1.0 {
            // Turns first: walking back for a long way only delays the turn.
            fastest *= (1.0 - (off.abs() - 1.0)).max(0.1);
        }
        let braking = (limits.acceleration * left).sqrt().min(CLOSING * left);
        v = (v + limits.acceleration * DT).min(fastest).min(braking);
        s = (s + v * DT).min(length);
        let next = along(path, s);
        let (sin, cos) = (0.5 * (heading + turned)).sin_cos();
        let step = [(next[0] - at[0]) / DT, (next[1] - at[1]) / DT];
        reference.velocities[i] =
            [cos * step[0] + sin * step[1], -sin * step[0] + cos * step[1], (turned - heading) / DT];
        (at, heading) = (next, turned);
        reference.poses[i] = [at[0], at[1], heading];
    }
    reference
}

/// What to follow of poses that are given for each time; `from` is the time when the first stage begins.
pub(crate) fn in_time(pose_at: &dyn Fn(f64) -> [f64; 3], from: f64) -> Reference {
    let mut reference = Reference::default();
    let mut before = pose_at(from);
    for i in 0..STAGES {
        let pose = pose_at(from + DT * (i + 1) as f64);
        let turned = wrap(pose[2] - before[2]);
        let (sin, cos) = (before[2] + 0.5 * turned).sin_cos();
        let step = [(pose[0] - before[0]) / DT, (pose[1] - before[1]) / DT];
        reference.velocities[i] = [cos * step[0] + sin * step[1], -sin * step[0] + cos * step[1], turned / DT];
        reference.poses[i] = pose;
        before = pose;
    }
    reference
}

/// Straight lines between corners at a speed, turns on the spot between them: paper 4's star is one.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedCorners {
    /// Each corner: when it is reached, when it is left (s), where (m), heading of the leg that ends there, rad.
    corners: Vec<(f64, f64, [f64; 2], f64)>,
}

impl TimedCorners {
    /// Through `corners` at `speed` (m/s), turning at `turn` (rad/s).
    #[must_use]
    pub fn new(corners: &[[f64; 2]], speed: f64, turn: f64) -> Self {
        let leg = |k: usize| {
            let (a, b) = (corners[k], corners[(k + 1).min(corners.len() - 1)]);
            [b[0] - a[0], b[1] - a[1]]
        };
        let mut time = 0.0;
        let mut heading = corners.first().map_or(0.0, |_| leg(0)[1].atan2(leg(0)[0]));
        let mut timed = Vec::with_capacity(corners.len());
        for (k, corner) in corners.iter().enumerate() {
            let [dx, dy] = leg(k);
            let next = if k + 1 < corners.len() { dy.atan2(dx) } else { heading };
            let leaves = time + wrap(next - heading).abs() / turn;
            timed.push((time, leaves, *corner, heading));
            time = leaves + dx.hypot(dy) / speed;
            heading = next;
        }
        Self { corners: timed }
    }

    /// The star of paper 4, Fig 9: `rounds` times round, in the middle of the attacked half, 0.5 m/s and 1 rad/s.
    #[must_use]
    pub fn star(rounds: usize) -> Self {
        let corners: Vec<[f64; 2]> = (0..=5 * rounds)
            .map(|k| {
                let (s, c) = (0.8 * std::f64::consts::PI * k as f64).sin_cos();
                [3.5 + 2.0 * c, 2.0 * s]
            })
            .collect();
        Self::new(&corners, 0.5, 1.0)
    }

    /// When the last corner is reached, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.corners.last().map_or(0.0, |corner| corner.0)
    }

    /// x, y and heading at a time.
    #[must_use]
    pub fn pose(&self, time: f64) -> [f64; 3] {
        let k = self.corners.partition_point(|corner| corner.0 <= time);
        let Some((arrives, leaves, at, heading)) = self.corners.get(k.saturating_sub(1)).copied() else {
            return [0.0; 3];
        };
        let Some((next, _, to, onward)) = self.corners.get(k.max(1)).copied() else { return [at[0], at[1], heading] };
        if time < leaves {
            let share = ((time - arrives) / (leaves - arrives)).clamp(0.0, 1.0);
            return [at[0], at[1], wrap(heading + share * wrap(onward - heading))];
        }
        let share = (time - leaves) / (next - leaves);
        [at[0] + share * (to[0] - at[0]), at[1] + share * (to[1] - at[1]), onward]
    }
}
