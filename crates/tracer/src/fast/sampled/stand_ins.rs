//! Stand-ins for narrow objects, so wide that the rays of every pixel in which the narrow objects can be seen hit them.

use std::sync::Arc;

use glam::DVec3;
use rayfold_scene::model::unit;
use rayfold_scene::{
    Cone, Cuboid, Cylinder, Instance, Material, Object, Outline, Placement, SharedSlice, Sphere, Torus,
    Triangle,
};

use super::gauge::{Gauge, tips};
use crate::fast::shapes::instance::in_world;

/// The largest number of times that a long object is halved, because the size of a pixel varies along it.
const HALVINGS: u32 = 6;

/// Makes stand-ins that are some pixels wider on all sides.
pub(super) struct Widener<'a> {
    gauge: &'a Gauge,
    pixels: f64,
    material: Material,
    made: Vec<Object>,
}

impl<'a> Widener<'a> {
    /// Makes a widener. Its stand-ins have a colour that nothing else is likely to have.
    pub(super) fn new(gauge: &'a Gauge, pixels: f64) -> Self {
        let material =
            Material::new(DVec3::new(0.613, 0.127, 0.871), DVec3::ZERO, DVec3::ZERO).unwrap_or_default();
        Self { gauge, pixels, material, made: vec![] }
    }

    /// Returns the stand-ins of an object, wider by `more` pixels.
    pub(super) fn stand_ins(&mut self, object: &Object, more: f64) -> Vec<Object> {
        self.pixels += more;
        self.widen(object);
        self.pixels -= more;
        core::mem::take(&mut self.made)
    }

    fn wider(&self, at: DVec3) -> f64 {
        self.gauge.length(at, self.pixels)
    }

    /// Adds a stand-in. One whose numbers are out of range is left out.
    fn make<T: Into<Object>, E>(&mut self, made: Result<T, E>) {
        self.made.extend(made.ok().map(Into::into));
    }

    fn widen(&mut self, object: &Object) {
        if let Object::Instance(o) = object {
            match (in_world(o), o.object().outline()) {
                (Some(object), _) => self.widen(&object),
                (None, Some(Outline::Box { corners, .. })) => {
                    self.brick(corners, Some(o.placement()), HALVINGS);
                }
                (None, _) => {}
            }
        }
        let material = self.material.clone();
        match object.outline() {
            Some(Outline::Ball { center, radius }) => {
                self.make(Sphere::new(radius + self.wider(center), center, material));
            }
            Some(Outline::Triangle([a, b, c])) => {
                self.make(Triangle::new([a, b, c], material));
                for (a, b) in [(a, b), (b, c), (c, a)] {
                    self.rod([0.0; 2], [a, b], HALVINGS);
                }
            }
            Some(Outline::Box { corners, .. }) => self.brick(corners, None, HALVINGS),
            Some(Outline::Plane(_)) | None => {}
            Some(Outline::Disc { center, normal, radius }) => {
                let n = unit(normal);
                let wider =
                    self.wider(center) + self.gauge.pixel(center + radius * n.any_orthonormal_vector());
                let n = wider * n;
                self.make(Cylinder::new(radius + wider, [center - n, center + n], material));
            }
            Some(Outline::Rod { radii, ends, is_round }) => {
                self.rod(radii, if is_round { tips(radii[0], ends) } else { ends }, HALVINGS);
            }
            Some(Outline::Ring { radius, thickness, center, normal }) => {
                let (x, y) = unit(normal).any_orthonormal_pair();
                let around = [x, -x, y, -y].map(|way| self.wider(center + radius * way));
                let thick = thickness + around.into_iter().fold(0.0, f64::max);
                if thick < radius {
                    self.make(Torus::new(radius, thick, center, normal, material));
                } else {
                    self.make(Sphere::new(radius + thick, center, material));
                }
            }
        }
    }

    /// Adds a cone or cylinder, in parts if the size of a pixel varies along it.
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

    /// Adds a box, in parts if the size of a pixel varies along it.
    fn brick(&mut self, [low, high]: [DVec3; 2], placement: Option<&Placement>, halvings: u32) {
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
            self.brick([low, end], placement, halvings - 1);
            self.brick([start, high], placement, halvings - 1);
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

/// Returns a curved object in the world with another material.
pub(super) fn repainted(object: &Object, material: Material) -> Option<Object> {
    let Object::Instance(o) = object else {
        object.outline()?.curvature()?;
        return object.with_material(material).ok();
    };
    match in_world(o) {
        Some(object) => repainted(&object, material),
        None => {
            let group = SharedSlice::from(vec![repainted(o.object(), material)?]);
            Some(Instance::new(&group, 0, &Arc::new(*o.placement())).into())
        }
    }
}
