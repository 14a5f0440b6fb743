//! The difference between a shown animation and the intended one, frame by frame.

use std::sync::LazyLock;

use image::RgbImage;

/// One of this many pixels is compared by CIE 2000, which costs as much as all other measures together. No side of a
/// picture or of a dither pattern is a multiple of it.
const SPARSE: usize = 7;

/// Means over frames, except for the worst frame's PSNR.
#[derive(Debug, Clone, Default)]
pub(super) struct Quality {
    /// PSNR in decibels over all three channels of sRGB, the mean over the frames (99 for an exact frame).
    pub(super) psnr: f64,
    /// The PSNR of the worst frame.
    pub(super) psnr_worst: f64,
    /// CIE 1976 colour difference.
    pub(super) de76: f64,
    /// CIE 2000 colour difference.
    pub(super) de2000: f64,
    /// CIE 1976 colour difference after a mean over 5 x 5 pixels of both pictures.
    pub(super) blurred: f64,
    /// The CIE 1976 difference from one shown frame to the next, over the pixels whose colour should stay.
    pub(super) flicker: f64,
    /// The share of those pixels that change.
    pub(super) flicker_share: f64,
}

/// A frame as it should be shown.
pub(super) struct Meant<'a> {
    pub(super) image: &'a RgbImage,
    pub(super) before: Option<&'a RgbImage>,
    /// `None` if the frame is not compared by colour differences.
    pub(super) colours: Option<Colours>,
}

/// The L\*a\*b\* values of a frame, pixel by pixel.
pub(super) struct Colours {
    sharp: Vec<[f32; 3]>,
    blurred: Vec<[f32; 3]>,
}

impl Colours {
    pub(super) fn of(image: &RgbImage) -> Self {
        Self { sharp: lab(image), blurred: blurred_lab(image) }
    }
}

/// Compares the shown frames with the intended ones.
#[derive(Default)]
pub(super) struct Judge {
    before: Option<RgbImage>,
    psnr: Mean,
    psnr_worst: Option<f64>,
    de76: Mean,
    de2000: Mean,
    blurred: Mean,
    flicker: Mean,
    flicker_share: Mean,
}

#[derive(Default)]
struct Mean {
    sum: f64,
    count: f64,
}

impl Mean {
    fn add(&mut self, value: f64) {
        self.sum += value;
        self.count += 1.0;
    }

    /// Returns the mean, 0 without values.
    fn value(&self) -> f64 {
        self.sum / self.count.max(1.0)
    }
}

impl Judge {
    /// Takes the next frame.
    pub(super) fn see(&mut self, meant: &Meant<'_>, shown: &RgbImage) {
        let psnr = psnr(meant.image, shown);
        self.psnr.add(psnr);
        self.psnr_worst = Some(self.psnr_worst.map_or(psnr, |worst| worst.min(psnr)));
        if let Some(colours) = &meant.colours {
            let sharp = lab(shown);
            self.de76.add(mean_difference(&colours.sharp, &sharp, 1, difference_1976));
            self.de2000.add(mean_difference(&colours.sharp, &sharp, SPARSE, difference_2000));
            self.blurred.add(mean_difference(&colours.blurred, &blurred_lab(shown), 1, difference_1976));
        }
        if let (Some(before), Some(shown_before)) = (meant.before, &self.before) {
            let (flicker, share) = flicker([before, meant.image], [shown_before, shown]);
            self.flicker.add(flicker);
            self.flicker_share.add(share);
        }
        self.before = Some(shown.clone());
    }

    /// Returns the quality of all frames so far.
    pub(super) fn quality(&self) -> Quality {
        Quality {
            psnr: self.psnr.value(),
            psnr_worst: self.psnr_worst.unwrap_or_default(),
            de76: self.de76.value(),
            de2000: self.de2000.value(),
            blurred: self.blurred.value(),
            flicker: self.flicker.value(),
            flicker_share: self.flicker_share.value(),
        }
    }
}

fn psnr(a: &RgbImage, b: &RgbImage) -> f64 {
    let sum = a.as_raw().iter().zip(b.as_raw()).map(|(&a, &b)| u64::from(a.abs_diff(b)).pow(2)).sum::<u64>();
    if sum == 0 { 99.0 } else { 10.0 * (65_025.0 * a.as_raw().len() as f64 / sum as f64).log10() }
}

/// Returns the mean difference over every `step`th pixel.
fn mean_difference(
    a: &[[f32; 3]],
    b: &[[f32; 3]],
    step: usize,
    difference: impl Fn([f32; 3], [f32; 3]) -> f32,
) -> f64 {
    let pairs = a.iter().zip(b).step_by(step);
    let sum = pairs.filter(|(a, b)| a != b).map(|(a, b)| f64::from(difference(*a, *b))).sum::<f64>();
    sum / a.len().div_ceil(step) as f64
}

