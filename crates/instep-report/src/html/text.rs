//! Text that goes into a page: escaping, slots, base64, short numbers.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

/// Text for HTML content and quoted attributes.
pub(super) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            '"' => escaped += "&quot;",
            '\'' => escaped += "&#39;",
            other => escaped.push(other),
        }
    }
    escaped
}

/// JSON that may stand inside a script element: no `<` can end the element or open a comment. In JSON these characters
/// occur in strings only, where the escape means the same.
pub(super) fn json_in_script(json: &str) -> String {
    json.replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026")
}

/// The template with each `{{slot}}` replaced. What is filled in is not searched again, so a title that reads
/// `{{data}}` stays one.
pub(super) fn fill(template: &str, mut content: impl FnMut(&str) -> String) -> String {
    let mut filled = String::new();
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        filled += before;
        let Some((slot, tail)) = after.split_once("}}") else {
            rest = after;
            break;
        };
        filled += &content(slot);
        rest = tail;
    }
    filled + rest
}

/// Base64 of the values as little-endian f32.
pub(super) fn base64_f32(values: impl IntoIterator<Item = f32>) -> String {
    let bytes: Vec<u8> = values.into_iter().flat_map(f32::to_le_bytes).collect();
    STANDARD.encode(bytes)
}

/// The value with six significant digits, more than a plot can show; `None` (a gap) if it is not finite.
pub(super) fn short(value: f64) -> Option<f64> {
    let rounded: f64 = format!("{value:.5e}").parse().ok()?;
    // JSON would write -0.0 with its sign.
    rounded.is_finite().then_some(if rounded == 0.0 { 0.0 } else { rounded })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slots_in_what_is_filled_in_stay() {
        assert_eq!(fill("a{{x}}b{{y}}c", |slot| format!("[{slot}{{{{x}}}}]")), "a[x{{x}}]b[y{{x}}]c");
    }

    #[test]
    fn base64_round_trip() {
        let values = [0.0f32, -1.5, f32::MIN_POSITIVE, 3.402_823e38, 0.1];
        let bytes = STANDARD.decode(base64_f32(values)).unwrap();
        let back: Vec<f32> = bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
        assert_eq!(back, values);
    }

    #[test]
    fn short_numbers() {
        assert_eq!(short(1.234_567_89), Some(1.23457));
        assert_eq!(short(-123_456_789.0), Some(-123_457_000.0));
        assert_eq!(short(-0.0).map(f64::is_sign_negative), Some(false));
        assert_eq!(short(f64::NAN), None);
        assert_eq!(short(f64::NEG_INFINITY), None);
    }
}
