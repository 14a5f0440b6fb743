//! The progress of a file that does not fit the time of one invocation, stored for the next one.
//!
//! A checkpoint is resumed only if it makes the same bytes: the same set of frames, to replace the same file, by the
//! same version of the encoder. Any other checkpoint, also a damaged one, costs a build from the start. The lease
//! records that there is a checkpoint, so an assembler that builds in one piece need not look for one. A checkpoint
//! that no lease mentions is garbage, and the bucket's rules delete it.
//!
//! The object is a line with the hash of the rest, a line of JSON, the bytes of the file that are not sent yet,
//! and the encoder's state.

use bytes::{Bytes, BytesMut};
use rayfold_scene::Container;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::animator::Animator;
use crate::invocation::{Invocation, Mutation};
use crate::keys::Generation;
use crate::lease::HeldLease;
use crate::manifest::Head;
use crate::store::{ETag, PutOptions, Store, UnfinishedUpload, Upload};
use crate::{Clock, Error, Result};

/// The version of the format. Raise it when the object is written differently.
const SCHEMA: u32 = 1;

/// The number of bytes of the first line.
const HASH: usize = 64;

/// A file between two frames.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Checkpoint {
    pub(crate) head: CheckpointHead,
    pub(crate) upload: UnfinishedUpload,
    pub(crate) encoding: Bytes,
}

/// The identity of the file that a checkpoint belongs to.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct CheckpointHead {
    /// The set of frames.
    pub(crate) generation: Generation,
    /// The kind of file.
    #[serde(default = "gif")]
    pub(crate) output: Container,
    /// The file that it is to replace.
    pub(crate) replaces: Option<ETag>,
    /// The number of frames that the encoder has taken.
    pub(crate) frames: u64,
    /// The number of invocations so far.
    pub(crate) pieces: u32,
}

fn gif() -> Container {
    Container::Gif
}

#[derive(Serialize, Deserialize)]
struct Line {
    schema: u32,
    #[serde(flatten)]
    head: CheckpointHead,
    upload: UnfinishedUpload,
    /// The number of bytes of the upload's start, and of its tail.
    #[serde(default)]
    start: usize,
    tail: usize,
}

impl Checkpoint {
    fn encode(self, key: &str) -> Result<Bytes> {
        let Checkpoint { head, upload, encoding } = self;
        let (start, tail) = (upload.start.clone(), upload.tail.clone());
        let line = Line { schema: SCHEMA, head, upload, start: start.len(), tail: tail.len() };
        let line = serde_json::to_vec(&line)
            .map_err(|source| Error::Malformed { key: key.to_owned(), source: source.into() })?;
        let rest: [&[u8]; 5] = [&line, b"\n", &start, &tail, &encoding];
        let length: usize = rest.iter().map(|part| part.len()).sum();
        let mut body = BytesMut::with_capacity(HASH + 1 + length);
        body.extend_from_slice(hash(&rest).as_bytes());
        body.extend_from_slice(b"\n");
        rest.iter().for_each(|part| body.extend_from_slice(part));
        Ok(body.freeze())
    }

    /// Returns `None` for a checkpoint that is damaged, or of another schema.
    fn decode(mut body: Bytes) -> Option<Self> {
        if body.len() <= HASH {
            return None;
        }
        let expected = body.split_to(HASH);
        let rest = body.strip_prefix(b"\n")?;
        if hash(&[rest]).as_bytes() != expected {
            return None;
        }
        let mut rest = body.slice(1..);
        let end = rest.iter().position(|byte| *byte == b'\n')?;
        let line = rest.split_to(end);
        let Line { schema, head, upload, start, tail } = serde_json::from_slice(&line).ok()?;
        let mut encoding = rest.slice(1..);
        if schema != SCHEMA || start.checked_add(tail)? > encoding.len() {
            return None;
        }
        let (start, tail) = (encoding.split_to(start), encoding.split_to(tail));
        Some(Checkpoint { head, upload: UnfinishedUpload { start, tail, ..upload }, encoding })
    }
}

