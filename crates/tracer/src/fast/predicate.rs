//! A filtered predicate: whether a ray meets a triangle, where rounding leaves that open.
//!
//! The kernels take a ray for one that meets a triangle if it passes the edges on their inner sides within a bound on
//! the rounding errors, so that edges belong to it and are straight. Beyond the tip of a thin triangle there are such
//! rays far from it, where no tile, list or tree expects it; and near its plane the distance is off by more than bounds
//! are wide. Rays that are not clear of both come here: what is met passes the triangle within a few roundoffs, as bounds
//! are wide, and where it is met is within the box that the tree has for it, by the tree's own test. So nothing that is
//! found depends on how it was searched.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;

use super::bounds::{Crossing, padded};
use super::exact::passes;
use super::packet::Ray;
use super::real::{Lanes, Mask, Real, Vec3, constant};

/// How far beside a triangle a ray may pass and meet it, in roundoffs.
///
/// Along an edge this is more than the kernels' own bound on their errors, so that it only cuts what lies beyond the
/// tips; less than the bounds of tiles, lists and outlines.
#[derive(Clone, Copy, Debug)]
pub(super) enum Beside {
    /// Of the distance from the eye.
    Eye,
    /// Of the distance and of the coordinates where the ray starts.
    Anywhere,
    /// Of the triangle's largest distance from the eye: less than the offset of what starts at the triangle's edge, which
    /// is not in its shadow.
    Light,
}

impl Beside {
    /// Below this sine of the angle to the plane, a ray's distance from it is in doubt. From the eye the height above the
    /// plane has no errors but its own rounding's.
    #[inline(always)]
    pub(super) fn flat(self) -> f64 {
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
pub(super) trait Corners {
    /// Those of the triangle at this position in the array of triangles.
    fn of(&self, at: usize) -> [DVec3; 3];
}

/// Where a shape stands among those of its kind, and where to look up the corners of one that is a triangle.
pub(super) type Place<'a> = (&'a dyn Corners, usize);

/// Which of the doubtful lanes meet the triangle, and where: the distance, brought into the triangle's box. Lanes that
/// are `clear` of the edges are within them.
// Out of line, so that the kernels keep their registers for what is not in doubt.
#[cold]
#[inline(never)]
pub(super) fn settle<S: Simd, E: Real>(
    simd: S,
    (corners, at): Place,
    ray: Ray<S, E>,
    beside: Beside,
    (doubtful, clear): (Mask<S, E>, Mask<S, E>),
    distance: Lanes<S, E>,
) -> (Mask<S, E>, Lanes<S, E>) {
    simd.vectorize(
        #[inline(always)]
        || {
            let corners = corners.of(at);
            let mut met = [E::narrow(0.0); 16];
            let mut remaining = (doubtful & !clear).to_bitmask();
            while remaining != 0 {
                let lane = remaining.trailing_zeros() as usize;
                let exact =
                    |v: Vec3<S, E>| DVec3::new(v.x[lane].widen(), v.y[lane].widen(), v.z[lane].widen());
                let (origin, direction) = (exact(ray.origin), exact(ray.direction));
                let reach = |along: f64| beside.reach::<E>(corners, origin, along);
                if passes(corners, origin, direction, reach) {
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
