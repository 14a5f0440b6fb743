//! The files of a script's version in keys: short hashes of their names and entity tags.

use std::fmt;
use std::num::NonZeroU64;

use sha2::{Digest, Sha256};

use crate::store::ETag;

/// The digits of the hash in a version.
const SET_DIGITS: usize = 16;

/// The hash of a file's name: ten hexadecimal digits.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NameHash(String);

/// The hash of a file's entity tag: eight hexadecimal digits.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct VersionHash(String);

/// A file in a receipt, and its version, or `None` if it was absent.
pub type Entry = (NameHash, Option<VersionHash>);

/// A part of a set, in the form of the end of a receipt's key: `files-<i>-of-<n>-<entries>`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FileList {
    /// The number of the receipt within its set, from 1.
    pub number: NonZeroU64,
    /// The number of receipts of the set.
    pub of: NonZeroU64,
    /// The files, each with ten digits for its name and eight for its entity tag, or `-`.
    pub entries: Vec<Entry>,
}

impl NameHash {
    /// Hashes the name of a file.
    pub fn of(name: &str) -> Self {
        NameHash(digits(name.as_bytes(), 10))
    }
}

impl VersionHash {
    /// Hashes the entity tag of a file.
    pub fn of(version: &ETag) -> Self {
        VersionHash(digits(version.as_str().as_bytes(), 8))
    }
}

fn digits(bytes: &[u8], count: usize) -> String {
    let hash = Sha256::digest(bytes);
    let mut text: String = hash.iter().map(|byte| format!("{byte:02x}")).collect();
    text.truncate(count);
    text
}

fn is_hash(text: &str) -> bool {
    text.bytes().all(|byte| byte.is_ascii_digit() || (b'a'..=b'f').contains(&byte))
}

impl ETag {
    /// Returns the version of a script with this entity tag, drawn from a set of files.
    pub(crate) fn with_files(&self, set: &[Entry]) -> Self {
        let text: String = set.iter().map(entry_text).collect();
        ETag::new(&format!("{self}+{}", digits(text.as_bytes(), SET_DIGITS)))
    }

    /// Returns the entity tag of the script in a version, without the hash of its files.
    ///
    /// ```
    /// use rayfold_pipeline::store::ETag;
    /// assert_eq!(ETag::new("9a03").script(), "9a03");
    /// assert_eq!(ETag::new("9a03+0123456789abcdef").script(), "9a03");
    /// ```
    pub fn script(&self) -> &str {
        match self.as_str().rsplit_once('+') {
            Some((script, set)) if set.len() == SET_DIGITS && is_hash(set) => script,
            _ => self.as_str(),
        }
    }

    /// Returns whether the version is that of a script with a set of files.
    pub fn has_files(&self) -> bool {
        self.script() != self.as_str()
    }
}

fn entry_text((name, version): &Entry) -> String {
    format!("{}{}", name.0, version.as_ref().map_or("-", |version| version.0.as_str()))
}

impl fmt::Display for FileList {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let entries: String = self.entries.iter().map(entry_text).collect();
        write!(f, "files-{}-of-{}-{entries}", self.number, self.of)
    }
}

impl FileList {
    /// Parses the end of a receipt's key.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        let (number, rest) = text.strip_prefix("files-")?.split_once("-of-")?;
        let (of, mut rest) = rest.split_once('-')?;
        let mut entries = Vec::new();
        while !rest.is_empty() {
            let (name, after) = rest.split_at_checked(10)?;
            let (version, after) = match after.strip_prefix('-') {
                Some(after) => (None, after),
                None => {
                    let (version, after) = after.split_at_checked(8)?;
                    (Some(VersionHash(version.to_owned())), after)
                }
            };
            if !is_hash(name) || version.as_ref().is_some_and(|version| !is_hash(&version.0)) {
                return None;
            }
            entries.push((NameHash(name.to_owned()), version));
            rest = after;
        }
        let list = FileList { number: number.parse().ok()?, of: of.parse().ok()?, entries };
        (!list.entries.is_empty() && list.number <= list.of && list.to_string() == text).then_some(list)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::keys::{Animation, Key, Receipt, ScriptName, Tag};

    fn list(number: u64, of: u64, entries: Vec<Entry>) -> FileList {
        FileList { number: NonZeroU64::new(number).unwrap(), of: NonZeroU64::new(of).unwrap(), entries }
    }

    #[test]
    fn lists_of_files_read_back() {
        let (earth, wood) = (NameHash::of("earth.png"), NameHash::of("wood.png"));
        let version = Some(VersionHash::of(&ETag::new("9a03")));
        for entries in [vec![(earth.clone(), version.clone())], vec![(earth, None), (wood, version)]] {
            let list = list(1, 2, entries);
            let text = list.to_string();
            assert_eq!(FileList::parse(&text).as_ref(), Some(&list), "{text}");
            let name = ScriptName::new("1").unwrap();
            let tag = Tag { version: ETag::new("9a03").with_files(&list.entries), pixels: 1 };
            let receipt = Receipt::Files { name, tag, list };
            let key = Key::Receipt { animation: Animation::new("film").unwrap(), receipt };
            assert_eq!(key.to_string().parse::<Key>().unwrap(), key);
        }
        for text in [
            "files-1-of-1-",
            "files-3-of-2-0123456789-",
            "files-1-of-1-012345678-",
            "files-01-of-1-0123456789-",
        ] {
            assert_eq!(FileList::parse(text), None, "{text}");
        }
    }

    #[test]
    fn a_version_is_that_of_a_script_and_of_its_files() {
        let script = ETag::new("9a03-2");
        let one = script.with_files(&[(NameHash::of("earth.png"), None)]);
        let other = script.with_files(&[(NameHash::of("earth.png"), Some(VersionHash::of(&script)))]);
        assert!(one != other && one.has_files() && other.has_files() && !script.has_files());
        assert_eq!([&script, &one, &other].map(ETag::script), ["9a03-2"; 3]);
        // Tags of other stores may hold anything.
        assert_eq!(ETag::new("a+b").script(), "a+b");
    }
}
