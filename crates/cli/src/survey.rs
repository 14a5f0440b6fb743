//! Examines all scripts before anything is done with any of them, so that all faults are reported at once.

use std::fmt::Display;
use std::io::Read;
use std::path::Path;

use anyhow::Context;
use rayfold_scene::{AnimationSettings, Code, Diagnostic, Limits, Parsed, Script, Severity, parse_settings};
use rayon::prelude::*;
use serde::Serialize;

use crate::console::Console;
use crate::input::ScriptFile;
use crate::interrupt;
use crate::wording::number;

/// The faults of a number of scripts, in their order.
#[derive(Debug, Default)]
pub(crate) struct Faults {
    /// The diagnostics of the parser.
    pub(crate) diagnostics: Vec<Diagnostic>,
    /// Files that could not be read.
    pub(crate) unreadable: Vec<anyhow::Error>,
    /// The reasons why correct scripts form no animation together, and the files that are not read.
    pub(crate) conflicts: Vec<Conflict>,
    /// The number of files that have an error.
    pub(crate) bad: usize,
    /// The number of files that were examined.
    pub(crate) files: usize,
}

/// The reason why scripts form no animation together, or why a file is not read.
#[derive(Debug, Serialize)]
pub(crate) struct Conflict {
    /// The name that the user gave.
    input: String,
    severity: Severity,
    message: String,
}

impl Faults {
    /// Returns the number of errors in all files.
    pub(crate) fn errors(&self) -> usize {
        self.unreadable.len() + self.described(Severity::Error) + self.conflicts_of(Severity::Error)
    }

    /// Returns the number of warnings in all files.
    pub(crate) fn warnings(&self) -> usize {
        self.described(Severity::Warning) + self.conflicts_of(Severity::Warning)
    }

    fn described(&self, severity: Severity) -> usize {
        self.diagnostics.iter().filter(|d| d.severity == severity).map(|d| d.count).sum()
    }

    fn conflicts_of(&self, severity: Severity) -> usize {
        self.conflicts.iter().filter(|conflict| conflict.severity == severity).count()
    }

    /// Records why the scripts of an input, which are correct by themselves, form no animation together.
    pub(crate) fn conflict(&mut self, input: &Path, severity: Severity, why: &impl Display) {
        let (input, message) = (input.display().to_string(), why.to_string());
        self.conflicts.push(Conflict { input, severity, message });
    }

    /// Records the faults of the next script, which is `None` if it cannot be used.
    pub(crate) fn script(&mut self, parsed: anyhow::Result<Parsed>) -> Option<Script> {
        let parsed = parsed.map(|parsed| (parsed.script, parsed.diagnostics));
        self.sort_out(parsed)
    }

    /// Reads a folder's settings and records their faults. Returns `None` if they cannot be used.
    pub(crate) fn settings(&mut self, path: &Path) -> Option<AnimationSettings> {
        let name = path.display().to_string();
        let mut text = Vec::new();
        let parsed = rayfold_files::open(path)
            .and_then(|mut file| file.read_to_end(&mut text))
            .with_context(|| format!("cannot read {name}"))
            .map(|_| parse_settings(&name, &text))
            .map(|parsed| (parsed.settings, parsed.diagnostics));
        self.sort_out(parsed)
    }

    /// Drops the advice to use several rays per pixel, because the command line requests them.
    pub(crate) fn samples_are_asked_for(&mut self) {
        self.diagnostics.retain(|diagnostic| diagnostic.code != Code::NeedsSamples);
    }

    /// Records an input that could not even be listed.
    pub(crate) fn unusable(&mut self, error: anyhow::Error) {
        let _: Option<()> = self.sort_out(Err(error));
    }

    /// Appends the faults of another survey.
    pub(crate) fn add(&mut self, others: Self) {
        self.diagnostics.extend(others.diagnostics);
        self.unreadable.extend(others.unreadable);
        self.conflicts.extend(others.conflicts);
        self.bad += others.bad;
        self.files += others.files;
    }

    fn sort_out<T>(&mut self, parsed: anyhow::Result<(Option<T>, Vec<Diagnostic>)>) -> Option<T> {
        self.files += 1;
        let value = match parsed {
            Ok((value, diagnostics)) => {
                self.diagnostics.extend(diagnostics);
                value
            }
            Err(unreadable) => {
                self.unreadable.push(unreadable);
                None
            }
        };
        self.bad += usize::from(value.is_none());
        value
    }

    /// Shows everything to people, but warnings only if they did not ask for quiet.
    pub(crate) fn show(&self, console: &Console) {
        for error in &self.unreadable {
            console.error(error);
        }
        for diagnostic in &self.diagnostics {
            if diagnostic.code == Code::NotText {
                console.fault(&diagnostic.file, &diagnostic.message);
            } else if diagnostic.is_error() || !console.quiet {
                console.say(format_args!("{}\n", diagnostic.render(console.color)));
            }
        }
        for Conflict { input, severity, message } in &self.conflicts {
            match severity {
                Severity::Error => console.fault(input, message),
                Severity::Warning => console.warn(format_args!("{input}: {message}")),
            }
        }
        let too_large = |d: &Diagnostic| d.code == Code::LimitExceeded && d.message.contains("pixels");
        if self.diagnostics.iter().any(too_large) {
            console.note("--max-pixels sets the limit on pixels");
        }
    }

    /// Returns `3 errors in 2 of 50 files`.
    pub(crate) fn count(&self) -> String {
        let errors = number(self.errors() as u64, "error");
        if self.files == 1 || self.bad == 0 {
            errors
        } else {
            format!("{errors} in {} of {} files", self.bad, self.files)
        }
    }
}

/// Parses all scripts in parallel and applies `map` to each, in their order.
///
/// # Errors
/// Fails only if the run was asked to stop. A file that cannot be read is an error in its own place.
pub(crate) fn parse_all<T: Send>(
    scripts: &[ScriptFile],
    limits: &Limits,
    map: impl Fn(&ScriptFile, anyhow::Result<Parsed>) -> T + Sync,
) -> anyhow::Result<Vec<T>> {
    scripts
        .par_iter()
        .map(|script| {
            anyhow::ensure!(!interrupt::stopping(), "interrupted");
            Ok(map(script, script.parse(limits)))
        })
        .collect()
}
