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
/// centre's largest coordinate and its radius).
///
/// Three errors can put the start on the wrong side. The point is off its surface: a box's is set to the face, 0; a
/// triangle's is moved by its height above the plane, which has 4; a sphere's is worked out from the centre and a normal
/// of length 1 but for 3, and a sum, 4. The start is rounded, 1. And the next test errs: by 9 in a height above a plane
/// ([`distance_error`]), by 8 in a slab ([`LATE`]). Together 14, and as much again.
pub(super) const OFFSET: f64 = 32.0;

/// How far bounds on where objects lie are widened, in roundoffs of the object's largest coordinate: for tiles, lists and
/// outlines.
///
/// Rays meet objects beside where they lie by the errors of their tests: boxes 8 ([`LATE`]), spheres about 10; triangles,
/// once settled, 16 of the distance from the eye, which is at most √3 of the largest coordinate: 28, and 7 towards a
/// light (`Beside` in the predicate). The ray's own direction is off by 3. Together 31, and as much again.
pub(super) const BOUNDS: f64 = 64.0;

/// How far the boxes of a tree are widened, in roundoffs of the scene's size, which is 1.
///
/// A ray's origin is rounded relative to that size, wherever the box lies: 1. The test, `corner · inverse - origin ·
/// inverse`, has 1 for the inverse, which both products share, 1 for each product and 1 for the difference: 4. Spheres and
/// boxes are met up to 10 beside where they lie. Together 15, and as much again. What a triangle is met beside is cut off
/// at the box: see the predicate.
pub(super) const BOX: f64 = 32.0;

/// The part of a pixel by which tiles are wider than their pixels.
///
/// A pixel's coordinate on the window is rounded by 2 roundoffs: in `f32`, in an image of 100,000 columns, 1/168 of a pixel.
/// What the direction is off besides is in [`BOUNDS`].
pub(super) const MARGIN: f64 = 1.0 / 32.0;

/// Below this many roundoffs the sine of the angle between a ray and a triangle's plane is noise: the ray is in the plane,
/// and misses.
///
/// The sine is `normal · direction`, of two vectors of length 1: 1 roundoff of each of the two, and 1 of each of the two
/// sums that are left with fused multiply-add.
pub(super) const GRAZING: f64 = 4.0;

/// Below this many roundoffs the sine of the angle between the light and a triangle's plane is noise.
///
/// Such a triangle has no shadow; taken for one that has, its sides would bound a line without ends. The direction of the
/// light and the normal are both rounded in all three coordinates, which turns each by up to √3 roundoffs, and the sides
/// are divided by what is left: four times [`GRAZING`].
pub(super) const EDGE_ON: f64 = 16.0;

/// How much later than leaving a box a ray may enter it, in roundoffs of the distance.
///
/// A face is met at `(face - origin) · inverse`: 1 roundoff of the difference, 1 of the inverse, 1 of the product. At an
/// edge the faces of two axes are compared: 6, and room (Ize, "Robust BVH ray traversal", JCGT 2(2), 2013).
pub(super) const LATE: f64 = 8.0;

/// How much later than at its far side a ray may enter a box of a tree, in roundoffs of the distance.
///
/// As [`LATE`]; but `corner · inverse` and `origin · inverse` are rounded before they are subtracted, and may be larger
/// than the distance. What that adds is in [`BOX`]. Generous, as it costs nothing.
pub(super) const LATE_IN_TREE: f64 = 64.0;

/// Rounding errors of a ray's side of an edge, in roundoffs of the sum of the products' magnitudes.
///
/// One of the constant, four of the sum without fused multiply-add, and what is of second order.
pub(super) const SIDE: f64 = 5.25;

/// How far rounding turns a ray from the eye, in roundoffs.
///
/// A coordinate on the window and the axis that it is along are rounded, 1 each, and the two sums, 1 each; each of these is a part of
/// the direction's length. A ray that is turned by more counts as one of no pixel.
pub(super) const TURNED: f64 = 4.0;

/// [`SIDE`] of a ray from the eye, where the ray of the pixel is meant.
pub(super) const SIDE_OF_PIXEL: f64 = SIDE + TURNED;

/// Rounding errors of the constants of an edge in `f64`, before they are rounded to the kernels' numbers, relative to the
/// product of the lengths.
///
/// A cross product of a corner and a difference of corners: 1 roundoff of the difference, 1 of each product and 1 of their
/// difference; 8 are allowed for.
pub(super) const CONSTANT: f64 = 4.0 * f64::EPSILON;

/// Rounding errors of a triangle's volume with the eye in `f64`, relative to the product of the lengths: those of
/// [`CONSTANT`], and of a dot product of three terms. Relative, too, to the sum of the six products of the determinant, each
/// at most that of the corners' largest coordinates: which is less where a triangle lies in a plane along two axes, near the
/// eye for its size.
pub(super) const VOLUME: f64 = 4.0 * f64::EPSILON;

/// How far a region of points that wait for light is widened on a sun's screen, in roundoffs of the sum of the
/// coordinates.
///
/// Each coordinate there is a dot product with an axis: 1 roundoff of the axis, 3 of the products and sums; on both sides
/// of the comparison 8, and as much again.
pub(super) const BEAM: f64 = 16.0;

/// A bound on the rounding errors of distances to triangles that are not met under a flat angle, as a part of 1 and of
/// the distance. Nearer than that a ray may start beyond the plane.
///
/// The height above the plane has 9 roundoffs and the slope 4; a ray is [settled] where the slope is below 1/32, so that
/// the errors of the height are at most 32 times as large along the ray: 9 · 32 = 288 and 4 · 32 = 128, together 416 of
/// 512. The rest is what a normal is off that was worked out in `f64` from corners before they were rounded.
///
/// [settled]: super::predicate::settle
pub(super) const fn distance_error<E: Real>() -> f64 {
    512.0 * E::ROUNDOFF + 2048.0 * f64::EPSILON
}
