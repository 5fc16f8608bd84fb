//! What the server tells in a cycle, as plain data in SI units and radians.
//!
//! Unknown expressions are counted and left out: a newer server may say more. A number that is none leaves its reading as it
//! was. Frames: the server's world (x toward the right team's goal, y to its left, z up), torso and camera.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use nalgebra::Vector3;

use crate::expression::{Expressions, Item, List, Malformed};

/// Most things that are taken from one picture.
const MOST_SEEN: usize = 512;
/// Most messages that are taken from one cycle.
const MOST_HEARD: usize = 32;

/// A joint's reading.
#[derive(Debug, Clone, PartialEq)]
pub struct JointReading {
    /// The server's name for its sensor, like `q_llj1`.
    pub name: String,
    /// rad
    pub angle: f64,
    /// rad/s
    pub speed: f64,
}

/// A point that was seen, in the camera's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Polar {
    /// m
    pub distance: f64,
    /// To the left, rad.
    pub azimuth: f64,
    /// Up, rad.
    pub elevation: f64,
}

impl Polar {
    /// The point in the camera's frame (x ahead, y left, z up), m.
    #[must_use]
    pub fn point(&self) -> Vector3<f64> {
        let (se, ce) = self.elevation.sin_cos();
        let (sa, ca) = self.azimuth.sin_cos();
        self.distance * Vector3::new(ce * ca, ce * sa, se)
    }
}

/// A robot that was seen.
#[derive(Debug, Clone, PartialEq)]
pub struct SeenRobot {
    /// Its team.
    pub team: String,
    /// Its number.
    pub number: u8,
    /// Its parts by name: head, feet.
    pub parts: Vec<(String, Polar)>,
}

/// What one picture showed.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Picture {
    /// The ball.
    pub ball: Option<Polar>,
    /// Landmarks by the server's name, like `l_luf`.
    pub landmarks: Vec<(String, Polar)>,
    /// Robots, the own parts among them.
    pub robots: Vec<SeenRobot>,
}

/// The game.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GameNews {
    /// s
    pub time: f64,
    /// The server's name of the play mode.
    pub mode: String,
    /// Name of the left team.
    pub left: Option<String>,
    /// Name of the right team.
    pub right: Option<String>,
    /// Goals of the left and the right team.
    pub score: [u32; 2],
}

/// What the server tells in a cycle.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Perception {
    /// s
    pub time: Option<f64>,
    /// The game.
    pub game: Option<GameNews>,
    /// `world_from_torso` (w, x, y, z), as the server has it, to three digits.
    pub orientation: Option<[f64; 4]>,
    /// The torso in the world, m, to three digits.
    pub position: Option<[f64; 3]>,
    /// Angular velocity of the torso, in its frame, rad/s.
    pub gyro: Option<[f64; 3]>,
    /// Specific force in the torso's frame, m/s^2.
    pub accelerometer: Option<[f64; 3]>,
    /// Joints.
    pub joints: Vec<JointReading>,
    /// The picture, every second cycle.
    pub picture: Option<Picture>,
    /// What was heard: bytes of a speaker.
    pub heard: Vec<Vec<u8>>,
    /// Expressions that nobody knows.
    pub unknown: usize,
}

fn three(list: List, from: usize) -> Option<[f64; 3]> {
    Some([list.number(from)?, list.number(from + 1)?, list.number(from + 2)?])
}

fn name(atom: Option<&[u8]>) -> Option<String> {
    std::str::from_utf8(atom?).ok().map(str::to_owned)
}

fn polar(list: List) -> Option<Polar> {
    let list = list.about(b"pol")?;
    let [distance, azimuth, elevation] = three(list, 1)?;
    (distance >= 0.0).then(|| Polar { distance, azimuth: azimuth.to_radians(), elevation: elevation.to_radians() })
}

impl Perception {
    /// Reads a message.
    ///
    /// # Errors
    /// [`Malformed`] when it is none.
    pub fn read(text: &[u8], expressions: &mut Expressions) -> Result<Self, Malformed> {
        let all = expressions.parse(text)?;
        let mut perception = Self::default();
        for list in all.lists() {
            perception.take(list);
        }
        Ok(perception)
    }

    /// Whether the message has what a cycle's perception always has.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.time.is_some() && self.game.is_some() && !self.joints.is_empty()
    }

    fn take(&mut self, list: List) {
        match list.head() {
            b"time" => self.time = list.about(b"now").and_then(|now| now.number(1)),
            b"GS" => self.game = game(list),
            b"quat" => {
                let quat = list.about(b"q");
                self.orientation = quat.and_then(|q| Some([q.number(1)?, q.number(2)?, q.number(3)?, q.number(4)?]));
            }
            b"pos" => self.position = list.about(b"p").and_then(|p| three(p, 1)),
            b"GYR" => {
                let rate = list.about(b"rt").and_then(|rate| three(rate, 1));
                self.gyro = rate.map(|rate| rate.map(f64::to_radians));
            }
            b"ACC" => self.accelerometer = list.about(b"a").and_then(|a| three(a, 1)),
            b"HJ" => {
                let read = |part: &[u8]| list.about(part).and_then(|reading| reading.number(1)).map(f64::to_radians);
                let named = list.about(b"n").and_then(|n| name(n.atom(1)));
                if let (Some(name), Some(angle), Some(speed)) = (named, read(b"ax"), read(b"vx")) {
                    self.joints.push(JointReading { name, angle, speed });
                }
            }
            b"See" => self.picture = Some(picture(list)),
            b"MIC" => {
                for said in list.lists().take(MOST_HEARD) {
                    if let Some(Ok(bytes)) = said.atom(1).map(|text| STANDARD.decode(text)) {
                        self.heard.push(bytes);
                    }
                }
            }
            b"syn" | b"TCH" => {}
            _ => self.unknown += 1,
        }
    }
}

