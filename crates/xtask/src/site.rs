//! Builds the studio as a static site: target/site, a folder for any host of files.
//!
//! The site has the page and its workers (built by Node from `crates/studio/web`), the two variants of the WebAssembly
//! module (`crates/web`), a start page with the examples, and each example as a zip file. Each text file and each
//! module also has a copy compressed with Brotli, for hosts that serve those. The page requests no other files.

use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, ensure};
use rayfold_files::Folder;

use crate::archive::{self, Entry};
use crate::sources::root;
use crate::toolchain::{self, say};

const TARGET: &str = "wasm32-unknown-unknown";

/// The variants of the module, and the instructions of each. `src/static/variant.ts` chooses one.
const MODULES: [(&str, &str); 2] = [("relaxed.wasm", "+simd128,+relaxed-simd"), ("rayfold.wasm", "+simd128")];

/// The default font of letters, which the module lacks.
const FONT: &str = "font.ttf";

/// The largest module, compressed.
const LARGEST: u64 = 3 << 19;

/// The page of the studio, as the start page links to it.
const STUDIO: &str = "studio.html";

/// Builds the site. A draft is for tests: both modules are the variant that every browser runs, and nothing is
/// compressed.
pub(crate) fn run(draft: bool) -> anyhow::Result<()> {
    let root = root()?;
    let web = root.join("crates/studio/web");
    let site = root.join(if draft { "target/site-draft" } else { "target/site" });
    ensure!(
        web.join("node_modules").is_dir(),
        "the page's packages are not installed: `npm ci` in crates/studio/web"
    );
    let mut npm = Command::new("npm");
    toolchain::run(npm.args(["run", "site", "--", "--outDir"]).arg(&site).current_dir(&web))?;
    for (file, features) in MODULES {
        let features = if draft { MODULES[1].1 } else { features };
        let built = module(&root, features, draft)?;
        fs::copy(built, site.join(file)).with_context(|| format!("cannot copy {file}"))?;
    }

    fs::write(site.join(FONT), notosans::BOLD_TTF)?;
    let examples = site.join("examples");
    fs::create_dir_all(&examples)?;
    let mut cards = String::new();
    for (name, files) in examples_of(&root.join("scenes"))? {
        let entries = files.iter().map(|path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            Ok(Entry::text(name, fs::read(path)?))
        });
        let zip = archive::zip(entries.collect::<anyhow::Result<_>>()?)?;
        fs::write(examples.join(format!("{name}.zip")), zip)?;
        cards.push_str(&card(&root, &examples, &name)?);
    }
    let read = |name: &str| fs::read_to_string(web.join("site").join(name));
    fs::write(site.join("index.html"), read("index.html")?.replace("<!-- examples -->", &cards))?;
    fs::copy(web.join("site/index.css"), site.join("index.css"))?;
    let (names, version) = kept(&site)?;
    let offline = read("offline.js")?.replace("@VERSION@", &version).replace("\"@FILES@\"", &names);
    fs::write(site.join("offline.js"), offline)?;
    if draft {
        return Ok(());
    }
    let mut node = Command::new("node");
    toolchain::run(node.arg("compress.mjs").arg(&site).current_dir(&web))?;
    for (file, _) in MODULES {
        let size = fs::metadata(site.join(format!("{file}.br")))?.len();
        say(&format!("{file}: {size} bytes with Brotli"));
        ensure!(size <= LARGEST, "{file} is larger than {LARGEST} bytes");
    }
    say(&format!("target/site, version {version}: serve it by any host of files"));
    Ok(())
}

/// Builds the module with these features of WebAssembly, and returns its path.
fn module(root: &Path, features: &str, draft: bool) -> anyhow::Result<PathBuf> {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["build", "--locked", "--profile", "web", "--package", "rayfold-web", "--target", TARGET]);
    cargo.arg("--target-dir").arg(root.join("target"));
    // Messages of panics name the sources of dependencies, without the folder where this machine has them.
    let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let home =
        home.or_else(|| Some(std::env::home_dir()?.join(".cargo"))).context("there is no home folder")?;
    let flags = [format!("-Ctarget-feature={features}"), format!("--remap-path-prefix={}=", home.display())];
    // Beside those of `.cargo/config.toml`.
    cargo.arg("--config").arg(format!("target.{TARGET}.rustflags={flags:?}"));
    if draft {
        cargo.args(["--config", "profile.web.lto=false"]);
    }
    toolchain::run(cargo.current_dir(root))
        .with_context(|| format!("`rustup target add {TARGET}` is needed once"))?;
    Ok(root.join("target").join(TARGET).join("web/rayfold_web.wasm"))
}

