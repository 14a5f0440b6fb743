//! Numbers: decimal, finite, exact.
//!
//! Parsing is exact: the result is the nearest 64-bit float, ties to even, as `str::parse` guarantees. The language
//! does not accept the words that `str::parse` does (`inf`, `infinity`, `nan`). A point needs a digit on one side
//! (`5.` and `.5` are numbers, `.` is not). A number too small for a float is 0.

/// The reason why a word is not a number of the language.
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
