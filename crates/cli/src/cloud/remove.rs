//! `rayfold remove`: removes an animation and everything made of it from the bucket.

use rayfold_client::Contents;
use rayfold_pipeline::keys::Animation;

use super::{BucketArgs, agree, named, names_of, parse_animation, with_bucket};
use crate::console::{Console, visible};
use crate::outcome::Outcome;
use crate::wording::number;

/// Remove an animation from the bucket: its scripts, its frames, its GIF
///
/// Shows at a terminal what there is, and asks. What is removed does not come back.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  rayfold remove hello --bucket my-bucket
      asks
  rayfold remove hello --bucket my-bucket --dry-run
      shows what would go
  rayfold remove hello --bucket my-bucket --delete
      does not ask")]
pub(crate) struct Args {
    /// The animation
    #[arg(value_parser = parse_animation)]
    animation: Animation,
    #[command(flatten)]
    bucket: BucketArgs,
    /// Delete without asking
    #[arg(long)]
    delete: bool,
    /// Show what would be deleted, and delete nothing
    #[arg(long, conflicts_with = "delete")]
    dry_run: bool,
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let animation = &args.animation;
    with_bucket(&args.bucket, async |client| {
        if args.dry_run {
            let Contents { scripts, made } = client.contents(animation).await?;
            let keys = scripts.iter().chain(&made);
            console.print(keys.map(|key| format!("delete {}\n", visible(key))).collect::<String>())?;
            let count = number((scripts.len() + made.len()) as u64, "object");
            console.note(format_args!("{animation}: {count} would be removed"));
            return Ok(Outcome::Done);
        }
        if !args.delete {
            let Contents { scripts, made } = client.contents(animation).await?;
            let names = names_of(&scripts, &animation.scripts());
            let what = format!(
                "{} and {} made of them",
                number(scripts.len() as u64, "uploaded file"),
                number(made.len() as u64, "object")
            );
            match agree(&names, &format!("Remove {animation}: {what}?"), console).await? {
                Some(true) => {}
                Some(false) => anyhow::bail!("nothing was removed"),
                None => anyhow::bail!(
                    "{animation} has {what} ({}); nothing was removed: give --delete to remove all",
                    named(&names)
                ),
            }
        }
        let removed = client.remove(animation, |_| {}).await?;
        console.note(format_args!("{animation}: {} removed", number(removed, "object")));
        Ok(Outcome::Done)
    })
}
