//! KickBench without the command line: `bench [engine,..] [robot,..] [scenario,..|all] [requests] [seeds]`.
#![allow(clippy::print_stdout, clippy::print_stderr, clippy::unwrap_used)]

use std::path::Path;

use instep_bench::table::{csv, markdown, rows_over_seeds};
use instep_bench::{Bench, Scenario, Subject};

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let list = |i: usize, default: &str| {
        args.get(i).map_or(default, String::as_str).split(',').map(str::to_owned).collect::<Vec<_>>()
    };
    let number = |i: usize, default: u64| args.get(i).and_then(|a| a.parse().ok()).unwrap_or(default);
    let wanted = list(3, "all");
    let mut scenarios = Scenario::load_all(Path::new("scenarios")).unwrap();
    scenarios.retain(|s| wanted[0] == "all" || wanted.contains(&s.name));
    let bench = Bench {
        engines: list(1, "dynamic"),
        subjects: list(2, "nao,wolfgang")
            .iter()
            .map(|name| Subject::load(Path::new("robots"), name).unwrap())
            .collect(),
        scenarios,
        seeds: (1..=number(5, 1)).collect(),
        requests: number(4, 20) as usize,
    };
    let start = std::time::Instant::now();
    let resume = std::env::var("BENCH_RESUME").ok();
    let cells = bench
        .run(resume.as_deref().map(Path::new), &|done, all, key| {
            eprintln!("{done}/{all} {} {} {} {}", key.engine, key.robot, key.scenario, key.seed);
        })
        .unwrap();
    let rows = rows_over_seeds(&cells);
    println!("{}", markdown(&rows));
    for row in &rows {
        println!("{} {} {}: refused {:?}", row.engine, row.robot, row.scenario, row.refused_why);
    }
    if let Ok(file) = std::env::var("BENCH_CSV") {
        std::fs::write(file, csv(&rows)).unwrap();
    }
    println!("{:.1} s", start.elapsed().as_secs_f64());
}
