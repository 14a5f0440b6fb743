//! Short lists of candidates for scenes whose objects are too many for the bits of a mask.
//!
//! For the eye: what each tile's rays can meet, from the rectangle that an object covers. For a light: a grid over the
//! scene as the light sees it (the light buffer of Haines and Greenberg, "The light buffer: a shadow-testing
//! accelerator", 1986), from which a tile takes what lies over the region that it shows. Where a list would be long, the
//! tree is the better way, and the list is left out.

use std::ops::Range;

use glam::{DMat3, DVec3};

use super::geometry::{Shape, Solid, View};
use super::prepare::BOUNDS;
use super::real::Real;
use super::window::MARGIN;

/// Candidates of a list at most.
pub(super) const LONGEST: usize = 64;

/// Entries of a light's grid that a tile looks at, at most: more cost more than the tree.
const LOOKED_AT: usize = 192;

/// Objects up to this many are put on lists.
pub(super) const LISTED: usize = 100_000;

/// Objects by their positions in the arrays of each kind.
#[derive(Clone, Debug, Default)]
pub(super) struct Picked {
    pub(super) spheres: Vec<u32>,
    pub(super) cuboids: Vec<u32>,
    pub(super) triangles: Vec<u32>,
}

impl Picked {
    pub(super) fn len(&self) -> usize {
        self.spheres.len() + self.cuboids.len() + self.triangles.len()
    }

    fn clear(&mut self) {
        self.spheres.clear();
        self.cuboids.clear();
        self.triangles.clear();
    }

    /// An object by its position among all; `before` is how many come before the boxes and before the triangles.
    fn push(&mut self, item: u32, before: (u32, u32)) {
        if item < before.0 {
            self.spheres.push(item);
        } else if item < before.1 {
            self.cuboids.push(item - before.0);
        } else {
            self.triangles.push(item - before.1);
        }
    }
}

