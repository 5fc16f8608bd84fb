//! A player's connection: joins, answers every message, joins again when the line is dead, goes in order when it is told to.
//!
//! The server is never kept waiting: every message gets an answer, and when more than one lies there already the older ones get an
//! empty one and are counted as late.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use instep_player::Record;
use serde::Serialize;

use crate::agent::Agent;
use crate::framing::{Inbox, TooLong, frame};
use crate::model::CYCLE;
use crate::{RcssError, agent};

/// A server that says nothing for this long is dead; on a busy machine it is silent while it takes others in.
const SILENCE: Duration = Duration::from_secs(30);
/// But this long while it takes a player in: it builds its whole world anew.
const PATIENT: Duration = Duration::from_secs(60);
/// How often a stop is looked for while nothing comes.
const GLANCE: Duration = Duration::from_millis(200);
/// For a connection, and before the first and the later tries to get another.
const CONNECT: Duration = Duration::from_secs(2);
const PAUSES: [Duration; 2] = [Duration::from_millis(300), Duration::from_secs(3)];
/// Before joining: a server that was just started dies of a player who comes before its first cycle (0.2.1).
const SETTLE: Duration = Duration::from_secs(1);
/// Tries to join before a refusal is believed: after a restart the old player may still be there.
const TRIES: u32 = 4;
/// Messages that are none before the other end is no server of this kind.
const MOST_MALFORMED: u64 = 50;

/// Where and how long to play.
#[derive(Debug, Clone)]
pub struct Setup {
    /// The server's host.
    pub host: String,
    /// Its port for players.
    pub port: u16,
    /// Stop after this much of the server's time, s.
    pub duration: Option<f64>,
    /// How long to look for the first server, s.
    pub patience: f64,
    /// Time between two records, s of the server's time; `None`: none are kept.
    pub record: Option<f64>,
}

/// What came of it.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Tally {
    /// Shirt number.
    pub number: u8,
    /// Messages answered.
    pub cycles: u64,
    /// Of these, how many came too late: answered later than a cycle after they came, or with a newer one there already.
    pub late_cycles: u64,
    /// Goals of the own team, as last told.
    pub goals: u32,
    /// Goals of the other team.
    pub goals_against: u32,
    /// Falls.
    pub fell: u64,
    /// How often the line was dead and another was found.
    pub reconnects: u64,
    /// Messages that were none, or lacked something.
    pub malformed: u64,
    /// Longest time from a message to its answer, ms.
    pub longest_ms: f64,
    /// Mean of it, ms.
    pub mean_ms: f64,
    /// What the player believed and did.
    #[serde(skip)]
    pub records: Vec<Kept>,
}

/// A record beside the pose that the server told at the time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Kept {
    /// What the player believed and did.
    #[serde(flatten)]
    pub record: Record,
    /// The pose by landmarks and odometry alone.
    pub by_landmarks: instep_field::Pose,
    /// The pose that the server told.
    pub told: instep_field::Pose,
    /// Play mode.
    pub mode: String,
}

/// How a connection ended.
enum End {
    /// Told to stop, or the time is over.
    Stopped,
    /// The server closed before it told anything.
    Refused,
    /// The line is dead: why.
    Lost(String),
}

/// A player's connection.
pub struct Client<'a> {
    setup: &'a Setup,
    agent: Agent,
    tally: Tally,
    say: &'a (dyn Fn(String) + Sync),
    began: Option<f64>,
    recorded: f64,
    bytes: Vec<u8>,
}

impl<'a> Client<'a> {
    /// For `agent`, number `number`; `say` is told what people should know.
    pub fn new(setup: &'a Setup, agent: Agent, number: u8, say: &'a (dyn Fn(String) + Sync)) -> Self {
        let tally = Tally { number, ..Tally::default() };
        Self { setup, agent, tally, say, began: None, recorded: f64::NEG_INFINITY, bytes: Vec::new() }
    }

    fn address(&self) -> String {
        format!("{}:{}", self.setup.host, self.setup.port)
    }

    /// Plays until `stop` is raised or the time is over. `again` makes the agent anew for another connection.
    ///
    /// # Errors
    /// When there is no server, it refuses this player, or what it sends is nothing that can be understood.
    pub fn run(mut self, stop: &AtomicBool, again: impl Fn() -> Result<Agent, RcssError>) -> Result<Tally, RcssError> {
        let (mut refused, mut strange, mut joined, mut told) = (0, 0, false, false);
        let begin = Instant::now();
        while !stop.load(Ordering::Relaxed) {
            let stream = match self.connect() {
                Ok(stream) => stream,
                Err(detail) => {
                    if !joined && begin.elapsed().as_secs_f64() > self.setup.patience {
                        return Err(RcssError::Connection { address: self.address(), detail });
                    }
                    if joined && !std::mem::replace(&mut told, true) {
                        (self.say)(format!("{}: {detail}; player {} tries again", self.address(), self.tally.number));
                    }
                    std::thread::sleep(if begin.elapsed() < CONNECT { PAUSES[0] } else { PAUSES[1] });
                    continue;
                }
            };
            let before = self.tally.cycles;
            let end = self.session(stream, stop)?;
            if self.tally.cycles > before {
                if joined {
                    (self.say)(format!("player {} plays again", self.tally.number));
                    self.tally.reconnects += 1;
                }
                (joined, refused, told) = (true, 0, false);
            }
            match end {
                End::Stopped => break,
                End::Refused => {
                    refused += 1;
                    if refused >= TRIES {
                        return Err(RcssError::Refused {
                            address: self.address(),
                            number: self.tally.number,
                            team: self.agent.team().to_owned(),
                            model: self.agent.model_name(),
                        });
                    }
                }
                End::Lost(why) => {
                    // Lines that break are a server's; lines on which nothing was ever understood are something else's.
                    strange = if self.agent.counts().understood > 0 { 0 } else { strange + 1 };
                    if strange >= TRIES {
                        let detail = format!("nothing that can be read, then: {why}");
                        return Err(RcssError::Protocol { address: self.address(), detail });
                    }
                    (self.say)(format!("{}: {why}; player {} tries again", self.address(), self.tally.number));
                    told = true;
                }
            }
            let counts = self.agent.counts();
            self.tally.fell += counts.fell;
            self.tally.malformed += counts.malformed;
            self.agent = again()?;
            std::thread::sleep(PAUSES[0]);
        }
        self.tally.fell += self.agent.counts().fell;
        self.tally.malformed += self.agent.counts().malformed;
        if self.tally.cycles > 0 {
            self.tally.mean_ms /= self.tally.cycles as f64;
        }
        Ok(self.tally)
    }

