//! One frame as the format stores it, before compression.

/// The part of a frame that is drawn over what is already seen.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Block {
    pub(crate) left: u16,
    pub(crate) top: u16,
    pub(crate) width: u16,
    pub(crate) height: u16,
    /// One palette index a pixel, row by row.
    pub(crate) indices: Vec<u8>,
    /// Red, green, blue for each index; at most 256 of them.
    pub(crate) palette: Vec<u8>,
    /// The index that leaves a pixel as it is.
    pub(crate) transparent: Option<u8>,
    pub(crate) delay_cs: u16,
}

impl Block {
    /// Draws nothing, for the time given. The format has no empty block, so this is one pixel of nothing.
    pub(crate) fn nothing(delay_cs: u16) -> Self {
        Self {
            left: 0,
            top: 0,
            width: 1,
            height: 1,
            indices: vec![0],
            palette: vec![0; 3],
            transparent: Some(0),
            delay_cs,
        }
    }

    /// Cuts a whole frame's indices to the rectangle outside of which all are transparent.
    ///
    /// Without a transparent index the whole frame is drawn.
    pub(crate) fn cut(
        indices: Vec<u8>,
        width: usize,
        colours: &[[u8; 3]],
        transparent: Option<u8>,
        delay_cs: u16,
    ) -> Self {
        let filler = transparent.map(|_| [0; 3]);
        let palette = colours.iter().chain(&filler).flatten().copied().collect();
        let Some(clear) = transparent else {
            let height = (indices.len() / width) as u16;
            let width = width as u16;
            return Self { left: 0, top: 0, width, height, indices, palette, transparent, delay_cs };
        };
        let (mut left, mut right, mut top, mut bottom) = (width, 0, usize::MAX, 0);
        for (y, row) in indices.chunks_exact(width).enumerate() {
            if let Some(first) = row.iter().position(|&index| index != clear) {
                let last = row.iter().rposition(|&index| index != clear).unwrap_or(first);
                left = left.min(first);
                right = right.max(last + 1);
                top = top.min(y);
                bottom = y + 1;
            }
        }
        if top == usize::MAX {
            return Self::nothing(delay_cs);
        }
        let cut = (top..bottom).flat_map(|y| &indices[y * width + left..y * width + right]).copied();
        let mut kept = Vec::with_capacity((right - left) * (bottom - top));
        kept.extend(cut);
        Self {
            left: left as u16,
            top: top as u16,
            width: (right - left) as u16,
            height: (bottom - top) as u16,
            indices: kept,
            palette,
            transparent,
            delay_cs,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cut_keeps_what_is_drawn() {
        let mut indices = vec![7; 5 * 4];
        indices[5 + 2] = 1;
        indices[3 * 5 + 3] = 2;
        let block = Block::cut(indices, 5, &[[0; 3]; 7], Some(7), 4);
        assert_eq!((block.left, block.top, block.width, block.height), (2, 1, 2, 3));
        assert_eq!(block.indices, [1, 7, 7, 7, 7, 2]);
    }

    #[test]
    fn nothing_drawn_is_one_clear_pixel() {
        assert_eq!(Block::cut(vec![3; 6], 2, &[[0; 3]; 3], Some(3), 9), Block::nothing(9));
    }
}
