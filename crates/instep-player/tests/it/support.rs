//! What tests share.

use std::path::Path;
use std::sync::{Arc, LazyLock};

use instep_behaviour::{KickTable, Strategy};
use instep_field::{Field, Pose};
use instep_localisation::Start;
use instep_player::{Identity, Player, PlayerSettings, Senses};
use instep_robot::Robot;
use instep_robot::control::Sensors;

fn load(name: &str) -> Arc<Robot> {
    Arc::new(Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots").join(name)).unwrap())
}

static T1: LazyLock<Arc<Robot>> = LazyLock::new(|| load("t1"));
static ARTEMIS: LazyLock<Arc<Robot>> = LazyLock::new(|| load("artemis"));

/// Booster's T1: loaded once.
pub(crate) fn robot() -> Arc<Robot> {
    Arc::clone(&T1)
}

/// ARTEMIS, which kicks within its gait: loaded once.
pub(crate) fn artemis() -> Arc<Robot> {
    Arc::clone(&ARTEMIS)
}

/// A player that knows that it stands at `pose`.
pub(crate) fn player(pose: Pose) -> Player {
    player_of(robot(), pose)
}

/// The same in another body.
pub(crate) fn player_of(robot: Arc<Robot>, pose: Pose) -> Player {
    let settings = PlayerSettings::load(&robot, Strategy::default(), &KickTable { kick: Vec::new() }).unwrap();
    let start = Start::Near { pose, position_sigma: 0.1, heading_sigma: 0.05 };
    let field = Arc::new(Field::named("adult-2024").unwrap());
    Player::new(robot, field, Identity { number: 2, start }, settings).unwrap()
}

/// The senses of a robot that stands still and upright at `time`.
pub(crate) fn standing(time: f64) -> Senses {
    standing_of(&robot(), time)
}

/// The same in another body.
pub(crate) fn standing_of(robot: &Robot, time: f64) -> Senses {
    let (joints, contacts) = (robot.joints.len(), robot.contacts.len());
    let body = Sensors {
        time,
        joint_positions: robot.stand[7..].to_vec(),
        joint_velocities: vec![0.0; joints],
        accelerometer: [0.0, 0.0, 9.81],
        orientation: [1.0, 0.0, 0.0, 0.0],
        contact_forces: vec![robot.mass() * 9.81 / contacts as f64; contacts],
        centre_of_pressure: [Some([0.0; 2]); 2],
        ..Sensors::default()
    };
    Senses { body, ..Senses::default() }
}
