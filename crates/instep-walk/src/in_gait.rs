//! A kick in the middle of a step: walks up to the ball on its line, has the steps fall so that the ball lies right for the
//! kicking foot, kicks by [`crate::plmk`], walks on and stops. The gait is never interrupted.
//!
//! The ball is known by sights alone, each put into the odometry's frame at the time when it was taken and averaged: a
//! resting ball. Power is how far the foot is led beyond the ball's surface, looked up from the wanted speed.

use std::sync::Arc;

use instep_motion::phase::Side;
use instep_robot::Robot;
use instep_robot::control::{Controller, JointCommand, Sensors};
use nalgebra::{Rotation2, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use crate::ball::BallMemory;
use crate::gait::Mode;
use crate::plmk::{KickCommander, Sight, Strike};
use crate::{Velocity, WalkError, WalkSettings, Walker, approach};

/// A sight older than this is not fresh, s.
const FRESH: f64 = 1.0;
/// How fast the run-up closes errors across and of the heading, 1/s.
const STEER: [f64; 2] = [1.2, 1.5];
/// Fastest step across in the run-up, m/s.
const ACROSS: f64 = 0.25;
/// Errors across (m) and of the heading (rad) with which a run-up may begin, and with which it is given up.
const LINE: [[f64; 2]; 2] = [[0.10, 0.12], [0.25, 0.5]];
/// Numbers of steps that the run-up looks at, and its speed at the least and at most, as shares of the wanted one.
const COUNTS: usize = 5;
/// See [`COUNTS`].
const PACE: [f64; 2] = [0.4, 1.5];
/// Phases of a swing that are looked at for the ball.
const PHASES: u32 = 100;
/// Steps after the kick before the stop.
const FOLLOW: usize = 2;

/// How a robot kicks within a step; from its `in-gait.toml`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InGaitSettings {
    /// Zone, window and strike point.
    pub strike: Strike,
    /// Ball's x from the support foot at lift-off that the run-up aims at, m.
    pub ideal: f64,
    /// Length of the run-up, from the ball to the robot, m.
    pub run_up: f64,
    /// For rising ball speeds: the speed of the run-up. Between them it is interpolated.
    pub pace: Vec<Pace>,
    /// Speed of the ball over that with which the planned swing meets it.
    pub gain: f64,
    /// Least and most that the foot is led beyond the ball's surface at mid-swing, m: the power is chosen between them.
    pub power: [f64; 2],
    /// Stated standard deviation of the direction, rad.
    pub precision: f64,
}

/// How fast to run up to a ball.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pace {
    /// Speed with which the ball is to leave, m/s.
    pub ball_speed: f64,
    /// Speed of the run-up, m/s.
    pub walk: f64,
}

/// What is asked: in the frame of the start, m and rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aim {
    /// Where the ball is said to be.
    pub ball: [f64; 2],
    /// Direction of the kick.
    pub direction: f64,
    /// Speed of the ball, m/s.
    pub speed: f64,
    /// The foot, where it matters.
    pub foot: Option<Side>,
}

/// Where in a kick it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// No kick was asked.
    Idle,
    /// To the beginning of the run-up.
    Approach,
    /// On the line to the ball.
    RunUp,
    /// The step that kicks.
    Kick,
    /// Steps after it.
    FollowThrough,
    /// Comes to a stand; then it is over.
    Stop,
    /// Over; the robot stands.
    Done,
}

/// The walker with what kicks.
#[derive(Debug)]
pub struct InGait {
    walker: Walker,
    settings: InGaitSettings,
    commander: KickCommander,
    radius: f64,
    aim: Option<Aim>,
    ball: BallMemory,
    stage: Stage,
    foot: Side,
    steps_after: usize,
    was: Mode,
}

