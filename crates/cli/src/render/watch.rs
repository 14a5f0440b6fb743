//! Draws again whenever a script changes, or a file that a script names.
//!
//! Changes are found by looking at the files a few times a second, not by the system's notifications: those are
//! silent on network drives and in folders that a virtual machine or a container shares, and lose a file that
//! an editor replaces. The contents of small files are compared, not their times: some file systems count in
//! steps of two seconds.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use rayfold_files::named_by_scripts;

use crate::console::Console;
use crate::input::is_part_of_animation;
use crate::interrupt;
use crate::outcome::{Outcome, Usage};

/// The time between two looks at the files.
const LOOK: Duration = Duration::from_millis(200);

/// The size in bytes up to which a file is read at each look.
const SMALL: u64 = 64 << 10;

/// Calls `draw` first, and then whenever one of the files has changed, until the run is asked to stop.
///
/// # Errors
/// Fails only for wrong usage: any other error is shown, and may be corrected.
pub(super) fn draw_again(
    inputs: &[PathBuf],
    console: &Console,
    mut draw: impl FnMut() -> anyhow::Result<()>,
) -> anyhow::Result<Outcome> {
    loop {
        let mut drawn = look(inputs);
        match draw() {
            Err(error) if interrupt::signalled() || error.is::<Usage>() => return Err(error),
            Err(error) => console.error(&error),
            Ok(()) => {}
        }
        // Files that scripts name are known once the scripts were read.
        for (path, state) in look(inputs) {
            if is_named(&path) {
                drawn.entry(path).or_insert(state);
            }
        }
        interrupt::go_on();
        console.note("waiting for a script to change; Ctrl-C ends this");
        let mut last = look(inputs);
        loop {
            std::thread::sleep(LOOK);
            if interrupt::signalled() {
                return Ok(Outcome::Done);
            }
            let now = look(inputs);
            // Two looks alike: no editor is in the middle of saving.
            if now == last && now != drawn {
                break;
            }
            last = now;
        }
    }
}

/// The state of each input file.
type Seen = BTreeMap<PathBuf, Option<State>>;

#[derive(Debug, PartialEq)]
enum State {
    Small { hash: u64 },
    Large { size: u64, modified: Option<SystemTime> },
}

fn look(inputs: &[PathBuf]) -> Seen {
    let mut seen = Seen::new();
    for input in inputs {
        match std::fs::read_dir(input) {
            Ok(entries) => {
                let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
                seen.extend(paths.filter(|path| is_part_of_animation(path)).map(|path| {
                    let state = state(&path);
                    (path, state)
                }));
            }
            Err(_) => _ = seen.insert(input.clone(), state(input)),
        }
    }
    for path in named_by_scripts() {
        let state = state(&path);
        seen.insert(path, state);
    }
    seen
}

/// Returns whether a path is that of a file which a script names.
fn is_named(path: &Path) -> bool {
    !is_part_of_animation(path)
}

/// `None` for a missing file.
fn state(path: &Path) -> Option<State> {
    let metadata = path.metadata().ok()?;
    if metadata.len() > SMALL {
        return Some(State::Large { size: metadata.len(), modified: metadata.modified().ok() });
    }
    let (mut hasher, mut text) = (DefaultHasher::new(), Vec::new());
    rayfold_files::open(path).and_then(|mut file| file.read_to_end(&mut text)).ok()?;
    text.hash(&mut hasher);
    Some(State::Small { hash: hasher.finish() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_change_of_a_script_is_seen_and_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let inputs = [folder.path().to_path_buf()];
        let write = |name: &str, text: &str| std::fs::write(path(name), text).unwrap();
        write("a.txt", "Screen 4 3");
        let mut before = look(&inputs);
        let mut changes = || {
            let now = look(&inputs);
            std::mem::replace(&mut before, look(&inputs)) != now
        };
        write("notes.md", "not a script");
        write("a.txt", "Screen 4 3");
        assert!(!changes());
        // The file has the same size, within one tick of any clock.
        write("a.txt", "Screen 3 4");
        assert!(changes() && !changes());
        write("animation.json", "{}");
        assert!(changes());
        // As editors save: a new file takes the old one's place.
        write("a.txt~", "Screen 5 5");
        std::fs::rename(path("a.txt~"), path("a.txt")).unwrap();
        assert!(changes());
        std::fs::remove_file(path("a.txt")).unwrap();
        assert!(changes() && !changes());
        let large = "#".repeat(SMALL as usize + 1);
        write("b.txt", &large);
        assert!(changes());
        write("b.txt", &(large + "#"));
        assert!(changes());
    }
}
