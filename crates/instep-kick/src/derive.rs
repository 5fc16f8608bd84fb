//! The engines' settings as they follow from a robot: so that a kick needs no file, and a file holds only what differs.
//!
//! Problem: an engine wants some sixty numbers. Nearly all of them scale with a few of the robot's own: lengths with the leg, times
//! with the leg's pendulum sqrt(leg / g), speeds with sqrt(g leg), heights at the ball with its radius, edges with the sole. The
//! factors are the ones that NAO's, Wolfgang's and PresToe's hand-set numbers have in common (0.25, 0.41 and 0.70 m of leg).
//!
//! [`Derive::of`] puts a file's values over the derived ones. A key that the settings do not have, or a value of another type, is
//! refused with its path. Not done: arms (they keep their standing angles), and what only a measurement tells (stated accuracy is
//! that of the robots measured).

use std::collections::BTreeMap;
use std::path::Path;

use instep_robot::Robot;
use serde::Serialize;
use toml::{Table, Value};

use crate::adaptive::{self, AdaptiveSettings};
use crate::ball::BallModel;
use crate::dynamic::{self, DynamicSettings};
use crate::preview::{self, PreviewSettings};
use crate::settings::Settings;
use crate::whole_body::{Feedback, Inclination, Limits, Pid, Stance, Times};
use crate::{KickError, preview::zmp::Trust};

/// Gravity, m/s^2.
const GRAVITY: f64 = 9.81;
/// Slowest tick of an engine whose robot takes commands faster, s: a plan's curves are smooth, and its loops slow.
const SLOWEST_TICK: f64 = 0.004;

/// What of a robot its settings follow from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Build {
    /// From the hip's pitch joint along thigh and shank to the sole, m.
    pub leg: f64,
    /// Half of the sole's width between its outermost contact points, m.
    pub half_sole_width: f64,
    /// Share of the hip roll motor's torque that carries the body on one leg, with the base level: m g w / torque, w the half distance of
    /// the feet, m without the standing leg.
    pub hip_load: f64,
    /// Radius of the ball that it plays, m.
    pub ball_radius: f64,
    /// Period at which an engine ticks, s.
    pub tick: f64,
}

impl Build {
    /// Of `robot` with the ball that it plays.
    #[must_use]
    pub fn of(robot: &Robot, ball: &BallModel) -> Self {
        let data = robot.data();
        let leg = &robot.legs[0];
        let turn = data.link_rotation(leg.sole.link).inverse();
        let across = robot.contacts.iter().filter(|contact| contact.leg == instep_motion::phase::Side::Left);
        let [low, high] = across.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], contact| {
            let y = (turn * (data.point(&contact.at) - data.point(&leg.sole))).y;
            [low.min(y), high.max(y)]
        });
        let apart = 0.5 * (data.point(&robot.legs[0].sole) - data.point(&robot.legs[1].sole)).xy().norm();
        let model = robot.model();
        // The leg hangs on the body of its first joint; joint 0 of the model is the base's free joint.
        let first = leg.joints().min().and_then(|joint| model.jnt_bodyid().get(joint + 1).copied());
        let standing = first.and_then(|link| model.body_subtreemass().get(usize::try_from(link).ok()?)).copied();
        let carried = robot.mass() - standing.unwrap_or(0.0);
        let torque = robot.joints.get(leg.hip_roll).map_or(f64::INFINITY, |joint| joint.torque);
        Self {
            leg: robot.leg_length(),
            hip_load: carried * GRAVITY * apart / torque,
            half_sole_width: (0.5 * (high - low)).max(0.0),
            ball_radius: ball.radius,
            tick: robot.drives.period.max(SLOWEST_TICK),
        }
    }

    /// Time in which the leg falls over like a pendulum on its head, s.
    fn pendulum(&self) -> f64 {
        (self.leg / GRAVITY).sqrt()
    }

    /// Speed of such a fall, m/s.
    fn fall(&self) -> f64 {
        (self.leg * GRAVITY).sqrt()
    }

    fn times(&self) -> Times {
        let unit = self.pendulum();
        Times {
            shift: tidy(4.0 * unit),
            settle: tidy(0.6 * unit),
            foot_speed: tidy(0.14 * self.fall()),
            foot_least: tidy(1.6 * unit),
            aim: 0.05,
            lower: tidy(1.8 * unit),
            shift_back: tidy(4.4 * unit),
        }
    }

    fn stance(&self) -> Stance {
        let aside = if self.half_sole_width > 0.02 { 0.012 * self.leg } else { 0.0 };
        // A base that rolls toward the standing foot brings the hip over it: 0.15 rad take off a fifth of a T1's load.
        let roll = (0.6 * (self.hip_load - 0.7)).clamp(0.0, 0.2);
        Stance { balance: [0.0, tidy(aside)], crouch: tidy(0.05 * self.leg), pitch: 0.0, roll: tidy(roll) }
    }

    fn limits(&self) -> Limits {
        Limits {
            speed: 0.95,
            torque: 1.2,
            hold: 0.95,
            joint_margin: 0.01,
            knee_bend: 0.25,
            reach: 0.008,
            clearance: tidy(0.007 * self.leg),
            // The planned centre of pressure may use the sole but for a rim; a line foot has no inside.
            edge: tidy(if self.half_sole_width > 0.02 { 0.2 * self.half_sole_width } else { -0.03 }),
            stand: 0.3,
        }
    }

    fn feedback(&self) -> Feedback {
        let pid = Pid { p: 0.0, i: 0.2, d: 0.0, limit: tidy(0.05 * self.leg) };
        Feedback {
            on: true,
            x: pid,
            y: pid,
            filter: 0.15,
            tilt: 0.6,
            rate: 0.2,
            moment: 0.9,
            catch: 0.12,
            follow_ball: true,
        }
    }

    /// Lift, follow-through and least height of the sole, m.
    fn way(&self) -> [f64; 3] {
        [0.1, 0.22, 0.05].map(|share| tidy(share * self.leg))
    }

    fn height(&self) -> f64 {
        tidy(-0.2 * self.ball_radius)
    }
}

