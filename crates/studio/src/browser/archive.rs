//! Projects as zip files.

use std::io::{Cursor, Read, Write};

use zip::write::SimpleFileOptions;
use zip::{ZipArchive, ZipWriter};

use super::packet::File;
use crate::error::Error;
use crate::storage::TEXT;

/// The largest number of files in an archive.
const FILES: usize = 10_000;

/// Returns files as a zip file.
///
/// # Errors
/// Fails if the files are beyond the limits of the format.
pub fn zipped(files: &[File]) -> Result<Vec<u8>, Error> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, content) in files {
        zip.start_file(name, SimpleFileOptions::default()).map_err(|error| refused(&error))?;
        zip.write_all(content).map_err(|error| refused(&error))?;
    }
    Ok(zip.finish().map_err(|error| refused(&error))?.into_inner())
}

/// Returns the files of a zip file, and the names of those that are left out, because they are in folders. One folder that
/// holds everything does not count.
///
/// # Errors
/// Fails if it is no zip file, or if its files exceed the limit of the studio.
pub fn unzipped(bytes: &[u8]) -> Result<(Vec<File>, Vec<String>), Error> {
    let mut zip = ZipArchive::new(Cursor::new(bytes)).map_err(|error| refused(&error))?;
    let name_at = |at| Some(zip.name_for_index(at)?.ok()?.into_owned());
    let names: Vec<String> = (0..zip.len()).filter_map(name_at).collect();
    let first = names.first().and_then(|name| name.split_once('/')).map(|(folder, _)| format!("{folder}/"));
    let folder = first.filter(|folder| names.iter().all(|name| name.starts_with(folder))).unwrap_or_default();
    let mut room = TEXT;
    let (mut files, mut left_out) = (Vec::new(), Vec::new());
    for name in names {
        let own = &name[folder.len()..];
        if !is_plain(own) {
            left_out.extend((!own.is_empty() && !own.ends_with('/')).then(|| own.to_owned()));
            continue;
        }
        let entry = zip.by_name(&name).map_err(|error| refused(&error))?;
        let mut content = Vec::new();
        entry.take(room + 1).read_to_end(&mut content).map_err(|error| refused(&error))?;
        let too_large =
            || Error::Output(format!("the zip file holds more than {TEXT} bytes or {FILES} files"));
        room = room.checked_sub(content.len() as u64).ok_or_else(too_large)?;
        files.push((own.to_owned(), content));
        if files.len() > FILES {
            return Err(too_large());
        }
    }
    Ok((files, left_out))
}

/// Returns whether a name is that of a file that is not hidden and not in a folder.
fn is_plain(name: &str) -> bool {
    !name.is_empty() && !name.starts_with('.') && !name.chars().any(|c| c.is_control() || "/\\:".contains(c))
}

fn refused(error: &dyn std::error::Error) -> Error {
    Error::Output(format!("the zip file cannot be used: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_zip_file_has_its_files_and_none_of_other_places() {
        let files = vec![("a.txt".to_owned(), b"Trace\n".to_vec()), ("m.obj".to_owned(), vec![0; 9])];
        assert_eq!(unzipped(&zipped(&files).unwrap()).unwrap(), (files.clone(), vec![]));
        let nested: Vec<_> =
            files.iter().map(|(name, content)| (format!("film/{name}"), content.clone())).collect();
        let own = unzipped(&zipped(&nested).unwrap()).unwrap();
        assert_eq!(own, (files.clone(), vec![]), "one folder that holds everything");
        let mut astray = files.clone();
        astray.extend([("../b.txt".into(), vec![1]), ("c/d.txt".into(), vec![2])]);
        let left_out = vec!["../b.txt".to_owned(), "c/d.txt".to_owned()];
        assert_eq!(unzipped(&zipped(&astray).unwrap()).unwrap(), (files, left_out));
        assert!(unzipped(b"no zip file").unwrap_err().to_string().contains("cannot be used"));
    }
}
