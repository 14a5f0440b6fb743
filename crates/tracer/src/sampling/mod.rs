//! The points of the rays of a pixel that is a mean: a point of its square, of the lens and of each light, and a
//! moment.
//!
//! Each of these takes one to three dimensions of a [sequence](sobol) that fills the cube of all of them evenly. Each
//! pixel has its own arrangement of the sequence, so that the errors of neighbours are independent. A point depends
//! only on the column, the row and the number of the sample, so parts that do not move from frame to frame do not
//! flicker. [`places`] maps numbers to places. [`film`] sums samples and decides which pixels need more. This module
//! does not depend on how rays are traced.

pub(crate) mod bright;
pub(crate) mod cube_table;
pub(crate) mod film;
pub(crate) mod guide;
pub(crate) mod lights;
pub(crate) mod paths;
pub(crate) mod places;
pub(crate) mod rough;
pub(crate) mod sky_table;
mod sobol;

use rayfold_scene::{Camera, Light, Scene};

/// The number of dimensions of the pixel's square. They come first, because every picture has them.
const SQUARE: usize = 2;

/// The dimensions of each feature. A feature that a scene lacks takes none, so that the lowest dimensions, which are
/// the most even, are used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Dimensions {
    /// For each light with an extent, the first of its dimensions: three of a lamp, two of a sun, in the order of the
    /// script.
    pub(crate) lights: Vec<Option<usize>>,
    /// The first of the two dimensions of the lens.
    pub(crate) lens: Option<usize>,
    pub(crate) time: Option<usize>,
    /// The number of dimensions.
    count: usize,
    /// The number of directions that paths draw after scattering hits, two dimensions each.
    directions: usize,
}

impl Dimensions {
    /// Returns the dimensions for a scene at these moments. There is a time if there is more than one moment.
    pub(crate) fn new(moments: &[Scene]) -> Self {
        let lights = moments.iter().map(|scene| scene.lights.len()).max().unwrap_or(0);
        let mut count = SQUARE;
        let mut take = |of_these: usize| (of_these > 0).then(|| (count, count += of_these).0);
        let coordinates = |light: &Light| lights::shape(light).coordinates();
        let lights = (0..lights)
            .map(|k| take(moments.iter().map(|m| m.lights.get(k).map_or(0, coordinates)).max().unwrap_or(0)))
            .collect();
        let has_lens = moments.iter().any(has_lens);
        let lens = take(if has_lens { 2 } else { 0 });
        let time = take(usize::from(moments.len() > 1));
        let directions = moments.iter().map(Scene::indirect_bounces).max().unwrap_or(0) as usize;
        Self { lights, lens, time, count, directions }
    }
}

/// Returns whether rays start in more than one point of a lens.
pub(crate) fn has_lens(scene: &Scene) -> bool {
    scene.lens.radius() > 0.0 && scene.camera != Camera::Orthographic
}

/// Returns the seed of a pixel's points.
#[inline(always)]
pub(crate) const fn pixel_seed(column: u32, row: u32) -> u32 {
    sobol::mixed(column ^ sobol::mixed(row ^ 0x9e37_79b9))
}

/// Returns the coordinate of a sample along a dimension, above 0 and below 1.
pub(crate) fn coordinate(pixel_seed: u32, sample: u32, dimension: usize) -> f64 {
    unit(sobol::scrambled(reversed(pixel_seed, sample, dimension), seed(pixel_seed, dimension)))
}

fn in_pairs(pixel_seed: u32, sample: u32, dimension: usize) -> f64 {
    let order = seed(pixel_seed, 0x1000 + dimension / 2);
    let sample = sobol::scrambled(sample.reverse_bits(), order).reverse_bits();
    unit(sobol::scrambled(sobol::reversed(sample, dimension % 2), seed(pixel_seed, dimension)))
}

fn independent(pixel_seed: u32, sample: u32, dimension: usize) -> f64 {
    unit(sobol::mixed(seed(pixel_seed, dimension) ^ sobol::mixed(sample.wrapping_add(0x51ed_270b))))
}

