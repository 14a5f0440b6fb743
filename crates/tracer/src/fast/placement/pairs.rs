//! Pairs of objects that share a surface.
//!
//! Parts of surfaces are sorted so that those in the same surface are neighbours: first by direction, then by position.
//! Neighbours are compared pair by pair if one lies over the other.

use glam::DVec3;
use rayfold_scene::{Object, Scene};

use crate::fast::placement::geometry::Geometry;
use crate::fast::shapes::Shape;
use crate::fast::shared::surface::{ASIDE, Flat, Plain, SAME, Surface};
use crate::fast::shared::{Pair, SharedSurfaces};
use crate::{Precision, RenderOptions};

/// The maximum number of comparisons of parts. If more parts lie in one place, rounding decides about the rest.
const MAX_COMPARED: usize = 1 << 25;

/// The maximum number of pairs that are kept.
const MAX_PAIRS: usize = 1 << 22;

/// The minimum distance within which directions and positions count as neighbours.
const TOGETHER: f64 = 1.0 / (1u64 << 32) as f64;

/// The factor by which the rounding error of a direction may exceed that of a position. It grows as a part gets small
/// compared with its distance.
const SMALL: f64 = 1024.0;

/// A part of an object's surface.
struct Part {
    order: u32,
    /// The direction of a part, and its position along it.
    key: (f64, f64),
    /// The largest range that it covers along [`ASIDE`].
    span: (f64, f64),
    surface: Surface,
}

impl Part {
    fn new(order: u32, surface: Surface) -> Self {
        let (center, radius) = surface.ball();
        let (at, reach) = (center.dot(ASIDE), radius * ASIDE.length());
        Self { order, key: surface.key(), span: (at - reach, at + reach), surface }
    }
}

impl Geometry {
    /// Adds the objects that share surfaces.
    pub(crate) fn with_shared_surfaces(mut self, scene: &Scene) -> Self {
        let pairs = find(&self, scene);
        self.shared = (!pairs.is_empty()).then(|| SharedSurfaces::of_pairs(&pairs, scene.objects.len()));
        self
    }

    /// Adds them for single precision, if that was requested. If single precision was chosen automatically, the only
    /// shared surfaces are those that rays hit at the same distance bit for bit.
    pub(crate) fn with_shared_surfaces_if_single(self, scene: &Scene, options: &RenderOptions) -> Self {
        match options.precision {
            Precision::F32 => self.with_shared_surfaces(scene),
            Precision::Auto | Precision::F64 => self,
        }
    }
}

/// Returns the pairs of a scene, sorted by the second object and then by the first.
fn find(geometry: &Geometry, scene: &Scene) -> Vec<Pair> {
    let is_plain = geometry.bodies.is_empty() && !geometry.is_finished && !geometry.are_distinct();
    if is_plain && geometry.have_one_material(scene) {
        return vec![];
    }
    let mut parts: Vec<Part> = Vec::new();
    for solid in geometry.solids.iter() {
        each_part(&solid.shape, |surface| parts.push(Part::new(solid.order, surface)));
    }
    for body in &geometry.bodies {
        body.each_surface(|surface| parts.push(Part::new(body.order(), surface)));
    }
    let sizes: Vec<DVec3> = scene.objects.iter().map(|object| sizes(object, geometry)).collect();
    let largest =
        sizes.iter().map(|size| size.max_element()).filter(|size| size.is_finite()).fold(1.0, f64::max);
    let together = TOGETHER.max(SMALL * SAME * largest);
    let mut search = Search { sizes, left: MAX_COMPARED, pairs: vec![] };
    parts.sort_unstable_by(|a, b| a.key.0.total_cmp(&b.key.0));
    for parts in parts.chunk_by_mut(|a, b| b.key.0 - a.key.0 <= together) {
        parts.sort_unstable_by(|a, b| a.key.1.total_cmp(&b.key.1));
        for parts in parts.chunk_by_mut(|a, b| b.key.1 - a.key.1 <= 4.0 * together) {
            search.among(parts);
        }
    }
    let mut pairs = search.pairs;
    pairs.sort_unstable_by(|a, b| {
        (a.second, a.first).cmp(&(b.second, b.first)).then(b.size.total_cmp(&a.size))
    });
    pairs.dedup_by_key(|pair| (pair.second, pair.first));
    pairs
}

struct Search {
    sizes: Vec<DVec3>,
    left: usize,
    pairs: Vec<Pair>,
}