fn game(list: List) -> Option<GameNews> {
    let count = |part: &[u8]| list.about(part).and_then(|n| n.number(1)).map_or(0, |n| n.clamp(0.0, 1e6) as u32);
    Some(GameNews {
        time: list.about(b"t")?.number(1)?,
        mode: name(list.about(b"pm")?.atom(1))?,
        left: list.about(b"tl").and_then(|team| name(team.atom(1))),
        right: list.about(b"tr").and_then(|team| name(team.atom(1))),
        score: [count(b"sl"), count(b"sr")],
    })
}

fn picture(list: List) -> Picture {
    let mut picture = Picture::default();
    for seen in list.lists().take(MOST_SEEN) {
        match seen.head() {
            b"B" => picture.ball = polar(seen),
            b"P" => {
                let number = seen.about(b"id").and_then(|id| id.number(1));
                let team = seen.about(b"team").and_then(|team| name(team.atom(1)));
                let (Some(team), Some(number)) = (team, number) else { continue };
                let parts = seen
                    .items()
                    .filter_map(|item| if let Item::List(list) = item { Some(list) } else { None })
                    .filter_map(|part| Some((name(Some(part.head()))?, polar(part)?)))
                    .collect();
                picture.robots.push(SeenRobot { team, number: number.clamp(0.0, 255.0) as u8, parts });
            }
            head => {
                if let (Some(name), Some(at)) = (name(Some(head)), polar(seen)) {
                    picture.landmarks.push((name, at));
                }
            }
        }
    }
    picture
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A message of version 0.2.1, shortened.
    const MESSAGE: &str = "(time (now 3.02))(GS (t 1.5)(pm KickOff_Left)(tl Instep)(sl 1)(sr 0))(quat (n torso_quat) \
        (q 0.707 0.0 0.0 -0.707))(pos (n torso_pos) (p -3.0 20.5 0.673))(GYR (n torso_gyro) (rt 90.0 0.0 -1.5))(ACC (n torso_acc) \
        (a 0.1 -0.2 9.8))(HJ (n q_hj1)(ax 90.0)(vx -45.0))(HJ (n q_hj2)(ax x)(vx 0.0))(See (B (pol 4.5 90.0 0.0))(l_luf (pol \
        10.0 0.0 -5.0))(P (team Other)(id 3)(head (pol 2.0 0.0 0.0))(lfoot (pol 2.2 1.0 -20.0))))(MIC hear (12 aGVsbG8=)\
        (3 ?))(new (thing 1))";

    #[test]
    fn a_cycle_of_the_server_is_understood() {
        let perception = Perception::read(MESSAGE.as_bytes(), &mut Expressions::default()).unwrap();
        assert!(perception.is_complete());
        assert_eq!(perception.time, Some(3.02));
        let game = perception.game.unwrap();
        assert_eq!(
            (game.mode.as_str(), game.left.as_deref(), game.right, game.score),
            ("KickOff_Left", Some("Instep"), None, [1, 0])
        );
        assert_eq!(perception.gyro.unwrap()[0], std::f64::consts::FRAC_PI_2);
        // A number that is none leaves its joint out.
        assert_eq!(perception.joints.len(), 1);
        assert_eq!(perception.joints[0].speed, -std::f64::consts::FRAC_PI_4);
        let picture = perception.picture.unwrap();
        assert!((picture.ball.unwrap().point() - Vector3::new(0.0, 4.5, 0.0)).norm() < 1e-12);
        assert_eq!(picture.landmarks[0].0, "l_luf");
        assert_eq!((picture.robots[0].number, picture.robots[0].parts.len()), (3, 2));
        assert_eq!((perception.heard, perception.unknown), (vec![b"hello".to_vec()], 1));
    }

    proptest! {
        #[test]
        fn a_message_with_holes_is_read_or_refused(cut in prop::collection::vec((0_usize..900, any::<u8>()), 0..40)) {
            let mut text = MESSAGE.as_bytes().to_vec();
            for (at, byte) in cut {
                let at = at % text.len();
                text[at] = byte;
            }
            if let Ok(perception) = Perception::read(&text, &mut Expressions::default()) {
                let finite = |numbers: &[f64]| numbers.iter().all(|x| x.is_finite());
                prop_assert!(perception.position.is_none_or(|p| finite(&p)));
                prop_assert!(perception.joints.iter().all(|j| j.angle.is_finite() && j.speed.is_finite()));
            }
        }
    }
}
