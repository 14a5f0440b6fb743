//! A filtered predicate: whether a ray meets a triangle, where rounding leaves that open, and whether another triangle at
//! the same edge hides it.
//!
//! The kernels take a ray for one that meets a triangle if it passes the edges on their inner sides within a bound on
//! the rounding errors, so that edges belong to it and are straight. Beyond the tip of a thin triangle there are such
//! rays far from it, where no tile, list or tree expects it; and near its plane the distance is off by more than bounds
//! are wide. Rays that are not clear of both come here: what is met passes the triangle within a few roundoffs, as bounds
//! are wide, and where it is met is within the box that the tree has for it, by the tree's own test. So nothing that is
//! found depends on how it was searched.
//!
//! Where a ray passes the outline of a body, its front and its back are met at almost one distance, and rounding would say
//! which is nearer: a dark dot before a bright sky. So what lies behind another triangle that shares the edge is not met
//! there. Rays that are clear of the edge need no such care: two faces under the slopes s and t to a ray that passes beside
//! their edge by δ are met δ·sin β/(s·t) apart, β the angle between them, and either distance errs by 4 roundoffs for its slope
//! ([`GRAZING`]); so beyond the 9 roundoffs that are in doubt they are told apart if they meet at more than 51 degrees, and in
//! practice at less.
//!
//! Where a pixel is one ray from the eye, what is decided is that ray and not what rounding made of it: so outlines and the edges
//! between needles are where they are in `f64`. An edge that two triangles share is exact: what passes beside it is the other's, or
//! no one's.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;

use crate::fast::arithmetic::exact::{Edge, is_behind, is_beside, passes};
use crate::fast::arithmetic::real::{Lanes, Mask, Real, Vec3, constant};
use crate::fast::arithmetic::rounding::GRAZING;
use crate::fast::rays::bounds::{Crossing, padded};
use crate::fast::rays::packet::Ray;

/// How far beside a triangle a ray may pass and meet it, in roundoffs.
///
/// Along an edge this is more than the kernels' own bound on their errors, so that it only cuts what lies beyond the
/// tips; less than the bounds of tiles, lists and outlines.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Beside {
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
    /// Those of the triangle at this position in the array of triangles.
    fn of(&self, at: usize) -> [DVec3; 3];

    /// Whether `is` holds of the third corner of any other triangle that has this edge.
    fn any_across(&self, at: usize, edge: Edge, is: &dyn Fn(DVec3) -> bool) -> bool;

    /// The direction of the pixel's ray that was rounded to this one, if pixels are single rays from the eye.
    fn unrounded(&self, direction: DVec3) -> Option<DVec3>;

    /// The ray of which this one is what `f32` made: one that goes on from where a pixel's ray meets a triangle, mirrored or towards
    /// a sun. None if no such ray is known.
    fn gone_on(&self, origin: DVec3, direction: DVec3, beside: Beside) -> Option<(DVec3, DVec3)>;
}

/// Where a shape stands among those of its kind, and where to look up the corners of one that is a triangle.
pub(crate) type Place<'a> = (&'a dyn Corners, usize);

/// Which of the doubtful lanes meet the triangle, and where: the distance, brought into the triangle's box. Lanes that
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

/// Whether a ray that passes an edge as near as rounding tells meets the triangle, and not another in front of it there.
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

/// Whether a triangle lies behind another at an edge that a ray passes within `reach`.
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
