//! From a request to a motion, or the cause why not.
//!
//! The grid proposes strokes with every part of both feet (`lookup`); inverse kinematics checks them with the foot's
//! rotation, which the grid does not hold; the best is followed along its whole way with joint speeds, torques and the centre of
//! pressure, and slowed down until all are within limits ("at the joints' limits"): the plan says what speed comes.

use instep_motion::phase::Side;
use nalgebra::{Rotation3, Vector2, Vector3};

use crate::adaptive::grid::Grid;
use crate::adaptive::lookup::{Found, Query, look_up_all};
use crate::adaptive::motion::{self, Stroke};
use crate::adaptive::settings::AdaptiveSettings;
use crate::engine::{Face, KickPlan};
use crate::request::{KickRequest, Place, Refusal};
use crate::whole_body::body::Body;
use crate::whole_body::forecast::{Demands, FAR, MIDDLE, Rehearsal, graver, ground_gap, judge, miss};
use crate::whole_body::motion::{Motion, goals};
use crate::whole_body::torque::Dynamics;
use instep_robot::ik::Ik;
use instep_robot::tree::TreePose;

/// Strokes whose whole way is forecast.
const FORECASTS: usize = 8;
/// The same where many plans are compared.
const FEW_FORECASTS: usize = 2;
/// Cost of slowing a stroke down by its whole speed, or its retraction by its whole time.
const SLOW_COST: f64 = 0.5;
/// Share of the joints' speeds that retraction and way back may take: there is time, and a leg that swings freely overshoots.
const CALM: f64 = 0.8;
/// Least height of any point of the swing foot over the ground, m.
const GROUND: f64 = 0.006;
/// What the strike's speed is multiplied with until it is within limits.
const SLOWER: f64 = 0.85;
/// What retraction and way back are slowed down with until the joints can, and how much at most.
const PACE: f64 = 1.4;
const SLOWEST: f64 = 3.0;
/// Waits for a rolling ball that are tried, s.
const WAIT_STEP: f64 = 0.2;
/// Times of contact with a rolling ball that are compared.
const GOOD_TIMES: usize = 2;
/// How much later than the ball the foot may be, s.
const ON_TIME: f64 = 0.02;

/// A motion that was forecast to be possible.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Planned {
    pub(crate) motion: Motion,
    pub(crate) stroke: Stroke,
    pub(crate) plan: KickPlan,
}

/// Where a ball is met, and how hard a stroke for it is looked for.
#[derive(Debug, Clone, Copy)]
struct Meeting {
    /// The ball at the contact, footprint frame, m.
    ball: [f64; 2],
    /// Its velocity there, m/s.
    velocity: [f64; 2],
    /// When the contact is to be, s; 0: as soon as can be.
    at: f64,
    /// Strokes whose whole way may be forecast.
    forecasts: usize,
}

impl Meeting {
    /// A ball at rest at `ball` (m), as soon as can be.
    fn at_rest(ball: [f64; 2], forecasts: usize) -> Self {
        Self { ball, velocity: [0.0; 2], at: 0.0, forecasts }
    }
}

/// The planner of one robot.
#[derive(Debug)]
pub(crate) struct Planner {
    pub(crate) rehearsal: Rehearsal,
    found: Vec<Found>,
}

/// The push that a ball (moving with `velocity`, m/s) needs to leave toward `direction` (rad) at `speed` (m/s).
pub(crate) fn push(direction: f64, speed: f64, velocity: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(direction.cos(), direction.sin()) * speed - velocity
}

impl Planner {
    pub(crate) fn new(body: &Body, settings: &AdaptiveSettings, ik: Ik, dynamics: Dynamics) -> Self {
        Self { rehearsal: Rehearsal::new(body, &settings.manner(), ik, dynamics), found: Vec::new() }
    }

