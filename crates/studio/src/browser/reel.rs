//! A worker that makes an animation, and workers that draw its frames. Each worker has a reel of the same files; one of
//! them takes the frames in order and encodes them.

use std::io::{Cursor, Write};

use image::{DynamicImage, RgbImage, RgbaImage};
use rayfold_movie::Container;
use rayfold_tracer::RenderOptions;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::desk::project_of;
use super::packet::File;
use crate::error::Error;
use crate::output::{Film, Job, frame_file, png};

/// A writer of the frames of a project to a file: an animation, or a zip file of pictures.
#[derive(Debug)]
pub struct Reel {
    film: Film,
    /// The zip file of pictures, each a frame in its own size.
    zip: Option<(ZipWriter<Cursor<Vec<u8>>>, u64)>,
}

impl Reel {
    /// Takes the files of a project, and the format: `gif`, `apng`, `webp`, or `frames` for a zip file of pictures.
    ///
    /// # Errors
    /// Fails if the format is unknown, or if a file is faulty.
    pub fn new(files: Vec<File>, format: &str) -> Result<Self, Error> {
        let (project, _) = project_of("", files)?;
        let container = match format {
            "gif" | "frames" => Container::Gif,
            "apng" => Container::Apng,
            "webp" => Container::Webp,
            _ => return Err(Error::Output(format!("there is no format {format}"))),
        };
        let job = Job::of(&project, container)?;
        let zip = (format == "frames").then(|| (ZipWriter::new(Cursor::new(Vec::new())), 0));
        let film = if zip.is_some() { Film::of_all_frames(job) } else { Film::new(job) };
        Ok(Self { film, zip })
    }

    /// Returns the number of frames.
    pub fn count(&self) -> usize {
        self.film.count()
    }

    /// Renders a frame, counted from 0: its width, its height and its number of channels as 32-bit little-endian numbers,
    /// then its levels.
    ///
    /// # Errors
    /// Fails if the frame cannot be rendered.
    pub fn draw(&self, number: usize) -> Result<Vec<u8>, Error> {
        let image = self.film.draw(number, &RenderOptions::default())?;
        let head = [image.width(), image.height(), u32::from(image.color().channel_count())];
        Ok([head.map(u32::to_le_bytes).as_flattened(), image.as_bytes()].concat())
    }

    /// Adds the next frame, as [`Self::draw`] has returned it.
    ///
    /// # Errors
    /// Fails if it is no frame, or if the file exceeds its limits.
    pub fn push(&mut self, frame: &[u8]) -> Result<(), Error> {
        let frame = image_of(frame).ok_or_else(|| Error::Output("a frame was cut off".into()))?;
        let Some((zip, count)) = &mut self.zip else { return self.film.push(frame) };
        *count += 1;
        let name = frame_file(*count, self.film.count() as u64);
        let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
        let failed = |error: &dyn std::error::Error| Error::Output(error.to_string());
        zip.start_file(name, options).map_err(|error| failed(&error))?;
        zip.write_all(&png(&frame)?).map_err(|error| failed(&error))
    }

    /// Returns the file.
    ///
    /// # Errors
    /// Fails if there was no frame, or if the file exceeds its limits.
    pub fn finish(self) -> Result<Vec<u8>, Error> {
        match self.zip {
            None => self.film.finish(),
            Some((zip, _)) => {
                let file = zip.finish().map_err(|error| Error::Output(error.to_string()))?;
                Ok(file.into_inner())
            }
        }
    }
}

fn image_of(frame: &[u8]) -> Option<DynamicImage> {
    let (head, levels) = frame.split_at_checked(12)?;
    let head: Vec<u32> = head.as_chunks().0.iter().map(|&bytes| u32::from_le_bytes(bytes)).collect();
    let &[width, height, channels] = head.as_slice() else { return None };
    match channels {
        3 => RgbImage::from_raw(width, height, levels.into()).map(DynamicImage::ImageRgb8),
        4 => RgbaImage::from_raw(width, height, levels.into()).map(DynamicImage::ImageRgba8),
        _ => None,
    }
}
