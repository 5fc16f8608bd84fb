//! One run of a scenario: a body that walks as the navigator asks, others in the way, and what is measured.

use instep_field::{Field, Pose};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::reference::project;
use crate::scenario::{Mind, Setup};
use crate::{
    Cause, Command, Goal, NavigationError, Navigator, Obstacle, Replaced, RobotLimits, Settings, Status, Target, View,
};

/// Time between two ticks of navigation, s.
pub const PERIOD: f64 = 0.05;
/// How fast the others change their velocity, m/s^2.
const AGILITY: f64 = 1.0;
/// Gains of the tracks of the others.
const TRACK: [f64; 2] = [0.3, 0.04];
/// A robot that has not come this far (m) in [`STUCK_AFTER`] seconds is stuck.
const STUCK: f64 = 0.2;
const STUCK_AFTER: f64 = 10.0;

/// What walks.
pub trait Body {
    /// Where it truly is.
    fn pose(&self) -> Pose;
    /// Where it believes to be.
    fn believe(&mut self) -> Pose;
    /// Walks with a velocity for `dt` seconds.
    ///
    /// # Errors
    /// When it cannot go on (it fell).
    fn advance(&mut self, velocity: [f64; 3], dt: f64) -> Result<(), NavigationError>;
}

/// A moment of a run.
#[derive(Debug, Clone)]
pub struct Sample {
    /// s
    pub time: f64,
    /// True pose.
    pub pose: Pose,
    /// Others, truly.
    pub obstacles: Vec<Obstacle>,
    /// The way that is followed, m.
    pub path: Vec<[f64; 2]>,
    /// Places that the robot is predicted to take, m.
    pub prediction: Vec<[f64; 2]>,
}

/// What came of a run.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// Distance from where it should be at each tick: at equal time where the goal is given in time, else from its path, m.
    pub errors: Vec<f64>,
    /// Deepest in a keep-out, m; 0 when never inside.
    pub depth: f64,
    /// Farthest beyond where the robot's middle may go, m; 0 when never.
    pub beyond: f64,
    /// Whether it touched somebody.
    pub contact: bool,
    /// Whether it came to its goal, or to what replaced it; what is given in time is reached when it ends.
    pub reached: bool,
    /// Whether it stood about far from the goal.
    pub stuck: bool,
    /// s
    pub time: f64,
    /// Distance (m) and angle (rad) from the goal at the end.
    pub from_goal: [f64; 2],
    /// Times of the ticks' solvers and planners, s.
    pub solves: Vec<f64>,
    /// s
    pub plans: Vec<f64>,
    /// Radius that the robot adds to each keep-out, m.
    pub radius: f64,
    /// Changes of the side.
    pub flips: usize,
    /// Why it stood, each once.
    pub causes: Vec<Cause>,
    /// Why the goal was replaced.
    pub replaced: Option<Replaced>,
    /// Four a second.
    pub samples: Vec<Sample>,
    /// Why the body could not go on.
    pub failed: Option<String>,
}

/// Follows somebody by what is seen of it.
struct Track {
    seen: Obstacle,
}

/// Runs `setup` with `body`. `clock` gives the thread's time, s.
///
/// # Errors
/// Limits or settings that cannot be.
pub fn run(
    setup: &Setup,
    field: &Field,
    limits: RobotLimits,
    settings: Settings,
    body: &mut dyn Body,
    seed: u64,
    clock: fn() -> f64,
) -> Result<Outcome, NavigationError> {
    let limits = RobotLimits { radius: setup.radius, delay: setup.delay.unwrap_or(limits.delay), ..limits };
    let mut navigator = Navigator::new(field, limits, settings)?;
    navigator.set_clock(clock);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(u64::MAX);
    let mut actors = setup.actors.clone();
    let mut tracks: Vec<Track> =
        actors.iter().map(|a| Track { seen: Obstacle { velocity: [0.0; 2], ..a.body } }).collect();
    let corners = setup.corners.clone();
    let in_time = |time: f64| corners.as_ref().map_or([0.0; 3], |c| c.pose(time));
    let target = if setup.corners.is_some() { Target::InTime(&in_time) } else { Target::Pose(setup.goal) };
    let goal = Goal { target, facing: setup.facing, speed: setup.speed };
    let half = navigator.problem().half;
    let mut outcome = Outcome { radius: setup.radius, ..Outcome::default() };
    let mut still_since = (0.0, setup.start.position());
    let ticks = (setup.duration / PERIOD).round() as usize;
    for tick in 0..ticks {
        let time = tick as f64 * PERIOD;
        look(&mut tracks, &actors, setup.sight, &mut rng);
        let obstacles: Vec<Obstacle> = tracks.iter().map(|t| t.seen).collect();
        let view = View { time, pose: body.believe(), velocity: None, obstacles: &obstacles };
        let command = navigator.tick(&view, &goal);
        note(&mut outcome, &navigator, &command);
        let pose = body.pose();
        outcome.errors.push(if setup.corners.is_some() {
            let [x, y, _] = in_time(time);
            (pose.x - x).hypot(pose.y - y)
        } else {
            distance_from(navigator.path(), pose.position())
        });
        if tick % 5 == 0 {
            outcome.samples.push(Sample {
                time,
                pose,
                obstacles: actors.iter().map(|a| a.body).collect(),
                path: navigator.path().to_vec(),
                prediction: navigator.prediction().iter().map(|s| [s.pose[0], s.pose[1]]).collect(),
            });
        }
        for actor in &actors {
            let distance = pose.distance(&Pose::new(actor.body.position[0], actor.body.position[1], 0.0));
            outcome.depth = outcome.depth.max(actor.body.radius + setup.radius - distance);
            outcome.contact |= distance < setup.contact;
        }
        for (k, at) in [pose.x, pose.y].into_iter().enumerate() {
            outcome.beyond = outcome.beyond.max(at.abs() - half[k]);
        }
        if (pose.x - still_since.1[0]).hypot(pose.y - still_since.1[1]) > STUCK {
            still_since = (time, pose.position());
        }
        outcome.time = time;
        if command.status == Status::Arrived {
            outcome.reached = true;
            break;
        }
        outcome.stuck |= setup.corners.is_none() && time - still_since.0 > STUCK_AFTER;
        if let Err(failure) = body.advance(command.velocity, PERIOD) {
            outcome.failed = Some(failure.to_string());
            break;
        }
        let pose = body.pose();
        actors.iter_mut().for_each(|actor| act(actor, &pose, setup));
    }
    outcome.reached |= setup.corners.is_some() && outcome.failed.is_none();
    let end = body.pose();
    outcome.from_goal = [end.distance(&setup.goal), instep_field::wrap(end.heading - setup.goal.heading).abs()];
    outcome.flips = navigator.flips();
    Ok(outcome)
}

