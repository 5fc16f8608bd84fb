//! From a request to a motion, or the cause why not: both feet and all faces are screened by inverse kinematics at the
//! wind-up, contact and follow-through points, and the best forecasts are checked along their whole way.
//!
//! Paper 2 chooses the foot by equation (1) and moves; bitbots_main#304 shows where that fails. Here equation (1) and
//! the 45-degree rule only tip the scales between candidates that all can. The forecast of a whole motion holds joint
//! ranges, joint speeds, motor torques (by inverse dynamics), gaps between parts of the robot, and the planned centre
//! of pressure in the support foot.

use std::f64::consts::FRAC_PI_4;

use instep_motion::phase::Side;
use nalgebra::{Vector2, Vector3};

use crate::dynamic::body::Body;
use crate::dynamic::foot::{FacePoint, contact_point, paper_choice, paper_face};
use crate::dynamic::motion::{Motion, Stroke, goals, trunk_support};
use crate::dynamic::settings::DynamicSettings;
use crate::dynamic::torque::Dynamics;
use crate::engine::{Face, KickPlan, Phase};
use crate::ik::{Ik, Residual};
use crate::request::{KickRequest, Place, Refusal, Strength};
use crate::tree::TreePose;

/// Steps of inverse kinematics to a place that is far from the last.
const FAR: usize = 12;
/// The same to a place a hand's breadth away.
const MIDDLE: usize = 6;
/// The same to a place near the last.
const NEAR: usize = 3;
/// The same along a way that is sampled densely.
const WAY: usize = 2;
/// Time constant with which the planned centre of pressure is smoothed before it is held against the foot, s.
const TIPPING: f64 = 0.04;
/// Sampling of the forecast, s: in the kick, and elsewhere.
const FINE: f64 = 0.016;
const COARSE: f64 = 0.03;

/// Least and greatest angle from the foot's x axis at which a corner strikes, rad.
const CORNER: [f64; 2] = [0.0, 1.3];

/// Every way to strike: front and sides with the foot turned as the face needs; the corners with the foot turned all the
/// way, half or not.
const WAYS: [(Side, Face, f64); 12] = {
    let [l, r] = [Side::Left, Side::Right];
    [
        (l, Face::Front, 1.0),
        (l, Face::Inner, 1.0),
        (l, Face::Outer, 1.0),
        (l, Face::Corner, 1.0),
        (l, Face::Corner, 0.5),
        (l, Face::Corner, 0.0),
        (r, Face::Front, 1.0),
        (r, Face::Inner, 1.0),
        (r, Face::Outer, 1.0),
        (r, Face::Corner, 1.0),
        (r, Face::Corner, 0.5),
        (r, Face::Corner, 0.0),
    ]
};

/// How a foot and face would strike.
#[derive(Debug, Clone, Copy)]
struct Aim {
    /// Direction of the strike, rad.
    direction: f64,
    point: FacePoint,
    /// The foot's, rad.
    yaw: f64,
    /// The part of the cost that is known without kinematics.
    cost: f64,
}

/// A foot and face that reach the three places.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    stroke: Stroke,
    /// Lower is better.
    cost: f64,
    ball_speed: f64,
}

/// A motion that was forecast to be possible.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Planned {
    pub(crate) motion: Motion,
    pub(crate) stroke: Stroke,
    pub(crate) plan: KickPlan,
}

/// Scratch space of the planner.
#[derive(Debug)]
pub(crate) struct Planner {
    ik: Ik,
    pose: TreePose,
    angles: Vec<f64>,
    saved: Vec<f64>,
    /// Joint angles with the left or right foot lifted over its place.
    lifted: [Vec<f64>; 2],
    dynamics: Dynamics,
}

/// Distance that a residual counts as, m: 1 rad is 0.1 m.
pub(crate) fn miss(residual: &Residual) -> f64 {
    residual.position + 0.1 * residual.orientation + 0.03 * residual.roll + 0.5 * residual.balance
}

/// Angle in (-pi, pi].
fn wrap(angle: f64) -> f64 {
    angle.sin().atan2(angle.cos())
}

