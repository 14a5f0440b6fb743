//! The plan of a frame: drawn without loss, or with the palette that suits it best.

use crate::block::Area;
use crate::bound;
use crate::exact::FewColours;
use crate::histogram::Histogram;
use crate::nearest;
use crate::palette::Sample;
use crate::quantised::Quantised;
use crate::refine_budget::Reservation;
use crate::update_map::UpdateMap;

/// The way in which a frame is drawn.
#[derive(Debug)]
pub(crate) enum Plan {
    /// All colours are exact.
    Lossless(FewColours),
    /// The colours are those of a palette.
    Lossy(LossyPlan),
}

/// The pixels that are drawn, and their palette.
#[derive(Debug)]
pub(crate) struct LossyPlan {
    /// `None` if the frame is encoded as if it were alone: the first frame, and frames that cannot be drawn
    /// well enough over others.
    pub(crate) reservation: Option<Reservation>,
    /// The largest error of a pixel, in levels (see [`bound`]).
    pub(crate) bound: u8,
    /// The part of the frame that is drawn because it changed.
    pub(crate) changed: f64,
    /// `None` if nothing is to be drawn.
    pub(crate) area: Option<Area>,
    pub(crate) quantised: Box<Quantised>,
    /// Mean level error of what is drawn.
    pub(crate) level_error: f32,
}

impl LossyPlan {
    /// Plans a frame after `updates` is decided. Fills the histogram with the colours that are drawn; each of `parts`
    /// counts a part of them.
    ///
    /// `reservation` is given if the frame is drawn over others with no pixel further off than `bound`. If that is
    /// impossible, the reservation is left in place, and the frame is planned as if it were alone.
    pub(crate) fn new(
        pixels: &[[u8; 3]],
        width: usize,
        reservation: &mut Option<Reservation>,
        bound: u8,
        updates: &mut UpdateMap,
        histogram: &mut Histogram,
        parts: &mut [Histogram],
    ) -> Self {
        if let Some(reserved) = reservation.take() {
            let changed =
                updates.count(pixels, reserved.least_error, histogram, parts) as f64 / pixels.len() as f64;
            let area = Area::around(&updates.pixels, width, |update| update.may_draw());
            let bins = Sample::of_bins(histogram);
            let best = Quantised::new(histogram, &bins, 255).of_fewer_colours(histogram, &bins);
            if let Some(quantised) = best.within((pixels, &updates.pixels), histogram, &bins, bound) {
                let level_error =
                    nearest::mean_level_error(histogram, &quantised.nearest, &quantised.palette);
                return Self {
                    reservation: Some(reserved),
                    bound,
                    changed,
                    area,
                    quantised: Box::new(quantised),
                    level_error,
                };
            }
            *reservation = Some(reserved);
        }
        updates.draw_all(width, pixels.len());
        histogram.count(pixels, parts);
        let bins = Sample::of_bins(histogram);
        // A viewer may see the first frame for a long time, or see nothing else.
        let quantised = Quantised::new(histogram, &bins, 256);
        let level_error = nearest::mean_level_error(histogram, &quantised.nearest, &quantised.palette);
        let area = Some(Area::whole(width, pixels.len()));
        Self {
            reservation: None,
            bound: bound::NONE,
            changed: 1.0,
            area,
            quantised: Box::new(quantised),
            level_error,
        }
    }
}