/// Lists one after another.
#[derive(Debug, Default)]
struct Lists {
    /// Where each list begins, and the end of the last.
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Lists {
    /// One list a cell of a grid; each of the items lies in a rectangle of cells, ends included, or nowhere. None
    /// where there would be more than `most` entries.
    // Out of line and in plain loops, as [`LightBuffer::gather`] is.
    #[inline(never)]
    fn new(columns: usize, rows: usize, rectangles: &[Option<Rectangle>], most: usize) -> Option<Self> {
        let entries: usize = rectangles.iter().flatten().map(Rectangle::cells).sum();
        if entries > most {
            return None;
        }
        let mut starts = vec![0u32; columns * rows + 1];
        for rectangle in rectangles.iter().flatten() {
            for row in rectangle.rows.0..rectangle.rows.1 + 1 {
                for count in &mut starts[1..][rectangle.cells_of(row, columns)] {
                    *count += 1;
                }
            }
        }
        let mut sum = 0;
        for start in &mut starts {
            sum += *start;
            *start = sum;
        }
        let mut items = vec![0; entries];
        let mut ends = starts.clone();
        for (item, rectangle) in rectangles.iter().enumerate() {
            let Some(rectangle) = rectangle else { continue };
            for row in rectangle.rows.0..rectangle.rows.1 + 1 {
                for end in &mut ends[rectangle.cells_of(row, columns)] {
                    items[*end as usize] = item as u32;
                    *end += 1;
                }
            }
        }
        Some(Self { starts, items })
    }

    fn list(&self, cell: usize) -> &[u32] {
        &self.items[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }
}

/// First and last column, first and last row.
#[derive(Clone, Copy, Debug)]
struct Rectangle {
    columns: (usize, usize),
    rows: (usize, usize),
}

impl Rectangle {
    fn cells(&self) -> usize {
        (self.columns.1 - self.columns.0 + 1) * (self.rows.1 - self.rows.0 + 1)
    }

    /// Its cells in a row, where rows are `columns` long.
    fn cells_of(&self, row: usize, columns: usize) -> Range<usize> {
        row * columns + self.columns.0..row * columns + self.columns.1 + 1
    }
}

/// What each tile's rays can meet.
#[derive(Debug)]
pub(super) struct Sights {
    lists: Lists,
    /// Objects before the boxes and before the triangles.
    before: (u32, u32),
    columns: usize,
}

impl Sights {
    /// `solids` are sorted by kind, `before` are those before the boxes and before the triangles; sizes are in pixels.
    /// None where lists would be long.
    pub(super) fn new(
        view: &View,
        solids: &[&Solid],
        before: (u32, u32),
        (width, height): (u32, u32),
        side: (u32, u32),
        roundoff: f64,
    ) -> Option<Self> {
        let (columns, rows) = (width.div_ceil(side.0) as usize, height.div_ceil(side.1) as usize);
        let (x, y) = super::window::steps(view);
        let tiles = |span: Option<(f64, f64)>, (start, step): (f64, f64), pixels: u32, side: u32| {
            let last = f64::from(pixels - 1);
            let (from, to) = span.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
            let (a, b) = ((from - start) / step, (to - start) / step);
            let (from, to) = (a.min(b) - MARGIN, a.max(b) + MARGIN);
            // Also where a bound is not a number.
            if from > last || to < 0.0 {
                return None;
            }
            let tile = |pixel: f64| pixel.clamp(0.0, last) as usize / side as usize;
            Some((tile(from), tile(to)))
        };
        let rectangle = |solid: &&Solid| {
            let (across, along) = outline(view, solid, BOUNDS * roundoff * solid.magnitude())?;
            let columns = tiles(across, x, width, side.0)?;
            // Rows of tiles count from the top.
            let flip = |(start, step): (f64, f64)| (start + step * f64::from(height - 1), -step);
            Some(Rectangle { columns, rows: tiles(along, flip(y), height, side.1)? })
        };
        let rectangles: Vec<_> = solids.iter().map(rectangle).collect();
        let lists = Lists::new(columns, rows, &rectangles, LONGEST * columns * rows)?;
        Some(Self { lists, before, columns })
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
        list.iter().for_each(|&item| into.push(item, self.before));
        true
    }
}

/// A span of the view's coordinates; everywhere, if none.
type Span = Option<(f64, f64)>;

/// What a solid covers in the view's own coordinates; nothing if it lies behind the eye.
fn outline(view: &View, solid: &Solid, slack: f64) -> Option<(Span, Span)> {
    let (right, up, back) = match *view {
        View::Pinhole { right, up, back, .. } => (right, up, back),
        View::Parallel { .. } => {
            let (min, max) = solid.bounds();
            let slack = 2.0 * slack;
            let ahead = min.z <= slack;
            return ahead
                .then_some((Some((min.x - slack, max.x + slack)), Some((min.y - slack, max.y + slack))));
        }
    };
    if solid.support(-back) < -slack {
        return None;
    }
    Some((across(solid, right, back, slack), across(solid, up, back, slack)))
}

/// The span of `p · axis / depth` over the points of a solid; none if it reaches behind the eye.
fn across(solid: &Solid, axis: DVec3, back: DVec3, slack: f64) -> Span {
    let span = |points: &[DVec3]| {
        points.iter().try_fold((f64::INFINITY, f64::NEG_INFINITY), |(from, to), point| {
            let (x, depth) = (point.dot(axis), -point.dot(back) - 2.0 * slack);
            let wide = (x.abs() + 2.0 * slack) / depth - x.abs() / (depth + 4.0 * slack);
            let middle = x / depth;
            (depth > 0.0).then_some((from.min(middle - wide), to.max(middle + wide)))
        })
    };
    match solid.shape {
        Shape::Triangle { vertices, .. } => span(&vertices),
        Shape::Cuboid { min, max } => {
            let mut corners = [min; 8];
            for (k, corner) in corners.iter_mut().enumerate() {
                *corner =
                    DVec3::new([min.x, max.x][k & 1], [min.y, max.y][k >> 1 & 1], [min.z, max.z][k >> 2 & 1]);
            }
            span(&corners)
        }
        Shape::Sphere { center, radius, .. } => {
            let (x, depth) = (center.dot(axis), -center.dot(back));
            let radius = radius + 2.0 * slack;
            (depth > radius).then(|| {
                let (angle, half) = (x.atan2(depth), (radius / x.hypot(depth)).asin());
                // The rounding errors of the three functions, generously.
                ((angle - half).tan() * (1.0 + 1e-12) - 1e-12, (angle + half).tan() * (1.0 + 1e-12) + 1e-12)
            })
        }
    }
    .map(|(from, to)| (from - (from.abs() + 1.0) * 1e-12, to + (to.abs() + 1.0) * 1e-12))
}

/// An object as a light sees it: a rectangle on its screen, how near to the light it reaches, and the farthest that it
/// reaches along each scene axis in the light's direction, times the sign of that.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline {
    pub(super) low: [f64; 2],
    pub(super) high: [f64; 2],
    pub(super) top: f64,
    pub(super) exits: [f64; 3],
}

impl Outline {
    /// `axes` are the light's, a row each.
    pub(super) fn new<E: Real>(solid: &Solid, axes: DMat3) -> Self {
        let slack = BOUNDS * E::ROUNDOFF * solid.magnitude();
        let reach = |axis: DVec3| solid.support(axis) + 2.0 * slack;
        let [x, y] = [axes.row(0), axes.row(1)];
        let (min, max) = solid.bounds();
        // A face is exact: what starts beyond it, if only by its offset, is beyond it.
        let is_box = matches!(solid.shape, Shape::Cuboid { .. });
        let rounded = |x: f64| if is_box { E::narrow(x).widen() } else { x + slack };
        let mut exits = [0.0; 3];
        for (axis, limit) in exits.iter_mut().enumerate() {
            let towards = axes.row(2)[axis];
            // A light along the other two axes passes on both sides.
            let exit = if towards > 0.0 {
                max[axis]
            } else if towards < 0.0 {
                -min[axis]
            } else {
                E::FAR
            };
            *limit = rounded(exit);
        }
        Self { low: [-reach(-x), -reach(-y)], high: [reach(x), reach(y)], top: reach(axes.row(2)), exits }
    }
}

/// What lies where on a light's screen.
#[derive(Clone, Debug)]
pub(super) struct LightBuffer(std::sync::Arc<Grid>);

#[derive(Debug)]
struct Grid {
    lists: Lists,
    outlines: Vec<Outline>,
    /// Objects before the boxes and before the triangles.
    before: (u32, u32),
    /// Cells of a side.
    side: usize,
    corner: [f64; 2],
    /// Cells per unit.
    pitch: [f64; 2],
}

/// Which objects a gathering has looked at: those marked with its number.
#[derive(Debug, Default)]
pub(super) struct Seen {
    marks: Vec<u32>,
    gathering: u32,
}

/// A region's shadow rays: the rectangle and the least height on a light's screen, and where they start along the
/// scene's axes, times the signs of the light's direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beam {
    pub(super) low: [f64; 2],
    pub(super) high: [f64; 2],
    pub(super) height: f64,
    pub(super) starts: [f64; 3],
}

