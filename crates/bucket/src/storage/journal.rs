//! The journal: acknowledged changes that are not yet in the database's durable state, one entry per
//! batch, in one file.
//!
//! An entry is written and synced before its batch is acknowledged. The database follows without a sync of its own,
//! and catches up when the journal has grown ([`Journal::is_long`]) or when there is nothing else to do. So a batch
//! costs one sync, and the work after a kill is bounded.
//!
//! ```text
//! header (32 bytes, twice)   magic, salt, number of the last entry before the journal, CRC-64 of these
//! mark (16 bytes)            number of the last acknowledged entry, CRC-64 of salt and number
//! entry                      length, number, CRC-64 of the content, CRC-64 of salt and these (8 bytes each), content
//! ```
//!
//! Each entry is on disk before the next one is written. So an unreadable entry is a torn write, which was never
//! acknowledged, only if it is the last one and the mark does not name it. Everything else is damage: the journal is
//! left unchanged, and [`read`] reports the position. The salt is random and never leaves the file, so no client can
//! put bytes into a body that look like an entry.
//!
//! Journals of format 1 have no header and no mark. Their entries are length, number, CRC-64 of
//! number and content, content.

use std::io;
use std::ops::Range;
use std::sync::Arc;

use s3s::crypto::{Checksum, Crc64Nvme};

use super::medium::Medium;

/// The first bytes of a journal.
const MAGIC: &[u8; 8] = b"rfjrnl2\n";

/// The length of one copy of the header in bytes.
const HEADER: usize = 32;

/// The position of the mark: after both copies of the header.
const MARK: usize = 2 * HEADER;

/// The position of the first entry.
const START: usize = MARK + 16;

/// The length from which the database catches up: some thousand small changes, some ten milliseconds of replay.
const LONG: u64 = 8 * 1024 * 1024;

/// The journal, open for writing, see the module.
pub(super) struct Journal {
    file: Arc<dyn Medium>,
    salt: u64,
    length: u64,
    last: u64,
    /// Changes that no caller waits for. They are written with the next entry.
    deferred: Vec<u8>,
    /// [`Journal::clear`] failed and must succeed before anything is appended.
    uncleared: bool,
}

/// The content of a journal that was read.
pub(super) struct Contents {
    bytes: Vec<u8>,
    format: Format,
    /// The number of the last entry before the journal; `None` if format 1 does not contain it.
    pub(super) base: Option<u64>,
    /// The readable entries, in order: number and range of the content.
    entries: Vec<(u64, Range<usize>)>,
    /// The end of the last whole entry.
    end: usize,
    /// The damaged places, without a torn end.
    pub(super) faults: Vec<Fault>,
}

/// A place in the journal that cannot be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Fault {
    /// The position of its first byte.
    pub(super) offset: u64,
    /// A description of the damage.
    pub(super) what: String,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Format {
    /// The entries are of format 1.
    Plain,
    Salted(u64),
}

/// An entry that is whole.
struct Entry {
    number: u64,
    content: Range<usize>,
}

impl Format {
    fn header(self) -> usize {
        match self {
            Self::Plain => 24,
            Self::Salted(_) => 32,
        }
    }

    /// Returns the entry that begins at a byte, if it is whole.
    fn entry(self, bytes: &[u8], at: usize) -> Option<Entry> {
        let header = bytes.get(at..at + self.header())?;
        let (length, number) = (number_at(header, 0), number_at(header, 8));
        let start = at + self.header();
        let content = start..start.checked_add(usize::try_from(length).ok()?)?;
        let written = bytes.get(content.clone())?;
        let whole = match self {
            Self::Plain => sum(&[&header[8..16], written]) == header[16..24],
            Self::Salted(salt) => {
                sum(&[&salt.to_le_bytes(), &header[..24]]) == header[24..]
                    && sum(&[written]) == header[16..24]
            }
        };
        whole.then_some(Entry { number, content })
    }

