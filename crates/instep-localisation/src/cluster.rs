//! Clusters of pose hypotheses: seeds where they lie densest, then K-means that drops its outliers.
//!
//! Source: paper 4, IV-C-2 (iterated K-means, a share of outliers removed after each iteration); what it leaves open is
//! in [`GlobalSettings`]. Distances join metres and radians; angles are averaged as offsets from the centroid, so that
//! nothing breaks at half a turn. Seeds come from a grid, so that the whole costs a time linear in the hypotheses.

use std::f64::consts::PI;

use instep_field::{Pose, wrap};

use crate::GlobalSettings;
use crate::map::Map;

/// Edge of a grid cell, m; in heading the same by `metres_per_radian`.
const CELL: f64 = 0.5;
/// Farther than this from every seed a hypothesis belongs to no cluster, m.
const REACH: f64 = 1.5;
/// Clusters at most.
pub(crate) const MOST_CLUSTERS: usize = 16;
/// Seeds are at least this far from each other, m.
const APART: f64 = 0.75;

/// A dense place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cluster {
    /// Its centroid.
    pub pose: Pose,
    /// Hypotheses that are left in it.
    pub members: usize,
}

/// Finds clusters; keeps its room between calls.
#[derive(Debug, Clone)]
pub(crate) struct Clustering {
    settings: GlobalSettings,
    low: [f64; 2],
    cells: [usize; 3],
    /// Hypotheses in each cell.
    counts: Vec<u16>,
    occupied: Vec<(u32, u32)>,
    /// Hypotheses that are still in a cluster, and which.
    kept: Vec<(Pose, usize)>,
    distances: Vec<f64>,
    clusters: Vec<Cluster>,
}

impl Clustering {
    /// Room for `most` hypotheses on `map`.
    pub(crate) fn new(map: &Map, settings: &GlobalSettings, margin: f64, most: usize) -> Clustering {
        let low = map.half().map(|h| -h - margin);
        let across = low.map(|l| (2.0 * -l / CELL).ceil() as usize + 1);
        let turns = (2.0 * PI * settings.metres_per_radian / CELL).ceil().max(3.0) as usize;
        Clustering {
            settings: *settings,
            low,
            cells: [across[0], across[1], turns],
            counts: vec![0; across[0] * across[1] * turns],
            occupied: Vec::with_capacity(most),
            kept: Vec::with_capacity(most),
            distances: Vec::with_capacity(most),
            clusters: Vec::with_capacity(settings.clusters),
        }
    }

    /// The clusters of `poses`, the one with most members first.
    pub(crate) fn find(&mut self, poses: &[Pose]) -> &[Cluster] {
        self.seed(poses);
        let Clustering { settings, kept, distances, clusters, .. } = self;
        let squared = |a: &Pose, b: &Pose| {
            let turn = settings.metres_per_radian * short_wrap(a.heading - b.heading);
            (a.x - b.x).powi(2) + (a.y - b.y).powi(2) + turn * turn
        };
        let nearest = |pose: &Pose, clusters: &[Cluster]| {
            let (mut owner, mut best) = (0, f64::INFINITY);
            for (k, cluster) in clusters.iter().enumerate() {
                let d = squared(pose, &cluster.pose);
                if d < best {
                    (owner, best) = (k, d);
                }
            }
            (owner, best)
        };
        kept.clear();
        let reached = poses.iter().filter_map(|pose| {
            let (owner, square) = nearest(pose, clusters);
            (square < REACH * REACH).then_some((*pose, owner))
        });
        kept.extend(reached);
        for round in 0..settings.rounds {
            for _ in 0..settings.steps {
                move_centroids(clusters, kept);
                for (pose, owner) in kept.iter_mut() {
                    *owner = nearest(pose, clusters).0;
                }
            }
            if round + 1 == settings.rounds {
                break;
            }
            for (k, cluster) in clusters.iter().enumerate() {
                let center = cluster.pose;
                distances.clear();
                distances.extend(kept.iter().filter(|(_, o)| *o == k).map(|(p, _)| squared(p, &center)));
                if distances.is_empty() {
                    continue;
                }
                let last = ((1.0 - settings.drop) * distances.len() as f64).ceil() as usize;
                let place = last.clamp(1, distances.len()) - 1;
                let (_, &mut limit, _) = distances.select_nth_unstable_by(place, f64::total_cmp);
                let limit = limit.max(settings.keep * settings.keep);
                kept.retain(|(pose, owner)| *owner != k || squared(pose, &center) <= limit);
            }
        }
        move_centroids(clusters, kept);
        clusters.retain(|c| c.members > 0);
        clusters.sort_unstable_by(|a, b| b.members.cmp(&a.members).then(a.pose.x.total_cmp(&b.pose.x)));
        clusters
    }

