//! The kinodynamic stage: from a kinematic reference to a motion that the robot can really do (paper 1, section
//! II-A.2, equations 1-33).
//!
//! # The problem, and what of the paper's is a variable here
//!
//! The paper's variables are r, r', h, q, v, c_i and f_i at every knot, tied by integration (21)-(24), centroidal
//! dynamics (1), (2) and consistency (7)-(9). Here q and f alone are variables; the others follow from them exactly:
//!
//! - q(t) is a uniform cubic B-spline ([`transcription`]), so v and the acceleration are its derivatives, at the nodes
//!   and between them: (21)-(24) hold without a row.
//! - r = phi_COM(q), h = A_CAM(q) v, c_i = phi_ci(q) are functions of q and v: (7)-(9) hold without a row.
//! - Then (1) and (2) say that the rate of momentum, as the motion has it, is what gravity and contact forces give.
//!   That is the same as: the six unactuated rows of M(q) q'' + h(q, v) - sum J_i^T f_i are zero ([`base_dynamics`]).
//!   Those rows are the rates of linear momentum and of angular momentum about the base, less the outer wrench; the
//!   step from there to the centre of mass is an invertible linear map of the six rows. So the root wrench of (33) is
//!   the residual of (1) and (2) itself.
//! - Torques (15), (18) are the other rows of the same expression ([`torque`]): the whole of (33), not its estimate,
//!   so that no round of "verify and optimise again" is left over.
//!
//! r, h, f, torques and the contact schedule are all in the resulting reference.
//!
//! The paper's 30 knots a second cannot show what happens in a swing of a tenth of a second; between such knots the
//! root wrench would be several percent of the weight. The default is 180 nodes a second; the reference has a knot at
//! every node and one half-way to the next. Where (33) finds that the wrench between the nodes is still more than a
//! hundredth of the weight, the problem is solved once more on nodes a third denser, from where the first ended. Doing
//! the same for other small failures was tried and mended none (CMU 10_06).
//!
//! | equation | file | |
//! |---|---|---|
//! | (1) (2) (7) (8) | [`base_dynamics`] | six rows a node |
//! | (3) | [`tracking`] | keypoints and posture |
//! | (4) (5) | [`strike`] | foot speed in the swing |
//! | (6) | [`regularisation`] | speeds, angular momentum, forces |
//! | (9) (11) (12) | [`contact`] | independent rows; gamma_gnd in [`height_map`] |
//! | (10) | [`friction`] | four rays about the ground's normal |
//! | (13) | [`ground`] | |
//! | (14) | [`collision`] | capsules |
//! | (15) (18) | [`torque`] | with the torque-speed law of the drives |
//! | (16) (17) | [`limits`] | at every instant |
//! | (19) | [`ankle_lock`] | at every instant of its time |
//! | (20) | [`approach`] | |
//! | (21)-(24) | [`transcription`] | exact |
//! | (33) | [`verify`] | MuJoCo, at 200 Hz |
//!
//! The ground is a height map ([`HeightMap`]); the kinematic stage before knows level ground only, so the motion is raised
//! onto the map and starts with its feet level. The map is not in the reference, and who plays a reference on a level
//! pitch should have made it for one.
//!
//! Not done: the impact with the ball; a foot that stands across an edge of the ground; sums over several clips.

mod ankle_lock;
mod approach;
mod assemble;
mod base_dynamics;
mod collision;
mod contact;
mod friction;
mod ground;
mod height_map;
mod inverse_dynamics;
mod limits;
mod local;
mod node;
mod plan;
mod regularisation;
mod settings;
mod smoothness;
mod solver;
mod strike;
mod terms;
#[cfg(test)]
mod tests;
mod torque;
mod tracking;
mod transcription;
mod tree;
pub mod verify;

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};

use instep_motion::reference::{Reference, ReferenceKind};
use instep_robot::Robot;
use serde::Serialize;

use crate::RetargetError;
use crate::kinematic::{Retargeted, Weights};
use plan::Plan;
use solver::{End, Solver};
use terms::Family;
use transcription::Unknowns;
use verify::{VERIFY_RATE, Verification, verify};

pub use height_map::HeightMap;
pub use settings::{KinodynamicSettings, KinodynamicWeights};

/// What the stage is at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Work {
    /// Taking Newton steps.
    Optimisation,
    /// Checking by full inverse dynamics, (33).
    Verification,
}

/// How far the stage has come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// What it is at.
    pub work: Work,
    /// Newton steps done.
    pub iteration: usize,
    /// Most steps.
    pub iterations: usize,
    /// Round of multipliers, from 0.
    pub round: usize,
    /// Costs (3), (4) and (6), without penalties.
    pub cost: f64,
    /// Worst violation, in the units of [`Kinodynamic::violations`].
    pub violation: f64,
    /// Its family.
    pub family: &'static str,
}

