//! `rayfold remove`: an animation out of the bucket, with all that was made of it.

use std::time::{Duration, Instant};

use rayfold_pipeline::keys::{Animation, Key};
use rayfold_pipeline::manifest::Status;
use rayfold_pipeline::store::{ListRequest, S3Store};

use super::upload::delete;
use super::watch::Watch;
use super::{BucketArgs, list, parse_animation, with_bucket};
use crate::console::Console;
use crate::outcome::Outcome;
use crate::wording::number;

/// How long the functions have to notice that the scripts are gone. They write an empty manifest then, which would come
/// back if it were removed before.
const NOTICE: Duration = Duration::from_secs(15);

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
    let animation = &args.animation;
    with_bucket(&args.bucket, async |store| {
        let scripts = of_animation(store, animation, &[animation.scripts()]).await?;
        let rest = rest(store, animation).await?;
        anyhow::ensure!(
            !scripts.is_empty() || !rest.is_empty(),
            "there is no animation {animation} in {}",
            store.bucket()
        );
        delete(store, &scripts).await?;
        let mut removed = scripts.len();
        let mut watch = Watch::new(store, animation);
        let start = Instant::now();
        watch.look().await?;
        let is_pending =
            |watch: &Watch| watch.manifest.as_ref().is_some_and(|m| m.head.status != Status::Empty);
        while !scripts.is_empty() && is_pending(&watch) && start.elapsed() < NOTICE {
            watch.pause().await;
            watch.look_patiently().await?;
        }
        // Whatever was under way may have left something since.
        loop {
            let rest = self::rest(store, animation).await?;
            if rest.is_empty() {
                break;
            }
            removed += rest.len();
            delete(store, &rest).await?;
        }
        console.note(format_args!("{animation}: {} removed", number(removed as u64, "object")));
        Ok(Outcome::Done)
    })
}

/// Everything but the scripts.
async fn rest(store: &S3Store, animation: &Animation) -> anyhow::Result<Vec<String>> {
    let prefixes = [
        animation.retries(),
        animation.parts(),
        format!("assemblies/{animation}/"),
        animation.frames(),
        animation.gif(),
        animation.manifest(),
    ];
    of_animation(store, animation, &prefixes).await
}

/// Keys below the prefixes that belong to this animation, and not to one whose name starts with it.
async fn of_animation(
    store: &S3Store,
    animation: &Animation,
    prefixes: &[String],
) -> anyhow::Result<Vec<String>> {
    let mut keys = Vec::new();
    for prefix in prefixes {
        let (listed, _) = list(store, ListRequest::all(prefix.clone())).await?;
        let is_ours = |key: &String| key.parse::<Key>().is_ok_and(|key| key.animation() == animation);
        keys.extend(listed.into_iter().map(|object| object.key).filter(is_ours));
    }
    Ok(keys)
}
