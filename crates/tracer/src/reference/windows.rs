//! The windows of a room: the parts of the box around a scene's large objects through which the surroundings are seen.

use glam::DVec3;
use rayfold_scene::{Object, Scene};

use super::shapes;
use super::world::glass;
use crate::camera::Ray;
use crate::pictures::Panorama;
use crate::sampling::bright::{Bright, half_area};
use crate::sampling::guide::Windows;
use crate::sampling::sky_table::brightness;
use crate::sampling::{coordinate, pixel_seed};

/// The number of panes along an edge of the box, and of rays through each.
const SIDE: usize = 8;
const RAYS: u32 = 16;

/// The largest number of objects that are looked at: the largest ones, which walls are.
const MAX_OBJECTS: usize = 32;

/// The part of the largest brightness from which on a pane counts.
const BRIGHT: f64 = 0.25;

/// The largest part of the box that is open in a room. Elsewhere rays by the cosine find the surroundings as well.
const MAX_OPEN: f64 = 0.05;

/// Returns the windows of a scene; `None` if no ray is scattered, or if the scene is no room.
///
/// Meshes and glass are not looked at.
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
    let windows = faces.iter().enumerate();
    let windows = windows.flat_map(|(face, panes)| joined(face, panes, BRIGHT * brightest, room));
    Some(Windows::new(room, windows.collect()))
}

/// Returns the largest objects that are no meshes and no glass.
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

/// Returns, for each face of a room, how bright each of its panes is, as seen from places in the room.
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
fn joined(face: usize, panes: &[f64], least: f64, room: [DVec3; 2]) -> Vec<Bright> {
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
        found.extend(Bright::rectangle(sum / (right * down) as f64, bounds));
    }
    found
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
