//! The method that is shipped: an iterated robust landmark filter that looks round for itself when in doubt.
//!
//! The state is the pose, a common scale of all ranges (a camera's tilt), two scales of the odometry and the gyro's
//! bias. A frame's sights are associated one to one with landmarks, the most probable state is found by Gauss-Newton
//! steps under Cauchy's weights, and from there sights are associated and the state is found again (iterated landmark
//! matching: Hou et al., arXiv 2503.11020). Pieces of lines count as well, by the distances of their ends from the
//! line. Each measurement enters as a scalar into the Kalman form of the step, so that nothing is inverted and a state
//! that is exactly known is no special case.
//!
//! CLAP (`window`) finds the start and notices that the robot has been carried away: a candidate takes the pose's place
//! when it explains much more of the last two seconds, several times running. Of a symmetric field's twins the one is
//! taken that agrees with the gyro's heading; at a start the game's state decides. A candidate is never averaged into
//! the pose.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use instep_field::{Line, Pose, wrap};
use nalgebra::{Matrix3, SMatrix, SVector};

use crate::association::Association;
use crate::localiser::{Method, Start, Status};
use crate::map::Map;
use crate::measurement::{Expected, Polar, cauchy};
use crate::window::{Candidate, Window, nearest_first};
use crate::{Frame, LineSight, Settings};

/// x, y, heading, range scale less 1, odometry's scale ahead and sideways less 1, gyro bias.
const N: usize = 7;
const RANGE_SCALE: usize = 3;
const AHEAD: usize = 4;
const SIDEWAYS: usize = 5;
const BIAS: usize = 6;
type State = SVector<f64, N>;
type Covariance = SMatrix<f64, N, N>;

/// How well a candidate is known when it becomes the pose: m, rad.
const RESET_SIGMA: [f64; 2] = [0.2, 0.08];

/// One scalar measurement: slope, what was measured less what is expected, variance.
#[derive(Debug, Clone, Copy)]
struct Row {
    slope: State,
    residual: f64,
    variance: f64,
}

/// The iterated robust landmark filter.
#[derive(Debug, Clone)]
pub struct LandmarkFilter {
    map: Arc<Map>,
    settings: Settings,
    state: State,
    covariance: Covariance,
    status: Status,
    resets: usize,
    window: Window,
    /// Heading by gyro alone since the pose was last beyond doubt, rad.
    gyro_heading: f64,
    /// Checks running that spoke against the pose, or for the same start.
    doubts: usize,
    /// Before the pose is known: the half that the game allows.
    own_half: bool,
    sights: Vec<Polar>,
    association: Association,
    rows: Vec<Row>,
}

impl LandmarkFilter {
    /// A filter that has not been started.
    pub fn new(map: Arc<Map>, settings: Settings) -> LandmarkFilter {
        let most = settings.filter.most_sights;
        LandmarkFilter {
            window: Window::new(&map, &settings),
            association: Association::with_capacity(&map, most),
            sights: Vec::with_capacity(64),
            rows: Vec::with_capacity(2 * most + 2 * MOST_LINES),
            state: State::zeros(),
            covariance: Covariance::zeros(),
            status: Status::Lost,
            resets: 0,
            gyro_heading: 0.0,
            doubts: 0,
            own_half: false,
            map,
            settings,
        }
    }

    /// Estimated scale of ranges, scale of odometry ahead and sideways (each 1 when exact), gyro bias, rad/s.
    pub fn calibration(&self) -> [f64; 4] {
        let x = &self.state;
        [1.0 + x[RANGE_SCALE], 1.0 + x[AHEAD], 1.0 + x[SIDEWAYS], x[BIAS]]
    }

    /// Puts the pose somewhere; calibration is kept, its certainty forgotten.
    fn place(&mut self, pose: &Pose, position_sigma: f64, heading_sigma: f64) {
        let (filter, odometry) = (&self.settings.filter, &self.settings.odometry);
        self.state.fixed_rows_mut::<3>(0).copy_from_slice(&[pose.x, pose.y, pose.heading]);
        let sigmas = [
            position_sigma,
            position_sigma,
            heading_sigma,
            filter.range_scale,
            odometry.scale_ahead,
            odometry.scale_sideways,
            odometry.gyro_bias,
        ];
        self.covariance = Covariance::from_diagonal(&State::from(sigmas).map(|s| s * s));
        self.gyro_heading = pose.heading;
        self.doubts = 0;
    }

