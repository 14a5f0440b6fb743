//! A file as it should be in the bucket, and the check whether it is there already.
//!
//! The check compares the size and the MD5, which usually is the object's entity tag. It is not if the
//! object is encrypted with a customer-managed key or was uploaded in parts; then the digest in the
//! object's metadata is compared.

use std::path::PathBuf;

use bytes::Bytes;
use md5::{Digest, Md5};
use rayfold_pipeline::store::PutOptions;

use crate::error::{Error, Result};

/// The metadata key of a script's digest.
pub(crate) const DIGEST: &str = "rayfold-md5";

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
        let bytes = content.read()?;
        Ok(Self { size: bytes.len() as u64, digest: digest(&bytes), content })
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

    /// Returns the bytes, for the object `key`.
    ///
    /// # Errors
    /// [`Error::Read`], and [`Error::FileChanged`] if the file has changed since it was digested.
    pub(crate) fn read(&self, key: &str) -> Result<Bytes> {
        let bytes = self.content.read()?;
        if digest(&bytes) != self.digest {
            return Err(Error::FileChanged { key: key.to_owned() });
        }
        Ok(bytes)
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
    fn read(&self) -> Result<Bytes> {
        match self {
            Self::Bytes(bytes) => Ok(bytes.clone()),
            Self::Path(path) => match std::fs::read(path) {
                Ok(bytes) => Ok(bytes.into()),
                Err(source) => Err(Error::Read { path: path.clone(), source }),
            },
        }
    }
}

fn digest(bytes: &[u8]) -> String {
    Md5::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_digest_is_what_s3_calls_an_entity_tag() {
        // The test vector is from RFC 1321, A.5.
        assert_eq!(digest(b"message digest"), "f96b697d7cb7938d525a2f31aaf161d0");
    }

    #[test]
    fn a_file_that_changes_before_it_is_sent_is_not_sent() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("1.txt");
        std::fs::write(&path, "first").unwrap();
        let file = File::new(Content::Path(path.clone())).unwrap();
        assert_eq!((file.size(), file.read("k").unwrap()), (5, "first".into()));
        std::fs::write(&path, "other").unwrap();
        assert!(matches!(file.read("k"), Err(Error::FileChanged { key }) if key == "k"));
        std::fs::remove_file(&path).unwrap();
        assert!(matches!(file.read("k"), Err(Error::Read { path: of, .. }) if of == path));
    }
}