    /// Returns the first whole entry from a byte on that has a higher number, and its position.
    fn later(self, bytes: &[u8], from: usize, last: Option<u64>) -> Option<(usize, Entry)> {
        let most = (bytes.len() / self.header()) as u64 + 1;
        (from..bytes.len().saturating_sub(self.header() - 1)).find_map(|at| {
            let number = number_at(bytes, at + 8);
            // A fast test, which fails for nearly all bytes that do not begin an entry.
            let plausible = last.map_or(number > 0, |last| {
                number.checked_sub(last).is_some_and(|ahead| (1..=most).contains(&ahead))
            });
            let entry = plausible.then(|| self.entry(bytes, at)).flatten()?;
            Some((at, entry))
        })
    }
}

/// Reads a journal without changing anything. `format_1` allows one of format 1.
///
/// # Errors
/// Returns the error of the system.
pub(super) fn read(file: &dyn Medium, format_1: bool) -> io::Result<Contents> {
    let bytes = file.read_all()?;
    let header = [0, HEADER].into_iter().find_map(|at| header(&bytes, at));
    let mut faults = Vec::new();
    let (format, base, start) = match header {
        Some((salt, base)) => (Format::Salted(salt), Some(base), START),
        None if format_1 => (Format::Plain, None, 0),
        None => {
            let what =
                format!("both copies of the header of the journal ({} bytes) are damaged", bytes.len());
            faults.push(Fault { offset: 0, what });
            let contents =
                Contents { end: 0, bytes, format: Format::Plain, base: None, entries: Vec::new(), faults };
            return Ok(contents);
        }
    };
    if bytes.len() < start {
        let what = format!("it ends after {} bytes, within its header", bytes.len());
        faults.push(Fault { offset: bytes.len() as u64, what });
    }
    let mut entries = Vec::new();
    let mut at = start;
    let mut last = base;
    while at < bytes.len() {
        let expected = last.map(|last| last + 1);
        let found = format.entry(&bytes, at);
        if let Some(entry) = &found
            && last.is_none_or(|last| entry.number == last + 1)
        {
            last = Some(entry.number);
            at = entry.content.end;
            entries.push((entry.number, entry.content.clone()));
            continue;
        }
        let shown = expected.map_or_else(|| "the first entry".to_owned(), |number| format!("entry {number}"));
        let from = found.as_ref().map_or(at + 1, |entry| entry.content.end);
        // A whole entry with a wrong number is no torn write, wherever it is.
        let next = match &found {
            Some(entry) if last.is_some_and(|last| entry.number > last) => Some(at),
            _ => format.later(&bytes, from, last).map(|(next, _)| next),
        };
        let what = match (&found, next) {
            (Some(entry), _) => Some(format!("found entry {} in place of {shown}", entry.number)),
            (None, Some(next)) => Some(format!(
                "{shown} cannot be read, but a later one at byte {next} is whole: this is damage, not the end of an \
                 interrupted write"
            )),
            (None, None) => None,
        };
        let Some(what) = what else { break };
        faults.push(Fault { offset: at as u64, what });
        match next {
            Some(next) => {
                at = next;
                last = format.entry(&bytes, at).map(|entry| entry.number - 1);
            }
            None => {
                at = from;
                break;
            }
        }
    }
    let end = at.min(bytes.len());
    if let (Format::Salted(salt), Some(last)) = (format, last) {
        let mark = bytes.get(MARK..START);
        let marked = mark.filter(|mark| sum(&[&salt.to_le_bytes(), &mark[..8]]) == mark[8..]);
        let marked = marked.map(|mark| number_at(mark, 0));
        let torn = end < bytes.len();
        let what = match marked {
            Some(number) if number > last => Some(format!(
                "entry {number} was acknowledged, but the journal can be read only up to the end of entry {last}"
            )),
            None if torn => Some(format!(
                "entry {} cannot be read, and the mark at byte {MARK}, which tells whether it was acknowledged, is \
                 damaged too",
                last + 1
            )),
            Some(_) | None => None,
        };
        faults.extend(what.map(|what| Fault { offset: end as u64, what }));
    }
    Ok(Contents { bytes, format, base, entries, end, faults })
}

