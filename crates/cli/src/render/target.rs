//! The destination of a picture, from the ending of OUT.

use std::path::{Path, PathBuf};

use anyhow::Context;
use image::{DynamicImage, ImageEncoder, ImageFormat};
use rayfold_files::probe;
use rayfold_movie::Container;

use crate::console::Console;
use crate::outcome::Usage;
use crate::wording::number;

/// The kind of output that OUT stands for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    /// One animation of all frames.
    Animation(Container, Place),
    /// A picture of one frame.
    Image(PathBuf, Format),
    /// A file for each frame.
    Images(Pattern, Format),
}

/// The destination of an animation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    File(PathBuf),
    StandardOutput,
}

/// The file format of a single image.
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
    /// Returns the target for a name; `format` overrides the ending. Standard output is a .y4m without a `format`.
    ///
    /// # Errors
    /// Fails if the ending is unknown or the pattern is invalid.
    pub(crate) fn parse(out: &Path, format: Option<Container>) -> Result<Self, Usage> {
        let shown = out.display();
        if out.as_os_str() == "-" {
            return Ok(Self::Animation(format.unwrap_or(Container::Y4m), Place::StandardOutput));
        }
        let container = match format
            .map(Container::ending)
            .map(str::to_owned)
            .or_else(|| ending(out))
            .as_deref()
        {
            Some("gif") => Container::Gif,
            Some("apng") => Container::Apng,
            Some("webp") => Container::Webp,
            Some("y4m") => Container::Y4m,
            Some("png") => return Self::image(out, Format::Png),
            Some("tif" | "tiff") => return Self::image(out, Format::Tiff),
            Some(video @ ("mp4" | "m4v" | "mov" | "mkv" | "webm" | "avi" | "mpg" | "mpeg")) => {
                return Err(Usage(format!(
                    "rayfold writes no .{video}, but ffmpeg does: rayfold ... -o - --format y4m | ffmpeg -i - -pix_fmt yuv420p \
                     {shown} (docs/video.md has more)"
                )));
            }
            _ => {
                return Err(Usage(format!(
                    "cannot tell from its ending what {shown} should be: expected .gif, .apng, .webp or .y4m for an animation, \
                     .png, .tif or .tiff for one frame, or a pattern such as frames/%04d.png for many"
                )));
            }
        };
        if Pattern::parse(out)?.is_some() {
            return Err(Usage(format!(
                "{shown} names a file a frame, but an animation holds all frames: leave the % part out"
            )));
        }
        Ok(Self::Animation(container, Place::File(out.to_path_buf())))
    }

    fn image(out: &Path, format: Format) -> Result<Self, Usage> {
        Ok(match Pattern::parse(out)? {
            None => Self::Image(out.to_path_buf(), format),
            Some(pattern) => Self::Images(pattern, format),
        })
    }
}

/// Returns the kind of file that a name stands for, for a command that writes files of animations and nothing else.
///
/// # Errors
/// Fails if the name does not end as such a file's, or stands for many files.
#[cfg(feature = "network")]
pub(crate) fn container_of(out: &Path) -> Result<Container, Usage> {
    match Target::parse(out, None) {
        Ok(Target::Animation(container, Place::File(_))) => Ok(container),
        _ => {
            let endings = "a name that ends in .gif, .apng, .webp or .y4m";
            Err(Usage(format!("cannot write {}: expected {endings}", out.display())))
        }
    }
}

fn ending(out: &Path) -> Option<String> {
    out.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase())
}

impl Pattern {
    /// Returns `None` if `path` has no place for a number.
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

    /// Returns the pattern of the files beside these, with another ending: `a%04d.depth.exr` for `a%04d.png`.
    pub(crate) fn with_ending(&self, ending: &str) -> Self {
        let after = self.after.rsplit_once('.').map_or("", |(after, _)| after);
        Self { after: format!("{after}.{ending}"), ..self.clone() }
    }

    /// Returns now the error that [`make_folder`](Self::make_folder) or writing a file would return later. Creates
    /// nothing.
    ///
    /// # Errors
    /// Fails if no file can be written there.
    pub(crate) fn probe(&self, number: u64) -> anyhow::Result<()> {
        let is_there = |folder: &&Path| folder.as_os_str().is_empty() || folder.symlink_metadata().is_ok();
        match self.folder.ancestors().find(is_there) {
            // The folders in between are made later, so that only the nearest existing one must be writable.
            Some(nearest) if nearest != self.folder => {
                let path = self.path(number);
                let name = path.file_name().unwrap_or_default();
                probe(&nearest.join(name)).map_err(|error| match error {
                    rayfold_files::Error::Io { source, .. } => self.not_made(source),
                    other => other.about(path).into(),
                })
            }
            _ => Ok(probe(&self.path(number))?),
        }
    }

