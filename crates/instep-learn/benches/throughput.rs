//! Where a training's time goes: `cargo bench -p instep-learn --bench throughput [-- THREADS]`.
//!
//! PresToe on its kinodynamic reference with the settings of the task `track`. Physics alone is the same worlds stepped under the
//! reference's own commands, nothing seen and nothing learned; the rest is by difference, on the same threads, in the same run.
//! Each figure is the median of rounds that measure all parts in turn, so that what else runs meets all of them.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a benchmark prints, and stops at the first surprise")]

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use instep_learn::LearnSettings;
use instep_learn::environment::{Environment, Scene};
use instep_learn::ppo::Learner;
use instep_learn::train::Training;
use instep_motion::reference::Reference;
use instep_robot::Robot;
use instep_robot::control::JointCommand;
use instep_sim::BallState;
use rand::SeedableRng as _;
use rayon::prelude::*;

/// Control steps a second that a laptop should reach on two cores.
const LIMIT: f64 = 5000.0;
const ROUNDS: usize = 5;

fn main() {
    let threads = std::env::args().filter_map(|arg| arg.parse().ok()).next().unwrap_or(2);
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let robot = Arc::new(Robot::load(&root.join("robots/prestoe")).unwrap());
    let reference = Arc::new(Reference::load(&root.join("references/prestoe/10_03_kinodynamic.json")).unwrap());
    let mut settings = LearnSettings::default();
    (settings.clip.from, settings.clip.to) = (Some(0.15), Some(2.4));
    let scene = Arc::new(Scene::new(Arc::clone(&robot), Arc::clone(&reference), settings.clone()).unwrap());
    let mut training = Training::new(robot, reference, "10_03", settings, 1, u64::MAX, None).unwrap();
    let first = training.iterate().unwrap();
    let count = first.steps as f64;

    let steps = count as usize / threads;
    let mut times = [const { Vec::new() }; 4];
    for round in 0..ROUNDS {
        let start = Instant::now();
        let (samples, _) = training.rollout.collect(&training.ppo.weights, 0.3).unwrap();
        times[0].push(start.elapsed().as_secs_f64());
        let start = Instant::now();
        training.ppo.update(&samples, round as u64).unwrap();
        times[1].push(start.elapsed().as_secs_f64());
        times[2].push(time(threads, |_| physics(&scene, steps)));
        times[3].push(time(threads, |thread| environments(&scene, thread, steps)));
    }
    let [collect, update, physics, environment] = times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[ROUNDS / 2]
    });
    let inference = collect - environment;
    let total = collect + update;
    println!("{threads} threads, {count} control steps an iteration");
    for (name, seconds) in [
        ("physics", physics),
        ("observation and reward", environment - physics),
        ("inference, starts, waiting", inference),
        ("update", update),
    ] {
        println!("  {name:<28} {:7.1} us a step  {:5.1} %", 1e6 * seconds / count, 100.0 * seconds / total);
    }
    let rate = count / total;
    println!(
        "  together {rate:.0} control steps a second: {:.2} of the {LIMIT} that two cores should reach",
        rate / LIMIT
    );
}

fn time(threads: usize, work: impl Fn(usize) + Sync + Send) -> f64 {
    let start = Instant::now();
    (0..threads).into_par_iter().for_each(work);
    start.elapsed().as_secs_f64()
}

/// Steps a world under the reference's own commands.
fn physics(scene: &Scene, steps: usize) {
    let mut follower = scene.follower().clone();
    let mut world = scene.world(&mut rand_chacha::ChaCha8Rng::from_seed([1; 32])).unwrap();
    let mut command = JointCommand::zeros(scene.robot.joints.len());
    let mut state = instep_kick::track::TrackState::default();
    let far = scene.settings.world.step;
    let substeps = (scene.settings.follower.period / far).round() as usize;
    let mut track = follower.track().clone();
    for step in 0..steps {
        let tick = step % scene.clip_ticks();
        if tick.is_multiple_of(20) {
            track.sample_into(tick as f64 * scene.settings.follower.period, &mut state);
            world.reset(&state.q, &state.v, &BallState::at_rest([60.0, 0.0, 1000.0])).unwrap();
        }
        for k in 0..substeps {
            follower.command(tick as f64 * scene.settings.follower.period + k as f64 * far, &mut command);
            world.advance(&command, None).unwrap();
        }
    }
}

/// Steps environments without a network.
fn environments(scene: &Arc<Scene>, thread: usize, steps: usize) {
    let mut environment = Environment::new(Arc::clone(scene), 1, thread).unwrap();
    let still = vec![0.0; scene.robot.joints.len()];
    environment.start(0).unwrap();
    for step in 0..steps {
        if environment.step(&still, 10.0).end.is_some() || step % 20 == 19 {
            environment.start((step + 1) % scene.clip_ticks()).unwrap();
        }
    }
}
