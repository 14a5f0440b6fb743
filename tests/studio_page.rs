//! The studio's page in a real browser with the real program: runs `crates/studio/web/tests`.
//!
//! The test needs Node, Chromium and the page's packages (`npm ci` in `crates/studio/web`). If one of them is missing,
//! a line reports that the page was not tested; likewise for Firefox. Nothing is installed here. `.ci/run` runs this program
//! beside the others, and sets `RAYFOLD_PAGE_TESTS=apart` for these.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The files of tests, in the page's folder.
const TESTS: &[&str] = &[
    "tests/logic.mjs",
    "tests/site-standing.mjs",
    "tests/site-cost.mjs",
    "tests/page.mjs",
    "tests/language.mjs",
    "tests/journeys.mjs",
    "tests/script.mjs",
    "tests/edit.mjs",
    "tests/arrange.mjs",
    "tests/files.mjs",
    "tests/runs.mjs",
    "tests/time.mjs",
    "tests/history.mjs",
];

/// The tests that drive Firefox.
const IN_FIREFOX: &str = "tests/firefox.mjs";

/// The names of the browsers, in the order in which they are tried.
const CHROMIUM: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];
const FIREFOX: [&str; 2] = ["firefox-esr", "firefox"];

/// The first version of Node with all features that the tests use.
const NODE: u32 = 20;

/// The tests of the page without a server, alone and beside the bucket of `rayfold dev`.
const OF_THE_SITE: &[&str] = &["tests/site.mjs", "tests/site-disk.mjs", "tests/site-runs.mjs"];
const OF_THE_SITE_IN_FIREFOX: &str = "tests/site-firefox.mjs";

#[test]
fn the_page_does_in_a_browser_what_it_promises() {
    if std::env::var_os("RAYFOLD_PAGE_TESTS").is_some_and(|value| value == "apart") {
        return note(
            "the page is tested by another command at the same time, as RAYFOLD_PAGE_TESTS=apart says",
        );
    }
    let web = Path::new(env!("CARGO_MANIFEST_DIR")).join("../studio/web");
    let browser = match tools(&web) {
        Ok(browser) => browser,
        Err(missing) => return note(&format!("the page was NOT TESTED: {missing}")),
    };
    let program = Path::new(env!("CARGO_BIN_EXE_rayfold"));
    let mut node = Command::new("node");
    // One after the other, because each uses all cores.
    node.args(["--test", "--test-reporter=spec", "--test-concurrency=1"]).args(TESTS);
    let site = match site() {
        Ok(site) => Some(node.args(OF_THE_SITE).env("SITE", site)).is_some(),
        Err(missing) => {
            note(&format!("the page without a server was NOT TESTED: {missing}"));
            false
        }
    };
    match found(&FIREFOX) {
        Ok(firefox) => {
            node.arg(IN_FIREFOX).env("FIREFOX", firefox);
            node.args(site.then_some(OF_THE_SITE_IN_FIREFOX));
        }
        Err(missing) => note(&format!("the page was NOT TESTED in Firefox: {missing}")),
    }
    if let Some(beside) = program.parent().filter(|folder| folder.join("rayfold-render").is_file()) {
        // The functions were built with this test. Without them `rayfold dev` builds them itself.
        node.env("RAYFOLD_FUNCTIONS", beside);
    }
    node.current_dir(&web).env("RAYFOLD", program).env("CHROMIUM", browser).stdin(Stdio::null());
    let status = node.status().expect("node runs");
    assert!(status.success(), "see above which of the page's tests failed");
}

/// Prints a line; `eprintln!` would print nothing in a test that passes.
fn note(text: &str) {
    writeln!(std::io::stderr(), "studio: {text}").expect("standard error");
}

/// Builds a draft of the page without a server, and returns its folder, or what is missing.
fn site() -> Result<PathBuf, String> {
    const TARGET: &str = "wasm32-unknown-unknown";
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let rustc = std::env::var_os("RUSTC").unwrap_or("rustc".into());
    let libraries = Command::new(rustc).args(["--print", "target-libdir", "--target", TARGET]).output();
    let libraries = libraries.map_err(|error| format!("there is no rustc: {error}"))?;
    if !Path::new(String::from_utf8_lossy(&libraries.stdout).trim()).is_dir() {
        return Err(format!("its target is not installed: `rustup target add {TARGET}`"));
    }
    // `.ci/run` has built it with the features of the tests: `cargo xtask` would build half of its dependencies again.
    let mut xtask = match std::env::var_os("RAYFOLD_XTASK") {
        Some(built) => Command::new(built),
        None => {
            let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or("cargo".into()));
            cargo.arg("xtask");
            cargo
        }
    };
    let status = xtask.args(["site", "--draft"]).current_dir(&root).stdin(Stdio::null()).status();
    assert!(status.is_ok_and(|status| status.success()), "`cargo xtask site --draft` fails: see above");
    Ok(root.join("target/site-draft"))
}

/// Returns the browser, or the missing tool.
fn tools(web: &Path) -> Result<PathBuf, String> {
    let node = Command::new("node").arg("--version").output().map_err(|_| "there is no node".to_owned())?;
    let version = String::from_utf8_lossy(&node.stdout).trim().trim_start_matches('v').to_owned();
    let major = version.split('.').next().and_then(|major| major.parse::<u32>().ok());
    if major.is_none_or(|major| major < NODE) {
        return Err(format!("node is {version}, expected {NODE} or newer"));
    }
    if !web.join("node_modules/playwright-core").exists() {
        return Err("its packages are not installed: `npm ci` in crates/studio/web".into());
    }
    found(&CHROMIUM)
}

/// Returns the program on the PATH, or the missing names.
fn found(names: &[&str]) -> Result<PathBuf, String> {
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let found = std::env::split_paths(&paths)
        .flat_map(|folder| names.iter().map(move |name| folder.join(name)))
        .find(|path| path.is_file());
    found.ok_or_else(|| format!("there is none of {}", names.join(", ")))
}
