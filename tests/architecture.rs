//! Checks the promises of ARCHITECTURE.md about the crates, and the style rules that no compiler checks.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails, also in the functions that tests share")]

#[path = "architecture/circles.rs"]
mod circles;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

/// The crates of the project that each one may use. A new crate needs an entry here and a section in ARCHITECTURE.md.
const KNOWS: &[(&str, &[&str])] = &[
    ("rayfold-assets", &[]),
    ("rayfold-scene", &["rayfold-assets"]),
    ("rayfold-files", &["rayfold-scene"]),
    ("rayfold-gif", &[]),
    ("rayfold-movie", &["rayfold-gif", "rayfold-scene"]),
    ("rayfold-bucket", &[]),
    ("rayfold-tracer", &["rayfold-scene"]),
    ("rayfold-pipeline", &["rayfold-scene"]),
    ("rayfold-simulation", &["rayfold-scene", "rayfold-pipeline"]),
    ("rayfold-client", &["rayfold-scene", "rayfold-files", "rayfold-pipeline"]),
    ("rayfold-lambda", &["rayfold-scene", "rayfold-tracer", "rayfold-movie", "rayfold-pipeline"]),
    ("rayfold-local", &["rayfold-bucket", "rayfold-pipeline"]),
    (
        "rayfold-studio",
        &[
            "rayfold-scene",
            "rayfold-files",
            "rayfold-tracer",
            "rayfold-movie",
            "rayfold-pipeline",
            "rayfold-client",
        ],
    ),
    ("rayfold-web", &["rayfold-studio"]),
    (
        "rayfold",
        &[
            "rayfold-scene",
            "rayfold-files",
            "rayfold-tracer",
            "rayfold-gif",
            "rayfold-movie",
            "rayfold-pipeline",
            "rayfold-client",
            "rayfold-local",
            "rayfold-studio",
        ],
    ),
    (
        "rayfold-python",
        &[
            "rayfold-scene",
            "rayfold-files",
            "rayfold-tracer",
            "rayfold-movie",
            "rayfold-pipeline",
            "rayfold-client",
        ],
    ),
    ("rayfold-xtask", &["rayfold-files", "rayfold-scene"]),
    (
        "rayfold-bench",
        &[
            "rayfold-scene",
            "rayfold-files",
            "rayfold-tracer",
            "rayfold-gif",
            "rayfold-pipeline",
            "rayfold-simulation",
            "rayfold-lambda",
            "rayfold-local",
            "rayfold",
        ],
    ),
];

/// The rooms of the fast tracer, each a folder, in the order of [docs/tracer.md](../docs/tracer.md): a room uses only those
/// before it.
const ROOMS: [&str; 14] = [
    "arithmetic",
    "rays",
    "lights",
    "shapes",
    "shared",
    "acceleration",
    "bodies",
    "placement",
    "materials",
    "build",
    "transport",
    "film",
    "sampled",
    "probe",
];

/// The crates of pure functions, without side effects.
const CORE: [&str; 5] = ["rayfold-assets", "rayfold-scene", "rayfold-tracer", "rayfold-gif", "rayfold-movie"];

/// Packages that open sockets, read clocks or draw random numbers, by the start of their names.
const OUTSIDE_THE_CORE: &[&str] = &[
    "tokio",
    "aws-",
    "hyper",
    "reqwest",
    "lambda_",
    "async-",
    "mio",
    "socket2",
    "chrono",
    "jiff",
    "rand",
    "getrandom",
];

/// The largest number of lines of a source file. A longer file has more than one responsibility.
const LONGEST_FILE: usize = 800;

#[test]
fn crates_know_only_what_they_may() {
    let metadata = metadata();
    let members = members(&metadata);
    let table: BTreeMap<&str, &[&str]> = KNOWS.iter().copied().collect();
    for (name, package) in &members {
        let allowed =
            table.get(name.as_str()).unwrap_or_else(|| panic!("{name} is not in the table of this test"));
        for dependency in list(package, "dependencies") {
            let kind = dependency["kind"].as_str().unwrap_or("normal");
            let used = text(dependency, "name");
            if kind != "dev" && members.contains_key(used) {
                assert!(allowed.contains(&used), "{name} must not know {used}");
            }
        }
    }
}

