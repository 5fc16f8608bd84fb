//! The way of the swing foot: one sixth-order polynomial an axis in the normalised phase of the step (paper 4, section
//! IV-F-1), whose mid-swing waypoint is exposed (its eq 14).
//!
//! Seven conditions: position at rest without acceleration at lift-off, a position at phase 1/2, and position, velocity and
//! no acceleration at phase 1. They may be changed on the way. The polynomial is written in a basis that meets the
//! conditions one by one, so there is nothing to solve.

use nalgebra::Vector3;

/// A swing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Swing {
    /// Where the foot left the ground, m.
    pub from: Vector3<f64>,
    /// Where it is at phase 1/2, m; `None`, midway, lifted by `clearance`.
    pub waypoint: Option<Vector3<f64>>,
    /// Height of the waypoint over the lower of both ends where none is given, m.
    pub clearance: f64,
    /// Where it lands at phase 1, m.
    pub to: Vector3<f64>,
    /// How fast it comes down at phase 1 and beyond, m/s.
    pub landing_speed: f64,
    /// How long it takes, s.
    pub duration: f64,
}

/// A point on the way: position (m), velocity (m/s) and acceleration (m/s^2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Waypoint {
    /// m.
    pub position: Vector3<f64>,
    /// m/s.
    pub velocity: Vector3<f64>,
    /// m/s^2.
    pub acceleration: Vector3<f64>,
}

/// Values of a polynomial with its first two derivatives by phase.
type Values = [f64; 3];

/// From 0 to 1 without velocity or acceleration at either end: 10 s^3 - 15 s^4 + 6 s^5; 1/2 at 1/2.
fn rise(s: f64) -> Values {
    let r = 1.0 - s;
    [s * s * s * (10.0 - 15.0 * s + 6.0 * s * s), 30.0 * s * s * r * r, 60.0 * s * r * (1.0 - 2.0 * s)]
}

/// 1 at 1/2; zero with two derivatives at both ends: 64 s^3 (1 - s)^3.
fn bump(s: f64) -> Values {
    let p = s * (1.0 - s);
    let slope = 1.0 - 2.0 * s;
    [64.0 * p * p * p, 192.0 * p * p * slope, 384.0 * p * (slope * slope - p)]
}

/// Zero at both ends, with a derivative of 1 at 1: -4 s^3 + 7 s^4 - 3 s^5; -5/32 at 1/2.
fn arrival(s: f64) -> Values {
    [
        s * s * s * (-4.0 + 7.0 * s - 3.0 * s * s),
        s * s * (-12.0 + 28.0 * s - 15.0 * s * s),
        s * (-24.0 + 84.0 * s - 60.0 * s * s),
    ]
}

impl Swing {
    /// Where the foot is to be at `phase`; beyond phase 1 it goes straight down.
    #[must_use]
    pub fn at(&self, phase: f64) -> Waypoint {
        let landing = Vector3::new(0.0, 0.0, -self.landing_speed);
        if phase >= 1.0 {
            let position = self.to + landing * ((phase - 1.0) * self.duration);
            return Waypoint { position, velocity: landing, acceleration: Vector3::zeros() };
        }
        let s = phase.max(0.0);
        let speed = landing * self.duration;
        // Where rise and arrival alone would be at 1/2; the bump makes up for the rest.
        let middle = 0.5 * (self.from + self.to) - speed * (5.0 / 32.0);
        let waypoint = self.waypoint.unwrap_or_else(|| {
            let level = 0.5 * (self.from + self.to);
            Vector3::new(
                level.x,
                level.y,
                self.from.z.max(self.to.z).min(level.z + 0.5 * self.clearance) + self.clearance,
            )
        });
        let (rise, bump, arrival) = (rise(s), bump(s), arrival(s));
        let order = |k: usize| (self.to - self.from) * rise[k] + speed * arrival[k] + (waypoint - middle) * bump[k];
        Waypoint {
            position: self.from + order(0),
            velocity: order(1) / self.duration,
            acceleration: order(2) / (self.duration * self.duration),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn swing() -> Swing {
        Swing {
            from: Vector3::new(-0.2, 0.1, 0.0),
            waypoint: Some(Vector3::new(0.15, 0.12, 0.08)),
            clearance: 0.07,
            to: Vector3::new(0.3, 0.05, 0.01),
            landing_speed: 0.15,
            duration: 0.4,
        }
    }

    #[test]
    fn all_seven_conditions_hold() {
        let swing = swing();
        let (start, middle, end) = (swing.at(0.0), swing.at(0.5), swing.at(1.0 - 1e-12));
        assert!((start.position - swing.from).norm() < 1e-12);
        assert!(start.velocity.norm() < 1e-12 && start.acceleration.norm() < 1e-12);
        assert!((middle.position - swing.waypoint.unwrap()).norm() < 1e-12);
        assert!((end.position - swing.to).norm() < 1e-9);
        assert!((end.velocity - Vector3::new(0.0, 0.0, -0.15)).norm() < 1e-9);
        assert!(end.acceleration.norm() < 1e-6);
    }

    #[test]
    fn velocity_and_acceleration_are_the_derivatives() {
        let swing = swing();
        let h = 1e-5;
        for i in 1..20 {
            let phase = f64::from(i) / 20.0;
            let step = h / swing.duration;
            let (before, now, after) = (swing.at(phase - step), swing.at(phase), swing.at(phase + step));
            assert!(((after.position - before.position) / (2.0 * h) - now.velocity).norm() < 1e-6);
            assert!(((after.velocity - before.velocity) / (2.0 * h) - now.acceleration).norm() < 1e-5);
        }
    }

    #[test]
    fn it_is_of_sixth_order() {
        // The seventh difference of a sixth-order polynomial is zero, the sixth is not.
        let swing = swing();
        let mut values: Vec<f64> = (0..8).map(|i| swing.at(f64::from(i) / 8.0).position.x).collect();
        for _ in 0..6 {
            values = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
        }
        assert!(values[0].abs() > 1e-3 && (values[0] - values[1]).abs() < 1e-10, "{values:?}");
    }
}
