//! The world as MuJoCo's specification: robots, ground, goals, ball and all contact pairs, and the solver's settings.
//!
//! Robots after the first are deep copies of their specifications, attached with a prefix to every name.

use instep_field::Field;
use instep_robot::Robot;
use mujoco_rs::error::MjEditError;
use mujoco_rs::mujoco_c::mjtCone;
use mujoco_rs::prelude::*;
use mujoco_rs::wrappers::mj_editing::{MjSpec, SpecItem};

use crate::SimError;
use crate::contact_law::{SOLIMP, solref};
use crate::goal;
use crate::settings::{Fidelity, ModelError, WorldSettings};

/// Names of ground and ball, their geoms and the ball's joint.
pub(crate) const FLOOR: &str = "instep_floor";
pub(crate) const BALL: &str = "instep_ball";

/// Robots that a world can hold: each has a bit of its own beside the goals'.
pub(crate) const MOST_ROBOTS: usize = 30;
/// Sliding friction between robots, and of robots with posts; an assumption for plastic and aluminium.
const ROBOT_FRICTION: f64 = 0.4;

/// Body indices of the links that carry contact points.
pub(crate) fn foot_links(robot: &Robot) -> Vec<usize> {
    let mut links: Vec<usize> = robot.contacts.iter().map(|contact| contact.at.link).collect();
    links.extend(robot.legs.iter().map(|leg| leg.foot));
    links.sort_unstable();
    links.dedup();
    links
}

/// The robot's geoms that a ball meets: the striking geoms, which are its feet, and all above that its model lets collide.
pub(crate) fn solid_geoms(robot: &Robot) -> Vec<usize> {
    let (model, feet) = (robot.model(), foot_links(robot));
    let above = |geom: usize| !feet.contains(&usize::try_from(model.geom_bodyid()[geom]).unwrap_or(0));
    let collides = |geom: usize| model.geom_contype()[geom] != 0 || model.geom_conaffinity()[geom] != 0;
    let mut geoms: Vec<usize> = (0..model.geom_bodyid().len()).filter(|&geom| collides(geom) && above(geom)).collect();
    geoms.extend(robot.legs.iter().flat_map(|leg| &leg.strike));
    geoms.sort_unstable();
    geoms.dedup();
    geoms
}

/// Name of a part of robot `index` in the world: the first robot's parts keep their own.
pub(crate) fn part(index: usize, name: &str) -> String {
    if index == 0 { name.to_owned() } else { format!("robot_{index}/{name}") }
}

/// The world as a specification: `robots` (each with its model as loaded), the ground, the goals of `field`, the ball, all
/// contact pairs, and the solver's settings. A single robot's specification is added to as it is, so that a robot alone is
/// the same to the last bit whether or not others could be there.
pub(crate) fn build(robots: &[&Robot], field: Option<&Field>, settings: &WorldSettings) -> Result<MjSpec, SimError> {
    let refused = |robot: &Robot, e: MjEditError| SimError::World { robot: robot.name.clone(), detail: e.to_string() };
    let [first, others @ ..] = robots else {
        return Err(SimError::State { found: "no robot".into(), expected: "at least one".into() });
    };
    let mut spec = first.spec()?;
    let mut bodies = vec![prepare(&mut spec, first, settings).map_err(|e| refused(first, e))?];
    for (i, robot) in others.iter().enumerate() {
        let mut other = robot.spec()?;
        bodies.push(prepare(&mut other, robot, settings).map_err(|e| refused(robot, e))?);
        spec.world_body_mut().attach_by_deep_copy(&mut other, &part(i + 1, ""), "").map_err(|e| refused(robot, e))?;
    }
    furnish(&mut spec, robots, &bodies, field, settings).map_err(|e| refused(first, e))?;
    Ok(spec)
}

