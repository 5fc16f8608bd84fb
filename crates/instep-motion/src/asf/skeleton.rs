//! The ASF file: units, root, bones and their tree, and how the numbers of a frame turn each bone.

use std::collections::HashMap;
use std::path::Path;

use nalgebra::{UnitQuaternion, Vector3};

use crate::MotionError;
use crate::clip::{Bone, Skeleton};
use crate::text::{FileAxis, Line, last_line, lines, number, triple, z_up};

/// A skeleton and what is needed to read its motion.
#[derive(Debug)]
pub(super) struct Rig {
    pub(super) skeleton: Skeleton,
    /// How each bone turns, in the order of the bones; the root's is first.
    pub(super) joints: Vec<Joint>,
    /// What the values of the root's line are, in order.
    pub(super) root_order: Vec<RootValue>,
    /// Root's place in the zero pose, m, our axes.
    pub(super) root_position: Vector3<f64>,
    /// Metres in one unit of length.
    pub(super) metres: f64,
    /// Radians in one unit of angle.
    pub(super) radians: f64,
}

/// How one bone turns: `C R C^-1`.
#[derive(Debug, Clone)]
pub(super) struct Joint {
    /// `C`.
    pub(super) axis: UnitQuaternion<f64>,
    /// Axes of `R`, the first applied first.
    pub(super) dofs: Vec<FileAxis>,
}

/// One value of the root's line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RootValue {
    Translation(FileAxis),
    Rotation(FileAxis),
}

/// A bone as its block says, before units are known (they may come later in the file).
#[derive(Default)]
struct Block {
    line: usize,
    name: Option<String>,
    direction: Option<Vector3<f64>>,
    length: Option<f64>,
    axis: Option<(Vector3<f64>, Vec<FileAxis>)>,
    dofs: Vec<FileAxis>,
}

struct Units {
    length: f64,
    radians: f64,
}

struct Root {
    order: Vec<RootValue>,
    axis: Vec<FileAxis>,
    position: Vector3<f64>,
    orientation: Vector3<f64>,
}

#[derive(Clone, Copy, PartialEq)]
enum Section {
    Units,
    Root,
    Bones,
    Hierarchy,
    Skipped,
}

struct Parser<'a> {
    file: &'a Path,
    units: Units,
    root: Root,
    bones: Vec<Block>,
    open: Option<Block>,
    /// Children of each parent with the line that says so, in file order.
    children: HashMap<String, Vec<(String, usize)>>,
}

/// Parses the text of the ASF file `file`.
pub(super) fn parse(file: &Path, text: &str) -> Result<Rig, MotionError> {
    let mut parser = Parser {
        file,
        units: Units { length: 1.0, radians: 1.0_f64.to_radians() },
        root: Root {
            order: Vec::new(),
            axis: vec![FileAxis::X, FileAxis::Y, FileAxis::Z],
            position: Vector3::zeros(),
            orientation: Vector3::zeros(),
        },
        bones: Vec::new(),
        open: None,
        children: HashMap::new(),
    };
    let mut section = Section::Skipped;
    for line in lines(text, Some('#')) {
        if let Some(keyword) = line.words[0].strip_prefix(':') {
            parser.close_section(&line)?;
            section = match keyword.to_ascii_lowercase().as_str() {
                "units" => Section::Units,
                "root" => Section::Root,
                "bonedata" => Section::Bones,
                "hierarchy" => Section::Hierarchy,
                "version" | "name" | "documentation" | "skin" => Section::Skipped,
                other => return Err(parser.wrong(&line, format!(":{other}"), "a section of the ASF format")),
            };
            continue;
        }
        match section {
            Section::Units => parser.units(&line)?,
            Section::Root => parser.root(&line)?,
            Section::Bones => parser.bone(&line)?,
            Section::Hierarchy => parser.hierarchy(&line)?,
            Section::Skipped => {}
        }
    }
    let end = last_line(text);
    if parser.open.is_some() {
        return Err(MotionError::syntax(file, end, "the end of the file within a bone", "end"));
    }
    parser.finish(end)
}

