//! LDR-FLIP: the perceived difference between two images that are shown alternately.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild, "FLIP: A difference evaluator for alternating
//! images", Proc. ACM Comput. Graph. Interact. Tech. 3(2), 2020. The constants have the names of the paper. The result
//! is the mean over the pixels, from 0 (no difference) to 1, at 67 pixels per degree of the field of view.

use image::RgbImage;

const PIXELS_A_DEGREE: f64 = 67.0;

/// The D65 white of linear sRGB.
const WHITE: [f64; 3] = [0.950_428_545, 1.0, 1.088_900_371];

type Plane = Vec<f64>;

/// Returns the mean difference of two images of the same size.
pub(crate) fn flip(a: &RgbImage, b: &RgbImage) -> f64 {
    let size = (a.width() as usize, a.height() as usize);
    let (a, b) = (opponents(a), opponents(b));
    let color = color_difference(&a, &b, size);
    let feature = feature_difference(&a[0], &b[0], size);
    let sum: f64 = color.iter().zip(feature).map(|(c, f)| c.powf(1.0 - f)).sum();
    sum / (size.0 * size.1) as f64
}

/// Converts sRGB to the three planes of YCxCz.
fn opponents(image: &RgbImage) -> [Plane; 3] {
    let mut planes = [const { Vec::new() }; 3];
    for pixel in image.pixels() {
        let linear = pixel.0.map(|level| {
            let v = f64::from(level) / 255.0;
            if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
        });
        let [x, y, z] = over_white(to_xyz(linear));
        for (plane, value) in planes.iter_mut().zip([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]) {
            plane.push(value);
        }
    }
    planes
}

fn to_xyz([r, g, b]: [f64; 3]) -> [f64; 3] {
    [
        0.412_390_799 * r + 0.357_584_339 * g + 0.180_480_788 * b,
        0.212_639_006 * r + 0.715_168_679 * g + 0.072_192_315 * b,
        0.019_330_819 * r + 0.119_194_780 * g + 0.950_532_152 * b,
    ]
}

fn to_rgb([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        3.240_969_942 * x - 1.537_383_178 * y - 0.498_610_760 * z,
        -0.969_243_636 * x + 1.875_967_502 * y + 0.041_555_057 * z,
        0.055_630_080 * x - 0.203_976_959 * y + 1.056_971_514 * z,
    ]
}

fn over_white(xyz: [f64; 3]) -> [f64; 3] {
    [xyz[0] / WHITE[0], xyz[1] / WHITE[1], xyz[2] / WHITE[2]]
}

/// Converts YCxCz, clamped to the range of a display, to CIELAB with Hunt's adjustment: dark colours are less
/// saturated.
fn perceived([y, cx, cz]: [f64; 3]) -> [f64; 3] {
    let y = (y + 16.0) / 116.0;
    let (x, z) = (y + cx / 500.0, y - cz / 200.0);
    let rgb = to_rgb([x * WHITE[0], y * WHITE[1], z * WHITE[2]]).map(|c| c.clamp(0.0, 1.0));
    hunt(rgb)
}

