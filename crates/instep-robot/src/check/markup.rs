//! What MuJoCo drops from a model file but its owner wrote: mesh file names and a URDF's joint speeds.
//!
//! A scanner of start and end tags with their attributes, not an XML parser: MuJoCo has judged the file already, or
//! will. Comments and declarations are skipped; whatever cannot be read as a tag is passed over.

use std::collections::{BTreeMap, BTreeSet};

/// One start tag with its attributes, or one end tag.
#[derive(Debug, PartialEq)]
struct Tag<'a> {
    name: &'a str,
    end: bool,
    attributes: Vec<(&'a str, &'a str)>,
}

impl<'a> Tag<'a> {
    fn attribute(&self, name: &str) -> Option<&'a str> {
        self.attributes.iter().find(|(known, _)| *known == name).map(|(_, value)| *value)
    }
}

/// What a model file says about itself.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Markup {
    /// The first element's name: `mujoco` or `robot`.
    pub(crate) root: String,
    /// `name` (URDF) or `model` (MJCF) of the first element.
    pub(crate) name: Option<String>,
    /// Speed limit of each joint, rad/s, where the file gives one above zero (URDF `limit velocity`).
    pub(crate) speeds: BTreeMap<String, f64>,
    /// Joints that follow another (URDF `mimic`).
    pub(crate) followers: BTreeSet<String>,
    /// Files of meshes.
    pub(crate) meshes: Vec<String>,
    /// Folder of the meshes (MJCF `compiler meshdir` or `assetdir`).
    pub(crate) mesh_folder: Option<String>,
}

/// Reads what a model file says about itself.
pub(crate) fn read(text: &str) -> Markup {
    let mut markup = Markup::default();
    let mut joint = None;
    for tag in tags(text) {
        if tag.end {
            if tag.name == "joint" {
                joint = None;
            }
            continue;
        }
        if markup.root.is_empty() {
            tag.name.clone_into(&mut markup.root);
            markup.name = tag.attribute("name").or_else(|| tag.attribute("model")).map(str::to_owned);
        }
        match tag.name {
            "joint" => joint = tag.attribute("name"),
            "limit" => {
                let speed = tag.attribute("velocity").and_then(|speed| speed.trim().parse::<f64>().ok());
                if let (Some(joint), Some(speed)) = (joint, speed)
                    && speed > 0.0
                    && speed.is_finite()
                {
                    markup.speeds.insert(joint.to_owned(), speed);
                }
            }
            "mimic" => markup.followers.extend(joint.map(str::to_owned)),
            "mesh" => {
                let file = tag.attribute("filename").or_else(|| tag.attribute("file"));
                if let Some(file) = file.filter(|file| !markup.meshes.iter().any(|known| known == file)) {
                    markup.meshes.push(file.to_owned());
                }
            }
            "compiler" => {
                let folder = tag.attribute("meshdir").or_else(|| tag.attribute("assetdir"));
                markup.mesh_folder = folder.map(str::to_owned).or(markup.mesh_folder);
            }
            _ => {}
        }
    }
    markup
}

/// The first attribute that holds numbers of which one is not finite: its line, from 1, and its text.
pub(crate) fn not_finite(text: &str) -> Option<(usize, String)> {
    tags(text).flat_map(|tag| tag.attributes).filter(|(name, _)| *name != "name").find_map(|(name, value)| {
        let numbers: Option<Vec<f64>> = value.split_whitespace().map(|word| word.parse().ok()).collect();
        if numbers?.iter().all(|x| x.is_finite()) {
            return None;
        }
        // Both are parts of `text`, so that their addresses tell where the attribute stands.
        let before = &text[..value.as_ptr().addr() - text.as_ptr().addr()];
        Some((1 + before.matches('\n').count(), format!("{name}=\"{value}\"")))
    })
}

/// The tags of `text` in order.
fn tags(text: &str) -> impl Iterator<Item = Tag<'_>> {
    let mut rest = text;
    std::iter::from_fn(move || {
        loop {
            rest = &rest[rest.find('<')?..];
            if let Some(comment) = rest.strip_prefix("<!--") {
                rest = &comment[comment.find("-->")?..];
                continue;
            }
            let inside = &rest[1..];
            let close = end_of_tag(inside)?;
            let body = inside[..close].trim_end_matches('/');
            rest = &inside[close..];
            let (end, body) = body.strip_prefix('/').map_or((false, body), |body| (true, body));
            let name = body.split(|c: char| c.is_whitespace()).next().unwrap_or_default();
            if name.starts_with(|c: char| c.is_alphabetic()) {
                return Some(Tag { name, end, attributes: attributes(&body[name.len()..]) });
            }
        }
    })
}

/// Where the tag that begins `text` ends: the first `>` outside quotes.
fn end_of_tag(text: &str) -> Option<usize> {
    let mut quote = None;
    text.char_indices().find_map(|(at, c)| {
        match quote {
            Some(open) if c == open => quote = None,
            Some(_) => {}
            None if c == '"' || c == '\'' => quote = Some(c),
            None if c == '>' => return Some(at),
            None => {}
        }
        None
    })
}

/// `a="1" b='2'` as pairs.
fn attributes(text: &str) -> Vec<(&str, &str)> {
    let mut pairs = Vec::new();
    let mut rest = text;
    while let Some((name, after)) = rest.split_once('=') {
        let after = after.trim_start();
        let Some(quote) = after.chars().next().filter(|c| *c == '"' || *c == '\'') else { break };
        let Some((value, after)) = after[1..].split_once(quote) else { break };
        pairs.push((name.trim(), value));
        rest = after;
    }
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_and_meshes_are_read_through_comments_and_quotes() {
        let markup = read(
            "<?xml version='1.0'?><!-- <robot name=\"old\"> --><robot name='a > b'>\
             <joint name=\"knee\" type=\"revolute\"><limit effort=\"3\" velocity=\" 6.4 \"/></joint>\
             <joint name=\"fixed\" type=\"fixed\"/><limit velocity=\"9\"/>\
             <mesh filename=\"package://x/y.stl\"/><mesh filename=\"package://x/y.stl\"/></robot>",
        );
        assert_eq!(markup.root, "robot");
        assert_eq!(markup.name.as_deref(), Some("a > b"));
        assert_eq!(markup.speeds.get("knee"), Some(&6.4));
        assert_eq!(markup.meshes, ["package://x/y.stl"]);
    }

    #[test]
    fn numbers_that_are_none_are_found_with_their_line() {
        let text = "<a name=\"nan\">\n<b pos=\"1 2 3\"/>\n<c pos=\"0 NaN 0\" file=\"inf.stl\"/></a>";
        assert_eq!(not_finite(text), Some((3, "pos=\"0 NaN 0\"".to_owned())));
        assert_eq!(not_finite("<a size=\"1e400\"/>").map(|(line, _)| line), Some(1));
        assert_eq!(not_finite("<a joint=\"infinite\" size=\"1 x nan\"/>"), None);
    }

    #[test]
    fn half_a_file_is_read_as_far_as_it_goes() {
        let whole = "<robot name=\"r\"><joint name=\"a\"><limit velocity=\"1\"/></joint><mesh filename=\"m\"/></robot>";
        for end in 0..whole.len() {
            let _ = read(&whole[..end]);
        }
        assert_eq!(read("no markup at all"), Markup::default());
    }
}
