//! `rayfold fetch`: downloads the frames or a file of an animation from the bucket.

use std::io;
use std::path::{Path, PathBuf};

use anyhow::Context;
use rayfold_client::{FetchedFrame, Frames, frame_name, frames};
use rayfold_files::{OutputFile, probe};
use rayfold_movie::Container;
use rayfold_pipeline::keys::Animation;
use rayfold_pipeline::manifest::{Manifest, Status};

use super::age::Age;
use super::{BucketArgs, Client, Watch, address, named, parse_animation, report, with_bucket};
use crate::console::Console;
use crate::outcome::{Outcome, Usage};
use crate::progress::Progress;
use crate::render::target::{Format, Pattern, Place, Target};
use crate::wording::{Size, number};

/// Download the GIF of an animation, another file that was made of it, or its frames
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  rayfold fetch hello --bucket my-bucket -o hello.gif
  rayfold fetch hello --bucket my-bucket -o hello.gif --last
      while a new one is made
  rayfold fetch hello --bucket my-bucket -o 'frames/%04d.png'
  rayfold fetch hello --bucket my-bucket -o 'frames/%04d.png' --partial
      those that are drawn")]
pub(crate) struct Args {
    /// The animation
    #[arg(value_parser = parse_animation)]
    animation: Animation,
    #[command(flatten)]
    bucket: BucketArgs,
    /// File to write: .gif, .webp, .apng or .y4m, or a pattern such as frames/%04d.png (or .tif) for the frames, whose folder
    /// is made
    #[arg(long, short, value_name = "OUT")]
    output: PathBuf,
    /// The file that there is, also when it does not show the scripts as they are now
    #[arg(long)]
    last: bool,
    /// The frames that are drawn, also when others are not; each keeps its number
    #[arg(long, conflicts_with = "last")]
    partial: bool,
}

/// The files to fetch.
enum Wanted {
    File(Container, PathBuf),
    Frames(Pattern, Format),
}

/// # Errors
/// Fails if OUT is neither a file of an animation nor a pattern, or if a flag does not fit it.
fn wanted(args: &Args) -> Result<Wanted, Usage> {
    let shown = args.output.display();
    match Target::parse(&args.output, None) {
        Ok(Target::Animation(container, Place::File(path))) if !args.partial => {
            Ok(Wanted::File(container, path))
        }
        Ok(Target::Images(pattern, format)) if !args.last => Ok(Wanted::Frames(pattern, format)),
        Ok(Target::Images(..)) => Err(Usage(
            "--last is for an animation: expected an output that ends in .gif, .webp, .apng or .y4m".into(),
        )),
        Ok(Target::Animation(_, Place::File(_))) => {
            Err(Usage("--partial is for frames: expected a pattern such as frames/%04d.png".into()))
        }
        Ok(_) | Err(_) => Err(Usage(format!(
            "cannot write {shown}: expected .gif, .webp, .apng or .y4m, or a pattern such as frames/%04d.png (or .tif)"
        ))),
    }
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let wanted = wanted(args)?;
    match &wanted {
        Wanted::File(_, path) => probe(path)?,
        Wanted::Frames(pattern, _) => pattern.probe(1)?,
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
        match &wanted {
            Wanted::File(container, path) => {
                let (container, name) = (*container, container.name());
                if !watch.outputs().contains(&container) {
                    anyhow::bail!(not_asked_for(watch.outputs(), container, &animation.to_string()));
                }
                let is_current = watch.has_current(container);
                let is_of_use = is_current || (args.last && watch.file(container).is_some());
                if !is_of_use {
                    return Err(not_there(&watch, container, manifest, console));
                }
                if let (false, Some(age)) = (is_current, watch.age(container)) {
                    console.note(format_args!(
                        "this {name} is {} old and shows older scripts: {animation} is {} ({})",
                        Age(age),
                        manifest.head.status,
                        report::count(manifest)
                    ));
                }
                file(client, animation, (container, path), &args.bucket, console).await?;
            }
            Wanted::Frames(pattern, format) => {
                fetch_frames(client, manifest, args.partial, pattern, *format, console).await?;
            }
        }
        Ok(Outcome::Done)
    })
}

