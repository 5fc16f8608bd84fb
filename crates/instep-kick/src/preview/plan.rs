//! From a request to a motion, or the cause why not: both feet and every face (front, sides, heel, rounded corners) are
//! screened at contact, retraction point and end of the kick; the best are forecast on their whole way.
//!
//! The forecast is made twice, for the preview controller knows a pendulum and the robot has legs. First the centre of mass
//! follows the reference alone, and inverse dynamics of the joint trajectory tells where the zero-moment point really
//! goes. Its distance from the pendulum's is taken off the reference, and the second time the body moves against its
//! swinging leg beforehand (Kajita et al. 2003, section 5, the same with the preview controller as filter). Joint
//! ranges, speeds, torques, gaps and the zero-moment point are held against their limits the second time.

use std::f64::consts::{FRAC_PI_4, PI};

use instep_motion::phase::Side;
use nalgebra::{Rotation3, Vector2, Vector3};

use crate::engine::{Face, KickPlan, Phase};
use crate::preview::Placer;
use crate::preview::motion::{Motion, goals, trunk_support, zmp_support};
use crate::preview::regulator::Regulator;
use crate::preview::settings::PreviewSettings;
use crate::preview::stroke::{Shape, Stroke};
use crate::request::{KickRequest, Place, Refusal};
use crate::whole_body::body::Body;
use crate::whole_body::foot::{contact_point, paper_choice, paper_face, wrap};
use crate::whole_body::forecast::{
    FAR, MIDDLE, NEAR, ROLL, TIPPING, WAY, check_place, fastest, graver, judge, miss, outside,
};
use crate::whole_body::torque::Dynamics;
use instep_robot::tree::TreePose;

/// How long a motor may have to give more than it can outside the kick, s: the drives ride over less.
const HELD: f64 = 0.06;
/// Share of its speed limit below which every joint counts as holding a pose.
const HOLDING: f64 = 0.3;
/// Largest correction of the reference, m.
const CORRECTION: f64 = 0.05;
/// Least and greatest angle from the foot's x axis at which a corner strikes, rad.
const CORNER: [f64; 2] = [0.0, 1.3];

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
    pub(crate) plan: KickPlan,
}

/// Scratch space of the planner.
#[derive(Debug)]
pub(crate) struct Planner {
    placer: Placer,
    pose: TreePose,
    angles: Vec<f64>,
    saved: Vec<f64>,
    /// Joint angles with the left or right foot lifted over its place.
    lifted: [Vec<f64>; 2],
    dynamics: Dynamics,
    /// What is taken off the reference of the zero-moment point, one entry a sample, m.
    pub(crate) correction: Vec<[f64; 2]>,
}

impl Planner {
    pub(crate) fn new(body: &Body, settings: &PreviewSettings, placer: Placer, dynamics: Dynamics) -> Self {
        let mut planner = Self {
            placer,
            pose: body.tree.pose(),
            angles: body.angles.clone(),
            saved: body.angles.clone(),
            lifted: [body.angles.clone(), body.angles.clone()],
            dynamics,
            correction: Vec::new(),
        };
        for swing in [Side::Left, Side::Right] {
            planner.angles.copy_from_slice(&body.angles);
            body.set_arms(1.0, &mut planner.angles);
            let home = body.stand(swing).home;
            let foot = [home.x, home.y, settings.swing.lift, 0.0, 0.0];
            let trunk = trunk_support(body, settings, swing, 0.0);
            let goals = goals(&foot, &trunk, zmp_support(settings, swing));
            planner.placer.solve(&body.tree, &mut planner.pose, &mut planner.angles, swing, &goals, 30);
            planner.lifted[swing as usize].copy_from_slice(&planner.angles);
        }
        planner
    }

    /// Plans `request`; [`Planner::correction`] is the motion's afterwards.
    pub(crate) fn plan(
        &mut self,
        body: &Body,
        settings: &PreviewSettings,
        regulator: &Regulator,
        request: &KickRequest,
    ) -> Result<Planned, Refusal> {
        request.check()?;
        body.check_clear(request.ball)?;
        // When the contact comes decides where a moving ball is, and the other way round: two rounds settle it.
        let mut contact = settings.times.shift + 3.0 * settings.times.foot_least;
        let moving = Vector2::from(request.ball_velocity).norm() > 0.02;
        if moving {
            contact = self.plan_at(body, settings, None, request, contact)?.plan.contact;
        }
        let time = if moving { contact } else { 0.0 };
        let planned = self.plan_at(body, settings, Some(regulator), request, time)?;
        if let Some(deadline) = request.deadline.filter(|deadline| planned.plan.contact > *deadline) {
            return Err(Refusal::TooLate { contact: planned.plan.contact, deadline });
        }
        if let Some(asked) = request.precision.filter(|asked| planned.plan.precision > *asked) {
            return Err(Refusal::TooImprecise { asked, possible: planned.plan.precision });
        }
        Ok(planned)
    }

