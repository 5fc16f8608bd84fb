//! From a request to a motion, or the cause why not: both feet and all faces are screened by inverse kinematics at the
//! wind-up, contact and follow-through points, and the best forecasts are checked along their whole way.
//!
//! Paper 2 chooses the foot by equation (1) and moves; bitbots_main#304 shows where that fails. Here equation (1) and
//! the 45-degree rule only tip the scales between candidates that all can. The forecast of a whole motion holds joint
//! ranges, joint speeds, motor torques (by inverse dynamics), gaps between parts of the robot, and the planned centre
//! of pressure in the support foot.

use std::f64::consts::{FRAC_PI_4, PI};

use instep_motion::phase::Side;
use nalgebra::{Vector2, Vector3};

use crate::dynamic::motion::{self, Stroke};
use crate::dynamic::settings::DynamicSettings;
use crate::engine::{Face, KickPlan};
use crate::request::{KickRequest, Place, Refusal};
use crate::whole_body::body::Body;
use crate::whole_body::foot::{FacePoint, contact_point, paper_choice, paper_face, wrap};
use crate::whole_body::forecast::{Demands, FAR, MIDDLE, NEAR, Rehearsal, check_place, graver, judge};
use crate::whole_body::motion::{Motion, goals};
use crate::whole_body::torque::Dynamics;
use instep_robot::ik::Ik;

/// The share of the asked speed below which a slower stroke is no answer.
const SLOWEST: f64 = 0.8;
/// Wind-ups, in units of the one that there is room for, and how hasty the stroke is over them, in the order in which they are
/// tried.
const WINDUPS: [(f64, f64); 6] = [(1.0, 2.0), (1.5, 2.0), (1.0, 1.7), (1.5, 1.7), (0.7, 2.0), (0.45, 2.0)];
/// What is left of the joints' speed when a stroke that was too fast is tried again, slower.
const AGAIN: f64 = 0.98;
/// Ways that are looked at by inverse kinematics, of these those whose whole motion may be forecast, and how many forecasts that
/// may take: what bounds the time of a plan.
const SCREENS: usize = 40;
const CANDIDATES: usize = 8;
const FORECASTS: usize = 14;
/// What the times of retraction and way back are multiplied with until the joints can, and how much at most.
const PACE: f64 = 1.5;
const SLOW_MOST: f64 = 4.0;
/// Peak over mean speed of a quintic from rest to rest, and room for ways that are not straight in the joints.
const PEAK: f64 = 1.875 * 1.2;
/// Way over which the joints' speeds at the contact are taken, m.
const WAY: f64 = 0.01;
/// Share of the speed limit up to which a stroke is left as the settings have it.
const CALM: f64 = 0.6;
/// How far and in which steps pitch (rad/m), rise and turn (rad/m) are searched.
const PITCH: [f64; 2] = [0.5, 16.0];
const RISE: [f64; 2] = [0.05, 10.0];
const TURN: [f64; 2] = [0.5, 8.0];
/// Least height of the swing foot over the ground in the forecast, m.
const GROUND: f64 = 0.006;
/// Speeds of joints after the contact, in units of their limits, up to which they come back in time.
const LATE: f64 = 1.5;
/// Least and greatest angle from the foot's x axis at which a corner strikes, rad.
const CORNER: [f64; 2] = [0.03, 1.4];
/// Yaws of the foot with a corner, rad: steps to either side.
const YAW_STEP: f64 = 0.2;
const YAWS: i32 = 6;
/// Shares of a flat face's half width at which it may meet the ball.
const SLIDES: [f64; 5] = [0.0, 0.5, -0.5, 0.95, -0.95];
/// Way of the foot from its place, in units of the leg's length, up to which a contact costs nothing.
const EASY: f64 = 0.4;
/// Times at which a rolling ball may be met: from the soonest, by steps, s.
const MEETING_STEP: f64 = 0.25;
const MEETINGS: usize = 9;
/// How much later than the ball the foot may be, s.
const ON_TIME: f64 = 0.02;
/// Speed below which a ball counts as resting, m/s.
pub(crate) const RESTS: f64 = 0.02;

