//! `rayfold studio`: scenes in a browser, until told to stop.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::Context;
use rayfold_pipeline::store::S3Store;
use rayfold_studio::{Cloud, Page, Project, Server};

use crate::console::Console;
use crate::interrupt;
use crate::outcome::Outcome;
use crate::threads::Threads;

/// Between two looks at whether to stop.
const LOOK: Duration = Duration::from_millis(50);

/// Design scenes in a browser, in the final picture
///
/// What is done on the page is written into the scripts, line by line; everything else in them stays.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The page is served on this machine only, to who knows the address that is printed. It opens and
writes the scripts that PATH names and nothing else. Stop with Ctrl-C.

Examples:
  rayfold studio scenes/hello    a folder of scripts
  rayfold studio mine.txt        one script; if it is not there yet, with a scene to begin with
  rayfold studio scenes/hello --bucket my-bucket
                                 with a bucket to render it in")]
pub(crate) struct Args {
    /// A folder of scripts, or one script
    path: PathBuf,
    /// Print the address and open no browser
    #[arg(long)]
    no_open: bool,
    /// Where to listen on this machine; 0 is any free port
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    port: u16,
    /// A bucket to submit to, as `rayfold submit` does. Region, credentials and endpoint come from the standard AWS
    /// environment
    #[arg(long, env = "RAYFOLD_BUCKET", value_name = "NAME")]
    bucket: Option<String>,
    #[command(flatten)]
    threads: Threads,
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    args.threads.start()?;
    let project = Project::open(&args.path)?;
    for not_read in &project.not_read {
        console.warn(format_args!("{}: {not_read}", not_read.path.display()));
    }
    let page = Page::get(&mut |line| console.note(line))?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .context("cannot start")?;
    runtime.block_on(async {
        let cloud = match &args.bucket {
            Some(bucket) => Cloud::new(bucket, S3Store::from_environment(bucket).await?),
            None => Cloud::none(),
        };
        let server = Server::start(project, page, cloud, args.port).await?;
        console.print(format!("{}\n", server.address()))?;
        console.note("Ctrl-C ends it");
        if !args.no_open
            && let Err(error) = open::that_detached(server.address())
        {
            console.note(format_args!("no browser could be opened ({error}): open the address in one"));
        }
        while !interrupt::stopping() {
            tokio::time::sleep(LOOK).await;
        }
        let unsaved = server.stop().await;
        anyhow::ensure!(
            unsaved.is_empty(),
            "not written, because others changed them or they cannot be written: {}",
            unsaved.join(", ")
        );
        Ok(Outcome::Done)
    })
}
