//! A cancel at any instant leads back to two feet; a hold waits and goes on. Few instants here; the benchmark's example
//! `cancels` takes a thousand.

use instep_kick::{KickEngine, KickStatus, Phase};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::rig::{Rig, request};

fn cancel_at(name: &str, share: f64) {
    let request = request(name);
    let mut rig = Rig::new(name, request.ball);
    let plan = rig.engine.plan(&request, &rig.sensors).unwrap();
    while rig.world.time() < share * plan.duration {
        rig.tick();
    }
    let phase = rig.engine.progress().phase;
    rig.engine.cancel();
    let limit = rig.world.time() + plan.duration + 1.0;
    while rig.world.time() < limit && rig.engine.progress().status != KickStatus::Cancelled {
        rig.tick();
    }
    assert_eq!(rig.engine.progress().status, KickStatus::Cancelled, "{name} at {share} ({phase:?})");
    for _ in 0..80 {
        rig.tick();
    }
    assert!(rig.stands(), "{name} cancelled at {share} of the kick ({phase:?}) does not stand: {:?}", rig.world.q());
}

#[test]
fn a_cancel_at_any_instant_leads_back_to_two_feet() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for name in ["nao", "wolfgang"] {
        for i in 0..10 {
            let share: f64 = (f64::from(i) + rng.random::<f64>()) / 10.0;
            cancel_at(name, share);
        }
    }
}

#[test]
fn a_held_foot_waits_until_it_is_released() {
    let request = instep_kick::KickRequest { hold: true, ..request("wolfgang") };
    let mut rig = Rig::new("wolfgang", request.ball);
    let plan = rig.engine.plan(&request, &rig.sensors).unwrap();
    while rig.world.time() < plan.contact + 1.0 {
        rig.tick();
    }
    let held = rig.engine.progress();
    assert_eq!((held.status, held.phase), (KickStatus::Holding, Phase::WindUp));
    let still = rig.world.ball().velocity.iter().all(|v| v.abs() < 0.01);
    assert!(still, "the ball was touched while the foot was held");
    rig.engine.release();
    for _ in 0..((plan.duration + 0.5) / rig.engine.control_period()) as usize {
        rig.tick();
    }
    assert_eq!(rig.engine.progress().status, KickStatus::Finished);
    assert!(rig.world.ball().position[0] > request.ball[0] + 0.1, "the ball was not kicked");
    assert!(rig.stands());
}
