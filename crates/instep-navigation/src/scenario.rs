//! What is asked of navigation: named set-ups of start, goal and who is in the way.
//!
//! `star` and `two-obstacles` are paper 4's (Fig 9 C and D; places of the discs chosen so that one way is shorter by more
//! than 0.3 m, else runs part); `three-obstacles` is like RAVEN's (arXiv 2607.15701); opponents as in our facts on navigation.

use instep_field::Pose;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::reference::TimedCorners;
use crate::{Facing, NavigationError, Obstacle, RobotLimits};

/// What somebody does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mind {
    /// Goes on as it is, or stands.
    Goes,
    /// Walks to the robot at this speed, m/s.
    Chases(f64),
    /// Steps between robot and goal at this speed, m/s.
    Blocks(f64),
}

/// Somebody in the way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Actor {
    /// Truly.
    pub body: Obstacle,
    /// What it does.
    pub mind: Mind,
}

/// One run.
#[derive(Debug, Clone)]
pub struct Setup {
    /// The robot at its start.
    pub start: Pose,
    /// Where to.
    pub goal: Pose,
    /// Corners to be followed in time, in place of the goal.
    pub corners: Option<TimedCorners>,
    /// Where it looks.
    pub facing: Facing,
    /// m/s
    pub speed: f64,
    /// The others.
    pub actors: Vec<Actor>,
    /// Distance of middles that is a contact, m; 0: discs that nobody can touch.
    pub contact: f64,
    /// Of the robot, m.
    pub radius: f64,
    /// Delay of the robot, s; `None`: its own.
    pub delay: Option<f64>,
    /// Longest time, s.
    pub duration: f64,
    /// Positions of the others are seen with this error (m), and not at all in one of ten pictures.
    pub sight: f64,
}

/// A set-up by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scenario {
    /// On the command line.
    pub name: &'static str,
    /// For people.
    pub title: &'static str,
    /// Runs, where nobody says how many.
    pub runs: usize,
}

/// Delays of `three-obstacles`, s.
pub const DELAYS: [f64; 4] = [0.0, 0.06, 0.1, 0.2];

/// All scenarios.
pub const SCENARIOS: &[Scenario] = &[
    Scenario { name: "star", title: "paper 4's star, 0.5 m/s, error at equal time", runs: 3 },
    Scenario { name: "two-obstacles", title: "two discs of radius 1.25 m (paper 4, Fig 9 D)", runs: 6 },
    Scenario {
        name: "three-obstacles",
        title: "three discs of radius 1 m on 10 m, 0.9 m/s, delays 0 to 0.2 s",
        runs: 48,
    },
    Scenario { name: "crossing", title: "two opponents cross at 0.3 to 0.9 m/s", runs: 100 },
    Scenario { name: "blocking", title: "an opponent steps between robot and goal at 0.4 m/s", runs: 100 },
    Scenario { name: "wall", title: "three opponents side by side", runs: 100 },
    Scenario { name: "chasing", title: "an opponent walks at the robot at 0.5 m/s", runs: 100 },
    Scenario { name: "head-on", title: "an opponent comes straight on at 0.5 m/s", runs: 100 },
    Scenario { name: "two-chasers", title: "two opponents walk at the robot at 0.4 m/s", runs: 100 },
    Scenario { name: "sideways", title: "1.5 m to the side, heading held", runs: 10 },
    Scenario { name: "round-ball", title: "half round a ball, facing it", runs: 10 },
    Scenario { name: "behind-ball", title: "behind a ball 4 m away, two opponents on the way", runs: 100 },
    Scenario { name: "start-inside", title: "starts inside a keep-out", runs: 10 },
    Scenario { name: "goal-inside", title: "the goal lies inside a keep-out", runs: 10 },
    Scenario { name: "off-field", title: "the goal lies off the field", runs: 10 },
    Scenario { name: "enclosed", title: "opponents all round the robot", runs: 3 },
];

