//! Bodies in the kernels' coordinates, in `f64`, before the first pixel.

use std::cmp::Ordering;

use glam::DVec3;
use rayfold_scene::model::unit;
use rayfold_scene::{Cuboid, Instance, Object};

use crate::fast::bounds::{Bounds, NOTHING};
use crate::fast::shapes::instance::{in_world, turned_box};
use crate::fast::shared::{Flat, Plain, Ring, Side, Surface};
use crate::fast::tree::Grouped;

/// A body and its position in the script.
#[derive(Clone, Copy, Debug)]
pub(in crate::fast) struct Solid {
    /// Orthonormal; the last is that of what is round.
    pub(super) axes: [DVec3; 3],
    /// Where they start.
    pub(super) center: DVec3,
    pub(super) form: Form,
    pub(super) order: u32,
    /// How far numbers of it reached before they were brought near the origin.
    reach: f64,
}

/// What a body is, along its axes.
#[derive(Clone, Copy, Debug)]
pub(in crate::fast) enum Form {
    Plane,
    Disc {
        radius: f64,
    },
    /// From its center along the last axis to `end`.
    Cone {
        radii: [f64; 2],
        height: f64,
        end: DVec3,
    },
    Torus {
        radius: f64,
        thickness: f64,
    },
    Cuboid {
        half: DVec3,
    },
}

/// How much wider than computed a body's box is, relative to its numbers.
const WIDER: f64 = 32.0 * f64::EPSILON;

/// How near the origin rounding may put it on the other side of a surface, relative to the body's numbers.
const AT_ORIGIN: f64 = 64.0 * f64::EPSILON;

/// An object moved so that `center` is the origin and then scaled, if it is a body that can be hit.
pub(in crate::fast) fn body(object: &Object, order: u32, center: DVec3, scale: f64) -> Option<Solid> {
    let place = |point: DVec3| (point - center) * scale;
    let (axes, middle, form) = match object {
        // From its place nearest to the eye, wherever its point lies.
        Object::Plane(o) => {
            let normal = unit(o.normal());
            (round_about(normal), normal * normal.dot(place(o.point())), Form::Plane)
        }
        Object::Disc(o) => {
            let form = Form::Disc { radius: scale * o.radius() };
            (round_about(unit(o.normal())), place(o.center()), form)
        }
        Object::Cylinder(o) => cone([o.radius(); 2].map(|radius| scale * radius), o.ends(), scale, place),
        Object::Cone(o) => cone(o.radii().map(|radius| scale * radius), o.ends(), scale, place),
        Object::Torus(o) => {
            let form = Form::Torus { radius: scale * o.radius(), thickness: scale * o.thickness() };
            (round_about(unit(o.normal())), place(o.center()), form)
        }
        Object::Instance(instance) => match turned_box(instance) {
            Some(cuboid) => askew(cuboid, instance, scale, place),
            None => return body(&in_world(instance)?, order, center, scale),
        },
        Object::Sphere(_) | Object::Triangle(_) | Object::Cuboid(_) => return None,
    };
    let reach = if let Object::Plane(o) = object { place(o.point()).abs().element_sum() } else { 0.0 };
    Some(Solid { axes, center: middle, form, order, reach })
}

type Placed = ([DVec3; 3], DVec3, Form);

fn cone(radii: [f64; 2], [a, b]: [DVec3; 2], scale: f64, place: impl Fn(DVec3) -> DVec3) -> Placed {
    // Relative to each other the ends are known better than where they lie.
    let along = (b - a) * scale;
    (round_about(unit(along)), place(a), Form::Cone { radii, height: along.length(), end: place(b) })
}

fn askew(cuboid: &Cuboid, instance: &Instance, scale: f64, place: impl Fn(DVec3) -> DVec3) -> Placed {
    let placement = instance.placement();
    let rotation = placement.rotation();
    let (min, max) = (cuboid.min(), cuboid.max());
    let middle = place(placement.point(min + 0.5 * (max - min)));
    let half = 0.5 * (max - min) * (placement.scale() * scale);
    ([rotation.x_axis, rotation.y_axis, rotation.z_axis], middle, Form::Cuboid { half })
}

/// Axes the last of which is given.
fn round_about(axis: DVec3) -> [DVec3; 3] {
    let (x, y) = axis.any_orthonormal_pair();
    [x, y, axis]
}

/// The largest distance along an axis from `center` that numbers of the body have; 0 for what is no body.
pub(in crate::fast) fn reach(object: &Object, center: DVec3) -> f64 {
    body(object, 0, center, 1.0).map_or(0.0, |solid| solid.extent())
}

impl Solid {
    /// At least the largest of its coordinates and lengths.
    pub(super) fn extent(&self) -> f64 {
        let size = match self.form {
            Form::Plane => 0.0,
            Form::Disc { radius } => radius,
            Form::Cone { radii: [a, b], height, .. } => height + a.max(b),
            Form::Torus { radius, thickness } => radius + thickness,
            Form::Cuboid { half } => half.element_sum(),
        };
        self.center.abs().max_element() + size
    }

