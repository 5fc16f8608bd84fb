//! Instep's command line: reads what the user asked for, runs it, and ends with a code that tells how it went.
//!
//! Exit codes: 0, the command did what was asked (a kick that falls or fails its audit is a result, not an error);
//! 1, it could not (no motion that the robot can do was found; the best is written and marked so); 130, Ctrl-C stopped
//! it and the best so far is written; 2, something handed in cannot be used: one message on standard error says what and what would be
//! right, and nothing was written.

mod adopt;
mod bench;
mod decide;
mod eval;
mod failure;
mod figure;
mod files;
mod interrupt;
mod kick;
mod learn_table;
mod locate;
mod matches;
mod mujoco_log;
mod navigate;
mod output;
mod places;
mod rcss;
mod reach;
mod retarget;
mod robot;
mod ros;
mod see;
mod show;
mod train;
mod tune;
mod walk;
mod worlds;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use output::Output;

/// Kicks a ball with a humanoid robot, in simulation, from human motion.
#[derive(Debug, Parser)]
#[command(name = "instep", version, propagate_version = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Print one JSON object on standard output instead of text. SI units; degrees only where a key ends in _deg
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Measure engines, robots and scenarios against each other in one table
    Bench(bench::Bench),
    /// Tell what a player would do in a situation, and why
    Decide(decide::Decide),
    /// Measure a policy over seeded trials
    Eval(eval::Eval),
    /// Let a robot kick a ball, from a reference or by an engine, and measure what happens
    Kick(kick::Kick),
    /// Compare three kinds of reference, with and without early termination (paper 1, Table II)
    LearnTable(learn_table::LearnTable),
    /// Follow a robot's pose on the field by CLAP, the shipped landmark filter and what others use, on the same data
    Locate(locate::Locate),
    /// Play games of soccer in the game simulator and compare strategies
    Match(matches::Match),
    /// Walk a point robot or a walking robot round others to its goal by DAVG and cf-MPC, and measure it
    Navigate(navigate::Navigate),
    /// Play on a running RCSSServerMJ, the simulation league's MuJoCo server: one player or a whole team
    Rcss(rcss::Rcss),
    /// Turn a human kick (ASF/AMC or BVH) into a reference for a robot
    Retarget(retarget::Retarget),
    /// Look at a robot's own files
    #[command(subcommand)]
    Robot(robot::RobotCommand),
    /// Offer the kick as a ROS 2 action, for a real or a simulated robot; no ROS has to be installed
    Ros(ros::Ros),
    /// Look through a robot's camera: frames, detector, ball, landmarks, obstacles; its sets, training and measures
    See(see::See),
    /// Train a policy that follows a reference, or that kicks the ball with it
    Train(train::Train),
    /// Find an engine's settings for a robot by CMA-ES
    Tune(tune::Tune),
    /// Let a robot walk on its senses, at a velocity or to a place, and measure how it goes
    Walk(walk::Walk),
}

fn main() -> ExitCode {
    mujoco_log::listen();
    let cli = Cli::parse();
    let output = Output::new(cli.json);
    let done = match cli.command {
        Command::Bench(bench) => bench.run(&output),
        Command::Decide(decide) => decide.run(&output),
        Command::Eval(eval) => eval.run(&output),
        Command::Kick(kick) => kick.run(&output),
        Command::LearnTable(table) => table.run(&output),
        Command::Locate(locate) => locate.run(&output),
        Command::Match(matches) => matches.run(&output),
        Command::Navigate(navigate) => navigate.run(&output),
        Command::Rcss(rcss) => rcss.run(&output),
        Command::Retarget(retarget) => retarget.run(&output),
        Command::Robot(command) => command.run(&output),
        Command::Ros(ros) => ros.run(&output),
        Command::See(see) => see.run(&output),
        Command::Train(train) => train.run(&output),
        Command::Tune(tune) => tune.run(&output),
        Command::Walk(walk) => walk.run(&output),
    };
    match done {
        Ok(code) => code,
        Err(failure) => {
            output.complain(&failure);
            failure.code()
        }
    }
}
