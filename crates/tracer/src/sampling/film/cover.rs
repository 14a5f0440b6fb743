//! The cover of pixels in scenes without background. It is summed beside their colours, as a colour of three equal
//! channels.

use super::first::{First, FirstRows};
use super::pixel::Pixel;

/// The cover of all pixels, stored as [`super::Film`] stores their colours.
#[derive(Debug)]
pub(super) struct Layer {
    pub(super) first: Option<First>,
    pub(super) tiles: Vec<Vec<Pixel>>,
}

/// The cover of a row of tiles.
pub(crate) struct CoverRows<'a> {
    tiles: &'a mut [Vec<Pixel>],
    first: Option<FirstRows<'a>>,
}

/// The cover of a tile.
pub(crate) struct CoverTile<'a, 'b> {
    /// The sums, row by row. Empty for a tile that has no sums yet.
    pub(crate) pixels: &'a mut Vec<Pixel>,
    /// The first samples of the tile's row of tiles.
    pub(crate) first: Option<&'a mut FirstRows<'b>>,
}

impl Layer {
    /// Returns the layer in bands of `tiles` tiles and `pixels` pixels.
    pub(super) fn rows(&mut self, tiles: usize, pixels: usize) -> impl Iterator<Item = CoverRows<'_>> {
        let mut first = self.first.as_mut().map(|first| first.bands(pixels));
        self.tiles
            .chunks_mut(tiles)
            .map(move |tiles| CoverRows { tiles, first: first.as_mut().and_then(Iterator::next) })
    }
}

impl<'b> CoverRows<'b> {
    /// Returns the cover of the tile in a column.
    pub(crate) fn of_tile(&mut self, column: usize) -> CoverTile<'_, 'b> {
        CoverTile { pixels: &mut self.tiles[column], first: self.first.as_mut() }
    }
}

impl CoverTile<'_, '_> {
    /// Makes room for the sums of `pixels` pixels.
    pub(crate) fn begin(&mut self, pixels: usize) {
        self.pixels.resize(pixels, Pixel::default());
    }
}
