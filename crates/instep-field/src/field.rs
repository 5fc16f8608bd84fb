//! One field: its numbers, where they come from a file, and the lines and landmarks that follow from them.
//!
//! Lines are their middles. A landmark is what a detector knows by its class: a goal post's foot, an L, a T or an X of
//! lines, a penalty mark. The centre mark lies on the halfway line and counts as an X. Arcs at corners and penalty
//! areas are left out: no league that robots play in draws them.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::{FieldError, Line, Pose, presets};

/// A field. Lengths are along x (goal to goal), widths along y, m.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Field {
    /// Its name in tables and reports.
    pub name: String,
    /// Between the goal lines.
    pub length: f64,
    /// Between the touch lines.
    pub width: f64,
    /// Of every line.
    #[serde(default = "Field::default_line_width")]
    pub line_width: f64,
    /// Free ground outside the lines.
    #[serde(default = "Field::default_border")]
    pub border: f64,
    /// Both goals.
    pub goal: GoalSize,
    /// The small area before a goal.
    pub goal_area: Area,
    /// The large area before a goal, where there is one.
    #[serde(default)]
    pub penalty_area: Option<Area>,
    /// From the goal line to the penalty mark.
    pub penalty_mark: f64,
    /// Of the centre circle.
    pub circle_radius: f64,
    /// The ball that is played with.
    #[serde(default)]
    pub ball: Ball,
    /// Landmarks in the place of those that follow from the lines. Must be closed under half a turn if localisation
    /// shall treat both halves alike; it need not be.
    #[serde(default, skip_serializing_if = "Option::is_none", rename = "landmark")]
    pub own_landmarks: Option<Vec<Landmark>>,
}

/// Both goals, m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GoalSize {
    /// Between the posts' middles.
    pub width: f64,
    /// Under the bar.
    pub height: f64,
    /// Behind the goal line.
    pub depth: f64,
}

/// An area on a goal line, m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Area {
    /// From the goal line into the field.
    pub length: f64,
    /// Along the goal line.
    pub width: f64,
}

/// The ball.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ball {
    /// m.
    pub radius: f64,
    /// kg.
    pub mass: f64,
}

impl Default for Ball {
    /// FIFA size 5.
    fn default() -> Self {
        Ball { radius: 0.11, mass: 0.43 }
    }
}

/// What a landmark is to a detector.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum LandmarkClass {
    /// Foot of a goal post.
    #[serde(rename = "goal_post")]
    GoalPost,
    /// Corner of two lines.
    L,
    /// A line that ends on another.
    T,
    /// Two lines that cross, and the centre mark.
    X,
    /// A penalty mark.
    #[serde(rename = "penalty_mark")]
    PenaltyMark,
}

impl LandmarkClass {
    /// All classes, in the order of their declaration.
    pub const ALL: [LandmarkClass; 5] = [Self::GoalPost, Self::L, Self::T, Self::X, Self::PenaltyMark];

    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::GoalPost => "goal_post",
            Self::L => "L",
            Self::T => "T",
            Self::X => "X",
            Self::PenaltyMark => "penalty_mark",
        }
    }
}

/// A landmark of the map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Landmark {
    /// Its class.
    pub class: LandmarkClass,
    /// In the field frame, m.
    pub x: f64,
    /// In the field frame, m.
    pub y: f64,
}

impl Landmark {
    /// Where it is, m.
    pub fn position(&self) -> [f64; 2] {
        [self.x, self.y]
    }
}

impl Field {
    const fn default_line_width() -> f64 {
        0.05
    }

    const fn default_border() -> f64 {
        1.0
    }

    /// A known field, one of [`crate::FIELD_NAMES`].
    ///
    /// # Errors
    /// [`FieldError::Unknown`] with the names that there are.
    pub fn named(name: &str) -> Result<Field, FieldError> {
        presets::field(name)
            .ok_or_else(|| FieldError::Unknown { name: name.to_owned(), known: crate::FIELD_NAMES.join(", ") })
    }

    /// A known field by name, or a field's TOML file by path (whatever ends in `.toml`).
    ///
    /// # Errors
    /// As [`Field::named`] and [`Field::load`].
    pub fn named_or_load(name_or_path: &str) -> Result<Field, FieldError> {
        if name_or_path.ends_with(".toml") { Field::load(Path::new(name_or_path)) } else { Field::named(name_or_path) }
    }

    /// Reads a field's TOML file.
    ///
    /// # Errors
    /// [`FieldError`] with file and line, or with file and the path of the value that cannot be.
    pub fn load(path: &Path) -> Result<Field, FieldError> {
        let text = std::fs::read_to_string(path).map_err(|e| FieldError::file(path, e))?;
        let field: Field = toml::from_str(&text).map_err(|e| FieldError::file(path, e))?;
        field.validate(&path.display().to_string())?;
        Ok(field)
    }