impl InGaitSettings {
    /// Reads `text`, the content of `file`.
    ///
    /// # Errors
    /// When it is not what it should be.
    pub fn parse(file: &str, text: &str) -> Result<Self, WalkError> {
        let settings: Self = toml::from_str(text)
            .map_err(|e| WalkError::Parse { file: file.into(), detail: e.to_string().trim_end().to_owned() })?;
        let rises = settings.pace.windows(2).all(|pair| pair[0].ball_speed < pair[1].ball_speed);
        if settings.pace.is_empty() || !rises {
            return Err(WalkError::Setting {
                file: file.into(),
                field: "pace".into(),
                found: format!("{} rows", settings.pace.len()),
                expected: "at least one row, ball_speed rising".into(),
            });
        }
        Ok(settings)
    }

    /// Run-up speed (m/s) for a ball speed (m/s), which is held within the table.
    #[must_use]
    pub fn walk(&self, speed: f64) -> f64 {
        let (first, last) = (self.pace[0], self.pace[self.pace.len() - 1]);
        let speed = speed.clamp(first.ball_speed, last.ball_speed);
        for pair in self.pace.windows(2) {
            let (a, b) = (pair[0], pair[1]);
            if speed <= b.ball_speed {
                return a.walk + (b.walk - a.walk) * (speed - a.ball_speed) / (b.ball_speed - a.ball_speed);
            }
        }
        last.walk
    }

    /// Least and greatest ball speed of the table, m/s.
    #[must_use]
    pub fn speeds(&self) -> [f64; 2] {
        [self.pace[0].ball_speed, self.pace[self.pace.len() - 1].ball_speed]
    }
}

impl InGait {
    /// For `robot`, which plays a ball of `radius` (m).
    ///
    /// # Errors
    /// As [`Walker::new`].
    pub fn new(
        robot: Arc<Robot>,
        walk: WalkSettings,
        settings: InGaitSettings,
        radius: f64,
    ) -> Result<Self, WalkError> {
        Ok(Self {
            walker: Walker::new(robot, walk)?,
            commander: KickCommander::new(settings.strike.clone()),
            settings,
            radius,
            aim: None,
            ball: BallMemory::default(),
            stage: Stage::Idle,
            foot: Side::Left,
            steps_after: 0,
            was: Mode::Stand,
        })
    }

    /// Asks for a kick from now on.
    pub fn ask(&mut self, aim: Aim) {
        let across = Vector2::new(-aim.direction.sin(), aim.direction.cos());
        let [x, y, _] = self.walker.odometry();
        let beside = (Vector2::from(aim.ball) - Vector2::new(x, y)).dot(&across);
        self.foot = aim.foot.unwrap_or(if beside > 0.0 { Side::Left } else { Side::Right });
        self.ball.expect(aim.ball.into());
        self.aim = Some(aim);
        self.stage = Stage::Approach;
    }

    /// Gives the kick up: walks on and stops. A kick that has begun is made.
    pub fn cancel(&mut self) {
        if matches!(self.stage, Stage::Approach | Stage::RunUp) {
            self.commander.cancel();
            self.stage = Stage::Stop;
        }
    }

    /// Where in the kick it is.
    #[must_use]
    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// The foot that is to kick.
    #[must_use]
    pub fn foot(&self) -> Side {
        self.foot
    }

    /// The walker.
    #[must_use]
    pub fn walker(&self) -> &Walker {
        &self.walker
    }

    /// The walker, to be steered while no kick is under way.
    pub fn walker_mut(&mut self) -> &mut Walker {
        &mut self.walker
    }

    /// Hands the walker back as it walks: no stop, no kick. A kick that has begun is made first.
    pub fn release(&mut self) {
        if self.stage != Stage::Kick {
            self.commander.cancel();
            self.ball.forget();
            (self.aim, self.stage) = (None, Stage::Idle);
        }
    }

    /// Where the ball is, as far as it is known: odometry's frame, m.
    #[must_use]
    pub fn ball(&self) -> Option<[f64; 2]> {
        self.ball.position().map(Into::into)
    }

