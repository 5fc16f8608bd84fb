//! A small training: the same on any number of threads, stopped and resumed, with every end of an episode explained.

use std::path::Path;
use std::sync::Arc;

use instep_learn::environment::{Environment, Scene};
use instep_learn::evaluate::{Evaluation, evaluate};
use instep_learn::settings::{NetworkSettings, PpoSettings};
use instep_learn::termination::End;
use instep_learn::train::Training;
use instep_learn::{LearnError, LearnSettings, checkpoint};
use instep_motion::reference::Reference;
use instep_robot::Robot;

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

fn prestoe() -> (Arc<Robot>, Arc<Reference>) {
    let robot = Robot::load(&root().join("robots/prestoe")).unwrap();
    let reference = Reference::load(&root().join("references/prestoe/10_03_kinodynamic.json")).unwrap();
    (Arc::new(robot), Arc::new(reference))
}

fn small() -> LearnSettings {
    let mut settings = LearnSettings {
        ppo: PpoSettings { environments: 40, horizon: 8, minibatch: 160, epochs: 2, ..PpoSettings::default() },
        network: NetworkSettings { actor: vec![32], critic: vec![32], ..NetworkSettings::default() },
        ..LearnSettings::default()
    };
    (settings.clip.from, settings.clip.to) = (Some(0.15), Some(2.4));
    settings
}

fn training(settings: LearnSettings) -> Training {
    let (robot, reference) = prestoe();
    Training::new(robot, reference, "10_03_kinodynamic.json", settings, 3, 100_000, None).unwrap()
}

#[test]
fn one_thread_and_three_give_the_same_policy() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut training = training(small());
            for _ in 0..3 {
                training.iterate().unwrap();
            }
            (training.policy().to_bytes().unwrap(), training.state.curve.clone())
        })
    };
    let (one, three) = (run(1), run(3));
    assert!(one.0 == three.0, "the policies' bytes differ");
    assert_eq!(one.1, three.1);
}

#[test]
fn a_training_goes_on_from_its_checkpoint() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("checkpoint.safetensors");
    let mut first = training(small());
    first.iterate().unwrap();
    first.iterate().unwrap();
    checkpoint::save(&first, &file).unwrap();
    let (settings, state) = checkpoint::peek(&file).unwrap();
    assert_eq!((&settings, &state), (&small(), &first.state));

    let mut second = training(settings);
    checkpoint::restore(&mut second, &file).unwrap();
    assert_eq!(second.ppo.weights.flat, first.ppo.weights.flat);
    assert_eq!(second.ppo.actor_adam, first.ppo.actor_adam);
    assert_eq!(second.ppo.critic_adam, first.ppo.critic_adam);
    assert_eq!(second.rollout.moments, first.rollout.moments);
    assert_eq!(second.policy().to_bytes().unwrap(), first.policy().to_bytes().unwrap());
    let progress = second.iterate().unwrap();
    assert_eq!((progress.iteration, progress.steps), (3, 3 * 40 * 8));

    // Half a file, and another training's.
    let bytes = std::fs::read(&file).unwrap();
    std::fs::write(&file, &bytes[..bytes.len() / 2]).unwrap();
    assert!(matches!(checkpoint::restore(&mut second, &file), Err(LearnError::File { .. })));
    let mut other = small();
    other.network.actor = vec![16];
    let mut other = training(other);
    std::fs::write(&file, &bytes).unwrap();
    let error = checkpoint::restore(&mut other, &file).unwrap_err().to_string();
    assert!(error.contains("another training"), "{error}");
}

#[test]
fn a_disk_that_refuses_leaves_the_last_checkpoint() {
    let folder = tempfile::tempdir().unwrap();
    let training = training(small());
    let error = checkpoint::save(&training, &folder.path().join("none/checkpoint.safetensors")).unwrap_err();
    assert!(error.to_string().contains("cannot be written"), "{error}");
}

