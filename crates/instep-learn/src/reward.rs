//! The rewards of paper 1, equations (34) to (38).

use instep_robot::Joint;
use nalgebra::Vector3;

use crate::settings::RewardSettings;

/// How far a robot is from its reference.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Deviation {
    /// Sum over the key points of their distances, m: the exponent of (35).
    pub keypoints: f64,
    /// Norm of the difference of the joint angles, rad.
    pub joints: f64,
    /// Norm of the difference of the joint speeds, rad/s.
    pub joint_speeds: f64,
    /// Distance of the centres of mass, m.
    pub com: f64,
    /// Mean over the links of their distances, m: the measure of Table II.
    pub links: f64,
    /// The greatest of them, m, and its link: the measure of (39).
    pub farthest: (f64, usize),
}

/// How far the joint speeds `v` (rad/s, n) are beyond the share `from` of their limits: the sum over the joints of the
/// excess, each in shares of its limit.
#[must_use]
pub fn excess_speed(joints: &[Joint], v: &[f64], from: f64) -> f64 {
    joints.iter().zip(v).map(|(joint, v)| (v.abs() / joint.speed - from).max(0.0)).sum()
}

/// Imitation reward (34), between 0 and 1.
#[must_use]
pub fn imitation(settings: &RewardSettings, deviation: &Deviation) -> f64 {
    let s = settings;
    let keypoints = s.w_k * (s.k_k * deviation.keypoints).exp();
    let joints = s.w_q * (s.k_q * deviation.joints).exp() + s.w_v * (s.k_v * deviation.joint_speeds).exp();
    let com = s.w_c * (s.k_c * deviation.com).exp();
    (keypoints + joints + com) / (s.w_k + s.w_q + s.w_v + s.w_c)
}

/// Ball reward (38) for a ball at `velocity` (m/s) that should go along the unit vector `target`; the settings say how
/// it differs from the paper's.
#[must_use]
pub fn ball(settings: &RewardSettings, velocity: &Vector3<f64>, target: &Vector3<f64>) -> f64 {
    let along = velocity.dot(target);
    let up = Vector3::z();
    let across = velocity.dot(&up.cross(target)).abs();
    let speed = (along - settings.ball_across * across).clamp(0.0, settings.ball_cap);
    settings.w_ball * ((speed / settings.ball_scale).exp() - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn perfect_tracking_gives_one_and_each_deviation_takes_away() {
        let settings = RewardSettings::default();
        assert!((imitation(&settings, &Deviation::default()) - 1.0).abs() < 1e-12);
        for deviation in [
            Deviation { keypoints: 0.1, ..Deviation::default() },
            Deviation { joints: 0.1, ..Deviation::default() },
            Deviation { joint_speeds: 0.1, ..Deviation::default() },
            Deviation { com: 0.1, ..Deviation::default() },
        ] {
            assert!(imitation(&settings, &deviation) < 1.0, "{deviation:?}");
        }
    }

    #[test]
    fn only_what_a_joint_is_beyond_its_limit_counts() {
        let robots = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots");
        let robot = instep_robot::Robot::load(&robots.join("nao")).unwrap();
        let mut v: Vec<f64> = robot.joints.iter().map(|joint| -0.94 * joint.speed).collect();
        assert_eq!(excess_speed(&robot.joints, &v, 0.95), 0.0);
        assert!((excess_speed(&robot.joints, &v, 0.84) - 0.1 * v.len() as f64).abs() < 1e-9);
        v[0] = 1.05 * robot.joints[0].speed;
        v[3] = -1.25 * robot.joints[3].speed;
        assert!((excess_speed(&robot.joints, &v, 0.95) - 0.4).abs() < 1e-12);
    }

    #[test]
    fn the_ball_reward_is_equation_38_with_the_papers_numbers() {
        let settings = RewardSettings {
            w_ball: 2.0,
            ball_scale: 1.0,
            ball_cap: 100.0,
            ball_across: 0.0,
            ..RewardSettings::default()
        };
        let forward = Vector3::x();
        let reward = |v: [f64; 3]| ball(&settings, &v.into(), &forward);
        assert_eq!(reward([-3.0, 0.0, 0.0]), 0.0);
        assert!((reward([2.0, 5.0, 1.0]) - 2.0 * (2.0f64.exp() - 1.0)).abs() < 1e-12);
    }
}
