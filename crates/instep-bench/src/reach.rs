//! Builds the reachability grid of the adaptive kick by moving the simulated robot through it: every row of cells along x
//! that inverse kinematics can reach is one line for [`Probe`]; what the sensors say was reached counts (paper 3, section
//! 2.1, where the robot was a real one).
//!
//! Rows are independent, so all cores work at them and the result is the same on any number of cores.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use instep_kick::adaptive::grid::{CELLS, Grid};
use instep_kick::adaptive::probe::{Line, Probe};
use instep_kick::adaptive::{AdaptiveSettings, grid_hash};
use instep_robot::Robot;
use instep_robot::control::{Controller, JointCommand, Sensors};
use instep_sim::sensors::SensorSuite;
use instep_sim::settings::WorldSettings;
use instep_sim::trial::has_fallen;
use instep_sim::{BallState, World};
use rayon::prelude::*;

use crate::BenchError;

/// Where the ball lies out of the way, m.
const AWAY: [f64; 3] = [5.0, 0.0, 0.2];
/// Tries to go on with a line behind a cell at which it ended.
const TRIES: usize = 3;

/// What was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Reach {
    /// Cells that the simulated foot reached.
    pub measured: Grid,
    /// Cells that inverse kinematics reaches within joint ranges, gaps and balance.
    pub kinematic: Grid,
    /// Time that the simulated robot took, s.
    pub simulated: f64,
}

/// Measures the grid of `robot`; `progress` is told how many of all rows are done.
///
/// # Errors
/// When the world or the probe cannot be made, or a simulation diverges.
pub fn measure(
    robot: &Arc<Robot>,
    settings: &AdaptiveSettings,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Reach, BenchError> {
    let hash = grid_hash(robot, settings);
    // Rows differ much in length; neighbours in y go to different cores.
    let rows: Vec<[usize; 2]> = (0..CELLS).flat_map(|z| (0..CELLS).map(move |y| [y, z])).collect();
    let done = AtomicUsize::new(0);
    let empty = || Reach { measured: Grid::new(hash), kinematic: Grid::new(hash), simulated: 0.0 };
    rows.par_iter()
        .map_init(
            || Bed::new(robot, settings),
            |bed, [y, z]| {
                let mut reach = empty();
                match bed {
                    Ok(bed) => bed.row(*y, *z, &mut reach)?,
                    Err(error) => return Err(BenchError::File { file: robot.name.clone(), detail: error.to_string() }),
                }
                progress(done.fetch_add(1, Ordering::Relaxed) + 1, rows.len());
                Ok(reach)
            },
        )
        .try_reduce(empty, |mut a, b| {
            a.measured.merge(&b.measured);
            a.kinematic.merge(&b.kinematic);
            a.simulated += b.simulated;
            Ok(a)
        })
}

/// One core's world and probe.
struct Bed {
    probe: Probe,
    world: World,
    sensors: Sensors,
    command: JointCommand,
}

impl Bed {
    fn new(robot: &Arc<Robot>, settings: &AdaptiveSettings) -> Result<Self, BenchError> {
        // Which places the foot reaches does not depend on the drives; in an ideal world it gets there in one tick.
        let robot = &Arc::new(Robot::clone(robot).with_ideal_drives());
        Ok(Self {
            probe: Probe::new(Arc::clone(robot), settings)?,
            world: World::new(Arc::clone(robot), &WorldSettings::default())?,
            sensors: Sensors::default(),
            command: JointCommand::zeros(robot.joints.len()),
        })
    }

    /// Measures one row of cells: from the cell next to the foot's own place outward, forward and backward.
    fn row(&mut self, y: usize, z: usize, reach: &mut Reach) -> Result<(), BenchError> {
        let home = Grid::cell(&nalgebra::Vector3::new(0.0, Grid::centre([0, y, z]).y, Grid::centre([0, y, z]).z));
        let home = home.map_or(CELLS / 2, |cell| cell[0]);
        for [from, to] in self.probe.runs(y, z) {
            (from..=to).for_each(|x| reach.kinematic.insert([x, y, z]));
            let middle = home.clamp(from, to);
            for end in [to, from] {
                let step = if end > middle { 2 } else { -2 };
                let mut start = middle;
                // A line that ends early is taken up again behind the cell that stopped it.
                for _ in 0..TRIES {
                    let Some(line) = self.probe.line([[start, y, z], [end, y, z]]) else { break };
                    let last = self.follow(&line, reach)?.unwrap_or(start);
                    let next = last.checked_add_signed(step).filter(|next| *next < CELLS);
                    match next.filter(|next| (*next <= end) == (step > 0) || *next == end) {
                        Some(next) if last != end => start = next,
                        _ => break,
                    }
                }
            }
        }
        Ok(())
    }

    /// Follows a line and gives the last x that was reached on it.
    fn follow(&mut self, line: &Line, reach: &mut Reach) -> Result<Option<usize>, BenchError> {
        let robot = Arc::clone(self.world.robot());
        self.world.reset(&line.start, &vec![0.0; robot.nv()], &BallState::at_rest(AWAY))?;
        let mut suite = SensorSuite::new(&mut self.world, 0);
        suite.sense(&self.world);
        let duration = self.probe.start(line);
        let period = (self.probe.control_period() / self.world.settings().step.tick).round().max(1.0) as usize;
        let mut last = None;
        while self.world.time() < duration && !has_fallen(&self.world) {
            suite.read_into(self.world.time(), &mut self.sensors);
            if let Some(cell) = self.probe.reached(&self.sensors) {
                reach.measured.insert(cell);
                last = Some(cell[0]);
            }
            self.probe.tick(&self.sensors, &mut self.command);
            for _ in 0..period {
                self.world.advance(&self.command, None)?;
                suite.sense(&self.world);
            }
        }
        reach.simulated += self.world.time();
        Ok(last)
    }
}