/// Returns salt and base of a copy of the header.
fn header(bytes: &[u8], at: usize) -> Option<(u64, u64)> {
    let header = bytes.get(at..at + HEADER)?;
    let whole = header.starts_with(MAGIC) && sum(&[&header[..24]]) == header[24..];
    whole.then(|| (number_at(header, 8), number_at(header, 16)))
}

impl Contents {
    /// Returns numbers and contents of the readable entries.
    pub(super) fn entries(&self) -> impl Iterator<Item = (u64, &[u8])> {
        self.entries.iter().map(|(number, content)| (*number, &self.bytes[content.clone()]))
    }

    /// Returns whether it is shorter than what the first start writes at once.
    pub(super) fn is_unfinished(&self) -> bool {
        self.bytes.len() < START
    }

    /// Returns the number of the last entry that can be read or is in the database.
    pub(super) fn last(&self, applied: u64) -> u64 {
        self.entries.last().map_or(applied, |(number, _)| applied.max(*number))
    }

    /// Returns the reason why the journal does not belong to a database with the changes up to entry `applied`.
    pub(super) fn mismatch(&self, applied: u64) -> Option<String> {
        let of_database = format!("the database holds the changes up to entry {applied}");
        let first = self.base.map(|base| base + 1).or(self.entries.first().map(|(number, _)| *number));
        match first {
            Some(first) if first > applied + 1 => Some(format!(
                "{of_database}, but the journal begins with entry {first}: one of the two is older"
            )),
            Some(_) if self.last(0).max(self.base.unwrap_or(0)) < applied && self.base.is_some() => {
                Some(format!(
                    "{of_database}, but the journal ends with entry {}: one of the two is older",
                    self.last(self.base.unwrap_or(0))
                ))
            }
            _ => None,
        }
    }

    /// Continues after the last entry, and removes the remains of an interrupted write. A journal of format 1 is
    /// rewritten: the database must hold all its entries durably.
    pub(super) fn resume(self, file: Arc<dyn Medium>, applied: u64) -> io::Result<Journal> {
        let last = self.last(applied);
        let Format::Salted(salt) = self.format else { return Journal::create(file, last) };
        let length = self.end as u64;
        if length < self.bytes.len() as u64 {
            file.set_len(length)?;
        }
        Ok(Journal { file, salt, length, last, deferred: Vec::new(), uncleared: false })
    }
}

impl Journal {
    /// Writes an empty journal whose first entry will follow number `base`. It is on disk on return.
    pub(super) fn create(file: Arc<dyn Medium>, base: u64) -> io::Result<Self> {
        let mut journal =
            Self { file, salt: 0, length: 0, last: base, deferred: Vec::new(), uncleared: true };
        journal.clear()?;
        Ok(journal)
    }

    /// Appends an entry with all deferred changes. It is on disk on return. If that fails, the journal is unchanged.
    pub(super) fn append(&mut self, content: &[u8]) -> io::Result<()> {
        if self.uncleared {
            self.clear()?;
        }
        let number = self.last + 1;
        let length = self.deferred.len() + content.len();
        let mut bytes = Vec::with_capacity(32 + length);
        bytes.extend((length as u64).to_le_bytes());
        bytes.extend(number.to_le_bytes());
        bytes.extend(sum(&[&self.deferred, content]));
        bytes.extend(sum(&[&self.salt.to_le_bytes(), &bytes]));
        bytes.extend(&self.deferred);
        bytes.extend(content);
        let written = self.file.write_all_at(&bytes, self.length).and_then(|()| self.file.sync());
        if let Err(failed) = written {
            self.file.set_len(self.length)?;
            return Err(failed);
        }
        self.length += bytes.len() as u64;
        self.last = number;
        self.deferred.clear();
        // It needs no sync: it matters for the last entry alone, and a power cut that loses it loses no entry.
        let _ = self.file.write_all_at(&mark(self.salt, number), MARK as u64);
        Ok(())
    }

