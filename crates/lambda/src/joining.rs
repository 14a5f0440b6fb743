//! Joins the bands of a frame, each a PNG, to the PNG of the frame. The rows go through the same encoder as a frame
//! in one piece, so the bytes are the same. Holds the file that it writes, and one band.

use std::num::NonZeroU64;

use bytes::Bytes;
use rayfold_pipeline::BandJoiner;
use rayfold_pipeline::keys::Band;
use rayfold_pipeline::manifest::Reason;

use crate::{png, pool};

/// A frame that is joined from bands.
pub struct PngJoining {
    size: (u32, u32),
    has_alpha: bool,
    /// The bands that are still to come, the last first.
    bands: Vec<Band>,
    /// `None` while a band is being encoded, and after a failure.
    rows: Option<png::Rows>,
}

impl PngJoining {
    /// Begins a frame of this size, in columns and rows, made of `count` bands, which all have alpha or have none.
    pub(crate) fn begin(size: (u32, u32), has_alpha: bool, count: NonZeroU64) -> Result<Self, Reason> {
        if count.get() > u64::from(size.1) {
            return Err(Reason::new(format!("a frame of {} rows has no {count} bands", size.1)));
        }
        let rows =
            png::Rows::begin(size.0, size.1, has_alpha).map_err(|error| Reason::new(error.to_string()))?;
        let mut bands: Vec<Band> = Band::all(count).collect();
        bands.reverse();
        Ok(Self { size, has_alpha, bands, rows: Some(rows) })
    }
}

impl BandJoiner for PngJoining {
    async fn push(&mut self, band: Bytes) -> Result<(), Reason> {
        let failed = || Reason::new("the encoder failed on an earlier band");
        let next = *self.bands.last().ok_or_else(|| Reason::new("the frame has all its bands"))?;
        let mut rows = self.rows.take().ok_or_else(failed)?;
        let ((width, height), has_alpha) = (self.size, self.has_alpha);
        let work = move || {
            let expected = (width, next.rows(height).len() as u32);
            let most_pixels = u64::from(expected.0) * u64::from(expected.1);
            let image = match png::decode(&band, most_pixels) {
                Ok(image) if image.color().has_alpha() != has_alpha => {
                    let what = if has_alpha { "it has no alpha" } else { "it has alpha" };
                    return (Some(rows), Err(Reason::new(what)));
                }
                Ok(image) if (image.width(), image.height()) == expected => image,
                Ok(image) => {
                    let (across, down) = (image.width(), image.height());
                    let (width, height) = expected;
                    let what = format!("it has {across} x {down} pixels: expected {width} x {height}");
                    return (Some(rows), Err(Reason::new(what)));
                }
                Err(error) => return (Some(rows), Err(Reason::new(error.to_string()))),
            };
            match rows.push(image.as_bytes()) {
                Ok(()) => (Some(rows), Ok(())),
                Err(error) => (None, Err(Reason::new(error.to_string()))),
            }
        };
        let (rows, pushed) = pool::run(work).await.unwrap_or_else(|| (None, Err(failed())));
        self.rows = rows;
        pushed?;
        self.bands.pop();
        Ok(())
    }

    async fn finish(mut self) -> Result<Bytes, Reason> {
        let rows = self.rows.take().ok_or_else(|| Reason::new("the encoder failed on a band"))?;
        rows.finish().map_err(|error| Reason::new(error.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use image::{DynamicImage, RgbImage};

    use super::*;

    fn picture(has_alpha: bool) -> DynamicImage {
        let image: DynamicImage =
            RgbImage::from_fn(23, 17, |x, y| image::Rgb([(x * y) as u8, x as u8, (y * 31) as u8])).into();
        if !has_alpha {
            return image;
        }
        let mut image = image.into_rgba8();
        image.enumerate_pixels_mut().for_each(|(x, y, pixel)| pixel[3] = (x * 7 + y) as u8);
        image.into()
    }

    fn bands(has_alpha: bool, count: NonZeroU64) -> Vec<Bytes> {
        let picture = picture(has_alpha);
        let cut = |band: Band| {
            let rows = band.rows(17);
            png::encode(&picture.crop_imm(0, rows.start, 23, rows.end - rows.start)).unwrap()
        };
        Band::all(count).map(cut).collect()
    }

    #[tokio::test]
    async fn bands_put_together_are_the_file_of_the_whole() {
        for (count, has_alpha) in (1..=17).flat_map(|count| [(count, false), (count, true)]) {
            let count = NonZeroU64::new(count).unwrap();
            let mut joining = PngJoining::begin((23, 17), has_alpha, count).unwrap();
            for band in bands(has_alpha, count) {
                joining.push(band).await.unwrap();
            }
            assert!(joining.finish().await.unwrap() == png::encode(&picture(has_alpha)).unwrap(), "{count}");
        }
    }

    #[tokio::test]
    async fn what_is_no_such_band_adds_nothing() {
        let count = NonZeroU64::new(2).unwrap();
        let (right, clear) = (bands(false, count), bands(true, count));
        let mut joining = PngJoining::begin((23, 17), false, count).unwrap();
        // The second band has a row more, one has alpha; the others are no bands at all.
        for wrong in
            [right[1].clone(), clear[0].clone(), right[0].slice(..40), Bytes::from("garbage"), Bytes::new()]
        {
            assert!(joining.push(wrong).await.is_err());
        }
        joining.push(right[0].clone()).await.unwrap();
        assert!(joining.push(right[0].clone()).await.is_err());
        joining.push(right[1].clone()).await.unwrap();
        assert!(joining.push(right[1].clone()).await.is_err(), "it has all its bands");
        assert!(joining.finish().await.unwrap() == png::encode(&picture(false)).unwrap());
    }

    #[tokio::test]
    async fn a_frame_with_bands_missing_is_none() {
        let count = NonZeroU64::new(3).unwrap();
        let mut joining = PngJoining::begin((23, 17), false, count).unwrap();
        joining.push(bands(false, count)[0].clone()).await.unwrap();
        assert!(joining.finish().await.is_err());
        assert!(PngJoining::begin((23, 17), false, NonZeroU64::new(18).unwrap()).is_err());
    }
}
