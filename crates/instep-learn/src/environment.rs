//! One robot that follows a track in its world: what a policy is trained in.
//!
//! The policy sees what it will see on a robot ([`instep_kick::policy::Follower`]); rewards and ends are measured by the
//! simulator's truth. An episode starts in a random state of the reference (Peng et al., DeepMimic, 2018), more often
//! where episodes fail.

use std::sync::Arc;

use instep_kick::policy::Follower;
use instep_kick::track::{Track, TrackState};
use instep_motion::reference::Reference;
use instep_robot::control::{JointCommand, Sensors};
use instep_robot::{Robot, RobotData};
use instep_sim::sensors::SensorSuite;
use instep_sim::settings::{Step as StepSettings, WorldSettings};
use instep_sim::trial::has_fallen;
use instep_sim::{BallState, World};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::LearnError;
use crate::reward::{self, Deviation};
use crate::settings::LearnSettings;
use crate::termination::{End, part};

/// Where the ball is while there is none, m: so high that an episode is over before it lands, and no step has to solve its
/// contact with the ground.
pub(crate) const NO_BALL: [f64; 3] = [60.0, 0.0, 1000.0];
/// How long before the contact an episode must start for the ball to be there, s.
const BALL_LEAD: f64 = 0.1;
/// Least speed of a ball that has been kicked, m/s.
const KICKED: f64 = 0.5;

/// Whether an episode that starts at `at` (s) of `track` comes early enough for the ball: later the foot may already be where
/// it lies.
pub(crate) fn before_ball(track: &Track, at: f64) -> bool {
    at + BALL_LEAD < track.contact_time()
}

/// What all environments share.
#[derive(Debug)]
pub struct Scene {
    /// The robot.
    pub robot: Arc<Robot>,
    /// All settings.
    pub settings: LearnSettings,
    /// A follower at its start.
    follower: Follower,
    /// The reference at every step of the policy, through the stand.
    ticks: Vec<Tick>,
    /// Number of them inside the window.
    clip_ticks: usize,
    links: Vec<usize>,
}

/// The reference at one instant.
#[derive(Debug)]
struct Tick {
    state: TrackState,
    links: Vec<Vector3<f64>>,
    keypoints: Vec<Vector3<f64>>,
    com: Vector3<f64>,
}

impl Scene {
    /// For `robot` after `reference`.
    ///
    /// # Errors
    /// When a setting cannot be, or robot and reference do not fit.
    pub fn new(robot: Arc<Robot>, reference: Arc<Reference>, settings: LearnSettings) -> Result<Self, LearnError> {
        settings.validate()?;
        let window = [settings.clip.from.unwrap_or(0.0), settings.clip.to.unwrap_or(reference.duration())];
        let mut track = Track::new(&robot, reference, window)?;
        let period = settings.follower.period;
        let clip_ticks = ((track.duration() / period).round() as usize).max(1);
        let stand_ticks = (settings.start.stand / period).round() as usize;
        let mut data = robot.data();
        let links: Vec<usize> = (1..robot.model().body_parentid().len()).collect();
        let mut state = TrackState::default();
        let ticks = (0..=clip_ticks + stand_ticks)
            .map(|k| {
                track.sample_into(k as f64 * period, &mut state);
                data.set_position(&state.q);
                Tick {
                    links: links.iter().map(|&link| data.link_position(link)).collect(),
                    keypoints: robot.landmarks.iter().map(|(_, at)| data.point(at)).collect(),
                    com: data.com(),
                    state: state.clone(),
                }
            })
            .collect();
        let follower = Follower::new(&robot, track, settings.follower.clone());
        Ok(Self { robot, settings, follower, ticks, clip_ticks, links })
    }

    /// The follower, at its start.
    #[must_use]
    pub fn follower(&self) -> &Follower {
        &self.follower
    }

    /// Number of policy steps inside the window: where episodes can start.
    #[must_use]
    pub fn clip_ticks(&self) -> usize {
        self.clip_ticks
    }

