//! Destinations of a file of an animation: a file that appears once all of it is there, and memory.

use std::io::{self, BufWriter, IntoInnerError, Write};
use std::path::{Path, PathBuf};

use rayfold_files::OutputFile;
use rayfold_pipeline::Clock;
use rayfold_pipeline::keys::Animation;
use rayfold_pipeline::store::{ObjectInfo, Store};
use rayfold_scene::Container;

use crate::client::Client;
use crate::error::{Error, Result};
use crate::fetch::Output;

/// A file that appears once all of it is there.
struct Download {
    path: PathBuf,
    file: Option<BufWriter<OutputFile>>,
}

impl Output for Download {
    fn begin(&mut self, _: u64) -> io::Result<()> {
        self.file = Some(BufWriter::new(OutputFile::create(&self.path).map_err(io::Error::other)?));
        Ok(())
    }

    fn write(&mut self, piece: &[u8]) -> io::Result<()> {
        self.file.as_mut().map_or(Ok(()), |file| write_to(&self.path, file, piece))
    }
}

/// Writes to the file of this name, which an error has.
fn write_to(path: &Path, mut file: impl Write, piece: &[u8]) -> io::Result<()> {
    file.write_all(piece).map_err(|source| io::Error::other(unwritten(path, source)))
}

/// Returns the error of the system with the name of the file.
fn unwritten(path: &Path, source: io::Error) -> rayfold_files::Error {
    rayfold_files::Error::Io { path: path.to_path_buf(), source }
}

impl Output for Vec<u8> {
    fn begin(&mut self, _: u64) -> io::Result<()> {
        self.clear();
        Ok(())
    }

    fn write(&mut self, piece: &[u8]) -> io::Result<()> {
        self.extend_from_slice(piece);
        Ok(())
    }
}

impl<S: Store, C: Clock> Client<'_, S, C> {
    /// Downloads the current file of a kind to a file, which appears once all of it is there.
    ///
    /// # Errors
    /// The errors of [`fetch`](Self::fetch), and [`Error::Write`].
    pub async fn download(
        &self,
        animation: &Animation,
        container: Container,
        path: &Path,
    ) -> Result<ObjectInfo> {
        let mut download = Download { path: path.to_path_buf(), file: None };
        let info = self.fetch(animation, container, &mut download).await?;
        if let Some(file) = download.file {
            let file = file.into_inner().map_err(IntoInnerError::into_error);
            file.map_err(|source| unwritten(path, source))
                .and_then(|file| file.finish(true))
                .map_err(Error::Write)?;
        }
        Ok(info)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::World;
    use rayfold_pipeline::store::PutOptions;

    #[tokio::test]
    async fn a_file_appears_whole_or_not_at_all() {
        let world = World::new();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("film.gif");
        std::fs::write(&path, "before").unwrap();
        assert!(world.client().download(&world.film(), Container::Gif, &path).await.is_err());
        assert_eq!(std::fs::read(&path).unwrap(), b"before");
        world.store.put("animations/film.gif", "GIF89a".into(), PutOptions::always()).await.unwrap();
        world.client().download(&world.film(), Container::Gif, &path).await.unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"GIF89a");
        let mut bytes = b"before".to_vec();
        world.client().fetch(&world.film(), Container::Gif, &mut bytes).await.unwrap();
        assert_eq!(bytes, b"GIF89a");
        let missing = folder.path().join("none").join("film.gif");
        let error = world.client().download(&world.film(), Container::Gif, &missing).await.unwrap_err();
        assert!(error.to_string().contains("none"), "{error}");
    }

    /// The message was "No space left on device", without the name of the file.
    #[test]
    fn a_file_that_cannot_grow_is_named() {
        let error = write_to(Path::new("film.gif"), &mut [0; 2][..], b"GIF89a").unwrap_err();
        assert_eq!(Error::Output(error).to_string(), "cannot write film.gif");
    }
}