    /// The settings.
    #[must_use]
    pub fn settings(&self) -> &InGaitSettings {
        &self.settings
    }

    /// What the gait is asked in this tick.
    fn steer(&mut self, aim: &Aim, ball: Vector2<f64>) -> Velocity {
        let limits = self.walker.settings().limits.clone();
        let pose = self.walker.odometry();
        let turn = Rotation2::new(-aim.direction);
        let from_robot = turn * (ball - Vector2::new(pose[0], pose[1]));
        let side = if self.foot == Side::Left { 1.0 } else { -1.0 };
        let half = 0.5 * self.walker.settings().gait.width;
        // The kicking foot's line, with the face's middle over the ball's.
        let beside = from_robot.y - side * (half + self.settings.strike.outward);
        let turned = wrap(aim.direction - pose[2]);
        let on_line = |errors: [f64; 2]| beside.abs() < errors[0] && turned.abs() < errors[1];
        let shortest = 0.5 * self.settings.run_up;
        if self.stage == Stage::Approach && on_line(LINE[0]) && from_robot.x > shortest {
            self.stage = Stage::RunUp;
        } else if self.stage == Stage::RunUp && (!on_line(LINE[1]) || from_robot.x < 0.05) {
            self.stage = Stage::Approach;
        }
        match self.stage {
            Stage::Approach => {
                let start = turn.inverse() * Vector2::new(from_robot.x - self.settings.run_up, beside);
                approach::toward(pose, [pose[0] + start.x, pose[1] + start.y, aim.direction], &limits)
            }
            Stage::RunUp => {
                let x = self.pace(aim, ball);
                let along = Velocity {
                    x,
                    y: (STEER[0] * beside).clamp(-ACROSS, ACROSS),
                    turn: (STEER[1] * turned).clamp(-limits.turn, limits.turn),
                };
                limits.clip(along)
            }
            Stage::Kick | Stage::FollowThrough => {
                limits.clip(Velocity { x: self.settings.walk(aim.speed), y: 0.0, turn: 0.0 })
            }
            Stage::Idle | Stage::Stop | Stage::Done => Velocity::default(),
        }
    }

    /// Speed ahead with which whole steps bring the support foot of the kick to its place before the ball, m/s.
    fn pace(&mut self, aim: &Aim, ball: Vector2<f64>) -> f64 {
        let wanted = self.settings.walk(aim.speed);
        let view = self.walker.view();
        let Mode::Step { support } = view.mode else { return wanted };
        let from_support = Rotation2::new(-aim.direction) * (ball - view.feet[support as usize].xy());
        let way = from_support.x - self.settings.ideal;
        // Steps until the support foot of the kick stands: an odd number when the other foot is to kick.
        let first = usize::from(support == self.foot);
        let Some(gait) = self.walker.gait_mut() else { return wanted };
        (0..COUNTS)
            .filter_map(|k| gait.velocity_for(first + 2 * k, way, aim.direction))
            .min_by(|a, b| (a - wanted).abs().total_cmp(&(b - wanted).abs()))
            .map_or(wanted, |speed| speed.clamp(PACE[0] * wanted, PACE[1] * wanted))
    }

    /// How far to lead the foot beyond the ball's surface, m, so that the swing meets the ball at the speed that sends it off
    /// as asked: the swing's own polynomial tells the speed.
    fn power(&self, aim: &Aim, ball: Vector2<f64>, contact: Vector3<f64>) -> f64 {
        let wanted = aim.speed / self.settings.gain;
        let [least, most] = self.settings.power;
        let count = 40;
        let candidates = (0..=count).map(|k| least + (most - least) * f64::from(k) / f64::from(count));
        let miss = |power: f64| {
            let mut commander = self.commander.clone();
            let strike = commander.lift_off(self.foot, ball, aim.direction, self.radius, power);
            strike.map_or(f64::INFINITY, |strike| (self.meeting(aim, ball, contact, strike) - wanted).abs())
        };
        candidates.min_by(|a, b| miss(*a).total_cmp(&miss(*b))).unwrap_or(least)
    }