    fn pose_of(state: &State) -> Pose {
        Pose { x: state[0], y: state[1], heading: wrap(state[2]) }
    }

    /// One frame: associates, solves, associates at the result, solves again from the prediction.
    fn correct(&mut self, lines: &[LineSight]) {
        let (prior, prior_covariance) = (self.state, self.covariance);
        let filter = self.settings.filter;
        for _ in 0..filter.associations {
            let pose = Self::pose_of(&self.state);
            let covariance = self.covariance.fixed_view::<3, 3>(0, 0).into_owned();
            let scale = 1.0 + self.state[RANGE_SCALE];
            self.association.find(&self.map, &self.sights, &pose, &covariance, scale, filter.gate);
            for _ in 0..filter.iterations {
                self.linearise(lines);
                let offset = difference(&self.state, &prior);
                let (mut step, mut covariance) = (State::zeros(), prior_covariance);
                for row in &self.rows {
                    // What remains of the residual once the state has gone from where it was linearised to here.
                    let innovation = row.residual + row.slope.dot(&(offset - step));
                    let spread = covariance * row.slope;
                    let gain = spread / (row.slope.dot(&spread) + row.variance);
                    step += gain * innovation;
                    covariance -= gain * spread.transpose();
                }
                self.state = prior + step;
                self.state[2] = wrap(self.state[2]);
                self.covariance = 0.5 * (covariance + covariance.transpose());
            }
        }
    }

    /// The rows of all associated sights and lines at the present state.
    fn linearise(&mut self, lines: &[LineSight]) {
        self.rows.clear();
        let filter = &self.settings.filter;
        let pose = Self::pose_of(&self.state);
        let scale = 1.0 + self.state[RANGE_SCALE];
        for (sight, landmark) in self.sights.iter().zip(&self.association.landmark) {
            let Some(landmark) = *landmark else { continue };
            let expected = Expected::of(&pose, self.map.landmarks()[landmark].1);
            let range_residual = sight.range - scale * expected.range;
            let bearing_residual = wrap(sight.bearing - expected.bearing);
            let square =
                (range_residual / sight.range_sigma).powi(2) + (bearing_residual / sight.bearing_sigma).powi(2);
            let factor = filter.information_divisor / cauchy(square, filter.cauchy);
            let [hx, hy, ht] = expected.range_slope.map(|s| scale * s);
            self.rows.push(Row {
                slope: State::from([hx, hy, ht, expected.range, 0.0, 0.0, 0.0]),
                residual: range_residual,
                variance: factor * sight.range_sigma.powi(2),
            });
            let [hx, hy, ht] = expected.bearing_slope;
            self.rows.push(Row {
                slope: State::from([hx, hy, ht, 0.0, 0.0, 0.0, 0.0]),
                residual: bearing_residual,
                variance: factor * sight.bearing_sigma.powi(2),
            });
        }
        for line in lines.iter().take(MOST_LINES) {
            self.line_rows(line, &pose, scale);
        }
    }

