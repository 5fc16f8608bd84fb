//! A player's camera in a physics match (paper 4, section V-D): the world rendered from its head, the shipped detector, and what
//! follows it.
//!
//! A frame is taken at the camera's rate and arrives as late as the camera can be. The truth makes the picture alone: where the
//! camera was when it was taken is what encoders, inertial sensor and the lower sole tell.

use std::collections::VecDeque;

use instep_field::Side;
use instep_localisation::Sight;
use instep_perception::after::sights::sights;
use instep_perception::detector::{Detector, THRESHOLDS};
use instep_perception::render::Renderer;
use instep_perception::scene::staged::{Ball, Player, colour, staged};
use instep_perception::scene::{Look, Paint, Scene, Shape};
use instep_perception::{Camera as Picture, CameraPose, Team};
use instep_player::{BallSight, RobotSight, Sights};
use instep_robot::control::Sensors;
use instep_robot::senses::Camera;
use instep_robot::{Form, RobotData};
use instep_sim::World;
use nalgebra::{Isometry3, Matrix3, Quaternion, UnitQuaternion, Vector3};

use crate::MatchError;

/// Deviation of the direction in which something is seen, rad: half a pixel, and what the tilt errs.
const ANGLE: f64 = 0.006;

/// The camera of one player.
#[derive(Debug)]
pub(crate) struct Lens {
    camera: Camera,
    renderer: Renderer,
    detector: Detector,
    /// What the robot knows of its body.
    data: RobotData,
    q: Vec<f64>,
    team: Side,
    seed: u64,
    /// When the next frame is due, s, and how many there were.
    next: f64,
    count: u64,
    /// Taken, not yet looked at.
    shot: Option<Shot>,
    coming: VecDeque<(f64, Sights)>,
}

/// A frame that was taken.
#[derive(Debug)]
struct Shot {
    time: f64,
    scene: Scene,
    /// `heading_from_camera` as the robot knows it.
    known: CameraPose,
}

impl Lens {
    pub(crate) fn new(world: &World, index: usize, camera: Camera, seed: u64) -> Result<Self, MatchError> {
        let view = world.on(index);
        let wrong = |found: String| MatchError::Value {
            what: "camera",
            found,
            expected: "a camera and a detector that fit each other".into(),
        };
        let Some(field) = world.field() else { return Err(wrong("a world without a field".into())) };
        let picture =
            Picture { field_of_view: camera.field_of_view[0], rate: 1.0 / camera.period, ..Picture::default() };
        picture.validate(&format!("{}: senses.camera", view.robot().name)).map_err(|e| wrong(e.to_string()))?;
        Ok(Self {
            renderer: Renderer::new(picture, field),
            detector: Detector::shipped().map_err(|e| wrong(e.to_string()))?,
            data: view.robot().data(),
            q: view.robot().stand.clone(),
            team: view.team(),
            camera,
            seed,
            next: 0.0,
            count: 0,
            shot: None,
            coming: VecDeque::new(),
        })
    }

    /// Takes the frame that is due; `body` is what robot `index` of `world` senses of itself.
    pub(crate) fn take(&mut self, world: &World, index: usize, body: &Sensors) {
        let time = world.time();
        let Some(field) = world.field() else { return };
        if time + 1e-9 < self.next || body.joint_positions.len() + 7 != self.q.len() {
            return;
        }
        self.next = (self.next + self.camera.period).max(time);
        self.count += 1;
        let known = self.known(world, index, body);
        let truth = world.on(index).camera_pose(&self.camera);
        let optical = pose(&truth);
        let picture = *self.renderer.camera();
        // What turns while the shutter is open is smeared.
        let gyro = known.rotation.transpose() * Vector3::from(body.gyro).cast::<f32>();
        let smear = picture.focal() * picture.exposure as f32;
        let look =
            Look { motion: [smear * gyro.y, smear * gyro.x], texture: self.seed as u32 & 0xf_ffff, ..Look::default() };
        let players: Vec<Player> = world
            .robots()
            .enumerate()
            .map(|(other, view)| {
                let team = team(view.team());
                let base = view.robot().base;
                let hidden = (other == index).then_some(self.camera.at.link);
                let parts = view.robot().visible().filter(|part| Some(part.link) != hidden);
                let parts = parts.map(|part| {
                    // A jersey round the trunk; the rest is grey as its colour is light.
                    let [r, g, b, _] = part.color;
                    let grey = (0.3 * r + 0.6 * g + 0.1 * b).powf(2.2);
                    let paint = if part.link == base { colour(team) } else { Paint::Plain([grey; 3]) };
                    let (origin, turn) = view.link_pose(part.link);
                    let position = (origin + turn * part.position).cast::<f32>();
                    let turn = turn * part.rotation.to_rotation_matrix().into_inner();
                    (shape(part.form), position, turn.cast::<f32>(), paint)
                });
                Player { team: Some(team), parts: parts.collect() }
            })
            .collect();
        let ball = world.ball();
        let [w, x, y, z] = ball.orientation;
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        let ball = Ball {
            position: Vector3::from(ball.position).cast(),
            rotation: turn.to_rotation_matrix().into_inner().cast(),
            radius: world.settings().ball.radius as f32,
        };
        let noise = self.seed.wrapping_mul(0x9E37_79B9).wrapping_add(self.count);
        self.shot = Some(Shot { time, scene: staged(field, optical, look, Some(ball), &players, noise), known });
    }