    /// Speed along the kick with which a swing through `strike` meets the ball's surface, m/s; 0 when it does not.
    fn meeting(&self, aim: &Aim, ball: Vector2<f64>, contact: Vector3<f64>, strike: Vector2<f64>) -> f64 {
        let Some(gait) = self.walker.gait() else { return 0.0 };
        let swing = gait.swing(Some(self.waypoint(contact, strike)));
        let along = Vector2::new(aim.direction.cos(), aim.direction.sin());
        let surface = ball.dot(&along) - self.radius - self.settings.strike.face;
        (0..=PHASES)
            .map(|k| swing.at(f64::from(k) / f64::from(PHASES)))
            .find(|way| (way.position - contact).xy().dot(&along) >= surface)
            .map_or(0.0, |way| way.velocity.xy().dot(&along))
    }

    /// The strike point over the ground, odometry frame.
    fn waypoint(&self, contact: Vector3<f64>, strike: Vector2<f64>) -> Vector3<f64> {
        contact + Vector3::new(strike.x, strike.y, self.settings.strike.height)
    }

    /// Touchdowns and lift-offs that the last tick brought: algorithm 1's events.
    fn events(&mut self, aim: &Aim, ball: Vector2<f64>, time: f64) {
        if let Some(step) = self.walker.footstep() {
            if self.stage == Stage::Kick && step.side == self.foot {
                self.stage = Stage::FollowThrough;
                self.steps_after = 0;
            } else if self.stage == Stage::FollowThrough {
                self.steps_after += 1;
                if self.steps_after >= FOLLOW {
                    self.stage = Stage::Stop;
                }
            }
            self.commander.touch_down(step.side);
        }
        let view = *self.walker.view();
        let changed = view.mode != self.was;
        self.was = view.mode;
        if self.stage == Stage::Stop && view.mode == Mode::Stand {
            self.stage = Stage::Done;
        }
        let Mode::Step { support } = view.mode else { return };
        if self.stage != Stage::RunUp {
            return;
        }
        let pose = self.walker.odometry();
        let local = Rotation2::new(-pose[2]) * (ball - Vector2::new(pose[0], pose[1]));
        let sight = Sight {
            balancing: false,
            ball: self.ball.seen().is_some_and(|seen| time - seen < FRESH).then_some([local.x, local.y]),
            speed: view.com_velocity.x * pose[2].cos() + view.com_velocity.y * pose[2].sin(),
        };
        self.commander.look(&sight, Some(self.foot));
        if changed && support.other() == self.foot {
            let contact = view.feet[support as usize];
            let from_contact = ball - contact.xy();
            let power = self.power(aim, from_contact, contact);
            if let Some(strike) = self.commander.lift_off(self.foot, from_contact, aim.direction, self.radius, power) {
                let waypoint = self.waypoint(contact, strike);
                if let Some(gait) = self.walker.gait_mut() {
                    gait.set_waypoint(waypoint);
                }
                self.stage = Stage::Kick;
            }
        }
    }
}

impl Controller for InGait {
    fn tick(&mut self, sensors: &Sensors, command: &mut JointCommand) {
        self.ball.see(sensors);
        if let (Some(aim), Some(ball)) = (self.aim, self.ball.position()) {
            let velocity = self.steer(&aim, ball);
            self.walker.set_velocity(velocity);
            let planned = self.walker.plan(sensors, command);
            self.events(&aim, ball, sensors.time);
            // The kick that was locked in this tick is led from the next one on: a swing begins at rest.
            let outcome = self.walker.solve(planned.as_ref());
            self.walker.write(outcome, command);
        } else {
            self.walker.tick(sensors, command);
        }
        self.ball.at(sensors.time, self.walker.odometry());
    }
}

fn wrap(angle: f64) -> f64 {
    angle.sin().atan2(angle.cos())
}
