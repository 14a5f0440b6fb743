//! `rayfold dev`: the whole pipeline on this machine, until it is stopped.
//!
//! It starts an S3 server (the built-in store, MinIO or SeaweedFS), makes the bucket and its notifications,
//! and starts the local invoker with the function binaries. Everything that it started ends with it; the data
//! stays, and the next start continues from there. With a folder it keeps its data in a temporary one,
//! submits the scripts, writes the GIF and ends. With an endpoint it runs the functions alone, on a bucket of
//! another S3 server (`cluster`).

mod cluster;
mod news;
mod stop;

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::pin::pin;
use std::time::Duration;

use anyhow::{Context, bail, ensure};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use rayfold_local::invoker::Settings;
use rayfold_local::{Error, Functions, Plan, Platform, Site, StoreKind};
use rayfold_pipeline::SystemClock;
use rayfold_scene::Limits;
use tempfile::TempDir;
use tokio::sync::mpsc::unbounded_channel;

use crate::cloud::submit::Order;
use crate::cloud::{BucketArgs, Client};
use crate::console::Console;
use crate::interrupt;
use crate::outcome::{Outcome, Usage};
use crate::values;
use news::News;
use stop::interrupted;

/// The time for which the first lines wait for events that were missed since the last run.
const CATCH_UP: Duration = Duration::from_secs(3);

/// The variables from which the functions take the limits on the largest script and animation; Terraform sets the same
/// ones.
const LIMITS: [&str; 7] = [
    "RAYFOLD_MAX_SCRIPT_BYTES",
    "RAYFOLD_MAX_OBJECTS",
    "RAYFOLD_MAX_LIGHTS",
    "RAYFOLD_MAX_PIXELS",
    "RAYFOLD_MAX_FRAMES",
    "RAYFOLD_MAX_BANDS",
    "RAYFOLD_MAX_ANIMATION_FRAMES",
];

/// Run the whole pipeline on this machine: an S3 server, the bucket and the functions
///
/// With a folder of scripts it submits them, writes the GIF and stops: all of it in a temporary folder and on free ports.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Nothing has to be installed: the S3 server is part of rayfold. --store minio
and --store seaweedfs run another server, from RAYFOLD_MINIO or
RAYFOLD_SEAWEEDFS, or from the PATH. If it is missing, it is built from source
once, which needs Go. Each store keeps its objects in a folder of its own below
the data folder: bucket/, objects/, seaweedfs/.

--endpoint runs the functions on a bucket of an S3 server that is running
already, with the credentials of the standard AWS environment. Several machines
on one bucket share the work, and take over the work of one that is lost. The
bucket is listed every second. With --webhook and --webhook-arn a change is
seen at once: the server sends it to http://IP:PORT/events, with the bearer
token in RAYFOLD_WEBHOOK_TOKEN.

The functions, rayfold-render and rayfold-assemble, are those in the folder that RAYFOLD_FUNCTIONS
names; without it those beside rayfold, or on the PATH, or they are built where rayfold was built.
They refuse what RAYFOLD_MAX_PIXELS, RAYFOLD_MAX_OBJECTS and the like do not allow, as on AWS.

Stop with Ctrl-C; the data is kept, and the next start goes on where this one was.
Of what was made for FOLDER nothing is kept but the GIF.

Other clients take the two keys that it prints, and its address as URL:
  s5cmd   AWS_REGION=us-east-1, and --endpoint-url URL
  rclone  RCLONE_CONFIG_BOX_TYPE=s3 RCLONE_CONFIG_BOX_PROVIDER=Other
          RCLONE_CONFIG_BOX_ENV_AUTH=true RCLONE_CONFIG_BOX_REGION=us-east-1
          RCLONE_CONFIG_BOX_ENDPOINT=URL; the bucket is BOX:rayfold
  s3cmd   --no-ssl --region=us-east-1 --host=HOST:PORT --host-bucket=HOST:PORT
  mc      mc alias set box URL KEY SECRET --api s3v4 --path on; box/rayfold

