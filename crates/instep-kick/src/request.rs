//! What a team asks of a kick, and the causes for which an engine may say no.
//!
//! Frame of every request: the robot's footprint, that is the ground point midway between the two soles' centres (REP
//! 120), x along the mean heading of the soles, y left, z up. SI units, radians. Nothing here plans; the dialects of
//! other teams (facts/kick-interfaces.md, A to F) are read in [`crate::dialect`].

use instep_motion::phase::Side;
use instep_robot::Robot;
use mujoco_rs::prelude::MjtObjBase;
use serde::{Deserialize, Serialize};

use crate::ball::BallModel;

/// How strong a kick should be.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Strength {
    /// Speed of the ball as it leaves, m/s.
    BallSpeed(f64),
    /// Speed of the foot at contact, m/s (paper 2's and dialect A's `kick_speed`).
    FootSpeed(f64),
    /// How far the ball should roll, m; the engine's rolling deceleration turns it into a speed.
    Distance(f64),
}

impl Strength {
    /// Speed (m/s) with which `ball` is to leave when the foot's effective mass is `mass` (kg).
    pub(crate) fn ball_speed(self, ball: &BallModel, mass: f64) -> f64 {
        match self {
            Self::BallSpeed(v) => v,
            Self::FootSpeed(v) => v * ball.gain(mass),
            Self::Distance(d) => (2.0 * ball.deceleration * d).sqrt(),
        }
    }

    /// The number, whatever it means.
    #[must_use]
    pub fn value(self) -> f64 {
        match self {
            Self::BallSpeed(v) | Self::FootSpeed(v) | Self::Distance(v) => v,
        }
    }
}

/// One kick that is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KickRequest {
    /// Ball's centre on the ground plane in the footprint frame, m.
    pub ball: [f64; 2],
    /// Ball's velocity in the footprint frame, m/s.
    #[serde(default)]
    pub ball_velocity: [f64; 2],
    /// Wanted direction of the ball, rad from x toward y.
    pub direction: f64,
    /// Wanted strength.
    pub strength: Strength,
    /// Largest acceptable standard deviation of the direction, rad; `None`: any.
    #[serde(default)]
    pub precision: Option<f64>,
    /// Latest acceptable instant of contact, s after the plan; `None`: any.
    #[serde(default)]
    pub deadline: Option<f64>,
    /// Hold the foot retracted until [`crate::KickEngine::release`] (dialect E's `finishKick`).
    #[serde(default)]
    pub hold: bool,
    /// The foot to kick with; `None`: the engine chooses.
    #[serde(default)]
    pub foot: Option<Side>,
}

impl KickRequest {
    /// A kick of a resting ball at `ball` (m) toward `direction` (rad) that sends it off at `speed` (m/s).
    #[must_use]
    pub fn new(ball: [f64; 2], direction: f64, speed: f64) -> Self {
        Self {
            ball,
            ball_velocity: [0.0; 2],
            direction,
            strength: Strength::BallSpeed(speed),
            precision: None,
            deadline: None,
            hold: false,
            foot: None,
        }
    }

    /// Whether `other` asks for the same kick, wherever the ball is.
    #[must_use]
    pub fn differs_by_ball(&self, other: &Self) -> bool {
        Self { ball: other.ball, ball_velocity: other.ball_velocity, ..*self } == *other
    }

    /// The first thing in it that is not a finite number, or a strength that is not above zero.
    ///
    /// # Errors
    /// [`Refusal::NotFinite`] or [`Refusal::NoStrength`].
    pub fn check(&self) -> Result<(), Refusal> {
        let fields = [
            ("ball", self.ball[0]),
            ("ball", self.ball[1]),
            ("ball_velocity", self.ball_velocity[0]),
            ("ball_velocity", self.ball_velocity[1]),
            ("direction", self.direction),
            ("strength", self.strength.value()),
            ("precision", self.precision.unwrap_or(0.0)),
            ("deadline", self.deadline.unwrap_or(0.0)),
        ];
        if let Some((field, _)) = fields.iter().find(|(_, value)| !value.is_finite()) {
            return Err(Refusal::NotFinite { field });
        }
        if self.strength.value() <= 0.0 {
            return Err(Refusal::NoStrength { asked: self.strength.value() });
        }
        Ok(())
    }
}

