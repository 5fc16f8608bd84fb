//! One robot as the dynamic engine knows it: its tree, its feet and its stand, seen from either support foot.

use std::collections::BTreeMap;
use std::sync::Arc;

use instep_motion::phase::Side;
use instep_robot::Robot;
use instep_robot::control::Sensors;
use nalgebra::{Rotation2, Rotation3, Vector2, Vector3};

use crate::KickError;
use crate::ball::BallModel;
use crate::gaze::neck;
use crate::request::Refusal;
use crate::whole_body::foot::Foot;
use instep_robot::tree::{Capsule, Tree, TreePose};

/// Gap between ball and rising foot, in units of the leg's length.
const AWAY: f64 = 0.08;

/// Distance of a point from a segment, m.
fn apart(point: &Vector3<f64>, [a, b]: &[Vector3<f64>; 2]) -> f64 {
    let along = b - a;
    let share = (along.dot(&(point - a)) / along.norm_squared().max(1e-18)).clamp(0.0, 1.0);
    (point - a - along * share).norm()
}

/// The robot standing, in the frame of one sole.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stand {
    /// The swing sole's centre, m.
    pub(crate) home: Vector3<f64>,
    /// Centre of mass, m.
    pub(crate) com: Vector3<f64>,
    /// Base height, m.
    pub(crate) height: f64,
    /// Base roll, pitch, yaw, rad.
    pub(crate) base: [f64; 3],
    /// Swing sole's yaw and pitch, rad.
    pub(crate) yaw_pitch: [f64; 2],
}

/// A robot with what the engine computes once.
#[derive(Debug)]
pub(crate) struct Body {
    /// Joints of the neck: they look elsewhere and stand all the same.
    neck: Vec<usize>,
    pub(crate) robot: Arc<Robot>,
    pub(crate) ball: BallModel,
    pub(crate) tree: Tree,
    /// Left foot, right foot.
    pub(crate) feet: [Foot; 2],
    /// By swing side: left, right.
    pub(crate) stands: [Stand; 2],
    /// Standing joint angles, rad.
    pub(crate) angles: Vec<f64>,
    /// Joints that leave the stand while the foot is up: index, standing angle, angle then.
    pub(crate) arms: Vec<(usize, f64, f64)>,
    /// Half the distance between the soles' centres, m.
    pub(crate) half_width: f64,
    /// Length of the straight leg from hip to sole, m.
    pub(crate) leg_length: f64,
    /// What of the left and right leg may strike a ball.
    pub(crate) strikers: [Vec<Capsule>; 2],
    /// The same of both legs in the stand, in the left sole's frame: ends of the axis and radius, m.
    standing: Vec<([Vector3<f64>; 2], f64)>,
}

/// The ankle roll joint of the leg on `side`, without which nobody stands on one foot.
pub(crate) fn ankle_roll(robot: &Robot, side: Side) -> Result<usize, KickError> {
    let missing = || KickError::MissingPart { robot: robot.name.clone(), side, part: "ankle_roll" };
    robot.leg(side).ankle_roll.ok_or_else(missing)
}

