//! Lists, for each tile, the objects that its camera rays can hit, by the screen rectangle of each object. They are
//! used if a scene has more objects than a mask has bits.

use glam::DVec3;

use crate::camera::Axis;
use crate::fast::acceleration::candidates::Picked;
use crate::fast::acceleration::lists::{LONGEST, Lists, Rectangle};
use crate::fast::arithmetic::rounding::BOUNDS;
use crate::fast::placement::window::{Grid, axes};
use crate::fast::rays::kind::Row;
use crate::fast::rays::placed::RenderSpaceShape;
use crate::fast::rays::view::View;
use crate::fast::shapes::Shape;

/// The candidates of each tile's rays.
#[derive(Debug)]
pub(crate) struct TileLists {
    lists: Lists,
    row: Row,
    columns: usize,
}

impl TileLists {
    /// Makes the lists. `shapes` are in the order of `row`. Returns `None` if lists would be long, or if rays do not
    /// all start at one point.
    pub(crate) fn new<'a>(
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
            // Also handles a bound that is NaN.
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

    /// Collects the tile's candidates. Returns false if there are too many.
    // Out of line, so that the code does not depend on the kernels of a build.
    #[inline(never)]
    pub(crate) fn gather(&self, column: usize, row: usize, into: &mut Picked) -> bool {
        into.clear();
        let list = self.lists.list(row * self.columns + column);
        if list.len() > LONGEST {
            return false;
        }
        list.iter().for_each(|&item| into.push(item, self.row));
        true
    }
}

/// A span of the view's coordinates; `None` is unbounded.
type Span = Option<(f64, f64)>;

/// Returns the region that a shape covers in the view's own coordinates, or `None` if it is behind the eye.
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

/// Returns [`RenderSpaceShape::across`], widened by the rounding errors of the comparison.
fn across(shape: &Shape, axis: DVec3, back: DVec3, slack: f64) -> Span {
    shape
        .across(axis, back, slack)
        .map(|(from, to)| (from - (from.abs() + 1.0) * 1e-12, to + (to.abs() + 1.0) * 1e-12))
}
