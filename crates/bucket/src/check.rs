//! Checks a whole folder: journal, database, every record and every body. A repair sets damaged files and rows aside.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use redb::StorageError;

use crate::checksum::Comparison;
use crate::records::{self, Body, LayoutPart, decode, find, key, set};
use crate::storage::{Bodies, BodyId, Damage, Row, Salvage, Snapshot, Table, View};
use crate::{Error, Result};

/// The number of bytes that are read from a file at a time.
const BLOCK_BYTES: usize = 1024 * 1024;

/// The result of a check.
#[derive(Debug)]
#[non_exhaustive]
pub struct Report {
    /// The number of undamaged objects.
    pub objects: u64,
    /// The sum of their sizes in bytes.
    pub bytes: u64,
    /// Everything that is damaged.
    pub damages: Vec<Damage>,
    /// The folder to which a repair moved damaged files.
    pub set_aside: Option<PathBuf>,
}

/// Reads all of a stopped store, and compares it with its checksums. With `repair`, moves damaged files and rows with
/// a list to a folder `set-aside-N` inside the store, so that the rest can be used again. Deletes nothing. Needs as
/// much disk space as two copies of the database.
///
/// # Errors
/// [`Error::DataInUse`], [`Error::NotOurs`], [`Error::Newer`], [`Error::File`], [`Error::Storage`].
pub fn check(data: &Path, repair: bool) -> Result<Report> {
    let mut salvage = Salvage::read(data)?;
    let rows = salvage.rows()?;
    let mut examined = Examined::default();
    let failed =
        |source: StorageError| Error::Storage { path: data.to_owned(), source: Box::new(source.into()) };
    examined.rows(&rows, salvage.bodies()).map_err(failed)?;
    let files = salvage.bodies().files().map_err(Error::file(data))?;
    examined.strays(&rows, files).map_err(failed)?;
    drop(rows);
    salvage.damages.append(&mut examined.damages);
    let damages = salvage.damages.clone();
    let mut set_aside = None;
    if repair && !damages.is_empty() {
        let aside = salvage.aside()?;
        examined.set_aside(&salvage, &aside, &damages)?;
        salvage.keep(&aside)?;
        set_aside = Some(aside);
    } else {
        salvage.leave()?;
    }
    Ok(Report { objects: examined.objects, bytes: examined.bytes, damages, set_aside })
}

/// The findings in the rows.
#[derive(Default)]
struct Examined {
    objects: u64,
    bytes: u64,
    damages: Vec<Damage>,
    /// The rows that must be removed.
    removed: Vec<(Table, Row)>,
    /// The files that must be removed.
    files: Vec<PathBuf>,
    /// The buckets that have objects but no row.
    buckets: BTreeSet<String>,
    /// The bodies that undamaged objects and parts refer to.
    used: BTreeSet<[u8; 8]>,
}

impl Examined {
    fn damaged(&mut self, place: impl Into<String>, what: impl Into<String>) {
        self.damages.push(Damage { place: place.into(), what: what.into() });
    }

