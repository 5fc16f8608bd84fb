//! What a look-up of a request in the reachability grid costs: `cargo bench -p instep-bench --bench outlook`, for every robot
//! with a grid, over the requests of paper 3's scenarios. Each is made three times and its least time counts: time of the
//! thread on its core, which a machine that is shared still lengthens.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a benchmark prints, and stops at the first surprise")]

use std::path::Path;

use instep_bench::cpu::thread_seconds;
use instep_bench::{Scenario, Subject};
use instep_kick::adaptive::AdaptiveKick;

/// 99th percentile that a look-up may take, s.
const LIMIT: f64 = 0.001;
const REQUESTS: usize = 200;

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for name in ["nao", "wolfgang"] {
        let subject = Subject::load(&root.join("robots"), name).unwrap();
        let mut engine = AdaptiveKick::load(subject.robot.clone()).unwrap();
        for scenario in ["sweep", "random-100", "ball-moved-far", "directions"] {
            let scenario = Scenario::load(&root.join("scenarios").join(scenario).with_extension("toml")).unwrap();
            let mut found = 0;
            let mut times: Vec<f64> = scenario
                .cases(&subject.size, 1, REQUESTS)
                .iter()
                .map(|case| {
                    let mut once = || {
                        let start = thread_seconds();
                        let outlook = engine.outlook(&case.request).unwrap();
                        (thread_seconds() - start, outlook.is_some())
                    };
                    let tries = [once(), once(), once()];
                    found += usize::from(tries[0].1);
                    tries.iter().map(|(time, _)| *time).fold(f64::INFINITY, f64::min)
                })
                .collect();
            times.sort_by(f64::total_cmp);
            let [p50, p99] = [0.5, 0.99].map(|share| times[(share * REQUESTS as f64) as usize]);
            println!(
                "{name:<9} {:<15} {found:>3} of {REQUESTS} found, p50 {:.3} ms, p99 {:.3} ms: {:.2} of the limit",
                scenario.name,
                1e3 * p50,
                1e3 * p99,
                p99 / LIMIT
            );
        }
    }
}
