//! Many players of a team, each with its own connection and thread.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use instep_field::Field;
use instep_player::PlayerSettings;
use instep_robot::Robot;

use crate::agent::Agent;
use crate::client::{Client, Setup, Tally};
use crate::{RcssError, model};

/// Who plays.
#[derive(Debug, Clone, Copy)]
pub struct Roster<'a> {
    /// The team's name: letters, digits, `_` and `-`.
    pub team: &'a str,
    /// Shirt numbers, from 1 to 99.
    pub numbers: &'a [u8],
}

/// Lets the `roster` play in `robot` until `stop` is raised; `say` is told what people should know. When one cannot go on all
/// stop.
///
/// # Errors
/// The first that went wrong.
pub fn play(
    setup: &Setup,
    robot: &Robot,
    field: &Arc<Field>,
    Roster { team, numbers }: Roster<'_>,
    settings: &PlayerSettings,
    stop: &AtomicBool,
    say: &(dyn Fn(String) + Sync),
) -> Result<Vec<Tally>, RcssError> {
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if team.is_empty() || team.len() > 32 || !team.chars().all(fits) {
        return Err(RcssError::Team { found: team.to_owned() });
    }
    if let Some(&number) = numbers.iter().find(|number| !(1..=99).contains(*number)) {
        return Err(RcssError::Number { found: u32::from(number) });
    }
    let model = model::named(&robot.name)?;
    let (robot, wires) = model::on_server(model, robot)?;
    let make = |number: u8| {
        let body = (model, Arc::clone(&robot), wires.clone());
        Agent::new(body, Arc::clone(field), team, number, settings.clone())
    };
    let results: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = numbers
            .iter()
            .map(|&number| {
                let make = &make;
                scope.spawn(move || {
                    let result = make(number)
                        .and_then(|agent| Client::new(setup, agent, number, say).run(stop, || make(number)));
                    if result.is_err() {
                        stop.store(true, Ordering::Relaxed);
                    }
                    result
                })
            })
            .collect();
        threads.into_iter().map(std::thread::ScopedJoinHandle::join).collect()
    });
    let mut tallies = Vec::with_capacity(results.len());
    for result in results {
        match result {
            Ok(tally) => tallies.push(tally?),
            // A thread of ours does not panic; if one did, its panic is the caller's.
            Err(panic) => std::panic::resume_unwind(panic),
        }
    }
    Ok(tallies)
}
