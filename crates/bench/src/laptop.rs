//! `rayfold-bench laptop`: small animations on few places, by the real programs, as `rayfold dev FOLDER` makes them.
//!
//! Measures the seconds from the first upload to the GIF, with new processes, and the requests that each function
//! sends. Frames of 8 x 8 pixels take no time to draw, so the rest is the pipeline's time.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use rayfold_local::invoker::Settings;
use rayfold_local::routes::Function;
use rayfold_local::{Functions, Plan, Platform, StoreKind};

use crate::pipeline::{Compiled, Folder, Run, make};
use crate::report_folder::ReportFolder;

/// Options of `rayfold-bench laptop`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Invocations of a function at once; may be given several times
    #[arg(long, value_name = "N", default_values_t = [1, 2, 4, 16])]
    places: Vec<usize>,
    /// Frames of the animations of 8 x 8 pixels; may be given several times
    #[arg(long, value_name = "N", default_values_t = [10, 300, 1_000])]
    frames: Vec<u32>,
    /// A folder of scripts that is made, too
    #[arg(long, value_name = "FOLDER", default_value = "scenes/hello")]
    scene: PathBuf,
    #[command(flatten)]
    output: ReportFolder,
}

/// An animation on a number of places.
struct Row {
    name: String,
    frames: usize,
    places: usize,
    run: Run,
}

/// Measures and writes the report.
///
/// # Errors
/// Fails if the functions cannot be started, an animation fails, or the report cannot be written.
pub fn run(args: &Args) -> Result<()> {
    args.output.prepare()?;
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()?;
    let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let rows = runtime.block_on(measure(args))?;
    args.output.write("laptop.md", report(&rows, load.trim())?)
}

async fn measure(args: &Args) -> Result<Vec<Row>> {
    let mut folders = Vec::new();
    for frames in &args.frames {
        let folder = tempfile::tempdir()?;
        write_trivial(folder.path(), *frames)?;
        folders.push(Folder::read(&format!("{frames} frames of 8 x 8"), folder.path())?);
    }
    let name = args.scene.file_name().unwrap_or_default().to_string_lossy().into_owned();
    folders.push(Folder::read(&name, &args.scene)?);
    let mut rows = Vec::new();
    for folder in &folders {
        for &places in &args.places {
            let run = make_on(places, folder).await?;
            eprintln!("{} on {places}: {:.2} s", folder.name, run.total.as_secs_f64());
            rows.push(Row { name: folder.name.clone(), frames: folder.frames(), places, run });
        }
    }
    Ok(rows)
}

fn write_trivial(folder: &Path, frames: u32) -> Result<()> {
    for number in 1..=frames {
        let script = format!("# {number}\nScreen 8 8\nTrace\n");
        std::fs::write(folder.join(format!("{number}.txt")), script)?;
    }
    Ok(())
}

/// Makes an animation in a bucket of its own, with new processes.
async fn make_on(places: usize, folder: &Folder) -> Result<Run> {
    let data = tempfile::tempdir()?;
    let plan =
        Plan::new(StoreKind::BuiltIn, data.path(), Functions::locate(&mut |line| eprintln!("{line}"))?);
    let settings = |settings: &mut Settings| settings.concurrency = places;
    let mut platform = Platform::start(&plan, settings, &mut |line| eprintln!("{line}")).await?;
    let (sender, mut seen) = tokio::sync::mpsc::unbounded_channel();
    platform.start_invoker(Some(sender)).await?.idle().await;
    while seen.try_recv().is_ok() {}
    let run = make(&platform, &mut seen, folder, "film", Compiled::ByTheFunction).await;
    platform.stop().await;
    run.with_context(|| format!("{} on {places} places", folder.name))
}

fn report(rows: &[Row], load: &str) -> Result<String> {
    let mut page = String::new();
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    writeln!(
        page,
        "# The pipeline on a laptop\n\n\
         Written by `cargo run --release -p rayfold-bench -- laptop`: the built-in store, the local invoker and the \
         function programs, as `rayfold dev FOLDER --concurrency PLACES` runs them, on {threads} processors with a \
         load of {load} (`/proc/loadavg`) at the start. Other programs on the machine affect the seconds, but not the \
         requests.\n\n\
         *Seconds* are from the first upload to the GIF, including the start of the processes. *Requests* are the \
         requests of the render function per frame, without those of the uploads. *Assembler* are the requests of the \
         assemble function per frame. *Fold* is the mean time after a result was written, in milliseconds.\n\n\
         | animation | places | seconds | requests | GET | PUT | LIST | assembler | fold, ms |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    )?;
    for Row { name, frames, places, run } in rows {
        let of = |function| run.requests.get(&function).copied().unwrap_or_default();
        let (render, assemble) = (of(Function::Render), of(Function::Assemble));
        let a_frame = |count: u64| count as f64 / *frames as f64;
        writeln!(
            page,
            "| {name} | {places} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.1} |",
            run.total.as_secs_f64(),
            a_frame(render.billed() + render.delete),
            a_frame(render.get),
            a_frame(render.put),
            a_frame(render.list),
            a_frame(assemble.billed() + assemble.delete),
            run.stages[3],
        )?;
    }
    Ok(page)
}
