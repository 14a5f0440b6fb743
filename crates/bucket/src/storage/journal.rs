//! What was acknowledged and is not in the database's durable state yet: one entry a batch, in one file.
//!
//! An entry is written and synced before its batch is acknowledged; the database follows without a sync of its own, and
//! catches up when the journal has grown ([`Journal::is_long`]) or when nothing else is to be done. So a batch costs one
//! sync, and what a kill leaves to be done at the next start is bounded.
//!
//! An entry: length and number (8 bytes each), a CRC-64 of number and content, the content. Numbers follow each other;
//! the first entry that is cut off, does not match its sum or does not follow ends the journal: it was never acknowledged.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

use s3s::crypto::{Checksum, Crc64Nvme};

use crate::private;

const HEADER: usize = 24;

/// Beyond this length the database catches up: some thousand small changes, some ten milliseconds of replay.
const LONG: u64 = 8 * 1024 * 1024;

/// See the module.
pub(super) struct Journal {
    file: File,
    length: u64,
    last: u64,
}

impl Journal {
    /// Opens the journal and gives the content of every entry after number `applied` to `replay`, in order.
    pub(super) fn open<E>(
        path: &Path,
        applied: u64,
        mut replay: impl FnMut(&[u8]) -> Result<(), E>,
    ) -> Result<Self, OpenError<E>> {
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .mode(private::FILE)
            .open(path)
            .map_err(OpenError::File)?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(OpenError::File)?;
        let mut rest = bytes.as_slice();
        let mut length = 0;
        let mut last = applied;
        let mut previous = None;
        while let Some((number, content)) = entry(&mut rest) {
            if previous.is_some_and(|previous| number != previous + 1) {
                break;
            }
            previous = Some(number);
            if number > applied {
                if number != last + 1 {
                    return Err(OpenError::Gap { after: last, found: number });
                }
                replay(content).map_err(OpenError::Replay)?;
                last = number;
            }
            length = (bytes.len() - rest.len()) as u64;
        }
        file.set_len(length).map_err(OpenError::File)?;
        file.seek(SeekFrom::Start(length)).map_err(OpenError::File)?;
        Ok(Self { file, length, last })
    }

    /// Appends an entry; on return it is on the disk if `sync` says so. When that fails, the journal is as before.
    pub(super) fn append(&mut self, content: &[u8], sync: bool) -> io::Result<()> {
        let number = self.last + 1;
        let mut bytes = Vec::with_capacity(HEADER + content.len());
        bytes.extend((content.len() as u64).to_le_bytes());
        bytes.extend(number.to_le_bytes());
        bytes.extend(sum(number, content));
        bytes.extend(content);
        let written =
            self.file.write_all(&bytes).and_then(|()| if sync { self.file.sync_data() } else { Ok(()) });
        if let Err(failed) = written {
            self.file.set_len(self.length)?;
            self.file.seek(SeekFrom::Start(self.length))?;
            return Err(failed);
        }
        self.length += bytes.len() as u64;
        self.last = number;
        Ok(())
    }

    /// The number of the last entry.
    pub(super) fn last(&self) -> u64 {
        self.last
    }

    pub(super) fn is_long(&self) -> bool {
        self.length >= LONG
    }

    pub(super) fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// The database holds all entries durably: they go.
    pub(super) fn clear(&mut self) -> io::Result<()> {
        self.file.set_len(0)?;
        self.file.seek(SeekFrom::Start(0))?;
        self.length = 0;
        Ok(())
    }
}

/// Why a journal cannot be used.
#[derive(Debug)]
pub(super) enum OpenError<E> {
    File(io::Error),
    Replay(E),
    /// Entries are missing.
    Gap {
        after: u64,
        found: u64,
    },
}

/// Takes an entry off the front.
fn entry<'a>(bytes: &mut &'a [u8]) -> Option<(u64, &'a [u8])> {
    let mut rest = *bytes;
    let length = u64::from_le_bytes(*rest.split_off(..8)?.as_array()?);
    let number = u64::from_le_bytes(*rest.split_off(..8)?.as_array()?);
    let expected = rest.split_off(..8)?;
    let content = rest.split_off(..usize::try_from(length).ok()?)?;
    if sum(number, content) != expected {
        return None;
    }
    *bytes = rest;
    Some((number, content))
}

fn sum(number: u64, content: &[u8]) -> [u8; 8] {
    let mut sum = Crc64Nvme::new();
    sum.update(&number.to_le_bytes());
    sum.update(content);
    sum.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(path: &Path, applied: u64) -> (Journal, Vec<Vec<u8>>) {
        let mut entries = Vec::new();
        let journal = Journal::open(path, applied, |content| {
            entries.push(content.to_vec());
            Ok::<(), ()>(())
        });
        (journal.unwrap(), entries)
    }

    #[test]
    fn entries_come_back_in_order_and_those_applied_do_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let (mut journal, entries) = read(&path, 7);
        assert!(entries.is_empty() && journal.is_empty());
        for content in [b"one".as_slice(), b"", b"three"] {
            journal.append(content, true).unwrap();
        }
        assert_eq!(journal.last(), 10);
        assert_eq!(read(&path, 7).1, [b"one".as_slice(), b"", b"three"]);
        assert_eq!(read(&path, 9).1, [b"three"]);
        journal.clear().unwrap();
        journal.append(b"four", true).unwrap();
        assert_eq!(read(&path, 10).1, [b"four"]);
        assert!(Journal::open(&path, 8, |_| Ok::<(), ()>(())).is_err(), "entries 9 and 10 are gone");
    }

    #[test]
    fn an_entry_cut_off_or_changed_ends_the_journal() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let (mut journal, _) = read(&path, 0);
        journal.append(b"first", true).unwrap();
        journal.append(b"second", true).unwrap();
        let whole = std::fs::read(&path).unwrap();
        for cut in 0..whole.len() {
            std::fs::write(&path, &whole[..cut]).unwrap();
            let expected: &[&[u8]] = if cut < HEADER + 5 { &[] } else { &[b"first"] };
            assert_eq!(read(&path, 0).1, expected, "cut at {cut}");
        }
        for changed in HEADER + 5..whole.len() {
            let mut bytes = whole.clone();
            bytes[changed] ^= 1;
            std::fs::write(&path, &bytes).unwrap();
            let (mut journal, entries) = read(&path, 0);
            assert_eq!(entries, [b"first"], "changed at {changed}");
            journal.append(b"again", true).unwrap();
            assert_eq!(read(&path, 0).1, [b"first", b"again"]);
        }
    }
}
