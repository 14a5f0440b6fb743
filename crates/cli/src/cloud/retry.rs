//! `rayfold retry`: drawing frames again.

use std::cell::Cell;

use rayfold_pipeline::Randomness;
use rayfold_pipeline::keys::Animation;
use rayfold_pipeline::retry::Scope;

use super::{BucketArgs, parse_animation, with_bucket};
use crate::console::Console;
use crate::outcome::Outcome;
use crate::wording::number;

/// Render frames of an animation again that failed or are missing
///
/// A script with an error fails again: correct it and submit it instead. If it is interrupted, also with --all, the same
/// command without --all renders what is then missing.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  rayfold retry hello --bucket my-bucket
      what failed or is missing
  rayfold retry hello --bucket my-bucket --all
      every frame, also those that are there")]
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
    let (animation, bucket) = (&args.animation, &args.bucket.bucket);
    let may_be_half_done = Cell::new(false);
    let done = with_bucket(&args.bucket, async |client| {
        let random = Randomness::seeded(fastrand::u64(..));
        client.must_exist(animation).await?;
        may_be_half_done.set(true);
        let retried = client.retry(animation, scope, rayfold_tracer::PIXEL_VERSION, &random).await?;
        if retried.woken == 0 && !retried.reassembled {
            console.note(format_args!("{animation}: nothing failed and nothing is missing"));
        } else if retried.woken == 0 {
            console.note(format_args!("{animation} is assembled again"));
        } else {
            console.note(format_args!(
                "{animation}: {} rendered again; rayfold status {animation} --bucket {} --watch follows it",
                number(retried.woken, "frame"),
                bucket
            ));
        }
        Ok(Outcome::Done)
    });
    if done.is_err() && may_be_half_done.get() {
        console.note(format_args!(
            "{animation}: frames may have been deleted, and not all of them are rendered again yet: rayfold retry \
             {animation} --bucket {bucket} renders what is missing"
        ));
    }
    done
}
