//! The data that the scripts read, as JSON: field names here are the names used in `assets/*.js`.

use serde::Serialize;

use super::text::{base64_f32, short};
use crate::{
    Actor, Axis, Camera, Color, Finish, Marking, Matrix, MatrixCell, Measure, Pitch, Plot, Replay, Report, Samples,
    Series, Shape,
};

/// The report's replay and plots.
pub(super) fn json(report: &Report) -> String {
    let data = Data {
        replay: report.replay.as_ref().map(replay),
        matrix: report.matrix.as_ref().map(matrix),
        plots: report.plots.iter().map(plot).collect(),
    };
    // Plain structs with string keys: serde_json cannot fail on them. An empty object would leave the page's text.
    serde_json::to_string(&data).unwrap_or_else(|_| "{\"plots\":[]}".into())
}

#[derive(Serialize)]
struct Data<'a> {
    replay: Option<ReplayData<'a>>,
    matrix: Option<MatrixData<'a>>,
    plots: Vec<PlotData<'a>>,
}

#[derive(Serialize)]
struct ReplayData<'a> {
    /// Microseconds are enough for a time line.
    times: Vec<f64>,
    actors: Vec<ActorData<'a>>,
    events: Vec<(f64, &'a str)>,
    pitch: Option<PitchData>,
    camera: Option<CameraData>,
}

#[derive(Serialize)]
struct MatrixData<'a> {
    title: &'a str,
    measures: Vec<MeasureData<'a>>,
    columns: &'a [String],
    rows: Vec<MatrixRowData<'a>>,
}

#[derive(Serialize)]
struct MeasureData<'a> {
    name: &'a str,
    about: &'a str,
    shade: [f64; 2],
    digits: usize,
}

#[derive(Serialize)]
struct MatrixRowData<'a> {
    name: &'a str,
    cells: Vec<Option<MatrixCellData<'a>>>,
}

#[derive(Serialize)]
struct MatrixCellData<'a> {
    /// Value, low and high of each measure.
    values: Vec<[Option<f64>; 3]>,
    details: &'a [(String, String)],
    links: &'a [(String, String)],
}

#[derive(Serialize)]
struct ActorData<'a> {
    name: &'a str,
    offset: [f32; 3],
    parts: Vec<PartData>,
    arrows: Vec<ArrowData<'a>>,
}

#[derive(Serialize)]
struct PartData {
    shape: &'static str,
    size: Vec<f32>,
    color: [u8; 4],
    football: bool,
    /// Base64: x y z, w x y z for each frame.
    poses: String,
}

#[derive(Serialize)]
struct ArrowData<'a> {
    name: &'a str,
    color: [u8; 4],
    scale: f32,
    /// Base64: origin and vector, x y z each, for each frame.
    frames: String,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct PitchData {
    center: [f32; 2],
    /// With the border.
    half_size: [f32; 2],
    line_width: f32,
    /// From x y, to x y.
    lines: Vec<[f32; 4]>,
    /// Middle x y, radius, half width.
    rings: Vec<[f32; 4]>,
}

#[derive(Serialize)]
struct CameraData {
    target: [f32; 3],
    distance: f32,
    azimuth: f32,
    elevation: f32,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct PlotData<'a> {
    title: &'a str,
    x_label: &'a str,
    y_label: &'a str,
    time: bool,
    /// Missing: the replay's times.
    x: Option<Vec<Option<f64>>>,
    series: Vec<SeriesData<'a>>,
    limits: Vec<(&'a str, f64)>,
    regions: Vec<(&'a str, f64, f64)>,
}

#[derive(Serialize)]
struct SeriesData<'a> {
    name: &'a str,
    color: Option<String>,
    dashed: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    y: Option<Vec<Option<f64>>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    points: Option<Vec<[Option<f64>; 2]>>,
}

fn matrix(matrix: &Matrix) -> MatrixData<'_> {
    fn cell(cell: &MatrixCell) -> MatrixCellData<'_> {
        MatrixCellData {
            values: cell.values.iter().map(|value| value.map(|number| number.and_then(short))).collect(),
            details: &cell.details,
            links: &cell.links,
        }
    }
    MatrixData {
        title: &matrix.title,
        measures: matrix
            .measures
            .iter()
            .map(|Measure { name, about, shade, digits }| MeasureData { name, about, shade: *shade, digits: *digits })
            .collect(),
        columns: &matrix.columns,
        rows: matrix
            .rows
            .iter()
            .map(|row| MatrixRowData {
                name: &row.name,
                cells: row.cells.iter().map(|c| c.as_ref().map(cell)).collect(),
            })
            .collect(),
    }
}

