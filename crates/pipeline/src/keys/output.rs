//! The parts of keys that name an output of an animation.

use rayfold_scene::Container;

use super::Generation;

/// The start of the name of a mark.
const MARK: &str = "@output.";

/// Returns the name of the mark object: it records that there may be such a file.
pub(super) fn mark(output: Container) -> String {
    format!("{MARK}{}", output.ending())
}

/// Parses `<animation>/@output.<ending>`. A script's receipt has a tag after the `@`, which contains a hyphen.
pub(super) fn of_mark(rest: &str) -> Option<(&str, Container)> {
    let (animation, file) = rest.rsplit_once('/')?;
    Some((animation, file.strip_prefix(MARK)?.parse().ok()?))
}

/// Returns the generation, and the ending of the file unless it is a GIF.
pub(super) fn refusal(generation: &Generation, output: Container) -> String {
    match output {
        Container::Gif => generation.to_string(),
        other => format!("{generation}.{}", other.ending()),
    }
}

/// Reads what [`refusal`] writes.
pub(super) fn of_refusal(text: &str) -> Option<(Generation, Container)> {
    let (generation, output) = match text.split_once('.') {
        None => (text, Container::Gif),
        Some((generation, ending)) => {
            (generation, ending.parse().ok().filter(|output| *output != Container::Gif)?)
        }
    };
    Some((Generation::new(generation).ok()?, output))
}
