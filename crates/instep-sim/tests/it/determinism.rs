//! The same trial and seed give the same bytes, twice and on any number of threads.

use instep_robot::control::{Controller, JointCommand, Sensors};
use instep_sim::BallState;
use instep_sim::settings::{SensorNoise, WorldSettings};
use instep_sim::trial::{Trial, TrialSettings, run};
use rayon::prelude::*;

use crate::robot;

/// Swings the right leg, which is already moving, at the ball, disturbed by what the noisy sensors say.
struct Swing {
    stand: Vec<f64>,
    hip: usize,
    knee: usize,
}

impl Controller for Swing {
    fn tick(&mut self, sensors: &Sensors, command: &mut JointCommand) {
        command.positions.copy_from_slice(&self.stand);
        command.positions[self.hip] += -1.2 + 0.1 * sensors.gyro[0];
        command.positions[self.knee] += 0.2;
    }
}

fn trial(seed: u64) -> Trial {
    let robot = robot("prestoe");
    let leg = &robot.legs[1];
    let mut v = vec![0.0; robot.nv()];
    v[6 + leg.hip_pitch] = -6.0;
    let settings = TrialSettings {
        world: WorldSettings {
            sensors: SensorNoise { gyro: 0.1, joint_position: 0.01, delay: 0.006, ..SensorNoise::default() },
            ..WorldSettings::default()
        },
        seed,
        duration: 0.8,
        control_period: 0.01,
        q: robot.stand.clone(),
        v,
        ball: BallState::at_rest([0.30, -0.085, 0.11]),
        direction: 0.0,
    };
    let swing = || Swing { stand: robot.stand[7..].to_vec(), hip: leg.hip_pitch, knee: leg.knee };
    run(&robot, &settings, &mut swing(), &mut swing()).unwrap()
}

#[test]
fn same_seed_same_bytes_on_one_thread_and_on_two() {
    let serial: Vec<Trial> = (0..6).map(trial).collect();
    let again: Vec<Trial> = (0..6).map(trial).collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let parallel: Vec<Trial> = pool.install(|| (0..6).into_par_iter().map(trial).collect());
    for ((a, b), c) in serial.iter().zip(&again).zip(&parallel) {
        let bits = |t: &Trial| t.record.q.iter().chain(&t.record.v).map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(a), bits(b));
        assert_eq!(bits(a), bits(c));
        assert_eq!(a, b);
        assert_eq!(a, c);
    }
    assert_ne!(serial[0].record.q, serial[1].record.q, "another seed draws other noise");
    // The swing does hit: otherwise nothing of the impact was compared.
    let impact = serial[0].impact.as_ref().expect("the ball was hit");
    assert!(serial[0].audit.faults.is_empty(), "{:?} {impact:?}", serial[0].audit);
}
