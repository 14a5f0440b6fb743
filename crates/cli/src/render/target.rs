//! Where the picture goes: what OUT means by its ending.

use std::path::{Path, PathBuf};

use anyhow::Context;
use image::{ExtendedColorType, ImageEncoder, RgbImage};

use crate::outcome::Usage;

/// What OUT asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    /// All frames as one animation.
    Gif(PathBuf),
    /// One frame.
    Image(PathBuf, Format),
    /// Each frame as a file.
    Images(Pattern, Format),
}

/// How a single image is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    Png,
    Tiff,
}

/// A path with a frame's number in its file name, such as `frames/%04d.png`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Pattern {
    folder: PathBuf,
    before: String,
    digits: usize,
    after: String,
}

impl Target {
    /// # Errors
    /// When the ending is none of ours or the pattern is not one.
    pub(crate) fn parse(out: &Path) -> Result<Self, Usage> {
        let shown = out.display();
        let ending = out.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        let format = match ending.as_deref() {
            Some("gif") => None,
            Some("png") => Some(Format::Png),
            Some("tif" | "tiff") => Some(Format::Tiff),
            _ => {
                return Err(Usage(format!(
                    "cannot tell from its ending what {shown} should be: expected .gif for an animation, .png, .tif or \
                     .tiff for one frame, or a pattern such as frames/%04d.png for many"
                )));
            }
        };
        match (format, Pattern::parse(out)?) {
            (None, None) => Ok(Self::Gif(out.to_path_buf())),
            (None, Some(_)) => Err(Usage(format!(
                "{shown} names a file a frame, but a GIF holds all frames: leave the % part out"
            ))),
            (Some(format), None) => Ok(Self::Image(out.to_path_buf(), format)),
            (Some(format), Some(pattern)) => Ok(Self::Images(pattern, format)),
        }
    }
}

impl Pattern {
    /// `None` when `path` has no place for a number.
    fn parse(path: &Path) -> Result<Option<Self>, Usage> {
        let Some(name) = path.file_name().and_then(|name| name.to_str()) else { return Ok(None) };
        let Some((before, digits, after)) = split(name) else { return Ok(None) };
        if split(after).is_some() {
            return Err(Usage(format!("{}: expected one number such as %04d, found two", path.display())));
        }
        let digits = if digits.is_empty() { Some(0) } else { digits.parse().ok().filter(|n| *n <= 20) };
        let Some(digits) = digits else {
            return Err(Usage(format!("{}: a frame's number has at most 20 digits", path.display())));
        };
        let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
        Ok(Some(Self { folder, before: before.into(), digits, after: after.into() }))
    }

    /// The file of frame `number`, counted from 1.
    pub(crate) fn path(&self, number: u64) -> PathBuf {
        self.folder.join(format!("{}{number:0width$}{}", self.before, self.after, width = self.digits))
    }
}

/// `a%04d.png` is `a`, `04`, `.png`.
fn split(name: &str) -> Option<(&str, &str, &str)> {
    name.match_indices('%').find_map(|(at, _)| {
        let rest = &name[at + 1..];
        let end = rest.find(|c: char| !c.is_ascii_digit())?;
        let after = rest[end..].strip_prefix('d')?;
        Some((&name[..at], &rest[..end], after))
    })
}

impl Format {
    /// The image's file.
    ///
    /// # Errors
    /// When the image is beyond what the format can hold.
    pub(crate) fn encode(self, image: &RgbImage) -> anyhow::Result<Vec<u8>> {
        use image::codecs::{png, tiff};
        let mut file = Vec::new();
        let (width, height) = image.dimensions();
        let color = ExtendedColorType::Rgb8;
        match self {
            Self::Png => png::PngEncoder::new_with_quality(
                &mut file,
                png::CompressionType::Fast,
                png::FilterType::Adaptive,
            )
            .write_image(image, width, height, color),
            Self::Tiff => tiff::TiffEncoder::new(std::io::Cursor::new(&mut file))
                .write_image(image, width, height, color),
        }
        .context("cannot encode the image")?;
        Ok(file)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn images(out: &str) -> Pattern {
        match Target::parse(Path::new(out)) {
            Ok(Target::Images(pattern, _)) => pattern,
            other => panic!("{out}: {other:?}"),
        }
    }

    #[test]
    fn the_ending_decides() {
        assert_eq!(Target::parse(Path::new("a.GIF")).unwrap(), Target::Gif("a.GIF".into()));
        assert_eq!(Target::parse(Path::new("a.png")).unwrap(), Target::Image("a.png".into(), Format::Png));
        assert_eq!(Target::parse(Path::new("a.tif")).unwrap(), Target::Image("a.tif".into(), Format::Tiff));
        assert_eq!(Target::parse(Path::new("a.tiff")).unwrap(), Target::Image("a.tiff".into(), Format::Tiff));
        for unknown in ["a", "a.jpg", ".gif", "a.gif/", "gif", ""] {
            let target = Target::parse(Path::new(unknown));
            assert!(target.is_err() || unknown == "a.gif/", "{unknown}: {target:?}");
        }
    }

    #[test]
    fn numbers_count_from_one_and_grow_beyond_their_width() {
        let pattern = images("frames/a%04d.png");
        assert_eq!(pattern.path(1), Path::new("frames/a0001.png"));
        assert_eq!(pattern.path(12345), Path::new("frames/a12345.png"));
        assert_eq!(images("%d.tiff").path(10), Path::new("10.tiff"));
        assert_eq!(images("%3d.tiff").path(10), Path::new("010.tiff"));
    }

    #[test]
    fn a_percent_sign_alone_is_part_of_the_name() {
        for name in ["100%.png", "a%20b.png", "%x.png", "%.png"] {
            assert!(matches!(Target::parse(Path::new(name)), Ok(Target::Image(..))), "{name}");
        }
        assert_eq!(images("100%-%d.png").path(7), Path::new("100%-7.png"));
    }

    #[test]
    fn senseless_patterns_are_refused() {
        for name in ["%d-%d.png", "%04d.gif", "%99999d.png"] {
            assert!(Target::parse(Path::new(name)).is_err(), "{name}");
        }
    }

    #[test]
    fn images_decode_to_what_they_were() {
        let image = RgbImage::from_fn(7, 5, |x, y| image::Rgb([x as u8, y as u8, 200]));
        for format in [Format::Png, Format::Tiff] {
            let file = format.encode(&image).unwrap();
            assert_eq!(image::load_from_memory(&file).unwrap().into_rgb8(), image, "{format:?}");
        }
    }
}
