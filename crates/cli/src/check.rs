//! `rayfold check`: the faults of scripts and settings, for people and for editors.

use std::path::{Path, PathBuf};

use rayfold_files::named_by_scripts;
use rayfold_scene::{Diagnostic, Language, Limits, SETTINGS_FILE, Severity};
use serde::Serialize;

use crate::console::{Console, Format, describe};
use crate::input::{Input, stdin_once};
use crate::interrupt;
use crate::outcome::Outcome;
use crate::plan::{Plan, Wishes};
use crate::render::passes::is_pass;
use crate::survey::{Conflict, Faults};
use crate::threads::Threads;
use crate::values;
use crate::wording::number;

/// Show what is wrong with scripts, without rendering them
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  rayfold check scenes/hello
      a folder: its scripts and its animation.json
  rayfold check scenes/*
      several
  rayfold check --format json a.txt
      for an editor, on standard output
  cat a.txt | rayfold check -
      a buffer that is not saved

The JSON document holds the number of files, frames, errors and warnings; `diagnostics`, each with file, line,
column, span (byte offsets), severity, code, message and, where there is one, expected and help; `unreadable`, the
files that could not be read; `conflicts`, why scripts that are fine by themselves are no animation together, and
files that are not read because of their names, models and skies that no script names, each with its input, severity and message; and `language`, the table of the scene language: its commands, the clauses of
materials and the modes of curves, each number with its name, kind, unit, range and default.")]
pub(crate) struct Args {
    /// Folders, script files, animation.json, or - for standard input
    #[arg(required = true)]
    input: Vec<PathBuf>,
    /// How to show them
    #[arg(long, value_enum, default_value_t)]
    format: Format,
    /// The largest image that a script may ask for, in pixels
    #[arg(long, value_name = "N", value_parser = values::count::<u64>, allow_negative_numbers = true, default_value_t = Limits::PIXELS)]
    max_pixels: u64,
    #[command(flatten)]
    threads: Threads,
}

#[derive(Serialize)]
struct Report<'a> {
    files: usize,
    frames: u64,
    errors: usize,
    warnings: usize,
    diagnostics: &'a [Diagnostic],
    unreadable: Vec<String>,
    language: Language,
    conflicts: &'a [Conflict],
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    stdin_once(&args.input)?;
    args.threads.tell(console);
    args.threads.start()?;
    let limits = Limits { max_pixels: args.max_pixels, ..Limits::default() };
    let is_settings =
        |path: &PathBuf| path.file_name().is_some_and(|name| name == SETTINGS_FILE) && !path.is_dir();
    let (settings, inputs): (Vec<_>, Vec<_>) = args.input.iter().cloned().partition(is_settings);

    let mut faults = Faults::default();
    for path in &settings {
        faults.settings(path);
    }
    let mut frames = 0;
    for (path, input) in inputs.iter().zip(Input::each(&inputs, &limits)) {
        let input = match input {
            Ok(input) => input,
            Err(error) if interrupt::signalled() => return Err(error),
            Err(error) => {
                faults.unusable(error);
                continue;
            }
        };
        let (found, plan) = Plan::survey(&input, &limits, &Wishes::default())?;
        faults.add(found);
        match plan {
            None => {}
            Some(Err(error)) => faults.conflict(path, Severity::Error, &error),
            Some(Ok(plan)) => {
                frames += plan.len();
                for file in unused_files(path) {
                    faults.conflict(&file, Severity::Warning, &"no script names this file");
                }
                // Nobody would see the warning.
                let is_seen = !console.quiet || args.format == Format::Json;
                if is_seen && let Some(warning) = plan.light_cut_off()? {
                    faults.conflict(path, Severity::Warning, &warning);
                }
                if let Err(error) = plan.one_size() {
                    // A script of unlike frames cannot be an animation, but it can be pictures.
                    let severity = if path.is_dir() { Severity::Error } else { Severity::Warning };
                    faults.conflict(path, severity, &error);
                }
            }
        }
    }
    match args.format {
        Format::Text => tell(&faults, frames, console),
        Format::Json => {
            let report = Report {
                files: faults.files,
                frames,
                errors: faults.errors(),
                warnings: faults.warnings(),
                diagnostics: &faults.diagnostics,
                unreadable: faults.unreadable.iter().map(describe).collect(),
                language: rayfold_scene::language(),
                conflicts: &faults.conflicts,
            };
            let mut text = serde_json::to_vec_pretty(&report)?;
            text.push(b'\n');
            console.print(text)?;
        }
    }
    Ok(if faults.errors() > 0 { Outcome::Failed } else { Outcome::Done })
}

/// The endings of models, of the files that they refer to, of fonts, and of skies. Other pictures are left out, because
/// they may be renderings.
const NAMED: [&str; 10] = ["obj", "mtl", "ply", "stl", "gltf", "glb", "ttf", "otf", "hdr", "exr"];

/// Returns the models, fonts and skies in a folder that no script names, in order.
fn unused_files(folder: &Path) -> Vec<PathBuf> {
    let named = named_by_scripts();
    let is_meant = |path: &Path| {
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        NAMED.contains(&ending.as_str()) && !is_pass(path) && path.is_file()
    };
    let entries = folder.read_dir().into_iter().flatten();
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let mut unused: Vec<PathBuf> = paths.filter(|path| is_meant(path) && !named.contains(path)).collect();
    unused.sort();
    unused
}

fn tell(faults: &Faults, frames: u64, console: &Console) {
    faults.show(console);
    let warnings = match faults.warnings() {
        0 => String::new(),
        n => format!(", {}", number(n as u64, "warning")),
    };
    if faults.errors() > 0 {
        console.note(format_args!("{}{warnings}", faults.count()));
    } else {
        let files = number(faults.files as u64, "file");
        console.note(format_args!("{files}, {}: no errors{warnings}", number(frames, "frame")));
    }
}
