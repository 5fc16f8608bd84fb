//! What is in a rendered frame: boxes from the truth behind its pixels.
//!
//! Ball, posts and robots get the box of their visible pixels; a post's is widened to [`LEAST_WIDTH`], as people draw it: one of
//! two pixels is a matter of luck. An intersection gets a box around its point whose width is
//! what 0.6 m across the line of sight takes at its distance, and whose height is 0.6 of that, at least 8 pixels: marks on
//! the ground have no extent of their own, and people who label them draw such boxes. What is too small, too far, worn
//! or too much hidden to be asked for is listed as ignored: finding it is neither right nor wrong.

use instep_field::Field;
use nalgebra::Vector3;

use crate::camera::Camera;
use crate::class::{Class, Team};
use crate::render::View;
use crate::scene::{Scene, Thing};

/// A box in pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rect {
    /// Left edge.
    pub left: f32,
    /// Upper edge.
    pub top: f32,
    /// Right edge.
    pub right: f32,
    /// Lower edge.
    pub low: f32,
}

impl Rect {
    /// Around a middle.
    pub fn around([x, y]: [f32; 2], width: f32, height: f32) -> Self {
        Rect { left: x - width / 2.0, top: y - height / 2.0, right: x + width / 2.0, low: y + height / 2.0 }
    }

    /// Its middle.
    pub fn middle(&self) -> [f32; 2] {
        [(self.left + self.right) / 2.0, (self.top + self.low) / 2.0]
    }

    /// Its width.
    pub fn width(&self) -> f32 {
        self.right - self.left
    }

    /// Its height.
    pub fn height(&self) -> f32 {
        self.low - self.top
    }

    /// Its area; 0 for one that is turned inside out.
    pub fn area(&self) -> f32 {
        self.width().max(0.0) * self.height().max(0.0)
    }

    /// What lies in both.
    #[must_use]
    pub fn meet(&self, other: &Rect) -> Rect {
        Rect {
            left: self.left.max(other.left),
            top: self.top.max(other.top),
            right: self.right.min(other.right),
            low: self.low.min(other.low),
        }
    }

    /// Widened about its middle to [`LEAST_WIDTH`], where it is narrower.
    #[must_use]
    pub fn widened(self) -> Rect {
        let more = (LEAST_WIDTH - self.width()).max(0.0) / 2.0;
        Rect { left: self.left - more, right: self.right + more, ..self }
    }

    /// Intersection over union.
    pub fn iou(&self, other: &Rect) -> f32 {
        let meet = self.meet(other).area();
        let all = self.area() + other.area() - meet;
        if all > 0.0 { meet / all } else { 0.0 }
    }
}

/// A label of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Label {
    /// What it is.
    pub class: Class,
    /// Where it is.
    pub rect: Rect,
    /// A robot's team, where known.
    pub team: Option<Team>,
    /// Whether it need not be found.
    pub ignored: bool,
    /// Where it truly is in the camera frame (a ball's middle, a foot, a point of lines), m; NaN where unknown.
    pub place: [f32; 3],
}

/// Farther than this an intersection is not asked for, m on the ground.
pub const LANDMARK_RANGE: f32 = 6.5;
/// Width of an intersection's box across the line of sight, m.
pub const LANDMARK_WIDTH: f32 = 0.6;

/// Least width of a post's box, pixels: one and a half cells of the network's maps.
pub const LEAST_WIDTH: f32 = 6.0;

/// The box of an intersection whose point falls on a pixel, `depth` m ahead.
pub fn intersection_rect(camera: &Camera, pixel: [f32; 2], depth: f32) -> Rect {
    let width = (camera.focal() * LANDMARK_WIDTH / depth.max(0.1)).max(12.0);
    Rect::around(pixel, width, (0.6 * width).max(8.0))
}