impl Search {
    /// Compares parts that stand together.
    fn among(&mut self, parts: &mut [Part]) {
        let is_one_plane = |part: &Part| part.surface.is_met_with(&parts[0].surface);
        if parts.len() < 2 || parts.iter().all(is_one_plane) {
            return;
        }
        parts.sort_unstable_by(|a, b| a.span.0.total_cmp(&b.span.0));
        for (at, one) in parts.iter().enumerate() {
            for other in parts[at + 1..].iter().take_while(|other| other.span.0 <= one.span.1) {
                if self.left == 0 || self.pairs.len() == MAX_PAIRS {
                    return;
                }
                self.left -= 1;
                self.compare(one, other);
            }
        }
    }

    fn compare(&mut self, one: &Part, other: &Part) {
        if one.order == other.order || one.surface.is_met_with(&other.surface) {
            return;
        }
        let sizes = self.sizes[one.order as usize] + self.sizes[other.order as usize];
        if let Some(size) = one.surface.shared(&other.surface, sizes) {
            let (first, second) = (one.order.min(other.order), one.order.max(other.order));
            self.pairs.push(Pair { first, second, size });
        }
    }
}

/// Returns the parts of objects that have no axes of their own.
fn each_part(shape: &Shape, mut each: impl FnMut(Surface)) {
    match shape {
        Shape::Sphere(ball) => each(Surface::Ball { center: ball.center, radius: ball.radius }),
        Shape::Triangle(triangle) => {
            let [a, b, c] = triangle.vertices;
            let center = (a + b + c) / 3.0;
            let radius = triangle.vertices.iter().map(|v| v.distance(center)).fold(0.0, f64::max);
            let (normal, height) = (triangle.normal, triangle.height);
            each(Surface::Flat(Flat { normal, height, center, radius, plain: Plain::Triangle }));
        }
        Shape::Cuboid(cuboid) => {
            let (min, max) = (cuboid.min, cuboid.max);
            for axis in 0..3 {
                let normal = DVec3::AXES[axis];
                let across = (max - min) * (1.0 - normal);
                for height in [min[axis], max[axis]] {
                    let mut center = 0.5 * (min + max);
                    center[axis] = height;
                    let radius = 0.5 * across.length();
                    each(Surface::Flat(Flat { normal, height, center, radius, plain: Plain::ByAxis }));
                    if min[axis] == max[axis] {
                        break;
                    }
                }
            }
        }
    }
}

/// The weight of the script's numbers in bounds on rounding errors: they are rounded once or twice, and not in each
/// step of a test.
const WRITTEN: f64 = 1.0 / 16.0;

/// The maximum ratio of the script's weighted numbers to the numbers as seen from the eye. Farther away the rounding
/// errors of the script's numbers are visible, and surfaces are where the numbers say.
const FARTHEST: f64 = (1u64 << 19) as f64;

/// Returns the largest numbers that determine the position of an object, along each axis, as lengths of the kernels: as
/// seen from the eye, and with less weight those of its line, of its group and of the eye.
fn sizes(object: &Object, geometry: &Geometry) -> DVec3 {
    let center = geometry.center;
    let seen = numbers(object, center);
    let written = WRITTEN * (numbers(object, DVec3::ZERO) + center.abs());
    (seen + written.min(DVec3::splat(FARTHEST * seen.max_element()))) * geometry.scale
}

/// Returns the same for coordinates with the origin `center`.
fn numbers(object: &Object, center: DVec3) -> DVec3 {
    let Object::Instance(instance) = object else { return of_line(object, center) };
    let placement = instance.placement();
    let rotation = placement.rotation();
    let local = placement.scale() * of_line(instance.object(), DVec3::ZERO);
    let turned =
        rotation.x_axis.abs() * local.x + rotation.y_axis.abs() * local.y + rotation.z_axis.abs() * local.z;
    (placement.translation() - center).abs() + turned
}

