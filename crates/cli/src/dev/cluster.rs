//! `rayfold dev --endpoint`: the functions on a bucket of an S3 server that is already running.

use anyhow::{Context, bail};
use rayfold_local::cluster::Bucket;
use rayfold_local::invoker::Invoker;
use rayfold_local::routes::Routes;
use rayfold_local::{Functions, notify};
use tokio::sync::mpsc::unbounded_channel;

use super::Args;
use super::news::News;
use super::stop::interrupted;
use crate::console::Console;
use crate::outcome::Outcome;

/// The environment variable with the token that the server sends with each call of the webhook.
const TOKEN: &str = "RAYFOLD_WEBHOOK_TOKEN";

/// Runs until a signal stops it.
pub(super) async fn serve(
    endpoint: &str,
    functions: Functions,
    args: &Args,
    console: &Console,
) -> anyhow::Result<Outcome> {
    let bucket = tokio::select! {
        bucket = Bucket::open(endpoint, &args.bucket) => bucket?,
        () = interrupted() => return Ok(Outcome::Interrupted),
    };
    let mut settings = bucket.settings(functions)?;
    args.apply(&mut settings);
    if let (Some(webhook), Some(arn)) = (args.webhook, &args.webhook_arn) {
        settings.webhook = webhook;
        settings.webhook_token = std::env::var(TOKEN)
            .with_context(|| format!("set {TOKEN} to the token of the server's webhook"))?;
        notify(bucket.store(), &Routes::shared().notifications(arn)).await.with_context(|| {
            format!("{endpoint} does not notify {arn}; without --webhook the bucket is listed alone")
        })?;
    }
    let (sender, mut seen) = unbounded_channel();
    let invoker = Invoker::start(settings, Some(sender)).await?;
    console
        .note(format_args!("running the functions on s3://{} at {endpoint}; Ctrl-C stops them", args.bucket));
    let mut news = News::new(console, bucket.store());
    let ended = loop {
        tokio::select! {
            observation = seen.recv() => match observation {
                Some(observation) => news.hear(&observation),
                None => bail!("the invoker has ended"),
            },
            () = news.tick() => news.look().await,
            () = interrupted() => break Ok(Outcome::Done),
        }
    };
    console.note("stopping");
    invoker.stop().await;
    ended
}
