//! What measures the reachability grid: holds the robot on its left foot and moves the right one slowly along a line,
//! stabilised as in a kick, so that a world or a real robot shows which cells the foot reaches (paper 3, section 2.1).
//!
//! Which lines are worth a try is found by inverse kinematics first, as the paper did. What counts as reached is judged
//! from the sensors: encoders, inertial sensor and foot pressure.

use std::sync::Arc;

use instep_motion::phase::Side;
use instep_motion::spline::State;
use instep_robot::Robot;
use instep_robot::control::{Controller, JointCommand, Sensors};
use nalgebra::{Quaternion, Rotation3, UnitQuaternion, Vector3};

use crate::KickError;
use crate::adaptive::grid::{CELL, CELLS, Cell, Grid};
use crate::adaptive::settings::AdaptiveSettings;
use crate::ball::BallModel;
use crate::settings::Settings;
use crate::whole_body::body::Body;
use crate::whole_body::drive::{Drive, Footing, Wanted};
use crate::whole_body::motion::goals;
use crate::whole_body::path::Path;
use instep_robot::ik::Ik;
use instep_robot::tree::TreePose;

/// A probe plays no ball.
const NO_BALL: BallModel = BallModel { radius: 0.1, mass: 0.4, restitution: 0.5, deceleration: 0.4 };
/// The foot that moves.
const SWING: Side = Side::Right;
/// Steps of inverse kinematics to the first place of a line, and to the next cell.
const FAR: usize = 25;
const NEAR: usize = 6;
/// Time to come to rest before the foot moves, s.
const SETTLE: f64 = 0.25;
/// Mean speed of the foot, m/s.
const SPEED: f64 = 0.2;
/// Time that a line takes at least, s.
const LEAST: f64 = 0.2;
/// Largest tilt of the support sole that counts as standing on it, rad.
const FLAT: f64 = 0.06;
/// Distance from where the foot was sent within which it counts as there, m.
const TOLERANCE: f64 = 0.8 * CELL;
/// Largest rotation of the foot away from level and straight, rad.
const TURNED: f64 = 0.6;
/// Cells without success after which a line ends.
const GIVE_UP: usize = 2;

/// A line of cells along x.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// First and last cell.
    pub cells: [Cell; 2],
    /// The robot's position (7 + n) with the foot at the first cell, the support sole at the world's origin.
    pub start: Vec<f64>,
}

/// Moves the foot along lines.
#[derive(Debug)]
pub struct Probe {
    body: Body,
    settings: AdaptiveSettings,
    drive: Drive,
    ik: Ik,
    pose: TreePose,
    angles: Vec<f64>,
    foot: Path<5>,
    clock: f64,
}

impl Probe {
    /// For `robot` with the stance, limits and stabiliser of `settings`.
    ///
    /// # Errors
    /// When a setting does not fit the robot.
    pub fn new(robot: Arc<Robot>, settings: &AdaptiveSettings) -> Result<Self, KickError> {
        settings.validate()?;
        let (body, drive) = super::parts(robot, NO_BALL, settings)?;
        Ok(Self {
            ik: drive.ik.clone(),
            pose: body.tree.pose(),
            angles: body.angles.clone(),
            foot: Path::starting(0.0, State::at_rest([0.0; 5])),
            clock: 0.0,
            settings: settings.clone(),
            drive,
            body,
        })
    }

    /// Period of its ticks, s.
    #[must_use]
    pub fn control_period(&self) -> f64 {
        self.settings.control_period
    }

    fn pose_at(point: &Vector3<f64>) -> [f64; 5] {
        [point.x, point.y, point.z, 0.0, 0.0]
    }

    /// Moves `self.angles` toward a foot at `point`; whether joint ranges, gaps and balance allow it.
    fn reach(&mut self, point: &Vector3<f64>, steps: usize) -> bool {
        let trunk = self.settings.manner().trunk_support(&self.body, SWING, 0.0);
        let goals = goals(&Self::pose_at(point), &trunk);
        let off = self.ik.solve(&self.body.tree, &mut self.pose, &mut self.angles, SWING, &goals, steps);
        off.position < 0.5 * CELL
            && off.balance < 0.5 * CELL
            && off.orientation.max(off.roll) < TURNED
            && self.body.tree.least_gap(&self.pose).0 > self.settings.limits.clearance
    }

