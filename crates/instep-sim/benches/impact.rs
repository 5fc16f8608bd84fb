//! Restitution and energy of a block onto the ball over all sub-step phases: `cargo bench -p instep-sim --bench impact`.
//! The same rig as the test, as a table beside the stated restitution and the closed-form speed ratio.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a benchmark prints, and stops at the first surprise")]

#[path = "../tests/rig/mod.rs"]
mod rig;

use instep_sim::settings::WorldSettings;

fn main() {
    let settings = WorldSettings::default();
    let (mass, phases) = (1.0, 100);
    let e = settings.impact.restitution;
    let ratio = (1.0 + e) * mass / (mass + settings.ball.mass);
    println!("1 kg block onto the ball, {phases} sub-step phases; stated restitution {e}, speed ratio {ratio:.3}");
    println!("limit: restitution {e} +- 0.02, energy ratio at most 1\n");
    println!("  speed      restitution            v_ball/v_block         largest energy ratio");
    for speed in [5.0, 10.0, 15.0] {
        let impacts: Vec<_> =
            (0..phases).map(|i| rig::block_impact(&settings, mass, speed, f64::from(i) / f64::from(phases))).collect();
        let spread = |value: fn(&rig::BlockImpact) -> f64| {
            let values = impacts.iter().map(value);
            (values.clone().fold(f64::INFINITY, f64::min), values.fold(f64::NEG_INFINITY, f64::max))
        };
        let (low, high) = spread(|i| i.restitution);
        let (slow, fast) = spread(|i| i.speed_ratio);
        let (_, energy) = spread(|i| i.energy_ratio);
        println!("  {speed:4.0} m/s   {low:.4} to {high:.4}       {slow:.4} to {fast:.4}       {energy:.9}");
    }
}