#[test]
fn every_episode_ends_for_a_reason_and_starts_where_it_is_told() {
    let (robot, reference) = prestoe();
    let scene = Arc::new(Scene::new(Arc::clone(&robot), reference, small()).unwrap());
    let mut environment = Environment::new(Arc::clone(&scene), 1, 0).unwrap();
    let still = vec![0.0; robot.joints.len()];
    let mut run = |tick: usize, action: &[f32]| {
        environment.start(tick).unwrap();
        assert_eq!((environment.tick(), environment.started()), (tick, tick));
        loop {
            let step = environment.step(action, 0.3);
            assert!((-1.0..=1.0).contains(&step.reward), "{step:?}");
            if let Some(end) = step.end {
                return (end, environment.tick());
            }
        }
    };
    // From the stand after the kick the reference's own torques suffice.
    let (end, tick) = run(scene.clip_ticks() - 1, &still);
    assert_eq!(end, End::Completed);
    assert!(tick > scene.clip_ticks());
    // A policy that pulls at every joint leaves the reference, and it is known by which link.
    let (end, _) = run(0, &vec![5.0; robot.joints.len()]);
    assert!(matches!(end, End::Link(link) if link > 0), "{end:?}");
}

#[test]
fn the_error_of_a_start_is_not_told_to_the_odometry() {
    let (robot, reference) = prestoe();
    let mut settings = small();
    (settings.start.base_speed, settings.start.joint_speed) = (0.5, 0.5);
    let scene = Arc::new(Scene::new(Arc::clone(&robot), reference, settings).unwrap());
    let mut environment = Environment::new(scene, 1, 0).unwrap();
    environment.start(0).unwrap();
    let n = robot.joints.len();
    let seen = environment.observation();
    assert!(seen[n..2 * n].iter().any(|e| e.abs() > 0.1), "an encoder sees a joint's speed: {seen:?}");
    assert!(seen[2 * n + 12..2 * n + 15].iter().all(|e| e.abs() < 1e-6), "nothing sees the base's: {seen:?}");
}

#[test]
fn without_early_termination_not_even_a_fall_ends_an_episode() {
    let (robot, reference) = prestoe();
    let run = |ret: bool| {
        let mut settings = small();
        settings.termination.ret = ret;
        let scene = Arc::new(Scene::new(Arc::clone(&robot), Arc::clone(&reference), settings).unwrap());
        let mut environment = Environment::new(scene, 1, 0).unwrap();
        environment.start(0).unwrap();
        let action = vec![5.0; robot.joints.len()];
        loop {
            // So far away that only a fall is left to end it early.
            if let Some(end) = environment.step(&action, 10.0).end {
                break end;
            }
        }
    };
    assert_eq!(run(true), End::Fell);
    assert_eq!(run(false), End::Completed);
}

#[test]
fn a_kicked_ball_is_paid_for_once() {
    let (robot, reference) = prestoe();
    let still = vec![0.0; robot.joints.len()];
    // The same kick with and without the ball's reward; the reference's own torques bring the foot from the swing to the ball.
    let rewards = [0.0, 20.0].map(|w_ball| {
        let mut settings = small();
        (settings.world.ball, settings.reward.w_ball) = (true, w_ball);
        let scene = Arc::new(Scene::new(Arc::clone(&robot), Arc::clone(&reference), settings).unwrap());
        let contact = (scene.follower().track().contact_time() / scene.settings.follower.period) as usize;
        let mut environment = Environment::new(scene, 1, 0).unwrap();
        environment.start(contact - 8).unwrap();
        (0..30).map(|_| environment.step(&still, 10.0).reward).collect::<Vec<_>>()
    });
    let paid: Vec<(usize, f64)> = rewards[1]
        .iter()
        .zip(&rewards[0])
        .map(|(with, without)| with - without)
        .enumerate()
        .filter(|(_, p)| *p != 0.0)
        .collect();
    assert_eq!(paid.len(), 1, "{paid:?}");
    assert!((8..14).contains(&paid[0].0) && paid[0].1 > 5.0, "{paid:?}");
}

