//! The tables of the database, which map bytes to bytes, and two views of them: a snapshot, and a batch
//! that is being written.
//!
//! Knows no record: `records` interprets the rows. A batch remembers every row that it changes, so that the journal
//! can be written before the database.

use std::any::Any;
use std::sync::Arc;

use redb::{ReadOnlyTable, ReadTransaction, ReadableTable, StorageError, TableDefinition, WriteTransaction};

use super::bodies::{BodyId, NewBody};

/// The key and value of a row.
pub(crate) type Row = (Vec<u8>, Vec<u8>);

type Definition = TableDefinition<'static, &'static [u8], &'static [u8]>;
type Written<'t> = redb::Table<'t, &'static [u8], &'static [u8]>;
type Read = ReadOnlyTable<&'static [u8], &'static [u8]>;

/// A table. The discriminants are stored in the journal, so they never change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Table {
    /// Single values, by name.
    Settings = 0,
    Buckets = 1,
    /// Objects by bucket and key, in the order of listings.
    Objects = 2,
    /// Small bodies by id.
    Bodies = 3,
    /// Bodies in files, by id. A file without a row is garbage.
    Files = 4,
    /// The parts of objects that were uploaded in parts, by id.
    Layouts = 5,
    /// Unfinished uploads by bucket, key and upload id.
    Uploads = 6,
    /// The parts of unfinished uploads, by upload id and number.
    Parts = 7,
    /// Events that are not delivered yet, in order.
    Outbox = 8,
    /// Temporary identities, by access key.
    Sessions = 9,
}

impl Table {
    pub(crate) const ALL: [Self; 10] = [
        Self::Settings,
        Self::Buckets,
        Self::Objects,
        Self::Bodies,
        Self::Files,
        Self::Layouts,
        Self::Uploads,
        Self::Parts,
        Self::Outbox,
        Self::Sessions,
    ];

    fn definition(self) -> Definition {
        TableDefinition::new(match self {
            Self::Settings => "settings",
            Self::Buckets => "buckets",
            Self::Objects => "objects",
            Self::Bodies => "bodies",
            Self::Files => "files",
            Self::Layouts => "layouts",
            Self::Uploads => "uploads",
            Self::Parts => "parts",
            Self::Outbox => "outbox",
            Self::Sessions => "sessions",
        })
    }

    pub(super) fn of(number: u8) -> Option<Self> {
        Self::ALL.get(usize::from(number)).copied()
    }
}

/// A view of the rows.
pub(crate) trait View {
    #[doc(hidden)]
    type Opened: ReadableTable<&'static [u8], &'static [u8]> + redb::ReadableTableMetadata;

    #[doc(hidden)]
    fn opened(&self, table: Table) -> &Self::Opened;

    /// Returns the value at a key.
    fn get(&self, table: Table, key: &[u8]) -> Result<Option<Vec<u8>>, StorageError> {
        Ok(self.opened(table).get(key)?.map(|value| value.value().to_vec()))
    }

    /// Returns the rows from a key on, in the order of their keys' bytes.
    fn from(
        &self,
        table: Table,
        key: &[u8],
    ) -> Result<impl Iterator<Item = Result<Row, StorageError>>, StorageError> {
        let rows = self.opened(table).range::<&[u8]>(key..)?;
        Ok(rows.map(|row| row.map(|(key, value)| (key.value().to_vec(), value.value().to_vec()))))
    }

    /// Returns the rows whose keys begin with these bytes.
    fn beginning_with(
        &self,
        table: Table,
        prefix: &[u8],
    ) -> Result<impl Iterator<Item = Result<Row, StorageError>>, StorageError> {
        let rows = self.from(table, prefix)?;
        Ok(rows.take_while(move |row| row.as_ref().map_or(true, |(key, _)| key.starts_with(prefix))))
    }

    /// Returns the number of rows.
    fn count(&self, table: Table) -> Result<u64, StorageError> {
        use redb::ReadableTableMetadata;
        self.opened(table).len()
    }
}

/// The rows at one moment.
pub(crate) struct Snapshot {
    tables: [Read; Table::ALL.len()],
    /// The database, which must stay open while the snapshot is read.
    _database: Option<Arc<dyn Any + Send + Sync>>,
}

impl Snapshot {
    pub(super) fn of(transaction: &ReadTransaction) -> Result<Self, redb::Error> {
        let opened: Result<Vec<_>, _> =
            Table::ALL.iter().map(|table| transaction.open_table(table.definition())).collect();
        let tables = opened?.try_into().map_err(|_| missing_table())?;
        Ok(Self { tables, _database: None })
    }

    /// Keeps the database open as long as this snapshot is in use, also if the store reopens it.
    pub(super) fn keeping(self, database: Arc<dyn Any + Send + Sync>) -> Self {
        Self { _database: Some(database), ..self }
    }
}

impl View for Snapshot {
    type Opened = Read;

    fn opened(&self, table: Table) -> &Read {
        &self.tables[table as usize]
    }
}

/// A batch that is being written. Its reads see its own changes.
pub(crate) struct Batch<'t> {
    tables: [Written<'t>; Table::ALL.len()],
    changes: Vec<u8>,
    adopted: Vec<NewBody>,
    discarded: Vec<BodyId>,
    removed_bytes: u64,
}

