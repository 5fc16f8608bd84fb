//! Memory of the ball and of opponents (paper 4, section IV-E: lost, in view, remembered, predicted).
//!
//! A ball that is seen is in view; one that leaves the view is remembered where it was, or predicted while it rolls. It
//! is lost when it has not been seen for too long, or when it should have been seen and was not: within the camera's
//! cone and range and in no opponent's or mate's shadow.

use arrayvec::ArrayVec;
use instep_field::{Pose, wrap};
use serde::{Deserialize, Serialize};

use crate::belief::{MAX_TEAM, Opponent, View};
use crate::geometry::{Circle, Point, along, distance, in_shadow, norm, sub};

/// Deceleration of a ball that rolls on turf, m/s^2 (B-Human's planner; shared by forecast and kick manager).
pub(crate) const ROLLING_DECELERATION: f64 = 0.30;
/// A ball that should be seen is given up after this, s: the detector misses some.
const GIVE_UP: f64 = 0.6;
/// A ball that cannot be seen is given up after this, s.
const FORGET: f64 = 15.0;
/// Slower than this, a ball lies, m/s.
const LIES: f64 = 0.15;
/// Share of an innovation that goes into the place of an opponent.
const OPPONENT_GAIN: f64 = 0.5;
/// Sights farther apart are two opponents, m.
const OPPONENT_GATE: f64 = 0.9;
/// An opponent that should be seen is given up after this, s; one that cannot be after `OPPONENT_FORGET`.
const OPPONENT_GIVE_UP: f64 = 1.0;
const OPPONENT_FORGET: f64 = 6.0;
/// Body radius that an opponent is remembered with, m.
const BODY: f64 = 0.3;

/// What one camera frame gave, in the robot frame.
#[derive(Debug, Clone, Default)]
pub struct Sight {
    /// The ball.
    pub ball: Option<BallSight>,
    /// Opponents' middles on the ground, m.
    pub opponents: ArrayVec<Point, MAX_TEAM>,
}

/// A ball that was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BallSight {
    /// On the ground, robot frame, m.
    pub position: Point,
    /// Standard deviation of each coordinate, m.
    pub std: f64,
}

/// What is known of the ball.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BallState {
    /// Nowhere.
    #[default]
    Lost,
    /// Seen in the last frame.
    InView,
    /// Where it lay.
    Remembered,
    /// Where it must have rolled.
    Predicted,
}

/// The ball, in the field frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BallMemory {
    /// What is known.
    pub state: BallState,
    /// Where it is by what is known, m.
    pub position: Point,
    /// m/s.
    pub velocity: Point,
    /// Standard deviation of the position, m.
    pub std: f64,
    /// When it was last seen, s.
    pub seen: f64,
    /// When this was updated last, s.
    updated: f64,
    /// How long it should have been seen and was not, s.
    missed: f64,
    /// Whether it would be seen from here, were it where it is remembered.
    pub expected: bool,
}

impl BallMemory {
    /// A ball that is known, at rest or not.
    pub fn known(time: f64, position: Point, velocity: Point, state: BallState) -> Self {
        Self { state, position, velocity, seen: time, updated: time, std: 0.1, missed: 0.0, expected: true }
    }

    /// Seconds since it was seen.
    pub fn age(&self, time: f64) -> f64 {
        (time - self.seen).max(0.0)
    }

    /// One camera frame, seen at `time` from `own` with the neck at `yaw`; `others` are all robots that cast shadows.
    pub fn update(&mut self, time: f64, own: &Pose, yaw: f64, view: &View, others: &[Circle], sight: &Sight) {
        let dt = (time - self.updated).clamp(0.0, 1.0);
        self.updated = time;
        let speed = norm(self.velocity);
        if speed > 0.0 {
            let after = (speed - ROLLING_DECELERATION * dt).max(0.0);
            self.position = along(self.position, self.velocity, dt * 0.5 * (1.0 + after / speed));
            self.velocity = [self.velocity[0] * after / speed, self.velocity[1] * after / speed];
        }
        if let Some(ball) = sight.ball {
            self.see(time, dt, own.outer_from_local(ball.position), ball.std);
            return;
        }
        if self.state == BallState::Lost {
            return;
        }
        self.std += (0.05 + 0.3 * speed) * dt;
        self.expected = would_be_seen(own, yaw, view, others, self.position);
        self.missed = if self.expected { self.missed + dt } else { 0.0 };
        let rolling = speed > LIES;
        self.state = if self.missed > GIVE_UP || self.age(time) > FORGET {
            BallState::Lost
        } else if rolling {
            BallState::Predicted
        } else {
            BallState::Remembered
        };
    }