    /// Begins the clusters at the cells with most hypotheses in and around them.
    fn seed(&mut self, poses: &[Pose]) {
        self.counts.fill(0);
        self.occupied.clear();
        for pose in poses {
            let cell = self.cell(pose);
            let index = self.index(cell);
            if let Some(count) = self.counts.get_mut(index) {
                if *count == 0 {
                    self.occupied.push((0, index as u32));
                }
                *count = count.saturating_add(1);
            }
        }
        let mut occupied = std::mem::take(&mut self.occupied);
        for (density, index) in &mut occupied {
            *density = self.density(*index as usize);
        }
        // Densest first, the cell's index breaking ties: the order of hypotheses does not matter.
        occupied.sort_unstable_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
        self.clusters.clear();
        for &(_, index) in &occupied {
            let pose = self.center(index as usize);
            let far = |c: &Cluster| {
                let turn = self.settings.metres_per_radian * wrap(c.pose.heading - pose.heading);
                c.pose.distance(&pose).hypot(turn) > APART
            };
            if self.clusters.iter().all(far) {
                self.clusters.push(Cluster { pose, members: 0 });
                if self.clusters.len() == self.settings.clusters.min(MOST_CLUSTERS) {
                    break;
                }
            }
        }
        self.occupied = occupied;
    }

    fn cell(&self, pose: &Pose) -> [usize; 3] {
        // The casts saturate; a pose outside the grid lands in its edge.
        let along = |v: f64, low: f64, n: usize| (((v - low) / CELL) as usize).min(n - 1);
        let turn = ((wrap(pose.heading) + PI) / (2.0 * PI) * self.cells[2] as f64) as usize % self.cells[2];
        [along(pose.x, self.low[0], self.cells[0]), along(pose.y, self.low[1], self.cells[1]), turn]
    }

    fn index(&self, [x, y, turn]: [usize; 3]) -> usize {
        (x * self.cells[1] + y) * self.cells[2] + turn
    }

    fn center(&self, index: usize) -> Pose {
        let turn = index % self.cells[2];
        let [x, y] = [index / self.cells[2] / self.cells[1], index / self.cells[2] % self.cells[1]];
        let heading = (turn as f64 + 0.5) / self.cells[2] as f64 * 2.0 * PI - PI;
        Pose::new(self.low[0] + (x as f64 + 0.5) * CELL, self.low[1] + (y as f64 + 0.5) * CELL, heading)
    }

    /// Hypotheses in a cell and its 26 neighbours.
    fn density(&self, index: usize) -> u32 {
        let turns = self.cells[2];
        let turn = index % turns;
        let [x, y] = [index / turns / self.cells[1], index / turns % self.cells[1]];
        let mut sum = 0;
        for i in x.saturating_sub(1)..=(x + 1).min(self.cells[0] - 1) {
            for j in y.saturating_sub(1)..=(y + 1).min(self.cells[1] - 1) {
                for k in [(turn + turns - 1) % turns, turn, (turn + 1) % turns] {
                    sum += u32::from(self.counts[self.index([i, j, k])]);
                }
            }
        }
        sum
    }
}

/// Each centroid becomes its members' mean; one without members stays. Headings are averaged as offsets from it.
fn move_centroids(clusters: &mut [Cluster], kept: &[(Pose, usize)]) {
    let mut sums = [([0.0; 3], 0_usize); MOST_CLUSTERS];
    for (pose, owner) in kept {
        let (Some(cluster), Some((sum, members))) = (clusters.get(*owner), sums.get_mut(*owner)) else { continue };
        sum[0] += pose.x;
        sum[1] += pose.y;
        sum[2] += short_wrap(pose.heading - cluster.pose.heading);
        *members += 1;
    }
    for (cluster, (sum, members)) in clusters.iter_mut().zip(sums) {
        cluster.members = members;
        if members > 0 {
            let n = members as f64;
            cluster.pose = Pose::new(sum[0] / n, sum[1] / n, cluster.pose.heading + sum[2] / n);
        }
    }
}

/// [`wrap`] for a difference of two wrapped angles, without a division.
fn short_wrap(difference: f64) -> f64 {
    if difference > PI {
        difference - 2.0 * PI
    } else if difference < -PI {
        difference + 2.0 * PI
    } else {
        difference
    }
}

#[cfg(test)]
mod tests {
    use instep_field::Field;

    use super::*;

    /// Three heaps, one across the cut of the angles, in much scattered noise.
    #[test]
    fn heaps_are_found_in_scatter() {
        let map = Map::new(&Field::named("adult-2024").unwrap(), true).unwrap();
        let settings = GlobalSettings::default();
        let mut clustering = Clustering::new(&map, &settings, 1.0, 2000);
        let heaps = [Pose::new(3.1, 1.2, 3.1), Pose::new(-2.0, -3.0, 0.4), Pose::new(5.5, -1.0, -1.5)];
        let mut poses = Vec::new();
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
        };
        for (k, heap) in heaps.iter().enumerate() {
            for _ in 0..200 - 40 * k {
                poses.push(Pose::new(heap.x + 0.4 * random(), heap.y + 0.4 * random(), heap.heading + 0.1 * random()));
            }
        }
        for _ in 0..800 {
            poses.push(Pose::new(14.0 * random(), 9.0 * random(), 6.2 * random()));
        }
        let found = clustering.find(&poses).to_vec();
        for (cluster, heap) in found.iter().zip(&heaps) {
            assert!(cluster.pose.distance(heap) < 0.05, "{cluster:?} {heap:?}");
            assert!(wrap(cluster.pose.heading - heap.heading).abs() < 0.02);
        }
        poses.reverse();
        let reversed = clustering.find(&poses).to_vec();
        for (a, b) in found.iter().zip(&reversed).take(3) {
            assert!(a.pose.distance(&b.pose) < 1e-9);
        }
        assert!(clustering.find(&[]).is_empty());
    }
}
