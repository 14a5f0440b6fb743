//! Culls up to 64 bodies by a bit mask: a tile tests only the bodies that its rays or shadow rays can hit.
//!
//! Each packet first tests only the bounding spheres of these bodies, and the slabs of flat ones, which takes no division.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;

use super::solid::{Solid, Span};
use crate::fast::acceleration::candidates::MASKED;
use crate::fast::arithmetic::real::{Fused, Lanes, Mask, Real, Vec3, constant, splat};
use crate::fast::rays::packet::Ray;
use crate::fast::shapes::Shape;

/// The tolerance of a bounding sphere's squared radius, in roundoffs. The squares of lengths of about 1 that are
/// compared with it have errors of some roundoffs.
const WIDER: f64 = 64.0;

/// The bounding volumes of the bodies, in the order of the bits.
#[derive(Debug)]
pub(super) struct BodyCuller<E> {
    pub(super) boxes: Vec<Shape>,
    balls: Vec<Ball<E>>,
    /// The slabs of flat bodies. Few of the rays that come near the bounding sphere of a flat body come near its slab.
    slabs: Vec<Option<Slab<E>>>,
    /// The bits of all bodies.
    pub(super) all: u64,
    /// Whether there are so few bodies that any search tests each of them, and no search uses the tree.
    pub(super) is_short: bool,
}

/// The largest number of bodies that are tested one by one.
const SHORT: usize = 16;

/// The thickness, in diameters of the bounding sphere, below which a body is flat.
const FLAT: f64 = 0.4;

/// The space between two parallel planes around a body.
#[derive(Clone, Copy, Debug)]
struct Slab<E> {
    axis: [E; 3],
    /// Half of the thickness, with the errors of heights.
    half: E,
    /// The square of the radius of a hole in the middle, or 0 without.
    hole: E,
}

#[derive(Clone, Copy, Debug)]
struct Ball<E> {
    center: [E; 3],
    square: E,
    /// The radius, with the errors of distances along a ray.
    radius: E,
}

impl<E: Real> BodyCuller<E> {
    /// Returns `None` if there are no bodies, or more than a mask has bits.
    pub(super) fn new(solids: &[Solid]) -> Option<Self> {
        if solids.is_empty() || solids.len() > MASKED {
            return None;
        }
        let boxes: Option<Vec<Shape>> =
            solids.iter().map(|solid| solid.bounds().map(Shape::of_box)).collect();
        let balls = solids.iter().map(|solid| Ball::around(solid.ball())).collect();
        let slabs = solids.iter().map(Slab::around).collect();
        let all = u64::MAX >> (MASKED - solids.len());
        Some(Self { boxes: boxes?, balls, slabs, all, is_short: solids.len() <= SHORT })
    }

    /// Returns the rays that come near the body of this bit before a distance.
    #[inline(always)]
    pub(super) fn are_near<S: Simd>(
        &self,
        simd: S,
        bit: usize,
        ray: Ray<S, E>,
        before: Lanes<S, E>,
    ) -> Mask<S, E> {
        let Ball { center, square, radius } = self.balls[bit];
        let to = Vec3::splat(simd, center).sub(ray.origin);
        let along = to.dot(ray.direction);
        let apart = to.dot(to) - along * along;
        let slack = to.dot(to) * constant::<S, E>(simd, WIDER * E::ROUNDOFF);
        let square = splat::<S, E>(simd, square) + slack;
        let near = apart.simd_le(square) & (along - splat::<S, E>(simd, radius)).simd_le(before);
        let Some(Slab { axis, half, hole }) = self.slabs[bit] else { return near };
        // The height of the ray's start above the middle of the slab, and how it changes along the ray.
        let (zero, far) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, E::FAR));
        let axis = Vec3::splat(simd, axis);
        let (start, slope) = (zero - axis.dot(to), axis.dot(ray.direction));
        let half = splat::<S, E>(simd, half) + slack;
        let is_level = slope.abs().simd_lt(constant::<S, E>(simd, LEVEL));
        let inverse = constant::<S, E>(simd, 1.0) / is_level.select(far, slope);
        let (a, b) = ((zero - half - start) * inverse, (half - start) * inverse);
        let (enter, leave) = (a.min(b).max(zero), a.max(b));
        // The square of the distance from the centre, at a place along the ray.
        let from_center = |t: Lanes<S, E>| {
            let aside = t - along;
            aside.fused_mul_add(aside, apart)
        };
        let nearest = along.max(enter).min(leave);
        let mut passes = leave.simd_lt(zero)
            | enter.simd_gt(
                before.fused_mul_add(constant::<S, E>(simd, LATER), constant::<S, E>(simd, LATER)) + before,
            )
            | from_center(nearest).simd_gt(square);
        if hole > E::narrow(0.0) {
            // From the axis the distance is largest at one of the ends.
            let from_axis = |t: Lanes<S, E>| {
                let height = slope.fused_mul_add(t, start);
                from_center(t) - height * height
            };
            passes |= from_axis(enter).max(from_axis(leave)).simd_lt(splat::<S, E>(simd, hole) - slack);
        }
        near & !(is_level.select(start.abs(), zero).simd_gt(half) | !is_level & passes)
    }
}

/// The change of height along a ray below which the ray counts as level: less than any rounding error of a height.
const LEVEL: f64 = 1e-30;

/// The length by which a ray may enter a slab later than its hit, relative to 1 and to the distance.
const LATER: f64 = 1e-6;

/// The part by which the hole of a ring is assumed to be smaller.
const HOLE: f64 = 1e-6;

