//! The interface of a shape in the coordinates of the kernels, in `f64`: its extent, the region that it covers, and
//! whether `f32` is precise enough for it.

use std::ops::Range;

use glam::{DVec2, DVec3};

use crate::fast::rays::bounds::Bounds;

/// A shape in the kernels' coordinates.
pub(crate) trait RenderSpaceShape {
    /// Returns the smallest box around it.
    fn bounds(&self) -> Bounds;

    /// Returns the shape's extent along `direction`: the largest `direction · point`.
    fn support(&self, direction: DVec3) -> f64;

    /// Returns the span of `p · axis / -(p · back)` over the shape's points, widened by about `slack`: the part of the
    /// view's coordinate along `axis` that the shape covers. Returns `None` if the shape reaches behind the eye.
    fn across(&self, axis: DVec3, back: DVec3, slack: f64) -> Option<(f64, f64)>;

    /// Returns whether the shape is its own bounding box, so that no rounding moves a face.
    fn is_its_box(&self) -> bool {
        false
    }

    /// Returns the centre and the radius if the shape is a sphere.
    fn ball(&self) -> Option<(DVec3, f64)> {
        None
    }

    /// Returns the numbers of its flat faces.
    fn faces(&self) -> Range<usize>;

    /// Returns one of its flat faces.
    fn face(&self, number: usize) -> Face;

    /// Returns the normal if all of the shape is in one plane.
    fn plane(&self) -> Option<DVec3> {
        None
    }

    /// Returns a lower bound of the distance between the origin and the shape's surface.
    fn nearest(&self) -> f64;

    /// Returns a lower bound of the distance between the origin and the edge of the shape's shadow on a sun's screen,
    /// whose axes are `x` and `y`.
    fn shadow_nearest(&self, x: DVec3, y: DVec3) -> f64;

    /// Returns whether the errors of single precision are invisible in the shape.
    fn is_fine(&self, sight: &Sight) -> bool;

    /// Returns an upper bound of the distance between the origin and the shape's points.
    fn farthest(&self) -> f64 {
        let (min, max) = self.bounds();
        min.abs().max(max.abs()).length()
    }

    /// Returns an upper bound of the coordinates of the shape's points. The shape's rounding errors are relative to
    /// this bound.
    fn magnitude(&self) -> f64 {
        let (min, max) = self.bounds();
        min.abs().max(max.abs()).max_element()
    }
}

/// A flat face with four corners.
pub(crate) struct Face {
    /// The corners, counterclockwise about the normal. The last corner of a triangle is repeated.
    pub(crate) corners: [DVec3; 4],
    pub(crate) normal: DVec3,
    /// `normal · point` of its points.
    pub(crate) height: f64,
}

impl Face {
    /// Returns whether rays hit both faces at the same distance bit for bit in single precision, because the numbers of
    /// their planes round to the same numbers.
    pub(crate) fn is_one_in_single(&self, other: &Self) -> bool {
        let of = |normal: DVec3, height: f64| (normal.as_vec3(), height as f32);
        let one = of(self.normal, self.height);
        one == of(other.normal, other.height) || one == of(-other.normal, -other.height)
    }
}

/// The limits below which an error is invisible.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight {
    /// The largest relative error of one rounding.
    pub(crate) roundoff: f64,
    /// The size of a pixel: an angle from the eye, or a length in parallel projection.
    pub(crate) pixel: f64,
    /// Whether all rays have one direction.
    pub(crate) parallel: bool,
    /// The largest invisible error of a normal, as a sine.
    pub(crate) normal: f64,
    /// The largest invisible error of a position, in pixels.
    pub(crate) invisible: f64,
    /// The accumulated rounding error of a point on a surface, in roundoffs of its distance and the size of its object.
    pub(crate) point: f64,
    /// The accumulated rounding error of the start of a ray from that point and of the test of the next hit, in the
    /// same roundoffs.
    pub(crate) start: f64,
}

impl Sight {
    /// Returns whether the errors of a flat shape are invisible. From the eye they are relative to the distance of the
    /// point, as are those of the directions, which are invisible. In parallel projection a distant object is as large
    /// as a near one.
    pub(crate) fn is_fine_if_flat(&self, magnitude: f64) -> bool {
        !self.parallel || self.is_invisible(self.start * magnitude, 0.0)
    }

    /// Returns whether an error of this many roundoffs is invisible at this distance.
    pub(crate) fn is_invisible(&self, roundoffs: f64, distance: f64) -> bool {
        let pixel = if self.parallel { self.pixel } else { self.pixel * distance };
        self.roundoff * roundoffs <= self.invisible * pixel
    }
}

/// Returns the distance from the origin to the nearest point of a box.
pub(crate) fn nearest_within((min, max): Bounds) -> f64 {
    DVec3::ZERO.clamp(min, max).length()
}

/// Returns the distance from the origin to the edge between two corners on a sun's screen, whose axes are `x` and `y`.
pub(crate) fn edge_nearest([from, to]: [DVec3; 2], x: DVec3, y: DVec3) -> f64 {
    let on_screen = |corner: DVec3| DVec2::new(corner.dot(x), corner.dot(y));
    let (from, along) = (on_screen(from), on_screen(to) - on_screen(from));
    let square = along.length_squared();
    let part = if square > 0.0 { (-from.dot(along) / square).clamp(0.0, 1.0) } else { 0.0 };
    (from + part * along).length()
}

/// Returns [`RenderSpaceShape::across`] of the convex hull of corners.
pub(crate) fn across_corners(corners: &[DVec3], axis: DVec3, back: DVec3, slack: f64) -> Option<(f64, f64)> {
    corners.iter().try_fold((f64::INFINITY, f64::NEG_INFINITY), |(from, to), point| {
        let (x, depth) = (point.dot(axis), -point.dot(back) - 2.0 * slack);
        let wide = (x.abs() + 2.0 * slack) / depth - x.abs() / (depth + 4.0 * slack);
        let middle = x / depth;
        (depth > 0.0).then_some((from.min(middle - wide), to.max(middle + wide)))
    })
}
