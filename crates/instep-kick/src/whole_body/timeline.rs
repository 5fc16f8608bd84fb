//! When each phase of a kick ends, and how far a kick is: what the motions and the states of all engines have in common.

use instep_motion::phase::Side;

use crate::engine::{KickStatus, Phase, Progress};

/// The phases in order.
const PHASES: [Phase; 7] =
    [Phase::Shift, Phase::Raise, Phase::WindUp, Phase::Kick, Phase::MoveBack, Phase::Lower, Phase::ShiftBack];

/// Ends of the phases, s of the motion.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Timeline {
    ends: [f64; PHASES.len()],
}

impl Timeline {
    /// All phases over at `time`.
    pub(crate) fn over(time: f64) -> Self {
        Self { ends: [time; PHASES.len()] }
    }

    /// Sets the end of `phase`; the stand has none.
    pub(crate) fn end_at(&mut self, phase: Phase, time: f64) {
        if let Some(end) = PHASES.iter().position(|p| *p == phase).and_then(|i| self.ends.get_mut(i)) {
            *end = time;
        }
    }

    /// End of a phase; that of the stand is the beginning.
    pub(crate) fn end_of(&self, phase: Phase) -> f64 {
        PHASES.iter().position(|p| *p == phase).map_or(0.0, |i| self.ends[i])
    }

    /// End of all.
    pub(crate) fn end(&self) -> f64 {
        self.end_of(Phase::ShiftBack)
    }

    /// The phase at `time`.
    pub(crate) fn phase(&self, time: f64) -> Phase {
        PHASES.into_iter().zip(self.ends).find(|(_, end)| time < *end).map_or(Phase::Stand, |(phase, _)| phase)
    }

    /// Whether both feet stand at `time`.
    pub(crate) fn both_feet(&self, time: f64) -> bool {
        matches!(self.phase(time), Phase::Stand | Phase::Shift | Phase::ShiftBack)
    }
}

/// How a kick goes on: what was asked meanwhile, and what that leads to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Course {
    status: KickStatus,
    /// The foot is to wait retracted.
    pub(crate) hold: bool,
    cancel: bool,
}

impl Course {
    /// No kick was asked yet.
    pub(crate) fn idle() -> Self {
        Self { status: KickStatus::Idle, hold: false, cancel: false }
    }

    /// A kick starts.
    pub(crate) fn started(hold: bool) -> Self {
        Self { status: KickStatus::Running, hold, cancel: false }
    }

    /// What goes on.
    pub(crate) fn status(&self) -> KickStatus {
        self.status
    }

    /// Whether a motion is under way.
    pub(crate) fn running(&self) -> bool {
        matches!(self.status, KickStatus::Running | KickStatus::Holding | KickStatus::Cancelling)
    }

    /// Asks for a cancel at the next tick.
    pub(crate) fn cancel(&mut self) {
        self.cancel = true;
    }

    /// Whether the motion is to turn back now: a cancel was asked since the last call.
    pub(crate) fn turns_back(&mut self) -> bool {
        let turns = std::mem::take(&mut self.cancel) && self.running();
        if turns {
            (self.status, self.hold) = (KickStatus::Cancelling, false);
        }
        turns
    }

    /// One tick, in which the foot `waits` or the motion goes on.
    pub(crate) fn step(&mut self, waits: bool) {
        self.status = match self.status {
            KickStatus::Running if waits => KickStatus::Holding,
            KickStatus::Holding if !waits => KickStatus::Running,
            status => status,
        };
    }

    /// The motion has come to its end.
    pub(crate) fn finish(&mut self) {
        self.status = match self.status {
            KickStatus::Cancelling => KickStatus::Cancelled,
            _ => KickStatus::Finished,
        };
    }

    /// How far the kick with `swing` is at `clock` (s); `contact` is planned.
    pub(crate) fn progress(&self, timeline: &Timeline, clock: f64, contact: Option<f64>, swing: Side) -> Progress {
        let (end, over) = (timeline.end(), !self.running());
        Progress {
            status: self.status,
            phase: if over { Phase::Stand } else { timeline.phase(clock) },
            done: if over || end <= 0.0 { 1.0 } else { (clock / end).clamp(0.0, 1.0) },
            to_contact: contact.filter(|_| !over).map(|contact| contact - clock),
            foot: (!over).then_some(swing),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_instant_has_its_phase() {
        let mut timeline = Timeline::default();
        PHASES.into_iter().enumerate().for_each(|(i, phase)| timeline.end_at(phase, 1.0 + i as f64));
        assert_eq!(timeline.phase(0.0), Phase::Shift);
        assert_eq!(timeline.phase(3.5), Phase::Kick);
        assert_eq!(timeline.phase(7.0), Phase::Stand);
        assert_eq!((timeline.end_of(Phase::Kick), timeline.end()), (4.0, 7.0));
        let both = [0.5, 1.5, 4.5, 6.5, 8.0].map(|time| timeline.both_feet(time));
        assert_eq!(both, [true, false, false, true, true]);
    }

    #[test]
    fn a_cancel_counts_once_and_only_in_a_kick() {
        let mut course = Course::idle();
        course.cancel();
        assert!(!course.turns_back() && !course.running());
        course = Course::started(true);
        course.step(true);
        assert_eq!(course.status(), KickStatus::Holding);
        course.cancel();
        assert!(course.turns_back() && !course.turns_back() && !course.hold);
        course.finish();
        assert_eq!(course.status(), KickStatus::Cancelled);
    }
}
