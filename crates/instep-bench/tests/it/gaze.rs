//! A robot as built sees the ball that it is to kick: it looks at it, before and while it kicks.

use instep_bench::Subject;
use instep_kick::KickRequest;
use instep_robot::control::{JointCommand, Sensors};
use instep_sim::sensors::SensorSuite;
use instep_sim::{BallState, World};

use crate::root;

const BALL: [f64; 2] = [0.18, -0.05];

/// The sights before the start, and the age of the oldest one that the engine had until the contact, s.
fn seen(name: &str, look: bool) -> (usize, f64) {
    let subject = Subject::load(&root("robots"), name).unwrap();
    let robot = &subject.robot;
    let mut world = World::new(robot.clone(), &subject.world()).unwrap();
    let mut q = robot.stand.clone();
    if look {
        subject.gaze().unwrap().aim(BALL, &mut q[7..]);
    }
    let [x, y] = [0, 1].map(|k| BALL[k] + subject.footprint[k]);
    world.reset(&q, &vec![0.0; robot.nv()], &BallState::at_rest([x, y, subject.size.ball])).unwrap();
    let mut suite = SensorSuite::new(&mut world, 1);
    suite.sense(&world);
    let before = suite.ball_sights().unwrap().len();
    if !look {
        return (before, f64::INFINITY);
    }
    let mut sensors = Sensors::default();
    suite.read_into(0.0, &mut sensors);
    let mut engine = subject.engine("dynamic").unwrap();
    let plan = engine.plan(&KickRequest::new(BALL, 0.0, 0.6), &sensors).unwrap();
    let mut command = JointCommand::zeros(robot.joints.len());
    let period = (engine.control_period() / world.settings().step.tick).round() as usize;
    let mut oldest = 0.0f64;
    for tick in 0.. {
        if world.time() > plan.contact {
            break;
        }
        if tick % period == 0 {
            suite.read_into(world.time(), &mut sensors);
            oldest = oldest.max(world.time() - sensors.ball.unwrap().time);
            engine.tick(&sensors, &mut command);
        }
        world.advance(&command, None).unwrap();
        suite.sense(&world);
    }
    (before, oldest)
}

#[test]
fn a_ball_at_the_feet_is_seen_from_the_plan_to_the_contact() {
    for name in ["nao", "wolfgang"] {
        // Looking straight ahead neither camera has it in its picture.
        assert_eq!(seen(name, false).0, 0, "{name}");
        let (before, oldest) = seen(name, true);
        assert!(before >= 10, "{name}: {before} sights before the start");
        assert!(oldest < 0.3, "{name}: a sight {oldest:.2} s old");
    }
}