#[test]
fn the_core_sees_no_runtime_network_clock_or_randomness() {
    let metadata = metadata();
    let names: BTreeMap<&str, &str> =
        list(&metadata, "packages").iter().map(|p| (text(p, "id"), text(p, "name"))).collect();
    let used: BTreeMap<&str, Vec<&str>> = list(&metadata["resolve"], "nodes")
        .iter()
        .map(|node| {
            let normal = |d: &&Value| list(d, "dep_kinds").iter().any(|k| k["kind"].is_null());
            (text(node, "id"), list(node, "deps").iter().filter(normal).map(|d| text(d, "pkg")).collect())
        })
        .collect();
    for core in CORE {
        let start = names.iter().find(|(_, name)| **name == core).map(|(id, _)| *id).expect(core);
        let mut seen = BTreeSet::from([start]);
        let mut open = vec![start];
        while let Some(id) = open.pop() {
            let name = names[id];
            assert!(!OUTSIDE_THE_CORE.iter().any(|o| name.starts_with(o)), "{core} depends on {name}");
            open.extend(used[id].iter().filter(|next| seen.insert(next)));
        }
        assert!(
            seen.len() > 1,
            "{core} has no dependencies at all: is this test still looking in the right place?"
        );
    }
}

#[test]
fn no_modules_use_one_another_in_a_circle() {
    let read = |path: &Path| std::fs::read_to_string(path).ok();
    let mut found = Vec::new();
    for folder in std::fs::read_dir(root().join("crates")).unwrap().map(|entry| entry.unwrap()) {
        let name = folder.file_name().into_string().unwrap();
        let roots = crate_roots(&folder.path().join("src"));
        assert!(!roots.is_empty(), "crates/{name} has neither a library nor a program");
        let circles = roots.iter().flat_map(|root| circles::circles(root, &read));
        found.extend(circles.map(|circle| format!("crates/{name}: {circle}")));
    }
    assert!(found.is_empty(), "modules that use one another in a circle:\n{}", found.join("\n"));
}

#[test]
fn rooms_of_the_tracer_use_those_before_them_and_are_small() {
    let read = |path: &Path| std::fs::read_to_string(path).ok();
    let source = root().join("crates/tracer/src");
    let found = circles::upward(&source.join("lib.rs"), &read, "fast", &ROOMS);
    assert!(
        found.is_empty(),
        "uses of later rooms, or rooms that have no place in ROOMS:\n{}",
        found.join("\n")
    );
    for room in ROOMS {
        let files = rust_files(&source.join("fast").join(room));
        assert!(room == "probe" || !files.is_empty(), "there is no folder {room}");
        assert!(files.len() <= 12, "{room} has {} files: more than twelve are two rooms", files.len());
    }
}

#[test]
fn the_core_names_no_file_clock_environment_or_output() {
    let banned =
        ["std::fs", "std::env", "std::net", "std::process", "std::time", "SystemTime", "Instant::now"];
    for core in ["scene", "tracer", "gif"] {
        for file in rust_files(&root().join("crates").join(core).join("src")) {
            let source = read(&file);
            for (number, line) in production(&source).enumerate() {
                for word in banned {
                    assert!(!line.contains(word), "{}:{}: {word} in the core", file.display(), number + 1);
                }
            }
        }
    }
}

#[test]
fn aws_stays_in_the_s3_store_and_the_functions() {
    let banned =
        ["aws_sdk", "aws_config", "aws_smithy", "aws_credential", "aws_lambda_events", "lambda_runtime"];
    let mut outside = Vec::new();
    for file in rust_files(&root().join("crates")) {
        let shown = file.strip_prefix(root()).unwrap().to_string_lossy().replace('\\', "/");
        if shown.starts_with("crates/lambda/") || shown.contains("/store/s3") {
            continue;
        }
        for (number, line) in read(&file).lines().enumerate() {
            let code = line.trim_start();
            if !code.starts_with("//") && banned.iter().any(|b| code.contains(b)) {
                outside.push(format!("{shown}:{}: {code}", number + 1));
            }
        }
    }
    assert!(outside.is_empty(), "AWS types outside the S3 store and crates/lambda:\n{}", outside.join("\n"));
}

#[test]
fn source_files_are_short() {
    let rust = ["crates", "tests", "fuzz"].map(|folder| rust_files(&root().join(folder)));
    let page = ["src", "tests"].map(|folder| root().join("crates/studio/web").join(folder));
    let page = page.map(|folder| files(&folder, &["ts", "tsx", "mjs", "css"]));
    assert!(page.iter().all(|files| !files.is_empty()), "the page's sources are elsewhere");
    for file in rust.iter().chain(&page).flatten() {
        let lines = read(file).lines().count();
        assert!(lines < LONGEST_FILE, "{} has {lines} lines: split it by responsibility", file.display());
    }
}

