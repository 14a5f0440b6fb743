//! Bodies in the kernels' coordinates, in `f64`, computed before the first pixel.

use std::cmp::Ordering;

use glam::DVec3;
use rayfold_scene::Object;

use super::AnyForm;
use crate::fast::acceleration::hollow::Hollow;
use crate::fast::acceleration::tree::Grouped;
use crate::fast::rays::bounds::{Bounds, NOTHING};
use crate::fast::shapes::instance::{in_world, turned};
use crate::fast::shared::{Flat, Plain, Surface, is_square};
use crate::meshes::mesh;

/// A body and its position in the script.
#[derive(Clone, Copy, Debug)]
pub(in crate::fast) struct Solid {
    pub(super) frame: Frame,
    pub(super) form: AnyForm,
    pub(super) order: u32,
    /// The largest coordinate that the script gives for it, before the origin of a plane was moved near the eye.
    reach: f64,
}

/// The coordinate frame of a body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// Orthonormal axes. The last is the axis of symmetry of round shapes.
    pub(super) axes: [DVec3; 3],
    /// The origin of the axes.
    pub(super) center: DVec3,
}

/// The space between two parallel planes around a body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub(super) axis: DVec3,
    /// Half of the distance of the planes.
    pub(super) half: f64,
    /// The radius of a hole in the middle, along the axis; 0 without.
    pub(super) hole: f64,
}

/// A map from the scene to the kernels' coordinates: `center` becomes the origin, then all is scaled.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub(super) center: DVec3,
    pub(super) scale: f64,
}

/// The operations, before the first pixel, that differ between the shapes of bodies.
pub(super) trait Form {
    /// Returns at least the largest of its lengths.
    fn size(&self) -> f64;

    /// Calls `each` with the parts of its surface.
    fn each_surface(&self, frame: &Frame, each: &mut dyn FnMut(Surface));

    /// Returns whether a point, in coordinates along the axes from the centre, is at most `near` from the surface. If
    /// the last axis is not slanted, the side of a face perpendicular to it is known exactly.
    fn is_near(&self, place: DVec3, near: f64, is_slanted: bool) -> bool;

    /// Returns the centre and the radius of a bounding sphere. For a plane it is a point.
    fn ball(&self, frame: &Frame) -> (DVec3, f64);

    /// Returns the bounding box, as computed; `None` for a plane.
    fn bounds(&self, frame: &Frame) -> Option<Bounds>;

    /// Returns the two planes around it, as computed; `None` if it is not flat.
    fn slab(&self, _: &Frame) -> Option<Span> {
        None
    }

    /// Returns a ball that contains no part of its surface, as computed; `None` if there is no useful one.
    fn hollow(&self, _: &Frame) -> Option<Hollow> {
        None
    }
}

/// The margin of a body's bounding box, relative to its numbers.
const WIDER: f64 = 32.0 * f64::EPSILON;

/// The distance from the origin within which rounding may put a surface on the other side of it, relative to the body's
/// numbers.
const AT_ORIGIN: f64 = 64.0 * f64::EPSILON;

/// Returns an object in the kernels' coordinates, if it is a body that can be hit.
pub(in crate::fast) fn body(object: &Object, order: u32, center: DVec3, scale: f64) -> Option<Solid> {
    if let Object::Instance(instance) = object
        && turned(instance).is_none()
        && mesh(object).is_none()
    {
        return body(&in_world(instance)?, order, center, scale);
    }
    let place = Place { center, scale };
    let (frame, form) = AnyForm::new(object, place)?;
    let reach = if let Object::Plane(o) = object { place.point(o.point()).abs().element_sum() } else { 0.0 };
    Some(Solid { frame, form, order, reach })
}

/// Returns the largest distance from `center` along an axis among the numbers of the body; 0 if the object is no body.
pub(in crate::fast) fn reach(object: &Object, center: DVec3) -> f64 {
    body(object, 0, center, 1.0).map_or(0.0, |solid| solid.extent())
}

impl Place {
    pub(super) fn point(self, point: DVec3) -> DVec3 {
        (point - self.center) * self.scale
    }
}

