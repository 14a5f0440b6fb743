//! The state of an animation between two frames as bytes, so that another process can continue it.
//!
//! This module defines how numbers and pixels are written; each part of the encoder defines its own content. A state
//! starts with a mark and the hash of the encoder's sources. A state of another version is refused, because its bytes
//! might differ. The rest is compressed by gzip, whose checksum detects damage.

use std::io::{self, Read, Write};

use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;

use crate::error::Error;

const MARK: [u8; 8] = *b"rayfgif\n";

/// The hash of the encoder's sources, computed by `build.rs`.
const SOURCES: &str = env!("RAYFOLD_GIF_SOURCES");

/// Most pixels are seen exactly or nearly so: little effort makes them small.
const EFFORT: Compression = Compression::fast();

/// A writer of a state.
pub(crate) struct StateWriter(GzEncoder<Vec<u8>>);

impl StateWriter {
    pub(crate) fn new() -> Self {
        let mut bytes = MARK.to_vec();
        bytes.extend_from_slice(&version().to_le_bytes());
        Self(GzEncoder::new(bytes, EFFORT))
    }

    pub(crate) fn bytes(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.write_all(bytes)
    }

    pub(crate) fn u16(&mut self, number: u16) -> io::Result<()> {
        self.bytes(&number.to_le_bytes())
    }

    pub(crate) fn u64(&mut self, number: u64) -> io::Result<()> {
        self.bytes(&number.to_le_bytes())
    }

    pub(crate) fn f32(&mut self, number: f32) -> io::Result<()> {
        self.bytes(&number.to_le_bytes())
    }

    pub(crate) fn f64(&mut self, number: f64) -> io::Result<()> {
        self.bytes(&number.to_le_bytes())
    }

    pub(crate) fn finish(self) -> io::Result<Vec<u8>> {
        self.0.finish()
    }
}

/// A reader of a state. Reports unreadable bytes as [`Error::State`].
pub(crate) struct StateReader<'a>(GzDecoder<&'a [u8]>);

impl<'a> StateReader<'a> {
    pub(crate) fn new(state: &'a [u8]) -> Result<Self, Error> {
        let Some(rest) = state.strip_prefix(&MARK) else {
            return Err(damaged("it is not a state of this encoder"));
        };
        let Some((found, rest)) = rest.split_first_chunk() else { return Err(damaged("it is cut off")) };
        if *found != version().to_le_bytes() {
            return Err(Error::StateVersion);
        }
        Ok(Self(GzDecoder::new(rest)))
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Error> {
        let mut array = [0; N];
        self.0.read_exact(&mut array).map_err(unreadable)?;
        Ok(array)
    }

    /// Reads `count` bytes. Memory grows with the bytes that exist, not with `count`.
    pub(crate) fn bytes(&mut self, count: usize) -> Result<Vec<u8>, Error> {
        let mut bytes = Vec::new();
        self.0.by_ref().take(count as u64).read_to_end(&mut bytes).map_err(unreadable)?;
        if bytes.len() == count { Ok(bytes) } else { Err(damaged("it is cut off")) }
    }

    pub(crate) fn u8(&mut self) -> Result<u8, Error> {
        self.array().map(|[byte]| byte)
    }

    pub(crate) fn u16(&mut self) -> Result<u16, Error> {
        self.array().map(u16::from_le_bytes)
    }

    pub(crate) fn u64(&mut self) -> Result<u64, Error> {
        self.array().map(u64::from_le_bytes)
    }

    pub(crate) fn f32(&mut self) -> Result<f32, Error> {
        self.array().map(f32::from_le_bytes)
    }

    pub(crate) fn f64(&mut self) -> Result<f64, Error> {
        self.array().map(f64::from_le_bytes)
    }

    /// Checks that nothing follows, which also checks the checksum.
    pub(crate) fn finish(mut self) -> Result<(), Error> {
        match self.0.read(&mut [0]).map_err(unreadable)? {
            0 => Ok(()),
            _ => Err(damaged("something follows its end")),
        }
    }
}

fn version() -> u64 {
    // A number, as `build.rs` printed it.
    SOURCES.parse().unwrap_or_default()
}

fn unreadable(source: io::Error) -> Error {
    Error::State { source }
}

pub(crate) fn damaged(problem: &'static str) -> Error {
    unreadable(io::Error::new(io::ErrorKind::InvalidData, problem))
}
