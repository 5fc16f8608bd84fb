//! What is fixed before the solver starts: the nodes in time, what each follows, and the contact schedule.

use instep_motion::phase::{KickPhases, Side};
use instep_robot::{LinkPoint, Robot};
use nalgebra::{Rotation3, Vector3};

use super::collision::Capsules;
use super::height_map;
use super::settings::KinodynamicSettings;
use super::tree::{MAX_PITCH, Tree};
use crate::RetargetError;
use crate::kinematic::{Retargeted, Weights};
use crate::rescale::Targets;
use crate::stance::stances;

/// One row by which a standing contact point is held: its place along one direction; (11), (12).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hold {
    pub point: usize,
    /// Into [`Plan::episodes`].
    pub episode: usize,
    /// In the axes of the episode's foot: x along the sole, z up.
    pub direction: Vector3<f64>,
    /// First or last node of the point's stance, where its speed is held too.
    pub edge: bool,
}

/// What happens at one node.
#[derive(Debug, Clone, Default)]
pub(crate) struct Node {
    /// Where each keypoint should be, m.
    pub targets: Vec<Vector3<f64>>,
    /// Coordinates of the kinematic stage.
    pub posture: Vec<f64>,
    /// Contact points that stand.
    pub standing: Vec<bool>,
    /// Contact points that may push; three force components each.
    pub pushing: Vec<usize>,
    pub holds: Vec<Hold>,
    /// zeta of (5).
    pub swing: bool,
    pub impact: bool,
}

/// A stretch in which a foot stands without a break: it keeps one place and heading.
#[derive(Debug, Clone)]
pub(crate) struct Episode {
    pub side: Side,
    /// Nodes `start..end`.
    pub start: usize,
    pub end: usize,
    /// Of the sole's origin on the ground, m.
    pub place: Vector3<f64>,
    pub heading: f64,
    /// Lays level axes on the ground under the foot.
    pub tilt: Rotation3<f64>,
}

impl Episode {
    /// `world_from_sole`.
    pub(crate) fn turn(&self) -> Rotation3<f64> {
        self.tilt * Rotation3::from_axis_angle(&Vector3::z_axis(), self.heading)
    }
}

/// The whole problem but its unknowns.
#[derive(Debug)]
pub(crate) struct Plan<'a> {
    pub robot: &'a Robot,
    pub tree: Tree,
    pub settings: &'a KinodynamicSettings,
    /// Time between nodes, s.
    pub step: f64,
    pub nodes: Vec<Node>,
    pub episodes: Vec<Episode>,
    /// Of each contact point in its standing foot's frame: the sole's axes, origin at the ground under the ankle, m.
    pub offsets: Vec<Vector3<f64>>,
    pub keypoints: Vec<(LinkPoint, f64)>,
    pub capsules: Capsules,
    /// The point of the kicking foot whose speed counts: the middle of its first striking geom.
    pub strike: LinkPoint,
    /// Where that point should be at the impact, m: to the ball as the kinematic stage has it.
    pub strike_place: Vector3<f64>,
    /// In the reference's own time.
    pub phases: KickPhases,
    /// First and last node at which the ankle keeps still; (19).
    pub lock: [usize; 2],
    pub ball: Vector3<f64>,
    /// m g, N.
    pub weight: f64,
    /// The clip's own time at node 0, s.
    pub clip_start: f64,
    /// By how much the motion was turned about the ball, beyond the aim, so that the approach angle can be kept, rad.
    pub aim_turn: f64,
}

