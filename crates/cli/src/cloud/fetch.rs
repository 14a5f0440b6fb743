//! `rayfold fetch`: what the bucket has of an animation, to this machine.

use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use futures_util::stream::{self, StreamExt, TryStreamExt};
use rayfold_pipeline::keys::{Animation, Receipt, Tag};
use rayfold_pipeline::manifest::{FrameState, Manifest, Status};
use rayfold_pipeline::store::{ObjectInfo, S3Store, Store};

use super::watch::Watch;
use super::{BucketArgs, SIDE_BY_SIDE, address, must_exist, parse_animation, report, with_bucket};
use crate::console::Console;
use crate::outcome::{Outcome, Usage};
use crate::output::{OutputError, OutputFile, probe};
use crate::progress::Progress;
use crate::render::target::{Format, Pattern, Target};
use crate::wording::{Size, number};

/// Bytes of a GIF that are asked for in one request.
const PIECE: u64 = 8 << 20;

/// Pieces that are under way at once.
const PIECES: usize = 4;

/// How often a GIF that is replaced while it is being read is begun anew.
const ATTEMPTS: u32 = 5;

/// Download the GIF of an animation, or its frames
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  rayfold fetch hello --bucket my-bucket -o hello.gif
  rayfold fetch hello --bucket my-bucket -o 'frames/%04d.png'")]
pub(crate) struct Args {
    /// The animation
    #[arg(value_parser = parse_animation)]
    animation: Animation,
    #[command(flatten)]
    bucket: BucketArgs,
    /// What to write: .gif, or a pattern such as frames/%04d.png (or .tif) for the frames
    #[arg(long, short, value_name = "OUT")]
    output: PathBuf,
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let target = Target::parse(&args.output)?;
    match &target {
        Target::Gif(path) => probe(path)?,
        Target::Images(pattern, _) => probe(&pattern.path(1))?,
        Target::Image(path, _) => {
            let shown = path.display();
            return Err(
                Usage(format!("{shown} is one image: expected .gif, or a pattern such as %04d.png")).into()
            );
        }
    }
    with_bucket(&args.bucket, async |store| {
        let mut watch = Watch::new(store, &args.animation);
        watch.look().await?;
        let Some(manifest) = &watch.manifest else {
            must_exist(store, &args.animation).await?;
            anyhow::bail!("no function has looked at {} yet", args.animation);
        };
        match &target {
            Target::Gif(path) => {
                if !watch.is_current() {
                    return Err(not_there(manifest, console));
                }
                gif(store, &args.animation, path, console).await?;
            }
            Target::Images(pattern, format) => frames(store, manifest, pattern, *format, console).await?,
            Target::Image(..) => {}
        }
        Ok(Outcome::Done)
    })
}

fn not_there(manifest: &Manifest, console: &Console) -> anyhow::Error {
    report::show_faults(manifest, console);
    let head = &manifest.head;
    let why = match head.status {
        Status::Done => "its GIF is being assembled",
        other => report::word(other),
    };
    anyhow::anyhow!("there is no GIF of {} as it is now: {why} ({})", head.animation, report::count(manifest))
}

/// Downloads the GIF as it is now, piece by piece.
///
/// # Errors
/// When there is none, it cannot be written, or it is replaced all the time.
pub(crate) async fn gif(
    store: &S3Store,
    animation: &Animation,
    path: &Path,
    console: &Console,
) -> anyhow::Result<()> {
    let key = animation.gif();
    for _ in 0..ATTEMPTS {
        let info = store.head(&key).await?;
        if let Some(out) = copy(store, &key, &info, path).await? {
            out.finish(true)?;
            let shown = path.display();
            console.note(format_args!("{shown}: {}, from {}", Size(info.size), address(store, &key)));
            return Ok(());
        }
    }
    anyhow::bail!("{} is replaced faster than it can be read", address(store, &key))
}

/// `None` when the object is replaced on the way.
async fn copy(
    store: &S3Store,
    key: &str,
    info: &ObjectInfo,
    path: &Path,
) -> anyhow::Result<Option<OutputFile>> {
    let failed = |source| OutputError::Io { path: path.to_path_buf(), source };
    let mut out = BufWriter::new(OutputFile::create(path)?);
    let pieces = (0..info.size.div_ceil(PIECE)).map(|n| n * PIECE..((n + 1) * PIECE).min(info.size));
    let pieces: Vec<_> = pieces.map(|range| store.get_range(key, range)).collect();
    let mut pieces = stream::iter(pieces).buffered(PIECES);
    while let Some(piece) = pieces.try_next().await? {
        if piece.info.etag != info.etag {
            return Ok(None);
        }
        out.write_all(&piece.body).map_err(failed)?;
    }
    Ok(Some(out.into_inner().map_err(|e| failed(e.into_error()))?))
}

async fn frames(
    store: &S3Store,
    manifest: &Manifest,
    pattern: &Pattern,
    format: Format,
    console: &Console,
) -> anyhow::Result<()> {
    let animation = &manifest.head.animation;
    let mut keys = Vec::new();
    for frame in &manifest.frames {
        let FrameState::Done { pixels } = frame.state else {
            report::show_faults(manifest, console);
            anyhow::bail!(
                "{} is {} ({}): {} is not drawn",
                animation,
                report::word(manifest.head.status),
                report::count(manifest),
                report::name(frame)
            );
        };
        let tag = Tag { version: frame.version.clone(), pixels };
        keys.push(animation.receipt(&Receipt::Frame { name: frame.script.clone(), tag, part: frame.part }));
    }
    anyhow::ensure!(!keys.is_empty(), "{animation} has no frames");
    let mut progress = Progress::start(console, "frames", keys.len() as u64);
    let downloads = keys.iter().zip(1..).map(async |(key, number)| {
        let png = store.get(key).await?.body;
        let file = match format {
            Format::Png => png.to_vec(),
            Format::Tiff => {
                let image = image::load_from_memory(&png).with_context(|| format!("{key} is no image"))?;
                format.encode(&image.into_rgb8())?
            }
        };
        OutputFile::write(pattern.path(number), &file, false)?;
        anyhow::Ok(())
    });
    let downloads: Vec<_> = downloads.collect();
    let mut downloads = stream::iter(downloads).buffer_unordered(SIDE_BY_SIDE);
    let mut done = 0;
    while let Some(()) = downloads.try_next().await? {
        done += 1;
        progress.set(console, done);
    }
    drop(downloads);
    let took = progress.finish().as_secs_f64();
    let (first, last) = (pattern.path(1), pattern.path(keys.len() as u64));
    console.note(format_args!(
        "{} to {}: {}, in {took:.2} s",
        first.display(),
        last.display(),
        number(done, "frame")
    ));
    Ok(())
}