/// Why an engine will not kick. Said before the robot moves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, thiserror::Error)]
#[serde(rename_all = "snake_case", tag = "cause")]
pub enum Refusal {
    /// A field of the request is NaN or infinite.
    #[error("{field} is not a finite number")]
    NotFinite {
        /// The field.
        field: &'static str,
    },
    /// A strength of zero or below.
    #[error("a strength of {asked} cannot move a ball; expected a number above 0")]
    NoStrength {
        /// As asked.
        asked: f64,
    },
    /// The ball is behind the robot.
    #[error("the ball is behind the robot (x {x:.3} m, at least {least:.3} m is needed)")]
    BallBehind {
        /// Ball's x, m.
        x: f64,
        /// Least x of a ball that is not behind, m.
        least: f64,
    },
    /// The ball overlaps a foot or lies between the feet.
    #[error("the ball is under the robot ({gap:.3} m from a foot's outline, at least {least:.3} m is needed)")]
    BallUnderRobot {
        /// Distance from the ball's surface to the nearest foot's outline, negative where they overlap, m.
        gap: f64,
        /// What is needed, m.
        least: f64,
    },
    /// The ball is farther away than a leg is long: walk first.
    #[error("the ball is {distance:.2} m away, farther than the {reach:.2} m that a leg can reach: walk to it first")]
    TooFar {
        /// Distance of the ball's centre from the footprint, m.
        distance: f64,
        /// Largest distance, m.
        reach: f64,
    },
    /// The ball rolls, and the engine kicks one that rests.
    #[error("the ball rolls at {speed:.2} m/s; this engine kicks a ball that rests (at most {most:.2} m/s)")]
    BallRolls {
        /// Its speed, m/s.
        speed: f64,
        /// Largest speed, m/s.
        most: f64,
    },
    /// No foot pose on the way is within the joints' ranges.
    #[error("the {foot} foot misses its {place} by {gap:.3} m within the joints' ranges")]
    Unreachable {
        /// The foot that came nearest.
        foot: Side,
        /// Which place of the swing.
        place: Place,
        /// How far off, m (1 rad of orientation counts as 0.1 m).
        gap: f64,
    },
    /// On the way two parts of the robot would touch.
    #[error("with the {foot} foot two parts of the robot come within {gap:.3} m of each other (pair {pair})")]
    SelfCollision {
        /// The foot.
        foot: Side,
        /// Which pair, as an index into the robot's self-collision pairs.
        pair: usize,
        /// Smallest gap, m; negative is an overlap.
        gap: f64,
    },
    /// On the way the kicking foot would come too near to the ground.
    #[error("the {foot} foot comes within {gap:.3} m of the ground")]
    HitsGround {
        /// The foot.
        foot: Side,
        /// Height of its lowest point, m.
        gap: f64,
    },
    /// The motors cannot do it.
    #[error("{asked:.2} m/s at the {foot} foot asks {share:.2} times what joint {joint} can do")]
    TooFast {
        /// The foot.
        foot: Side,
        /// Foot speed asked, m/s.
        asked: f64,
        /// Largest share of a joint's speed or torque limit.
        share: f64,
        /// Index of that joint.
        joint: usize,
    },
    /// The engine's strongest kick is weaker.
    #[error("{asked:.2} m/s at the {foot} foot is asked, the engine's settings give {most:.2} m/s at most")]
    TooStrong {
        /// The foot.
        foot: Side,
        /// Foot speed asked, m/s.
        asked: f64,
        /// Largest foot speed, m/s.
        most: f64,
    },
    /// The motors cannot hold the robot on one foot in a pose on the way.
    #[error("with the {foot} foot the joint {joint} would have to hold {share:.2} times what its motor can")]
    TooHeavy {
        /// The kicking foot.
        foot: Side,
        /// Largest share of a motor's torque at rest.
        share: f64,
        /// Index of that joint.
        joint: usize,
    },
    /// The planned centre of pressure leaves the support foot.
    #[error("with the {foot} foot the robot would tip: centre of pressure {by:.3} m outside the support foot")]
    OffBalance {
        /// The kicking foot.
        foot: Side,
        /// How far outside, m.
        by: f64,
    },
    /// The contact would come after the deadline.
    #[error("the contact would come after {contact:.2} s, the deadline is {deadline:.2} s")]
    TooLate {
        /// Instant of contact, s after the plan.
        contact: f64,
        /// The deadline, s.
        deadline: f64,
    },
    /// The engine cannot aim that well.
    #[error("a standard deviation of {asked:.3} rad is asked, {possible:.3} rad is what this kick has")]
    TooImprecise {
        /// As asked, rad.
        asked: f64,
        /// What the engine's settings state for this kind of kick, rad.
        possible: f64,
    },
    /// Within the measured grid of reachable places no part of a foot can be brought behind the ball, or none so that it
    /// moves in the wanted direction.
    #[error("the ball is outside what a foot can reach for that direction")]
    OutsideGrid {
        /// The foot that was asked for.
        foot: Option<Side>,
    },
    /// On its way back the foot would touch the ball.
    #[error("on its way to the wind-up point the {foot} foot would come within {gap:.3} m of the ball")]
    BrushesBall {
        /// The foot.
        foot: Side,
        /// Smallest gap, m; negative is an overlap.
        gap: f64,
    },
    /// An update of a kick that is over or was never asked.
    #[error("no kick is under way whose ball could be updated")]
    NoKick,
    /// An update that comes too late.
    #[error("the strike has begun: the ball cannot be followed any more")]
    Struck,
    /// A kick is under way.
    #[error("a kick is under way; cancel it first")]
    Busy,
    /// The robot does not stand as it should before a kick.
    #[error("the robot is not in its standing pose: joint {joint} is {off:.2} rad off")]
    NotStanding {
        /// Index of the joint.
        joint: usize,
        /// How far off, rad.
        off: f64,
    },
    /// The robot is not in the pose from which the engine's kick starts.
    #[error("the robot is not in the pose from which this kick starts: joint {joint} is {off:.2} rad off")]
    NotAtStart {
        /// Index of the joint.
        joint: usize,
        /// How far off, rad.
        off: f64,
    },
    /// The engine has learned one kick, and another is asked.
    #[error("{} is {}; only one kick was learned: ball at ({:.3}, {:.3}) m, {:.0} degrees, {:.1} m/s",
        .what, off_text(.what, *.off, *.most), .ball[0], .ball[1], .direction.to_degrees(), .ball_speed)]
    OtherKick {
        /// What differs.
        what: Learned,
        /// By how much: m, m/s or rad.
        off: f64,
        /// By how much it may.
        most: f64,
        /// Where the ball of the learned kick lies, m.
        ball: [f64; 2],
        /// Where it goes, rad.
        direction: f64,
        /// How fast, m/s.
        ball_speed: f64,
    },
    /// The engine kicks with one foot, and the other is asked.
    #[error("the kick was learned with the {foot} foot only")]
    OtherFoot {
        /// The foot that it has.
        foot: Side,
    },
    /// The engine cannot hold the foot back.
    #[error("the foot of a kick out of a run-up cannot be held back; ask without `hold`")]
    CannotHold,
}

