//! CLAP's landmark matching: where the robot would be if two sights were these two landmarks.
//!
//! Source: paper 4, eq (5); Fernandez et al., arXiv 2509.08495. Every pair of sights is laid on every ordered pair of
//! landmarks of the same classes whose distance agrees: both orders where the labels are equal (the paper's "same
//! ordering" says nothing there). The angle's difference is wrapped, and the pair is anchored at the point between its
//! ends that divides the base line by the ends' variances, not at the first end.

use instep_field::{Pose, wrap};

use crate::HypothesisSettings;
use crate::map::Map;
use crate::measurement::Polar;

/// Adds the hypotheses of one frame to `poses`; no more than the settings' `most`. `sights` nearest first.
pub(crate) fn hypotheses(map: &Map, sights: &[Polar], settings: &HypothesisSettings, poses: &mut Vec<Pose>) {
    let limit = poses.len() + settings.most;
    let sights = &sights[..sights.len().min(settings.most_sights)];
    for (i, a) in sights.iter().enumerate() {
        for b in &sights[i + 1..] {
            let (pa, pb) = (a.point(1.0), b.point(1.0));
            let [dx, dy] = [pb[0] - pa[0], pb[1] - pa[1]];
            let (distance, angle) = (dx.hypot(dy), dy.atan2(dx));
            if distance < settings.least_base {
                continue;
            }
            let variance = variance_along(a, angle) + variance_along(b, angle);
            let tolerance = settings.sigmas * variance.sqrt() + settings.tolerance;
            // Nearer to the better end: its share is the other's variance.
            let (va, vb) = (spread(a), spread(b));
            let share = va / (va + vb);
            for pair in map.pairs(a.class, b.class, distance, tolerance) {
                let heading = wrap(pair.angle - angle);
                let (s, c) = heading.sin_cos();
                let seen = [pa[0] + share * dx, pa[1] + share * dy];
                let known = [
                    pair.first[0] + share * (pair.second[0] - pair.first[0]),
                    pair.first[1] + share * (pair.second[1] - pair.first[1]),
                ];
                let pose =
                    Pose { x: known[0] - c * seen[0] + s * seen[1], y: known[1] - s * seen[0] - c * seen[1], heading };
                if map.contains(pose.position(), settings.margin) {
                    if poses.len() == limit {
                        return;
                    }
                    poses.push(pose);
                }
            }
        }
    }
}

/// Variance of a sight's position along a direction of the robot's frame, m^2.
fn variance_along(sight: &Polar, direction: f64) -> f64 {
    let (s, c) = (direction - sight.bearing).sin_cos();
    (sight.range_sigma * c).powi(2) + (sight.range * sight.bearing_sigma * s).powi(2)
}

/// Variance of a sight's position in all, m^2.
fn spread(sight: &Polar) -> f64 {
    sight.range_sigma.powi(2) + (sight.range * sight.bearing_sigma).powi(2)
}

#[cfg(test)]
mod tests {
    use instep_field::{Field, LandmarkClass};

    use super::*;
    use crate::{Noise, Sight};

    /// The four landmarks nearest to the robot as it would see them without error.
    fn seen(map: &Map, pose: &Pose, count: usize) -> Vec<Polar> {
        let mut sights: Vec<Polar> = map
            .landmarks()
            .iter()
            .map(|&(class, at)| {
                let position = pose.local_from_outer(at);
                Polar::of(&Sight { class, position, confidence: 1.0, covariance: None }, &Noise::default())
            })
            .collect();
        sights.sort_by(|a, b| a.range.total_cmp(&b.range));
        sights.truncate(count);
        sights
    }

    fn all(map: &Map, sights: &[Polar]) -> Vec<Pose> {
        let mut poses = Vec::new();
        hypotheses(map, sights, &HypothesisSettings { most: 100_000, ..HypothesisSettings::default() }, &mut poses);
        poses
    }

    fn has(poses: &[Pose], pose: &Pose, tolerance: f64) -> bool {
        poses.iter().any(|p| p.distance(pose) < tolerance && wrap(p.heading - pose.heading).abs() < tolerance)
    }

    #[test]
    fn without_noise_the_pose_and_its_twin_are_among_them_and_the_set_is_closed_under_half_a_turn() {
        for name in ["adult-2024", "kid", "hsl-l", "simulation"] {
            let map = Map::new(&Field::named(name).unwrap(), false).unwrap();
            for pose in [Pose::new(1.0, 0.7, 0.3), Pose::new(-2.5, -1.9, 2.8), Pose::new(0.3, 2.2, -1.2)] {
                let poses = all(&map, &seen(&map, &pose, 5));
                assert!(has(&poses, &pose, 1e-9) && has(&poses, &pose.mirrored(), 1e-9), "{name} {pose:?}");
                for p in &poses {
                    assert!(has(&poses, &p.mirrored(), 1e-9));
                }
            }
        }
    }

    /// An enumerator that knows nothing of sorted tables: every ordered pair of landmarks for every pair of sights.
    #[test]
    fn as_many_as_a_plain_enumeration_finds() {
        let map = Map::new(&Field::named("adult-2024").unwrap(), true).unwrap();
        let settings = HypothesisSettings::default();
        let sights = seen(&map, &Pose::new(3.0, -1.0, 0.9), 6);
        let mut count = 0;
        for i in 0..sights.len() {
            for j in i + 1..sights.len() {
                let (a, b) = (&sights[i], &sights[j]);
                let (pa, pb) = (a.point(1.0), b.point(1.0));
                let d = (pb[0] - pa[0]).hypot(pb[1] - pa[1]);
                let direction = (pb[1] - pa[1]).atan2(pb[0] - pa[0]);
                let sigma = (variance_along(a, direction) + variance_along(b, direction)).sqrt();
                for &(ca, wa) in map.landmarks() {
                    for &(cb, wb) in map.landmarks() {
                        let e = (wb[0] - wa[0]).hypot(wb[1] - wa[1]);
                        if ca != a.class || cb != b.class || e == 0.0 || d < settings.least_base {
                            continue;
                        }
                        if (e - d).abs() > settings.sigmas * sigma + settings.tolerance {
                            continue;
                        }
                        let heading = (wb[1] - wa[1]).atan2(wb[0] - wa[0]) - direction;
                        let share = spread(a) / (spread(a) + spread(b));
                        let at =
                            |p: [f64; 2], q: [f64; 2]| [p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1])];
                        let turned = Pose::new(0.0, 0.0, heading).outer_from_local(at(pa, pb));
                        let [x, y] = [at(wa, wb)[0] - turned[0], at(wa, wb)[1] - turned[1]];
                        if map.contains([x, y], settings.margin) {
                            count += 1;
                        }
                    }
                }
            }
        }
        assert!(count > 20);
        assert_eq!(all(&map, &sights).len(), count);
    }

    #[test]
    fn two_posts_in_either_order_stand_for_the_goal() {
        let map = Map::new(&Field::named("kid").unwrap(), false).unwrap();
        let pose = Pose::new(2.0, 0.0, 0.0);
        let mut sights = seen(&map, &pose, 40);
        sights.retain(|s| s.class == LandmarkClass::GoalPost && s.bearing.abs() < 1.0);
        assert_eq!(sights.len(), 2);
        sights.reverse();
        assert!(has(&all(&map, &sights), &pose, 1e-9));
    }
}