    /// The two rows of a piece of a line: its ends' distances from the map's line that both are near to.
    fn line_rows(&mut self, sight: &LineSight, pose: &Pose, scale: f64) {
        let (filter, noise) = (&self.settings.filter, &self.settings.noise);
        let ends = [sight.from, sight.to];
        let seen = ends.map(|p| p.map(|v| v / scale));
        let at = seen.map(|p| pose.outer_from_local(p));
        let farther = |line: &Line| line.distance(at[0]).max(line.distance(at[1]));
        let Some(line) = self.map.lines().iter().min_by(|a, b| farther(a).total_cmp(&farther(b))) else { return };
        let mut rows = [None; 2];
        for k in 0..2 {
            let (normal, residual) = match *line {
                Line::Segment { from, to } => {
                    let length = line.length();
                    let normal = [-(to[1] - from[1]) / length, (to[0] - from[0]) / length];
                    let distance = normal[0] * (at[k][0] - from[0]) + normal[1] * (at[k][1] - from[1]);
                    // Beyond the line's end there is no line.
                    if line.distance(at[k]) > distance.abs() + 0.5 {
                        return;
                    }
                    (normal, -distance)
                }
                Line::Circle { center, radius } => {
                    let [dx, dy] = [at[k][0] - center[0], at[k][1] - center[1]];
                    let distance = dx.hypot(dy).max(0.01);
                    ([dx / distance, dy / distance], radius - distance)
                }
            };
            let (s, c) = pose.heading.sin_cos();
            let [vx, vy] = seen[k];
            let turned = [c * vx - s * vy, s * vx + c * vy];
            let slope = State::from([
                normal[0],
                normal[1],
                normal[1] * turned[0] - normal[0] * turned[1],
                -(normal[0] * turned[0] + normal[1] * turned[1]) / scale,
                0.0,
                0.0,
                0.0,
            ]);
            let range = vx.hypot(vy);
            let along = (normal[0] * turned[0] + normal[1] * turned[1]) / range;
            let variance = (noise.range_sigma(range) * along).powi(2)
                + (range * noise.bearing_sigma(range)).powi(2) * (1.0 - along * along);
            let pose_variance = slope.dot(&(self.covariance * slope));
            if residual * residual > 9.0 * (variance + pose_variance) {
                return;
            }
            let weight = cauchy(residual * residual / variance, filter.cauchy);
            rows[k] = Some(Row { slope, residual, variance: filter.information_divisor * variance / weight });
        }
        self.rows.extend(rows.into_iter().flatten());
    }

    /// The candidate to believe, with its twin if one is as good.
    fn choose(&mut self) -> Option<(Candidate, Option<Pose>)> {
        let alternative = self.settings.global.alternative;
        let pose = Self::pose_of(&self.state);
        let (lost, own_half, gyro) = (self.status == Status::Lost, self.own_half, self.gyro_heading);
        let candidates = self.window.candidates(&self.map);
        let best = *candidates.first()?;
        let good = || candidates.iter().filter(|c| c.share >= alternative * best.share);
        if lost {
            let chosen = if own_half { *good().find(|c| c.pose.x < 0.0)? } else { best };
            let other = good().find(|c| c.pose.distance(&chosen.pose.mirrored()) < 1.0).map(|c| c.pose);
            return Some((chosen, if own_half { None } else { other }));
        }
        let turned = |c: &&Candidate| wrap(c.pose.heading - gyro).abs() < FRAC_PI_2;
        let near = |a: &&Candidate, b: &&Candidate| pose.distance(&a.pose).total_cmp(&pose.distance(&b.pose));
        good().filter(turned).min_by(near).map(|c| (*c, None))
    }
}

/// Pieces of lines of a frame that are used.
const MOST_LINES: usize = 16;

/// `a - b` with the heading wrapped.
fn difference(a: &State, b: &State) -> State {
    let mut d = a - b;
    d[2] = wrap(d[2]);
    d
}

