//! What each tile's rays can meet, where objects are too many for the bits of a mask: a list a tile, from the rectangle
//! that an object covers.

use glam::DVec3;

use super::candidates::Picked;
use super::kind::Row;
use super::lists::{LONGEST, Lists, Rectangle};
use super::placed::Placed;
use super::rounding::BOUNDS;
use super::shapes::Shape;
use super::view::View;
use super::window::{Grid, axes};
use crate::camera::Axis;

/// What each tile's rays can meet.
#[derive(Debug)]
pub(super) struct Sights {
    lists: Lists,
    row: Row,
    columns: usize,
}

impl Sights {
    /// `shapes` stand in this row. None where lists would be long, and where rays start at no one place.
    pub(super) fn new<'a>(
        view: &View,
        shapes: impl Iterator<Item = &'a Shape>,
        row: Row,
        grid: &Grid,
        roundoff: f64,
    ) -> Option<Self> {
        let Grid { size: (width, height), side, margin, lens } = *grid;
        if lens.is_some() {
            return None;
        }
        let (columns, rows) = (width.div_ceil(side.0) as usize, height.div_ceil(side.1) as usize);
        let (x, y) = axes(view);
        let tiles = |span: Option<(f64, f64)>, axis: Axis, pixels: u32, side: u32| {
            let last = f64::from(pixels - 1);
            let (from, to) = span.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
            let (a, b) = (axis.index(from), axis.index(to));
            let (from, to) = (a.min(b) - margin, a.max(b) + margin);
            // Also where a bound is not a number.
            if from > last || to < 0.0 {
                return None;
            }
            let tile = |pixel: f64| pixel.clamp(0.0, last) as usize / side as usize;
            Some((tile(from), tile(to)))
        };
        let rectangle = |shape: &Shape| {
            let (across, along) = outline(view, shape, BOUNDS * roundoff * shape.magnitude())?;
            let columns = tiles(across, x, width, side.0)?;
            // Rows of tiles count from the top.
            Some(Rectangle { columns, rows: tiles(along, y.reversed(height), height, side.1)? })
        };
        let rectangles: Vec<_> = shapes.map(rectangle).collect();
        let lists = Lists::new(columns, rows, &rectangles, LONGEST * columns * rows)?;
        Some(Self { lists, row, columns })
    }

    /// The tile's candidates, or none if they are too many.
    // Out of line, so that it is the same code whatever kernels a build has.
    #[inline(never)]
    pub(super) fn gather(&self, column: usize, row: usize, into: &mut Picked) -> bool {
        into.clear();
        let list = self.lists.list(row * self.columns + column);
        if list.len() > LONGEST {
            return false;
        }
        list.iter().for_each(|&item| into.push(item, self.row));
        true
    }
}

/// A span of the view's coordinates; everywhere, if none.
type Span = Option<(f64, f64)>;

/// What a shape covers in the view's own coordinates; nothing if it lies behind the eye.
fn outline(view: &View, shape: &Shape, slack: f64) -> Option<(Span, Span)> {
    let (right, up, back) = match *view {
        View::Pinhole { right, up, back, .. } => (right, up, back),
        View::Parallel { .. } => {
            let (min, max) = shape.bounds();
            let slack = 2.0 * slack;
            let ahead = min.z <= slack;
            return ahead
                .then_some((Some((min.x - slack, max.x + slack)), Some((min.y - slack, max.y + slack))));
        }
    };
    if shape.support(-back) < -slack {
        return None;
    }
    Some((across(shape, right, back, slack), across(shape, up, back, slack)))
}

/// [`Placed::across`], wider by the rounding errors of what the span is compared with.
fn across(shape: &Shape, axis: DVec3, back: DVec3, slack: f64) -> Span {
    shape
        .across(axis, back, slack)
        .map(|(from, to)| (from - (from.abs() + 1.0) * 1e-12, to + (to.abs() + 1.0) * 1e-12))
}
