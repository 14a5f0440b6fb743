//! Objects that stand in for narrower ones: so wide that the rays of every pixel in which those can be seen meet them.

use std::sync::Arc;

use glam::DVec3;
use rayfold_scene::model::unit;
use rayfold_scene::{
    Capsule, Cone, Cuboid, Cylinder, Instance, Material, Object, Placement, Roundbox, SharedSlice, Sphere,
    Torus, Triangle,
};

use super::gauge::{Gauge, tips};
use crate::fast::shapes::instance::in_world;

/// How often what is long is halved, at most, because pixels are not of one size along it.
const HALVINGS: u32 = 6;

/// Makes stand-ins, so many pixels wider on all sides.
pub(super) struct Widener<'a> {
    gauge: &'a Gauge,
    pixels: f64,
    material: Material,
    made: Vec<Object>,
}

impl<'a> Widener<'a> {
    /// Of a colour that nothing else is likely to have.
    pub(super) fn new(gauge: &'a Gauge, pixels: f64) -> Self {
        let material =
            Material::new(DVec3::new(0.613, 0.127, 0.871), DVec3::ZERO, DVec3::ZERO).unwrap_or_default();
        Self { gauge, pixels, material, made: vec![] }
    }

    /// Those of an object, wider by some pixels more.
    pub(super) fn stand_ins(&mut self, object: &Object, more: f64) -> Vec<Object> {
        self.pixels += more;
        self.widen(object);
        self.pixels -= more;
        core::mem::take(&mut self.made)
    }

    fn wider(&self, at: DVec3) -> f64 {
        self.gauge.length(at, self.pixels)
    }

    /// What cannot be made of such numbers is left out: it is at the end of all numbers.
    fn make<T: Into<Object>, E>(&mut self, made: Result<T, E>) {
        self.made.extend(made.ok().map(Into::into));
    }

    fn widen(&mut self, object: &Object) {
        let material = self.material.clone();
        match object {
            Object::Sphere(o) => {
                let sphere = Sphere::new(o.radius() + self.wider(o.center()), o.center(), material);
                self.make(sphere);
            }
            Object::Triangle(o) => {
                let [a, b, c] = *o.vertices();
                self.make(Triangle::new([a, b, c], material));
                for (a, b) in [(a, b), (b, c), (c, a)] {
                    self.rod([0.0; 2], [a, b], HALVINGS);
                }
            }
            Object::Cuboid(o) => self.brick((o.min(), o.max()), None, HALVINGS),
            Object::Roundbox(o) => self.brick((o.min(), o.max()), None, HALVINGS),
            Object::Plane(_) | Object::Mesh(_) => {}
            Object::Disc(o) => {
                let n = unit(o.normal());
                let wider = self.wider(o.center())
                    + self.gauge.pixel(o.center() + o.radius() * n.any_orthonormal_vector());
                let n = wider * n;
                self.make(Cylinder::new(o.radius() + wider, [o.center() - n, o.center() + n], material));
            }
            Object::Cylinder(o) => self.rod([o.radius(); 2], o.ends(), HALVINGS),
            Object::Cone(o) => self.rod(o.radii(), o.ends(), HALVINGS),
            Object::Torus(o) => {
                let (x, y) = unit(o.normal()).any_orthonormal_pair();
                let around = [x, -x, y, -y].map(|way| self.wider(o.center() + o.radius() * way));
                let thick = o.thickness() + around.into_iter().fold(0.0, f64::max);
                if thick < o.radius() {
                    self.make(Torus::new(o.radius(), thick, o.center(), o.normal(), material));
                } else {
                    self.make(Sphere::new(o.radius() + thick, o.center(), material));
                }
            }
            Object::Capsule(o) => self.rod([o.radius(); 2], tips(o), HALVINGS),
            Object::Instance(o) => match (in_world(o), o.object()) {
                (Some(object), _) => self.widen(&object),
                (None, Object::Cuboid(cuboid)) => {
                    self.brick((cuboid.min(), cuboid.max()), Some(o.placement()), HALVINGS);
                }
                (None, Object::Roundbox(roundbox)) => {
                    self.brick((roundbox.min(), roundbox.max()), Some(o.placement()), HALVINGS);
                }
                (None, _) => {}
            },
        }
    }

