//! Every physics step of a kick in files that a program of its own can read: the compiled model (`model.mjb`), what stands where
//! (`steps.json`), and the numbers (`steps.f64` and `commands.f64`, little-endian). `tools/replay.py` does the kick again from
//! them.

use std::path::Path;

use instep_robot::Joint;
use instep_sim::World;
use instep_sim::trial::Trial;

use crate::failure::Failure;
use crate::files;

/// What is written: model, description, steps, commands.
const FILES: [&str; 4] = ["model.mjb", "steps.json", "steps.f64", "commands.f64"];

/// Finds out whether the files can be written, and tells `world` to keep its steps.
///
/// # Errors
/// When they cannot.
pub(super) fn prepare(folder: &Path, world: &mut World) -> Result<(), Failure> {
    for name in FILES {
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
    let (robot, settings) = (world.robot().clone(), *world.settings());
    let encoder_offsets = world.encoder_offsets().to_vec();
    let model = world.mujoco().model();
    let of_joints = |value: fn(&Joint) -> f64| robot.joints.iter().map(value).collect::<Vec<_>>();
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
        "drives": settings.drives,
        "kind": robot.drives.kind,
        "period": robot.drives.period,
        "delay": robot.drives.delay,
        "sag": robot.drives.sag,
        "drag": settings.ball.drag,
        "joints": robot.joints.iter().map(|joint| joint.name.as_str()).collect::<Vec<_>>(),
        "encoder_offsets": encoder_offsets,
        "torque": of_joints(|joint| joint.torque),
        "speed": of_joints(|joint| joint.speed),
        "corner": of_joints(|joint| joint.corner),
        "kp": of_joints(|joint| joint.kp),
        "kd": of_joints(|joint| joint.kd),
        "p": of_joints(|joint| joint.pid.p),
        "i": of_joints(|joint| joint.pid.i),
        "d": of_joints(|joint| joint.pid.d),
        "dead_zone": of_joints(|joint| joint.dead_zone),
        "play": of_joints(|joint| joint.play),
    });
    let bytes = |numbers: &[f64]| numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>();
    let rows = [bytes(&steps.rows), bytes(&steps.end)].concat();
    let mut batch = files::Batch::default();
    let [binary, json, numbers, commands] = FILES.map(|name| folder.join(name));
    let model_file = batch.stage(&binary)?.to_owned();
    model.save_to_file(&model_file).map_err(Failure::other)?;
    let files = [(json, about.to_string().into_bytes()), (numbers, rows), (commands, bytes(&steps.commands))];
    for (path, bytes) in files {
        let staged = batch.stage(&path)?.to_owned();
        std::fs::write(&staged, bytes)
            .map_err(|e| Failure::input(format!("{}: cannot be written: {e}", path.display())))?;
    }
    batch.commit()
}
