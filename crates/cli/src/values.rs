//! Parsers for the values of flags. Their errors state what would be right.

use std::str::FromStr;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use rayfold_movie::Container;
use rayfold_scene::{Samples, Screen};

/// A container of animations, by the ending of its files.
pub(crate) fn container() -> impl TypedValueParser<Value = Container> {
    PossibleValuesParser::new(Container::ALL.map(Container::ending)).try_map(|word| word.parse::<Container>())
}

/// A whole number of `1` or more.
///
/// # Errors
/// The message says what was expected.
pub(crate) fn count<T: FromStr + Default + PartialEq>(text: &str) -> Result<T, String> {
    match text.parse::<T>() {
        Ok(number) if number != T::default() => Ok(number),
        _ => Err("expected a whole number, 1 or more".into()),
    }
}

/// Parses the number of repetitions of an animation; 0 is for ever.
///
/// # Errors
/// The message says what was expected.
pub(crate) fn repetitions(text: &str) -> Result<u16, String> {
    text.parse().map_err(|_| format!("expected a whole number from 0, which is for ever, to {}", u16::MAX))
}

/// Parses a number of any size and sign; the caller knows its bounds.
///
/// # Errors
/// The message says what was expected.
pub(crate) fn rate(text: &str) -> Result<f64, String> {
    let rate = text.parse::<f64>().ok().or_else(|| rayfold_scene::fraction(text));
    rate.filter(|rate| rate.is_finite())
        .ok_or_else(|| "expected a number, such as 25 or 12.5, or a fraction, such as 30000/1001".into())
}

/// Parses seconds into hundredths of a second, the unit of an animation.
///
/// # Errors
/// The message says what was expected.
pub(crate) fn hundredths(text: &str) -> Result<u16, String> {
    let expected = "expected seconds from 0.02 to 655.35, such as 1.5";
    let value = text.parse::<f64>().map_err(|_| expected)? * 100.0;
    // Players slow a delay below two hundredths down to ten.
    if (2.0..=65_535.0).contains(&value.round()) { Ok(value.round() as u16) } else { Err(expected.into()) }
}

/// Parses rays per pixel and the target error, such as `64` or `64,0.5`.
///
/// # Errors
/// The message says what was expected.
pub(crate) fn samples(text: &str) -> Result<Samples, String> {
    let expected =
        "expected rays a pixel, 1 or more, and after a comma the error in levels, such as 64 or 64,0.5";
    let (most, error) = match text.split_once(',') {
        Some((most, error)) => (most, error.parse().ok()),
        None => (text, Some(Samples::default().error())),
    };
    let (most, error) = most.parse().ok().zip(error).ok_or(expected)?;
    Samples::new(most, error).map_err(|_| expected.into())
}

/// Parses a size in bytes, such as `8M` or `500k`; a unit is a power of 1,000.
///
/// # Errors
/// The message says what was expected.
pub(crate) fn bytes(text: &str) -> Result<u64, String> {
    let expected = "expected a size such as 8M, 1.5MB or 500k";
    let lower = text.to_ascii_lowercase();
    let digits = lower.trim_end_matches('b');
    let (digits, unit) = match digits.strip_suffix(['k', 'm', 'g']) {
        Some(rest) if digits.ends_with('k') => (rest, 1e3),
        Some(rest) if digits.ends_with('m') => (rest, 1e6),
        Some(rest) => (rest, 1e9),
        None => (digits, 1.0),
    };
    let size = digits.trim_end().parse::<f64>().map_err(|_| expected)? * unit;
    if (1.0..=1e15).contains(&size) { Ok(size as u64) } else { Err(expected.into()) }
}

/// The levels of a colour, as `#rrggbb`.
///
/// # Errors
/// The message says what was expected.
pub(crate) fn color(text: &str) -> Result<[u8; 3], String> {
    let expected = "expected # and six hexadecimal digits in quotes, such as '#ffffff'";
    let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6 && digits.is_ascii());
    let digits = digits.ok_or(expected)?;
    let level = |at: usize| {
        digits
            .get(at..at + 2)
            .filter(|two| two.bytes().all(|digit| digit.is_ascii_hexdigit()))
            .and_then(|two| u8::from_str_radix(two, 16).ok())
            .ok_or(expected)
    };
    Ok([level(0)?, level(2)?, level(4)?])
}

/// Parses width and height, such as `640x480`.
///
/// # Errors
/// The message says what was expected.
pub(crate) fn size(text: &str) -> Result<Screen, String> {
    let sides = text.split_once(['x', 'X']).and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    let (width, height) = sides.ok_or("expected width and height in pixels, such as 640x480")?;
    Screen::new(width, height).map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_two_whole_numbers() {
        assert_eq!(size("640x480"), Ok(Screen::new(640, 480).unwrap()));
        for wrong in ["", "640", "640x", "0x480", "640x480x3", "-1x2", "6.4x3"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn rates_may_be_fractions() {
        assert_eq!(["25", "12.5", "30000/1001"].map(rate), [Ok(25.0), Ok(12.5), Ok(30_000.0 / 1_001.0)]);
        for wrong in ["", "x", "30000/", "/1001", "1/0", "1/2/3", "nan", "inf"] {
            assert!(rate(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn sizes_of_files_have_units() {
        let read = ["8M", "8 MB", "1.5m", "500k", "500kB", "2G", "12345", "12b"].map(bytes);
        let expect = [8_000_000, 8_000_000, 1_500_000, 500_000, 500_000, 2_000_000_000, 12_345, 12];
        assert_eq!(read, expect.map(Ok));
        for wrong in ["", "M", "0", "-8M", "8X", "eight", "nan", "inf", "1e99"] {
            assert!(bytes(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn counts_begin_at_one() {
        assert_eq!((count::<u64>("1"), count::<u16>("65535")), (Ok(1), Ok(65_535)));
        for wrong in ["0", "-1", "", "1.5", "65536", "many"] {
            assert!(count::<u16>(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn seconds_are_those_that_a_player_keeps_to() {
        let read = ["0.02", "1.5", "2", "655.35"].map(hundredths);
        assert_eq!(read, [Ok(2), Ok(150), Ok(200), Ok(65_535)]);
        for wrong in ["0", "0.01", "-1", "655.36", "nan", "inf", "long", ""] {
            assert!(hundredths(wrong).is_err(), "{wrong}");
        }
    }
}
