//! A robot's drives as they are: what of a command reaches them and when, and which torque comes out.
//!
//! Two kinds. A *torque drive* (quasi-direct drive with current control) takes angle, speed and torque of every command and
//! closes proportional-derivative control on its own board. A *position servo* takes angles only: its own PID sets the
//! share u of the supply's voltage, and a direct-current motor gives stall torque x (u - speed / no-load speed), so that
//! back-EMF damps it at any u (ROBOTIS e-Manual, MX and X series: position P gain / 128 is PWM a tick of error).
//!
//! Both have a bus that takes the newest command once a period and a delay until it acts; a supply whose voltage sags with
//! the load; and gears with play, in which the motor runs free at the speed that its torque leaves it, until the other
//! flank carries. The rotor's inertia stays with the joint while the flanks are apart. Dry and viscous friction belong to
//! the joint and are the world's: see instep-sim. No heat, no cogging, no torque ripple.

use serde::{Deserialize, Serialize};

use crate::control::{JointCommand, torque_range_over_step};
use crate::robot::{Joint, Robot};

/// Times are sums of steps: a command is on time that is this much early, s.
const GRACE: f64 = 1e-7;

/// What a robot's drives take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DriveKind {
    /// Angle, speed and torque.
    #[default]
    Torque,
    /// Angle alone.
    PositionServo,
}

/// `[drives]` of `robot.toml`: what all drives of a robot share. Absent: torque drives at 1 kHz without delay.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriveSettings {
    /// What they take.
    pub kind: DriveKind,
    /// Cycle of the bus, s, above 0: how often a new command is taken, and at which a controller is to be ticked.
    pub period: f64,
    /// From the tick that gives a command to its effect on the motor, s.
    pub delay: f64,
    /// Share of the voltage that the supply loses when every motor gives its largest torque, in [0, 0.9].
    #[serde(default)]
    pub sag: f64,
}

impl Default for DriveSettings {
    fn default() -> Self {
        Self { kind: DriveKind::Torque, period: 0.001, delay: 0.0, sag: 0.0 }
    }
}

/// A position servo's PID, in terms of the torque at standstill: stall torque times the share of the voltage.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pid {
    /// N m/rad.
    pub p: f64,
    /// N m/(rad s).
    #[serde(default)]
    pub i: f64,
    /// On the measured speed, beside the motor's own back-EMF, N m s/rad.
    #[serde(default)]
    pub d: f64,
}

/// What one joint's drive is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Target {
    /// rad.
    pub position: f64,
    /// rad/s.
    pub velocity: f64,
    /// N m.
    pub torque: f64,
}

/// What a drive measures of its joint and its supply, and the step that the torque will be held for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// Angle as the drive's encoder has it, rad.
    pub position: f64,
    /// Speed, rad/s.
    pub velocity: f64,
    /// Voltage as a share of the nominal one.
    pub voltage: f64,
    /// Time step, s.
    pub step: f64,
    /// Inverse of the least inertia that the motor can find before it, 1/(kg m^2).
    pub inverse_inertia: f64,
}

/// The state of one joint's drive.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Drive {
    /// Angle of the gear before the joint, within half the play on either side, rad.
    gap: f64,
    /// The PID's integral part, N m.
    integral: f64,
}

impl Drive {
    /// The torque (N m) on the joint for the next step.
    pub fn torque(&mut self, joint: &Joint, kind: DriveKind, target: &Target, now: &Measured) -> f64 {
        let error = target.position - now.position;
        let error = error - error.clamp(-joint.dead_zone, joint.dead_zone);
        let (stall, slope) = joint.motor();
        let per_torque = now.step * now.inverse_inertia;
        let torque = match kind {
            DriveKind::Torque => {
                let [least, greatest] = torque_range_over_step(joint, now.velocity, per_torque, now.voltage);
                let damped = joint.kd * (target.velocity - now.velocity);
                (joint.kp * error + damped + target.torque).clamp(least, greatest)
            }
            DriveKind::PositionServo => {
                let Pid { p, i, d } = joint.pid;
                self.integral = (self.integral + i * error * now.step).clamp(-stall, stall);
                let held = p * error + self.integral;
                // Damping acts at the speed that the torque leads to: stable on the lightest link.
                let free = (held - (d + slope) * now.velocity) / (1.0 + (d + slope) * per_torque);
                let share = (held - d * (now.velocity + free * per_torque)) / stall;
                let torque = if share.abs() <= now.voltage {
                    free
                } else {
                    (now.voltage.copysign(share) * stall - slope * now.velocity) / (1.0 + slope * per_torque)
                };
                torque.clamp(-joint.torque, joint.torque)
            }
        };
        if joint.play <= 0.0 {
            return torque;
        }
        // Unloaded, the gear runs away from the joint by what the torque is short of on the motor's line.
        let half = 0.5 * joint.play;
        self.gap = (self.gap + torque / slope * now.step).clamp(-half, half);
        let carries = if torque > 0.0 { self.gap >= half } else { self.gap <= -half };
        if carries { torque } else { 0.0 }
    }
}