fn of_line(object: &Object, center: DVec3) -> DVec3 {
    let far = |point: DVec3| (point - center).abs();
    match (object, object.bounds()) {
        (_, Some([low, high])) => far(low).max(far(high)),
        (Object::Plane(plane), None) => far(plane.point()),
        // None is in another, and all others have an end.
        (_, None) => DVec3::ZERO,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DMat3;
    use rayfold_scene::{
        Camera, Cuboid, Cylinder, Disc, Instance, Material, Placement, Screen, Sphere, Torus, Triangle,
    };

    use super::*;

    /// Returns the pairs of a scene of objects with different colours.
    fn pairs(objects: Vec<Object>) -> Vec<(u32, u32)> {
        let mut scene = Scene::new(Screen::new(4, 3).unwrap(), Camera::Orthographic);
        scene.objects = objects.into();
        let geometry = Geometry::new(&scene, None).unwrap().with_shared_planes(&scene);
        find(&geometry, &scene).iter().map(|pair| (pair.first, pair.second)).collect()
    }

    fn colored(level: f64) -> Material {
        Material::new(DVec3::splat(level), DVec3::ZERO, DVec3::ZERO).unwrap()
    }

    fn can(radius: f64, from: f64, to: f64, level: f64) -> Object {
        let ends = [from, to].map(|height| DVec3::new(1.0, height, -0.3));
        Cylinder::new(radius, ends, colored(level)).unwrap().into()
    }

    fn turned(objects: Vec<Object>) -> Vec<Object> {
        let turn = DMat3::from_rotation_y(0.5) * DMat3::from_rotation_x(0.3);
        let placement = Arc::new(Placement::new(DVec3::new(0.1, 0.2, 0.3), turn, 1.1).unwrap());
        let count = objects.len();
        let group = objects.into();
        (0..count).map(|index| Instance::new(&group, index, &placement).into()).collect()
    }

    fn brick(level: f64) -> Object {
        Cuboid::new([DVec3::NEG_ONE, DVec3::new(1.0, 0.5, 1.0)], colored(level)).unwrap().into()
    }

    fn card(height: f64, level: f64) -> Object {
        let corners = [[-1.0, -1.0], [1.0, -1.0], [0.0, 1.0]].map(|[x, z]| DVec3::new(x, height, z));
        Triangle::new(corners, colored(level)).unwrap().into()
    }

    #[test]
    fn a_label_shares_the_side_of_its_bottle() {
        assert_eq!(pairs(vec![can(0.6, 0.2, 0.6, 0.1), can(0.6, 0.0, 1.0, 0.2)]), [(0, 1)]);
        assert_eq!(pairs(vec![can(0.6, 1.0, 0.0, 0.1), can(0.6, 0.2, 0.6, 0.2)]), [(0, 1)], "turned round");
        assert_eq!(pairs(vec![can(0.600_000_000_1, 0.2, 0.6, 0.1), can(0.6, 0.0, 1.0, 0.2)]), []);
        assert_eq!(pairs(vec![can(0.6, 0.2, 0.6, 0.1), can(0.6, 0.7, 1.0, 0.2)]), [], "one above the other");
    }

    #[test]
    fn what_lies_on_a_turned_box_shares_its_face() {
        assert_eq!(pairs(turned(vec![card(0.5, 0.1), brick(0.2)])), [(0, 1)]);
        assert_eq!(pairs(turned(vec![card(0.500_000_000_1, 0.1), brick(0.2)])), []);
        let far = card(0.5, 0.1).placed(1.0, |place| place + 4.0 * DVec3::X).unwrap();
        assert_eq!(pairs(turned(vec![far, brick(0.2)])), [], "beside it");
    }

    #[test]
    fn what_is_met_at_the_same_distance_anyway_needs_no_pair() {
        let disc = |center: DVec3, normal: DVec3| -> Object {
            Disc::new(0.5, center, normal, colored(0.3)).unwrap().into()
        };
        let flat = disc(DVec3::new(0.3, 0.5, 0.1), DVec3::NEG_Y);
        assert_eq!(pairs(vec![card(0.5, 0.1), brick(0.2), flat.clone()]), []);
        let slanted = DVec3::new(0.2, 1.0, 0.3);
        let aside = slanted.cross(DVec3::X).normalize() * 0.4;
        assert_eq!(pairs(vec![disc(DVec3::ZERO, slanted), disc(aside, slanted), flat]), [(0, 1)]);
    }

    #[test]
    fn equal_balls_and_rings_are_pairs_and_a_crowd_is_found_soon() {
        let ball = |x: f64| -> Object { Sphere::new(0.5, DVec3::X * x, colored(0.1)).unwrap().into() };
        let ring = |normal: DVec3| -> Object {
            Torus::new(0.8, 0.25, DVec3::Y * 0.4, normal, colored(0.2)).unwrap().into()
        };
        assert_eq!(
            pairs(vec![ball(0.1 + 0.2), ring(DVec3::Z), ball(0.3), ring(DVec3::NEG_Z)]),
            [(0, 2), (1, 3)]
        );
        // Floor tiles that stand askew, and one under all of them.
        let mut tiles: Vec<Object> = (0..900)
            .map(|k| {
                let corner = DVec3::new(f64::from(k % 30), 0.0, f64::from(k / 30)) - 15.0;
                let size = DVec3::new(0.9, 0.5, 0.9);
                Cuboid::new([corner, corner + size], colored(f64::from(k))).unwrap().into()
            })
            .collect();
        let low = DVec3::splat(-15.0);
        tiles.push(Cuboid::new([low, low + DVec3::new(30.0, 0.5, 30.0)], colored(-1.0)).unwrap().into());
        let found = pairs(turned(tiles));
        assert!((0..900).all(|tile| found.contains(&(tile, 900))), "{} pairs", found.len());
    }
}