impl Planner {
    pub(crate) fn new(body: &Body, settings: &DynamicSettings, ik: Ik, dynamics: Dynamics) -> Self {
        let mut planner = Self {
            ik,
            pose: body.tree.pose(),
            angles: body.angles.clone(),
            saved: body.angles.clone(),
            lifted: [body.angles.clone(), body.angles.clone()],
            dynamics,
        };
        for swing in [Side::Left, Side::Right] {
            planner.angles.copy_from_slice(&body.angles);
            body.set_arms(1.0, &mut planner.angles);
            let home = body.stand(swing).home;
            let foot = [home.x, home.y, settings.swing.lift, 0.0, 0.0];
            let goals = goals(&foot, &trunk_support(body, settings, swing, 0.0));
            planner.ik.solve(&body.tree, &mut planner.pose, &mut planner.angles, swing, &goals, 30);
            planner.lifted[swing as usize].copy_from_slice(&planner.angles);
        }
        planner
    }

    /// Plans `request`.
    pub(crate) fn plan(
        &mut self,
        body: &Body,
        settings: &DynamicSettings,
        request: &KickRequest,
    ) -> Result<Planned, Refusal> {
        request.check()?;
        // When the contact comes decides where a moving ball is, and the other way round: two rounds settle it.
        let moving = Vector2::from(request.ball_velocity).norm() > 0.02;
        let mut contact = settings.times.shift + settings.times.settle + 3.0 * settings.times.foot_least;
        if moving {
            // One round without following the whole way tells the time well enough.
            contact = self.plan_at(body, settings, request, contact, false)?.plan.contact;
        }
        let planned = self.plan_at(body, settings, request, if moving { contact } else { 0.0 }, true)?;
        if let Some(deadline) = request.deadline
            && planned.plan.contact > deadline
        {
            return Err(Refusal::TooLate { contact: planned.plan.contact, deadline });
        }
        if let Some(asked) = request.precision
            && planned.plan.precision > asked
        {
            return Err(Refusal::TooImprecise { asked, possible: planned.plan.precision });
        }
        Ok(planned)
    }

    /// Plans for a ball that is where it will be after `time` (s); `whole`: the best candidates' whole way is forecast.
    fn plan_at(
        &mut self,
        body: &Body,
        settings: &DynamicSettings,
        request: &KickRequest,
        time: f64,
        whole: bool,
    ) -> Result<Planned, Refusal> {
        let (ball, velocity) = body.ball.roll(request.ball, request.ball_velocity, time);
        check_place(body, ball)?;
        let mut refusal: Option<Refusal> = None;
        // What each would cost at least, cheapest first: once two are cheaper than all that are left, none of those can
        // be one of the two best.
        let mut waiting = WAYS.map(|(swing, face, turn)| {
            let asked = request.foot.is_none_or(|foot| foot == swing);
            let aim = if asked { self.aim(body, settings, request, velocity, swing, (face, turn)) } else { None };
            aim.map(|aim| (swing, face, aim))
        });
        let least = |way: &Option<(Side, Face, Aim)>| way.as_ref().map_or(f64::INFINITY, |(_, _, aim)| aim.cost);
        waiting.sort_by(|a, b| least(a).total_cmp(&least(b)));
        let cost = |c: &Option<Candidate>| c.map_or(f64::INFINITY, |c| c.cost);
        let mut candidates: [Option<Candidate>; 2] = [None; 2];
        for (swing, face, aim) in waiting.into_iter().flatten() {
            if cost(&candidates[1]) <= aim.cost {
                break;
            }
            match self.screen(body, settings, request, (ball, velocity), swing, face, &aim) {
                Ok(found) if found.cost < cost(&candidates[0]) => candidates = [Some(found), candidates[0]],
                Ok(found) if found.cost < cost(&candidates[1]) => candidates[1] = Some(found),
                Ok(_) => {}
                Err(cause) => refusal = Some(graver(refusal, cause)),
            }
        }
        // The two best are enough: what neither can do, the sixth will not.
        for candidate in candidates.iter().flatten() {
            let motion = Motion::kick(body, settings, &candidate.stroke);
            let forecast = if whole { self.forecast(body, settings, &motion, &candidate.stroke) } else { Ok(()) };
            match forecast {
                Ok(()) => {
                    let front = candidate.stroke.face == Face::Front;
                    let plan = KickPlan {
                        foot: candidate.stroke.swing,
                        face: candidate.stroke.face,
                        contact: motion.contact.unwrap_or(0.0),
                        duration: motion.end(),
                        foot_speed: candidate.stroke.speed,
                        ball_speed: candidate.ball_speed,
                        precision: if front { settings.accuracy.front } else { settings.accuracy.side },
                    };
                    return Ok(Planned { motion, stroke: candidate.stroke, plan });
                }
                Err(cause) => refusal = Some(graver(refusal, cause)),
            }
        }
        Err(refusal.unwrap_or(Refusal::Unreachable { foot: Side::Right, place: Place::Contact, gap: f64::INFINITY }))
    }

