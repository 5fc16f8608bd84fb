//! A curve of quintic segments of fixed capacity, so that it can be rebuilt in a control tick without allocation.
//!
//! Source: paper 2, section 4.2: key frames with position, speed and acceleration, fifth-degree polynomials between
//! them. The polynomial is instep-motion's. Before the first and after the last segment the end position is held.

use instep_motion::spline::{Quintic, State};

/// Most segments.
const SEGMENTS: usize = 16;

/// A curve in `D` coordinates.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Path<const D: usize> {
    segments: [Option<(f64, Quintic<D>)>; SEGMENTS],
    count: usize,
    end: f64,
    last: State<D>,
}

impl<const D: usize> Path<D> {
    /// Starts at `time` (s) in `state`.
    #[must_use]
    pub(crate) fn starting(time: f64, state: State<D>) -> Self {
        Self { segments: [None; SEGMENTS], count: 0, end: time, last: state }
    }

    /// Goes on to `state` within `duration` (s). Too short a duration, or one segment too many, only replaces the end.
    pub(crate) fn to(&mut self, duration: f64, state: State<D>) {
        if self.count < SEGMENTS
            && let Ok(segment) = Quintic::between(duration, &self.last, &state)
        {
            self.segments[self.count] = Some((self.end, segment));
            self.count += 1;
            self.end += duration;
        }
        self.last = state;
    }

    /// Stays where it is for `duration` (s).
    pub(crate) fn hold(&mut self, duration: f64) {
        self.to(duration, State::at_rest(self.last.position));
    }

    /// When it ends, s.
    #[must_use]
    pub(crate) fn end(&self) -> f64 {
        self.end
    }

    /// The state at the end.
    #[must_use]
    pub(crate) fn last(&self) -> State<D> {
        self.last
    }

    /// State at `time` (s).
    #[must_use]
    pub(crate) fn at(&self, time: f64) -> State<D> {
        if time >= self.end || self.count == 0 {
            return State::at_rest(self.last.position);
        }
        let mut chosen = self.segments[0];
        for segment in self.segments[..self.count].iter().flatten() {
            if segment.0 <= time {
                chosen = Some(*segment);
            }
        }
        let Some((start, segment)) = chosen else { return self.last };
        let t = time - start;
        if t < 0.0 {
            return State::at_rest(segment.position(0.0));
        }
        State { position: segment.position(t), velocity: segment.velocity(t), acceleration: segment.acceleration(t) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_passes_its_knots_and_holds_its_ends() {
        let mut path = Path::starting(1.0, State::at_rest([0.0]));
        let knot = State { position: [1.0], velocity: [2.0], acceleration: [0.5] };
        path.to(0.5, knot);
        path.to(0.25, State::at_rest([1.5]));
        path.hold(1.0);
        assert_eq!(path.at(0.0).position, [0.0]);
        let at = path.at(1.5);
        assert!((at.position[0] - 1.0).abs() < 1e-12 && (at.velocity[0] - 2.0).abs() < 1e-12);
        assert!((at.acceleration[0] - 0.5).abs() < 1e-9);
        assert!((path.at(2.0).position[0] - 1.5).abs() < 1e-12);
        assert_eq!(path.at(9.0), State::at_rest([1.5]));
        assert!((path.end() - 2.75).abs() < 1e-12);
    }
}
