//! `rayfold studio`: scenes in a browser, until it is stopped.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Context;
use rayfold_pipeline::store::S3Store;
use rayfold_studio::{Choice, Cloud, Page, Project, Recent, Server, Start};

use crate::console::Console;
use crate::interrupt;
use crate::outcome::Outcome;
use crate::threads::Threads;

/// The time between two checks whether to stop.
const LOOK: Duration = Duration::from_millis(50);

/// Design scenes in a browser, in the final picture
///
/// What is done on the page is written into the scripts, line by line; everything else in them stays.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The page is served on this machine only, to who knows the address that is printed. It opens and
writes the scripts that PATH names and nothing else. Stop with Ctrl-C.

Examples:
  rayfold studio                 a page with recent scenes and examples
  rayfold studio scenes/hello    a folder of scripts
  rayfold studio mine.txt        one script; if it is not there yet, with a scene to begin with
  rayfold studio scenes/hello --bucket my-bucket
                                 with a bucket to render it in")]
pub(crate) struct Args {
    /// A folder of scripts, or one script. Without it, a page offers recent scenes, examples and an empty scene
    path: Option<PathBuf>,
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
    /// Serve the page from a folder, for those who change it
    #[arg(long, env = "RAYFOLD_STUDIO_PAGE", value_name = "DIR", hide = true)]
    page: Option<PathBuf>,
    #[command(flatten)]
    threads: Threads,
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    args.threads.start()?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .context("cannot start")?;
    runtime.block_on(async {
        let Some(path) = &args.path else { return from_start_page(args, console).await };
        let server = open_studio(args, path, args.port, console).await?;
        show(args, server.address(), console)?;
        until_stopped().await;
        stop(vec![server]).await
    })
}

/// Opens the items that are chosen on the start page, each in a studio of its own.
async fn from_start_page(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let folder = std::env::current_dir().context("there is no current folder")?;
    let mut start = Start::open(Recent::of_user(), &folder, args.port).await?;
    show(args, start.address(), console)?;
    let mut servers: Vec<(PathBuf, Server)> = Vec::new();
    loop {
        let choice = tokio::select! {
            choice = start.choice() => choice,
            () = until_stopped() => None,
        };
        let Some(Choice { path, answer }) = choice else { break };
        let path = path.canonicalize().unwrap_or(path);
        let opened = match servers.iter().find(|(opened, _)| *opened == path) {
            Some((_, server)) => Ok(server.address().to_owned()),
            None => open_studio(args, &path, 0, console).await.map(|server| {
                server.lead_to_start(start.address());
                let address = server.address().to_owned();
                servers.push((path, server));
                address
            }),
        };
        // The browser may have gone.
        let _ = answer.send(opened.map_err(|error| format!("{error:#}")));
    }
    stop(servers.into_iter().map(|(_, server)| server).collect()).await
}

async fn open_studio(args: &Args, path: &Path, port: u16, console: &Console) -> anyhow::Result<Server> {
    let project = Project::open(path)?;
    for not_read in &project.not_read {
        console.warn(format_args!("{}: {not_read}", not_read.path.display()));
    }
    let page = args.page.as_deref().map_or_else(|| Ok(Page::built_in()), Page::read)?;
    let cloud = match &args.bucket {
        Some(bucket) => Cloud::new(bucket, S3Store::from_environment(bucket).await?),
        None => Cloud::none(),
    };
    let server = Server::start(project, page, cloud, port).await?;
    Recent::of_user().add(path);
    Ok(server)
}

/// Prints the address and opens it.
fn show(args: &Args, address: &str, console: &Console) -> anyhow::Result<()> {
    console.print(format!("{address}\n"))?;
    console.note("Ctrl-C ends it");
    if !args.no_open
        && let Err(error) = open::that_detached(address)
    {
        console.note(format_args!("no browser could be opened ({error}): open the address in one"));
    }
    Ok(())
}

async fn until_stopped() {
    while !interrupt::stopping() {
        tokio::time::sleep(LOOK).await;
    }
}

async fn stop(servers: Vec<Server>) -> anyhow::Result<Outcome> {
    let mut unsaved = Vec::new();
    for server in servers {
        unsaved.extend(server.stop().await);
    }
    anyhow::ensure!(
        unsaved.is_empty(),
        "not written, because others changed them or they cannot be written: {}",
        unsaved.join(", ")
    );
    Ok(Outcome::Done)
}
