//! From a frame to boxes: the network's peaks, their rest and size, doubles taken out.

use std::path::Path;

use crate::PerceptionError;
use crate::class::{Class, Team};
use crate::label::Rect;
use crate::net::{file, shape};
use crate::picture::Frame;
use crate::train::loss::{GRID, regression};

/// What was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detection {
    /// What it is.
    pub class: Class,
    /// Where it is, pixels.
    pub rect: Rect,
    /// Confidence, 0 to 1.
    pub confidence: f32,
    /// A robot's team by its hue, where one can be told.
    pub team: Option<Team>,
}

/// Two boxes of one class that overlap more are one.
const SAME: f32 = 0.55;

/// A network with its buffers.
#[derive(Debug, Clone)]
pub struct Detector {
    weights: Vec<f32>,
    tape: shape::Tape,
    planes: Vec<f32>,
    maps: Vec<f32>,
}

impl Detector {
    /// Of a flat vector of parameters of [`shape::parameters`] numbers.
    pub fn new(weights: Vec<f32>) -> Self {
        Detector { weights, tape: shape::Tape::new(), planes: Vec::new(), maps: Vec::new() }
    }

    /// Reads a detector's file.
    ///
    /// # Errors
    /// [`PerceptionError::File`] naming the file and what in it does not fit.
    pub fn load(path: &Path) -> Result<Self, PerceptionError> {
        Ok(Self::new(file::read(path, &[])?.0))
    }

    /// Its parameters, in the order of [`shape::parts`].
    pub fn weights(&self) -> &[f32] {
        &self.weights
    }

    /// All peaks above their class's threshold (such as [`THRESHOLDS`]), the most confident first.
    ///
    /// # Errors
    /// [`PerceptionError::Size`] for a frame of another size than the network's.
    pub fn detect(
        &mut self,
        frame: &Frame,
        thresholds: &[f32; Class::ALL.len()],
    ) -> Result<Vec<Detection>, PerceptionError> {
        let [width, height] = shape::INPUT;
        if (frame.width, frame.height) != (width, height) || frame.rgb.len() != 3 * width * height {
            return Err(PerceptionError::Size { found_width: frame.width, found_height: frame.height, width, height });
        }
        shape::image(&frame.rgb, &mut self.planes);
        shape::forward(&self.weights, &self.planes, &mut self.tape);
        self.maps.clear();
        self.maps.extend_from_slice(self.tape.output());
        // The same in a mirror: two opinions are better than one, and there is time for both.
        self.planes.chunks_exact_mut(width).for_each(<[f32]>::reverse);
        shape::forward(&self.weights, &self.planes, &mut self.tape);
        average(&mut self.maps, self.tape.output());
        let mut found = peaks(&self.maps, thresholds);
        for detection in found.iter_mut().filter(|d| d.class == Class::Robot) {
            detection.team = team(frame, &detection.rect);
        }
        Ok(found)
    }
}

/// The mean of maps and of those of the mirrored frame.
fn average(maps: &mut [f32], mirrored: &[f32]) {
    let [columns, rows] = GRID;
    let rest = Class::ALL.map(regression);
    for (channel, (to, from)) in
        maps.chunks_exact_mut(columns * rows).zip(mirrored.chunks_exact(columns * rows)).enumerate()
    {
        let sign = if rest.contains(&channel) { -1.0 } else { 1.0 };
        for (to, from) in to.chunks_exact_mut(columns).zip(from.chunks_exact(columns)) {
            for (a, b) in to.iter_mut().zip(from.iter().rev()) {
                *a = 0.5 * (*a + sign * b);
            }
        }
    }
}

/// Share of a peak's confidence that a neighbour must have to have a say in its box.
const SAY: f32 = 0.4;

