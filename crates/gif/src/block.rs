//! One frame in the form in which the file stores it.

use crate::lzw::{self, Part};

/// A rectangle of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Area {
    pub(crate) left: usize,
    pub(crate) top: usize,
    /// The first column to the right of the rectangle. `bottom` is the first row below it.
    pub(crate) right: usize,
    pub(crate) bottom: usize,
}

impl Area {
    pub(crate) fn whole(width: usize, pixels: usize) -> Self {
        Self { left: 0, top: 0, right: width, bottom: pixels / width }
    }

    pub(crate) fn size(&self) -> usize {
        (self.right - self.left) * (self.bottom - self.top)
    }

    pub(crate) fn contains(&self, x: usize, y: usize) -> bool {
        (self.left..self.right).contains(&x) && (self.top..self.bottom).contains(&y)
    }

    /// Returns the smallest area that holds this one and a pixel.
    pub(crate) fn with(&self, x: usize, y: usize) -> Self {
        Self {
            left: self.left.min(x),
            top: self.top.min(y),
            right: self.right.max(x + 1),
            bottom: self.bottom.max(y + 1),
        }
    }

    /// Returns the smallest area that holds all wanted items, which are given row by row; `None` if there are none.
    pub(crate) fn around<T>(items: &[T], width: usize, wanted: impl Fn(&T) -> bool) -> Option<Self> {
        let mut around: Option<Self> = None;
        for (y, row) in items.chunks_exact(width).enumerate() {
            let Some(first) = row.iter().position(&wanted) else { continue };
            let after = row.iter().rposition(&wanted).unwrap_or(first) + 1;
            let area = around.get_or_insert(Self { left: first, top: y, right: after, bottom: y + 1 });
            area.left = area.left.min(first);
            area.right = area.right.max(after);
            area.bottom = y + 1;
        }
        around
    }
}

/// The part of a frame that is drawn over the canvas.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Block {
    pub(crate) area: Area,
    /// Red, green and blue of each index; at most 256 entries.
    pub(crate) palette: Vec<u8>,
    /// The palette is that of the file, so that the block stores none.
    pub(crate) is_of_file: bool,
    /// The index that leaves a pixel as it is.
    pub(crate) transparent: Option<u8>,
    pub(crate) delay_cs: u16,
    /// The canvas is clear after the block, where it was drawn.
    pub(crate) clears: bool,
    /// The compressed indices, row by row.
    pub(crate) data: Vec<u8>,
}

impl Block {
    /// Makes a block that draws nothing for the time given. The format has no empty block, so this
    /// is one transparent pixel.
    pub(crate) fn nothing(delay_cs: u16) -> Self {
        let mut writer = lzw::Writer::new(bits(1));
        writer.put(0);
        let area = Area { left: 0, top: 0, right: 1, bottom: 1 };
        Self::new(area, &[], Some(0), delay_cs, &[writer.finish(true)])
    }

    /// Makes a block from image data in parts.
    pub(crate) fn new(
        area: Area,
        colours: &[[u8; 3]],
        transparent: Option<u8>,
        delay_cs: u16,
        parts: &[Part],
    ) -> Self {
        // The transparent index needs an entry in the palette, too. That entry is never shown.
        let filler = transparent.map(|_| [0; 3]);
        let palette = colours.iter().chain(&filler).flatten().copied().collect::<Vec<_>>();
        let data = lzw::join(bits(palette.len() / 3), parts);
        Self { area, palette, is_of_file: false, transparent, delay_cs, clears: false, data }
    }

    /// Marks the palette as that of the file.
    pub(crate) fn of_file(self) -> Self {
        Self { is_of_file: true, ..self }
    }

    /// Makes the canvas clear after the block.
    pub(crate) fn clearing(self) -> Self {
        Self { clears: true, ..self }
    }

    /// Returns the bytes that depend on the choice of the palette.
    pub(crate) fn bytes(&self) -> usize {
        let table = if self.is_of_file { 0 } else { 3 << bits_of_table(self.palette.len() / 3) };
        table + self.data.len()
    }
}

/// Returns the bits of an index into a stored palette of this many colours.
fn bits_of_table(colours: usize) -> u8 {
    (1..8).find(|&bits| colours <= 1 << bits).unwrap_or(8)
}

/// Returns the bits of an index into a palette of this many colours. LZW needs at least 2.
pub(crate) fn bits(colours: usize) -> u8 {
    (2..8).find(|&bits| colours <= 1 << bits).unwrap_or(8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn area_around_what_is_drawn() {
        let mut items = vec![7; 5 * 4];
        items[5 + 2] = 1;
        items[3 * 5 + 3] = 2;
        let expected = Area { left: 2, top: 1, right: 4, bottom: 4 };
        assert_eq!(Area::around(&items, 5, |&item| item != 7), Some(expected));
        assert_eq!(Area::around(&items, 5, |&item| item == 9), None);
        assert_eq!(Area::whole(5, 20), Area { left: 0, top: 0, right: 5, bottom: 4 });
    }

    #[test]
    fn nothing_is_one_transparent_pixel() {
        let block = Block::nothing(9);
        let mut decoder = weezl::decode::Decoder::new(weezl::BitOrder::Lsb, block.data[0]);
        assert_eq!(decoder.decode(&block.data[1..]).unwrap(), [0]);
        assert_eq!((block.transparent, block.palette.len(), block.delay_cs), (Some(0), 3, 9));
    }
}