impl<'a> Plan<'a> {
    pub(crate) fn new(
        robot: &'a Robot,
        start: &Retargeted,
        weights: &Weights,
        settings: &'a KinodynamicSettings,
    ) -> Result<Self, RetargetError> {
        let tree = Tree::new(robot);
        let rate = start.contacts.rate;
        let stride = rate / (settings.rate * settings.time_scale);
        let last = start.positions.len().saturating_sub(1) as f64;
        let impact_frame = start.phases.t_impact * rate;
        let before = (impact_frame / stride + 1e-9).floor();
        let first = (impact_frame - before * stride).max(0.0);
        let count = ((last - first) / stride + 1e-9).floor() as usize + 1;
        if count < 8 {
            return Err(RetargetError::Setting {
                field: "kinodynamic.rate".into(),
                found: format!("{count} nodes in the clip"),
                expected: "at least 8".into(),
            });
        }
        let targets = start.targets.frames.iter().flat_map(|frame| &frame.positions);
        let finite = start.positions.iter().flatten().chain(targets.flat_map(|at| at.iter())).all(|x| x.is_finite());
        if !finite {
            return Err(RetargetError::Breakdown {
                iteration: start.iterations,
                what: "a position that is not a number came out of it",
            });
        }
        let step = 1.0 / settings.rate;
        let of_clip = |t: f64| ((t - first / rate) * settings.time_scale).max(0.0);
        let phases = KickPhases {
            kick_foot: start.phases.kick_foot,
            t_plant: of_clip(start.phases.t_plant),
            t_swing: of_clip(start.phases.t_swing),
            t_lock: of_clip(start.phases.t_lock),
            t_impact: of_clip(start.phases.t_impact),
        };
        let impact = before as usize;
        let node_at = |t: f64| ((t / step).round().max(0.0) as usize).min(count - 1);
        let lock = [node_at(phases.t_lock), impact];

        let level = Vector3::from(start.reference.ball);
        let ground = &settings.ground;
        let ball = Vector3::new(level.x, level.y, ground.rest(level.x, level.y, level.z).0);
        let shift = Vector3::new(settings.ball[0], settings.ball[1], 0.0);
        let aim_turn = aim_turn(start, &(ball + shift), settings);
        // The world's x axis is the aim; where that is not the clip's own direction, the clip is turned instead.
        let angle = aim_turn - settings.aim;
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), angle);
        let raw = stances(robot, &start.contacts);
        let mut near = 0.0;
        let mut at_impact = Vec::new();
        let mut nodes = Vec::with_capacity(count);
        for k in 0..count {
            let frame = (first + k as f64 * stride).clamp(0.0, last);
            let (below, share) = ((frame + 1e-9).floor() as usize, frame - (frame + 1e-9).floor());
            let above = (below + 1).min(start.positions.len() - 1);
            let mut posture = tree.coordinates(&start.positions[below], near);
            let next = tree.coordinates(&start.positions[above], posture[3]);
            near = posture[3];
            if posture[4].abs() > MAX_PITCH {
                return Err(RetargetError::Setting {
                    field: "clip".into(),
                    found: format!("a pelvis pitched by {:.2} rad at {:.3} s", posture[4], frame / rate),
                    expected: format!("at most {MAX_PITCH} rad: the kinodynamic stage's coordinates need it"),
                });
            }
            posture.iter_mut().zip(&next).for_each(|(x, y)| *x += share.max(0.0) * (y - *x));
            let moved = |at: Vector3<f64>| {
                let at = level + turn * (at - shift - level);
                at + Vector3::z() * ground.height(at.x, at.y)
            };
            if k == impact {
                at_impact.clone_from(&posture);
            }
            let base = moved(Vector3::new(posture[0], posture[1], posture[2]));
            posture[..3].copy_from_slice(base.as_slice());
            posture[3] += angle;
            let (a, b) = (&start.targets.frames[below].positions, &start.targets.frames[above].positions);
            let targets = a.iter().zip(b).map(|(a, b)| moved(a + (b - a) * share.max(0.0))).collect();
            let nearest = frame.round() as usize;
            let standing = (0..robot.contacts.len())
                .map(|p| raw.iter().any(|s| s.point == p && (s.start..s.end).contains(&nearest)))
                .collect();
            let swing = k <= impact && k as f64 * step >= phases.t_swing - 1e-9;
            nodes.push(Node { targets, posture, standing, swing, impact: k == impact, ..Node::default() });
        }

        let offsets = offsets(robot, &tree);
        let mut data = robot.data();
        data.set_position(&robot.stand);
        let leg = robot.leg(phases.kick_foot);
        let strike = leg.strike.first().map_or(leg.sole, |&geom| {
            let (axis, _) = data.capsule(geom);
            let link = data.geom_link(geom);
            let centre = (axis[0] + axis[1]) * 0.5 - data.link_position(link);
            LinkPoint { link, point: data.link_matrix(link).transpose() * centre }
        });
        let mut pose = tree.pose();
        tree.place(&at_impact, &mut pose);
        let strike_place = pose.point(&strike) + (ball - level);
        let weight = tree.mass * tree.gravity;
        let keypoints = keypoints(&start.targets, weights);
        let capsules = Capsules::new(robot, &data);
        let mut plan = Self {
            robot,
            tree,
            settings,
            step,
            nodes,
            episodes: Vec::new(),
            offsets,
            keypoints,
            capsules,
            strike,
            strike_place,
            phases,
            lock,
            ball,
            weight,
            clip_start: first / rate,
            aim_turn,
        };
        plan.schedule();
        let postures: Vec<Vec<f64>> = plan.nodes.iter().map(|node| node.posture.clone()).collect();
        plan.settle(&postures);
        Ok(plan)
    }

    /// Episodes, which points push, and the rows that hold the standing ones.
    fn schedule(&mut self) {
        let count = self.nodes.len();
        for side in [Side::Left, Side::Right] {
            let own: Vec<usize> =
                (0..self.robot.contacts.len()).filter(|&p| self.robot.contacts[p].leg == side).collect();
            let mut start = None;
            self.fill_gaps(&own);
            for k in 0..=count {
                let stands = k < count && own.iter().any(|&p| self.nodes[k].standing[p]);
                match (start, stands) {
                    (None, true) => start = Some(k),
                    (Some(first), false) => {
                        let place = Vector3::zeros();
                        let tilt = Rotation3::identity();
                        self.episodes.push(Episode { side, start: first, end: k, place, heading: 0.0, tilt });
                        start = None;
                    }
                    _ => {}
                }
            }
        }
        for k in 0..count {
            let around = [k.saturating_sub(1), (k + 1).min(count - 1)];
            let whole = |p: usize| around.iter().all(|&n| self.nodes[n].standing[p]);
            let standing: Vec<usize> = (0..self.robot.contacts.len()).filter(|&p| self.nodes[k].standing[p]).collect();
            let pushing = standing.iter().copied().filter(|&p| whole(p)).collect();
            let mut holds = Vec::new();
            for (episode, e) in self.episodes.iter().enumerate() {
                if !(e.start..e.end).contains(&k) {
                    continue;
                }
                let of_foot: Vec<usize> =
                    standing.iter().copied().filter(|&p| self.robot.contacts[p].leg == e.side).collect();
                let rows = super::contact::independent(self.robot, &self.offsets, &of_foot);
                holds.extend(rows.into_iter().map(|(point, direction)| {
                    // At the ends of the clip the foot goes on standing.
                    Hold { point, episode, direction, edge: !whole(point) }
                }));
            }
            self.nodes[k].pushing = pushing;
            self.nodes[k].holds = holds;
        }
    }

    /// Lets the points of one foot that stand before and after a short flight of the foot stand during it too.
    fn fill_gaps(&mut self, own: &[usize]) {
        let most = (self.settings.min_gap / self.step).round() as usize;
        let mut last: Option<usize> = None;
        for k in 0..self.nodes.len() {
            if !own.iter().any(|&p| self.nodes[k].standing[p]) {
                continue;
            }
            if let Some(before) = last.filter(|&before| k - before > 1 && k - before - 1 <= most) {
                let both: Vec<usize> = own
                    .iter()
                    .copied()
                    .filter(|&p| self.nodes[before].standing[p] && self.nodes[k].standing[p])
                    .collect();
                for n in before + 1..k {
                    both.iter().for_each(|&p| self.nodes[n].standing[p] = true);
                }
            }
            last = Some(k);
        }
    }

    /// Puts every episode's foot where its standing points are on average, flat on the ground. Where the ground under it
    /// is no plane, the foot takes its mean slope and its points touch or are above it.
    pub(crate) fn settle(&mut self, positions: &[Vec<f64>]) {
        let mut pose = self.tree.pose();
        for e in 0..self.episodes.len() {
            let (start, end, side) = (self.episodes[e].start, self.episodes[e].end, self.episodes[e].side);
            let mut pairs = Vec::new();
            for (k, x) in positions.iter().enumerate().take(end).skip(start) {
                self.tree.place(x, &mut pose);
                for (p, contact) in self.robot.contacts.iter().enumerate() {
                    if contact.leg == side && self.nodes[k].standing[p] {
                        pairs.push((self.offsets[p], pose.point(&contact.at), k));
                    }
                }
            }
            let count = pairs.len().max(1) as f64;
            let mean =
                pairs.iter().fold((Vector3::zeros(), Vector3::zeros()), |m, p| (m.0 + p.0 / count, m.1 + p.1 / count));
            // The rotation about z that fits best; a foot that only ever stood on one point keeps its own heading.
            let (mut sine, mut cosine) = (0.0, 0.0);
            for (a, b, _) in &pairs {
                let (a, b) = (a - mean.0, b - mean.1);
                sine += a.x * b.y - a.y * b.x;
                cosine += a.x * b.x + a.y * b.y;
            }
            let heading = if sine.hypot(cosine) > 1e-9 {
                sine.atan2(cosine)
            } else {
                self.tree.place(&positions[start], &mut pose);
                let ahead = pose.rotations[self.robot.leg(side).foot] * Vector3::x();
                ahead.y.atan2(ahead.x)
            };
            let ground = &self.settings.ground;
            let slopes = pairs.iter().map(|(_, at, _)| ground.gradient(at.x, at.y) / count);
            let tilt = height_map::tilt(&slopes.sum());
            let episode = &mut self.episodes[e];
            (episode.heading, episode.tilt) = (heading, tilt);
            let turn = episode.turn();
            let place = mean.1 - turn * mean.0;
            // Up until no standing point is in the ground.
            let depth = pairs.iter().map(|(offset, ..)| {
                let at = Vector3::new(place.x, place.y, 0.0) + turn * Vector3::new(offset.x, offset.y, 0.0);
                ground.height(at.x, at.y) - at.z
            });
            let up = depth.reduce(f64::max).unwrap_or(0.0);
            episode.place = Vector3::new(place.x, place.y, up);
        }
    }

    /// Where a contact point stands during an episode, m.
    pub(crate) fn place(&self, episode: usize, point: usize) -> Vector3<f64> {
        let e = &self.episodes[episode];
        e.place + e.turn() * self.offsets[point]
    }

    /// Axes of the ground under a point that stands at node `k`: x, y and straight off it.
    pub(crate) fn footing(&self, k: usize, point: usize) -> [Vector3<f64>; 3] {
        let side = self.robot.contacts[point].leg;
        let stands = self.episodes.iter().find(|e| e.side == side && (e.start..e.end).contains(&k));
        let tilt = stands.map_or_else(Rotation3::identity, |e| e.tilt);
        [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| tilt * axis)
    }
}

