//! The flags for the playback of an animation, for every subcommand that writes one.

use rayfold_movie::Plays;

use crate::values;

/// `--loop`, `--once` and `--final-delay`.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(crate) struct Playback {
    /// How often to repeat the animation after it was shown once; 0 is for ever [default: as the animation.json beside the
    /// scripts or a single animated file says, or 0]
    #[arg(long = "loop", value_name = "TIMES", value_parser = values::repetitions, allow_negative_numbers = true)]
    loops: Option<u16>,
    /// Show the animation once: do not repeat it
    #[arg(long, conflicts_with = "loops")]
    once: bool,
    /// How long to show the last frame, before the animation starts again
    #[arg(long, value_name = "SECONDS", value_parser = values::hundredths, allow_negative_numbers = true)]
    final_delay: Option<u16>,
}

impl Playback {
    /// Returns whether a flag was given.
    pub(crate) fn is_given(&self) -> bool {
        self.once || self.loops.is_some() || self.final_delay.is_some()
    }

    /// Returns the number of repetitions, or `usual` if no flag sets it.
    pub(crate) fn plays(&self, usual: Plays) -> Plays {
        if self.once { Plays::Once } else { self.loops.map_or(usual, Plays::repeated) }
    }

    /// The frame rate or time in hundredths of a second.
    pub(crate) fn last_delay_cs(&self) -> Option<u16> {
        self.final_delay
    }
}
