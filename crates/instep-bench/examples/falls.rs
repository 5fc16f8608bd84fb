//! Lists the cases of a cell that fell, missed or broke limits, with their requests and plans: `falls robot scenario count seed`.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::path::Path;

use instep_bench::cell::{run_case, world};
use instep_bench::{Scenario, Subject};
use instep_robot::control::Sensors;

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let text = |i: usize, default: &str| args.get(i).cloned().unwrap_or_else(|| default.to_owned());
    let subject = Subject::load(Path::new("robots"), &text(1, "nao")).unwrap();
    let scenario =
        Scenario::load(&Path::new("scenarios").join(text(2, "random-place")).with_extension("toml")).unwrap();
    let sensors = Sensors { joint_positions: subject.robot.stand[7..].to_vec(), ..Sensors::default() };
    for (i, case) in
        scenario.cases(&subject.size, text(4, "1").parse().unwrap(), text(3, "60").parse().unwrap()).iter().enumerate()
    {
        let mut engine = subject.engine("dynamic").unwrap();
        let Ok(plan) = engine.plan(&case.request, &sensors) else { continue };
        let mut engine = subject.engine("dynamic").unwrap();
        let mut world = world(&subject, &scenario, case).unwrap();
        let (outcome, _, trial) = run_case(&subject, case, engine.as_mut(), &mut world, &mut Vec::new()).unwrap();
        let (Ok(kicked), Some(trial)) = (outcome, trial) else { continue };
        if kicked.hit && kicked.upright && kicked.violations == 0 {
            continue;
        }
        println!("{i} hit {} fell {:?} contact {:?}", kicked.hit, trial.fell_at, kicked.contact);
        println!("  {:?} {:.3} rad {:?}", case.request.ball, case.request.direction, case.request.strength);
        println!("  {plan:?}");
        for v in &trial.limit_violations {
            println!("  {} {} {:.2} of {:.2} at {:.3}", v.joint, v.quantity, v.peak, v.limit, v.time);
        }
    }
}