impl Parser<'_> {
    fn wrong(&self, line: &Line<'_>, found: impl Into<String>, expected: impl Into<String>) -> MotionError {
        MotionError::syntax(self.file, line.number, found, expected)
    }

    fn close_section(&self, line: &Line<'_>) -> Result<(), MotionError> {
        match self.open {
            Some(_) => Err(self.wrong(line, line.words[0], "the end of the bone before the next section")),
            None => Ok(()),
        }
    }

    fn single<'b>(&self, line: &Line<'b>) -> Result<&'b str, MotionError> {
        match line.words[..] {
            [_, value] => Ok(value),
            _ => Err(self.wrong(line, format!("{} values after {}", line.words.len() - 1, line.words[0]), "one")),
        }
    }

    fn units(&mut self, line: &Line<'_>) -> Result<(), MotionError> {
        let value = self.single(line)?;
        match line.words[0].to_ascii_lowercase().as_str() {
            "mass" => {
                number(self.file, line.number, value)?;
            }
            "length" => {
                let length = number(self.file, line.number, value)?;
                if !(1e-6..=1e6).contains(&length) {
                    return Err(self.wrong(line, format!("length {value}"), "a positive number, such as CMU's 0.45"));
                }
                self.units.length = length;
            }
            "angle" => self.units.radians = angle_unit(value).ok_or_else(|| self.wrong(line, value, "deg or rad"))?,
            other => return Err(self.wrong(line, other, "mass, length or angle")),
        }
        Ok(())
    }

    fn root(&mut self, line: &Line<'_>) -> Result<(), MotionError> {
        let values = &line.words[1..];
        match line.words[0].to_ascii_lowercase().as_str() {
            "order" => {
                let mut order = Vec::with_capacity(6);
                for word in values {
                    let value = root_value(word).ok_or_else(|| self.wrong(line, *word, "TX, TY, TZ, RX, RY or RZ"))?;
                    if order.contains(&value) {
                        return Err(self.wrong(line, format!("{word} twice"), "each value once"));
                    }
                    order.push(value);
                }
                self.root.order = order;
            }
            "axis" => self.root.axis = self.letters(line, self.single(line)?)?,
            "position" => self.root.position = triple(self.file, line.number, values)?,
            "orientation" => self.root.orientation = triple(self.file, line.number, values)?,
            other => return Err(self.wrong(line, other, "order, axis, position or orientation")),
        }
        Ok(())
    }

    /// Three different axis letters.
    fn letters(&self, line: &Line<'_>, word: &str) -> Result<Vec<FileAxis>, MotionError> {
        let axes: Option<Vec<_>> = word.chars().map(FileAxis::from_letter).collect();
        match axes {
            Some(axes) if axes.len() == 3 && all_differ(&axes) => Ok(axes),
            _ => Err(self.wrong(line, format!("{word:?}"), "the letters X, Y and Z in some order")),
        }
    }

    fn bone(&mut self, line: &Line<'_>) -> Result<(), MotionError> {
        let (key, values) = (line.words[0].to_ascii_lowercase(), &line.words[1..]);
        let Some(mut block) = self.open.take() else {
            if key != "begin" {
                return Err(self.wrong(line, line.words[0], "begin"));
            }
            self.open = Some(Block { line: line.number, ..Block::default() });
            return Ok(());
        };
        match key.as_str() {
            "end" => {
                self.bones.push(block);
                return Ok(());
            }
            "name" => block.name = Some(self.single(line)?.to_owned()),
            "direction" => block.direction = Some(triple(self.file, line.number, values)?),
            "length" => block.length = Some(number(self.file, line.number, self.single(line)?)?),
            "axis" => {
                let (letters, angles) =
                    values.split_last().ok_or_else(|| self.wrong(line, "axis", "axis x y z XYZ"))?;
                block.axis = Some((triple(self.file, line.number, angles)?, self.letters(line, letters)?));
            }
            "dof" => {
                for word in values {
                    let expected = "rx, ry or rz (bones that translate or stretch are not supported)";
                    match root_value(word) {
                        Some(RootValue::Rotation(axis)) => block.dofs.push(axis),
                        _ => return Err(self.wrong(line, *word, expected)),
                    }
                }
                if !all_differ(&block.dofs) {
                    return Err(self.wrong(line, values.join(" "), "each degree of freedom once"));
                }
            }
            // Limits are not enforced by a reader; masses are not recorded by anybody.
            "id" | "limits" | "bodymass" | "cofmass" => {}
            key if key.starts_with('(') => {}
            _ => return Err(self.wrong(line, line.words[0], "id, name, direction, length, axis, dof, limits or end")),
        }
        self.open = Some(block);
        Ok(())
    }

    fn hierarchy(&mut self, line: &Line<'_>) -> Result<(), MotionError> {
        let [parent, children @ ..] = &line.words[..] else { return Ok(()) };
        if children.is_empty() {
            let mark = parent.eq_ignore_ascii_case("begin") || parent.eq_ignore_ascii_case("end");
            return if mark { Ok(()) } else { Err(self.wrong(line, *parent, "a bone and its children")) };
        }
        for child in children {
            self.children.entry((*parent).to_owned()).or_default().push(((*child).to_owned(), line.number));
        }
        Ok(())
    }

    /// The tree, parents before children, in our units and axes.
    fn finish(self, end: usize) -> Result<Rig, MotionError> {
        let file = self.file;
        if self.root.order.is_empty() {
            return Err(MotionError::syntax(file, end, "no order of the root's values", ":root with order TX TY ..."));
        }
        let metres = 0.0254 / self.units.length;
        let mut blocks = HashMap::new();
        for block in &self.bones {
            let Some(name) = block.name.as_deref() else {
                return Err(MotionError::syntax(file, block.line, "a bone without a name", "name"));
            };
            if name == "root" || blocks.insert(name, block).is_some() {
                return Err(MotionError::syntax(file, block.line, format!("a second {name}"), "a name for each bone"));
            }
        }
        let euler = |angles: Vector3<f64>, order: &[FileAxis]| {
            order.iter().fold(UnitQuaternion::identity(), |r, axis| {
                axis.rotation(angles[axis.index()] * self.units.radians) * r
            })
        };
        let root = Bone { name: "root".to_owned(), parent: None, origin: Vector3::zeros(), tip: Vector3::zeros() };
        let root_joint = Joint { axis: euler(self.root.orientation, &self.root.axis), dofs: self.root.axis.clone() };
        let (mut bones, mut joints) = (vec![root], vec![root_joint]);
        // Depth first; a bone that was taken leaves `blocks`, so that a cycle or a second parent cannot pass.
        let mut stack: Vec<(usize, &(String, usize))> = Vec::new();
        let push_children = |stack: &mut Vec<_>, parent: usize, name: &str| {
            stack.extend(self.children.get(name).into_iter().flatten().rev().map(move |child| (parent, child)));
        };
        push_children(&mut stack, 0, "root");
        while let Some((parent, (name, line))) = stack.pop() {
            let Some(block) = blocks.remove(name.as_str()) else {
                let expected = "a bone of :bonedata that has no other parent";
                return Err(MotionError::syntax(file, *line, name.as_str(), expected));
            };
            let tip = z_up(block.tip(file)?) * metres;
            bones.push(Bone { name: name.clone(), parent: Some(parent), origin: bones[parent].tip, tip });
            let axis =
                block.axis.as_ref().map_or_else(UnitQuaternion::identity, |(angles, order)| euler(*angles, order));
            joints.push(Joint { axis, dofs: block.dofs.clone() });
            push_children(&mut stack, bones.len() - 1, name);
        }
        if let Some((name, block)) = blocks.iter().min_by_key(|(_, block)| block.line) {
            let found = format!("{name} without a parent in :hierarchy");
            return Err(MotionError::syntax(file, block.line, found, "a bone that hangs on the root"));
        }
        if bones.len() < 2 {
            return Err(MotionError::syntax(file, end, "no bones", ":bonedata and :hierarchy"));
        }
        Ok(Rig {
            skeleton: Skeleton { bones },
            joints,
            root_order: self.root.order,
            root_position: z_up(self.root.position) * metres,
            metres,
            radians: self.units.radians,
        })
    }
}