/// Three digits: nobody measures a leg more finely, and a person reads it.
fn tidy(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// Settings that follow from a robot.
pub trait Derive: Settings + Serialize {
    /// The settings of a robot of this build.
    fn derive(build: &Build) -> Self;

    /// What `text` (TOML; `name` stands in errors) says, and for the rest what follows from the robot.
    ///
    /// # Errors
    /// When the text is no TOML, has a key that these settings do not have, or a value that cannot be: with the key's path.
    fn of(build: &Build, name: &str, text: &str) -> Result<Self, KickError> {
        let given: Table = toml::from_str(text)
            .map_err(|e| KickError::Parse { file: name.to_owned(), detail: e.to_string().trim_end().to_owned() })?;
        let mut table = Table::try_from(Self::derive(build))
            .map_err(|e| KickError::Parse { file: name.to_owned(), detail: e.to_string() })?;
        lay_over(&mut table, given, name, text, "")?;
        Self::parse(name, &table.to_string())
    }

    /// The settings of `robot`: derived, under what its folder's file says where there is one.
    ///
    /// # Errors
    /// As [`Derive::of`], or when the file is there and cannot be read.
    fn of_folder(build: &Build, folder: &Path) -> Result<Self, KickError> {
        let file = folder.join(Self::FILE);
        let name = file.display().to_string();
        let text = match std::fs::read_to_string(&file) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(error) => return Err(KickError::Read { file: name, detail: error.to_string() }),
        };
        Self::of(build, &name, &text)
    }
}

/// Puts the values of `over` into `table`; `path` is where both stand in their file.
fn lay_over(table: &mut Table, over: Table, file: &str, text: &str, path: &str) -> Result<(), KickError> {
    // A table without keys is a map from names that are free, such as joints to angles.
    let free = table.is_empty();
    for (key, value) in over {
        let field = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        let wrong = |found: String, expected: String| {
            let line = line_of(text, &key).map(|line| format!(":{line}")).unwrap_or_default();
            Err(KickError::Setting { field: format!("{file}{line}: {field}"), found, expected })
        };
        if free {
            table.insert(key, value);
            continue;
        }
        let known = table.keys().cloned().collect::<Vec<_>>().join(", ");
        match (table.get_mut(&key), value) {
            (None, _) => return wrong("an unknown key".into(), format!("one of {known}")),
            (Some(Value::Table(inner)), Value::Table(value)) => lay_over(inner, value, file, text, &field)?,
            (Some(old @ Value::Float(_)), Value::Integer(value)) => *old = Value::Float(value as f64),
            (Some(old), value) if old.same_type(&value) => *old = value,
            (Some(old), value) => {
                return wrong(format!("{} {value}", value.type_str()), format!("a {}", old.type_str()));
            }
        }
    }
    Ok(())
}

