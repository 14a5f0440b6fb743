//! The file formats of animations.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// The file format of an animation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Container {
    /// At most 256 colours a frame. Pixels are drawn or clear.
    Gif,
    /// Lossless; the number of frames must be known before the first.
    Apng,
    /// Lossless.
    Webp,
    /// Raw frames for video encoders.
    Y4m,
}

impl Container {
    /// All containers.
    pub const ALL: [Self; 4] = [Self::Gif, Self::Apng, Self::Webp, Self::Y4m];

    /// Returns the ending of its files, without a dot. [`FromStr`] is the inverse.
    #[must_use]
    pub fn ending(self) -> &'static str {
        match self {
            Self::Gif => "gif",
            Self::Apng => "apng",
            Self::Webp => "webp",
            Self::Y4m => "y4m",
        }
    }

    /// Returns the name of the format, as people write it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Gif => "GIF",
            Self::Apng => "APNG",
            Self::Webp => "WebP",
            Self::Y4m => "Y4M",
        }
    }

    /// Returns the media type of its files.
    #[must_use]
    pub fn media_type(self) -> &'static str {
        match self {
            Self::Gif => "image/gif",
            Self::Apng => "image/apng",
            Self::Webp => "image/webp",
            Self::Y4m => "video/x-yuv4mpeg2",
        }
    }
}

/// The error for a word that names no container.
#[derive(Debug, thiserror::Error)]
#[error("no container of animations: expected gif, apng, webp or y4m")]
pub struct UnknownContainer;

impl FromStr for Container {
    type Err = UnknownContainer;

    fn from_str(word: &str) -> Result<Self, UnknownContainer> {
        Self::ALL.into_iter().find(|container| container.ending() == word).ok_or(UnknownContainer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_container_is_named_by_its_ending() {
        for container in Container::ALL {
            assert_eq!(container.ending().parse::<Container>().unwrap(), container);
            assert_eq!(serde_json::to_string(&container).unwrap(), format!("\"{}\"", container.ending()));
        }
        assert!("mp4".parse::<Container>().is_err());
    }
}
