//! Every physics step of a kick in files that a program of its own can read: the compiled model (`model.mjb`), what stands where
//! (`steps.json`), and the numbers (`steps.f64`, little-endian). `tools/replay.py` does the kick again from them.

use std::path::Path;

use instep_sim::World;
use instep_sim::trial::Trial;

use crate::failure::Failure;
use crate::files;

/// Finds out whether the files can be written, and tells `world` to keep its steps.
///
/// # Errors
/// When they cannot.
pub(super) fn prepare(folder: &Path, world: &mut World) -> Result<(), Failure> {
    for name in ["model.mjb", "steps.json", "steps.f64"] {
        files::check_file(&folder.join(name))?;
    }
    world.keep_steps();
    Ok(())
}

/// Writes the steps of `trial`, which `world` has run.
///
/// # Errors
/// When a file cannot be written.
pub(super) fn write(folder: &Path, world: &mut World, trial: &Trial) -> Result<(), Failure> {
    let Some(steps) = &trial.record.steps else { return Ok(()) };
    let robot = world.robot().clone();
    let model = world.mujoco().model();
    let joints: Vec<&str> = robot.joints.iter().map(|joint| joint.name.as_str()).collect();
    let about = serde_json::json!({
        "robot": robot.name,
        "mujoco": "3.17.0",
        "steps": steps.rows.len() / steps.width.max(1),
        "width": steps.width,
        "row": ["dt", "qpos", "qvel", "qfrc_applied", "xfrc_base", "xfrc_ball"],
        "nq": steps.end.len() - model.ffi().nv as usize,
        "nv": model.ffi().nv,
        "base": robot.link_name(robot.base),
        "ball": "instep_ball",
        "joints": joints,
        "torque": robot.joints.iter().map(|joint| joint.torque).collect::<Vec<_>>(),
        "speed": robot.joints.iter().map(|joint| joint.speed).collect::<Vec<_>>(),
        "corner": robot.joints.iter().map(|joint| joint.corner).collect::<Vec<_>>(),
    });
    let numbers: Vec<u8> = steps.rows.iter().chain(&steps.end).flat_map(|number| number.to_le_bytes()).collect();
    let mut batch = files::Batch::default();
    let [binary, json, rows] = ["model.mjb", "steps.json", "steps.f64"].map(|name| folder.join(name));
    let model_file = batch.stage(&binary)?.to_owned();
    model.save_to_file(&model_file).map_err(Failure::other)?;
    for (path, bytes) in [(json, about.to_string().into_bytes()), (rows, numbers)] {
        let staged = batch.stage(&path)?.to_owned();
        std::fs::write(&staged, bytes)
            .map_err(|e| Failure::input(format!("{}: cannot be written: {e}", path.display())))?;
    }
    batch.commit()
}