impl Block {
    /// `direction * length` in the file's unit and axes.
    fn tip(&self, file: &Path) -> Result<Vector3<f64>, MotionError> {
        let wrong = |found: String, expected: &str| Err(MotionError::syntax(file, self.line, found, expected));
        let (Some(direction), Some(length)) = (self.direction, self.length) else {
            return wrong("a bone without direction or length".to_owned(), "both");
        };
        if !(0.0..1e6).contains(&length) {
            return wrong(format!("length {length}"), "a length that is not negative");
        }
        if length > 0.0 && !(0.99..=1.01).contains(&direction.norm()) {
            return wrong(format!("direction of length {}", direction.norm()), "a unit vector");
        }
        Ok(direction * length)
    }
}

/// Radians in one `deg` or `rad`.
pub(super) fn angle_unit(word: &str) -> Option<f64> {
    match word.to_ascii_lowercase().as_str() {
        "deg" | "degrees" => Some(1.0_f64.to_radians()),
        "rad" | "radians" => Some(1.0),
        _ => None,
    }
}

fn root_value(word: &str) -> Option<RootValue> {
    let mut letters = word.chars();
    let (kind, axis) = (letters.next()?, FileAxis::from_letter(letters.next()?)?);
    match (kind.to_ascii_uppercase(), letters.next()) {
        ('T', None) => Some(RootValue::Translation(axis)),
        ('R', None) => Some(RootValue::Rotation(axis)),
        _ => None,
    }
}

fn all_differ(axes: &[FileAxis]) -> bool {
    axes.iter().enumerate().all(|(i, axis)| !axes[..i].contains(axis))
}
