//! Everything that walking can be told, with a default for each robot that follows from its size (`robot.toml`), and what its
//! `walk.toml` says otherwise.
//!
//! Lengths scale with the height H of the centre of mass, times with sqrt(H / g), moments with m g H: the defaults are those
//! that walk ARTEMIS (H 0.705 m), and they walk others.

use std::path::Path;

use instep_motion::phase::Side;
use instep_robot::Robot;
use instep_robot::drive::DriveKind;
use serde::{Deserialize, Serialize};

use crate::WalkError;

/// Acceleration of free fall, m/s^2.
pub(crate) const GRAVITY: f64 = 9.81;
/// The settings' file in a robot's folder.
const FILE: &str = "walk.toml";

/// A walking velocity in the robot's heading frame.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Velocity {
    /// Ahead, m/s.
    pub x: f64,
    /// To the left, m/s.
    pub y: f64,
    /// Counter-clockwise, rad/s.
    pub turn: f64,
}

impl Velocity {
    /// Whether it is a stand.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        *self == Self::default()
    }
}

/// How a robot walks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WalkSettings {
    /// The gait.
    pub gait: Gait,
    /// What may be asked.
    pub limits: Limits,
    /// Weights and gains of the whole-body controller.
    pub control: Control,
    /// What goes to the drives.
    pub drive: Drive,
}

/// The gait.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gait {
    /// Time of a step, s. Shorter is safer across, longer faster.
    pub step_time: f64,
    /// Distance between the feet across, m.
    pub width: f64,
    /// Height of the centre of mass over the ground, m. Too high and the knee is straight at the end of a step: the robot vaults.
    pub height: f64,
    /// Height of the swing foot at mid-swing, m.
    pub clearance: f64,
    /// Share of the momentum error that a step takes away; 1 over-steps as soon as the body rises.
    pub alpha: f64,
    /// Real mean speed over that of the pendulum: what it leaves out (the swing leg, the ankle).
    pub speed_gain: f64,
    /// How fast the foot comes down, m/s.
    pub landing_speed: f64,
    /// Phase before which a contact of the swing foot is not a touchdown.
    pub earliest: f64,
    /// How long after its time a touchdown is taken for granted, s.
    pub latest: f64,
    /// Farthest foothold ahead or back, m.
    pub reach: f64,
    /// Nearest and farthest foothold across, m: no crossing, no split.
    pub across: [f64; 2],
    /// Time at a start in which the weight goes toward the foot that is lifted first, s; from there it falls over the other one.
    pub start_time: f64,
    /// Forward lean of the base, rad.
    pub lean: f64,
}

/// What may be asked.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Fastest ahead, m/s.
    pub forward: f64,
    /// Fastest back, m/s.
    pub backward: f64,
    /// Fastest sideways, m/s.
    pub sideways: f64,
    /// Fastest turn, rad/s.
    pub turn: f64,
    /// Largest change of the velocity ahead and across, m/s^2.
    pub acceleration: f64,
    /// Largest change of the turn, rad/s^2.
    pub turn_acceleration: f64,
}

/// Weights (1), stiffnesses (1/s^2) and dampings (1/s) of the whole-body controller's tasks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Control {
    /// Contact points of a foot on the ground stay where they are.
    pub stance: Task,
    /// Base orientation about x and y.
    pub base: Task,
    /// Base orientation about z.
    pub base_yaw: Task,
    /// Height of the centre of mass.
    pub height: Task,
    /// Centre of mass over the ground, on both feet.
    pub shift: Task,
    /// Swing foot's place.
    pub swing: Task,
    /// Swing foot's orientation.
    pub swing_turn: Task,
    /// Arms and neck.
    pub arms: Task,
    /// Legs' posture: what the other tasks leave free.
    pub legs: Task,
    /// Weight of a moment of the ground about the contact, 1/(N m)^2: without it the centre of pressure wanders.
    pub moment: f64,
    /// Yaw momentum about the centre of mass is damped.
    pub yaw_momentum: Task,
    /// Friction between sole and ground that the forces keep; below what is there.
    pub friction: f64,
    /// Largest force on one contact point, as a share of the weight.
    pub largest_force: f64,
    /// How far ahead joint limits are seen, s.
    pub look_ahead: f64,
    /// Share of the drives' torque that is used.
    pub torque_share: f64,
}

