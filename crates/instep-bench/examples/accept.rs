//! Plans the requests of a scenario without trying them, and counts refusals by cause: `accept [robot] [scenario] [count]`.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::path::Path;

use instep_bench::{Scenario, Subject};
use instep_robot::control::Sensors;

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let text = |i: usize, default: &str| args.get(i).cloned().unwrap_or_else(|| default.to_owned());
    let subject = Subject::load(Path::new(&text(4, "robots")), &text(1, "nao")).unwrap();
    let scenario =
        Scenario::load(&Path::new("scenarios").join(text(2, "random-place")).with_extension("toml")).unwrap();
    let robot = &subject.robot;
    let sensors = Sensors { joint_positions: robot.stand[7..].to_vec(), ..Sensors::default() };
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for seed in 1..=3 {
        for case in scenario.cases(&subject.size, seed, text(3, "200").parse().unwrap()) {
            let mut engine = subject.engine("dynamic").unwrap();
            let name = match engine.plan(&case.request, &sensors) {
                Ok(plan) => format!("accepted {:?}", plan.face),
                Err(refusal) => refusal.name().to_owned(),
            };
            *counts.entry(name).or_default() += 1;
        }
    }
    println!("{counts:?}");
}
