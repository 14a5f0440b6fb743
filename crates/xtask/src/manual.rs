//! The scripts of `docs/language.md`, each of which has a picture.
//!
//! A code block that starts with ```` ```scene NAME ```` is the script of the picture `NAME`. A block that sets the
//! size of the image is a whole script. Any other block is completed: the stage (the block `stage`: camera, light and
//! floor) is inserted before it, and a `Trace` after it. This module does not depend on how a script is drawn.
//!
//! ````text
//! ```scene sphere
//! Sphere 1  0 1 0  red
//! ```
//! ````

use anyhow::{Context, ensure};

/// The language page, relative to the root of the repository.
pub(crate) const PAGE: &str = "docs/language.md";
/// The folder of its pictures, relative to the root of the repository.
pub(crate) const PICTURES: &str = "docs/images/language";

/// The folder of the models that its scripts name, relative to the root of the repository.
pub(crate) const MODELS: &str = "docs/models";

/// The name of the block that incomplete examples share.
const STAGE: &str = "stage";
/// The prefix of examples that show how a number changes rather than a scene.
const CURVE: &str = "curve-";

/// A script of the page.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Example {
    /// The name of the example, and of its picture without the ending.
    pub(crate) name: String,
    /// The complete script of the example.
    pub(crate) script: String,
}

impl Example {
    /// Returns whether its picture is a plot of a number over the frames.
    pub(crate) fn is_curve(&self) -> bool {
        self.name.starts_with(CURVE)
    }

    /// Returns the file name of its picture.
    pub(crate) fn file(&self) -> String {
        format!("{}.{}", self.name, if self.is_curve() { "svg" } else { "png" })
    }
}

/// Returns all examples of a page in its order, without the stage.
///
/// # Errors
/// Fails if a name occurs twice, or if an example needs a stage and there is none.
pub(crate) fn examples(page: &str) -> anyhow::Result<Vec<Example>> {
    let blocks = blocks(page);
    let stage = blocks.iter().find(|(name, _)| *name == STAGE).map(|(_, text)| text.as_str());
    let mut all: Vec<Example> = Vec::new();
    for (name, text) in blocks.iter().filter(|(name, _)| *name != STAGE) {
        ensure!(all.iter().all(|other| other.name != *name), "there are two scripts `{name}`");
        let is_whole = text.lines().any(|line| line.starts_with("Screen"));
        let script = if is_whole {
            text.clone()
        } else {
            let stage = stage.with_context(|| format!("`{name}` needs a script `{STAGE}`"))?;
            format!("{stage}{text}Trace\n")
        };
        all.push(Example { name: (*name).to_owned(), script });
    }
    Ok(all)
}

/// Returns the code blocks that are scripts with a name.
fn blocks(page: &str) -> Vec<(&str, String)> {
    let mut lines = page.lines();
    let mut blocks = Vec::new();
    while let Some(line) = lines.next() {
        if let Some(name) = line.strip_prefix("```scene ") {
            let text = lines.by_ref().take_while(|line| *line != "```").map(|line| format!("{line}\n"));
            blocks.push((name.trim(), text.collect()));
        }
    }
    blocks
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::fs;
    use std::path::Path;

    use rayfold_files::library_beside;
    use rayfold_scene::{Command, Limits, parse_with_files};

    use super::*;

    /// The largest size of a picture in bytes: larger ones make the page slow to read.
    const LARGEST: u64 = 100_000;

    fn root() -> &'static Path {
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
    }

    fn page() -> (String, Vec<Example>) {
        let page = fs::read_to_string(root().join(PAGE)).unwrap();
        let examples = examples(&page).unwrap();
        (page, examples)
    }

    #[test]
    fn what_is_not_whole_stands_on_the_stage() {
        let page = "a\n```scene stage\nScreen 4 3\n```\n```scene a\nSphere 1\n```\nb\n```text\nno\n```\n\
                    ```scene b\nScreen 2 1\nTrace\n```\n";
        let example = |name: &str, script: &str| Example { name: name.into(), script: script.into() };
        assert_eq!(
            examples(page).unwrap(),
            [example("a", "Screen 4 3\nSphere 1\nTrace\n"), example("b", "Screen 2 1\nTrace\n")]
        );
        assert!(examples("```scene a\nSphere 1\n```\n").is_err());
        assert!(examples("```scene a\nScreen 1 1\n```\n```scene a\nScreen 1 1\n```\n").is_err());
    }

    #[test]
    fn every_script_of_the_page_is_in_order() {
        let (_, examples) = page();
        for Example { name, script } in &examples {
            let models = library_beside(&root().join(MODELS).join("script.txt"));
            let parsed = parse_with_files(name, script.as_bytes(), &Limits::default(), &models);
            // The stage defines more materials than each example uses. One example shows what one ray per pixel does.
            let is_meant = |message: &str| {
                message.contains("this material is not used")
                    || name == "samples" && message.contains("has no effect")
            };
            let faults: Vec<_> = parsed
                .diagnostics
                .iter()
                .filter(|d| d.is_error() || !is_meant(&d.message))
                .map(|d| d.render(false))
                .collect();
            assert!(faults.is_empty(), "{}", faults.join("\n"));
        }
    }

    #[test]
    fn every_picture_of_the_page_is_there_and_is_drawn_by_it() {
        let (page, examples) = page();
        let files: BTreeSet<String> = examples.iter().map(Example::file).collect();
        for file in &files {
            let path = root().join(PICTURES).join(file);
            let size =
                fs::metadata(&path).unwrap_or_else(|e| panic!("cargo xtask pictures: {file}: {e}")).len();
            assert!(size <= LARGEST, "{file} has {size} bytes");
            assert!(page.contains(&format!("](images/language/{file})")), "the page does not show {file}");
        }
        let shown = page.split("](images/language/").skip(1).filter_map(|rest| rest.split(')').next());
        let shown: BTreeSet<String> = shown.map(str::to_owned).collect();
        let there: BTreeSet<String> = fs::read_dir(root().join(PICTURES))
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        assert_eq!((&shown, &there), (&files, &files), "what the page shows, and what is there");
    }

    #[test]
    fn everything_of_the_language_has_a_picture() {
        let (_, examples) = page();
        let words: BTreeSet<String> = examples
            .iter()
            .flat_map(|example| example.script.split_whitespace())
            .map(str::to_lowercase)
            .collect();
        let language = rayfold_scene::language();
        let clauses = language.clauses.iter().map(|clause| clause.name);
        for name in Command::ALL.iter().map(|command| command.name()).chain(clauses) {
            assert!(words.contains(&name.to_lowercase()), "no script uses `{name}`");
        }
        for mode in &language.curve_modes {
            assert!(words.iter().any(|word| word.trim_start_matches('(') == mode.name), "{}", mode.name);
        }
    }
}
