//! The store as a process of its own, for conformance tests and for killing it in the middle.
//!
//! Reads the owner's key from `AWS_ACCESS_KEY_ID` and `AWS_SECRET_ACCESS_KEY`. Prints the address as the first line
//! of standard output once it serves requests. SIGINT or SIGTERM stops it in order. `rayfold-bucket check` reads a
//! folder and lists its damage.

use std::io::Write;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context;
use clap::{Parser, Subcommand};
use rayfold_bucket::{Credentials, Damage, Options, Server, Webhook};

#[derive(Parser)]
#[command(version, about = "An S3-compatible object store in a folder")]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
struct Args {
    #[command(subcommand)]
    command: Option<Command>,
    /// Folder of the store, which is created if missing
    #[arg(long, required = true)]
    data: Option<PathBuf>,
    /// Address to listen on; port 0 selects any free one
    #[arg(long, default_value = "127.0.0.1:0")]
    address: SocketAddr,
    /// Region of the buckets
    #[arg(long, env = "AWS_REGION", default_value = "us-east-1")]
    region: String,
    /// URL to which events are sent, `http://…`
    #[arg(long, requires = "webhook_token")]
    webhook: Option<String>,
    /// Token sent with each event as `Authorization: Bearer <token>`
    #[arg(long, env = "RAYFOLD_BUCKET_WEBHOOK_TOKEN", hide_env_values = true)]
    webhook_token: Option<String>,
    #[arg(long, env = "AWS_ACCESS_KEY_ID", hide = true, required = true)]
    access_key: Option<String>,
    #[arg(long, env = "AWS_SECRET_ACCESS_KEY", hide = true, hide_env_values = true, required = true)]
    secret_key: Option<String>,
}

#[derive(Subcommand)]
enum Command {
    /// Check all of a stopped store against its checksums, and list the damage
    ///
    /// Exits with 1 if something is damaged and was not repaired.
    Check {
        /// Folder of the store
        #[arg(long)]
        data: PathBuf,
        /// Move damaged files and rows to a folder `set-aside-N` inside the store, so that the rest stays usable
        #[arg(long)]
        repair: bool,
    },
}

#[tokio::main]
async fn main() -> ExitCode {
    run().await.unwrap_or_else(|error| {
        let _ = writeln!(std::io::stderr(), "error: {error:#}");
        ExitCode::FAILURE
    })
}

async fn run() -> anyhow::Result<ExitCode> {
    let args = Args::parse();
    if let Some(Command::Check { data, repair }) = args.command {
        return check(&data, repair);
    }
    let (Some(data), Some(access_key), Some(secret_key)) = (args.data, args.access_key, args.secret_key)
    else {
        anyhow::bail!("--data, AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY are needed");
    };
    let webhook = args.webhook.zip(args.webhook_token).map(|(url, token)| Webhook { url, token });
    let server = Server::start(Options {
        data,
        address: args.address,
        root: Credentials { access_key, secret_key },
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
    Ok(ExitCode::SUCCESS)
}

fn check(data: &Path, repair: bool) -> anyhow::Result<ExitCode> {
    let report = rayfold_bucket::check(data, repair)?;
    let mut output = std::io::stdout().lock();
    for Damage { place, what } in &report.damages {
        writeln!(output, "{place}: {what}")?;
    }
    writeln!(
        output,
        "{} objects of {} bytes are whole; {} damages",
        report.objects,
        report.bytes,
        report.damages.len()
    )?;
    match &report.set_aside {
        Some(aside) => {
            writeln!(output, "what is damaged, and the files as they were, is in {}", aside.display())?
        }
        None if report.damages.is_empty() => {}
        None => {
            writeln!(output, "nothing was changed; --repair sets aside what is damaged and keeps the rest")?;
            return Ok(ExitCode::FAILURE);
        }
    }
    Ok(ExitCode::SUCCESS)
}
