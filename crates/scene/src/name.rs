//! The classification of file names: the single definition of scripts, settings and other files, for folders on disk
//! and for keys in a bucket. `docs/pipeline.md` has the table.

/// The settings file beside the scripts of a folder.
pub const SETTINGS_FILE: &str = "animation.json";

/// The class of a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Name<'a> {
    /// A script; the name is without `.txt`.
    Script(&'a str),
    /// The settings file `animation.json`.
    Settings,
    /// A file that systems and programs leave in folders. It is ignored without a warning.
    Ignored,
    /// A name that looks like a script or settings but is wrong, with the correction. The file is not read, and
    /// a warning names it.
    NearMiss(&'static str),
    /// A script, settings or a near miss outside of an animation's folder, with the correction.
    Misplaced(&'static str),
    /// Any other file: a picture, a README.
    Other,
}

impl<'a> Name<'a> {
    /// Classifies a file in an animation's own folder.
    ///
    /// ```
    /// use rayfold_scene::Name;
    /// assert_eq!(Name::of("frame07.txt"), Name::Script("frame07"));
    /// assert_eq!(Name::of("._frame07.txt"), Name::Ignored);
    /// assert!(matches!(Name::of("frame07.TXT"), Name::NearMiss(_)));
    /// assert_eq!(Name::of("notes.md"), Name::Other);
    /// ```
    pub fn of(file: &'a str) -> Self {
        if is_left_behind(file) {
            return Name::Ignored;
        }
        let name = match file.rsplit_once('.') {
            Some((stem, "txt")) if !stem.is_empty() && stem.trim() == stem => Name::Script(stem),
            _ if file == SETTINGS_FILE => Name::Settings,
            Some((stem, ending)) if ending.trim().eq_ignore_ascii_case("txt") => Name::NearMiss({
                if stem.trim().is_empty() {
                    "expected a name before the ending .txt"
                } else if stem.trim() != stem || ending.trim() != ending {
                    "expected no blanks around the name and its ending .txt"
                } else {
                    "expected the ending .txt in small letters"
                }
            }),
            Some((stem, ending)) if is_like_settings(stem, ending) => {
                Name::NearMiss("expected animation.json, in small letters and without blanks")
            }
            _ => Name::Other,
        };
        match name {
            Name::Script(_) | Name::NearMiss(_) if file.contains('\\') => Name::Misplaced(BACKSLASH),
            name => name,
        }
    }

    /// Classifies an object of this size in bytes by its key, without the `scripts/` before it.
    ///
    /// ```
    /// use rayfold_scene::Name;
    /// assert_eq!(Name::below_scripts("film/1.txt", 99), Name::Script("1"));
    /// assert!(matches!(Name::below_scripts("film//1.txt", 99), Name::Misplaced(_)));
    /// assert_eq!(Name::below_scripts("film/", 0), Name::Ignored);
    /// ```
    pub fn below_scripts(path: &'a str, bytes: u64) -> Self {
        let Some((folder, file)) = path.rsplit_once('/') else {
            return match Name::of(path) {
                Name::Script(_) | Name::Settings | Name::NearMiss(_) => Name::Misplaced(NO_FOLDER),
                _ if path.is_empty() => Name::Ignored,
                name => name,
            };
        };
        if folder.split('/').any(|segment| is_left_behind(segment) || segment == "__MACOSX") {
            return Name::Ignored;
        }
        if file.is_empty() {
            // Consoles and mounts mark a folder with such an object.
            return if bytes == 0 { Name::Ignored } else { Name::Misplaced(EMPTY) };
        }
        let problem = folder.split('/').find_map(|segment| match segment {
            "" => Some(EMPTY),
            "." | ".." => Some(DOTS),
            _ if segment.contains('\\') => Some(BACKSLASH),
            _ => None,
        });
        match (Name::of(file), problem) {
            (Name::Script(_) | Name::Settings | Name::NearMiss(_), Some(problem)) => Name::Misplaced(problem),
            (name, _) => name,
        }
    }
}

const NO_FOLDER: &str = "a script lies in a folder, which is the animation: scripts/<animation>/<name>.txt";
const EMPTY: &str = "an animation's name has an empty segment";
const DOTS: &str = "an animation's name has a segment . or ..";
const BACKSLASH: &str = "the key has a backslash: folders are separated by /";

/// Returns the script name of a file in a folder, which is the file name without `.txt`, or `None` if the file
/// is no script. [`natural_cmp`](crate::natural_cmp) orders names, not file names: `f` comes before `f-1`,
/// though `f.txt` would not.
pub fn script_name(file: &str) -> Option<&str> {
    match Name::of(file) {
        Name::Script(name) => Some(name),
        _ => None,
    }
}

/// Returns whether a file or folder is hidden, or a system's own.
fn is_left_behind(segment: &str) -> bool {
    let is_hidden = segment.starts_with('.') && !matches!(segment, "." | "..");
    is_hidden || ["thumbs.db", "desktop.ini"].iter().any(|name| segment.eq_ignore_ascii_case(name))
}

fn is_like_settings(stem: &str, ending: &str) -> bool {
    let (wanted, _) = SETTINGS_FILE.split_once('.').unwrap_or_default();
    stem.trim().eq_ignore_ascii_case(wanted) && ending.trim().eq_ignore_ascii_case("json")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::natural_cmp;

    /// Returns the class in a word.
    fn class(name: Name<'_>) -> &'static str {
        match name {
            Name::Script(_) => "script",
            Name::Settings => "settings",
            Name::Ignored => "ignored",
            Name::NearMiss(_) => "near miss",
            Name::Misplaced(_) => "misplaced",
            Name::Other => "other",
        }
    }

    #[test]
    fn every_file_of_a_folder_has_one_class() {
        for (expected, names) in [
            (
                "script",
                &["1.txt", "a b.txt", "5.TXT.txt", "ü.txt", "1..txt", "a.txt.txt", "~.txt", "__MACOSX.txt"][..],
            ),
            ("settings", &["animation.json"]),
            (
                "ignored",
                &[
                    ".old.txt",
                    "._1.txt",
                    ".#1.txt",
                    ".txt",
                    "..txt",
                    ".DS_Store",
                    "Thumbs.db",
                    "THUMBS.DB",
                    "desktop.ini",
                    "Desktop.ini",
                    ".animation.json",
                ],
            ),
            (
                "near miss",
                &[
                    "3.TXT",
                    "3.Txt",
                    "5.txt ",
                    " 5.txt",
                    "5 .txt",
                    "5. txt",
                    "5.txt\u{a0}",
                    "5.txt\r",
                    "\t5.txt",
                    " .txt",
                    "5.TXT ",
                    "animation.JSON",
                    "Animation.json",
                    " animation.json",
                    "animation.json ",
                    "animation .json",
                ],
            ),
            ("misplaced", &["film\\1.txt", "\\1.TXT"]),
            (
                "other",
                &[
                    "notes.md",
                    "1.txt~",
                    "1.txt.bak",
                    "txt",
                    "1txt",
                    "",
                    "animation.json5",
                    "a\\b.png",
                    "animations.json",
                ],
            ),
        ] {
            for name in names {
                assert_eq!(class(Name::of(name)), expected, "{name:?}");
                assert_eq!(
                    class(Name::below_scripts(&format!("film/two/{name}"), 9)),
                    if name.is_empty() { "misplaced" } else { expected },
                    "{name:?}"
                );
            }
        }
    }

    #[test]
    fn every_key_below_scripts_has_one_class() {
        for (expected, keys) in [
            ("script", &["film/1.txt", "a/b/1.txt", "a b/1.txt", "ä/1.txt", "Thumbs/1.txt"][..]),
            ("settings", &["film/animation.json"]),
            (
                "ignored",
                &[
                    "",
                    "film/",
                    "a/b/",
                    "/",
                    "film//",
                    ".DS_Store",
                    "film/._1.txt",
                    ".git/1.txt",
                    "film/.ipynb_checkpoints/1.txt",
                    "__MACOSX/film/._1.txt",
                    "film/__MACOSX/1.txt",
                    "film/Thumbs.db",
                    "/.hidden/1.txt",
                ],
            ),
            ("near miss", &["film/3.TXT", "film/animation.JSON"]),
            (
                "misplaced",
                &[
                    "1.txt",
                    "1.TXT",
                    "animation.json",
                    "/h/1.txt",
                    "h//1.txt",
                    "./1.txt",
                    "../1.txt",
                    "a/../1.txt",
                    "a/./1.txt",
                    "a\\b/1.txt",
                    "a/b\\1.txt",
                    "a//2.TXT",
                    "//1.txt",
                ],
            ),
            ("other", &["film/notes.md", "notes.md", "a//logo.png", "film/1.txt/notes.md"]),
        ] {
            for key in keys {
                let bytes = if key.ends_with('/') || key.is_empty() { 0 } else { 9 };
                assert_eq!(class(Name::below_scripts(key, bytes)), expected, "{key:?}");
            }
        }
        assert_eq!(class(Name::below_scripts("film/", 1)), "misplaced", "a marker holds nothing");
    }

    #[test]
    fn scripts_are_ordered_without_their_ending() {
        let name = |file| script_name(file).unwrap();
        assert!(natural_cmp(name("f.txt"), name("f-1.txt")).is_lt());
        assert!(natural_cmp(name("f.txt"), name("f 1.txt")).is_lt());
        assert_eq!([".txt", "f.TXT", "f.txt~", SETTINGS_FILE].map(script_name), [None; 4]);
    }
}
