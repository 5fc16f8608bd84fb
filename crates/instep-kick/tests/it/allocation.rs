//! A tick allocates nothing, in no phase, and neither do the ticks after a cancel.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::Arc;

use instep_kick::Settings;
use instep_kick::adaptive::AdaptiveKick;
use instep_kick::dynamic::DynamicKick;
use instep_kick::policy::PolicyKick;
use instep_kick::preview::{Com, PreviewKick, PreviewSettings, Stabiliser};
use instep_kick::{BallModel, BreakOff, KickEngine, KickRequest, KickStatus, Playback};
use instep_robot::Robot;
use instep_robot::control::{BallObservation, Controller, JointCommand};

use crate::learned::learned;
use crate::policy::{policy, prestoe};
use crate::rig::{engine, request, robot, standing};

struct Counting;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: every call goes to the system's allocator; counting touches a constant-initialised thread-local only.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let _ = COUNT.try_with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's promise is passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Runs a kick, cancelled or not, and counts what its ticks allocate.
fn allocated(engine: &mut dyn KickEngine, robot: &Robot, request: &KickRequest, cancel: bool) -> usize {
    let mut sensors = standing(robot);
    if let Some(start) = engine.own_start() {
        sensors.joint_positions.copy_from_slice(&start.q[7..]);
    }
    let mut command = JointCommand::zeros(robot.joints.len());
    let plan = engine.plan(request, &sensors).unwrap();
    let before = COUNT.get();
    while sensors.time < plan.duration + 0.5 {
        if cancel && sensors.time > 0.9 * plan.contact {
            engine.cancel();
        }
        engine.tick(&sensors, &mut command);
        sensors.time += engine.control_period();
    }
    COUNT.get() - before
}

#[test]
fn a_tick_allocates_nothing() {
    for name in ["nao", "wolfgang"] {
        for cancel in [false, true] {
            let robot = robot(name);
            assert_eq!(allocated(&mut engine(name), &robot, &request(name), cancel), 0, "{name} allocated in a tick");
        }
    }
}

#[test]
fn a_tick_of_preview_allocates_nothing() {
    let robot = robot("nao");
    let folder = robot.folder();
    for com in [Com::General, Com::TwoLink] {
        for cancel in [false, true] {
            let mut settings = PreviewSettings::load(folder).unwrap();
            settings.com = com;
            settings.stabilisers = vec![Stabiliser::Preview, Stabiliser::Pressure, Stabiliser::Inertial];
            let ball = BallModel::load(folder).unwrap();
            let mut engine = PreviewKick::new(Arc::clone(&robot), ball, settings).unwrap();
            assert_eq!(allocated(&mut engine, &robot, &request("nao"), cancel), 0, "{com:?} allocated in a tick");
        }
    }
}

/// The ball is seen, moves twice while the foot goes back, and at last goes where no foot can meet it.
#[test]
fn the_adaptive_kick_allocates_nothing_while_it_follows_the_ball() {
    for name in ["nao", "wolfgang"] {
        let robot = robot(name);
        let mut engine = AdaptiveKick::load(robot.clone()).unwrap();
        let mut sensors = standing(&robot);
        let mut command = JointCommand::zeros(robot.joints.len());
        let request = request(name);
        let foot = DynamicKick::load(robot.clone()).unwrap().footprint_from_base();
        let plan = engine.plan(&request, &sensors).unwrap();
        let mut broke = None;
        let before = COUNT.get();
        while sensors.time < plan.duration + 1.0 {
            let by = match sensors.time / plan.contact {
                t if t < 0.7 => [0.0, 0.0],
                t if t < 0.75 => [0.015, 0.01],
                t if t < 0.8 => [-0.005, -0.02],
                _ => [0.5, 0.5],
            };
            let at = [request.ball[0] + by[0] - foot[0], request.ball[1] + by[1] - foot[1], 0.05];
            sensors.ball = Some(BallObservation { time: sensors.time, position: at });
            engine.tick(&sensors, &mut command);
            broke = broke.or(engine.broken_off());
            sensors.time += engine.control_period();
        }
        assert_eq!(COUNT.get(), before, "{name} allocated in a tick");
        assert_eq!(broke, Some(BreakOff::BallGone), "{name}");
    }
}

#[test]
fn a_tick_of_the_policys_engine_allocates_nothing() {
    for cancel in [false, true] {
        let mut engine = learned();
        let robot = robot("prestoe");
        let request = engine.own_start().unwrap().request;
        assert_eq!(allocated(&mut engine, &robot, &request, cancel), 0, "allocated in a tick");
        let status = if cancel { KickStatus::Cancelled } else { KickStatus::Finished };
        assert_eq!(engine.progress().status, status);
    }
}

#[test]
fn neither_playback_nor_policy_allocate_in_a_tick() {
    let (robot, reference) = prestoe();
    let mut playback = Playback::new(&robot, reference.clone(), 0.5).unwrap();
    let mut run = PolicyKick::new(&robot, &policy(&robot, &reference), 0.0).unwrap();
    for controller in [&mut playback as &mut dyn Controller, &mut run] {
        let mut sensors = standing(&robot);
        let mut command = JointCommand::zeros(robot.joints.len());
        let before = COUNT.get();
        while sensors.time < 3.2 {
            controller.tick(&sensors, &mut command);
            sensors.time += 0.002;
        }
        assert_eq!(COUNT.get(), before, "allocated in a tick");
    }
}
