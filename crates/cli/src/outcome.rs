//! The outcome of a run, as its exit code.
//!
//! 0: done. 1: the input or the rendering failed, and standard error says why. 2: the command line is wrong. 128 and
//! the number of the signal (130, 143): interrupted; nothing half-written is left behind.

use std::process::ExitCode;

use crate::interrupt;

/// The end of a subcommand that has reported all of its errors. An unreported error is returned as an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// The subcommand did its work.
    Done,
    /// The subcommand failed, and has reported the reason.
    Failed,
    /// The run was asked to stop.
    Interrupted,
}

impl From<Outcome> for ExitCode {
    fn from(outcome: Outcome) -> Self {
        match outcome {
            Outcome::Done => Self::SUCCESS,
            Outcome::Failed => Self::from(1),
            Outcome::Interrupted => Self::from(u8::try_from(interrupt::exit_code()).unwrap_or(130)),
        }
    }
}

/// A combination of flags that clap itself cannot rule out. It ends the run with exit code 2.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct Usage(pub(crate) String);

/// Returns the exit code of an error that was not handled.
pub(crate) fn exit_code(error: &anyhow::Error) -> ExitCode {
    if error.is::<Usage>() { ExitCode::from(2) } else { Outcome::Failed.into() }
}
