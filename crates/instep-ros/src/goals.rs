//! The goals of a ROS 2 action server as its clients see them: identity, state, result, cancellation.
//!
//! Source: design.ros2.org, "Actions"; the codes are those of action_msgs (CancelGoal.srv, GoalStatus.msg). One goal
//! at a time is carried out. Finished goals are remembered, the last [`REMEMBERED`] of them, so that a client that asks
//! late still gets its result. Knows neither network nor clock: times and requests are handed in.

use std::collections::VecDeque;

/// Finished goals that are remembered.
const REMEMBERED: usize = 64;
/// Clients that may wait for the result of the goal under way; more than that and the first is told that it is unknown.
const WAITING: usize = 64;

/// A goal's identity: the client draws it.
pub type GoalId = [u8; 16];

/// State of a goal, numbered as in action_msgs/msg/GoalStatus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i8)]
pub enum GoalState {
    /// Under way.
    Executing = 2,
    /// A cancel was accepted; the foot goes back.
    Canceling = 3,
    /// Done.
    Succeeded = 4,
    /// Ended by a cancel.
    Canceled = 5,
    /// Ended otherwise.
    Aborted = 6,
}

/// Answer to a cancel, numbered as in action_msgs/srv/CancelGoal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i8)]
pub enum CancelCode {
    /// The goals listed are being cancelled.
    None = 0,
    /// No goal with that identity was ever accepted.
    UnknownGoal = 2,
    /// It is over already.
    Terminated = 3,
}

/// A goal that was accepted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Goal {
    /// Identity.
    pub id: GoalId,
    /// When it was accepted, ns since 1970.
    pub accepted: i64,
    /// State.
    pub state: GoalState,
    /// The kick's result code, once it is over.
    pub result: Option<u8>,
}

/// What to do with a request for a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResultAnswer<T> {
    /// Answer this request at once: state (`None`: no such goal) and result code.
    Now(T, Option<(GoalState, u8)>),
    /// It waits for the end of the goal.
    Later,
}

/// The goals. `T` identifies a client's request for a result.
#[derive(Debug, Clone)]
pub struct Goals<T> {
    active: Option<Goal>,
    waiting: VecDeque<T>,
    finished: VecDeque<Goal>,
}

impl<T> Default for Goals<T> {
    fn default() -> Self {
        Self { active: None, waiting: VecDeque::new(), finished: VecDeque::new() }
    }
}

impl<T> Goals<T> {
    /// The goal under way.
    #[must_use]
    pub fn active(&self) -> Option<&Goal> {
        self.active.as_ref()
    }

    /// Whether a goal with this identity was accepted and is remembered.
    #[must_use]
    pub fn knows(&self, id: &GoalId) -> bool {
        self.all().any(|goal| goal.id == *id)
    }

    /// Every goal that is remembered, the newest last.
    pub fn all(&self) -> impl Iterator<Item = &Goal> {
        self.finished.iter().chain(&self.active)
    }

    /// Takes a goal to be carried out. There must be none under way, or that one is given up as aborted.
    pub fn accept(&mut self, id: GoalId, now: i64) -> Vec<T> {
        let orphans = self.finish(GoalState::Aborted, crate::msg::KickResult::ABORTED);
        self.active = Some(Goal { id, accepted: now, state: GoalState::Executing, result: None });
        orphans
    }

    /// Ends the goal under way; gives the requests that waited for it.
    pub fn finish(&mut self, state: GoalState, result: u8) -> Vec<T> {
        let Some(goal) = self.active.take() else { return Vec::new() };
        self.finished.push_back(Goal { state, result: Some(result), ..goal });
        if self.finished.len() > REMEMBERED {
            self.finished.pop_front();
        }
        self.waiting.drain(..).collect()
    }

