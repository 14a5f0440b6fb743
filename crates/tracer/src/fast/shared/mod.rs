//! Objects that share a part of their surfaces. There the object that comes first in the script is seen.
//!
//! Two objects may share a part of their surfaces: a label and its bottle, a picture and its wall. A ray hits the two
//! at distances that differ by some roundoffs, so that the nearest hit alone would be random. Before the first pixel
//! the pairs of such objects are found by their numbers, in `f64` (`pairs`). If a ray has hit an object of a pair, the
//! objects of its pairs that come before it are tested again. The first of them that is hit within the bound on the
//! rounding errors of both counts (`settle`). So the visible object depends neither on the order of the search nor on
//! other objects.
//!
//! Objects whose hits are the same bit for bit need no pair: faces perpendicular to an axis, and triangles whose planes
//! have the same numbers.

pub(super) mod surface;

pub(super) use self::surface::{Flat, Plain, Ring, Side, Surface, is_square};
use crate::fast::arithmetic::real::Real;

/// The distance within which hits count as equal, in roundoffs of the numbers of both objects and of the distance. It
/// is the distance of surfaces that are meant to coincide ([`surface::SAME`]), plus the same again for the errors of
/// the tests of bodies.
pub(super) const EQUAL: f64 = 128.0;

/// The objects that share surfaces.
#[derive(Clone, Debug)]
pub(super) struct SharedSurfaces {
    /// The start of the list of each object, and the end of the last list.
    starts: Vec<u32>,
    /// For each object, the objects that come before it and share a surface with it, in order.
    earlier: Vec<Earlier>,
    /// For each object, the size of the largest numbers of itself and of those that share a surface with it; 0 if there
    /// are none.
    sizes: Vec<f64>,
}

/// An object that shares a surface with one that comes later.
#[derive(Clone, Copy, Debug)]
pub(super) struct Earlier {
    pub(super) order: u32,
    /// The size of the numbers of both that define the place of the surface.
    pub(super) size: f64,
}

/// Two objects that share a surface, by their positions in the script.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pair {
    pub(super) first: u32,
    pub(super) second: u32,
    /// The size of the numbers that define the place of the surface.
    pub(super) size: f64,
}

impl SharedSurfaces {
    /// Makes the lists for a scene of `count` objects from the pairs, which are sorted by the second object and then by
    /// the first.
    pub(super) fn of_pairs(pairs: &[Pair], count: usize) -> Self {
        let mut starts = vec![0u32; count + 1];
        let mut sizes = vec![0f64; count];
        let mut earlier = Vec::with_capacity(pairs.len());
        for &Pair { first, second, size } in pairs {
            starts[second as usize + 1] += 1;
            earlier.push(Earlier { order: first, size });
            for order in [first, second] {
                sizes[order as usize] = sizes[order as usize].max(size);
            }
        }
        for at in 0..count {
            starts[at + 1] += starts[at];
        }
        Self { starts, earlier, sizes }
    }

    /// Returns the objects that share a surface with an object and come before it.
    pub(super) fn earlier(&self, order: usize) -> &[Earlier] {
        &self.earlier[self.starts[order] as usize..self.starts[order + 1] as usize]
    }

