//! Downloads of an animation: its files, piece by piece, and its frames.

use std::io;

use bytes::Bytes;
use futures_util::stream::{self, StreamExt, TryStreamExt};
use rayfold_pipeline::Clock;
use rayfold_pipeline::assemble::frame_key;
use rayfold_pipeline::found;
use rayfold_pipeline::keys::Animation;
use rayfold_pipeline::manifest::{Frame, Manifest};
use rayfold_pipeline::store::{ObjectInfo, Store};
use rayfold_scene::Container;

use crate::client::{Client, SIDE_BY_SIDE};
use crate::error::{Error, Result};

/// The size of the range of a file that one request asks for, in bytes.
const PIECE: u64 = 8 << 20;

/// The number of pieces that are requested at the same time.
const PIECES: usize = 4;

/// The number of times that a file is read if it is replaced during each read.
const ATTEMPTS: u32 = 5;

/// The destination of a download.
pub trait Output {
    /// Begins the file, which will have `size` bytes. Discards everything written before.
    ///
    /// # Errors
    /// Returns the error of the system.
    fn begin(&mut self, size: u64) -> io::Result<()>;

    /// Writes the next bytes.
    ///
    /// # Errors
    /// Returns the error of the system.
    fn write(&mut self, piece: &[u8]) -> io::Result<()>;
}

/// A frame that was downloaded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FetchedFrame<'a> {
    /// The number of the frame in the animation, from 1.
    pub number: u64,
    /// The key of the frame.
    pub key: &'a str,
    /// The content of the PNG file.
    pub png: Bytes,
}

/// The key of a frame that is drawn.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FrameKey {
    /// The number of the frame in the animation, from 1.
    pub number: u64,
    /// The key of the frame.
    pub key: String,
}

/// The frames of an animation, in their order.
#[derive(Debug, Clone, PartialEq)]
pub struct Frames<'a> {
    /// The frames that are drawn.
    pub drawn: Vec<FrameKey>,
    /// The frames that failed or are pending.
    pub missing: Vec<&'a Frame>,
}

/// Divides the frames of a manifest into drawn and missing ones.
pub fn frames(manifest: &Manifest) -> Frames<'_> {
    let mut frames = Frames { drawn: Vec::new(), missing: Vec::new() };
    for (frame, number) in manifest.frames.iter().zip(1..) {
        match frame_key(&manifest.head.animation, frame) {
            Some(key) => frames.drawn.push(FrameKey { number, key }),
            None => frames.missing.push(frame),
        }
    }
    frames
}

