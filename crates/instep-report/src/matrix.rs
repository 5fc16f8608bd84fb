//! A matrix: the same measures for every pair of a row and a column. One measure is shown at a time, as a number on a shade
//! with its interval below; a click on a cell shows all that is known of it.

/// A matrix.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Matrix {
    /// Its heading.
    pub title: String,
    /// What one may look at; the first is shown at the start.
    pub measures: Vec<Measure>,
    /// Names of the columns, in order.
    pub columns: Vec<String>,
    /// The rows.
    pub rows: Vec<MatrixRow>,
}

/// One measure of every cell.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Measure {
    /// Its name, with the unit.
    pub name: String,
    /// What it is, in a sentence.
    pub about: String,
    /// The value that is shaded as the worst, and the one that is shaded as the best.
    pub shade: [f64; 2],
    /// Digits after the point.
    pub digits: usize,
}

/// One row.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MatrixRow {
    /// Its name.
    pub name: String,
    /// One for each column; `None` where there is nothing.
    pub cells: Vec<Option<MatrixCell>>,
}

/// One cell.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MatrixCell {
    /// For each measure: the value and the ends of its interval, each `None` where there is none.
    pub values: Vec<[Option<f64>; 3]>,
    /// All that is known of it: what and how much.
    pub details: Vec<(String, String)>,
    /// Files beside the page that show more: label and relative path.
    pub links: Vec<(String, String)>,
}
