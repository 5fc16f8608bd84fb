//! Whether the parts of a report fit together.

use crate::{Axis, Matrix, Plot, Replay, Report, ReportError, Samples, Shape};

/// What `view.js` and its shader can draw.
const MOST_LINES: usize = 96;
/// Circles and spots.
const MOST_RINGS: usize = 32;

/// The first place that does not fit, as an error.
pub(crate) fn check(report: &Report) -> Result<(), ReportError> {
    for table in &report.tables {
        for (index, row) in table.rows.iter().enumerate() {
            let place = || format!("table {:?}, row {}", table.title, index + 1);
            ensure(row.len() == table.columns.len(), place, || {
                (format!("{} cells", row.len()), format!("{}, one for each column", table.columns.len()))
            })?;
        }
    }
    if let Some(matrix) = &report.matrix {
        check_matrix(matrix)?;
    }
    if let Some(replay) = &report.replay {
        check_replay(replay)?;
    }
    let frames = report.replay.as_ref().map(|replay| replay.times.len());
    report.plots.iter().try_for_each(|plot| check_plot(plot, frames))
}

fn ensure(
    holds: bool,
    place: impl FnOnce() -> String,
    wrong_and_wanted: impl FnOnce() -> (String, String),
) -> Result<(), ReportError> {
    if holds {
        return Ok(());
    }
    let (wrong, wanted) = wrong_and_wanted();
    Err(ReportError::Inconsistent { place: place(), wrong, wanted })
}

fn check_matrix(matrix: &Matrix) -> Result<(), ReportError> {
    for row in &matrix.rows {
        let place = || format!("matrix {:?}, row {:?}", matrix.title, row.name);
        let (cells, columns) = (row.cells.len(), matrix.columns.len());
        ensure(cells == columns, place, || (format!("{cells} cells"), format!("{columns}, one for each column")))?;
        for cell in row.cells.iter().flatten() {
            let (values, measures) = (cell.values.len(), matrix.measures.len());
            ensure(values == measures, place, || {
                (format!("{values} values"), format!("{measures}, one for each measure"))
            })?;
        }
    }
    Ok(())
}

fn check_replay(replay: &Replay) -> Result<(), ReportError> {
    let frames = replay.times.len();
    check_rising(&replay.times, true, || "replay.times".into())?;
    ensure(frames > 0, || "replay.times".into(), || ("no frame".into(), "at least one, or no replay at all".into()))?;
    let frame_count = |found: usize, place: &dyn Fn() -> String| {
        ensure(found == 1 || found == frames, place, || {
            (format!("{found} frames"), format!("{frames}, one for each time, or 1 if it never moves"))
        })
    };
    for event in &replay.events {
        let place = || format!("replay event {:?}", event.label);
        ensure(event.time.is_finite(), place, || (format!("time {}", event.time), "a finite time".into()))?;
    }
    if let Some(camera) = &replay.camera {
        let finite =
            [camera.distance, camera.azimuth, camera.elevation].into_iter().chain(camera.target).all(f32::is_finite);
        ensure(
            finite && camera.distance > 0.0,
            || "replay.camera".into(),
            || (format!("{camera:?}"), "finite numbers and a positive distance".into()),
        )?;
    }
    for actor in &replay.actors {
        ensure(
            actor.offset.iter().all(|x| x.is_finite()),
            || format!("replay actor {:?}, offset", actor.name),
            || (format!("{:?}", actor.offset), "finite numbers".into()),
        )?;
        for (index, part) in actor.parts.iter().enumerate() {
            let place = || format!("replay actor {:?}, part {index}", actor.name);
            frame_count(part.poses.len(), &place)?;
            let sizes: &[f32] = match &part.shape {
                Shape::Sphere { radius } => &[*radius],
                Shape::Capsule { radius, half_length } | Shape::Cylinder { radius, half_length } => {
                    &[*radius, *half_length]
                }
                Shape::Box { half_extents } => half_extents,
                Shape::Ellipsoid { radii } => radii,
            };
            ensure(sizes.iter().all(|size| size.is_finite() && *size >= 0.0), place, || {
                (format!("{:?}", part.shape), "finite sizes, not negative".into())
            })?;
            for (frame, pose) in part.poses.iter().enumerate() {
                let place = || format!("{}, frame {frame}", place());
                let norm = pose.rotation.iter().map(|q| q * q).sum::<f32>().sqrt();
                ensure(pose.position.iter().all(|x| x.is_finite()) && (norm - 1.0).abs() < 0.01, place, || {
                    (format!("{pose:?}"), "a finite position and a unit quaternion [w, x, y, z]".into())
                })?;
            }
        }
        for arrow in &actor.arrows {
            let place = || format!("replay actor {:?}, arrow {:?}", actor.name, arrow.name);
            frame_count(arrow.frames.len(), &place)?;
            ensure(arrow.metres_per_unit.is_finite(), place, || {
                (format!("{} metres per unit", arrow.metres_per_unit), "a finite scale".into())
            })?;
            for (frame, value) in arrow.frames.iter().enumerate() {
                let place = || format!("{}, frame {frame}", place());
                ensure(value.origin.iter().chain(&value.vector).all(|x| x.is_finite()), place, || {
                    (format!("{value:?}"), "finite numbers (a zero vector is not drawn)".into())
                })?;
            }
        }
    }
    if let Some(pitch) = &replay.pitch {
        let count = |wanted: fn(&crate::Marking) -> usize| pitch.markings.iter().map(wanted).sum::<usize>();
        let lines = count(|marking| match marking {
            crate::Marking::Line { .. } => 1,
            crate::Marking::Rectangle { .. } => 4,
            _ => 0,
        });
        let rings =
            count(|marking| matches!(marking, crate::Marking::Circle { .. } | crate::Marking::Spot { .. }).into());
        ensure(
            lines <= MOST_LINES && rings <= MOST_RINGS,
            || "replay.pitch.markings".into(),
            || {
                (
                    format!("{lines} straight lines and {rings} circles or spots"),
                    format!("at most {MOST_LINES} and {MOST_RINGS}"),
                )
            },
        )?;
    }
    Ok(())
}

