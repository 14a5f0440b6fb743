//! Counts of the faults.

use std::collections::BTreeMap;
use std::fmt;
use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// Counts by name. Clones share the counts.
#[derive(Debug, Clone, Default)]
pub(crate) struct Tally(Arc<Mutex<BTreeMap<String, u64>>>);

impl Tally {
    pub(crate) fn add(&self, what: &str) {
        *self.0.lock().unwrap().entry(what.to_owned()).or_default() += 1;
    }

    pub(crate) fn of(&self, what: &str) -> u64 {
        self.0.lock().unwrap().get(what).copied().unwrap_or(0)
    }

    /// Adds all counts of another tally.
    pub(crate) fn add_all(&self, other: &Tally) {
        for (what, count) in other.counts() {
            *self.0.lock().unwrap().entry(what).or_default() += count;
        }
    }

    pub(crate) fn counts(&self) -> BTreeMap<String, u64> {
        self.0.lock().unwrap().clone()
    }

    /// Adds the notes of processes, which may have ended.
    pub(crate) fn add_notes(&self, folder: &Path) {
        for line in std::fs::read_to_string(notes(folder)).unwrap_or_default().lines() {
            self.add(line);
        }
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts: Vec<String> =
            self.counts().into_iter().map(|(what, count)| format!("{count} {what}")).collect();
        f.write_str(&counts.join(", "))
    }
}

fn notes(folder: &Path) -> PathBuf {
    folder.join("notes")
}

/// Returns a function that notes a fault so that it is counted even if the process is killed: it writes each line in
/// one call.
pub(crate) fn noting(folder: &Path) -> impl Fn(&str) + Clone + Send + Sync + use<> {
    let file = OpenOptions::new().create(true).append(true).open(notes(folder)).unwrap();
    let file = Arc::new(Mutex::new(file));
    move |what: &str| file.lock().unwrap().write_all(format!("{what}\n").as_bytes()).unwrap()
}
