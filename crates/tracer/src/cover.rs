//! Pictures of scenes without background: light and cover, and their conversion to levels.

use image::{Rgb, RgbImage, Rgba, RgbaImage};
use rayfold_scene::Tone;

use crate::fast::encoded;
use crate::reference;

/// The light of a pixel, premultiplied by its cover, in three channels from 0 to 1; and its cover, from 0 to 1.
pub(crate) type Lit = [f32; 4];

/// Nothing: neither light nor cover.
pub(crate) const NOTHING: Lit = [0.0; 4];

/// Converts pixels to levels that are not premultiplied, and their cover to a fourth level. Pixels whose cover is rounded to
/// 0 are black.
pub(crate) fn straight(size: (u32, u32), tone: Tone, pixels: &[Lit]) -> RgbaImage {
    let mut image = RgbaImage::new(size.0, size.1);
    for (into, &[red, green, blue, cover]) in image.pixels_mut().zip(pixels) {
        let alpha = (255.0 * f64::from(cover).clamp(0.0, 1.0)).round() as u8;
        if alpha == 0 {
            continue;
        }
        let [red, green, blue] =
            [red, green, blue].map(|channel| level(tone, f64::from(channel) / f64::from(cover)));
        *into = Rgba([red, green, blue, alpha]);
    }
    image
}

/// Converts pixels to the levels that they have over a colour, which is given by its levels.
pub(crate) fn over(size: (u32, u32), tone: Tone, pixels: &[Lit], matte: [u8; 3]) -> RgbImage {
    let matte = matte.map(|level| tone.light(level));
    let mut image = RgbImage::new(size.0, size.1);
    for (into, &[red, green, blue, cover]) in image.pixels_mut().zip(pixels) {
        let clear = 1.0 - f64::from(cover).clamp(0.0, 1.0);
        let channels = [red, green, blue];
        *into = Rgb([0, 1, 2].map(|k: usize| level(tone, f64::from(channels[k]) + clear * matte[k])));
    }
    image
}

/// Returns the level of a channel. A NaN is black.
fn level(tone: Tone, channel: f64) -> u8 {
    match tone {
        Tone::Plain => reference::levels(glam::DVec3::splat(channel))[0],
        Tone::Srgb => encoded(channel),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_those_of_the_light_that_covers() {
        let pixels = [[0.25, 0.125, 0.0, 0.5], [0.1, 0.1, 0.1, 0.001], [1.0, 0.5, 0.0, 1.0]];
        let image = straight((3, 1), Tone::Plain, &pixels);
        assert_eq!(image.into_raw(), [128, 64, 0, 128, 0, 0, 0, 0, 255, 128, 0, 255]);
        let image = straight((1, 1), Tone::Srgb, &[[0.107_93, 0.0, 2.0, 0.5]]);
        assert_eq!(image.into_raw(), [128, 0, 255, 128]);
    }

    #[test]
    fn a_matte_shows_where_nothing_covers_it() {
        let pixels = [[0.25, 0.0, 0.0, 0.5], NOTHING];
        assert_eq!(over((2, 1), Tone::Plain, &pixels, [0, 255, 0]).into_raw(), [64, 128, 0, 0, 255, 0]);
        // In linear light half of white is level 188.
        assert_eq!(over((2, 1), Tone::Srgb, &pixels, [255; 3]).into_raw()[1..4], [188, 188, 255]);
    }
}