    /// Examines every record that refers to a body, and the body.
    fn rows(&mut self, rows: &Snapshot, bodies: &Bodies) -> Result<(), StorageError> {
        for row in rows.from(Table::Objects, b"")? {
            let (row_key, value) = row?;
            let split = row_key.iter().position(|byte| *byte == 0).unwrap_or(row_key.len());
            let bucket = String::from_utf8_lossy(&row_key[..split]).into_owned();
            let name = format!("{bucket}/{}", String::from_utf8_lossy(key::of_object(&row_key, &bucket)));
            let object: Result<records::Object, _> = decode(&value);
            let whole = match object {
                Ok(object) => {
                    let (size, checksum) = (object.size, object.checksum);
                    let part = LayoutPart { number: 1, size, body: object.body, checksum };
                    self.body(rows, bodies, &part)?.map(|used| (used, size))
                }
                Err(error) => Err(error.to_string()),
            };
            match whole {
                Ok((used, size)) => {
                    self.objects += 1;
                    self.bytes += size;
                    self.used.extend(used);
                    if rows.get(Table::Buckets, bucket.as_bytes())?.is_none()
                        && self.buckets.insert(bucket.clone())
                    {
                        self.damaged(bucket, "the bucket's row is missing, but it has objects");
                    }
                }
                Err(what) => {
                    self.damaged(name, what);
                    self.removed.push((Table::Objects, (row_key, value)));
                }
            }
        }
        for row in rows.from(Table::Parts, b"")? {
            let (row_key, value) = row?;
            let part: Result<records::Part, _> = decode(&value);
            let whole = match part {
                Ok(part) => {
                    let part = LayoutPart {
                        number: 1,
                        size: part.size,
                        body: part.body,
                        checksum: Some(part.checksum),
                    };
                    self.body(rows, bodies, &part)?
                }
                Err(error) => Err(error.to_string()),
            };
            match whole {
                Ok(used) => self.used.extend(used),
                Err(what) => {
                    let upload =
                        String::from_utf8_lossy(row_key.split(|byte| *byte == 0).next().unwrap_or_default());
                    self.damaged(format!("part {} of upload {upload}", key::of_part(&row_key)), what);
                    self.removed.push((Table::Parts, (row_key, value)));
                }
            }
        }
        self.decodable::<records::Bucket>(rows, Table::Buckets)?;
        self.decodable::<records::Upload>(rows, Table::Uploads)?;
        self.decodable::<records::Event>(rows, Table::Outbox)
    }

    fn decodable<T: serde::de::DeserializeOwned>(
        &mut self,
        rows: &Snapshot,
        table: Table,
    ) -> Result<(), StorageError> {
        for row in rows.from(table, b"")? {
            let row = row?;
            if let Err(error) = decode::<T>(&row.1) {
                self.damaged(format!("a row of {table:?}"), error.to_string());
                self.removed.push((table, row));
            }
        }
        Ok(())
    }

    /// Returns the keys of a body's rows if it is undamaged, else the damage.
    fn body(
        &self,
        rows: &Snapshot,
        bodies: &Bodies,
        part: &LayoutPart,
    ) -> Result<Result<Vec<[u8; 8]>, String>, StorageError> {
        let mut comparison = part.checksum.as_ref().and_then(Comparison::with);
        Ok(match part.body {
            Body::Row(id) => {
                let bytes = rows.get(Table::Bodies, &id.key())?.unwrap_or_default();
                if let Some(comparison) = &mut comparison {
                    comparison.update(&bytes);
                }
                let whole = bytes.len() as u64 == part.size && comparison.is_none_or(Comparison::matches);
                let what = || {
                    format!(
                        "{} of its {} bytes are there, or do not match their checksum",
                        bytes.len(),
                        part.size
                    )
                };
                whole.then(|| vec![id.key()]).ok_or_else(what)
            }
            Body::File(id) => {
                let path = bodies.path(id);
                let wrong = |what: String| format!("{}: {what}", path.display());
                match read(&path, comparison.as_mut()) {
                    Err(error) => Err(wrong(error.to_string())),
                    Ok(length) if length != part.size => {
                        Err(wrong(format!("it has {length} bytes instead of {}", part.size)))
                    }
                    Ok(_) if !comparison.is_none_or(Comparison::matches) => {
                        Err(wrong("its bytes do not match their checksum".to_owned()))
                    }
                    Ok(_) if rows.get(Table::Files, &id.key())?.is_none() => {
                        Err(wrong("the row that keeps the file is missing".to_owned()))
                    }
                    Ok(_) => Ok(vec![id.key()]),
                }
            }
            Body::Parts(id) => {
                let layout: Option<records::Layout> =
                    find(rows, Table::Layouts, &id.key()).unwrap_or_default();
                let Some(layout) = layout else {
                    return Ok(Err("the list of its parts cannot be read".to_owned()));
                };
                let mut used = vec![id.key()];
                for part in &layout.parts {
                    if matches!(part.body, Body::Parts(_)) {
                        return Ok(Err("a part of it is made of parts".to_owned()));
                    }
                    match self.body(rows, bodies, part)? {
                        Ok(more) => used.extend(more),
                        Err(what) => return Ok(Err(format!("part {}: {what}", part.number))),
                    }
                }
                match layout.parts.iter().map(|part| part.size).sum::<u64>() == part.size {
                    true => Ok(used),
                    false => Err("its parts have another size than it has".to_owned()),
                }
            }
        })
    }

