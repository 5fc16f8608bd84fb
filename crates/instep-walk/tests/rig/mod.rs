//! A robot of the repository in the simulator, walked on its true state: what the gait alone can do.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use instep_motion::phase::Side;
use instep_robot::Robot;
use instep_robot::control::JointCommand;
use instep_sim::settings::WorldSettings;
use instep_sim::trial::has_fallen;
use instep_sim::{BallState, World};
use instep_walk::{Gait, StateEstimate, Velocity, WalkSettings};
use nalgebra::Vector3;

/// A robot of the repository.
pub(crate) fn robot(name: &str) -> Arc<Robot> {
    let folder: PathBuf = [env!("CARGO_MANIFEST_DIR"), "..", "..", "robots", name].iter().collect();
    Arc::new(Robot::load(&folder).unwrap())
}

/// A world at 1 kHz.
pub(crate) fn world(robot: &Arc<Robot>) -> World {
    let mut settings = WorldSettings::default();
    settings.step.tick = 0.001;
    let mut world = World::new(Arc::clone(robot), &settings).unwrap();
    let (q, v) = (robot.stand.clone(), vec![0.0; robot.nv()]);
    world.reset(&q, &v, &BallState::at_rest([50.0, 0.0, 0.11])).unwrap();
    world
}

/// What came of a walk.
#[derive(Debug, Default)]
pub(crate) struct Walked {
    pub(crate) fell_at: Option<f64>,
    /// Way from the half of the time to the end over that time, in the heading's axes: m/s, m/s, rad/s.
    pub(crate) speed: [f64; 3],
    /// Least and greatest height of the centre of mass in that half, m.
    pub(crate) height: [f64; 2],
    /// Largest torque of each joint of the left leg, N m.
    pub(crate) torques: Vec<f64>,
    /// Mean and largest time of a tick, s.
    pub(crate) tick: [f64; 2],
    pub(crate) p99: f64,
}

/// Walks with `velocity(t)` for `duration` (s); `push(t)` is a force on the trunk (N).
pub(crate) fn walk(
    world: &mut World,
    settings: WalkSettings,
    duration: f64,
    velocity: impl Fn(f64) -> Velocity,
    push: impl Fn(f64) -> [f64; 3],
    mut look: impl FnMut(f64, &Gait, &World),
) -> Walked {
    let robot = Arc::clone(world.robot());
    let mut gait = Gait::new(Arc::clone(&robot), settings).unwrap();
    let mut state = StateEstimate::standing(&robot);
    let mut command = JointCommand::zeros(robot.joints.len());
    let mut forces = vec![Vector3::zeros(); robot.contacts.len()];
    let mut walked =
        Walked { height: [f64::INFINITY, 0.0], torques: vec![0.0; robot.joints.len()], ..Walked::default() };
    let (mut half, mut way, mut ticks) = (None, [0.0; 3], Vec::new());
    let steps = (duration * 1000.0) as usize;
    let mut heading: f64 = 0.0;
    for step in 0..steps {
        let time = step as f64 * 0.001;
        state.time = time;
        state.q.copy_from_slice(world.q());
        state.v.copy_from_slice(world.v());
        world.contact_forces_into(&mut forces);
        for side in [Side::Left, Side::Right] {
            let load = robot.contacts.iter().zip(&forces).filter(|(c, _)| c.leg == side).map(|(_, f)| f.z).sum();
            state.load[side as usize] = load;
            state.contact[side as usize] = load > 1.0;
        }
        gait.set_velocity(velocity(time));
        world.push(push(time));
        let start = Instant::now();
        gait.tick(&state, &mut command);
        ticks.push(start.elapsed().as_secs_f64());
        look(time, &gait, world);
        let before = [world.q()[0], world.q()[1]];
        world.advance(&command, None).unwrap();
        let (q, v) = (world.q(), world.v());
        let moved = [q[0] - before[0], q[1] - before[1]];
        heading = gait.view().heading;
        if step >= steps / 2 {
            half.get_or_insert(heading);
            way[0] += heading.cos() * moved[0] + heading.sin() * moved[1];
            way[1] += heading.cos() * moved[1] - heading.sin() * moved[0];
            way[2] += v[5] * 0.001;
            let z = gait.view().com.z;
            walked.height = [walked.height[0].min(z), walked.height[1].max(z)];
            for (most, torque) in walked.torques.iter_mut().zip(world.torques()) {
                *most = most.max(torque.abs());
            }
        }
        if has_fallen(world) {
            walked.fell_at = Some(time);
            break;
        }
    }
    let _ = heading;
    walked.speed = way.map(|way| way / (0.5 * duration));
    ticks.sort_by(f64::total_cmp);
    walked.tick = [ticks.iter().sum::<f64>() / ticks.len() as f64, ticks[ticks.len() - 1]];
    walked.p99 = ticks[ticks.len() * 99 / 100];
    walked
}