/// A task: how much it counts and how it is followed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Task {
    /// Weight.
    pub weight: f64,
    /// Stiffness, 1/s^2.
    pub kp: f64,
    /// Damping, 1/s.
    pub kd: f64,
}

impl Task {
    const fn new(weight: f64, kp: f64, kd: f64) -> Self {
        Self { weight, kp, kd }
    }
}

/// What goes to the drives besides the torque.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drive {
    /// How fast the integrated joint reference goes back to what is measured, 1/s. Smaller leans more on the drives' own
    /// stiffness, which makes up for friction.
    pub leak: f64,
    /// How position servos are led.
    pub servo: Servo,
}

/// How position servos are led; see [`crate::pattern`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Servo {
    /// How far the ankles turn against a tilt of the trunk, rad/rad: stiffness beyond the servo's own, as a share of it.
    pub tilt: f64,
    /// See `tilt`; for its rate, s.
    pub rate: f64,
    /// Lag of the tilt that they see, s.
    pub lag: f64,
    /// Phase from which a foot that touches the ground ends the step; much before it, left and right steps drift apart.
    pub earliest: f64,
}

impl WalkSettings {
    /// What follows from the robot alone.
    ///
    /// # Errors
    /// Which part of the robot walking needs and it has not.
    pub fn of(robot: &Robot) -> Result<Self, WalkError> {
        let missing = |missing: String, expected: &str| {
            Err(WalkError::Robot { robot: robot.name.clone(), missing, expected: expected.into() })
        };
        for side in [Side::Left, Side::Right] {
            let points = robot.contacts.iter().filter(|contact| contact.leg == side).count();
            let least = if robot.leg(side).ankle_roll.is_some() { 3 } else { 2 };
            if points < least {
                return missing(
                    format!("leg.{side} has {points} contact points"),
                    if least == 3 {
                        "at least 3 [[contact]] a foot with ankle roll"
                    } else {
                        "at least 2 [[contact]] a foot"
                    },
                );
            }
        }
        let data = robot.data();
        let ground = |side: usize| data.point(&robot.legs[side].sole);
        let width = ground(0).y - ground(1).y;
        let standing = data.com().z;
        if !(width > 0.02 && standing > 0.05) {
            return missing(
                format!(
                    "in the standing pose the soles are {width:.3} m apart and the centre of mass {standing:.3} m high"
                ),
                "the left foot to the left of the right one, and [stand] a stand",
            );
        }
        let is_servo = robot.drives.kind == DriveKind::PositionServo;
        let of = |torque: f64, servo: f64| if is_servo { servo } else { torque };
        let height = 0.91 * standing;
        let time = (height / GRAVITY).sqrt();
        // Gains are in units of the pendulum's time: 0.268 s for ARTEMIS.
        let rate = 0.268 / time;
        let task = |weight: f64, kp: f64, kd: f64| Task::new(weight, kp * rate.powi(2).min(2.0), kd * rate.min(1.4));
        Ok(Self {
            gait: Gait {
                // Servos are late: they want slower steps, higher ones, longer waits and a body that leans into its way. Their numbers were fitted
                // to NAO and Wolfgang together.
                step_time: of(1.49, 2.02) * time,
                width: of(1.1, 1.03) * width,
                height,
                clearance: of(0.1, 0.155) * height,
                alpha: 0.9,
                speed_gain: 0.92,
                landing_speed: of(0.15, 0.077) * (height / 0.705).sqrt(),
                earliest: 0.7,
                latest: of(0.11, 0.7) * time,
                reach: 0.92 * height,
                across: [0.55 * width, 0.78 * height],
                start_time: 2.0 * time,
                lean: of(0.03, 0.115),
            },
            limits: Limits {
                forward: of(0.57, 0.19) * (GRAVITY * height).sqrt(),
                backward: of(0.2, 0.1) * (GRAVITY * height).sqrt(),
                sideways: of(0.152, 0.08) * (GRAVITY * height).sqrt(),
                turn: of(1.2, 0.8),
                acceleration: of(0.15, 0.05) * GRAVITY,
                turn_acceleration: 2.0,
            },
            control: Control {
                stance: task(50.0, 0.0, 30.0),
                base: task(30.0, 200.0, 28.0),
                base_yaw: task(10.0, 100.0, 20.0),
                height: task(1000.0, 120.0, 22.0),
                shift: task(30.0, 100.0, 20.0),
                swing: task(300.0, 500.0, 40.0),
                swing_turn: task(20.0, 400.0, 35.0),
                arms: task(2.0, 60.0, 12.0),
                legs: task(0.02, 60.0, 12.0),
                // 0.2 for ARTEMIS; fitted to what other robots wanted (PresToe 0.5, Wolfgang 5, NAO 10).
                moment: 0.2 * (259.0 / (robot.mass() * GRAVITY * height)).powf(1.3),
                yaw_momentum: task(0.002, 0.0, 10.0),
                friction: 0.6,
                largest_force: 2.5,
                look_ahead: 0.06,
                torque_share: 1.0,
            },
            drive: Drive { leak: 10.0, servo: Servo { tilt: 0.25, rate: 0.58 * time, lag: 0.016, earliest: 0.97 } },
        })
    }

