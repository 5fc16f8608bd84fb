//! The approach angle (20): between the way from the body's first position to the ball and the x axis, within its
//! range. Held at the first node. Unit: rad.

use super::node::View;
use super::terms::{Family, Sink};

/// Part of the range that is kept free at both ends, rad.
pub(crate) const SPARE: f64 = 0.003;

/// The angle and its derivatives by the body's x and y.
pub(crate) fn angle(ball: [f64; 2], body: [f64; 2]) -> (f64, [f64; 2]) {
    let (x, y) = (ball[0] - body[0], ball[1] - body[1]);
    let far = x.hypot(y).max(1e-9);
    // The angle is |atan2(y, x)|; the ball's own place does not move.
    let side = if y < 0.0 { -1.0 } else { 1.0 };
    (y.abs().atan2(x), [side * y / (far * far), -side * x / (far * far)])
}

pub(crate) fn rows(view: &View, sink: &mut Sink) {
    if view.k != 0 {
        return;
    }
    let plan = view.plan;
    let (angle, by) = angle([plan.ball.x, plan.ball.y], [view.q[0], view.q[1]]);
    let [least, greatest] = plan.settings.approach_angle;
    sink.at_most(Family::ApproachAngle, angle - (greatest - SPARE), |row| row.q[..2].copy_from_slice(&by));
    sink.at_most(Family::ApproachAngle, least + SPARE - angle, |row| row.q[..2].copy_from_slice(&by.map(|d| -d)));
}
