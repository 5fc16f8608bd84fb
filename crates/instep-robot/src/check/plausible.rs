//! A robot that loads: does it make sense? Each check says what was measured, and against which bound.

use instep_motion::phase::Side;
use nalgebra::{Vector2, Vector3};

use super::outline::effective_inertias;
use super::{CheckReport, Findings, Kind};
use crate::{Joint, Leg, Robot, RobotData};

/// Control step that drive gains must be stable at, s.
const STEP: f64 = 0.002;
/// Contact points this close to the lowest one bear weight in the standing pose, m.
const FLAT: f64 = 0.003;

pub(crate) fn check(robot: &Robot) -> CheckReport {
    let mut findings = Findings::default();
    let data = robot.data();
    inventory(robot, &mut findings);
    standing(robot, &data, &mut findings);
    feet(robot, &data, &mut findings);
    sides(robot, &mut findings);
    gains(robot, &mut findings);
    findings.report(Kind::Robot, robot.name.clone(), None)
}

fn inventory(robot: &Robot, findings: &mut Findings) {
    findings.found("title", robot.title.clone());
    findings.found("model", robot.model_file().display().to_string());
    findings.found("mass", format!("{:.3} kg in all", robot.mass()));
    findings.found("base link", format!("\"{}\"", robot.link_name(robot.base)));
    let groups = robot.groups.iter().enumerate().map(|(g, name)| {
        let of_group: Vec<&Joint> = robot.joints.iter().filter(|joint| joint.group == g).collect();
        let torque = of_group.iter().map(|joint| joint.torque).fold(0.0, f64::max);
        let speed = of_group.iter().map(|joint| joint.speed).fold(0.0, f64::max);
        format!("{name} ({} x {torque} N m, {speed} rad/s)", of_group.len())
    });
    let groups: Vec<String> = groups.collect();
    findings.found("joints", format!("{} in groups: {}", robot.joints.len(), groups.join(", ")));
    for (word, leg) in ["left", "right"].into_iter().zip(&robot.legs) {
        let joints: Vec<&str> = leg.joints().map(|joint| robot.joints[joint].name.as_str()).collect();
        findings.found("leg", format!("{word}: {}, sole on \"{}\"", joints.join(", "), robot.link_name(leg.foot)));
        if leg.strike.is_empty() {
            findings.missing("strike geoms", format!("leg.{word}.strike is empty: nothing may strike the ball"));
        }
        let strays: Vec<&str> = robot
            .contacts
            .iter()
            .filter(|c| robot.leg(c.leg).foot == leg.foot && c.at.link != leg.foot && Some(c.at.link) != leg.toe_link)
            .map(|c| c.name.as_str())
            .collect();
        if !strays.is_empty() {
            findings.missing("contact points", format!("{word}: not on foot or toe: {}", strays.join(", ")));
        }
    }
    findings.found("contact points", robot.contacts.len().to_string());
    findings.found("self-collision", format!("{} pairs", robot.self_collision.len()));
    findings.found("landmarks", robot.landmarks.len().to_string());
    let needed = ["hip", "knee", "ankle"].iter().flat_map(|part| [format!("left_{part}"), format!("right_{part}")]);
    let lacking: Vec<String> =
        std::iter::once("pelvis".to_owned()).chain(needed).filter(|name| robot.landmark(name).is_none()).collect();
    if !lacking.is_empty() {
        findings.doubtful("landmarks", format!("retargeting wants {}", lacking.join(", ")));
    }
    for equality in 0..robot.model().eq_type().len() {
        let name = robot.model().id_to_name(mujoco_rs::prelude::MjtObjBase::mjOBJ_EQUALITY, equality);
        findings.found(
            "equality",
            format!("the model couples parts by \"{}\"; kinematics here do not see it", name.unwrap_or("")),
        );
    }
}

