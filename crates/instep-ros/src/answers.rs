//! Between our goals and the library's messages of the action protocol.

use ros2_client::action::{CancelGoalRequest, GoalInfo, GoalStatusEnum};
use ros2_client::builtin_interfaces::Time as RosTime;
use serde::{Deserialize, Serialize};

use crate::goals::{Goal, GoalId, GoalState};
use crate::msg::Time;

/// `action_msgs/srv/CancelGoal_Request` as it lies in CDR: the library does not let its field be read.
#[derive(Serialize, Deserialize)]
pub(crate) struct CancelAsked {
    pub(crate) goal_id: GoalId,
    pub(crate) stamp: Time,
}

pub(crate) fn cancel_asked(request: &CancelGoalRequest) -> Option<CancelAsked> {
    let bytes = cdr_encoding::to_vec::<_, byteorder::LittleEndian>(request).ok()?;
    cdr_encoding::from_bytes::<_, byteorder::LittleEndian>(&bytes).ok().map(|(asked, _)| asked)
}

pub(crate) fn ros_id(id: &GoalId) -> ros2_client::unique_identifier_msgs::UUID {
    ros2_client::unique_identifier_msgs::UUID { uuid: uuid::Uuid::from_bytes(*id) }
}

pub(crate) fn ros_info(goal: &Goal) -> GoalInfo {
    GoalInfo { goal_id: ros_id(&goal.id), stamp: RosTime::from_nanos(goal.accepted) }
}

pub(crate) fn ros_state(state: GoalState) -> GoalStatusEnum {
    match state {
        GoalState::Executing => GoalStatusEnum::Executing,
        GoalState::Canceling => GoalStatusEnum::Canceling,
        GoalState::Succeeded => GoalStatusEnum::Succeeded,
        GoalState::Canceled => GoalStatusEnum::Canceled,
        GoalState::Aborted => GoalStatusEnum::Aborted,
    }
}
