//! The filter against finite differences, a finely integrated motion, and its own covariance (NEES).

use nalgebra::Rotation3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;

const NOISE: Noise =
    Noise { gyro: 1e-3, accelerometer: 2e-2, gyro_bias: 1e-4, accelerometer_bias: 1e-3, slip: 5e-3, kinematics: 2e-3 };
const SPREAD: [f64; 5] = [0.02, 0.05, 0.02, 0.01, 0.05];
const PERIOD: f64 = 2e-3;

/// A standard normal number, by twelve uniform ones (tails beyond 6 missing).
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0
}

fn normals(rng: &mut ChaCha8Rng, sigma: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| sigma * normal(rng))
}

/// xi = log(X^ X^-1), and the biases' errors.
fn error(estimate: &ContactEkf, truth: &ContactEkf) -> SVector<f64, ERROR> {
    let turn = estimate.rotation * truth.rotation.transpose();
    // Through the sine: the angle's cosine alone is blind below 1e-8 rad.
    let half = (turn - turn.transpose()) * 0.5;
    let axis = Vector3::new(half[(2, 1)], half[(0, 2)], half[(1, 0)]);
    let sine = axis.norm();
    let phi = if sine > 0.0 { axis * (sine.atan2((turn.trace() - 1.0) / 2.0) / sine) } else { axis };
    let inverse = gamma(1, &phi).try_inverse().unwrap();
    let mut xi = SVector::<f64, ERROR>::zeros();
    let mut put = |at: usize, v: Vector3<f64>| xi.fixed_rows_mut::<3>(at).copy_from(&v);
    put(TURN, phi);
    put(VELOCITY, inverse * (estimate.velocity - turn * truth.velocity));
    put(POSITION, inverse * (estimate.position - turn * truth.position));
    for i in (0..CONTACTS).filter(|&i| estimate.stands[i]) {
        put(POINTS + 3 * i, inverse * (estimate.points[i] - turn * truth.points[i]));
    }
    put(GYRO_BIAS, estimate.gyro_bias - truth.gyro_bias);
    put(ACCELEROMETER_BIAS, estimate.accelerometer_bias - truth.accelerometer_bias);
    xi
}

/// A state in the middle of a motion, all points standing.
fn moving() -> ContactEkf {
    let mut state = ContactEkf::new(
        NOISE,
        Rotation3::from_euler_angles(0.2, -0.3, 0.7).into_inner(),
        Vector3::new(0.8, -0.2, 0.1),
        Vector3::new(1.5, 0.4, 0.8),
        SPREAD,
    );
    for i in 0..CONTACTS {
        let x = 0.1 * i as f64;
        state.add_point(i, &Vector3::new(x - 0.1, 0.1 - x, -0.8));
    }
    state
}

#[test]
fn transition_is_the_derivative_of_propagation() {
    let (gyro, accelerometer) = (Vector3::new(0.4, -0.9, 0.3), Vector3::new(1.0, 0.5, 10.5));
    // The matrix is exact for a state that stands still within the period: short enough for that, differences do the rest.
    let (period, step) = (1e-4, 1e-5);
    let state = moving();
    let matrix = state.transition(period);
    for column in 0..ERROR {
        let mut xi = SVector::<f64, ERROR>::zeros();
        xi[column] = step;
        let after = |xi: &SVector<f64, ERROR>| {
            let (mut disturbed, mut truth) = (state.clone(), state.clone());
            disturbed.retract(xi);
            disturbed.propagate(&gyro, &accelerometer, period);
            truth.propagate(&gyro, &accelerometer, period);
            error(&disturbed, &truth)
        };
        let difference = (after(&xi) - after(&-xi)) / (2.0 * step);
        let off = (difference - matrix.column(column)).amax();
        assert!(off < 2e-6, "column {column}: {off}");
    }
}

#[test]
fn correction_has_the_stated_measurement_jacobian_and_sign() {
    let truth = moving();
    let step = 1e-6;
    for column in 0..ERROR {
        let mut xi = SVector::<f64, ERROR>::zeros();
        xi[column] = step;
        let mut disturbed = truth.clone();
        disturbed.retract(&xi);
        for i in 0..CONTACTS {
            let point = truth.rotation.transpose() * (truth.points[i] - truth.position);
            let innovation = disturbed.rotation * point - (disturbed.points[i] - disturbed.position);
            let expected = (xi.fixed_rows::<3>(POSITION) - xi.fixed_rows::<3>(POINTS + 3 * i)) / step;
            assert!((innovation / step - expected).amax() < 1e-5, "column {column}, point {i}");
        }
    }
}

