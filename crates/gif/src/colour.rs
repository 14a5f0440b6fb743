//! The colour space in which errors are measured.
//!
//! A picture is judged by its levels (PSNR) and by the eye (CIE Lab), and a palette that is best in one of them is
//! worse in the other. So a colour is a point with six coordinates: the sRGB levels, and `LAB_WEIGHT` times CIE
//! L\*a\*b\* (D65, CIE 15:2004). The squared distance is the sum of both errors. The chroma is compressed half way
//! from the CIE 1976 difference to that of CIE 2000, in which saturated colours differ less.
//!
//! Only +, -, x, / and square roots are used. IEEE 754 defines them to the bit, so the same frames give the same
//! bytes on every machine, whatever its mathematical library.

use std::sync::LazyLock;

/// The number of coordinates of a [`Point`].
pub(crate) const DIMENSIONS: usize = 6;
/// The weight of a unit of L\*a\*b\* relative to a level of sRGB.
pub(crate) const LAB_WEIGHT: f32 = 3.0;

/// The fall of the weight of a chroma difference per unit of chroma (CIE 142-2001, `S_C`).
const CHROMA_FALLOFF: f32 = 0.045;

/// A colour in the space in which the squared distance is the error.
pub(crate) type Point = [f32; DIMENSIONS];

/// Returns the squared distance of two points.
pub(crate) fn error(a: &Point, b: &Point) -> f32 {
    let mut sum = 0.0;
    for k in 0..DIMENSIONS {
        let d = a[k] - b[k];
        sum += d * d;
    }
    sum
}

/// Returns L\*a\*b\* of a colour. Its sRGB levels (0 to 255) may be fractions.
fn lab(rgb: [f32; 3]) -> [f32; 3] {
    let tables = &*TABLES;
    let linear = |k: usize| interpolate(&tables.linear, rgb[k]);
    let (r, g, b) = (linear(0), linear(1), linear(2));
    // The matrix of IEC 61966-2-1, its rows divided by the white point D65.
    let f = |x: f32, y: f32, z: f32| interpolate(&tables.lightness, (x * r + y * g + z * b) * STEPS as f32);
    let fx = f(0.412_456_4 / 0.950_47, 0.357_576_1 / 0.950_47, 0.180_437_5 / 0.950_47);
    let fy = f(0.212_672_9, 0.715_152_2, 0.072_175);
    let fz = f(0.019_333_9 / 1.088_83, 0.119_192 / 1.088_83, 0.950_304_1 / 1.088_83);
    [116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)]
}

/// Returns the point of a colour. Its sRGB levels (0 to 255) may be fractions.
pub(crate) fn point(rgb: [f32; 3]) -> Point {
    let [l, a, b] = lab(rgb);
    // The slope of c * closer is 1 / sqrt(1 + CHROMA_FALLOFF c), between 1 (CIE 1976) and its square (CIE 2000).
    let chroma = (a * a + b * b).sqrt();
    let closer = 2.0 / (1.0 + (1.0 + CHROMA_FALLOFF * chroma).sqrt());
    let weight = LAB_WEIGHT * closer;
    [rgb[0], rgb[1], rgb[2], LAB_WEIGHT * l, weight * a, weight * b]
}

/// Returns the point of a colour with whole levels.
pub(crate) fn point_of(rgb: [u8; 3]) -> Point {
    point([f32::from(rgb[0]), f32::from(rgb[1]), f32::from(rgb[2])])
}

/// An approximation of [`error`] for colours of whole levels that are close together. Takes a fraction of the time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LocalMetric(&'static [[f32; 6]; 4096]);

impl LocalMetric {
    pub(crate) fn new() -> Self {
        Self(&METRIC)
    }

    /// Computes the tables now rather than on first use.
    pub(crate) fn prepare() {
        LazyLock::force(&METRIC);
    }

    pub(crate) fn error(self, a: [u8; 3], b: [u8; 3]) -> f32 {
        self.around(a).error(levels(a), levels(b))
    }

    /// Returns the metric near one colour.
    pub(crate) fn around(self, [r, g, b]: [u8; 3]) -> QuadraticForm {
        QuadraticForm(&self.0[usize::from(r >> 4) << 8 | usize::from(g >> 4) << 4 | usize::from(b >> 4)])
    }
}

/// A quadratic form in the differences of levels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct QuadraticForm(&'static [f32; 6]);

// Written out, because mapped arrays are several times slower here.
impl QuadraticForm {
    pub(crate) fn error(self, a: [f32; 3], b: [f32; 3]) -> f32 {
        let (r, g, b) = (a[0] - b[0], a[1] - b[1], a[2] - b[2]);
        let form = self.0;
        r * (form[0] * r + form[3] * g + form[4] * b) + g * (form[1] * g + form[5] * b) + form[2] * b * b
    }
}

/// Converts the levels of a colour to `f32`.
pub(crate) fn levels(rgb: [u8; 3]) -> [f32; 3] {
    [f32::from(rgb[0]), f32::from(rgb[1]), f32::from(rgb[2])]
}

/// Returns the squared difference of levels, weighted by the brightness of the channels: 6 if all
/// levels differ by one.
pub(crate) fn level_error(a: [u8; 3], b: [u8; 3]) -> u32 {
    let (r, g, b) = (a[0].abs_diff(b[0]), a[1].abs_diff(b[1]), a[2].abs_diff(b[2]));
    let square = |d: u8| u32::from(d) * u32::from(d);
    2 * square(r) + 3 * square(g) + square(b)
}