/// Returns the error for a file that the settings do not ask for.
pub(crate) fn not_asked_for(outputs: &[Container], container: Container, animation: &str) -> String {
    let names: Vec<&str> = outputs.iter().map(|output| output.name()).collect();
    let endings: Vec<&str> = outputs.iter().chain([&container]).map(|output| output.ending()).collect();
    format!(
        "no {} is made of {animation}, but {}: add \"outputs\": [\"{}\"] to its animation.json",
        container.name(),
        names.join(" and "),
        endings.join("\", \"")
    )
}

fn not_there(
    watch: &Watch<'_>,
    container: Container,
    manifest: &Manifest,
    console: &Console,
) -> anyhow::Error {
    report::show_faults(manifest, console);
    let (head, name) = (&manifest.head, container.name());
    let why = match head.status {
        Status::Done => format!("its {name} is being assembled"),
        other => other.to_string(),
    };
    let last = match (watch.file(container), watch.age(container)) {
        (Some(file), Some(age)) => {
            format!("; --last fetches the one before, of {} and {} old", Size(file.size), Age(age))
        }
        _ => String::new(),
    };
    let count = report::count(manifest);
    anyhow::anyhow!("there is no {name} of {} as it is now: {why} ({count}){last}", head.animation)
}

/// Downloads the current file.
///
/// # Errors
/// Fails if there is no file, it cannot be written, or it is replaced again and again.
pub(crate) async fn file(
    client: Client<'_>,
    animation: &Animation,
    (container, path): (Container, &Path),
    bucket: &BucketArgs,
    console: &Console,
) -> anyhow::Result<()> {
    let shown = path.display();
    let info = client.download(animation, container, path).await?;
    let from = address(&bucket.bucket, &animation.output(container));
    console.note(format_args!("{shown}: {}, from {from}", Size(info.size)));
    Ok(())
}

async fn fetch_frames(
    client: Client<'_>,
    manifest: &Manifest,
    partial: bool,
    pattern: &Pattern,
    format: Format,
    console: &Console,
) -> anyhow::Result<()> {
    let animation = &manifest.head.animation;
    let Frames { drawn, missing } = frames(manifest);
    if let Some(first) = missing.first()
        && !partial
    {
        report::show_faults(manifest, console);
        let rest = match drawn.len() {
            0 => String::new(),
            others => format!("; --partial fetches {}", number(others as u64, "other frame")),
        };
        anyhow::bail!(
            "{animation} is {} ({}): {} is not drawn{rest}",
            manifest.head.status,
            report::count(manifest),
            frame_name(first)
        );
    }
    let (Some(first), Some(last)) = (drawn.first(), drawn.last()) else {
        anyhow::bail!("{animation} has no frames that are drawn");
    };
    pattern.make_folder()?;
    let progress = Progress::start(console, "frames", drawn.len() as u64);
    let mut done = 0;
    let take = |frame: FetchedFrame<'_>| {
        write_frame(&frame, pattern, format).map_err(io::Error::other)?;
        done += 1;
        progress.set(console, done);
        Ok(())
    };
    client.fetch_frames(&drawn, take).await?;
    let took = progress.finish().as_secs_f64();
    console.note(format_args!(
        "{}: {}, in {took:.2} s",
        pattern.range(first.number, last.number),
        number(done, "frame")
    ));
    pattern.warn_of_older(manifest.head.total, console);
    if !missing.is_empty() {
        let names: Vec<String> = missing.into_iter().map(frame_name).collect();
        console.warn(format_args!("not drawn, and not fetched: {}", named(&names)));
    }
    Ok(())
}

/// Converts an image to eight bits per channel, with alpha if it has any.
fn levels(image: image::DynamicImage) -> image::DynamicImage {
    if image.color().has_alpha() { image.into_rgba8().into() } else { image.into_rgb8().into() }
}

fn write_frame(frame: &FetchedFrame<'_>, pattern: &Pattern, format: Format) -> anyhow::Result<()> {
    let path = pattern.path(frame.number);
    match format {
        Format::Png => OutputFile::write(path, &frame.png, false)?,
        Format::Tiff => {
            let image = image::load_from_memory(&frame.png);
            let image = image.with_context(|| format!("{} is no image", frame.key))?;
            OutputFile::write(path, &format.encode(&levels(image))?, false)?;
        }
    }
    Ok(())
}