    /// Checks every number; `file` is what an error names.
    ///
    /// # Errors
    /// [`FieldError::Value`] for the first that cannot be.
    pub fn validate(&self, file: &str) -> Result<(), FieldError> {
        let value = |field: &str, found: String, expected: String| FieldError::Value {
            file: file.to_owned(),
            field: field.to_owned(),
            found,
            expected,
        };
        let within = |field: &str, found: f64, low: f64, high: f64| {
            if found >= low && found <= high {
                Ok(())
            } else {
                Err(value(field, format!("{found} m"), format!("{low} to {high} m")))
            }
        };
        within("length", self.length, 1.0, 200.0)?;
        within("width", self.width, 1.0, 200.0)?;
        let (half_length, half_width) = (self.length / 2.0, self.width / 2.0);
        within("line_width", self.line_width, 0.01, 0.5)?;
        within("border", self.border, 0.0, 50.0)?;
        within("goal.width", self.goal.width, 0.1, self.width)?;
        within("goal.height", self.goal.height, 0.1, 10.0)?;
        within("goal.depth", self.goal.depth, 0.05, 10.0)?;
        within("goal_area.length", self.goal_area.length, 0.1, half_length)?;
        within("goal_area.width", self.goal_area.width, 0.1, self.width)?;
        if let Some(area) = self.penalty_area {
            within("penalty_area.length", area.length, self.goal_area.length, half_length)?;
            within("penalty_area.width", area.width, self.goal_area.width, self.width)?;
        }
        within("penalty_mark", self.penalty_mark, 0.1, half_length)?;
        within("circle_radius", self.circle_radius, 0.1, half_length.min(half_width))?;
        within("ball.radius", self.ball.radius, 0.01, 0.5)?;
        if !(self.ball.mass > 0.0 && self.ball.mass <= 5.0) {
            return Err(value("ball.mass", format!("{} kg", self.ball.mass), "above 0, at most 5 kg".to_owned()));
        }
        if let Some(landmarks) = &self.own_landmarks {
            if landmarks.is_empty() {
                let expected = "at least one landmark, or no such key: then they follow from the lines".to_owned();
                return Err(value("landmark", "a field without landmarks".to_owned(), expected));
            }
            let (x, y) = (half_length + self.border, half_width + self.border);
            for (i, landmark) in landmarks.iter().enumerate() {
                within(&format!("landmark[{i}].x (outside the field)"), landmark.x, -x, x)?;
                within(&format!("landmark[{i}].y (outside the field)"), landmark.y, -y, y)?;
            }
        }
        Ok(())
    }

    /// The white lines: touch and goal lines, halfway line, areas, centre circle.
    pub fn lines(&self) -> Vec<Line> {
        let (x, y) = (self.length / 2.0, self.width / 2.0);
        let segment = |from, to| Line::Segment { from, to };
        let mut lines = vec![
            segment([-x, -y], [x, -y]),
            segment([x, -y], [x, y]),
            segment([x, y], [-x, y]),
            segment([-x, y], [-x, -y]),
            segment([0.0, -y], [0.0, y]),
            Line::Circle { center: [0.0; 2], radius: self.circle_radius },
        ];
        for area in self.areas() {
            let w = area.width / 2.0;
            for (goal_line, front) in [(-x, area.length - x), (x, x - area.length)] {
                lines.push(segment([goal_line, -w], [front, -w]));
                lines.push(segment([front, -w], [front, w]));
                lines.push(segment([front, w], [goal_line, w]));
            }
        }
        lines
    }

    /// The landmarks: the file's own, or what follows from the lines, closed under half a turn about the origin.
    pub fn landmarks(&self) -> Vec<Landmark> {
        self.own_landmarks.clone().unwrap_or_else(|| self.landmarks_of_lines())
    }

    /// What follows from the lines, whatever the file says. An area as wide as the field or the goal has no corners
    /// of its own and is still listed.
    fn landmarks_of_lines(&self) -> Vec<Landmark> {
        use LandmarkClass::{GoalPost, L, PenaltyMark, T, X};
        let (x, y) = (self.length / 2.0, self.width / 2.0);
        let mut landmarks = vec![Landmark { class: X, x: 0.0, y: 0.0 }];
        for sign in [1.0, -1.0] {
            let mut add = |class, x: f64, y: f64| landmarks.push(Landmark { class, x: sign * x, y: sign * y });
            add(L, x, y);
            add(L, x, -y);
            add(T, 0.0, y);
            add(X, 0.0, self.circle_radius);
            add(GoalPost, x, self.goal.width / 2.0);
            add(GoalPost, x, -self.goal.width / 2.0);
            add(PenaltyMark, x - self.penalty_mark, 0.0);
            for area in self.areas() {
                for w in [area.width / 2.0, -area.width / 2.0] {
                    add(L, x - area.length, w);
                    add(T, x, w);
                }
            }
        }
        landmarks
    }