    /// Finds bodies that no undamaged record refers to. A kill leaves such files. They are no damage if
    /// nothing else is damaged.
    fn strays(&mut self, rows: &Snapshot, files: Vec<(PathBuf, Option<BodyId>)>) -> Result<(), StorageError> {
        for table in [Table::Bodies, Table::Files, Table::Layouts] {
            for row in rows.from(table, b"")? {
                let row = row?;
                if !row.0.as_slice().try_into().is_ok_and(|key: [u8; 8]| self.used.contains(&key)) {
                    if BodyId::of_key(&row.0).is_none() {
                        self.damaged(format!("a row of {table:?}"), "its key is malformed");
                    }
                    self.removed.push((table, row));
                }
            }
        }
        let stray = |id: &Option<BodyId>| id.is_none_or(|id| !self.used.contains(&id.key()));
        self.files = files.into_iter().filter(|(_, id)| stray(id)).map(|(path, _)| path).collect();
        Ok(())
    }

    /// Moves the files and rows that must be removed to a folder, with a list.
    fn set_aside(&self, salvage: &Salvage, aside: &Path, damages: &[Damage]) -> Result<()> {
        let write = || {
            let mut list = File::create_new(aside.join("list.txt"))?;
            for Damage { place, what } in damages {
                writeln!(list, "{place}: {what}")?;
            }
            let mut rows = File::create_new(aside.join("rows.txt"))?;
            for (number, (table, (row_key, value))) in self.removed.iter().enumerate() {
                let shown = |bytes: &[u8]| String::from_utf8_lossy(bytes).escape_debug().to_string();
                if *table == Table::Bodies {
                    let file = format!("body-row-{number}");
                    fs::write(aside.join(&file), value)?;
                    writeln!(rows, "{table:?}\t{row_key:02x?}\tin {file}")?;
                } else {
                    writeln!(rows, "{table:?}\t{}\t{}", shown(row_key), shown(value))?;
                }
            }
            for file in &self.files {
                if let Some(name) = file.file_name() {
                    fs::rename(file, aside.join(name))?;
                }
            }
            list.sync_all()?;
            rows.sync_all()
        };
        write().map_err(Error::file(aside))?;
        salvage.change(|batch| {
            for (table, (row_key, _)) in &self.removed {
                batch.remove(*table, row_key)?;
            }
            for bucket in &self.buckets {
                let record = records::Bucket {
                    created: records::Moment::now(),
                    notifications: Vec::new(),
                    cors: Vec::new(),
                };
                set(batch, Table::Buckets, bucket.as_bytes(), &record)?;
            }
            Ok(())
        })
    }
}

/// Reads a file to its end. Returns its length.
fn read(path: &Path, mut comparison: Option<&mut Comparison>) -> io::Result<u64> {
    let mut file = File::open(path)?;
    let mut block = vec![0; BLOCK_BYTES];
    let mut length = 0;
    loop {
        match file.read(&mut block) {
            Ok(0) => return Ok(length),
            Ok(read) => {
                length += read as u64;
                if let Some(comparison) = &mut comparison {
                    comparison.update(&block[..read]);
                }
            }
            Err(again) if again.kind() == io::ErrorKind::Interrupted => {}
            Err(failed) => return Err(failed),
        }
    }
}
