//! The conversion of colours to the levels of a picture.

use glam::DVec3;
use rayfold_scene::Tone;

use crate::parallel::CHANNELS;

/// Returns the levels of a pixel of this colour.
pub(crate) fn toned(tone: Tone, color: DVec3) -> [u8; CHANNELS] {
    levels(match tone {
        Tone::Plain => color,
        Tone::Srgb => DVec3::from_array(color.to_array().map(encoded)),
    })
}

/// Returns a channel of linear light, clamped, encoded by the sRGB curve (IEC 61966-2-1).
pub(crate) fn encoded(light: f64) -> f64 {
    let light = light.clamp(0.0, 1.0);
    if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * libm::pow(light, 1.0 / 2.4) - 0.055 }
}

/// Converts display values to the levels of the channels.
pub(crate) fn levels(color: DVec3) -> [u8; CHANNELS] {
    #[cfg(feature = "accuracy")]
    crate::nans::add(color.is_nan_mask().bitmask().count_ones());
    color.to_array().map(|channel| (255.0 * channel.clamp(0.0, 1.0)).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_rounded_and_clamped() {
        assert_eq!(levels(DVec3::new(-1.0, 0.499 / 255.0, 0.501 / 255.0)), [0, 0, 1]);
        assert_eq!(levels(DVec3::new(2.0, f64::INFINITY, f64::NEG_INFINITY)), [255, 255, 0]);
    }

    #[test]
    fn linear_light_is_encoded() {
        assert_eq!(toned(Tone::Srgb, DVec3::new(0.0, 0.215_86, 1.0)), [0, 128, 255]);
        assert_eq!(toned(Tone::Srgb, DVec3::new(0.002, -3.0, 7.0)), [7, 0, 255]);
        assert_eq!(toned(Tone::Plain, DVec3::splat(0.5)), [128; 3]);
    }
}