impl Method for LandmarkFilter {
    fn name(&self) -> &'static str {
        "landmark filter"
    }

    fn start(&mut self, start: Start) {
        self.state = State::zeros();
        self.window.clear();
        self.resets = 0;
        self.own_half = start == Start::OwnHalf;
        self.status = Status::Lost;
        match start {
            Start::Near { pose, position_sigma, heading_sigma } => {
                self.place(&pose, position_sigma, heading_sigma);
                self.status = Status::Tracking;
            }
            Start::OwnHalf | Start::Anywhere => self.place(&Pose::default(), self.map.half()[0], PI),
        }
    }

    fn predict(&mut self, motion: &Pose, dt: f64) {
        self.window.step(motion);
        let (filter, odometry) = (&self.settings.filter, &self.settings.odometry);
        let x = &mut self.state;
        let (s, c) = x[2].sin_cos();
        let ahead = (1.0 + x[AHEAD]) * motion.x;
        let sideways = (1.0 + x[SIDEWAYS]) * motion.y;
        let mut f = Covariance::identity();
        f[(0, 2)] = -s * ahead - c * sideways;
        f[(1, 2)] = c * ahead - s * sideways;
        (f[(0, AHEAD)], f[(1, AHEAD)]) = (c * motion.x, s * motion.x);
        (f[(0, SIDEWAYS)], f[(1, SIDEWAYS)]) = (-s * motion.y, c * motion.y);
        f[(2, BIAS)] = -dt;
        x[0] += c * ahead - s * sideways;
        x[1] += s * ahead + c * sideways;
        let turn = motion.heading - x[BIAS] * dt;
        x[2] = wrap(x[2] + turn);
        self.gyro_heading = wrap(self.gyro_heading + turn);

        let mut q = State::zeros();
        let step = motion.x.hypot(motion.y);
        // A share of each step, as steps of 50 ms would sum it up.
        let per_step = if dt > 0.0 { (odometry.step_share * step).powi(2) * 0.05 / dt } else { 0.0 };
        q[0] = odometry.slip * odometry.slip * dt + per_step;
        q[1] = q[0];
        q[2] = odometry.heading * odometry.heading * dt + (odometry.turn_share * motion.heading).powi(2);
        for (k, sigma, time) in [
            (RANGE_SCALE, filter.range_scale, filter.range_scale_time),
            (AHEAD, odometry.scale_ahead, odometry.scale_time),
            (SIDEWAYS, odometry.scale_sideways, odometry.scale_time),
            (BIAS, odometry.gyro_bias, odometry.gyro_time),
        ] {
            let kept = (-dt / time).exp();
            x[k] *= kept;
            f[(k, k)] = kept;
            q[k] = sigma * sigma * (1.0 - kept * kept);
        }
        self.covariance = f * self.covariance * f.transpose() + Covariance::from_diagonal(&q);
    }

    fn update(&mut self, frame: &Frame) {
        nearest_first(&frame.landmarks, &self.settings.noise, self.settings.filter.most_sights, &mut self.sights);
        self.window.push(&self.map, &self.sights);
        if self.status != Status::Lost {
            self.correct(&frame.lines);
        }
        if let Status::Ambiguous { twin } = &mut self.status {
            *twin = Self::pose_of(&self.state).mirrored();
        }
    }

    fn check(&mut self) {
        let global = self.settings.global;
        if self.window.len() < global.frames / 4 {
            return;
        }
        let pose = Self::pose_of(&self.state);
        let Some((candidate, twin)) = self.choose() else {
            self.doubts = 0;
            return;
        };
        if self.status == Status::Lost {
            self.doubts = if candidate.share > global.share { self.doubts + 1 } else { 0 };
            if self.doubts >= 2 {
                self.place(&candidate.pose, RESET_SIGMA[0], RESET_SIGMA[1]);
                self.status = twin.map_or(Status::Tracking, |twin| Status::Ambiguous { twin });
            }
            return;
        }
        let own = self.window.share(&self.map, &pose);
        let far = candidate.pose.distance(&pose) > global.distance
            || wrap(candidate.pose.heading - pose.heading).abs() > global.angle;
        if far && candidate.share > global.ratio * own && candidate.share > global.share {
            self.doubts += 1;
        } else {
            self.doubts = 0;
            if own > global.share {
                self.gyro_heading = pose.heading;
            }
        }
        if self.doubts >= global.times {
            self.place(&candidate.pose, RESET_SIGMA[0], RESET_SIGMA[1]);
            self.resets += 1;
        }
    }

    fn check_period(&self) -> f64 {
        self.settings.global.period
    }

    fn pose(&self) -> Pose {
        Self::pose_of(&self.state)
    }

    fn covariance(&self) -> Option<Matrix3<f64>> {
        Some(self.covariance.fixed_view::<3, 3>(0, 0).into_owned())
    }

    fn status(&self) -> Status {
        self.status
    }

    fn resets(&self) -> usize {
        self.resets
    }

    fn candidates(&self) -> &[Candidate] {
        self.window.last_candidates()
    }
}

#[cfg(test)]
mod tests {
    use instep_field::{Field, Landmark, LandmarkClass};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::Sight;

