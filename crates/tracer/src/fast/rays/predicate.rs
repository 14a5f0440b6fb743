//! A filtered predicate: whether a ray hits a triangle if rounding leaves that open, and whether another triangle at
//! the same edge hides it.
//!
//! The kernels count a ray as a hit of a triangle if it passes the inner sides of the edges within a bound on the
//! rounding errors. So edges belong to the triangle and are straight. Two cases need more care. Beyond the tip of a
//! thin triangle, rays far from it satisfy this test, and no tile, list or tree expects them there. Near the triangle's
//! plane, the error of the distance is larger than the bounds allow. Rays in one of these cases are decided here. A hit
//! then passes the triangle within a few roundoffs, which the bounds allow for, and its distance is in the tree's box
//! of the triangle, by the tree's own test. So no hit depends on how it was searched.
//!
//! At the outline of a body a ray hits its front and its back at almost the same distance, and rounding would decide
//! which is nearer. The result would be a dark dot before a bright sky. So a triangle that lies behind another one at
//! their common edge is not hit there. Rays that are clear of the edge need no such care. Let two faces meet under the
//! angle β, and let a ray pass their edge at the distance δ, with the slopes s and t to the faces. The hits are δ·sin
//! β/(s·t) apart, and each distance has an error of 4 roundoffs for its slope ([`GRAZING`]). Beyond the 9 roundoffs
//! that are in doubt, the hits are therefore distinct if the faces meet at more than 51 degrees, and in practice at
//! less.
//!
//! If a pixel is one ray from the eye, the exact ray is tested and not its rounded copy. So outlines, and the edges
//! between needles, are where they are in `f64`. An edge that two triangles share is exact: a ray that passes beside it
//! hits the other triangle or none.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;

use crate::fast::arithmetic::exact::{Edge, is_behind, is_beside, passes};
use crate::fast::arithmetic::real::{Lanes, Mask, Real, Vec3, constant};
use crate::fast::arithmetic::rounding::GRAZING;
use crate::fast::rays::bounds::{Crossing, padded};
use crate::fast::rays::packet::Ray;

/// The largest distance beside a triangle at which a ray counts as a hit, in roundoffs.
///
/// Along an edge this is more than the kernels' own bound on their errors, so that it removes only hits beyond the
/// tips. It is less than the bounds of tiles, lists and outlines.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Beside {
    /// Roundoffs of the distance from the eye.
    Eye,
    /// Roundoffs of the distance and of the coordinates of the ray's start.
    Anywhere,
    /// Roundoffs of the triangle's largest distance from the eye. This is less than the offset of a ray that starts at
    /// the triangle's edge, so the triangle does not shadow it.
    Light,
}

impl Beside {
    /// Returns the sine of the angle to the plane below which a ray's distance from the plane is in doubt. For rays
    /// from the eye, the height above the plane has no error but its own rounding.
    #[inline(always)]
    pub(crate) fn flat(self) -> f64 {
        match self {
            Self::Eye => 1.0 / 128.0,
            Self::Anywhere | Self::Light => 1.0 / 32.0,
        }
    }

    fn reach<E: Real>(self, corners: [DVec3; 3], origin: DVec3, along: f64) -> f64 {
        E::ROUNDOFF
            * match self {
                Self::Eye => 16.0 * along,
                Self::Anywhere => 32.0 * (origin.abs().element_sum() + along),
                Self::Light => 4.0 * corners.iter().map(|corner| corner.length()).fold(0.0, f64::max),
            }
    }
}

/// The corners of triangles before they were rounded.
pub(crate) trait Corners {
    /// Returns the corners of the triangle at this position in the array of triangles.
    fn of(&self, at: usize) -> [DVec3; 3];

    /// Returns whether `is` holds for the third corner of any other triangle that has this edge.
    fn any_across(&self, at: usize, edge: Edge, is: &dyn Fn(DVec3) -> bool) -> bool;

    /// Returns the exact direction of the pixel's ray that was rounded to this one, if pixels are single rays from the
    /// eye.
    fn unrounded(&self, direction: DVec3) -> Option<DVec3>;

    /// Returns the exact ray that was rounded to this one in `f32`. It starts where a pixel's ray hits a triangle, and
    /// is mirrored or goes towards a sun. Returns `None` if no such ray is known.
    fn gone_on(&self, origin: DVec3, direction: DVec3, beside: Beside) -> Option<(DVec3, DVec3)>;
}

