//! The last seconds' sights, carried to now by odometry: where could they have been seen from, and how much of them
//! does a pose explain?
//!
//! Source: paper 4, IV-C-2 (global clustering over several frames with inertial prediction). Unlike there a candidate
//! counts by the sights that it explains, not by its cluster's members: wrong hypotheses gather too.

use std::collections::VecDeque;

use instep_field::{Pose, wrap};

use crate::cluster::{Cluster, Clustering};
use crate::hypotheses::hypotheses;
use crate::map::Map;
use crate::measurement::{Expected, Polar, cauchy};
use crate::{Noise, Settings, Sight};

/// A pose that the last frames speak for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// Now.
    pub pose: Pose,
    /// Share of the window's sights that it explains, 0 to 1; one that fits poorly counts in part.
    pub share: f64,
}

#[derive(Debug, Clone, Default)]
struct Entry {
    /// `odometry_from_robot` at the frame's time.
    odometry: Pose,
    sights: Vec<Polar>,
    hypotheses: Vec<Pose>,
}

/// The last frames.
#[derive(Debug, Clone)]
pub(crate) struct Window {
    settings: Settings,
    /// Odometry summed up since the start.
    odometry: Pose,
    entries: VecDeque<Entry>,
    clustering: Clustering,
    carried: Vec<Pose>,
    candidates: Vec<Candidate>,
}

impl Window {
    pub(crate) fn new(map: &Map, settings: &Settings) -> Window {
        let frames = settings.global.frames;
        let most = frames * settings.hypotheses.most;
        Window {
            settings: *settings,
            odometry: Pose::default(),
            entries: VecDeque::with_capacity(frames),
            clustering: Clustering::new(map, &settings.global, settings.hypotheses.margin, most),
            carried: Vec::with_capacity(most),
            candidates: Vec::with_capacity(settings.global.clusters),
        }
    }

    /// The robot moved.
    pub(crate) fn step(&mut self, motion: &Pose) {
        self.odometry = self.odometry.then(motion);
    }

    /// A new frame; when the window is full the oldest goes, and its room is used again.
    pub(crate) fn push(&mut self, map: &Map, sights: &[Polar]) {
        let mut entry = if self.entries.len() < self.settings.global.frames {
            Entry {
                odometry: Pose::default(),
                sights: Vec::with_capacity(self.settings.filter.most_sights),
                hypotheses: Vec::with_capacity(self.settings.hypotheses.most),
            }
        } else {
            self.entries.pop_front().unwrap_or_default()
        };
        entry.odometry = self.odometry;
        entry.sights.clear();
        entry.sights.extend_from_slice(sights);
        entry.hypotheses.clear();
        hypotheses(map, sights, &self.settings.hypotheses, &mut entry.hypotheses);
        self.entries.push_back(entry);
    }

    /// Frames that are held.
    pub(crate) fn len(&self) -> usize {
        self.entries.len()
    }

    /// Forgets all frames.
    pub(crate) fn clear(&mut self) {
        // Their room goes too: this happens at a start, not in a tick.
        self.entries.clear();
    }

    /// The hypotheses of the newest frame, for now.
    pub(crate) fn newest(&self) -> &[Pose] {
        self.entries.back().map(|e| e.hypotheses.as_slice()).unwrap_or_default()
    }

    /// Clusters of all frames' hypotheses, carried to now; the one with most members first.
    pub(crate) fn clusters(&mut self) -> &[Cluster] {
        self.carried.clear();
        for entry in &self.entries {
            let since = entry.odometry.relative(&self.odometry);
            self.carried.extend(entry.hypotheses.iter().map(|pose| pose.then(&since)));
        }
        self.clustering.find(&self.carried)
    }

    /// The clusters' centroids with what they explain, best first.
    pub(crate) fn candidates(&mut self, map: &Map) -> &[Candidate] {
        let mut candidates = std::mem::take(&mut self.candidates);
        candidates.clear();
        candidates.extend(self.clusters().iter().map(|c| Candidate { pose: c.pose, share: 0.0 }));
        for candidate in &mut candidates {
            candidate.share = self.share(map, &candidate.pose);
        }
        candidates.sort_unstable_by(|a, b| b.share.total_cmp(&a.share).then(a.pose.x.total_cmp(&b.pose.x)));
        self.candidates = candidates;
        &self.candidates
    }

    /// What [`Window::candidates`] found the last time.
    pub(crate) fn last_candidates(&self) -> &[Candidate] {
        &self.candidates
    }

    /// Share of the window's sights that a robot at `pose` now explains.
    pub(crate) fn share(&self, map: &Map, pose: &Pose) -> f64 {
        let filter = &self.settings.filter;
        let (mut explained, mut all) = (0.0, 0_usize);
        for entry in &self.entries {
            let then = pose.then(&self.odometry.relative(&entry.odometry));
            explained += entry.sights.iter().map(|s| fit(map, s, &then, filter.gate, filter.cauchy)).sum::<f64>();
            all += entry.sights.len();
        }
        if all == 0 { 0.0 } else { explained / all as f64 }
    }
}

/// How well a sight fits its nearest landmark of its class from `pose`: 1 exactly, 0 outside the gate.
fn fit(map: &Map, sight: &Polar, pose: &Pose, gate: f64, corner: f64) -> f64 {
    let at = pose.outer_from_local(sight.point(1.0));
    let Some(landmark) = map.nearest(sight.class, at) else { return 0.0 };
    let expected = Expected::of(pose, landmark);
    let dr = (sight.range - expected.range) / sight.range_sigma;
    let db = wrap(sight.bearing - expected.bearing) / sight.bearing_sigma;
    let distance = dr * dr + db * db;
    if distance < gate { cauchy(distance, corner) } else { 0.0 }
}

/// The sights of a frame in polar form, nearest first, at most `most`.
pub(crate) fn nearest_first(sights: &[Sight], noise: &Noise, most: usize, polars: &mut Vec<Polar>) {
    polars.clear();
    polars.extend(sights.iter().map(|s| Polar::of(s, noise)));
    polars.sort_unstable_by(|a, b| a.range.total_cmp(&b.range).then(a.bearing.total_cmp(&b.bearing)));
    polars.truncate(most);
}
