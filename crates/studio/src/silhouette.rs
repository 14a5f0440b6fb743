//! Outlines of objects in a picture, from the tracer's own hits.
//!
//! Rays are traced only where these objects can be. In a scene with many objects, rays are tested only against
//! objects whose bounding boxes they can hit, because a script may have a hundred thousand.

use std::fmt::Write;

use glam::{DVec2, DVec3};
use rayfold_scene::Scene;
use rayfold_tracer::probe::{Found, nearest_hits};
use rayfold_tracer::{RenderError, RenderOptions, pixel_ray};

use crate::view::{Bounds, Projection};

/// The largest number of rays for an outline: a tenth of a second on one core for scenes of a few hundred objects.
const RAYS: f64 = 60_000.0;

/// The largest number of rays for an outline that need not be exact.
const FEW_RAYS: f64 = 15_000.0;

/// Up to this number of objects, rays are tested against all of them.
const FEW: usize = 256;

/// The relative widening of boxes: far more than rounding errors.
const WIDER: f64 = 1e-9;

/// The margin in pixels around the area of the objects in a picture.
const MARGIN: f64 = 2.0;

/// A scene as it is seen, with a box around each of its objects.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) boxes: &'a [Bounds],
}

impl View<'_> {
    /// Returns the object that a pixel shows. Column and row are counted from the upper left.
    ///
    /// # Errors
    /// Returns the errors of the tracer.
    pub(crate) fn pick(&self, column: f64, row: f64) -> Result<Option<Found>, RenderError> {
        let scene = self.scene;
        let (origin, direction) = pixel_ray(scene, column, f64::from(scene.screen.height()) - 1.0 - row);
        let found = self.nearest(&[(origin, direction)], |bounds| meets(bounds, origin, direction))?;
        Ok(found.into_iter().next().flatten())
    }

    /// Returns the edges of the visible parts of some objects, as an SVG path in pixels of the picture.
    ///
    /// # Errors
    /// Returns the errors of the tracer.
    pub(crate) fn outline(&self, is_in: impl Fn(usize) -> bool) -> Result<String, RenderError> {
        self.traced(RAYS, is_in)
    }

    /// Returns the edges in coarse steps.
    ///
    /// # Errors
    /// Returns the errors of the tracer.
    pub(crate) fn ghost(&self, is_in: impl Fn(usize) -> bool) -> Result<String, RenderError> {
        self.traced(FEW_RAYS, is_in)
    }

    fn traced(&self, rays: f64, is_in: impl Fn(usize) -> bool) -> Result<String, RenderError> {
        let scene = self.scene;
        let own = self.boxes.iter().enumerate().filter(|(object, _)| is_in(*object));
        let Some(around) = own.map(|(_, bounds)| *bounds).reduce(Bounds::with) else {
            return Ok(String::new());
        };
        let size = DVec2::new(scene.screen.width().into(), scene.screen.height().into());
        let Some((low, high)) = seen(scene, around, size) else { return Ok(String::new()) };
        let room = high - low;
        let stride = (room.x * room.y / rays).sqrt().ceil().max(1.0);
        let (columns, rows) = ((room.x / stride).ceil() as usize, (room.y / stride).ceil() as usize);
        let last = size.y - 1.0;
        let ray = |column: f64, row: f64| {
            let at = low + DVec2::new(column, row) * stride + 0.5 * (stride - 1.0);
            pixel_ray(scene, at.x, last - at.y)
        };
        let rays: Vec<(DVec3, DVec3)> =
            (0..rows * columns).map(|at| ray((at % columns) as f64, (at / columns) as f64)).collect();
        let ends = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
            .map(|(x, y)| ray(x * columns as f64 - 0.5, y * rows as f64 - 0.5));
        let sides = sides(&ends);
        let found = self.nearest(&rays, |bounds| sides.iter().all(|side| side.lets_in(bounds)))?;
        let inside: Vec<bool> =
            found.iter().map(|found| found.is_some_and(|found| is_in(found.object))).collect();
        Ok(edges(&inside, columns, rows, low, stride))
    }

    /// Returns the nearest hit of each ray, testing only objects whose boxes can be hit.
    fn nearest(
        &self,
        rays: &[(DVec3, DVec3)],
        can_be_met: impl Fn(&Bounds) -> bool,
    ) -> Result<Vec<Option<Found>>, RenderError> {
        let options = RenderOptions::default();
        if self.scene.objects.len() <= FEW {
            return nearest_hits(self.scene, rays, &options);
        }
        let near: Vec<usize> =
            self.boxes.iter().enumerate().filter(|(_, b)| can_be_met(b)).map(|(at, _)| at).collect();
        let objects: Vec<_> = near.iter().map(|&at| self.scene.objects[at].clone()).collect();
        let few = Scene { objects: objects.into(), ..self.scene.clone() };
        let found = nearest_hits(&few, rays, &options)?;
        let in_script = |found: Found| Found { object: near[found.object], ..found };
        Ok(found.into_iter().map(|found| found.map(in_script)).collect())
    }
}

