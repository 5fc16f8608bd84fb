//! Contacts and phases of the synthetic kick, whose truth is known.

use instep_motion::MotionError;
use instep_motion::asf;
use instep_motion::clip::Clip;
use instep_motion::contact::{self, ContactSchedule, ContactSettings};
use instep_motion::landmark::Landmarks;
use instep_motion::phase::{KickPhases, KickSettings, SMOOTHING, Side, find_kick, kick_direction, peak_speeds};

use crate::synthetic::{IMPACT, PLANT, RATE, data};

fn clip() -> Clip {
    asf::load_clip(&data("kick.asf"), &data("kick_01.amc"), RATE).unwrap()
}

fn analyse(clip: &Clip) -> (Landmarks, ContactSchedule, Result<KickPhases, MotionError>) {
    let landmarks = Landmarks::find(&clip.skeleton).unwrap().calibrated(clip);
    let contacts = contact::detect(clip, &landmarks, &ContactSettings::default()).unwrap();
    let phases = find_kick(clip, &landmarks, &contacts, &KickSettings::default());
    (landmarks, contacts, phases)
}

#[test]
fn phases_of_the_synthetic_kick() {
    let clip = clip();
    let (landmarks, contacts, phases) = analyse(&clip);
    let phases = phases.unwrap();
    phases.validate().unwrap();
    assert_eq!(phases.kick_foot, Side::Right);
    assert!((phases.t_impact - IMPACT).abs() < 0.04, "{phases:?}");
    assert!((phases.t_plant - PLANT).abs() < 0.06, "{phases:?}");
    assert!((0.33..0.45).contains(&phases.t_swing), "{phases:?}");
    assert!((contacts.ground - 0.03).abs() < 1e-3, "{}", contacts.ground);
    let peak = peak_speeds(&clip, &landmarks, &phases, SMOOTHING);
    assert!(peak.ankle < peak.ball && peak.ball < peak.toe_tip, "{peak:?}");
    // The player looks 0.4 rad to the left and swings about the hip, a little outward.
    let direction = kick_direction(&clip, &landmarks, &phases).unwrap();
    assert!((direction.y.atan2(direction.x) - 0.4).abs() < 0.35 && direction.z == 0.0, "{direction}");
}

#[test]
fn contacts_of_the_synthetic_kick() {
    let clip = clip();
    let (_, contacts, _) = analyse(&clip);
    let left = contacts.foot(Side::Left);
    assert_eq!(left.stances.len(), 1);
    assert_eq!(left.stances[0].end, clip.frames.len() - 1);
    let right = contacts.foot(Side::Right);
    assert_eq!(right.stances.len(), 1);
    assert_eq!(right.stances[0].start, 0);
    assert!(clip.time(right.stances[0].end) < 0.3);
    assert!(right.stance_at(0).is_some() && right.stance_at(40).is_none());
}

#[test]
fn a_clip_without_a_kick_says_so() {
    let kick = clip();
    let no_kick = |clip: &Clip, why: &str| {
        let error = analyse(clip).2.unwrap_err();
        assert!(matches!(error, MotionError::NoKick { .. }) && error.to_string().contains(why), "{error}");
    };
    // Standing still.
    let still = Clip { frames: vec![kick.frames[47].clone(); 48], ..kick.clone() };
    no_kick(&still, "which is slow; a kick has 3 m/s at least");
    // One frame only.
    no_kick(&Clip { frames: vec![kick.frames[0].clone()], ..kick.clone() }, "which is slow");
    // The same swing twice: neither stands out.
    let twice = Clip { frames: [&kick.frames[..], &kick.frames[..]].concat(), ..kick.clone() };
    no_kick(&twice, "no more than 1.00 times the next fastest foot motion; a kick has 1.15 times at least");
}

#[test]
fn a_kick_in_the_air_has_no_stance() {
    let mut clip = clip();
    // Lifted from the plant on, so that the ground is still where the right foot stood.
    for (i, frame) in clip.frames.iter_mut().enumerate().skip(8) {
        frame.root.z += 2.0 * (i - 8) as f64 / RATE;
    }
    let error = analyse(&clip).2.unwrap_err();
    assert!(matches!(error, MotionError::NoStance { side: Side::Left, .. }), "{error}");
}

#[test]
fn a_schedule_of_another_clip_is_refused() {
    let clip = clip();
    let (landmarks, mut contacts, _) = analyse(&clip);
    contacts.feet[0].stance.pop();
    let error = find_kick(&clip, &landmarks, &contacts, &KickSettings::default()).unwrap_err();
    assert!(error.to_string().starts_with("contacts: 47 frames; expected 48"), "{error}");
}

#[test]
fn phases_out_of_order_are_refused() {
    let good = analyse(&clip()).2.unwrap();
    for bad in [
        KickPhases { t_plant: 1.0, ..good },
        KickPhases { t_swing: 0.6, ..good },
        KickPhases { t_lock: f64::NAN, ..good },
        KickPhases { t_impact: f64::INFINITY, ..good },
    ] {
        assert!(bad.validate().is_err(), "{bad:?}");
    }
}
