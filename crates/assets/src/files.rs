//! Files by name: the trait through which callers hand them over, and the rules of their names.

use std::collections::BTreeMap;

use unicode_normalization::UnicodeNormalization;

/// The files beside a script, by their plain names.
pub trait Files: Send + Sync {
    /// Returns the names of all files, in any order. It is only asked for to explain why a name is not found.
    fn names(&self) -> Vec<String>;

    /// Returns the size and the tag of a file, or `None` if there is no file of this name.
    ///
    /// # Errors
    /// Returns the reason if it is unknown whether the file exists.
    fn look(&self, name: &str) -> Result<Option<FileInfo>, String>;

    /// Returns the content of a file.
    ///
    /// # Errors
    /// Returns the reason if the file cannot be read.
    fn read(&self, name: &str) -> Result<Vec<u8>, String>;

    /// Returns whether files can be read at all.
    fn are_readable(&self) -> bool {
        true
    }
}

/// The size and the tag of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileInfo {
    /// The size in bytes.
    pub bytes: u64,
    /// A number that changes with the content, such as a time of modification or a hash.
    pub tag: u64,
}

/// No files, for callers that cannot read any.
#[derive(Clone, Copy, Debug)]
pub struct NoFiles;

impl Files for NoFiles {
    fn names(&self) -> Vec<String> {
        Vec::new()
    }

    fn look(&self, _: &str) -> Result<Option<FileInfo>, String> {
        Ok(None)
    }

    fn read(&self, _: &str) -> Result<Vec<u8>, String> {
        Err("no files are read here".into())
    }

    fn are_readable(&self) -> bool {
        false
    }
}

/// Files in memory, for tests and generated models.
#[derive(Clone, Debug, Default)]
pub struct MemoryFiles {
    /// The content of each file, and its hash.
    files: BTreeMap<String, (Vec<u8>, u64)>,
}

impl<const N: usize> From<[(&str, Vec<u8>); N]> for MemoryFiles {
    fn from(files: [(&str, Vec<u8>); N]) -> Self {
        let mut all = Self::default();
        files.into_iter().for_each(|(name, bytes)| all.insert(name, bytes));
        all
    }
}

impl MemoryFiles {
    /// Adds or replaces a file.
    pub fn insert(&mut self, name: &str, bytes: Vec<u8>) {
        let tag = hash(&bytes);
        self.files.insert(name.into(), (bytes, tag));
    }
}

impl Files for MemoryFiles {
    fn names(&self) -> Vec<String> {
        self.files.keys().cloned().collect()
    }

    fn look(&self, name: &str) -> Result<Option<FileInfo>, String> {
        Ok(self.files.get(name).map(|(bytes, tag)| FileInfo { bytes: bytes.len() as u64, tag: *tag }))
    }

    fn read(&self, name: &str) -> Result<Vec<u8>, String> {
        self.files.get(name).map(|(bytes, _)| bytes.clone()).ok_or_else(|| "it is gone".into())
    }
}

/// Returns a hash of bytes, by the steps of FNV-1a for words of eight bytes, in four interleaved sequences.
fn hash(bytes: &[u8]) -> u64 {
    const PRIME: u64 = 0x0000_0100_0000_01b3;
    let step = |hash: u64, word: u64| (hash ^ word).wrapping_mul(PRIME).rotate_left(29);
    let (blocks, rest) = bytes.as_chunks::<32>();
    let mut hashes =
        [0xcbf2_9ce4_8422_2325, 0x9e37_79b9_7f4a_7c15, 0x2545_f491_4f6c_dd1d, 0x6a09_e667_f3bc_c909];
    for block in blocks {
        for (hash, word) in hashes.iter_mut().zip(block.as_chunks::<8>().0) {
            *hash = step(*hash, u64::from_le_bytes(*word));
        }
    }
    let of_blocks = hashes.into_iter().fold(bytes.len() as u64, step);
    rest.iter().fold(of_blocks, |hash, byte| step(hash, u64::from(*byte)))
}

/// The reason why a word in quotes is no name of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NameFault {
    /// It is empty.
    #[error("the name of a file is empty")]
    Empty,
    /// It has a character that no name has: `/`, `\`, `:` or a control character.
    #[error("the name of a file has no {0:?}: files are in the script's own folder")]
    Character(char),
    /// It begins with a dot.
    #[error("the name of a file does not begin with a dot")]
    Dot,
    /// It is the name of a script or of the settings.
    #[error("a file is neither a script (.txt) nor the settings (animation.json)")]
    Script,
}

/// Checks the plain name of a file in the script's own folder.
///
/// ```
/// use rayfold_assets::{NameFault, file_name};
///
/// assert_eq!(file_name("teapot v2.obj"), Ok(()));
/// assert_eq!(file_name("models/teapot.obj"), Err(NameFault::Character('/')));
/// assert_eq!(file_name("Notes.TXT"), Err(NameFault::Script));
/// ```
///
/// # Errors
/// If it is no such name.
pub fn file_name(name: &str) -> Result<(), NameFault> {
    if name.is_empty() {
        return Err(NameFault::Empty);
    }
    if let Some(odd) = name.chars().find(|c| c.is_control() || matches!(c, '/' | '\\' | ':')) {
        return Err(NameFault::Character(odd));
    }
    if name.starts_with('.') {
        return Err(NameFault::Dot);
    }
    let low = name.to_ascii_lowercase();
    if low.ends_with(".txt") || low == "animation.json" {
        return Err(NameFault::Script);
    }
    Ok(())
}

/// Describes the file that is there in place of one of another name, which differs from its own as `same_but_for_case` says.
pub(crate) fn likeness(there: &str, wanted: &str) -> String {
    let form = match there.nfc().eq(wanted.nfc()) {
        true => ", whose letters are in another Unicode normal form",
        false => "",
    };
    format!("there is `{there}`{form}: names are compared byte for byte")
}

/// Returns whether two names differ, and only in letter case or in their Unicode normal forms.
pub fn same_but_for_case(a: &str, b: &str) -> bool {
    let plain = |name: &str| name.nfkc().flat_map(char::to_lowercase).nfkc().collect::<String>();
    a != b && plain(a) == plain(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_files_are_plain() {
        for good in
            ["a.obj", "A b.PNG", "ü.glb", "a..b", "txt", "a.txt.obj", "\u{85f}.ply", "animation.json2"]
        {
            assert_eq!(file_name(good), Ok(()), "{good}");
        }
        for (bad, fault) in [
            ("", NameFault::Empty),
            ("a/b", NameFault::Character('/')),
            ("a\\b", NameFault::Character('\\')),
            ("C:a", NameFault::Character(':')),
            ("a\tb", NameFault::Character('\t')),
            ("a\u{85}b", NameFault::Character('\u{85}')),
            (".a", NameFault::Dot),
            ("..", NameFault::Dot),
            ("a.txt", NameFault::Script),
            ("a.TxT", NameFault::Script),
            ("Animation.JSON", NameFault::Script),
        ] {
            assert_eq!(file_name(bad), Err(fault), "{bad}");
        }
    }

    #[test]
    fn names_are_alike_but_for_case_and_normal_form() {
        assert!(same_but_for_case("Teapot.OBJ", "teapot.obj"));
        assert!(same_but_for_case("u\u{308}.png", "\u{fc}.png"), "as macOS writes it");
        assert!(same_but_for_case("U\u{308}.png", "\u{fc}.png"));
        assert!(!same_but_for_case("a.obj", "a.obj") && !same_but_for_case("a.obj", "b.obj"));
    }
}