/// The first line of `text` that sets or opens `key`, counted from 1.
fn line_of(text: &str, key: &str) -> Option<usize> {
    let names = |line: &str| {
        line.trim_start_matches(['[', ' '])
            .strip_prefix(key)
            .is_some_and(|rest| rest.trim_start().starts_with(['=', ']', '.']))
    };
    text.lines().position(names).map(|at| at + 1)
}

impl Derive for DynamicSettings {
    fn derive(build: &Build) -> Self {
        let [lift, follow, sole_least] = build.way();
        Self {
            control_period: build.tick,
            coupled: Vec::new(),
            swing: dynamic::Swing {
                windup: tidy(0.33 * build.leg),
                windup_least: tidy(0.11 * build.leg),
                follow,
                lift,
                height: build.height(),
                sole_least,
                pitch: 1.0,
                speed_gain: 1.0,
                corridor: tidy(0.8 * build.leg),
                yaw: 0.9,
                base_yaw: 0.4,
            },
            times: build.times(),
            stance: build.stance(),
            arms: BTreeMap::new(),
            limits: build.limits(),
            accuracy: dynamic::Accuracy { front: 0.07, side: 0.12 },
            feedback: build.feedback(),
        }
    }
}

impl Derive for AdaptiveSettings {
    fn derive(build: &Build) -> Self {
        let [lift, follow, sole_least] = build.way();
        Self {
            control_period: build.tick,
            coupled: Vec::new(),
            kick: adaptive::Kick {
                delta: 0.999,
                true_shape: true,
                retraction: [tidy(0.05 * build.leg), tidy(0.25 * build.leg)],
                follow: tidy(0.7 * follow),
                lift,
                height: 0.0,
                sole_least,
                yaw: 0.8,
                base_yaw: 0.4,
                friction: 0.5,
                forecast_least: 0.8,
                speed_gain: 1.0,
                speed_least: 0.8,
                wait: 2.0,
            },
            times: build.times(),
            stance: build.stance(),
            arms: BTreeMap::new(),
            limits: build.limits(),
            accuracy: adaptive::Accuracy {
                front: [0.012, 0.012],
                side: [0.02, -0.02],
                corner: [0.02, 0.0],
                angle: 0.25,
            },
            stabiliser: adaptive::Stabiliser::Pressure,
            inclination: Inclination { gain: 0.5, limit: tidy(0.05 * build.leg), lean: 3.0, filter: 0.1 },
            feedback: build.feedback(),
        }
    }
}