impl LightBuffer {
    /// `outlines` are sorted by kind, `before` are those before the boxes and before the triangles.
    pub(super) fn new(outlines: Vec<Outline>, before: (u32, u32)) -> Option<Self> {
        let side = (outlines.len() as f64).sqrt().ceil() as usize;
        let (mut corner, mut end) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for outline in &outlines {
            for axis in 0..2 {
                corner[axis] = corner[axis].min(outline.low[axis]);
                end[axis] = end[axis].max(outline.high[axis]);
            }
        }
        let pitch = [0, 1].map(|axis| side as f64 / (end[axis] - corner[axis]).max(f64::MIN_POSITIVE));
        let cell = |x: f64, axis: usize| (((x - corner[axis]) * pitch[axis]).max(0.0) as usize).min(side - 1);
        let span = |o: &Outline, axis: usize| (cell(o.low[axis], axis), cell(o.high[axis], axis));
        let rectangles: Vec<_> =
            outlines.iter().map(|o| Some(Rectangle { columns: span(o, 0), rows: span(o, 1) })).collect();
        let lists = Lists::new(side, side, &rectangles, LONGEST * side * side)?;
        Some(Self(Grid { lists, outlines, before, side, corner, pitch }.into()))
    }

    /// What can stand in a beam's way; false if that is too much.
    // Out of line, so that it is the same code whatever kernels a build has, and in plain loops, so that it does not turn
    // on which iterators the compiler inlines.
    #[inline(never)]
    pub(super) fn gather(&self, beam: &Beam, seen: &mut Seen, into: &mut Picked) -> bool {
        into.clear();
        let Grid { lists, outlines, before, side, corner, pitch } = &*self.0;
        if seen.marks.len() < outlines.len() {
            seen.marks.resize(outlines.len(), 0);
        }
        seen.gathering += 1;
        let marks = &mut seen.marks[..outlines.len()];
        let cell = |x: f64, axis: usize| (((x - corner[axis]) * pitch[axis]).max(0.0) as usize).min(side - 1);
        let columns = (cell(beam.low[0], 0), cell(beam.high[0], 0) + 1);
        let rows = cell(beam.low[1], 1)..cell(beam.high[1], 1) + 1;
        // The cells of a row lie side by side.
        let row = |row: usize| {
            let (from, to) = (row * side + columns.0, row * side + columns.1);
            &lists.items[lists.starts[from] as usize..lists.starts[to] as usize]
        };
        let mut entries = 0;
        for at in rows.clone() {
            entries += row(at).len();
        }
        if entries > LOOKED_AT {
            return false;
        }
        let mut count = 0;
        for at in rows {
            for &item in row(at) {
                let (mark, o) = (&mut marks[item as usize], &outlines[item as usize]);
                if *mark == seen.gathering {
                    continue;
                }
                *mark = seen.gathering;
                let meets = o.low[0] <= beam.high[0]
                    && o.high[0] >= beam.low[0]
                    && o.low[1] <= beam.high[1]
                    && o.high[1] >= beam.low[1]
                    && o.top >= beam.height
                    && o.exits[0] >= beam.starts[0]
                    && o.exits[1] >= beam.starts[1]
                    && o.exits[2] >= beam.starts[2];
                if meets {
                    if count == LONGEST {
                        return false;
                    }
                    count += 1;
                    into.push(item, *before);
                }
            }
        }
        true
    }
}