    /// Returns the distance by which new rays start farther off an object than its own numbers require, so that they
    /// are also off all objects that share its surface.
    pub(super) fn offset<E: Real>(&self, order: E) -> E {
        E::narrow(EQUAL * E::ROUNDOFF * self.sizes[order.to_index()])
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use rayfold_scene::{Camera, Disc, Limits, Material, Object, Scene, Screen, Torus, Triangle, parse};

    use crate::probe::nearest_hits;
    use crate::{Precision, RenderOptions, precision};

    fn scene(objects: Vec<Object>) -> Scene {
        let mut scene = Scene::new(Screen::new(4, 3).unwrap(), Camera::Orthographic);
        scene.objects = objects.into();
        scene
    }

    #[test]
    fn a_ring_is_met_at_the_same_distance_whatever_else_is_met() {
        let ring = || -> Object {
            Torus::new(0.8, 0.25, DVec3::Y * 0.4, DVec3::Z, Material::default()).unwrap().into()
        };
        let wall = |z: f64| -> Object {
            Disc::new(9.0, DVec3::Z * z, DVec3::new(0.0, 0.01, 1.0), Material::default()).unwrap().into()
        };
        let mut rng = fastrand::Rng::with_seed(34);
        let mut random = || DVec3::new(rng.f64(), rng.f64(), rng.f64()) * 2.0 - 1.0;
        let rays: Vec<_> = (0..4000)
            .map(|_| {
                let (origin, target) = (DVec3::new(0.0, 0.0, 5.0) + random(), random());
                (origin, (target - origin).normalize())
            })
            .collect();
        let options = RenderOptions::default();
        let hits = |objects| nearest_hits(&scene(objects), &rays, &options).unwrap();
        // The discs are met first, as they come first in the tree.
        let alone = hits(vec![ring()]);
        for z in [-0.3, -0.1, 0.0, 0.1] {
            let beside = hits(vec![wall(z), ring()]);
            let both = alone.iter().zip(&beside).filter_map(|(a, b)| Some((a.as_ref()?, b.as_ref()?)));
            let met: Vec<_> = both.filter(|(_, b)| b.object == 1).collect();
            assert!(met.len() > 300, "{}", met.len());
            assert!(met.iter().all(|(a, b)| a.distance == b.distance), "before a wall at {z}");
        }
    }

    /// Their planes have the same numbers, but rays hit them at different distances, because these depend on the
    /// centres.
    #[test]
    fn of_discs_that_are_tilted_by_less_than_a_roundoff_the_first_is_met() {
        let eye = DVec3::new(-39.703_401_364_447_09, 0.766_533_590_484_827_9, -2.464_513_971_398_901);
        let text = "Screen 40 32
            Look -39.70340136444709 0.7665335904848279 -2.464513971398901 -37.293 0 0 46
            Disc .41888635328496 -37.61664068823529 .32829385205500167 -.8155749021454818 6.123233995736764e-17 -1.2246467991473532e-16 -1 1 0 0 0 0 0
            Disc 1.0956250820334263 -37.44393318010792 .007217480117956848 -.8155749021454818 6.123233995736764e-17 -1.2246467991473532e-16 -1 0 1 0 0 0 0
            Trace";
        let scene = parse("a.txt", text.as_bytes(), &Limits::default()).script.unwrap().frame(0).unwrap();
        let mut rng = fastrand::Rng::with_seed(3_008_409);
        let rays: Vec<_> = (0..2000)
            .map(|_| {
                let mut aside = || DVec3::new(rng.f64() - 0.5, rng.f64() - 0.5, 0.0) * 0.5;
                let target =
                    DVec3::new(-37.616_640_688_235_29, 0.328_293_852_055_001_67, -0.815_574_902_145_481_8);
                let origin = eye + 2.0 * aside();
                (origin, (target + aside() - origin).normalize())
            })
            .collect();
        let hits = nearest_hits(&scene, &rays, &RenderOptions::default()).unwrap();
        assert!(hits.iter().all(|hit| hit.as_ref().is_some_and(|hit| hit.object == 0)));
    }

    #[test]
    fn faces_in_one_plane_whose_numbers_differ_in_single_precision_are_drawn_in_double() {
        let card = |depth: f64, level: f64| -> Object {
            let material = Material::new(DVec3::splat(level), DVec3::ZERO, DVec3::ZERO).unwrap();
            let corners = [[-3.0, -3.0], [9.0, -3.0], [3.0, 9.0]].map(|[x, y]| DVec3::new(x, y, -depth));
            Triangle::new(corners, material).unwrap().into()
        };
        // Halfway between two numbers of single precision, and a little to either side.
        let (half, little) = (1.0 + 2f64.powi(-24), 2f64.powi(-46));
        let chosen = |one: f64, other: f64| precision(&scene(vec![card(one, 0.1), card(other, 0.2)]));
        assert_eq!(chosen(half + little, half + little), Precision::F32);
        assert_eq!(chosen(half + little, half + 2.0 * little), Precision::F32);
        assert_eq!(chosen(half - little, half + little), Precision::F64);
    }
}
