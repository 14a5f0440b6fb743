//! A picture and the name of its file.

use std::sync::Arc;

use rayfold_assets::Picture;

/// The picture in a file of the script's own folder.
#[derive(Clone, Debug)]
pub struct PictureFile {
    file: Arc<str>,
    picture: Arc<Picture>,
}

impl PictureFile {
    /// Makes it from the plain name of a file and the picture in the file.
    pub fn new(file: &str, picture: Arc<Picture>) -> Self {
        Self { file: file.into(), picture }
    }

    /// Returns the name of the file.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// Returns the picture.
    pub fn picture(&self) -> &Arc<Picture> {
        &self.picture
    }
}

/// Two picture files are equal if they are the same picture in memory.
impl PartialEq for PictureFile {
    fn eq(&self, other: &Self) -> bool {
        self.file == other.file && Arc::ptr_eq(&self.picture, &other.picture)
    }
}
