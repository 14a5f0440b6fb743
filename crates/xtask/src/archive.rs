//! Zip files of programs and texts.
//!
//! Invariant: the same entries give the same file. The file depends on no clock, owner or order, and the compressor is
//! the same on every machine.

use std::io::{Cursor, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

/// A file in an archive.
#[derive(Clone, Debug)]
pub(crate) struct Entry {
    /// The path of the file, with slashes.
    pub(crate) name: String,
    bytes: Vec<u8>,
    mode: u32,
}

impl Entry {
    /// Returns a file that may be executed.
    pub(crate) fn program(name: impl Into<String>, bytes: Vec<u8>) -> Self {
        Self { name: name.into(), bytes, mode: 0o755 }
    }

    /// Returns a file that may be read.
    pub(crate) fn text(name: impl Into<String>, bytes: Vec<u8>) -> Self {
        Self { name: name.into(), bytes, mode: 0o644 }
    }
}

/// Makes the zip file of `entries`, in the order of their names.
///
/// # Errors
/// Fails if a name occurs twice.
pub(crate) fn zip(mut entries: Vec<Entry>) -> zip::result::ZipResult<Vec<u8>> {
    entries.sort_by(|a, b| a.name.cmp(&b.name));
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    for entry in &entries {
        // The zero time of the format: 1 January 1980.
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Deflated)
            .compression_level(Some(9))
            .last_modified_time(DateTime::default())
            .unix_permissions(entry.mode);
        archive.start_file(entry.name.as_str(), options)?;
        archive.write_all(&entry.bytes)?;
    }
    Ok(archive.finish()?.into_inner())
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::*;

    #[test]
    fn holds_each_file_with_its_mode_and_no_time() {
        let program = b"\x7fELF and so on, and on, and on, and on, and on".repeat(100);
        let bytes =
            zip(vec![Entry::text("b/README.md", b"# b".to_vec()), Entry::program("b/a", program.clone())])
                .unwrap();
        let mut archive = zip::ZipArchive::new(Cursor::new(&bytes)).unwrap();
        assert_eq!(archive.len(), 2);
        for (i, (name, mode, content)) in
            [("b/README.md", 0o644, b"# b".as_slice()), ("b/a", 0o755, program.as_slice())]
                .into_iter()
                .enumerate()
        {
            let mut entry = archive.by_index(i).unwrap();
            assert_eq!(entry.name().unwrap(), name);
            assert_eq!(entry.unix_mode().unwrap() & 0o777, mode);
            assert_eq!(entry.last_modified().unwrap(), DateTime::default());
            let mut unpacked = Vec::new();
            entry.read_to_end(&mut unpacked).unwrap();
            assert_eq!(unpacked, content);
        }
        assert!(bytes.len() < program.len() / 2);
    }

    #[test]
    fn is_the_same_at_another_time_and_in_another_order() {
        let entries = [Entry::program("a", b"program".to_vec()), Entry::text("b", b"text".to_vec())];
        let first = zip(entries.to_vec()).unwrap();
        std::thread::sleep(std::time::Duration::from_millis(2100));
        let again = zip(entries.into_iter().rev().collect()).unwrap();
        assert_eq!(first, again, "zip times have a resolution of two seconds");
    }

    #[test]
    fn a_name_that_occurs_twice_is_refused() {
        assert!(zip(vec![Entry::text("a", vec![1]), Entry::text("a", vec![2])]).is_err());
    }
}