impl Scenario {
    /// # Errors
    /// [`NavigationError::Unknown`] with the names that there are.
    pub fn named(name: &str) -> Result<&'static Self, NavigationError> {
        SCENARIOS.iter().find(|s| s.name == name).ok_or_else(|| NavigationError::Unknown {
            name: name.to_owned(),
            known: SCENARIOS.iter().map(|s| s.name).collect::<Vec<_>>().join(", "),
        })
    }

    /// Run number `run` of a seed.
    #[must_use]
    pub fn setup(&self, seed: u64, run: usize, limits: &RobotLimits) -> Setup {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(run as u64);
        let mut even = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
        let goes = |x: f64, y: f64, velocity: [f64; 2], radius: f64| Actor {
            body: Obstacle { position: [x, y], velocity, radius },
            mind: Mind::Goes,
        };
        let opponent = |x: f64, y: f64, velocity: [f64; 2]| goes(x, y, velocity, 0.5);
        let base = Setup {
            start: Pose::new(-4.0, even(-1.5, 1.5), even(-0.5, 0.5)),
            goal: Pose::new(4.0, even(-1.5, 1.5), even(-0.8, 0.8)),
            corners: None,
            facing: Facing::Path,
            speed: f64::INFINITY,
            actors: Vec::new(),
            contact: 0.5,
            radius: 0.25,
            delay: None,
            duration: 60.0,
            sight: 0.1,
        };
        let (from, to) = (base.start, base.goal);
        let on_way = |share: f64| [from.x + share * (to.x - from.x), from.y + share * (to.y - from.y)];
        let disc = Setup { contact: 0.0, radius: 0.0, sight: 0.0, ..base.clone() };
        match self.name {
            "star" => {
                let corners = TimedCorners::star(2);
                let [x, y, heading] = corners.pose(0.0);
                let duration = corners.duration().min(100.0);
                Setup { start: Pose::new(x, y, heading), corners: Some(corners), duration, ..disc }
            }
            "two-obstacles" => Setup {
                start: Pose::new(-1.0, 0.0, 0.0),
                goal: Pose::new(6.3, 0.0, 0.0),
                speed: 0.5,
                actors: vec![goes(1.5, 0.6, [0.0; 2], 1.25), goes(4.2, -0.6, [0.0; 2], 1.25)],
                ..disc
            },
            "three-obstacles" => {
                let actors = [-3.0, 0.0, 3.0].map(|x| goes(x + even(-0.4, 0.4), even(-1.2, 1.2), [0.0; 2], 1.0));
                Setup {
                    start: Pose::new(-5.0, 0.0, 0.0),
                    goal: Pose::new(5.0, 0.0, 0.0),
                    speed: 0.9,
                    actors: actors.to_vec(),
                    delay: Some(DELAYS[run % DELAYS.len()]),
                    ..disc
                }
            }
            "crossing" => {
                let speed = 0.8 * limits.forward;
                let actors = [0.35, 0.7].map(|share| {
                    let v = even(0.3, 0.9) * if even(-1.0, 1.0) > 0.0 { 1.0 } else { -1.0 };
                    let [x, y] = on_way(share);
                    let meets = share * from.distance(&to) / speed + even(-0.5, 0.5);
                    opponent(x, y - v * meets, [0.0, v])
                });
                Setup { actors: actors.to_vec(), ..base }
            }
            "blocking" => {
                let [x, y] = on_way(even(0.4, 0.6));
                let body = Obstacle { position: [x, y], velocity: [0.0; 2], radius: 0.5 };
                Setup { actors: vec![Actor { body, mind: Mind::Blocks(0.4) }], ..base }
            }
            "wall" => {
                let [x, y] = on_way(even(0.4, 0.6));
                let shift = even(-0.3, 0.3);
                let actors = [-1.0, 0.0, 1.0].map(|k| opponent(x, y + shift + k, [0.0; 2]));
                Setup { actors: actors.to_vec(), ..base }
            }
            "chasing" | "two-chasers" => {
                let two = self.name == "two-chasers";
                let shares = if two { [0.5, 0.7] } else { [0.6, 0.6] };
                let actors = shares.map(|share| {
                    let [x, y] = on_way(share);
                    let side = if even(-1.0, 1.0) > 0.0 { 1.0 } else { -1.0 };
                    let position = [x, y + side * even(0.5, 2.0)];
                    let body = Obstacle { position, velocity: [0.0; 2], radius: 0.5 };
                    Actor { body, mind: Mind::Chases(if two { 0.4 } else { 0.5 }) }
                });
                Setup { actors: actors[..if two { 2 } else { 1 }].to_vec(), ..base }
            }
            "head-on" => {
                let [x, y] = on_way(0.8);
                let way = [(from.x - to.x) / from.distance(&to), (from.y - to.y) / from.distance(&to)];
                Setup { actors: vec![opponent(x, y + even(-0.2, 0.2), way.map(|w| 0.5 * w))], ..base }
            }
            "sideways" => {
                let goal = Pose::new(from.x, from.y + 1.5, from.heading);
                Setup { goal, facing: Facing::Hold(from.heading), ..base }
            }
            "round-ball" => {
                let ball = [0.0, even(-1.0, 1.0)];
                let start = Pose::new(ball[0] - 0.8, ball[1], 0.0);
                let goal = Pose::new(ball[0] + 0.8, ball[1] + 0.1, std::f64::consts::PI);
                let actors = vec![goes(ball[0], ball[1], [0.0; 2], 0.4)];
                Setup {
                    start,
                    goal,
                    facing: Facing::Point(ball),
                    actors,
                    contact: 0.2,
                    radius: 0.2,
                    sight: 0.0,
                    ..base
                }
            }
            "behind-ball" => {
                // The ball 4 m away in any direction that keeps it on the field; the robot is to stand 0.3 m behind it.
                let start = Pose::new(even(-2.5, 0.0), even(-1.5, 1.5), even(-3.1, 3.1));
                let away = even(-0.7, 0.7);
                let ball = [start.x + 4.0 * away.cos(), start.y + 4.0 * away.sin()];
                let kick = even(-1.5, 1.5);
                let goal = Pose::new(ball[0] - 0.3 * kick.cos(), ball[1] - 0.3 * kick.sin(), kick);
                let mut between = |share: f64| {
                    let side = even(-0.6, 0.6);
                    let [c, s] = [away.cos(), away.sin()];
                    let speed = even(0.0, 0.3);
                    let turn = even(-3.1, 3.1);
                    // It wanders off: nobody stands on the ball for good.
                    opponent(
                        start.x + 4.0 * share * c - side * s,
                        start.y + 4.0 * share * s + side * c,
                        [speed * turn.cos(), speed * turn.sin()],
                    )
                };
                let actors = vec![between(0.35), between(0.6)];
                Setup { start, goal, actors, duration: 40.0, ..base }
            }
            "start-inside" => Setup {
                actors: vec![opponent(from.x + 0.35, from.y + even(-0.2, 0.2), [0.0; 2])],
                contact: 0.1,
                ..base
            },
            "goal-inside" => Setup { actors: vec![opponent(to.x + even(-0.2, 0.2), to.y + 0.2, [0.0; 2])], ..base },
            "off-field" => Setup { goal: Pose::new(even(10.0, 12.0), to.y, 0.0), ..base },
            _ => {
                let ring = (0..8).map(|k| {
                    let (s, c) = (f64::from(k) * std::f64::consts::FRAC_PI_4).sin_cos();
                    opponent(from.x + 1.3 * c, from.y + 1.3 * s, [0.0; 2])
                });
                Setup { actors: ring.collect(), duration: 6.0, ..base }
            }
        }
    }
}