/// The least turn of the whole motion about the ball that brings the approach angle (20) at the start into its range.
fn aim_turn(start: &Retargeted, ball: &Vector3<f64>, settings: &KinodynamicSettings) -> f64 {
    let Some(q) = start.positions.first() else { return 0.0 };
    let (x, y) = (ball.x - q[0], ball.y - q[1]);
    let angle = y.atan2(x) - settings.aim;
    let [least, greatest] = settings.approach_angle;
    let spare = (0.25 * (greatest - least)).min(0.01);
    let wanted = angle.abs().clamp(least + spare, (greatest - spare).max(least + spare));
    (wanted - angle.abs()) * if angle < 0.0 { -1.0 } else { 1.0 } + 0.0
}

fn keypoints(targets: &Targets, weights: &Weights) -> Vec<(LinkPoint, f64)> {
    targets.keypoints.iter().map(|k| (k.at, weights.of(k.landmark))).collect()
}

/// Each contact point in the frame of its foot when that stands flat.
fn offsets(robot: &Robot, tree: &Tree) -> Vec<Vector3<f64>> {
    let mut pose = tree.pose();
    tree.place(&vec![0.0; tree.nv], &mut pose);
    let at = |leg: Side| {
        let foot = pose.positions[robot.leg(leg).foot];
        let sole = pose.point(&robot.leg(leg).sole);
        Vector3::new(foot.x, foot.y, sole.z)
    };
    robot
        .contacts
        .iter()
        .map(|contact| {
            let offset = pose.point(&contact.at) - at(contact.leg);
            Vector3::new(offset.x, offset.y, contact.radius)
        })
        .collect()
}
