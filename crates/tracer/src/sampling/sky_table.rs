//! A table of the brightness of each part of a sky's picture above its mean.
//!
//! Cells are wider than the picture's pixels, so that bright light between pixels is in a cell that counts.

use core::f64::consts::{PI, TAU};
use std::sync::{Arc, Mutex, PoisonError, Weak};

use glam::DVec3;
use rayfold_scene::assets::Picture;

use super::cube_table::{CubeTable, cell};
use crate::pictures::Panorama;

/// The least and the largest number of columns in which a picture is read. Columns of larger pictures are left out
/// evenly.
const COLUMNS: (u32, u32) = (256, 2048);

/// The number of the picture's columns along an edge of a cell in the middle of a face. At the face's corners it is a
/// third of this.
const COLUMNS_OF_CELL: u32 = 4;

/// The largest number of cells that are divided.
const DIVIDED: usize = 256;

/// The bright parts of a picture, in the picture's own axes.
#[derive(Debug)]
pub(crate) struct SkyTable {
    /// The mean brightness of the picture.
    pub(crate) mean: f64,
    /// The integral of the brightness above the mean over all directions.
    pub(crate) excess: f64,
    /// The density in proportion to that.
    pub(crate) directions: CubeTable,
}

/// Returns how bright a colour is: the mean of its channels.
pub(crate) fn brightness(color: DVec3) -> f64 {
    color.abs().element_sum() / 3.0
}

/// A picture, whether its levels are decoded, and its table.
type Known = (Weak<Picture>, bool, Option<Arc<SkyTable>>);

/// The table that was made last.
static LAST: Mutex<Option<Known>> = Mutex::new(None);

impl SkyTable {
    /// Returns the table of a picture, or `None` if no part of it is bright. The last table is cached.
    pub(crate) fn of(panorama: &Panorama) -> Option<Arc<Self>> {
        let (picture, is_linear) = panorama.picture();
        let mut last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((of, of_linear, table)) = &*last
            && *of_linear == is_linear
            && of.upgrade().is_some_and(|of| Arc::ptr_eq(&of, picture))
        {
            return table.clone();
        }
        let table = Self::new(picture.width(), |place| brightness(panorama.level(place)));
        let table = table.map(Arc::new);
        *last = Some((Arc::downgrade(picture), is_linear, table.clone()));
        table
    }

    /// Makes the table of a picture of this width. `brightness` returns the brightness at a place.
    fn new(width: u32, brightness: impl Fn([f64; 2]) -> f64) -> Option<Self> {
        let columns = width.clamp(COLUMNS.0, COLUMNS.1) as usize;
        let rows = columns / 2;
        let place = |column: usize, row: usize| {
            [(column as f64 + 0.5) / columns as f64, (row as f64 + 0.5) / rows as f64]
        };
        let bright: Vec<f64> =
            (0..rows * columns).map(|at| brightness(place(at % columns, at / columns))).collect();
        // The solid angle of a pixel.
        let solid = |row: usize| {
            let edge = |row: usize| libm::cos(row as f64 / rows as f64 * PI);
            (edge(row) - edge(row + 1)) * TAU / columns as f64
        };
        let of_rows = || bright.chunks_exact(columns).enumerate();
        let total: f64 = of_rows().map(|(row, bright)| solid(row) * bright.iter().sum::<f64>()).sum();
        let mean = total / (4.0 * PI);
        let side = (columns as u32 / 4 / COLUMNS_OF_CELL) as usize;
        let mut cells = vec![0.0; 6 * side * side];
        for row in 0..rows {
            let around = [row.saturating_sub(1), row, (row + 1).min(rows - 1)];
            for column in 0..columns {
                // Between pixels the picture is about as bright as its pixels around.
                let beside = [column.checked_sub(1).unwrap_or(columns - 1), column, (column + 1) % columns];
                let levels =
                    around.iter().flat_map(|row| beside.map(|column| bright[row * columns + column]));
                let excess = levels.sum::<f64>() / 9.0 - mean;
                if excess > 0.0 {
                    let direction = Panorama::direction(place(column, row));
                    cells[cell(direction, side).0] += excess * solid(row);
                }
            }
        }
        let excess = cells.iter().sum::<f64>();
        // In a picture of one colour rounding alone adds some.
        (excess > 1e-3 * mean).then(|| {
            let weight = |direction: DVec3| {
                let bright = brightness(Panorama::place(direction));
                // A little everywhere: what is bright beside the corners of a part has some density.
                (bright - mean).max(0.01 * (bright + mean))
            };
            Self { mean, excess, directions: CubeTable::new(side, cells, DIVIDED, weight) }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bright_pixels_are_in_cells_that_count_and_one_colour_has_none() {
        assert!(SkyTable::new(512, |_| 0.7).is_none());
        let is_sun = |[u, v]: [f64; 2]| (u - 0.3).abs() < 0.004 && (v - 0.2).abs() < 0.008;
        let table = SkyTable::new(512, |place| if is_sun(place) { 1000.0 } else { 0.5 }).unwrap();
        // 4.1 pixels across and 4.1 rows.
        let solid = 0.008 * TAU * (libm::cos(0.192 * PI) - libm::cos(0.208 * PI));
        assert!((table.mean - 0.5 - 1000.0 * solid / (4.0 * PI)).abs() < 0.1 * table.mean);
        assert!((table.excess / (1000.0 * solid) - 1.0).abs() < 0.1, "{}", table.excess);
        let towards = Panorama::direction([0.3, 0.2]);
        // Most of the density is in a few cells around it.
        assert!(table.directions.density(towards) * solid > 0.3);
        assert_eq!(table.directions.density(-towards), 0.0);
    }
}
