//! The bounds on rounding errors, each with its derivation.
//!
//! Numbers here are counts of *roundoffs*: the largest relative error of one rounding, u = 2⁻²⁴ for `f32` and 2⁻⁵³ for
//! `f64` ([`Real::ROUNDOFF`]). A scene is in -1..=1 around its origin (the eye, if there is one), so a coordinate is at
//! most 1 and its rounding error at most u. The error of n successive roundings is n·u, plus terms of the order of
//! n²·u², which the margin of each bound covers. Fused multiply-add saves roundings; the bounds hold without it too.
//!
//! The bounds are nested, which makes pictures independent of the search method:
//!
//! ```text
//! errors of a test  <  tolerance of a hit      <  margins of candidates
//!                      (slack of edges, LATE)     (BOUNDS, BOX, MARGIN)
//! ```
//!
//! A new ray starts farther off its surface ([`OFFSET`]) than all errors of the hit and of the next test together.

use crate::fast::arithmetic::real::Real;

/// The offset of a new ray from its surface, in roundoffs of the sum of the coordinates there (for a sphere: of its
/// centre's largest coordinate and its radius).
///
/// Three errors can put the start on the wrong side. First, the point is off its surface. A point of a box is set to
/// the face: 0. A point of a triangle is moved by its height above the plane, which has an error of 4. A point of a
/// sphere is computed from the centre and a normal whose length is 1 except for 3, and a sum: 4. Second, the start is
/// rounded: 1. Third, the next test has an error: 9 in a height above a plane ([`distance_error`]), 8 in a slab
/// ([`LATE`]). The sum is 14; the bound is more than twice that.
pub(crate) const OFFSET: f64 = 32.0;

/// The margin of bounds on the positions of objects, in roundoffs of the object's largest coordinate: for tiles, lists
/// and outlines.
///
/// Rays hit objects beside their exact positions by the errors of the tests. Boxes have 8 ([`LATE`]), spheres about 10.
/// Triangles, once settled, have 16 of the distance from the eye, which is at most √3 of the largest coordinate: 28;
/// and 7 towards a light (`Beside` in the predicate). The ray's own direction has an error of 3. The sum is 31; the
/// bound is more than twice that.
pub(crate) const BOUNDS: f64 = 64.0;

/// The margin of the boxes of a tree, in roundoffs of the scene's size, which is 1.
///
/// A ray's origin is rounded relative to that size, at any position of the box: 1. The test,
/// `corner · inverse - origin · inverse`, has 1 for the inverse, which both products share, 1 for each product and 1
/// for the difference: 4. Spheres and boxes are hit up to 10 beside their exact positions. The sum is 15; the bound is
/// more than twice that. The error of a triangle is cut off at the box: see the predicate.
pub(crate) const BOX: f64 = 32.0;

/// The margin by which tiles are wider than their pixels, in pixels.
///
/// A pixel's coordinate on the window is rounded by 2 roundoffs: in `f32`, in an image of 100,000 columns, 1/168 of a
/// pixel. The other errors of the direction are in [`BOUNDS`].
pub(crate) const MARGIN: f64 = 1.0 / 32.0;

/// The sine of the angle between a ray and a triangle's plane, in roundoffs, below which it is only rounding error.
/// Such a ray counts as in the plane, and misses.
///
/// The sine is `normal · direction`, of two vectors of length 1: 1 roundoff of each of the two, and 1 of each of the
/// two sums that are left with fused multiply-add.
pub(crate) const GRAZING: f64 = 4.0;

/// The sine of the angle between the light and a triangle's plane, in roundoffs, below which it is only rounding error.
///
/// Such a triangle has no shadow. If it had one, its sides would bound a line without ends. The direction of the light
/// and the normal are both rounded in all three coordinates, which turns each by up to √3 roundoffs, and the sides are
/// divided by the remaining sine: four times [`GRAZING`].
pub(crate) const EDGE_ON: f64 = 16.0;