Examples:
  rayfold dev scenes/hello -o hello.gif
      scripts in, GIF out, through the bucket
  rayfold dev
      prints what to set in another terminal
  aws s3 sync scenes/hello s3://rayfold/scripts/hello/
      there; the GIF appears below animations/
  rayfold dev --endpoint http://10.0.0.5:8333 --bucket films
      on several machines: they share the scripts of one bucket")]
pub(crate) struct Args {
    /// A folder of scripts, to be made into a GIF
    folder: Option<PathBuf>,
    /// Where to write the GIF of FOLDER [default: the folder's name with .gif, in the current folder]
    #[arg(long, short, value_name = "OUT.gif", requires = "folder")]
    output: Option<PathBuf>,
    /// Run on when the GIF of FOLDER is written
    #[arg(long, requires = "folder")]
    keep: bool,
    /// Run the functions on a bucket of this S3 server, which is running already
    #[arg(long, value_name = "URL", value_parser = url, conflicts_with_all = ["folder", "store", "data", "address"])]
    endpoint: Option<String>,
    /// Listen there for the webhook of the server of --endpoint
    #[arg(long, value_name = "IP:PORT", requires_all = ["endpoint", "webhook_arn"])]
    webhook: Option<SocketAddr>,
    /// ARN of the webhook on that server, as arn:minio:sqs::NAME:webhook; replaces the bucket's notifications
    #[arg(long, value_name = "ARN", requires = "webhook")]
    webhook_arn: Option<String>,
    /// What keeps the bucket
    #[arg(long, value_name = "STORE", default_value = StoreKind::BuiltIn.name(), value_parser = stores())]
    store: StoreKind,
    /// Where objects and credentials are kept [default: rayfold/dev in the user's data folder]
    #[arg(long, value_name = "DIR", conflicts_with = "folder")]
    data: Option<PathBuf>,
    /// How many processes of a function run at once [default: one a core, two at least]
    #[arg(long, value_name = "N", value_parser = values::count::<u16>)]
    concurrency: Option<u16>,
    /// Where S3 listens; port 0 stands for any [default: 127.0.0.1:9000, or any port when that is taken]
    #[arg(long, value_name = "IP:PORT")]
    address: Option<SocketAddr>,
    /// The bucket's name
    #[arg(long, value_name = "NAME", default_value = "rayfold")]
    bucket: String,
    /// Serve the studio's static page from this folder, which `cargo xtask site` has built; it submits to the bucket
    #[arg(long, value_name = "DIR", conflicts_with_all = ["folder", "endpoint"])]
    site: Option<PathBuf>,
    /// Serve the page of --site at this address; port 0 stands for any
    #[arg(long, value_name = "IP:PORT", default_value = "127.0.0.1:0", requires = "site")]
    site_address: SocketAddr,
}

impl Args {
    /// Applies the arguments to the settings of the invoker and the functions.
    fn apply(&self, settings: &mut Settings) {
        settings.concurrency = self.concurrency.map_or_else(usual_concurrency, usize::from);
        let stuck_after_ms = stuck_after(settings.timeout).as_millis().to_string();
        settings.environment.push(("RAYFOLD_STUCK_AFTER_MS".into(), stuck_after_ms));
        let own = |name: &str| Some((name.to_owned(), std::env::var(name).ok()?));
        settings.environment.extend(LIMITS.into_iter().filter_map(own));
    }
}

/// The names of the stores, for the flag.
fn stores() -> impl TypedValueParser<Value = StoreKind> {
    PossibleValuesParser::new(StoreKind::ALL.map(StoreKind::name))
        .map(|name| StoreKind::named(&name).unwrap_or_default())
}

