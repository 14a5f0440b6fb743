//! Animations in a bucket: sending scripts there, watching what becomes of them, and getting frames and GIFs back.
//!
//! All that these subcommands know they read off the bucket, as the functions do; there is no other service to ask.
//! Who and where comes from the standard AWS environment.

use std::time::Duration;

use anyhow::Context;
use rayfold_pipeline::Error;
use rayfold_pipeline::keys::Animation;
use rayfold_pipeline::store::{ListRequest, Listed, S3Store, Store};

use crate::interrupt;

pub(crate) mod fetch;
pub(crate) mod remove;
pub(crate) mod report;
pub(crate) mod retry;
pub(crate) mod status;
pub(crate) mod submit;
pub(crate) mod upload;
pub(crate) mod watch;

/// Requests of one kind that are under way at once.
pub(crate) const SIDE_BY_SIDE: usize = 32;

/// Between two looks at whether the run was told to stop.
const LOOK: Duration = Duration::from_millis(50);

/// `--bucket`, for every subcommand that talks to one.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct BucketArgs {
    /// The bucket. Region, credentials and endpoint come from the standard AWS environment
    #[arg(long, env = "RAYFOLD_BUCKET", value_name = "NAME")]
    pub(crate) bucket: String,
}

/// Does `work` on the bucket; it is dropped when the run is told to stop.
///
/// # Errors
/// Those of the work, and when the environment does not say how to reach the bucket.
pub(crate) fn with_bucket<T>(
    args: &BucketArgs,
    work: impl AsyncFnOnce(&S3Store) -> anyhow::Result<T>,
) -> anyhow::Result<T> {
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_all().build().context("cannot start")?;
    runtime.block_on(async {
        let work = async {
            let store = S3Store::from_environment(&args.bucket).await?;
            work(&store).await.map_err(|error| explain(error, &args.bucket))
        };
        tokio::select! {
            result = work => result,
            () = interrupted() => anyhow::bail!("interrupted"),
        }
    })
}

/// The store's own words seldom name the bucket, and never say where credentials come from.
fn explain(error: anyhow::Error, bucket: &str) -> anyhow::Error {
    let Some(Error::Refused { source, .. } | Error::Ambiguous { source, .. }) = error.downcast_ref() else {
        return error;
    };
    let words = source.to_string();
    let lacks_credentials = ["credentials", "IMDS"].iter().any(|word| words.contains(word));
    error.context(if lacks_credentials {
        format!(
            "bucket {bucket}: found no AWS credentials: set AWS_PROFILE, or AWS_ACCESS_KEY_ID and \
             AWS_SECRET_ACCESS_KEY"
        )
    } else {
        format!("bucket {bucket}")
    })
}

async fn interrupted() {
    while !interrupt::stopping() {
        tokio::time::sleep(LOOK).await;
    }
}

/// Everything below a prefix, page by page.
pub(crate) async fn list(
    store: &S3Store,
    first: ListRequest,
) -> rayfold_pipeline::Result<(Vec<Listed>, Vec<String>)> {
    let (mut objects, mut folders) = (Vec::new(), Vec::new());
    let mut continuation = None;
    loop {
        let page = store.list(ListRequest { continuation, ..first.clone() }).await?;
        objects.extend(page.objects);
        folders.extend(page.prefixes);
        continuation = page.next;
        if continuation.is_none() {
            return Ok((objects, folders));
        }
    }
}

/// What is there, or `None`.
pub(crate) fn found<T>(answer: rayfold_pipeline::Result<T>) -> rayfold_pipeline::Result<Option<T>> {
    match answer {
        Err(Error::NotFound { .. }) => Ok(None),
        answer => answer.map(Some),
    }
}

/// # Errors
/// When nothing shows that there is such an animation, or ever was.
pub(crate) async fn must_exist(store: &S3Store, animation: &Animation) -> anyhow::Result<()> {
    let has_manifest = found(store.get(&animation.manifest()).await)?.is_some();
    let page = store.list(ListRequest::level(animation.scripts())).await?;
    anyhow::ensure!(
        has_manifest || !page.objects.is_empty(),
        "there is no animation {animation} in {}",
        store.bucket()
    );
    Ok(())
}

/// For clap: the name of an animation.
pub(crate) fn parse_animation(name: &str) -> Result<Animation, String> {
    Animation::new(name.trim_end_matches('/')).map_err(|error| match error {
        Error::Key { problem, .. } => problem.to_owned(),
        other => other.to_string(),
    })
}

/// Where an object lies, for people.
pub(crate) fn address(store: &S3Store, key: &str) -> String {
    format!("s3://{}/{key}", store.bucket())
}