    /// Makes the folder of the files if it does not exist.
    ///
    /// # Errors
    /// The errors of the system.
    pub(crate) fn make_folder(&self) -> anyhow::Result<()> {
        let folder = &self.folder;
        if folder.as_os_str().is_empty() {
            return Ok(());
        }
        std::fs::create_dir_all(folder).map_err(|source| self.not_made(source))
    }

    fn not_made(&self, source: std::io::Error) -> anyhow::Error {
        anyhow::Error::new(source).context(format!("cannot make the folder {}", self.folder.display()))
    }

    /// Returns a description of the files of frames `first` to `last`, for messages.
    pub(crate) fn range(&self, first: u64, last: u64) -> String {
        let (from, to) = (self.path(first), self.path(last));
        if first == last {
            from.display().to_string()
        } else {
            format!("{} to {}", from.display(), to.display())
        }
    }

    /// Returns the numbers of existing files of frames after the last one, in order: an earlier run had more frames.
    pub(crate) fn beyond(&self, last: u64) -> Vec<u64> {
        let folder = if self.folder.as_os_str().is_empty() { Path::new(".") } else { &self.folder };
        let names = folder.read_dir().into_iter().flatten().flatten().map(|entry| entry.file_name());
        let mut numbers: Vec<u64> = names
            .filter_map(|name| {
                let digits = name.to_str()?.strip_prefix(&self.before)?.strip_suffix(&self.after)?;
                let number = digits.parse().ok().filter(|number| *number > last)?;
                (self.path(number).file_name() == Some(&name)).then_some(number)
            })
            .collect();
        numbers.sort_unstable();
        numbers
    }

    /// Returns whether a file may be that of a frame.
    pub(crate) fn names(&self, file: &Path) -> bool {
        let folder = |folder: &Path| {
            let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
            folder.canonicalize().ok()
        };
        let number = file.file_name().and_then(|name| {
            name.to_str()?.strip_prefix(&self.before)?.strip_suffix(&self.after)?.parse().ok()
        });
        number.is_some_and(|number| self.path(number).file_name() == file.file_name())
            && file.parent().and_then(folder).is_some_and(|parent| folder(&self.folder) == Some(parent))
    }

    /// Warns of files of frames after the last one, which an earlier run has left.
    pub(crate) fn warn_of_older(&self, last: u64, console: &Console) {
        let older = self.beyond(last);
        if let (Some(&first), Some(&end)) = (older.first(), older.last()) {
            console.warn(format_args!(
                "{} of an earlier run left beside them: {}",
                number(older.len() as u64, "frame"),
                self.range(first, end)
            ));
        }
    }

    /// Returns the path of frame `number`, counted from 1.
    pub(crate) fn path(&self, number: u64) -> PathBuf {
        self.folder.join(format!("{}{number:0width$}{}", self.before, self.after, width = self.digits))
    }
}

/// Splits a pattern: `a%04d.png` becomes `a`, `04`, `.png`.
fn split(name: &str) -> Option<(&str, &str, &str)> {
    name.match_indices('%').find_map(|(at, _)| {
        let rest = &name[at + 1..];
        let end = rest.find(|c: char| !c.is_ascii_digit())?;
        let after = rest[end..].strip_prefix('d')?;
        Some((&name[..at], &rest[..end], after))
    })
}

impl Format {
    /// Decodes the image in a file of this format. Returns `None` if the file is incomplete.
    pub(crate) fn decode(self, file: &[u8]) -> Option<DynamicImage> {
        let format = match self {
            Self::Png => ImageFormat::Png,
            Self::Tiff => ImageFormat::Tiff,
        };
        let image = image::load_from_memory_with_format(file, format).ok()?;
        Some(if image.color().has_alpha() { image.into_rgba8().into() } else { image.into_rgb8().into() })
    }