    fn areas(&self) -> impl Iterator<Item = Area> {
        std::iter::once(self.goal_area).chain(self.penalty_area)
    }

    /// Whether a point lies within the lines widened by `margin` (negative: narrowed), m.
    pub fn contains(&self, point: [f64; 2], margin: f64) -> bool {
        point[0].abs() <= self.length / 2.0 + margin && point[1].abs() <= self.width / 2.0 + margin
    }

    /// Whether a pose lies in our own half.
    pub fn in_own_half(&self, pose: &Pose) -> bool {
        pose.x < 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FIELD_NAMES;

    #[test]
    fn the_adult_field_has_the_landmarks_of_paper_4() {
        let landmarks = Field::named("adult-2024").unwrap().landmarks();
        let count = |class| landmarks.iter().filter(|l| l.class == class).count();
        assert_eq!(LandmarkClass::ALL.map(count), [4, 12, 10, 3, 2]);
        let has = |class, x: f64, y: f64| {
            landmarks.iter().any(|l| l.class == class && (l.x - x).abs() < 1e-12 && (l.y - y).abs() < 1e-12)
        };
        assert!(has(LandmarkClass::GoalPost, 7.0, -1.3) && has(LandmarkClass::L, -4.0, 3.0));
        assert!(has(LandmarkClass::T, 7.0, 2.0) && has(LandmarkClass::PenaltyMark, -4.9, 0.0));
        assert!(has(LandmarkClass::X, 0.0, -1.5) && has(LandmarkClass::T, 0.0, -4.5));
    }

    #[test]
    fn every_field_is_valid_closed_under_half_a_turn_and_survives_its_file() {
        for name in FIELD_NAMES {
            let field = Field::named(name).unwrap();
            assert_eq!(&field.name, name);
            field.validate(name).unwrap();
            let landmarks = field.landmarks();
            for a in &landmarks {
                assert!(
                    landmarks.iter().any(|b| b.class == a.class && (a.x + b.x).hypot(a.y + b.y) < 1e-9),
                    "{name} {a:?}"
                );
            }
            let text = toml::to_string(&field).unwrap();
            assert_eq!(toml::from_str::<Field>(&text).unwrap(), field);
        }
    }

    /// L, T and X lie where the lines say: on at least two of them (the centre mark on one).
    #[test]
    fn landmarks_lie_on_lines() {
        for name in FIELD_NAMES {
            let field = Field { own_landmarks: None, ..Field::named(name).unwrap() };
            let lines = field.lines();
            for landmark in field.landmarks() {
                let through = lines.iter().filter(|line| line.distance(landmark.position()) < 1e-9).count();
                let least = match landmark.class {
                    LandmarkClass::L | LandmarkClass::T => 2,
                    LandmarkClass::X if landmark.y != 0.0 => 2,
                    LandmarkClass::X | LandmarkClass::GoalPost => 1,
                    LandmarkClass::PenaltyMark => 0,
                };
                assert!(through >= least, "{name} {landmark:?} lies on {through} lines");
            }
        }
    }

    #[test]
    fn a_wrong_number_is_named_by_its_path() {
        let good = Field::named("kid").unwrap();
        let said = |field: Field| field.validate("own.toml").unwrap_err().to_string();
        assert!(said(Field { length: f64::NAN, ..good.clone() }).starts_with("own.toml: length: NaN m"));
        let goal = GoalSize { width: 7.0, ..good.goal };
        assert!(said(Field { goal, ..good.clone() }).contains("goal.width: 7 m; expected 0.1 to 6 m"));
        let none = Field { own_landmarks: Some(Vec::new()), ..good.clone() };
        assert!(said(none).contains("landmark: a field without landmarks"));
        let outside = vec![Landmark { class: LandmarkClass::L, x: 1.0, y: 40.0 }];
        assert!(
            said(Field { own_landmarks: Some(outside), ..good }).contains("landmark[0].y (outside the field): 40 m")
        );
    }

    #[test]
    fn an_unknown_name_and_an_unknown_key_are_refused() {
        assert!(Field::named("moon").unwrap_err().to_string().contains("expected one of adult-2024"));
        let text = toml::to_string(&Field::named("kid").unwrap()).unwrap();
        let error = toml::from_str::<Field>(&format!("holes = 3\n{text}")).unwrap_err();
        assert!(error.to_string().contains("holes"), "{error}");
    }
}
