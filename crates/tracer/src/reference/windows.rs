//! The windows of a room: the parts of the box around a scene's large objects through which the surroundings are seen.
//! Also the places that suns light through them.

use glam::DVec3;
use rayfold_scene::model::unit;
use rayfold_scene::{Light, Object, Scene};

use super::shapes::{self, Surface};
use super::world::glass;
use crate::camera::Ray;
use crate::pictures::Panorama;
use crate::sampling::bright::{Bright, half_area, sides_of};
use crate::sampling::guide::Windows;
use crate::sampling::sky_table::brightness;
use crate::sampling::{coordinate, pixel_seed};

/// The number of panes along an edge of the box, and of rays through each pane.
const SIDE: usize = 8;
const RAYS: u32 = 16;

/// The largest number of objects that are considered. They are the largest ones, as walls are.
const MAX_OBJECTS: usize = 32;

/// The number of rays of a sun along an edge of a window.
const SUN_RAYS: usize = 16;

/// The share of the largest brightness from which on a pane counts as a window.
const BRIGHT: f64 = 0.25;

/// The largest share of the box that is open in a room. With a larger share, rays by the cosine find the surroundings
/// as well.
const MAX_OPEN: f64 = 0.05;

/// Returns the windows of a scene, or `None` if no ray is scattered, or if the scene is no room.
///
/// Meshes and glass are ignored.
pub(crate) fn windows(scene: &Scene) -> Option<Windows> {
    if scene.indirect_bounces() == 0 {
        return None;
    }
    let walls = walls(scene);
    let boxes = walls.iter().filter_map(|wall| wall.bounds());
    let room = boxes.reduce(|[low, high], [a, b]| [low.min(a), high.max(b)])?;
    let faces = brightness_of_faces(scene, &walls, room);
    let area = |face: usize| Pane::new(face, 0, room).area();
    let open = |face: usize| faces[face].iter().filter(|&&bright| bright > 0.0).count() as f64 * area(face);
    let all: f64 = (0..6).map(|face| area(face) * (SIDE * SIDE) as f64).sum();
    let brightest = faces.iter().flatten().fold(0.0, |most: f64, &bright| most.max(bright));
    if (0..6).map(open).sum::<f64>() > MAX_OPEN * all || brightest == 0.0 {
        return None;
    }
    let mut found = vec![];
    for (face, panes) in faces.iter().enumerate() {
        for (brightness, [low, high]) in joined(face, panes, BRIGHT * brightest, room) {
            found.extend(Bright::rectangle(brightness, [low, high]));
            add_sun_patches(scene, &walls, [low, high], &mut found);
        }
    }
    Some(Windows::new(room, found))
}

/// Returns the largest objects that are neither meshes nor glass.
fn walls(scene: &Scene) -> Vec<&Object> {
    let is_mesh = |object: &Object| match object {
        Object::Mesh(_) => true,
        Object::Instance(instance) => matches!(instance.object(), Object::Mesh(_)),
        _ => false,
    };
    let is_opaque = |object: &&Object| !is_mesh(object) && glass(object).is_none();
    let size = |object: &Object| object.bounds().map_or(f64::INFINITY, half_area);
    let mut objects: Vec<(f64, &Object)> =
        scene.objects.iter().filter(is_opaque).map(|object| (size(object), object)).collect();
    objects.sort_by(|a, b| b.0.total_cmp(&a.0));
    objects.truncate(MAX_OBJECTS);
    objects.into_iter().map(|(_, object)| object).collect()
}

/// Returns, for each face of a room, the brightness of each of its panes as seen from places in the room.
fn brightness_of_faces(scene: &Scene, walls: &[&Object], room: [DVec3; 2]) -> Vec<Vec<f64>> {
    let panorama = Panorama::of(scene);
    let along = |origin: DVec3, through: DVec3| {
        let direction = (through - origin).normalize();
        let ray = Ray { origin, direction };
        if walls.iter().any(|wall| shapes::distance(wall, ray).is_some()) {
            return 0.0;
        }
        brightness(match &panorama {
            Some(panorama) => panorama.along(direction),
            None => scene.surroundings().along(direction),
        })
    };
    let of_pane = |face: usize, at: usize| {
        let pane = Pane::new(face, at, room);
        let seed = pixel_seed(at as u32, face as u32);
        let rays = (0..RAYS).map(|ray| {
            let [a, b, c, d, e] = [0, 1, 2, 3, 4].map(|dimension| coordinate(seed, ray, dimension));
            along(room[0] + (room[1] - room[0]) * DVec3::new(a, b, c), pane.point(d, e))
        });
        rays.sum::<f64>() / f64::from(RAYS)
    };
    (0..6).map(|face| (0..SIDE * SIDE).map(|at| of_pane(face, at)).collect()).collect()
}