    fn connect(&self) -> Result<TcpStream, String> {
        let addresses = (self.setup.host.as_str(), self.setup.port).to_socket_addrs().map_err(|e| e.to_string())?;
        let mut last = "the name has no address".to_owned();
        for address in addresses {
            match TcpStream::connect_timeout(&address, CONNECT) {
                Ok(stream) => {
                    let ready = stream.set_nodelay(true).and_then(|()| stream.set_read_timeout(Some(GLANCE)));
                    return ready
                        .and_then(|()| stream.set_write_timeout(Some(CONNECT)))
                        .map(|()| stream)
                        .map_err(|e| e.to_string());
                }
                Err(error) => last = error.to_string(),
            }
        }
        Err(last)
    }

    /// One connection, from the first message to its end.
    fn session(&mut self, mut stream: TcpStream, stop: &AtomicBool) -> Result<End, RcssError> {
        let mut inbox = Inbox::default();
        let (mut buffer, mut malformed) = (vec![0; 1 << 16], 0);
        let lost = |error: std::io::Error| End::Lost(error.to_string());
        std::thread::sleep(SETTLE);
        if let Err(error) = self.send(&mut stream, &self.agent.init()) {
            return Ok(lost(error));
        }
        let (mut first, mut heard) = (true, Instant::now());
        loop {
            if stop.load(Ordering::Relaxed) {
                let last = self.agent.stand_down().to_owned();
                // The line may be dead by now; the server removes the robot either way.
                let _ = self.send(&mut stream, &last);
                return Ok(End::Stopped);
            }
            match stream.read(&mut buffer) {
                Ok(0) if first => return Ok(End::Refused),
                Ok(0) => return Ok(End::Lost("the server closed the line".into())),
                Ok(count) => {
                    heard = Instant::now();
                    inbox.push(&buffer[..count]);
                }
                Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                    let silence = if first { PATIENT } else { SILENCE };
                    if heard.elapsed() > silence {
                        return Ok(End::Lost(format!("silent for {} s", silence.as_secs())));
                    }
                    continue;
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(error) if first && error.kind() == ErrorKind::ConnectionReset => return Ok(End::Refused),
                Err(error) => return Ok(lost(error)),
            }
            loop {
                let address = self.address();
                let protocol = |detail: String| RcssError::Protocol { address, detail };
                let message = match inbox.take() {
                    Ok(Some(message)) => message.to_vec(),
                    Ok(None) => break,
                    Err(TooLong(length)) => return Err(protocol(format!("a message of {length} bytes"))),
                };
                first = false;
                let late = inbox.has_next();
                let answer = if late {
                    self.tally.cycles += 1;
                    self.tally.late_cycles += 1;
                    Agent::nothing().to_owned()
                } else {
                    match self.agent.answer(&message) {
                        Ok(answer) => answer.to_owned(),
                        Err(why) => {
                            malformed += 1;
                            if malformed > MOST_MALFORMED {
                                return Err(protocol(format!("message after message that cannot be read ({why:?})")));
                            }
                            Agent::nothing().to_owned()
                        }
                    }
                };
                if let Err(error) = self.send(&mut stream, &answer) {
                    return Ok(lost(error));
                }
                if !late {
                    self.count(heard.elapsed().as_secs_f64());
                }
                if self.is_over() {
                    let last = self.agent.stand_down().to_owned();
                    let _ = self.send(&mut stream, &last);
                    return Ok(End::Stopped);
                }
            }
        }
    }

    fn send(&mut self, stream: &mut TcpStream, message: &str) -> std::io::Result<()> {
        frame(message.as_bytes(), &mut self.bytes);
        stream.write_all(&self.bytes)
    }

    fn count(&mut self, took: f64) {
        let agent::Counts { score, .. } = self.agent.counts();
        let tally = &mut self.tally;
        tally.cycles += 1;
        tally.late_cycles += u64::from(took > CYCLE);
        tally.longest_ms = tally.longest_ms.max(1e3 * took);
        tally.mean_ms += 1e3 * took;
        [tally.goals, tally.goals_against] = score;
        let record = self.agent.player().record();
        if let Some(period) = self.setup.record
            && record.time - self.recorded >= period - 1e-9
        {
            self.recorded = record.time;
            let by_landmarks = self.agent.player().place().by_landmarks();
            let (told, mode) = (self.agent.told_pose(), self.agent.mode().to_owned());
            self.tally.records.push(Kept { record, by_landmarks, told, mode });
        }
    }

    fn is_over(&mut self) -> bool {
        let Some(duration) = self.setup.duration else { return false };
        let time = self.agent.time();
        time - *self.began.get_or_insert(time) >= duration
    }
}
