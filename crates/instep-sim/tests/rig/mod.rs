//! A block and a ball in empty space, with the contact law and the time steps of the world: the simplest impact there
//! is, for which restitution, speed ratio and energy are known in closed form. Shared by test and benchmark.

use instep_sim::contact_law::{SOLIMP, solref};
use instep_sim::settings::WorldSettings;
use mujoco_rs::prelude::*;

/// What one block impact gave.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BlockImpact {
    /// Speed of separation over speed of approach.
    pub(crate) restitution: f64,
    /// Ball's speed after over block's speed before.
    pub(crate) speed_ratio: f64,
    /// Largest kinetic energy at any later step over the energy before.
    pub(crate) energy_ratio: f64,
}

/// A block of `mass` (kg) at `speed` (m/s) onto a ball at rest; `phase` in [0, 1) shifts the start by that share of
/// the way of one far step.
pub(crate) fn block_impact(settings: &WorldSettings, mass: f64, speed: f64, phase: f64) -> BlockImpact {
    let ([k, b], [d0, d1, w, _, _]) = (solref(&settings.impact), SOLIMP);
    let (ball, step) = (settings.ball, settings.step);
    let inertia = 2.0 / 3.0 * ball.mass * ball.radius * ball.radius;
    let xml = format!(
        r#"<mujoco><option gravity="0 0 0" integrator="implicitfast" cone="elliptic" timestep="{far}"/><worldbody>
        <body name="block"><freejoint/><inertial pos="0 0 0" mass="{mass}" diaginertia="1 1 1"/>
          <geom name="block" type="box" size=".05 .05 .05" contype="0" conaffinity="0"/></body>
        <body name="ball" pos="{start} 0 0"><freejoint/>
          <inertial pos="0 0 0" mass="{ball_mass}" diaginertia="{inertia} {inertia} {inertia}"/>
          <geom name="ball" type="sphere" size="{radius}" contype="0" conaffinity="0"/></body></worldbody>
        <contact><pair geom1="block" geom2="ball" condim="3" solref="{k} {b}" solimp="{d0} {d1} {w}"/></contact>
        </mujoco>"#,
        far = step.far,
        ball_mass = ball.mass,
        radius = ball.radius,
        start = 0.05 + ball.radius + 0.2 + phase * speed * step.far,
    );
    let mut data = MjData::new(Box::new(MjModel::from_xml_string(&xml).unwrap()));
    data.qvel_mut()[0] = speed;
    let energy = |data: &MjData<Box<MjModel>>| {
        let (block, ball_speed) = (data.qvel()[0], data.qvel()[6]);
        0.5 * mass * block * block + 0.5 * ball.mass * ball_speed * ball_speed
    };
    let before = energy(&data);
    let mut most: f64 = 0.0;
    data.forward();
    while data.time() < 0.4 / speed + 0.05 {
        // As the world does it.
        let reach = step.near_distance + 3.0 * step.far * speed;
        let gap = data.geom_distance(0, 1, 2.0 * reach, None);
        let (dt, steps) = if gap < reach { (step.near, step.near_per_far()) } else { (step.far, 1) };
        data.model_opt_mut().timestep = dt;
        for _ in 0..steps {
            data.step();
            most = most.max(energy(&data));
        }
    }
    let (block, ball_speed) = (data.qvel()[0], data.qvel()[6]);
    BlockImpact {
        restitution: (ball_speed - block) / speed,
        speed_ratio: ball_speed / speed,
        energy_ratio: most / before,
    }
}
