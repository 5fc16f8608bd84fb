//! Measures: how far a method's pose is from the truth along a stream.
//!
//! Errors are distances on the ground at equal time. As in paper 4 the standard deviation is that of the distances, so
//! that MSE = MAE^2 + STD^2. Nothing here is told to a method.

use instep_field::{Pose, wrap};
use nalgebra::Vector3;

use crate::localiser::{Localiser, Method, Status};
use crate::stream::{Stream, Told};
use crate::{Candidate, LocalisationError};

/// A pose is right within this, m and rad.
const RIGHT: [f64; 2] = [0.5, 0.26];

/// Truth and estimate at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// s
    pub time: f64,
    /// `field_from_robot`
    pub truth: Pose,
    /// What the method said; without meaning when `lost`.
    pub estimate: Pose,
    /// The method said that it has no pose.
    pub lost: bool,
    /// The method said that the twin is as likely.
    pub ambiguous: bool,
    /// Normalised squared error of (x, y, heading), where a covariance is known; 3 on average when it is honest.
    pub nees: Option<f64>,
}

impl Sample {
    /// Distance on the ground, m.
    pub fn error(&self) -> f64 {
        self.truth.distance(&self.estimate)
    }

    /// Error of the heading without sign, rad.
    pub fn heading_error(&self) -> f64 {
        wrap(self.estimate.heading - self.truth.heading).abs()
    }

    /// Whether the estimate is right to half a metre and 15 degrees.
    pub fn is_right(&self) -> bool {
        !self.lost && self.error() < RIGHT[0] && self.heading_error() < RIGHT[1]
    }

    /// Whether the estimate is the truth's twin rather than the truth.
    pub fn is_twin(&self) -> bool {
        let twin = self.truth.mirrored();
        !self.lost
            && self.heading_error() > std::f64::consts::FRAC_PI_2
            && self.estimate.distance(&twin) < self.error().max(1.0)
    }
}

/// One method along one stream.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Track {
    /// At each true pose.
    pub samples: Vec<Sample>,
    /// Replacements of the pose.
    pub resets: usize,
    /// Replacements that made the pose worse (a radian counts as 2 m).
    pub false_resets: usize,
    /// What each frame cost, s.
    pub update_times: Vec<f64>,
    /// What each check cost, s.
    pub check_times: Vec<f64>,
    /// What each check found, with its time, s.
    pub candidates: Vec<(f64, Vec<Candidate>)>,
    /// When the robot was carried away; otherwise the recovery counts from the start, s.
    pub carried_at: Option<f64>,
}

/// Runs a method along a stream. `clock` gives seconds from anywhere; it times the method and changes nothing.
///
/// # Errors
/// [`LocalisationError`] with the first input that cannot be used.
pub fn follow(method: Box<dyn Method>, stream: &Stream, clock: &dyn Fn() -> f64) -> Result<Track, LocalisationError> {
    let mut localiser = Localiser::new(method, stream.start);
    let mut track = Track { carried_at: stream.carried_at, ..Track::default() };
    let mut open = None;
    for told in &stream.told {
        match told {
            Told::Truth(truth) => {
                track.close(&localiser, open.replace(*truth));
            }
            Told::Odometry(step) => localiser.step(step)?,
            Told::Frame(frame) => {
                let begin = clock();
                localiser.see(frame)?;
                track.update_times.push(clock() - begin);
                let (resets, before) = (localiser.method().resets(), localiser.pose());
                let begin = clock();
                if localiser.check_if_due() {
                    track.check_times.push(clock() - begin);
                    track.candidates.push((frame.time, localiser.method().candidates().to_vec()));
                }
                if localiser.method().resets() > resets {
                    track.resets += 1;
                    let off = |p: &Pose, t: &Pose| p.distance(t).hypot(2.0 * wrap(p.heading - t.heading));
                    let after = localiser.pose();
                    let worse = open.is_some_and(|t| off(&after, &t.pose) > off(&before, &t.pose));
                    track.false_resets += usize::from(worse);
                }
            }
            Told::Field(_) | Told::Start(_) => {}
        }
    }
    track.close(&localiser, open);
    Ok(track)
}

