//! The state of an unfinished file: a line of JSON, the pixels of the pictures that are still needed, and the encoded
//! picture that waits for its duration.

use image::{DynamicImage, RgbImage, RgbaImage};
use serde::{Deserialize, Serialize};

use crate::Error;

/// The version of the format. Raise it when the state, or the bytes of a file after it, are written differently.
const VERSION: u32 = 1;

/// The state of an encoder between two frames.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct State {
    pub(crate) counts: Counts,
    /// The frame that was written last.
    pub(crate) last: Option<DynamicImage>,
    /// Frames that are held back by [`rayfold_gif::Thinning`].
    pub(crate) held: Vec<DynamicImage>,
    /// An encoded picture that is not written yet.
    pub(crate) picture: Vec<u8>,
}

/// The numbers of a state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Counts {
    /// The number of frames that were pushed.
    pub(crate) pushed: u64,
    /// The number of frames in the file.
    pub(crate) written: u64,
    /// The number of bytes of the file, or of its numbered chunks, as the container counts.
    pub(crate) counted: u64,
    /// Column, row, width, height and milliseconds of the picture that is not yet written.
    pub(crate) chunk: Option<[u32; 5]>,
}

#[derive(Serialize, Deserialize)]
struct Head {
    version: u32,
    counts: Counts,
    size: (u32, u32),
    /// The channels of the last frame, and of the frames that are held back.
    last: Option<u8>,
    held: Vec<u8>,
    /// The number of bytes of the picture that is not yet written.
    picture: usize,
}

impl State {
    pub(crate) fn encode(&self) -> Vec<u8> {
        let pictures = || self.last.iter().chain(&self.held);
        let channels = |picture: &DynamicImage| picture.color().channel_count();
        let size = pictures().next().map_or((0, 0), |picture| (picture.width(), picture.height()));
        let (last, held) = (self.last.as_ref().map(channels), self.held.iter().map(channels).collect());
        let picture = self.picture.len();
        let head = Head { version: VERSION, counts: self.counts, size, last, held, picture };
        let mut bytes = serde_json::to_vec(&head).unwrap_or_default();
        bytes.push(b'\n');
        pictures().for_each(|picture| bytes.extend_from_slice(picture.as_bytes()));
        bytes.extend_from_slice(&self.picture);
        bytes
    }

    /// Decodes the state of a file whose frames have this size.
    pub(crate) fn decode(bytes: &[u8], size: (u32, u32)) -> Result<Self, Error> {
        let end = bytes.iter().position(|byte| *byte == b'\n');
        let (line, mut rest) = end.map(|end| (&bytes[..end], &bytes[end + 1..])).ok_or(DAMAGED)?;
        let Head { version, counts, size: found, last, held, picture: unwritten } =
            serde_json::from_slice(line).map_err(|_| DAMAGED)?;
        let has_pictures = last.is_some() || !held.is_empty();
        if version != VERSION {
            return Err(Error::State("it was written by another version of the encoder"));
        }
        if held.len() > 2 || has_pictures && found != size {
            return Err(DAMAGED);
        }
        let mut picture = |channels: u8| {
            let mut factors = [size.1 as usize, channels.into()].into_iter();
            let levels = factors.try_fold(size.0 as usize, usize::checked_mul).ok_or(DAMAGED)?;
            let (levels, left) = rest.split_at_checked(levels).ok_or(DAMAGED)?;
            rest = left;
            let (levels, (width, height)) = (levels.to_vec(), size);
            let picture = match channels {
                3 => RgbImage::from_raw(width, height, levels).map(DynamicImage::from),
                4 => RgbaImage::from_raw(width, height, levels).map(DynamicImage::from),
                _ => None,
            };
            picture.ok_or(DAMAGED)
        };
        let last = last.map(&mut picture).transpose()?;
        let held = held.into_iter().map(&mut picture).collect::<Result<_, _>>()?;
        if rest.len() != unwritten {
            return Err(DAMAGED);
        }
        Ok(Self { counts, last, held, picture: rest.to_vec() })
    }
}

/// The error for a state that no encoder has written.
pub(crate) const DAMAGED: Error = Error::State("it is damaged");
