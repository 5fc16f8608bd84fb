//! What the readers of text formats share: numbered lines without comments, and numbers with a place in the error;
//! and the change from their y-up axes to ours.
//!
//! Problem: motion files come from many hands (CRLF, blank lines, stray bytes), and an error must name file and line.
//! Bytes that are no UTF-8 are replaced, not refused: they stand in comments, or fail where they matter.

use std::path::Path;

use nalgebra::{Unit, UnitQuaternion, Vector3};

use crate::MotionError;

/// One line that holds something.
#[derive(Debug, Clone)]
pub(crate) struct Line<'a> {
    /// Counted from 1.
    pub(crate) number: usize,
    /// Words between white space; at least one.
    pub(crate) words: Vec<&'a str>,
}

/// The whole file as text.
pub(crate) fn read(file: &Path) -> Result<String, MotionError> {
    let bytes = std::fs::read(file).map_err(|source| MotionError::Read { file: file.to_owned(), source })?;
    Ok(decode(&bytes))
}

/// `bytes` as text, without the byte-order mark that some editors put first: UTF-8, or UTF-16 where the mark says so.
/// What is neither is replaced by U+FFFD.
#[must_use]
pub fn decode(bytes: &[u8]) -> String {
    let utf16 = |bytes: &[u8], unit: fn([u8; 2]) -> u16| {
        let units = bytes.chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
        char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
    };
    match bytes {
        [0xEF, 0xBB, 0xBF, rest @ ..] => String::from_utf8_lossy(rest).into_owned(),
        [0xFF, 0xFE, rest @ ..] => utf16(rest, u16::from_le_bytes),
        [0xFE, 0xFF, rest @ ..] => utf16(rest, u16::from_be_bytes),
        _ => String::from_utf8_lossy(bytes).into_owned(),
    }
}

/// The lines of `text` that hold something, without comments (from `comment` to the end of the line).
pub(crate) fn lines<'a>(text: &'a str, comment: Option<char>) -> impl Iterator<Item = Line<'a>> {
    text.lines().enumerate().filter_map(move |(i, line)| {
        let line = comment.and_then(|mark| line.split(mark).next()).unwrap_or(line);
        let words: Vec<&str> = line.split_whitespace().collect();
        (!words.is_empty()).then_some(Line { number: i + 1, words })
    })
}

/// Number of the last line of `text`, for errors at its end.
pub(crate) fn last_line(text: &str) -> usize {
    text.lines().count().max(1)
}

/// The largest number that is believed: so that no product of it with a unit overflows.
const LARGEST: f64 = 1e12;

/// A number, finite and not absurdly large.
pub(crate) fn number(file: &Path, line: usize, word: &str) -> Result<f64, MotionError> {
    match word.parse::<f64>() {
        Ok(value) if value.abs() <= LARGEST => Ok(value),
        _ => Err(MotionError::syntax(
            file,
            line,
            format!("{word:?}"),
            format!("a number of at most {LARGEST:e} in size"),
        )),
    }
}

/// Exactly three numbers.
pub(crate) fn triple(file: &Path, line: usize, words: &[&str]) -> Result<Vector3<f64>, MotionError> {
    let [x, y, z] = words else {
        return Err(MotionError::syntax(file, line, format!("{} values", words.len()), "three numbers"));
    };
    Ok(Vector3::new(number(file, line, x)?, number(file, line, y)?, number(file, line, z)?))
}

/// An axis of a y-up file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FileAxis {
    X,
    Y,
    Z,
}

impl FileAxis {
    /// From its letter, of either case.
    pub(crate) fn from_letter(letter: char) -> Option<Self> {
        match letter.to_ascii_uppercase() {
            'X' => Some(Self::X),
            'Y' => Some(Self::Y),
            'Z' => Some(Self::Z),
            _ => None,
        }
    }

    /// Its index in the file's vectors.
    pub(crate) fn index(self) -> usize {
        match self {
            Self::X => 0,
            Self::Y => 1,
            Self::Z => 2,
        }
    }

    /// Its direction in our axes: the file's x, y, z are our y, z, x.
    fn ours(self) -> Unit<Vector3<f64>> {
        match self {
            Self::X => Vector3::y_axis(),
            Self::Y => Vector3::z_axis(),
            Self::Z => Vector3::x_axis(),
        }
    }

    /// The rotation by `angle` rad about it, in our axes.
    pub(crate) fn rotation(self, angle: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::from_axis_angle(&self.ours(), angle)
    }
}

/// A vector of a y-up file in our z-up axes: (x, y, z) becomes (z, x, y), a cyclic permutation, so a rotation.
pub(crate) fn z_up(file: Vector3<f64>) -> Vector3<f64> {
    Vector3::new(file.z, file.x, file.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn change_of_axes_is_the_same_for_vectors_and_rotations() {
        let angle = 0.7_f64;
        // A turn about the file's x axis, done in file axes by hand.
        let in_file = Vector3::new(1.0, 2.0 * angle.cos() - 3.0 * angle.sin(), 2.0 * angle.sin() + 3.0 * angle.cos());
        let turned = FileAxis::X.rotation(angle) * z_up(Vector3::new(1.0, 2.0, 3.0));
        assert!((turned - z_up(in_file)).norm() < 1e-12);
        assert_eq!(z_up(Vector3::y()), Vector3::z());
    }

    #[test]
    fn lines_skip_comments_blanks_and_carriage_returns() {
        let got: Vec<_> = lines("# one\r\n\r\na b # c\r\n  d", Some('#')).map(|l| (l.number, l.words)).collect();
        assert_eq!(got, [(3, vec!["a", "b"]), (4, vec!["d"])]);
    }

    /// Issue 22: a text file with a byte-order mark was refused at its first line.
    #[test]
    fn issue_22_byte_order_marks_are_no_text() {
        let utf16 = |unit: fn(u16) -> [u8; 2]| "\u{feff}Höhe 1".encode_utf16().flat_map(unit).collect::<Vec<_>>();
        for bytes in
            ["\u{feff}Höhe 1".as_bytes(), "Höhe 1".as_bytes(), &utf16(u16::to_le_bytes), &utf16(u16::to_be_bytes)]
        {
            assert_eq!(decode(bytes), "Höhe 1");
        }
    }

    #[test]
    fn numbers_that_are_not_finite_are_refused() {
        for word in ["nan", "inf", "1e999", "x", ""] {
            assert!(number(Path::new("f"), 1, word).is_err(), "{word}");
        }
        assert_eq!(number(Path::new("f"), 1, "7.62852e-016").unwrap(), 7.62852e-16);
    }
}
