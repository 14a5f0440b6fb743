//! Animations in a bucket: sends scripts there, watches their progress, and gets frames and GIFs back.
//!
//! These subcommands add flags and texts to `rayfold-client`, which does the work. Credentials, region and endpoint
//! come from the standard AWS environment.

use std::sync::mpsc;
use std::time::Duration;

use anyhow::{Context, anyhow};
use rayfold_client as client;
pub(crate) use rayfold_client::address;
use rayfold_pipeline::keys::Animation;
use rayfold_pipeline::store::S3Store;
use rayfold_pipeline::{Error, SystemClock};

use crate::console::{Console, visible};
use crate::interrupt;

mod age;
pub(crate) mod fetch;
pub(crate) mod remove;
pub(crate) mod report;
pub(crate) mod retry;
pub(crate) mod status;
pub(crate) mod submit;

/// The time between two checks whether the run was asked to stop.
const LOOK: Duration = Duration::from_millis(50);

/// The maximum number of scripts that a message names.
const MAX_NAMED: usize = 20;

/// `--bucket`, for every subcommand that talks to one.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct BucketArgs {
    /// The bucket. Region, credentials and endpoint come from the standard AWS environment
    #[arg(long, env = "RAYFOLD_BUCKET", value_name = "NAME")]
    pub(crate) bucket: String,
}

/// The client of a bucket of S3.
pub(crate) type Client<'a> = rayfold_client::Client<'a, S3Store, SystemClock>;

/// A look at an animation in a bucket of S3.
pub(crate) type Watch<'a> = rayfold_client::Watch<'a, S3Store, SystemClock>;

/// Runs `work` on the bucket. The work is dropped when the run is asked to stop.
///
/// # Errors
/// The errors of the work, and an error if the environment does not say how to reach the bucket.
pub(crate) fn with_bucket<T>(
    args: &BucketArgs,
    work: impl AsyncFnOnce(Client<'_>) -> anyhow::Result<T>,
) -> anyhow::Result<T> {
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_all().build().context("cannot start")?;
    runtime.block_on(async {
        let work = async {
            let store = S3Store::from_environment(&args.bucket).await.map_err(client::Error::from)?;
            work(Client::new(&store, &SystemClock)).await
        };
        tokio::select! {
            result = work => result.map_err(|error| explain(error, &args.bucket)),
            () = interrupted() => anyhow::bail!("interrupted"),
        }
    })
}

/// Rewords an error of the client for users.
fn explain(error: anyhow::Error, bucket: &str) -> anyhow::Error {
    let Some(source) = error.downcast_ref::<client::Error>() else { return error };
    match source.explain(bucket) {
        Some(words) if source.is_of_store() => error.context(words),
        Some(words) => anyhow!(words),
        None => error,
    }
}

/// Shows `names`, up to [`MAX_NAMED`] of them, and asks the question. Returns `None` if there is no user to ask.
///
/// # Errors
/// Fails if the system refuses a thread.
async fn agree(names: &[String], question: &str, console: &Console) -> anyhow::Result<Option<bool>> {
    if !console.can_ask() {
        return Ok(None);
    }
    for name in names.iter().take(MAX_NAMED) {
        console.say(format_args!("  {}", visible(name)));
    }
    if names.len() > MAX_NAMED {
        console.say(format_args!("  and {} more", names.len() - MAX_NAMED));
    }
    console.ask(&format!("{} [y/N]", visible(question)));
    // On a thread that is left alone when the run is asked to stop: nothing ends the reading of a terminal.
    let (sender, receiver) = mpsc::channel();
    std::thread::Builder::new().name("answer".into()).spawn(move || {
        let mut answer = String::new();
        let _ = std::io::stdin().read_line(&mut answer);
        let _ = sender.send(answer);
    })?;
    loop {
        match receiver.try_recv() {
            Ok(answer) => return Ok(Some(is_yes(&answer))),
            Err(mpsc::TryRecvError::Empty) => tokio::time::sleep(LOOK).await,
            Err(mpsc::TryRecvError::Disconnected) => return Ok(Some(false)),
        }
    }
}

fn is_yes(answer: &str) -> bool {
    matches!(answer.trim().to_ascii_lowercase().as_str(), "y" | "yes")
}

/// Returns names in a row, up to [`MAX_NAMED`] of them.
fn named(names: &[String]) -> String {
    let mut text = names.iter().take(MAX_NAMED).map(String::as_str).collect::<Vec<_>>().join(", ");
    if names.len() > MAX_NAMED {
        text += &format!(" and {} more", names.len() - MAX_NAMED);
    }
    text
}

/// Returns the names of keys in their animation's folder.
fn names_of(keys: &[String], folder: &str) -> Vec<String> {
    keys.iter().map(|key| key.strip_prefix(folder).unwrap_or(key).to_owned()).collect()
}

async fn interrupted() {
    while !interrupt::stopping() {
        tokio::time::sleep(LOOK).await;
    }
}

/// Parses the name of an animation, for clap.
pub(crate) fn parse_animation(name: &str) -> Result<Animation, String> {
    Animation::new(name.trim_end_matches('/')).map_err(|error| match error {
        Error::Key { problem, .. } => problem.to_owned(),
        other => other.to_string(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_yes_is_a_yes() {
        for (answer, agreed) in
            [("y\n", true), ("YES\r\n", true), ("\n", false), ("", false), ("n", false), ("yeah", false)]
        {
            assert_eq!(is_yes(answer), agreed, "{answer:?}");
        }
    }

    #[test]
    fn long_lists_are_cut() {
        let names: Vec<String> = (1..=23).map(|n| n.to_string()).collect();
        assert!(named(&names).ends_with("19, 20 and 3 more"));
        assert_eq!(named(&names[..2]), "1, 2");
        let keys = ["scripts/film/a.txt".to_owned(), "elsewhere".to_owned()];
        assert_eq!(names_of(&keys, "scripts/film/"), ["a.txt", "elsewhere"]);
    }
}
