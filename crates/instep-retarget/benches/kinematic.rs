//! Speed and accuracy of the kinematic stage on every clip of CMU's subject 10: `cargo bench -p instep-retarget`.
//! Skips with a message where the clips are not beside the repository.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a benchmark prints, and stops at the first surprise")]

use std::path::Path;
use std::time::Instant;

use instep_motion::asf;
use instep_motion::reference::Source;
use instep_retarget::kinematic::{ContactForm, KinematicSettings, retarget};
use instep_robot::Robot;

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let clips = root.join("../shared/data/cmu_mocap");
    if !clips.exists() {
        println!("skipped: the CMU clips are not at ../shared/data/cmu_mocap");
        return;
    }
    let robot = Robot::load(&root.join("robots/prestoe")).unwrap();
    println!("limit: 2000 frames/s on one core, stance slip 5 mm in the enforced form\n");
    println!("clip    form      frames  frames/s  iterations  keypoint error  stance slip  violations");
    for name in ["10_01", "10_02", "10_03", "10_05", "10_06"] {
        let clip = asf::load_clip(&clips.join("10.asf"), &clips.join(format!("{name}.amc")), asf::CMU_RATE).unwrap();
        for form in [ContactForm::Enforced, ContactForm::Slip] {
            let settings = KinematicSettings { form, ..KinematicSettings::default() };
            let source =
                Source { clip: name.into(), skeleton: None, clip_start: 0.0, acknowledgement: String::new() };
            let start = Instant::now();
            let done = retarget(&robot, &clip, source, &settings, &mut |_| {}).unwrap();
            let seconds = start.elapsed().as_secs_f64();
            println!(
                "{name}   {:<9} {:>5}  {:>8.0}  {:>10}  {:>11.1} mm  {:>8.1} mm  {:?}",
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
