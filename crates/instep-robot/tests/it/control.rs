//! The drive's law: torque falls to zero at the speed limit and below it beyond, braking has the full torque, and a
//! command never exceeds what the motor can give.

use instep_robot::Joint;
use instep_robot::control::{JointCommand, drive_torque, torque_range};
use instep_robot::drive::Pid;
use proptest::prelude::*;

fn joint() -> impl Strategy<Value = Joint> {
    (0.1..300.0f64, 0.5..40.0f64, 0.0..0.99f64, 1.0..500.0f64, 0.01..20.0f64).prop_map(
        |(torque, speed, corner, kp, kd)| Joint {
            name: "joint".into(),
            group: 0,
            range: [-1.0, 1.0],
            torque,
            speed,
            corner,
            kp,
            kd,
            pid: Pid::default(),
            dead_zone: 0.0,
            play: 0.0,
            static_friction: 0.0,
            viscous_friction: 0.0,
        },
    )
}

proptest! {
    #[test]
    fn the_range_holds_zero_up_to_the_limit_and_brakes_beyond(joint in joint(), share in -3.0..3.0f64) {
        let [least, greatest] = torque_range(&joint, share * joint.speed);
        prop_assert!(greatest <= joint.torque && least >= -joint.torque && least <= greatest);
        if share.abs() < 1.0 { prop_assert!(least <= 0.0 && greatest >= 0.0) }
        // Braking has the full torque.
        if share >= 0.0 { prop_assert_eq!(least, -joint.torque) } else { prop_assert_eq!(greatest, joint.torque) }
        // Beyond the limit the motor brakes.
        if share > 1.0 + 1e-9 { prop_assert!(greatest < 0.0) }
        if share < -1.0 - 1e-9 { prop_assert!(least > 0.0) }
        // Up to the corner the full torque is there.
        if share.abs() < joint.corner { prop_assert_eq!([least, greatest], [-joint.torque, joint.torque]) }
    }

    #[test]
    fn both_directions_are_the_same_motor(joint in joint(), share in -2.0..2.0f64) {
        let [least, greatest] = torque_range(&joint, share * joint.speed);
        let [mirror_least, mirror_greatest] = torque_range(&joint, -share * joint.speed);
        prop_assert_eq!([least, greatest], [-mirror_greatest, -mirror_least]);
    }

    #[test]
    fn driving_torque_falls_with_speed_and_has_no_jump(joint in joint(), share in 0.0..1.5f64) {
        let step = 1e-6;
        let [_, here] = torque_range(&joint, share * joint.speed);
        let [_, faster] = torque_range(&joint, (share + step) * joint.speed);
        prop_assert!(faster <= here);
        prop_assert!(here - faster <= 1.01 * joint.torque * step / (1.0 - joint.corner) + 1e-12);
    }

    #[test]
    fn the_drive_stays_within_its_motor(
        joint in joint(), position in -9.0..9.0f64, velocity in -9.0..9.0f64, added in -999.0..999.0f64,
        q in -3.0..3.0f64, share in -2.0..2.0f64,
    ) {
        let v = share * joint.speed;
        let torque = drive_torque(&joint, position, velocity, added, q, v);
        let [least, greatest] = torque_range(&joint, v);
        prop_assert!((least..=greatest).contains(&torque));
        let free = joint.kp * (position - q) + joint.kd * (velocity - v) + added;
        if (least..=greatest).contains(&free) { prop_assert_eq!(torque, free) }
    }
}

#[test]
fn half_way_down_the_slope_there_is_half_the_torque() {
    let joint = Joint {
        name: "knee".into(),
        group: 0,
        range: [0.0, 2.0],
        torque: 200.0,
        speed: 10.0,
        corner: 0.8,
        kp: 1.0,
        kd: 1.0,
        pid: Pid::default(),
        dead_zone: 0.0,
        play: 0.0,
        static_friction: 0.0,
        viscous_friction: 0.0,
    };
    let [least, greatest] = torque_range(&joint, 9.0);
    assert!((greatest - 100.0).abs() < 1e-9);
    assert!((least + 200.0).abs() < 1e-9);
}

#[test]
fn an_empty_command_has_one_entry_a_joint() {
    let command = JointCommand::zeros(25);
    assert_eq!([command.positions.len(), command.velocities.len(), command.torques.len()], [25; 3]);
}
