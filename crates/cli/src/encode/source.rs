//! Sources of pictures: a file, which is opened as often as needed, or bytes in memory.

use std::io::{self, BufReader, Cursor, Read, Seek};
use std::path::PathBuf;
use std::sync::Arc;

/// A readable source with random access.
pub(super) trait ReadSeek: Read + Seek + Send {}

impl<T: Read + Seek + Send> ReadSeek for T {}

/// The input of the decoders.
pub(super) type Reader = BufReader<Box<dyn ReadSeek>>;

/// The bytes of a file.
#[derive(Clone, Debug)]
pub(super) enum Source {
    File(PathBuf),
    /// The bytes of standard input, which can be read only once.
    Memory(Arc<[u8]>),
}

impl Source {
    /// Returns the name for messages.
    pub(super) fn name(&self) -> String {
        match self {
            Self::File(path) => path.display().to_string(),
            Self::Memory(_) => "standard input".into(),
        }
    }

    /// # Errors
    /// When the file cannot be opened.
    pub(super) fn open(&self) -> io::Result<Reader> {
        let from: Box<dyn ReadSeek> = match self {
            Self::File(path) => Box::new(rayfold_files::open(path)?),
            Self::Memory(bytes) => Box::new(Cursor::new(Arc::clone(bytes))),
        };
        Ok(BufReader::new(from))
    }
}
