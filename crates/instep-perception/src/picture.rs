//! Pictures: a colour frame and its depth map, and how they come from and go to files.

use std::path::Path;

use crate::PerceptionError;

/// A colour frame, 8 bits a channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// Pixels in a row.
    pub width: usize,
    /// Pixels in a column.
    pub height: usize,
    /// Red, green, blue of each pixel, row by row from the top.
    pub rgb: Vec<u8>,
}

/// A depth map: the distance along the optical axis of each pixel, m; infinity where it is too far to tell, minus infinity
/// where it is too near, NaN where the camera has none for another reason (or does not tell the reason).
#[derive(Debug, Clone, PartialEq)]
pub struct Depth {
    /// Pixels in a row.
    pub width: usize,
    /// Pixels in a column.
    pub height: usize,
    /// Row by row from the top, m.
    pub meters: Vec<f32>,
}

impl Frame {
    /// A black frame.
    pub fn new(width: usize, height: usize) -> Self {
        Frame { width, height, rgb: vec![0; width * height * 3] }
    }

    /// One pixel; the nearest for a place outside the frame.
    pub fn pixel(&self, x: usize, y: usize) -> [u8; 3] {
        let i = 3 * (y.min(self.height.saturating_sub(1)) * self.width + x.min(self.width.saturating_sub(1)));
        self.rgb.get(i..i + 3).map_or([0; 3], |p| [p[0], p[1], p[2]])
    }

    /// Reads a PNG or JPEG image.
    ///
    /// # Errors
    /// [`PerceptionError::File`] naming the file.
    pub fn load(path: &Path) -> Result<Self, PerceptionError> {
        let bytes = std::fs::read(path).map_err(|e| PerceptionError::file(path, e))?;
        let picture = image::load_from_memory(&bytes)
            .map_err(|e| PerceptionError::file(path, format!("{e}; expected a PNG or JPEG image")))?
            .into_rgb8();
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        if width == 0 || height == 0 {
            return Err(PerceptionError::file(path, "an image without pixels"));
        }
        Ok(Frame { width, height, rgb: picture.into_raw() })
    }

    /// As a PNG file's bytes.
    pub fn png(&self) -> Vec<u8> {
        encode(&self.rgb, self.width, self.height, image::ExtendedColorType::Rgb8)
    }

    /// Scaled by bilinear interpolation (area-averaged where it shrinks) into `width` x `height`.
    #[must_use]
    pub fn resized(&self, width: usize, height: usize) -> Frame {
        if (width, height) == (self.width, self.height) || self.rgb.is_empty() {
            return self.clone();
        }
        let side = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        let Some(buffer) = image::RgbImage::from_raw(side(self.width), side(self.height), self.rgb.clone()) else {
            return Frame::new(width, height);
        };
        let scaled = image::imageops::resize(&buffer, side(width), side(height), image::imageops::FilterType::Triangle);
        Frame { width, height, rgb: scaled.into_raw() }
    }
}

impl Depth {
    /// As a picture for people: near is bright, no depth is black.
    pub fn picture(&self, farthest: f32) -> Frame {
        let mut frame = Frame::new(self.width, self.height);
        for (pixel, &z) in frame.rgb.chunks_exact_mut(3).zip(&self.meters) {
            if z.is_finite() {
                // Blue (far) through green to red (near).
                let near = (1.0 - z / farthest).clamp(0.0, 1.0);
                let level = |x: f32| (255.0 * x.clamp(0.0, 1.0)) as u8;
                pixel.copy_from_slice(&[
                    level(2.0 * near - 0.8),
                    level(1.2 - (2.0 * near - 1.0).abs()),
                    level(1.0 - near),
                ]);
            }
        }
        frame
    }
}

fn encode(bytes: &[u8], width: usize, height: usize, color: image::ExtendedColorType) -> Vec<u8> {
    use image::ImageEncoder as _;
    let mut out = Vec::new();
    let side = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    // Into memory only a picture of a wrong length can fail, and ours has its own.
    let _ = image::codecs::png::PngEncoder::new(&mut out).write_image(bytes, side(width), side(height), color);
    out
}
