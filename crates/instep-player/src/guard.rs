//! Which senses may be believed: finite numbers, as many as the robot has joints, a time that goes on.
//!
//! A tick with bad senses repeats the command before; when they stay bad the robot is to stand down. What comes with a frame or
//! from mates is checked where it is used.

use instep_robot::Robot;
use instep_robot::control::Sensors;

/// Bad senses for this long and the robot stands down, s.
const PATIENCE: f64 = 0.1;
/// A gap in time after which the legs' state is worth nothing, s.
const GAP: f64 = 0.5;

/// Why senses are not used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// A number is not finite, or the orientation is none.
    NotFinite,
    /// Not as many numbers as the robot has joints or contact points.
    Length,
    /// Time stands still or runs backwards.
    Backwards,
}

/// What to do with a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The senses are good.
    Good,
    /// They are good, but what was before is too long ago.
    Gap,
    /// Repeat the command before.
    Repeat(Fault),
    /// They have been bad for too long: stand down.
    StandDown(Fault),
}

/// Watches the senses of one robot.
#[derive(Debug, Clone)]
pub struct Guard {
    joints: usize,
    contacts: usize,
    time: Option<f64>,
    /// Between the last two good ticks, s.
    period: f64,
    bad: f64,
    faults: u64,
}

impl Guard {
    /// For `robot`.
    #[must_use]
    pub fn new(robot: &Robot) -> Self {
        Self {
            joints: robot.joints.len(),
            contacts: robot.contacts.len(),
            time: None,
            period: 0.001,
            bad: 0.0,
            faults: 0,
        }
    }

    /// How many ticks were refused.
    #[must_use]
    pub fn faults(&self) -> u64 {
        self.faults
    }

    /// Judges one tick's senses.
    pub fn judge(&mut self, senses: &Sensors) -> Verdict {
        if let Some(fault) = self.fault(senses) {
            self.faults += 1;
            self.bad += self.period;
            return if self.bad > PATIENCE { Verdict::StandDown(fault) } else { Verdict::Repeat(fault) };
        }
        self.bad = 0.0;
        let gap = self.time.map(|before| senses.time - before);
        self.time = Some(senses.time);
        match gap {
            Some(gap) if gap > GAP => Verdict::Gap,
            Some(gap) => {
                self.period = gap;
                Verdict::Good
            }
            None => Verdict::Good,
        }
    }

    fn fault(&self, senses: &Sensors) -> Option<Fault> {
        if senses.joint_positions.len() != self.joints
            || senses.joint_velocities.len() != self.joints
            || senses.contact_forces.len() != self.contacts
        {
            return Some(Fault::Length);
        }
        let norm = senses.orientation.iter().map(|x| x * x).sum::<f64>();
        let numbers = senses.joint_positions.iter().chain(&senses.joint_velocities).chain(&senses.contact_forces);
        let finite = numbers.chain(&senses.gyro).chain(&senses.accelerometer).all(|x| x.is_finite());
        if !(finite && senses.time.is_finite() && (0.25..=4.0).contains(&norm)) {
            return Some(Fault::NotFinite);
        }
        self.time.is_some_and(|before| senses.time <= before).then_some(Fault::Backwards)
    }
}
