//! Colours that are written as `#rrggbb`, and where one may stand.

use super::{Field, Form, Kind, Presence};
use crate::command::{Command, Effect};
use crate::model::Clause;

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
    /// Returns whether a colour as `#rrggbb` may stand after `count` numbers: where a colour must stand, and where one
    /// may stand right behind another that is written so. A colour counts as three numbers.
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

impl Command {
    /// Returns whether a colour as `#rrggbb` may stand after these parameters, without the name before them. A colour
    /// is three equal words.
    pub fn takes_color(self, words: &[&str]) -> bool {
        let is_behind_color = words.last().is_some_and(|word| word.starts_with('#'));
        if !matches!(self.effect(), Effect::Material) {
            return self.form().takes_color(words.len(), is_behind_color);
        }
        let clauses = words.iter().map(|word| Clause::from_name(word)).enumerate();
        let last = clauses.filter_map(|(at, clause)| Some((at, clause?))).last();
        last.is_some_and(|(at, clause)| clause.form().takes_color(words.len() - at - 1, is_behind_color))
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

    #[test]
    fn colours_stand_where_one_must_or_behind_one_written_so() {
        let check = |command: Command, words: &str, expect: bool| {
            let words: Vec<_> = words.split_whitespace().collect();
            assert_eq!(command.takes_color(&words), expect, "{command} {words:?}");
        };
        check(Command::Background, "", true);
        check(Command::Background, "1 2 3", false);
        check(Command::Background, "#112233 #112233 #112233", true);
        check(Command::Sphere, "1 0 0 0", true);
        check(Command::Sphere, "1 0 0", false);
        check(Command::Sphere, "1 0 0 0 1 2 3 #112233 #112233 #112233", true);
        check(Command::Sphere, "1 0 0 0 1 2 3 1 2 3", false);
        check(Command::Ilight, "", true);
        check(Command::Ilight, "#112233 #112233 #112233", false);
        check(Command::Material, "", false);
        check(Command::Material, "diffuse", true);
        check(Command::Material, "diffuse #112233 #112233 #112233", false);
        check(Command::Material, "diffuse 1 2 3 shine", true);
        check(Command::Material, "checker", false);
    }
}
