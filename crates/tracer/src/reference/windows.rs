//! The windows of a room: where the surroundings are seen through the box around a scene's large objects.

use glam::DVec3;
use rayfold_scene::{Object, Scene};

use super::shapes;
use super::world::glass;
use crate::camera::Ray;
use crate::pictures::Panorama;
use crate::sampling::guide::{Part, Windows};

/// The number of panes along an edge of the box, and of rays through each.
const SIDE: usize = 8;
const RAYS: usize = 16;

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
    let is_mesh = |object: &Object| match object {
        Object::Mesh(_) => true,
        Object::Instance(instance) => matches!(instance.object(), Object::Mesh(_)),
        _ => false,
    };
    let is_opaque = |object: &&Object| !is_mesh(object) && glass(object).is_none();
    let size = |object: &Object| {
        object.bounds().map_or(f64::INFINITY, |[low, high]| {
            let DVec3 { x, y, z } = high - low;
            x * y + y * z + z * x
        })
    };
    let mut objects: Vec<(f64, &Object)> =
        scene.objects.iter().filter(is_opaque).map(|object| (size(object), object)).collect();
    objects.sort_by(|a, b| b.0.total_cmp(&a.0));
    objects.truncate(MAX_OBJECTS);
    let boxes = objects.iter().filter_map(|(_, object)| object.bounds());
    let bounds = boxes.reduce(|[low, high], [a, b]| [low.min(a), high.max(b)])?;
    let panorama = Panorama::of(scene);
    let brightness = |origin: DVec3, through: DVec3| {
        let direction = (through - origin).normalize();
        let ray = Ray { origin, direction };
        let is_hidden = objects.iter().any(|(_, object)| shapes::distance(object, ray).is_some());
        let color = match &panorama {
            _ if is_hidden => DVec3::ZERO,
            Some(panorama) => panorama.along(direction),
            None => scene.surroundings().along(direction),
        };
        color.abs().element_sum() / 3.0
    };
    let sides = bounds[1] - bounds[0];
    let (mut parts, mut open, mut all) = (vec![], 0.0, 0.0);
    for face in 0..6 {
        let pane = |pane: usize| Pane::new(face, pane, bounds);
        let bright = |at: usize| {
            let rays = (0..RAYS).map(|ray| {
                let [a, b, c, d, e] = numbers(at * RAYS + ray);
                brightness(bounds[0] + sides * DVec3::new(a, b, c), pane(at).point(d, e))
            });
            rays.sum::<f64>() / RAYS as f64
        };
        let brights: Vec<f64> = (0..SIDE * SIDE).map(bright).collect();
        let area = pane(0).area();
        all += area * (SIDE * SIDE) as f64;
        open += area * brights.iter().filter(|&&bright| bright > 0.0).count() as f64;
        parts.extend((0..SIDE * SIDE).map(|at| (brights[at], face, at)));
    }
    let brightest = parts.iter().fold(0.0, |most: f64, part| most.max(part.0));
    if open > MAX_OPEN * all || brightest == 0.0 {
        return None;
    }
    let is_window = |face: usize, at: usize| parts[face * SIDE * SIDE + at].0 > BRIGHT * brightest;
    let mut found = vec![];
    for face in 0..6 {
        let mut taken = [false; SIDE * SIDE];
        for at in 0..SIDE * SIDE {
            if taken[at] || !is_window(face, at) {
                continue;
            }
            // The pane and those on its right, and the rows below that are windows as well.
            let (column, row) = (at % SIDE, at / SIDE);
            let is_free = |column: usize, row: usize| {
                !taken[row * SIDE + column] && is_window(face, row * SIDE + column)
            };
            let right = (column..SIDE).take_while(|&column| is_free(column, row)).count();
            let down = (row..SIDE)
                .take_while(|&row| (column..column + right).all(|column| is_free(column, row)))
                .count();
            let mut sum = 0.0;
            for at in (row..row + down)
                .flat_map(|row| (column..column + right).map(move |column| row * SIDE + column))
            {
                taken[at] = true;
                sum += parts[face * SIDE * SIDE + at].0;
            }
            let last = (row + down - 1) * SIDE + column + right - 1;
            let (first, last) = (Pane::new(face, at, bounds), Pane::new(face, last, bounds));
            let bounds = [first.point(0.0, 0.0), last.point(1.0, 1.0)];
            found.push(Part { brightness: sum / (right * down) as f64, bounds });
        }
    }
    Some(Windows::new(bounds, found))
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

/// Returns five numbers from 0 to 1 that fill their cube evenly: multiples of powers of the root of x⁶ = x + 1 (Roberts, 2018).
fn numbers(at: usize) -> [f64; 5] {
    const ROOT: f64 = 1.134_724_138_401_519_5;
    let mut step = 1.0;
    [0; 5].map(|_| {
        step /= ROOT;
        (0.5 + at as f64 * step) % 1.0
    })
}
