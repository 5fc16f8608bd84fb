//! Plots beside the replay: lines with limits, regions and events.

use crate::Color;

/// One small plot.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plot {
    /// What it shows, such as "Knee torque".
    pub title: String,
    /// Name and unit of the x axis; ignored for [`Axis::Time`], which is labelled by itself.
    pub x_label: String,
    /// Name and unit of the y axis, such as "N m".
    pub y_label: String,
    /// What the x axis is.
    pub axis: Axis,
    /// The x values of every [`Samples::Shared`] series; empty means [`crate::Replay::times`].
    pub x: Vec<f64>,
    /// The lines.
    pub series: Vec<Series>,
    /// Dashed level lines.
    pub limits: Vec<Limit>,
    /// Shaded stretches of the x axis.
    pub regions: Vec<Region>,
}

/// What a plot's x axis is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Axis {
    /// Seconds of the replay: the plot shows its events and cursor, and a click seeks.
    #[default]
    Time,
    /// Anything else (a sweep over ball positions, a phase plot).
    Other,
}

/// One line in a plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Shown in the legend.
    pub name: String,
    /// Its colour; without one the next of a fixed palette.
    pub color: Option<Color>,
    /// Its values.
    pub samples: Samples,
    /// Drawn dashed: a reference beside the measured line.
    pub dashed: bool,
}

/// The values of a series. A value that is not finite leaves a gap.
#[derive(Debug, Clone, PartialEq)]
pub enum Samples {
    /// One y for each shared x ([`Plot::x`], or the replay's times).
    Shared(Vec<f64>),
    /// Pairs `[x, y]`, x rising for [`Axis::Time`].
    Points(Vec<[f64; 2]>),
}

impl Series {
    /// A solid line over the shared x values, coloured from the palette.
    pub fn shared(name: impl Into<String>, y: Vec<f64>) -> Self {
        Self { name: name.into(), color: None, samples: Samples::Shared(y), dashed: false }
    }

    /// A solid line through pairs `[x, y]`, coloured from the palette.
    pub fn points(name: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self { name: name.into(), color: None, samples: Samples::Points(points), dashed: false }
    }

    /// The same line in this colour.
    #[must_use]
    pub fn colored(mut self, color: Color) -> Self {
        self.color = Some(color);
        self
    }

    /// The same line, dashed.
    #[must_use]
    pub fn dashed(mut self) -> Self {
        self.dashed = true;
        self
    }
}

/// A level that matters, drawn as a dashed line.
#[derive(Debug, Clone, PartialEq)]
pub struct Limit {
    /// What it is, such as "limit".
    pub label: String,
    /// On the y axis, in its unit.
    pub value: f64,
}

/// A stretch of the x axis, shaded.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// What it is, such as "swing".
    pub label: String,
    /// Where it begins, in the x axis' unit.
    pub from: f64,
    /// Where it ends.
    pub to: f64,
}