    /// A client asks to cancel: goal `id` (zero: any), and all that were accepted up to `stamp` (ns; zero: none by time,
    /// or with a zero `id` all). Gives the code and the goals that are being cancelled now.
    pub fn cancel(&mut self, id: &GoalId, stamp: i64) -> (CancelCode, Vec<Goal>) {
        let any = *id == [0; 16];
        let meant = |goal: &Goal| match (any, stamp == 0) {
            (true, true) => true,
            (true, false) => goal.accepted <= stamp,
            (false, true) => goal.id == *id,
            (false, false) => goal.id == *id || goal.accepted <= stamp,
        };
        if let Some(goal) = self.active.as_mut().filter(|goal| meant(goal)) {
            goal.state = GoalState::Canceling;
            return (CancelCode::None, vec![*goal]);
        }
        if any {
            return (CancelCode::None, Vec::new());
        }
        let code = if self.knows(id) { CancelCode::Terminated } else { CancelCode::UnknownGoal };
        (code, Vec::new())
    }

    /// A client asks for a result. May also answer the oldest waiting request, to make room.
    pub fn result(&mut self, id: &GoalId, request: T) -> ResultAnswer<T> {
        if self.active.as_ref().is_some_and(|goal| goal.id == *id) {
            self.waiting.push_back(request);
            return match self.waiting.len() > WAITING {
                true => self.waiting.pop_front().map_or(ResultAnswer::Later, |first| ResultAnswer::Now(first, None)),
                false => ResultAnswer::Later,
            };
        }
        let known = self.finished.iter().find(|goal| goal.id == *id);
        ResultAnswer::Now(request, known.and_then(|goal| Some((goal.state, goal.result?))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_goal_is_followed_to_its_end_and_remembered() {
        let mut goals = Goals::default();
        goals.accept([1; 16], 100);
        assert_eq!(goals.result(&[1; 16], "a"), ResultAnswer::Later);
        assert_eq!(goals.result(&[2; 16], "b"), ResultAnswer::Now("b", None));
        assert_eq!(goals.cancel(&[2; 16], 0), (CancelCode::UnknownGoal, vec![]));
        let (code, list) = goals.cancel(&[1; 16], 0);
        assert_eq!((code, list.len(), list[0].state), (CancelCode::None, 1, GoalState::Canceling));
        assert_eq!(goals.finish(GoalState::Canceled, 2), ["a"]);
        assert!(goals.active().is_none() && goals.finish(GoalState::Succeeded, 0).is_empty());
        assert_eq!(goals.result(&[1; 16], "c"), ResultAnswer::Now("c", Some((GoalState::Canceled, 2))));
        assert_eq!(goals.cancel(&[1; 16], 0), (CancelCode::Terminated, vec![]));
    }

    #[test]
    fn cancels_by_time_and_of_all_follow_the_rules_of_cancel_goal() {
        let fresh = || {
            let mut goals = Goals::<()>::default();
            goals.accept([1; 16], 100);
            goals
        };
        let cancelled = |id: GoalId, stamp: i64| fresh().cancel(&id, stamp).1.len();
        assert_eq!(cancelled([0; 16], 0), 1);
        assert_eq!((cancelled([0; 16], 99), cancelled([0; 16], 100)), (0, 1));
        assert_eq!((cancelled([7; 16], 99), cancelled([7; 16], 100)), (0, 1));
        assert_eq!((cancelled([1; 16], 99), cancelled([7; 16], 0)), (1, 0));
        assert_eq!(Goals::<()>::default().cancel(&[0; 16], 0), (CancelCode::None, vec![]));
    }

    #[test]
    fn memory_is_bounded() {
        let mut goals = Goals::default();
        for i in 0..1000_u16 {
            let mut id = [0; 16];
            id[..2].copy_from_slice(&i.to_le_bytes());
            goals.accept(id, 0);
            let told = (0..200).filter(|_| matches!(goals.result(&id, i), ResultAnswer::Now(_, None))).count();
            assert_eq!(told, 200 - WAITING);
            assert_eq!(goals.finish(GoalState::Succeeded, 0).len(), WAITING);
        }
        assert_eq!(goals.all().count(), REMEMBERED);
    }
}