    fn see(&mut self, time: f64, dt: f64, seen: Point, std: f64) {
        let new = self.state == BallState::Lost || self.age(time) > 1.0;
        let innovation = sub(seen, self.position);
        // A jump that noise cannot make is a kick: take the place as it is and the speed from the jump.
        let jump = norm(innovation) > 4.0 * std + 0.15;
        if new {
            (self.position, self.velocity) = (seen, [0.0; 2]);
        } else if jump && dt > 0.0 {
            self.velocity = along(self.velocity, innovation, 0.7 / dt.max(0.05));
            self.position = seen;
        } else {
            // Alpha-beta filter; the gains fit a standing ball seen ten times a second.
            self.position = along(self.position, innovation, 0.5);
            self.velocity = along(self.velocity, innovation, 0.15 / dt.max(0.05));
        }
        if norm(self.velocity) > 15.0 {
            self.velocity = [0.0; 2];
        }
        (self.std, self.seen, self.missed, self.expected) = (std, time, 0.0, true);
        self.state = BallState::InView;
    }

    /// Takes a mate's ball where the own one is lost; `age` is how long ago the mate saw it, s.
    pub fn hear(&mut self, time: f64, position: Point, velocity: Point, age: f64) {
        if self.state == BallState::Lost && age < 1.0 {
            *self = Self { seen: time - age, std: 0.4, ..Self::known(time, position, velocity, BallState::Remembered) };
        }
    }

    /// The referee has put the ball there.
    pub fn place(&mut self, time: f64, position: Point) {
        *self = Self { std: 0.3, ..Self::known(time, position, [0.0; 2], BallState::Remembered) };
    }

    /// Whether decisions may count on it.
    pub fn is_known(&self) -> bool {
        self.state != BallState::Lost
    }
}

/// Whether a ball at `point` would be found by the camera: within its cone and range and in no shadow.
fn would_be_seen(own: &Pose, yaw: f64, view: &View, others: &[Circle], point: Point) -> bool {
    let eye = own.position();
    let off = wrap(own.bearing_to(point) - own.heading - yaw).abs();
    let d = distance(eye, point);
    // Just within the edge: what flickers at the edge is no reason to give up.
    off < 0.9 * view.half_angle && d < 0.9 * view.range && !others.iter().any(|o| in_shadow(eye, point, o))
}

/// Opponents that one remembers.
#[derive(Debug, Clone, Default)]
pub struct OpponentMemory {
    tracks: ArrayVec<OpponentTrack, MAX_TEAM>,
    updated: f64,
}

#[derive(Debug, Clone, Copy)]
struct OpponentTrack {
    place: Point,
    velocity: Point,
    seen: f64,
    missed: f64,
}

impl OpponentMemory {
    /// One camera frame; `most` is how many opponents there can be.
    pub fn update(&mut self, time: f64, own: &Pose, yaw: f64, view: &View, sight: &Sight, most: usize) {
        let dt = (time - self.updated).clamp(0.0, 1.0);
        self.updated = time;
        for seen in &sight.opponents {
            let place = own.outer_from_local(*seen);
            let nearest = self
                .tracks
                .iter_mut()
                .filter(|t| t.seen < time)
                .map(|t| (distance(t.place, place), t))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            match nearest {
                Some((d, track)) if d < OPPONENT_GATE => {
                    let innovation = sub(place, track.place);
                    track.place = along(track.place, innovation, OPPONENT_GAIN);
                    track.velocity = along(track.velocity, innovation, 0.1 / dt.max(0.05));
                    (track.seen, track.missed) = (time, 0.0);
                }
                _ => {
                    if self.tracks.len() >= most.min(MAX_TEAM) {
                        let oldest =
                            (0..self.tracks.len()).min_by(|&a, &b| self.tracks[a].seen.total_cmp(&self.tracks[b].seen));
                        let Some(oldest) = oldest else { continue };
                        self.tracks.swap_remove(oldest);
                    }
                    self.tracks.push(OpponentTrack { place, velocity: [0.0; 2], seen: time, missed: 0.0 });
                }
            }
        }
        for track in &mut self.tracks {
            if track.seen < time && would_be_seen(own, yaw, view, &[], track.place) {
                track.missed += dt;
            }
        }
        self.tracks.retain(|t| t.missed < OPPONENT_GIVE_UP && time - t.seen < OPPONENT_FORGET);
    }

