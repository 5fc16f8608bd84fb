//! The two layouts of `bitbots_msgs/action/Kick`: what a goal of each means as a [`KickRequest`], and its feedback.
//!
//! A goal's place and direction are both brought to the robot's footprint through TF (the public code of paper 2
//! transformed the ball alone). Then the dialects of instep-kick say what the numbers mean, so that a goal means the
//! same here as in a request file.

use std::fmt::Debug;

use instep_kick::dialect::{Context, Dialect, DialectError};
use instep_kick::{KickPlan, KickRequest, Progress};
use instep_motion::phase::Side;
use nalgebra::{Isometry3, Point3, Quaternion as Quat, UnitQuaternion, Vector3 as Vec3};
use ros2_client::Message;
use serde_json::json;

use crate::msg::{Kick2026Feedback, Kick2026Goal, KickFeedback, KickGoal};
use crate::tf::{TfBuffer, TfError};

/// The robot's frame in TF, on the ground between the soles (REP 120).
pub const FOOTPRINT: &str = "base_footprint";
/// The ball's frame in TF, for goals that do not say where the ball is.
pub const BALL: &str = "ball";

/// A direction must keep at least this share of its length when it is laid on the ground.
const FLAT: f64 = 0.1;

/// Why a goal is no request.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BadGoal {
    /// A number is NaN or infinite.
    #[error("{field} is {found}; expected a finite number")]
    NotFinite {
        /// The field.
        field: &'static str,
        /// As sent.
        found: f64,
    },
    /// No frame is named.
    #[error("header.frame_id is empty; expected a TF frame such as \"{FOOTPRINT}\"")]
    NoFrame,
    /// A quaternion that turns nothing.
    #[error("kick_direction has length {length:.3}; expected a unit quaternion")]
    NotUnit {
        /// Its length.
        length: f64,
    },
    /// A direction that points into the ground or the sky.
    #[error("kick_direction does not lie along the ground")]
    Steep,
    /// A direction of no length.
    #[error("the direction (x, y) is zero; expected a vector")]
    NoDirection,
    /// TF cannot bring it to the robot's frame.
    #[error("{what}: {cause}")]
    Tf {
        /// What was to be transformed.
        what: &'static str,
        /// Why it cannot be.
        cause: TfError,
    },
    /// The numbers do not make a request.
    #[error(transparent)]
    Meaning(#[from] DialectError),
}

/// One layout of the action.
pub trait Form: Send + 'static {
    /// Its goal.
    type Goal: Message + Clone + Debug + Send + 'static;
    /// Its feedback.
    type Feedback: Message + Debug + Send + 'static;

    /// What the goal asks, in the footprint frame.
    ///
    /// # Errors
    /// When it is malformed or cannot be transformed.
    fn request(goal: &Self::Goal, tf: &TfBuffer) -> Result<KickRequest, BadGoal>;

    /// How far the kick is.
    fn feedback(plan: &KickPlan, progress: &Progress) -> Self::Feedback;
}

/// Layout A, of paper 2's engine.
#[derive(Debug, Clone, Copy)]
pub struct Dynamic;

/// Layout B, of 2026.
#[derive(Debug, Clone, Copy)]
pub struct Form2026;

