//! Labelled sets on disc: images with YOLO label files beside them, and one COCO file over all.
//!
//! `images/000000.png`, `labels/000000.txt` (class, middle and size as shares of the image; class numbers as in
//! `data.yaml`), `annotations.json`. Reading takes either half ([`coco`], [`yolo`]), so a team's own folder can be trained
//! on.

mod coco;
mod yolo;

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

/// A set on disc, all its labels read and checked.
#[derive(Debug, Clone)]
pub struct Set {
    images: Vec<(PathBuf, Vec<Label>)>,
}

impl Set {
    /// Opens a set: a folder in YOLO's layout (`images/`, `labels/`, `data.yaml`), a COCO file, or a folder with a COCO file
    /// `annotations.json` and no `labels/`.
    ///
    /// # Errors
    /// [`PerceptionError::File`] naming file and place: no images, a class that is not known, a box outside the image.
    pub fn open(path: &Path) -> Result<Self, PerceptionError> {
        let listed = path.join("annotations.json");
        let images = if path.is_file() {
            coco::read(path)?
        } else if listed.is_file() && !path.join("labels").is_dir() {
            coco::read(&listed)?
        } else {
            yolo::read(path)?
        };
        if images.is_empty() {
            return Err(PerceptionError::file(path, "a set without images"));
        }
        Ok(Set { images })
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.images.len()
    }

    /// Never: a set without images does not open.
    pub fn is_empty(&self) -> bool {
        self.images.is_empty()
    }

    /// Frame `k`, at the network's size, with its labels.
    ///
    /// # Errors
    /// When the image cannot be read.
    pub fn get(&self, k: usize) -> Result<(Frame, Vec<Label>), PerceptionError> {
        let [width, height] = shape::INPUT;
        let (path, labels) = &self.images[k % self.images.len().max(1)];
        Ok((Frame::load(path)?.resized(width, height), labels.clone()))
    }
}

impl Source for Set {
    fn frame(&mut self, number: u64) -> Result<(Frame, Vec<Label>), PerceptionError> {
        // A stride that meets every image before one comes again, in a mixed order.
        let n = self.images.len() as u64;
        self.get((number.wrapping_mul(0x9e37_79b1) % n) as usize)
    }
}

/// A box given as shares of the image, at the network's size; `None` when it is empty or outside the image.
fn rect([x, y, w, h]: [f32; 4]) -> Option<Rect> {
    let inside = [x - w / 2.0, y - h / 2.0, 1.0 - x - w / 2.0, 1.0 - y - h / 2.0].iter().all(|v| *v >= -2e-3);
    let [width, height] = shape::INPUT.map(|s| s as f32);
    (inside && w > 0.0 && h > 0.0).then(|| Rect::around([x * width, y * height], w * width, h * height))
}

/// The class of a name in a set's file.
fn class(name: &str) -> Result<Class, String> {
    Class::named(name)
        .ok_or_else(|| format!("class \"{name}\"; expected one of {}", Class::ALL.map(Class::name).join(", ")))
}

fn label(class: Class, rect: Rect, ignored: bool) -> Label {
    Label { class, rect, team: None, ignored, place: [f32::NAN; 3] }
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
        let (back, labels) = Set::open(folder.path()).unwrap().get(0).unwrap();
        assert_eq!((back, labels[0].class), (frame, Class::T));
        assert!(labels[0].rect.iou(&label.rect) > 0.999);
    }

    #[test]
    fn the_coco_half_alone_is_a_set_too_and_what_is_wrong_in_it_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let (frame, label) = small();
        let mut writer = Writer::new(folder.path()).unwrap();
        writer.add(&frame, &[label, Label { ignored: true, class: Class::X, ..label }]).unwrap();
        writer.finish().unwrap();
        std::fs::remove_dir_all(folder.path().join("labels")).unwrap();
        let (_, labels) = Set::open(folder.path()).unwrap().get(0).unwrap();
        assert_eq!(
            labels.iter().map(|l| (l.class, l.ignored)).collect::<Vec<_>>(),
            [(Class::T, false), (Class::X, true)]
        );
        assert!(labels[0].rect.iou(&label.rect) > 0.999);
        let path = folder.path().join("annotations.json");
        let good = std::fs::read_to_string(&path).unwrap();
        for (from, to, part) in [
            ("\"bbox\":[100.0", "\"bbox\":[900.0", "annotations[0].bbox"),
            ("\"category_id\":5", "\"category_id\":50", "annotations[0].category_id: 50"),
            ("\"image_id\":0", "\"image_id\":7", "annotations[0].image_id: 7"),
            ("\"name\":\"T\"", "\"name\":\"unicorn\"", "categories[4]: class \"unicorn\""),
            ("\"width\":384", "\"width\":0", "images[0]"),
            ("{", "", "expected a COCO file"),
        ] {
            std::fs::write(&path, good.replacen(from, to, 1)).unwrap();
            let said = Set::open(folder.path()).unwrap_err().to_string();
            assert!(said.contains("annotations.json") && said.contains(part), "{said}");
        }
    }

    #[test]
    fn broken_labels_images_and_classes_are_named_by_file_and_line() {
        let folder = tempfile::tempdir().unwrap();
        let said = || Set::open(folder.path()).unwrap_err().to_string();
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
        assert!(Set::open(folder.path()).unwrap().get(0).unwrap_err().to_string().contains("000000.png"));
    }
}
