//! The body tree (paper 4, Fig 7 A): mode by the state of the game, then offence, defence or set piece, then an action
//! block. Each node says which options it weighed.

use instep_field::{Pose, wrap};

use crate::belief::{Beliefs, GamePhase, Kicking, PlayState, SetPlay};
use crate::decision::{Action, Decision, Motion, Reason};
use crate::geometry::{Circle, Point, along, bearing, distance, norm, sub, unit};
use crate::kick::{KickRequest, choose, heading_tolerance, is_time, stance};
use crate::positions;
use crate::roles::Role;
use crate::situation::Pitch;
use crate::targets::{Candidate, Scene, Target, TargetKind, best_pass, costs, open_goal};

/// Speed and turn that time to the ball is counted with, m/s and rad/s.
const WALK: f64 = 0.5;
const TURN: f64 = 1.0;
/// A target is weighed again this often, s.
const WEIGH_EVERY: f64 = 0.5;
/// From farther away than this a target is only a guess: weighed half as often, m.
const FAR: f64 = 2.5;
/// A new target must be this much cheaper to replace one in another direction.
const BETTER: f64 = 0.1;
/// But no longer than this after it was chosen, s: its cost is of then.
const KEEP: f64 = 2.0;
/// Directions closer than this are the same target, moved, rad.
const SAME: f64 = 0.35;
/// A dribble plays the ball this far, m.
const DRIBBLE: f64 = 1.2;
/// A robot that is taken off is given this room, m.
const ROOM: f64 = 1.2;
/// Before a lost ball is searched at another place, s.
const SEARCH_STAND: f64 = 4.0;

/// Time that a player needs to a ball, s: way by walking speed, and turning.
pub fn time_to_ball(own: &Pose, ball: Point) -> f64 {
    distance(own.position(), ball) / WALK + 0.5 * wrap(own.bearing_to(ball) - own.heading).abs() / TURN
}

/// What the body tree remembers.
#[derive(Debug, Clone, Default)]
pub(crate) struct Body {
    target: Option<Target>,
    weighed: f64,
    chosen: f64,
    dribbles: bool,
    lost_since: Option<f64>,
    rays: Vec<Point>,
    circles: Vec<Candidate>,
}

fn reason(decision: &mut Decision, option: &'static str, cost: f64, rejected: bool, why: &'static str) {
    // More reasons than fit are dropped: the first ones matter most.
    let _ = decision.reasons.try_push(Reason { option, cost, rejected, why });
}

fn walk(decision: &mut Decision, action: Action, pose: Pose, avoid_ball: bool) {
    decision.action = action;
    decision.motion = Motion::Walk { pose, avoid_ball };
}

impl Body {
    /// Fills in what the body does.
    pub(crate) fn update(&mut self, pitch: &Pitch, beliefs: &Beliefs, decision: &mut Decision) {
        let game = &beliefs.game;
        if game.penalised {
            return reason(decision, "stand", 0.0, false, "sent off");
        }
        if beliefs.own.fallen {
            (decision.action, decision.motion) = (Action::GetUp, Motion::GetUp);
            return reason(decision, "get_up", 0.0, false, "on the ground");
        }
        match game.state {
            PlayState::Initial | PlayState::Finished => reason(decision, "stand", 0.0, false, "no game"),
            PlayState::Set => reason(decision, "stand", 0.0, false, "nobody moves in SET"),
            PlayState::Ready => {
                let pose = if game.set_play == SetPlay::PenaltyKick || game.phase == GamePhase::Shootout {
                    penalty_place(pitch, beliefs)
                } else {
                    positions::kick_off(pitch, beliefs)
                };
                walk(decision, Action::GoTo, pose, true);
                reason(decision, "go_to", 0.0, false, "READY: to the kick-off position");
            }
            PlayState::Playing => self.play(pitch, beliefs, decision),
        }
    }