/// A place and time at which the ball can be met.
#[derive(Debug, Clone, Copy)]
struct Meeting {
    /// The ball, footprint frame, m.
    ball: [f64; 2],
    /// Its velocity, m/s.
    velocity: [f64; 2],
    /// When, s after the plan; 0: as soon as can be.
    at: f64,
}

/// How a foot and a part of it would strike: what is known without kinematics.
#[derive(Debug, Clone, Copy)]
struct Aim {
    swing: Side,
    face: Face,
    meeting: Meeting,
    /// Direction of the strike, rad.
    direction: f64,
    point: FacePoint,
    /// The foot's, rad.
    yaw: f64,
    /// Sole's centre at the contact, m.
    contact: Vector3<f64>,
    /// The part of the cost that is known; lower is better.
    cost: f64,
}

/// A foot and face that reach the three places.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    stroke: Stroke,
    /// Lower is better.
    cost: f64,
    ball_speed: f64,
    /// The stroke's speed as a share of the one that the request asks.
    slower: f64,
}

impl Candidate {
    /// What is planned with it.
    fn planned(&self, settings: &DynamicSettings, motion: Motion) -> Planned {
        let front = self.stroke.face == Face::Front;
        let plan = KickPlan {
            foot: self.stroke.swing,
            face: self.stroke.face,
            contact: motion.contact.unwrap_or(0.0),
            duration: motion.timeline.end(),
            foot_speed: self.stroke.speed,
            ball_speed: self.ball_speed,
            precision: if front { settings.accuracy.front } else { settings.accuracy.side },
        };
        Planned { motion, stroke: self.stroke, plan }
    }
}

/// A motion that was forecast to be possible.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Planned {
    pub(crate) motion: Motion,
    pub(crate) stroke: Stroke,
    pub(crate) plan: KickPlan,
}

/// The planner of one robot.
#[derive(Debug)]
pub(crate) struct Planner {
    rehearsal: Rehearsal,
    /// Shares of the joints' speed limits for each metre of the foot's way, for each metre that it rises, and for each radian
    /// that it pitches up or turns.
    rates: [Vec<f64>; 4],
    aims: Vec<Aim>,
}

impl Planner {
    pub(crate) fn new(body: &Body, settings: &DynamicSettings, ik: Ik, dynamics: Dynamics) -> Self {
        Self {
            rehearsal: Rehearsal::new(body, &settings.manner(), ik, dynamics),
            rates: std::array::from_fn(|_| vec![0.0; body.robot.joints.len()]),
            aims: Vec::new(),
        }
    }