fn url(text: &str) -> Result<String, &'static str> {
    let is_url =
        ["http://", "https://"].iter().any(|scheme| text.len() > scheme.len() && text.starts_with(scheme));
    if is_url { Ok(text.to_owned()) } else { Err("expected http:// or https:// and a host") }
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let order = args.folder.as_ref().map(|folder| order(folder, args, console)).transpose()?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .context("cannot start")?;
    runtime.block_on(serve(args, order.as_ref(), console))
}

fn order(folder: &PathBuf, args: &Args, console: &Console) -> anyhow::Result<Order> {
    ensure!(
        folder.is_dir() || !folder.exists(),
        Usage(format!("{} is a file: expected a folder of scripts", folder.display()))
    );
    Order::new(folder, None, args.output.as_deref(), true, &Limits::default(), console)
}

/// A folder that is removed at the end of the run, also if a second signal ends the run at once.
struct Scratch {
    folder: TempDir,
    _protected: interrupt::Protected,
}

impl Scratch {
    fn new() -> anyhow::Result<Self> {
        let folder = tempfile::Builder::new().prefix("rayfold-dev-").tempdir();
        let folder = folder.context("cannot make a temporary folder")?;
        let protected = interrupt::protect(folder.path());
        Ok(Self { folder, _protected: protected })
    }
}

async fn serve(args: &Args, order: Option<&Order>, console: &Console) -> anyhow::Result<Outcome> {
    let mut say = |line: &str| console.note(line);
    let functions = Functions::locate(&mut say)?;
    if let Some(endpoint) = &args.endpoint {
        return cluster::serve(endpoint, functions, args, console).await;
    }
    let scratch = order.map(|_| Scratch::new()).transpose()?;
    let data = match (&scratch, &args.data) {
        (Some(scratch), _) => scratch.folder.path().to_path_buf(),
        (None, Some(data)) => data.clone(),
        (None, None) => default_data()?,
    };
    let address = match args.address {
        Some(address) => address,
        None if order.is_some() => rayfold_local::any_port(),
        None => usual_address(),
    };
    let plan =
        Plan { store: args.store, data: data.clone(), address, bucket: args.bucket.clone(), functions };
    let settings = |settings: &mut Settings| args.apply(settings);
    let start = Platform::start(&plan, settings, &mut say);
    let mut platform = tokio::select! {
        platform = start => match platform {
            Err(error @ Error::DataInUse(_)) => bail!("{error}: stop that one, or choose another folder by --data"),
            Err(error @ Error::MinioFolder(_)) => bail!("{error} by --data"),
            Err(error @ (Error::NoServer { .. } | Error::Install { .. })) => {
                bail!("{error}. Without `--store` nothing has to be installed")
            }
            platform => platform?,
        },
        () = interrupted() => return Ok(Outcome::Interrupted),
    };
    let ended = attend(args, order, &mut platform, (&data, console)).await;
    // Otherwise a file that is still being written comes back into a folder that is being removed.
    platform.stop().await;
    ended
}

