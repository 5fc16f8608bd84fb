//! What is asked of a localiser: named set-ups of path, detector and odometry.
//!
//! The set-up `star` is paper 4's (V-A-3): a five-pointed star on the right of the field, its range errors, at most
//! seven landmarks a frame. What the paper does not say (how errors hang together in time, misses, false detections,
//! the odometry's drift) is chosen here, and every other scenario changes one thing of it.

use instep_field::Pose;

use crate::LocalisationError;

/// A set-up.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// Its name on the command line.
    pub name: &'static str,
    /// One line for people.
    pub title: &'static str,
    /// The field, by name.
    pub field: &'static str,
    /// s
    pub duration: f64,
    /// Walking speed, m/s.
    pub speed: f64,
    /// Circumradius of the star, m.
    pub star_radius: f64,
    /// Middle of the star, m.
    pub star_center: [f64; 2],
    /// Frames a second.
    pub rate: f64,
    /// From picture to arrival, s.
    pub delay: f64,
    /// Most landmarks of a frame, nearest first.
    pub most: usize,
    /// Share of the landmarks in view that are missed.
    pub missed: f64,
    /// Share of the detections that are false.
    pub false_share: f64,
    /// Share of false detections that stay in the world for 2 s.
    pub ghost_share: f64,
    /// Share of detections with a wrong class.
    pub confused: f64,
    /// Share of the errors' variance that lasts (1 s) for each landmark; the rest is new in each frame.
    pub lasting: f64,
    /// Common scale error of ranges, one standard deviation (lasts 20 s).
    pub range_scale: f64,
    /// The paper's per cents read as a bound (uniform) instead of one standard deviation.
    pub bounded: bool,
    /// Factor on all odometry errors.
    pub odometry: f64,
    /// Pieces of lines are seen too.
    pub lines: bool,
    /// What happens to the robot, or to its start.
    pub event: Event,
}

/// Something that a localiser must get over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event {
    /// Nothing: the start is known.
    None,
    /// At 5 s the robot is put anywhere on the field, any way round; the gyro runs on.
    Carried,
    /// The start is wrong by so much, m, and up to 0.2 rad, and is said to be good to 0.1 m.
    StartError([f64; 2]),
    /// Only the half is known at the start.
    OwnHalf,
}

const STAR: Scenario = Scenario {
    name: "star",
    title: "paper 4's star, errors that last",
    field: "adult-2024",
    duration: 100.0,
    speed: 0.5,
    star_radius: 2.0,
    star_center: [3.5, 0.0],
    rate: 20.0,
    delay: 0.0,
    most: 7,
    missed: 0.2,
    false_share: 0.1,
    ghost_share: 0.05,
    confused: 0.02,
    lasting: 0.5,
    range_scale: 0.02,
    bounded: false,
    odometry: 1.0,
    lines: false,
    event: Event::None,
};

/// All scenarios.
pub const SCENARIOS: &[Scenario] = &[
    STAR,
    Scenario { name: "star-white", title: "errors new in each frame", lasting: 0.0, range_scale: 0.0, ..STAR },
    Scenario { name: "star-bound", title: "the paper's per cents as a bound", bounded: true, ..STAR },
    Scenario { name: "false-30", title: "30 % false detections", false_share: 0.3, ..STAR },
    Scenario { name: "false-60", title: "60 % false detections", false_share: 0.6, ghost_share: 0.10, ..STAR },
    Scenario { name: "missed-60", title: "60 % missed", missed: 0.6, ..STAR },
    Scenario { name: "few", title: "at most two landmarks a frame", most: 2, ..STAR },
    Scenario { name: "slow", title: "5 frames a second", rate: 5.0, ..STAR },
    Scenario { name: "late", title: "detections 200 ms late", delay: 0.2, ..STAR },
    Scenario {
        name: "lasting",
        title: "90 % of the variance lasts, scale 4 %",
        lasting: 0.9,
        range_scale: 0.04,
        ..STAR
    },
    Scenario { name: "slipping", title: "odometry errors threefold", odometry: 3.0, ..STAR },
    Scenario { name: "lines", title: "pieces of lines too", lines: true, ..STAR },
    Scenario {
        name: "large",
        title: "22 m by 14 m, 0.8 m/s",
        field: "hsl-l",
        speed: 0.8,
        star_radius: 3.0,
        star_center: [5.5, 0.0],
        ..STAR
    },
    Scenario {
        name: "carried",
        title: "carried away, the gyro runs on",
        duration: 15.0,
        event: Event::Carried,
        ..STAR
    },
    Scenario {
        name: "start-error",
        title: "start wrong by 0.3 to 0.8 m",
        duration: 10.0,
        event: Event::StartError([0.3, 0.8]),
        ..STAR
    },
    Scenario {
        name: "own-half",
        title: "start anywhere in the own half",
        star_center: [-3.5, 0.0],
        duration: 10.0,
        event: Event::OwnHalf,
        ..STAR
    },
];

impl Scenario {
    /// The scenario of this name.
    ///
    /// # Errors
    /// [`LocalisationError::Unknown`] with the names that there are.
    pub fn named(name: &str) -> Result<&'static Scenario, LocalisationError> {
        SCENARIOS.iter().find(|s| s.name == name).ok_or_else(|| LocalisationError::Unknown {
            name: name.to_owned(),
            known: SCENARIOS.iter().map(|s| s.name).collect::<Vec<_>>().join(", "),
        })
    }

    /// Where the robot is after `time` seconds of its star: straight lines at the scenario's speed, turns on the spot
    /// at 1 rad/s.
    pub fn star(&self, time: f64) -> Pose {
        const TURN: f64 = 0.8 * std::f64::consts::PI;
        let corner = |k: usize| {
            // Every second corner of a pentagon.
            let angle = TURN * k as f64;
            let [x, y] = self.star_center;
            [x + self.star_radius * angle.cos(), y + self.star_radius * angle.sin()]
        };
        let [a, b] = [corner(0), corner(1)];
        let side = (b[0] - a[0]).hypot(b[1] - a[1]);
        let (walk, turn) = (side / self.speed, TURN);
        let leg = (time / (walk + turn)).floor().max(0.0);
        let rest = time - leg * (walk + turn);
        let k = leg as usize;
        let [from, to] = [corner(k), corner(k + 1)];
        let heading = (to[1] - from[1]).atan2(to[0] - from[0]);
        let share = (rest / walk).min(1.0);
        let at = [from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])];
        Pose::new(at[0], at[1], heading + (rest - walk).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use instep_field::wrap;

    use super::*;

    #[test]
    fn the_star_is_continuous_and_closes() {
        let mut before = STAR.star(0.0);
        let mut turning = 0;
        for k in 1..20_000 {
            let now = STAR.star(f64::from(k) * 0.01);
            assert!(now.distance(&before) < 0.0051 && wrap(now.heading - before.heading).abs() < 0.0101, "{k}");
            turning += usize::from(now.distance(&before) == 0.0);
            before = now;
        }
        assert!(turning > 1000);
        let side = 2.0 * 2.0 * (0.4 * std::f64::consts::PI).sin();
        let lap = 5.0 * (side / 0.5 + 0.8 * std::f64::consts::PI);
        assert!(STAR.star(lap).distance(&STAR.star(0.0)) < 1e-9);
    }
}