    /// The camera over the ground under the base, by the body's own senses.
    fn known(&mut self, world: &World, index: usize, body: &Sensors) -> CameraPose {
        let robot = world.on(index).robot();
        let [w, x, y, z] = body.orientation;
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        let level = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -turn.euler_angles().2) * turn;
        self.q[..3].fill(0.0);
        self.q[3..7].copy_from_slice(&[level.w, level.i, level.j, level.k]);
        self.q[7..].copy_from_slice(&body.joint_positions);
        self.data.set_position(&self.q);
        let lowest = robot.contacts.iter().map(|contact| self.data.point(&contact.at).z - contact.radius);
        let ground = lowest.fold(f64::INFINITY, f64::min);
        let turn = self.data.link_rotation(self.camera.at.link) * self.camera.link_from_camera;
        let mut at = self.data.point(&self.camera.at);
        at.z -= if ground.is_finite() { ground } else { 0.0 };
        pose(&Isometry3::from_parts(at.into(), turn))
    }

    /// Looks at the frame that was taken, if one was: it arrives when the camera and its computer are done.
    pub(crate) fn develop(&mut self) {
        let Some(shot) = self.shot.take() else { return };
        let view = self.renderer.render(&shot.scene);
        // The renderer's frames have the network's size.
        let found = self.detector.detect(&view.frame, &THRESHOLDS).unwrap_or_default();
        let radius = shot.scene.things.iter().find(|thing| thing.class == instep_perception::Class::Ball);
        let radius = radius.map_or(0.11, |thing| thing.size);
        let known = &shot.known;
        let seen = sights(self.renderer.camera(), known, radius, &view.frame, &view.depth, &found);
        // From under the camera to under the base.
        let yaw = f64::from(known.yaw());
        let (s, c) = yaw.sin_cos();
        let at = known.position.cast::<f64>();
        let place = |[x, y]: [f32; 2]| {
            let (x, y) = (f64::from(x), f64::from(y));
            [at.x + c * x - s * y, at.y + s * x + c * y]
        };
        let own = team(self.team);
        let sights = Sights {
            time: shot.time,
            gaze_yaw: yaw,
            ball: seen.ball.map(|(ball, _)| {
                let position = place([ball.position.x, ball.position.y]);
                let std = f64::from(ball.deviation).hypot(ANGLE * position[0].hypot(position[1]));
                BallSight { position, height: f64::from(ball.position.z), std }
            }),
            landmarks: seen
                .landmarks
                .iter()
                .filter_map(|sight| {
                    let position = place(sight.position);
                    let confidence = f64::from(sight.confidence);
                    Some(Sight { class: sight.class.landmark()?, position, confidence, covariance: None })
                })
                .collect(),
            lines: Vec::new(),
            robots: seen
                .robots
                .iter()
                .map(|sight| RobotSight {
                    position: place(sight.position),
                    mate: sight.team.map(|team| team == own),
                    number: None,
                    fallen: false,
                })
                .collect(),
        };
        self.coming.push_back((shot.time + self.camera.latency[1], sights));
    }

    /// The newest frame that has arrived by `time` (s) and was not handed out.
    pub(crate) fn arrived(&mut self, time: f64) -> Option<Sights> {
        let mut newest = None;
        while self.coming.front().is_some_and(|(at, _)| *at <= time + 1e-9) {
            newest = self.coming.pop_front();
        }
        newest.map(|(_, sights)| sights)
    }
}

/// A team's colour.
fn team(side: Side) -> Team {
    match side {
        Side::Home => Team::Red,
        Side::Away => Team::Blue,
    }
}