    fn map() -> Arc<Map> {
        Arc::new(Map::new(&Field::named("adult-2024").unwrap(), true).unwrap())
    }

    fn normal(rng: &mut ChaCha8Rng) -> f64 {
        StandardNormal.sample(rng)
    }

    /// All landmarks from 0.85 to 8 m, with the noise that the settings expect.
    fn sights(map: &Map, settings: &Settings, pose: &Pose, rng: &mut ChaCha8Rng) -> Vec<Sight> {
        let near = map.landmarks().iter().filter_map(|&(class, at)| {
            let [x, y] = pose.local_from_outer(at);
            let range = x.hypot(y);
            (0.85..8.0).contains(&range).then_some((class, range, y.atan2(x)))
        });
        let mut noisy = |(class, range, bearing): (LandmarkClass, f64, f64)| {
            let range: f64 = range + settings.noise.range_sigma(range) * normal(rng);
            let (s, c) = (bearing + settings.noise.bearing_sigma(range) * normal(rng)).sin_cos();
            Sight { class, position: [range * c, range * s], confidence: 1.0, covariance: None }
        };
        near.map(&mut noisy).collect()
    }

    /// The cost that the update should have made least: prior and Cauchy's loss of every associated sight.
    fn cost(filter: &LandmarkFilter, prior: &State, information: &Covariance, x: &State) -> f64 {
        let settings = &filter.settings.filter;
        let offset = difference(x, prior);
        let mut sum = 0.5 * offset.dot(&(information * offset));
        for (sight, landmark) in filter.sights.iter().zip(&filter.association.landmark) {
            let Some(landmark) = *landmark else { continue };
            let [dx, dy] = [filter.map.landmarks()[landmark].1[0] - x[0], filter.map.landmarks()[landmark].1[1] - x[1]];
            let range = (sight.range - (1.0 + x[RANGE_SCALE]) * dx.hypot(dy)) / sight.range_sigma;
            let bearing = wrap(sight.bearing - dy.atan2(dx) + x[2]) / sight.bearing_sigma;
            let square = range * range + bearing * bearing;
            let c = settings.cauchy * settings.cauchy;
            sum += 0.5 * c * (1.0 + square / c).ln() / settings.information_divisor;
        }
        sum
    }

    /// An oracle that knows no slopes: at the result the cost's central differences vanish.
    #[test]
    fn the_update_finds_the_least_cost() {
        let map = map();
        let mut settings = Settings::default();
        settings.filter.associations = 1;
        settings.filter.iterations = 60;
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        for k in 0..20 {
            let truth = Pose::new(0.3 * f64::from(k) - 3.0, 0.2 * f64::from(k) - 2.0, 0.31 * f64::from(k));
            let mut filter = LandmarkFilter::new(map.clone(), settings);
            let near = Pose::new(truth.x + 0.1 * normal(&mut rng), truth.y, truth.heading + 0.03 * normal(&mut rng));
            filter.start(Start::Near { pose: near, position_sigma: 0.15, heading_sigma: 0.05 });
            let (prior, information) = (filter.state, filter.covariance.try_inverse().unwrap());
            let landmarks = sights(&map, &settings, &truth, &mut rng);
            filter.update(&Frame { time: 0.0, landmarks, lines: Vec::new() });
            assert!(filter.association.landmark.iter().flatten().count() > 3);
            for i in 0..N {
                let mut step = State::zeros();
                step[i] = 1e-6;
                let at = |s: f64| cost(&filter, &prior, &information, &(filter.state + s * step));
                let slope = (at(1.0) - at(-1.0)) / 2e-6;
                let scale = information[(i, i)].sqrt();
                assert!(slope.abs() < 1e-3 * scale.max(1.0), "pose {k}, state {i}: slope {slope}");
            }
        }
    }