/// The peaks of the heat maps. A box is the mean of what the peak and its neighbours say, by their confidence.
fn peaks(output: &[f32], thresholds: &[f32; Class::ALL.len()]) -> Vec<Detection> {
    let [columns, rows] = GRID;
    let cells = columns * rows;
    let frame = Rect { left: 0.0, top: 0.0, right: shape::INPUT[0] as f32, low: shape::INPUT[1] as f32 };
    let mut found = Vec::new();
    for class in Class::ALL {
        let heat = &output[class.index() * cells..(class.index() + 1) * cells];
        let threshold = thresholds[class.index()];
        let least = (threshold / (1.0 - threshold).max(1e-6)).ln();
        for (cell, &z) in heat.iter().enumerate().filter(|(_, z)| **z > least) {
            let (row, column) = (cell / columns, cell % columns);
            let around = (row.saturating_sub(1)..(row + 2).min(rows))
                .flat_map(|r| (column.saturating_sub(1)..(column + 2).min(columns)).map(move |c| r * columns + c));
            if around.clone().any(|other| heat[other] > z || (heat[other] == z && other < cell)) {
                continue;
            }
            let confidence = sigmoid(z);
            let (mut edges, mut all) = ([0.0f32; 4], 0.0);
            for other in around {
                let say = sigmoid(heat[other]);
                if say < SAY * confidence {
                    continue;
                }
                let value = |k: usize| output[(regression(class) + k) * cells + other];
                let at = |place: usize, rest: f32| (place as f32 + 0.5 + rest) * shape::CELL as f32;
                let middle = [at(other % columns, value(0)), at(other / columns, value(1))];
                let side = |k: usize| shape::UNIT * value(k).clamp(-4.0, 4.0).exp();
                let rect = Rect::around(middle, side(2), side(3));
                for (sum, edge) in edges.iter_mut().zip([rect.left, rect.top, rect.right, rect.low]) {
                    *sum += say * edge;
                }
                all += say;
            }
            let [left, top, right, low] = edges.map(|edge| edge / all);
            let rect = Rect { left, top, right, low };
            let rect = if class == Class::GoalPost { rect.widened() } else { rect }.meet(&frame);
            if rect.area() > 0.0 {
                found.push(Detection { class, rect, confidence, team: None });
            }
        }
    }
    found.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    let mut kept: Vec<Detection> = Vec::with_capacity(found.len());
    for detection in found {
        if kept.iter().all(|k| k.class != detection.class || k.rect.iou(&detection.rect) < SAME) {
            kept.push(detection);
        }
    }
    kept
}

fn sigmoid(z: f32) -> f32 {
    1.0 / (1.0 + (-z).exp())
}

/// The team of a robot by the hues in the middle of its box: the colour with more strong pixels, at least 2 % of them.
pub fn team(frame: &Frame, rect: &Rect) -> Option<Team> {
    let (mut red, mut blue, mut all) = (0u32, 0u32, 0u32);
    let inset = 0.15 * rect.width();
    for y in (rect.top.max(0.0) as usize)..(rect.low.max(0.0) as usize).min(frame.height) {
        for x in ((rect.left + inset).max(0.0) as usize)..((rect.right - inset).max(0.0) as usize).min(frame.width) {
            let [r, g, b] = frame.pixel(x, y).map(i32::from);
            all += 1;
            red += u32::from(r > g + 40 && r > b + 30);
            blue += u32::from(b > r + 30 && b > g + 15);
        }
    }
    let enough = all / 50 + 1;
    match (red >= enough, blue >= enough) {
        (true, _) if red > blue => Some(Team::Red),
        (_, true) => Some(Team::Blue),
        _ => None,
    }
}

/// Confidence above which the shipped detector's finds of each class are used: where nine of ten are right; a ball's where
/// few frames in a thousand have a false one.
pub const THRESHOLDS: [f32; Class::ALL.len()] = [0.6, 0.5, 0.35, 0.5, 0.55, 0.45];

impl Detection {
    /// Whether it is confident enough to be used.
    pub fn is_used(&self) -> bool {
        self.confidence >= THRESHOLDS[self.class.index()]
    }
}

impl Detector {
    /// The detector that comes with Instep (`detector.md` is its card).
    ///
    /// # Errors
    /// Never for a program as it was built; the file is checked as any other.
    pub fn shipped() -> Result<Self, PerceptionError> {
        let bytes = include_bytes!("../detector.safetensors");
        Ok(Self::new(file::parse(bytes, Path::new("detector.safetensors"), &[])?.0))
    }
}
