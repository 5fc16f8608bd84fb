//! Whether a robot can do what is planned: single poses by inverse kinematics, and a whole motion with joint speeds, motor
//! torques (by inverse dynamics), gaps between parts of the robot, and the centre of pressure in the support foot.

use instep_motion::phase::Side;
use instep_robot::Robot;
use nalgebra::{Vector2, Vector3};

use crate::engine::Phase;
use crate::request::{Place, Refusal};
use crate::whole_body::body::Body;
use crate::whole_body::foot::Foot;
use crate::whole_body::motion::{Manner, Motion};
use crate::whole_body::settings::Limits;
use crate::whole_body::torque::Dynamics;
use instep_robot::ik::{Goals, Ik, Residual};
use instep_robot::tree::TreePose;

/// Steps of inverse kinematics to a place that is far from the last.
pub(crate) const FAR: usize = 12;
/// The same to a place a hand's breadth away.
pub(crate) const MIDDLE: usize = 6;
/// The same to a place near the last.
pub(crate) const NEAR: usize = 3;
/// The same along a way that is sampled densely.
pub(crate) const WAY: usize = 2;
/// Time constant with which the planned centre of pressure is smoothed before it is held against the foot, s: to tip takes
/// about sqrt(h / g), so what is over sooner does not count in full.
pub(crate) const TIPPING: f64 = 0.04;
/// Sampling of the forecast, s: in the strike, and elsewhere.
const FINE: f64 = 0.016;
const COARSE: f64 = 0.03;
/// Least gap between ball and swing leg before the strike, m.
const UNTOUCHED: f64 = 0.002;
/// Weight of the swing foot's roll in a miss, m/rad, where it counts.
pub(crate) const ROLL: f64 = 0.03;

/// Distance that a residual counts as, m: 1 rad is 0.1 m, 1 rad of the foot's roll `roll` (m).
pub(crate) fn miss(residual: &Residual, roll: f64) -> f64 {
    residual.position + 0.1 * residual.orientation + roll * residual.roll + 0.5 * residual.balance
}

/// Whether a pose that inverse kinematics has left at `gap` (m, see [`miss`]) from `place` reaches it, and no parts touch.
///
/// # Errors
/// What is in the way.
pub(crate) fn judge(
    body: &Body,
    limits: &Limits,
    pose: &TreePose,
    foot: Side,
    place: Place,
    gap: f64,
) -> Result<(), Refusal> {
    // Written so that a NaN fails.
    if !matches!(gap.partial_cmp(&limits.reach), Some(o) if o.is_le()) {
        return Err(Refusal::Unreachable { foot, place, gap });
    }
    let (gap, pair) = body.tree.least_gap(pose);
    if gap < limits.clearance {
        return Err(Refusal::SelfCollision { foot, pair, gap });
    }
    Ok(())
}

/// How far a centre of pressure (m) is outside the support foot's outline less the margin `edge` (m); below zero inside.
pub(crate) fn outside(zmp: [f64; 2], foot: &Foot, edge: f64) -> f64 {
    [(zmp[0], foot.stand_x), (zmp[1], foot.stand_y)]
        .map(|(p, [low, high])| (low + edge - p).max(p - high + edge))
        .into_iter()
        .fold(f64::NEG_INFINITY, f64::max)
}

/// Height of the swing foot's lowest point over the support sole's plane, m.
pub(crate) fn ground_gap(body: &Body, pose: &TreePose, swing: Side) -> f64 {
    let sole = &body.robot.leg(swing.other()).sole;
    let up = pose.rotation[sole.link] * Vector3::z();
    let origin = pose.point(sole);
    let points = body.robot.contacts.iter().filter(|contact| contact.leg == swing);
    points.map(|contact| up.dot(&(pose.point(&contact.at) - origin)) - contact.radius).fold(f64::INFINITY, f64::min)
}

/// The joint that goes the farthest share of its speed limit from angles to others within `time` (s), and that share.
pub(crate) fn fastest(
    robot: &Robot,
    joints: impl Iterator<Item = usize>,
    from: &[f64],
    to: &[f64],
    time: f64,
) -> (f64, usize) {
    joints
        .map(|j| ((to[j] - from[j]).abs() / time / robot.joints[j].speed, j))
        .fold((0.0, 0), |most, next| if next.0 > most.0 { next } else { most })
}