/// Returns the name of each example and its files: scripts, settings, and the files that the scripts name.
fn examples_of(scenes: &Path) -> anyhow::Result<Vec<(String, Vec<PathBuf>)>> {
    let mut examples = Vec::new();
    for entry in fs::read_dir(scenes)? {
        let folder = entry?.path();
        if !folder.is_dir() || Folder::list(&folder)?.scripts.is_empty() {
            continue;
        }
        let mut files: Vec<_> =
            fs::read_dir(&folder)?.map(|file| Ok(file?.path())).collect::<anyhow::Result<_>>()?;
        files.retain(|file| file.is_file());
        files.sort();
        examples.push((folder.file_name().unwrap_or_default().to_string_lossy().into_owned(), files));
    }
    // Those that are for the studio first.
    examples.sort_by_key(|(name, _)| (name != "hello", name.clone()));
    ensure!(!examples.is_empty(), "{} has no examples", scenes.display());
    Ok(examples)
}

/// Copies the picture of an example, and returns the part of the start page that shows it.
fn card(root: &Path, examples: &Path, name: &str) -> anyhow::Result<String> {
    let images = root.join("docs/images");
    let picture = ["gif", "png"].map(|ending| format!("{name}.{ending}"));
    let picture = picture.iter().find(|file| images.join(file).is_file());
    let picture = picture.with_context(|| format!("docs/images has no picture of {name}"))?;
    let (from, copy) = (images.join(picture), examples.join(picture));
    fs::copy(&from, &copy)?;
    let mut shown =
        format!("<img src=\"examples/{picture}\" alt=\"\" loading=\"lazy\" width=\"320\" height=\"240\" />");
    if picture.ends_with(".gif") {
        first_frame(&from).with_context(|| picture.clone())?.save(copy.with_extension("png"))?;
        shown = format!(
            "<picture><source media=\"(prefers-reduced-motion: reduce)\" srcset=\"examples/{name}.png\" />{shown}</picture>"
        );
    }
    Ok(format!("<li><a href=\"{STUDIO}#example={name}\">{shown}<span>{name}</span></a></li>\n        "))
}

/// Returns the first picture of a GIF, for people who prefer pictures without motion.
fn first_frame(gif: &Path) -> anyhow::Result<image::RgbaImage> {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(BufReader::new(fs::File::open(gif)?))?;
    let frame = decoder.read_next_frame()?.context("it has no frame")?;
    let (width, height) = (frame.width.into(), frame.height.into());
    image::RgbaImage::from_raw(width, height, frame.buffer.to_vec()).context("its frame is cut off")
}

/// Returns the names of the files that the browser stores from the start, as the items of a list in JavaScript, and a
/// version. The version changes with the content of these files and of the modules, of which a browser stores one.
/// Pictures of examples are stored when they are shown.
fn kept(site: &Path) -> anyhow::Result<(String, String)> {
    let mut names = vec!["index.html".to_owned(), "./".to_owned()];
    for (folder, prefix) in [(site.to_owned(), ""), (site.join("examples"), "examples/")] {
        for entry in fs::read_dir(folder)? {
            let name = entry?.file_name().to_string_lossy().into_owned();
            let is_app =
                prefix.is_empty() && ["js", "css", "html", "ttf"].iter().any(|end| name.ends_with(end));
            if (is_app && !["offline.js", "index.html"].contains(&name.as_str())) || name.ends_with(".zip") {
                names.push(format!("{prefix}{name}"));
            }
        }
    }
    names.sort();
    let mut hasher = DefaultHasher::new();
    for name in
        names.iter().map(String::as_str).chain(MODULES.map(|(file, _)| file)).filter(|name| *name != "./")
    {
        (name, fs::read(site.join(name))?).hash(&mut hasher);
    }
    let list: Vec<_> = names.iter().map(|name| format!("{name:?}")).collect();
    Ok((list.join(", "), format!("rayfold-{:016x}", hasher.finish())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_example_has_its_files_and_a_picture() {
        let root = root().unwrap();
        let folder = tempfile::tempdir().unwrap();
        let examples = examples_of(&root.join("scenes")).unwrap();
        assert_eq!(examples[0].0, "hello");
        for (name, files) in examples {
            assert!(
                files.iter().any(|file| file.extension().is_some_and(|ending| ending == "txt")),
                "{name}"
            );
            assert!(card(&root, folder.path(), &name).unwrap().contains(&format!("#example={name}\"")));
            let still = image::open(folder.path().join(format!("{name}.png"))).unwrap();
            assert!(still.width() >= 240, "{name}");
        }
    }

    #[test]
    fn the_version_changes_with_any_file_that_is_kept() {
        let site = tempfile::tempdir().unwrap();
        fs::create_dir(site.path().join("examples")).unwrap();
        for name in
            ["index.html", "studio.js", "examples/x.zip", "examples/x.gif", "rayfold.wasm", "relaxed.wasm"]
        {
            fs::write(site.path().join(name), "a").unwrap();
        }
        let (names, version) = kept(site.path()).unwrap();
        assert_eq!(names, r#""./", "examples/x.zip", "index.html", "studio.js""#);
        assert_eq!(kept(site.path()).unwrap().1, version);
        for name in ["examples/x.zip", "relaxed.wasm"] {
            let before = kept(site.path()).unwrap().1;
            fs::write(site.path().join(name), "b").unwrap();
            assert_ne!(kept(site.path()).unwrap().1, before, "{name}");
        }
    }
}
