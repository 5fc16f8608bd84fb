//! One kick, printed in detail: for tuning.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::sync::Arc;

use instep_kick::dynamic::{DynamicKick, DynamicSettings};
use instep_kick::{KickEngine, KickRequest};
use instep_robot::Robot;
use instep_robot::control::{Controller, JointCommand, Sensors};
use instep_sim::BallState;
use instep_sim::settings::{Ball, WorldSettings};
use instep_sim::trial::{TrialSettings, run};

struct Shell<'a> {
    engine: &'a mut DynamicKick,
    request: KickRequest,
    asked: bool,
    plan_time: f64,
    tick: Vec<f64>,
    verbose: bool,
}

impl Controller for Shell<'_> {
    fn tick(&mut self, sensors: &Sensors, command: &mut JointCommand) {
        if !self.asked {
            self.asked = true;
            let start = std::time::Instant::now();
            let plan = self.engine.plan(&self.request, sensors);
            self.plan_time = start.elapsed().as_secs_f64();
            println!("{plan:?} in {:.2} ms", 1e3 * self.plan_time);
            if let Err(e) = plan {
                println!("{e}");
            }
        }
        let start = std::time::Instant::now();
        self.engine.tick(sensors, command);
        self.tick.push(start.elapsed().as_secs_f64());
        if self.verbose && self.tick.len().is_multiple_of(8) {
            let p = self.engine.progress();
            let worst = command
                .positions
                .iter()
                .zip(&sensors.joint_positions)
                .map(|(a, b)| (a - b).abs())
                .enumerate()
                .max_by(|a, b| a.1.total_cmp(&b.1))
                .unwrap();
            let o = sensors.orientation;
            println!(
                "{:.3} {:?} cop L {:?} R {:?} planned {:?} tilt ({:+.3},{:+.3}) worst joint {} {:.3}",
                sensors.time,
                p.phase,
                sensors.centre_of_pressure[0].map(|c| c.map(|v| (v * 1e3).round())),
                sensors.centre_of_pressure[1].map(|c| c.map(|v| (v * 1e3).round())),
                self.engine.planned().map(|v| (v * 1e3).round()),
                2.0 * o[1],
                2.0 * o[2],
                worst.0,
                worst.1
            );
        }
    }
}

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let number = |i: usize, default: f64| args.get(i).and_then(|a| a.parse().ok()).unwrap_or(default);
    let name = args.get(1).map_or("nao", String::as_str);
    let robot = Arc::new(Robot::load(std::path::Path::new(&format!("robots/{name}"))).unwrap());
    let file = std::env::var("KICK_TOML").unwrap_or(format!("robots/{name}/dynamic.toml"));
    let settings = DynamicSettings::load(std::path::Path::new(&file)).unwrap();
    let mut engine = DynamicKick::new(Arc::clone(&robot), settings.clone()).unwrap();
    let ball = [number(2, 0.16), number(3, -0.05)];
    let direction = number(4, 0.0).to_radians();
    let mut request = KickRequest::new(ball, direction, number(5, 1.0));
    request.foot = None;
    let verbose = number(6, 0.0) > 0.0;
    let offset = engine.footprint_from_base();
    let at = [ball[0] - offset[0], ball[1] - offset[1]];
    println!("footprint from base {offset:?}");
    let mut world = WorldSettings::default();
    let env = |name: &str, default: f64| std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default);
    world.step.near_distance = env("NEAR_DISTANCE", 0.02);
    world.step.near = env("NEAR", 0.00025);
    world.impact.friction = env("GRIP", 0.5);
    world.ball = Ball { mass: settings.ball.mass, radius: settings.ball.radius };
    let trial = TrialSettings {
        world,
        seed: 1,
        duration: 5.0,
        control_period: settings.control_period,
        q: robot.stand.clone(),
        v: vec![0.0; robot.nv()],
        ball: BallState::at_rest([at[0], at[1], settings.ball.radius]),
        direction,
    };
    let mut shell = Shell { engine: &mut engine, request, asked: false, plan_time: 0.0, tick: vec![], verbose };
    let start = std::time::Instant::now();
    let result = run(&robot, &trial, &mut shell).unwrap();
    let took = start.elapsed().as_secs_f64();
    shell.tick.sort_by(f64::total_cmp);
    println!(
        "tick p50 {:.0} us p99 {:.0} us; trial {took:.2} s",
        1e6 * shell.tick[shell.tick.len() / 2],
        1e6 * shell.tick[shell.tick.len() * 99 / 100]
    );
    println!("fell {:?} violations {:?}", result.fell_at, result.limit_violations);
    println!(
        "direction error {:?} deg, launch {:?}",
        result.direction_error.map(f64::to_degrees),
        result.launch_angle.map(f64::to_degrees)
    );
    if let Some(i) = &result.impact {
        println!(
            "impact t {:.3} link {} foot {:.2} normal {:.2} ball {:.2} e {:.2} M {:.2} touches {} {}",
            i.time,
            i.link,
            i.foot_speed,
            i.foot_speed_normal,
            i.ball_speed(),
            i.restitution,
            i.effective_mass,
            i.touches,
            result.audit.verdict()
        );
        println!("{}", result.audit.reason());
    }
    for g in &result.groups {
        println!(
            "  {:16} {:8} torque {:.2}/{:.2} speed {:.2}/{:.2}",
            g.group, g.torque_joint, g.torque, g.torque_limit, g.speed, g.speed_limit
        );
    }
    println!("ball end {:?}", result.ball_end);
}