/// A part of a learned kick that a request may ask otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Learned {
    /// Where the ball lies.
    Ball,
    /// That it lies still.
    Rest,
    /// Where it is to go.
    Direction,
    /// How fast.
    Speed,
}

impl std::fmt::Display for Learned {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Ball => "the ball",
            Self::Rest => "the ball's motion",
            Self::Direction => "the direction",
            Self::Speed => "the ball's speed",
        })
    }
}

/// By how much a part of a kick is another, in its unit.
fn off_text(what: &Learned, off: f64, most: f64) -> String {
    match what {
        Learned::Ball => format!("{off:.3} m off its place, at most {most:.3} m is possible"),
        Learned::Direction => {
            format!("{:.1} degrees off, at most {:.1} is possible", off.to_degrees(), most.to_degrees())
        }
        Learned::Rest => format!("{off:.2} m/s, at most {most:.2} m/s is possible"),
        Learned::Speed => format!("{off:.2} m/s off, at most {most:.2} m/s is possible"),
    }
}

impl Refusal {
    /// The message for people, with the names of `robot`'s joints.
    #[must_use]
    pub fn explain(&self, robot: &Robot) -> String {
        let name = |joint: usize| robot.joints.get(joint).map_or("?", |joint| joint.name.as_str());
        match self {
            Self::TooFast { foot, asked, share, joint } => format!(
                "{asked:.2} m/s at the {foot} foot asks {share:.2} times what {} can do; a slower kick may be possible",
                name(*joint)
            ),
            Self::TooHeavy { foot, share, joint } => {
                format!("with the {foot} foot {} would have to hold {share:.2} times what its motor can", name(*joint))
            }
            Self::NotStanding { joint, off } => {
                format!("the robot is not in its standing pose: {} is {off:.2} rad off", name(*joint))
            }
            Self::NotAtStart { joint, off } => {
                format!(
                    "the robot is not in the pose from which this kick starts: {} is {off:.2} rad off",
                    name(*joint)
                )
            }
            Self::SelfCollision { foot, gap, pair } => {
                let part = |geom: usize| robot.model().id_to_name(MjtObjBase::mjOBJ_GEOM, geom).unwrap_or("?");
                let [a, b] = robot.self_collision.get(*pair).map_or(["?"; 2], |pair| pair.map(part));
                format!("with the {foot} foot {a} and {b} come within {gap:.3} m of each other")
            }
            other => other.to_string(),
        }
    }