fn flicker(meant: [&RgbImage; 2], shown: [&RgbImage; 2]) -> (f64, f64) {
    let (mut still, mut changed, mut sum) = (0_u64, 0_u64, 0.0);
    let [before, now] = meant.map(|image| image.as_raw().as_chunks::<3>().0);
    let [shown_before, shown_now] = shown.map(|image| image.as_raw().as_chunks::<3>().0);
    for k in 0..now.len() {
        if before[k] == now[k] {
            still += 1;
            if shown_before[k] != shown_now[k] {
                changed += 1;
                sum += f64::from(difference_1976(lab_of(shown_before[k]), lab_of(shown_now[k])));
            }
        }
    }
    if still == 0 { (0.0, 0.0) } else { (sum / still as f64, changed as f64 / still as f64) }
}

fn linear(level: f32) -> f32 {
    let v = level / 255.0;
    if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// The linear light of the levels and, for means over 25 pixels, of multiples of a twenty-fifth of a level.
static LINEAR: LazyLock<Vec<f32>> =
    LazyLock::new(|| (0..=255 * 25).map(|sum| linear(sum as f32 / 25.0)).collect());

pub(super) fn lab_of(rgb: [u8; 3]) -> [f32; 3] {
    lab_of_linear(rgb.map(|level| LINEAR[usize::from(level) * 25]))
}

/// Converts linear sRGB to CIE L\*a\*b\* under D65.
fn lab_of_linear([r, g, b]: [f32; 3]) -> [f32; 3] {
    let f = |t: f32| if t > 216.0 / 24_389.0 { t.cbrt() } else { (24_389.0 / 27.0 * t + 16.0) / 116.0 };
    let x = f((0.412_456_4 * r + 0.357_576_1 * g + 0.180_437_5 * b) / 0.950_47);
    let y = f(0.212_672_9 * r + 0.715_152_2 * g + 0.072_175 * b);
    let z = f((0.019_333_9 * r + 0.119_192 * g + 0.950_304_1 * b) / 1.088_83);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn lab(image: &RgbImage) -> Vec<[f32; 3]> {
    image.as_raw().as_chunks::<3>().0.iter().map(|&rgb| lab_of(rgb)).collect()
}

/// Returns L\*a\*b\* of the mean levels over 5 x 5 pixels, fewer at the edges.
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
            let count = span.len() * rows.len();
            let mut sum = [0; 3];
            for column in &columns[span] {
                for k in 0..3 {
                    sum[k] += column[k];
                }
            }
            out.push(lab_of_linear(sum.map(|sum| match count {
                25 => LINEAR[sum as usize],
                _ => linear(sum as f32 / count as f32),
            })));
        }
    }
    out
}

pub(super) fn difference_1976(a: [f32; 3], b: [f32; 3]) -> f32 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f32>().sqrt()
}

/// Returns the difference by CIE 142-2001, in the form of Sharma, Wu and Dalal (2005).
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

    fn quality(meant: &[&RgbImage], shown: &[&RgbImage]) -> Quality {
        let mut judge = Judge::default();
        for k in 0..meant.len() {
            let before = k.checked_sub(1).map(|k| meant[k]);
            let colours = Some(Colours::of(meant[k]));
            judge.see(&Meant { image: meant[k], before, colours }, shown[k]);
        }
        judge.quality()
    }

    #[test]
    fn psnr_of_one_level_everywhere() {
        let (a, b) = (RgbImage::new(9, 9), RgbImage::from_pixel(9, 9, image::Rgb([1; 3])));
        assert!((psnr(&a, &b) - 48.1308).abs() < 1e-3);
        let both = quality(&[&a, &a], &[&a, &b]);
        assert!((both.psnr - (99.0 + 48.1308) / 2.0).abs() < 1e-3 && both.psnr_worst < 49.0, "{both:?}");
    }

    #[test]
    fn blur_of_a_checkerboard_is_almost_grey() {
        let board = RgbImage::from_fn(40, 40, |x, y| image::Rgb([((x + y) % 2 * 200) as u8; 3]));
        let grey = RgbImage::from_pixel(40, 40, image::Rgb([100; 3]));
        let quality = quality(&[&grey], &[&board]);
        assert!(quality.de76 > 30.0 && quality.blurred < 2.5, "{quality:?}");
    }

    #[test]
    fn a_part_of_the_pixels_tells_the_mean() {
        let dots = RgbImage::from_fn(320, 240, |x, y| image::Rgb([((x ^ y) % 8 * 9) as u8, 80, 90]));
        let grey = RgbImage::from_pixel(320, 240, image::Rgb([30, 80, 90]));
        let (a, b) = (lab(&dots), lab(&grey));
        let [all, some] = [1, SPARSE].map(|step| mean_difference(&a, &b, step, difference_2000));
        assert!((some / all - 1.0).abs() < 0.002, "{some} for {all}");
    }

    #[test]
    fn flicker_counts_still_pixels_only() {
        let of =
            |left: u8, right: u8| RgbImage::from_fn(2, 1, |x, _| image::Rgb([[left, right][x as usize]; 3]));
        let meant = [&of(0, 50), &of(0, 90)];
        assert_eq!(quality(&meant, &[&of(0, 50), &of(0, 10)]).flicker, 0.0);
        let moved = quality(&meant, &[&of(0, 50), &of(119, 90)]);
        assert!((moved.flicker - 50.0).abs() < 0.2 && moved.flicker_share == 1.0, "{moved:?}");
    }
}