/// Refuses a ball (m, footprint frame) for which no kinematics is needed: too far, between the feet, or behind them
/// unless the heel kicks.
///
/// # Errors
/// The cause.
pub(crate) fn check_place(body: &Body, ball: [f64; 2], heel: bool) -> Result<(), Refusal> {
    let distance = ball[0].hypot(ball[1]);
    let reach = body.leg_length + body.feet[0].outline_x[1] + body.ball.radius;
    if distance > reach {
        return Err(Refusal::TooFar { distance, reach });
    }
    // The rectangle of both feet and what is between them.
    let [left, right] = &body.feet;
    let y = [right.outline_y[0] - body.half_width, left.outline_y[1] + body.half_width];
    let x = left.outline_x;
    let outside = |value: f64, [low, high]: [f64; 2]| (low - value).max(value - high).max(0.0);
    let gap = outside(ball[0], x).hypot(outside(ball[1], y)) - body.ball.radius;
    let least = -0.25 * body.ball.radius;
    if gap < least {
        return Err(Refusal::BallUnderRobot { gap, least });
    }
    if ball[0] < x[0] && !heel {
        return Err(Refusal::BallBehind { x: ball[0], least: x[0] });
    }
    Ok(())
}

/// The refusal that tells more: what came nearest to being possible.
pub(crate) fn graver(old: Option<Refusal>, new: Refusal) -> Refusal {
    let rank = |r: &Refusal| match r {
        Refusal::Unreachable { place: Place::Contact, gap, .. } => -gap.min(10.0),
        Refusal::Unreachable { gap, .. } => 1.0 - gap.min(0.9),
        Refusal::SelfCollision { .. } | Refusal::HitsGround { .. } | Refusal::BrushesBall { .. } => 2.0,
        Refusal::OffBalance { .. } | Refusal::TooHeavy { .. } => 3.0,
        Refusal::TooFast { share, .. } => 5.0 - (share / 100.0).min(0.9),
        Refusal::TooStrong { asked, most, .. } => 5.0 - (asked / most / 100.0).min(0.9),
        _ => 9.0,
    };
    match old {
        Some(old) if rank(&old) >= rank(&new) => old,
        _ => new,
    }
}

/// What a forecast asks for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Demands<'a> {
    pub(crate) limits: &'a Limits,
    /// Foot speed at the contact, m/s: for the refusal.
    pub(crate) foot_speed: f64,
    /// Largest speed of a joint between samples, in units of that in the limits: until the contact and after it, each
    /// outside the strike and in it.
    pub(crate) calm: [[f64; 2]; 2],
    /// Weight of the foot's roll in a miss, m/rad.
    pub(crate) roll: f64,
    /// Least height of any point of the swing foot over the ground, m.
    pub(crate) ground: f64,
    /// A ball at rest in the support sole's frame, m: it may not be touched before the strike.
    pub(crate) ball: Option<Vector2<f64>>,
}

/// Scratch space in which poses and motions are tried.
#[derive(Debug)]
pub(crate) struct Rehearsal {
    pub(crate) ik: Ik,
    pub(crate) pose: TreePose,
    pub(crate) angles: Vec<f64>,
    pub(crate) saved: Vec<f64>,
    /// Joint angles with the left or right foot lifted over its place.
    lifted: [Vec<f64>; 2],
    pub(crate) dynamics: Dynamics,
}

impl Rehearsal {
    pub(crate) fn new(body: &Body, manner: &Manner<'_>, mut ik: Ik, dynamics: Dynamics) -> Self {
        let mut pose = body.tree.pose();
        let lifted = [Side::Left, Side::Right].map(|swing| {
            let mut angles = body.angles.clone();
            body.set_arms(1.0, &mut angles);
            ik.solve(&body.tree, &mut pose, &mut angles, swing, &manner.lifted_goals(body, swing), 30);
            angles
        });
        Self { ik, pose, angles: body.angles.clone(), saved: body.angles.clone(), lifted, dynamics }
    }

    /// Starts with the foot of `swing` lifted over its place.
    pub(crate) fn lift(&mut self, swing: Side) {
        self.angles.copy_from_slice(&self.lifted[swing as usize]);
    }

    /// The joint that goes the farthest share of its speed limit from the lifted foot to the present angles in `time` (s).
    pub(crate) fn haste_from_lift(&self, body: &Body, swing: Side, time: f64) -> (f64, usize) {
        fastest(&body.robot, self.ik.joints(), &self.lifted[swing as usize], &self.angles, time)
    }

    /// Goes to `goals` by at most `steps` of inverse kinematics; gives how far it misses them, m.
    pub(crate) fn go(&mut self, body: &Body, swing: Side, goals: &Goals, steps: usize, roll: f64) -> f64 {
        miss(&self.ik.solve(&body.tree, &mut self.pose, &mut self.angles, swing, goals, steps), roll)
    }

