//! One player on the server: a message in, a message out.
//!
//! A robot that was put somewhere stands with straight legs and its arms out. It first eases into its stand; then it plays. Where
//! the server lets players be put to their places it asks for that.

use std::sync::Arc;

use arrayvec::ArrayVec;
use instep_behaviour::{Motion, PlayState};
use instep_field::{Field, Pose};
use instep_localisation::Start;
use instep_player::legs::Stage;
use instep_player::{Identity, Message, Player, PlayerSettings, Senses};
use instep_robot::Robot;
use instep_robot::control::JointCommand;

use crate::action::{self, Motor};
use crate::body::{self, Body, Cycle};
use crate::expression::{Expressions, Malformed};
use crate::model::{CYCLE, Model, Wiring};
use crate::perception::{GameNews, Perception};
use crate::speech::Code;
use crate::{RcssError, mode};

/// From where a robot was put to its stand, and the rest there, s.
const EASE: [f64; 2] = [0.6, 0.4];
/// Farther than this from its place and a player asks to be put there, m.
const AWAY: f64 = 0.4;
/// Time between two such wishes, s.
const AGAIN: f64 = 1.0;
/// Cycles between two messages of a player: with seven players one speaks every fifth cycle. The server lets the loudest
/// three of a cycle through.
const SPEAK: u64 = 35;
/// Standard deviation of where a robot was put: m, rad.
const PUT: [f64; 2] = [0.05, 0.02];

/// What it is at.
#[derive(Debug, Clone, PartialEq)]
enum Stance {
    /// Eases from these angles since then into its stand.
    Easing(f64, Vec<f64>),
    /// Plays.
    Playing,
}

/// Counts of one player.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Messages answered.
    pub cycles: u64,
    /// Messages that told what belongs to a perception.
    pub understood: u64,
    /// Messages that were none, or lacked something.
    pub malformed: u64,
    /// Falls.
    pub fell: u64,
    /// Goals of the own team and of the other, as last told.
    pub score: [u32; 2],
}

/// One player on the server.
#[derive(Debug)]
pub struct Agent {
    model: &'static Model,
    team: String,
    number: u8,
    player: Player,
    body: Body,
    code: Code,
    expressions: Expressions,
    senses: Senses,
    stance: Stance,
    stand: Vec<f64>,
    said: Option<Message>,
    beamed: f64,
    /// Where it wants to stand at the kick-off.
    wish: Option<Pose>,
    mode: String,
    reply: String,
    counts: Counts,
}

impl Agent {
    /// A player of `team` with `number`, in our `robot` as `model` is on the server (both by [`crate::model`]).
    ///
    /// # Errors
    /// When it cannot be played with.
    pub fn new(
        (model, robot, wires): (&'static Model, Arc<Robot>, Vec<Wiring>),
        field: Arc<Field>,
        team: &str,
        number: u8,
        settings: PlayerSettings,
    ) -> Result<Self, RcssError> {
        let code = Code::new(team, &field);
        let stand = robot.stand[7..].to_vec();
        let body = Body::new(Arc::clone(&robot), wires);
        let player = Player::new(robot, field, Identity { number, start: Start::Anywhere }, settings)?;
        Ok(Self {
            model,
            team: team.to_owned(),
            number,
            player,
            body,
            code,
            expressions: Expressions::default(),
            senses: Senses::default(),
            stance: Stance::Easing(0.0, stand.clone()),
            stand,
            said: None,
            beamed: f64::NEG_INFINITY,
            wish: None,
            mode: String::new(),
            reply: String::new(),
            counts: Counts::default(),
        })
    }

    /// The first message of a connection.
    #[must_use]
    pub fn init(&self) -> String {
        action::init(self.model.name, &self.team, self.number)
    }

    /// Its counts so far.
    #[must_use]
    pub fn counts(&self) -> Counts {
        Counts { fell: self.player.legs().falls(), ..self.counts }
    }

    /// Its team.
    #[must_use]
    pub fn team(&self) -> &str {
        &self.team
    }

    /// The server's name of its robot.
    #[must_use]
    pub fn model_name(&self) -> &'static str {
        self.model.name
    }

