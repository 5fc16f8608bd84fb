//! Speed and accuracy of the kinematic stage on every clip of CMU's subject 10: `cargo bench -p instep-retarget`.
//! Skips with a message where the clips are not beside the repository.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a benchmark prints, and stops at the first surprise")]

use std::path::Path;
use std::sync::LazyLock;
use std::time::Instant;

use instep_motion::asf;
use instep_motion::reference::Source;
use instep_retarget::kinematic::{ContactForm, KinematicSettings, retarget};
use instep_robot::Robot;

/// Time that this one thread has spent on a core, s: other programs on the machine do not count. Wall time where the
/// system does not tell.
fn cpu_seconds() -> f64 {
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|text| text.split_whitespace().next().and_then(|ns| ns.parse::<f64>().ok()))
        .map_or_else(|| START.elapsed().as_secs_f64(), |ns| ns * 1e-9)
}

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let clips = root.join("../shared/data/cmu_mocap");
    if !clips.exists() {
        println!("skipped: the CMU clips are not at ../shared/data/cmu_mocap");
        return;
    }
    let robot = Robot::load(&root.join("robots/prestoe")).unwrap();
    println!("limit: 2000 frames/s on one core, stance slip 5 mm in the enforced form\n");
    println!("clip    form      frames  frames/CPU-s  iterations  keypoint error  stance slip  violations");
    for name in ["10_01", "10_02", "10_03", "10_05", "10_06"] {
        let clip = asf::load_clip(&clips.join("10.asf"), &clips.join(format!("{name}.amc")), asf::CMU_RATE).unwrap();
        for form in [ContactForm::Enforced, ContactForm::Slip] {
            let settings = KinematicSettings { form, ..KinematicSettings::default() };
            let source = Source { clip: name.into(), skeleton: None, clip_start: 0.0, acknowledgement: String::new() };
            let start = cpu_seconds();
            let done = retarget(&robot, &clip, source, &settings, &mut |_| {}).unwrap();
            let seconds = cpu_seconds() - start;
            println!(
                "{name}   {:<9} {:>5}  {:>12.0}  {:>10}  {:>11.1} mm  {:>8.1} mm  {:?}",
                format!("{form:?}"),
                clip.frames.len(),
                clip.frames.len() as f64 / seconds,
                done.iterations,
                1e3 * done.keypoint_error_mean(),
                1e3 * done.max_stance_slip,
                done.violations,
            );
            if std::env::args().any(|a| a == "--errors") {
                for (name, error) in &done.keypoint_errors {
                    println!("        {name:<16} {:.1} mm", 1e3 * error);
                }
                println!("        phases {:?} ball {:?}", done.phases, done.reference.ball);
            }
        }
    }
}
