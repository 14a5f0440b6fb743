//! How the values of flags are read, so that a wrong one is answered by what would be right.

use std::str::FromStr;

use rayfold_scene::{Samples, Screen};

/// A whole number of `1` or more.
///
/// # Errors
/// What was expected.
pub(crate) fn count<T: FromStr + Default + PartialEq>(text: &str) -> Result<T, String> {
    match text.parse::<T>() {
        Ok(number) if number != T::default() => Ok(number),
        _ => Err("expected a whole number, 1 or more".into()),
    }
}

/// How often an animation is repeated; 0 is for ever.
///
/// # Errors
/// What was expected.
pub(crate) fn repetitions(text: &str) -> Result<u16, String> {
    text.parse().map_err(|_| format!("expected a whole number from 0, which is for ever, to {}", u16::MAX))
}

/// A number of any size and sign; whoever takes it knows its bounds.
///
/// # Errors
/// What was expected.
pub(crate) fn rate(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(rate) if rate.is_finite() => Ok(rate),
        _ => Err("expected a number, such as 25 or 12.5".into()),
    }
}

/// Seconds as hundredths of one, which is how an animation counts.
///
/// # Errors
/// What was expected.
pub(crate) fn hundredths(text: &str) -> Result<u16, String> {
    let expected = "expected seconds from 0.02 to 655.35, such as 1.5";
    let value = text.parse::<f64>().map_err(|_| expected)? * 100.0;
    // Players slow a delay below two hundredths down to ten.
    if (2.0..=65_535.0).contains(&value.round()) { Ok(value.round() as u16) } else { Err(expected.into()) }
}

/// Rays a pixel and the error that is aimed at, as `64` or `64,0.5`.
///
/// # Errors
/// What was expected.
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

/// Width and height, as `640x480`.
///
/// # Errors
/// What was expected.
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
