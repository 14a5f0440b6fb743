//! Colours that are written as `#rrggbb`, and the positions where they are allowed.

use super::{Field, Form, Kind, Presence};

/// The number of characters of a colour.
const LENGTH: usize = 7;

/// Returns the levels of the colour that is the first word of `text`: `#` and six hexadecimal digits.
///
/// ```
/// use rayfold_scene::color_levels;
///
/// assert_eq!(color_levels(b"#ff8000 .5"), Some([255, 128, 0]));
/// assert_eq!(color_levels(b"#ff80001"), None);
/// ```
pub fn color_levels(text: &[u8]) -> Option<[u8; 3]> {
    let digits = text.strip_prefix(b"#")?.get(..LENGTH - 1)?;
    let ends = text.get(LENGTH).is_none_or(|byte| b" \t,#():\r\n".contains(byte));
    if !ends || !digits.iter().all(u8::is_ascii_hexdigit) {
        return None;
    }
    let value = |digit: u8| (digit as char).to_digit(16).unwrap_or_default() as u8;
    Some([0, 1, 2].map(|i| 16 * value(digits[2 * i]) + value(digits[2 * i + 1])))
}

impl Field {
    /// Returns whether the parameter is a colour, which may be written as `#rrggbb`.
    pub fn is_color(&self) -> bool {
        matches!(self.kind, Kind::Color | Kind::Coefficients) && self.names.len() == 3
    }
}

impl Form {
    /// Returns whether a colour in the form `#rrggbb` may follow `count` numbers. It may for a required colour, and for
    /// an optional colour directly after another that is written in this form. A colour counts as three numbers.
    pub fn takes_color(&self, count: usize, is_behind_color: bool) -> bool {
        let mut start = 0;
        self.fields.iter().any(|field| {
            let first = start;
            start += field.names.len();
            let stands = field.presence == Presence::Required || is_behind_color;
            first == count && stands && field.is_color()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_colour_is_a_word_of_seven_characters() {
        for (text, levels) in [
            ("#000000", Some([0, 0, 0])),
            ("#Ff8001,2", Some([255, 128, 1])),
            ("#ff8001#", Some([255, 128, 1])),
            ("#ff800", None),
            ("#ff80012", None),
            ("#ff800g", None),
            ("# ff8001", None),
            ("ff8001", None),
            ("#ff8001ü", None),
            ("", None),
        ] {
            assert_eq!(color_levels(text.as_bytes()), levels, "{text}");
        }
    }
}