    /// Plans `request`.
    pub(crate) fn plan(
        &mut self,
        body: &Body,
        settings: &DynamicSettings,
        request: &KickRequest,
    ) -> Result<Planned, Refusal> {
        request.check()?;
        body.check_clear(request.ball)?;
        let planned = self.best(body, settings, request)?;
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

    /// The first of the likeliest ways to strike whose whole motion is possible.
    fn best(&mut self, body: &Body, settings: &DynamicSettings, request: &KickRequest) -> Result<Planned, Refusal> {
        self.aim(body, settings, request)?;
        let aims = std::mem::take(&mut self.aims);
        let mut refusal: Option<Refusal> = None;
        let mut candidates: Vec<Candidate> = Vec::with_capacity(CANDIDATES + 1);
        for aim in aims.iter().take(SCREENS) {
            // Nothing that is left can be one of the best.
            if candidates.len() == CANDIDATES && candidates.last().is_some_and(|last| last.cost <= aim.cost) {
                break;
            }
            match self.screen(body, settings, request, aim) {
                Ok(found) => {
                    let place = candidates.partition_point(|known| known.cost <= found.cost);
                    candidates.insert(place, found);
                    candidates.truncate(CANDIDATES);
                }
                Err(cause) => refusal = Some(graver(refusal, cause)),
            }
        }
        self.aims = aims;
        let mut left = FORECASTS;
        for candidate in &candidates {
            let (mut longest, mut pace, mut slower) = (f64::INFINITY, candidate.stroke.pace, 1.0);
            let mut windups = WINDUPS.iter().copied();
            let mut next = windups.next();
            while let Some((windup, haste)) = next.filter(|_| left > 0) {
                if windup >= longest {
                    next = windups.next();
                    continue;
                }
                left -= 1;
                let mut tried = *candidate;
                tried.stroke.windup *= windup;
                tried.stroke.haste = haste;
                tried.stroke.speed *= slower;
                tried.stroke.pace = pace;
                tried.ball_speed *= slower;
                let motion = motion::kick(body, settings, &tried.stroke);
                // A foot that comes later than the ball misses it.
                if tried.stroke.at > 0.0 && motion.contact.is_some_and(|contact| contact > tried.stroke.at + ON_TIME) {
                    break;
                }
                let demands = Demands {
                    limits: &settings.limits,
                    foot_speed: tried.stroke.speed,
                    calm: [[1.0; 2], [LATE; 2]],
                    roll: 0.0,
                    ground: GROUND,
                    ball: (tried.stroke.at == 0.0).then_some(tried.stroke.ball),
                };
                let Err((cause, strike)) = self.rehearsal.forecast(body, &motion, &demands) else {
                    return Ok(tried.planned(settings, motion));
                };
                refusal = Some(graver(refusal, cause));
                let least = SLOWEST / candidate.slower;
                match cause {
                    // Beside the strike there is time.
                    Refusal::TooFast { .. } if !strike && pace * PACE < SLOW_MOST => pace *= PACE,
                    // What is a little too fast is possible a little slower, else over another way.
                    Refusal::TooFast { share, .. } if slower * AGAIN * settings.limits.speed / share > least => {
                        slower *= AGAIN * (settings.limits.speed / share).min(1.0);
                    }
                    Refusal::TooFast { .. } | Refusal::OffBalance { .. } => next = windups.next(),
                    // What is out of reach or in the way is so over any longer way.
                    _ => {
                        longest = windup;
                        next = windups.next();
                    }
                }
            }
        }
        Err(refusal.unwrap_or(Refusal::Unreachable { foot: Side::Right, place: Place::Contact, gap: f64::INFINITY }))
    }

    /// Where and when the ball can be met: at rest where it lies, rolling at times from the soonest on until it rests.
    fn meetings(body: &Body, settings: &DynamicSettings, request: &KickRequest) -> Vec<Meeting> {
        let velocity = request.ball_velocity;
        if Vector2::from(velocity).norm() <= RESTS {
            return vec![Meeting { ball: request.ball, velocity: [0.0; 2], at: 0.0 }];
        }
        let t = &settings.times;
        let soonest = t.shift + t.settle + 2.0 * t.foot_least + t.aim + 0.15;
        let mut meetings = Vec::with_capacity(MEETINGS);
        for i in 0..MEETINGS {
            let at = soonest + i as f64 * MEETING_STEP;
            let (ball, velocity) = body.ball.roll(request.ball, velocity, at);
            meetings.push(Meeting { ball, velocity, at });
            if Vector2::from(velocity).norm() <= RESTS {
                break;
            }
        }
        meetings
    }

    /// Fills `aims` with every way to strike that is not out of the question, the likeliest first: both feet, every face with the
    /// foot turned as it needs, the rounded corners with the foot turned by steps; wherever a rolling ball comes by.
    fn aim(&mut self, body: &Body, settings: &DynamicSettings, request: &KickRequest) -> Result<(), Refusal> {
        self.aims.clear();
        // Only the heel kicks what lies behind.
        let heel = wrap(request.direction - PI).abs() <= settings.swing.yaw;
        let mut refusal = None;
        for meeting in Self::meetings(body, settings, request) {
            if let Err(cause) = check_place(body, meeting.ball, heel) {
                refusal = refusal.or(Some(cause));
                continue;
            }
            // A moving ball keeps its speed: the impulse must point from it to the wanted velocity.
            let velocity = Vector2::from(meeting.velocity);
            let wanted = unit(request.direction) * request.strength.ball_speed(&body.ball, 1.0) - velocity;
            let direction = if velocity.norm() > RESTS { wanted.y.atan2(wanted.x) } else { request.direction };
            for swing in [Side::Left, Side::Right] {
                if request.foot.is_some_and(|foot| foot != swing) {
                    continue;
                }
                let foot = &body.feet[swing as usize];
                for face in [Face::Front, Face::Inner, Face::Outer, Face::Back] {
                    for slide in SLIDES {
                        let mut point = foot.face(face, 0.0);
                        point.axis += across(point.angle) * (slide * point.half_width);
                        let yaw = wrap(direction - point.angle);
                        let extra = if face == Face::Front { 0.0 } else { 0.3 } + 0.05 * slide.abs();
                        self.add(body, settings, request, (swing, face, meeting), direction, (point, yaw, extra));
                    }
                }
                for step in -YAWS..=YAWS {
                    let yaw = f64::from(step) * YAW_STEP;
                    let turned = wrap(direction - yaw);
                    if (CORNER[0]..=CORNER[1]).contains(&turned.abs()) {
                        let point = foot.face(Face::Corner, turned);
                        self.add(body, settings, request, (swing, Face::Corner, meeting), direction, (point, yaw, 0.5));
                    }
                }
            }
        }
        self.aims.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        match refusal.filter(|_| self.aims.is_empty()) {
            Some(cause) => Err(cause),
            None => Ok(()),
        }
    }

    /// Adds one way to strike, with what is known of its cost, unless the foot would have to turn too far.
    fn add(
        &mut self,
        body: &Body,
        settings: &DynamicSettings,
        request: &KickRequest,
        (swing, face, meeting): (Side, Face, Meeting),
        direction: f64,
        (point, yaw, extra): (FacePoint, f64, f64),
    ) {
        let s = &settings.swing;
        if yaw.abs() > s.yaw {
            return;
        }
        let height = (body.ball.radius + s.height - point.axis.z).max(s.sole_least);
        let center = Vector2::from(body.support_from_footprint(swing, meeting.ball));
        let contact = contact_point(center, direction, &point, yaw, height, body.ball.radius);
        let out = (contact - body.stand(swing).home).xy().norm() / body.leg_length - EASY;
        let mut cost = extra + 0.4 * yaw.abs() / FRAC_PI_4 + 4.0 * out.max(0.0) + 0.1 * meeting.at;
        cost -= if paper_choice(request.ball, request.direction, s.corridor) == swing { 0.15 } else { 0.0 };
        cost -= if paper_face(swing, request.direction) == face { 0.15 } else { 0.0 };
        self.aims.push(Aim { swing, face, meeting, direction, point, yaw, contact, cost });
    }

    /// Looks whether a foot and face reach the three places.
    fn screen(
        &mut self,
        body: &Body,
        settings: &DynamicSettings,
        request: &KickRequest,
        aim: &Aim,
    ) -> Result<Candidate, Refusal> {
        let s = &settings.swing;
        let Aim { swing, face, direction, point, yaw, contact, .. } = *aim;
        let ball_velocity = Vector2::from(aim.meeting.velocity);
        let mut stroke = Stroke {
            swing,
            face,
            yaw,
            contact,
            direction,
            windup: s.windup,
            follow: s.follow,
            speed: 1.0,
            haste: 2.0,
            axis: point.axis,
            pitch: s.pitch,
            rise: 0.0,
            turn: 0.0,
            bend: [0.0; 5],
            lowest: s.sole_least,
            pace: 1.0,
            at: aim.meeting.at,
            ball: body.support_from_footprint(swing, aim.meeting.ball).into(),
        };

        // Contact first: where it is out of reach, nothing else matters.
        self.rehearsal.lift(swing);
        self.reach(body, settings, &stroke, stroke.pose(0.0), Place::Contact, FAR)?;
        let tried = &mut self.rehearsal;
        tried.saved.copy_from_slice(&tried.angles);
        let limit = tried.limit_margin(body);

        // Effective mass, foot speed, and the share of the joints' speeds that it takes.
        tried.dynamics.fill(body, swing.other(), &tried.angles, &tried.pose);
        let toward = Vector3::new(direction.cos(), direction.sin(), 0.0);
        let strike = contact + nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), yaw) * point.axis;
        let mass = tried.dynamics.effective_mass(body.robot.leg(swing).foot, &strike, &toward);
        let ball_speed = request.strength.ball_speed(&body.ball, mass);
        let change = (unit(request.direction) * ball_speed - ball_velocity).norm();
        let along = ball_velocity.dot(&toward.xy());
        stroke.speed = (change / body.ball.gain(mass) * s.speed_gain + along).max(0.1);
        let ease = self.ease(body, settings, &mut stroke);
        let slower = (settings.limits.speed / ease.0).min(1.0);
        if slower < SLOWEST {
            return Err(Refusal::TooFast { foot: swing, asked: stroke.speed, share: ease.0, joint: ease.1 });
        }
        stroke.speed *= slower;

