//! COCO's layout: one JSON file of images, annotations and categories; crowds are labels that need not be found.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::{class, label, rect};
use crate::PerceptionError;
use crate::label::Label;

#[derive(Deserialize)]
struct File {
    images: Vec<Image>,
    annotations: Vec<Annotation>,
    categories: Vec<Category>,
}

#[derive(Deserialize)]
struct Image {
    id: u64,
    file_name: PathBuf,
    width: f32,
    height: f32,
}

#[derive(Deserialize)]
struct Annotation {
    image_id: u64,
    category_id: u64,
    /// Left, top, width, height, pixels.
    bbox: [f32; 4],
    #[serde(default)]
    iscrowd: u8,
}

#[derive(Deserialize)]
struct Category {
    id: u64,
    name: String,
}

/// All images of a file with their labels. Images lie where `file_name` says, from the file's folder or its `images/`.
pub(super) fn read(path: &Path) -> Result<Vec<(PathBuf, Vec<Label>)>, PerceptionError> {
    let wrong = |what: String| PerceptionError::file(path, what);
    let text = std::fs::read_to_string(path).map_err(|e| PerceptionError::file(path, e))?;
    let file: File = serde_json::from_str(&text)
        .map_err(|e| wrong(format!("{e}; expected a COCO file with images, annotations and categories")))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut places = HashMap::new();
    let mut images = Vec::with_capacity(file.images.len());
    for (k, image) in file.images.iter().enumerate() {
        if !(image.width >= 1.0 && image.height >= 1.0) {
            let size = format!("{} x {}", image.width, image.height);
            return Err(wrong(format!("images[{k}]: {size} pixels; expected a width and a height")));
        }
        places.insert(image.id, k);
        let beside = folder.join(&image.file_name);
        let place = if beside.exists() { beside } else { folder.join("images").join(&image.file_name) };
        images.push((place, Vec::new()));
    }
    let mut classes = HashMap::new();
    for (k, category) in file.categories.iter().enumerate() {
        classes.insert(category.id, class(&category.name).map_err(|e| wrong(format!("categories[{k}]: {e}")))?);
    }
    for (k, annotation) in file.annotations.iter().enumerate() {
        let unknown =
            |field: &str, id: u64| wrong(format!("annotations[{k}].{field}: {id}; expected an id that is in the file"));
        let at = *places.get(&annotation.image_id).ok_or_else(|| unknown("image_id", annotation.image_id))?;
        let class =
            *classes.get(&annotation.category_id).ok_or_else(|| unknown("category_id", annotation.category_id))?;
        let (image, [x, y, w, h]) = (&file.images[at], annotation.bbox);
        let shares = [(x + w / 2.0) / image.width, (y + h / 2.0) / image.height, w / image.width, h / image.height];
        let rect = rect(shares).ok_or_else(|| {
            let size = format!("{} x {}", image.width, image.height);
            wrong(format!("annotations[{k}].bbox: {:?} outside an image of {size} pixels", annotation.bbox))
        })?;
        images[at].1.push(label(class, rect, annotation.iscrowd != 0));
    }
    Ok(images)
}
