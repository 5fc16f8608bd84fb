//! Paper 4's last experiment (figure 12 H): one robot, three opponents that stand anywhere, a ball in view, 14 x 9 m. It scores
//! within 60 s, or it does not, and then there is a cause.
//!
//! A set-up is random and repeatable: the robot in its own half, the ball 1.5 to 4 m from it in its field of view, at least a
//! metre from every line; the opponents, which stand, in the half of the field that is attacked and around the ball, no nearer
//! than 0.9 m to robot and ball. The robot is told where it was put to 0.2 m and 0.1 rad, as a handler would.

use std::sync::Arc;

use instep_behaviour::{GameState, Kicking, PlayState};
use instep_field::{Field, Pose, Side, wrap};
use instep_localisation::Start;
use instep_player::PlayerSettings;
use instep_player::legs::Stage;
use instep_robot::Robot;
use instep_sim::Entrant;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::Sight;
use super::arena::Arena;
use super::record::{Motion, frame, robot_frame};
use super::seat::{Guest, pose};
use crate::MatchError;
use crate::ball::{Ball, Whereabouts};
use crate::record::Recording;
use crate::settings::SightSettings;
use crate::sight::normal;

/// Time to score, s.
pub const LIMIT: f64 = 60.0;
/// Opponents.
pub const OPPONENTS: usize = 3;
/// Deviations of what the robot is told of its place: m, rad.
const TOLD: [f64; 2] = [0.2, 0.1];
/// Nearest that an opponent stands to robot and ball, m; and to another.
const APART: f64 = 0.9;
/// A pose this far off is a robot that is lost, m.
const ASTRAY: f64 = 0.8;
/// Ticks between two frames of the replay in space, and of the flat record.
const EVERY: [u64; 2] = [40, 200];

/// Why a trial did not end with a goal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// Fell before it had kicked.
    FellWalking,
    /// Fell in a kick or within two seconds of one.
    FellKicking,
    /// Fell after touching an opponent.
    FellTouching,
    /// The ball left the field after its kick.
    ShotWide,
    /// The ball left the field without a kick: walked into.
    WalkedOut,
    /// Time was up; it had kicked, but not often or hard enough.
    TooSlow,
    /// Time was up; it knew its place badly.
    Astray,
    /// Time was up; it did not know where the ball was for most of the time.
    BallLost,
    /// Time was up without a kick.
    NoKick,
}

impl Cause {
    /// The name in JSON.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::FellWalking => "fell_walking",
            Self::FellKicking => "fell_kicking",
            Self::FellTouching => "fell_touching",
            Self::ShotWide => "shot_wide",
            Self::WalkedOut => "walked_out",
            Self::TooSlow => "too_slow",
            Self::Astray => "astray",
            Self::BallLost => "ball_lost",
            Self::NoKick => "no_kick",
        }
    }
}

/// A set-up, in the frame of the robot's team.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Setup {
    /// The robot.
    pub robot: Pose,
    /// Where it is told to be.
    pub told: Pose,
    /// The ball, m.
    pub ball: [f64; 2],
    /// The opponents.
    pub opponents: [Pose; OPPONENTS],
}

/// A robot that touched an opponent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Touch {
    /// When, s.
    pub time: f64,
    /// What its legs did.
    pub stage: Stage,
    /// Where it was, in the frame of its team.
    pub pose: Pose,
    /// Which opponent, from 0.
    pub opponent: usize,
}

/// What came of a trial.
#[derive(Debug, Clone, Serialize)]
pub struct Outcome {
    /// Its seed.
    pub seed: u64,
    /// When the ball was in the goal, s.
    pub scored_at: Option<f64>,
    /// When the robot fell, s.
    pub fell_at: Option<f64>,
    /// Whether it touched an opponent.
    pub touched: bool,
    /// The first time that it did.
    pub touch: Option<Touch>,
    /// Kicks that it began.
    pub kicks: u32,
    /// How long it took, s.
    pub time: f64,
    /// Greatest error of the pose that it believed, m.
    pub pose_error: f64,
    /// Share of the time in which it did not know where the ball was.
    pub ball_lost: f64,
    /// Why there was no goal.
    pub cause: Option<Cause>,
    /// The set-up.
    pub setup: Setup,
}

/// A trial's record.
#[derive(Debug, Clone, Default)]
pub struct Seen {
    /// In space.
    pub motion: Motion,
    /// From above, with beliefs and decisions.
    pub flat: Recording,
}