    /// Keeps changes that no caller waits for until the next entry. A kill before that loses them.
    pub(super) fn defer(&mut self, content: &[u8]) {
        self.deferred.extend(content);
    }

    /// Returns the number of the last entry.
    pub(super) fn last(&self) -> u64 {
        self.last
    }

    pub(super) fn is_long(&self) -> bool {
        self.length + self.deferred.len() as u64 >= LONG
    }

    pub(super) fn is_empty(&self) -> bool {
        self.length == START as u64 && self.deferred.is_empty() && !self.uncleared
    }

    /// Removes all entries, because the database holds them durably. Their last number is in the new header,
    /// which has a new salt and is on disk before the file is truncated. A kill or power cut between the two
    /// leaves a torn end.
    pub(super) fn clear(&mut self) -> io::Result<()> {
        self.uncleared = true;
        let mut salt = [0; 8];
        getrandom::fill(&mut salt).map_err(io::Error::other)?;
        let mut header = MAGIC.to_vec();
        header.extend(salt);
        header.extend(self.last.to_le_bytes());
        header.extend(sum(&[&header]));
        self.salt = u64::from_le_bytes(salt);
        let start = [&header[..], &header[..], &mark(self.salt, self.last)[..]].concat();
        self.file.write_all_at(&start, 0)?;
        self.file.sync()?;
        self.file.set_len(START as u64)?;
        self.length = START as u64;
        self.deferred.clear();
        self.uncleared = false;
        Ok(())
    }
}

fn mark(salt: u64, number: u64) -> [u8; 16] {
    let mut mark = [0; 16];
    mark[..8].copy_from_slice(&number.to_le_bytes());
    mark[8..].copy_from_slice(&sum(&[&salt.to_le_bytes(), &number.to_le_bytes()]));
    mark
}

/// Returns the number at an offset, or 0 beyond the end.
fn number_at(bytes: &[u8], at: usize) -> u64 {
    bytes.get(at..).and_then(<[u8]>::first_chunk).map_or(0, |bytes| u64::from_le_bytes(*bytes))
}

fn sum(pieces: &[&[u8]]) -> [u8; 8] {
    let mut sum = Crc64Nvme::new();
    for piece in pieces {
        sum.update(piece);
    }
    sum.finalize()
}