#[test]
fn propagation_is_dense_integration_of_the_equations_of_motion() {
    let (gyro, accelerometer) = (Vector3::new(0.9, -1.7, 2.2), Vector3::new(3.0, -1.0, 8.0));
    let mut exact = moving();
    let mut fine = exact.clone();
    exact.propagate(&gyro, &accelerometer, 0.1);
    // Midpoint rule with 20000 steps.
    let step = 0.1 / 20_000.0;
    for _ in 0..20_000 {
        let middle = fine.rotation * Rotation3::new(gyro * (0.5 * step)).matrix();
        let acceleration = middle * accelerometer + fine.gravity;
        fine.position += (fine.velocity + acceleration * (0.5 * step)) * step;
        fine.velocity += acceleration * step;
        fine.rotation *= Rotation3::new(gyro * step).matrix();
    }
    assert!((exact.rotation - fine.rotation).norm() < 1e-9);
    assert!((exact.velocity - fine.velocity).norm() < 1e-8);
    assert!((exact.position - fine.position).norm() < 1e-9);
}

/// Error of one simulated walk, and what the filter thinks of it: (NEES over what is observable or has a prior, last error of
/// velocity, drift over way).
fn walk(seed: u64, seconds: f64) -> ([f64; 2], f64, f64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut truth =
        ContactEkf::new(NOISE, Matrix3::identity(), Vector3::new(0.5, 0.0, 0.0), Vector3::z() * 0.8, SPREAD);
    truth.gyro_bias = normals(&mut rng, SPREAD[3]);
    truth.accelerometer_bias = normals(&mut rng, SPREAD[4]);
    let mut start = SVector::<f64, ERROR>::zeros();
    for (at, sigma) in [TURN, VELOCITY, POSITION].into_iter().zip(SPREAD) {
        start.fixed_rows_mut::<3>(at).copy_from(&normals(&mut rng, sigma));
    }
    let mut filter = truth.clone();
    (filter.gyro_bias, filter.accelerometer_bias) = (Vector3::zeros(), Vector3::zeros());
    filter.retract(&start);
    let rate = |sigma: f64| sigma / PERIOD.sqrt();
    let steps = (seconds / PERIOD) as usize;
    let (mut squares, mut velocity) = ([0.0; 2], 0.0);
    let mut samples = [0.0; 2];
    for step in 0..steps {
        let time = step as f64 * PERIOD;
        // A trunk that sways and walks with 0.5 m/s, feet that take turns every 0.4 s with 0.05 s on both.
        let beat = std::f64::consts::TAU * time / 0.8;
        let turn_rate = Vector3::new(0.5 * beat.sin(), 0.4 * (2.0 * beat).cos(), 0.2 + 0.3 * beat.cos());
        let wanted = Vector3::new(0.5 + 0.1 * (2.0 * beat).sin(), 0.2 * beat.cos(), 0.1 * (2.0 * beat).cos());
        let acceleration = (wanted - truth.velocity) / PERIOD;
        // The very motion that a held acceleration and rate make, so that the truth has no error of integration.
        let turn = turn_rate * PERIOD;
        let force = (truth.rotation * gamma(1, &turn)).try_inverse().unwrap() * (acceleration - truth.gravity);
        let gyro = turn_rate + truth.gyro_bias + normals(&mut rng, rate(NOISE.gyro));
        let accelerometer = force + truth.accelerometer_bias + normals(&mut rng, rate(NOISE.accelerometer));
        let (turned, moved) = (turn_rate + truth.gyro_bias, force + truth.accelerometer_bias);
        truth.propagate(&turned, &moved, PERIOD);
        truth.gyro_bias += normals(&mut rng, NOISE.gyro_bias * PERIOD.sqrt());
        truth.accelerometer_bias += normals(&mut rng, NOISE.accelerometer_bias * PERIOD.sqrt());
        for point in &mut truth.points {
            *point += truth.rotation * normals(&mut rng, NOISE.slip * PERIOD.sqrt());
        }
        filter.propagate(&gyro, &accelerometer, PERIOD);

        let phase = time.rem_euclid(0.8);
        let down = [phase < 0.45, !(0.05..0.4).contains(&phase)];
        let mut contacts = [Contact { stands: false, point: Vector3::zeros() }; CONTACTS];
        for (i, contact) in contacts.iter_mut().enumerate() {
            let stands = down[i / 2];
            if stands && !truth.stands[i] {
                let (x, y) = (if i % 2 == 0 { -0.07 } else { 0.11 }, if i < 2 { 0.1 } else { -0.1 });
                truth.points[i] = truth.position + truth.rotation * Vector3::new(0.1 + x, y, -0.8);
            }
            truth.stands[i] = stands;
            let place = truth.rotation.transpose() * (truth.points[i] - truth.position);
            *contact = Contact { stands, point: place + normals(&mut rng, NOISE.kinematics) };
        }
        filter.correct(&contacts);

        if step % 100 == 99 {
            let xi = error(&filter, &truth);
            let standing: Vec<usize> = (0..ERROR)
                .filter(|&row| !(POINTS..GYRO_BIAS).contains(&row) || filter.stands[(row - POINTS) / 3])
                .collect();
            let covariance = nalgebra::DMatrix::from_fn(standing.len(), standing.len(), |r, c| {
                filter.covariance[(standing[r], standing[c])]
            });
            let part = nalgebra::DVector::from_fn(standing.len(), |r, _| xi[standing[r]]);
            squares[0] += part.dot(&covariance.cholesky().unwrap().solve(&part)) / standing.len() as f64;
            samples[0] += 1.0;
            // Velocity alone.
            let block = filter.covariance.fixed_view::<3, 3>(VELOCITY, VELOCITY).into_owned();
            let part = Vector3::from(xi.fixed_rows::<3>(VELOCITY));
            squares[1] += part.dot(&(block.try_inverse().unwrap() * part)) / 3.0;
            samples[1] += 1.0;
        }
        if time > 2.0 {
            velocity += (filter.velocity - truth.velocity).norm_squared();
        }
    }
    let drift = (filter.position - truth.position).xy().norm() / truth.position.xy().norm();
    ([squares[0] / samples[0], squares[1] / samples[1]], (velocity / (steps as f64 - 2.0 / PERIOD)).sqrt(), drift)
}

