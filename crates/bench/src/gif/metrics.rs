//! How far a shown animation is from the one meant.

use image::RgbImage;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Means over frames, but for the worst frame's PSNR.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Quality {
    /// Decibels over all three channels of sRGB, the mean of the frames' (99 for an exact frame).
    pub(super) psnr: f64,
    /// Of the worst frame.
    pub(super) psnr_worst: f64,
    /// CIE 1976 colour difference.
    pub(super) de76: f64,
    /// CIE 2000 colour difference.
    pub(super) de2000: f64,
    /// CIE 1976 after a mean over 5 x 5 pixels of both pictures.
    pub(super) blurred: f64,
    /// CIE 2000 after the same.
    pub(super) blurred2000: f64,
    /// Of pixels whose colour stays from one frame to the next: CIE 1976 difference of what is shown.
    pub(super) flicker: f64,
    /// The part of those pixels that change.
    pub(super) flicker_share: f64,
}

/// Compares frame by frame.
pub(super) fn quality(meant: &[RgbImage], shown: &[&RgbImage]) -> Quality {
    let per_frame = (0..meant.len().min(shown.len()))
        .into_par_iter()
        .map(|k| {
            let (a, b) = (&meant[k], shown[k]);
            let psnr = psnr(a, b);
            let (de76, de2000) = mean_difference(&lab(a), &lab(b));
            let (blurred, blurred2000) = mean_difference(&blurred_lab(a), &blurred_lab(b));
            let (flicker, share) =
                if k == 0 { (0.0, 0.0) } else { flicker([&meant[k - 1], a], [shown[k - 1], b]) };
            [psnr, de76, de2000, blurred, blurred2000, flicker, share]
        })
        .collect::<Vec<_>>();
    let mean = |at: usize| per_frame.iter().map(|f| f[at]).sum::<f64>() / per_frame.len() as f64;
    let after_first = per_frame.len() as f64 / (per_frame.len() as f64 - 1.0).max(1.0);
    Quality {
        psnr: mean(0),
        psnr_worst: per_frame.iter().map(|f| f[0]).fold(f64::MAX, f64::min),
        de76: mean(1),
        de2000: mean(2),
        blurred: mean(3),
        blurred2000: mean(4),
        flicker: mean(5) * after_first,
        flicker_share: mean(6) * after_first,
    }
}

fn psnr(a: &RgbImage, b: &RgbImage) -> f64 {
    let sum = a.as_raw().iter().zip(b.as_raw()).map(|(&a, &b)| u64::from(a.abs_diff(b)).pow(2)).sum::<u64>();
    if sum == 0 { 99.0 } else { 10.0 * (65_025.0 * a.as_raw().len() as f64 / sum as f64).log10() }
}

fn mean_difference(a: &[[f32; 3]], b: &[[f32; 3]]) -> (f64, f64) {
    let (mut de76, mut de2000) = (0.0, 0.0);
    for (a, b) in a.iter().zip(b) {
        if a != b {
            de76 += f64::from(difference_1976(*a, *b));
            de2000 += f64::from(difference_2000(*a, *b));
        }
    }
    (de76 / a.len() as f64, de2000 / a.len() as f64)
}

fn flicker(meant: [&RgbImage; 2], shown: [&RgbImage; 2]) -> (f64, f64) {
    let linear = linear_levels();
    let (mut still, mut changed, mut sum) = (0_u64, 0_u64, 0.0);
    let pixels = |image: &'_ RgbImage| image.as_raw().as_chunks::<3>().0.to_vec();
    let [before, now, shown_before, shown_now] = [meant[0], meant[1], shown[0], shown[1]].map(pixels);
    for k in 0..now.len() {
        if before[k] == now[k] {
            still += 1;
            if shown_before[k] != shown_now[k] {
                changed += 1;
                let of = |rgb: [u8; 3]| lab_of_linear(rgb.map(|level| linear[usize::from(level)]));
                sum += f64::from(difference_1976(of(shown_before[k]), of(shown_now[k])));
            }
        }
    }
    if still == 0 { (0.0, 0.0) } else { (sum / still as f64, changed as f64 / still as f64) }
}