/// Returns the part of a picture in which a box can be visible, or `None`.
fn seen(scene: &Scene, bounds: Bounds, size: DVec2) -> Option<(DVec2, DVec2)> {
    let projection = Projection::new(scene);
    let corner = |at: u8| {
        let pick = |axis: usize| if at >> axis & 1 == 0 { bounds.low[axis] } else { bounds.high[axis] };
        projection.point(DVec3::new(pick(0), pick(1), pick(2))).filter(|point| point.is_finite())
    };
    // A box that reaches behind the eye can be anywhere.
    let corners: Option<Vec<DVec2>> = (0..8).map(corner).collect();
    let (low, high) = match corners {
        Some(corners) => (
            corners.iter().copied().fold(DVec2::INFINITY, DVec2::min) - MARGIN,
            corners.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max) + MARGIN,
        ),
        None => (DVec2::ZERO, size),
    };
    let (low, high) = (low.floor().max(DVec2::ZERO), high.ceil().min(size));
    (low.x < high.x && low.y < high.y).then_some((low, high))
}

/// Returns a box widened by more than the rounding errors.
fn widened(bounds: &Bounds) -> (DVec3, DVec3) {
    let by = WIDER * bounds.low.abs().max(bounds.high.abs());
    (bounds.low - by, bounds.high + by)
}

/// Returns whether a ray can hit anything in a box.
fn meets(bounds: &Bounds, origin: DVec3, direction: DVec3) -> bool {
    let (low, high) = widened(bounds);
    let (mut enters, mut leaves) = (0.0_f64, f64::INFINITY);
    for axis in 0..3 {
        if direction[axis] == 0.0 {
            if origin[axis] < low[axis] || origin[axis] > high[axis] {
                return false;
            }
            continue;
        }
        let at = [low[axis], high[axis]].map(|side| (side - origin[axis]) / direction[axis]);
        enters = enters.max(at[0].min(at[1]));
        leaves = leaves.min(at[0].max(at[1]));
    }
    enters <= leaves * (1.0 + WIDER)
}

/// A plane that has all rays on one side.
struct Side {
    normal: DVec3,
    height: f64,
}

impl Side {
    fn lets_in(&self, bounds: &Bounds) -> bool {
        let (low, high) = widened(bounds);
        let furthest = DVec3::select(self.normal.cmpgt(DVec3::ZERO), high, low).dot(self.normal);
        // For a box without end it may be NaN.
        furthest >= self.height || furthest.is_nan()
    }
}

/// Returns the planes between four rays around all others. The four are given in their order around them.
fn sides(ends: &[(DVec3, DVec3); 4]) -> [Side; 4] {
    let along = |(origin, direction): (DVec3, DVec3)| origin + direction;
    let inner = ends.iter().map(|&end| along(end)).sum::<DVec3>() / 4.0;
    [0, 1, 2, 3].map(|at| {
        let (this, next) = (ends[at], ends[(at + 1) % 4]);
        let normal = this.1.cross(along(next) - this.0);
        let normal = if (inner - this.0).dot(normal) < 0.0 { -normal } else { normal };
        let height = this.0.dot(normal);
        Side { normal, height: height - WIDER * (height.abs() + normal.length()) }
    })
}

