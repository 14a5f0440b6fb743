//! Where the picture goes: what OUT means by its ending.

use std::path::{Path, PathBuf};

use anyhow::Context;
use image::{ExtendedColorType, ImageEncoder, ImageFormat, RgbImage};
use rayfold_files::probe;
use rayfold_gif::Plays;

use crate::console::Console;
use crate::outcome::Usage;
use crate::wording::number;

/// What OUT asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    /// All frames as one animation.
    Animation(Container, Place),
    /// One frame.
    Image(PathBuf, Format),
    /// Each frame as a file.
    Images(Pattern, Format),
}

/// How an animation is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Container {
    Gif,
    Apng,
    Y4m,
}

/// Where an animation goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    File(PathBuf),
    StandardOutput,
}

/// What is known of an animation before its first frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Movie {
    /// Columns and rows.
    pub(crate) size: (u32, u32),
    /// How many frames there will be.
    pub(crate) frames: u64,
    /// Frames a second.
    pub(crate) fps: f64,
    pub(crate) plays: Plays,
    /// How long the last frame is shown, if not as long as the others.
    pub(crate) last_delay_cs: Option<u16>,
    /// Whether a GIF keeps frames of at most 256 colours exactly, whatever that takes.
    pub(crate) exact: bool,
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
        if out.as_os_str() == "-" {
            return Ok(Self::Animation(Container::Y4m, Place::StandardOutput));
        }
        let container = match ending(out).as_deref() {
            Some("gif") => Container::Gif,
            Some("apng") => Container::Apng,
            Some("y4m") => Container::Y4m,
            Some("png") => return Self::image(out, Format::Png),
            Some("tif" | "tiff") => return Self::image(out, Format::Tiff),
            _ => {
                return Err(Usage(format!(
                    "cannot tell from its ending what {shown} should be: expected .gif, .apng or .y4m for an animation, \
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

/// For those who write a GIF and nothing else.
///
/// # Errors
/// When the name does not end so, or stands for many files.
pub(crate) fn must_be_gif(out: &Path) -> Result<(), Usage> {
    let shown = out.display();
    if ending(out).as_deref() != Some("gif") {
        return Err(Usage(format!("cannot write {shown}: expected a name that ends in .gif")));
    }
    Target::parse(out).map(drop)
}

fn ending(out: &Path) -> Option<String> {
    out.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase())
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

    /// Says now what [`make_folder`](Self::make_folder) and writing a file would say later; makes nothing.
    ///
    /// # Errors
    /// When no file can be written there.
    pub(crate) fn probe(&self, number: u64) -> anyhow::Result<()> {
        let is_there = |folder: &&Path| folder.as_os_str().is_empty() || folder.symlink_metadata().is_ok();
        match self.folder.ancestors().find(is_there) {
            // The folders in between are made, so that only the nearest one must take something.
            Some(nearest) if nearest != self.folder => {
                let path = self.path(number);
                let name = path.file_name().unwrap_or_default();
                Ok(probe(&nearest.join(name)).map_err(|error| error.about(path))?)
            }
            _ => Ok(probe(&self.path(number))?),
        }
    }

    /// Makes the folder of the files if it is not there.
    ///
    /// # Errors
    /// The system's.
    pub(crate) fn make_folder(&self) -> anyhow::Result<()> {
        let folder = &self.folder;
        if folder.as_os_str().is_empty() {
            return Ok(());
        }
        std::fs::create_dir_all(folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))
    }

    /// The files of frames `first` to `last`, for people.
    pub(crate) fn range(&self, first: u64, last: u64) -> String {
        let (from, to) = (self.path(first), self.path(last));
        if first == last {
            from.display().to_string()
        } else {
            format!("{} to {}", from.display(), to.display())
        }
    }

    /// The numbers of files that are there of frames behind the last one, in order: an earlier run had more.
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

    /// Warns of files that an earlier run has left of frames behind the last one.
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
    /// The image in a file of this format; `None` when it is not whole.
    pub(crate) fn decode(self, file: &[u8]) -> Option<RgbImage> {
        let format = match self {
            Self::Png => ImageFormat::Png,
            Self::Tiff => ImageFormat::Tiff,
        };
        Some(image::load_from_memory_with_format(file, format).ok()?.into_rgb8())
    }

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
        let animation = |name: &str, container| Target::Animation(container, Place::File(name.into()));
        for (name, container) in
            [("a.GIF", Container::Gif), ("a.apng", Container::Apng), ("a.y4m", Container::Y4m)]
        {
            assert_eq!(Target::parse(Path::new(name)).unwrap(), animation(name, container));
        }
        let piped = Target::Animation(Container::Y4m, Place::StandardOutput);
        assert_eq!(Target::parse(Path::new("-")).unwrap(), piped);
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
        assert_eq!(
            (pattern.range(9, 9), images("%d.png").range(1, 3)),
            ("frames/a0009.png".into(), "1.png to 3.png".into())
        );
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
    fn only_a_gif_is_a_gif() {
        assert!(must_be_gif(Path::new("a/b.gif")).is_ok());
        for name in ["a.mp4", "a.png", "a", "%d.gif", "-"] {
            assert!(must_be_gif(Path::new(name)).is_err(), "{name}");
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
        let image = RgbImage::from_fn(7, 5, |x, y| image::Rgb([x as u8, y as u8, 200]));
        for format in [Format::Png, Format::Tiff] {
            let file = format.encode(&image).unwrap();
            assert_eq!(format.decode(&file), Some(image.clone()), "{format:?}");
            assert_eq!(format.decode(&file[..file.len() / 2]), None, "half a {format:?}");
        }
    }
}
