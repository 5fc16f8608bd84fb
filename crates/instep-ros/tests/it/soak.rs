//! Many goals in a row with cancels at random: every one ends as it should, and memory stays flat.

use std::time::{Duration, Instant};

use instep_ros::Mapping;
use instep_ros::form::Dynamic;
use instep_ros::msg::KickResult;
use ros2_client::action::GoalStatusEnum;

use crate::client::goal;
use crate::support::{self, Client};

/// A small generator of its own, so that a run can be repeated (Steele, Lea, Flood, SplitMix, OOPSLA 2014).
struct Random(u64);

impl Random {
    fn below(&mut self, bound: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % bound
    }
}

/// Resident memory of this process, MB.
fn memory() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with("VmRSS:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<f64>().unwrap() / 1024.0
}

/// Sends `count` goals; gives the memory after each tenth, MB.
fn goals_in_a_row(domain: u16, count: u64) -> Vec<f64> {
    let robot = support::robot();
    let simulation = support::simulation(&robot, false);
    let (node, lines) = support::node::<Dynamic>(&robot, domain, Mapping::Enhanced, Some(simulation));
    let client = Client::<Dynamic>::new(domain);
    let mut random = Random(7);
    let mut used = Vec::new();
    let start = Instant::now();
    let (mut done, mut cancelled, mut fell) = (0, 0, 0);
    for i in 0..count {
        // The foot of the last kick may still be on its way when its client already knows the end (a fall).
        let id = support::within(20.0, "an accepted goal", || {
            let (id, accepted) = client.send(&goal());
            accepted.then_some(id)
        });
        let cancels = random.below(2) == 0;
        if cancels {
            std::thread::sleep(Duration::from_millis(random.below(400)));
            client.cancel(id);
        }
        let (status, result) = client.end(id);
        match (status, result) {
            (GoalStatusEnum::Succeeded, KickResult::SUCCESS) => done += 1,
            (GoalStatusEnum::Canceled, KickResult::ABORTED) if cancels => cancelled += 1,
            (GoalStatusEnum::Aborted, KickResult::ABORTED)
                if lines.lock().unwrap().iter().any(|line| line.contains("fell")) =>
            {
                fell += 1;
            }
            other => panic!("goal {i} ended as {other:?}; {:?}", lines.lock().unwrap().last()),
        }
        while client.action.receive_feedback(id).unwrap().is_some() {}
        lines.lock().unwrap().clear();
        if (i + 1) % (count / 10).max(1) == 0 {
            used.push(memory());
        }
    }
    assert!(done > 0 && cancelled > 0, "{done} done, {cancelled} cancelled");
    assert_eq!(done + cancelled + fell, count);
    let (report, took) = (node.stop().unwrap(), start.elapsed().as_secs_f64());
    println!(
        "{count} goals in {took:.0} s: {done} done, {cancelled} cancelled, {fell} fell; MB {used:.1?}\n{report:#?}"
    );
    used
}

#[test]
fn forty_goals_in_a_row_all_end() {
    goals_in_a_row(66, 40);
}

/// The bar of issue 8. Takes some five minutes: `cargo test -p instep-ros --test it -- --ignored --nocapture`.
#[test]
#[ignore = "takes some five minutes"]
fn a_thousand_goals_leave_memory_flat() {
    let used = goals_in_a_row(67, 1000);
    // The first tenth warms up caches and allocator.
    let (first, last) = (used[1], used[used.len() - 1]);
    assert!(last < first + 4.0, "memory grows: {used:.1?} MB");
}
