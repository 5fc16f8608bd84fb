//! `instep match --gamecontroller`: one game in real time that the official GameController leads over UDP; it sees every
//! player's status.

use std::net::SocketAddr;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use clap::Args;
use instep_behaviour::PlayState;
use instep_match::gamecontroller::{Control, Counters, Link, STATUS_PORT};
use instep_match::{Match as Game, MatchSettings, TeamSetup};

use super::Match;
use crate::failure::Failure;
use crate::interrupt;
use crate::output::{Output, Paint};

/// Every player tells its status so often, s (the league allows 0.5 to 2 Hz).
const STATUS_EVERY: f64 = 1.0;
/// Between two looks at the network.
const PAUSE: Duration = Duration::from_millis(5);
/// The second half is over, and nobody goes on with a shoot-out for so long, s.
const OVER: f64 = 10.0;

/// The arguments of a game that the official program leads.
#[derive(Debug, Args)]
pub(super) struct Led {
    /// Let the official GameController (version 20) lead one game in real time; listens at ADDRESS
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = "127.0.0.1:3838", conflicts_with = "physics")]
    pub(super) gamecontroller: Option<SocketAddr>,
    /// With --gamecontroller: the teams' numbers, red's and blue's
    #[arg(
        long,
        value_name = "RED,BLUE",
        value_delimiter = ',',
        num_args = 1,
        default_value = "1,2",
        requires = "gamecontroller"
    )]
    numbers: Vec<u8>,
}

impl Match {
    /// Plays until the official program ends the second half, or the user stops it.
    pub(super) fn play_led(
        &self,
        address: SocketAddr,
        settings: &Arc<MatchSettings>,
        teams: [TeamSetup; 2],
        output: &Output,
    ) -> Result<ExitCode, Failure> {
        let numbers = match self.led.numbers[..] {
            [red, blue] if red != blue => [red, blue],
            _ => return Err(Failure::input("--numbers: expected two different numbers of teams, as 12,34")),
        };
        let replay = self.replay_file()?;
        let mut link = Link::bind(address, numbers, STATUS_PORT)?;
        let names = teams.each_ref().map(|team| team.strategy.name.clone());
        let mut game = Game::new(Arc::clone(settings), teams, 0, self.seed)?;
        if replay.is_some() {
            game.record();
        }
        let listening = link.address().unwrap_or(address);
        output.remark(|_| format!("listening for a GameController at {listening}; Ctrl-C ends"));
        let stop = interrupt::stopped_by_the_user();
        let began = Instant::now();
        let (mut next_status, mut finished, mut told) = (0.0, None, String::new());
        let mut statuses: u64 = 0;
        // Without a GameController nothing begins: the game waits.
        let mut led: Option<f64> = None;
        while !stop.load(Ordering::Relaxed) {
            let now = began.elapsed().as_secs_f64();
            if let Some(control) = link.receive(now) {
                led = led.or(Some(now));
                game.obey(&control, numbers);
                tell(&control, &mut told, output);
                let over = control.state == PlayState::Finished && !control.first_half;
                finished = over.then(|| finished.unwrap_or(now));
            }
            if finished.is_some_and(|since| now - since > OVER) {
                break;
            }
            let Some(start) = led else {
                std::thread::sleep(PAUSE);
                continue;
            };
            while game.time() < now - start {
                game.step();
            }
            if now >= next_status {
                next_status = now + STATUS_EVERY;
                for status in game.statuses(numbers) {
                    link.send(&status);
                    statuses += 1;
                }
            }
            std::thread::sleep(PAUSE);
        }
        if let (Some(file), Some(recording)) = (&replay, game.take_recording()) {
            self.write_replay(file, &recording, &settings.field, [&names[0], &names[1]], output)?;
        }
        let (score, counters) = (game.result().score, link.counters);
        let object = serde_json::json!({
            "score": score,
            "simulated_s": game.time(),
            "messages": counters,
            "ignored": counters.ignored(),
            "statuses_sent": statuses,
        });
        output.show(&object, |paint| text(score, &counters, statuses, paint))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// One line whenever the state of the game changes.
fn tell(control: &Control, told: &mut String, output: &Output) {
    let [a, b] = &control.teams;
    let line = format!(
        "{:?} {:?} {:?}, kicking {}, {} {}:{} {}",
        control.phase,
        control.state,
        control.set_play,
        control.kicking.map_or_else(|| "nobody".to_owned(), |team| team.to_string()),
        a.number,
        a.score,
        b.score,
        b.number
    );
    if line != *told {
        output.remark(|paint| paint.faint(&line));
        *told = line;
    }
}

fn text([red, blue]: [u32; 2], counters: &Counters, statuses: u64, paint: Paint) -> String {
    format!(
        "{} messages of the GameController obeyed, {} ignored, {statuses} statuses sent; {}",
        counters.accepted,
        counters.ignored(),
        paint.strong(&format!("{red}:{blue}"))
    )
}
