//! Short lists of what lies in the cells of a grid.
//!
//! For scenes whose objects are too many for the bits of a mask: [`sights`](super::sights) has a list a tile, and each
//! sun's [`buffer`](super::lights::buffer) one a cell of its screen. Where a list would be long, the tree is the better
//! way, and the list is left out.

use std::ops::Range;

/// Candidates of a list at most.
pub(super) const LONGEST: usize = 64;

/// Objects up to this many are put on lists.
pub(super) const LISTED: usize = 100_000;

/// Lists one after another.
#[derive(Debug, Default)]
pub(super) struct Lists {
    /// Where each list begins, and the end of the last.
    pub(super) starts: Vec<u32>,
    pub(super) items: Vec<u32>,
}

impl Lists {
    /// One list a cell of a grid; each of the items lies in a rectangle of cells, ends included, or nowhere. None
    /// where there would be more than `most` entries.
    // Out of line, so that it is the same code whatever kernels a build has, and in plain loops, so that it does not turn
    // on which iterators the compiler inlines.
    #[inline(never)]
    pub(super) fn new(
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

    pub(super) fn list(&self, cell: usize) -> &[u32] {
        &self.items[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }
}

/// First and last column, first and last row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rectangle {
    pub(super) columns: (usize, usize),
    pub(super) rows: (usize, usize),
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