fn hunt(rgb: [f64; 3]) -> [f64; 3] {
    let delta: f64 = 6.0 / 29.0;
    let [x, y, z] = over_white(to_xyz(rgb))
        .map(|t| if t > delta.powi(3) { t.cbrt() } else { t / (3.0 * delta * delta) + 4.0 / 29.0 });
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

/// Returns the HyAB distance: the absolute difference in lightness plus the Euclidean distance in chroma.
fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

fn color_difference(a: &[Plane; 3], b: &[Plane; 3], size: (usize, usize)) -> Plane {
    let (exponent, knee, at_knee) = (0.7, 0.4, 0.95);
    let largest = distance(hunt([0.0, 1.0, 0.0]), hunt([0.0, 0.0, 1.0])).powf(exponent);
    let (a, b) = (filtered(a, size), filtered(b, size));
    let pixel = |planes: &[Plane; 3], k: usize| perceived([planes[0][k], planes[1][k], planes[2][k]]);
    (0..size.0 * size.1)
        .map(|k| {
            let d = distance(pixel(&a, k), pixel(&b, k)).powf(exponent);
            if d < knee * largest {
                at_knee / (knee * largest) * d
            } else {
                at_knee + (d - knee * largest) / (largest - knee * largest) * (1.0 - at_knee)
            }
        })
        .collect()
}

/// Filters each plane by the contrast sensitivity of the eye.
fn filtered(planes: &[Plane; 3], size: (usize, usize)) -> [Plane; 3] {
    // Pairs (a, b) of sums of Gaussians a·sqrt(pi/b)·exp(-pi²x²/b), x in degrees: luminance, red-green, blue-yellow.
    let sums: [&[(f64, f64)]; 3] = [&[(1.0, 0.0047)], &[(1.0, 0.0053)], &[(34.1, 0.04), (13.5, 0.025)]];
    let radius = (3.0 * (0.04 / (2.0 * std::f64::consts::PI.powi(2))).sqrt() * PIXELS_A_DEGREE).ceil() as i32;
    std::array::from_fn(|k| {
        let mut sum = vec![0.0; planes[k].len()];
        let mut total = 0.0;
        for &(a, b) in sums[k] {
            let kernel: Vec<f64> = (-radius..=radius)
                .map(|i| {
                    let x = f64::from(i) / PIXELS_A_DEGREE;
                    (-std::f64::consts::PI.powi(2) * x * x / b).exp()
                })
                .collect();
            let weight = a * (std::f64::consts::PI / b).sqrt();
            let mass: f64 = kernel.iter().sum();
            total += weight * mass * mass;
            for (s, f) in sum.iter_mut().zip(convolved(&planes[k], size, &kernel, &kernel)) {
                *s += weight * f;
            }
        }
        sum.iter().map(|s| s / total).collect()
    })
}

/// Returns the larger of the differences in edges and in points.
fn feature_difference(a: &Plane, b: &Plane, size: (usize, usize)) -> Plane {
    let width = 0.5 * 0.082 * PIXELS_A_DEGREE;
    let radius = (3.0 * width).ceil() as i32;
    let gauss = |i: i32| (-f64::from(i * i) / (2.0 * width * width)).exp();
    let smooth: Vec<f64> = (-radius..=radius).map(gauss).collect();
    let edge: Vec<f64> = (-radius..=radius).map(|i| -f64::from(i) * gauss(i)).collect();
    let point: Vec<f64> =
        (-radius..=radius).map(|i| (f64::from(i * i) / (width * width) - 1.0) * gauss(i)).collect();
    let strength = |plane: &Plane, kernel: &[f64]| {
        let plane: Plane = plane.iter().map(|y| (y + 16.0) / 116.0).collect();
        let kernel = balanced(kernel, smooth.iter().sum());
        let across = convolved(&plane, size, &kernel, &smooth);
        let down = convolved(&plane, size, &smooth, &kernel);
        across.iter().zip(down).map(|(x, y)| x.hypot(y)).collect::<Plane>()
    };
    let differences = [&edge, &point].map(|kernel| {
        strength(a, kernel).iter().zip(strength(b, kernel)).map(|(a, b)| (a - b).abs()).collect::<Plane>()
    });
    differences[0]
        .iter()
        .zip(&differences[1])
        .map(|(edge, point)| (std::f64::consts::FRAC_1_SQRT_2 * edge.max(*point)).sqrt())
        .collect()
}

/// Scales the positive weights to the sum 1 and the negative ones to -1, for a kernel that is then multiplied by one
/// with the sum `other`.
fn balanced(kernel: &[f64], other: f64) -> Vec<f64> {
    let mass = |sign: f64| kernel.iter().map(|k| (sign * k).max(0.0)).sum::<f64>() * other;
    let (up, down) = (mass(1.0), mass(-1.0));
    kernel.iter().map(|&k| if k > 0.0 { k / up } else { k / down }).collect()
}

/// Convolves the rows with one kernel, then the columns with the other. Pixels outside the image repeat its border.
fn convolved(plane: &Plane, (width, height): (usize, usize), rows: &[f64], columns: &[f64]) -> Plane {
    let at = |k: usize, offset: usize, kernel: &[f64], last: usize| {
        (k + offset).saturating_sub(kernel.len() / 2).min(last)
    };
    let mut across = vec![0.0; plane.len()];
    for y in 0..height {
        let row = &plane[y * width..(y + 1) * width];
        for x in 0..width {
            across[y * width + x] =
                rows.iter().enumerate().map(|(o, w)| w * row[at(x, o, rows, width - 1)]).sum();
        }
    }
    let mut down = vec![0.0; plane.len()];
    for y in 0..height {
        for (o, w) in columns.iter().enumerate() {
            let from = at(y, o, columns, height - 1) * width;
            for x in 0..width {
                down[y * width + x] += w * across[from + x];
            }
        }
    }
    down
}

#[cfg(test)]
mod tests {
    use image::Rgb;

    use super::*;

    fn image(draw: impl Fn(u32, u32) -> u8) -> RgbImage {
        RgbImage::from_fn(48, 40, |x, y| Rgb([draw(x, y); 3]))
    }

    #[test]
    fn the_same_image_does_not_differ() {
        let stripes = image(|x, y| (5 * x + 3 * y) as u8);
        assert_eq!(flip(&stripes, &stripes), 0.0);
    }

    #[test]
    fn differences_are_symmetric_and_grow() {
        let grey = image(|_, _| 100);
        let little = flip(&grey, &image(|_, _| 101));
        let more = flip(&grey, &image(|_, _| 160));
        let dot = image(|x, y| if (x, y) == (20, 20) { 255 } else { 100 });
        assert!(0.0 < little && little < 0.05 && little < more && more < 1.0);
        assert!((flip(&grey, &dot) - flip(&dot, &grey)).abs() < 1e-12);
        assert!(flip(&grey, &dot) < more);
    }

    #[test]
    fn black_and_white_differ_by_nearly_all() {
        let difference = flip(&image(|_, _| 0), &image(|_, _| 255));
        assert!((0.95..=1.0).contains(&difference), "{difference}");
    }

    #[test]
    fn a_flat_plane_is_not_changed_by_the_eye() {
        let flat = opponents(&image(|_, _| 90));
        let seen = filtered(&flat, (48, 40));
        assert!((0..3).all(|k| (seen[k][777] - flat[k][777]).abs() < 1e-9));
    }
}
