//! `rayfold retry`: drawing frames again.

use rayfold_pipeline::keys::Animation;
use rayfold_pipeline::retry::{Scope, retry};
use rayfold_pipeline::{Invocation, Policy, Randomness, SystemClock};

use super::{BucketArgs, must_exist, parse_animation, with_bucket};
use crate::console::Console;
use crate::outcome::Outcome;
use crate::wording::number;

/// Render frames of an animation again that failed or are missing
///
/// A script with an error fails again: correct it and submit it instead.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  rayfold retry hello --bucket my-bucket          what failed or is missing
  rayfold retry hello --bucket my-bucket --all    every frame, also those that are there")]
pub(crate) struct Args {
    /// The animation
    #[arg(value_parser = parse_animation)]
    animation: Animation,
    #[command(flatten)]
    bucket: BucketArgs,
    /// Every frame
    #[arg(long)]
    all: bool,
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let scope = if args.all { Scope::All } else { Scope::Failed };
    with_bucket(&args.bucket, async |store| {
        must_exist(store, &args.animation).await?;
        let (seed, request) = (fastrand::u64(..), format!("retry-{:016x}", fastrand::u64(..)));
        let (random, policy) = (Randomness::seeded(seed), Policy::new(rayfold_tracer::PIXEL_VERSION));
        let invocation = Invocation::new(store, &SystemClock, &random, &policy, &request);
        let retried = retry(&invocation, &args.animation, scope).await?;
        if retried.woken == 0 && !retried.reassembled {
            console.note(format_args!("{}: nothing failed and nothing is missing", args.animation));
        } else if retried.woken == 0 {
            console.note(format_args!("{} is assembled again", args.animation));
        } else {
            console.note(format_args!(
                "{}: {} rendered again; rayfold status {} --bucket {} --watch follows it",
                args.animation,
                number(retried.woken, "frame"),
                args.animation,
                store.bucket()
            ));
        }
        Ok(Outcome::Done)
    })
}
