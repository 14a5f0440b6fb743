//! The store as a process of its own, for conformance tests and for killing it in the middle.
//!
//! The root key is taken from `AWS_ACCESS_KEY_ID` and `AWS_SECRET_ACCESS_KEY`. The address is printed as the first line
//! of standard output when requests are answered; SIGINT or SIGTERM ends it in order.

use std::io::Write;
use std::net::SocketAddr;
use std::path::PathBuf;

use anyhow::Context;
use clap::Parser;
use rayfold_bucket::{Credentials, Options, Server, Webhook};

#[derive(Parser)]
#[command(version, about = "An S3-compatible object store in a folder")]
struct Args {
    /// The folder, made when missing
    #[arg(long)]
    data: PathBuf,
    /// Where to listen; port 0 is any free one
    #[arg(long, default_value = "127.0.0.1:0")]
    address: SocketAddr,
    /// What the buckets' location is
    #[arg(long, env = "AWS_REGION", default_value = "us-east-1")]
    region: String,
    /// Where events go, `http://…`
    #[arg(long, requires = "webhook_token")]
    webhook: Option<String>,
    /// Sent with each event as `Authorization: Bearer <token>`
    #[arg(long, env = "RAYFOLD_BUCKET_WEBHOOK_TOKEN", hide_env_values = true)]
    webhook_token: Option<String>,
    #[arg(long, env = "AWS_ACCESS_KEY_ID", hide = true)]
    access_key: String,
    #[arg(long, env = "AWS_SECRET_ACCESS_KEY", hide = true, hide_env_values = true)]
    secret_key: String,
}

#[tokio::main]
async fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let webhook = args.webhook.zip(args.webhook_token).map(|(url, token)| Webhook { url, token });
    let server = Server::start(Options {
        data: args.data,
        address: args.address,
        root: Credentials { access_key: args.access_key, secret_key: args.secret_key },
        region: args.region,
        webhook,
    })
    .await?;
    let mut output = std::io::stdout().lock();
    writeln!(output, "http://{}", server.address())
        .and_then(|()| output.flush())
        .context("standard output")?;
    drop(output);
    let mut terminate = tokio::signal::unix::signal(tokio::signal::unix::SignalKind::terminate())?;
    tokio::select! {
        ended = tokio::signal::ctrl_c() => ended?,
        _ = terminate.recv() => {}
    }
    server.stop().await;
    Ok(())
}
