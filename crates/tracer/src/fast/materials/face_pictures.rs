//! Pictures on the faces of a model, by texture coordinates, looked up in lanes.
//!
//! These are the functions of [`crate::pictures`], with the same results in `f64`. Only the pixels themselves are read lane by
//! lane.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::Vec2;
use rayfold_scene::assets::Wrap;

use crate::fast::arithmetic::real::{Lanes, Real, Vec3, constant};
use crate::pictures::FacePicture;

/// The data of a packet's faces, lane by lane. Only lanes that hit faces have any.
pub(super) struct Looked<E> {
    /// Texture coordinates at the corners, by corner and axis.
    coordinates: [[[E; 16]; 2]; 3],
    /// The columns and rows around the place of a hit, with the weights of the second ones: left, right, weight, first,
    /// second, weight.
    around: [[E; 16]; 6],
    /// The values of the picture there.
    values: [[E; 16]; 3],
}

impl<E: Real> Looked<E> {
    pub(super) fn new() -> Self {
        let nothing = [E::narrow(0.0); 16];
        Self { coordinates: [[nothing; 2]; 3], around: [nothing; 6], values: [nothing; 3] }
    }

    /// Takes the texture coordinates of the face that a lane hits.
    #[inline(always)]
    pub(super) fn put(&mut self, lane: usize, uvs: [Vec2; 3]) {
        for (into, uv) in self.coordinates.iter_mut().zip(uvs) {
            into[0][lane % 16] = E::narrow(uv.x.into());
            into[1][lane % 16] = E::narrow(uv.y.into());
        }
    }

    /// Returns the factors of a picture where faces are hit. `bits` are the lanes with such hits; the other lanes have
    /// any number.
    #[inline(always)]
    pub(super) fn factors<S: Simd>(
        &mut self,
        simd: S,
        picture: &FacePicture,
        [a, b, c]: [Lanes<S, E>; 3],
        bits: u32,
    ) -> Vec3<S, E> {
        let [zero, one] = [0.0, 1.0].map(|x| constant::<S, E>(simd, x));
        let [mut u, mut v] = [one; 2];
        for (place, axis) in [&mut u, &mut v].into_iter().zip(0..) {
            let [first, second, third] = &self.coordinates;
            *place = a * load::<S, E>(simd, &first[axis])
                + b * load::<S, E>(simd, &second[axis])
                + c * load::<S, E>(simd, &third[axis]);
        }
        let v = if picture.is_from_top { v } else { one - v };
        let [width, height] = [picture.picture.width(), picture.picture.height()];
        let (left, right, across) = neighbours::<S, E>(simd, u, width, picture.wraps[0]);
        let (first, second, down) = neighbours::<S, E>(simd, v, height, picture.wraps[1]);
        for (into, place) in self.around.iter_mut().zip([left, right, across, first, second, down]) {
            place.store_slice(&mut into[..Lanes::<S, E>::LEN]);
        }
        self.read(picture, bits);
        let mut factors = Vec3::splat(simd, [E::narrow(1.0); 3]);
        for (factor, axis) in [&mut factors.x, &mut factors.y, &mut factors.z].into_iter().zip(0..) {
            let level = load::<S, E>(simd, &self.values[axis]);
            *factor = match picture.tint {
                Some(tint) => (level * constant::<S, E>(simd, tint[axis])).max(zero).min(one),
                None => level,
            };
        }
        factors
    }

    /// Reads the pixels around the places of hits, and mixes them.
    #[inline(always)]
    fn read(&mut self, picture: &FacePicture, mut bits: u32) {
        let opaque = picture.picture.bytes_of_opaque(picture.is_linear);
        let width = picture.picture.width() as usize;
        // The fourth number is none; four are computed at once.
        let value = |column: usize, row: usize| -> [f64; 4] {
            if let Some((bytes, levels)) = opaque
                && let Some(&[r, g, b]) = bytes[3 * (row * width + column)..].first_chunk()
            {
                [levels[usize::from(r)], levels[usize::from(g)], levels[usize::from(b)], 0.0]
            } else {
                let value = picture.value(column as u32, row as u32);
                [value.x, value.y, value.z, 0.0]
            }
        };
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize % 16;
            bits &= bits - 1;
            let [left, right, across, first, second, down] = &self.around;
            let [left, right] = [left[lane].to_index(), right[lane].to_index()];
            let [first, second] = [first[lane].to_index(), second[lane].to_index()];
            let upper = mixed(value(left, first), value(right, first), across[lane].widen());
            let lower = mixed(value(left, second), value(right, second), across[lane].widen());
            let level = mixed(upper, lower, down[lane].widen());
            for (into, value) in self.values.iter_mut().zip(level) {
                into[lane] = E::narrow(value);
            }
        }
    }
}

