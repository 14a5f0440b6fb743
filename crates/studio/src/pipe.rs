//! Files that are sent while they are made, so that their size does not matter: written bytes become the body of a
//! response. The writer waits for the reader, and gets an error when the reader has gone.

use std::io::{self, Write};
use std::thread;

use axum::body::Body;
use bytes::Bytes;
use futures_util::stream;
use tokio::sync::mpsc::{Receiver, Sender, channel};
use zip::ZipWriter;
use zip::write::{SimpleFileOptions, StreamWriter};

/// The number of bytes that are sent at a time.
const PIECE: usize = 64 << 10;

/// The largest number of pieces that wait to be read.
const WAITING: usize = 16;

/// The writing end of a pipe.
#[derive(Debug)]
pub(crate) struct Pipe {
    sender: Sender<io::Result<Bytes>>,
    gathered: Vec<u8>,
}

/// A zip file that is sent while it is made. Pictures are stored uncompressed, because PNG is compressed already.
#[derive(Debug)]
pub(crate) struct Zip(ZipWriter<StreamWriter<Pipe>>);

/// Makes a body and the pipe that fills it.
pub(crate) fn pipe() -> (Pipe, Body) {
    let (sender, receiver) = channel(WAITING);
    let next = async |mut receiver: Receiver<_>| receiver.recv().await.map(|piece| (piece, receiver));
    (Pipe { sender, gathered: Vec::new() }, Body::from_stream(stream::unfold(receiver, next)))
}

/// Runs `work` to write a zip file on a thread of its own. An error breaks the response, so that the client does not
/// take it for a whole file.
///
/// # Errors
/// Fails if the system cannot start a thread.
pub(crate) fn zip_of(work: impl FnOnce(&mut Zip) -> io::Result<()> + Send + 'static) -> io::Result<Body> {
    let (pipe, body) = pipe();
    let failures = pipe.failures();
    thread::Builder::new().name("zip".into()).spawn(move || {
        let mut zip = Zip::new(pipe);
        if let Err(error) = work(&mut zip).and_then(|()| zip.finish()) {
            // If this fails, the reader has gone.
            let _ = failures.blocking_send(Err(error));
        }
    })?;
    Ok(body)
}

impl Zip {
    pub(crate) fn new(pipe: Pipe) -> Self {
        Self(ZipWriter::new_stream(pipe))
    }

    /// Adds a file to the archive.
    ///
    /// # Errors
    /// Fails if the reader has gone.
    pub(crate) fn add(&mut self, name: &str, bytes: &[u8]) -> io::Result<()> {
        let options = SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
        self.0.start_file(name, options)?;
        self.0.write_all(bytes)
    }

    /// Finishes the archive.
    ///
    /// # Errors
    /// Fails if the reader has gone.
    pub(crate) fn finish(self) -> io::Result<()> {
        self.0.finish()?.into_inner().flush()
    }
}

impl Pipe {
    /// Returns the sender for an error, which breaks the response.
    pub(crate) fn failures(&self) -> Sender<io::Result<Bytes>> {
        self.sender.clone()
    }

    /// Sends the gathered bytes.
    fn send(&mut self) -> io::Result<()> {
        let piece = Bytes::from(std::mem::take(&mut self.gathered));
        self.sender.blocking_send(Ok(piece)).map_err(|_| io::ErrorKind::BrokenPipe.into())
    }
}

impl Write for Pipe {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.gathered.extend_from_slice(bytes);
        if self.gathered.len() >= PIECE {
            self.send()?;
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.gathered.is_empty() { Ok(()) } else { self.send() }
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Cursor, Read};

    use super::*;

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn a_zip_file_comes_whole_however_large_it_is() {
        let large: Vec<u8> = (0..3_000_000_u32).map(|n| (n % 251) as u8).collect();
        let sent = large.clone();
        let body = zip_of(move |zip| {
            zip.add("small", b"x")?;
            zip.add("large", &sent)
        });
        let bytes = axum::body::to_bytes(body.unwrap(), usize::MAX).await.unwrap();
        let mut read = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
        let mut found = Vec::new();
        read.by_name("large").unwrap().read_to_end(&mut found).unwrap();
        assert!(found == large);
        assert_eq!(read.len(), 2);
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn a_file_that_fails_on_the_way_is_no_whole_answer() {
        let body = zip_of(|zip| {
            zip.add("a", b"x")?;
            Err(io::Error::other("no more"))
        });
        assert!(axum::body::to_bytes(body.unwrap(), usize::MAX).await.is_err());
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn whoever_writes_hears_that_nobody_reads() {
        let (report, heard) = std::sync::mpsc::channel();
        let body = zip_of(move |zip| {
            let ended = (0..10_000).try_for_each(|_| zip.add("a", &[0; 1 << 16]));
            report.send(ended.is_err()).unwrap();
            ended
        });
        drop(body);
        assert!(heard.recv_timeout(std::time::Duration::from_secs(20)).unwrap());
    }
}