        // The longest wind-up and follow-through there is room for.
        let mut failure = None;
        let fits = [1.0, 0.65, 0.3, 0.0].into_iter().find_map(|share| {
            stroke.windup = s.windup_least + share * (s.windup - s.windup_least);
            self.rehearsal.angles.copy_from_slice(&self.rehearsal.saved);
            let place = stroke.windup_pose();
            self.reach(body, settings, &stroke, place, Place::WindUp, MIDDLE).map_err(|e| failure = Some(e)).ok()
        });
        if let (None, Some(cause)) = (fits, failure) {
            return Err(cause);
        }
        // No joint may have to hurry on the way there.
        let (most, _) = self.rehearsal.haste_from_lift(body, swing, motion::retraction_time(body, settings, &stroke));
        stroke.pace = (PEAK * most / settings.limits.speed).clamp(1.0, SLOW_MOST);
        let fits = [1.0, 0.5, 0.0].into_iter().find_map(|share| {
            stroke.follow = s.follow * (0.3 + 0.7 * share);
            self.rehearsal.angles.copy_from_slice(&self.rehearsal.saved);
            let place = stroke.follow_pose();
            self.reach(body, settings, &stroke, place, Place::FollowThrough, MIDDLE).map_err(|e| failure = Some(e)).ok()
        });
        if let (None, Some(cause)) = (fits, failure) {
            return Err(cause);
        }
        // All that is added to the aim's cost is at least zero: the search leaves off by it.
        let mut cost = aim.cost + ease.0 / settings.limits.speed;
        cost += 0.8 * (1.0 - stroke.windup / s.windup) + 0.3 * (1.0 - stroke.follow / s.follow) + 2.0 * (1.0 - slower);
        cost += 0.3 * (1.0 - limit / 0.1).clamp(0.0, 1.0);
        Ok(Candidate { stroke, cost, ball_speed: ball_speed * slower, slower })
    }

    /// Chooses how the foot pitches, rises and turns at the contact so that the joints' speeds are easiest, for a stroke whose
    /// contact pose is in `saved`: a straight way of a level foot lets one joint bind while others have much left. Gives the
    /// largest share of a joint's speed limit that is left, and its joint.
    fn ease(&mut self, body: &Body, settings: &DynamicSettings, stroke: &mut Stroke) -> (f64, usize) {
        let base = Stroke { pitch: 0.0, rise: 0.0, turn: 0.0, ..*stroke };
        let trunk = settings.manner().trunk_support(body, stroke.swing, stroke.yaw);
        let (ahead, here) = (base.pose(WAY), base.pose(0.0));
        let mut up = here;
        up[2] += WAY;
        // Turning about the face moves the sole: the pose of a turn by WAY x 1 rad/m, less the way itself.
        let turned = |stroke: Stroke| {
            let mut pose = stroke.pose(WAY);
            (0..3).for_each(|axis| pose[axis] += here[axis] - ahead[axis]);
            pose
        };
        let (pitched, yawed) = (turned(Stroke { pitch: 1.0, ..base }), turned(Stroke { turn: 1.0, ..base }));
        let tried = &mut self.rehearsal;
        for (rates, pose) in self.rates.iter_mut().zip([ahead, up, pitched, yawed]) {
            tried.angles.copy_from_slice(&tried.saved);
            tried.go(body, stroke.swing, &goals(&pose, &trunk), NEAR, 0.0);
            for (j, rate) in rates.iter_mut().enumerate() {
                *rate = (tried.angles[j] - tried.saved[j]) / WAY / body.robot.joints[j].speed;
            }
        }
        let [way, up, pitches, turns] = &self.rates;
        // The foot pitches about the face's axis toward the front or heel, not about its side.
        let forward = stroke.axis.x.signum() * f64::from(u8::from(stroke.axis.x.abs() > stroke.axis.y.abs()));
        // A quintic that comes from the contact's height and rises at the end dips by 0.38 of the rise times the wind-up.
        let most_rise = (stroke.contact.z - settings.swing.sole_least).max(0.0) / (0.38 * settings.swing.windup);
        let calm = CALM * settings.limits.speed;
        let rate =
            |j: usize, [pitch, rise, turn]: [f64; 3]| way[j] + rise * up[j] + pitch * pitches[j] + turn * turns[j];
        let judged = |[pitch, rise, turn]: [f64; 3]| {
            let share = (0..way.len())
                .map(|j| (stroke.speed * rate(j, [pitch, rise, turn]).abs(), j))
                .fold((0.0, 0), |most, next| if next.0 > most.0 { next } else { most });
            (share.0.max(calm) + 0.02 * (pitch - stroke.pitch).abs() + 0.3 * rise + 0.02 * turn.abs(), share)
        };
        // One after the other, twice: what is minimised is convex in the three.
        let mut chosen = [stroke.pitch * forward, 0.0, 0.0];
        let mut best = judged(chosen);
        for _ in 0..2 {
            for (k, [step, count], low) in [(0, PITCH, -PITCH[1]), (1, RISE, 0.0), (2, TURN, -TURN[1])] {
                let mut next = chosen;
                for i in low as i32..=count as i32 {
                    next[k] = f64::from(i) * step;
                    if (k == 0 && next[0] * forward < 0.0) || (k == 1 && next[1] > most_rise) {
                        continue;
                    }
                    let found = judged(next);
                    if found.0 < best.0 {
                        (best, chosen) = (found, next);
                    }
                }
            }
        }
        [stroke.pitch, stroke.rise, stroke.turn] = chosen;
        // Where the foot would be if every joint went back at its rate: the way of a swing rather than a straight line.
        let tried = &mut self.rehearsal;
        for j in 0..way.len() {
            let [low, high] = body.robot.joints[j].range;
            let back = stroke.windup * rate(j, chosen) * body.robot.joints[j].speed;
            tried.angles[j] = (tried.saved[j] - back).clamp(low, high);
        }
        let Rehearsal { pose, angles, .. } = tried;
        body.tree.update(angles, pose);
        let back = body.foot_in_support(pose, stroke.swing);
        let (here, slope, way) = (stroke.pose(0.0), stroke.slope(), stroke.windup);
        stroke.bend = std::array::from_fn(|k| 2.0 * (back[k] - here[k] + way * slope[k]) / (way * way));
        best.1
    }

    /// Moves the foot to `foot` by inverse kinematics and judges the pose.
    fn reach(
        &mut self,
        body: &Body,
        settings: &DynamicSettings,
        stroke: &Stroke,
        foot: [f64; 5],
        what: Place,
        steps: usize,
    ) -> Result<(), Refusal> {
        let trunk = settings.manner().trunk_support(body, stroke.swing, stroke.yaw);
        let gap = self.rehearsal.go(body, stroke.swing, &goals(&foot, &trunk), steps, 0.0);
        judge(body, &settings.limits, &self.rehearsal.pose, stroke.swing, what, gap)
    }
}

/// Toward the left of `angle` (rad).
fn across(angle: f64) -> Vector3<f64> {
    Vector3::new(-angle.sin(), angle.cos(), 0.0)
}

fn unit(angle: f64) -> Vector2<f64> {
    Vector2::new(angle.cos(), angle.sin())
}
