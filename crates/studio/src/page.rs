//! The page: a part of the program if it was built before the program, else built once, with npm, in the folder where
//! the program was built.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::SystemTime;

use crate::error::Error;

/// The folder of the page's sources, if the program runs where it was built.
const SOURCES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/web");

/// The inputs of the page besides its packages.
const INPUTS: [&str; 6] =
    ["src", "index.html", "package.json", "package-lock.json", "tsconfig.json", "vite.config.ts"];

/// The files of the page.
#[derive(Clone, Debug)]
pub struct Page {
    /// The content of `index.html`.
    pub html: Vec<u8>,
    /// The content of `studio.js`.
    pub script: Vec<u8>,
    /// The content of `studio.css`.
    pub style: Vec<u8>,
}

impl Page {
    /// Returns the page. Calls `say` if it must be built first, which takes a minute.
    ///
    /// # Errors
    /// Fails with the missing requirement if there is no page and it cannot be built.
    pub fn get(say: &mut dyn FnMut(&str)) -> Result<Self, Error> {
        let sources = Path::new(SOURCES);
        if sources.join("package-lock.json").exists() {
            if is_stale(sources) {
                say("building the page, once");
                build(sources)?;
            }
            if let Some(page) = Self::read(&sources.join("dist")) {
                return Ok(page);
            }
        }
        Self::embedded().ok_or_else(|| {
            Error::NoPage(format!("this program was built without it, and its sources are not at {SOURCES}"))
        })
    }

    fn read(dist: &Path) -> Option<Self> {
        let read = |name: &str| fs::read(dist.join(name)).ok().filter(|text| !text.is_empty());
        Some(Self { html: read("index.html")?, script: read("studio.js")?, style: read("studio.css")? })
    }

    fn embedded() -> Option<Self> {
        let page = Self {
            html: include_bytes!(concat!(env!("OUT_DIR"), "/index.html")).to_vec(),
            script: include_bytes!(concat!(env!("OUT_DIR"), "/studio.js")).to_vec(),
            style: include_bytes!(concat!(env!("OUT_DIR"), "/studio.css")).to_vec(),
        };
        let whole = [&page.html, &page.script, &page.style].iter().all(|file| !file.is_empty());
        whole.then_some(page)
    }
}

/// Returns whether the built page is missing or older than its inputs.
fn is_stale(sources: &Path) -> bool {
    let built =
        ["index.html", "studio.js", "studio.css"].map(|name| newest(&sources.join("dist").join(name)));
    let built = built.into_iter().min().flatten();
    INPUTS.iter().any(|input| newest(&sources.join(input)) > built) || built.is_none()
}

/// Returns the time of the last change of a file, or of any file in a folder.
fn newest(path: &Path) -> Option<SystemTime> {
    let metadata = fs::metadata(path).ok()?;
    if metadata.is_file() {
        return metadata.modified().ok();
    }
    let entries: Vec<PathBuf> = fs::read_dir(path).ok()?.flatten().map(|entry| entry.path()).collect();
    entries.iter().filter_map(|path| newest(path)).max()
}

fn build(sources: &Path) -> Result<(), Error> {
    let missing = |what: &str| {
        Error::NoPage(format!(
            "{what}. It takes Node 20.19 or newer with npm (https://nodejs.org), once; then `npm ci && npm run build` in {}",
            sources.display()
        ))
    };
    let npm = |arguments: &[&str]| -> Result<(), Error> {
        let output = Command::new("npm").args(arguments).current_dir(sources).stdin(Stdio::null()).output();
        let output = output.map_err(|error| missing(&format!("npm cannot be run: {error}")))?;
        if output.status.success() {
            return Ok(());
        }
        let said = [output.stdout, output.stderr].concat();
        let said = String::from_utf8_lossy(&said);
        let lines: Vec<&str> = said.lines().filter(|line| !line.trim().is_empty()).collect();
        let last = &lines[lines.len().saturating_sub(8)..];
        Err(missing(&format!("npm {} failed: {}", arguments.join(" "), last.join("; "))))
    };
    if !sources.join("node_modules/vite").exists() {
        npm(&["ci", "--ignore-scripts"])?;
    }
    npm(&["run", "build"])
}