    /// Constants of the training's worlds.
    #[must_use]
    pub fn world_settings(&self) -> WorldSettings {
        let default = StepSettings::default();
        let far = self.settings.world.step;
        let per_far = (far / default.near).round().max(1.0);
        WorldSettings {
            step: StepSettings { tick: far, far, near: far / per_far, ..default },
            sensors: self.settings.world.sensors,
            drives: self.settings.world.drives,
            senses: self.settings.world.senses,
            ..WorldSettings::default()
        }
    }

    /// A world of the training, drawn from `rng` as far as they differ.
    ///
    /// # Errors
    /// When it cannot be made.
    pub fn world(&self, rng: &mut ChaCha8Rng) -> Result<World, LearnError> {
        let mut settings = self.world_settings();
        self.settings.world.spread.draw(&mut settings, rng);
        let mut world = World::new(Arc::clone(&self.robot), &settings)?;
        world.make_cheap(self.settings.world.solver_iterations, self.settings.world.solver_tolerance);
        Ok(world)
    }

    /// How far a robot at `q`, `v` is from the reference at `tick`; `data` is scratch space.
    #[must_use]
    pub fn deviation(&self, tick: usize, q: &[f64], v: &[f64], data: &mut RobotData) -> Deviation {
        let tick = &self.ticks[tick.min(self.ticks.len() - 1)];
        data.set_position(q);
        let norm = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
        let mut deviation = Deviation {
            joints: norm(&q[7..], &tick.state.q[7..]),
            joint_speeds: norm(&v[6..], &tick.state.v[6..]),
            com: (data.com() - tick.com).norm(),
            keypoints: self
                .robot
                .landmarks
                .iter()
                .zip(&tick.keypoints)
                .map(|((_, at), reference)| (data.point(at) - reference).norm())
                .sum(),
            ..Deviation::default()
        };
        for (&link, reference) in self.links.iter().zip(&tick.links) {
            let distance = (data.link_position(link) - reference).norm();
            deviation.links += distance / self.links.len() as f64;
            if distance > deviation.farthest.0 {
                deviation.farthest = (distance, link);
            }
        }
        deviation
    }

    /// The part of the kick at `tick`, as the table of ends counts it.
    #[must_use]
    pub fn part(&self, tick: usize) -> usize {
        let track = self.follower.track();
        part(&track.reference().phases, track.window(), tick as f64 * self.settings.follower.period)
    }
}

/// What a step brought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Its reward.
    pub reward: f64,
    /// How far from the reference it ended.
    pub deviation: Deviation,
    /// The episode's end, if this was it.
    pub end: Option<End>,
}

/// One environment.
#[derive(Debug)]
pub struct Environment {
    scene: Arc<Scene>,
    world: World,
    suite: SensorSuite,
    sensors: Sensors,
    command: JointCommand,
    follower: Follower,
    data: RobotData,
    rng: ChaCha8Rng,
    tick: usize,
    started: usize,
    with_ball: bool,
    /// When the ball was first seen to move, in policy steps.
    moving: Option<usize>,
    last_action: Vec<f32>,
    observation: Vec<f32>,
}

