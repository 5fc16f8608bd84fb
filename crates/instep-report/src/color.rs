//! Colours, and the few that every report shares so that the same thing looks the same everywhere.

/// An sRGB colour with straight (not premultiplied) opacity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Color {
    /// Red, 0 to 255.
    pub r: u8,
    /// Green, 0 to 255.
    pub g: u8,
    /// Blue, 0 to 255.
    pub b: u8,
    /// Opacity: 255 is opaque; less makes a ghost (a reference motion behind the real one).
    pub a: u8,
}

impl Color {
    /// White plastic: a robot's shells.
    pub const SHELL: Self = Self::rgb(0xe4e7ec);
    /// Dark grey: a robot's joints and feet.
    pub const JOINT: Self = Self::rgb(0x3d4452);
    /// Blue: the support leg, the measured signal.
    pub const BLUE: Self = Self::rgb(0x2f6fde);
    /// Orange: the swing leg, the thing to watch.
    pub const ORANGE: Self = Self::rgb(0xe8743b);
    /// Green: what was wanted, and what went well.
    pub const GREEN: Self = Self::rgb(0x2f9e6b);
    /// Red: limits, and what went wrong.
    pub const RED: Self = Self::rgb(0xd64550);
    /// Violet: a third signal.
    pub const VIOLET: Self = Self::rgb(0x8b5fd0);

    /// An opaque colour from `0xRRGGBB`.
    pub const fn rgb(hex: u32) -> Self {
        let [_, r, g, b] = hex.to_be_bytes();
        Self { r, g, b, a: 255 }
    }

    /// The same colour with opacity `alpha`, 0 (invisible) to 1 (opaque); values outside are clamped.
    #[must_use]
    pub fn with_alpha(self, alpha: f32) -> Self {
        // The cast saturates, and NaN becomes 0.
        Self { a: (alpha.clamp(0.0, 1.0) * 255.0).round() as u8, ..self }
    }

    /// `#rrggbb`, for style sheets; the opacity is left out.
    pub(crate) fn css(self) -> String {
        format!("#{:02x}{:02x}{:02x}", self.r, self.g, self.b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hex_and_alpha() {
        let c = Color::rgb(0x0180ff);
        assert_eq!((c.r, c.g, c.b, c.a), (1, 128, 255, 255));
        assert_eq!(c.css(), "#0180ff");
        assert_eq!(c.with_alpha(2.0).a, 255);
        assert_eq!(c.with_alpha(f32::NAN).a, 0);
    }
}
