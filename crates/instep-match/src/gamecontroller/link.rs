//! The socket that control messages come from and status goes to; what is ignored is counted.

use std::net::{IpAddr, SocketAddr, UdpSocket};

use serde::Serialize;

use super::message::{CONTROL_SIZE, Control, Refusal, Status};
use crate::MatchError;

/// After so long without a message any packet number is new, s.
const FORGOTTEN: f64 = 5.0;
/// Packets read at once: a flood cannot stop the game.
const MOST_PACKETS: usize = 64;

/// What came over the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Counters {
    /// Taken.
    pub accepted: u64,
    /// By [`Refusal`].
    pub size: u64,
    /// See [`Refusal::Header`].
    pub header: u64,
    /// See [`Refusal::Version`].
    pub version: u64,
    /// See [`Refusal::Value`].
    pub value: u64,
    /// See [`Refusal::Late`].
    pub late: u64,
    /// See [`Refusal::Teams`].
    pub teams: u64,
}

impl Counters {
    fn count(&mut self, refusal: Refusal) {
        *match refusal {
            Refusal::Size => &mut self.size,
            Refusal::Header => &mut self.header,
            Refusal::Version => &mut self.version,
            Refusal::Value => &mut self.value,
            Refusal::Late => &mut self.late,
            Refusal::Teams => &mut self.teams,
        } += 1;
    }

    /// All that were ignored.
    pub fn ignored(&self) -> u64 {
        self.size + self.header + self.version + self.value + self.late + self.teams
    }
}

/// A socket that control messages come from and status goes to.
#[derive(Debug)]
pub struct Link {
    socket: UdpSocket,
    /// Numbers of Home and Away.
    numbers: [u8; 2],
    /// Where status goes: the sender of control messages, at this port.
    status_port: u16,
    leader: Option<IpAddr>,
    last: Option<(u8, f64)>,
    /// What came.
    pub counters: Counters,
}

impl Link {
    /// Listens at `address`; `numbers` are those of Home and Away.
    ///
    /// # Errors
    /// [`MatchError::Network`] where the address cannot be listened at.
    pub fn bind(address: SocketAddr, numbers: [u8; 2], status_port: u16) -> Result<Self, MatchError> {
        let network = |source| MatchError::Network { what: format!("listening at {address}"), source };
        let socket = UdpSocket::bind(address).map_err(network)?;
        socket.set_nonblocking(true).map_err(network)?;
        Ok(Self { socket, numbers, status_port, leader: None, last: None, counters: Counters::default() })
    }

    /// Where it listens.
    pub fn address(&self) -> Option<SocketAddr> {
        self.socket.local_addr().ok()
    }

    /// The newest message since the last call; never waits. `time` is the reader's, s.
    pub fn receive(&mut self, time: f64) -> Option<Control> {
        let mut newest = None;
        // One byte more than a message: what is longer is seen to be.
        let mut buffer = [0; CONTROL_SIZE + 1];
        for _ in 0..MOST_PACKETS {
            // No more packets, or a network that fails for the moment: the game goes on.
            let Ok((size, from)) = self.socket.recv_from(&mut buffer) else { break };
            match self.judge(&buffer[..size], time) {
                Ok(control) => {
                    self.counters.accepted += 1;
                    self.leader = Some(from.ip());
                    newest = Some(control);
                }
                Err(refusal) => self.counters.count(refusal),
            }
        }
        newest
    }

    fn judge(&mut self, bytes: &[u8], time: f64) -> Result<Control, Refusal> {
        let control = Control::parse(bytes)?;
        let mut numbers = control.teams.map(|t| t.number);
        numbers.sort_unstable();
        let mut ours = self.numbers;
        ours.sort_unstable();
        if numbers != ours {
            return Err(Refusal::Teams);
        }
        if let Some((last, at)) = self.last
            && time - at < FORGOTTEN
            && (control.packet.wrapping_sub(last) as i8) <= 0
        {
            return Err(Refusal::Late);
        }
        self.last = Some((control.packet, time));
        Ok(control)
    }

    /// Sends a status to whoever leads the game; nobody to send to and a full network are no errors.
    pub fn send(&self, status: &Status) {
        if let Some(leader) = self.leader {
            let _ = self.socket.send_to(&status.bytes(), (leader, self.status_port));
        }
    }

    /// Sends a control message, where this game leads.
    pub fn broadcast(&self, control: &Control, to: SocketAddr) {
        // A listener that is not there is no error.
        let _ = self.socket.send_to(&control.bytes(), to);
    }
}