impl Frame {
    /// Makes a frame whose last axis is given.
    pub(super) fn round_about(axis: DVec3, center: DVec3) -> Self {
        let (x, y) = axis.any_orthonormal_pair();
        Self { axes: [x, y, axis], center }
    }

    /// Returns the extent, along each axis of the scene, of a circle of radius 1 perpendicular to the last axis.
    pub(super) fn circle(&self) -> DVec3 {
        let z = self.axes[2];
        (DVec3::ONE - z * z).max(DVec3::ZERO).map(f64::sqrt)
    }
}

impl Span {
    /// Returns the span along the last axis of the frame.
    pub(super) fn across(frame: &Frame, half: f64, hole: f64) -> Self {
        Self { axis: frame.axes[2], half, hole }
    }

    /// Returns the pair of planes across the shortest side of a box.
    pub(super) fn of_box(frame: &Frame, half: DVec3) -> Option<Self> {
        let number = half.to_array().iter().position(|&length| length == half.min_element())?;
        Some(Self { axis: frame.axes[number], half: half[number], hole: 0.0 })
    }
}

/// Makes a round, flat part of a surface.
pub(super) fn flat(normal: DVec3, center: DVec3, radius: f64, plain: Plain) -> Surface {
    Surface::Flat(Flat { normal, height: normal.dot(center), center, radius, plain })
}

impl Solid {
    pub(super) fn new(frame: Frame, form: AnyForm, order: u32) -> Self {
        Self { frame, form, order, reach: 0.0 }
    }

    /// Returns at least the largest of its coordinates and lengths.
    pub(super) fn extent(&self) -> f64 {
        self.frame.center.abs().max_element() + self.form.form().size()
    }

    /// Returns its position in the script.
    pub(in crate::fast) fn order(&self) -> u32 {
        self.order
    }

    /// Calls `each` with the parts of its surface.
    pub(in crate::fast) fn each_surface(&self, mut each: impl FnMut(Surface)) {
        self.form.form().each_surface(&self.frame, &mut each);
    }

    /// Returns whether the origin is so near its surface that rounding might put it on the other side. Numbers along an
    /// axis are exact enough to decide.
    pub(in crate::fast) fn is_at_origin(&self) -> bool {
        let Frame { axes, center } = self.frame;
        let near = AT_ORIGIN * self.extent().max(self.reach);
        let place = DVec3::from(axes.map(|axis| -axis.dot(center)));
        self.form.form().is_near(place, near, !is_square(axes[2]))
    }

    /// Returns the centre and the radius of a bounding sphere, wide enough for rounding errors. For a plane it is only
    /// its point.
    pub(super) fn ball(&self) -> (DVec3, f64) {
        let (center, radius) = self.form.form().ball(&self.frame);
        (center, radius + WIDER * self.extent())
    }

    /// Returns the two planes around it, as computed; `None` for shapes that are not flat. Its bounding sphere is centred between
    /// them.
    pub(super) fn slab(&self) -> Option<Span> {
        self.form.form().slab(&self.frame)
    }

    /// Returns a ball that contains no part of its surface, as computed; `None` for shapes without a useful one.
    pub(super) fn hollow(&self) -> Option<Hollow> {
        self.form.form().hollow(&self.frame).filter(|&(_, radius)| radius > 0.0)
    }

    /// Returns its bounding box; `None` for a plane.
    pub(in crate::fast) fn bounds(&self) -> Option<Bounds> {
        let (low, high) = self.form.form().bounds(&self.frame)?;
        let slack = WIDER * self.extent();
        Some((low - slack, high + slack))
    }
}

impl Grouped for Solid {
    fn bounds(&self) -> Bounds {
        Self::bounds(self).unwrap_or(NOTHING)
    }

    /// Returns 0 for all bodies, because they have a tree of their own.
    fn number(&self) -> u32 {
        0
    }

    fn order(&self) -> u32 {
        self.order
    }

    /// Compares the positions in the script, so that no body counts as a copy of another.
    fn compare(&self, other: &Self) -> Ordering {
        self.order.cmp(&other.order)
    }
}
