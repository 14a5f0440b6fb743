//! Sending a body: the bytes of a range, block by block, from rows and files.
//!
//! The next block is read while the one before is sent, so memory does not grow with the body. A body, or a part of
//! one, that is sent whole is compared with its checksum, and its last block is sent only if they match. For a range
//! of a file, only the length of the file is compared. (Rows have checksums of the storage.)

use std::collections::VecDeque;
use std::fmt::Display;
use std::fs::File;
use std::ops::Range;
use std::os::unix::fs::FileExt;
use std::path::PathBuf;
use std::pin::Pin;
use std::task::{Context, Poll};

use bytes::Bytes;
use futures_util::Stream;
use s3s::StdError;
use s3s::stream::{ByteStream, RemainingLength};
use tokio::task::JoinHandle;

use super::Service;
use crate::answer::{Answer, BodyDamaged, unreadable};
use crate::checksum::Comparison;
use crate::error::report;
use crate::records::{Body, Layout, LayoutPart, Object, find};
use crate::storage::{BodyId, Pins, Snapshot, Storage, Table, View};

/// The number of bytes that are read at a time.
const BLOCK_BYTES: u64 = 256 * 1024;

/// An object whose bytes stay available while they are read.
pub(super) struct Held {
    /// The bucket and the key.
    name: String,
    pub(super) object: Object,
    pub(super) layout: Option<Layout>,
    snapshot: Snapshot,
    pins: Option<Pins>,
}

impl Service {
    /// Returns the current object, with its bytes held.
    pub(super) fn held(&self, bucket: &str, key: &str) -> Answer<Held> {
        let mut pins: Option<Pins> = None;
        let mut pinned = None;
        loop {
            let snapshot = self.snapshot()?;
            let object = self.object(&snapshot, bucket, key)?;
            let layout = layout(&snapshot, &object)?;
            // The first read says which files to pin. The second proves that they still existed
            // when they were pinned.
            let files = files(&object, layout.as_ref());
            if files.is_empty() || pinned == Some(object.body) {
                let name = format!("{bucket}/{key}");
                return Ok(Held { name, object, layout, snapshot, pins });
            }
            pinned = Some(object.body);
            pins = Some(self.storage.bodies().pin(files));
        }
    }

    /// Returns the object's parts, if it was uploaded in parts.
    pub(super) fn layout(&self, snapshot: &Snapshot, object: &Object) -> Answer<Option<Layout>> {
        layout(snapshot, object)
    }
}

fn layout(snapshot: &Snapshot, object: &Object) -> Answer<Option<Layout>> {
    match object.body {
        Body::Row(_) | Body::File(_) => Ok(None),
        Body::Parts(id) => find(snapshot, Table::Layouts, &id.key()).map_err(unreadable),
    }
}

fn files(object: &Object, layout: Option<&Layout>) -> Vec<BodyId> {
    let parts = layout.into_iter().flat_map(|layout| layout.parts.iter().map(|part| part.body));
    std::iter::once(object.body)
        .chain(parts)
        .filter_map(|body| match body {
            Body::File(id) => Some(id),
            Body::Row(_) | Body::Parts(_) => None,
        })
        .collect()
}

impl Held {
    /// Returns the bytes of a range, which must lie within the object.
    pub(super) fn bytes(self, storage: &Storage, range: Range<u64>) -> Answer<BodyStream> {
        let Self { name, object, layout, snapshot, pins } = self;
        let damaged = |what: String| BodyDamaged { object: name.clone(), what }.refuse();
        let whole =
            [LayoutPart { number: 1, size: object.size, body: object.body, checksum: object.checksum }];
        let parts = match (&layout, object.body) {
            (Some(layout), _) => &layout.parts[..],
            (None, Body::Parts(_)) => return Err(damaged("the list of its parts is missing".to_owned())),
            (None, Body::Row(_) | Body::File(_)) => &whole[..],
        };
        let mut pieces = VecDeque::new();
        let mut start = 0;
        for part in parts {
            let within = range.start.max(start)..range.end.min(start + part.size);
            if within.start < within.end {
                let within = within.start - start..within.end - start;
                let is_whole = within.end - within.start == part.size;
                let mut comparison = part.checksum.as_ref().filter(|_| is_whole).and_then(Comparison::with);
                match part.body {
                    Body::Row(id) => {
                        let row = snapshot.get(Table::Bodies, &id.key()).map_err(unreadable)?;
                        let bytes = row.map(Bytes::from).unwrap_or_default();
                        if let Some(comparison) = &mut comparison {
                            comparison.update(&bytes);
                        }
                        if bytes.len() as u64 != part.size || !comparison.is_none_or(Comparison::matches) {
                            let what =
                                format!("its row has {} bytes that do not match its checksum", bytes.len());
                            return Err(damaged(what));
                        }
                        pieces.push_back(Piece::Bytes(slice(&bytes, &within)));
                    }
                    Body::File(id) => {
                        let path = storage.bodies().path(id);
                        let file = FilePiece { path, file: None, size: part.size, rest: within, comparison };
                        pieces.push_back(Piece::File(Box::new(file)));
                    }
                    Body::Parts(_) => return Err(damaged("a part of it is made of parts".to_owned())),
                }
            }
            start += part.size;
        }
        // So a missing file is reported in the response rather than by a broken connection.
        if let Some(Piece::File(file)) = pieces.front_mut() {
            file.open().map_err(damaged)?;
        }
        Ok(BodyStream { name, pieces, reading: None, left: range.end - range.start, _pins: pins })
    }
}

