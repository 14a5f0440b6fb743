//! The files that a model refers to: paths, names, and what was read of them; and its pictures.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::error::{AssetError, Fault, shortened};
use crate::files::{FileInfo, Files, file_name, likeness, same_but_for_case};
use crate::limits;
use crate::picture::{self, Picture};

/// A function that makes the picture in the file of a name.
type Pictures<'a> = &'a dyn Fn(&str) -> Result<Arc<Picture>, AssetError>;

/// The most files that are looked for. A path with blanks can be several names.
const LOOKED: usize = 4 * limits::FILES;

fn too_many() -> Fault {
    Fault::new(format!("it refers to more than {} files", limits::FILES))
}

/// The files that a model refers to, and all that was read of them.
pub struct Referred<'a> {
    files: &'a dyn Files,
    /// The pictures of a library, which keeps them.
    pictures: Option<Pictures<'a>>,
    /// The pictures in files so far, and the pixels of these and of embedded ones.
    made: BTreeMap<String, Arc<Picture>>,
    pixels: u64,
    /// The last part of each path, with the whole path.
    by_name: BTreeMap<String, String>,
    /// All files that were looked for, whether the model then referred to them or not, each with its number in the order of
    /// the first looks.
    looked: BTreeMap<String, (usize, Option<FileInfo>)>,
    /// An error that a decoder passes on unchanged.
    pub(crate) error: Option<AssetError>,
}

impl<'a> Referred<'a> {
    /// Starts without any files.
    pub fn new(files: &'a dyn Files) -> Self {
        Self {
            files,
            pictures: None,
            made: BTreeMap::new(),
            pixels: 0,
            by_name: BTreeMap::new(),
            looked: BTreeMap::new(),
            error: None,
        }
    }

    /// Starts without any files. Pictures are those that `pictures` makes.
    pub(crate) fn with_pictures(files: &'a dyn Files, pictures: Pictures<'a>) -> Self {
        Self { pictures: Some(pictures), ..Self::new(files) }
    }

    /// Returns the names of the files that were referred to, each with its path in the model.
    pub fn sources(&self) -> impl Iterator<Item = (&str, &str)> {
        self.by_name.iter().map(|(name, path)| (name.as_str(), path.as_str()))
    }

    /// Returns the names of all files that the outcome of reading the model depends on, in the order in which they were looked
    /// for, each with what is known about the file.
    pub(crate) fn looked(&self) -> Vec<(String, Option<FileInfo>)> {
        let mut looked: Vec<_> = self.looked.iter().collect();
        looked.sort_by_key(|(_, (number, _))| *number);
        looked.into_iter().map(|(name, (_, info))| (name.clone(), *info)).collect()
    }

    /// Returns whether there is a file for a path, without an error for a path that can have none.
    pub(crate) fn exists(&mut self, path: &str) -> Result<bool, Fault> {
        let name = last_part(path);
        if file_name(name).is_err() {
            return Ok(false);
        }
        Ok(self.look(name)?.is_some())
    }

    fn look(&mut self, name: &str) -> Result<Option<FileInfo>, Fault> {
        if let Some((_, info)) = self.looked.get(name) {
            return Ok(*info);
        }
        let number = self.looked.len();
        if number >= LOOKED {
            return Err(too_many());
        }
        let info = self.files.look(name).map_err(|why| self.give_up(unreadable(name, why)))?;
        self.looked.insert(name.into(), (number, info));
        Ok(info)
    }

    /// Counts a file for a path among those that were referred to, if a file can have its name.
    pub(crate) fn note(&mut self, path: &str) -> Result<(), Fault> {
        if file_name(last_part(path)).is_ok() {
            self.refer(path)?;
        }
        Ok(())
    }

    /// Returns the content of the file for a path, or `None` if there is none.
    pub(crate) fn read(&mut self, path: &str) -> Result<Option<Vec<u8>>, Fault> {
        let Some(name) = self.refer(path)? else { return Ok(None) };
        content(self.files, &name).map_err(|error| self.give_up(error)).map(Some)
    }

    /// Returns the picture in the file for a path, or `None` if there is no such file.
    pub(crate) fn picture(&mut self, path: &str) -> Result<Option<Arc<Picture>>, Fault> {
        let Some(name) = self.refer(path)? else { return Ok(None) };
        if let Some(known) = self.made.get(&name) {
            return Ok(Some(known.clone()));
        }
        let picture = match self.pictures {
            Some(pictures) => pictures(&name),
            None => content(self.files, &name)
                .and_then(|bytes| picture::surface(&name, picture::decode(&name, &bytes)?).map(Arc::new)),
        };
        let picture = picture.map_err(|error| self.give_up(error))?;
        self.count(&picture)?;
        self.made.insert(name, picture.clone());
        Ok(Some(picture))
    }