/// Returns the point of a sample along a dimension, before it is scrambled, as 32 bits in reverse order. Dimensions
/// without numbers of their own use those of others, with the samples in another order.
fn reversed(pixel_seed: u32, sample: u32, dimension: usize) -> u32 {
    let set = (dimension / sobol::OWN) as u32;
    let sample = if set == 0 {
        sample
    } else {
        let seed = sobol::mixed(pixel_seed.wrapping_add(set.wrapping_mul(0x85eb_ca6b)));
        sobol::scrambled(sample.reverse_bits(), seed).reverse_bits()
    };
    sobol::reversed(sample, dimension % sobol::OWN)
}

#[inline(always)]
const fn seed(pixel_seed: u32, dimension: usize) -> u32 {
    sobol::mixed(pixel_seed.wrapping_add((dimension as u32 + 1).wrapping_mul(0x9e37_79b9)))
}

/// Returns the middle of the cell that 32 bits in reverse order denote.
#[inline(always)]
const fn unit(reversed: u32) -> f64 {
    (reversed.reverse_bits() as f64 + 0.5) * (1.0 / 4_294_967_296.0)
}

/// The arrangement of the points of samples. All but the default are for measurements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sampler {
    /// Sobol's sequence in all dimensions, with Owen scrambling.
    #[default]
    Sobol,
    /// Its first two dimensions for each pair of dimensions, in another order for each.
    Pairs,
    /// Independent random points.
    Independent,
    /// The default, with the points of other pixels: a ground truth that shares no points with a picture.
    Others(u8),
}

impl Sampler {
    /// Returns the number that is added to the column of a pixel to find the pixel whose points are used.
    const fn aside(self) -> u32 {
        match self {
            Self::Sobol | Self::Pairs | Self::Independent => 0,
            Self::Others(set) => 0x8000_0000 | (set as u32) << 16,
        }
    }
}

/// The largest number of samples whose coordinates are computed at once.
pub(crate) const BATCH: usize = 256;

/// The points of samples, before they are scrambled: the same for all pixels.
#[derive(Debug)]
pub(crate) struct Points {
    sampler: Sampler,
    /// The number of columns between a pixel and the one whose points it uses.
    aside: u32,
    first: u32,
    /// A row for each dimension.
    rows: Vec<Vec<u32>>,
}

impl Points {
    /// Makes the points of the samples from `first` up to `end`.
    pub(crate) fn new(dimensions: &Dimensions, sampler: Sampler, first: u32, end: u32) -> Self {
        let own = (dimensions.count + 2 * dimensions.directions).min(sobol::OWN);
        let row = |dimension| (first..end).map(|sample| sobol::reversed(sample, dimension)).collect();
        Self { sampler, aside: sampler.aside(), first, rows: (0..own).map(row).collect() }
    }

    /// Returns the seed of a pixel's points.
    #[inline(always)]
    pub(crate) const fn pixel_seed(&self, column: u32, row: u32) -> u32 {
        pixel_seed(column.wrapping_add(self.aside), row)
    }

    /// Returns the coordinate of a sample of a pixel along a dimension.
    #[inline(always)]
    pub(crate) fn coordinate(&self, dimension: usize, pixel_seed: u32, sample: u32) -> f64 {
        match self.sampler {
            Sampler::Sobol | Sampler::Others(_) => coordinate(pixel_seed, sample, dimension),
            Sampler::Pairs => in_pairs(pixel_seed, sample, dimension),
            Sampler::Independent => independent(pixel_seed, sample, dimension),
        }
    }