    /// The first and last x of each run of cells along x, at `y` and `z` cells, that inverse kinematics can reach.
    pub fn runs(&mut self, y: usize, z: usize) -> Vec<[usize; 2]> {
        let middle = Grid::centre([0, y, z]);
        let hip = self.body.stand(SWING).home;
        // Farther from the hip's place than the leg is long, whatever x is.
        if (middle.y - hip.y).abs() > self.body.leg_length {
            return Vec::new();
        }
        let mut good = [false; CELLS];
        let home = (0.0 - Grid::centre([0, 0, 0]).x) / CELL;
        // Cells from the foot's own place outward, and back to front where that fails.
        let seeds = (0..CELLS / 4).flat_map(|i| [home as usize + 2 * i, (home as usize).wrapping_sub(2 * i)]);
        for seed in seeds.filter(|seed| *seed < CELLS) {
            if good[seed] {
                continue;
            }
            self.angles.copy_from_slice(&self.body.angles);
            self.body.set_arms(1.0, &mut self.angles);
            if !self.reach(&Grid::centre([seed, y, z]), FAR) {
                continue;
            }
            good[seed] = true;
            let from = self.angles.clone();
            for forward in [true, false] {
                self.angles.copy_from_slice(&from);
                let mut failed = 0;
                let mut x = seed;
                while failed < GIVE_UP {
                    x = if forward { x + 1 } else { x.wrapping_sub(1) };
                    if x >= CELLS || good[x] {
                        break;
                    }
                    good[x] = self.reach(&Grid::centre([x, y, z]), NEAR);
                    failed = if good[x] { 0 } else { failed + 1 };
                }
            }
        }
        let mut runs = Vec::new();
        let mut x = 0;
        while x < CELLS {
            let end = (x..CELLS).find(|i| !good[*i]).unwrap_or(CELLS);
            if end > x {
                runs.push([x, end - 1]);
            }
            x = end + 1;
        }
        runs
    }

    /// The line from one cell to another of its row; `None` when its first cell is out of reach.
    pub fn line(&mut self, cells: [Cell; 2]) -> Option<Line> {
        self.angles.copy_from_slice(&self.body.angles);
        self.body.set_arms(1.0, &mut self.angles);
        self.reach(&Grid::centre(cells[0]), 2 * FAR).then(|| {
            let sole = &self.body.robot.leg(SWING.other()).sole;
            let turn = self.pose.rotation[sole.link].transpose();
            let position = turn * (-self.pose.point(sole));
            let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
            let mut start = vec![position.x, position.y, position.z, rotation.w, rotation.i, rotation.j, rotation.k];
            start.extend(&self.angles);
            Line { cells, start }
        })
    }

    /// Starts on a line; its time is told, s.
    pub fn start(&mut self, line: &Line) -> f64 {
        let [from, to] = line.cells.map(Grid::centre);
        self.drive.start(&self.body, SWING, &line.start[7..], self.settings.control_period, false);
        self.clock = 0.0;
        self.foot = Path::starting(0.0, State::at_rest(Self::pose_at(&from)));
        self.foot.hold(SETTLE);
        self.foot.to(((to - from).norm() / SPEED).max(LEAST), State::at_rest(Self::pose_at(&to)));
        self.foot.hold(0.5 * SETTLE);
        self.foot.end()
    }

    /// The cell that the foot was sent to and has reached by what `sensors` say; `None` while it is away from there, the robot does not
    /// stand on its sole, the centre of mass is not over it, parts come too near to each other, or the foot touches the
    /// ground.
    pub fn reached(&mut self, sensors: &Sensors) -> Option<Cell> {
        if self.clock < 0.5 * SETTLE {
            return None;
        }
        let body = &self.body;
        body.tree.update(&sensors.joint_positions, &mut self.pose);
        let (support, flying) = (&body.robot.leg(SWING.other()).sole, &body.robot.leg(SWING).sole);
        let turn = self.pose.rotation[support.link].transpose();
        let sole = self.pose.point(support);
        let [w, x, y, z] = sensors.orientation;
        let world_from_base = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        let tilt = (world_from_base * (self.pose.rotation[support.link] * Vector3::z())).xy().norm();
        let from_sole = world_from_base * (body.tree.com(&self.pose) - sole);
        // Level, in the sole's heading.
        let ahead = world_from_base * (self.pose.rotation[support.link] * Vector3::x());
        let heading = ahead.xy().normalize();
        let com = [from_sole.xy().dot(&heading), heading.perp(&from_sole.xy())];
        let foot = &body.feet[SWING.other() as usize];
        let over = |at: f64, [low, high]: [f64; 2]| low < at && at < high;
        let lifted = body.robot.contacts.iter().zip(&sensors.contact_forces).all(|(c, f)| c.leg != SWING || *f <= 0.0);
        let stands = tilt < FLAT && over(com[0], foot.stand_x) && over(com[1], foot.stand_y) && lifted;
        let free = body.tree.least_gap(&self.pose).0 > 0.0;
        let point = turn * (self.pose.point(flying) - sole);
        let wanted = self.foot.at(self.clock).position;
        let sent = Vector3::new(wanted[0], wanted[1], wanted[2]);
        (stands && free && (point - sent).norm() < TOLERANCE).then(|| Grid::cell(&sent)).flatten()
    }
}

impl Controller for Probe {
    fn tick(&mut self, sensors: &Sensors, command: &mut JointCommand) {
        let dt = self.settings.control_period;
        let trunk = self.settings.manner().trunk_support(&self.body, SWING, 0.0);
        let wanted = Wanted { goals: goals(&self.foot.at(self.clock + 1.5 * dt).position, &trunk), arms: 1.0 };
        let footing = Footing { swing: SWING, both: false, active: true };
        self.drive.tick(&self.body, footing, &wanted, dt, sensors, command);
        self.clock += dt;
    }
}