fn rgba(color: Color) -> [u8; 4] {
    [color.r, color.g, color.b, color.a]
}

/// Seconds to the microsecond.
fn micro(time: f64) -> f64 {
    (time * 1e6).round() / 1e6
}

fn replay(replay: &Replay) -> ReplayData<'_> {
    ReplayData {
        times: replay.times.iter().copied().map(micro).collect(),
        actors: replay.actors.iter().map(actor).collect(),
        events: replay.events.iter().map(|event| (micro(event.time), event.label.as_str())).collect(),
        pitch: replay.pitch.as_ref().map(pitch),
        camera: replay.camera.map(|Camera { target, distance, azimuth, elevation }| CameraData {
            target,
            distance,
            azimuth,
            elevation,
        }),
    }
}

fn actor(actor: &Actor) -> ActorData<'_> {
    let parts = actor.parts.iter().map(|part| {
        let (shape, size) = shape(part.shape);
        let poses = part.poses.iter().flat_map(|pose| pose.position.into_iter().chain(pose.rotation));
        let football = part.finish == Finish::Football;
        PartData { shape, size, color: rgba(part.color), football, poses: base64_f32(poses) }
    });
    let arrows = actor.arrows.iter().map(|arrow| ArrowData {
        name: &arrow.name,
        color: rgba(arrow.color),
        scale: arrow.metres_per_unit,
        frames: base64_f32(arrow.frames.iter().flat_map(|frame| frame.origin.into_iter().chain(frame.vector))),
    });
    ActorData { name: &actor.name, offset: actor.offset, parts: parts.collect(), arrows: arrows.collect() }
}

/// Name and numbers of a shape, as `view.js` reads them.
fn shape(shape: Shape) -> (&'static str, Vec<f32>) {
    match shape {
        Shape::Sphere { radius } => ("sphere", vec![radius]),
        Shape::Capsule { radius, half_length } => ("capsule", vec![radius, half_length]),
        Shape::Cylinder { radius, half_length } => ("cylinder", vec![radius, half_length]),
        Shape::Box { half_extents } => ("box", half_extents.to_vec()),
        Shape::Ellipsoid { radii } => ("ellipsoid", radii.to_vec()),
    }
}

fn pitch(pitch: &Pitch) -> PitchData {
    let mut lines = Vec::new();
    let mut rings = Vec::new();
    for marking in &pitch.markings {
        match *marking {
            Marking::Line { from, to } => lines.push([from[0], from[1], to[0], to[1]]),
            Marking::Rectangle { min: [x0, y0], max: [x1, y1] } => {
                lines.extend([[x0, y0, x1, y0], [x1, y0, x1, y1], [x1, y1, x0, y1], [x0, y1, x0, y0]]);
            }
            Marking::Circle { center, radius } => rings.push([center[0], center[1], radius, pitch.line_width / 2.0]),
            Marking::Spot { center } => rings.push([center[0], center[1], 0.0, pitch.line_width]),
        }
    }
    let half_size = [pitch.length, pitch.width].map(|side| side / 2.0 + pitch.border);
    PitchData { center: pitch.center, half_size, line_width: pitch.line_width, lines, rings }
}

fn plot(plot: &Plot) -> PlotData<'_> {
    let numbers = |values: &[f64]| values.iter().copied().map(short).collect::<Vec<_>>();
    let series = |series: &Series| match &series.samples {
        Samples::Shared(y) => (Some(numbers(y)), None),
        Samples::Points(points) => (None, Some(points.iter().map(|point| point.map(short)).collect())),
    };
    PlotData {
        title: &plot.title,
        x_label: &plot.x_label,
        y_label: &plot.y_label,
        time: plot.axis == Axis::Time,
        x: (!plot.x.is_empty()).then(|| numbers(&plot.x)),
        series: plot
            .series
            .iter()
            .map(|one| {
                let (y, points) = series(one);
                SeriesData { name: &one.name, color: one.color.map(Color::css), dashed: one.dashed, y, points }
            })
            .collect(),
        limits: plot.limits.iter().map(|limit| (limit.label.as_str(), limit.value)).collect(),
        regions: plot.regions.iter().map(|region| (region.label.as_str(), region.from, region.to)).collect(),
    }
}