    /// Plans `request`.
    pub(crate) fn plan(
        &mut self,
        body: &Body,
        settings: &AdaptiveSettings,
        grid: &Grid,
        request: &KickRequest,
    ) -> Result<Planned, Refusal> {
        request.check()?;
        body.check_clear(request.ball)?;
        let planned = self.plan_moving(body, settings, grid, request)?;
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

    /// The ball where it will be at the contact; a ball that still has to come is waited for.
    fn plan_moving(
        &mut self,
        body: &Body,
        settings: &AdaptiveSettings,
        grid: &Grid,
        request: &KickRequest,
    ) -> Result<Planned, Refusal> {
        if Vector2::from(request.ball_velocity).norm() < 0.02 {
            let meeting = Meeting::at_rest(request.ball, FORECASTS);
            return Ok(self.plan_at(body, settings, grid, request, &meeting)?.0);
        }
        let t = &settings.times;
        let soonest = t.shift + t.settle + 2.0 * t.foot_least + t.aim + 0.3;
        let mut best: Option<(Planned, f64)> = None;
        let mut refusal = None;
        let mut good = 0;
        for i in 0..=(settings.kick.wait / WAIT_STEP) as usize {
            let at = soonest + i as f64 * WAIT_STEP;
            let (ball, velocity) = body.ball.roll(request.ball, request.ball_velocity, at);
            let meeting = Meeting { ball, velocity, at, forecasts: FEW_FORECASTS };
            match self.plan_at(body, settings, grid, request, &meeting) {
                // A foot that comes later than the ball misses it.
                Ok((planned, _)) if planned.plan.contact > at + ON_TIME => {}
                Ok((planned, cost)) => {
                    good += 1;
                    if best.is_none_or(|(_, least)| cost < least) {
                        best = Some((planned, cost));
                    }
                }
                Err(cause) => refusal = refusal.or(Some(cause)),
            }
            if good >= GOOD_TIMES {
                break;
            }
        }
        best.map(|(planned, _)| planned).ok_or_else(|| refusal.unwrap_or(Refusal::OutsideGrid { foot: request.foot }))
    }

    /// All strokes of the grid for a ball that is at a place (m) with a velocity (m/s) at the contact, best first.
    pub(crate) fn look_up(
        &mut self,
        body: &Body,
        settings: &AdaptiveSettings,
        grid: &Grid,
        request: &KickRequest,
        (ball, velocity): ([f64; 2], [f64; 2]),
    ) -> &[Found] {
        self.found.clear();
        let wanted = request.strength.ball_speed(&body.ball, 1.0);
        let aim = push(request.direction, wanted, velocity.into());
        for swing in [Side::Left, Side::Right] {
            if request.foot.is_some_and(|foot| foot != swing) {
                continue;
            }
            let query = Query {
                swing,
                ball: body.support_from_footprint(swing, ball).into(),
                direction: aim.y.atan2(aim.x),
                speed: 1.0,
                follow: settings.kick.follow,
                retraction: settings.kick.retraction[1],
            };
            look_up_all(body, settings, grid, &query, &mut self.found);
        }
        self.found.sort_by(|a, b| a.1.total_cmp(&b.1));
        &self.found
    }

    /// Plans for a meeting with the ball; gives the plan and its cost.
    fn plan_at(
        &mut self,
        body: &Body,
        settings: &AdaptiveSettings,
        grid: &Grid,
        request: &KickRequest,
        meeting: &Meeting,
    ) -> Result<(Planned, f64), Refusal> {
        let &Meeting { ball, velocity, at, forecasts: most } = meeting;
        self.look_up(body, settings, grid, request, (ball, velocity));
        let found = std::mem::take(&mut self.found);
        let mut refusal = None;
        let mut forecasts = 0;
        let mut best: Option<(Planned, f64)> = None;
        for (stroke, cost) in &found {
            // Nothing that follows can be better than what is known.
            if best.is_some_and(|(_, least)| least <= *cost) || forecasts >= most {
                break;
            }
            let mut stroke = Stroke { at, ..*stroke };
            if stroke.forecast < settings.kick.forecast_least {
                continue;
            }
            let tried = self.screen(body, settings, &mut stroke, (request, velocity)).and_then(|needed| {
                forecasts += 1;
                let motion = self.fastest(body, settings, &mut stroke, needed)?;
                Ok((motion, needed))
            });
            match tried {
                Ok((motion, needed)) => {
                    let plan = self.tell(settings, request, velocity.into(), &stroke, &motion, needed);
                    // A stroke that had to be slowed down is near the limits of the joints.
                    let cost = cost + SLOW_COST * (stroke.pace - 1.0 + 1.0 - stroke.speed / needed.0);
                    if best.is_none_or(|(_, least)| cost < least) {
                        best = Some((Planned { motion, stroke, plan }, cost));
                    }
                }
                Err(cause) => refusal = Some(graver(refusal, cause)),
            }
        }
        self.found = found;
        best.ok_or_else(|| refusal.unwrap_or(Refusal::OutsideGrid { foot: request.foot }))
    }

    /// What the caller is told.
    fn tell(
        &self,
        settings: &AdaptiveSettings,
        request: &KickRequest,
        velocity: Vector2<f64>,
        stroke: &Stroke,
        motion: &Motion,
        (foot_speed, ball_speed): (f64, f64),
    ) -> KickPlan {
        // The push grows with the foot's speed relative to the ball; the ball keeps its own velocity.
        let along = velocity.dot(&Vector2::new(stroke.normal.cos(), stroke.normal.sin()));
        let share = (stroke.speed - along) / (foot_speed - along).max(1e-6);
        let whole = push(request.direction, ball_speed, velocity);
        let comes = velocity + whole * share.clamp(0.0, 1.0);
        KickPlan {
            foot: stroke.swing,
            face: stroke.face,
            contact: motion.contact.unwrap_or(0.0),
            duration: motion.timeline.end(),
            foot_speed: stroke.speed,
            ball_speed: comes.norm(),
            precision: precision(settings, stroke),
        }
    }

    /// Checks a stroke's places with the foot's rotation and sets how far it follows through; gives the foot speed that the request
    /// needs and the ball speed that it gives, m/s.
    fn screen(
        &mut self,
        body: &Body,
        settings: &AdaptiveSettings,
        stroke: &mut Stroke,
        (request, velocity): (&KickRequest, [f64; 2]),
    ) -> Result<(f64, f64), Refusal> {
        self.rehearsal.lift(stroke.swing);
        self.reach(body, settings, stroke, &stroke.contact, Place::Contact, FAR)?;
        let tried = &mut self.rehearsal;
        tried.saved.copy_from_slice(&tried.angles);
        tried.dynamics.fill(body, stroke.swing.other(), &tried.angles, &tried.pose);
        let toward = Vector3::new(stroke.normal.cos(), stroke.normal.sin(), 0.0);
        let foot = &body.feet[stroke.swing as usize];
        let point = stroke.part.meet(foot, stroke.normal, f64::INFINITY).map_or(foot.faces[0], |(_, point)| point);
        let strike = stroke.contact + Rotation3::from_axis_angle(&Vector3::z_axis(), stroke.yaw) * point.axis;
        let mass = tried.dynamics.effective_mass(body.robot.leg(stroke.swing).foot, &strike, &toward);
        let ball_speed = request.strength.ball_speed(&body.ball, mass);
        let change = push(request.direction, ball_speed, velocity.into()).norm();
        let along = Vector2::from(velocity).dot(&toward.xy());
        // Only the part of the foot's speed along the push drives the ball.
        let share = stroke.direction().dot(&toward).max(0.3);
        let foot_speed = ((change / body.ball.gain(mass) * settings.kick.speed_gain + along) / share).max(0.1);
        stroke.speed = foot_speed;
        self.reach(body, settings, stroke, &stroke.retraction, Place::WindUp, MIDDLE)?;
        let mut failure = None;
        let most = stroke.follow;
        for share in [1.0, 0.6, 0.3] {
            stroke.follow = share * most;
            self.rehearsal.angles.copy_from_slice(&self.rehearsal.saved);
            match self.reach(body, settings, stroke, &stroke.rest(), Place::FollowThrough, MIDDLE) {
                Ok(()) => return Ok((foot_speed, ball_speed)),
                Err(cause) => failure = Some(cause),
            }
        }
        failure.map_or(Ok((foot_speed, ball_speed)), Err)
    }

    /// The fastest motion within limits, at most the needed one.
    fn fastest(
        &mut self,
        body: &Body,
        settings: &AdaptiveSettings,
        stroke: &mut Stroke,
        (needed, _): (f64, f64),
    ) -> Result<Motion, Refusal> {
        loop {
            let motion = motion::kick(body, settings, stroke);
            let demands = Demands {
                limits: &settings.limits,
                foot_speed: stroke.speed,
                calm: [[CALM, 1.0]; 2],
                roll: 0.0,
                ground: GROUND,
                ball: (stroke.at == 0.0).then_some(stroke.ball),
            };
            match self.rehearsal.forecast(body, &motion, &demands) {
                Ok(()) => return Ok(motion),
                Err((cause, false)) => {
                    if stroke.pace * PACE > SLOWEST || !matches!(cause, Refusal::TooFast { .. }) {
                        return Err(cause);
                    }
                    stroke.pace *= PACE;
                }
                Err((cause, true)) => {
                    let slower = matches!(cause, Refusal::TooFast { .. } | Refusal::OffBalance { .. });
                    if !slower || stroke.speed * SLOWER < settings.kick.speed_least * needed {
                        return Err(cause);
                    }
                    stroke.speed *= SLOWER;
                }
            }
        }
    }

    /// Moves the foot to `place` by inverse kinematics and judges the pose.
    fn reach(
        &mut self,
        body: &Body,
        settings: &AdaptiveSettings,
        stroke: &Stroke,
        place: &Vector3<f64>,
        what: Place,
        steps: usize,
    ) -> Result<(), Refusal> {
        let Rehearsal { ik, pose, angles, .. } = &mut self.rehearsal;
        check(body, settings, (ik, pose, angles), stroke, place, what, steps)
    }
}

/// Moves a foot to `place` of `stroke` by inverse kinematics and judges the pose.
pub(crate) fn check(
    body: &Body,
    settings: &AdaptiveSettings,
    (ik, pose, angles): (&mut Ik, &mut TreePose, &mut Vec<f64>),
    stroke: &Stroke,
    place: &Vector3<f64>,
    what: Place,
    steps: usize,
) -> Result<(), Refusal> {
    let trunk = settings.manner().trunk_support(body, stroke.swing, stroke.yaw);
    let goals = goals(&stroke.pose(place), &trunk);
    let off = ik.solve(&body.tree, pose, angles, stroke.swing, &goals, steps);
    judge(body, &settings.limits, pose, stroke.swing, what, miss(&off, 0.0))?;
    let gap = ground_gap(body, pose, stroke.swing);
    if gap < GROUND {
        return Err(Refusal::HitsGround { foot: stroke.swing, gap });
    }
    Ok(())
}

/// Stated standard deviation of the direction, rad.
pub(crate) fn precision(settings: &AdaptiveSettings, stroke: &Stroke) -> f64 {
    let a = &settings.accuracy;
    let [base, slope] = match stroke.face {
        Face::Front => a.front,
        Face::Inner | Face::Outer | Face::Back => a.side,
        Face::Corner => a.corner,
    };
    (base + slope * stroke.yaw.abs()).max(0.0) + a.angle * stroke.forecast.clamp(-1.0, 1.0).acos()
}