/// How the stage ended.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Status {
    /// Every violation within the tolerance, and nothing found by (33).
    Solved,
    /// No violation above ten times the tolerance.
    SolvedLoosely {
        /// The worst family.
        family: &'static str,
        /// By how much it is violated.
        by: f64,
    },
    /// The robot cannot do it, as far as the solver can tell.
    Infeasible {
        /// The worst family.
        family: &'static str,
        /// First knots of the reference, at most ten, at which it is violated.
        knots: Vec<usize>,
        /// By how much.
        by: f64,
    },
    /// Out of iterations before the violations were small; the best motion is returned.
    OutOfIterations {
        /// The worst family.
        family: &'static str,
        /// By how much it is violated.
        by: f64,
    },
    /// The nodes keep every limit, but (33) found more than it may between them.
    Unverified {
        /// What was found; a field of [`Verification`].
        family: &'static str,
        /// By how much.
        by: f64,
    },
    /// Stopped by the caller; the best motion is returned.
    Stopped,
}

impl Status {
    /// Whether the robot can do the motion, as far as the laws and limits go that were asked for.
    #[must_use]
    pub fn feasible(&self) -> bool {
        matches!(self, Self::Solved | Self::SolvedLoosely { .. })
    }

    /// Whether finer nodes are likely to mend it: all that is left is a wrench between the nodes.
    fn is_coarse(&self) -> bool {
        matches!(self, Self::Unverified { family: "root_wrench_residual", .. })
    }

    /// Whether it is a better end than `other`, which is not feasible.
    fn beats(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Unverified { family, by }, Self::Unverified { family: same, by: before }) => {
                family == same && by < before
            }
            _ => self.feasible(),
        }
    }
}

/// A limit that the motion touches.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Binding {
    /// `torque` or `speed`.
    pub limit: &'static str,
    /// The joint.
    pub joint: String,
    /// Most that was used, as a share of the limit.
    pub share: f64,
}

/// A motion that the robot can do, or the best that was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Kinodynamic {
    /// The motion, with forces, torques, centre of mass and momentum.
    pub reference: Reference,
    /// How it ended.
    pub status: Status,
    /// Worst violation of each family at the knots: `base_dynamics` and `friction` as shares of m g, `contact`,
    /// `penetration` and `self_collision` in m, `contact_speed` in 0.1 m/s, `torque`, `joint_speed` and `ankle_lock` as
    /// shares of the limit, `joint_limit` and `approach_angle` in rad. Against the real limits, margins not counted.
    pub violations: BTreeMap<&'static str, f64>,
    /// Newton steps.
    pub iterations: usize,
    /// Cost at the end.
    pub cost: f64,
    /// What (33) says between the knots.
    pub verification: Verification,
    /// Speed of the kicking foot at the impact, m/s, at the middle of its striking geom.
    pub foot_speed_at_impact: f64,
    /// The same of the kinematic reference.
    pub kinematic_foot_speed: f64,
    /// Factor on the clip's times.
    pub time_scale: f64,
    /// Distance of the striking point, at the impact, from where it belongs behind the ball, m.
    pub ball_miss: f64,
    /// By how much the motion was turned about the ball for the approach angle, rad.
    pub aim_turn: f64,
    /// Approach angle (20), rad.
    pub approach_angle: f64,
    /// Limits that are used up, less their margins, the most used first.
    pub binding: Vec<Binding>,
    /// Those that are used up from the start of the swing to the impact: what the foot's speed ends at.
    pub swing_binding: Vec<Binding>,
}

/// How much finer the nodes are in a second optimisation.
const REFINEMENT: f64 = 4.0 / 3.0;

/// What a second optimisation starts from.
struct Ended {
    x: Unknowns,
    settings: KinodynamicSettings,
}

/// Optimises the motion of `start`, the kinematic stage's result. `weights` are that stage's, of which (3) uses the
/// keypoints'. Progress is told after every step; setting `stop` ends the stage with the best motion so far.
///
/// # Errors
/// When a setting is out of its range or the clip does not fit: too short, or a pelvis that pitches too far.
pub fn optimize(
    robot: &Robot,
    start: &Retargeted,
    weights: &Weights,
    settings: &KinodynamicSettings,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(Progress),
) -> Result<Kinodynamic, RetargetError> {
    settings.validate()?;
    let (mut first, ended) = solve(robot, start, weights, settings, None, stop, progress)?;
    let rate = (settings.rate * REFINEMENT).min(KinodynamicSettings::MAX_RATE);
    if !first.status.is_coarse() || rate <= settings.rate || stop.load(Ordering::Relaxed) {
        return Ok(first);
    }
    let finer = KinodynamicSettings { rate, ..settings.clone() };
    let (mut second, _) = solve(robot, start, weights, &finer, Some(&ended), stop, progress)?;
    let iterations = first.iterations + second.iterations;
    (first.iterations, second.iterations) = (iterations, iterations);
    second.kinematic_foot_speed = first.kinematic_foot_speed;
    Ok(if second.status.beats(&first.status) { second } else { first })
}

