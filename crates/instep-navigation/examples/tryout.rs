//! Tryout.
#![allow(missing_docs)]
use instep_field::Field;
use instep_navigation::{*, scenario::*, trial::*};
fn clock() -> f64 { let mut t = libc::timespec{tv_sec:0,tv_nsec:0}; unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut t) }; t.tv_sec as f64 + 1e-9*t.tv_nsec as f64 }
fn p99(mut v: Vec<f64>) -> [f64;2] { v.sort_by(f64::total_cmp); if v.is_empty() {return [0.0;2]} [1e3*v[v.len()/2], 1e3*v[(v.len()-1)*99/100]] }
fn main() {
    let field = Field::named("adult-2024").unwrap();
    let args: Vec<String> = std::env::args().collect();
    let tracker = match args.get(1).map(|s| s.as_str()) { Some("qp") => Tracker::Linearised, Some("direct") => Tracker::Direct, _ => Tracker::Nonlinear };
    let model = if args.get(1).map(|s| s.as_str()) == Some("printed") { Model::Printed } else { Model::Lagged };
    let only = args.get(2).cloned();
    let most: usize = args.get(3).map_or(20, |s| s.parse().unwrap());
    let limits = RobotLimits::default();
    for s in SCENARIOS {
        if only.as_ref().is_some_and(|o| o != "all" && o != s.name) { continue; }
        let runs = s.runs.min(most);
        let (mut solves, mut plans, mut errors) = (vec![], vec![], vec![]);
        let (mut depth, mut contact, mut reached, mut stuck, mut beyond, mut flips, mut time) = (0.0f64, 0, 0, 0, 0.0f64, 0, 0.0);
        let mut causes = vec![]; let mut ends = [0.0f64;2]; let mut replaced = None;
        for run in 0..runs {
            let setup = s.setup(1000, run, &limits);
            let l = RobotLimits { delay: setup.delay.unwrap_or(limits.delay), ..limits };
            let mut body = PointRobot::new(l, setup.start, 1.0, run as u64 + 77);
            let o = trial::run(&setup, &field, limits, Settings { tracker, model, ..Settings::default() }, &mut body, run as u64, clock).unwrap();
            solves.extend(o.solves); plans.extend(o.plans); errors.extend(o.errors.clone());
            depth = depth.max(o.depth); contact += o.contact as usize; reached += o.reached as usize; stuck += o.stuck as usize; beyond = beyond.max(o.beyond); flips += o.flips; time += o.time;
            causes.extend(o.causes); ends = [ends[0].max(o.from_goal[0]), ends[1].max(o.from_goal[1])]; replaced = replaced.or(o.replaced);
            if args.len() > 4 { println!("  run {run} reached {} t {:.1} depth {:.3} contact {} stuck {} end {:?} flips {}", o.reached, o.time, o.depth, o.contact, o.stuck, o.from_goal, o.flips); }
        }
        causes.dedup();
        let st = statistics(errors.iter().copied());
        println!("{:16} runs {runs} mae {:.4} mse {:.4} depth {:.3} beyond {:.2} contact {contact} reached {reached} stuck {stuck} flips {flips} t {:.1} solve {:.3?} plan {:.3?} end {:.2?} {:?} {:?}", s.name, st[0], st[1], depth, beyond, time/runs as f64, p99(solves), p99(plans), ends, causes, replaced);
    }
}
