//! The page of each subcommand in docs/commands contains its help.
//!
//! `SNAPSHOTS=overwrite cargo test -p rayfold --test cli pages` updates the pages.

use std::path::{Path, PathBuf};

use snapbox::{Assert, Data};

use crate::Folder;

const PAGES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/commands");

/// Returns the help for a terminal of the usual width.
fn help(of: &str) -> String {
    let out = Folder::new().rayfold(&format!("{of} --help")).env("COLUMNS", "80").assert().code(0);
    String::from_utf8(out.get_output().stdout.clone()).unwrap()
}

/// Returns the subcommands that the help lists.
fn subcommands() -> Vec<String> {
    let help = help("");
    let lines =
        help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    // Continuation lines are indented further.
    let names =
        lines.filter(|line| !line.starts_with("   ")).filter_map(|line| line.split_whitespace().next());
    names.filter(|name| *name != "help").map(str::to_owned).collect()
}

fn page(name: &str) -> String {
    let (title, help) = if name == "rayfold" {
        ("rayfold".to_owned(), help(""))
    } else {
        (format!("rayfold {name}"), help(name))
    };
    format!(
        "# {title}\n\n<!-- Made of the program's help: SNAPSHOTS=overwrite cargo test -p rayfold --test cli pages -->\n\n\
         ```text\n{}\n```\n",
        help.lines().map(str::trim_end).collect::<Vec<_>>().join("\n").trim_end()
    )
}

#[cfg(unix)]
#[test]
fn the_page_of_each_subcommand_is_its_help() {
    let folder = PathBuf::from(PAGES);
    let mut names = subcommands();
    names.push("rayfold".into());
    let assert = Assert::new().action_env("SNAPSHOTS");
    for name in &names {
        let text = page(name);
        let widest = text.lines().map(|line| line.chars().count()).max();
        assert!(widest <= Some(100), "{name}: a line of {widest:?} columns");
        assert.eq(text, Data::read_from(&folder.join(format!("{name}.md")), None).raw());
    }
    let there = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
    let there: Vec<String> =
        there.map(|path| path.file_stem().unwrap().to_string_lossy().into_owned()).collect();
    for page in there.iter().filter(|page| *page != "README") {
        assert!(names.contains(page), "docs/commands/{page}.md is the page of no subcommand");
    }
    let index = std::fs::read_to_string(Path::new(PAGES).join("README.md")).unwrap();
    for name in names {
        assert!(
            index.contains(&format!("({name}.md)")),
            "docs/commands/README.md does not lead to {name}.md"
        );
    }
}

/// Each code block marked `scene` is a complete script.
#[test]
fn what_the_pages_show_is_drawn_without_a_word() {
    let docs = Path::new(PAGES).parent().unwrap();
    let folder = Folder::new();
    for page in ["tutorial.md", "camera.md"] {
        let text = std::fs::read_to_string(docs.join(page)).unwrap();
        let blocks = text.split("\n```scene\n").skip(1).map(|rest| rest.split("```").next().unwrap());
        let scripts: Vec<&str> = blocks.collect();
        assert!(!scripts.is_empty(), "{page} shows no script");
        for script in scripts {
            let said = folder.rayfold("check -").stdin(script).assert().code(0).get_output().stderr.clone();
            let said = String::from_utf8(said).unwrap();
            assert!(said.lines().count() == 1 && said.ends_with(": no errors\n"), "{page}: {said}");
            folder.rayfold("render - -o a.png --frame 1").stdin(script).assert().code(0);
            let image = folder.image("a.png");
            let first = image.get_pixel(0, 0);
            assert!(
                image.pixels().any(|pixel| pixel != first),
                "{page} shows a script of nothing:\n{script}"
            );
        }
    }
}
