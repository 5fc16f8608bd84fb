//! What kicks that begin with a walk share: which requests a robot can walk up to at all.

use instep_kick::{KickRequest, Refusal};

/// Farthest ball that is walked up to, m from the footprint.
const FARTHEST: f64 = 20.0;
/// A ball that rolls faster than this does not rest, m/s.
const STILL: f64 = 0.05;

/// Distance of the ball of `request` (m from the footprint), which a robot that is not `busy` may walk up to.
///
/// # Errors
/// Why it may not.
pub(crate) fn distance(request: &KickRequest, busy: bool) -> Result<f64, Refusal> {
    request.check()?;
    if busy {
        return Err(Refusal::Busy);
    }
    if request.hold {
        return Err(Refusal::CannotHold);
    }
    let rolls = request.ball_velocity[0].hypot(request.ball_velocity[1]);
    if rolls > STILL {
        return Err(Refusal::BallRolls { speed: rolls, most: STILL });
    }
    let distance = request.ball[0].hypot(request.ball[1]);
    if distance > FARTHEST {
        return Err(Refusal::TooFar { distance, reach: FARTHEST });
    }
    Ok(distance)
}
