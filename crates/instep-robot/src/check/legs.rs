//! Finding legs and arms in a model by its structure: two mirrored chains of five to seven hinges that end lowest are
//! the legs; of the other mirrored pairs the highest is the arms. Names only break ties (hip yaw or pitch?).

use super::outline::Outline;

/// Left and right chain of joints (indices into [`Outline::joints`]), without joints common to both.
pub(crate) type Pair = [Vec<usize>; 2];

/// What a joint of a leg turns about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum About {
    Roll,
    Pitch,
    Yaw,
}

/// The joints of one leg by role, as indices into [`Outline::joints`].
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct LegRoles {
    pub(crate) hip_yaw: Option<usize>,
    pub(crate) hip_roll: Option<usize>,
    pub(crate) hip_pitch: Option<usize>,
    pub(crate) knee: Option<usize>,
    pub(crate) ankle_pitch: Option<usize>,
    pub(crate) ankle_roll: Option<usize>,
    pub(crate) toe: Option<usize>,
}

impl LegRoles {
    /// The joint that moves the link with the sole: the last of `chain`, or the one before the toe.
    pub(crate) fn foot(&self, chain: &[usize]) -> Option<usize> {
        match self.toe.and_then(|toe| chain.iter().position(|&joint| joint == toe)) {
            Some(toe) => toe.checked_sub(1).map(|at| chain[at]),
            None => chain.last().copied(),
        }
    }

    /// Role and joint, from hip to toe.
    pub(crate) fn roles(&self) -> [(&'static str, Option<usize>); 7] {
        [
            ("hip_yaw", self.hip_yaw),
            ("hip_roll", self.hip_roll),
            ("hip_pitch", self.hip_pitch),
            ("knee", self.knee),
            ("ankle_pitch", self.ankle_pitch),
            ("ankle_roll", self.ankle_roll),
            ("toe", self.toe),
        ]
    }
}

/// Legs and arms of a model.
pub(crate) struct Limbs {
    pub(crate) legs: Option<Pair>,
    pub(crate) arms: Option<Pair>,
}

/// Finds legs and arms.
pub(crate) fn limbs(outline: &Outline) -> Limbs {
    let chains = outline.chains();
    let middle = outline.base.map_or(0.0, |base| outline.positions[base].y);
    let mut pairs: Vec<(f64, Pair)> = Vec::new();
    for (i, a) in chains.iter().enumerate() {
        for b in &chains[i + 1..] {
            let common = a.iter().zip(b).take_while(|(x, y)| x == y).count();
            let (a, b) = (&a[common..], &b[common..]);
            let (Some(&end_a), Some(&end_b)) = (a.last(), b.last()) else { continue };
            if a.len() != b.len() {
                continue;
            }
            let [p, q] = [end_a, end_b].map(|joint| outline.positions[outline.joints[joint].link]);
            let apart = (p.x - q.x).abs().max((p.y + q.y - 2.0 * middle).abs()).max((p.z - q.z).abs());
            let span = (p.y - q.y).abs();
            if apart < 0.01 + 0.1 * span && span > 0.01 {
                let height = [end_a, end_b].map(|joint| outline.bounds(outline.joints[joint].link)[0].z);
                let left_first = p.y > q.y;
                let pair = if left_first { [a.to_vec(), b.to_vec()] } else { [b.to_vec(), a.to_vec()] };
                pairs.push((height[0].min(height[1]), pair));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let leg = pairs.iter().position(|(_, pair)| {
        (5..=7).contains(&pair[0].len()) && pair.iter().flatten().all(|&j| outline.joints[j].kind == "hinge")
    });
    let legs = leg.map(|at| pairs.remove(at).1);
    let leg_joint = |joint: &usize| legs.as_ref().is_some_and(|pair| pair.iter().flatten().any(|j| j == joint));
    let arms =
        pairs.into_iter().rev().map(|(_, pair)| pair).find(|p| p[0].len() >= 2 && !p.iter().flatten().any(leg_joint));
    Limbs { legs, arms }
}

/// Gives each joint of a leg its role, by what it turns about and its place along the leg.
pub(crate) fn roles(outline: &Outline, chain: &[usize]) -> LegRoles {
    let about: Vec<(usize, About)> = chain.iter().map(|&joint| (joint, about(outline, joint))).collect();
    let nth = |kind: About, n: usize| about.iter().filter(|(_, k)| *k == kind).nth(n).map(|(joint, _)| *joint);
    let count = |kind: About| about.iter().filter(|(_, k)| *k == kind).count();
    LegRoles {
        hip_yaw: nth(About::Yaw, 0),
        hip_roll: nth(About::Roll, 0),
        hip_pitch: nth(About::Pitch, 0),
        knee: nth(About::Pitch, 1),
        ankle_pitch: nth(About::Pitch, 2),
        ankle_roll: (count(About::Roll) > 1).then(|| nth(About::Roll, count(About::Roll) - 1)).flatten(),
        toe: nth(About::Pitch, 3),
    }
}

/// A joint's name decides where it says something; else the axis in the zero pose.
fn about(outline: &Outline, joint: usize) -> About {
    let joint = &outline.joints[joint];
    let name = joint.name.to_lowercase();
    for (word, about) in [
        ("yaw", About::Yaw),
        ("roll", About::Roll),
        ("pitch", About::Pitch),
        ("knee", About::Pitch),
        ("toe", About::Pitch),
    ] {
        if name.contains(word) {
            return about;
        }
    }
    match joint.axis.abs().imax() {
        0 => About::Roll,
        1 => About::Pitch,
        _ => About::Yaw,
    }
}