/// Names what has no name, takes the model's own collisions away, and makes the robot err from its model and rub as the
/// settings say. Returns the geoms above the feet that the model lets collide.
fn prepare(spec: &mut MjSpec, robot: &Robot, settings: &WorldSettings) -> Result<Vec<String>, MjEditError> {
    // Contacts are explicit pairs, and pairs go by name.
    let mut body_geoms = Vec::new();
    for (i, geom) in spec.geom_iter_mut().enumerate() {
        if geom.name().is_empty() {
            geom.set_name(&format!("instep_geom_{i}"))?;
        }
        if geom.contype() != 0 || geom.conaffinity() != 0 {
            body_geoms.push(geom.name().to_owned());
        }
        geom.set_contype(0);
        geom.set_conaffinity(0);
    }
    let feet = foot_links(robot);
    let on_foot: Vec<String> = (0..robot.model().geom_bodyid().len())
        .filter(|&geom| feet.contains(&usize::try_from(robot.model().geom_bodyid()[geom]).unwrap_or(0)))
        .map(|geom| geom_name(robot, geom))
        .collect();
    body_geoms.retain(|name| !on_foot.contains(name));
    let error = &settings.model_error;
    if *error != ModelError::default() {
        let links = robot.model().body_parentid().len();
        for link in 1..links {
            let Some(body) = spec.world_body_mut().child_mut(robot.link_name(link)) else { continue };
            body.set_mass(body.mass() * error.mass);
            body.fullinertia_mut().iter_mut().for_each(|entry| *entry *= error.mass);
            body.inertia_mut().iter_mut().for_each(|entry| *entry *= error.mass);
            if link == robot.base {
                body.ipos_mut().iter_mut().zip(error.base_shift).for_each(|(at, shift)| *at += shift);
            }
        }
    }
    let as_built = settings.drives == Fidelity::AsBuilt;
    for joint in spec.joint_iter_mut() {
        let Some(limits) = robot.joint_index(joint.name()).map(|j| &robot.joints[j]) else { continue };
        let [dry, viscous] = if as_built { [limits.static_friction, limits.viscous_friction] } else { [0.0; 2] };
        let dry = dry + error.joint_friction * limits.torque;
        if dry > 0.0 {
            joint.set_frictionloss(joint.frictionloss() + dry);
        }
        if viscous > 0.0 {
            joint.damping_mut()[0] += viscous;
        }
    }
    Ok(body_geoms)
}

fn geom_name(robot: &Robot, geom: usize) -> String {
    robot.model().id_to_name(MjtObjBase::mjOBJ_GEOM, geom).unwrap_or_default().to_owned()
}