/// The index of a shape among those of its kind, and the source of the corners if it is a triangle.
pub(crate) type Place<'a> = (&'a dyn Corners, usize);

/// Returns which of the doubtful lanes hit the triangle, and their distances, clamped to the triangle's box. Lanes that
/// are `clear` of the edges are within them.
// Out of line, so that the kernels keep their registers for what is not in doubt.
#[cold]
#[inline(never)]
pub(crate) fn settle<S: Simd, E: Real>(
    simd: S,
    place: Place,
    ray: Ray<S, E>,
    beside: Beside,
    (doubtful, clear): (Mask<S, E>, Mask<S, E>),
    distance: Lanes<S, E>,
) -> (Mask<S, E>, Lanes<S, E>) {
    simd.vectorize(
        #[inline(always)]
        || {
            let corners = place.0.of(place.1);
            let mut met = [E::narrow(0.0); 16];
            let mut remaining = (doubtful & !clear).to_bitmask();
            while remaining != 0 {
                let lane = remaining.trailing_zeros() as usize;
                let exact =
                    |v: Vec3<S, E>| DVec3::new(v.x[lane].widen(), v.y[lane].widen(), v.z[lane].widen());
                let (origin, direction) = (exact(ray.origin), exact(ray.direction));
                if is_met::<E>(place, corners, (origin, direction), beside) {
                    met[lane] = E::narrow(1.0);
                }
                remaining &= remaining - 1;
            }
            let met = Lanes::<S, E>::from_slice(simd, &met[..Lanes::<S, E>::LEN]);
            let [a, b, c] = corners;
            let (low, high) = padded::<E>((a.min(b).min(c), a.max(b).max(c)));
            let (enter, leave) = Crossing::new(simd, ray).span(simd, low, high);
            let met = clear | met.simd_gt(constant::<S, E>(simd, 0.0));
            (met & enter.simd_le(leave), distance.min(leave).max(enter))
        },
    )
}

/// Returns whether a ray that passes an edge within the rounding error hits the triangle, and hits no other triangle in
/// front of it there.
fn is_met<E: Real>(
    place: Place,
    corners: [DVec3; 3],
    (origin, direction): (DVec3, DVec3),
    beside: Beside,
) -> bool {
    let (all, at) = place;
    let far = |along: f64| beside.reach::<E>(corners, origin, along);
    let exact = all.gone_on(origin, direction, beside);
    let is_single = E::ROUNDOFF > f64::EPSILON;
    let reach = |along: f64| match exact {
        Some((origin, _)) => beside.reach::<f64>(corners, origin, along),
        // No farther than the kernels' bound without the room for rays that are known exactly.
        None if is_single && matches!(beside, Beside::Anywhere) => 0.5 * far(along),
        None => far(along),
    };
    let (origin, direction) = exact.unwrap_or((origin, direction));
    let direction = match beside {
        Beside::Eye => all.unrounded(direction).unwrap_or(direction),
        Beside::Anywhere => direction,
        Beside::Light => return passes(corners, origin, direction, reach, |_| true),
    };
    // What lies in the other's plane does not meet it.
    let is_met_across = |[p, q]: Edge, other: DVec3| {
        let normal = (q - p).cross(other - p);
        normal.dot(direction).abs() > 2.0 * GRAZING * E::ROUNDOFF * normal.length()
    };
    let is_lone = |edge: Edge| !all.any_across(at, edge, &|other| is_met_across(edge, other));
    passes(corners, origin, direction, reach, is_lone)
        && !is_hidden(place, corners, (origin, direction), |along| 2.0 * far(along))
}

/// Returns whether a triangle lies behind another one at an edge that a ray passes within `reach`.
fn is_hidden(
    (all, at): Place,
    [a, b, c]: [DVec3; 3],
    (origin, direction): (DVec3, DVec3),
    reach: impl Fn(f64) -> f64,
) -> bool {
    [([a, b], c), ([b, c], a), ([c, a], b)].into_iter().any(|(edge, apex)| {
        is_beside(edge, origin, direction, &reach)
            && all.any_across(at, edge, &|other| is_behind(edge, apex, other, origin))
    })
}
