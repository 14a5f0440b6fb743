//! Short lists of the possible occluders of a sun: a grid over the scene as seen from the sun. A tile takes the objects
//! in the cells over its region (the light buffer of Haines and Greenberg, "The light buffer: a shadow-testing
//! accelerator", 1986).

use crate::fast::acceleration::candidates::Picked;
use crate::fast::acceleration::lists::{LONGEST, Lists, Rectangle};
use crate::fast::lights::sun::{Beam, Outline};
use crate::fast::rays::kind::Row;

/// The largest number of grid entries that a tile examines. More would cost more than the tree.
const LOOKED_AT: usize = 192;

/// The objects at each place of a sun's screen.
#[derive(Clone, Debug)]
pub(crate) struct LightBuffer(std::sync::Arc<Grid>);

#[derive(Debug)]
struct Grid {
    lists: Lists,
    outlines: Vec<Outline>,
    order: Row,
    /// The number of cells along a side.
    side: usize,
    corner: [f64; 2],
    /// The number of cells per unit of length.
    pitch: [f64; 2],
}

/// The objects that a gathering has examined: those marked with its number.
#[derive(Debug, Default)]
pub(crate) struct Seen {
    marks: Vec<u32>,
    gathering: u32,
}

impl LightBuffer {
    /// Makes the grid; `outlines` are in this `order`. Returns `None` if lists would be long.
    pub(crate) fn new(outlines: Vec<Outline>, order: Row) -> Option<Self> {
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
        Some(Self(Grid { lists, outlines, order, side, corner, pitch }.into()))
    }

    /// Collects the possible occluders of a beam. Returns false if there are too many.
    // Out of line, so that the code does not depend on the kernels of a build. Plain loops, so that it does not depend
    // on which iterators the compiler inlines.
    #[inline(never)]
    pub(crate) fn gather(&self, beam: &Beam, seen: &mut Seen, into: &mut Picked) -> bool {
        into.clear();
        let Grid { lists, outlines, order, side, corner, pitch } = &*self.0;
        if seen.marks.len() < outlines.len() {
            seen.marks.resize(outlines.len(), 0);
        }
        seen.gathering += 1;
        let marks = &mut seen.marks[..outlines.len()];
        let cell = |x: f64, axis: usize| (((x - corner[axis]) * pitch[axis]).max(0.0) as usize).min(side - 1);
        let columns = (cell(beam.low[0], 0), cell(beam.high[0], 0) + 1);
        let rows = cell(beam.low[1], 1)..cell(beam.high[1], 1) + 1;
        // The cells of a row are contiguous.
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
                    into.push(item, *order);
                }
            }
        }
        true
    }
}