fn linear(level: f32) -> f32 {
    let v = level / 255.0;
    if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

fn linear_levels() -> Vec<f32> {
    (0..256).map(|level| linear(level as f32)).collect()
}

/// CIE L\*a\*b\* under D65 of linear sRGB.
fn lab_of_linear([r, g, b]: [f32; 3]) -> [f32; 3] {
    let f = |t: f32| if t > 216.0 / 24_389.0 { t.cbrt() } else { (24_389.0 / 27.0 * t + 16.0) / 116.0 };
    let x = f((0.412_456_4 * r + 0.357_576_1 * g + 0.180_437_5 * b) / 0.950_47);
    let y = f(0.212_672_9 * r + 0.715_152_2 * g + 0.072_175 * b);
    let z = f((0.019_333_9 * r + 0.119_192 * g + 0.950_304_1 * b) / 1.088_83);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn lab(image: &RgbImage) -> Vec<[f32; 3]> {
    let linear = linear_levels();
    let pixels = image.as_raw().as_chunks::<3>().0.iter();
    pixels.map(|rgb| lab_of_linear(rgb.map(|level| linear[usize::from(level)]))).collect()
}

/// L\*a\*b\* of the mean levels over 5 x 5 pixels, fewer at the edges.
fn blurred_lab(image: &RgbImage) -> Vec<[f32; 3]> {
    let (width, height) = (image.width() as usize, image.height() as usize);
    let pixels = image.as_raw().as_chunks::<3>().0;
    let mut columns = vec![[0_u32; 3]; width];
    let mut out = Vec::with_capacity(pixels.len());
    for y in 0..height {
        let rows = y.saturating_sub(2)..(y + 3).min(height);
        columns.fill([0; 3]);
        for row in rows.clone() {
            for (sum, rgb) in columns.iter_mut().zip(&pixels[row * width..]) {
                for k in 0..3 {
                    sum[k] += u32::from(rgb[k]);
                }
            }
        }
        for x in 0..width {
            let span = x.saturating_sub(2)..(x + 3).min(width);
            let count = (span.len() * rows.len()) as f32;
            let mut sum = [0; 3];
            for column in &columns[span] {
                for k in 0..3 {
                    sum[k] += column[k];
                }
            }
            out.push(lab_of_linear(sum.map(|sum| linear(sum as f32 / count))));
        }
    }
    out
}

fn difference_1976(a: [f32; 3], b: [f32; 3]) -> f32 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f32>().sqrt()
}

/// CIE 142-2001, in the form of Sharma, Wu and Dalal (2005).
fn difference_2000(a: [f32; 3], b: [f32; 3]) -> f32 {
    let [l1, a1, b1] = a.map(f64::from);
    let [l2, a2, b2] = b.map(f64::from);
    let seventh = |c: f64| (c.powi(7) / (c.powi(7) + 25_f64.powi(7))).sqrt();
    let g = 0.5 * (1.0 - seventh((a1.hypot(b1) + a2.hypot(b2)) / 2.0));
    let (a1, a2) = (a1 * (1.0 + g), a2 * (1.0 + g));
    let (c1, c2) = (a1.hypot(b1), a2.hypot(b2));
    let hue =
        |a: f64, b: f64| if a == 0.0 && b == 0.0 { 0.0 } else { b.atan2(a).to_degrees().rem_euclid(360.0) };
    let (h1, h2) = (hue(a1, b1), hue(a2, b2));
    let grey = c1 * c2 == 0.0;
    let turn = match h2 - h1 {
        _ if grey => 0.0,
        d if d > 180.0 => d - 360.0,
        d if d < -180.0 => d + 360.0,
        d => d,
    };
    let (dl, dc) = (l2 - l1, c2 - c1);
    let dh = 2.0 * (c1 * c2).sqrt() * (turn / 2.0).to_radians().sin();
    let (l, c) = ((l1 + l2) / 2.0, (c1 + c2) / 2.0);
    let h = match (h1 - h2).abs() {
        _ if grey => h1 + h2,
        d if d <= 180.0 => (h1 + h2) / 2.0,
        _ if h1 + h2 < 360.0 => (h1 + h2 + 360.0) / 2.0,
        _ => (h1 + h2 - 360.0) / 2.0,
    };
    let cos = |degrees: f64| degrees.to_radians().cos();
    let t = 1.0 - 0.17 * cos(h - 30.0) + 0.24 * cos(2.0 * h) + 0.32 * cos(3.0 * h + 6.0)
        - 0.2 * cos(4.0 * h - 63.0);
    let sl = 1.0 + 0.015 * (l - 50.0).powi(2) / (20.0 + (l - 50.0).powi(2)).sqrt();
    let (sc, sh) = (1.0 + 0.045 * c, 1.0 + 0.015 * c * t);
    let rotation = -2.0 * seventh(c) * (60.0 * (-((h - 275.0) / 25.0).powi(2)).exp()).to_radians().sin();
    let (dl, dc, dh) = (dl / sl, dc / sc, dh / sh);
    (dl * dl + dc * dc + dh * dh + rotation * dc * dh).max(0.0).sqrt() as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pairs 1, 4, 7, 9, 14, 17, 19, 25 of Sharma, Wu and Dalal's test data.
    #[test]
    fn difference_2000_of_published_pairs() {
        for (a, b, expected) in [
            ([50.0, 2.6772, -79.7751], [50.0, 0.0, -82.7485], 2.0425),
            ([50.0, -1.3802, -84.2814], [50.0, 0.0, -82.7485], 1.0),
            ([50.0, 0.0, 0.0], [50.0, -1.0, 2.0], 2.3669),
            ([50.0, 2.49, -0.001], [50.0, -2.49, 0.0009], 7.1792),
            ([50.0, -0.001, 2.49], [50.0, 0.0011, -2.49], 4.7461),
            ([50.0, 2.5, 0.0], [73.0, 25.0, -18.0], 27.1492),
            ([50.0, 2.5, 0.0], [56.0, -27.0, -3.0], 31.9030),
            ([60.2574, -34.0099, 36.2677], [60.4626, -34.1751, 39.4387], 1.2644),
        ] {
            let found = difference_2000(a, b);
            assert!((found - expected).abs() < 2e-4, "{a:?} {b:?}: {found} for {expected}");
        }
    }

    #[test]
    fn psnr_of_one_level_everywhere() {
        let (a, b) = (RgbImage::new(9, 9), RgbImage::from_pixel(9, 9, image::Rgb([1; 3])));
        assert!((psnr(&a, &b) - 48.1308).abs() < 1e-3);
        assert_eq!(quality(std::slice::from_ref(&a), &[&a]).psnr, 99.0);
    }

    #[test]
    fn blur_of_a_checkerboard_is_almost_grey() {
        let board = RgbImage::from_fn(40, 40, |x, y| image::Rgb([((x + y) % 2 * 200) as u8; 3]));
        let grey = RgbImage::from_pixel(40, 40, image::Rgb([100; 3]));
        let quality = quality(&[grey], &[&board]);
        assert!(quality.de76 > 30.0 && quality.blurred < 2.5, "{quality:?}");
    }

    #[test]
    fn flicker_counts_still_pixels_only() {
        let of =
            |left: u8, right: u8| RgbImage::from_fn(2, 1, |x, _| image::Rgb([[left, right][x as usize]; 3]));
        let meant = [of(0, 50), of(0, 90)];
        assert_eq!(quality(&meant, &[&of(0, 50), &of(0, 10)]).flicker, 0.0);
        let moved = quality(&meant, &[&of(0, 50), &of(119, 90)]);
        assert!((moved.flicker - 50.0).abs() < 0.2 && moved.flicker_share == 1.0, "{moved:?}");
    }
}