/// Returns the edges between inside and outside cells: runs along rows, then along columns.
fn edges(inside: &[bool], columns: usize, rows: usize, low: DVec2, stride: f64) -> String {
    let cell = |column: usize, row: usize| {
        column
            .checked_sub(1)
            .zip(row.checked_sub(1))
            .is_some_and(|(column, row)| column < columns && row < rows && inside[row * columns + column])
    };
    let mut path = String::new();
    let mut runs = |count: usize, across: usize, is_edge: &dyn Fn(usize, usize) -> bool, flat: bool| {
        for line in 0..=across {
            let mut at = 0;
            while at < count {
                let start = at;
                while at < count && is_edge(at, line) {
                    at += 1;
                }
                if at == start {
                    at += 1;
                    continue;
                }
                let length = (at - start) as f64 * stride;
                let place = if flat {
                    DVec2::new(start as f64, line as f64)
                } else {
                    DVec2::new(line as f64, start as f64)
                };
                let DVec2 { x, y } = low + stride * place;
                // Writing to a string cannot fail.
                let _ = write!(path, "M{x} {y}{}{length}", if flat { 'h' } else { 'v' });
            }
        }
    };
    runs(columns, rows, &|column, row| cell(column + 1, row) != cell(column + 1, row + 1), true);
    runs(rows, columns, &|row, column| cell(column, row + 1) != cell(column + 1, row + 1), false);
    path
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::frame::boxes;

    fn scene(text: &str) -> Scene {
        let parsed = rayfold_scene::parse("a", text.as_bytes(), &Default::default());
        parsed.script.unwrap_or_else(|| panic!("{:?}", parsed.diagnostics)).frame(0).unwrap()
    }

    #[test]
    fn edges_surround_what_is_inside() {
        let inside = [false, true, false, false, true, true];
        let path = edges(&inside, 3, 2, DVec2::ZERO, 2.0);
        assert_eq!(path, "M2 0h2M4 2h2M2 4h4M2 0v4M4 0v2M6 2v2");
        assert_eq!(edges(&[true], 1, 1, DVec2::new(5.0, 7.0), 2.0), "M5 7h2M5 9h2M5 7v2M7 7v2");
    }

    #[test]
    fn a_pixel_shows_the_object_that_the_picture_shows_there() {
        let scene = scene(
            "Screen 40 30\nSphere 8  20 15 -20  1 0 0  0 0 0\nBox 0 0 -60  10 10 -50  0 1 0  0 0 0\nTrace",
        );
        let boxes = boxes(&scene);
        let view = View { scene: &scene, boxes: &boxes };
        let image = rayfold_tracer::render(&scene, &RenderOptions::default()).unwrap();
        for (column, row, pixel) in image.enumerate_pixels() {
            let found = view.pick(column.into(), row.into()).unwrap().map(|found| found.object);
            let expected = match pixel.0 {
                [255, 0, 0] => Some(0),
                [0, 255, 0] => Some(1),
                _ => None,
            };
            assert_eq!(found, expected, "{column} {row}");
        }
        assert!(view.outline(|object| object == 1).unwrap().starts_with("M0 19h"));
        assert_eq!(view.outline(|_| false).unwrap(), "");
    }

    /// With many objects, few are tested, without visible effect: every pixel shows the object of the picture, and
    /// outlines are those of the picture.
    #[test]
    fn of_many_objects_a_pixel_shows_what_the_picture_shows() {
        let cameras =
            ["Look 3 4 9  0 0 0  50", "Orthocamera", "Camera 0 0 0.5  0.2 0 -1  0 1 0  1  -1 -0.6  1 0.6"];
        for camera in cameras {
            let place = |i: u32| match camera {
                "Orthocamera" => [i % 21 * 4, i / 21 * 3, 0].map(f64::from),
                _ => [f64::from(i % 21) * 0.5 - 5.0, f64::from(i % 5) - 2.0, f64::from(i / 21) - 9.0],
            };
            let mut text = format!("Screen 80 48\n{camera}\n");
            for i in 0..400 {
                let [x, y, z] = place(i);
                let (red, green) = (f64::from(i / 20) / 20.0, f64::from(i % 20) / 20.0);
                let radius = if camera == "Orthocamera" { 2.5 } else { 0.4 };
                text += &match i % 3 {
                    0 => format!("Sphere {radius} {x} {y} {z}  {red} {green} 1  0 0 0\n"),
                    1 => format!("Disc {radius} {x} {y} {z}  1 2 3  {red} {green} 1  0 0 0\n"),
                    _ => format!(
                        "Box {x} {y} {z} {} {} {}  {red} {green} 1  0 0 0\n",
                        x + radius,
                        y + 0.2,
                        z + 0.3
                    ),
                };
            }
            text += "Plane 0 -9 0  0 1 0  0 0 0.5  0 0 0\nTrace";
            let scene = scene(&text);
            assert!(scene.objects.len() > FEW);
            let boxes = boxes(&scene);
            let view = View { scene: &scene, boxes: &boxes };
            let image = rayfold_tracer::render(&scene, &RenderOptions::default()).unwrap();
            let shown = |pixel: &[u8; 3]| match pixel {
                [.., 0] => None,
                [.., 128] => Some(400),
                [red, green, _] => {
                    let step = |level: u8| (f64::from(level) / 255.0 * 20.0).round() as usize;
                    Some(step(*red) * 20 + step(*green))
                }
            };
            let mut seen = BTreeSet::new();
            for (column, row, pixel) in image.enumerate_pixels() {
                let found = view.pick(column.into(), row.into()).unwrap().map(|found| found.object);
                assert_eq!(found, shown(&pixel.0), "{camera}: {column} {row}");
                seen.extend(found);
            }
            assert!(seen.len() > 50, "{}", seen.len());
            for object in seen {
                let inside: Vec<_> = image.pixels().map(|pixel| shown(&pixel.0) == Some(object)).collect();
                let expected = edges(&inside, 80, 48, DVec2::ZERO, 1.0);
                let outline = view.outline(|other| other == object).unwrap();
                assert_eq!(pieces(&outline), pieces(&expected), "{camera}: {object}");
            }
        }
    }

    /// Returns the parts of a path as a set.
    fn pieces(path: &str) -> BTreeSet<&str> {
        path.split('M').skip(1).collect()
    }
}