/// Returns the squared distance of levels, which is a part of [`error`].
pub(crate) fn levels_apart(a: [u8; 3], b: [u8; 3]) -> u32 {
    let square = |k: usize| u32::from(a[k].abs_diff(b[k])) * u32::from(a[k].abs_diff(b[k]));
    square(0) + square(1) + square(2)
}

/// Returns the largest difference of a level.
pub(crate) fn levels_off(a: [u8; 3], b: [u8; 3]) -> u8 {
    a[0].abs_diff(b[0]).max(a[1].abs_diff(b[1])).max(a[2].abs_diff(b[2]))
}

/// Returns the index of the colour with the smallest [`levels_off`], and that difference.
pub(crate) fn closest(colours: &[[u8; 3]], rgb: [u8; 3]) -> (u8, u8) {
    let off = colours.iter().map(|&colour| levels_off(colour, rgb));
    (0..=u8::MAX).zip(off).fold((0, u8::MAX), |best, now| if now.1 < best.1 { now } else { best })
}

/// The quadratic form that approximates [`error`] in each of 16 x 16 x 16 cells of sRGB: the coefficients of r², g²,
/// b², rg, rb and gb.
static METRIC: LazyLock<Box<[[f32; 6]; 4096]>> = LazyLock::new(|| {
    let mut metric = Box::new([[0.0; 6]; 4096]);
    for (cell, metric) in metric.iter_mut().enumerate() {
        *metric = {
            let middle = [cell >> 8, cell >> 4 & 15, cell & 15].map(|k| (16 * k + 8) as f32);
            let slope = [0, 1, 2].map(|k| {
                let step = |sign: f32| {
                    let mut rgb = middle;
                    rgb[k] += sign * 8.0;
                    point(rgb)
                };
                let (up, down) = (step(1.0), step(-1.0));
                std::array::from_fn::<f32, DIMENSIONS, _>(|at| (up[at] - down[at]) / 16.0)
            });
            let product =
                |a: usize, b: usize| (0..DIMENSIONS).map(|k| slope[a][k] * slope[b][k]).sum::<f32>();
            let (rg, rb, gb) = (product(0, 1), product(0, 2), product(1, 2));
            [product(0, 0), product(1, 1), product(2, 2), 2.0 * rg, 2.0 * rb, 2.0 * gb]
        };
    }
    metric
});

const STEPS: usize = 4096;

struct Tables {
    /// The linear light of each sRGB level.
    linear: Vec<f32>,
    /// The `f` of L\*a\*b\* for linear light in steps of 1 / `STEPS`.
    lightness: Vec<f32>,
}

static TABLES: LazyLock<Tables> = LazyLock::new(|| {
    let linear = |level: usize| {
        let v = level as f64 / 255.0;
        if v <= 0.040_45 {
            v / 12.92
        } else {
            let v = (v + 0.055) / 1.055;
            v * v * root(v * v, 5)
        }
    };
    let lightness = |step: usize| {
        let t = step as f64 / STEPS as f64;
        if t > 216.0 / 24_389.0 { root(t, 3) } else { (24_389.0 / 27.0 * t + 16.0) / 116.0 }
    };
    Tables {
        linear: (0..256).map(|level| linear(level) as f32).collect(),
        lightness: (0..=STEPS).map(|step| lightness(step) as f32).collect(),
    }
});

fn interpolate(table: &[f32], at: f32) -> f32 {
    let below = (at as usize).min(table.len() - 2);
    let part = at - below as f32;
    table[below] * (1.0 - part) + table[below + 1] * part
}

/// Returns the `n`th root of a number in (0, 1], by Newton's method.
fn root(x: f64, n: i32) -> f64 {
    let mut y = 1.0;
    loop {
        let power = (1..n).fold(1.0, |product, _| product * y);
        // Each step approaches the root from above, until rounding stops it.
        let next = y - (y - x / power) / f64::from(n);
        if next >= y {
            return y;
        }
        y = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lab_of_known_colours() {
        for (rgb, expected) in [
            ([255, 255, 255], [100.0, 0.0, 0.0]),
            ([0, 0, 0], [0.0, 0.0, 0.0]),
            ([255, 0, 0], [53.24, 80.09, 67.20]),
            ([0, 255, 0], [87.73, -86.18, 83.18]),
            ([0, 0, 255], [32.30, 79.19, -107.86]),
            ([10, 20, 30], [5.95, -0.67, -8.14]),
        ] {
            let found = lab(rgb.map(|level: u8| f32::from(level)));
            for k in 0..3 {
                assert!((found[k] - expected[k]).abs() < 0.15, "{rgb:?}: {found:?} for {expected:?}");
            }
        }
    }

    #[test]
    fn near_error_is_near() {
        for k in 0..2_000_u32 {
            let [r, g, b, d] = k.wrapping_mul(2_654_435_761).to_le_bytes().map(|v| v.clamp(8, 247));
            let near = [r + d % 5, g + 4 - d % 3, b - d % 7];
            let (quick, exact) =
                (LocalMetric::new().error([r, g, b], near), error(&point_of([r, g, b]), &point_of(near)));
            assert!((quick - exact).abs() <= 0.6 * exact + 0.1, "{r} {g} {b} {near:?}: {quick} for {exact}");
        }
    }

    #[test]
    fn root_is_a_root() {
        for x in [1e-3, 0.1, 0.5, 1.0] {
            assert!((root(x, 3) - f64::cbrt(x)).abs() < 1e-12);
            assert!((root(x, 5) - x.powf(0.2)).abs() < 1e-12);
        }
    }
}