    fn play(&mut self, pitch: &Pitch, beliefs: &Beliefs, decision: &mut Decision) {
        if let Some(away) = make_way(beliefs) {
            walk(decision, Action::MakeWay, away, true);
            return reason(decision, "make_way", 0.0, false, "a robot close by is being taken off");
        }
        if beliefs.own.kicking {
            decision.action = Action::Kick;
            decision.target = self.target;
            return reason(decision, "kick", 0.0, false, "a kick is on its way");
        }
        let game = &beliefs.game;
        let ours = game.kicking == Kicking::Us;
        let theirs = game.kicking == Kicking::Them;
        if !beliefs.ball.is_known() {
            reason(decision, decision.role.name(), 1.0, true, "the ball is lost");
            return self.search(pitch, beliefs, decision);
        }
        self.lost_since = None;
        let penalty = game.set_play == SetPlay::PenaltyKick || game.phase == GamePhase::Shootout;
        if penalty && game.kicking != Kicking::Nobody && !(ours && decision.role == Role::Striker) {
            // Between the posts at their penalty, else where the penalty found one.
            let pose = if theirs && decision.role == Role::Keeper {
                positions::place(pitch, beliefs, Role::Keeper, 0)
            } else {
                penalty_place(pitch, beliefs)
            };
            let action = if decision.role == Role::Keeper { Action::KeepGoal } else { Action::GoTo };
            walk(decision, action, pose, true);
            return reason(decision, "penalty_kick", 0.0, false, "a penalty kick is taken");
        }
        if theirs {
            let role = if decision.role == Role::Striker { Role::Defender } else { decision.role };
            let wish = positions::place(pitch, beliefs, role, 0);
            let (pose, action) = if role == Role::Keeper {
                (wish, Action::KeepGoal)
            } else {
                (positions::at_their_restart(pitch, beliefs, wish), Action::SetPieceTheirs)
            };
            walk(decision, action, pose, true);
            reason(decision, "striker", time_to_ball(&beliefs.own.pose, beliefs.ball.position), true, "their restart");
            return reason(decision, action_name(action), 0.0, false, "keeps the distance that the rules ask");
        }
        let ball = beliefs.ball.position;
        let near_goal = distance(ball, pitch.field.own_goal().center) < pitch.strategy.roles.keeper_clears;
        let slow = norm(beliefs.ball.velocity) < 0.5;
        match decision.role {
            Role::Striker => self.strike(pitch, beliefs, decision, ours),
            Role::Keeper if near_goal && slow && self.first_at_ball(beliefs) => {
                reason(decision, "keep_goal", 1.0, true, "the ball lies near the own goal and nobody is nearer");
                self.strike(pitch, beliefs, decision, ours);
            }
            Role::Keeper => {
                walk(decision, Action::KeepGoal, positions::place(pitch, beliefs, Role::Keeper, 0), true);
                let cost = time_to_ball(&beliefs.own.pose, ball);
                reason(decision, "striker", cost, true, "the keeper stays in its goal");
                reason(decision, "keep_goal", 0.0, false, "between ball and goal");
            }
            role => {
                let pose = positions::place(pitch, beliefs, role, 0);
                let action = if role == Role::Defender { Action::Defend } else { Action::GoTo };
                walk(decision, action, pose, true);
                let cost = time_to_ball(&beliefs.own.pose, ball);
                reason(decision, "striker", cost, true, "a mate is sooner at the ball");
                reason(decision, role.name(), 0.0, false, "takes its place");
            }
        }
    }

    fn first_at_ball(&self, beliefs: &Beliefs) -> bool {
        let mine = time_to_ball(&beliefs.own.pose, beliefs.ball.position);
        !beliefs.mates.iter().any(|m| m.able && !m.penalised && m.time_to_ball + 0.5 < mine)
    }

    fn search(&mut self, pitch: &Pitch, beliefs: &Beliefs, decision: &mut Decision) {
        let since = *self.lost_since.get_or_insert(beliefs.time);
        let searched = beliefs.time - since;
        decision.action = Action::Search;
        // Turns on its place first; then walks to where most of the field is seen. The keeper stays.
        if decision.role == Role::Keeper {
            let goal = pitch.field.own_goal().center[0] + pitch.strategy.positions.keeper_out;
            decision.motion = Motion::Walk { pose: Pose::new(goal, 0.0, 0.0), avoid_ball: false };
        } else if searched < SEARCH_STAND {
            decision.motion = Motion::Velocity([0.0, 0.0, 0.8]);
        } else {
            let leg = ((searched - SEARCH_STAND) / 6.0) as usize + usize::from(beliefs.number);
            let x = [-0.25, 0.0, 0.25, 0.0][leg % 4] * pitch.field.length;
            let y = [0.0, 0.2, 0.0, -0.2][leg % 4] * pitch.field.width;
            let heading = beliefs.own.pose.bearing_to([x, y]);
            decision.motion = Motion::Walk { pose: Pose::new(x, y, heading), avoid_ball: false };
        }
        reason(decision, "search", 0.0, false, "the ball must be found first");
    }

