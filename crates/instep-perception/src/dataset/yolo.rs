//! YOLO's layout: `images/`, `labels/` with a text file for each image, class names in `data.yaml`.

use std::path::{Path, PathBuf};

use super::{class, label, rect};
use crate::PerceptionError;
use crate::class::Class;
use crate::label::Label;

/// All images of a folder with their labels.
pub(super) fn read(folder: &Path) -> Result<Vec<(PathBuf, Vec<Label>)>, PerceptionError> {
    let place = folder.join("images");
    let entries = std::fs::read_dir(&place).map_err(|e| {
        PerceptionError::file(&place, format!("{e}; expected YOLO's layout: images/, labels/, data.yaml"))
    })?;
    let mut images: Vec<PathBuf> = entries
        .filter_map(|entry| entry.ok().map(|e| e.path()))
        .filter(|path| {
            path.extension().is_some_and(|e| ["png", "jpg", "jpeg"].iter().any(|k| e.eq_ignore_ascii_case(k)))
        })
        .collect();
    images.sort();
    if images.is_empty() {
        return Err(PerceptionError::file(&place, "no PNG or JPEG image"));
    }
    let classes = classes(&folder.join("data.yaml"))?;
    images
        .into_iter()
        .map(|image| {
            let name = image.file_stem().unwrap_or_default();
            let labels = labels(&folder.join("labels").join(name).with_extension("txt"), &classes)?;
            Ok((image, labels))
        })
        .collect()
}

/// The labels of an image, at the network's size. No file means nothing is there.
fn labels(path: &Path, classes: &[Class]) -> Result<Vec<Label>, PerceptionError> {
    if !path.exists() {
        return Ok(Vec::new());
    }
    let text = std::fs::read_to_string(path).map_err(|e| PerceptionError::file(path, e))?;
    text.lines()
        .enumerate()
        .filter(|(_, line)| !line.trim().is_empty())
        .map(|(number, line)| {
            let wrong = |what: String| PerceptionError::file(path, format!("line {}: {what}", number + 1));
            let values: Vec<f32> = line.split_whitespace().map_while(|word| word.parse().ok()).collect();
            let [class, x, y, w, h] = values[..] else {
                return Err(wrong("expected five numbers: class x y width height".to_owned()));
            };
            let known = classes.get(class as usize).filter(|_| class >= 0.0 && class.fract() == 0.0);
            let class = *known
                .ok_or_else(|| wrong(format!("class {class}; expected 0 to {}", classes.len().saturating_sub(1))))?;
            let rect = rect([x, y, w, h]).ok_or_else(|| {
                wrong(format!("box {x} {y} {w} {h} outside the image; expected shares of its size from 0 to 1"))
            })?;
            Ok(label(class, rect, false))
        })
        .collect()
}

/// Our classes in the order of the set's `data.yaml`; ours where there is none.
fn classes(path: &Path) -> Result<Vec<Class>, PerceptionError> {
    if !path.exists() {
        return Ok(Class::ALL.to_vec());
    }
    let text = std::fs::read_to_string(path).map_err(|e| PerceptionError::file(path, e))?;
    let mut names = Vec::new();
    let mut within = false;
    for (number, line) in text.lines().enumerate() {
        let line = line.trim_end();
        let mut word = |name: &str| {
            let name = name.trim().trim_matches(['"', '\'']);
            if name.is_empty() {
                return Ok(());
            }
            let named = class(name);
            names.push(named.map_err(|e| PerceptionError::file(path, format!("line {}: {e}", number + 1)))?);
            Ok(())
        };
        if let Some(rest) = line.strip_prefix("names:") {
            within = true;
            rest.trim().trim_matches(['[', ']']).split(',').try_for_each(&mut word)?;
        } else if within && line.starts_with([' ', '-']) {
            word(
                line.trim_start_matches([' ', '-'])
                    .split_once(':')
                    .map_or(line.trim_start_matches([' ', '-']), |p| p.1),
            )?;
        } else {
            within = false;
        }
    }
    if names.is_empty() { Err(PerceptionError::file(path, "no names; expected a list `names:`")) } else { Ok(names) }
}
