//! Time and outcome of the kinodynamic stage, by stage: `cargo bench -p instep-retarget --bench kinodynamic -- 10_03`.
//! Without clips named: all of CMU's subject 10. `--trace` prints every step, `--save FOLDER` keeps the references,
//! `--rate`, `--time-scale`, `--friction`, `--torque-margin`, `--q_i`, `--q_a`, `--q_j`, `--q_m`, `--q_ball` and
//! `--robot` change what they say; `--slope` is the ground's rise along the kick, `--raise` its height at the ball.
//! Skips with a message where the clips are not beside the repository.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a benchmark prints, and stops at the first surprise")]

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use instep_motion::asf;
use instep_motion::reference::Source;
use instep_retarget::kinematic::{KinematicSettings, retarget};
use instep_retarget::kinodynamic::{HeightMap, KinodynamicSettings, Work, optimize};
use instep_robot::Robot;

const ACKNOWLEDGEMENT: &str = "The data used in this project was obtained from mocap.cs.cmu.edu. \
    The database was created with funding from NSF EIA-0196217.";

/// Time that this one thread has spent on a core, s: other programs on the machine do not count.
fn cpu_seconds() -> f64 {
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|text| text.split_whitespace().next().and_then(|ns| ns.parse::<f64>().ok()))
        .map_or(f64::NAN, |ns| ns * 1e-9)
}

fn peak_memory() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM")).unwrap_or("VmHWM: unknown");
    line.split(':').nth(1).unwrap_or("").trim().to_owned()
}

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let clips = root.join("../shared/data/cmu_mocap");
    if !clips.exists() {
        println!("skipped: the CMU clips are not at ../shared/data/cmu_mocap");
        return;
    }
    let args: Vec<String> = std::env::args().skip(1).collect();
    let after = |name: &str| args.iter().position(|a| a == name).and_then(|i| args.get(i + 1)).cloned();
    let trace = args.iter().any(|a| a == "--trace");
    let save = after("--save").map(PathBuf::from);
    let mut settings = KinodynamicSettings::default();
    let number = |name: &str, into: &mut f64| {
        if let Some(value) = after(name) {
            *into = value.parse().unwrap();
        }
    };
    number("--rate", &mut settings.rate);
    number("--time-scale", &mut settings.time_scale);
    number("--friction", &mut settings.friction);
    number("--torque-margin", &mut settings.torque_margin);
    number("--q_i", &mut settings.weights.q_i[0]);
    number("--q_a", &mut settings.weights.q_a);
    number("--q_j", &mut settings.weights.q_j);
    number("--q_m", &mut settings.weights.q_m);
    number("--q_ball", &mut settings.weights.q_ball);
    let (mut slope, mut raise) = (0.0, 0.0);
    number("--slope", &mut slope);
    number("--raise", &mut raise);
    if slope != 0.0 || raise != 0.0 {
        let heights = vec![vec![raise - 10.0 * slope], vec![raise + 10.0 * slope]];
        settings.ground = HeightMap { origin: [-10.0, 0.0], spacing: 20.0, heights };
    }
    let robot = Robot::load(&root.join("robots").join(after("--robot").unwrap_or("prestoe".into()))).unwrap();
    let named: Vec<&str> = args.iter().map(String::as_str).filter(|a| a.starts_with("10_")).collect();
    let all = ["10_01", "10_02", "10_03", "10_05", "10_06"];
    for name in if named.is_empty() { &all[..] } else { &named } {
        let start = Instant::now();
        let clip = asf::load_clip(&clips.join("10.asf"), &clips.join(format!("{name}.amc")), asf::CMU_RATE).unwrap();
        let read = start.elapsed();
        let source = Source {
            clip: format!("{name}.amc"),
            skeleton: Some("10.asf".into()),
            clip_start: 0.0,
            acknowledgement: ACKNOWLEDGEMENT.into(),
        };
        let kinematic = KinematicSettings::default();
        let start = Instant::now();
        let mut rescaling = None;
        let first = retarget(&robot, &clip, source, &kinematic, &mut |_| {
            rescaling.get_or_insert_with(|| start.elapsed());
        })
        .unwrap();
        let rescaling = rescaling.unwrap_or_default();
        let kinematic_time = start.elapsed() - rescaling;
        let start = Instant::now();
        let cpu = cpu_seconds();
        let stop = AtomicBool::new(false);
        let mut verifying = start.elapsed();
        let done = optimize(&robot, &first, &kinematic.weights, &settings, &stop, &mut |p| {
            if p.work == Work::Verification {
                verifying = start.elapsed();
            }
            if trace {
                println!(
                    "  {:>7.2} s step {:>3} round {:>2} cost {:>10.5} worst {:.2e} {}",
                    start.elapsed().as_secs_f64(),
                    p.iteration,
                    p.round,
                    p.cost,
                    p.violation,
                    p.family
                );
            }
        })
        .unwrap();
        let seconds = start.elapsed();
        let cpu = cpu_seconds() - cpu;
        println!(
            "{name}: {} knots at {} Hz; read {:.2} s, rescaling {:.2} s, kinematic {:.2} s, kinodynamic {:.2} s, \
             verification {:.2} s ({:.2} s of a core for the last two) in {} steps; memory {}",
            done.reference.knots.len(),
            done.reference.rate,
            read.as_secs_f64(),
            rescaling.as_secs_f64(),
            kinematic_time.as_secs_f64(),
            verifying.as_secs_f64(),
            (seconds - verifying).as_secs_f64(),
            cpu,
            done.iterations,
            peak_memory()
        );
        println!("  {:?}", done.status);
        println!("  violations {:?}", done.violations);
        let v = &done.verification;
        println!(
            "  (33) at 200 Hz: torque {} speed {} joint {} of {}; root wrench {:.4} m g at {:.3} s; slip {:.2} mm; \
             lift {:.2} mm; penetration {:.2} mm; overlap {:.2} mm; friction {:.1e}",
            v.torque_violations,
            v.speed_violations,
            v.joint_violations,
            v.samples * robot.joints.len(),
            v.root_wrench_residual,
            v.root_wrench_time,
            1e3 * v.stance_slip,
            1e3 * v.stance_lift,
            1e3 * v.penetration,
            1e3 * v.self_collision,
            v.friction
        );
        println!(
            "  foot {:.2} m/s at impact (kinematic {:.2}), {:.1} mm off; approach {:.1} deg, turned {:.2} deg; binding {:?}",
            done.foot_speed_at_impact,
            done.kinematic_foot_speed,
            1e3 * done.ball_miss,
            done.approach_angle.to_degrees(),
            done.aim_turn.to_degrees(),
            done.binding.iter().map(|b| format!("{} {} {:.2}", b.joint, b.limit, b.share)).collect::<Vec<_>>()
        );
        if let Some(folder) = &save {
            done.reference.save(&folder.join(format!("{name}_kinodynamic.json"))).unwrap();
        }
    }
}