impl Track {
    fn close(&mut self, localiser: &Localiser<Box<dyn Method>>, truth: Option<crate::stream::Truth>) {
        let Some(truth) = truth else { return };
        let estimate = localiser.pose();
        let nees = localiser.covariance().and_then(|p| {
            let e = Vector3::new(
                estimate.x - truth.pose.x,
                estimate.y - truth.pose.y,
                wrap(estimate.heading - truth.pose.heading),
            );
            p.try_inverse().map(|inverse| e.dot(&(inverse * e)))
        });
        let status = localiser.status();
        self.samples.push(Sample {
            time: truth.time,
            truth: truth.pose,
            estimate,
            lost: status == Status::Lost,
            ambiguous: matches!(status, Status::Ambiguous { .. }),
            nees,
        });
    }

    /// From the event (or the start) until the estimate is right and stays so, s; nothing when it never is.
    pub fn recovery(&self) -> Option<f64> {
        let begin = self.carried_at.or(self.samples.first().map(|s| s.time))?;
        if !self.samples.last()?.is_right() {
            return None;
        }
        let last_wrong = self.samples.iter().rev().find(|s| !s.is_right() && s.time >= begin - 1e-9);
        Some(last_wrong.map_or(0.0, |s| s.time - begin))
    }

    /// Whether it ends in the twin.
    pub fn ends_in_twin(&self) -> bool {
        self.samples.last().is_some_and(Sample::is_twin)
    }
}

/// All tracks of one method in numbers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Measures {
    /// Mean distance, m.
    pub mae: f64,
    /// Mean squared distance, m^2.
    pub mse: f64,
    /// Standard deviation of the distance, m.
    pub std: f64,
    /// Largest distance, m.
    pub worst: f64,
    /// Mean heading error without sign, rad.
    pub heading_mae: f64,
    /// Share of the time in which the estimate was the truth's twin.
    pub wrong_half_rate: f64,
    /// Share of the time in which the estimate was farther than 1 m off, or missing.
    pub astray_rate: f64,
    /// Replacements that made the pose worse, over all runs.
    pub false_resets: usize,
    /// Replacements, over all runs.
    pub resets: usize,
    /// Mean normalised squared error over its 3 degrees of freedom: 1 when the covariance is honest.
    pub nees: Option<f64>,
    /// Runs that were right 6 s after the event (or start) and stayed so, as a share.
    pub recovered_rate: f64,
    /// Median time until right, of the runs that ended right, s.
    pub recovery_median: Option<f64>,
    /// Longest time until right, of the runs that ended right, s.
    pub recovery_worst: Option<f64>,
    /// Runs that ended in the twin, as a share.
    pub twin_rate: f64,
    /// 99th percentile of a frame's cost, s.
    pub update_p99: f64,
    /// 99th percentile of a check's cost, s.
    pub check_p99: f64,
}

/// Runs must be right within this time after the event, s.
const RECOVERY_TIME: f64 = 6.0;

impl Measures {
    /// Over all samples of all tracks alike.
    pub fn of(tracks: &[Track]) -> Measures {
        let samples = || tracks.iter().flat_map(|t| &t.samples);
        let count = samples().count() as f64;
        if count == 0.0 {
            return Measures::default();
        }
        let mean = |value: fn(&Sample) -> f64| samples().map(value).sum::<f64>() / count;
        let share = |test: fn(&Sample) -> bool| samples().filter(|s| test(s)).count() as f64 / count;
        let mae = mean(Sample::error);
        let mse = mean(|s| s.error().powi(2));
        let nees: Vec<f64> = samples().filter_map(|s| s.nees).collect();
        let mut recoveries: Vec<f64> = tracks.iter().filter_map(Track::recovery).collect();
        recoveries.sort_by(f64::total_cmp);
        let runs = tracks.len() as f64;
        Measures {
            mae,
            mse,
            std: samples().map(|s| (s.error() - mae).powi(2)).sum::<f64>().sqrt() / count.sqrt(),
            worst: samples().map(Sample::error).fold(0.0, f64::max),
            heading_mae: mean(Sample::heading_error),
            wrong_half_rate: share(Sample::is_twin),
            astray_rate: share(|s| s.lost || s.error() > 1.0),
            false_resets: tracks.iter().map(|t| t.false_resets).sum(),
            resets: tracks.iter().map(|t| t.resets).sum(),
            nees: (!nees.is_empty()).then(|| nees.iter().sum::<f64>() / nees.len() as f64 / 3.0),
            recovered_rate: recoveries.iter().filter(|&&r| r <= RECOVERY_TIME).count() as f64 / runs,
            recovery_median: recoveries.get(recoveries.len() / 2).copied(),
            recovery_worst: recoveries.last().copied(),
            twin_rate: tracks.iter().filter(|t| t.ends_in_twin()).count() as f64 / runs,
            update_p99: percentile(tracks.iter().flat_map(|t| &t.update_times), 0.99),
            check_p99: percentile(tracks.iter().flat_map(|t| &t.check_times), 0.99),
        }
    }
}

