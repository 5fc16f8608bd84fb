//! The report itself: what stands at the top, the tables, and how it is saved.

use std::path::Path;

use crate::{Matrix, Plot, Replay, ReportError, file, html};

/// One page: a person opens it and knows how the trial went.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Report {
    /// The page's title.
    pub title: String,
    /// One line below it: robot, engine, scenario, seed.
    pub subtitle: String,
    /// The few numbers that matter, shown large.
    pub summary: Vec<SummaryItem>,
    /// A comparison of many with many.
    pub matrix: Option<Matrix>,
    /// Detail, in order.
    pub tables: Vec<Table>,
    /// The 3-D view.
    pub replay: Option<Replay>,
    /// Small plots, in order.
    pub plots: Vec<Plot>,
    /// Paragraphs of plain text at the end: how it was measured, what falls short.
    pub notes: Vec<String>,
}

/// How something went.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Verdict {
    /// As wanted: green.
    Good,
    /// Not as wanted: red.
    Bad,
    /// A fact, not a judgement.
    #[default]
    Neutral,
}

/// A number that matters.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SummaryItem {
    /// What it is, such as "Ball speed".
    pub label: String,
    /// With its unit, already rounded, such as "4.21 m/s".
    pub value: String,
    /// How it went.
    pub verdict: Verdict,
    /// One line of detail, such as "wanted 4.0 m/s"; may be empty.
    pub note: String,
}

impl SummaryItem {
    /// A number with its verdict and one line of detail.
    pub fn new(label: impl Into<String>, value: impl Into<String>, verdict: Verdict, note: impl Into<String>) -> Self {
        Self { label: label.into(), value: value.into(), verdict, note: note.into() }
    }
}

/// A table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// Its heading.
    pub title: String,
    /// Its columns.
    pub columns: Vec<Column>,
    /// Its rows; each has one cell for each column.
    pub rows: Vec<Vec<Cell>>,
}

/// A column of a table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Column {
    /// Its heading, with the unit.
    pub title: String,
    /// How its cells stand.
    pub align: Align,
}

/// How cells stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Align {
    /// Words: to the left.
    #[default]
    Left,
    /// Numbers: to the right, with digits of one width.
    Right,
}

impl Column {
    /// A column of words.
    pub fn text(title: impl Into<String>) -> Self {
        Self { title: title.into(), align: Align::Left }
    }

    /// A column of numbers.
    pub fn number(title: impl Into<String>) -> Self {
        Self { title: title.into(), align: Align::Right }
    }
}

/// A cell of a table. Made from anything that is text: `"3.2".into()`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cell {
    /// Its text, already rounded.
    pub text: String,
    /// How it went: colours the cell.
    pub verdict: Verdict,
}

impl<T: Into<String>> From<T> for Cell {
    fn from(text: T) -> Self {
        Self { text: text.into(), verdict: Verdict::Neutral }
    }
}

impl Cell {
    /// A cell with a verdict.
    pub fn judged(text: impl Into<String>, verdict: Verdict) -> Self {
        Self { text: text.into(), verdict }
    }
}

impl Report {
    /// The page as one HTML text. Where numbers are missing (see [`Report::check`]) the page shows less, but it opens.
    pub fn html(&self) -> String {
        html::page(self)
    }

    /// Whether the parts of the report fit together: a pose for each frame, a value for each x, a cell for each column,
    /// rising times, finite poses.
    ///
    /// # Errors
    /// [`ReportError::Inconsistent`] with the first place that does not fit.
    pub fn check(&self) -> Result<(), ReportError> {
        html::check(self)
    }

    /// Checks the report, then writes the page to `path` in one step: a reader sees the old file or the new one.
    ///
    /// # Errors
    /// [`ReportError::Inconsistent`] if the parts do not fit together, [`ReportError::Write`] if the file cannot be
    /// written; then nothing is left behind.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), ReportError> {
        self.check()?;
        file::write_atomically(path.as_ref(), self.html().as_bytes())
    }
}
