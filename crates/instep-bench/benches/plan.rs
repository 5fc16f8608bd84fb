//! What plans cost: `cargo bench -p instep-bench --bench plan [-- ENGINE]`, for every engine and robot that fit, over the
//! requests of the scenarios random-place and directions. Each plan is made three times and its least time counts:
//! time of the thread on its core, which a machine that is shared still lengthens.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a benchmark prints, and stops at the first surprise")]

use std::path::Path;

use instep_bench::cpu::thread_seconds;
use instep_bench::{Scenario, Subject, engines};
use instep_robot::control::Sensors;
use instep_sim::sensors::SensorSuite;
use instep_sim::{BallState, World};

/// 99th percentile that a plan may take, s.
const LIMIT: f64 = 0.005;
const REQUESTS: usize = 200;

fn main() {
    let wanted = std::env::args().skip(1).find(|arg| !arg.starts_with('-'));
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for name in ["nao", "wolfgang"] {
        let subject = Subject::load(&root.join("robots"), name).unwrap();
        let robot = &subject.robot;
        for engine in engines().filter(|e| subject.knows(e) && wanted.as_deref().is_none_or(|w| w == *e)) {
            for scenario in Scenario::load_all(&root.join("scenarios")).unwrap() {
                if !["random-place", "directions"].contains(&scenario.name.as_str()) {
                    continue;
                }
                let mut world = World::new(robot.clone(), &subject.world()).unwrap();
                let far = BallState::at_rest([1.0, 0.0, subject.size.ball]);
                world.reset(&robot.stand, &vec![0.0; robot.nv()], &far).unwrap();
                let mut suite = SensorSuite::new(&mut world, 1);
                suite.sense(&world);
                let mut sensors = Sensors::default();
                suite.read_into(0.0, &mut sensors);
                let mut accepted = 0;
                let mut times: Vec<f64> = scenario
                    .cases(&subject.size, 1, REQUESTS)
                    .iter()
                    .map(|case| {
                        let once = |_| {
                            let mut planner = subject.engine(engine).unwrap();
                            let start = thread_seconds();
                            let plan = planner.plan(&case.request, &sensors);
                            (thread_seconds() - start, plan.is_ok())
                        };
                        let tries = [0; 3].map(once);
                        accepted += usize::from(tries[0].1);
                        tries.iter().map(|(time, _)| *time).fold(f64::INFINITY, f64::min)
                    })
                    .collect();
                times.sort_by(f64::total_cmp);
                let [p50, p99] = [0.5, 0.99].map(|share| times[(share * REQUESTS as f64) as usize]);
                println!(
                    "{engine:<14} {name:<9} {:<13} {accepted:>3} of {REQUESTS} accepted, p50 {:.2} ms, p99 {:.2} ms: \
                     {:.2} of the limit",
                    scenario.name,
                    1e3 * p50,
                    1e3 * p99,
                    p99 / LIMIT
                );
            }
        }
    }
}