/// Rewrites the entries of a journal in format 1.
#[cfg(test)]
pub(super) fn of_format_1(path: &std::path::Path) -> Vec<u8> {
    let contents = read(&std::fs::File::open(path).unwrap(), false).unwrap();
    let entry = |(number, content): (u64, &[u8])| {
        let length = (content.len() as u64).to_le_bytes();
        [&length[..], &number.to_le_bytes(), &sum(&[&number.to_le_bytes(), content]), content].concat()
    };
    contents.entries().flat_map(entry).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::storage::medium::{Files, SystemFiles};

    fn open(path: &Path) -> Arc<dyn Medium> {
        SystemFiles.open(path).unwrap()
    }

    fn contents(path: &Path, format_1: bool) -> Contents {
        read(&*open(path), format_1).unwrap()
    }

    fn entries(contents: &Contents) -> Vec<Vec<u8>> {
        contents.entries().map(|(_, content)| content.to_vec()).collect()
    }

    /// A journal of three entries. `acknowledged` says whether the last one is marked as acknowledged.
    fn three(path: &Path, acknowledged: bool) -> Vec<u8> {
        let mut journal = Journal::create(open(path), 7).unwrap();
        journal.append(b"first").unwrap();
        journal.append(b"").unwrap();
        let before = std::fs::read(path).unwrap();
        journal.append(b"third").unwrap();
        let mut bytes = std::fs::read(path).unwrap();
        if !acknowledged {
            bytes[MARK..START].copy_from_slice(&before[MARK..START]);
        }
        bytes
    }

    /// Three entries in format 1.
    fn three_of_format_1(number: u64) -> Vec<u8> {
        let entry = |number: u64, content: &[u8]| {
            let length = (content.len() as u64).to_le_bytes();
            let number = number.to_le_bytes();
            [&length[..], &number, &sum(&[&number, content]), content].concat()
        };
        [entry(number, b"first"), entry(number + 1, b""), entry(number + 2, b"third")].concat()
    }

    #[test]
    fn entries_come_back_in_order_and_go_when_they_are_cleared() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        three(&path, true);
        let read = contents(&path, false);
        assert_eq!(
            (entries(&read), read.base),
            (vec![b"first".to_vec(), vec![], b"third".to_vec()], Some(7))
        );
        assert!(read.faults.is_empty() && read.mismatch(7).is_none() && read.mismatch(10).is_none());
        assert!(read.mismatch(6).is_some() && read.mismatch(11).is_some(), "one of the two is older");
        let mut journal = read.resume(open(&path), 8).unwrap();
        assert!(journal.last() == 10 && !journal.is_empty());
        journal.clear().unwrap();
        assert!(journal.is_empty() && journal.last() == 10);
        journal.defer(b"nobody waits, ");
        assert!(!journal.is_empty());
        journal.append(b"fourth").unwrap();
        assert_eq!(entries(&contents(&path, false)), [b"nobody waits, fourth"]);
        assert!(contents(&path, false).mismatch(8).is_some(), "entries 9 and 10 are gone");
    }

    /// An interrupted write of the last entry is no damage, whatever its length.
    #[test]
    fn a_torn_last_entry_ends_the_journal() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let whole = three(&path, false);
        let last = whole.len() - 37;
        for cut in last..whole.len() {
            for fill in [None, Some(0), Some(255)] {
                let mut bytes = whole[..cut].to_vec();
                if let Some(fill) = fill {
                    bytes.resize(whole.len() + 5000, fill);
                }
                std::fs::write(&path, &bytes).unwrap();
                let read = contents(&path, false);
                assert!(read.faults.is_empty() && entries(&read).len() == 2, "cut at {cut}, {fill:?}");
                let mut journal = read.resume(open(&path), 7).unwrap();
                journal.append(b"again").unwrap();
                let read = contents(&path, false);
                assert!(read.faults.is_empty(), "cut at {cut}, {fill:?}");
                assert_eq!(entries(&read), [b"first".to_vec(), vec![], b"again".to_vec()]);
            }
        }
    }

    /// An acknowledged entry is there, or the journal is damaged.
    #[test]
    fn no_flipped_bit_and_no_cut_hides_an_acknowledged_entry() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let whole = three(&path, true);
        let judge = |bytes: &[u8], what: &str| {
            std::fs::write(&path, bytes).unwrap();
            let read = contents(&path, false);
            let all = [b"first".to_vec(), vec![], b"third".to_vec()];
            assert!(!read.faults.is_empty() || (entries(&read) == all && read.base == Some(7)), "{what}");
        };
        for bit in 0..whole.len() * 8 {
            let mut bytes = whole.clone();
            bytes[bit / 8] ^= 1 << (bit % 8);
            judge(&bytes, &format!("bit {bit} flipped"));
        }
        for cut in 0..whole.len() {
            judge(&whole[..cut], &format!("cut at {cut}"));
            for bytes in [0, 255] {
                let mut filled = whole[..cut].to_vec();
                filled.resize(whole.len(), bytes);
                judge(&filled, &format!("filled with {bytes} from {cut} on"));
            }
        }
        let entries = [START..START + 37, START + 37..START + 69, START + 69..whole.len()];
        for (number, entry) in entries.iter().enumerate() {
            for at in [START, START + 37, START + 69, whole.len()] {
                let mut bytes = whole.clone();
                bytes.splice(at..at, whole[entry.clone()].to_vec());
                std::fs::write(&path, &bytes).unwrap();
                assert!(!contents(&path, false).faults.is_empty(), "entry {number} once more at {at}");
            }
            let mut bytes = whole.clone();
            bytes.drain(entry.clone());
            std::fs::write(&path, &bytes).unwrap();
            assert!(!contents(&path, false).faults.is_empty(), "entry {number} is missing");
        }
    }

    #[test]
    fn damage_is_said_with_its_place_and_the_rest_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let mut bytes = three(&path, true);
        bytes[START + 34] ^= 1;
        std::fs::write(&path, &bytes).unwrap();
        let read = contents(&path, false);
        let what = format!(
            "entry 8 cannot be read, but a later one at byte {} is whole: this is damage, not the end of an interrupted \
             write",
            START + 37
        );
        assert_eq!(read.faults, [Fault { offset: START as u64, what }]);
        assert_eq!(entries(&read), [b"".to_vec(), b"third".to_vec()]);
        bytes = three(&path, true);
        let last = bytes.len() - 1;
        bytes[last] ^= 1;
        std::fs::write(&path, &bytes).unwrap();
        let what = "entry 10 was acknowledged, but the journal can be read only up to the end of entry 9";
        let faults = contents(&path, false).faults;
        assert_eq!(faults, [Fault { offset: START as u64 + 69, what: what.to_owned() }]);
    }

    /// A body that looks like an entry of a higher number must not turn a torn end into damage.
    #[test]
    fn a_client_cannot_forge_an_entry() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let mut journal = Journal::create(open(&path), 0).unwrap();
        journal.append(b"first").unwrap();
        let acknowledged = std::fs::read(&path).unwrap();
        let foreign = folder.path().join("foreign");
        let mut other = Journal::create(open(&foreign), 2).unwrap();
        other.append(b"forged").unwrap();
        let forged = [&std::fs::read(&foreign).unwrap()[START..], &three_of_format_1(3)].concat();
        journal.append(&forged).unwrap();
        let mut bytes = std::fs::read(&path).unwrap();
        bytes[MARK..START].copy_from_slice(&acknowledged[MARK..START]);
        bytes[acknowledged.len() + 3] ^= 1;
        std::fs::write(&path, &bytes).unwrap();
        let read = contents(&path, false);
        assert!(read.faults.is_empty() && entries(&read) == [b"first"]);
    }

    #[test]
    fn journals_of_format_1_are_read_and_written_anew() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let whole = three_of_format_1(8);
        std::fs::write(&path, &whole).unwrap();
        let read = contents(&path, true);
        assert!(read.faults.is_empty() && read.mismatch(7).is_none() && read.mismatch(6).is_some());
        let mut journal = read.resume(open(&path), 7).unwrap();
        journal.append(b"fourth").unwrap();
        let read = contents(&path, false);
        assert_eq!((entries(&read), read.base), (vec![b"fourth".to_vec()], Some(10)));
        // A last entry that is cut off may never have been acknowledged.
        for cut in whole.len() - 28..whole.len() {
            std::fs::write(&path, &whole[..cut]).unwrap();
            let read = contents(&path, true);
            assert!(read.faults.is_empty() && entries(&read).len() == 2, "cut at {cut}");
        }
        for bit in 0..(whole.len() - 29) * 8 {
            let mut bytes = whole.clone();
            bytes[bit / 8] ^= 1 << (bit % 8);
            std::fs::write(&path, &bytes).unwrap();
            assert!(!contents(&path, true).faults.is_empty(), "bit {bit} flipped");
        }
    }
}