    /// A short name for tables.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::NotFinite { .. } => "not_finite",
            Self::NoStrength { .. } => "no_strength",
            Self::BallBehind { .. } => "ball_behind",
            Self::BallUnderRobot { .. } => "ball_under_robot",
            Self::TooFar { .. } => "too_far",
            Self::BallRolls { .. } => "ball_rolls",
            Self::Unreachable { .. } => "unreachable",
            Self::SelfCollision { .. } => "self_collision",
            Self::HitsGround { .. } => "hits_ground",
            Self::TooFast { .. } => "too_fast",
            Self::TooStrong { .. } => "too_strong",
            Self::TooHeavy { .. } => "too_heavy",
            Self::OffBalance { .. } => "off_balance",
            Self::TooLate { .. } => "too_late",
            Self::TooImprecise { .. } => "too_imprecise",
            Self::OutsideGrid { .. } => "outside_grid",
            Self::BrushesBall { .. } => "brushes_ball",
            Self::NoKick => "no_kick",
            Self::Struck => "struck",
            Self::Busy => "busy",
            Self::NotStanding { .. } => "not_standing",
            Self::NotAtStart { .. } => "not_at_start",
            Self::OtherKick { .. } => "other_kick",
            Self::OtherFoot { .. } => "other_foot",
            Self::CannotHold => "cannot_hold",
        }
    }
}

/// A place of the swing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Place {
    /// The wind-up point of equation (2).
    WindUp,
    /// Where the foot meets the ball.
    Contact,
    /// Where the foot comes to rest after it.
    FollowThrough,
    /// Between these.
    Way,
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::WindUp => "wind-up point",
            Self::Contact => "contact point",
            Self::FollowThrough => "follow-through point",
            Self::Way => "way",
        })
    }
}