/// Optical axes (right, down, ahead) of a camera that looks along x.
fn pose(camera: &Isometry3<f64>) -> CameraPose {
    let axes = camera.rotation.to_rotation_matrix().into_inner().cast::<f32>();
    let [ahead, left, up] = [axes.column(0), axes.column(1), axes.column(2)];
    CameraPose {
        position: camera.translation.vector.cast(),
        rotation: Matrix3::from_columns(&[-left, -up, ahead.into_owned()]),
    }
}

fn shape(form: Form) -> Shape {
    match form {
        Form::Sphere(radius) => Shape::Sphere(radius as f32),
        Form::Capsule(radius, half) => Shape::Capsule(radius as f32, half as f32),
        Form::Cylinder(radius, half) => Shape::Cylinder(radius as f32, half as f32),
        // The renderer knows no ellipsoid.
        Form::Box(half) | Form::Ellipsoid(half) => Shape::Box(half.map(|side| side as f32)),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;

    use instep_field::{Field, Pose};
    use instep_robot::Robot;
    use instep_sim::sensors::SensorSuite;
    use instep_sim::settings::WorldSettings;
    use instep_sim::{BallState, Entrant};

    use super::*;

    /// A robot that stands turned on the field and has turned its head by `yaw` sees a ball, an opponent and landmarks; all in its
    /// own frame, and where the camera looks.
    #[test]
    fn what_is_seen_lies_where_it_is_wherever_robot_and_head_look() {
        let robot = Arc::new(Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/artemis")).unwrap());
        let field = Arc::new(Field::named("adult-2024").unwrap());
        let start = Pose::new(-1.5, 1.0, 0.2);
        // It has turned since the inertial sensor began to count.
        let own = Pose { heading: start.heading - 0.8, ..start };
        let other = Pose::new(1.4, -0.3, 2.0);
        let entrants = [(Side::Home, start), (Side::Away, other)];
        let entrants = entrants.map(|(team, pose)| Entrant { robot: Arc::clone(&robot), team, pose });
        let neck = robot.joint_index("neck_yaw").unwrap();
        for yaw in [0.0, 0.4, -0.4] {
            let mut world = World::on_field(Arc::clone(&field), &entrants, &WorldSettings::default()).unwrap();
            let mut q = world.on(0).q().to_vec();
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), own.heading - start.heading);
            let turned = turn * UnitQuaternion::from_quaternion(Quaternion::new(q[3], q[4], q[5], q[6]));
            q[3..7].copy_from_slice(&[turned.w, turned.i, turned.j, turned.k]);
            q[7 + neck] = yaw;
            world.place_robot(0, &q, &vec![0.0; robot.nv()]).unwrap();
            let [x, y] = own.outer_from_local([1.9, 0.3]);
            world.place_ball(&BallState::at_rest([x, y, field.ball.radius]));
            let mut suite = SensorSuite::of(&mut world, 0, 1);
            let mut body = Sensors::default();
            suite.sense(&world);
            suite.read_into(0.0, &mut body);
            let mut lens = Lens::new(&world, 0, robot.camera.unwrap(), 7).unwrap();
            lens.take(&world, 0, &body);
            lens.develop();
            let late = robot.camera.unwrap().latency[1];
            assert!(lens.arrived(late - 0.002).is_none(), "before the camera is done");
            let sights = lens.arrived(late).unwrap();
            assert!(lens.arrived(late).is_none(), "handed out once");
            assert_eq!(sights.time, 0.0);
            assert!((sights.gaze_yaw - yaw).abs() < 0.03, "{} for {yaw}", sights.gaze_yaw);
            let off = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
            let ball = sights.ball.unwrap();
            assert!(off(ball.position, [1.9, 0.3]) < 0.05, "{yaw}: {ball:?}");
            assert!((ball.height - field.ball.radius).abs() < 0.05, "{yaw}: {ball:?}");
            let there = own.local_from_outer(other.position());
            let seen = sights.robots.iter().find(|robot| off(robot.position, there) < 0.4);
            assert!(seen.is_some_and(|robot| robot.mate == Some(false)), "{yaw}: {:?}", sights.robots);
            assert!(!sights.landmarks.is_empty(), "{yaw}");
            for sight in &sights.landmarks {
                let at = own.outer_from_local(sight.position);
                // A far post's foot is told to a pixel.
                let within = 0.3 + 0.05 * off(sight.position, [0.0; 2]);
                let near = field.landmarks().iter().any(|l| l.class == sight.class && off([l.x, l.y], at) < within);
                assert!(near, "{yaw}: {sight:?} at {at:?}");
            }
        }
    }
}
