//! Short lists of the objects in the cells of a grid.
//!
//! They are used for scenes with more objects than a mask has bits: [`sights`](crate::fast::placement::tile_lists) has a list per tile, and
//! each sun's [`buffer`](crate::fast::acceleration::light_buffer) one per cell of its screen. If a list would be long, the tree is
//! faster, and the list is left out.

use std::ops::Range;

/// The largest number of candidates in a list.
pub(crate) const LONGEST: usize = 64;

/// The largest number of objects in a scene that uses lists.
pub(crate) const LISTED: usize = 100_000;

/// Lists, stored one after another.
#[derive(Debug, Default)]
pub(crate) struct Lists {
    /// The start of each list, and the end of the last.
    pub(crate) starts: Vec<u32>,
    pub(crate) items: Vec<u32>,
}

impl Lists {
    /// Makes one list per cell of a grid. Each item covers a rectangle of cells, ends included, or no cell. Returns
    /// `None` if there would be more than `most` entries.
    // Out of line, so that the code does not depend on the kernels of a build. Plain loops, so that it does not depend
    // on which iterators the compiler inlines.
    #[inline(never)]
    pub(crate) fn new(
        columns: usize,
        rows: usize,
        rectangles: &[Option<Rectangle>],
        most: usize,
    ) -> Option<Self> {
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

    pub(crate) fn list(&self, cell: usize) -> &[u32] {
        &self.items[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }
}

/// The first and the last column, the first and the last row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rectangle {
    pub(crate) columns: (usize, usize),
    pub(crate) rows: (usize, usize),
}

impl Rectangle {
    fn cells(&self) -> usize {
        (self.columns.1 - self.columns.0 + 1) * (self.rows.1 - self.rows.0 + 1)
    }

    /// Returns its cells in a row, where rows are `columns` long.
    fn cells_of(&self, row: usize, columns: usize) -> Range<usize> {
        row * columns + self.columns.0..row * columns + self.columns.1 + 1
    }
}