/// Adds ground, goals, ball and all contact pairs to the robots, and sets the solver.
fn furnish(
    spec: &mut MjSpec,
    robots: &[&Robot],
    bodies: &[Vec<String>],
    field: Option<&Field>,
    settings: &WorldSettings,
) -> Result<(), MjEditError> {
    let world = spec.world_body_mut();
    world
        .add_geom()
        .with_name(FLOOR)
        .with_type(MjtGeomBase::mjGEOM_PLANE)
        .with_size([0.0, 0.0, 1.0])
        .with_contype(0)
        .with_conaffinity(0);
    let ball = world.add_body().with_name(BALL).with_pos([1.0, 0.0, settings.ball.radius]);
    ball.add_free_joint().set_name(BALL)?;
    // A thin shell.
    let inertia = 2.0 / 3.0 * settings.ball.mass * settings.ball.radius * settings.ball.radius;
    ball.set_mass(settings.ball.mass);
    *ball.inertia_mut() = [inertia; 3];
    // Left unset, the specification takes the body's own place for its centre of mass.
    *ball.ipos_mut() = [0.0; 3];
    ball.set_explicitinertial(true);
    ball.add_geom()
        .with_name(BALL)
        .with_type(MjtGeomBase::mjGEOM_SPHERE)
        .with_size([settings.ball.radius, 0.0, 0.0])
        .with_mass(0.0)
        .with_contype(0)
        .with_conaffinity(0);

    let goals = field.map(|field| goal::add(spec, field)).transpose()?.unwrap_or_default();

    let sole = [settings.pitch.softness, 1.0];
    let slide = settings.pitch.friction;
    for (i, (robot, body_geoms)) in robots.iter().zip(bodies).enumerate() {
        let own = |geom: usize| part(i, &geom_name(robot, geom));
        for contact in &robot.contacts {
            add_pair(spec, FLOOR, &part(i, &contact.name), 3, [slide, slide, 0.0, 0.0, 0.0], sole, None);
        }
        for name in body_geoms {
            add_pair(spec, FLOOR, &part(i, name), 3, [slide, slide, 0.0, 0.0, 0.0], sole, None);
        }
        for pair in &robot.self_collision {
            let [a, b] = pair.map(own);
            add_pair(spec, &a, &b, 1, [0.1, 0.1, 0.0, 0.0, 0.0], sole, None);
        }
        // The ball meets all of the robot, not only what is meant to strike it.
        for geom in solid_geoms(robot) {
            let grip = settings.impact.friction;
            let friction = [grip, grip, 0.0, 0.0, 0.0];
            add_pair(spec, &own(geom), BALL, 3, friction, solref(&settings.impact), Some(SOLIMP));
        }
        if robots.len() > 1 || field.is_some() {
            meet_others(spec, i, robot)?;
        }
    }
    for part in &goals {
        let friction = [part.friction, part.friction, 0.0, 0.0, 0.0];
        add_pair(spec, &part.name, BALL, 3, friction, part.solref, Some(SOLIMP));
    }
    // Rolling of a thin shell: (m + I / r^2) a = N c / r with I = 2/3 m r^2, so c = 5/3 r a / g.
    let roll = 5.0 / 3.0 * settings.ball.radius * settings.ball.rolling_deceleration / 9.81;
    let grip = settings.pitch.ball_friction;
    let friction = [grip, grip, 0.005, roll, roll];
    add_pair(spec, FLOOR, BALL, 6, friction, solref(&settings.ball.rebound), Some(SOLIMP));

    let option = spec.option_mut();
    option.timestep = settings.step.far;
    option.integrator = MjtIntegrator::mjINT_IMPLICITFAST as i32;
    option.cone = mjtCone::mjCONE_ELLIPTIC as i32;
    // A foot that squeezes the ball onto the ground couples stiff contacts. With fewer iterations, or friction harder
    // than the normal direction (impratio above 1), the solver stops short and the ball's speed scatters by 5 per cent.
    // Elsewhere it needs two or three iterations whatever the limit.
    option.impratio = 1.0;
    option.iterations = 100;
    option.ls_iterations = 100;
    option.tolerance = 1e-10;
    option.ls_tolerance = 1e-3;
    option.gravity = [0.0, 0.0, -9.81];
    Ok(())
}

/// Lets the solid geoms of robot `index` meet those of all others and the goals' posts: by MuJoCo's bits, since its search for
/// near bodies costs less than every pair of geoms asked at every step.
fn meet_others(spec: &mut MjSpec, index: usize, robot: &Robot) -> Result<(), MjEditError> {
    let own = 1 << (index + 1);
    for geom in solid_geoms(robot) {
        let name = part(index, &geom_name(robot, geom));
        let Some(geom) = spec.geom_mut(&name) else { continue };
        geom.set_contype(own);
        geom.set_conaffinity(i32::MAX & !own);
        geom.set_condim(3);
        geom.friction_mut()[0] = ROBOT_FRICTION;
    }
    Ok(())
}

/// Adds one contact pair.
fn add_pair(
    spec: &mut MjSpec,
    first: &str,
    second: &str,
    dimensions: i32,
    friction: [f64; 5],
    solref: [f64; 2],
    solimp: Option<[f64; 5]>,
) {
    let pair = spec.add_pair();
    pair.with_geomname1(first)
        .with_geomname2(second)
        .with_condim(dimensions)
        .with_friction(friction)
        .with_solref(solref);
    if let Some(solimp) = solimp {
        pair.with_solimp(solimp);
    }
}