    /// Returns the picture in a part of the file `name`. `what` names the part.
    pub(crate) fn embedded(&mut self, name: &str, what: &str, bytes: &[u8]) -> Result<Arc<Picture>, Fault> {
        let picture = picture::decode(name, bytes).and_then(|picture| picture::surface(name, picture));
        let picture = picture.map_err(|error| {
            let what = match error {
                AssetError::Picture { what: fault, .. } => format!("{what}: {fault}"),
                _ => format!("{what} is a picture of light (HDR or EXR)"),
            };
            self.give_up(AssetError::Picture { name: name.into(), what })
        })?;
        self.count(&picture)?;
        Ok(Arc::new(picture))
    }

    /// Counts the pixels of a picture, so that many small files do not fill the memory.
    fn count(&mut self, picture: &Picture) -> Result<(), Fault> {
        self.pixels += u64::from(picture.width()) * u64::from(picture.height());
        if self.pixels > limits::MODEL_PIXELS {
            let limit = limits::MODEL_PIXELS;
            return Err(Fault::new(format!("its pictures have more than {limit} pixels together")));
        }
        Ok(())
    }

    /// Notes a file that is referred to. Returns its name, or `None` if there is none.
    fn refer(&mut self, path: &str) -> Result<Option<String>, Fault> {
        let path = path.replace('\\', "/");
        let mut path = path.as_str();
        while let Some(rest) = path.strip_prefix("./") {
            path = rest;
        }
        let name = last_part(path);
        file_name(name).map_err(|fault| Fault::new(format!("it refers to `{path}`, but {fault}")))?;
        match self.by_name.get(name) {
            Some(other) if other != path => {
                return Err(Fault::new(format!(
                    "it refers to both `{other}` and `{path}`, which are one file here"
                )));
            }
            Some(_) => {}
            None if self.by_name.len() >= limits::FILES => return Err(too_many()),
            None => drop(self.by_name.insert(name.into(), path.into())),
        }
        Ok(self.look(name)?.map(|_| name.into()))
    }

    /// Returns the warning that a model lacks an optional file, with the effect of that.
    pub(crate) fn absence(&self, path: &str, effect: &str) -> String {
        let name = last_part(path);
        let similar = similar(self.files, name).map(|other| format!(" ({})", likeness(&other, name)));
        format!("there is no file `{}`{}: {effect}", shortened(path), similar.unwrap_or_default())
    }

    /// Returns the error for a file that a model cannot do without.
    pub(crate) fn absent(&mut self, path: &str) -> Fault {
        let error = absent(self.files, last_part(path));
        self.give_up(error)
    }

    /// Keeps an error that is passed on unchanged.
    fn give_up(&mut self, error: AssetError) -> Fault {
        let fault = Fault::new(error.to_string());
        self.error = Some(error);
        fault
    }

    pub(crate) fn extension(&mut self, name: &str, extension: &str) -> Fault {
        self.give_up(AssetError::Extension { name: name.into(), extension: shortened(extension) })
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
    AssetError::Absent { name: name.into(), similar: similar(files, name) }
}

/// Returns the file whose name differs in letter case alone.
fn similar(files: &dyn Files, name: &str) -> Option<String> {
    files.names().into_iter().find(|other| same_but_for_case(other, name))
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
    if bytes.starts_with(b"version https://git-lfs.github.com/spec/") {
        let why = "Git LFS has left a pointer in its place: `git lfs pull` fetches the file".into();
        return Err(unreadable(name, why));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use image::{ImageFormat, RgbImage};

    use super::*;
    use crate::files::MemoryFiles;

    /// A black picture of 2²⁶ pixels can be a file of some kilobytes.
    #[test]
    fn pictures_of_a_model_are_bounded_together() {
        let mut bytes = std::io::Cursor::new(Vec::new());
        RgbImage::new(4, 2).write_to(&mut bytes, ImageFormat::Png).unwrap();
        let bytes = bytes.into_inner();
        let files = MemoryFiles::from([("a.png", bytes.clone()), ("b.png", bytes.clone())]);
        let mut referred = Referred::new(&files);
        referred.pixels = limits::MODEL_PIXELS - 8;
        assert!(referred.picture("a.png").unwrap().is_some());
        assert!(referred.picture("a.png").unwrap().is_some(), "a picture counts once");
        let beyond = "its pictures have more than 268435456 pixels together";
        assert_eq!(referred.picture("b.png").unwrap_err().what, beyond);
        assert_eq!(referred.embedded("a.glb", "image 0", &bytes).unwrap_err().what, beyond);
    }
}