impl Derive for PreviewSettings {
    fn derive(build: &Build) -> Self {
        let [lift, follow, sole_least] = build.way();
        let Feedback { x, y, filter, tilt, rate, moment, .. } = build.feedback();
        let unit = build.pendulum();
        Self {
            control_period: build.tick,
            com: preview::Com::General,
            stabilisers: vec![preview::Stabiliser::Pressure, preview::Stabiliser::Inertial],
            coupled: Vec::new(),
            regulator: preview::Weights { q: 1.0, r: 1e-6, horizon: tidy((10.0 * unit).min(4.0)) },
            trust: Trust { jerk: 20.0, com: 0.002, zmp: 0.01 },
            kick: preview::Kick { time: tidy(1.9 * unit), share: 0.5, via: 0.5, offset: [0.0; 3] },
            swing: preview::Swing {
                retraction: tidy(0.33 * build.leg),
                retraction_least: tidy(0.11 * build.leg),
                rise: 0.0,
                follow,
                follow_rise: 0.0,
                lift,
                height: build.height(),
                sole_least,
                pitch: 1.0,
                speed_gain: 1.0,
                corridor: tidy(0.8 * build.leg),
                yaw: 0.9,
                base_yaw: 0.4,
            },
            times: Times { settle: 0.0, shift: tidy(6.0 * unit), shift_back: tidy(6.0 * unit), ..build.times() },
            stance: build.stance(),
            arms: BTreeMap::new(),
            limits: build.limits(),
            accuracy: dynamic::Accuracy { front: 0.07, side: 0.12 },
            feedback: preview::Gains { preview: 1.0, x, y, filter, tilt, rate, moment },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: Build = Build { leg: 0.25, half_sole_width: 0.04, hip_load: 0.5, ball_radius: 0.05, tick: 0.012 };
    const TALL: Build = Build { leg: 0.9, half_sole_width: 0.0, hip_load: 1.2, ball_radius: 0.11, tick: 0.004 };

    fn build(name: &str) -> Build {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots").join(name);
        let robot = Robot::load(&folder).unwrap();
        Build::of(&robot, &BallModel::load(&folder).unwrap())
    }

    /// Against what the cards say: NAO's thigh, tibia and foot height; T1's thigh from the hip's pitch axis, shank, ankle and sole.
    #[test]
    fn a_build_is_measured_on_the_robot() {
        let (nao, t1, k1) = (build("nao"), build("t1"), build("k1"));
        assert!((nao.leg - (0.1 + 0.1029 + 0.04519)).abs() < 1e-3, "{nao:?}");
        let thigh = (0.02_f64 + 0.081854 + 0.134).hypot(0.014);
        assert!((t1.leg - (thigh + 0.28 + 0.012 + 0.03)).abs() < 2e-3, "{t1:?}");
        assert!((t1.half_sole_width - 0.045).abs() < 1e-9 && t1.ball_radius == 0.11, "{t1:?}");
        // A servo's engine ticks with its bus, one with fast drives at the slowest tick.
        assert_eq!((nao.tick, t1.tick), (0.012, SLOWEST_TICK));
        // T1's weak hip roll makes the base roll, K1's strong one does not.
        assert!(t1.hip_load > 0.8 && k1.hip_load < 0.6, "{t1:?} {k1:?}");
        assert!(DynamicSettings::derive(&t1).stance.roll > 0.05 && DynamicSettings::derive(&k1).stance.roll == 0.0);
    }

    #[test]
    fn every_build_has_settings_that_can_be() {
        for build in [SMALL, TALL] {
            DynamicSettings::of(&build, "d", "").unwrap();
            AdaptiveSettings::of(&build, "a", "").unwrap();
            PreviewSettings::of(&build, "p", "").unwrap();
        }
        let (small, tall) = (DynamicSettings::derive(&SMALL), DynamicSettings::derive(&TALL));
        assert!(small.swing.windup < tall.swing.windup && small.times.shift < tall.times.shift);
    }

    #[test]
    fn a_file_says_only_what_differs() {
        let text = "coupled = [[\"a\", \"b\"]]\n[swing]\nwindup = 1e-1\nyaw = 1\n[arms]\nLShoulderRoll = 0.3\n";
        let (given, derived) = (DynamicSettings::of(&SMALL, "d", text).unwrap(), DynamicSettings::derive(&SMALL));
        assert_eq!((given.swing.windup, given.swing.yaw, given.arms["LShoulderRoll"]), (0.1, 1.0, 0.3));
        assert_eq!(given.coupled.len(), 1);
        assert_eq!((given.times, given.swing.lift), (derived.times, derived.swing.lift));
    }

    #[test]
    fn what_no_settings_have_is_refused_by_its_path_and_line() {
        for (text, parts) in [
            ("\n[swing]\nwindupp = 0.1\n", ["robots/d.toml:3: swing.windupp", "an unknown key", "windup_least"]),
            ("[swing]\nwindup = \"far\"\n", ["robots/d.toml:2: swing.windup", "string", "a float"]),
            ("[times]\nshift = 99.0\n", ["robots/d.toml: times.shift", "99", "[0.1, 5]"]),
            ("swing = 3\n", ["robots/d.toml:1: swing", "integer", "a table"]),
            ("[swing\n", ["robots/d.toml", "line 1", "swing"]),
        ] {
            let error = DynamicSettings::of(&SMALL, "robots/d.toml", text).unwrap_err().to_string();
            assert!(parts.iter().all(|part| error.contains(part)), "{text:?}: {error}");
        }
    }
}
