//! Where objects are seen: the outline of some of them in a picture, from the tracer's own hits.

use std::fmt::Write;

use glam::DVec3;
use rayfold_scene::Scene;
use rayfold_tracer::probe::{Found, nearest_hits};
use rayfold_tracer::{RenderError, RenderOptions, pixel_ray};

/// Rays that an outline is made of, at most: a tenth of a second on one core for scenes of a few hundred objects.
const RAYS: f64 = 60_000.0;

/// The same, for one that need not be exact.
const FEW_RAYS: f64 = 15_000.0;

/// What a pixel of a picture shows, column and row from the upper left.
///
/// # Errors
/// Those of the tracer.
pub(crate) fn pick(scene: &Scene, column: f64, row: f64) -> Result<Option<Found>, RenderError> {
    let j = f64::from(scene.screen.height()) - 1.0 - row;
    let found = nearest_hits(scene, &[pixel_ray(scene, column, j)], &RenderOptions::default())?;
    Ok(found.into_iter().next().flatten())
}

/// The edges of what is seen of some objects, as the path of an SVG in pixels of the picture.
///
/// # Errors
/// Those of the tracer.
pub(crate) fn outline(scene: &Scene, is_in: impl Fn(usize) -> bool) -> Result<String, RenderError> {
    traced(scene, RAYS, is_in)
}

/// The same, in coarse steps.
///
/// # Errors
/// Those of the tracer.
pub(crate) fn ghost(scene: &Scene, is_in: impl Fn(usize) -> bool) -> Result<String, RenderError> {
    traced(scene, FEW_RAYS, is_in)
}

fn traced(scene: &Scene, rays: f64, is_in: impl Fn(usize) -> bool) -> Result<String, RenderError> {
    let (width, height) = (scene.screen.width(), scene.screen.height());
    let stride = (f64::from(width) * f64::from(height) / rays).sqrt().ceil().max(1.0);
    let columns = (f64::from(width) / stride).ceil() as usize;
    let rows = (f64::from(height) / stride).ceil() as usize;
    let last = f64::from(height) - 1.0;
    let rays: Vec<(DVec3, DVec3)> = (0..rows * columns)
        .map(|at| {
            let (row, column) = ((at / columns) as f64, (at % columns) as f64);
            let middle = 0.5 * (stride - 1.0);
            pixel_ray(scene, column * stride + middle, last - (row * stride + middle))
        })
        .collect();
    let found = nearest_hits(scene, &rays, &RenderOptions::default())?;
    let inside: Vec<bool> =
        found.iter().map(|found| found.is_some_and(|found| is_in(found.object))).collect();
    Ok(edges(&inside, columns, rows, stride))
}

/// The edges between cells that are inside and others: runs along rows, then along columns.
fn edges(inside: &[bool], columns: usize, rows: usize, stride: f64) -> String {
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
                let (from, line, length) =
                    (start as f64 * stride, line as f64 * stride, (at - start) as f64 * stride);
                // Writing to a text cannot fail.
                let _ = if flat {
                    write!(path, "M{from} {line}h{length}")
                } else {
                    write!(path, "M{line} {from}v{length}")
                };
            }
        }
    };
    runs(columns, rows, &|column, row| cell(column + 1, row) != cell(column + 1, row + 1), true);
    runs(rows, columns, &|row, column| cell(column, row + 1) != cell(column + 1, row + 1), false);
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_surround_what_is_inside() {
        let inside = [false, true, false, false, true, true];
        assert_eq!(edges(&inside, 3, 2, 2.0), "M2 0h2M4 2h2M2 4h4M2 0v4M4 0v2M6 2v2");
    }

    #[test]
    fn a_pixel_shows_the_object_that_the_picture_shows_there() {
        let text =
            "Screen 40 30\nSphere 8  20 15 -20  1 0 0  0 0 0\nBox 0 0 -60  10 10 -50  0 1 0  0 0 0\nTrace";
        let scene =
            rayfold_scene::parse("a", text.as_bytes(), &Default::default()).script.unwrap().frame(0).unwrap();
        let image = rayfold_tracer::render(&scene, &RenderOptions::default()).unwrap();
        for (column, row, pixel) in image.enumerate_pixels() {
            let found = pick(&scene, column.into(), row.into()).unwrap().map(|found| found.object);
            let expected = match pixel.0 {
                [255, 0, 0] => Some(0),
                [0, 255, 0] => Some(1),
                _ => None,
            };
            assert_eq!(found, expected, "{column} {row}");
        }
        assert!(outline(&scene, |object| object == 1).unwrap().starts_with("M0 19h"));
        assert_eq!(outline(&scene, |_| false).unwrap(), "");
    }
}
