//! What is asked of a shape once it is placed in the coordinates of the kernels, in `f64`: how far it reaches, what it
//! covers, and whether `f32` will do for it.

use std::ops::Range;

use glam::{DVec2, DVec3};

use super::bounds::Bounds;

/// A shape in the kernels' coordinates.
pub(super) trait Placed {
    /// The least box around it.
    fn bounds(&self) -> Bounds;

    /// How far it reaches along `direction`: the largest `direction · point`.
    fn support(&self, direction: DVec3) -> f64;

    /// The span of `p · axis / -(p · back)` over its points, widened by about `slack`: what it covers of the view's
    /// coordinate along `axis`. None if it reaches behind the eye.
    fn across(&self, axis: DVec3, back: DVec3, slack: f64) -> Option<(f64, f64)>;

    /// Whether its box is the shape itself, so that no rounding puts a face elsewhere.
    fn is_its_box(&self) -> bool {
        false
    }

    /// Its centre and radius, if it is a sphere.
    fn ball(&self) -> Option<(DVec3, f64)> {
        None
    }

    /// How many flat faces it has.
    fn faces(&self) -> Range<usize>;

    /// One of its flat faces.
    fn face(&self, number: usize) -> Face;

    /// Its normal, if all of it lies in one plane.
    fn plane(&self) -> Option<DVec3> {
        None
    }

    /// How near to the origin its surface comes, at least.
    fn nearest(&self) -> f64;

    /// How near to the origin the edge of its shadow passes, at least, in the light of a sun: `x` and `y` are that one's
    /// screen.
    fn shadow_nearest(&self, x: DVec3, y: DVec3) -> f64;

    /// Whether the errors of single precision cannot be seen in it.
    fn is_fine(&self, sight: &Sight) -> bool;

    /// How far from the origin it reaches, at least.
    fn farthest(&self) -> f64 {
        let (min, max) = self.bounds();
        min.abs().max(max.abs()).length()
    }

    /// The largest coordinate of its points, at least: what its rounding errors are relative to.
    fn magnitude(&self) -> f64 {
        let (min, max) = self.bounds();
        min.abs().max(max.abs()).max_element()
    }
}

/// A flat face with four corners.
pub(super) struct Face {
    /// Counterclockwise about the normal; a triangle's last comes twice.
    pub(super) corners: [DVec3; 4],
    pub(super) normal: DVec3,
    /// `normal · point` of its points.
    pub(super) height: f64,
}

impl Face {
    /// Whether rays meet both at the same distance bit for bit in single precision: the numbers of their planes are rounded to
    /// the same ones.
    pub(super) fn is_one_in_single(&self, other: &Self) -> bool {
        let of = |normal: DVec3, height: f64| (normal.as_vec3(), height as f32);
        let one = of(self.normal, self.height);
        one == of(other.normal, other.height) || one == of(-other.normal, -other.height)
    }
}

/// What can be seen of an error.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sight {
    /// The largest relative error of one rounding.
    pub(super) roundoff: f64,
    /// The size of a pixel: an angle from the eye, or a length in parallel projection.
    pub(super) pixel: f64,
    /// Whether all rays run along one direction.
    pub(super) parallel: bool,
    /// The error of a normal, as a sine, that cannot be seen.
    pub(super) normal: f64,
    /// The part of a pixel that nothing may move by.
    pub(super) invisible: f64,
    /// Rounding errors that add up in a point on a surface, in roundoffs of its distance and the size of what it is on.
    pub(super) point: f64,
    /// The same in where a ray starts that goes on from there, and in the test of what it meets.
    pub(super) start: f64,
}

impl Sight {
    /// Whether the errors of what is flat cannot be seen. From the eye they are relative to the distance of what is seen,
    /// as those of the directions are, which are known to be invisible; in parallel what is far away is as large as what
    /// is near.
    pub(super) fn is_fine_if_flat(&self, magnitude: f64) -> bool {
        !self.parallel || self.is_invisible(self.start * magnitude, 0.0)
    }

    /// Whether so many roundoffs cannot be seen at this distance.
    pub(super) fn is_invisible(&self, roundoffs: f64, distance: f64) -> bool {
        let pixel = if self.parallel { self.pixel } else { self.pixel * distance };
        self.roundoff * roundoffs <= self.invisible * pixel
    }
}

/// How near to the origin what lies within a box comes.
pub(super) fn nearest_within((min, max): Bounds) -> f64 {
    DVec3::ZERO.clamp(min, max).length()
}

/// How near to the origin the edge between two corners passes on a sun's screen, whose axes are `x` and `y`.
pub(super) fn edge_nearest([from, to]: [DVec3; 2], x: DVec3, y: DVec3) -> f64 {
    let on_screen = |corner: DVec3| DVec2::new(corner.dot(x), corner.dot(y));
    let (from, along) = (on_screen(from), on_screen(to) - on_screen(from));
    let square = along.length_squared();
    let part = if square > 0.0 { (-from.dot(along) / square).clamp(0.0, 1.0) } else { 0.0 };
    (from + part * along).length()
}

/// [`Placed::across`] of what is spanned by corners.
pub(super) fn across_corners(corners: &[DVec3], axis: DVec3, back: DVec3, slack: f64) -> Option<(f64, f64)> {
    corners.iter().try_fold((f64::INFINITY, f64::NEG_INFINITY), |(from, to), point| {
        let (x, depth) = (point.dot(axis), -point.dot(back) - 2.0 * slack);
        let wide = (x.abs() + 2.0 * slack) / depth - x.abs() / (depth + 4.0 * slack);
        let middle = x / depth;
        (depth > 0.0).then_some((from.min(middle - wide), to.max(middle + wide)))
    })
}
