//! A body on its way out: the bytes of a range, block by block, out of rows and files.
//!
//! The next block is read while the one before is sent; memory does not grow with the body.

use std::collections::VecDeque;
use std::fs::File;
use std::io;
use std::ops::Range;
use std::os::unix::fs::FileExt;
use std::path::PathBuf;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use bytes::Bytes;
use futures_util::Stream;
use s3s::StdError;
use s3s::stream::{ByteStream, RemainingLength};
use tokio::task::JoinHandle;

use super::Service;
use crate::answer::{Answer, unreadable};
use crate::records::{Body, Layout, LayoutPart, Object, find};
use crate::storage::{BodyId, Pins, Snapshot, Storage, Table, View};

/// What is read at a time.
const BLOCK_BYTES: u64 = 256 * 1024;

/// An object whose bytes stay while they are read.
pub(super) struct Held {
    pub(super) object: Object,
    pub(super) layout: Option<Layout>,
    snapshot: Snapshot,
    pins: Option<Pins>,
}

impl Service {
    /// The object as it is now, with its bytes held.
    pub(super) fn held(&self, bucket: &str, key: &str) -> Answer<Held> {
        let mut pins: Option<Pins> = None;
        let mut pinned = None;
        loop {
            let snapshot = self.snapshot()?;
            let object = self.object(&snapshot, bucket, key)?;
            let layout = layout(&snapshot, &object)?;
            // The first look says what to pin, the second one that it was still there then.
            let files = files(&object, layout.as_ref());
            if files.is_empty() || pinned == Some(object.body) {
                return Ok(Held { object, layout, snapshot, pins });
            }
            pinned = Some(object.body);
            pins = Some(self.storage.bodies().pin(files));
        }
    }

    /// The object's parts, if it was uploaded in parts.
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
    /// The bytes of a range, which must lie within the object.
    pub(super) fn bytes(self, storage: &Storage, range: Range<u64>) -> Answer<Outgest> {
        let whole =
            [LayoutPart { number: 1, size: self.object.size, body: self.object.body, checksum: None }];
        let parts = self.layout.as_ref().map_or(&whole[..], |layout| &layout.parts);
        let mut pieces = VecDeque::new();
        let mut start = 0;
        for part in parts {
            let within = range.start.max(start)..range.end.min(start + part.size);
            if within.start < within.end {
                let within = within.start - start..within.end - start;
                pieces.push_back(match part.body {
                    Body::Row(id) => {
                        let row = self.snapshot.get(Table::Bodies, &id.key()).map_err(unreadable)?;
                        let bytes = row.map(Bytes::from).unwrap_or_default();
                        Piece::Bytes(slice(&bytes, &within))
                    }
                    Body::File(id) => Piece::Closed(storage.bodies().path(id), within),
                    Body::Parts(_) => Piece::Bytes(Bytes::new()),
                });
            }
            start += part.size;
        }
        Ok(Outgest { pieces, reading: None, left: range.end - range.start, _pins: self.pins })
    }
}

/// See the module.
pub(super) struct Outgest {
    pieces: VecDeque<Piece>,
    reading: Option<JoinHandle<io::Result<Block>>>,
    left: u64,
    _pins: Option<Pins>,
}

/// Bytes, and what comes after them.
type Block = (Bytes, Option<Piece>);

enum Piece {
    Bytes(Bytes),
    Closed(PathBuf, Range<u64>),
    Open(Arc<File>, Range<u64>),
}

impl Piece {
    /// The first block, and what comes after it.
    fn read(self) -> io::Result<Block> {
        let (file, range) = match self {
            Self::Bytes(bytes) => return Ok((bytes, None)),
            Self::Closed(path, range) => (Arc::new(File::open(path)?), range),
            Self::Open(file, range) => (file, range),
        };
        let end = range.end.min(range.start + BLOCK_BYTES);
        let mut block = vec![0; usize::try_from(end - range.start).unwrap_or_default()];
        file.read_exact_at(&mut block, range.start)?;
        Ok((block.into(), (end < range.end).then(|| Self::Open(file, end..range.end))))
    }
}

impl Outgest {
    /// Starts to read the next block.
    fn advance(&mut self) {
        self.reading = self.pieces.pop_front().map(|piece| tokio::task::spawn_blocking(|| piece.read()));
    }
}

impl Stream for Outgest {
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
            let missing = this.left > 0;
            this.left = 0;
            return Poll::Ready(missing.then(|| Err("the body is shorter than it should be".into())));
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
            Ok(Err(failed)) => Err(failed.into()),
            Err(failed) => Err(failed.into()),
        }))
    }
}

impl ByteStream for Outgest {
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

    /// A client must see that bytes are missing, not take the beginning for the whole.
    #[tokio::test]
    async fn a_body_that_lost_bytes_ends_with_an_error() {
        for (left, whole) in [(5, false), (2, true)] {
            let pieces = VecDeque::from([Piece::Bytes(Bytes::from_static(b"ab"))]);
            let body = Outgest { pieces, reading: None, left, _pins: None };
            let ends: Vec<bool> = body.map(|piece| piece.is_ok()).collect().await;
            assert_eq!(ends, if whole { vec![true] } else { vec![true, false] });
        }
    }
}