    /// Offence: chooses a target, walks behind the ball, kicks when the moment has come.
    fn strike(&mut self, pitch: &Pitch, beliefs: &Beliefs, decision: &mut Decision, restart: bool) {
        let own = &beliefs.own;
        let to_ball = time_to_ball(&own.pose, beliefs.ball.position);
        // Where the ball will be when one gets there, but not farther than it rolls.
        let lead = (0.5 * to_ball).min(1.5);
        let ball = along(beliefs.ball.position, beliefs.ball.velocity, lead);
        reason(decision, "striker", to_ball, false, "first at the ball");
        let far = distance(own.pose.position(), ball) > FAR;
        let every = if far { 2.0 * WEIGH_EVERY } else { WEIGH_EVERY };
        if self.target.is_none() || beliefs.time - self.weighed >= every {
            self.weighed = beliefs.time;
            self.weigh(pitch, beliefs, decision, ball);
        } else if let Some(target) = self.target {
            reason(decision, target_name(&target, self.dribbles), target.cost, false, "chosen before");
        }
        let Some(target) = self.target else {
            walk(decision, Action::Approach, stance(&pitch.kicks[0], ball, 0.0), true);
            return reason(decision, "approach", 0.0, false, "no target yet");
        };
        let Some(request) = choose(pitch.kicks, ball, &target) else { return };
        let kick = &pitch.kicks[request.kick];
        decision.target = Some(target);
        decision.prepared = Some(KickRequest { precision: target.tolerance, ..request });
        let moment = is_time(kick, &request, own, &beliefs.ball);
        let seen = beliefs.ball.age(beliefs.time) < 1.0;
        let mut pose = stance(kick, ball, request.direction);
        // Already behind the ball and nearly aligned: walks on through the stance, for a kick in the gait.
        let behind = own.pose.local_from_outer(ball);
        let off = wrap(request.direction - own.pose.heading).abs();
        let aligned = off < 2.0 * heading_tolerance(kick, &request) && behind[0] > 0.0 && behind[1].abs() < 0.25;
        if aligned && kick.in_gait && !moment {
            let ahead = unit(request.direction);
            pose = Pose::new(pose.x + 0.1 * ahead[0], pose.y + 0.1 * ahead[1], pose.heading);
        }
        walk(decision, if restart { Action::SetPieceOurs } else { Action::Approach }, pose, !aligned);
        if moment && seen {
            decision.kick = Some(KickRequest { precision: target.tolerance, ..request });
            decision.action = if self.dribbles { Action::Dribble } else { Action::Kick };
            reason(decision, "kick_now", 0.0, false, "ball before the foot at the next step");
        } else {
            reason(decision, "kick_now", 1.0, true, if seen { "not behind the ball yet" } else { "ball not seen" });
        }
    }

    /// Weighs shot, best pass and dribble, and keeps the present target where the best is hardly better.
    fn weigh(&mut self, pitch: &Pitch, beliefs: &Beliefs, decision: &mut Decision, ball: Point) {
        let game = &beliefs.game;
        let mates: arrayvec::ArrayVec<Point, 16> =
            beliefs.mates.iter().filter(|m| m.able && !m.penalised).map(|m| m.pose.position()).take(16).collect();
        let opponents: arrayvec::ArrayVec<Circle, 16> = beliefs.opponents.iter().map(|o| o.circle).take(16).collect();
        let (spread, reach) = pitch
            .kicks
            .iter()
            .map(|k| (k.direction_spread(), k.reach()))
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .unwrap_or((0.1, 5.0));
        let scene = Scene {
            field: pitch.field,
            ball,
            own: beliefs.own.pose,
            mates: &mates,
            opponents: &opponents,
            spread,
            reach,
        };
        let settings = &pitch.strategy.shot;
        let always = settings.least_chance == 0.0;
        // After a kick-off, throw-in or indirect free kick a second player must touch the ball first.
        let indirect = game.kicking == Kicking::Us
            && matches!(game.set_play, SetPlay::None | SetPlay::ThrowIn | SetPlay::IndirectFreeKick);
        let shot = open_goal(&scene, settings.opponent_reach, settings.spread_factor * spread, always);
        let mut best: Option<(Target, bool)> = None;
        if let Some(shot) = shot {
            let turn = wrap(shot.direction - beliefs.own.pose.heading).abs();
            let why = if indirect && !always {
                Some("a goal from here would not count")
            } else if 1.0 - shot.cost < settings.least_chance {
                Some("a goal is not likely enough")
            } else if turn > settings.most_turn {
                Some("too much turning round the ball")
            } else {
                None
            };
            if why.is_none() {
                best = Some((shot, false));
            }
            reason(decision, "shoot", shot.cost, why.is_some(), why.unwrap_or("the goal is open enough"));
        } else {
            reason(decision, "shoot", 1.0, true, "the goal is closed");
        }
        let weights = &pitch.strategy.weights;
        let pass = best_pass(&scene, weights, &mut self.rays, &mut self.circles);
        let dribble = dribble(&scene, weights);
        for (target, option, dribbles) in [(pass, "pass", false), (dribble, "dribble", true)] {
            let Some(target) = target else {
                reason(decision, option, f64::INFINITY, true, "no room");
                continue;
            };
            let worse = best.is_some_and(|(b, _)| b.kind == TargetKind::Shot || b.cost <= target.cost);
            if !worse {
                if best.is_some() {
                    // The pass was the best until now.
                    if let Some(last) = decision.reasons.last_mut() {
                        (last.rejected, last.why) = (true, "a dribble is cheaper");
                    }
                }
                best = Some((target, dribbles));
            }
            let why = if !worse { "the cheapest way on" } else { "another option is better" };
            reason(decision, option, target.cost, worse, why);
        }
        let Some((target, dribbles)) = best else { return };
        if let Some(old) = self.target {
            let same = wrap(target.direction - old.direction).abs() < SAME;
            let old_stands = old.kind == target.kind && distance(old.point, ball) > 0.6;
            if !same && old_stands && target.cost > old.cost - BETTER && beliefs.time - self.chosen < KEEP {
                let direction = bearing(ball, old.point);
                self.target = Some(Target { direction, ..old });
                return reason(
                    decision,
                    target_name(&old, self.dribbles),
                    old.cost,
                    false,
                    "kept: the new one is hardly better",
                );
            }
        }
        (self.target, self.dribbles, self.chosen) = (Some(target), dribbles, beliefs.time);
    }

