//! The zip file for Lambda: one executable named `bootstrap` at the top.
//!
//! Invariant: the same program gives the same file. The file depends on no clock, owner or folder order, and the
//! compressor is the same on every machine.

use std::io::{Cursor, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

/// The file that the `provided` runtimes start.
const ENTRY: &str = "bootstrap";

/// Makes the zip file around `program`.
pub(crate) fn zip(program: &[u8]) -> zip::result::ZipResult<Vec<u8>> {
    // The zero time of the format: 1 January 1980.
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .compression_level(Some(9))
        .last_modified_time(DateTime::default())
        .unix_permissions(0o755);
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    archive.start_file(ENTRY, options)?;
    archive.write_all(program)?;
    Ok(archive.finish()?.into_inner())
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::*;

    #[test]
    fn holds_one_executable_named_bootstrap() {
        let program = b"\x7fELF and so on, and on, and on, and on, and on".repeat(100);
        let bytes = zip(&program).unwrap();
        let mut archive = zip::ZipArchive::new(Cursor::new(&bytes)).unwrap();
        assert_eq!(archive.len(), 1);
        let mut entry = archive.by_index(0).unwrap();
        assert_eq!(entry.name().unwrap(), "bootstrap");
        assert_eq!(entry.unix_mode().unwrap() & 0o777, 0o755);
        assert_eq!(entry.last_modified().unwrap(), DateTime::default());
        assert!(entry.compressed_size() < program.len() as u64 / 10);
        let mut unpacked = Vec::new();
        entry.read_to_end(&mut unpacked).unwrap();
        assert_eq!(unpacked, program);
    }

    #[test]
    fn is_the_same_at_another_time() {
        let first = zip(b"program").unwrap();
        std::thread::sleep(std::time::Duration::from_millis(2100));
        assert_eq!(first, zip(b"program").unwrap(), "zip times have a resolution of two seconds");
    }
}