impl Environment {
    /// Environment number `index` of a training with `seed`, not yet started.
    ///
    /// # Errors
    /// When the world cannot be made.
    pub fn new(scene: Arc<Scene>, seed: u64, index: usize) -> Result<Self, LearnError> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(index as u64 + 1);
        let mut world = scene.world(&mut rng)?;
        let follower = scene.follower.clone();
        Ok(Self {
            suite: SensorSuite::new(&mut world, 0),
            world,
            sensors: Sensors::default(),
            command: JointCommand::zeros(scene.robot.joints.len()),
            data: scene.robot.data(),
            rng,
            tick: 0,
            started: 0,
            with_ball: false,
            moving: None,
            last_action: vec![0.0; follower.action_len()],
            observation: vec![0.0; follower.observation_len()],
            follower,
            scene,
        })
    }

    /// The generator of this environment's random numbers.
    pub fn rng(&mut self) -> &mut ChaCha8Rng {
        &mut self.rng
    }

    /// What the policy sees now.
    #[must_use]
    pub fn observation(&self) -> &[f32] {
        &self.observation
    }

    /// Where in the clip the episode started, in policy steps.
    #[must_use]
    pub fn started(&self) -> usize {
        self.started
    }

    /// Where in the clip it is, in policy steps.
    #[must_use]
    pub fn tick(&self) -> usize {
        self.tick
    }

    /// Starts an episode at `tick` of the clip.
    ///
    /// # Errors
    /// When the world refuses the state.
    pub fn start(&mut self, tick: usize) -> Result<(), LearnError> {
        let scene = Arc::clone(&self.scene);
        let state = &scene.ticks[tick].state;
        let (mut q, mut v) = (state.q.clone(), state.v.clone());
        scene.settings.start.disturb(&scene.robot, &mut q, &mut v, &mut self.rng);
        let at = tick as f64 * scene.settings.follower.period;
        let track = self.follower.track();
        self.with_ball = scene.settings.world.ball && before_ball(track, at);
        let ball = if self.with_ball { track.reference().ball } else { NO_BALL };
        self.world.reset(&q, &v, &BallState::at_rest(ball))?;
        let seed = self.rng.random();
        self.suite = SensorSuite::new(&mut self.world, seed);
        self.suite.sense(&self.world);
        (self.tick, self.started, self.moving) = (tick, tick, None);
        self.last_action.fill(0.0);
        // As on a robot: what is known at the start is the reference's state, not the error that was added to it.
        let (q, v) = (&state.q, &state.v);
        self.follower.start(0.0, at, Vector3::new(q[0], q[1], q[2]), Vector3::new(v[0], v[1], v[2]));
        self.look();
        Ok(())
    }

    fn look(&mut self) {
        self.suite.read_into(self.world.time(), &mut self.sensors);
        self.follower.sense(&self.sensors);
        self.follower.observe(&self.sensors, &mut self.observation);
    }

    /// One step of the policy with `action`; (39) ends the episode at the distance `threshold` (m).
    pub fn step(&mut self, action: &[f32], threshold: f64) -> Step {
        let scene = Arc::clone(&self.scene);
        let settings = &scene.settings;
        self.follower.act(action);
        let substeps = (settings.follower.period / settings.world.step).round() as usize;
        let weights = &settings.reward;
        let mut excess: f64 = 0.0;
        for k in 0..substeps {
            if k > 0 {
                self.suite.read_into(self.world.time(), &mut self.sensors);
                self.follower.sense(&self.sensors);
            }
            self.follower.command(self.sensors.time, &mut self.command);
            if self.world.advance(&self.command, None).is_err() {
                return Step { reward: 0.0, deviation: Deviation::default(), end: Some(End::Diverged) };
            }
            self.suite.sense(&self.world);
            excess = excess.max(reward::excess_speed(&scene.robot.joints, &self.world.v()[6..], weights.limit_from));
        }
        self.tick += 1;
        self.look();
        let deviation = scene.deviation(self.tick, self.world.q(), self.world.v(), &mut self.data);
        let mut reward = reward::imitation(weights, &deviation);
        let n = action.len().max(1) as f64;
        let square = |x: f32| f64::from(x) * f64::from(x);
        let action = self.follower.action();
        let rate: f64 = action.iter().zip(&self.last_action).map(|(a, b)| square(a - b)).sum();
        reward -= weights.w_rate * rate / n;
        reward -= weights.w_action * action.iter().map(|&a| square(a)).sum::<f64>() / n;
        reward -= weights.w_limit * excess;
        self.last_action.copy_from_slice(action);
        if self.with_ball && weights.w_ball > 0.0 {
            let velocity = Vector3::from(self.world.ball().velocity);
            // A contact is over within the step after the one in which the ball was first seen to move.
            if self.moving == Some(self.tick - 1) {
                reward += reward::ball(weights, &velocity, &Vector3::x());
            }
            if velocity.norm() > KICKED {
                self.moving = self.moving.or(Some(self.tick));
            }
        }
        let ret = settings.termination.ret;
        let end = if ret && deviation.farthest.0 > threshold {
            Some(End::Link(deviation.farthest.1))
        } else if ret && has_fallen(&self.world) {
            Some(End::Fell)
        } else {
            (self.tick + 1 >= scene.ticks.len()).then_some(End::Completed)
        };
        Step { reward, deviation, end }
    }
}