/// The margin by which a ray may enter a box later than it leaves it, in roundoffs of the distance.
///
/// A face is hit at `(face - origin) · inverse`: 1 roundoff of the difference, 1 of the inverse, 1 of the product. At
/// an edge the faces of two axes are compared: 6, and a margin (Ize, "Robust BVH ray traversal", JCGT 2(2), 2013).
pub(crate) const LATE: f64 = 8.0;

/// The margin by which a ray may enter a box of a tree later than its far side, in roundoffs of the distance.
///
/// As for [`LATE`], but `corner · inverse` and `origin · inverse` are rounded before they are subtracted, and may be
/// larger than the distance. The additional error is in [`BOX`]. Generous, because it costs nothing.
pub(crate) const LATE_IN_TREE: f64 = 64.0;

/// The rounding error of a ray's side of an edge, in roundoffs of the sum of the products' magnitudes.
///
/// One of the constant, four of the sum without fused multiply-add, and the terms of second order.
pub(crate) const SIDE: f64 = 5.25;

/// The largest angle by which rounding turns a ray from the eye, in roundoffs.
///
/// A coordinate on the window and its axis are rounded, 1 each, and the two sums, 1 each. Each of these is relative to
/// a part of the direction's length. A ray that is turned by more belongs to no pixel.
pub(crate) const TURNED: f64 = 4.0;

/// [`SIDE`] for a ray from the eye, relative to the exact ray of the pixel.
pub(crate) const SIDE_OF_PIXEL: f64 = SIDE + TURNED;

/// The error in `f32` of a ray that is spawned at a surface which the eye sees, in roundoffs of the coordinates of its origin.
///
/// The origin is [`OFFSET`] off the surface, in roundoffs of the sum of the coordinates and of the surface's height: to one
/// side only, so at most 64 along the normal. The direction from the eye adds 4 of the distance across it.
pub(crate) const GONE_ON: f64 = 96.0;

/// Returns [`SIDE`] for a spawned ray that stands for the exact ray of its pixel. It is larger in `f32` only, because errors
/// of `f64` are invisible.
pub(crate) const fn side_of_going_on<E: Real>() -> f64 {
    if E::ROUNDOFF > f64::EPSILON { SIDE + 0.5 * GONE_ON } else { SIDE }
}

/// The rounding error of an edge's constants in `f64`, before they are rounded to the kernels' numbers, relative to the
/// product of the lengths.
///
/// A cross product of a corner and a difference of corners: 1 roundoff of the difference, 1 of each product and 1 of
/// their difference. The bound allows 8.
pub(crate) const CONSTANT: f64 = 4.0 * f64::EPSILON;

/// The rounding error of a triangle's volume with the eye in `f64`, relative to the product of the lengths: the errors
/// of [`CONSTANT`], and those of a dot product of three terms. It is also relative to the sum of the six products of
/// the determinant, each at most the product of the corners' largest coordinates. That sum is smaller if a triangle is
/// in a plane along two axes and near the eye for its size.
pub(crate) const VOLUME: f64 = 4.0 * f64::EPSILON;

/// The margin of a region of hits that need light, on a sun's screen, in roundoffs of the sum of the coordinates.
///
/// Each coordinate there is a dot product with an axis: 1 roundoff of the axis, 3 of the products and sums. On both
/// sides of the comparison that is 8; the bound is twice that.
pub(crate) const BEAM: f64 = 16.0;

/// Returns a bound on the rounding error of distances to triangles that are not hit at a grazing angle, relative to 1
/// plus the distance. Nearer than that a ray may start beyond the plane.
///
/// The height above the plane has an error of 9 roundoffs, and the slope one of 4. A ray is [settled] if the slope is
/// below 1/32, so the errors of the height are at most 32 times as large along the ray: 9 · 32 = 288 and 4 · 32 = 128.
/// The sum is 416; the bound is 512. The second term is the error of a normal that was computed in `f64` from corners
/// before they were rounded.
///
/// [settled]: crate::fast::rays::predicate::settle
pub(crate) const fn distance_error<E: Real>() -> f64 {
    512.0 * E::ROUNDOFF + 2048.0 * f64::EPSILON
}