    /// The server's time at the last perception, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.body.sensors().time
    }

    /// The player.
    #[must_use]
    pub fn player(&self) -> &Player {
        &self.player
    }

    /// The pose that the server told last, own team's frame.
    #[must_use]
    pub fn told_pose(&self) -> Pose {
        self.body.pose()
    }

    /// The play mode of the last message.
    #[must_use]
    pub fn mode(&self) -> &str {
        &self.mode
    }

    /// Answers one message. What is no perception is answered too: in its sync mode the server waits for it.
    ///
    /// # Errors
    /// [`Malformed`] when the message is none; [`Self::nothing`] is to be sent then.
    pub fn answer(&mut self, message: &[u8]) -> Result<&str, Malformed> {
        self.reply.clear();
        self.counts.cycles += 1;
        let perception =
            Perception::read(message, &mut self.expressions).inspect_err(|_| self.counts.malformed += 1)?;
        if let Some(game) = &perception.game {
            self.look_at_game(game);
        }
        let under_way = match (&self.stance, self.player.legs().stage()) {
            (Stance::Playing, Stage::Stand | Stage::Walk | Stage::RunUp | Stage::Kick) => {
                self.player.legs().walker().acceleration()
            }
            _ => &[],
        };
        let cycle = self.body.take(&perception, under_way);
        self.counts.understood += u64::from(cycle != Cycle::Incomplete);
        match cycle {
            Cycle::Incomplete => self.counts.malformed += 1,
            Cycle::Carried => {
                let sensors = self.body.sensors();
                self.stance = Stance::Easing(sensors.time, sensors.joint_positions.clone());
                self.act(&perception);
            }
            Cycle::Good => self.act(&perception),
        }
        action::end(&mut self.reply);
        Ok(&self.reply)
    }

    /// A message that asks for nothing.
    #[must_use]
    pub fn nothing() -> &'static str {
        "(syn)"
    }

    /// The last message: every motor gives way softly.
    pub fn stand_down(&mut self) -> &str {
        self.reply.clear();
        let positions = &self.body.sensors().joint_positions;
        for wire in self.body.wires() {
            let motor = Motor { q: positions[wire.joint], dq: 0.0, kp: 0.0, kd: wire.kd, tau: 0.0 };
            action::motor(&mut self.reply, wire.motor, &motor);
        }
        action::end(&mut self.reply);
        &self.reply
    }

    fn look_at_game(&mut self, game: &GameNews) {
        let is = |team: &Option<String>| team.as_deref() == Some(self.team.as_str());
        self.body.set_side(is(&game.right) && !is(&game.left));
        let mut state = mode::state(game, self.body.is_right());
        if state.state != PlayState::Ready {
            self.wish = None;
        } else if self.wish.is_some_and(|wish| self.body.pose().distance(&wish) < AWAY) {
            // At its place nobody moves any more.
            state.state = PlayState::Set;
        }
        self.counts.score = state.score;
        self.senses.game = state;
        self.mode.clone_from(&game.mode);
    }

    fn act(&mut self, perception: &Perception) {
        let time = self.body.sensors().time;
        if let Some(picture) = &perception.picture {
            self.senses.sights = Some(self.body.see(picture, &self.team, self.number));
        }
        self.senses.heard =
            perception.heard.iter().filter_map(|bytes| self.code.read(bytes)).take(11).collect::<ArrayVec<_, 11>>();
        if let Stance::Easing(since, from) = &self.stance {
            let passed = time - since;
            let share = (passed / EASE[0]).clamp(0.0, 1.0);
            let share = share * share * (3.0 - 2.0 * share);
            let mut command = JointCommand::zeros(self.stand.len());
            for ((position, from), to) in command.positions.iter_mut().zip(from).zip(&self.stand) {
                *position = from + share * (to - from);
            }
            self.motors(&command);
            if passed >= EASE[0] + EASE[1] {
                let [position_sigma, heading_sigma] = PUT;
                self.player.restart(Start::Near { pose: self.body.pose(), position_sigma, heading_sigma });
                self.stance = Stance::Playing;
            }
            return;
        }
        self.senses.body.copy_from(self.body.sensors());
        self.senses.fix = Some(self.body.fix());
        self.senses.state = Some(self.body.ahead().clone());
        let output = self.player.tick(&self.senses);
        if output.say.is_some() {
            self.said = output.say;
        }
        let mut command = output.command.clone();
        if !matches!(self.player.legs().stage(), Stage::Down | Stage::Safe) {
            body::lead(&mut command, self.player.legs().walker().acceleration());
        }
        self.motors(&command);
        self.beam(time);
        self.speak(time);
    }

    fn motors(&mut self, command: &JointCommand) {
        for wire in self.body.wires() {
            let j = wire.joint;
            let (q, dq, tau) = (command.positions[j], command.velocities[j], command.torques[j]);
            action::motor(&mut self.reply, wire.motor, &Motor { q, dq, kp: wire.kp, kd: wire.kd, tau });
        }
    }

    /// Asks to be put to where the decision wants to stand, where the server lets it.
    fn beam(&mut self, time: f64) {
        if !mode::may_beam(&self.mode) || self.senses.game.state != PlayState::Ready || time - self.beamed < AGAIN {
            return;
        }
        let Some(Motion::Walk { pose, .. }) = self.player.decision().map(|decision| decision.motion) else { return };
        self.wish = Some(pose);
        if self.body.pose().distance(&pose) > AWAY {
            self.beamed = time;
            action::beam(&mut self.reply, &pose, self.body.is_right());
        }
    }

    /// Says what there is to say, when it is this number's turn.
    fn speak(&mut self, time: f64) {
        let cycle = (time / CYCLE).round().max(0.0) as u64;
        if cycle % SPEAK != u64::from(self.number) * 5 % SPEAK {
            return;
        }
        if let Some(message) = self.said.take() {
            action::say(&mut self.reply, self.model.speaker, &self.code.write(&message));
        }
    }
}