/// The labels of a rendered scene.
pub fn labels(camera: &Camera, field: &Field, scene: &Scene, view: &View) -> Vec<Label> {
    let mut labels = boxes(camera, scene, view);
    let frame = Rect { left: 0.0, top: 0.0, right: camera.width as f32, low: camera.height as f32 };
    for landmark in field.landmarks() {
        let class = match landmark.class {
            instep_field::LandmarkClass::L => Class::L,
            instep_field::LandmarkClass::T => Class::T,
            instep_field::LandmarkClass::X => Class::X,
            _ => continue,
        };
        let place = Vector3::new(landmark.x as f32, landmark.y as f32, 0.0);
        let local = scene.camera.camera_from_world(place);
        let Some(pixel) = camera.project(local) else { continue };
        let [u, v] = pixel;
        if !(u >= 2.0 && v >= 2.0 && u < frame.right - 2.0 && v < frame.low - 2.0) {
            continue;
        }
        let at = v as usize * camera.width + u as usize;
        let bare = view.things[at] == View::GROUND;
        let distance = (place - scene.camera.position).xy().norm();
        // The mark across the halfway line is 20 cm only.
        let range = if landmark.x == 0.0 && landmark.y == 0.0 { 0.6 * LANDMARK_RANGE } else { LANDMARK_RANGE };
        if !bare && distance < LANDMARK_RANGE {
            continue;
        }
        let rect = intersection_rect(camera, pixel, local.z).meet(&frame);
        labels.push(Label { class, rect, team: None, ignored: distance > range, place: local.into() });
    }
    labels
}

/// Boxes of visible pixels.
fn boxes(camera: &Camera, scene: &Scene, view: &View) -> Vec<Label> {
    #[derive(Clone, Copy)]
    struct Extent {
        left: usize,
        top: usize,
        right: usize,
        low: usize,
        pixels: usize,
    }
    let none = Extent { left: usize::MAX, top: usize::MAX, right: 0, low: 0, pixels: 0 };
    let frame = Rect { left: 0.0, top: 0.0, right: camera.width as f32, low: camera.height as f32 };
    let mut extents = vec![none; scene.things.len()];
    for (row, marks) in view.things.chunks_exact(camera.width).enumerate() {
        for (column, &mark) in marks.iter().enumerate() {
            if mark == 0 || mark == View::GROUND {
                continue;
            }
            let Some(extent) = extents.get_mut(usize::from(mark) - 1) else { continue };
            extent.left = extent.left.min(column);
            extent.right = extent.right.max(column + 1);
            extent.top = extent.top.min(row);
            extent.low = extent.low.max(row + 1);
            extent.pixels += 1;
        }
    }
    scene
        .things
        .iter()
        .zip(&extents)
        .filter(|(_, extent)| extent.pixels > 0)
        .map(|(thing, extent)| {
            let rect = Rect {
                left: extent.left as f32,
                top: extent.top as f32,
                right: extent.right as f32,
                low: extent.low as f32,
            };
            let place = scene.camera.camera_from_world(thing.position);
            let ignored = !asked_for(camera, thing, place, &rect, extent.pixels);
            let rect = if thing.class == Class::GoalPost { rect.widened().meet(&frame) } else { rect };
            Label { class: thing.class, rect, team: thing.team, ignored, place: place.into() }
        })
        .collect()
}

/// Whether enough of a thing is seen that it has to be found.
fn asked_for(camera: &Camera, thing: &Thing, place: Vector3<f32>, rect: &Rect, pixels: usize) -> bool {
    let f = camera.focal();
    let pixels = pixels as f32;
    match thing.class {
        Class::Ball => {
            let radius = f * thing.size / place.z.max(0.05);
            pixels >= 0.4 * std::f32::consts::PI * radius * radius && pixels >= 10.0
        }
        Class::GoalPost => rect.height() >= 14.0 && pixels >= 0.4 * rect.area() * 0.6,
        _ => {
            let whole = f * 2.0 * thing.size / place.z.max(0.3);
            pixels >= 90.0 && pixels >= 0.04 * whole * whole.min(camera.height as f32)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_narrow_box_is_widened_about_its_middle_and_a_wide_one_stays() {
        let narrow = Rect { left: 10.0, top: 3.0, right: 12.0, low: 40.0 }.widened();
        assert_eq!(narrow, Rect { left: 8.0, top: 3.0, right: 14.0, low: 40.0 });
        let wide = Rect { left: 10.0, top: 3.0, right: 17.0, low: 40.0 };
        assert_eq!(wide.widened(), wide);
    }
}
