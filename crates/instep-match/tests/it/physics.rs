//! Matches in physics: the same bytes on any number of threads, a player that sees, and bad input that is refused.

use std::path::Path;
use std::sync::Arc;

use instep_behaviour::{KickTable, Strategy};
use instep_field::Field;
use instep_match::MatchSettings;
use instep_match::physics::fig12h::{self, Seen};
use instep_match::physics::{Motion, Outfit, PhysicsMatch, Sight};
use instep_player::PlayerSettings;
use instep_robot::Robot;

fn artemis() -> (Arc<Robot>, PlayerSettings) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let robot = Arc::new(Robot::load(&root.join("robots/artemis")).unwrap());
    let kicks = KickTable::load(&root.join("kicks/kicks.toml")).unwrap();
    let settings = PlayerSettings::load(&robot, Strategy::default(), &kicks).unwrap();
    (robot, settings)
}

fn outfits(players: [usize; 2]) -> [Outfit; 2] {
    let (robot, settings) = artemis();
    players.map(|players| Outfit {
        robot: Arc::clone(&robot),
        settings: settings.clone(),
        players,
        sight: Sight::default(),
    })
}

fn played(seconds: f64) -> (Motion, String) {
    let settings = Arc::new(MatchSettings::new("adult-2024", None).unwrap());
    let mut game = PhysicsMatch::new(settings, &outfits([2, 1]), 0, 3).unwrap();
    game.keep_motion();
    game.play(seconds, |_| ()).unwrap();
    let (flat, motion) = game.take_records();
    (motion.unwrap(), serde_json::to_string(&flat).unwrap())
}

#[test]
fn the_same_game_on_one_thread_and_on_three() {
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let (one, flat) = pool(1).install(|| played(1.5));
    let (three, same) = pool(3).install(|| played(1.5));
    assert!(one == three, "positions differ");
    assert_eq!(flat, same);
    assert_eq!(one.q.len(), 3);
    assert!(flat.contains("Ready"), "the referee has called them to their places");
}

#[test]
fn a_trial_is_repeatable_and_its_robot_sees_the_ball() {
    let (robot, settings) = artemis();
    let field = Arc::new(Field::named("adult-2024").unwrap());
    let game = |seed, sight| {
        let mut seen = Seen::default();
        let outcome = fig12h::play_for(&field, &robot, &settings, sight, seed, 1.0, Some(&mut seen)).unwrap();
        (outcome, seen)
    };
    for sight in [Sight::Camera, Sight::Simulated] {
        let (first, seen) = game(5, sight);
        let (again, _) = game(5, sight);
        assert_eq!(serde_json::to_string(&first).unwrap(), serde_json::to_string(&again).unwrap());
        assert!(first.fell_at.is_none() && !first.touched);
        // By its own eyes, near where it is.
        let last = seen.flat.frames.last().unwrap();
        let [x, y] = last.robots[0].ball.expect("it has seen the ball, which lies in view");
        let off = (x - last.ball[0]).hypot(y - last.ball[1]);
        assert!(off < 0.8, "{off} m, {sight:?}");
    }
}

#[test]
fn what_cannot_be_played_is_refused() {
    let settings = Arc::new(MatchSettings::new("adult-2024", None).unwrap());
    let error = PhysicsMatch::new(Arc::clone(&settings), &outfits([0, 1]), 0, 1).unwrap_err().to_string();
    assert!(error.contains("players of a team: 0"), "{error}");
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/artemis");
    let mut blind = Robot::load(&root).unwrap();
    blind.camera = None;
    let [mut red, blue] = outfits([1, 1]);
    red.robot = Arc::new(blind);
    let error = PhysicsMatch::new(settings, &[red, blue], 0, 1).unwrap_err().to_string();
    assert!(error.contains("camera") && error.contains("artemis"), "{error}");
}
