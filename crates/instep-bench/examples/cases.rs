//! One line for each case of a scenario: what was asked, what came, for those who tune an engine.
//!
//! `cargo run -p instep-bench --example cases -- adaptive nao sweep 50 [seed]`
#![allow(clippy::print_stdout)]

use std::path::Path;

use instep_bench::cell::{run_case, world};
use instep_bench::{Scenario, Subject};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let text = |i: usize, default: &str| args.get(i).map_or(default.to_owned(), Clone::clone);
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let subject = Subject::load(&root.join("robots"), &text(1, "nao"))?;
    let scenario = Scenario::load(&root.join("scenarios").join(text(2, "sweep") + ".toml"))?;
    let (count, seed) = (text(3, "10").parse()?, text(4, "1").parse()?);
    let mut ticks = Vec::new();
    let (mut hits, mut upright, mut accepted) = (0, 0, 0);
    for (i, case) in scenario.cases(&subject.size, seed, count).into_iter().enumerate() {
        let mut world = world(&subject, &scenario, &case)?;
        let start = instep_bench::cpu::thread_seconds();
        let (outcome, plan, trial) = run_case(&subject, &text(0, "adaptive"), &case, &mut world, &mut ticks)?;
        let cpu = instep_bench::cpu::thread_seconds() - start;
        let asked = format!(
            "{i:3} ball ({:+.3} {:+.3}) {:+5.0} deg {:.2} m/s plan {:5.1} ms",
            case.ball[0],
            case.ball[1],
            case.turn.to_degrees(),
            case.request.strength.value(),
            1e3 * plan
        );
        match (outcome, trial) {
            (Ok(k), Some(ran)) => {
                let trial = &ran.trial;
                accepted += 1;
                hits += usize::from(k.hit);
                upright += usize::from(k.upright);
                let deg = |v: Option<f64>| v.map_or(f64::NAN, f64::to_degrees);
                let by = trial.impact.as_ref().map_or("-", |impact| impact.link.as_str());
                println!(
                    "{asked} {} {} moved {:.2?} off {:+6.1} deg speed {:.2} g {:.3} stated {:4.1} ground {} broke {:?} beyond {:?} by {by} at {:.2} cpu {cpu:.1} {}",
                    if k.hit { "hit " } else { "MISS" },
                    if k.upright { "up  " } else { "FELL" },
                    case.ball_moved.map(|(_, by)| by),
                    deg(k.turn_error),
                    k.ball_speed.unwrap_or(f64::NAN),
                    k.forecast.unwrap_or(f64::NAN),
                    k.precision.to_degrees(),
                    k.grounded,
                    k.broken_off,
                    trial
                        .limit_violations
                        .iter()
                        .map(|v| (&v.joint, v.quantity, v.peak / v.limit, v.time))
                        .collect::<Vec<_>>(),
                    k.contact.unwrap_or(f64::NAN),
                    trial.audit.reason(),
                );
            }
            (outcome, _) => {
                println!("{asked} refused: {}", outcome.err().map_or(String::new(), |e| e.explain(&subject.robot)));
            }
        }
    }
    ticks.sort_by(f32::total_cmp);
    let at = |share: f64| ticks.get((ticks.len() as f64 * share) as usize).copied().unwrap_or(0.0) * 1e6;
    println!("{accepted} accepted, {hits} hits, {upright} upright, tick us p50 {:.0} p99 {:.0}", at(0.5), at(0.99));
    Ok(())
}