    /// Distance of the present angles from the nearest joint limit, rad.
    pub(crate) fn limit_margin(&self, body: &Body) -> f64 {
        self.ik
            .joints()
            .map(|j| {
                let [low, high] = body.robot.joints[j].range;
                (self.angles[j] - low).min(high - self.angles[j])
            })
            .fold(f64::INFINITY, f64::min)
    }

    /// The largest share of a motor's torque that holding the pose with `angles` takes, and its joint.
    pub(crate) fn load(&mut self, body: &Body, swing: Side, angles: &[f64], pose: &TreePose) -> (f64, usize) {
        self.dynamics.fill(body, swing.other(), angles, pose);
        self.dynamics.solve(body, swing, pose, FINE, false);
        let [_, torque] = self.dynamics.shares(&body.robot);
        torque
    }

    /// Follows a motion from the lifted foot to the way back.
    ///
    /// # Errors
    /// What is beyond its limit, and whether it is so in the strike.
    pub(crate) fn forecast(
        &mut self,
        body: &Body,
        motion: &Motion,
        demands: &Demands<'_>,
    ) -> Result<(), (Refusal, bool)> {
        let (swing, support) = (motion.swing, motion.swing.other());
        let Demands { limits, foot_speed: asked, .. } = *demands;
        self.lift(swing);
        let at = |phase| motion.timeline.end_of(phase);
        let (start, end) = (at(Phase::Raise), at(Phase::MoveBack));
        let contact = motion.contact.unwrap_or(end);
        let strike = [at(Phase::WindUp) - 2.0 * FINE, at(Phase::Kick) + FINE];
        let foot = &body.feet[support as usize];
        let mut time = start;
        let mut fine = 0;
        let mut zmp = [0.0; 2];
        let mut last: Option<f64> = None;
        while time < end {
            let quick = (strike[0]..strike[1]).contains(&time);
            let refused = |cause| Err((cause, quick));
            let too_fast = |(share, joint)| Err((Refusal::TooFast { foot: swing, asked, share, joint }, quick));
            let gap = self.go(body, swing, &motion.goals(time), WAY, demands.roll);
            judge(body, limits, &self.pose, swing, Place::Way, gap).or_else(refused)?;
            let gap = ground_gap(body, &self.pose, swing);
            if gap < demands.ground {
                return refused(Refusal::HitsGround { foot: swing, gap });
            }
            if let Some(ball) = demands.ball.filter(|_| time < strike[0]) {
                let gap = body.gap_to_ball(&self.pose, swing, ball);
                if gap < UNTOUCHED {
                    return refused(Refusal::BrushesBall { foot: swing, gap });
                }
            }
            if quick {
                if fine == 0 {
                    self.dynamics.fill(body, support, &self.angles, &self.pose);
                } else {
                    self.dynamics.push(body, support, &self.angles, &self.pose);
                }
                fine += 1;
            }
            // Between the samples, in the slow parts too, no joint may jump from one solution to another.
            if let Some(last) = last {
                let most = fastest(&body.robot, self.ik.joints(), &self.saved, &self.angles, time - last);
                let calm = demands.calm[usize::from(time > contact)][usize::from(quick)];
                if most.0 > calm * limits.speed {
                    return too_fast(most);
                }
            }
            self.saved.copy_from_slice(&self.angles);
            last = Some(time);
            if !quick {
                self.dynamics.fill(body, support, &self.angles, &self.pose);
                self.dynamics.solve(body, swing, &self.pose, FINE, false);
                let [_, (share, joint)] = self.dynamics.shares(&body.robot);
                if share > limits.hold {
                    return refused(Refusal::TooHeavy { foot: swing, share, joint });
                }
            }
            if quick && fine >= 3 {
                // The pose is one sample ahead of the middle: good enough for axes of a forecast.
                let now = self.dynamics.solve(body, swing, &self.pose, FINE, false);
                let share = if fine == 3 { 1.0 } else { FINE / (TIPPING + FINE) };
                zmp = [0, 1].map(|k| zmp[k] + share * (now[k] - zmp[k]));
                // After the contact a joint may lag: nothing depends on it.
                if time <= contact + FINE {
                    let [speed, torque] = self.dynamics.shares(&body.robot);
                    for (most, limit) in [(speed, limits.speed), (torque, limits.torque)] {
                        if most.0 > limit {
                            return too_fast(most);
                        }
                    }
                }
                let by = outside(zmp, foot, limits.edge);
                if by > 0.0 {
                    return refused(Refusal::OffBalance { foot: swing, by });
                }
            }
            time += if quick { FINE } else { COARSE.min((strike[0] - time).max(FINE)) };
        }
        Ok(())
    }
}