impl Setup {
    /// The set-up of a seed on `field`, for a camera with a field of view of `width` rad.
    #[must_use]
    pub fn random(field: &Field, width: f64, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(12);
        let (half_length, half_width) = (0.5 * field.length, 0.5 * field.width);
        let mut even = {
            let rng = &mut rng;
            move |low: f64, high: f64| low + (high - low) * rng.random::<f64>()
        };
        let distance = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        // A field of this size has room: a few draws do.
        let (robot, ball) = loop {
            let robot =
                Pose::new(even(1.5 - half_length, -0.5), even(1.5 - half_width, half_width - 1.5), even(-1.2, 1.2));
            let (far, aside) = (even(1.5, 4.0), even(-0.4, 0.4) * width);
            let ball = robot.outer_from_local([far * aside.cos(), far * aside.sin()]);
            if field.contains(ball, -1.0) {
                break (robot, ball);
            }
        };
        let mut opponents = [Pose::default(); OPPONENTS];
        for i in 0..OPPONENTS {
            opponents[i] = loop {
                let place = [even(ball[0] - 1.0, half_length - 0.5), even(0.5 - half_width, half_width - 0.5)];
                let others = opponents[..i].iter().map(Pose::position).chain([robot.position(), ball]);
                if others.into_iter().all(|other| distance(other, place) > APART) {
                    break Pose::new(place[0], place[1], wrap(std::f64::consts::PI + even(-0.7, 0.7)));
                }
            };
        }
        let told = Pose::new(
            robot.x + TOLD[0] * normal(&mut rng),
            robot.y + TOLD[0] * normal(&mut rng),
            robot.heading + TOLD[1] * normal(&mut rng),
        );
        Self { robot, told, ball, opponents }
    }
}

/// Plays the trial of `seed`; records it into `seen` where it is given.
///
/// # Errors
/// When robot or player cannot be, or the physics diverge. A fall and a miss are results.
pub fn play(
    field: &Arc<Field>,
    robot: &Arc<Robot>,
    settings: &PlayerSettings,
    sight: Sight,
    seed: u64,
    seen: Option<&mut Seen>,
) -> Result<Outcome, MatchError> {
    play_for(field, robot, settings, sight, seed, LIMIT, seen)
}

/// As [`play`], with another limit of time, s.
///
/// # Errors
/// As [`play`].
pub fn play_for(
    field: &Arc<Field>,
    robot: &Arc<Robot>,
    settings: &PlayerSettings,
    sight: Sight,
    seed: u64,
    limit: f64,
    mut seen: Option<&mut Seen>,
) -> Result<Outcome, MatchError> {
    let width = robot.camera.map_or(1.0, |camera| camera.field_of_view[0]);
    let setup = Setup::random(field, width, seed);
    let entrant = |team, pose| Entrant { robot: Arc::clone(robot), team, pose };
    let start = Start::Near { pose: setup.told, position_sigma: TOLD[0], heading_sigma: TOLD[1] };
    let guest = Guest { team: Side::Home, number: 2, start, settings: settings.clone(), sight, seed };
    let mut entrants = vec![(entrant(Side::Home, setup.robot), Some(guest))];
    entrants.extend(setup.opponents.iter().map(|pose| (entrant(Side::Away, *pose), None)));
    let mut arena = Arena::new(field, entrants, &SightSettings::default())?;
    arena.place_ball(setup.ball);
    let game = GameState { state: PlayState::Playing, kicking: Kicking::Nobody, ..GameState::default() };
    arena.seats[0].tell(game);

    let mut watch = Watch::default();
    for tick in 0.. {
        let time = arena.time();
        if let Some(seen) = seen.as_deref_mut() {
            if tick % EVERY[0] == 0 {
                seen.motion.push(&arena.world);
            }
            if tick % EVERY[1] == 0 {
                let robots = (0..=OPPONENTS).map(|i| robot_frame(&arena.world, i, arena.seats.get(i), None)).collect();
                let state = format!("{:?}", arena.seats[0].player.legs().stage());
                seen.flat.frames.push(frame(&arena.world, robots, limit - time, state, [0; 2]));
            }
        }
        if time >= limit || watch.is_over() {
            break;
        }
        arena.advance()?;
        watch.look(&mut arena, field);
    }
    Ok(watch.outcome(seed, arena.time(), setup))
}

/// What is watched of a trial.
#[derive(Debug, Default)]
struct Watch {
    scored_at: Option<f64>,
    fell_at: Option<f64>,
    out: bool,
    touch: Option<Touch>,
    kicks: u32,
    kicked_at: Option<f64>,
    stage: Option<Stage>,
    pose_error: f64,
    /// Ticks in which the ball was not known, and all.
    lost: [u64; 2],
}

impl Watch {
    fn is_over(&self) -> bool {
        self.scored_at.is_some() || self.fell_at.is_some() || self.out
    }