/// Does the pending work of a running platform until it is stopped.
async fn attend(
    args: &Args,
    order: Option<&Order>,
    platform: &mut Platform,
    (data, console): (&Path, &Console),
) -> anyhow::Result<Outcome> {
    let (sender, mut seen) = unbounded_channel();
    let invoker = platform.start_invoker(Some(sender)).await?;
    // So the sweep that catches up does not meet the next upload.
    let _ = tokio::time::timeout(CATCH_UP, invoker.idle()).await;
    if let Some(order) = order {
        let bucket = BucketArgs { bucket: args.bucket.clone() };
        let client = Client::new(platform.store(), &SystemClock);
        let mut delivery = pin!(order.deliver(client, &bucket, console));
        let mut news = News::brief(console, platform.store());
        loop {
            tokio::select! {
                delivered = &mut delivery => break delivered?,
                observation = seen.recv() => match observation {
                    Some(observation) => news.hear(&observation),
                    None => bail!("the invoker has ended"),
                },
                status = platform.server().ended() => bail!("{} has ended ({status})", args.store),
                () = interrupted() => return Ok(Outcome::Interrupted),
            }
        }
        if !args.keep {
            return Ok(Outcome::Done);
        }
    }
    // It ends with this function.
    let _site = match &args.site {
        Some(folder) => {
            let owner = platform.server().connection();
            let site = Site::start(folder, args.site_address, owner, &args.bucket).await?;
            console.note(format_args!("the studio's page, for one person: {}studio.html", site.url()));
            Some(site)
        }
        None => None,
    };
    console.print(exports(platform))?;
    let end = if order.is_some() { "stops everything and removes it" } else { "stops everything" };
    console.note(format_args!("data in {}; Ctrl-C {end}", data.display()));
    for other in StoreKind::ALL.into_iter().filter(|kind| *kind != args.store && kind.objects(data).exists())
    {
        console.note(format_args!("{}", left_alone(other, data)));
    }
    console.print(format!("aws s3 sync scenes/hello s3://{0}/scripts/hello/\n", args.bucket))?;
    let mut news = News::new(console, platform.store());
    loop {
        tokio::select! {
            observation = seen.recv() => match observation {
                Some(observation) => news.hear(&observation),
                None => bail!("the invoker has ended"),
            },
            () = news.tick() => news.look().await,
            status = platform.server().ended() => {
                bail!("{} has ended ({status}); its log is in {}", args.store, data.display());
            }
            () = interrupted() => break,
        }
    }
    console.note("stopping");
    Ok(Outcome::Done)
}

/// Prints that objects of the other store in the same data folder are not shown now.
fn left_alone(other: StoreKind, data: &Path) -> String {
    let flag = match other {
        StoreKind::BuiltIn => "without --store".to_owned(),
        StoreKind::Minio | StoreKind::SeaweedFs => format!("by --store {}", other.name()),
    };
    let objects = other.objects(data);
    format!("{} has objects of {other}, which stay there; they are shown {flag}", objects.display())
}

/// Returns the environment variables with which every AWS tool uses this S3, as lines for `eval`.
fn exports(platform: &Platform) -> String {
    let mut text = String::new();
    for (name, value) in platform.server().environment() {
        text.push_str(&format!("export {name}={value}\n"));
        if name == "AWS_REGION" {
            // Older versions of the AWS command line know this name alone.
            text.push_str(&format!("export AWS_DEFAULT_REGION={value}\n"));
        }
    }
    text
}

fn default_data() -> anyhow::Result<PathBuf> {
    let base = std::env::var_os("XDG_DATA_HOME").map(PathBuf::from).filter(|path| path.is_absolute());
    let base = base.or_else(|| std::env::home_dir().map(|home| home.join(".local/share")));
    Ok(base.context("no home folder: say where the data goes by --data")?.join("rayfold/dev"))
}

/// A drawing uses a core fully, so more processes than cores only slow each other down.
fn usual_concurrency() -> usize {
    std::thread::available_parallelism().map_or(2, usize::from).max(2)
}

/// An animation in which nothing has happened for this long has lost an event. It is longer than a frame may be drawn,
/// so that no frame is drawn twice at the same time.
fn stuck_after(timeout: Duration) -> Duration {
    timeout + timeout / 10
}

/// Returns MinIO's usual port, for either store, so that variables exported in another terminal stay valid from run to
/// run.
fn usual_address() -> SocketAddr {
    let usual = SocketAddr::from(([127, 0, 0, 1], 9000));
    if std::net::TcpListener::bind(usual).is_ok() { usual } else { rayfold_local::any_port() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames that took more than a minute to draw were triggered again and drawn twice at once, ten at a time on two
    /// cores.
    #[test]
    fn frames_are_not_woken_while_they_may_be_drawn() {
        for seconds in [1, 300, 900] {
            let timeout = Duration::from_secs(seconds);
            assert!(stuck_after(timeout) > timeout);
        }
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        assert_eq!(usual_concurrency(), cores.max(2));
    }
}
