//! A file as it should be in the bucket, and the check whether it is there already.
//!
//! The check compares the size and the MD5, which usually is the object's entity tag. It is not if the
//! object is encrypted with a customer-managed key or was uploaded in parts; then the digest in the
//! object's metadata is compared.

use std::io::{Cursor, Read};
use std::path::{Path, PathBuf};

use bytes::Bytes;
use md5::{Digest, Md5};
use rayfold_pipeline::store::{ETag, PutOptions, Store, Upload};

use crate::error::{Error, Result};

/// The metadata key of a script's digest.
pub(crate) const DIGEST: &str = "rayfold-md5";

/// The size from which a file is sent in parts, in bytes.
const IN_PARTS: u64 = 16 << 20;

/// The size of the pieces in which a file is read, in bytes.
const PIECE: u64 = 1 << 20;

/// A file as it should be in the bucket.
#[derive(Debug, Clone)]
pub struct File {
    content: Content,
    size: u64,
    digest: String,
}

/// The source of a file's bytes.
#[derive(Debug, Clone)]
pub enum Content {
    /// A file on disk, which is read again when it is sent.
    Path(PathBuf),
    /// A content in memory.
    Bytes(Bytes),
}

impl File {
    /// Reads the content once, for its size and digest.
    ///
    /// # Errors
    /// [`Error::Read`] if the file cannot be read.
    pub fn new(content: Content) -> Result<Self> {
        let (mut pieces, mut size) = (content.pieces()?, 0);
        while let Some(piece) = pieces.next()? {
            size += piece.len() as u64;
        }
        Ok(Self { size, digest: pieces.digest(), content })
    }

    /// Makes a file with this text.
    pub fn of_text(text: impl Into<String>) -> Self {
        let bytes = Bytes::from(text.into());
        Self { size: bytes.len() as u64, digest: digest(&bytes), content: Content::Bytes(bytes) }
    }

    /// Returns the size in bytes.
    pub fn size(&self) -> u64 {
        self.size
    }

    /// Returns the MD5 as hexadecimal digits.
    pub(crate) fn digest(&self) -> &str {
        &self.digest
    }

    /// Returns the most memory that sending it takes, in bytes.
    pub(crate) fn memory(&self) -> u64 {
        self.size.min(IN_PARTS)
    }

    /// Makes it the object `key`: in one request, or in parts if it is large.
    ///
    /// # Errors
    /// [`Error::Read`], and [`Error::FileChanged`] if the file has changed since it was digested; the errors of the store.
    /// Then the object is as it was.
    pub(crate) async fn send<S: Store>(&self, store: &S, key: &str) -> Result<ETag> {
        let mut pieces = self.content.pieces()?;
        if self.size < IN_PARTS {
            let mut bytes = Vec::new();
            while let Some(piece) = pieces.next()? {
                bytes.extend_from_slice(&piece);
            }
            self.must_be(pieces, key)?;
            return Ok(store.put(key, bytes.into(), self.options(key)).await?);
        }
        let mut upload = store.upload(key, self.options(key)).await?;
        match self.write(pieces, key, &mut upload).await {
            Ok(()) => Ok(upload.finish(None).await?),
            Err(error) => {
                // If it cannot be aborted either, it is left to the bucket's rule for unfinished uploads.
                let _ = upload.abort().await;
                Err(error)
            }
        }
    }

    async fn write(&self, mut pieces: Pieces<'_>, key: &str, upload: &mut impl Upload) -> Result<()> {
        while let Some(piece) = pieces.next()? {
            upload.write(piece).await?;
        }
        self.must_be(pieces, key)
    }

    /// Returns an error unless these were the pieces of the file as it was digested.
    fn must_be(&self, pieces: Pieces<'_>, key: &str) -> Result<()> {
        if pieces.digest() == self.digest { Ok(()) } else { Err(Error::FileChanged { key: key.to_owned() }) }
    }