/// The standing pose: is the centre of mass over the feet?
fn standing(robot: &Robot, data: &RobotData, findings: &mut Findings) {
    let com = data.com();
    let height = data.link_position(robot.base).z;
    findings.found("stand", format!("base {height:.3} m, centre of mass {:.3} m above the ground", com.z));
    for side in [Side::Left, Side::Right] {
        let bearing = robot.contacts.iter().filter(|contact| contact.leg == side);
        let (count, rolls) = (bearing.count(), robot.leg(side).ankle_roll.is_none());
        if count < 3 && !rolls {
            findings.doubtful("contact points", format!("{side:?}: {count}; a foot rolls over fewer than three"));
        } else if rolls {
            findings.found("contact points", format!("{side:?}: no ankle roll; the foot rolls, which walking can do"));
        }
    }
    let bearing: Vec<Vector2<f64>> = robot
        .contacts
        .iter()
        .map(|contact| (data.point(&contact.at), contact.radius))
        .filter(|(point, radius)| point.z - radius < FLAT)
        .map(|(point, _)| point.xy())
        .collect();
    match margin(&bearing, com.xy()) {
        Some(margin) if margin > 0.0 => {
            findings
                .found("stand", format!("statically stable: centre of mass {:.1} mm inside the support", 1e3 * margin));
        }
        Some(margin) => findings.missing(
            "stand",
            format!(
                "falls over: centre of mass {:.1} mm outside the support; change the angles in [stand]",
                -1e3 * margin
            ),
        ),
        None => findings.missing("stand", "fewer than three contact points touch the ground in the pose of [stand]"),
    }
}

/// How far `point` lies inside the convex hull of `points` (m, negative outside); `None` for fewer than three points
/// or points on a line.
fn margin(points: &[Vector2<f64>], point: Vector2<f64>) -> Option<f64> {
    let hull = hull(points)?;
    let edges = hull.iter().zip(hull.iter().cycle().skip(1));
    edges.map(|(a, b)| (b - a).perp(&(point - a)) / (b - a).norm()).min_by(f64::total_cmp)
}

/// Convex hull, counter-clockwise (Andrew's monotone chain).
fn hull(points: &[Vector2<f64>]) -> Option<Vec<Vector2<f64>>> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let half = |order: &mut dyn Iterator<Item = &Vector2<f64>>| {
        let mut chain: Vec<Vector2<f64>> = Vec::new();
        for p in order {
            while let [.., a, b] = chain.as_slice()
                && (b - a).perp(&(p - a)) <= 1e-12
            {
                chain.pop();
            }
            chain.push(*p);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut sorted.iter());
    hull.extend(half(&mut sorted.iter().rev()));
    (hull.len() >= 3).then_some(hull)
}

/// Soles: level, pointing forward, with all contact points in one plane in the standing pose.
fn feet(robot: &Robot, data: &RobotData, findings: &mut Findings) {
    for (word, side) in [("left", Side::Left), ("right", Side::Right)] {
        let leg = robot.leg(side);
        let heights: Vec<f64> =
            robot.contacts.iter().filter(|c| c.leg == side).map(|c| data.point(&c.at).z - c.radius).collect();
        let (least, greatest) = heights.iter().fold((f64::INFINITY, 0.0f64), |(a, b), h| (a.min(*h), b.max(*h)));
        if heights.is_empty() {
            findings.missing("contact points", format!("{word}: none"));
        } else if greatest > FLAT {
            let detail = format!(
                "{word}: {:.1} to {:.1} mm above the ground in [stand]; level the foot",
                1e3 * least,
                1e3 * greatest
            );
            findings.doubtful("contact points", detail);
        } else {
            findings.found("contact points", format!("{word}: level within {:.2} mm", 1e3 * (greatest - least)));
        }
        let axes = data.link_matrix(leg.foot);
        let forward = Vector3::from(axes.column(0)).angle(&Vector3::x());
        let upward = Vector3::from(axes.column(2)).angle(&Vector3::z());
        if forward > 0.35 || upward > 0.1 {
            findings.missing(
                "foot axes",
                format!("{word}: in [stand] the foot's x points {forward:.2} rad off forward and its z {upward:.2} rad off up"),
            );
        }
        let sole = data.point(&leg.sole);
        if sole.z.abs() > 0.01 {
            findings
                .doubtful("sole", format!("{word}: its centre is {:.1} mm above the ground in [stand]", 1e3 * sole.z));
        }
    }
}