impl Body {
    pub(crate) fn new(robot: Arc<Robot>, ball: BallModel, wanted: &BTreeMap<String, f64>) -> Result<Self, KickError> {
        for side in [Side::Left, Side::Right] {
            ankle_roll(&robot, side)?;
        }
        let tree = Tree::new(&robot);
        let mut pose = tree.pose();
        let angles = robot.stand[7..].to_vec();
        tree.update(&angles, &mut pose);
        let feet = [Side::Left, Side::Right].map(|side| Foot::new(&robot, &tree, &pose, side));
        let stands = [Side::Left, Side::Right].map(|swing| {
            let (support, flying) = (robot.leg(swing.other()).sole, robot.leg(swing).sole);
            let (s, f) = (pose.point(&support), pose.point(&flying));
            let turn = pose.rotation[support.link].transpose();
            let relative = Rotation3::from_matrix_unchecked(turn * pose.rotation[flying.link]);
            let (_, pitch, yaw) = relative.euler_angles();
            let (base_roll, base_pitch, base_yaw) = Rotation3::from_matrix_unchecked(turn).euler_angles();
            Stand {
                home: turn * (f - s),
                com: turn * (tree.com(&pose) - s),
                height: (turn * (-s)).z,
                base: [base_roll, base_pitch, base_yaw],
                yaw_pitch: [yaw, pitch],
            }
        });
        let half_width = 0.5 * stands[0].home.y.abs();
        let leg_length = robot.leg_length();
        let arms = wanted
            .iter()
            .map(|(name, &angle)| {
                let wrong = |expected: String| KickError::Setting {
                    field: format!("arms.{name}"),
                    found: angle.to_string(),
                    expected,
                };
                let joint = robot
                    .joint_index(name)
                    .filter(|j| !robot.legs.iter().any(|leg| leg.joints().any(|of_leg| of_leg == *j)))
                    .ok_or_else(|| wrong(format!("a joint of {} that is no leg's", robot.name)))?;
                let [low, high] = robot.joints[joint].range;
                if !(low..=high).contains(&angle) {
                    return Err(wrong(format!("an angle in [{low}, {high}] rad")));
                }
                Ok((joint, angles[joint], angle))
            })
            .collect::<Result<_, _>>()?;
        let strikers = [Side::Left, Side::Right]
            .map(|side| robot.leg(side).strike.iter().map(|&geom| tree.capsule(&robot, geom)).collect::<Vec<_>>());
        let left = robot.leg(Side::Left).sole;
        let (turn, sole) = (pose.rotation[left.link].transpose(), pose.point(&left));
        let place = |capsule: &Capsule| (pose.axis_of(capsule).map(|end| turn * (end - sole)), capsule.radius);
        let standing = strikers.iter().flatten().map(place).collect();
        let neck = neck(&robot, &tree);
        Ok(Self { neck, robot, ball, tree, feet, stands, angles, arms, half_width, leg_length, strikers, standing })
    }

    /// Sets the joints that are no leg's: `share` 0 is the stand, 1 the foot up.
    pub(crate) fn set_arms(&self, share: f64, angles: &mut [f64]) {
        for (joint, stand, up) in &self.arms {
            angles[*joint] = stand + share * (up - stand);
        }
    }

    /// The stand as seen from the support foot of a kick with `swing`.
    pub(crate) fn stand(&self, swing: Side) -> &Stand {
        &self.stands[swing as usize]
    }

    /// The sole of the swing foot on its place: x, y, z, yaw, pitch.
    pub(crate) fn home(&self, swing: Side) -> [f64; 5] {
        let stand = self.stand(swing);
        let [yaw, pitch] = stand.yaw_pitch;
        [stand.home.x, stand.home.y, stand.home.z, yaw, pitch]
    }

    /// The same at the height `lift` (m).
    pub(crate) fn lifted(&self, swing: Side, lift: f64) -> [f64; 5] {
        let [x, y, _, yaw, pitch] = self.home(swing);
        [x, y, lift, yaw, pitch]
    }

    /// Height, roll, pitch and yaw of the base on the support foot: `crouch` (m) lower than in the stand, rolled toward
    /// that foot and pitched forward by `tilt`, turned by `yaw` (rad).
    pub(crate) fn base_support(&self, swing: Side, crouch: f64, tilt: [f64; 2], yaw: f64) -> [f64; 4] {
        let stand = self.stand(swing);
        let [base_roll, base_pitch, base_yaw] = stand.base;
        let [roll, pitch] = tilt;
        [stand.height - crouch, base_roll + Self::sign(swing) * roll, base_pitch + pitch, base_yaw + yaw]
    }

    /// Whether the robot stands, no joint farther than `most` (rad) from there.
    ///
    /// # Errors
    /// Names the joint.
    pub(crate) fn check_standing(&self, sensors: &Sensors, most: f64) -> Result<(), Refusal> {
        for (joint, (now, stand)) in sensors.joint_positions.iter().zip(&self.angles).enumerate() {
            if self.neck.contains(&joint) {
                continue;
            }
            let off = now - stand;
            // Written so that a NaN fails.
            if !matches!(off.abs().partial_cmp(&most), Some(o) if o.is_le()) {
                return Err(Refusal::NotStanding { joint, off });
            }
        }
        Ok(())
    }

