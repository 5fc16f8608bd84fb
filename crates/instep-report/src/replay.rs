//! The 3-D replay: actors made of simple shapes, moved frame by frame.

use crate::Color;

/// Everything that moves, with one time axis for the 3-D view, its events and the plots.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Replay {
    /// The time of each frame, seconds from the start of the trial, rising. Need not be even: between frames the view
    /// interpolates, so 100 to 200 frames a second are plenty, also at a tenth of the speed.
    pub times: Vec<f64>,
    /// Robots, balls, goals. The camera follows the first one.
    pub actors: Vec<Actor>,
    /// Moments worth a tick on the time line and in the plots.
    pub events: Vec<Event>,
    /// The pitch; without one the ground is a plain floor with a 1 m grid.
    pub pitch: Option<Pitch>,
    /// Where the view starts; without one it is chosen from the first actor's size.
    pub camera: Option<Camera>,
}

/// A moment worth a tick.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// Seconds from the start of the trial.
    pub time: f64,
    /// A word or two, such as "touchdown".
    pub label: String,
}

/// Where the view starts. All angles are radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// The point looked at in the first frame, world frame, metres; while following it moves along with the first actor.
    pub target: [f32; 3],
    /// From target to eye, metres.
    pub distance: f32,
    /// Direction from target to eye about z: 0 looks from +x, pi/2 from +y.
    pub azimuth: f32,
    /// Height of the eye over the horizon.
    pub elevation: f32,
}

/// Something made of parts: a robot, a ball, a goal.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Actor {
    /// Shown in the view's legend.
    pub name: String,
    /// Added to every position, world frame, metres: puts two robots side by side. Usually zero.
    pub offset: [f32; 3],
    /// The solids.
    pub parts: Vec<Part>,
    /// Forces and other vectors.
    pub arrows: Vec<Arrow>,
}

/// One solid and where it is in each frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Its form and size.
    pub shape: Shape,
    /// Its colour; opacity below 255 makes a ghost that casts no shadow.
    pub color: Color,
    /// Its surface.
    pub finish: Finish,
    /// World from shape: one pose for each of [`Replay::times`], or a single one for what never moves.
    pub poses: Vec<Pose>,
}

/// The forms, as in MuJoCo: centred on the origin, long axis along local z, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// A ball.
    Sphere {
        /// Radius.
        radius: f32,
    },
    /// A cylinder with round ends.
    Capsule {
        /// Radius.
        radius: f32,
        /// Half the length of the cylindrical piece, along z, without the round ends.
        half_length: f32,
    },
    /// A cylinder with flat ends.
    Cylinder {
        /// Radius.
        radius: f32,
        /// Half the length, along z.
        half_length: f32,
    },
    /// A box.
    Box {
        /// Half the length of each side, along x, y, z.
        half_extents: [f32; 3],
    },
    /// An ellipsoid.
    Ellipsoid {
        /// Half axes along x, y, z.
        radii: [f32; 3],
    },
}

/// A surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Finish {
    /// One colour.
    #[default]
    Plain,
    /// White and black panels of a football, so that spin shows. Meant for spheres; the part's colour tints the white.
    Football,
}

/// World from shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// World frame, metres.
    pub position: [f32; 3],
    /// Unit quaternion `[w, x, y, z]`.
    pub rotation: [f32; 4],
}

impl Pose {
    /// A pose that is not turned.
    pub const fn at(position: [f32; 3]) -> Self {
        Self { position, rotation: [1.0, 0.0, 0.0, 0.0] }
    }
}

/// A vector that changes from frame to frame, drawn as an arrow: a contact force, a wanted direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrow {
    /// What it is, such as "left sole force".
    pub name: String,
    /// Its colour.
    pub color: Color,
    /// Metres drawn for one unit of the vector, such as 0.001 m/N.
    pub metres_per_unit: f32,
    /// One for each of [`Replay::times`], or a single one for what never moves.
    pub frames: Vec<ArrowFrame>,
}