#[test]
fn an_evaluation_is_the_same_twice_and_counts_what_it_says() {
    let (robot, _) = prestoe();
    let policy = training(small()).policy();
    let evaluation = Evaluation { trials: 3, ..Evaluation::default() };
    let first = evaluate(&robot, &policy, &evaluation, &|| ()).unwrap();
    let second = evaluate(&robot, &policy, &evaluation, &|| ()).unwrap();
    assert_eq!(first, second);
    assert_eq!(first.each.len(), 3);
    // Nothing was learned yet: it does not get through the run-up, and that is told.
    assert!(first.each.iter().all(|tried| tried.upright == tried.fell_at.is_none()), "{first:?}");
    assert!(first.completed.share() < Some(1.0) && first.upright.share() < Some(1.0), "{first:?}");
    let upright = first.each.iter().filter(|tried| tried.upright).count() as f64 / 3.0;
    assert_eq!(first.upright.share(), Some(upright));
    assert!(first.link_error_mean > 0.0);
}

#[test]
fn spread_trials_start_all_over_the_clip() {
    let (robot, _) = prestoe();
    let policy = training(small()).policy();
    let at = |start: f64, spread: bool, trials: usize, seed: u64| {
        let evaluation = Evaluation { trials, seed, start, spread, ..Evaluation::default() };
        evaluate(&robot, &policy, &evaluation, &|| ()).unwrap().each
    };
    let spread = at(0.0, true, 3, 1);
    let [from, to] = policy.header.window;
    let period = policy.header.follower.period;
    for (i, seed) in [1, 2, 3].into_iter().enumerate() {
        let start = (i as f64 / 3.0 * (to - from) / period).floor() * period;
        assert_eq!(spread[i], at(start, false, 1, seed)[0], "trial {i} from {start} s");
    }
    assert_ne!(spread[1], at(0.0, false, 3, 1)[1]);
    // Where the foot is at the ball already there is none.
    let contact = policy.follower(&robot).unwrap().track().contact_time();
    assert_eq!(at(contact, false, 1, 1)[0].direction_error_deg, None);
}

#[test]
fn settings_come_back_from_toml_and_wrong_ones_are_named() {
    let text = toml::to_string(&LearnSettings::ball()).unwrap();
    assert_eq!(toml::from_str::<LearnSettings>(&text).unwrap(), LearnSettings::ball());
    let wrong = |text: &str| toml::from_str::<LearnSettings>(text).unwrap().validate().unwrap_err().to_string();
    assert!(wrong("[ppo]\ngamma = 1.5").contains("ppo.gamma: 1.5"));
    assert!(wrong("[reward]\nk_k = 2.0").contains("reward.k_k"));
    assert!(wrong("[world]\nstep = 0.003").contains("world.step"));
    assert!(toml::from_str::<LearnSettings>("[ppo]\ngama = 0.9").is_err());
}

#[test]
fn the_ball_is_learnt_in_worlds_as_built_that_differ_and_the_reference_in_ideal_ones() {
    use instep_sim::settings::Fidelity;
    use rand::SeedableRng as _;
    let (robot, reference) = prestoe();
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(4);
    let scene = |settings| Scene::new(Arc::clone(&robot), Arc::clone(&reference), settings).unwrap();
    let ball = scene(LearnSettings::ball());
    let [one, other] = [(); 2].map(|()| *ball.world(&mut rng).unwrap().settings());
    for world in [&one, &other] {
        assert_eq!((world.drives, world.senses), (Fidelity::AsBuilt, Fidelity::AsBuilt));
        assert_eq!((world.step.tick, world.step.far), (0.001, 0.001));
    }
    assert_ne!(one.model_error.mass, other.model_error.mass);
    assert_ne!(one.pitch.friction, other.pitch.friction);
    let track = scene(LearnSettings::default());
    let world = *track.world(&mut rng).unwrap().settings();
    assert_eq!((world.drives, world.senses, world.model_error.mass), (Fidelity::Ideal, Fidelity::Ideal, 1.0));
}
