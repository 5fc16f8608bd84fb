//! All that a training needs to go on: weights, optimiser, observations' moments, starts, clock and curve, in one safetensors
//! file that appears whole or not at all. The environments themselves are not in it: they start new episodes.

use std::collections::HashMap;
use std::path::Path;

use safetensors::tensor::{Dtype, SafeTensors, TensorView};

use crate::LearnError;
use crate::adam::Adam;
use crate::settings::LearnSettings;
use crate::train::{State, Training};

const SETTINGS: &str = "settings";
const STATE: &str = "state";

/// Writes `bytes` to `path` whole or not at all.
///
/// # Errors
/// When the file cannot be written; what stood there before is then still there.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), LearnError> {
    let temporary = path.with_extension("part");
    let written = std::fs::File::create(&temporary).and_then(|mut file| {
        std::io::Write::write_all(&mut file, bytes)?;
        file.sync_all()?;
        std::fs::rename(&temporary, path)
    });
    written.map_err(|e| {
        // Nothing more can be done about a temporary file that cannot be removed either.
        let _ = std::fs::remove_file(&temporary);
        LearnError::file(path, format!("cannot be written: {e}"))
    })
}

/// The settings and the state in a checkpoint's header.
///
/// # Errors
/// When the file cannot be read or is no checkpoint.
pub fn peek(path: &Path) -> Result<(LearnSettings, State), LearnError> {
    let bytes = std::fs::read(path).map_err(|e| LearnError::file(path, format!("cannot be read: {e}")))?;
    header(&bytes).map_err(|detail| LearnError::file(path, detail))
}

fn header(bytes: &[u8]) -> Result<(LearnSettings, State), String> {
    let (_, metadata) =
        SafeTensors::read_metadata(bytes).map_err(|e| format!("{e}; expected a checkpoint (safetensors)"))?;
    let entry = |key: &str| {
        metadata.metadata().as_ref().and_then(|map| map.get(key)).ok_or(format!("no {key}; expected a checkpoint"))
    };
    let settings = serde_json::from_str(entry(SETTINGS)?).map_err(|e| format!("{SETTINGS}: {e}"))?;
    let state = serde_json::from_str(entry(STATE)?).map_err(|e| format!("{STATE}: {e}"))?;
    Ok((settings, state))
}

/// Writes a checkpoint of `training`.
///
/// # Errors
/// When the file cannot be written.
pub fn save(training: &Training, path: &Path) -> Result<(), LearnError> {
    let wrong = |e: &dyn std::fmt::Display| LearnError::file(path, format!("cannot be made: {e}"));
    let f32s = |values: &[f32]| values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let f64s = |values: &[f64]| values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let (ppo, rollout) = (&training.ppo, &training.rollout);
    let moments = &rollout.moments;
    let scalars = [ppo.rate, ppo.actor_adam.t as f64, ppo.warm_up as f64, moments.count, ppo.critic_adam.t as f64];
    let tensors = [
        ("weights", Dtype::F32, f32s(&ppo.weights.flat)),
        ("actor.m", Dtype::F32, f32s(&ppo.actor_adam.m)),
        ("actor.v", Dtype::F32, f32s(&ppo.actor_adam.v)),
        ("critic.m", Dtype::F32, f32s(&ppo.critic_adam.m)),
        ("critic.v", Dtype::F32, f32s(&ppo.critic_adam.v)),
        ("moments.sum", Dtype::F64, f64s(&moments.sum)),
        ("moments.square", Dtype::F64, f64s(&moments.square)),
        ("starts", Dtype::F64, f64s(&rollout.starts.failures)),
        ("scalars", Dtype::F64, f64s(&scalars)),
    ];
    let views = tensors
        .iter()
        .map(|(name, kind, bytes)| {
            let width = if *kind == Dtype::F32 { 4 } else { 8 };
            Ok((*name, TensorView::new(*kind, vec![bytes.len() / width], bytes)?))
        })
        .collect::<Result<Vec<_>, safetensors::SafeTensorError>>()
        .map_err(|e| wrong(&e))?;
    let metadata = HashMap::from([
        (SETTINGS.to_owned(), serde_json::to_string(&training.scene.settings).map_err(|e| wrong(&e))?),
        (STATE.to_owned(), serde_json::to_string(&training.state).map_err(|e| wrong(&e))?),
    ]);
    let bytes = safetensors::serialize(views, Some(metadata)).map_err(|e| wrong(&e))?;
    write_whole(path, &bytes)
}

/// Brings `training`, made with the checkpoint's settings, to where the checkpoint was.
///
/// # Errors
/// When the file cannot be read, or is of another training.
pub fn restore(training: &mut Training, path: &Path) -> Result<(), LearnError> {
    let bytes = std::fs::read(path).map_err(|e| LearnError::file(path, format!("cannot be read: {e}")))?;
    fill(training, &bytes).map_err(|detail| LearnError::file(path, detail))
}

fn fill(training: &mut Training, bytes: &[u8]) -> Result<(), String> {
    let (_, state) = header(bytes)?;
    let file = SafeTensors::deserialize(bytes).map_err(|e| e.to_string())?;
    let raw = |name: &str, kind: Dtype, len: usize| {
        let tensor = file.tensor(name).map_err(|e| format!("tensor {name}: {e}"))?;
        let found: usize = tensor.shape().iter().product();
        if tensor.dtype() != kind || found != len {
            return Err(format!(
                "tensor {name}: {found} numbers; expected {len}: the checkpoint is of another training"
            ));
        }
        Ok(tensor.data())
    };
    let f32s = |name: &str, len: usize| -> Result<Vec<f32>, String> {
        Ok(raw(name, Dtype::F32, len)?.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect())
    };
    let f64s = |name: &str, len: usize| -> Result<Vec<f64>, String> {
        Ok(raw(name, Dtype::F64, len)?.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect())
    };
    let parameters = training.ppo.weights.flat.len();
    let observations = training.rollout.moments.sum.len();
    let (actor, critic) = (training.ppo.weights.sigma_part().end, training.ppo.weights.critic_part().len());
    let weights = f32s("weights", parameters)?;
    let (actor_m, actor_v) = (f32s("actor.m", actor)?, f32s("actor.v", actor)?);
    let (critic_m, critic_v) = (f32s("critic.m", critic)?, f32s("critic.v", critic)?);
    let (sum, square) = (f64s("moments.sum", observations)?, f64s("moments.square", observations)?);
    let starts = f64s("starts", training.rollout.starts.failures.len())?;
    let scalars = f64s("scalars", 5)?;
    let finite = [&weights, &actor_m, &actor_v, &critic_m, &critic_v].into_iter().flatten().all(|x| x.is_finite())
        && sum.iter().chain(&square).chain(&starts).chain(&scalars).all(|x| x.is_finite());
    if !finite {
        return Err("a number is not finite".into());
    }
    training.ppo.weights.flat = weights;
    training.ppo.actor_adam = Adam { m: actor_m, v: actor_v, t: scalars[1] as u64 };
    training.ppo.critic_adam = Adam { m: critic_m, v: critic_v, t: scalars[4] as u64 };
    training.ppo.rate = scalars[0];
    training.ppo.warm_up = scalars[2] as u64;
    let moments = &mut training.rollout.moments;
    (moments.sum, moments.square, moments.count) = (sum, square, scalars[3]);
    training.rollout.starts.failures = starts;
    training.state = state;
    Ok(())
}