fn check_plot(plot: &Plot, frames: Option<usize>) -> Result<(), ReportError> {
    let place = |name: &str| format!("plot {:?}, {name}", plot.title);
    let is_time = plot.axis == Axis::Time;
    check_rising(&plot.x, is_time, || place("x"))?;
    for series in &plot.series {
        match &series.samples {
            Samples::Shared(y) if plot.x.is_empty() => {
                ensure(
                    frames == Some(y.len()),
                    || place(&format!("series {:?}", series.name)),
                    || {
                        let wanted = match frames {
                            Some(frames) => format!("{frames}, one for each time of the replay"),
                            None => "x values of the plot's own, as there is no replay".into(),
                        };
                        (format!("{} values", y.len()), wanted)
                    },
                )?;
            }
            Samples::Shared(y) => {
                ensure(
                    plot.x.len() == y.len(),
                    || place(&format!("series {:?}", series.name)),
                    || (format!("{} values", y.len()), format!("{}, one for each x", plot.x.len())),
                )?;
            }
            Samples::Points(points) => {
                let x: Vec<f64> = points.iter().map(|point| point[0]).collect();
                check_rising(&x, is_time, || place(&format!("series {:?}", series.name)))?;
            }
        }
    }
    for limit in &plot.limits {
        ensure(
            limit.value.is_finite(),
            || place(&format!("limit {:?}", limit.label)),
            || (limit.value.to_string(), "a finite level".into()),
        )?;
    }
    for region in &plot.regions {
        ensure(
            region.from <= region.to,
            || place(&format!("region {:?}", region.label)),
            || (format!("from {} to {}", region.from, region.to), "from not after to, both finite".into()),
        )?;
    }
    Ok(())
}

/// Finite, and (if `rising`) each not before the one before.
fn check_rising(values: &[f64], rising: bool, place: impl FnOnce() -> String) -> Result<(), ReportError> {
    let mut before = f64::NEG_INFINITY;
    for (index, &value) in values.iter().enumerate() {
        if !value.is_finite() || (rising && value < before) {
            let wrong = format!("value {index} is {value}, after {before}");
            let wanted = if rising { "finite values that never fall" } else { "finite values" };
            return Err(ReportError::Inconsistent { place: place(), wrong, wanted: wanted.into() });
        }
        before = value;
    }
    Ok(())
}
