//! The subcommands that serve, use a bucket, or estimate its cost: the feature `network`.
//!
//! They take most of the time of a first build, so the renderer can be built without them.

use clap::Subcommand;

use crate::cloud::{fetch, remove, retry, status, submit};
use crate::console::Console;
#[cfg(unix)]
use crate::dev;
use crate::outcome::Outcome;
use crate::{cost, interrupt, studio};

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Studio(studio::Args),
    Cost(cost::Args),
    Submit(submit::Args),
    Status(status::Args),
    Fetch(fetch::Args),
    Retry(retry::Args),
    Remove(remove::Args),
    #[cfg(unix)]
    Dev(dev::Args),
}

impl Command {
    pub(crate) fn run(self, console: &Console) -> anyhow::Result<Outcome> {
        match self {
            Self::Studio(args) => studio::run(&args, console),
            Self::Cost(args) => cost::run(&args, console),
            Self::Submit(args) => submit::run(&args, console),
            Self::Status(args) => status::run(&args, console),
            Self::Fetch(args) => fetch::run(&args, console),
            Self::Retry(args) => retry::run(&args, console),
            Self::Remove(args) => remove::run(&args, console),
            #[cfg(unix)]
            Self::Dev(args) => {
                // The store and the functions are programs of their own.
                interrupt::patience();
                dev::run(&args, console)
            }
        }
    }
}
