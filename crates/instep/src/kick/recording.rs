//! The recording of a kick: joints, links, ball and events at every sample of the trial.

use instep_report::ReportError;
use instep_report::mcap::{Joints, LinkPose, Recording};

use super::Tried;

/// The trial as a recording.
///
/// # Errors
/// When the trial holds what a recording cannot.
pub(super) fn recording(tried: &Tried) -> Result<Recording, ReportError> {
    let (robot, record) = (&tried.robot, &tried.trial.record);
    let names: Vec<String> = robot.joints.iter().map(|joint| joint.name.clone()).collect();
    let links = 1..robot.model().body_parentid().len();
    let mut data = robot.data();
    let mut recording = Recording::new()?;
    recording.description(&robot.urdf())?;
    let frame = robot.link_name(robot.base);
    // Messages go in by time, as a reader will want them.
    let mut events = super::summary::events(&tried.trial).into_iter().peekable();
    for (i, &time) in record.times.iter().enumerate() {
        while let Some((at, label)) = events.next_if(|(at, _)| *at <= time) {
            recording.event(at, label)?;
        }
        let (q, v) = (record.row(&record.q, i), record.row(&record.v, i));
        let effort = record.row(&record.torques, i);
        recording.joints(time, &Joints { frame, names: &names, position: &q[7..], velocity: &v[6..], effort })?;
        data.set_position(q);
        let poses: Vec<LinkPose<'_>> = links
            .clone()
            .map(|link| {
                let turn = data.link_rotation(link);
                LinkPose {
                    name: robot.link_name(link),
                    position: data.link_position(link).into(),
                    rotation: [turn.w, turn.i, turn.j, turn.k],
                }
            })
            .collect();
        recording.links(time, &poses)?;
        recording.ball(time, record.ball[i].position, record.ball[i].orientation)?;
    }
    Ok(recording)
}