/// A stream of a body's bytes, see the module.
pub(super) struct BodyStream {
    /// The bucket and the key.
    name: String,
    pieces: VecDeque<Piece>,
    reading: Option<JoinHandle<Result<Block, String>>>,
    left: u64,
    _pins: Option<Pins>,
}

/// The bytes of a block, and the piece that follows them.
type Block = (Bytes, Option<Piece>);

enum Piece {
    Bytes(Bytes),
    File(Box<FilePiece>),
}

/// The rest of a file that is to be read.
struct FilePiece {
    path: PathBuf,
    file: Option<File>,
    /// The size of the file.
    size: u64,
    rest: Range<u64>,
    /// The comparison with the checksum, if all of the file is sent.
    comparison: Option<Comparison>,
}

impl FilePiece {
    /// Returns the file, after checking its length.
    fn open(&mut self) -> Result<&File, String> {
        let wrong = |what: &dyn Display| format!("{}: {what}", self.path.display());
        let file = match self.file.take() {
            Some(file) => file,
            None => {
                let file = File::open(&self.path).map_err(|error| wrong(&error))?;
                let length = file.metadata().map_err(|error| wrong(&error))?.len();
                if length != self.size {
                    return Err(wrong(&format_args!("it has {length} bytes instead of {}", self.size)));
                }
                file
            }
        };
        Ok(self.file.insert(file))
    }

    /// Returns the first block, and the piece that follows it.
    fn read(mut self: Box<Self>) -> Result<Block, String> {
        let Range { start, end } = self.rest;
        let stop = end.min(start + BLOCK_BYTES);
        let mut block = vec![0; usize::try_from(stop - start).unwrap_or_default()];
        let read = self.open()?.read_exact_at(&mut block, start);
        read.map_err(|error| format!("{}: {error}", self.path.display()))?;
        if let Some(comparison) = &mut self.comparison {
            comparison.update(&block);
        }
        self.rest = stop..end;
        if stop < end {
            return Ok((block.into(), Some(Piece::File(self))));
        }
        if !self.comparison.is_none_or(Comparison::matches) {
            return Err(format!(
                "{}: its {} bytes do not match their checksum",
                self.path.display(),
                self.size
            ));
        }
        Ok((block.into(), None))
    }
}

impl Piece {
    fn read(self) -> Result<Block, String> {
        match self {
            Self::Bytes(bytes) => Ok((bytes, None)),
            Self::File(file) => file.read(),
        }
    }
}

impl BodyStream {
    /// Starts reading the next block.
    fn advance(&mut self) {
        self.reading = self.pieces.pop_front().map(|piece| tokio::task::spawn_blocking(|| piece.read()));
    }

    /// Ends with an error. The connection breaks, so that the client does not take the bytes sent for the whole.
    fn fail(&mut self, what: String) -> StdError {
        (self.left, self.reading) = (0, None);
        self.pieces.clear();
        let damaged = BodyDamaged { object: self.name.clone(), what };
        report(&damaged);
        damaged.into()
    }
}

impl Stream for BodyStream {
    type Item = Result<Bytes, StdError>;

    fn poll_next(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        let this = self.get_mut();
        if this.reading.is_none() {
            if let Some(Piece::Bytes(bytes)) = this.pieces.front_mut() {
                let bytes = std::mem::take(bytes);
                this.pieces.pop_front();
                this.left = this.left.saturating_sub(bytes.len() as u64);
                return Poll::Ready(Some(Ok(bytes)));
            }
            this.advance();
        }
        let Some(reading) = &mut this.reading else {
            let missing = this.left;
            return Poll::Ready(
                (missing > 0).then(|| Err(this.fail(format!("{missing} bytes are missing")))),
            );
        };
        let read = std::task::ready!(Pin::new(reading).poll(context));
        this.reading = None;
        Poll::Ready(Some(match read {
            Ok(Ok((bytes, rest))) => {
                if let Some(rest) = rest {
                    this.pieces.push_front(rest);
                }
                if !matches!(this.pieces.front(), Some(Piece::Bytes(_))) {
                    this.advance();
                }
                this.left = this.left.saturating_sub(bytes.len() as u64);
                Ok(bytes)
            }
            Ok(Err(what)) => Err(this.fail(what)),
            Err(failed) => Err(this.fail(failed.to_string())),
        }))
    }
}

impl ByteStream for BodyStream {
    fn remaining_length(&self) -> RemainingLength {
        usize::try_from(self.left).map_or_else(|_| RemainingLength::unknown(), RemainingLength::new_exact)
    }
}

fn slice(bytes: &Bytes, within: &Range<u64>) -> Bytes {
    let at = |offset: u64| usize::try_from(offset).unwrap_or(usize::MAX).min(bytes.len());
    bytes.slice(at(within.start)..at(within.end))
}

#[cfg(test)]
mod tests {
    use futures_util::StreamExt;

    use super::*;

    /// A client must notice that bytes are missing, and not take the beginning for the whole.
    #[tokio::test]
    async fn a_body_that_lost_bytes_ends_with_an_error() {
        for (left, whole) in [(5, false), (2, true)] {
            let pieces = VecDeque::from([Piece::Bytes(Bytes::from_static(b"ab"))]);
            let body = BodyStream { name: "films/a".into(), pieces, reading: None, left, _pins: None };
            let ends: Vec<bool> = body.map(|piece| piece.is_ok()).collect().await;
            assert_eq!(ends, if whole { vec![true] } else { vec![true, false] });
        }
    }
}
