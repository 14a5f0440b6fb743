//! `rayfold-bench pipeline`: the paper's table with the local invoker and the built-in store, MinIO or SeaweedFS.
//!
//! For each scene and each number of concurrent invocations, a GIF is made by the assemble function, with cold and with
//! warm processes, and by this program from fetched frames. In addition all frames are drawn one after the other,
//! without a GIF. Uploads go through the store, events through its webhook, and the function binaries are those that
//! ship.

mod report;
mod run;
mod timeline;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use rayfold_local::{Functions, Plan, Platform, StoreKind};
use rayfold_scene::{Limits, parse};
use rayfold_tracer::{RenderOptions, render};

use crate::report_folder::ReportFolder;

pub(crate) use run::{Compiled, Folder, Run, put, run as make};

/// The options of the subcommand.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Use this S3 store
    #[arg(long, value_name = "STORE", default_value = StoreKind::BuiltIn.name(), value_parser = stores())]
    store: StoreKind,
    #[command(flatten)]
    output: ReportFolder,
    /// Read the scenes from this folder
    #[arg(long, default_value = "scenes")]
    scenes: PathBuf,
    /// Measure only these scenes
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
}

fn stores() -> impl TypedValueParser<Value = StoreKind> {
    PossibleValuesParser::new(StoreKind::ALL.map(StoreKind::name))
        .map(|name| StoreKind::named(&name).unwrap_or_default())
}

/// The scenes in the paper's order, with the paper's names and seconds: with 10 invocations compiled locally and in the
/// cloud, with 5 the same, and locally without a GIF.
const PAPER: [(&str, &str, [Option<f64>; 5]); 5] = [
    ("sphere_light", "sphere_lig", [Some(55.885), Some(61.226), Some(68.147), Some(73.453), Some(37.43)]),
    ("moving_up", "moving_u", [Some(56.500), Some(61.993), Some(73.279), Some(78.626), Some(44.38)]),
    ("artistic", "artistic", [Some(87.063), Some(93.499), Some(92.668), Some(98.393), Some(97.32)]),
    ("artisticsss", "artisticsss", [Some(86.850), Some(92.991), Some(88.014), Some(93.742), Some(101.41)]),
    ("hello", "hello", [Some(183.565), None, Some(171.016), None, Some(359.61)]),
];

/// The numbers of concurrent invocations of a function, as many as the paper had ray tracers.
const AT_ONCE: [usize; 2] = [10, 5];

/// All runs of a scene.
pub(crate) struct Scene {
    pub(crate) folder: Folder,
    pub(crate) paper: [Option<f64>; 5],
    /// One for each of [`AT_ONCE`].
    pub(crate) runs: Vec<Runs>,
    /// The time to draw all frames one after the other on one thread.
    pub(crate) sequential: Duration,
}

/// The runs with one number of concurrent invocations.
pub(crate) struct Runs {
    pub(crate) cold: Run,
    pub(crate) warm: Run,
    pub(crate) local: Run,
}

/// Measures and writes the report.
///
/// # Errors
/// Fails if the store or the functions cannot be started, an animation fails, or the report cannot be written.
pub fn run(args: &Args) -> Result<()> {
    args.output.prepare()?;
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()?;
    let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let scenes = runtime.block_on(measure(args))?;
    let name = match args.store {
        StoreKind::BuiltIn => "pipeline",
        StoreKind::Minio => "pipeline-minio",
        StoreKind::SeaweedFs => "pipeline-seaweedfs",
    };
    let plot = format!("{name}-timeline.svg");
    timeline::plot(&args.output.path(&plot), scenes.last().context("no scene")?)?;
    args.output.write(format!("{name}.md"), report::text(args.store, &scenes, load.trim(), &plot)?)
}

async fn measure(args: &Args) -> Result<Vec<Scene>> {
    let functions = Functions::locate(&mut |line| eprintln!("{line}"))?;
    let data = tempfile::tempdir()?;
    let plan = Plan::new(args.store, data.path(), functions);
    let settings = |settings: &mut rayfold_local::invoker::Settings| settings.sweep_every = None;
    let mut platform = Platform::start(&plan, settings, &mut |line| eprintln!("{line}")).await?;
    let mut scenes = Vec::new();
    for (name, _, paper) in PAPER {
        if !args.only.is_empty() && !args.only.iter().any(|only| only == name) {
            continue;
        }
        let folder = Folder::read(name, &args.scenes.join(name))?;
        let mut runs = Vec::new();
        for at_once in AT_ONCE {
            eprintln!("{name}: {at_once} at once");
            platform.settings_mut().concurrency = at_once;
            let (sender, mut seen) = tokio::sync::mpsc::unbounded_channel();
            platform.start_invoker(Some(sender)).await?;
            platform.invoker().context("the invoker has just been started")?.idle().await;
            while seen.try_recv().is_ok() {}
            let mut take = async |label: &str, compiled| {
                let animation = format!("{name}-{at_once}-{label}");
                make(&platform, &mut seen, &folder, &animation, compiled).await
            };
            let cold = take("cold", Compiled::ByTheFunction).await?;
            let warm = take("warm", Compiled::ByTheFunction).await?;
            let local = take("local", Compiled::Here).await?;
            runs.push(Runs { cold, warm, local });
        }
        eprintln!("{name}: one after the other");
        let sequential = sequential(&folder)?;
        scenes.push(Scene { folder, paper, runs, sequential });
    }
    platform.stop().await;
    Ok(scenes)
}

/// Draws every frame on one thread, one after the other. Returns the time.
fn sequential(folder: &Folder) -> Result<Duration> {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    one.install(|| {
        let start = Instant::now();
        for (name, text) in folder.scripts() {
            let script = parse(name, text, &Limits::default()).script;
            for scene in script.ok_or_else(|| anyhow!("{name} has errors"))?.frames() {
                std::hint::black_box(render(&scene, &RenderOptions::default())?);
            }
        }
        Ok(start.elapsed())
    })
}