    /// Encodes an image, with or without alpha, as a file of this format.
    ///
    /// # Errors
    /// Fails if the image exceeds the limits of the format.
    pub(crate) fn encode(self, image: &DynamicImage) -> anyhow::Result<Vec<u8>> {
        use image::codecs::{png, tiff};
        let mut file = Vec::new();
        let (width, height) = (image.width(), image.height());
        let (bytes, color) = (image.as_bytes(), image.color().into());
        match self {
            Self::Png => png::PngEncoder::new_with_quality(
                &mut file,
                png::CompressionType::Fast,
                png::FilterType::Adaptive,
            )
            .write_image(bytes, width, height, color),
            Self::Tiff => tiff::TiffEncoder::new(std::io::Cursor::new(&mut file))
                .write_image(bytes, width, height, color),
        }
        .context("cannot encode the image")?;
        Ok(file)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn images(out: &str) -> Pattern {
        match Target::parse(Path::new(out), None) {
            Ok(Target::Images(pattern, _)) => pattern,
            other => panic!("{out}: {other:?}"),
        }
    }

    #[test]
    fn the_ending_decides() {
        let animation = |name: &str, container| Target::Animation(container, Place::File(name.into()));
        for (name, container) in
            [("a.GIF", Container::Gif), ("a.apng", Container::Apng), ("a.y4m", Container::Y4m)]
        {
            assert_eq!(Target::parse(Path::new(name), None).unwrap(), animation(name, container));
        }
        let piped = Target::Animation(Container::Y4m, Place::StandardOutput);
        assert_eq!(Target::parse(Path::new("-"), None).unwrap(), piped);
        assert_eq!(
            Target::parse(Path::new("a.png"), None).unwrap(),
            Target::Image("a.png".into(), Format::Png)
        );
        assert_eq!(
            Target::parse(Path::new("a.tif"), None).unwrap(),
            Target::Image("a.tif".into(), Format::Tiff)
        );
        assert_eq!(
            Target::parse(Path::new("a.tiff"), None).unwrap(),
            Target::Image("a.tiff".into(), Format::Tiff)
        );
        for unknown in ["a", "a.jpg", ".gif", "a.gif/", "gif", ""] {
            let target = Target::parse(Path::new(unknown), None);
            assert!(target.is_err() || unknown == "a.gif/", "{unknown}: {target:?}");
        }
    }

    #[test]
    fn numbers_count_from_one_and_grow_beyond_their_width() {
        let pattern = images("frames/a%04d.png");
        assert_eq!(pattern.path(1), Path::new("frames/a0001.png"));
        assert_eq!(pattern.path(12345), Path::new("frames/a12345.png"));
        assert_eq!(images("%d.tiff").path(10), Path::new("10.tiff"));
        assert_eq!(
            (pattern.range(9, 9), images("%d.png").range(1, 3)),
            ("frames/a0009.png".into(), "1.png to 3.png".into())
        );
        assert_eq!(images("%3d.tiff").path(10), Path::new("010.tiff"));
    }

    #[test]
    fn a_percent_sign_alone_is_part_of_the_name() {
        for name in ["100%.png", "a%20b.png", "%x.png", "%.png"] {
            assert!(matches!(Target::parse(Path::new(name), None), Ok(Target::Image(..))), "{name}");
        }
        assert_eq!(images("100%-%d.png").path(7), Path::new("100%-7.png"));
    }

    #[test]
    fn senseless_patterns_are_refused() {
        for name in ["%d-%d.png", "%04d.gif", "%99999d.png"] {
            assert!(Target::parse(Path::new(name), None).is_err(), "{name}");
        }
    }

    #[test]
    #[cfg(feature = "network")]
    fn an_animation_is_named_by_its_ending() {
        for container in Container::ALL {
            let name = format!("a/b.{}", container.ending());
            assert_eq!(container_of(Path::new(&name)).unwrap(), container);
        }
        for name in ["a.mp4", "a.png", "a", "%d.gif", "%d.png", "-"] {
            assert!(container_of(Path::new(name)).is_err(), "{name}");
        }
    }

    #[test]
    fn a_folder_of_frames_is_made_but_not_by_asking_whether_it_can_be() {
        let folder = tempfile::tempdir().unwrap();
        let pattern = images(folder.path().join("new/frames/%d.png").to_str().unwrap());
        pattern.probe(1).unwrap();
        assert!(!folder.path().join("new").exists());
        pattern.make_folder().unwrap();
        assert!(folder.path().join("new/frames").is_dir());
        std::fs::write(folder.path().join("file"), "").unwrap();
        let below_a_file = images(folder.path().join("file/%d.png").to_str().unwrap());
        assert!(below_a_file.probe(1).is_err() && below_a_file.make_folder().is_err());
    }

    #[test]
    fn files_of_frames_behind_the_last_one_are_found_by_their_exact_names() {
        let folder = tempfile::tempdir().unwrap();
        let pattern = images(folder.path().join("a%03d.png").to_str().unwrap());
        assert!(pattern.beyond(0).is_empty());
        for name in
            ["a009.png", "a010.png", "a1000.png", "a0011.png", "a12.png", "b013.png", "a014.tif", "a-15.png"]
        {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        assert_eq!(pattern.beyond(9), [10, 1000]);
        assert!(images(folder.path().join("no/%d.png").to_str().unwrap()).beyond(1).is_empty());
    }

    #[test]
    fn images_decode_to_what_they_were() {
        let clear =
            image::RgbaImage::from_fn(7, 5, |x, y| image::Rgba([x as u8, y as u8, 200, 30 * x as u8]));
        let clear = DynamicImage::from(clear);
        for image in [clear.to_rgb8().into(), clear] {
            for format in [Format::Png, Format::Tiff] {
                let file = format.encode(&image).unwrap();
                assert_eq!(format.decode(&file), Some(image.clone()), "{format:?}");
                assert_eq!(format.decode(&file[..file.len() / 2]), None, "half a {format:?}");
            }
        }
    }
}
