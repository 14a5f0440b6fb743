//! The files that a model refers to: paths, names, and what was read of them.

use std::collections::BTreeMap;

use crate::error::{AssetError, Fault};
use crate::files::{FileInfo, Files, file_name, same_but_for_case};
use crate::limits;

/// The files that a model refers to, and all that was read of them.
pub struct Referred<'a> {
    files: &'a dyn Files,
    /// The last part of each path, with the whole path and what is known about the file.
    by_name: BTreeMap<String, (String, Option<FileInfo>)>,
    /// An error that a decoder is to pass on as it is.
    pub(crate) error: Option<AssetError>,
}

impl<'a> Referred<'a> {
    /// Starts without any.
    pub fn new(files: &'a dyn Files) -> Self {
        Self { files, by_name: BTreeMap::new(), error: None }
    }

    /// Returns the names of the files that were referred to, each with its path in the model, and what is known about the
    /// file; `None` if there is none.
    pub fn sources(&self) -> impl Iterator<Item = (&str, &str, Option<FileInfo>)> {
        self.by_name.iter().map(|(name, (path, info))| (name.as_str(), path.as_str(), *info))
    }

    /// Returns whether there is a file for a path, without an error for a path that can have none.
    pub(crate) fn exists(&self, path: &str) -> Result<bool, Fault> {
        let name = last_part(path);
        if file_name(name).is_err() {
            return Ok(false);
        }
        Ok(self.files.look(name).map_err(Fault::new)?.is_some())
    }

    /// Returns the content of the file for a path, or `None` if there is none.
    pub(crate) fn read(&mut self, path: &str) -> Result<Option<Vec<u8>>, Fault> {
        let path = path.replace('\\', "/");
        let mut path = path.as_str();
        while let Some(rest) = path.strip_prefix("./") {
            path = rest;
        }
        let name = last_part(path);
        file_name(name).map_err(|fault| Fault::new(format!("it refers to `{path}`, but {fault}")))?;
        let info = match self.by_name.get(name) {
            Some((other, _)) if other != path => {
                return Err(Fault::new(format!(
                    "it refers to both `{other}` and `{path}`, which are one file here"
                )));
            }
            Some((_, info)) => *info,
            None => {
                if self.by_name.len() >= limits::FILES {
                    return Err(Fault::new(format!("it refers to more than {} files", limits::FILES)));
                }
                let info = self.files.look(name).map_err(|why| self.give_up(unreadable(name, why)))?;
                self.by_name.insert(name.into(), (path.into(), info));
                info
            }
        };
        if info.is_none() {
            return Ok(None);
        }
        content(self.files, name).map_err(|error| self.give_up(error)).map(Some)
    }

    /// Returns the error for a file that a model cannot do without.
    pub(crate) fn absent(&mut self, path: &str) -> Fault {
        let error = absent(self.files, last_part(path));
        self.give_up(error)
    }

    /// Keeps an error that is to be passed on as it is.
    fn give_up(&mut self, error: AssetError) -> Fault {
        let fault = Fault::new(error.to_string());
        self.error = Some(error);
        fault
    }

    pub(crate) fn extension(&mut self, name: &str, extension: &str) -> Fault {
        self.give_up(AssetError::Extension { name: name.into(), extension: extension.into() })
    }
}

/// Returns the part of a path behind its last separator.
pub(crate) fn last_part(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or_default()
}

fn unreadable(name: &str, why: String) -> AssetError {
    AssetError::Unreadable { name: name.into(), why }
}

/// Returns the error for a file that is not there.
pub(crate) fn absent(files: &dyn Files, name: &str) -> AssetError {
    if !files.are_readable() {
        return AssetError::NotHere { name: name.into() };
    }
    let similar = files.names().into_iter().find(|other| same_but_for_case(other, name));
    AssetError::Absent { name: name.into(), similar }
}

/// Returns the content of a file within the limit on its size.
pub(crate) fn content(files: &dyn Files, name: &str) -> Result<Vec<u8>, AssetError> {
    let Some(info) = files.look(name).map_err(|why| unreadable(name, why))? else {
        return Err(absent(files, name));
    };
    if info.bytes > limits::FILE_BYTES {
        return Err(AssetError::TooLarge { name: name.into(), bytes: info.bytes });
    }
    let bytes = files.read(name).map_err(|why| unreadable(name, why))?;
    if bytes.len() as u64 > limits::FILE_BYTES {
        return Err(AssetError::TooLarge { name: name.into(), bytes: bytes.len() as u64 });
    }
    Ok(bytes)
}