    /// Which way a foot and face must strike and how the foot must turn for it; `None` when it would have to turn too far.
    fn aim(
        &self,
        body: &Body,
        settings: &DynamicSettings,
        request: &KickRequest,
        velocity: [f64; 2],
        swing: Side,
        (face, turn): (Face, f64),
    ) -> Option<Aim> {
        let s = &settings.swing;
        // A moving ball keeps its speed: the impulse must point from it to the wanted velocity.
        let ball_velocity = Vector2::from(velocity);
        let wanted = unit(request.direction) * wanted_speed(body, request, 1.0) - ball_velocity;
        let direction = if ball_velocity.norm() > 0.02 { wanted.y.atan2(wanted.x) } else { request.direction };
        let (point, yaw) = if face == Face::Corner {
            let yaw = turn * direction;
            let turned = wrap(direction - yaw);
            // With the foot turned all the way both corners will do; the inner one reaches farther across.
            let corner = if turned.abs() < 1e-9 { -1e-9 * Body::sign(swing) } else { turned };
            (body.feet[swing as usize].face(face, corner), yaw)
        } else {
            let point = body.feet[swing as usize].face(face, 0.0);
            (point, wrap(direction - point.angle))
        };
        let corner_range = (CORNER[0]..=CORNER[1]).contains(&point.angle.abs());
        if yaw.abs() > s.yaw || (face == Face::Corner && !corner_range) {
            return None;
        }
        let mut cost = 0.4 * yaw.abs() / FRAC_PI_4
            + match face {
                Face::Front => 0.0,
                Face::Inner | Face::Outer | Face::Back => 0.3,
                Face::Corner => 0.5,
            };
        cost -= if paper_choice(request.ball, request.direction, s.corridor) == swing { 0.15 } else { 0.0 };
        cost -= if paper_face(swing, request.direction) == face { 0.15 } else { 0.0 };
        Some(Aim { direction, point, yaw, cost })
    }