/// The results of a batch after all its changes were applied.
pub(super) struct Applied {
    /// The changed rows, in the journal's format.
    pub(super) changes: Vec<u8>,
    /// Bodies in files to which rows now refer.
    pub(super) adopted: Vec<NewBody>,
    /// Bodies in files to which no row refers any more.
    pub(super) discarded: Vec<BodyId>,
    /// The size in bytes of the values that were removed or replaced.
    pub(super) removed_bytes: u64,
}

impl<'t> Batch<'t> {
    pub(super) fn of(transaction: &'t WriteTransaction) -> Result<Self, redb::Error> {
        let opened: Result<Vec<_>, _> =
            Table::ALL.iter().map(|table| transaction.open_table(table.definition())).collect();
        let tables = opened?.try_into().map_err(|_| missing_table())?;
        let (changes, adopted, discarded) = (Vec::new(), Vec::new(), Vec::new());
        Ok(Self { tables, changes, adopted, discarded, removed_bytes: 0 })
    }

    pub(crate) fn put(&mut self, table: Table, key: &[u8], value: &[u8]) -> Result<(), StorageError> {
        let replaced = self.tables[table as usize].insert(key, value)?;
        self.removed_bytes += replaced.map_or(0, |value| value.value().len() as u64);
        note(&mut self.changes, table, key, Some(value));
        Ok(())
    }

    /// Removes a row. Returns whether it existed.
    pub(crate) fn remove(&mut self, table: Table, key: &[u8]) -> Result<bool, StorageError> {
        let removed = self.tables[table as usize].remove(key)?.map(|value| value.value().len() as u64);
        if let Some(bytes) = removed {
            self.removed_bytes += bytes;
            note(&mut self.changes, table, key, None);
        }
        Ok(removed.is_some())
    }

    /// Binds a body's file to a row of this batch. If the batch fails, the file is deleted.
    pub(crate) fn adopt(&mut self, body: NewBody) {
        self.adopted.push(body);
    }

    /// Releases a body's file from its row. It is deleted when the batch is on disk.
    pub(crate) fn discard(&mut self, body: BodyId) {
        self.discarded.push(body);
    }

    pub(super) fn changed_bytes(&self) -> usize {
        self.changes.len()
    }

    pub(super) fn end(self) -> Applied {
        let Self { tables, changes, adopted, discarded, removed_bytes } = self;
        drop(tables);
        Applied { changes, adopted, discarded, removed_bytes }
    }

    /// Applies rows from a journal.
    pub(super) fn replay(&mut self, mut changes: &[u8]) -> Result<(), StorageError> {
        while !changes.is_empty() {
            let (table, key, value) = noted(&mut changes)
                .ok_or_else(|| StorageError::Corrupted("a row of the journal is cut off".to_owned()))?;
            match value {
                Some(value) => drop(self.tables[table as usize].insert(key, value)?),
                None => drop(self.tables[table as usize].remove(key)?),
            }
        }
        Ok(())
    }
}

impl<'t> View for Batch<'t> {
    type Opened = Written<'t>;

    fn opened(&self, table: Table) -> &Written<'t> {
        &self.tables[table as usize]
    }
}

/// The value length that marks a removed row.
const REMOVED: u32 = u32::MAX;

/// Encodes a change: table, length of the key, length of the value, key, value.
fn note(changes: &mut Vec<u8>, table: Table, key: &[u8], value: Option<&[u8]>) {
    let length = |bytes: &[u8]| u32::try_from(bytes.len()).unwrap_or(REMOVED - 1);
    changes.push(table as u8);
    changes.extend(length(key).to_le_bytes());
    changes.extend(value.map_or(REMOVED, length).to_le_bytes());
    changes.extend(key);
    changes.extend(value.unwrap_or_default());
}

/// A decoded change: table, key, and the value unless the row was removed.
type Noted<'a> = (Table, &'a [u8], Option<&'a [u8]>);

fn noted<'a>(changes: &mut &'a [u8]) -> Option<Noted<'a>> {
    let table = Table::of(*changes.split_off_first()?)?;
    let key_length = u32::from_le_bytes(*changes.split_off(..4)?.as_array()?);
    let value_length = u32::from_le_bytes(*changes.split_off(..4)?.as_array()?);
    let key = changes.split_off(..usize::try_from(key_length).ok()?)?;
    if value_length == REMOVED {
        return Some((table, key, None));
    }
    let value = changes.split_off(..usize::try_from(value_length).ok()?)?;
    Some((table, key, Some(value)))
}

fn missing_table() -> redb::Error {
    redb::Error::Corrupted("a table is missing".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_noted_and_read_back() {
        let mut changes = Vec::new();
        note(&mut changes, Table::Objects, b"films\0a", Some(b"value"));
        note(&mut changes, Table::Files, b"", Some(b""));
        note(&mut changes, Table::Sessions, b"key", None);
        let mut rest = changes.as_slice();
        assert_eq!(noted(&mut rest), Some((Table::Objects, &b"films\0a"[..], Some(&b"value"[..]))));
        assert_eq!(noted(&mut rest), Some((Table::Files, &b""[..], Some(&b""[..]))));
        assert_eq!(noted(&mut rest), Some((Table::Sessions, &b"key"[..], None)));
        assert!(rest.is_empty());
        for cut in 1..changes.len() {
            let mut rest = &changes[..cut];
            while !rest.is_empty() && noted(&mut rest).is_some() {}
        }
    }

    #[test]
    fn every_table_is_found_by_its_number() {
        for table in Table::ALL {
            assert_eq!(Table::of(table as u8), Some(table));
        }
        assert_eq!(Table::of(10), None);
    }
}
