//! Numbers: decimal, finite, exact.
//!
//! Reading is exact: the nearest 64-bit float, ties to even, as `str::parse` guarantees. Of the forms that it takes
//! the language leaves out the words (`inf`, `infinity`, `nan`); a point needs a digit on one side (`5.` and `.5` are
//! numbers, `.` is not). What is too small for a float is 0.

use super::report::{Fault, quoted};
use crate::diagnostic::Code;

/// Why a word is not a number of the language.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NumberFault {
    Malformed,
    TooLarge,
}

pub(super) fn parse(word: &str) -> Result<f64, NumberFault> {
    match word.parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        Ok(_) if word.bytes().any(|b| b.is_ascii_digit()) => Err(NumberFault::TooLarge),
        _ => Err(NumberFault::Malformed),
    }
}

impl NumberFault {
    /// What to tell about `word`, which stands in the place of `parameter`.
    pub(super) fn of(self, parameter: &str, word: &str) -> Fault {
        match self {
            Self::TooLarge => Fault::new(Code::NumberTooLarge, format!("{} is too large", quoted(word)))
                .expected(format!("expected `{parameter}`, a number up to 1.7e308")),
            Self::Malformed => {
                let fault = Fault::new(Code::NotANumber, format!("{} is not a number", quoted(word)))
                    .expected(format!("expected `{parameter}`, a number such as 2, -.5 or 1e-3"));
                match hint(word) {
                    Some(hint) => fault.help(hint),
                    None => fault,
                }
            }
        }
    }
}

/// What a slip of the keyboard or of another program would explain.
fn hint(word: &str) -> Option<String> {
    // Long words are no slips, and looking at them has a price.
    if word.len() > 100 {
        return None;
    }
    let odd = word.chars().find(|c| !c.is_ascii_graphic())?;
    let ascii: String = word
        .chars()
        .map(|c| if matches!(c, '\u{2010}'..='\u{2015}' | '\u{2212}') { '-' } else { c })
        .collect();
    if parse(&ascii).is_ok() {
        return Some(format!("this minus is U+{:04X}: write `-`", u32::from(odd)));
    }
    if odd.is_whitespace() {
        return Some(format!(
            "it contains the blank U+{:04X}: separate parameters by ordinary blanks",
            u32::from(odd)
        ));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(word: &str, expect: Result<f64, NumberFault>) {
        let got = parse(word);
        assert_eq!(got.map(f64::to_bits), expect.map(f64::to_bits), "{word:?}");
    }

    #[test]
    fn decimal_forms() {
        check("2", Ok(2.0));
        check("+2", Ok(2.0));
        check(".5", Ok(0.5));
        check("-.5", Ok(-0.5));
        check("5.", Ok(5.0));
        check("-1e-3", Ok(-0.001));
        check("1.E+2", Ok(100.0));
        check("007", Ok(7.0));
        check("-0", Ok(-0.0));
    }

    #[test]
    fn the_nearest_float_is_taken() {
        check("9007199254740993", Ok(9007199254740992.0));
        check("2.2250738585072011e-308", Ok(2.225073858507201e-308));
        check("1.7976931348623158e308", Ok(f64::MAX));
        check("4.9e-324", Ok(5e-324));
        check("1e-999", Ok(0.0));
        check("-1e-999", Ok(-0.0));
    }

    #[test]
    fn beyond_a_float_is_an_error() {
        check("1.7976931348623159e308", Err(NumberFault::TooLarge));
        check("-1e999", Err(NumberFault::TooLarge));
    }

    #[test]
    fn what_is_no_number() {
        for word in [
            "", "+", "-", ".", "+.", "e5", ".e5", "1e", "1e+", "--1", "+-1", "1.2.3", "0x10", "1_000", "1f",
            "1d3", "inf", "-inf", "infinity", "INF", "nan", "NaN", "+nan", "½", "١", "1\u{a0}", "1e1.5",
        ] {
            check(word, Err(NumberFault::Malformed));
        }
    }
}