    /// Where the noise is what the settings say, new in each frame, the squared error over the covariance is 3 on
    /// average: in the 99 % band of chi-square over 200 runs.
    #[test]
    fn the_covariance_is_honest() {
        // One landmark of each class: no sight can be taken for another's.
        let places = [(7.0, 1.3), (4.0, -3.0), (0.0, 4.5), (0.0, -1.5), (4.9, 0.0)];
        let own = LandmarkClass::ALL.iter().zip(places).map(|(&class, (x, y))| Landmark { class, x, y });
        let field = Field { own_landmarks: Some(own.collect()), ..Field::named("adult-2024").unwrap() };
        let map = Arc::new(Map::new(&field, false).unwrap());
        let mut settings = Settings::default();
        settings.filter.information_divisor = 1.0;
        settings.filter.cauchy = 1e6;
        settings.filter.gate = 1e6;
        let odometry = settings.odometry;
        let (runs, dt) = (200, 0.05);
        let mut sum = 0.0;
        for run in 0..runs {
            let mut rng = ChaCha8Rng::seed_from_u64(run);
            let mut truth = Pose::new(1.0, -1.0, 0.4);
            let start = Pose::new(
                truth.x + 0.1 * normal(&mut rng),
                truth.y + 0.1 * normal(&mut rng),
                truth.heading + 0.05 * normal(&mut rng),
            );
            let mut filter = LandmarkFilter::new(map.clone(), settings);
            filter.start(Start::Near { pose: start, position_sigma: 0.1, heading_sigma: 0.05 });
            let scale = 1.0 + settings.filter.range_scale * normal(&mut rng);
            let ahead = 1.0 + odometry.scale_ahead * normal(&mut rng);
            let sideways = 1.0 + odometry.scale_sideways * normal(&mut rng);
            let bias = odometry.gyro_bias * normal(&mut rng);
            for _ in 0..40 {
                let told = Pose::new(0.02, 0.005, 0.02);
                let slip = (odometry.slip.powi(2) * dt + (odometry.step_share * 0.02_f64.hypot(0.005)).powi(2)).sqrt();
                let turn = (odometry.heading.powi(2) * dt + (odometry.turn_share * told.heading).powi(2)).sqrt();
                truth = truth.then(&Pose::new(
                    ahead * told.x + slip * normal(&mut rng),
                    sideways * told.y + slip * normal(&mut rng),
                    told.heading - bias * dt + turn * normal(&mut rng),
                ));
                filter.predict(&told, dt);
                let mut landmarks = sights(&map, &settings, &truth, &mut rng);
                for sight in &mut landmarks {
                    sight.position = sight.position.map(|v| v * scale);
                }
                nearest_first(&landmarks, &settings.noise, settings.filter.most_sights, &mut filter.sights);
                filter.correct(&[]);
            }
            let e = nalgebra::Vector3::new(
                filter.state[0] - truth.x,
                filter.state[1] - truth.y,
                wrap(filter.state[2] - truth.heading),
            );
            sum += e.dot(&(Method::covariance(&filter).unwrap().try_inverse().unwrap() * e));
        }
        let mean = sum / runs as f64;
        assert!((2.57..3.46).contains(&mean), "NEES {mean}");
    }

    /// Ends of lines alone, seen without error, pull a wrong pose to the truth.
    #[test]
    fn lines_correct_the_pose() {
        let map = map();
        let truth = Pose::new(3.0, 1.0, 0.7);
        let mut filter = LandmarkFilter::new(map.clone(), Settings::default());
        let near = Pose::new(3.1, 0.93, 0.74);
        filter.start(Start::Near { pose: near, position_sigma: 0.1, heading_sigma: 0.05 });
        let seen = |from: [f64; 2], to: [f64; 2]| LineSight {
            from: truth.local_from_outer(from),
            to: truth.local_from_outer(to),
        };
        let lines = vec![
            seen([4.0, 2.5], [4.0, -0.5]),
            seen([4.5, 3.0], [6.5, 3.0]),
            seen([7.0, 0.5], [7.0, 3.5]),
            seen([0.0, 1.7], [0.0, 3.5]),
        ];
        for _ in 0..10 {
            filter.update(&Frame { time: 0.0, landmarks: Vec::new(), lines: lines.clone() });
        }
        let pose = filter.pose();
        assert!(pose.distance(&truth) < 0.03 && wrap(pose.heading - truth.heading).abs() < 0.005, "{pose:?}");
    }
}