    /// Looks whether a foot and face reach the three places.
    #[allow(clippy::too_many_arguments, reason = "one request, one ball, one foot")]
    fn screen(
        &mut self,
        body: &Body,
        settings: &DynamicSettings,
        request: &KickRequest,
        (ball, velocity): ([f64; 2], [f64; 2]),
        swing: Side,
        face: Face,
        aim: &Aim,
    ) -> Result<Candidate, Refusal> {
        let s = &settings.swing;
        let ball_velocity = Vector2::from(velocity);
        let Aim { direction, point, yaw, .. } = *aim;
        let height = (body.ball.radius + s.height - point.axis.z).max(s.sole_least);
        let center = Vector2::from(body.support_from_footprint(swing, ball));
        let contact = contact_point(center, direction, &point, yaw, height, body.ball.radius);
        let mut stroke = Stroke {
            swing,
            face,
            yaw,
            contact,
            direction,
            windup: s.windup,
            follow: s.follow,
            speed: 1.0,
            axis: point.axis,
            pitch: s.pitch,
        };

        // Contact first: where it is out of reach, nothing else matters.
        self.angles.copy_from_slice(&self.lifted[swing as usize]);
        self.reach(body, settings, &stroke, stroke.pose(0.0), Place::Contact, FAR)?;
        self.saved.copy_from_slice(&self.angles);
        let limit = self.limit_margin(body);

        // Effective mass, foot speed, and the share of the joints' speeds that it takes.
        self.dynamics.fill(body, swing.other(), &self.angles, &self.pose);
        let toward = Vector3::new(direction.cos(), direction.sin(), 0.0);
        let strike = contact + nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), yaw) * point.axis;
        let mass = self.dynamics.effective_mass(body.robot.leg(swing).foot, &strike, &toward);
        let ball_speed = wanted_speed(body, request, mass);
        let change = (unit(request.direction) * ball_speed - ball_velocity).norm();
        let along = ball_velocity.dot(&toward.xy());
        stroke.speed = (change / body.ball.gain(mass) * s.speed_gain + along).max(0.1);
        let ahead = 0.01;
        let beyond = self.reach(body, settings, &stroke, stroke.pose(ahead), Place::Contact, NEAR);
        let share = body
            .robot
            .joints
            .iter()
            .enumerate()
            .map(|(j, joint)| ((self.angles[j] - self.saved[j]) / ahead * stroke.speed / joint.speed, j))
            .fold((0.0_f64, 0), |most, (share, j)| if share.abs() > most.0 { (share.abs(), j) } else { most });
        if beyond.is_ok() && share.0 > settings.limits.speed {
            return Err(Refusal::TooFast { foot: swing, asked: stroke.speed, share: share.0, joint: share.1 });
        }

        // The longest wind-up and follow-through there is room for.
        let mut failure = None;
        let fits = [1.0, 0.65, 0.3, 0.0].into_iter().find_map(|share| {
            stroke.windup = s.windup_least + share * (s.windup - s.windup_least);
            self.angles.copy_from_slice(&self.saved);
            let place = stroke.windup_pose();
            self.reach(body, settings, &stroke, place, Place::WindUp, MIDDLE).map_err(|e| failure = Some(e)).ok()
        });
        if let (None, Some(cause)) = (fits, failure) {
            return Err(cause);
        }
        let fits = [1.0, 0.5, 0.0].into_iter().find_map(|share| {
            stroke.follow = s.follow * (0.3 + 0.7 * share);
            self.angles.copy_from_slice(&self.saved);
            let place = stroke.follow_pose();
            self.reach(body, settings, &stroke, place, Place::FollowThrough, MIDDLE).map_err(|e| failure = Some(e)).ok()
        });
        if let (None, Some(cause)) = (fits, failure) {
            return Err(cause);
        }
        // All that is added to the aim's cost is at least zero: the search leaves off by it.
        let mut cost = aim.cost + share.0 / settings.limits.speed;
        cost += 0.8 * (1.0 - stroke.windup / s.windup) + 0.3 * (1.0 - stroke.follow / s.follow);
        cost += 0.3 * (1.0 - limit / 0.1).clamp(0.0, 1.0);
        Ok(Candidate { stroke, cost, ball_speed })
    }

    /// Moves the foot to `place` by inverse kinematics and judges the pose.
    fn reach(
        &mut self,
        body: &Body,
        settings: &DynamicSettings,
        stroke: &Stroke,
        foot: [f64; 5],
        what: Place,
        steps: usize,
    ) -> Result<(), Refusal> {
        let trunk = trunk_support(body, settings, stroke.swing, stroke.yaw);
        let goals = goals(&foot, &trunk);
        let residual = self.ik.solve(&body.tree, &mut self.pose, &mut self.angles, stroke.swing, &goals, steps);
        let gap = miss(&residual);
        // Written so that a NaN fails.
        if !matches!(gap.partial_cmp(&settings.limits.reach), Some(o) if o.is_le()) {
            return Err(Refusal::Unreachable { foot: stroke.swing, place: what, gap });
        }
        let (gap, pair) = body.tree.least_gap(&self.pose);
        if gap < settings.limits.clearance {
            return Err(Refusal::SelfCollision { foot: stroke.swing, pair, gap });
        }
        Ok(())
    }

    /// Distance of the present angles from the nearest joint limit, rad.
    fn limit_margin(&self, body: &Body) -> f64 {
        self.ik
            .joints()
            .map(|j| {
                let [low, high] = body.robot.joints[j].range;
                (self.angles[j] - low).min(high - self.angles[j])
            })
            .fold(f64::INFINITY, f64::min)
    }

    /// Follows a whole motion.
    pub(crate) fn forecast(
        &mut self,
        body: &Body,
        settings: &DynamicSettings,
        motion: &Motion,
        stroke: &Stroke,
    ) -> Result<(), Refusal> {
        let swing = stroke.swing;
        let support = swing.other();
        let limits = &settings.limits;
        self.angles.copy_from_slice(&self.lifted[swing as usize]);
        let (start, end) = (motion.end_of(Phase::Raise), motion.end_of(Phase::MoveBack));
        let contact = motion.contact.unwrap_or(end);
        let fast = [motion.end_of(Phase::WindUp) - 2.0 * FINE, motion.end_of(Phase::Kick) + FINE];
        let foot = &body.feet[support as usize];
        let mut time = start;
        let mut fine = 0;
        let mut zmp = [0.0; 2];
        let mut last: Option<f64> = None;
        while time < end {
            let goals = motion.goals(time);
            let residual = self.ik.solve(&body.tree, &mut self.pose, &mut self.angles, swing, &goals, WAY);
            let gap = miss(&residual);
            if !matches!(gap.partial_cmp(&limits.reach), Some(o) if o.is_le()) {
                return Err(Refusal::Unreachable { foot: swing, place: Place::Way, gap });
            }
            let (gap, pair) = body.tree.least_gap(&self.pose);
            if gap < limits.clearance {
                return Err(Refusal::SelfCollision { foot: swing, pair, gap });
            }
            let quick = (fast[0]..fast[1]).contains(&time);
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
                let most = self
                    .ik
                    .joints()
                    .map(|j| ((self.angles[j] - self.saved[j]).abs() / (time - last) / body.robot.joints[j].speed, j));
                let (share, joint) = most.fold((0.0, 0), |a, b| if b.0 > a.0 { b } else { a });
                if time <= contact && share > limits.speed || share > 1.5 * limits.speed {
                    return Err(Refusal::TooFast { foot: swing, asked: stroke.speed, share, joint });
                }
            }
            self.saved.copy_from_slice(&self.angles);
            last = Some(time);
            if !quick {
                self.dynamics.fill(body, support, &self.angles, &self.pose);
                self.dynamics.solve(body, swing, &self.pose, FINE, false);
                let [_, (share, joint)] = self.dynamics.shares(&body.robot);
                if share > limits.hold {
                    return Err(Refusal::TooHeavy { foot: swing, share, joint });
                }
            }
            if quick && fine >= 3 {
                // The pose is one sample ahead of the middle: good enough for axes of a forecast.
                let now = self.dynamics.solve(body, swing, &self.pose, FINE, false);
                // To tip takes about sqrt(h / g): what is over sooner does not count in full.
                let share = if fine == 3 { 1.0 } else { FINE / (TIPPING + FINE) };
                zmp = [0, 1].map(|k| zmp[k] + share * (now[k] - zmp[k]));
                let [(speed, fastest), (torque, strongest)] = self.dynamics.shares(&body.robot);
                // After the contact a joint may lag: nothing depends on it.
                if time <= contact + FINE {
                    if speed > limits.speed {
                        let cause = Refusal::TooFast { foot: swing, asked: stroke.speed, share: speed, joint: fastest };
                        return Err(cause);
                    }
                    if torque > limits.torque {
                        let cause =
                            Refusal::TooFast { foot: swing, asked: stroke.speed, share: torque, joint: strongest };
                        return Err(cause);
                    }
                }
                let by = [(zmp[0], foot.stand_x), (zmp[1], foot.stand_y)]
                    .map(|(p, [low, high])| (low + limits.edge - p).max(p - high + limits.edge))
                    .into_iter()
                    .fold(f64::NEG_INFINITY, f64::max);
                if by > 0.0 {
                    return Err(Refusal::OffBalance { foot: swing, by });
                }
            }
            time += if quick { FINE } else { COARSE.min((fast[0] - time).max(FINE)) };
            if !quick && time >= fast[1] {
                time = time.max(fast[1]);
            }
        }
        Ok(())
    }
}