/// One optimisation with its verification. It starts from another's end or, without one, from the kinematic stage.
fn solve(
    robot: &Robot,
    start: &Retargeted,
    weights: &Weights,
    settings: &KinodynamicSettings,
    from: Option<&Ended>,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(Progress),
) -> Result<(Kinodynamic, Ended), RetargetError> {
    let mut plan = Plan::new(robot, start, weights, settings)?;
    let x = match from {
        None => Unknowns::guess(&plan),
        Some(ended) => {
            let old = Plan::new(robot, start, weights, &ended.settings)?;
            ended.x.resampled(&old, &plan)
        }
    };
    let mut solver = Solver::new(&mut plan, x);
    let kinematic_foot_speed = assemble::foot_speed(&solver);
    let end = solver.run(stop, progress);
    let worst = solver.violations(false);
    let violations = assemble::violations(&solver, &worst);
    let (family, by) = most(&violations);
    progress(Progress {
        work: Work::Verification,
        iteration: solver.iterations,
        iterations: settings.iterations,
        round: solver.round,
        cost: solver.cost,
        violation: by,
        family,
    });
    let mut reference = assemble::reference(&solver, start);
    let verification = verify(robot, &reference, VERIFY_RATE, settings.friction, &settings.ground);
    let status = status(&mut solver, end, &violations, &verification);
    if !status.feasible() {
        reference.kind = ReferenceKind::Infeasible;
    }
    let approach_angle = assemble::approach_angle(&solver);
    let foot_speed_at_impact = assemble::foot_speed(&solver);
    let done = Kinodynamic {
        reference,
        status,
        violations,
        iterations: solver.iterations,
        cost: solver.cost,
        binding: binding(&verification.torque_use, &verification.speed_use, settings),
        swing_binding: binding(&verification.swing_torque_use, &verification.swing_speed_use, settings),
        verification,
        foot_speed_at_impact,
        kinematic_foot_speed,
        time_scale: settings.time_scale,
        ball_miss: assemble::ball_miss(&solver),
        aim_turn: solver.plan.aim_turn,
        approach_angle,
    };
    Ok((done, Ended { x: solver.x.clone(), settings: settings.clone() }))
}

/// The worst family and by how much it is violated.
fn most(violations: &BTreeMap<&'static str, f64>) -> (&'static str, f64) {
    let all = violations.iter().map(|(f, v)| (*f, *v));
    all.fold((Family::ALL[0].name(), 0.0), |a, b| if b.1 > a.1 || b.1.is_nan() { b } else { a })
}

fn status(
    solver: &mut Solver,
    end: End,
    violations: &BTreeMap<&'static str, f64>,
    verification: &Verification,
) -> Status {
    let tolerance = solver.plan.settings.tolerance;
    let (family, by) = most(violations);
    match end {
        // A stop that comes after the last step changes nothing.
        End::Stopped if by > tolerance => Status::Stopped,
        _ if by <= 10.0 * tolerance => match verification.fault() {
            Some((family, by)) => Status::Unverified { family, by },
            None if by <= tolerance => Status::Solved,
            None => Status::SolvedLoosely { family, by },
        },
        End::Iterations => Status::OutOfIterations { family, by },
        _ => Status::Infeasible { family, knots: assemble::violated(solver, family), by },
    }
}

/// Share of what a margin leaves of a limit from which on it binds.
const BINDS: f64 = 0.97;

/// Limits that are nearly or wholly used.
fn binding(
    torques: &BTreeMap<String, f64>,
    speeds: &BTreeMap<String, f64>,
    settings: &KinodynamicSettings,
) -> Vec<Binding> {
    let of = |limit: &'static str, uses: &BTreeMap<String, f64>, margin: f64| {
        uses.iter()
            .filter(|(_, share)| **share >= BINDS * (1.0 - margin))
            .map(|(joint, share)| Binding { limit, joint: joint.clone(), share: *share })
            .collect::<Vec<_>>()
    };
    let mut all = of("torque", torques, settings.torque_margin);
    all.extend(of("speed", speeds, settings.speed_margin));
    all.sort_by(|a, b| b.share.total_cmp(&a.share));
    all
}