fn hash(parts: &[&[u8]]) -> String {
    let mut hasher = Sha256::new();
    parts.iter().for_each(|part| hasher.update(part));
    hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A file that is gone on with.
pub(crate) struct ResumedUpload<E, U> {
    pub(crate) encoding: E,
    pub(crate) upload: U,
    /// The number of frames that the encoder has taken.
    pub(crate) frames: u64,
    /// The number of invocations so far.
    pub(crate) pieces: u32,
}

impl<S: Store, C: Clock> Invocation<'_, S, C> {
    /// Continues the file that the lease's last holder left unfinished, if it is of this kind and set, and would
    /// replace this version. Otherwise its upload is aborted, and the checkpoint is deleted.
    pub(crate) async fn take_up<A: Animator>(
        &self,
        animator: &A,
        (head, output): (&Head, Container),
        replaces: Option<&ETag>,
        options: &PutOptions,
        held: &mut HeldLease,
    ) -> Result<Option<ResumedUpload<A::Encoding, S::Upload>>> {
        if !held.has_checkpoint {
            return Ok(None);
        }
        let found = self.get(&head.animation.checkpoint()).await?;
        if let Some(Checkpoint { head: of, upload, encoding }) =
            found.and_then(|found| Checkpoint::decode(found.body))
        {
            let upload = self.store.take_up(&head.animation.output(of.output), options.clone(), upload);
            let fits = of.generation == head.generation
                && of.output == output
                && of.replaces.as_ref() == replaces
                && of.frames <= head.total;
            if (fits || self.breaks(Mutation::TakeUpAnyCheckpoint))
                && let Ok(encoding) = animator.resume(&head.counted_settings(), output, encoding).await
            {
                return Ok(Some(ResumedUpload { encoding, upload, frames: of.frames, pieces: of.pieces }));
            }
            // An upload that cannot be aborted is left to the bucket's rule for unfinished uploads.
            let _ = upload.abort().await;
        }
        self.drop_checkpoint(head, held).await?;
        Ok(None)
    }

    /// Writes down a file between two frames.
    pub(crate) async fn put_checkpoint(&self, head: &Head, checkpoint: Checkpoint) -> Result<()> {
        let key = head.animation.checkpoint();
        let body = checkpoint.encode(&key)?;
        self.put(&key, body).await.map(drop)
    }

    /// Removes the checkpoint, if there is one.
    pub(crate) async fn drop_checkpoint(&self, head: &Head, held: &mut HeldLease) -> Result<()> {
        if std::mem::take(&mut held.has_checkpoint) {
            self.delete(&head.animation.checkpoint()).await?;
        }
        Ok(())
    }

    /// Deletes the checkpoint and aborts its upload, because no assembler will continue it.
    pub(crate) async fn abandon_checkpoint(&self, head: &Head, held: &mut HeldLease) -> Result<()> {
        if !held.has_checkpoint {
            return Ok(());
        }
        let found = self.get(&head.animation.checkpoint()).await?;
        if let Some(checkpoint) = found.and_then(|found| Checkpoint::decode(found.body)) {
            let key = head.animation.output(checkpoint.head.output);
            // As above.
            let _ = self.store.take_up(&key, PutOptions::always(), checkpoint.upload).abort().await;
        }
        self.drop_checkpoint(head, held).await
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checkpoint() -> Checkpoint {
        let generation = Generation::new(&"0a".repeat(16)).unwrap();
        let (output, replaces) = (Container::Webp, Some(ETag::new("\"e\"")));
        let head = CheckpointHead { generation, output, replaces, frames: 7, pieces: 2 };
        let (parts, tail) = (vec![ETag::new("p1"), ETag::new("p2")], Bytes::from_static(b"tail\n{}"));
        let start = Bytes::from_static(b"{start");
        let upload = UnfinishedUpload { id: Some("id".to_owned()), parts, start, tail };
        Checkpoint { head, upload, encoding: Bytes::from_static(b"\nstate") }
    }

    #[test]
    fn a_checkpoint_reads_back() {
        let first = Checkpoint {
            head: CheckpointHead { replaces: None, ..checkpoint().head },
            upload: UnfinishedUpload::default(),
            encoding: Bytes::new(),
        };
        for checkpoint in [checkpoint(), first] {
            let body = checkpoint.clone().encode("key").unwrap();
            assert_eq!(Checkpoint::decode(body), Some(checkpoint));
        }
    }

    /// Any missing or changed byte is detected.
    #[test]
    fn a_damaged_checkpoint_is_none() {
        let whole = checkpoint().encode("key").unwrap();
        for end in 0..whole.len() {
            assert_eq!(Checkpoint::decode(whole.slice(..end)), None, "cut off after {end}");
        }
        for at in 0..whole.len() {
            let mut damaged = whole.to_vec();
            damaged[at] ^= 1;
            assert_eq!(Checkpoint::decode(damaged.into()), None, "byte {at}");
        }
    }

    #[test]
    fn a_checkpoint_of_another_schema_is_none() {
        let whole = checkpoint().encode("key").unwrap();
        let text = String::from_utf8_lossy(&whole[HASH + 1..]).replace("\"schema\":1", "\"schema\":2");
        let body = format!("{}\n{text}", hash(&[text.as_bytes()]));
        assert_eq!(Checkpoint::decode(body.into()), None);
    }
}
