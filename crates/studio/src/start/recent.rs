//! The scenes that were opened last: a list of paths in the user's folder for the state of programs.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

use rayfold_files::OutputFile;

/// The number of paths that are kept.
const KEPT: usize = 8;

/// The file of the list; without one, nothing is remembered.
#[derive(Debug)]
pub struct Recent(Option<PathBuf>);

impl Recent {
    /// Returns the list of this user.
    pub fn of_user() -> Self {
        let set = |name: &str| env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
        let home = || env::home_dir().map(|home| home.join(".local/state"));
        let folder = set("XDG_STATE_HOME").or_else(|| set("LOCALAPPDATA")).or_else(home);
        Self(folder.map(|folder| folder.join("rayfold").join("recent.json")))
    }

    /// Returns the list in a file.
    pub fn at(path: PathBuf) -> Self {
        Self(Some(path))
    }

    /// Returns the paths that still exist, the newest first.
    pub fn list(&self) -> Vec<PathBuf> {
        self.all().into_iter().filter(|path| path.exists()).collect()
    }

    fn all(&self) -> Vec<PathBuf> {
        let text = self.0.as_ref().and_then(|path| fs::read(path).ok()).unwrap_or_default();
        serde_json::from_slice(&text).unwrap_or_default()
    }

    /// Puts a path first. A list that cannot be written is no error: it is a convenience.
    pub fn add(&self, path: &Path) {
        let (Some(file), Ok(path)) = (&self.0, path.canonicalize()) else { return };
        let mut all = self.all();
        all.retain(|other| *other != path);
        all.insert(0, path);
        all.truncate(KEPT);
        if let (Some(folder), Ok(text)) = (file.parent(), serde_json::to_vec(&all))
            && fs::create_dir_all(folder).is_ok()
        {
            let _ = OutputFile::write(file, text, false);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_is_first_and_what_is_gone_is_not_listed() {
        let folder = tempfile::tempdir().unwrap();
        let recent = Recent::at(folder.path().join("a/b/recent.json"));
        assert_eq!(recent.list(), Vec::<PathBuf>::new());
        let path = |number: usize| folder.path().canonicalize().unwrap().join(number.to_string());
        for number in 0..KEPT + 3 {
            fs::write(path(number), "").unwrap();
            recent.add(&path(number));
        }
        recent.add(&path(5));
        fs::remove_file(path(7)).unwrap();
        assert_eq!(recent.list(), [5, 10, 9, 8, 6, 4, 3].map(path));
        Recent(None).add(&path(5));
        fs::write(folder.path().join("a/b/recent.json"), "{").unwrap();
        assert_eq!(recent.list(), Vec::<PathBuf>::new());
    }
}