    /// Plans for a ball that is where it will be after `time` (s); with a `regulator` the best candidates' whole way is
    /// forecast.
    fn plan_at(
        &mut self,
        body: &Body,
        settings: &PreviewSettings,
        regulator: Option<&Regulator>,
        request: &KickRequest,
        time: f64,
    ) -> Result<Planned, Refusal> {
        let (ball, velocity) = body.ball.roll(request.ball, request.ball_velocity, time);
        // Only the heel kicks what lies behind.
        let heel = wrap(request.direction - PI).abs() <= settings.swing.yaw;
        check_place(body, ball, heel)?;
        let mut candidates: Vec<Candidate> = Vec::new();
        let mut refusal: Option<Refusal> = None;
        for swing in [Side::Left, Side::Right].into_iter().filter(|side| request.foot.is_none_or(|foot| foot == *side))
        {
            // Front, sides and heel with the foot turned as the face needs; the corners with it turned half or not.
            for (face, turn) in [
                (Face::Front, 1.0),
                (Face::Inner, 1.0),
                (Face::Outer, 1.0),
                (Face::Back, 1.0),
                (Face::Corner, 1.0),
                (Face::Corner, 0.5),
                (Face::Corner, 0.0),
            ] {
                match self.screen(body, settings, request, (ball, velocity), swing, (face, turn)) {
                    Some(Ok(candidate)) => candidates.push(candidate),
                    Some(Err(cause)) => refusal = Some(graver(refusal, cause)),
                    None => {}
                }
            }
        }
        candidates.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        // The two best are enough: what neither can do, the sixth will not.
        for candidate in candidates.iter().take(2) {
            let motion = Motion::kick(body, settings, &candidate.stroke);
            let forecast = regulator.map_or(Ok(()), |regulator| {
                self.correction.clear();
                self.forecast(body, settings, regulator, &motion, &candidate.stroke, false)?;
                self.forecast(body, settings, regulator, &motion, &candidate.stroke, true)
            });
            match forecast {
                Ok(()) => {
                    let front = candidate.stroke.face == Face::Front;
                    let plan = KickPlan {
                        foot: candidate.stroke.swing,
                        face: candidate.stroke.face,
                        contact: motion.contact.unwrap_or(0.0),
                        duration: motion.timeline.end(),
                        foot_speed: candidate.stroke.speed(),
                        ball_speed: candidate.ball_speed,
                        precision: if front { settings.accuracy.front } else { settings.accuracy.side },
                    };
                    return Ok(Planned { motion, plan });
                }
                Err(cause) => refusal = Some(graver(refusal, cause)),
            }
        }
        Err(refusal.unwrap_or(Refusal::Unreachable { foot: Side::Right, place: Place::Contact, gap: f64::INFINITY }))
    }