    /// A cone or cylinder; in parts where pixels are of other sizes along it.
    fn rod(&mut self, [low, high]: [f64; 2], [a, b]: [DVec3; 2], halvings: u32) {
        let middle = 0.5 * (a + b);
        let (at_a, at_b) = (self.wider(a), self.wider(b));
        if halvings > 0 && 0.5 * (at_a + at_b) > 1.5 * self.wider(middle) {
            let half = 0.5 * (low + high);
            self.rod([low, half], [a, middle], halvings - 1);
            self.rod([half, high], [middle, b], halvings - 1);
            return;
        }
        let along = (b - a).normalize_or(DVec3::Z);
        let ends = [a - at_a * along, b + at_b * along];
        let material = self.material.clone();
        self.make(Cone::new([low + at_a, high + at_b], ends, material));
    }

    /// A box, in parts where pixels are of other sizes along it.
    fn brick(&mut self, (low, high): (DVec3, DVec3), placement: Option<&Placement>, halvings: u32) {
        let place = |p: DVec3| placement.map_or(p, |placement| placement.point(p));
        let scale = placement.map_or(1.0, Placement::scale);
        let ends = [low, high];
        let corners = (0..8).map(|k: usize| DVec3::new(ends[k & 1].x, ends[k >> 1 & 1].y, ends[k >> 2].z));
        let wider: Vec<f64> = corners.map(|corner| self.wider(place(corner))).collect();
        let (least, most) =
            wider.iter().fold((f64::INFINITY, 0.0), |(a, b): (f64, f64), &x| (a.min(x), b.max(x)));
        let middle = 0.5 * (low + high);
        let least = least.min(self.wider(place(middle)));
        let size = high - low;
        let longest = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0);
        if halvings > 0 && most > 1.5 * least && scale * size[longest] > 2.0 * most {
            let (mut end, mut start) = (high, low);
            (end[longest], start[longest]) = (middle[longest], middle[longest]);
            self.brick((low, end), placement, halvings - 1);
            self.brick((start, high), placement, halvings - 1);
            return;
        }
        let wider = DVec3::splat(most / scale);
        let cuboid = Cuboid::new([low - wider, high + wider], self.material.clone());
        match placement {
            None => self.make(cuboid),
            Some(placement) => {
                let of_group = cuboid.map(|cuboid| SharedSlice::from(vec![Object::from(cuboid)]));
                self.make(of_group.map(|group| Instance::new(&group, 0, &Arc::new(*placement))));
            }
        }
    }
}

/// A curved object with another material, in the world.
pub(super) fn repainted(object: &Object, material: Material) -> Option<Object> {
    let made = match object {
        Object::Sphere(o) => Object::from(Sphere::new(o.radius(), o.center(), material).ok()?),
        Object::Cylinder(o) => Object::from(Cylinder::new(o.radius(), o.ends(), material).ok()?),
        Object::Cone(o) => Object::from(Cone::new(o.radii(), o.ends(), material).ok()?),
        Object::Torus(o) => {
            Object::from(Torus::new(o.radius(), o.thickness(), o.center(), o.normal(), material).ok()?)
        }
        Object::Capsule(o) => Object::from(Capsule::new(o.radius(), o.ends(), material).ok()?),
        Object::Roundbox(o) => Object::from(Roundbox::new(*o.corners(), o.radius(), material).ok()?),
        Object::Instance(o) => match in_world(o) {
            Some(object) => return repainted(&object, material),
            None => {
                let group = SharedSlice::from(vec![repainted(o.object(), material)?]);
                Object::from(Instance::new(&group, 0, &Arc::new(*o.placement())))
            }
        },
        Object::Triangle(_) | Object::Cuboid(_) | Object::Plane(_) | Object::Disc(_) | Object::Mesh(_) => {
            return None;
        }
    };
    Some(made)
}