    /// Returns the options with which the file is put.
    pub(crate) fn options(&self, key: &str) -> PutOptions {
        let media_type = match key.rsplit_once('.') {
            Some((_, "json")) => "application/json",
            Some((_, "txt")) => "text/plain; charset=utf-8",
            _ => "application/octet-stream",
        };
        PutOptions::always().content_type(media_type).metadata(DIGEST, &self.digest)
    }
}

impl Content {
    fn pieces(&self) -> Result<Pieces<'_>> {
        let (reader, path): (Box<dyn Read + Send>, _) = match self {
            Self::Bytes(bytes) => (Box::new(Cursor::new(bytes.clone())), Path::new("")),
            Self::Path(path) => match std::fs::File::open(path) {
                Ok(file) => (Box::new(file), path.as_path()),
                Err(source) => return Err(Error::Read { path: path.clone(), source }),
            },
        };
        Ok(Pieces { reader, path, md5: Md5::new() })
    }
}

/// The bytes of a content, piece by piece.
struct Pieces<'a> {
    reader: Box<dyn Read + Send>,
    /// The path of the file; empty for bytes in memory, whose reading does not fail.
    path: &'a Path,
    md5: Md5,
}

impl Pieces<'_> {
    fn next(&mut self) -> Result<Option<Bytes>> {
        let mut piece = Vec::new();
        match (&mut self.reader).take(PIECE).read_to_end(&mut piece) {
            Ok(0) => Ok(None),
            Ok(_) => {
                self.md5.update(&piece);
                Ok(Some(piece.into()))
            }
            Err(source) => Err(Error::Read { path: self.path.to_owned(), source }),
        }
    }

    /// Returns the MD5 of what was read.
    fn digest(self) -> String {
        hexadecimal(&self.md5.finalize())
    }
}

fn digest(bytes: &[u8]) -> String {
    hexadecimal(&Md5::digest(bytes))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::World;

    #[test]
    fn the_digest_is_what_s3_calls_an_entity_tag() {
        // The test vector is from RFC 1321, A.5.
        assert_eq!(digest(b"message digest"), "f96b697d7cb7938d525a2f31aaf161d0");
    }

    #[tokio::test]
    async fn a_file_that_changes_before_it_is_sent_is_not_sent() {
        let (world, folder) = (World::new(), tempfile::tempdir().unwrap());
        let path = folder.path().join("1.txt");
        for size in [5, IN_PARTS as usize + 5] {
            std::fs::write(&path, vec![b'a'; size]).unwrap();
            let file = File::new(Content::Path(path.clone())).unwrap();
            assert_eq!(file.size(), size as u64);
            std::fs::write(&path, vec![b'b'; size]).unwrap();
            let refused = file.send(&world.store, "k").await;
            assert!(matches!(refused, Err(Error::FileChanged { key }) if key == "k"), "{size}");
            std::fs::remove_file(&path).unwrap();
            let refused = file.send(&world.store, "k").await;
            assert!(matches!(refused, Err(Error::Read { path: of, .. }) if of == path), "{size}");
        }
        assert!(world.keys("").await.is_empty());
    }

    #[tokio::test]
    async fn a_large_file_goes_in_parts_and_is_known_again() {
        let world = World::new();
        let large = |last: u8| {
            let mut bytes = vec![b'a'; IN_PARTS as usize];
            bytes.push(last);
            File::new(Content::Bytes(bytes.into())).unwrap()
        };
        for (file, name) in [(large(b'b'), "upload k"), (File::of_text("small"), "put s")] {
            world.requests.clear();
            file.send(&world.store, &name[name.len() - 1..]).await.unwrap();
            assert_eq!(world.requests.seen(), [name]);
        }
        let object = world.store.get("k").await.unwrap();
        assert_eq!(object.body.len() as u64, IN_PARTS + 1);
        assert_eq!(object.info.metadata[DIGEST], large(b'b').digest());
        assert_ne!(object.info.metadata[DIGEST], large(b'c').digest());
    }
}
