//! The bounds on rounding errors, each with its derivation.
//!
//! Numbers here are counts of *roundoffs*: the largest relative error of one rounding, u = 2⁻²⁴ for `f32` and 2⁻⁵³ for
//! `f64` ([`Real::ROUNDOFF`]). A scene lies in -1..=1 around its origin (the eye, if there is one), so a coordinate is at
//! most 1 and its rounding error at most u. Where n roundings follow each other the error is n·u, but for terms of the
//! order of n²·u², which the room in each bound is for. Fused multiply-add saves roundings; bounds hold without it too.
//!
//! They lie inside each other, and that is what makes pictures independent of how hits are searched for:
//!
//! ```text
//! errors of a test  <  what a test takes for a hit  <  what candidates are sought by
//!                      (slack of edges, LATE)          (BOUNDS, BOX, MARGIN)
//! ```
//!
//! and a new ray starts farther off its surface ([`OFFSET`]) than all errors of the hit and of the next test together.

use super::real::Real;

/// How far off its surface a new ray starts, in roundoffs of the sum of the coordinates there (of a sphere: of its
/// largest coordinate).
///
/// What can put the start on the wrong side: the hit, off by the distance's 13 roundoffs ([`distance_error`] has their
/// sum) and 2 of `origin + distance · direction`, but then brought back to its surface (a sphere's point is worked out
/// from the centre and the normal, a box's is set to the face, a triangle's moved by its height above the plane), which
/// leaves 2 to 4; rounding the start itself, 1; and the next test's own errors, at most 13 of the coordinates. 18, and
/// room.
pub(super) const OFFSET: f64 = 32.0;

/// How far bounds on where objects lie are widened, in roundoffs of the object's largest coordinate: tiles, lists and
/// outlines.
///
/// A ray meets an object at most as far beside it as the test errs: [`SIDE`] (5.25) of two products for a triangle's
/// edge, and 16 or 32 where that was settled (see `Beside` there), 8 for a box ([`LATE`]), about 10 for a sphere. The
/// bounds themselves are worked out in `f64`. Twice the largest.
pub(super) const BOUNDS: f64 = 64.0;

/// How far the boxes of a tree are widened, in roundoffs of the scene's size, which is 1.
///
/// The test of a ray against a box is `corner · inverse - origin · inverse`: 1 for the inverse, 2 for the two products, 1
/// for the sum, all relative to products no larger than the distance to the far end of the scene, and the origin's own
/// rounding, 1, wherever the box lies. A hit is off its object by up to 13 of the distance ([`distance_error`], where a
/// plane is not met under a flat angle). 18, and room.
pub(super) const BOX: f64 = 32.0;

/// The part of a pixel by which tiles are wider than their pixels.
///
/// Not a count of roundoffs: the direction of a ray is off by 3 roundoffs, which single precision is chosen for only
/// where it is below a twentieth of a pixel... and 1/32 of a pixel is what candidates are widened by besides [`BOUNDS`].
pub(super) const MARGIN: f64 = 1.0 / 32.0;

/// Below this many roundoffs the sine of the angle between a ray and a triangle's plane is noise: the ray is in the plane,
/// and misses.
///
/// `normal · direction` is a sum of three products of unit vectors: 1 roundoff of each factor and 1 of each sum.
pub(super) const GRAZING: f64 = 4.0;

/// Below this many roundoffs the sine of the angle between the light and a triangle's plane is noise.
///
/// Such a triangle has no shadow; taken for one that has, its sides would bound a line without ends. More than
/// [`GRAZING`], as the light's direction and the normal are rounded before they are compared in `f64`, and the test then
/// has two of these sines.
pub(super) const EDGE_ON: f64 = 16.0;

/// How much later than leaving a box a ray may enter it, in roundoffs of the distance.
///
/// Each is `(face - origin) · inverse`, 3 roundoffs, one of them the inverse's, which two faces of an axis share; an edge
/// compares those of two axes: 6, and room (Ize, "Robust BVH ray traversal", JCGT 2(2), 2013, has the same argument).
pub(super) const LATE: f64 = 8.0;

/// How much later than at its far side a ray may enter a box of a tree, in roundoffs of the distance.
///
/// As [`LATE`], where `corner · inverse` and `origin · inverse` are rounded before they are subtracted: that error is
/// relative to the larger of them, which [`BOX`] pays for where it is the origin's. Generous, as it costs nothing.
pub(super) const LATE_IN_TREE: f64 = 64.0;

/// Rounding errors of a ray's side of an edge, in roundoffs of the sum of the products' magnitudes.
///
/// One of the constant, four of the sum without fused multiply-add, and what is of second order.
pub(super) const SIDE: f64 = 5.25;

/// Rounding errors of the constants of an edge in `f64`, before they are rounded to the kernels' numbers: of a cross
/// product, 2 roundings of each product and its difference, of corners that were rounded once each.
pub(super) const CONSTANT: f64 = 4.0 * f64::EPSILON;

/// Rounding errors of a triangle's volume with the eye in `f64`, relative to the product of the lengths: of a cross and a
/// dot product, as [`CONSTANT`].
pub(super) const VOLUME: f64 = 4.0 * f64::EPSILON;

/// How far a region of points that wait for light is widened on a sun's screen, in roundoffs of the sum of the
/// coordinates: 3 for the axes, which are rounded, and each dot product's 3, on both sides of the comparison, and room.
pub(super) const BEAM: f64 = 16.0;

/// A bound on the rounding errors of distances to triangles that are not met under a flat angle, as a part of 1 and of
/// the distance. Nearer than that a ray may start beyond the plane.
///
/// The height above the plane has 9 roundoffs and the slope 4; a ray is [settled] where the slope is below 1/32, so that
/// the errors of the height are at most 32 times as large along the ray: 9 · 32 = 288 and 4 · 32 = 128, together 416 of
/// 512. The rest is what a normal is off that was worked out in `f64` from corners before they were rounded.
///
/// [settled]: super::shapes::triangle::settle
pub(super) const fn distance_error<E: Real>() -> f64 {
    512.0 * E::ROUNDOFF + 2048.0 * f64::EPSILON
}
