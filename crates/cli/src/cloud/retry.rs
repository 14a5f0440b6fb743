//! `rayfold retry`: drawing frames again.

use rayfold_pipeline::Randomness;
use rayfold_pipeline::keys::Animation;
use rayfold_pipeline::retry::Scope;

use super::{BucketArgs, parse_animation, with_bucket};
use crate::console::Console;
use crate::outcome::Outcome;
use crate::wording::number;

/// Render frames of an animation again that failed or are missing
///
/// A script with an error fails again: correct it and submit it instead.
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
    let animation = &args.animation;
    with_bucket(&args.bucket, async |client| {
        let random = Randomness::seeded(fastrand::u64(..));
        let retried = client.retry(animation, scope, rayfold_tracer::PIXEL_VERSION, &random).await?;
        if retried.woken == 0 && !retried.reassembled {
            console.note(format_args!("{animation}: nothing failed and nothing is missing"));
        } else if retried.woken == 0 {
            console.note(format_args!("{animation} is assembled again"));
        } else {
            console.note(format_args!(
                "{animation}: {} rendered again; rayfold status {animation} --bucket {} --watch follows it",
                number(retried.woken, "frame"),
                args.bucket.bucket
            ));
        }
        Ok(Outcome::Done)
    })
}