    fn look(&mut self, arena: &mut Arena, field: &Field) {
        let (time, view, seat) = (arena.time(), arena.world.on(0), &arena.seats[0]);
        let stage = seat.player.legs().stage();
        if stage == Stage::Kick && self.stage != Some(Stage::Kick) {
            self.kicks += 1;
            self.kicked_at = Some(time);
        }
        self.stage = Some(stage);
        let error = pose(&view).distance(&seat.player.place().pose());
        // The first seconds are the handler's error.
        if time > 5.0 {
            self.pose_error = self.pose_error.max(error);
        }
        self.lost[0] += u64::from(!seat.player.beliefs().ball.is_known());
        self.lost[1] += 1;
        if view.has_fallen() {
            self.fell_at = Some(time);
        }
        let ball = arena.world.ball();
        let [x, y, z] = ball.position;
        match (Ball { position: [x, y], velocity: [0.0; 2] }).whereabouts(field) {
            Whereabouts::Inside => {}
            Whereabouts::Goal(1) if z < field.goal.height => self.scored_at = Some(time),
            _ => self.out = true,
        }
        if let Some((_, other)) = arena.met.iter().find(|(a, _)| *a == 0) {
            let touch = Touch { time, stage, pose: pose(&arena.world.on(0)), opponent: other - 1 };
            self.touch = self.touch.or(Some(touch));
        }
        arena.met.clear();
        arena.on_ball.clear();
    }

    fn outcome(self, seed: u64, time: f64, setup: Setup) -> Outcome {
        let ball_lost = self.lost[0] as f64 / self.lost[1].max(1) as f64;
        let just_kicked = |at: f64| self.kicked_at.is_some_and(|kick| at - kick < 2.0);
        let cause = match (self.scored_at, self.fell_at) {
            (Some(_), _) => None,
            (None, Some(at)) if just_kicked(at) => Some(Cause::FellKicking),
            (None, Some(_)) if self.touch.is_some() => Some(Cause::FellTouching),
            (None, Some(_)) => Some(Cause::FellWalking),
            (None, None) if self.out && self.kicks > 0 => Some(Cause::ShotWide),
            (None, None) if self.out => Some(Cause::WalkedOut),
            (None, None) if self.pose_error > ASTRAY => Some(Cause::Astray),
            (None, None) if ball_lost > 0.5 => Some(Cause::BallLost),
            (None, None) if self.kicks == 0 => Some(Cause::NoKick),
            (None, None) => Some(Cause::TooSlow),
        };
        Outcome {
            seed,
            scored_at: self.scored_at,
            fell_at: self.fell_at,
            touched: self.touch.is_some(),
            touch: self.touch,
            kicks: self.kicks,
            time,
            pose_error: self.pose_error,
            ball_lost,
            cause,
            setup,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn a_touch_is_told_with_its_time_and_its_opponent() {
        let robot = Arc::new(Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/artemis")).unwrap());
        let field = Arc::new(Field::named("adult-2024").unwrap());
        let entrant = |team, x| (Entrant { robot: Arc::clone(&robot), team, pose: Pose::new(x, 0.0, 0.0) }, None);
        let mut others = vec![entrant(Side::Away, 2.0), entrant(Side::Away, 4.0)];
        let kicks = instep_behaviour::KickTable { kick: Vec::new() };
        let settings = PlayerSettings::load(&robot, instep_behaviour::Strategy::default(), &kicks).unwrap();
        let (start, sight) = (Start::Anywhere, Sight::Simulated);
        let guest = Guest { team: Side::Home, number: 2, start, settings, sight, seed: 1 };
        others.insert(0, (entrant(Side::Home, -2.0).0, Some(guest)));
        let mut arena = Arena::new(&field, others, &SightSettings::default()).unwrap();
        let mut watch = Watch::default();
        let run = |arena: &mut Arena, watch: &mut Watch| {
            for _ in 0..20 {
                arena.advance().unwrap();
                watch.look(arena, &field);
            }
        };
        run(&mut arena, &mut watch);
        assert_eq!(watch.touch, None);
        // The second opponent is put into its arms.
        arena.carry(2, Pose::new(-1.85, 0.0, 0.0)).unwrap();
        let before = arena.time();
        run(&mut arena, &mut watch);
        let touch = watch.touch.unwrap();
        assert!(touch.opponent == 1 && (before..before + 0.03).contains(&touch.time), "{touch:?}");
        assert!((touch.pose.x + 2.0).abs() < 0.1, "{touch:?}");
    }

    #[test]
    fn every_setup_has_its_ball_in_view_and_room_around_everybody() {
        let field = Field::named("adult-2024").unwrap();
        for seed in 0..300 {
            let setup = Setup::random(&field, 1.5, seed);
            let [x, y] = setup.robot.local_from_outer(setup.ball);
            assert!(y.atan2(x).abs() < 0.75 && (1.5..4.0).contains(&x.hypot(y)), "{setup:?}");
            assert!(field.contains(setup.ball, -1.0) && field.contains(setup.robot.position(), -0.5));
            for opponent in &setup.opponents {
                let off = [opponent.x - setup.ball[0], opponent.y - setup.ball[1]];
                assert!(off[0].hypot(off[1]) > APART && opponent.distance(&setup.robot) > APART);
                assert!(field.contains(opponent.position(), 0.0));
            }
            assert_eq!(setup, Setup::random(&field, 1.5, seed));
        }
        assert_ne!(Setup::random(&field, 1.5, 1), Setup::random(&field, 1.5, 2));
    }
}
