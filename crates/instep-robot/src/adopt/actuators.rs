//! Speed limits of known actuators, for models that give torques alone (MJCF has no place for a speed).
//!
//! A row is found by the robot's mass and the joint's torque limit as its maker's model has it. Sources: Unitree's URDF of the G1 (29
//! joints, rev 1.0) and of the H1; Booster's T1 by public whole-body-tracking configurations; ROBOTIS e-Manual (no-load speeds at 12 V).

/// One actuator in one robot.
struct Actuator {
    name: &'static str,
    /// Mass of the robots that have it, kg.
    mass: [f64; 2],
    /// Torque limits under which it stands in models, N m.
    torque: [f64; 2],
    /// No-load speed, rad/s.
    speed: f64,
}

const KNOWN: &[Actuator] = &[
    Actuator { name: "Unitree G1 hip pitch and yaw", mass: [28.0, 45.0], torque: [87.0, 89.0], speed: 32.0 },
    Actuator { name: "Unitree G1 hip roll and knee", mass: [28.0, 45.0], torque: [138.0, 140.0], speed: 20.0 },
    Actuator { name: "Unitree G1 ankle and waist", mass: [28.0, 45.0], torque: [49.0, 51.0], speed: 30.0 },
    Actuator { name: "Unitree G1 arm", mass: [28.0, 45.0], torque: [24.5, 25.5], speed: 37.0 },
    Actuator { name: "Unitree G1 wrist", mass: [28.0, 45.0], torque: [4.9, 5.1], speed: 22.0 },
    Actuator { name: "Unitree H1 hip and torso", mass: [45.0, 75.0], torque: [199.0, 201.0], speed: 23.0 },
    Actuator { name: "Unitree H1 knee", mass: [45.0, 75.0], torque: [299.0, 301.0], speed: 14.0 },
    Actuator { name: "Unitree H1 ankle and shoulder", mass: [45.0, 75.0], torque: [39.0, 41.0], speed: 9.0 },
    Actuator { name: "Unitree H1 arm", mass: [45.0, 75.0], torque: [17.5, 18.5], speed: 20.0 },
    Actuator { name: "Booster T1 hip pitch", mass: [27.0, 36.0], torque: [44.0, 46.0], speed: 12.5 },
    Actuator { name: "Booster T1 hip roll, yaw, waist", mass: [27.0, 36.0], torque: [29.0, 31.0], speed: 10.9 },
    Actuator { name: "Booster T1 knee", mass: [27.0, 36.0], torque: [59.0, 66.0], speed: 11.7 },
    Actuator { name: "Booster T1 ankle pitch", mass: [27.0, 36.0], torque: [19.5, 24.4], speed: 18.8 },
    Actuator { name: "Booster T1 ankle roll", mass: [27.0, 36.0], torque: [14.5, 15.5], speed: 12.4 },
    Actuator { name: "Booster T1 arm", mass: [27.0, 36.0], torque: [17.5, 18.5], speed: 18.8 },
    Actuator { name: "ROBOTIS MX-28", mass: [1.0, 8.0], torque: [2.4, 2.6], speed: 5.76 },
    Actuator { name: "ROBOTIS XM430-W350", mass: [1.0, 8.0], torque: [3.8, 5.1], speed: 4.8 },
    Actuator { name: "ROBOTIS MX-64", mass: [3.0, 10.0], torque: [5.9, 7.4], speed: 6.6 },
    Actuator { name: "ROBOTIS MX-106", mass: [3.0, 10.0], torque: [8.3, 10.1], speed: 4.71 },
];

/// Name and speed limit (rad/s) of an actuator with `torque` (N m) in a robot of `mass` (kg).
pub(super) fn known(mass: f64, torque: f64) -> Option<(&'static str, f64)> {
    let within = |[low, high]: [f64; 2], x: f64| (low..=high).contains(&x);
    KNOWN.iter().find(|row| within(row.mass, mass) && within(row.torque, torque)).map(|row| (row.name, row.speed))
}