/// Left and right joints of a leg should have the same limits, as they are or with the sign turned.
fn sides(robot: &Robot, findings: &mut Findings) {
    let [left, right] = &robot.legs;
    let mut alike = 0;
    for (a, b) in left.joints().zip(right.joints()) {
        let (a, b) = (&robot.joints[a], &robot.joints[b]);
        let near = |x: f64, y: f64| (x - y).abs() < 0.02;
        let same = near(a.range[0], b.range[0]) && near(a.range[1], b.range[1]);
        let turned = near(a.range[0], -b.range[1]) && near(a.range[1], -b.range[0]);
        if !(same || turned) {
            findings
                .doubtful("sides", format!("\"{}\" has the range {:?}, \"{}\" {:?}", a.name, a.range, b.name, b.range));
        } else if (a.torque, a.speed) != (b.torque, b.speed) {
            findings.doubtful("sides", format!("\"{}\" and \"{}\" differ in torque or speed", a.name, b.name));
        } else {
            alike += 1;
        }
    }
    let count = |leg: &Leg| leg.joints().count();
    if count(left) != count(right) {
        findings.missing("sides", format!("the left leg has {} joints, the right {}", count(left), count(right)));
    }
    findings.found("sides", format!("{alike} pairs of leg joints have the same limits"));
}

/// Drives at a 2 ms step: position feedback k and damping c per effective inertia are stable while
/// 2 c dt + k dt^2 < 4 (semi-implicit Euler, Jury's criterion); half of that is asked for.
fn gains(robot: &Robot, findings: &mut Findings) {
    let model = robot.model();
    let mut data = mujoco_rs::prelude::MjData::new(model.clone());
    data.qpos_mut().copy_from_slice(&robot.stand);
    data.kinematics();
    data.com_pos();
    data.make_m();
    let inertias = effective_inertias(&data);
    let mut worst = (0.0, "");
    for (joint, inertia) in robot.joints.iter().zip(inertias.iter().skip(6)) {
        let Some(inertia) = inertia else {
            findings.missing("inertia", format!("joint \"{}\" moves no inertia", joint.name));
            continue;
        };
        let share = (2.0 * joint.kd * STEP + joint.kp * STEP * STEP) / (4.0 * inertia);
        if share > worst.0 {
            worst = (share, &joint.name);
        }
        if share >= 0.5 {
            let detail = format!(
                "\"{}\": kp {} and kd {} on {inertia:.2e} kg m^2 use {:.0} % of what a 2 ms step can hold; lower them or add armature",
                joint.name,
                joint.kp,
                joint.kd,
                100.0 * share
            );
            if share >= 1.0 { findings.missing("gains", detail) } else { findings.doubtful("gains", detail) }
        }
    }
    findings.found("gains", format!("at most {:.0} % of what a 2 ms step can hold (\"{}\")", 100.0 * worst.0, worst.1));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn margin_is_the_distance_to_the_nearest_edge() {
        let square = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0], [1.0, 1.0], [1.0, 0.0]].map(Vector2::from);
        assert!((margin(&square, Vector2::new(0.5, 1.0)).unwrap() - 0.5).abs() < 1e-12);
        assert!((margin(&square, Vector2::new(2.25, 1.0)).unwrap() + 0.25).abs() < 1e-12);
        assert_eq!(margin(&square[..2], Vector2::zeros()), None);
        let line = [[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]].map(Vector2::from);
        assert_eq!(margin(&line, Vector2::zeros()), None);
    }
}
