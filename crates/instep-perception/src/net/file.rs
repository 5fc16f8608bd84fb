//! A detector's file: safetensors with PyTorch's names and shapes, and what it was trained for in the header.

use std::collections::HashMap;
use std::path::Path;

use safetensors::tensor::{Dtype, SafeTensors, TensorView};

use super::shape::{LAYERS, parameters, parts};
use crate::PerceptionError;

/// The name and shape of each tensor, in the order of the flat parameters.
pub(crate) fn tensors() -> Vec<(String, Vec<usize>)> {
    LAYERS
        .iter()
        .enumerate()
        .flat_map(|(i, layer)| {
            let c = layer.conv;
            [
                (format!("layer_{i}.weight"), vec![c.outputs, c.inputs, c.kernel, c.kernel]),
                (format!("layer_{i}.bias"), vec![c.outputs]),
            ]
        })
        .collect()
}

/// The file of a network's parameters, and of whatever else a training keeps beside them.
///
/// # Errors
/// [`PerceptionError::File`] when the writer refuses.
pub fn bytes(
    weights: &[f32],
    more: &[(&str, &[f32])],
    notes: HashMap<String, String>,
) -> Result<Vec<u8>, PerceptionError> {
    let of = |values: &[f32]| values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let ranges = parts().into_iter().flat_map(|(w, b)| [w, b]);
    let mut data: Vec<(String, Vec<usize>, Vec<u8>)> =
        tensors().into_iter().zip(ranges).map(|((name, shape), range)| (name, shape, of(&weights[range]))).collect();
    data.extend(more.iter().map(|(name, values)| ((*name).to_owned(), vec![values.len()], of(values))));
    let refused = |e: safetensors::SafeTensorError| PerceptionError::file(Path::new("detector"), e);
    let views: Vec<(&str, TensorView<'_>)> = data
        .iter()
        .map(|(name, shape, bytes)| {
            TensorView::new(Dtype::F32, shape.clone(), bytes).map(|view| (name.as_str(), view)).map_err(refused)
        })
        .collect::<Result<_, _>>()?;
    safetensors::serialize(views, Some(notes)).map_err(refused)
}

/// The parameters in a detector's file, and the vectors of the names in `more`.
///
/// # Errors
/// [`PerceptionError::File`] naming the file and the tensor that is missing, of another shape or not finite.
pub fn read(path: &Path, more: &[&str]) -> Result<(Vec<f32>, Vec<Vec<f32>>), PerceptionError> {
    let bytes = std::fs::read(path).map_err(|e| PerceptionError::file(path, e))?;
    parse(&bytes, path, more)
}

/// As [`read`], from bytes; `path` is what errors name.
///
/// # Errors
/// As [`read`].
pub fn parse(bytes: &[u8], path: &Path, more: &[&str]) -> Result<(Vec<f32>, Vec<Vec<f32>>), PerceptionError> {
    let file = SafeTensors::deserialize(bytes)
        .map_err(|e| PerceptionError::file(path, format!("{e}; expected a detector's safetensors file")))?;
    let values = |name: &str, shape: Option<&[usize]>| {
        let view = file.tensor(name).map_err(|_| {
            PerceptionError::file(path, format!("no tensor {name}; expected a detector of `instep see train`"))
        })?;
        if view.dtype() != Dtype::F32 || shape.is_some_and(|shape| view.shape() != shape) {
            let wanted = shape.map_or("one number after the other".to_owned(), |s| format!("{s:?}"));
            let found = format!("{name}: {:?} of {:?}; expected F32 of {wanted}", view.shape(), view.dtype());
            return Err(PerceptionError::file(path, found));
        }
        let values: Vec<f32> =
            view.data().chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        match values.iter().position(|v| !v.is_finite()) {
            Some(at) => Err(PerceptionError::file(
                path,
                format!("{name}: number {at} is {}; expected a finite one", values[at]),
            )),
            None => Ok(values),
        }
    };
    let mut weights = Vec::with_capacity(parameters());
    for (name, shape) in tensors() {
        weights.extend(values(&name, Some(&shape))?);
    }
    let more = more.iter().map(|name| values(name, None)).collect::<Result<_, _>>()?;
    Ok((weights, more))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng as _;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn a_file_gives_the_same_parameters_and_a_wrong_one_is_named() {
        let weights = super::super::shape::initial(&mut ChaCha8Rng::seed_from_u64(1));
        let path = Path::new("own.safetensors");
        let file = bytes(&weights, &[("step", &[7.0])], HashMap::new()).unwrap();
        let (back, more) = parse(&file, path, &["step"]).unwrap();
        assert_eq!((back, more), (weights.clone(), vec![vec![7.0]]));
        assert!(parse(&file[..100], path, &[]).unwrap_err().to_string().starts_with("own.safetensors: "));
        assert!(parse(&file, path, &["moments"]).unwrap_err().to_string().contains("no tensor moments"));
        let mut broken = weights;
        broken[3] = f32::NAN;
        let file = bytes(&broken, &[], HashMap::new()).unwrap();
        assert!(parse(&file, path, &[]).unwrap_err().to_string().contains("layer_0.weight: number 3 is NaN"));
    }
}
