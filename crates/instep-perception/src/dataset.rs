//! Labelled sets on disc: images with YOLO label files beside them, and one COCO file over all.
//!
//! `images/000000.png`, `labels/000000.txt` (class, middle and size as shares of the image; class numbers as in
//! `data.yaml`), `annotations.json`. Reading takes the YOLO half, so a team's own folder can be trained on.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::PerceptionError;
use crate::class::Class;
use crate::label::{Label, Rect};
use crate::net::shape;
use crate::picture::Frame;
use crate::train::Source;

/// A set under construction.
#[derive(Debug)]
pub struct Writer {
    folder: PathBuf,
    images: Vec<serde_json::Value>,
    annotations: Vec<serde_json::Value>,
}

impl Writer {
    /// Into a folder that is made.
    ///
    /// # Errors
    /// [`PerceptionError::File`] when it cannot be made.
    pub fn new(folder: &Path) -> Result<Self, PerceptionError> {
        for part in ["images", "labels"] {
            let path = folder.join(part);
            std::fs::create_dir_all(&path).map_err(|e| PerceptionError::file(&path, e))?;
        }
        let mut names = String::from("path: .\ntrain: images\nval: images\nnames:\n");
        for class in Class::ALL {
            let _ = writeln!(names, "  {}: {}", class.index(), class.name());
        }
        put(&folder.join("data.yaml"), names.as_bytes())?;
        Ok(Writer { folder: folder.to_owned(), images: Vec::new(), annotations: Vec::new() })
    }

    /// Adds a frame; ignored labels are COCO's `iscrowd` and are not in YOLO's file.
    ///
    /// # Errors
    /// [`PerceptionError::File`] when a file cannot be written.
    pub fn add(&mut self, frame: &Frame, labels: &[Label]) -> Result<(), PerceptionError> {
        let id = self.images.len();
        let name = format!("{id:06}");
        put(&self.folder.join(format!("images/{name}.png")), &frame.png())?;
        let (w, h) = (frame.width as f32, frame.height as f32);
        let mut lines = String::new();
        for label in labels {
            let (r, [x, y]) = (label.rect, label.rect.middle());
            if !label.ignored {
                let _ = writeln!(
                    lines,
                    "{} {:.6} {:.6} {:.6} {:.6}",
                    label.class.index(),
                    x / w,
                    y / h,
                    r.width() / w,
                    r.height() / h
                );
            }
            self.annotations.push(serde_json::json!({
                "id": self.annotations.len() + 1,
                "image_id": id,
                "category_id": label.class.index() + 1,
                "bbox": [r.left, r.top, r.width(), r.height()],
                "area": r.area(),
                "iscrowd": u8::from(label.ignored),
            }));
        }
        put(&self.folder.join(format!("labels/{name}.txt")), lines.as_bytes())?;
        self.images.push(serde_json::json!({
            "id": id, "file_name": format!("images/{name}.png"), "width": frame.width, "height": frame.height,
        }));
        Ok(())
    }

    /// Writes the COCO file.
    ///
    /// # Errors
    /// [`PerceptionError::File`] when it cannot be written.
    pub fn finish(self) -> Result<(), PerceptionError> {
        let categories: Vec<_> =
            Class::ALL.iter().map(|c| serde_json::json!({"id": c.index() + 1, "name": c.name()})).collect();
        let all = serde_json::json!({"images": self.images, "annotations": self.annotations, "categories": categories});
        put(&self.folder.join("annotations.json"), all.to_string().as_bytes())
    }
}

fn put(path: &Path, bytes: &[u8]) -> Result<(), PerceptionError> {
    std::fs::write(path, bytes).map_err(|e| PerceptionError::file(path, e))
}

/// A set on disc in YOLO's layout.
#[derive(Debug, Clone)]
pub struct Folder {
    images: Vec<PathBuf>,
    labels: PathBuf,
    /// Our class of each of the set's.
    classes: Vec<Class>,
}

impl Folder {
    /// Opens a set and reads every label once.
    ///
    /// # Errors
    /// [`PerceptionError::File`] naming the file and line: no images, a class that is not known, a box outside the image.
    pub fn open(folder: &Path) -> Result<Self, PerceptionError> {
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
        let folder = Folder { classes: classes(&folder.join("data.yaml"))?, labels: folder.join("labels"), images };
        for k in 0..folder.images.len() {
            folder.labels_of(k)?;
        }
        Ok(folder)
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.images.len()
    }

    /// Never: a set without images does not open.
    pub fn is_empty(&self) -> bool {
        self.images.is_empty()
    }

