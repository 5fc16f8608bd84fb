//! Settings of the kinodynamic stage, with the paper's symbols.

use serde::{Deserialize, Serialize};

use super::height_map::HeightMap;
use crate::RetargetError;

/// Weights of the costs (3), (4) and (6); each is summed over the nodes and multiplied by the time between them, so
/// that results hardly depend on the rate. Only ratios matter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct KinodynamicWeights {
    /// Q_m of (3), as a factor on the kinematic stage's weights of the keypoints; 1/m^2 there. Larger stays closer to
    /// the human.
    pub q_m: f64,
    /// Distance of every coordinate from the kinematic stage's, 1/rad^2 and 1/m^2: for what no keypoint sees.
    pub q_posture: f64,
    /// Q_v of (6), s^2/rad^2, outside the swing only. Larger is calmer.
    pub q_v: f64,
    /// Q_h of (6), for the angular momentum about the centre of mass, s^2/(kg m^2)^2.
    pub q_h: f64,
    /// Q_f of (6), for contact forces as shares of the weight m g. Larger shares the load more evenly.
    pub q_f: f64,
    /// Q_i of (4), for the kicking foot's velocity along x (the kick), y and z, s^2/m^2. Larger kicks harder.
    pub q_i: [f64; 3],
    /// Distance of the striking point, at the impact, from the place that it has to the ball in the kinematic stage,
    /// 1/m^2. Larger meets the ball more exactly where it lies.
    pub q_ball: f64,
    /// For the square of the foot's missing speed along x at the impact, s^2/m^2, where `foot_speed` is set.
    pub q_target: f64,
    /// Joint and base acceleration, s^4/rad^2; not in the paper. Larger is smoother.
    pub q_a: f64,
    /// Joint and base jerk, s^6/rad^2; not in the paper. Larger is smoother, and what holds at the nodes holds better
    /// between them; much larger blunts the kick.
    pub q_j: f64,
    /// Joint torques as shares of their limits; not in the paper. Larger keeps away from the limits and costs time.
    pub q_tau: f64,
}

impl Default for KinodynamicWeights {
    fn default() -> Self {
        Self {
            q_m: 1.0,
            q_posture: 0.05,
            q_v: 1e-5,
            q_h: 1e-4,
            q_f: 1e-3,
            q_i: [0.04, 0.0, 0.0],
            q_ball: 100.0,
            q_target: 1.0,
            q_a: 2e-8,
            q_j: 5e-9,
            q_tau: 0.0,
        }
    }
}

/// How the kinodynamic stage is solved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct KinodynamicSettings {
    /// Nodes of the spline a second; 30 to 240. The reference has twice as many knots. The paper has 30, which cannot
    /// show what happens inside a swing of 0.1 s: see the module's documentation.
    pub rate: f64,
    /// Factor on all times of the clip: 1.2 is a kick slowed down by a fifth. 0.5 to 4.
    pub time_scale: f64,
    /// Where the ball lies, from the place where the clip's own kick meets it, m; x along the clip's kick, y to its
    /// left. -0.5 to 0.5 each.
    pub ball: [f64; 2],
    /// Direction of the kick, from that of the clip's own to the left, rad; the way of the run-up stays, so that the
    /// approach angle changes by as much, within its range. -1 to 1.
    pub aim: f64,
    /// Weights of the costs.
    pub weights: KinodynamicWeights,
    /// A foot that leaves the ground for less than this goes on standing, s; 0 to 0.3. Short gaps come from the contact
    /// detection more often than from the human.
    pub min_gap: f64,
    /// Coefficient of friction of the cone (10), 0.1 to 2. The cone is the pyramid inside of it.
    pub friction: f64,
    /// The ground's height, gamma_gnd of (12) and (13). The kinematic stage knows level ground only: what it hands over is
    /// raised, each point by the height of the ground below it, and the ball by that below the ball.
    pub ground: HeightMap,
    /// Least and greatest approach angle of (20), rad.
    pub approach_angle: [f64; 2],
    /// Foot speed along x that is asked for at the impact, m/s; none asks for as much as Q_i is worth.
    pub foot_speed: Option<f64>,
    /// Share of each torque limit that is kept free, 0 to 0.5: what the motion between the nodes and the controller's
    /// corrections may use.
    pub torque_margin: f64,
    /// Share of each speed limit that is kept free, 0 to 0.5.
    pub speed_margin: f64,
    /// Part of each joint's range that is kept free at both ends, rad.
    pub joint_margin: f64,
    /// Gap that capsules keep at the nodes (14), m; 0 to 0.05. Between the nodes a fast limb comes a little closer.
    pub clearance: f64,
    /// Gap that contact points in the air keep to the ground at the nodes (13), m; 0 to 0.05. Between the nodes a
    /// swinging foot comes a little closer.
    pub ground_clearance: f64,
    /// Most Newton steps over all.
    pub iterations: usize,
    /// Most rounds of multipliers.
    pub rounds: usize,
    /// Worst violation at which the problem counts as solved, in the units of
    /// [`super::Kinodynamic::violations`].
    pub tolerance: f64,
}