/// Returns the two pixels, out of `count`, whose middles are around each place, and the weights of the second ones.
#[inline(always)]
fn neighbours<S: Simd, E: Real>(
    simd: S,
    place: Lanes<S, E>,
    count: u32,
    wrap: Wrap,
) -> (Lanes<S, E>, Lanes<S, E>, Lanes<S, E>) {
    let [zero, half, one, two] = [0.0, 0.5, 1.0, 2.0].map(|x| constant::<S, E>(simd, x));
    let [count, last] = [f64::from(count), f64::from(count - 1)].map(|x| constant::<S, E>(simd, x));
    let is_finite = place.abs().simd_lt(constant::<S, E>(simd, f64::INFINITY));
    let place = is_finite.select(place, zero);
    let place = match wrap {
        Wrap::Repeat => place - place.floor(),
        Wrap::Clamp => place.max(zero).min(one),
        Wrap::Mirror => {
            let place = place - two * (half * place).floor();
            place.simd_gt(one).select(two - place, place)
        }
    };
    let at = place * count - half;
    let left = at.floor();
    let right = left + one;
    let share = at - left;
    if wrap == Wrap::Repeat {
        let left = left.simd_lt(zero).select(last, left);
        let right = right.simd_gt(last).select(right - count, right);
        // The place may be rounded to 1.
        (left.min(last), right.max(zero), share)
    } else {
        (left.max(zero).min(last), right.max(zero).min(last), share)
    }
}

#[inline(always)]
fn mixed(a: [f64; 4], b: [f64; 4], share: f64) -> [f64; 4] {
    let mut mixed = a;
    for ((mixed, a), b) in mixed.iter_mut().zip(a).zip(b) {
        *mixed = a + share * (b - a);
    }
    mixed
}

#[inline(always)]
fn load<S: Simd, E: Real>(simd: S, from: &[E; 16]) -> Lanes<S, E> {
    Lanes::<S, E>::from_slice(simd, &from[..Lanes::<S, E>::LEN])
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;
    use crate::pictures;

    /// Checks that the pixels around places, one in each lane, are those that the reference selects.
    fn check<S: Simd>(simd: S, places: &[f64; 8], count: u32, wrap: Wrap) {
        for at in (0..places.len()).step_by(Lanes::<S, f64>::LEN) {
            let place = Lanes::<S, f64>::from_slice(simd, &places[at..at + Lanes::<S, f64>::LEN]);
            let (left, right, share) = neighbours::<S, f64>(simd, place, count, wrap);
            for lane in 0..Lanes::<S, f64>::LEN {
                let found = ([left[lane] as u32, right[lane] as u32], share[lane]);
                let place = places[at + lane];
                assert_eq!(found, pictures::neighbours(place, count, wrap), "{place} of {count}, {wrap:?}");
            }
        }
    }

    #[test]
    fn the_pixels_around_a_place_are_those_of_the_reference() {
        let places = [
            [0.0, -0.0, 1.0, 0.5, 0.375, 1.125, 1.375, -0.125],
            [-1e-20, 1e-20, -3.0, 2.0, 0.999_999_999, 1e17, -1e300, 0.1],
            [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -0.7, 1.6, 2.1, 1.0 - f64::EPSILON],
        ];
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for (places, count) in
                places.iter().flat_map(|places| [1, 2, 7, 1024].map(|count| (places, count)))
            {
                dispatch!(Level::new(), simd => check(simd, places, count, wrap));
            }
        }
    }
}