fn note(outcome: &mut Outcome, navigator: &Navigator, command: &Command) {
    let [plan, solve] = navigator.times();
    if plan > 0.0 {
        outcome.plans.push(plan);
    }
    if command.status == Status::Walking {
        outcome.solves.push(solve);
    }
    if let Status::Stopped(cause) = command.status
        && !outcome.causes.contains(&cause)
    {
        outcome.causes.push(cause);
    }
    outcome.replaced = command.replaced.map(|(_, why)| why).or(outcome.replaced);
}

fn distance_from(path: &[[f64; 2]], point: [f64; 2]) -> f64 {
    let (_, s) = project(path, point);
    let at = crate::reference::along(path, s);
    if path.is_empty() { 0.0 } else { (point[0] - at[0]).hypot(point[1] - at[1]) }
}

/// One picture of the others: an alpha-beta filter each.
fn look(tracks: &mut [Track], actors: &[crate::scenario::Actor], sight: f64, rng: &mut ChaCha8Rng) {
    for (track, actor) in tracks.iter_mut().zip(actors) {
        if sight == 0.0 {
            track.seen = actor.body;
            continue;
        }
        let mut normal = || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        let error = [sight * normal(), sight * normal()];
        let missed = rng.random::<f64>() < 0.1;
        track.seen.position = track.seen.at(PERIOD);
        if missed {
            continue;
        }
        for k in 0..2 {
            let residual = actor.body.position[k] + error[k] - track.seen.position[k];
            track.seen.position[k] += TRACK[0] * residual;
            track.seen.velocity[k] += TRACK[1] / PERIOD * residual;
        }
    }
}

fn act(actor: &mut crate::scenario::Actor, robot: &Pose, setup: &Setup) {
    let body = &mut actor.body;
    let (aim, speed) = match actor.mind {
        Mind::Goes => {
            body.position = body.at(PERIOD);
            return;
        }
        Mind::Chases(speed) => (robot.position(), speed),
        Mind::Blocks(speed) => {
            // The nearest point of robot-goal that leaves a metre to the robot and more to the goal; else it stays.
            let way = [setup.goal.x - robot.x, setup.goal.y - robot.y];
            let length = way[0].hypot(way[1]).max(1e-6);
            let off = [body.position[0] - robot.x, body.position[1] - robot.y];
            let farthest = length - 1.5;
            let speed = if farthest > 1.0 { speed } else { 0.0 };
            let s = ((off[0] * way[0] + off[1] * way[1]) / length).clamp(1.0, farthest.max(1.0));
            ([robot.x + s * way[0] / length, robot.y + s * way[1] / length], speed)
        }
    };
    let way = [aim[0] - body.position[0], aim[1] - body.position[1]];
    let length = way[0].hypot(way[1]);
    let wanted = way.map(|w| if length > 1e-6 { w / length * speed.min(2.0 * length) } else { 0.0 });
    for k in 0..2 {
        body.velocity[k] += (wanted[k] - body.velocity[k]).clamp(-AGILITY * PERIOD, AGILITY * PERIOD);
    }
    body.position = body.at(PERIOD);
}

/// The three numbers of paper 4 (they satisfy MSE = MAE^2 + STD^2): mean of the distances, of their squares, their deviation.
#[must_use]
pub fn statistics(errors: impl Iterator<Item = f64> + Clone) -> [f64; 3] {
    let count = errors.clone().count() as f64;
    let mae = errors.clone().sum::<f64>() / count;
    let mse = errors.map(|e| e * e).sum::<f64>() / count;
    [mae, mse, (mse - mae * mae).max(0.0).sqrt()]
}