    /// [`Self::of`], changed by the `walk.toml` of the robot's folder, if there is one.
    ///
    /// # Errors
    /// As [`Self::of`], or when the file is not what it should be.
    pub fn load(robot: &Robot) -> Result<Self, WalkError> {
        let file = robot.folder().join(FILE);
        if !file.exists() {
            return Self::of(robot);
        }
        let text = std::fs::read_to_string(&file)
            .map_err(|e| WalkError::Read { file: file.display().to_string(), detail: e.to_string() })?;
        Self::parse(robot, &file, &text)
    }

    /// [`Self::of`], changed by `text`, the content of `file`.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn parse(robot: &Robot, file: &Path, text: &str) -> Result<Self, WalkError> {
        let wrong = |detail: String| WalkError::Parse {
            file: file.display().to_string(),
            detail: detail.trim_end().to_owned(),
        };
        let changes: toml::Table = toml::from_str(text).map_err(|e| wrong(e.to_string()))?;
        let mut whole = toml::Table::try_from(Self::of(robot)?).map_err(|e| wrong(e.to_string()))?;
        merge(&mut whole, changes);
        let settings: Self = whole.try_into().map_err(|e: toml::de::Error| wrong(e.to_string()))?;
        settings.validate(file)?;
        Ok(settings)
    }

    fn validate(&self, file: &Path) -> Result<(), WalkError> {
        let check = |field: &str, value: f64, good: bool, expected: &str| {
            if good && value.is_finite() {
                return Ok(());
            }
            let (file, field) = (file.display().to_string(), field.to_owned());
            Err(WalkError::Setting { file, field, found: value.to_string(), expected: expected.into() })
        };
        let (gait, limits, control) = (&self.gait, &self.limits, &self.control);
        check("gait.step_time", gait.step_time, (0.05..=2.0).contains(&gait.step_time), "0.05 to 2 s")?;
        check("gait.alpha", gait.alpha, (0.5..=1.0).contains(&gait.alpha), "0.5 to 1")?;
        check("gait.earliest", gait.earliest, (0.3..=1.0).contains(&gait.earliest), "0.3 to 1")?;
        for (field, value) in [
            ("gait.width", gait.width),
            ("gait.height", gait.height),
            ("gait.clearance", gait.clearance),
            ("gait.speed_gain", gait.speed_gain),
            ("gait.landing_speed", gait.landing_speed),
            ("gait.latest", gait.latest),
            ("gait.reach", gait.reach),
            ("gait.across[0]", gait.across[0]),
            ("gait.start_time", gait.start_time),
            ("limits.acceleration", limits.acceleration),
            ("limits.turn_acceleration", limits.turn_acceleration),
            ("control.friction", control.friction),
            ("control.largest_force", control.largest_force),
            ("control.look_ahead", control.look_ahead),
            ("control.torque_share", control.torque_share),
        ] {
            check(field, value, value > 0.0, "a number above 0")?;
        }
        check("gait.across[1]", gait.across[1], gait.across[1] > gait.across[0], "more than gait.across[0]")?;
        check("gait.lean", gait.lean, gait.lean.abs() < 0.5, "within 0.5 rad")?;
        for (field, value) in [
            ("limits.forward", limits.forward),
            ("limits.backward", limits.backward),
            ("limits.sideways", limits.sideways),
            ("limits.turn", limits.turn),
            ("control.moment", control.moment),
            ("drive.leak", self.drive.leak),
            ("drive.servo.tilt", self.drive.servo.tilt),
            ("drive.servo.rate", self.drive.servo.rate),
            ("drive.servo.lag", self.drive.servo.lag),
            ("drive.servo.earliest", self.drive.servo.earliest),
        ] {
            check(field, value, value >= 0.0, "a number of at least 0")?;
        }
        for (name, task) in [
            ("stance", control.stance),
            ("base", control.base),
            ("base_yaw", control.base_yaw),
            ("height", control.height),
            ("shift", control.shift),
            ("swing", control.swing),
            ("swing_turn", control.swing_turn),
            ("arms", control.arms),
            ("legs", control.legs),
            ("yaw_momentum", control.yaw_momentum),
        ] {
            for (part, value) in [("weight", task.weight), ("kp", task.kp), ("kd", task.kd)] {
                check(&format!("control.{name}.{part}"), value, value >= 0.0, "a number of at least 0")?;
            }
        }
        Ok(())
    }
}