fn unit(angle: f64) -> Vector2<f64> {
    Vector2::new(angle.cos(), angle.sin())
}

/// Speed that the ball is to leave with (m/s) when the foot's effective mass is `mass` (kg).
fn wanted_speed(body: &Body, request: &KickRequest, mass: f64) -> f64 {
    match request.strength {
        Strength::BallSpeed(v) => v,
        Strength::FootSpeed(v) => v * body.ball.gain(mass),
        Strength::Distance(d) => (2.0 * body.ball.deceleration * d).sqrt(),
    }
}

/// The refusals that need no kinematics.
fn check_place(body: &Body, ball: [f64; 2]) -> Result<(), Refusal> {
    let distance = ball[0].hypot(ball[1]);
    let reach = body.leg_length + body.ball.radius;
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
    if ball[0] < x[0] {
        return Err(Refusal::BallBehind { x: ball[0], least: x[0] });
    }
    Ok(())
}

/// The refusal that tells more: what came nearest to being possible.
fn graver(old: Option<Refusal>, new: Refusal) -> Refusal {
    let rank = |r: &Refusal| match r {
        Refusal::Unreachable { place: Place::Contact, gap, .. } => -gap.min(10.0),
        Refusal::Unreachable { gap, .. } => 1.0 - gap.min(0.9),
        Refusal::SelfCollision { .. } => 2.0,
        Refusal::OffBalance { .. } | Refusal::TooHeavy { .. } => 3.0,
        Refusal::TooFast { share, .. } => 5.0 - (share / 100.0).min(0.9),
        _ => 9.0,
    };
    match old {
        Some(old) if rank(&old) >= rank(&new) => old,
        _ => new,
    }
}
