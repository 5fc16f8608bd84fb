//! A policy's file: safetensors with the network, the normalisation of its observations, the reference that it follows and
//! a header, so that one file of a few MiB runs on its own.
//!
//! Tensors: `actor.<i>.weight` (out x in) and `actor.<i>.bias` as PyTorch lays them out, `observation.mean`,
//! `observation.deviation`, all f32; `reference`: the bytes of its JSON. The header is JSON under the metadata key
//! `instep`. Same policy, same bytes.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use instep_motion::reference::Reference;
use instep_robot::Robot;
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use serde::{Deserialize, Serialize};

use super::follower::{Follower, FollowerSettings};
use super::network::{Activation, Layer, Network, Normalizer};
use crate::KickError;
use crate::track::Track;

/// The key of the header among the file's metadata.
const HEADER: &str = "instep";
/// The most layers that a file may have.
const MOST_LAYERS: usize = 16;

/// What a policy is, beside its numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PolicyHeader {
    /// Version of this layout: 1.
    pub format: u32,
    /// The robot's name.
    pub robot: String,
    /// File name of the reference.
    pub reference: String,
    /// The part of the reference that is followed, s.
    pub window: [f64; 2],
    /// Observation and action.
    pub follower: FollowerSettings,
    /// Between the network's layers.
    pub activation: Activation,
    /// Control steps of training behind it.
    pub steps: u64,
}

impl PolicyHeader {
    /// The layout that this version writes and reads.
    pub const FORMAT: u32 = 1;
}

/// A policy.
#[derive(Debug, Clone)]
pub struct Policy {
    /// What it is.
    pub header: PolicyHeader,
    /// What it follows.
    pub reference: Arc<Reference>,
    /// The network.
    pub network: Network,
}

impl Policy {
    /// Reads a policy.
    ///
    /// # Errors
    /// [`KickError::Read`] when the file cannot be read, [`KickError::Parse`] with what is wrong in it.
    pub fn load(path: &Path) -> Result<Self, KickError> {
        let name = path.display().to_string();
        let bytes = std::fs::read(path).map_err(|e| KickError::Read { file: name.clone(), detail: e.to_string() })?;
        Self::from_bytes(&bytes).map_err(|detail| KickError::Parse { file: name, detail })
    }

