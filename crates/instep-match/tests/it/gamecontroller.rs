//! A program that speaks the GameController's bytes over UDP leads a game: what it says is done, and it sees every
//! player's status.

use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::sync::Arc;
use std::time::{Duration, Instant};

use instep_behaviour::{PlayState, SetPlay};
use instep_match::gamecontroller::{CONTROL_SIZE, Control, Link, PlayerInfo, Status, TeamInfo};
use instep_match::{Match, MatchSettings, Status as Body};

use crate::rules::team;

const NUMBERS: [u8; 2] = [12, 34];

/// The program's side.
struct Program {
    socket: UdpSocket,
    to: SocketAddr,
    control: Control,
}

impl Program {
    fn say(&mut self, change: impl FnOnce(&mut Control)) {
        change(&mut self.control);
        self.control.packet = self.control.packet.wrapping_add(1);
        self.socket.send_to(&self.control.bytes(), self.to).unwrap();
    }
}

/// Waits until the message is there, then plays `seconds`.
fn listen_and_play(link: &mut Link, game: &mut Match, seconds: f64) {
    let patience = Instant::now() + Duration::from_secs(20);
    let control = loop {
        if let Some(control) = link.receive(game.time()) {
            break control;
        }
        assert!(Instant::now() < patience, "no message came");
        std::thread::sleep(Duration::from_millis(1));
    };
    game.obey(&control, NUMBERS);
    for _ in 0..(seconds / 0.02) as usize {
        game.step();
    }
}

#[test]
fn the_official_program_leads_a_game_and_sees_every_player() {
    let local = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
    // Its ear for statuses, and its mouth.
    let ear = UdpSocket::bind(local).unwrap();
    ear.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    let mut link = Link::bind(local, NUMBERS, ear.local_addr().unwrap().port()).unwrap();
    let team_info = |number| TeamInfo { number, keeper: 1, ..TeamInfo::default() };
    let mut program = Program {
        socket: UdpSocket::bind(local).unwrap(),
        to: link.address().unwrap(),
        control: Control {
            packet: 254,
            players: 3,
            competition: 1,
            stopped: false,
            phase: instep_behaviour::GamePhase::Normal,
            state: PlayState::Initial,
            set_play: SetPlay::None,
            first_half: true,
            kicking: Some(34),
            remaining: 600,
            secondary: 0,
            // The program may name our Away first.
            teams: [team_info(34), team_info(12)],
        },
    };
    let settings = Arc::new(MatchSettings::new("hsl-m", None).unwrap());
    let mut game = Match::new(settings, [team(), team()], 0, 5).unwrap();

    program.say(|_| ());
    listen_and_play(&mut link, &mut game, 1.0);
    program.say(|c| c.state = PlayState::Ready);
    listen_and_play(&mut link, &mut game, 30.0);
    let own_half = |r: &instep_match::Robot| if r.team == 0 { r.pose.x < 0.0 } else { r.pose.x > 0.0 };
    assert!(game.robots().iter().all(|r| own_half(r) && r.pose.y.abs() < 4.5), "nobody walked to its place");

    program.say(|c| c.state = PlayState::Set);
    listen_and_play(&mut link, &mut game, 2.0);
    program.say(|c| c.state = PlayState::Playing);
    listen_and_play(&mut link, &mut game, 8.0);
    assert!(game.tally().kicks > 0 || game.ball().position != [0.0; 2], "nobody kicked off");

    // Somebody is sent off, and only it; our referee judges nothing.
    program.say(|c| {
        c.teams[1].players[1] = PlayerInfo { penalty: 9, seconds: 45, cautions: 0 };
        c.teams[0].score = 2;
    });
    listen_and_play(&mut link, &mut game, 3.0);
    let off = |game: &Match| -> Vec<(usize, u8)> {
        let gone = game.robots().iter().filter(|r| matches!(r.status, Body::Removed { .. }));
        gone.map(|r| (r.team, r.number)).collect()
    };
    assert_eq!(off(&game), [(0, 2)]);
    assert_eq!(game.result().score, [0, 2]);

    // Noise, an old message and a team that does not play: counted, and the game goes on.
    let mut other = program.control;
    (other.packet, other.teams[0].number) = (other.packet.wrapping_add(1), 99);
    for bytes in [&b"RGme"[..], &[0; CONTROL_SIZE], &program.control.bytes(), &other.bytes()] {
        program.socket.send_to(bytes, program.to).unwrap();
    }
    program.say(|c| {
        c.teams[1].players[1] = PlayerInfo::default();
        (c.set_play, c.kicking) = (SetPlay::CornerKick, Some(12));
    });
    listen_and_play(&mut link, &mut game, 0.1);
    let counters = link.counters;
    assert_eq!((counters.size, counters.header, counters.late, counters.teams), (1, 1, 1, 1));
    assert_eq!((counters.accepted, counters.ignored()), (6, 4));
    assert_eq!(off(&game), []);
    let [x, y] = game.ball().position;
    assert!((x - 7.0).hypot(y.abs() - 4.5) < 0.2, "the corner kick is at ({x}, {y})");

    for status in game.statuses(NUMBERS) {
        link.send(&status);
    }
    let mut told: Vec<(u8, u8)> = Vec::new();
    let mut buffer = [0; 64];
    for _ in 0..6 {
        let size = ear.recv(&mut buffer).unwrap();
        let status = Status::parse(&buffer[..size]).unwrap();
        assert!(status.pose[0].abs() < 9000.0 && status.pose[1].abs() < 7000.0, "{status:?}");
        told.push((status.team, status.player));
    }
    told.sort_unstable();
    assert_eq!(told, [(12, 1), (12, 2), (12, 3), (34, 1), (34, 2), (34, 3)]);

    program.say(|c| (c.state, c.first_half, c.set_play) = (PlayState::Finished, false, SetPlay::None));
    listen_and_play(&mut link, &mut game, 0.1);
    assert_eq!(game.ball().speed(), 0.0);
}