/// 0 without values.
fn percentile<'a>(values: impl Iterator<Item = &'a f64>, share: f64) -> f64 {
    let mut sorted: Vec<f64> = values.copied().collect();
    sorted.sort_by(f64::total_cmp);
    let place = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(place.saturating_sub(1)).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(time: f64, truth: Pose, estimate: Pose) -> Sample {
        Sample { time, truth, estimate, lost: false, ambiguous: false, nees: None }
    }

    #[test]
    fn the_measures_of_known_errors() {
        let truth = Pose::new(1.0, 2.0, 0.5);
        let off = |d: f64, turn: f64| Pose::new(1.0 + d * 0.6, 2.0 - d * 0.8, 0.5 + turn);
        let samples = vec![sample(0.0, truth, off(0.1, 0.2)), sample(1.0, truth, off(0.3, -0.4))];
        let m = Measures::of(&[Track { samples, ..Track::default() }]);
        assert!((m.mae - 0.2).abs() < 1e-12 && (m.mse - 0.05).abs() < 1e-12 && (m.std - 0.1).abs() < 1e-12);
        assert!((m.mse - m.mae.powi(2) - m.std.powi(2)).abs() < 1e-12);
        assert!((m.heading_mae - 0.3).abs() < 1e-12 && (m.worst - 0.3).abs() < 1e-12);
        assert_eq!((m.wrong_half_rate, m.twin_rate), (0.0, 0.0));
    }

    #[test]
    fn the_twin_is_known_near_the_middle_too() {
        for truth in [Pose::new(3.0, 1.0, 0.5), Pose::new(0.1, 0.1, 2.0)] {
            assert!(sample(0.0, truth, truth.mirrored()).is_twin());
            assert!(!sample(0.0, truth, truth).is_twin());
            assert!(!sample(0.0, truth, Pose::new(truth.x, truth.y + 2.0, truth.heading)).is_twin());
        }
    }

    #[test]
    fn recovery_counts_from_the_event_to_the_last_wrong_sample() {
        let truth = Pose::default();
        let far = Pose::new(2.0, 0.0, 0.0);
        let at = |k: usize| if k == 2 || k == 5 || k == 6 { far } else { truth };
        let samples: Vec<Sample> = (0..10).map(|k| sample(k as f64, truth, at(k))).collect();
        let track = Track { samples: samples.clone(), carried_at: Some(4.0), ..Track::default() };
        assert_eq!(track.recovery(), Some(2.0));
        let track = Track { samples: samples[..7].to_vec(), carried_at: Some(4.0), ..Track::default() };
        assert_eq!(track.recovery(), None);
        let track = Track { samples: samples[..5].to_vec(), carried_at: Some(3.0), ..Track::default() };
        assert_eq!(track.recovery(), Some(0.0));
    }

    #[test]
    fn percentile_of_a_hundred() {
        let values: Vec<f64> = (1..=100).map(f64::from).collect();
        assert_eq!(percentile(values.iter(), 0.99), 99.0);
        assert_eq!(percentile([].iter(), 0.99), 0.0);
    }
}
