//! The goals of a field as things: posts and a bar that a ball and a robot bounce off, and a net that holds the ball.
//!
//! Posts and bar are round, 10 cm thick as the Humanoid League's rules have them, the posts' middles on the goal line. The net
//! is four slabs behind the goal line (back, sides, roof) whose inner faces stand where a net would hang; it stops a ball
//! within a hand's breadth and gives nearly nothing back, as cloth that hangs does (assumed: overdamped). It is air for robots and
//! for cameras: whoever walks in there is the referee's matter.

use instep_field::Field;
use mujoco_rs::error::MjEditError;
use mujoco_rs::prelude::*;
use mujoco_rs::wrappers::mj_editing::MjSpec;

use crate::contact_law::solref;
use crate::settings::ImpactLaw;

/// Radius of posts and bar, m.
pub const POST_RADIUS: f64 = 0.05;
/// Half the thickness of a net's slab, m: a fast ball must not reach its middle.
const SLAB: f64 = 0.15;
/// The bit by which robots meet posts; see `model`.
const POST_BIT: i32 = 1;

/// Ball on post: aluminium, hard and quick. Assumed: what a ball keeps on a hard floor (see [`crate::ball`]).
const POST_LAW: ImpactLaw = ImpactLaw { contact_time: 0.010, restitution: 0.7, friction: 0.4 };
/// Ball on net, r'' = -k r - b r' as in [`crate::contact_law`]: natural frequency w0 = 52/s and six times the critical damping. A
/// ball goes v / (2 z w0) deep, 2 cm at 12 m/s, and is given v / (4 z^2) back.
const NET_SOLREF: [f64; 2] = [-2704.0, -624.0];
const NET_FRICTION: f64 = 0.8;

/// A part of a goal.
pub(crate) struct Part {
    /// Its geom's name.
    pub(crate) name: String,
    /// How the ball bounces off it.
    pub(crate) solref: [f64; 2],
    /// Sliding friction of the ball on it.
    pub(crate) friction: f64,
}

/// Adds both goals of `field`; returns what the ball can meet.
pub(crate) fn add(spec: &mut MjSpec, field: &Field) -> Result<Vec<Part>, MjEditError> {
    let mut parts = Vec::new();
    for (end, goal) in [("own", field.own_goal()), ("opponent", field.opponent_goal())] {
        let [line, _] = goal.center;
        let (out, half) = (line.signum(), 0.5 * field.goal.width);
        let middle = line + 0.5 * out * goal.depth;
        let tall = 0.5 * goal.height;
        let bar = goal.height + POST_RADIUS;
        let rods = [
            ("left_post", [line, half, 0.0, line, half, bar]),
            ("right_post", [line, -half, 0.0, line, -half, bar]),
            ("bar", [line, -half, bar, line, half, bar]),
        ];
        for (name, ends) in rods {
            let name = format!("instep_{end}_{name}");
            let geom = spec.world_body_mut().add_geom();
            *geom.fromto_mut() = ends;
            geom.with_name(&name)
                .with_type(MjtGeomBase::mjGEOM_CAPSULE)
                .with_size([POST_RADIUS, 0.0, 0.0])
                .with_contype(POST_BIT)
                .with_conaffinity(0);
            parts.push(Part { name, solref: solref(&POST_LAW), friction: POST_LAW.friction });
        }
        let slabs = [
            ("back_net", [line + out * (goal.depth + SLAB), 0.0, tall], [SLAB, half + 2.0 * SLAB, tall + SLAB]),
            ("left_net", [middle, half + SLAB, tall], [0.5 * goal.depth, SLAB, tall]),
            ("right_net", [middle, -half - SLAB, tall], [0.5 * goal.depth, SLAB, tall]),
            ("roof_net", [middle, 0.0, goal.height + SLAB], [0.5 * goal.depth, half + SLAB, SLAB]),
        ];
        for (name, position, size) in slabs {
            let name = format!("instep_{end}_{name}");
            let geom = spec.world_body_mut().add_geom();
            // What cannot be seen stops no ray.
            geom.with_name(&name)
                .with_type(MjtGeomBase::mjGEOM_BOX)
                .with_pos(position)
                .with_size(size)
                .with_rgba([1.0, 1.0, 1.0, 0.0])
                .with_contype(0)
                .with_conaffinity(0);
            parts.push(Part { name, solref: NET_SOLREF, friction: NET_FRICTION });
        }
    }
    Ok(parts)
}