impl<S: Store, C: Clock> Client<'_, S, C> {
    /// Downloads the current file of a kind.
    ///
    /// # Errors
    /// An error of the store or of the output, or [`Error::Restless`] if the file is
    /// replaced during each attempt.
    pub async fn fetch(
        &self,
        animation: &Animation,
        container: Container,
        output: &mut impl Output,
    ) -> Result<ObjectInfo> {
        let key = animation.output(container);
        for _ in 0..ATTEMPTS {
            let info = self.store.head(&key).await?;
            output.begin(info.size).map_err(Error::Output)?;
            if self.copy(&key, &info, output).await? {
                return Ok(info);
            }
        }
        Err(Error::Restless { key })
    }

    /// Copies the object to the output. Returns `false` if the object is replaced meanwhile.
    async fn copy(&self, key: &str, info: &ObjectInfo, output: &mut impl Output) -> Result<bool> {
        let pieces = (0..info.size.div_ceil(PIECE)).map(|n| n * PIECE..((n + 1) * PIECE).min(info.size));
        let pieces: Vec<_> = pieces.map(|range| self.store.get_range(key, range)).collect();
        let mut pieces = stream::iter(pieces).buffered(PIECES);
        while let Some(piece) = pieces.next().await {
            match found(piece)? {
                Some(piece) if piece.info.etag == info.etag => {
                    output.write(&piece.body).map_err(Error::Output)?;
                }
                _ => return Ok(false),
            }
        }
        Ok(true)
    }

    /// Downloads frames, several at once, and passes each to `take` on arrival.
    ///
    /// # Errors
    /// The errors of the store and of `take`, and [`Error::FrameGone`].
    pub async fn fetch_frames(
        &self,
        frames: &[FrameKey],
        mut take: impl FnMut(FetchedFrame<'_>) -> io::Result<()>,
    ) -> Result<()> {
        let reads = frames.iter().map(|FrameKey { number, key }| async move {
            let object = found(self.store.get(key).await)?;
            let png = object.ok_or_else(|| Error::FrameGone { key: key.clone() })?.body;
            Ok::<_, Error>(FetchedFrame { number: *number, key, png })
        });
        let reads: Vec<_> = reads.collect();
        let mut reads = stream::iter(reads).buffer_unordered(SIDE_BY_SIDE);
        while let Some(frame) = reads.try_next().await? {
            take(frame).map_err(Error::Output)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::World;
    use rayfold_pipeline::store::PutOptions;

    #[derive(Default)]
    struct Memory {
        begun: u32,
        bytes: Vec<u8>,
        size: u64,
    }

    impl Output for Memory {
        fn begin(&mut self, size: u64) -> io::Result<()> {
            *self = Memory { begun: self.begun + 1, bytes: Vec::new(), size };
            Ok(())
        }

        fn write(&mut self, piece: &[u8]) -> io::Result<()> {
            self.bytes.extend_from_slice(piece);
            Ok(())
        }
    }

    fn gif(size: usize, salt: u8) -> Vec<u8> {
        (0..size).map(|n| (n % 251) as u8 ^ salt).collect()
    }

    #[tokio::test]
    async fn a_gif_of_several_pieces_comes_whole() {
        let world = World::new();
        for size in [0, 1, PIECE as usize, 2 * PIECE as usize + 5] {
            let body = gif(size, 1);
            world.store.put("animations/film.gif", body.clone().into(), PutOptions::always()).await.unwrap();
            let mut out = Memory::default();
            let info = world.client().fetch(&world.film(), Container::Gif, &mut out).await.unwrap();
            assert_eq!((info.size, out.size, out.begun), (size as u64, size as u64, 1));
            assert!(out.bytes == body, "{size} bytes");
        }
    }

    #[tokio::test]
    async fn a_gif_that_is_replaced_on_the_way_is_begun_anew() {
        let world = World::new();
        let size = PIECES * PIECE as usize + 1;
        world.store.put("animations/film.gif", gif(size, 1).into(), PutOptions::always()).await.unwrap();
        // Replaced once, before the last piece is read.
        world.replace_before("get animations/film.gif", PIECES as u32, gif(9, 2), 1);
        let mut out = Memory::default();
        world.client().fetch(&world.film(), Container::Gif, &mut out).await.unwrap();
        assert_eq!((out.begun, out.bytes), (2, [gif(9, 2), vec![0]].concat()));
        // Replaced at every attempt.
        world.replace_before("get animations/film.gif", 0, gif(9, 3), u8::MAX);
        let error =
            world.client().fetch(&world.film(), Container::Gif, &mut Memory::default()).await.unwrap_err();
        assert!(matches!(error, Error::Restless { key } if key == "animations/film.gif"));
    }

    #[tokio::test]
    async fn frames_come_with_their_numbers_and_those_not_drawn_are_named() {
        let world = World::new();
        for name in ["2", "10", "1"] {
            world.put(&format!("scripts/film/{name}.txt"), &format!("frame {name}")).await;
        }
        world.functions().await;
        let watch = world.client().look(&[world.film()]).await.unwrap().remove(0);
        let keys = frames(watch.manifest().unwrap()).drawn;
        let mut fetched = Vec::new();
        let take = |frame: FetchedFrame<'_>| {
            fetched.push((frame.number, String::from_utf8(frame.png.to_vec()).unwrap()));
            Ok(())
        };
        world.client().fetch_frames(&keys, take).await.unwrap();
        fetched.sort();
        let expected = [(1, "1: frame 1"), (2, "2: frame 2"), (3, "10: frame 10")];
        assert_eq!(fetched, expected.map(|(number, text)| (number, text.to_owned())));

        world.store.delete(&keys[1].key).await.unwrap();
        let error = world.client().fetch_frames(&keys, |_| Ok(())).await.unwrap_err();
        assert!(matches!(error, Error::FrameGone { key } if key == keys[1].key));

        world.put("scripts/film/2.txt", "bad").await;
        world.functions().await;
        let watch = world.client().look(&[world.film()]).await.unwrap().remove(0);
        let Frames { drawn, missing } = frames(watch.manifest().unwrap());
        assert_eq!((missing.len(), missing[0].script.as_str()), (1, "2"));
        assert_eq!(
            drawn.iter().map(|frame| frame.number).collect::<Vec<_>>(),
            [1, 3],
            "they keep their places"
        );
    }
}