    /// The swing sole's x, y, z (m), yaw and pitch (rad) in the support sole's frame, in `pose`.
    pub(crate) fn foot_in_support(&self, pose: &TreePose, swing: Side) -> [f64; 5] {
        let (support, flying) = (self.robot.leg(swing.other()).sole, self.robot.leg(swing).sole);
        let turn = pose.rotation[support.link].transpose();
        let at = turn * (pose.point(&flying) - pose.point(&support));
        let (_, pitch, yaw) = Rotation3::from_matrix_unchecked(turn * pose.rotation[flying.link]).euler_angles();
        [at.x, at.y, at.z, yaw, pitch]
    }

    /// Where a ball that is seen at `seen` (m, from the base's ground projection, in its heading) is in the support
    /// sole's frame, for a robot in `pose`.
    pub(crate) fn sighted(&self, pose: &TreePose, swing: Side, seen: [f64; 3]) -> Vector2<f64> {
        let sole = &self.robot.leg(swing.other()).sole;
        let turn = pose.rotation[sole.link].transpose();
        let base = turn * (-pose.point(sole));
        let yaw = turn[(1, 0)].atan2(turn[(0, 0)]);
        base.xy() + Rotation2::new(yaw) * Vector2::new(seen[0], seen[1])
    }

    /// A footprint point in the support sole's frame of a kick with `swing`.
    pub(crate) fn support_from_footprint(&self, swing: Side, point: [f64; 2]) -> [f64; 2] {
        let support_y = if swing == Side::Left { -self.half_width } else { self.half_width };
        [point[0], point[1] - support_y]
    }

    /// Refuses a ball (m, footprint frame) that touches the robot in its stand.
    ///
    /// # Errors
    /// [`Refusal::BallUnderRobot`].
    pub(crate) fn check_clear(&self, ball: [f64; 2]) -> Result<(), Refusal> {
        let [x, y] = self.support_from_footprint(Side::Right, ball);
        let centre = Vector3::new(x, y, self.ball.radius);
        let gaps = self.standing.iter().map(|(ends, radius)| apart(&centre, ends) - radius - self.ball.radius);
        let gap = gaps.fold(f64::INFINITY, f64::min);
        if gap <= 0.0 { Err(Refusal::BallUnderRobot { gap, least: 0.0 }) } else { Ok(()) }
    }

    /// Gap between a ball at `ball` (m, in the support sole's frame, on the ground) and the swing leg in `pose`, m.
    pub(crate) fn gap_to_ball(&self, pose: &TreePose, swing: Side, ball: Vector2<f64>) -> f64 {
        let sole = &self.robot.leg(swing.other()).sole;
        let centre = pose.rotation[sole.link] * Vector3::new(ball.x, ball.y, self.ball.radius) + pose.point(sole);
        let gap = |capsule: &Capsule| apart(&centre, &pose.axis_of(capsule)) - capsule.radius - self.ball.radius;
        self.strikers[swing as usize].iter().map(gap).fold(f64::INFINITY, f64::min)
    }

    /// How far the swing foot goes from a ball at `ball` (m, support sole's frame) while it rises, m: a ball that nearly touches it
    /// must not be brushed.
    pub(crate) fn away(&self, swing: Side, ball: Vector2<f64>) -> [f64; 2] {
        let (home, foot) = (self.stand(swing).home.xy(), &self.feet[swing as usize]);
        let ([back, front], [right, left]) = (foot.outline_x, foot.outline_y);
        let at = ball - home;
        let off = at - Vector2::new(at.x.clamp(back, front), at.y.clamp(right, left));
        let gap = off.norm() - self.ball.radius;
        let by = (AWAY * self.leg_length - gap).max(0.0);
        off.try_normalize(1e-9).map_or([0.0; 2], |off| (-off * by).into())
    }

    /// +1 for a left, -1 for a right swing foot: the side of the swing foot as seen from the support foot.
    pub(crate) fn sign(swing: Side) -> f64 {
        if swing == Side::Left { 1.0 } else { -1.0 }
    }
}
