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

use crate::dynamic::motion::{self, Stroke};
use crate::dynamic::settings::DynamicSettings;
use crate::engine::{Face, KickPlan};
use crate::ik::Ik;
use crate::request::{KickRequest, Place, Refusal};
use crate::whole_body::body::Body;
use crate::whole_body::foot::{FacePoint, contact_point, paper_choice, paper_face, wrap};
use crate::whole_body::forecast::{Demands, FAR, MIDDLE, NEAR, ROLL, Rehearsal, check_place, graver, judge};
use crate::whole_body::motion::{Motion, goals};
use crate::whole_body::torque::Dynamics;

/// The share of the asked speed below which a slower stroke is no answer.
const SLOWEST: f64 = 0.88;
/// Wind-ups, in units of the one that there is room for, and speeds, in units of the asked one, in the order in which they are
/// tried.
const TRIES: [(f64, f64); 7] = [(1.0, 1.0), (1.5, 1.0), (0.7, 1.0), (2.0, 1.0), (1.0, 0.89), (1.5, 0.89), (2.0, 0.89)];
/// Way over which the joints' speeds at the contact are taken, m.
const WAY: f64 = 0.01;
/// Share of the speed limit up to which a stroke is left as the settings have it.
const CALM: f64 = 0.6;
/// How far and in which steps pitch (rad/m) and rise are searched.
const PITCHES: u8 = 16;
const PITCH_STEP: f64 = 0.5;
const RISES: u8 = 10;
const RISE_STEP: f64 = 0.05;
/// Least height of the swing foot over the ground in the forecast, m.
const GROUND: f64 = 0.006;
/// Speeds of joints after the contact, in units of their limits, up to which they come back in time.
const LATE: f64 = 1.5;
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
    /// that it pitches up.
    rates: [Vec<f64>; 3],
}

impl Planner {
    pub(crate) fn new(body: &Body, settings: &DynamicSettings, ik: Ik, dynamics: Dynamics) -> Self {
        Self {
            rehearsal: Rehearsal::new(body, &settings.manner(), ik, dynamics),
            rates: std::array::from_fn(|_| vec![0.0; body.robot.joints.len()]),
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
        check_place(body, ball, false)?;
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
            if !whole {
                let motion = motion::kick(body, settings, &candidate.stroke);
                return Ok(candidate.planned(settings, motion));
            }
            // What is too fast for the motors over one way may be possible over another, or a little slower.
            for (windup, slower) in TRIES {
                let mut tried = *candidate;
                if candidate.slower * slower < SLOWEST {
                    continue;
                }
                tried.stroke.windup *= windup;
                tried.stroke.speed *= slower;
                tried.ball_speed *= slower;
                let motion = motion::kick(body, settings, &tried.stroke);
                let demands = Demands {
                    limits: &settings.limits,
                    foot_speed: tried.stroke.speed,
                    calm: [[1.0; 2], [LATE; 2]],
                    roll: ROLL,
                    ground: GROUND,
                };
                match self.rehearsal.forecast(body, &motion, &demands) {
                    Ok(()) => return Ok(tried.planned(settings, motion)),
                    Err((cause, _)) => {
                        let other = matches!(cause, Refusal::TooFast { .. } | Refusal::OffBalance { .. });
                        refusal = Some(graver(refusal, cause));
                        if !other {
                            break;
                        }
                    }
                }
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
        let wanted = unit(request.direction) * request.strength.ball_speed(&body.ball, 1.0) - ball_velocity;
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
            rise: 0.0,
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
        cost += 0.8 * (1.0 - stroke.windup / s.windup) + 0.3 * (1.0 - stroke.follow / s.follow);
        cost += 0.3 * (1.0 - limit / 0.1).clamp(0.0, 1.0);
        Ok(Candidate { stroke, cost, ball_speed: ball_speed * slower, slower })
    }

    /// Chooses how the foot pitches and rises at the contact so that the joints' speeds are easiest, for a stroke whose contact
    /// pose is in `saved`: a straight way of a level foot lets one joint bind while others have much left. Gives the largest share
    /// of a joint's speed limit that is left, and its joint.
    fn ease(&mut self, body: &Body, settings: &DynamicSettings, stroke: &mut Stroke) -> (f64, usize) {
        let base = Stroke { pitch: 0.0, rise: 0.0, ..*stroke };
        let (ahead, here) = (base.pose(WAY), base.pose(0.0));
        let moved = |axis: usize, by: f64| {
            let mut pose = here;
            pose[axis] += by;
            pose
        };
        // Turning about the face moves the sole: the pose of a pitch by WAY x 1 rad/m, less the way itself.
        let pitched = {
            let mut pose = Stroke { pitch: 1.0, ..base }.pose(WAY);
            (0..3).for_each(|axis| pose[axis] += here[axis] - ahead[axis]);
            pose
        };
        let trunk = settings.manner().trunk_support(body, stroke.swing, stroke.yaw);
        let tried = &mut self.rehearsal;
        for (rates, pose) in self.rates.iter_mut().zip([ahead, moved(2, WAY), pitched]) {
            tried.angles.copy_from_slice(&tried.saved);
            tried.go(body, stroke.swing, &goals(&pose, &trunk), NEAR, ROLL);
            for (j, rate) in rates.iter_mut().enumerate() {
                *rate = (tried.angles[j] - tried.saved[j]) / WAY / body.robot.joints[j].speed;
            }
        }
        let [way, up, turn] = &self.rates;
        // A quintic that comes from the contact's height and rises at the end dips by 0.38 of the rise times the wind-up.
        let most_rise = (stroke.contact.z - settings.swing.sole_least).max(0.0) / (0.38 * settings.swing.windup);
        let mut best = (f64::INFINITY, (0.0, 0));
        let (default, calm) = (stroke.pitch, CALM * settings.limits.speed);
        for p in 0..=PITCHES {
            for r in 0..=RISES {
                let pitch = default + f64::from(p) * PITCH_STEP;
                let rise = f64::from(r) * RISE_STEP;
                if rise > most_rise {
                    break;
                }
                let share = (0..way.len())
                    .map(|j| (stroke.speed * (way[j] + rise * up[j] + pitch * turn[j]).abs(), j))
                    .fold((0.0, 0), |most, next| if next.0 > most.0 { next } else { most });
                let cost = share.0.max(calm) + 0.02 * (pitch - default) + 0.3 * rise;
                if cost < best.0 {
                    best = (cost, share);
                    (stroke.pitch, stroke.rise) = (pitch, rise);
                }
            }
        }
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
        let gap = self.rehearsal.go(body, stroke.swing, &goals(&foot, &trunk), steps, ROLL);
        judge(body, &settings.limits, &self.rehearsal.pose, stroke.swing, what, gap)
    }
}

fn unit(angle: f64) -> Vector2<f64> {
    Vector2::new(angle.cos(), angle.sin())
}