impl Default for KinodynamicSettings {
    fn default() -> Self {
        Self {
            rate: 180.0,
            time_scale: 1.0,
            ball: [0.0; 2],
            aim: 0.0,
            weights: KinodynamicWeights::default(),
            min_gap: 0.075,
            friction: 0.6,
            ground: HeightMap::default(),
            approach_angle: [24.0_f64.to_radians(), 43.0_f64.to_radians()],
            foot_speed: None,
            torque_margin: 0.08,
            speed_margin: 0.01,
            joint_margin: 0.005,
            clearance: 0.005,
            ground_clearance: 0.003,
            iterations: 300,
            rounds: 40,
            tolerance: 1e-4,
        }
    }
}

impl KinodynamicSettings {
    /// Most nodes a second.
    pub(crate) const MAX_RATE: f64 = 240.0;

    /// Checks every field's range.
    ///
    /// # Errors
    /// When a field is out of its range; the error names it.
    pub fn validate(&self) -> Result<(), RetargetError> {
        let [least, greatest] = self.approach_angle;
        let w = &self.weights;
        let fields = [
            ("rate", self.rate, 30.0, Self::MAX_RATE),
            ("time_scale", self.time_scale, 0.5, 4.0),
            ("ball[0]", self.ball[0], -0.5, 0.5),
            ("ball[1]", self.ball[1], -0.5, 0.5),
            ("aim", self.aim, -1.0, 1.0),
            ("min_gap", self.min_gap, 0.0, 0.3),
            ("friction", self.friction, 0.1, 2.0),
            ("approach_angle[0]", least, 0.0, 1.5),
            ("approach_angle[1]", greatest, least, 1.57),
            ("foot_speed", self.foot_speed.unwrap_or(0.0), 0.0, 40.0),
            ("torque_margin", self.torque_margin, 0.0, 0.5),
            ("speed_margin", self.speed_margin, 0.0, 0.5),
            ("joint_margin", self.joint_margin, 0.0, 0.2),
            ("clearance", self.clearance, 0.0, 0.05),
            ("ground_clearance", self.ground_clearance, 0.0, 0.05),
            ("tolerance", self.tolerance, 1e-8, 1e-1),
            ("weights.q_m", w.q_m, 0.0, 1e6),
            ("weights.q_posture", w.q_posture, 0.0, 1e6),
            ("weights.q_v", w.q_v, 0.0, 1e3),
            ("weights.q_h", w.q_h, 0.0, 1e3),
            ("weights.q_f", w.q_f, 1e-9, 1e3),
            ("weights.q_i[0]", w.q_i[0], 0.0, 1e3),
            ("weights.q_i[1]", w.q_i[1], 0.0, 1e3),
            ("weights.q_i[2]", w.q_i[2], 0.0, 1e3),
            ("weights.q_ball", w.q_ball, 0.0, 1e6),
            ("weights.q_target", w.q_target, 0.0, 1e6),
            ("weights.q_a", w.q_a, 0.0, 1.0),
            ("weights.q_j", w.q_j, 0.0, 1.0),
            ("weights.q_tau", w.q_tau, 0.0, 1e3),
        ];
        for (field, value, least, most) in fields {
            if !(least..=most).contains(&value) {
                return Err(RetargetError::Setting {
                    field: format!("kinodynamic.{field}"),
                    found: value.to_string(),
                    expected: format!("{least} to {most}"),
                });
            }
        }
        self.ground.validate("kinodynamic.ground")?;
        if self.iterations == 0 || self.rounds == 0 {
            return Err(RetargetError::Setting {
                field: "kinodynamic.iterations, kinodynamic.rounds".into(),
                found: "0".into(),
                expected: "at least 1".into(),
            });
        }
        Ok(())
    }
}
