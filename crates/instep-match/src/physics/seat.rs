//! One player in its body: the sensors of its robot, its eyes, and the period at which it is asked.

use std::sync::Arc;

use arrayvec::ArrayVec;
use instep_behaviour::GameState;
use instep_field::{Pose, Side};
use instep_localisation::{Map, Start};
use instep_player::{Identity, Message, Player, PlayerSettings, Senses};
use instep_robot::control::JointCommand;
use instep_sim::sensors::SensorSuite;
use instep_sim::{View, World};

use super::Sight;
use super::camera::Lens;
use super::eyes::{Eyes, Other};
use crate::MatchError;
use crate::settings::SightSettings;

/// One player in its body.
#[derive(Debug)]
pub struct Seat {
    /// Its team.
    pub team: Side,
    /// Its number.
    pub number: u8,
    /// The player.
    pub player: Player,
    /// Its robot in the world.
    pub(super) index: usize,
    suite: SensorSuite,
    eyes: Vision,
    pub(super) senses: Senses,
    /// Ticks of the world from one of the player's to the next.
    every: u64,
    pub(super) said: Option<Message>,
}

/// What a seat sees with.
#[derive(Debug)]
enum Vision {
    Camera(Box<Lens>),
    Simulated(Box<Eyes>),
}

/// Who is to be seated.
#[derive(Debug, Clone)]
pub(super) struct Guest {
    pub team: Side,
    pub number: u8,
    /// What it knows of its place, in its team's frame.
    pub start: Start,
    pub settings: PlayerSettings,
    pub sight: Sight,
    pub seed: u64,
}

impl Seat {
    pub(super) fn new(
        world: &mut World,
        index: usize,
        guest: Guest,
        map: &Arc<Map>,
        sight: &SightSettings,
    ) -> Result<Self, MatchError> {
        let robot = Arc::clone(world.on(index).robot());
        let Some(camera) = robot.camera else {
            let found = format!("{} has none", robot.name);
            return Err(MatchError::Value { what: "camera", found, expected: "a robot with [senses.camera]".into() });
        };
        let Some(field) = world.field().cloned() else {
            let found = "a world without one".into();
            return Err(MatchError::Value { what: "field", found, expected: "a field".into() });
        };
        let every = (robot.drives.period / world.settings().step.tick).round().max(1.0) as u64;
        let eyes = match guest.sight {
            Sight::Camera => Vision::Camera(Box::new(Lens::new(world, index, camera, guest.seed)?)),
            Sight::Simulated => Vision::Simulated(Box::new(Eyes::new(camera, Arc::clone(map), sight, guest.seed))),
        };
        let identity = Identity { number: guest.number, start: guest.start };
        let mut seat = Self {
            team: guest.team,
            number: guest.number,
            player: Player::new(robot, field, identity, guest.settings)?,
            index,
            suite: SensorSuite::of(world, index, guest.seed),
            eyes,
            senses: Senses::default(),
            every,
            said: None,
        };
        seat.suite.sense(world);
        Ok(seat)
    }

    /// Asks the player, if it is its turn.
    pub(super) fn act(&mut self, tick: u64, time: f64, command: &mut JointCommand) {
        self.said = None;
        if !tick.is_multiple_of(self.every) {
            return;
        }
        self.suite.read_into(time, &mut self.senses.body);
        let output = self.player.tick(&self.senses);
        command.positions.copy_from_slice(&output.command.positions);
        command.velocities.copy_from_slice(&output.command.velocities);
        command.torques.copy_from_slice(&output.command.torques);
        self.said = output.say;
        self.senses.heard.clear();
    }

    /// Reads the sensors after a tick.
    pub(super) fn sense(&mut self, world: &World) {
        self.suite.sense(world);
    }

    /// Looks: `others` are in the player's team's frame.
    pub(super) fn look(&mut self, world: &World, others: &ArrayVec<Other, { crate::referee::MOST_ROBOTS }>) {
        let view = world.on(self.index);
        let sights = match &mut self.eyes {
            Vision::Camera(lens) => {
                lens.take(world, self.index, &self.senses.body);
                lens.arrived(view.time())
            }
            Vision::Simulated(eyes) => {
                eyes.be_at(&view, self.team.pose(&pose(&view)));
                eyes.frame(view.time(), self.suite.ball_sights().and_then(<[_]>::last), others)
            }
        };
        if sights.is_some() {
            self.senses.sights = sights;
        }
    }

    /// Looks at the frame that was taken, if one was.
    pub(super) fn develop(&mut self) {
        if let Vision::Camera(lens) = &mut self.eyes {
            lens.develop();
        }
    }

    /// The game, as its team sees it.
    pub(super) fn tell(&mut self, game: GameState) {
        self.senses.game = game;
    }

    /// It was carried and knows roughly where to.
    pub(super) fn restart(&mut self, world: &World, start: Start) {
        self.suite.carried();
        self.suite.sense(world);
        self.player.restart(start);
    }
}

/// Where a robot is, in the watcher's frame.
pub(super) fn pose(view: &View<'_>) -> Pose {
    let heading = view.heading();
    Pose::new(heading.translation.x, heading.translation.y, heading.rotation.euler_angles().2)
}
