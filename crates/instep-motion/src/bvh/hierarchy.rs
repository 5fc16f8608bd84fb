//! The HIERARCHY part of a BVH file: joints, parents before children, in the order of their channels.

use std::path::Path;

use nalgebra::Vector3;

use crate::MotionError;
use crate::text::{FileAxis, Line, triple};

/// One value of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Channel {
    /// Replaces a coordinate of the offset, file units.
    Position(FileAxis),
    /// A turn, degrees.
    Rotation(FileAxis),
}

/// One joint, file units and axes.
#[derive(Debug)]
pub(super) struct Joint {
    pub(super) name: String,
    pub(super) parent: Option<usize>,
    pub(super) offset: Vector3<f64>,
    pub(super) channels: Vec<Channel>,
    /// The end site, if it has one.
    pub(super) end: Option<Vector3<f64>>,
}

/// An open brace.
enum Open {
    Joint { index: usize, has_offset: bool, has_channels: bool },
    EndSite { parent: usize },
}

/// Reads up to and with the line MOTION; `end` is the number of the last line.
pub(super) fn parse<'a>(
    file: &Path,
    lines: &mut impl Iterator<Item = Line<'a>>,
    end: usize,
) -> Result<Vec<Joint>, MotionError> {
    let mut joints: Vec<Joint> = Vec::new();
    let mut stack: Vec<Open> = Vec::new();
    // A block that was announced and waits for its brace.
    let mut announced: Option<Open> = None;
    let mut begun = false;
    for line in lines {
        let wrong = |found: String, expected: &str| Err(MotionError::syntax(file, line.number, found, expected));
        let words = &line.words[..];
        if !begun {
            if words != ["HIERARCHY"] {
                return wrong(words.join(" "), "HIERARCHY");
            }
            begun = true;
            continue;
        }
        // A brace may stand at the end of the line that announces the block.
        let (words, brace) = match words {
            [head @ .., "{"] => (head, true),
            all => (all, false),
        };
        match (words, stack.last_mut()) {
            ([], _) => {}
            _ if announced.is_some() => return wrong(words.join(" "), "{"),
            (["MOTION"], None) if !joints.is_empty() => return Ok(joints),
            (["ROOT", name @ ..], None) if joints.is_empty() => {
                announced = Some(open_joint(file, &line, &mut joints, name, None)?);
            }
            (["ROOT", ..], None) => return wrong("a second ROOT".to_owned(), "one figure a file"),
            (["JOINT", name @ ..], Some(Open::Joint { index, .. })) => {
                let parent = Some(*index);
                announced = Some(open_joint(file, &line, &mut joints, name, parent)?);
            }
            (["End", "Site" | "site"], Some(Open::Joint { index, .. })) => {
                if joints[*index].end.is_some() {
                    return wrong("a second End Site".to_owned(), "one in a joint");
                }
                announced = Some(Open::EndSite { parent: *index });
            }
            (["OFFSET", values @ ..], Some(Open::Joint { index, has_offset, .. })) if !*has_offset => {
                joints[*index].offset = triple(file, line.number, values)?;
                *has_offset = true;
            }
            (["OFFSET", values @ ..], Some(Open::EndSite { parent })) if joints[*parent].end.is_none() => {
                joints[*parent].end = Some(triple(file, line.number, values)?);
            }
            (["CHANNELS", values @ ..], Some(Open::Joint { index, has_channels, .. })) if !*has_channels => {
                joints[*index].channels = channels(file, &line, values)?;
                *has_channels = true;
            }
            (["}"], Some(open)) => {
                match open {
                    Open::Joint { has_offset: false, .. } => return wrong("a joint without OFFSET".into(), "OFFSET"),
                    Open::EndSite { parent } if joints[*parent].end.is_none() => {
                        return wrong("an End Site without OFFSET".into(), "OFFSET");
                    }
                    _ => {}
                }
                stack.pop();
            }
            (_, None) => return wrong(words.join(" "), "ROOT and a name, or MOTION after it"),
            (_, Some(_)) => return wrong(words.join(" "), "one OFFSET, one CHANNELS, JOINT, End Site or }"),
        }
        if brace {
            match announced.take() {
                Some(open) => stack.push(open),
                None => return wrong("{".to_owned(), "a block's name before it"),
            }
        }
    }
    Err(MotionError::syntax(file, end, "the end of the file", "HIERARCHY, a figure and MOTION"))
}

fn open_joint(
    file: &Path,
    line: &Line<'_>,
    joints: &mut Vec<Joint>,
    name: &[&str],
    parent: Option<usize>,
) -> Result<Open, MotionError> {
    let name = name.join(" ");
    if name.is_empty() || joints.iter().any(|joint| joint.name == name) {
        return Err(MotionError::syntax(file, line.number, format!("the name {name:?}"), "a new name for each joint"));
    }
    joints.push(Joint { name, parent, offset: Vector3::zeros(), channels: Vec::new(), end: None });
    Ok(Open::Joint { index: joints.len() - 1, has_offset: false, has_channels: false })
}

fn channels(file: &Path, line: &Line<'_>, values: &[&str]) -> Result<Vec<Channel>, MotionError> {
    let wrong = |found: String, expected: &str| Err(MotionError::syntax(file, line.number, found, expected));
    let (count, names) = match values {
        [count, names @ ..] => (count.parse::<usize>().ok(), names),
        [] => (None, values),
    };
    if count != Some(names.len()) {
        return wrong(values.join(" "), "CHANNELS, their number and as many names");
    }
    let mut channels = Vec::with_capacity(names.len());
    for name in names {
        let mut letters = name.chars();
        let axis = letters.next().and_then(FileAxis::from_letter);
        let channel = match (axis, letters.as_str().to_ascii_lowercase().as_str()) {
            (Some(axis), "position") => Channel::Position(axis),
            (Some(axis), "rotation") => Channel::Rotation(axis),
            _ => {
                return wrong((*name).to_owned(), "Xposition, Yposition, Zposition, Xrotation, Yrotation or Zrotation");
            }
        };
        if channels.contains(&channel) {
            return wrong(format!("{name} twice"), "each channel once");
        }
        channels.push(channel);
    }
    Ok(channels)
}