    /// The labels of an image, at the network's size. No file means nothing is there.
    fn labels_of(&self, k: usize) -> Result<Vec<Label>, PerceptionError> {
        let name = self.images[k].file_stem().unwrap_or_default();
        let path = self.labels.join(name).with_extension("txt");
        if !path.exists() {
            return Ok(Vec::new());
        }
        let text = std::fs::read_to_string(&path).map_err(|e| PerceptionError::file(&path, e))?;
        text.lines()
            .enumerate()
            .filter(|(_, line)| !line.trim().is_empty())
            .map(|(number, line)| {
                let wrong = |what: String| PerceptionError::file(&path, format!("line {}: {what}", number + 1));
                let values: Vec<f32> = line.split_whitespace().map_while(|word| word.parse().ok()).collect();
                let [class, x, y, w, h] = values[..] else {
                    return Err(wrong("expected five numbers: class x y width height".to_owned()));
                };
                let known = self.classes.get(class as usize).filter(|_| class >= 0.0 && class.fract() == 0.0);
                let class = *known.ok_or_else(|| {
                    wrong(format!("class {class}; expected 0 to {}", self.classes.len().saturating_sub(1)))
                })?;
                let inside =
                    [x - w / 2.0, y - h / 2.0, 1.0 - x - w / 2.0, 1.0 - y - h / 2.0].iter().all(|v| *v >= -2e-3);
                if !(inside && w > 0.0 && h > 0.0) {
                    return Err(wrong(format!(
                        "box {x} {y} {w} {h} outside the image; expected shares of its size from 0 to 1"
                    )));
                }
                let [width, height] = shape::INPUT.map(|s| s as f32);
                let rect = Rect::around([x * width, y * height], w * width, h * height);
                Ok(Label { class, rect, team: None, ignored: false, place: [f32::NAN; 3] })
            })
            .collect()
    }
}

impl Source for Folder {
    fn frame(&mut self, number: u64) -> Result<(Frame, Vec<Label>), PerceptionError> {
        // A stride that meets every image before one comes again, in a mixed order.
        let n = self.images.len() as u64;
        let k = (number.wrapping_mul(0x9e37_79b1) % n) as usize;
        let [width, height] = shape::INPUT;
        Ok((Frame::load(&self.images[k])?.resized(width, height), self.labels_of(k)?))
    }
}

/// Frames of a set in their order.
impl Folder {
    /// Frame `k`, at the network's size, with its labels.
    ///
    /// # Errors
    /// When the image cannot be read.
    pub fn get(&self, k: usize) -> Result<(Frame, Vec<Label>), PerceptionError> {
        let [width, height] = shape::INPUT;
        Ok((Frame::load(&self.images[k])?.resized(width, height), self.labels_of(k)?))
    }
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
            let class = Class::named(name).ok_or_else(|| {
                let known = Class::ALL.map(Class::name).join(", ");
                PerceptionError::file(path, format!("line {}: class \"{name}\"; expected one of {known}", number + 1))
            })?;
            names.push(class);
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

#[cfg(test)]
mod tests {
    use super::*;

    fn small() -> (Frame, Label) {
        let rect = Rect { left: 100.0, top: 50.0, right: 120.0, low: 70.0 };
        let [w, h] = shape::INPUT;
        (Frame::new(w, h), Label { class: Class::T, rect, team: None, ignored: false, place: [0.0; 3] })
    }

    #[test]
    fn a_written_set_opens_with_the_same_labels() {
        let folder = tempfile::tempdir().unwrap();
        let (frame, label) = small();
        let mut writer = Writer::new(folder.path()).unwrap();
        writer.add(&frame, &[label]).unwrap();
        writer.finish().unwrap();
        let (back, labels) = Folder::open(folder.path()).unwrap().get(0).unwrap();
        assert_eq!((back, labels[0].class), (frame, Class::T));
        assert!(labels[0].rect.iou(&label.rect) > 0.999);
    }

    #[test]
    fn broken_labels_images_and_classes_are_named_by_file_and_line() {
        let folder = tempfile::tempdir().unwrap();
        let said = || Folder::open(folder.path()).unwrap_err().to_string();
        assert!(said().contains("expected YOLO's layout"));
        let (frame, label) = small();
        let mut writer = Writer::new(folder.path()).unwrap();
        writer.add(&frame, &[label]).unwrap();
        let path = folder.path().join("labels/000000.txt");
        for (text, part) in [
            ("0 0.5 0.5 0.1", "five numbers"),
            ("9 0.5 0.5 0.1 0.1", "class 9"),
            ("0 0.99 0.5 0.1 0.1", "outside the image"),
            ("0 NaN 0.5 0.1 0.1", "outside"),
        ] {
            std::fs::write(&path, format!("\n{text}\n")).unwrap();
            let said = said();
            assert!(said.contains("000000.txt: line 2") && said.contains(part), "{said}");
        }
        std::fs::write(folder.path().join("data.yaml"), "names: [ball, unicorn]\n").unwrap();
        assert!(said().contains("line 1: class \"unicorn\""));
        std::fs::remove_file(folder.path().join("data.yaml")).unwrap();
        std::fs::write(&path, "").unwrap();
        std::fs::write(folder.path().join("images/000000.png"), b"no image").unwrap();
        assert!(Folder::open(folder.path()).unwrap().get(0).unwrap_err().to_string().contains("000000.png"));
    }
}