/// Joins the panes of a face that are brighter than `least` to rectangles.
fn joined(face: usize, panes: &[f64], least: f64, room: [DVec3; 2]) -> Vec<(f64, [DVec3; 2])> {
    let mut taken = [false; SIDE * SIDE];
    let mut found = vec![];
    for at in 0..SIDE * SIDE {
        let is_free = |column: usize, row: usize| {
            let at = row * SIDE + column;
            !taken[at] && panes[at] > least
        };
        let (column, row) = (at % SIDE, at / SIDE);
        let right = (column..SIDE).take_while(|&column| is_free(column, row)).count();
        if right == 0 {
            continue;
        }
        let is_row_free = |row: &usize| (column..column + right).all(|column| is_free(column, *row));
        let down = (row..SIDE).take_while(is_row_free).count();
        let mut sum = 0.0;
        for row in row..row + down {
            let row = row * SIDE + column..row * SIDE + column + right;
            taken[row.clone()].fill(true);
            sum = panes[row].iter().fold(sum, |sum, bright| sum + bright);
        }
        let last = (row + down - 1) * SIDE + column + right - 1;
        let bounds = [Pane::new(face, at, room).point(0.0, 0.0), Pane::new(face, last, room).point(1.0, 1.0)];
        found.push((sum / (right * down) as f64, bounds));
    }
    found
}

/// Adds the parts of walls that suns light through the window with these opposite corners.
fn add_sun_patches(scene: &Scene, walls: &[&Object], [low, high]: [DVec3; 2], found: &mut Vec<Bright>) {
    let [across, down] = sides_of([low, high]).map(|side| side / SUN_RAYS as f64);
    let on_window = |[column, row]: [f64; 2]| low + column * across + row * down;
    for light in &scene.lights {
        let Light::Directional(sun) = light else { continue };
        let along = unit(sun.direction());
        let mut patches: Vec<SunPatch> = vec![];
        for at in 0..SUN_RAYS * SUN_RAYS {
            let at = [at % SUN_RAYS, at / SUN_RAYS];
            let origin = on_window(at.map(|part| part as f64 + 0.5));
            if nearest(walls, Ray { origin, direction: -along }).is_some() {
                continue;
            }
            let ray = Ray { origin, direction: along };
            let Some((wall, distance)) = nearest(walls, ray) else { continue };
            let surface = shapes::surface(walls[wall], ray, distance);
            let level =
                brightness(sun.color() * walls[wall].material().diffuse()) * -along.dot(surface.normal);
            let is_same = |patch: &&mut SunPatch| {
                patch.wall == wall
                    && patch.surface.flat == surface.flat
                    && (!surface.flat || (patch.surface.normal - surface.normal).length_squared() < 1e-12)
            };
            match patches.iter_mut().find(is_same) {
                Some(patch) => patch.add(at, surface.point, level),
                None => patches.push(SunPatch::new(wall, surface, at, level)),
            }
        }
        found.extend(patches.iter().filter_map(|patch| patch.bright(along, on_window)));
    }
}