impl<E: Real> Slab<E> {
    /// Returns the slab of a body that is flat.
    fn around(solid: &Solid) -> Option<Self> {
        let Span { axis, half, hole } = solid.slab()?;
        let (center, radius) = solid.ball();
        let slack = WIDER * E::ROUNDOFF * (1.0 + solid.extent() + center.length());
        (half < FLAT * radius).then(|| Self {
            axis: axis.to_array().map(E::narrow),
            half: E::narrow(half + 2.0 * slack),
            hole: E::narrow((hole * hole * (1.0 - HOLE) - HOLE * radius * radius).max(0.0)),
        })
    }
}

impl<E: Real> Ball<E> {
    fn around((center, radius): (DVec3, f64)) -> Self {
        let square = radius * radius * (1.0 + WIDER * E::ROUNDOFF);
        // The effect of the centre's rounding error.
        let shift = WIDER * E::ROUNDOFF * (center.length() * (radius + center.length()));
        let along = WIDER * E::ROUNDOFF * (1.0 + radius + center.length());
        Self {
            center: center.to_array().map(E::narrow),
            square: E::narrow(square + shift),
            radius: E::narrow(radius + along),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use fearless_simd::{Level, dispatch};
    use glam::DMat3;
    use rayfold_scene::{Cone, Cuboid, Cylinder, Disc, Instance, Material, Object, Placement, Torus};

    use super::super::{Body, body};
    use super::*;
    use crate::fast::rays::packet::Nearest;

    fn objects(random: &mut impl FnMut() -> DVec3) -> Vec<Object> {
        let material = Material::default;
        let center = 0.4 * random();
        let [thin, wide] = [0.005 + 0.1 * random().x.abs(), 0.1 + 0.4 * random().x.abs()];
        let normal = random().normalize();
        let turn = DMat3::from_axis_angle(normal, random().x);
        let board = Cuboid::new([-DVec3::new(wide, thin, wide), DVec3::new(wide, thin, wide)], material());
        let group = vec![board.unwrap().into()].into();
        vec![
            Torus::new(wide, thin.min(0.9 * wide), center, normal, material()).unwrap().into(),
            Torus::new(wide, thin.min(0.9 * wide), center, DVec3::Y, material()).unwrap().into(),
            Disc::new(wide, center, normal, material()).unwrap().into(),
            Cylinder::new(wide, [center, center + thin * normal], material()).unwrap().into(),
            Cone::new([wide, 0.5 * wide], [center, center + thin * DVec3::Z], material()).unwrap().into(),
            Instance::new(&group, 0, &Arc::new(Placement::new(center, turn, 1.0).unwrap())).into(),
        ]
    }

    #[test]
    fn rays_that_meet_a_body_come_near_it_and_few_others_do() {
        let mut numbers = fastrand::Rng::with_seed(39);
        let mut random = || DVec3::new(numbers.f64(), numbers.f64(), numbers.f64()) * 2.0 - 1.0;
        let (mut met, mut near, mut all) = (0, 0, 0);
        for _ in 0..300 {
            let objects = objects(&mut random);
            let solid =
                |(order, object): (usize, &Object)| body(object, order as u32, DVec3::ZERO, 1.0).unwrap();
            let solids: Vec<Solid> = objects.iter().enumerate().map(solid).collect();
            let culler = BodyCuller::<f64>::new(&solids).unwrap();
            for (bit, solid) in solids.iter().enumerate() {
                let own = Body::<f64>::new(solid, &objects, None);
                for round in 0..12 {
                    let rays: Vec<_> = (0..8)
                        .map(|_| (random(), random()))
                        .map(|(from, way)| {
                            // Some along the axes, some to the middle and some just past the edge.
                            let to = match round % 4 {
                                0 => from + DVec3::AXES[round as usize / 4] * way.x,
                                1 => solid.ball().0 + 1e-3 * way,
                                _ => solid.ball().0 + solid.ball().1 * way.normalize(),
                            };
                            (from, (to - from).normalize())
                        })
                        .collect();
                    let [hits, nearby] =
                        dispatch!(Level::new(), simd => found(simd, (&culler, bit, &own), &rays));
                    assert_eq!(hits & !nearby, 0, "{:?}, {rays:?}", objects[bit]);
                    met += hits.count_ones();
                    near += nearby.count_ones();
                    all += 8;
                }
            }
        }
        assert!(met > all / 20 && near < all / 2, "{met} of {all} meet, {near} come near");
    }

    /// Returns the rays that hit the body and those that come near it, as bits.
    #[inline(always)]
    fn found<S: Simd>(
        simd: S,
        (culler, bit, own): (&BodyCuller<f64>, usize, &Body<f64>),
        rays: &[(DVec3, DVec3)],
    ) -> [u64; 2] {
        let mut bits = [0; 2];
        for at in (0..rays.len()).step_by(Lanes::<S, f64>::LEN) {
            let mut columns = [[0.0; 16]; 6];
            for (lane, (from, way)) in rays[at..].iter().take(Lanes::<S, f64>::LEN).enumerate() {
                for axis in 0..3 {
                    (columns[axis][lane], columns[axis + 3][lane]) = (from[axis], way[axis]);
                }
            }
            let [a, b, c, x, y, z] = columns;
            let ray =
                Ray { origin: Vec3::load(simd, &[a, b, c], 0), direction: Vec3::load(simd, &[x, y, z], 0) };
            let mut nearest = Nearest::<S, f64>::none(simd);
            let near = culler.are_near(simd, bit, ray, nearest.distance);
            own.intersect(simd, ray, &mut nearest);
            bits[0] |= nearest.hit(simd).to_bitmask() << at;
            bits[1] |= near.to_bitmask() << at;
        }
        bits
    }
}
