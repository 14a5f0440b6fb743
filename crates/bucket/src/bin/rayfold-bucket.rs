//! The store as a process of its own, for conformance tests and for killing it in the middle.
//!
//! The root key is taken from `AWS_ACCESS_KEY_ID` and `AWS_SECRET_ACCESS_KEY`. The address is printed as the first line
//! of standard output when requests are answered; SIGINT or SIGTERM ends it in order. `rayfold-bucket check` reads a folder and
//! lists what is damaged in it.

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
    /// The folder, made when missing
    #[arg(long, required = true)]
    data: Option<PathBuf>,
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
    #[arg(long, env = "AWS_ACCESS_KEY_ID", hide = true, required = true)]
    access_key: Option<String>,
    #[arg(long, env = "AWS_SECRET_ACCESS_KEY", hide = true, hide_env_values = true, required = true)]
    secret_key: Option<String>,
}

#[derive(Subcommand)]
enum Command {
    /// Reads all of a store that does not run, compares it with its checksums, and lists what is damaged
    ///
    /// Ends with 1 when something is damaged and was not repaired.
    Check {
        /// The folder
        #[arg(long)]
        data: PathBuf,
        /// Move what is damaged to a folder `set-aside-N` in the store's, and keep the rest usable
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
