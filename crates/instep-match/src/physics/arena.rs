//! The world with its players: everybody is asked, the world goes on by a tick, everybody senses and looks.
//!
//! Players are asked side by side on as many threads as there are; each has its own chance, and what they say is heard a tick
//! later, so the number of threads changes nothing.

use std::sync::Arc;

use arrayvec::ArrayVec;
use instep_field::{Field, Pose};
use instep_localisation::Map;
use instep_robot::control::JointCommand;
use instep_sim::settings::{Ball as SimBall, Fidelity, Step, WorldSettings};
use instep_sim::{BallState, Entrant, World};
use nalgebra::{UnitQuaternion, Vector3};
use rayon::prelude::*;

use super::eyes::Other;
use super::seat::{Guest, Seat, pose};
use crate::MatchError;
use crate::referee::MOST_ROBOTS;
use crate::settings::SightSettings;

/// A torque drive's period and the world's step, s.
const TICK: f64 = 0.001;
/// Ticks between two looks of a camera's keeper: frames are rarer.
const LOOK_EVERY: u64 = 10;

/// The world with its players.
#[derive(Debug)]
pub(super) struct Arena {
    pub world: World,
    pub seats: Vec<Seat>,
    commands: Vec<JointCommand>,
    tick: u64,
    /// Robots that touched the ball since this was last cleared.
    pub on_ball: ArrayVec<usize, MOST_ROBOTS>,
    /// Pairs that touched each other since this was last cleared.
    pub met: ArrayVec<(usize, usize), 64>,
}

impl Arena {
    /// `entrants` on `field`; those with a guest play, the others stand where they are.
    pub(super) fn new(
        field: &Arc<Field>,
        entrants: Vec<(Entrant, Option<Guest>)>,
        sight: &SightSettings,
    ) -> Result<Self, MatchError> {
        let settings = WorldSettings {
            drives: Fidelity::AsBuilt,
            senses: Fidelity::AsBuilt,
            step: Step { tick: TICK, far: TICK, ..Step::default() },
            ball: SimBall { mass: field.ball.mass, radius: field.ball.radius, ..SimBall::default() },
            ..WorldSettings::default()
        };
        let (entrants, guests): (Vec<Entrant>, Vec<Option<Guest>>) = entrants.into_iter().unzip();
        let mut world = World::on_field(Arc::clone(field), &entrants, &settings)?;
        let map = Arc::new(Map::new(field, true)?);
        let commands = entrants.iter().map(|entrant| stand(&entrant.robot)).collect();
        let mut seats = Vec::new();
        for (index, guest) in guests.into_iter().enumerate() {
            if let Some(guest) = guest {
                seats.push(Seat::new(&mut world, index, guest, &map, sight)?);
            }
        }
        Ok(Self { world, seats, commands, tick: 0, on_ball: ArrayVec::new(), met: ArrayVec::new() })
    }

    /// s.
    pub(super) fn time(&self) -> f64 {
        self.world.time()
    }

    /// One tick of the world.
    pub(super) fn advance(&mut self) -> Result<(), MatchError> {
        let (tick, time) = (self.tick, self.world.time());
        match &mut self.seats[..] {
            [seat] => seat.act(tick, time, &mut self.commands[seat.index]),
            seats => {
                let mut commands: ArrayVec<_, MOST_ROBOTS> = self.commands.iter_mut().map(Some).collect();
                let turns: Vec<_> =
                    seats.iter_mut().filter_map(|seat| Some((commands[seat.index].take()?, seat))).collect();
                turns.into_par_iter().for_each(|(command, seat)| seat.act(tick, time, command));
            }
        }
        self.pass_messages();
        self.world.advance_all(&self.commands, None)?;
        self.tick += 1;
        for robot in self.world.robots_on_ball() {
            if !self.on_ball.contains(&robot) {
                self.on_ball.push(robot);
            }
        }
        for [a, b] in self.world.robots_touching() {
            if !self.met.contains(&(a, b)) {
                // As many as fit: more than 64 at once cannot be.
                let _ = self.met.try_push((a, b));
            }
        }
        for seat in &mut self.seats {
            seat.sense(&self.world);
        }
        if self.tick.is_multiple_of(LOOK_EVERY) {
            self.look();
        }
        Ok(())
    }

    fn pass_messages(&mut self) {
        for i in 0..self.seats.len() {
            let Some(message) = self.seats[i].said.take() else { continue };
            let (team, number) = (self.seats[i].team, self.seats[i].number);
            for seat in self.seats.iter_mut().filter(|seat| seat.team == team && seat.number != number) {
                // As many as a team has fit.
                let _ = seat.senses.heard.try_push(message);
            }
        }
    }

    fn look(&mut self) {
        let all: ArrayVec<_, MOST_ROBOTS> =
            self.world.robots().map(|view| (view.team(), pose(&view).position(), view.has_fallen())).collect();
        for seat in &mut self.seats {
            let others = all.iter().enumerate().filter(|(i, _)| *i != seat.index);
            let others = others.map(|(_, (team, position, fallen))| Other {
                position: seat.team.point(*position),
                mate: *team == seat.team,
                fallen: *fallen,
            });
            let others = others.collect();
            seat.look(&self.world, &others);
        }
        // What costs is what the network does.
        match &mut self.seats[..] {
            [seat] => seat.develop(),
            seats => seats.par_iter_mut().for_each(Seat::develop),
        }
    }

    /// Carries a robot: it stands at `to` (watcher's frame).
    pub(super) fn carry(&mut self, index: usize, to: Pose) -> Result<(), MatchError> {
        let view = self.world.on(index);
        let robot = Arc::clone(view.robot());
        let mut q = robot.stand.clone();
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), to.heading);
        let turned = turn * UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(q[3], q[4], q[5], q[6]));
        (q[0], q[1]) = (to.x, to.y);
        q[3..7].copy_from_slice(&[turned.w, turned.i, turned.j, turned.k]);
        self.world.place_robot(index, &q, &vec![0.0; robot.nv()])?;
        self.commands[index] = stand(&robot);
        Ok(())
    }

    /// Puts the ball to rest at `spot`, m.
    pub(super) fn place_ball(&mut self, spot: [f64; 2]) {
        let radius = self.world.settings().ball.radius;
        self.world.place_ball(&BallState::at_rest([spot[0], spot[1], radius]));
    }
}

fn stand(robot: &instep_robot::Robot) -> JointCommand {
    let mut command = JointCommand::zeros(robot.joints.len());
    command.positions.copy_from_slice(&robot.stand[7..]);
    command
}
