//! Reads a folder on disk as an animation.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use rayfold_scene::{Name, natural_cmp};

/// The files of an animation in a folder.
#[derive(Debug, Default)]
pub struct Folder {
    /// The scripts in the order of their frames, each with its name without `.txt`.
    pub scripts: Vec<(String, PathBuf)>,
    /// The path of the settings file.
    pub settings: Option<PathBuf>,
    /// The files that are not read although they look like a part of the animation.
    pub not_read: Vec<NotRead>,
    /// The folder is empty, without even an ignored file.
    pub is_empty: bool,
}

/// A file or folder that is not read because of its name or kind.
#[derive(Debug, Clone)]
pub struct NotRead {
    /// The path of the file or folder.
    pub path: PathBuf,
    /// The problem, with what would be right.
    pub problem: &'static str,
}

impl fmt::Display for NotRead {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "not read: {}", self.problem)
    }
}

impl Folder {
    /// Lists a folder. Scripts are not opened: anything but a regular file is refused when it is read.
    ///
    /// # Errors
    /// Returns the error of the system.
    pub fn list(path: &Path) -> io::Result<Self> {
        let mut folder = Self { is_empty: true, ..Self::default() };
        for entry in path.read_dir()? {
            let entry = entry?;
            folder.is_empty = false;
            let path = entry.path();
            let file = entry.file_name();
            let file = file.to_string_lossy();
            match Name::of(&file) {
                // The folder may hold another animation.
                Name::Script(_) if path.is_dir() => {
                    folder.not_read.push(NotRead { path, problem: "expected a script, found a folder" });
                }
                Name::Script(name) => folder.scripts.push((name.to_owned(), path)),
                Name::Settings => folder.settings = Some(path),
                Name::NearMiss(_) | Name::Misplaced(_) if path.is_dir() => {}
                Name::NearMiss(problem) | Name::Misplaced(problem) => {
                    folder.not_read.push(NotRead { path, problem });
                }
                Name::Ignored | Name::Other => {}
            }
        }
        folder.scripts.sort_by(|(a, _), (b, _)| natural_cmp(a, b));
        folder.not_read.sort_by(|a, b| a.path.cmp(&b.path));
        Ok(folder)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_sorted_out_by_names() {
        let folder = tempfile::tempdir().unwrap();
        assert!(Folder::list(folder.path()).unwrap().is_empty);
        for name in [
            "f10.txt",
            "f9.txt",
            "._f1.txt",
            ".old.txt",
            "3.TXT",
            "5.txt ",
            "notes.md",
            "animation.json",
            "Thumbs.db",
        ] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        for name in ["7.txt", "8.TXT", ".ipynb_checkpoints"] {
            std::fs::create_dir(folder.path().join(name)).unwrap();
        }
        let found = Folder::list(folder.path()).unwrap();
        let names: Vec<_> = found.scripts.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!((names, found.settings), (vec!["f9", "f10"], Some(folder.path().join("animation.json"))));
        let not_read: Vec<_> =
            found.not_read.iter().map(|not| not.path.file_name().unwrap().to_owned()).collect();
        assert_eq!(not_read, ["3.TXT", "5.txt ", "7.txt"]);
        assert!(!found.is_empty);
    }
}