impl Limits {
    /// `now` after `period` (s) on its way to `asked`: as fast as is allowed, and `brake` times as fast where it slows down.
    #[must_use]
    pub fn approach(&self, now: Velocity, asked: Velocity, brake: f64, period: f64) -> Velocity {
        let toward = |from: f64, to: f64, rate: f64| {
            let most = rate * period * if to.abs() < from.abs() { brake } else { 1.0 };
            from + (to - from).clamp(-most, most)
        };
        Velocity {
            x: toward(now.x, asked.x, self.acceleration),
            y: toward(now.y, asked.y, self.acceleration),
            turn: toward(now.turn, asked.turn, self.turn_acceleration),
        }
    }

    /// The velocity nearest to `asked` that the robot is allowed: an ellipse ahead and across, and the turn.
    #[must_use]
    pub fn clip(&self, asked: Velocity) -> Velocity {
        let ahead = if asked.x < 0.0 { self.backward } else { self.forward };
        let finite = |value: f64| if value.is_finite() { value } else { 0.0 };
        let (x, y, turn) = (finite(asked.x), finite(asked.y), finite(asked.turn));
        let share = |value: f64, limit: f64| {
            if limit > 0.0 {
                value / limit
            } else if value == 0.0 {
                0.0
            } else {
                f64::INFINITY
            }
        };
        let size = share(x, ahead).hypot(share(y, self.sideways));
        let scale = if size > 1.0 { 1.0 / size } else { 1.0 };
        let held = |value: f64, limit: f64| (value * scale).clamp(-limit, limit);
        Velocity { x: held(x, ahead), y: held(y, self.sideways), turn: turn.clamp(-self.turn, self.turn) }
    }
}

fn merge(whole: &mut toml::Table, changes: toml::Table) {
    for (key, change) in changes {
        match (whole.get_mut(&key), change) {
            (Some(toml::Value::Table(inner)), toml::Value::Table(change)) => merge(inner, change),
            (_, change) => {
                whole.insert(key, change);
            }
        }
    }
}