#[test]
fn source_files_say_why_they_exist() {
    for file in rust_files(&root().join("crates")) {
        let source = read(&file);
        let first = source.lines().find(|line| !line.is_empty()).unwrap_or_default();
        assert!(first.starts_with("//!"), "{} does not start with its purpose (//!)", file.display());
    }
}

#[test]
fn nothing_is_left_to_do() {
    let marks = [["TO", "DO"], ["FIX", "ME"], ["XX", "X"], ["#[ign", "ore"]].map(|halves| halves.concat());
    for folder in ["crates", "tests", "fuzz"] {
        for file in rust_files(&root().join(folder)) {
            for (number, line) in read(&file).lines().enumerate() {
                for mark in &marks {
                    assert!(!line.contains(mark.as_str()), "{}:{}: {mark}", file.display(), number + 1);
                }
            }
        }
    }
}

#[test]
fn architecture_page_names_every_crate() {
    let page = read(&root().join("ARCHITECTURE.md"));
    for entry in std::fs::read_dir(root().join("crates")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        assert!(page.contains(&format!("crates/{name}`")), "ARCHITECTURE.md does not name crates/{name}");
    }
}

#[test]
fn every_crate_takes_lints_and_dependencies_from_the_workspace() {
    for entry in std::fs::read_dir(root().join("crates")).unwrap() {
        let path = entry.unwrap().path().join("Cargo.toml");
        let manifest = read(&path);
        // It exports names to a page, which a crate may not do that forbids unsafe code.
        let has_own_lints = path.ends_with("crates/web/Cargo.toml");
        let inherits = manifest.contains("[lints]\nworkspace = true");
        assert!(inherits != has_own_lints, "{} sets lints of its own", path.display());
        let mut in_dependencies = false;
        for line in manifest.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'))
        {
            if line.starts_with('[') {
                in_dependencies = line.ends_with("dependencies]");
            } else if in_dependencies {
                let inherited = line.contains("workspace = true") || line.contains(".workspace=true");
                assert!(inherited, "{}: `{line}` belongs in [workspace.dependencies]", path.display());
            }
        }
    }
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap()
}

/// Returns the root files of the crates in `src`: a library, a program, or several.
fn crate_roots(src: &Path) -> Vec<PathBuf> {
    let named = ["lib.rs", "main.rs"].map(|name| src.join(name)).into_iter().filter(|path| path.exists());
    named.chain(rust_files(&src.join("bin"))).collect()
}

/// Returns the metadata for this machine's platform only, because the packages of other platforms need not be on the
/// disk.
fn metadata() -> Value {
    let version = Command::new("rustc").arg("-vV").output().expect("rustc runs");
    let version = String::from_utf8(version.stdout).unwrap();
    let host = version.lines().find_map(|line| line.strip_prefix("host: ")).expect("rustc names its host");
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--locked", "--filter-platform", host])
        .current_dir(root())
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn members(metadata: &Value) -> BTreeMap<String, &Value> {
    let ids: BTreeSet<&str> =
        list(metadata, "workspace_members").iter().map(|id| id.as_str().expect("an id is text")).collect();
    list(metadata, "packages")
        .iter()
        .filter(|package| ids.contains(text(package, "id")))
        .map(|package| (text(package, "name").to_owned(), package))
        .collect()
}

fn list<'a>(value: &'a Value, key: &str) -> &'a [Value] {
    value[key].as_array().unwrap_or_else(|| panic!("no list `{key}`"))
}

fn text<'a>(value: &'a Value, key: &str) -> &'a str {
    value[key].as_str().unwrap_or_else(|| panic!("no text `{key}`"))
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    files(folder, &["rs"])
}

/// Returns the files below a folder with one of the endings; none if there is no such folder.
fn files(folder: &Path, endings: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let Ok(entries) = std::fs::read_dir(folder) else { return found };
    for path in entries.map(|entry| entry.unwrap().path()) {
        if path.is_dir() && !path.ends_with("target") {
            found.extend(files(&path, endings));
        } else if path.extension().is_some_and(|e| endings.iter().any(|ending| e == *ending)) {
            found.push(path);
        }
    }
    found
}

/// Returns the shipped code: everything before the unit tests, without comments.
fn production(source: &str) -> impl Iterator<Item = &str> {
    source
        .lines()
        .take_while(|line| !line.contains("#[cfg(test)]"))
        .map(|line| line.split("//").next().unwrap_or_default())
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}
