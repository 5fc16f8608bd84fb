//! The definitions that are shipped are those that are spoken: the same fields in the same order.

use std::path::Path;

use instep_ros::msg::{JointCommand, Kick2026Feedback, Kick2026Goal, KickFeedback, KickGoal, KickResult, SupportState};
use serde::Serialize;

/// The field names of each part of a definition.
fn fields(file: &str) -> Vec<Vec<String>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("interfaces").join(file);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let field = |line: &str| {
        let line = line.split('#').next().unwrap().trim();
        (!line.is_empty() && !line.contains('=')).then(|| line.split_whitespace().nth(1).unwrap().to_owned())
    };
    text.split("---").map(|part| part.lines().filter_map(field).collect()).collect()
}

/// The field names of a message in the order in which they are sent.
fn sent(message: &impl Serialize) -> Vec<String> {
    let json = serde_json::to_string(message).unwrap();
    let names: serde_json::Map<String, serde_json::Value> = serde_json::from_str(&json).unwrap();
    let mut names: Vec<String> = names.keys().cloned().collect();
    // An inner message has no field with the name of an outer one that comes later.
    names.sort_by_key(|name| json.find(&format!("\"{name}\":")).unwrap());
    names
}

#[test]
fn shipped_definitions_are_what_is_sent() {
    let kick = fields("bitbots_msgs/action/Kick.action");
    assert_eq!(kick, [sent(&KickGoal::default()), sent(&KickResult::default()), sent(&KickFeedback::default())]);
    let kick = fields("bitbots_msgs_2026/action/Kick.action");
    assert_eq!(
        kick,
        [sent(&Kick2026Goal::default()), sent(&KickResult::default()), sent(&Kick2026Feedback::default())]
    );
    assert_eq!(fields("bitbots_msgs/msg/JointCommand.msg"), [sent(&JointCommand::default())]);
    assert_eq!(fields("biped_interfaces/msg/Phase.msg"), [sent(&SupportState::default())]);
}
