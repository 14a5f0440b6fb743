//! Keys that users and their programs write. A key that is no script or settings has no [`Key`], but may still have a
//! meaning.

use rayfold_scene::Name;
use rayfold_scene::assets::file_name;

use super::{Animation, Key, SCRIPTS, ScriptName};
use crate::{Error, Result};

/// An object below `scripts/`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Uploaded {
    /// A script of an animation.
    Script(Animation, ScriptName),
    /// The settings of an animation.
    Settings(Animation),
    /// An object that is meant as a script of an animation but has a key that the pipeline cannot use. The animation
    /// fails.
    Rejected(Animation, &'static str),
    /// An object with almost the name of a script or of the settings. It is not read, and the manifest contains a
    /// warning.
    NearMiss(Animation, &'static str),
    /// An object that belongs to no animation although it is meant as a part of one.
    Misplaced(&'static str),
    /// An object in an animation's folder that its scripts may name.
    File(Animation, String),
    /// An object without meaning, such as a file that an operating system leaves in a folder.
    Nothing,
}

impl Uploaded {
    /// Classifies an object by its key and size. An object that is not below `scripts/` has no meaning here.
    ///
    /// ```
    /// use rayfold_pipeline::keys::Uploaded;
    /// assert!(matches!(Uploaded::of("scripts/film/1.txt", 9), Uploaded::Script(..)));
    /// assert!(matches!(Uploaded::of("scripts/film/1.TXT", 9), Uploaded::NearMiss(..)));
    /// assert_eq!(Uploaded::of("scripts/film/", 0), Uploaded::Nothing);
    /// ```
    pub fn of(key: &str, bytes: u64) -> Self {
        let Some(path) = key.strip_prefix(SCRIPTS) else { return Self::Nothing };
        let animation = || Animation::new(path.rsplit_once('/').map_or("", |(folder, _)| folder));
        match Name::below_scripts(path, bytes) {
            Name::Ignored => Self::Nothing,
            Name::Other => match (animation(), path.rsplit_once('/')) {
                (Ok(animation), Some((_, name))) if file_name(name).is_ok() => {
                    Self::File(animation, name.to_owned())
                }
                _ => Self::Nothing,
            },
            Name::Misplaced(problem) => match animation() {
                // A backslash in the name alone: the folder is an animation's.
                Ok(animation) if !animation.as_str().contains('\\') => Self::NearMiss(animation, problem),
                _ => Self::Misplaced(problem),
            },
            Name::NearMiss(problem) => with(animation(), |animation| Self::NearMiss(animation, problem)),
            Name::Script(_) | Name::Settings => match key.parse() {
                Ok(Key::Script { animation, name }) => Self::Script(animation, name),
                Ok(Key::Settings { animation }) => Self::Settings(animation),
                Err(Error::Key { problem, .. }) => {
                    with(animation(), |animation| Self::Rejected(animation, problem))
                }
                Ok(_) | Err(_) => Self::Nothing,
            },
        }
    }

    /// Returns whether a key is that of a file that scripts may name.
    pub fn is_file(key: &str) -> bool {
        matches!(Self::of(key, 1), Self::File(..))
    }

    /// Returns the animation that it concerns.
    pub fn animation(self) -> Option<Animation> {
        match self {
            Self::Script(animation, _)
            | Self::Settings(animation)
            | Self::Rejected(animation, _)
            | Self::NearMiss(animation, _) => Some(animation),
            // A folder without scripts is no animation.
            Self::File(..) | Self::Misplaced(_) | Self::Nothing => None,
        }
    }
}

fn with(animation: Result<Animation>, class: impl FnOnce(Animation) -> Uploaded) -> Uploaded {
    match animation {
        Ok(animation) => class(animation),
        Err(Error::Key { problem, .. }) => Uploaded::Misplaced(problem),
        Err(_) => Uploaded::Nothing,
    }
}

/// Returns the problem with the place of an object that is meant as a part of an animation but belongs to none,
/// wherever in the bucket it is.
pub fn misplaced(key: &str, bytes: u64) -> Option<&'static str> {
    if key.starts_with(SCRIPTS) {
        return match Uploaded::of(key, bytes) {
            Uploaded::Misplaced(problem) => Some(problem),
            _ => None,
        };
    }
    let plain = key.replace('\\', "/");
    let (first, rest) = plain.trim_start_matches('/').split_once('/')?;
    let is_meant = matches!(
        Name::below_scripts(rest, bytes),
        Name::Script(_) | Name::Settings | Name::NearMiss(_) | Name::Misplaced(_)
    );
    let is_like_scripts = first.eq_ignore_ascii_case(SCRIPTS.trim_end_matches('/'));
    (is_like_scripts && is_meant).then_some("expected a key that begins with scripts/, in small letters")
}

/// Returns whether an object below `scripts/` is deleted when the animation is removed. These are its scripts and
/// settings, also misnamed ones, and files that operating systems leave beside them. An object in the folder of one of
/// the `others` is not deleted.
pub fn goes_with(animation: &Animation, key: &str, others: &[Animation]) -> bool {
    let Some(path) = key.strip_prefix(&animation.scripts()) else { return false };
    let Some((folders, file)) = path.rsplit_once('/') else {
        return path.is_empty() || Name::of(path) != Name::Other;
    };
    // The beginning of an ignored path: its own name, or a folder's.
    let mut owner = animation.as_str().to_owned();
    let mut is_ignored = file.is_empty() || Name::of(file) == Name::Ignored;
    for segment in folders.split('/') {
        if Name::below_scripts(&format!("{segment}/1.txt"), 1) == Name::Ignored {
            is_ignored = true;
            break;
        }
        owner.push('/');
        owner.push_str(segment);
    }
    let is_in = |inner: &str, outer: &str| {
        inner == outer || inner.strip_prefix(outer).is_some_and(|rest| rest.starts_with('/'))
    };
    let is_theirs = |other: &Animation| {
        other != animation && (is_in(&owner, other.as_str()) || is_in(other.as_str(), &owner))
    };
    is_ignored && (owner == animation.as_str() || !others.iter().any(is_theirs))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn animation(name: &str) -> Animation {
        Animation::new(name).unwrap()
    }

    #[test]
    fn what_makes_a_difference_to_an_animation_names_it() {
        let long = format!("scripts/film/{}.txt", "x".repeat(900));
        for (key, expected) in [
            ("scripts/film/1.txt", Some("film")),
            ("scripts/film/animation.json", Some("film")),
            ("scripts/film/two/3.TXT", Some("film/two")),
            ("scripts/film/a\\1.txt", Some("film")),
            (long.as_str(), Some("film")),
            ("scripts/film/", None),
            ("scripts/film/._1.txt", None),
            ("scripts/film/notes.md", None),
            ("scripts/1.txt", None),
            ("scripts/a\\b/1.txt", None),
            ("scripts//h/1.txt", None),
            ("frames/film/1.txt", None),
        ] {
            let found = Uploaded::of(key, if key.ends_with('/') { 0 } else { 9 }).animation();
            assert_eq!(found, expected.map(animation), "{key}");
        }
        assert!(matches!(Uploaded::of(&long, 9), Uploaded::Rejected(_, "the key is longer than 900 bytes")));
        // A name that no animation can have.
        let far = format!("scripts/{}/1.TXT", "x".repeat(900));
        assert!(matches!(Uploaded::of(&far, 9), Uploaded::Misplaced(_)));
    }

    #[test]
    fn misplaced_keys_are_found_wherever_they_are() {
        for key in [
            "scripts/1.txt",
            "scripts//h/1.txt",
            "scripts/h/../1.txt",
            "scripts/a\\b/1.txt",
            "/scripts/film/1.txt",
            "//scripts/film/1.txt",
            "/scripts/1.txt",
            "Scripts/film/1.txt",
            "SCRIPTS/film/animation.json",
            "Scripts/film/1.TXT",
            "scripts\\film\\1.txt",
        ] {
            assert!(misplaced(key, 9).is_some(), "{key}");
        }
        for key in [
            "scripts/film/1.txt",
            "scripts/film/1.TXT",
            "scripts/film/a\\1.txt",
            "scripts/notes.md",
            "scripts/._1.txt",
            "Scripts/notes.md",
            "Scripts/",
            "Scripts/.DS_Store",
            "/film/1.txt",
            "frames/film/1.txt",
            "scripts.txt",
        ] {
            assert_eq!(misplaced(key, if key.ends_with('/') { 0 } else { 9 }), None, "{key}");
        }
    }

    #[test]
    fn what_goes_with_an_animation_is_all_of_its_own_and_nothing_of_others() {
        let others = ["film", "film/two", "film/deep/er", "films"].map(animation);
        for (key, expected) in [
            ("film/1.txt", true),
            ("film/animation.json", true),
            ("film/3.TXT", true),
            ("film/", true),
            ("film/._1.txt", true),
            ("film/Thumbs.db", true),
            ("film/.ipynb_checkpoints/1.txt", true),
            ("film/.ipynb_checkpoints/", true),
            ("film/__MACOSX/a/._1.txt", true),
            ("film/textures/.DS_Store", true),
            ("film/textures/", true),
            ("film/notes.md", false),
            ("film/textures/wood.png", false),
            ("film/two/1.txt", false),
            ("film/two/", false),
            ("film/two/._1.txt", false),
            ("film/deep/", false),
            ("films/._1.txt", false),
        ] {
            assert_eq!(goes_with(&others[0], &format!("scripts/{key}"), &others), expected, "{key}");
        }
        // One of a name that is no longer taken.
        assert!(goes_with(&animation("film/.old"), "scripts/film/.old/1.txt", &[]));
    }
}
