//! From a scene to what a stereo camera delivers: colour, depth with its faults, and the truth behind each pixel.
//!
//! One ray a pixel: ground, walls and ceiling in closed form ([`ground`]), bodies by exact intersection inside the
//! rectangle that they can cover ([`solid`]), then what the camera does to light ([`lens`]) and to depth ([`stereo`]).
//! No GPU, no system package, no thread, no clock: the same scene gives the same bytes.

mod ground;
mod lens;
mod noise;
mod solid;
mod stereo;

use instep_field::Field;

use crate::camera::Camera;
use crate::picture::{Depth, Frame};
use crate::scene::Scene;

pub(crate) use ground::LineMap;
use noise::Noise;

/// Red, green and blue light of each pixel.
type Light = [Vec<f32>; 3];

/// A function that is also compiled for AVX2. Nothing is fused, so its bytes are the same with and without.
macro_rules! also_wide {
    ($name:ident, $body:ident, ($($arg:ident: $kind:ty),*) $(-> $out:ty)?) => {
        pub(super) fn $name($($arg: $kind),*) $(-> $out)? {
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx2")]
                fn wide($($arg: $kind),*) $(-> $out)? {
                    $body($($arg),*)
                }
                if is_x86_feature_detected!("avx2") {
                    // SAFETY: the processor has what the function is compiled for.
                    return unsafe { wide($($arg),*) };
                }
            }
            $body($($arg),*)
        }
    };
}
use also_wide;

/// A renderer for one camera on one field. Its buffers are kept between frames.
#[derive(Debug, Clone)]
pub struct Renderer {
    camera: Camera,
    lines: LineMap,
    noise: Noise,
    light: Light,
    spare: Light,
    depth: Vec<f32>,
    things: Vec<u16>,
}

/// What is seen, and what is there.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// What the camera delivers.
    pub frame: Frame,
    /// What the stereo camera delivers; NaN where it has nothing.
    pub depth: Depth,
    /// The true depth of each pixel, m.
    pub true_depth: Vec<f32>,
    /// Which thing each pixel shows, as [`crate::scene::Solid::thing`]; [`View::GROUND`] for the field's ground.
    pub things: Vec<u16>,
}

impl View {
    /// The mark of the ground in [`View::things`].
    pub const GROUND: u16 = u16::MAX;
}

impl Renderer {
    /// For `camera` on `field`.
    pub fn new(camera: Camera, field: &Field) -> Self {
        let pixels = camera.width * camera.height;
        Renderer {
            camera,
            lines: LineMap::new(field),
            noise: Noise::new(),
            light: std::array::from_fn(|_| vec![0.0; pixels]),
            spare: std::array::from_fn(|_| vec![0.0; pixels]),
            depth: vec![0.0; pixels],
            things: vec![0; pixels],
        }
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Renders a scene.
    pub fn render(&mut self, scene: &Scene) -> View {
        let Renderer { camera, lines, noise, light, spare, depth, things } = self;
        ground::draw(camera, scene, lines, noise, light, depth, things);
        solid::draw(camera, scene, light, depth, things);
        let frame = lens::expose(camera, &scene.look, scene.seed, noise, light, spare);
        let seen = stereo::depth(camera, scene.seed, noise, depth);
        View { frame, depth: seen, true_depth: depth.clone(), things: things.clone() }
    }
}
