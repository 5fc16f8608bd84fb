//! The field as a localiser needs it: landmarks by class, ordered pairs of landmarks by their distance, lines.

use instep_field::{Field, LandmarkClass, Line};

use crate::LocalisationError;

/// Two landmarks in an order.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair {
    /// Between them, m.
    pub(crate) distance: f64,
    /// Direction from the first to the second in the field frame, rad.
    pub(crate) angle: f64,
    /// The first, m.
    pub(crate) first: [f64; 2],
    /// The second, m.
    pub(crate) second: [f64; 2],
}

const CLASSES: usize = LandmarkClass::ALL.len();

/// A field, prepared. Made once, shared by reference.
#[derive(Debug, Clone)]
pub struct Map {
    /// Class and place of each landmark, by class.
    landmarks: Vec<(LandmarkClass, [f64; 2])>,
    /// Where each class begins in `landmarks`, and the end.
    begins: [usize; CLASSES + 1],
    /// Ordered pairs by the classes of the first and the second, by rising distance.
    pairs: Vec<Vec<Pair>>,
    lines: Vec<Line>,
    half: [f64; 2],
    crosses: bool,
}

impl Map {
    /// `marks_are_crosses`: the detector knows no penalty marks of their own and calls them X, as that of paper 4.
    ///
    /// # Errors
    /// [`LocalisationError::NoLandmarks`] when fewer than two are on the field.
    pub fn new(field: &Field, marks_are_crosses: bool) -> Result<Map, LocalisationError> {
        let mut landmarks: Vec<_> = field
            .landmarks()
            .iter()
            .map(|l| (if marks_are_crosses { merged(l.class) } else { l.class }, l.position()))
            .collect();
        if landmarks.len() < 2 {
            return Err(LocalisationError::NoLandmarks { field: field.name.clone() });
        }
        landmarks.sort_by_key(|&(class, _)| class as usize);
        let mut begins = [0; CLASSES + 1];
        for class in 0..CLASSES {
            begins[class + 1] = landmarks.iter().filter(|(c, _)| *c as usize <= class).count();
        }
        let mut pairs = vec![Vec::new(); CLASSES * CLASSES];
        for (i, &(a, first)) in landmarks.iter().enumerate() {
            for (j, &(b, second)) in landmarks.iter().enumerate() {
                let [dx, dy] = [second[0] - first[0], second[1] - first[1]];
                if i != j {
                    let pair = Pair { distance: dx.hypot(dy), angle: dy.atan2(dx), first, second };
                    pairs[a as usize * CLASSES + b as usize].push(pair);
                }
            }
        }
        for list in &mut pairs {
            list.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        }
        let half = [field.length / 2.0, field.width / 2.0];
        Ok(Map { landmarks, begins, pairs, lines: field.lines(), half, crosses: marks_are_crosses })
    }

    /// Class as this map's detector would call it.
    pub(crate) fn class(&self, class: LandmarkClass) -> LandmarkClass {
        if self.crosses { merged(class) } else { class }
    }

    /// All landmarks; indices into it name a landmark.
    pub(crate) fn landmarks(&self) -> &[(LandmarkClass, [f64; 2])] {
        &self.landmarks
    }

    /// The indices of a class.
    pub(crate) fn of_class(&self, class: LandmarkClass) -> std::ops::Range<usize> {
        let class = self.class(class) as usize;
        self.begins[class]..self.begins[class + 1]
    }

    /// The landmark of a class that is nearest to a point of the field.
    pub(crate) fn nearest(&self, class: LandmarkClass, point: [f64; 2]) -> Option<[f64; 2]> {
        let square = |p: [f64; 2]| (p[0] - point[0]).powi(2) + (p[1] - point[1]).powi(2);
        let of_class = self.landmarks.get(self.of_class(class)).unwrap_or_default();
        of_class.iter().map(|l| l.1).min_by(|a, b| square(*a).total_cmp(&square(*b)))
    }

    /// Ordered pairs of these classes whose distance is within `tolerance` of `distance`.
    pub(crate) fn pairs(&self, a: LandmarkClass, b: LandmarkClass, distance: f64, tolerance: f64) -> &[Pair] {
        let list = &self.pairs[self.class(a) as usize * CLASSES + self.class(b) as usize];
        let begin = list.partition_point(|p| p.distance < distance - tolerance);
        let end = list.partition_point(|p| p.distance <= distance + tolerance);
        list.get(begin..end).unwrap_or_default()
    }

    pub(crate) fn lines(&self) -> &[Line] {
        &self.lines
    }

    /// Half the length and half the width, m.
    pub(crate) fn half(&self) -> [f64; 2] {
        self.half
    }

    /// Whether a robot can be there: inside the lines widened by `margin`, m.
    pub(crate) fn contains(&self, point: [f64; 2], margin: f64) -> bool {
        point[0].abs() <= self.half[0] + margin && point[1].abs() <= self.half[1] + margin
    }
}

fn merged(class: LandmarkClass) -> LandmarkClass {
    if class == LandmarkClass::PenaltyMark { LandmarkClass::X } else { class }
}