    /// Computes the coordinates of at most [`BATCH`] samples of pixels along a dimension, as [`coordinate`] does.
    #[inline(always)]
    pub(crate) fn coordinates(
        &self,
        dimension: usize,
        pixel_seeds: &[u32],
        samples: &[u32],
        into: &mut [f64],
    ) {
        let is_sobol = matches!(self.sampler, Sampler::Sobol | Sampler::Others(_));
        match self.rows.get(dimension).filter(|_| is_sobol) {
            Some(row) => {
                // In two loops, of which the second has no branch and is done in packets.
                let mut points = [0; BATCH];
                for (point, &sample) in points.iter_mut().zip(samples) {
                    *point = row[(sample - self.first) as usize];
                }
                for ((into, &pixel), &point) in into.iter_mut().zip(pixel_seeds).zip(&points) {
                    *into = unit(sobol::scrambled(point, seed(pixel, dimension)));
                }
            }
            None => {
                for ((into, &pixel), &sample) in into.iter_mut().zip(pixel_seeds).zip(samples) {
                    *into = self.coordinate(dimension, pixel, sample);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use rayfold_scene::{DirectionalLight, Lamp, Lens, Screen};

    use super::*;

    fn scene(lens: f64, lights: Vec<Light>) -> Scene {
        let eye = rayfold_scene::Look::new(DVec3::Z, DVec3::ZERO, 40.0, None).unwrap();
        let mut scene = Scene::new(Screen::new(1, 1).unwrap(), Camera::Look(eye));
        scene.lens = Lens::new(lens, None).unwrap();
        scene.lights = lights.into();
        scene
    }

    fn sun(angle: f64) -> Light {
        DirectionalLight::new(DVec3::ONE, DVec3::NEG_Y).unwrap().spanning(angle).unwrap().into()
    }

    fn lamp(radius: f64) -> Light {
        Lamp::new(DVec3::ONE, DVec3::Y, radius, 0.0).unwrap().into()
    }

    #[test]
    fn only_what_a_scene_has_takes_dimensions() {
        let still = Dimensions::new(&[scene(0.0, vec![sun(0.0), lamp(1.0), sun(2.0)])]);
        assert_eq!((still.lights, still.lens, still.time), (vec![None, Some(2), Some(5)], None, None));
        let moments = [scene(0.0, vec![lamp(0.0)]), scene(0.5, vec![lamp(0.25)])];
        let moving = Dimensions::new(&moments);
        assert_eq!((moving.lights, moving.lens, moving.time), (vec![Some(2)], Some(5), Some(7)));
        assert_eq!(moving.count, 8);
        let mut parallel = scene(0.5, vec![]);
        parallel.camera = Camera::Orthographic;
        assert_eq!(Dimensions::new(&[parallel]).lens, None);
    }

    #[test]
    fn many_pixels_at_once_have_the_points_that_each_has() {
        let dimensions = Dimensions { lights: vec![], lens: None, time: None, count: 50, directions: 0 };
        let points = Points::new(&dimensions, Sampler::Sobol, 5, 40);
        let seeds: Vec<u32> = (0..35).map(|k| pixel_seed(k, 7 * k)).collect();
        let samples: Vec<u32> = (5..40).collect();
        for dimension in [0, 1, 20, 21, 49] {
            let mut coordinates = [0.0; 35];
            points.coordinates(dimension, &seeds, &samples, &mut coordinates);
            for ((x, &seed), &sample) in coordinates.iter().zip(&seeds).zip(&samples) {
                assert_eq!(*x, coordinate(seed, sample, dimension));
                assert!(*x > 0.0 && *x < 1.0);
            }
        }
    }

    #[test]
    fn dimensions_without_numbers_of_their_own_fill_their_cells_too() {
        for dimension in [21, 40, 43] {
            let mut cells: Vec<u32> = (0..64).map(|k| (coordinate(99, k, dimension) * 64.0) as u32).collect();
            cells.sort_unstable();
            assert_eq!(cells, (0..64).collect::<Vec<_>>(), "{dimension}");
        }
    }

    /// The error of the mean of a discontinuous function falls faster than with independent points. A slope of -1/2
    /// would mean a wrong shuffle.
    #[test]
    fn errors_of_edges_fall_with_the_slope_of_nets() {
        let error = |samples: u32| {
            let squares: f64 = (0..2000)
                .map(|pixel| {
                    let seed = pixel_seed(pixel, 3);
                    let below = (0..samples)
                        .filter(|&k| coordinate(seed, k, 0) + 0.618 * coordinate(seed, k, 1) < 0.75)
                        .count();
                    // The area below the line: a trapezium, whose upper end is at the right edge.
                    let area = 0.75 - 0.5 * 0.618;
                    (below as f64 / f64::from(samples) - area).powi(2)
                })
                .sum();
            (squares / 2000.0).sqrt()
        };
        let slope = (error(256) / error(16)).log2() / 4.0;
        assert!((-0.85..-0.68).contains(&slope), "{slope}");
    }
}