/// Returns the wall that a ray hits first, and the distance to it.
fn nearest(walls: &[&Object], ray: Ray) -> Option<(usize, f64)> {
    let hits = walls.iter().enumerate().filter_map(|(at, wall)| Some((at, shapes::distance(wall, ray)?)));
    hits.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// The part of a wall that a sun lights through a window.
struct SunPatch {
    wall: usize,
    /// The surface at the hit of its first ray.
    surface: Surface,
    /// The first and the last column and row of the window through which its rays come.
    ends: [[usize; 2]; 2],
    /// A box around the hits.
    bounds: [DVec3; 2],
    /// The sum of the rays' brightness.
    sum: f64,
    rays: usize,
}

impl SunPatch {
    fn new(wall: usize, surface: Surface, at: [usize; 2], level: f64) -> Self {
        Self { wall, surface, ends: [at; 2], bounds: [surface.point; 2], sum: level, rays: 1 }
    }

    fn add(&mut self, at: [usize; 2], point: DVec3, level: f64) {
        let [first, last] = &mut self.ends;
        for ((first, last), at) in first.iter_mut().zip(last).zip(at) {
            (*first, *last) = ((*first).min(at), (*last).max(at));
        }
        self.bounds = [self.bounds[0].min(point), self.bounds[1].max(point)];
        self.sum += level;
        self.rays += 1;
    }

    /// Returns it as a parallelogram on a flat surface, and otherwise as a box around it.
    fn bright(&self, along: DVec3, on_window: impl Fn([f64; 2]) -> DVec3) -> Option<Bright> {
        let Surface { point, normal, flat, .. } = self.surface;
        if !flat {
            return Some(Bright::within(self.sum / self.rays as f64, self.bounds));
        }
        let [[left, top], [right, bottom]] =
            [self.ends[0], self.ends[1].map(|last| last + 1)].map(|end| end.map(|part| part as f64));
        let cells = (right - left) * (bottom - top);
        let on_wall = |at| {
            let from = on_window(at);
            from + along * ((point - from).dot(normal) / along.dot(normal))
        };
        let origin = on_wall([left, top]);
        let sides = [on_wall([right, top]) - origin, on_wall([left, bottom]) - origin];
        Bright::parallelogram(self.sum / cells, origin, sides, normal)
    }
}

/// A part of a face of a box.
struct Pane {
    low: DVec3,
    across: DVec3,
    down: DVec3,
}

impl Pane {
    fn new(face: usize, pane: usize, [low, high]: [DVec3; 2]) -> Self {
        let [normal, across, down] = [0, 1, 2].map(|k| DVec3::AXES[(face / 2 + k) % 3]);
        let sides = (high - low) / SIDE as f64;
        let low = if face.is_multiple_of(2) { low } else { low + (high - low) * normal };
        let (across, down) = (across * sides, down * sides);
        Self { low: low + (pane % SIDE) as f64 * across + (pane / SIDE) as f64 * down, across, down }
    }

    fn point(&self, u: f64, v: f64) -> DVec3 {
        self.low + u * self.across + v * self.down
    }

    fn area(&self) -> f64 {
        self.across.length() * self.down.length()
    }
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Limits, parse};

    use super::*;
    use crate::sampling::guide::{Guide, Scattering};
    use crate::sampling::paths::scattered;

    /// A room of boxes with a window in its left wall, and a place below its ceiling.
    const ROOM: &str = "Screen 8 6
Samples 16
Indirect 1
Sky .1 .1 .1
Material white diffuse .7 .7 .7
Box -2.2 -.2 -2.2 2.2 0 2.2 white
Box -2.2 3 -2.2 2.2 3.2 2.2 white
Box -2.2 0 -2.2 2.2 3 -2 white
Box -2.2 0 2 2.2 3 2.2 white
Box 2 0 -2 2.2 3 2 white
Box -2.2 0 -2 -2 1 2 white
Box -2.2 2 -2 -2 3 2 white
Box -2.2 1 -2 -2 2 -.5 white
Box -2.2 1 .5 -2 2 2 white
";
    const PLACE: DVec3 = DVec3::new(0.7, 2.9, 0.3);

    /// Returns the light below the ceiling from the part of the floor with an x in the range `x`, by rays with and
    /// without a guide: the mean, and the standard deviation of one ray.
    fn light_from_floor(rest: &str, x: [f64; 2]) -> [(f64, f64); 2] {
        let text = format!("{ROOM}{rest}Trace\n");
        let scene = parse("a.txt", text.as_bytes(), &Limits::default()).script.unwrap().frame(0).unwrap();
        let guide = Guide::of(core::slice::from_ref(&scene), windows(&scene)).pop().flatten().unwrap();
        let is_lit = |direction: DVec3| {
            let at = PLACE - direction * (PLACE.y / direction.y);
            direction.y < 0.0 && at.z.abs() < 0.5 && x[0] < at.x && at.x < x[1]
        };
        let mut dice = fastrand::Rng::with_seed(7);
        let count = 100_000;
        let mut sums = [(0.0, 0.0); 2];
        for _ in 0..count {
            let numbers = (dice.f64(), dice.f64());
            let by_cosine = scattered(numbers, DVec3::NEG_Y, DVec3::NEG_Y);
            let hit = Scattering::of_one(numbers, by_cosine, PLACE, (DVec3::NEG_Y, DVec3::NEG_Y));
            let guided = guide.scattered(&hit, &mut vec![]).of_one(by_cosine);
            let of = |(direction, share)| if is_lit(direction) { share } else { 0.0 };
            for (sum, light) in sums.iter_mut().zip([guided.map(of).iter().sum(), of((by_cosine, 1.0))]) {
                *sum = (sum.0 + light, sum.1 + light * light);
            }
        }
        sums.map(|(sum, squares)| {
            let mean = sum / f64::from(count);
            (mean, (squares / f64::from(count) - mean * mean).sqrt())
        })
    }

    #[test]
    fn what_a_sun_lights_through_a_window_is_aimed_at() {
        let lit = [-1.0, -0.2];
        // Through the middle of the window, to the floor.
        for (sun, factor) in [("Ilight 9 9 9 1 -1 0\n", 0.5), ("Ilight 9 9 9 -1 -1 0\n", f64::INFINITY)] {
            let [guided, plain] = light_from_floor(sun, lit);
            let error = (guided.1.powi(2) + plain.1.powi(2)).sqrt() / 100_000f64.sqrt();
            assert!((guided.0 - plain.0).abs() < 4.0 * error, "{sun}: {guided:?} {plain:?}");
            assert!(guided.1 < factor * plain.1, "{sun}: {guided:?} {plain:?}");
        }
    }

    #[test]
    fn a_patch_is_as_large_as_what_is_lit() {
        let text = format!("{ROOM}Ilight 9 9 9 1 -1 0\nTrace\n");
        let scene = parse("a.txt", text.as_bytes(), &Limits::default()).script.unwrap().frame(0).unwrap();
        let mut found = vec![];
        let window = [DVec3::new(-2.2, 1.0, -0.5), DVec3::new(-2.2, 2.0, 0.5)];
        add_sun_patches(&scene, &walls(&scene), window, &mut found);
        // The floor, and the sill, on which the rays of three of 16 rows fall.
        assert_eq!(found.len(), 2);
        let level = 0.7 * 9.0 * 0.5_f64.sqrt();
        for (bright, area) in found.iter().zip([3.0 / 16.0, 13.0 / 16.0]) {
            assert!((bright.power() - level * area).abs() < 1e-9, "{bright:?}");
        }
    }
}
