//! `rayfold fetch`: what the bucket has of an animation, to this machine.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use rayfold_client::{FetchedFrame, Output, frame_keys, frame_name};
use rayfold_pipeline::keys::Animation;
use rayfold_pipeline::manifest::{Manifest, Status};

use super::{BucketArgs, Client, address, parse_animation, report, with_bucket};
use crate::console::Console;
use crate::outcome::{Outcome, Usage};
use crate::output::{OutputFile, probe};
use crate::progress::Progress;
use crate::render::target::{Format, Pattern, Target};
use crate::wording::{Size, number};

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
    let animation = &args.animation;
    with_bucket(&args.bucket, async |client| {
        let watch = client.look(std::slice::from_ref(animation)).await?.remove(0);
        let Some(manifest) = watch.manifest() else {
            client.must_exist(animation).await?;
            anyhow::ensure!(
                !watch.is_unreadable(),
                "the manifest of {animation} cannot be read: the next sweep makes it anew"
            );
            anyhow::bail!("no function has looked at {animation} yet");
        };
        match &target {
            Target::Gif(path) => {
                if !watch.is_current() {
                    return Err(not_there(manifest, console));
                }
                gif(client, animation, path, &args.bucket, console).await?;
            }
            Target::Images(pattern, format) => frames(client, manifest, pattern, *format, console).await?,
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

/// A file that appears once all of it is there.
struct Download<'a> {
    path: &'a Path,
    file: Option<BufWriter<OutputFile>>,
}

impl Output for Download<'_> {
    fn begin(&mut self, _: u64) -> io::Result<()> {
        self.file = Some(BufWriter::new(OutputFile::create(self.path).map_err(io::Error::other)?));
        Ok(())
    }

    fn write(&mut self, piece: &[u8]) -> io::Result<()> {
        self.file.as_mut().map_or(Ok(()), |file| file.write_all(piece))
    }
}

/// Downloads the GIF as it is now.
///
/// # Errors
/// When there is none, it cannot be written, or it is replaced all the time.
pub(crate) async fn gif(
    client: Client<'_>,
    animation: &Animation,
    path: &Path,
    bucket: &BucketArgs,
    console: &Console,
) -> anyhow::Result<()> {
    let shown = path.display();
    let mut download = Download { path, file: None };
    let info = client.fetch_gif(animation, &mut download).await?;
    if let Some(file) = download.file {
        let file = file.into_inner().map_err(io::IntoInnerError::into_error);
        file.with_context(|| format!("cannot write {shown}"))?.finish(true)?;
    }
    let from = address(&bucket.bucket, &animation.gif());
    console.note(format_args!("{shown}: {}, from {from}", Size(info.size)));
    Ok(())
}

async fn frames(
    client: Client<'_>,
    manifest: &Manifest,
    pattern: &Pattern,
    format: Format,
    console: &Console,
) -> anyhow::Result<()> {
    let animation = &manifest.head.animation;
    let keys = frame_keys(manifest).map_err(|frame| {
        report::show_faults(manifest, console);
        anyhow::anyhow!(
            "{animation} is {} ({}): {} is not drawn",
            report::word(manifest.head.status),
            report::count(manifest),
            frame_name(frame)
        )
    })?;
    anyhow::ensure!(!keys.is_empty(), "{animation} has no frames");
    let mut progress = Progress::start(console, "frames", keys.len() as u64);
    let mut done = 0;
    let take = |frame: FetchedFrame<'_>| {
        write_frame(&frame, pattern, format).map_err(io::Error::other)?;
        done += 1;
        progress.set(console, done);
        Ok(())
    };
    client.fetch_frames(&keys, take).await?;
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

fn write_frame(frame: &FetchedFrame<'_>, pattern: &Pattern, format: Format) -> anyhow::Result<()> {
    let path = pattern.path(frame.number);
    match format {
        Format::Png => OutputFile::write(path, &frame.png, false)?,
        Format::Tiff => {
            let image = image::load_from_memory(&frame.png);
            let image = image.with_context(|| format!("{} is no image", frame.key))?;
            OutputFile::write(path, &format.encode(&image.into_rgb8())?, false)?;
        }
    }
    Ok(())
}