/// All drives of one robot, with the commands that are still under way.
#[derive(Debug, Clone, PartialEq)]
pub struct Drives {
    settings: DriveSettings,
    joints: Vec<Drive>,
    /// Commands on their way, as a ring: when each acts, s, and what it asks.
    queue: Vec<(f64, JointCommand)>,
    first: usize,
    waiting: usize,
    active: JointCommand,
    /// When the bus takes the next command, s; `None` before the first.
    next: Option<f64>,
    /// Torques of the last step over the largest, all motors together.
    load: f64,
    most: f64,
}

impl Drives {
    /// The drives of `robot`, which have had no command yet.
    #[must_use]
    pub fn new(robot: &Robot) -> Self {
        let (settings, n) = (robot.drives, robot.joints.len());
        // Never more than a delay's worth of periods are under way. The settings are checked to make this a small number.
        let places = (settings.delay / settings.period).ceil() as usize + 2;
        Self {
            settings,
            joints: vec![Drive::default(); n],
            queue: vec![(0.0, JointCommand::zeros(n)); places],
            first: 0,
            waiting: 0,
            active: JointCommand::zeros(n),
            next: None,
            load: 0.0,
            most: robot.joints.iter().map(|joint| joint.torque).sum(),
        }
    }

    /// As before the first command.
    pub fn reset(&mut self) {
        self.joints.fill(Drive::default());
        (self.waiting, self.next, self.load) = (0, None, 0.0);
    }

    /// Offers `command` at `time` (s): the bus takes it when it is its turn. The first one counts as long under way.
    pub fn offer(&mut self, time: f64, command: &JointCommand) {
        let (kind, places) = (self.settings.kind, self.queue.len());
        match self.next {
            None => {
                take(kind, command, &mut self.active);
                self.next = Some(time + self.settings.period);
            }
            Some(next) if time + GRACE >= next => {
                let place = (self.first + self.waiting) % places;
                self.queue[place].0 = time + self.settings.delay;
                take(kind, command, &mut self.queue[place].1);
                self.waiting = (self.waiting + 1).min(places);
                // A clock that was stopped is not caught up with.
                let on_time = next + self.settings.period;
                self.next = Some(if on_time > time + GRACE { on_time } else { time + self.settings.period });
            }
            Some(_) => {}
        }
        while self.waiting > 0 && self.queue[self.first].0 <= time + GRACE {
            std::mem::swap(&mut self.active, &mut self.queue[self.first].1);
            self.first = (self.first + 1) % places;
            self.waiting -= 1;
        }
    }

    /// The torque (N m) of drive `i`, of `joint`, for the next step. `now.voltage` is put in here.
    pub fn torque(&mut self, i: usize, joint: &Joint, mut now: Measured) -> f64 {
        now.voltage = 1.0 - self.settings.sag * self.load;
        let target = Target {
            position: self.active.positions[i],
            velocity: self.active.velocities[i],
            torque: self.active.torques[i],
        };
        self.joints[i].torque(joint, self.settings.kind, &target, &now)
    }

    /// Tells the supply the sum of the absolute torques (N m) of the step.
    pub fn loaded(&mut self, torques: f64) {
        self.load = (torques / self.most).min(1.0);
    }

    /// The command that acts now.
    #[must_use]
    pub fn active(&self) -> &JointCommand {
        &self.active
    }
}

/// Speed over which dry friction is taken to turn round, rad/s.
const TURNING: f64 = 0.1;