    /// Its position in the script.
    pub(in crate::fast) fn order(&self) -> u32 {
        self.order
    }

    /// The parts of its surface.
    pub(in crate::fast) fn each_surface(&self, mut each: impl FnMut(Surface)) {
        let flat = |normal: DVec3, center: DVec3, radius: f64, plain| {
            Surface::Flat(Flat { normal, height: normal.dot(center), center, radius, plain })
        };
        let &Self { axes, center, .. } = self;
        let axis = axes[2];
        match self.form {
            Form::Plane => each(flat(axis, center, f64::INFINITY, Plain::ByAxis)),
            Form::Disc { radius } => each(flat(axis, center, radius, Plain::ByAxis)),
            Form::Cone { radii, height, end } => {
                for (center, radius) in [center, end].into_iter().zip(radii) {
                    if radius > 0.0 {
                        each(flat(axis, center, radius, Plain::ByAxis));
                    }
                }
                each(Surface::Side(Side { end: center, axis, height, radii }));
            }
            Form::Torus { radius, thickness } => {
                each(Surface::Ring(Ring { center, axis, radius, thickness }));
            }
            Form::Cuboid { half } => {
                for number in 0..3 {
                    let (normal, across) = (axes[number], half * (1.0 - DVec3::AXES[number]));
                    let apart = half[number] * normal;
                    each(flat(normal, center - apart, across.length(), Plain::No));
                    if half[number] > 0.0 {
                        each(flat(normal, center + apart, across.length(), Plain::No));
                    }
                }
            }
        }
    }

    /// Whether the origin lies so near its surface that rounding might put it on the other side. Numbers along an axis are
    /// exact enough to tell.
    pub(in crate::fast) fn is_at_origin(&self) -> bool {
        let near = AT_ORIGIN * self.extent().max(self.reach);
        let [x, y, z] = self.axes.map(|axis| -axis.dot(self.center));
        let is_slanted = self.axes[2].abs().max_element() < 1.0;
        let aside = x.hypot(y);
        match self.form {
            Form::Plane => is_slanted && z.abs() <= near,
            Form::Disc { radius } => is_slanted && z.abs() <= near && aside <= radius + near,
            Form::Cone { radii: [a, b], height, .. } => {
                let radius = a + (b - a) * (z / height).clamp(0.0, 1.0);
                let ends = z.abs().min((z - height).abs());
                let within = z >= -near && z <= height + near;
                let slope = 1.0 + (b - a).abs() / height;
                within && ((aside - radius).abs() <= near * slope || ends <= near && aside <= radius + near)
            }
            Form::Torus { radius, thickness } => ((aside - radius).hypot(z) - thickness).abs() <= near,
            Form::Cuboid { half } => {
                let outside = (DVec3::new(x, y, z).abs() - half).max_element();
                outside.abs() <= near
            }
        }
    }

    /// A ball around it, of a plane its point alone: its middle and its radius, wide enough for what rounding makes of it.
    pub(super) fn ball(&self) -> (DVec3, f64) {
        let (center, radius) = match self.form {
            Form::Plane => (self.center, 0.0),
            Form::Disc { radius } => (self.center, radius),
            Form::Cone { radii: [a, b], height, end } => {
                (0.5 * (self.center + end), a.max(b).hypot(0.5 * height))
            }
            Form::Torus { radius, thickness } => (self.center, radius + thickness),
            Form::Cuboid { half } => (self.center, half.length()),
        };
        (center, radius + WIDER * self.extent())
    }

    /// The box around it; none around a plane.
    pub(in crate::fast) fn bounds(&self) -> Option<Bounds> {
        let [x, y, z] = self.axes;
        // How far a circle square to z reaches along each axis.
        let circle = (DVec3::ONE - z * z).max(DVec3::ZERO).map(f64::sqrt);
        let (low, high) = match self.form {
            Form::Plane => return None,
            Form::Disc { radius } => (self.center - radius * circle, self.center + radius * circle),
            Form::Cone { radii: [a, b], end, .. } => (
                (self.center - a * circle).min(end - b * circle),
                (self.center + a * circle).max(end + b * circle),
            ),
            Form::Torus { radius, thickness } => {
                let reach = radius * circle + thickness;
                (self.center - reach, self.center + reach)
            }
            Form::Cuboid { half } => {
                let reach = x.abs() * half.x + y.abs() * half.y + z.abs() * half.z;
                (self.center - reach, self.center + reach)
            }
        };
        let slack = WIDER * self.extent();
        Some((low - slack, high + slack))
    }
}

impl Grouped for Solid {
    fn bounds(&self) -> Bounds {
        Self::bounds(self).unwrap_or(NOTHING)
    }

    /// Bodies have a tree of their own, in which all are alike.
    fn number(&self) -> u32 {
        0
    }

    fn order(&self) -> u32 {
        self.order
    }

    /// None is taken for the same as another.
    fn compare(&self, other: &Self) -> Ordering {
        self.order.cmp(&other.order)
    }
}