    /// Reads a policy from the bytes of its file.
    ///
    /// # Errors
    /// What is wrong with them, and what would be right.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        let (_, metadata) =
            SafeTensors::read_metadata(bytes).map_err(|e| format!("{e}; expected a policy (safetensors)"))?;
        let file = SafeTensors::deserialize(bytes).map_err(|e| format!("{e}; expected a policy (safetensors)"))?;
        let header = metadata
            .metadata()
            .as_ref()
            .and_then(|map| map.get(HEADER))
            .ok_or("no header of a policy; expected a file that `instep train` wrote")?;
        let header: PolicyHeader = serde_json::from_str(header).map_err(|e| format!("header: {e}"))?;
        if header.format != PolicyHeader::FORMAT {
            return Err(format!("format {}; expected {}", header.format, PolicyHeader::FORMAT));
        }
        let reference = file.tensor("reference").map_err(|e| format!("tensor reference: {e}"))?;
        let reference: Reference =
            serde_json::from_slice(reference.data()).map_err(|e| format!("tensor reference: {e}"))?;
        reference.validate().map_err(|e| format!("tensor reference: {e}"))?;
        let network = network(&file, header.activation)?;
        Ok(Self { header, reference: Arc::new(reference), network })
    }

    /// The bytes of its file.
    ///
    /// # Errors
    /// When something in it cannot be written, such as a NaN.
    pub fn to_bytes(&self) -> Result<Vec<u8>, String> {
        let numbers = |values: &[f32]| values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
        let mut tensors = Vec::new();
        let mut inputs = self.network.inputs();
        for (i, layer) in self.network.layers.iter().enumerate() {
            let outputs = layer.bias.len();
            tensors.push((format!("actor.{i}.weight"), Dtype::F32, vec![outputs, inputs], numbers(&layer.weight)));
            tensors.push((format!("actor.{i}.bias"), Dtype::F32, vec![outputs], numbers(&layer.bias)));
            inputs = outputs;
        }
        let normalizer = &self.network.normalizer;
        for (name, values) in [("mean", &normalizer.mean), ("deviation", &normalizer.deviation)] {
            tensors.push((format!("observation.{name}"), Dtype::F32, vec![values.len()], numbers(values)));
        }
        let finite = |values: &[f32]| values.iter().all(|x| x.is_finite());
        let layers = &self.network.layers;
        if !layers.iter().all(|layer| finite(&layer.weight) && finite(&layer.bias)) {
            return Err("a weight is not finite".into());
        }
        let reference = serde_json::to_vec(&*self.reference).map_err(|e| e.to_string())?;
        tensors.push(("reference".into(), Dtype::U8, vec![reference.len()], reference));
        let views = tensors
            .iter()
            .map(|(name, kind, shape, bytes)| Ok((name, TensorView::new(*kind, shape.clone(), bytes)?)))
            .collect::<Result<Vec<_>, safetensors::SafeTensorError>>()
            .map_err(|e| e.to_string())?;
        let header = serde_json::to_string(&self.header).map_err(|e| e.to_string())?;
        let metadata = HashMap::from([(HEADER.to_owned(), header)]);
        safetensors::serialize(views, Some(metadata)).map_err(|e| e.to_string())
    }

    /// What turns sensor readings into this policy's observations and its actions into commands, on `robot`.
    ///
    /// # Errors
    /// When the robot is another one, or the network has another shape than the robot asks for.
    pub fn follower(&self, robot: &Robot) -> Result<Follower, KickError> {
        let track = Track::new(robot, Arc::clone(&self.reference), self.header.window)?;
        let follower = Follower::new(robot, track, self.header.follower.clone());
        let (found, expected) =
            ([self.network.inputs(), self.network.outputs()], [follower.observation_len(), follower.action_len()]);
        if found != expected {
            return Err(KickError::Setting {
                field: "the policy's network".into(),
                found: format!("{} inputs and {} outputs", found[0], found[1]),
                expected: format!("{} and {} for {}", expected[0], expected[1], robot.name),
            });
        }
        Ok(follower)
    }
}

/// Reads the network, checking every shape.
fn network(file: &SafeTensors<'_>, activation: Activation) -> Result<Network, String> {
    let numbers = |name: &str, shape: &[Option<usize>]| -> Result<(Vec<f32>, Vec<usize>), String> {
        let tensor = file.tensor(name).map_err(|e| format!("tensor {name}: {e}"))?;
        let fits = tensor.shape().len() == shape.len()
            && tensor.shape().iter().zip(shape).all(|(found, wanted)| wanted.is_none_or(|wanted| wanted == *found));
        if tensor.dtype() != Dtype::F32 || !fits {
            return Err(format!(
                "tensor {name}: {:?} of shape {:?}; expected F32 of shape {shape:?}",
                tensor.dtype(),
                tensor.shape()
            ));
        }
        let values: Vec<f32> =
            tensor.data().as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
        match values.iter().position(|x| !x.is_finite()) {
            Some(at) => Err(format!("tensor {name}: entry {at} is {}; expected finite numbers", values[at])),
            None => Ok((values, tensor.shape().to_vec())),
        }
    };
    let (mean, _) = numbers("observation.mean", &[None])?;
    let (deviation, _) = numbers("observation.deviation", &[Some(mean.len())])?;
    if let Some(at) = deviation.iter().position(|&x| x <= 0.0) {
        return Err(format!("tensor observation.deviation: entry {at} is {}; expected above 0", deviation[at]));
    }
    let mut layers = Vec::new();
    let mut inputs = mean.len();
    while file.tensor(&format!("actor.{}.weight", layers.len())).is_ok() && layers.len() < MOST_LAYERS {
        let (weight, shape) = numbers(&format!("actor.{}.weight", layers.len()), &[None, Some(inputs)])?;
        let (bias, _) = numbers(&format!("actor.{}.bias", layers.len()), &[Some(shape[0])])?;
        layers.push(Layer { weight, bias });
        inputs = shape[0];
    }
    if layers.is_empty() {
        return Err("tensor actor.0.weight: missing".into());
    }
    Ok(Network::new(Normalizer { mean, deviation }, layers, activation))
}