/// Mean NEES a degree of freedom is 1 for a consistent filter; over 24 walks its mean scatters by less than 0.1 (the whole error
/// has 21 to 27 degrees of freedom, which change slowly).
#[test]
fn is_consistent_over_random_walks() {
    let walks: Vec<_> = (0..24).map(|seed| walk(seed, 6.0)).collect();
    type Walk = ([f64; 2], f64, f64);
    let mean = |f: &dyn Fn(&Walk) -> f64| walks.iter().map(f).sum::<f64>() / walks.len() as f64;
    let (whole, of_velocity) = (mean(&|w| w.0[0]), mean(&|w| w.0[1]));
    let velocity = mean(&|w| w.1 * w.1).sqrt();
    println!(
        "NEES {whole:.3}, of velocity {of_velocity:.3}; velocity {velocity:.4} m/s RMS; drift {:.4}",
        mean(&|w| w.2)
    );
    assert!((0.8..1.25).contains(&whole), "{whole}");
    assert!((0.7..1.4).contains(&of_velocity), "{of_velocity}");
    assert!(velocity < 0.05, "{velocity}");
}

#[test]
fn finds_the_biases_of_a_robot_that_stands() {
    let gyro_bias = Vector3::new(0.01, -0.02, 0.005);
    let mut filter = ContactEkf::new(NOISE, Matrix3::identity(), Vector3::zeros(), Vector3::z() * 0.8, SPREAD);
    let contacts = std::array::from_fn(|i| Contact {
        stands: true,
        point: Vector3::new(0.18 * (i % 2) as f64 - 0.07, if i < 2 { 0.1 } else { -0.1 }, -0.8),
    });
    filter.correct(&contacts);
    for _ in 0..5000 {
        filter.propagate(&gyro_bias, &Vector3::new(0.0, 0.0, crate::settings::GRAVITY), PERIOD);
        filter.correct(&contacts);
    }
    // Gravity shows roll and pitch; about the vertical only the feet do, which creep.
    let off = filter.gyro_bias - gyro_bias;
    assert!(off.xy().amax() < 5e-4 && off.z.abs() < 2e-3, "{off:?}");
    assert!(filter.velocity.norm() < 1e-3 && (filter.position.z - 0.8).abs() < 1e-2);
}

#[test]
fn a_rest_finds_the_bias_about_the_vertical_and_tells_how_well() {
    let gyro_bias = Vector3::new(0.003, -0.004, 0.006);
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let mut squares = 0.0;
    for _ in 0..40 {
        let mut filter = ContactEkf::new(NOISE, Matrix3::identity(), Vector3::zeros(), Vector3::z(), SPREAD);
        for _ in 0..500 {
            let gyro = gyro_bias + normals(&mut rng, NOISE.gyro / PERIOD.sqrt());
            filter.propagate(&gyro, &Vector3::new(0.0, 0.0, crate::settings::GRAVITY), PERIOD);
            filter.rest(&gyro, 0.0, PERIOD);
        }
        let spread = filter.covariance()[(GYRO_BIAS + 2, GYRO_BIAS + 2)].sqrt();
        squares += ((filter.gyro_bias.z - gyro_bias.z) / spread).powi(2);
        // A second of white noise of this density, and no more than that.
        assert!((0.5..1.5).contains(&(spread / NOISE.gyro)), "{spread}");
    }
    assert!((0.6..1.5).contains(&(squares / 40.0)), "{squares}");
}

#[test]
fn a_wrong_sign_of_the_correction_would_be_seen() {
    let mut filter = moving();
    let truth = filter.clone();
    let mut xi = SVector::<f64, ERROR>::zeros();
    xi[VELOCITY] = 0.05;
    filter.retract(&xi);
    let before = (filter.velocity - truth.velocity).norm();
    let mut still = truth.clone();
    let force = truth.rotation.transpose() * -truth.gravity;
    for _ in 0..200 {
        still.propagate(&Vector3::zeros(), &force, PERIOD);
        filter.propagate(&Vector3::zeros(), &force, PERIOD);
        let contacts = std::array::from_fn(|i| Contact {
            stands: true,
            point: still.rotation.transpose() * (truth.points[i] - still.position),
        });
        filter.correct(&contacts);
    }
    assert!((filter.velocity - still.velocity).norm() < 0.2 * before);
}
