//! One kick from a project of your own: a robot, an engine, a request, a world.

#![allow(clippy::print_stdout, reason = "it is a program")]

use instep_bench::{Subject, cell::run_case, scenario::Case};
use instep_kick::{KickRequest, Strength};
use instep_robot::Robot;
use instep_sim::World;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "../../robots/t1".into());
    let subject = Subject::of(Robot::load(folder.as_ref())?)?;
    let mut world = World::new(subject.robot.clone(), &subject.world())?;
    let request = KickRequest { strength: Strength::BallSpeed(1.0), ..KickRequest::new([0.3, -0.1], 0.0, 1.0) };
    let (outcome, ..) = run_case(&subject, "dynamic", &Case::of(&request, 1), &mut world, &mut Vec::new())?;
    match outcome {
        Ok(kick) => println!("ball {:?} m/s, {}", kick.ball_speed, if kick.upright { "stands" } else { "fell" }),
        Err(refusal) => println!("refused: {}", refusal.explain(&subject.robot)),
    }
    Ok(())
}
