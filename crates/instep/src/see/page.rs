//! The page of frames: what was found over what is there, and depth beside it.

use std::fmt::Write as _;
use std::path::Path;

use base64::Engine as _;
use instep_perception::detector::Detection;
use instep_perception::label::Rect;
use instep_perception::render::View;
use instep_perception::{Class, label};

use super::Looked;
use crate::failure::Failure;

/// The colour of a class's boxes.
pub(super) fn colour(class: Class) -> &'static str {
    ["#ff8000", "#ffee00", "#ff40ff", "#ff3030", "#20e0ff", "#6080ff"][class.index()]
}

/// A frame and its depth side by side, with boxes over them.
pub(super) fn picture(
    title: &str,
    view: &View,
    found: &[Detection],
    labels: &[label::Label],
    looked: Option<(&Looked, Option<Rect>)>,
) -> String {
    let code = |png: Vec<u8>| base64::engine::general_purpose::STANDARD.encode(png);
    let (w, h) = (view.frame.width, view.frame.height);
    let mut boxes = String::new();
    for l in labels.iter().filter(|l| !l.ignored) {
        let r = l.rect;
        let _ = write!(
            boxes,
            "<rect x='{}' y='{}' width='{}' height='{}' stroke='{}' stroke-dasharray='2 2'/>",
            r.left,
            r.top,
            r.width(),
            r.height(),
            colour(l.class)
        );
    }
    for d in found {
        let r = d.rect;
        let team = d.team.map_or("", |t| t.name());
        let _ = write!(
            boxes,
            "<rect x='{:.1}' y='{:.1}' width='{:.1}' height='{:.1}' stroke='{c}'/><text x='{:.1}' y='{:.1}' fill='{c}'>{} {:.2} {team}</text>",
            r.left,
            r.top,
            r.width(),
            r.height(),
            r.left,
            (r.top - 2.0).max(8.0),
            d.class.name(),
            d.confidence,
            c = colour(d.class)
        );
    }
    let mut near = String::new();
    let mut said = String::new();
    if let Some((looked, spot)) = looked {
        if let Some(r) = spot {
            let [x, y] = r.middle();
            let _ = write!(
                boxes,
                "<circle cx='{x:.1}' cy='{y:.1}' r='{:.1}'/><path d='M{x:.1} {:.1}v5'/>",
                0.8 * r.width().max(6.0),
                y - 0.8 * r.width().max(6.0) - 5.0
            );
        }
        for o in looked.obstacles.iter().filter(|o| !o.dummy) {
            let r = o.rect;
            let _ = write!(
                near,
                "<rect x='{}' y='{}' width='{}' height='{}' stroke='#fff'/><text x='{}' y='{}' fill='#fff'>{:.2} m</text>",
                r.left,
                r.top,
                r.width(),
                r.height(),
                r.left + 2.0,
                r.top + 10.0,
                o.depth
            );
        }
        if let Some((ball, confidence)) = &looked.sights.ball {
            let how = if ball.by_diameter { "diameter" } else { "depth" };
            let [x, y] = [ball.position.x, ball.position.y];
            let _ = write!(said, "ball {x:.2} m ahead, {y:.2} m left, by {how}, confidence {confidence:.2}; ");
        }
        for why in &looked.sights.refused {
            let _ = write!(said, "ball thrown out: {why:?}; ");
        }
        let _ = write!(said, "{} landmarks, {} robots", looked.sights.landmarks.len(), looked.sights.robots.len());
    }
    let one = |png: String, over: &str| {
        format!(
            "<svg viewBox='0 0 {w} {h}'><image href='data:image/png;base64,{png}' width='{w}' height='{h}'/>{over}</svg>"
        )
    };
    let frame = one(code(view.frame.png()), &boxes);
    let depth = one(code(view.depth.picture(10.0).png()), &near);
    format!("<section><h2>{title}</h2><div>{frame}{depth}</div><p>{said}</p></section>")
}

pub(super) fn save(path: &Path, title: &str, body: &str) -> Result<(), Failure> {
    let page = format!(
        "<!doctype html><html lang='en'><meta charset='utf-8'><title>{title}</title><style>body{{background:#181a1e;color:#ddd;font:15px system-ui;margin:24px}}svg{{width:49%;margin-right:1%;background:#000}}svg rect,svg circle,svg path{{fill:none;stroke-width:1}}svg circle,svg path{{stroke:#fff}}svg text{{font:8px sans-serif}}h2{{font-size:15px;margin:18px 0 6px}}</style><h1>{title}</h1><p>Left: the frame, what was found (whole lines, with confidence), what is there (dashed) and the ball's track (white ring). Right: depth, black where the camera has none, with near obstacles.</p>{body}</html>"
    );
    std::fs::write(path, page).map_err(|e| Failure::input(format!("{}: cannot be written: {e}", path.display())))
}
