//! The limits of scripts, from the function's environment.
//!
//! Every upload costs the owner of the account money, and a script too large for the function's memory fails three
//! times before it is given up. So the limits are settings of the stack. This module knows only names and numbers;
//! [`Limits`] defines their meaning.

use std::num::{NonZeroU32, NonZeroU64};

use anyhow::Context as _;
use rayfold_scene::Limits;

use crate::capacity::{Capacity, MAX_BANDS};

/// Reads the default limits, as changed by the variables that `variable` finds: `RAYFOLD_MAX_SCRIPT_BYTES`,
/// `RAYFOLD_MAX_OBJECTS`, `RAYFOLD_MAX_LIGHTS`, `RAYFOLD_MAX_PIXELS` and `RAYFOLD_MAX_FRAMES` (of one script).
///
/// # Errors
/// Returns an error if a variable is no whole number of at least 1.
pub(crate) fn limits(variable: impl Fn(&str) -> Option<String>) -> anyhow::Result<Limits> {
    let default = Limits::default();
    let number = |name: &str| number(&variable, name);
    let size =
        |name: &str| Ok::<_, anyhow::Error>(number(name)?.map(|n| usize::try_from(n).unwrap_or(usize::MAX)));
    Ok(Limits {
        max_script_bytes: size("RAYFOLD_MAX_SCRIPT_BYTES")?.unwrap_or(default.max_script_bytes),
        max_objects: size("RAYFOLD_MAX_OBJECTS")?.unwrap_or(default.max_objects),
        max_lights: size("RAYFOLD_MAX_LIGHTS")?.unwrap_or(default.max_lights),
        max_pixels: number("RAYFOLD_MAX_PIXELS")?.unwrap_or(default.max_pixels),
        // Each frame is an invocation, so there is a limit even by default.
        max_frames: size("RAYFOLD_MAX_FRAMES")?.or(usize::try_from(Limits::FRAMES).ok()),
        max_described: default.max_described,
    })
}

/// Reads the largest number of frames of an animation from `RAYFOLD_MAX_ANIMATION_FRAMES`. `None` means no limit.
///
/// # Errors
/// Returns an error if the variable is no whole number of at least 1.
pub(crate) fn most_frames(variable: impl Fn(&str) -> Option<String>) -> anyhow::Result<Option<u64>> {
    number(&variable, "RAYFOLD_MAX_ANIMATION_FRAMES")
}

/// Reads the capacity of an invocation: its memory in megabytes from Lambda's own `AWS_LAMBDA_FUNCTION_MEMORY_SIZE`,
/// and the largest number of bands of a frame from `RAYFOLD_MAX_BANDS`.
///
/// # Errors
/// Returns an error if one of them is no whole number of at least 1.
pub(crate) fn capacity(variable: impl Fn(&str) -> Option<String>) -> anyhow::Result<Capacity> {
    let megabytes = number(&variable, "AWS_LAMBDA_FUNCTION_MEMORY_SIZE")?;
    let bands = number(&variable, "RAYFOLD_MAX_BANDS")?.map(|bands| u32::try_from(bands).unwrap_or(u32::MAX));
    Ok(Capacity {
        memory: megabytes.map(|megabytes| megabytes.saturating_mul(1 << 20)),
        most_bands: bands.and_then(NonZeroU32::new).unwrap_or(MAX_BANDS),
    })
}

fn number(variable: impl Fn(&str) -> Option<String>, name: &str) -> anyhow::Result<Option<u64>> {
    let Some(text) = variable(name) else { return Ok(None) };
    let number: NonZeroU64 =
        text.parse().with_context(|| format!("{name}={text}: expected a whole number of at least 1"))?;
    Ok(Some(number.get()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(name: &'static str, text: &'static str) -> anyhow::Result<Limits> {
        limits(|asked| (asked == name).then(|| text.to_owned()))
    }

    #[test]
    fn without_variables_the_defaults_hold() {
        let expected = Limits { max_frames: Some(1_000_000), ..Limits::default() };
        assert_eq!(limits(|_| None).unwrap(), expected);
        assert_eq!(most_frames(|_| None).unwrap(), None);
    }

    #[test]
    fn each_variable_sets_its_limit_and_no_other() {
        let default = limits(|_| None).unwrap();
        for (name, expected) in [
            ("RAYFOLD_MAX_SCRIPT_BYTES", Limits { max_script_bytes: 7, ..default }),
            ("RAYFOLD_MAX_OBJECTS", Limits { max_objects: 7, ..default }),
            ("RAYFOLD_MAX_LIGHTS", Limits { max_lights: 7, ..default }),
            ("RAYFOLD_MAX_PIXELS", Limits { max_pixels: 7, ..default }),
            ("RAYFOLD_MAX_FRAMES", Limits { max_frames: Some(7), ..default }),
        ] {
            assert_eq!(with(name, "7").unwrap(), expected, "{name}");
        }
        let of_animations = |name: &str| (name == "RAYFOLD_MAX_ANIMATION_FRAMES").then(|| "7".to_owned());
        assert_eq!((limits(of_animations).unwrap(), most_frames(of_animations).unwrap()), (default, Some(7)));
    }

    #[test]
    fn what_an_invocation_bears_is_what_lambda_and_the_stack_say() {
        let of = |asked: &str| match asked {
            "AWS_LAMBDA_FUNCTION_MEMORY_SIZE" => Some("1769".to_owned()),
            "RAYFOLD_MAX_BANDS" => Some("7".to_owned()),
            _ => None,
        };
        let expected = Capacity { memory: Some(1769 << 20), most_bands: NonZeroU32::new(7).unwrap() };
        assert_eq!(capacity(of).unwrap(), expected);
        assert_eq!(capacity(|_| None).unwrap(), Capacity::default());
        assert!(capacity(|name| (name == "RAYFOLD_MAX_BANDS").then(|| "0".to_owned())).is_err());
    }

    #[test]
    fn what_is_no_limit_is_named() {
        for text in ["0", "-1", "many", "1.5", ""] {
            let error = with("RAYFOLD_MAX_OBJECTS", text).unwrap_err();
            assert!(
                format!("{error:#}").starts_with(&format!("RAYFOLD_MAX_OBJECTS={text}: expected")),
                "{error:#}"
            );
        }
    }

    /// The stack must set variables that are read here, and all of them.
    #[test]
    fn the_stack_sets_these_variables() {
        let stack = include_str!("../../../infra/terraform/functions.tf");
        let mut set: Vec<_> =
            stack.split_whitespace().filter(|word| word.starts_with("RAYFOLD_MAX_")).collect();
        set.sort_unstable();
        let read = std::cell::RefCell::new(Vec::new());
        let note = |name: &str| {
            read.borrow_mut().push(name.to_owned());
            None
        };
        limits(note).unwrap();
        most_frames(note).unwrap();
        capacity(note).unwrap();
        let mut read = read.into_inner();
        read.retain(|name| name.starts_with("RAYFOLD_"));
        read.sort_unstable();
        assert_eq!(set, read);
    }
}