    /// A new restart or a ball that was moved: targets of before are nothing worth.
    pub(crate) fn forget(&mut self) {
        self.target = None;
    }
}

/// A short way toward the goal, scored like a pass.
fn dribble(scene: &Scene, weights: &crate::Weights) -> Option<Target> {
    let direction = bearing(scene.ball, scene.field.opponent_goal().center);
    let circle = Candidate { center: along(scene.ball, unit(direction), DRIBBLE), radius: 0.3 };
    scene.field.contains(circle.center, -0.1).then(|| Target {
        kind: TargetKind::Pass,
        point: circle.center,
        radius: circle.radius,
        direction,
        tolerance: (circle.radius / DRIBBLE).asin(),
        cost: costs(scene, &circle).total(weights),
    })
}

fn target_name(target: &Target, dribbles: bool) -> &'static str {
    match target.kind {
        TargetKind::Shot => "shoot",
        TargetKind::Pass if dribbles => "dribble",
        TargetKind::Pass => "pass",
    }
}

fn action_name(action: Action) -> &'static str {
    match action {
        Action::KeepGoal => "keep_goal",
        _ => "set_piece_theirs",
    }
}

/// Away from the nearest robot that is being taken off, where one is close.
fn make_way(beliefs: &Beliefs) -> Option<Pose> {
    let own = beliefs.own.pose.position();
    let mates = beliefs.mates.iter().filter(|m| m.penalised).map(|m| m.pose.position());
    let opponents = beliefs.opponents.iter().filter(|o| o.penalised).map(|o| o.circle.center);
    let nearest = mates.chain(opponents).min_by(|a, b| distance(*a, own).total_cmp(&distance(*b, own)))?;
    let d = distance(nearest, own);
    if d >= ROOM {
        return None;
    }
    let away = if d > 0.01 { sub(own, nearest) } else { [-1.0, 0.0] };
    let to = along(own, away, (ROOM + 0.3 - d) / norm(away));
    Some(Pose::new(to[0], to[1], beliefs.own.pose.heading))
}

/// Where one waits for a penalty kick: the kicker behind the mark, the keeper on its line, the others outside.
fn penalty_place(pitch: &Pitch, beliefs: &Beliefs) -> Pose {
    let field = pitch.field;
    let ours = beliefs.game.kicking == Kicking::Us;
    let mark = field.length / 2.0 - field.penalty_mark;
    let shootout = beliefs.game.phase == GamePhase::Shootout;
    let keeper = beliefs.number == 1;
    match (ours, keeper) {
        (false, true) => Pose::new(-field.length / 2.0 + 0.1, 0.0, 0.0),
        (true, false) if beliefs.number == 2 => Pose::new(mark - 0.8, 0.0, 0.0),
        (true, true) if !shootout => Pose::new(-field.length / 2.0 + pitch.strategy.positions.keeper_out, 0.0, 0.0),
        _ => {
            // Behind the ball, outside the penalty area and the circle about the mark.
            let area = field.penalty_area.map_or(field.goal_area.length, |a| a.length);
            let edge = field.length / 2.0 - area.max(field.penalty_mark + field.circle_radius) - 0.5;
            let x = if ours { edge } else { -edge };
            let n = f64::from(beliefs.number);
            let y = (n - 2.5) * 1.0 + if ours { 0.5 } else { -0.5 };
            Pose::new(
                x,
                y.clamp(-field.width / 2.0 + 0.5, field.width / 2.0 - 0.5),
                if ours { 0.0 } else { std::f64::consts::PI },
            )
        }
    }
}