/// Puts what the drives of `robot` cannot be told into what they can. A torque drive takes a command as it is. A position
/// servo gets the angle at which its own law gives the wanted torque on the wanted motion, as far ahead as the command is late:
/// with the servo's stiffness p, its damping and back-EMF d, and the friction f of the joint, the angle is
/// q + v delay + (torque + d v + f) / p, beyond the dead zone by the dead zone. What p cannot hold stays as an error; play
/// cannot be told. Speeds and torques become zero. Allocates nothing.
pub fn tell(robot: &Robot, command: &mut JointCommand) {
    let DriveSettings { kind, delay, .. } = robot.drives;
    if kind == DriveKind::Torque {
        return;
    }
    for (i, joint) in robot.joints.iter().enumerate() {
        command.positions[i] =
            joint.servo_target(command.positions[i], command.velocities[i], command.torques[i], delay);
        (command.velocities[i], command.torques[i]) = (0.0, 0.0);
    }
}

impl Joint {
    /// The torque (N m) at standstill on the whole voltage, and what a motor loses of it for each rad/s (N m s/rad).
    fn motor(&self) -> (f64, f64) {
        let stall = self.torque / (1.0 - self.corner);
        (stall, stall / self.speed)
    }

    /// The angle (rad) to send a position servo that is to be at `position` (rad) with `velocity` (rad/s) and `torque` (N m) when
    /// the command acts `delay` (s) later; see [`tell`].
    #[must_use]
    pub fn servo_target(&self, position: f64, velocity: f64, torque: f64, delay: f64) -> f64 {
        let Pid { p, d, .. } = self.pid;
        let friction = self.static_friction * velocity / (velocity.abs() + TURNING) + self.viscous_friction * velocity;
        let needed = (torque + friction + (d + self.motor().1) * velocity) / p;
        let dead = if self.dead_zone > 0.0 { self.dead_zone * needed / (needed.abs() + self.dead_zone) } else { 0.0 };
        let target = position + velocity * delay + needed + dead;
        if target.is_finite() { target } else { position }
    }
}

/// Copies what a drive of `kind` takes of a command; the rest stays zero.
fn take(kind: DriveKind, command: &JointCommand, to: &mut JointCommand) {
    to.positions.copy_from_slice(&command.positions);
    if kind == DriveKind::Torque {
        to.velocities.copy_from_slice(&command.velocities);
        to.torques.copy_from_slice(&command.torques);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn knee() -> Joint {
        Joint {
            name: "knee".to_owned(),
            group: 0,
            range: [-0.1, 2.0],
            torque: 3.0,
            speed: 6.4,
            corner: 0.6,
            kp: 50.0,
            kd: 1.2,
            pid: Pid { p: 21.0, i: 0.0, d: 0.1 },
            dead_zone: 0.0015,
            play: 0.0,
            static_friction: 0.15,
            viscous_friction: 0.02,
        }
    }

    /// On the wanted motion the servo's own law gives the wanted torque, and that against friction: the drive's law is the oracle.
    #[test]
    fn a_servo_that_is_told_its_target_gives_the_wanted_torque() {
        let joint = knee();
        for (velocity, torque) in [(0.0, 1.2), (0.0, -0.9), (1.5, 0.6), (-2.0, -0.4), (2.5, -1.0)] {
            let target = Target { position: joint.servo_target(0.7, velocity, torque, 0.0), ..Target::default() };
            let now = Measured { position: 0.7, velocity, voltage: 1.0, step: 1e-6, inverse_inertia: 1.0 };
            let given = Drive::default().torque(&joint, DriveKind::PositionServo, &target, &now);
            let friction = 0.15 * velocity / (f64::abs(velocity) + TURNING) + 0.02 * velocity;
            assert!(
                (given - torque - friction).abs() < 0.02,
                "{velocity} rad/s: {given} N m for {torque} and {friction}"
            );
        }
    }

    #[test]
    fn a_target_leads_by_the_delay_and_a_torque_that_is_no_number_changes_nothing() {
        let joint = knee();
        let lead = joint.servo_target(0.7, 1.0, 0.0, 0.02) - joint.servo_target(0.7, 1.0, 0.0, 0.0);
        assert!((lead - 0.02).abs() < 1e-12);
        assert!((joint.servo_target(0.7, 1.0, f64::NAN, 0.02) - 0.7).abs() < 1e-12);
    }
}