/// One frame of an [`Arrow`]; a vector too short to see is not drawn.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ArrowFrame {
    /// The tail, world frame, metres.
    pub origin: [f32; 3],
    /// The vector, world frame, in its own unit (N for a force).
    pub vector: [f32; 3],
}

/// A green rectangle with lines, on z = 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Pitch {
    /// Middle of the pitch, world frame (x, y), metres.
    pub center: [f32; 2],
    /// Along world x, between the goal lines, metres.
    pub length: f32,
    /// Along world y, between the touch lines, metres.
    pub width: f32,
    /// Green strip outside the lines, metres.
    pub border: f32,
    /// Width of every line, metres (0.05 in the Humanoid League).
    pub line_width: f32,
    /// The lines, in the pitch's frame (origin in the middle). May be empty: plain green.
    pub markings: Vec<Marking>,
}

/// A white line on the pitch; coordinates are metres from the pitch's middle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Marking {
    /// A straight line.
    Line {
        /// One end.
        from: [f32; 2],
        /// The other end.
        to: [f32; 2],
    },
    /// Four straight lines.
    Rectangle {
        /// Lower corner in x and y.
        min: [f32; 2],
        /// Upper corner in x and y.
        max: [f32; 2],
    },
    /// A circle.
    Circle {
        /// Its middle.
        center: [f32; 2],
        /// Its radius.
        radius: f32,
    },
    /// A filled spot, as wide as two lines: the penalty mark.
    Spot {
        /// Its middle.
        center: [f32; 2],
    },
}

impl Pitch {
    /// Grass without lines, `length` by `width` metres about the world's origin.
    pub fn plain(length: f32, width: f32) -> Self {
        Self { center: [0.0; 2], length, width, border: 0.0, line_width: 0.05, markings: Vec::new() }
    }

    /// The kid-size pitch of the RoboCup Humanoid League rules of 2025: 9 m by 6 m, goal area 1 m by 3 m, penalty area
    /// 2 m by 5 m, penalty mark 1.5 m before the goal line, centre circle 1.5 m wide.
    pub fn kid_size() -> Self {
        Self::soccer([9.0, 6.0], [1.0, 3.0], [2.0, 5.0], 1.5, 1.5)
    }

    /// The adult-size pitch of the RoboCup Humanoid League rules of 2025: 14 m by 9 m, goal area 1 m by 4 m, penalty
    /// area 3 m by 6 m, penalty mark 2.1 m before the goal line, centre circle 3 m wide.
    pub fn adult_size() -> Self {
        Self::soccer([14.0, 9.0], [1.0, 4.0], [3.0, 6.0], 2.1, 3.0)
    }

    /// The same pitch with its middle at `center` (world x, y, metres).
    #[must_use]
    pub fn centered_at(mut self, center: [f32; 2]) -> Self {
        self.center = center;
        self
    }

    /// Markings of a pitch from its sizes, metres: each pair is along x, along y.
    fn soccer(field: [f32; 2], goal_area: [f32; 2], penalty_area: [f32; 2], mark: f32, circle_width: f32) -> Self {
        let [x, y] = [field[0] / 2.0, field[1] / 2.0];
        let mut markings = vec![
            Marking::Rectangle { min: [-x, -y], max: [x, y] },
            Marking::Line { from: [0.0, -y], to: [0.0, y] },
            Marking::Circle { center: [0.0, 0.0], radius: circle_width / 2.0 },
            Marking::Spot { center: [0.0, 0.0] },
        ];
        for [depth, width] in [goal_area, penalty_area] {
            let w = width / 2.0;
            markings.push(Marking::Rectangle { min: [-x, -w], max: [-x + depth, w] });
            markings.push(Marking::Rectangle { min: [x - depth, -w], max: [x, w] });
        }
        markings.push(Marking::Spot { center: [-x + mark, 0.0] });
        markings.push(Marking::Spot { center: [x - mark, 0.0] });
        Self { center: [0.0; 2], length: field[0], width: field[1], border: 1.0, line_width: 0.05, markings }
    }
}
