//! `rayfold remove`: an animation out of the bucket, with all that was made of it.

use rayfold_pipeline::keys::Animation;

use super::{BucketArgs, parse_animation, with_bucket};
use crate::console::Console;
use crate::outcome::Outcome;
use crate::wording::number;

/// Remove an animation from the bucket: its scripts, its frames, its GIF
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  rayfold remove hello --bucket my-bucket")]
pub(crate) struct Args {
    /// The animation
    #[arg(value_parser = parse_animation)]
    animation: Animation,
    #[command(flatten)]
    bucket: BucketArgs,
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    with_bucket(&args.bucket, async |client| {
        let removed = client.remove(&args.animation, |_| {}).await?;
        console.note(format_args!("{}: {} removed", args.animation, number(removed, "object")));
        Ok(Outcome::Done)
    })
}