fn finite(fields: &[(&'static str, f64)]) -> Result<(), BadGoal> {
    match fields.iter().find(|(_, value)| !value.is_finite()) {
        Some(&(field, found)) => Err(BadGoal::NotFinite { field, found }),
        None => Ok(()),
    }
}

impl Form for Dynamic {
    type Goal = KickGoal;
    type Feedback = KickFeedback;

    fn request(goal: &KickGoal, tf: &TfBuffer) -> Result<KickRequest, BadGoal> {
        let (ball, turn) = (&goal.ball_position, &goal.kick_direction);
        finite(&[
            ("ball_position.x", ball.x),
            ("ball_position.y", ball.y),
            ("ball_position.z", ball.z),
            ("kick_direction.x", turn.x),
            ("kick_direction.y", turn.y),
            ("kick_direction.z", turn.z),
            ("kick_direction.w", turn.w),
            ("kick_speed", goal.kick_speed),
        ])?;
        let frame = goal.header.frame_id.as_str();
        if frame.is_empty() {
            return Err(BadGoal::NoFrame);
        }
        let turn = Quat::new(turn.w, turn.x, turn.y, turn.z);
        let length = turn.norm();
        if !((length - 1.0).abs() < 0.05) {
            return Err(BadGoal::NotUnit { length });
        }
        let stamp = goal.header.stamp.nanoseconds();
        let footprint_from_frame: Isometry3<f64> = tf
            .lookup(FOOTPRINT, frame, (stamp != 0).then_some(stamp))
            .map_err(|cause| BadGoal::Tf { what: "the goal's frame", cause })?;
        let at = footprint_from_frame * Point3::from(ball.array());
        let along = footprint_from_frame * (UnitQuaternion::new_normalize(turn) * Vec3::x());
        if along.xy().norm() < FLAT {
            return Err(BadGoal::Steep);
        }
        let half = 0.5 * along.y.atan2(along.x);
        let message = json!({
            "header": { "frame_id": FOOTPRINT },
            "ball_position": { "x": at.x, "y": at.y },
            "kick_direction": { "z": half.sin(), "w": half.cos() },
            "kick_speed": goal.kick_speed,
        });
        Ok(Dialect::BitbotsDynamic.parse(&message.to_string(), &Context::default())?)
    }

    fn feedback(plan: &KickPlan, progress: &Progress) -> KickFeedback {
        KickFeedback {
            chosen_foot: match plan.foot {
                Side::Left => 0,
                Side::Right => 1,
            },
            percent_done: percent(progress),
        }
    }
}

impl Form for Form2026 {
    type Goal = Kick2026Goal;
    type Feedback = Kick2026Feedback;

    fn request(goal: &Kick2026Goal, tf: &TfBuffer) -> Result<KickRequest, BadGoal> {
        let Kick2026Goal { x, y, strength, timeout } = *goal;
        finite(&[("x", x), ("y", y), ("strength", strength), ("timeout", timeout)])?;
        if x.hypot(y) < 1e-6 {
            return Err(BadGoal::NoDirection);
        }
        let ball = tf
            .lookup(FOOTPRINT, BALL, None)
            .map_err(|cause| BadGoal::Tf { what: "the goal does not say where the ball is", cause })?;
        let context = Context { ball: Some([ball.translation.x, ball.translation.y]), ..Context::default() };
        let message = json!({ "x": x, "y": y, "strength": strength, "timeout": timeout });
        Ok(Dialect::Bitbots2026.parse(&message.to_string(), &context)?)
    }

    fn feedback(plan: &KickPlan, progress: &Progress) -> Kick2026Feedback {
        Kick2026Feedback { time_remaining: plan.duration * (1.0 - progress.done) }
    }
}

/// Share that is done, in whole per cent.
pub(crate) fn percent(progress: &Progress) -> u8 {
    // The cast saturates.
    (100.0 * progress.done.clamp(0.0, 1.0)) as u8
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use instep_kick::Strength;

    use super::*;
    use crate::msg::{Header, Quaternion, Time, Transform, TransformStamped, Vector3};

    fn yaw(angle: f64) -> Quaternion {
        Quaternion { x: 0.0, y: 0.0, z: (0.5 * angle).sin(), w: (0.5 * angle).cos() }
    }

    fn goal(frame: &str, ball: [f64; 3], direction: f64) -> KickGoal {
        KickGoal {
            header: Header { stamp: Time::default(), frame_id: frame.into() },
            ball_position: Vector3::new(ball),
            kick_direction: yaw(direction),
            kick_speed: 1.0,
            unstable: false,
        }
    }

    /// The robot stands at odom (1, 2) and looks along odom's y axis; the ball lies 0.2 m ahead and 0.05 m to the left.
    fn tf() -> TfBuffer {
        let mut tf = TfBuffer::default();
        let mut put = |parent: &str, child: &str, at: [f64; 3], turn: f64| {
            let transform = Transform { translation: Vector3::new(at), rotation: yaw(turn) };
            let header = Header { stamp: Time::from_nanoseconds(5_000_000_000), frame_id: parent.into() };
            tf.insert(&TransformStamped { header, child_frame_id: child.into(), transform }, false).unwrap();
        };
        put("odom", FOOTPRINT, [1.0, 2.0, 0.0], FRAC_PI_2);
        put("odom", BALL, [0.95, 2.2, 0.1], 0.0);
        tf
    }

    #[test]
    fn ball_and_direction_are_both_transformed() {
        let request = Dynamic::request(&goal("odom", [0.95, 2.2, 0.1], FRAC_PI_2 + 0.3), &tf()).unwrap();
        assert!((request.ball[0] - 0.2).abs() < 1e-12 && (request.ball[1] - 0.05).abs() < 1e-12, "{request:?}");
        assert!((request.direction - 0.3).abs() < 1e-12);
        assert_eq!(request.strength, Strength::FootSpeed(1.0));
        // The footprint itself needs no TF.
        let same = Dynamic::request(&goal("/base_footprint", [0.2, 0.05, 0.0], 0.3), &TfBuffer::default()).unwrap();
        assert!((same.direction - 0.3).abs() < 1e-12 && same.ball == [0.2, 0.05]);
    }

    #[test]
    fn the_form_of_2026_takes_the_ball_from_tf() {
        let asked = Kick2026Goal { x: 1.0, y: -1.0, strength: 5.0, timeout: -1.0 };
        let request = Form2026::request(&asked, &tf()).unwrap();
        assert!((request.ball[0] - 0.2).abs() < 1e-12 && (request.direction + 0.5 * FRAC_PI_2).abs() < 1e-12);
        assert!(matches!(Form2026::request(&asked, &TfBuffer::default()), Err(BadGoal::Tf { .. })));
        for bad in [
            Kick2026Goal { x: f64::NAN, ..asked.clone() },
            Kick2026Goal { x: 0.0, y: 0.0, ..asked.clone() },
            Kick2026Goal { strength: 6.0, ..asked },
        ] {
            assert!(Form2026::request(&bad, &tf()).is_err(), "{bad:?}");
        }
    }

    #[test]
    fn malformed_goals_say_what_is_wrong() {
        let tf = tf();
        let good = goal("odom", [0.95, 2.2, 0.1], FRAC_PI_2);
        let why = |goal: &KickGoal| Dynamic::request(goal, &tf).unwrap_err().to_string();
        let mut bad = good.clone();
        bad.ball_position.y = f64::NAN;
        assert_eq!(why(&bad), "ball_position.y is NaN; expected a finite number");
        bad = good.clone();
        bad.kick_direction.w = f64::INFINITY;
        assert!(why(&bad).starts_with("kick_direction.w is inf"));
        bad = good.clone();
        bad.header.frame_id.clear();
        assert_eq!(why(&bad), "header.frame_id is empty; expected a TF frame such as \"base_footprint\"");
        bad.header.frame_id = "moon".into();
        assert!(why(&bad).contains("\"moon\" is not known to TF; known: ball, base_footprint, odom"), "{}", why(&bad));
        bad = good.clone();
        bad.kick_direction = Quaternion::default();
        assert_eq!(why(&bad), "kick_direction has length 0.000; expected a unit quaternion");
        bad.kick_direction =
            Quaternion { x: 0.0, y: std::f64::consts::FRAC_1_SQRT_2, z: 0.0, w: std::f64::consts::FRAC_1_SQRT_2 };
        assert_eq!(why(&bad), "kick_direction does not lie along the ground");
        bad = good;
        bad.header.stamp = Time { sec: 1000, nanosec: 0 };
        assert!(why(&bad).contains("the time asked is 1000.000 s"), "{}", why(&bad));
    }
}
