//! What the server is told: motors, beams, speech, the end of the cycle.

use std::fmt::Write as _;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use instep_field::Pose;

macro_rules! put {
    ($out:expr, $($part:tt)*) => {
        // Writing into a string cannot fail.
        let _ = write!($out, $($part)*);
    };
}

/// What a motor is to do: the server gives kp (q - angle) + kd (dq - speed) + tau until it is told otherwise, four times a
/// cycle, within the joint's torque.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motor {
    /// rad
    pub q: f64,
    /// rad/s
    pub dq: f64,
    /// N m/rad
    pub kp: f64,
    /// N m s/rad
    pub kd: f64,
    /// N m
    pub tau: f64,
}

/// Asks to join: the first message of a connection.
#[must_use]
pub fn init(model: &str, team: &str, number: u8) -> String {
    format!("(init {model} {team} {number})")
}

/// Tells a motor. Numbers that are none are not written: the motor keeps what it was told before.
pub fn motor(out: &mut String, name: &str, motor: &Motor) {
    let Motor { q, dq, kp, kd, tau } = *motor;
    if [q, dq, kp, kd, tau].iter().all(|x| x.is_finite()) {
        put!(out, "({name} {:.4} {:.4} {kp:.3} {kd:.3} {tau:.4})", q.to_degrees(), dq.to_degrees());
    }
}

/// Asks to be put at `pose`, in the own team's frame; the server takes it before a kick-off, in the own half. It mirrors x and
/// the heading for the right team, but not y.
pub fn beam(out: &mut String, pose: &Pose, right: bool) {
    if pose.is_finite() {
        let y = if right { -pose.y } else { pose.y };
        put!(out, "(beam {:.3} {y:.3} {:.2})", pose.x, pose.heading.to_degrees());
    }
}

/// Speaks, as loud as can be.
pub fn say(out: &mut String, speaker: &str, message: &[u8]) {
    put!(out, "(SPK {speaker} 100 {})", STANDARD.encode(message));
}

/// Ends the cycle's message: in its sync mode the server waits for it.
pub fn end(out: &mut String) {
    out.push_str("(syn)");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cycles_actions_are_what_the_server_reads() {
        let mut out = String::new();
        motor(&mut out, "lle1", &Motor { q: std::f64::consts::PI, dq: -0.5, kp: 100.0, kd: 2.5, tau: -1.25 });
        motor(&mut out, "lle2", &Motor { q: f64::NAN, dq: 0.0, kp: 1.0, kd: 1.0, tau: 0.0 });
        beam(&mut out, &Pose::new(-2.0, 1.5, 0.5), true);
        say(&mut out, "say", b"hello");
        end(&mut out);
        assert_eq!(
            out,
            "(lle1 180.0000 -28.6479 100.000 2.500 -1.2500)(beam -2.000 -1.500 28.65)(SPK say 100 aGVsbG8=)(syn)"
        );
        assert_eq!(init("T1", "Instep", 7), "(init T1 Instep 7)");
    }
}
