//! `rayfold split`: a script with many frames becomes a folder with one script per frame.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::Context;
use rayfold_files::OutputFile;
use rayfold_scene::{Limits, Name};

use crate::console::Console;
use crate::input::{Input, must_not_replace};
use crate::interrupt;
use crate::outcome::Outcome;
use crate::survey::Faults;
use crate::values;
use crate::wording::number;

/// Split a script with many Traces into one script a frame
///
/// Each script holds all that its frame needs, so that frames can be rendered apart from each other. The files that the
/// script names are copied into the folder.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  rayfold split flight.txt flight
      writes flight/flight-001.txt and on
  rayfold render flight -o flight.gif
      draws the same as flight.txt")]
pub(crate) struct Args {
    /// The script, or - for standard input
    script: PathBuf,
    /// The folder to write to; it is made when it is not there
    dir: PathBuf,
    /// The largest image that a script may ask for, in pixels
    #[arg(long, value_name = "N", value_parser = values::count::<u64>, allow_negative_numbers = true, default_value_t = Limits::PIXELS)]
    max_pixels: u64,
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    if args.script.is_dir() {
        anyhow::bail!("{} is a folder: expected a script", args.script.display());
    }
    let limits = Limits { max_pixels: args.max_pixels, ..Limits::default() };
    let input = Input::animation(std::slice::from_ref(&args.script), &limits)?;
    let mut faults = Faults::default();
    let parsed = input.scripts[0].parse(&limits);
    let named = parsed.as_ref().map(|parsed| parsed.files.clone()).unwrap_or_default();
    let script = faults.script(parsed);
    faults.show(console);
    let Some(script) = script else { anyhow::bail!("nothing was written: {}", faults.count()) };

    let stem = args.script.file_stem().filter(|_| input.scripts[0].path().is_some());
    let stem = stem.map_or_else(|| "frame".into(), |stem| stem.to_string_lossy());
    let digits = script.frame_count().to_string().len();
    let name = |number: usize| format!("{stem}-{number:0digits$}.txt");

    let folder = &args.dir;
    std::fs::create_dir_all(folder)
        .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    let ours: BTreeSet<String> = (1..=script.frame_count()).map(name).collect();
    refuse_strangers(folder, &ours)?;
    for number in 1..=script.frame_count() {
        must_not_replace(&folder.join(name(number)), input.files())?;
    }
    copy_files(&named, input.scripts[0].path(), folder)?;
    for number in 1..=script.frame_count() {
        anyhow::ensure!(!interrupt::stopping(), "interrupted");
        let frame = script.only(number - 1).context("a frame of the script is missing")?;
        OutputFile::write(folder.join(name(number)), part(&frame.to_string()).as_bytes(), false)?;
    }
    let first = folder.join(name(1));
    console.note(format_args!(
        "{}: {} and on",
        number(script.frame_count() as u64, "script"),
        first.display()
    ));
    Ok(Outcome::Done)
}

/// Returns the text of a part. A part with curves says that it is a single frame, so that it is not mistaken for a
/// script without its `Frames`.
fn part(text: &str) -> Cow<'_, str> {
    if text.contains('(') && !text.contains("\nFrames ") {
        return text.replacen("\nTrace", "\nFrames 1\nTrace", 1).into();
    }
    text.into()
}

/// Copies the files that a script names into the folder, if they exist.
fn copy_files(names: &[String], script: Option<&Path>, folder: &Path) -> anyhow::Result<()> {
    let beside = script.and_then(Path::parent).filter(|beside| *beside != Path::new(""));
    let beside = beside.unwrap_or(Path::new("."));
    if beside.canonicalize().ok() == folder.canonicalize().ok() {
        return Ok(());
    }
    for name in names {
        let (from, to) = (beside.join(name), folder.join(name));
        if !from.is_file() {
            continue;
        }
        let bytes = std::fs::read(&from).with_context(|| format!("cannot read {}", from.display()))?;
        match std::fs::read(&to) {
            Ok(there) if there == bytes => {}
            Ok(_) => anyhow::bail!("{} holds another file already: expected a new folder", to.display()),
            Err(_) => OutputFile::write(to, &bytes, false)?,
        }
    }
    Ok(())
}

/// Other scripts in the folder would become frames of the same animation.
fn refuse_strangers(folder: &Path, ours: &BTreeSet<String>) -> anyhow::Result<()> {
    let entries =
        std::fs::read_dir(folder).with_context(|| format!("cannot list the folder {}", folder.display()))?;
    for entry in entries {
        let name = entry?.file_name().to_string_lossy().into_owned();
        let is_part = matches!(Name::of(&name), Name::Script(_) | Name::Settings);
        if is_part && !ours.contains(&name) {
            anyhow::bail!(
                "{} already holds {name}, which would be part of the same animation: expected a folder without scripts",
                folder.display()
            );
        }
    }
    Ok(())
}
