//! `rayfold-bench cold-start`: the size of the functions, and the time until a new process requests its first
//! invocation.

use std::io::Write as _;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use rayfold_local::invoker::{Invoker, Settings};
use rayfold_local::observation::Seen;
use rayfold_local::routes::Function;
use rayfold_local::{Functions, any_port};

/// The options of the subcommand.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Start this many processes of each function
    #[arg(long, default_value = "50")]
    rounds: usize,
    /// Use the function binaries in this folder [default: those beside this program]
    #[arg(long, value_name = "DIR")]
    functions: Option<PathBuf>,
}

/// A payload that no function can parse. The function replies at once, without using the store.
const NOTHING: &str = "{}";

/// Measures and prints the results.
///
/// # Errors
/// Fails if the functions cannot be started.
pub fn run(args: &Args) -> Result<()> {
    let functions = match &args.functions {
        Some(folder) => Functions::in_folder(folder),
        None => Functions::locate(&mut |line| eprintln!("{line}"))?,
    };
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build()?;
    for function in Function::ALL {
        let binary = std::fs::read(functions.path(function))?;
        let mut times = Vec::new();
        for _ in 0..args.rounds {
            times.push(runtime.block_on(first_next(&functions, function))?);
        }
        times.sort();
        let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize].as_secs_f64() * 1e3;
        eprintln!(
            "{}: {:.2} MB, {:.2} MB deflated; from spawn to the first `next` {:.1} ms (median of {}; least {:.1}, 90 % \
             within {:.1})",
            function.binary(),
            binary.len() as f64 / 1e6,
            deflated(&binary)? as f64 / 1e6,
            at(0.5),
            times.len(),
            at(0.0),
            at(0.9),
        );
    }
    Ok(())
}

/// Returns the time until a new process calls `next` for the first time.
async fn first_next(functions: &Functions, function: Function) -> Result<Duration> {
    let mut settings = Settings::new(functions.clone(), Some(any_port()), any_port(), String::new());
    settings.sweep_every = None;
    settings.environment = [
        ("AWS_REGION", "us-east-1"),
        ("AWS_ACCESS_KEY_ID", "none"),
        ("AWS_SECRET_ACCESS_KEY", "none"),
        ("RAYFOLD_BUCKET", "none"),
    ]
    .map(|(name, value)| (name.to_owned(), value.to_owned()))
    .to_vec();
    let (sender, mut seen) = tokio::sync::mpsc::unbounded_channel();
    let invoker = Invoker::start(settings, Some(sender)).await?;
    let outcome = invoker.invoke(function, NOTHING).await;
    ensure!(outcome.is_success(), "{outcome:?}");
    let mut init = None;
    while let Ok(observation) = seen.try_recv() {
        if let Seen::Finished { attempt, init: Some(took), .. } = observation.seen
            && attempt.function == function
        {
            init = Some(took);
        }
    }
    invoker.stop().await;
    init.context("the process was new")
}

fn deflated(bytes: &[u8]) -> Result<usize> {
    let mut encoder = flate2::write::DeflateEncoder::new(Vec::new(), flate2::Compression::best());
    encoder.write_all(bytes)?;
    Ok(encoder.finish()?.len())
}