    /// Looks at one foot and face: `None` when the foot would have to turn too far.
    fn screen(
        &mut self,
        body: &Body,
        settings: &PreviewSettings,
        request: &KickRequest,
        (ball, velocity): ([f64; 2], [f64; 2]),
        swing: Side,
        (face, turn): (Face, f64),
    ) -> Option<Result<Candidate, Refusal>> {
        let s = &settings.swing;
        // A moving ball keeps its speed: the impulse must point from it to the wanted velocity.
        let ball_velocity = Vector2::from(velocity);
        let wanted_speed = |mass: f64| request.strength.ball_speed(&body.ball, mass);
        let wanted = Vector2::new(request.direction.cos(), request.direction.sin());
        let aim = wanted * wanted_speed(1.0) - ball_velocity;
        let direction = if ball_velocity.norm() > 0.02 { aim.y.atan2(aim.x) } else { request.direction };
        let (point, yaw) = if face == Face::Corner {
            let yaw = turn * wrap(direction);
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
        let height = (body.ball.radius + s.height - point.axis.z).max(s.sole_least);
        let center = Vector2::from(body.support_from_footprint(swing, ball));
        let contact = contact_point(center, direction, &point, yaw, height, body.ball.radius);
        let pitch = match face {
            Face::Front | Face::Corner => s.pitch,
            Face::Back => -s.pitch,
            Face::Inner | Face::Outer => 0.0,
        };
        let shape = Shape::new(&settings.kick, s, s.retraction, s.follow);
        let cramped = Refusal::Unreachable { foot: swing, place: Place::Contact, gap: f64::INFINITY };
        let Some(shape) = shape else { return Some(Err(cramped)) };
        let mut stroke =
            Stroke { swing, face, yaw, contact, direction, axis: point.axis, pitch, shape, time: settings.kick.time };

        // Contact first: where it is out of reach, nothing else matters.
        self.angles.copy_from_slice(&self.lifted[swing as usize]);
        if let Err(cause) = self.reach(body, settings, &stroke, stroke.pose(&Vector3::zeros()), Place::Contact, FAR) {
            return Some(Err(cause));
        }
        self.saved.copy_from_slice(&self.angles);
        let margin = self.limit_margin(body);

        // Effective mass, foot speed, and the share of the joints' speeds that it takes.
        self.dynamics.fill(body, swing.other(), &self.angles, &self.pose);
        let toward = Vector3::new(direction.cos(), direction.sin(), 0.0);
        let strike = contact + Rotation3::from_axis_angle(&Vector3::z_axis(), yaw) * point.axis;
        let mass = self.dynamics.effective_mass(body.robot.leg(swing).foot, &strike, &toward);
        let ball_speed = wanted_speed(mass);
        let change = (wanted * ball_speed - ball_velocity).norm();
        let asked = (change / body.ball.gain(mass) * s.speed_gain + ball_velocity.dot(&toward.xy())).max(0.1);
        let ahead = 0.01;
        let beyond = stroke.pose(&Vector3::new(ahead, 0.0, 0.0));
        let beyond = self.reach(body, settings, &stroke, beyond, Place::Contact, NEAR);
        let share = fastest(&body.robot, 0..body.robot.joints.len(), &self.saved, &self.angles, ahead / asked);
        if beyond.is_ok() && share.0 > settings.limits.speed {
            return Some(Err(Refusal::TooFast { foot: swing, asked, share: share.0, joint: share.1 }));
        }

        // The longest way there is room for.
        let mut failure = None;
        let fits = [1.0, 0.65, 0.3, 0.0].into_iter().find_map(|share| {
            let retraction = s.retraction_least + share * (s.retraction - s.retraction_least);
            stroke.shape = Shape::new(&settings.kick, s, retraction, s.follow)?;
            self.angles.copy_from_slice(&self.saved);
            let place = stroke.retraction();
            let reached = self.reach(body, settings, &stroke, place, Place::WindUp, MIDDLE);
            reached.map_err(|e| failure = Some(e)).ok().map(|()| retraction)
        });
        let Some(retraction) = fits else { return Some(Err(failure.unwrap_or(cramped))) };
        let fits = [1.0, 0.65, 0.3].into_iter().find_map(|share| {
            stroke.shape = Shape::new(&settings.kick, s, retraction, s.follow * share)?;
            self.angles.copy_from_slice(&self.saved);
            let reached = self.reach(body, settings, &stroke, stroke.end(), Place::FollowThrough, MIDDLE);
            reached.map_err(|e| failure = Some(e)).ok().map(|()| share)
        });
        let Some(follow) = fits else { return Some(Err(failure.unwrap_or(cramped))) };
        stroke.time = stroke.shape.speed / asked;
        // A shorter way at the same time is a slower kick.
        if stroke.time < settings.kick.time {
            let most = stroke.shape.speed / settings.kick.time;
            return Some(Err(Refusal::TooStrong { foot: swing, asked, most }));
        }
        let mut cost = share.0 / settings.limits.speed;
        cost += 0.8 * (1.0 - retraction / s.retraction) + 0.3 * (1.0 - follow);
        cost += 0.4 * yaw.abs() / FRAC_PI_4
            + match face {
                Face::Front => 0.0,
                Face::Inner | Face::Outer | Face::Back => 0.3,
                Face::Corner => 0.5,
            };
        cost += 0.3 * (1.0 - margin / 0.1).clamp(0.0, 1.0);
        cost -= if paper_choice(request.ball, request.direction, s.corridor) == swing { 0.15 } else { 0.0 };
        cost -= if paper_face(swing, request.direction) == face { 0.15 } else { 0.0 };
        Some(Ok(Candidate { stroke, cost, ball_speed }))
    }

    /// Moves the foot to `place` by inverse kinematics and judges the pose.
    fn reach(
        &mut self,
        body: &Body,
        settings: &PreviewSettings,
        stroke: &Stroke,
        foot: [f64; 5],
        what: Place,
        steps: usize,
    ) -> Result<(), Refusal> {
        let trunk = trunk_support(body, settings, stroke.swing, stroke.yaw);
        let goals = goals(&foot, &trunk, zmp_support(settings, stroke.swing));
        let residual = self.placer.solve(&body.tree, &mut self.pose, &mut self.angles, stroke.swing, &goals, steps);
        judge(body, &settings.limits, &self.pose, stroke.swing, what, miss(&residual, ROLL))
    }

    /// Distance of the present angles from the nearest joint limit, rad.
    fn limit_margin(&self, body: &Body) -> f64 {
        let legs = body.robot.legs.iter().flat_map(instep_robot::Leg::joints);
        legs.map(|j| {
            let [low, high] = body.robot.joints[j].range;
            (self.angles[j] - low).min(high - self.angles[j])
        })
        .fold(f64::INFINITY, f64::min)
    }

    /// Follows a whole motion, one sample a tick. The first time (`check` false) fills the correction of the reference; the
    /// second time holds everything against its limit.
    fn forecast(
        &mut self,
        body: &Body,
        settings: &PreviewSettings,
        regulator: &Regulator,
        motion: &Motion,
        stroke: &Stroke,
        check: bool,
    ) -> Result<(), Refusal> {
        let (swing, support) = (stroke.swing, stroke.swing.other());
        let (limits, dt) = (&settings.limits, settings.control_period);
        let count = (motion.timeline.end() / dt).ceil() as usize + 1;
        let reference: Vec<[f64; 2]> = (0..count)
            .map(|i| {
                let zmp = motion.zmp(i as f64 * dt);
                let off = self.correction.get(i).copied().unwrap_or_default();
                [zmp[0] - off[0], zmp[1] - off[1]]
            })
            .collect();
        let mut correction = vec![[0.0; 2]; count];
        let mut state = reference[0].map(|zmp| Vector3::new(zmp, 0.0, 0.0));
        let mut pendulum = reference[0];
        self.angles.copy_from_slice(&body.angles);
        body.tree.update(&self.angles, &mut self.pose);
        self.dynamics.fill(body, support, &self.angles, &self.pose);
        let (up, down) = (motion.timeline.end_of(Phase::Raise), motion.timeline.end_of(Phase::MoveBack));
        let contact = motion.contact.unwrap_or(down);
        let foot = &body.feet[support as usize];
        let mut zmp: Option<[f64; 2]> = None;
        let mut heavy = 0;
        for sample in 1..count {
            let time = sample as f64 * dt;
            for (axis, state) in state.iter_mut().enumerate() {
                let ahead = |i: usize| reference[(sample - 1 + i).min(count - 1)][axis];
                *state = regulator.advance(state, regulator.jerk(state, ahead));
            }
            body.set_arms(motion.arms(time), &mut self.angles);
            let goals = motion.goals(time, [state[0].x, state[1].x]);
            self.saved.copy_from_slice(&self.angles);
            let residual = self.placer.solve(&body.tree, &mut self.pose, &mut self.angles, swing, &goals, WAY);
            self.dynamics.push(body, support, &self.angles, &self.pose);
            // The pose is one sample ahead of the middle: good enough for axes of a forecast.
            let before = time - dt;
            let single = !motion.timeline.both_feet(before);
            let now = self.dynamics.solve(body, swing, &self.pose, dt, !single);
            if single && !check {
                correction[sample - 1] = [0, 1].map(|k| (now[k] - pendulum[k]).clamp(-CORRECTION, CORRECTION));
            }
            pendulum = state.map(|state| regulator.zmp(&state));
            if !check || !(up..down).contains(&before) {
                continue;
            }
            judge(body, limits, &self.pose, swing, Place::Way, miss(&residual, ROLL))?;
            let [(speed, fastest), (torque, strongest)] = self.dynamics.shares(&body.robot);
            let quick = motion.timeline.phase(before) == Phase::Kick;
            let asked = stroke.speed();
            let too_fast = |share, joint| Err(Refusal::TooFast { foot: swing, asked, share, joint });
            // After the contact a joint may lag: nothing depends on it.
            if speed > limits.speed * if before <= contact + dt { 1.0 } else { 1.5 } {
                return too_fast(speed, fastest);
            }
            // In the kick until the contact, and where poses are held; over the limit for a moment the drives ride over.
            let (most, time) = if quick { (limits.torque, 1.5 * dt) } else { (limits.hold, HELD) };
            let holds = if quick { before <= contact + dt } else { speed < HOLDING };
            heavy = if torque > most && holds { heavy + 1 } else { 0 };
            if f64::from(heavy) * dt > time {
                if quick {
                    return too_fast(torque, strongest);
                }
                return Err(Refusal::TooHeavy { foot: swing, share: torque, joint: strongest });
            }
            let share = dt / (TIPPING + dt);
            // A jump of the way back that the speeds allow is no fall.
            let now = [(now[0], foot.stand_x), (now[1], foot.stand_y)]
                .map(|(p, [low, high])| p.clamp(low - CORRECTION, high + CORRECTION));
            let smooth = zmp.map_or(now, |zmp| [0, 1].map(|k| zmp[k] + share * (now[k] - zmp[k])));
            zmp = Some(smooth);
            let by = outside(smooth, foot, limits.edge);
            if by > 0.0 {
                return Err(Refusal::OffBalance { foot: swing, by });
            }
        }
        if !check {
            self.correction = correction;
        }
        Ok(())
    }
}