    /// All that are remembered.
    pub fn list(&self, out: &mut ArrayVec<Opponent, MAX_TEAM>) {
        out.clear();
        out.extend(self.tracks.iter().map(|t| Opponent {
            circle: Circle { center: t.place, radius: BODY },
            velocity: t.velocity,
            penalised: false,
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ORIGIN: Pose = Pose { x: 0.0, y: 0.0, heading: 0.0 };

    fn sight(position: Point) -> Sight {
        Sight { ball: Some(BallSight { position, std: 0.05 }), ..Sight::default() }
    }

    fn run(ball: &mut BallMemory, from: i32, to: i32, yaw: f64, others: &[Circle]) {
        for i in from..to {
            ball.update(f64::from(i) / 10.0, &ORIGIN, yaw, &View::default(), others, &Sight::default());
        }
    }

    #[test]
    fn a_ball_that_should_be_seen_and_is_not_is_lost() {
        let mut ball = BallMemory::default();
        assert_eq!(ball.state, BallState::Lost);
        ball.update(0.0, &ORIGIN, 0.0, &View::default(), &[], &sight([2.0, 0.0]));
        assert_eq!(ball.state, BallState::InView);
        run(&mut ball, 1, 6, 0.0, &[]);
        assert_eq!(ball.state, BallState::Remembered);
        run(&mut ball, 6, 9, 0.0, &[]);
        assert_eq!(ball.state, BallState::Lost);
    }

    #[test]
    fn a_ball_in_a_shadow_or_out_of_view_is_remembered_until_it_is_too_old() {
        for (yaw, others) in [(0.0, vec![Circle { center: [1.0, 0.0], radius: 0.3 }]), (1.6, vec![])] {
            let mut ball = BallMemory::default();
            ball.update(0.0, &ORIGIN, 0.0, &View::default(), &others, &sight([2.0, 0.0]));
            run(&mut ball, 1, 140, yaw, &others);
            assert_eq!(ball.state, BallState::Remembered);
            assert!(!ball.expected);
            run(&mut ball, 140, 160, yaw, &others);
            assert_eq!(ball.state, BallState::Lost);
        }
    }

    #[test]
    fn a_rolling_ball_is_predicted_where_it_rolls() {
        let mut ball = BallMemory::default();
        for i in 0..20 {
            let at = 2.0 + f64::from(i) * 0.1;
            ball.update(f64::from(i) / 10.0, &ORIGIN, 0.0, &View::default(), &[], &sight([at, 0.0]));
        }
        assert!((ball.velocity[0] - 1.0).abs() < 0.2, "{:?}", ball.velocity);
        run(&mut ball, 20, 30, 1.6, &[]);
        assert_eq!(ball.state, BallState::Predicted);
        // 1.1 s of braking from 1 m/s after the last sight at 3.9 m.
        assert!((ball.position[0] - (3.9 + 1.1 - 0.15 * 1.21)).abs() < 0.3, "{:?}", ball.position);
    }

    #[test]
    fn a_mates_ball_is_taken_only_where_the_own_one_is_lost() {
        let mut ball = BallMemory::default();
        ball.hear(1.0, [3.0, 1.0], [0.0; 2], 0.2);
        assert_eq!((ball.state, ball.position), (BallState::Remembered, [3.0, 1.0]));
        ball.update(1.1, &ORIGIN, 0.0, &View::default(), &[], &sight([2.0, 0.0]));
        ball.hear(1.2, [-3.0, 1.0], [0.0; 2], 0.2);
        assert!(ball.position[0] > 1.5);
    }

    #[test]
    fn opponents_are_followed_and_forgotten() {
        let mut memory = OpponentMemory::default();
        let mut list = ArrayVec::new();
        for i in 0..10 {
            let mut sight = Sight::default();
            sight.opponents.push([3.0 + f64::from(i) * 0.05, 0.5]);
            memory.update(f64::from(i) / 10.0, &ORIGIN, 0.0, &View::default(), &sight, 3);
        }
        memory.list(&mut list);
        assert_eq!(list.len(), 1);
        assert!((list[0].circle.center[0] - 3.45).abs() < 0.15, "{list:?}");
        for i in 10..25 {
            memory.update(f64::from(i) / 10.0, &ORIGIN, 0.0, &View::default(), &Sight::default(), 3);
        }
        memory.list(&mut list);
        assert!(list.is_empty());
    }
}
