//! The quantiser: turns each frame into the GIF block that updates the canvas from the previous frame to it.
//!
//! Two frames are processed at once: while one is drawn, the next one is prepared. Preparing a frame means
//! [comparing](crate::update_map) it with the canvas before it, and [planning](crate::plan) how to draw it. Drawing
//! it means choosing its indices, in [stripes](crate::stripe).
//!
//! The state of a quantiser can be saved between two frames. Only what cannot be derived is stored. The histogram,
//! the palette and the nearest entry of each colour are computed again.

use std::io;

use image::RgbImage;

use crate::block::{Area, Block};
use crate::bound;
use crate::colour::LocalMetric;
use crate::error::Error;
use crate::exact::{self, Change, FewColours, Kind};
use crate::histogram::{Histogram, MAX_BINS};
use crate::plan::{LossyPlan, Plan};
use crate::quantised::Quantised;
use crate::refine_budget::{Redrawn, RefineBudget, Reservation};
use crate::state::{StateReader, StateWriter, damaged};
use crate::stripe::{self, Colours, Layout, Row, Stripe};
use crate::update_map::{EXACT_SKIP_ERROR, PixelUpdate, Previous, SKIP_ERROR, UpdateMap};

/// The number of parts of a frame whose colours are counted in parallel.
const PARTS: usize = 2;

/// If at least this part of a frame is drawn because it changed, it is divided into this many stripes,
/// because the file grows little by them there. There are several per thread: one thread has prepared the
/// next frame and starts later.
const MOST: f64 = 0.5;
const STRIPES_IF_MOST: usize = 5;
/// With this many colours a code table fills soon, so a second stripe hardly enlarges the file.
const MANY_COLOURS: usize = 4096;

/// A converter of frames to blocks, one after the other.
#[derive(Debug)]
pub(crate) struct Quantiser {
    /// No frame [drifts](Kind).
    exact: bool,
    /// The palette of the file.
    of_file: Option<FewColours>,
    /// The frame that is drawn next.
    prepared: Option<Prepared>,
    /// The canvas after the last block.
    seen: RgbImage,
    budget: RefineBudget,
    /// Histograms that are reused for each frame.
    parts: Vec<Histogram>,
    /// A histogram of all colours of a frame.
    whole: Histogram,
    spare: Option<Buffers>,
    /// The mean level error of the pixels drawn with the last palette.
    drawn_error: f32,
}

/// The buffers in which a frame is prepared.
#[derive(Debug)]
struct Buffers {
    updates: UpdateMap,
    /// The colours that are drawn.
    histogram: Histogram,
}

/// A frame that is ready to be drawn.
#[derive(Debug)]
struct Prepared {
    frame: RgbImage,
    delay_cs: u16,
    /// There is no frame before it.
    first: bool,
    /// The frame drifts (see [`Kind`]).
    drifts: bool,
    buffers: Buffers,
    plan: Plan,
}

/// The inputs and buffers for preparing a frame.
struct Preparation<'a> {
    pixels: &'a [[u8; 3]],
    width: usize,
    previous: Option<&'a Prepared>,
    drawn_error: f32,
    exact: bool,
    budget: &'a mut RefineBudget,
    parts: &'a mut [Histogram],
    whole: &'a mut Histogram,
    buffers: &'a mut Buffers,
}

impl Quantiser {
    /// Makes a quantiser. `exact`: frames of few colours stay exact also if they drift. `of_file`: the palette of the
    /// file.
    pub(crate) fn new(exact: bool, of_file: Option<FewColours>) -> Self {
        Self {
            exact,
            of_file,
            prepared: None,
            seen: RgbImage::default(),
            budget: RefineBudget::new(),
            parts: (1..PARTS).map(|_| Histogram::new(MAX_BINS)).collect(),
            whole: Histogram::new(MAX_BINS),
            spare: None,
            drawn_error: 0.0,
        }
    }

    /// Returns the palette of the file.
    pub(crate) fn of_file(&self) -> Option<&FewColours> {
        self.of_file.as_ref()
    }

    /// Takes the next frame, and returns the block of the one before it.
    pub(crate) fn push(&mut self, frame: RgbImage, delay_cs: u16) -> Option<Block> {
        // The whole step runs in the pool. Otherwise each part of it would have to wait for a thread.
        rayon::scope(|_| self.step(frame, delay_cs))
    }

    fn step(&mut self, frame: RgbImage, delay_cs: u16) -> Option<Block> {
        self.settle();
        let previous = self.prepared.take();
        let first = previous.is_none();
        if first {
            self.seen = RgbImage::new(frame.width(), frame.height());
        }
        let Self { exact, of_file, seen, budget, parts, whole, spare, drawn_error, .. } = self;
        let of_file = of_file.as_ref();
        let mut buffers = spare.take().unwrap_or_else(Buffers::new);
        let mut preparation = Preparation {
            pixels: pixels_of(&frame),
            width: frame.width() as usize,
            previous: previous.as_ref(),
            drawn_error: *drawn_error,
            exact: *exact,
            budget,
            parts,
            whole,
            buffers: &mut buffers,
        };
        let ((plan, drifts), drawn) = match &previous {
            None => {
                let compared = preparation.compare(seen);
                rayon::join(
                    || preparation.plan(compared),
                    || {
                        LocalMetric::prepare();
                        None
                    },
                )
            }
            // The canvas will be the previous frame itself.
            Some(previous) if matches!(previous.plan, Plan::Lossless(_)) => rayon::join(
                || {
                    let compared = preparation.compare(&previous.frame);
                    preparation.plan(compared)
                },
                || Some(previous.draw(seen, of_file, Some(pixels_of(&frame)))),
            ),
            Some(previous) => {
                let compared = preparation.compare(seen);
                rayon::join(
                    || preparation.plan(compared),
                    || Some(previous.draw(seen, of_file, Some(pixels_of(&frame)))),
                )
            }
        };
        if let Plan::Lossy(LossyPlan { area: Some(_), level_error, .. }) = plan {
            self.drawn_error = level_error;
        }
        self.prepared = Some(Prepared { frame, delay_cs, first, drifts, buffers, plan });
        let (previous, (block, redrawn)) = (previous?, drawn?);
        if let Plan::Lossy(LossyPlan { reservation: Some(reservation), changed, .. }) = &previous.plan {
            self.budget.commit(reservation, &redrawn, *changed);
        }
        self.spare = Some(previous.buffers);
        Some(block)
    }

    /// Revises the plan of the frame that is drawn next, now that the canvas before it is known.
    fn settle(&mut self) {
        let Self { prepared, seen, parts, budget, .. } = self;
        let Some(Prepared {
            frame, buffers: Buffers { updates, histogram }, plan: Plan::Lossy(plan), ..
        }) = prepared
        else {
            return;
        };
        let (pixels, width) = (pixels_of(frame), frame.width() as usize);
        if plan.reservation.is_none() || !updates.draw_what_is_off(pixels, pixels_of(seen), plan.bound) {
            return;
        }
        let mut reservation = plan.reservation.take();
        *plan = LossyPlan::new(pixels, width, &mut reservation, plan.bound, updates, histogram, parts);
        if let Some(reservation) = reservation {
            budget.release(&reservation);
        }
        if plan.area.is_some() {
            self.drawn_error = plan.level_error;
        }
    }

    /// Returns the block of the last frame.
    pub(crate) fn finish(&mut self) -> Option<Block> {
        rayon::scope(|_| self.settle());
        let last = self.prepared.take()?;
        rayon::scope(|_| Some(last.draw(&mut self.seen, self.of_file.as_ref(), None).0))
    }
}

impl Quantiser {
    /// Takes back the last frame, whose block is not written yet, and its delay.
    pub(crate) fn take_back(&mut self) -> Option<(RgbImage, u16)> {
        self.prepared.take().map(|prepared| (prepared.frame, prepared.delay_cs))
    }
}

/// Tags for the plan of a prepared frame in a suspended animation.
const LOSSLESS: u8 = 0;
const LOSSY: u8 = 1;
/// The plan refines static pixels out of a reservation.
const LOSSY_WITH_RESERVATION: u8 = 2;

impl Quantiser {
    /// Writes the state on which later blocks depend. Writes nothing before the first frame.
    pub(crate) fn write(&self, state: &mut StateWriter) -> io::Result<()> {
        let Some(Prepared { frame, delay_cs, first, drifts, buffers, plan }) = &self.prepared else {
            return Ok(());
        };
        self.budget.write(state)?;
        state.f32(self.drawn_error)?;
        state.u16(*delay_cs)?;
        state.bytes(&[u8::from(*first), u8::from(*drifts)])?;
        match plan {
            Plan::Lossless(_) => state.bytes(&[LOSSLESS])?,
            Plan::Lossy(LossyPlan { reservation: None, .. }) => state.bytes(&[LOSSY])?,
            Plan::Lossy(LossyPlan { reservation: Some(reservation), bound, .. }) => {
                state.bytes(&[LOSSY_WITH_RESERVATION, *bound])?;
                reservation.write(state)?;
            }
        }
        state.bytes(self.seen.as_raw())?;
        // The frame as its difference from the canvas, which is mostly small.
        for (now, seen) in rows(frame).zip(rows(&self.seen)) {
            let differences: Vec<u8> =
                now.iter().zip(seen).map(|(now, seen)| now.wrapping_sub(*seen)).collect();
            state.bytes(&differences)?;
        }
        for updates in buffers.updates.pixels.chunks(frame.width() as usize) {
            let updates: Vec<u8> = updates.iter().map(|update| update.to_byte()).collect();
            state.bytes(&updates)?;
        }
        Ok(())
    }

    /// Reads the state that was written for frames of a size.
    pub(crate) fn read(
        state: &mut StateReader<'_>,
        (width, height): (u32, u32),
        exact: bool,
        of_file: Option<FewColours>,
    ) -> Result<Self, Error> {
        let mut quantiser = Self {
            budget: RefineBudget::read(state)?,
            drawn_error: state.f32()?,
            ..Self::new(exact, of_file)
        };
        let (delay_cs, first, drifts) = (state.u16()?, state.u8()? != 0, state.u8()? != 0);
        let kind = state.u8()?;
        let (bound, reservation) = match kind {
            LOSSY_WITH_RESERVATION => (state.u8()?, Some(Reservation::read(state)?)),
            _ => (bound::NONE, None),
        };
        let pixels = width as usize * height as usize;
        let seen = state.bytes(pixels * 3)?;
        let mut frame = state.bytes(pixels * 3)?;
        for (level, seen) in frame.iter_mut().zip(&seen) {
            *level = level.wrapping_add(*seen);
        }
        let image = |levels: Vec<u8>| {
            RgbImage::from_raw(width, height, levels).ok_or_else(|| damaged("its size is wrong"))
        };
        let (frame, seen) = (image(frame)?, image(seen)?);
        let updates = state.bytes(pixels)?.into_iter().map(PixelUpdate::of_byte).collect::<Option<Vec<_>>>();
        let updates = UpdateMap::decided(
            width as usize,
            updates.ok_or_else(|| damaged("a pixel has an unknown update"))?,
        );
        let mut buffers = Buffers { updates, ..Buffers::new() };
        let plan = match kind {
            LOSSLESS => {
                let few = exact::few_colours(pixels_of(&frame));
                Plan::Lossless(few.ok_or_else(|| damaged("a frame without loss has too many colours"))?)
            }
            LOSSY | LOSSY_WITH_RESERVATION if reservation.is_none() || !first => {
                let Buffers { updates, histogram } = &mut buffers;
                let (pixels, parts) = (pixels_of(&frame), &mut quantiser.parts);
                let (mut reservation, width) = (reservation, width as usize);
                let plan = rayon::scope(|_| {
                    LossyPlan::new(pixels, width, &mut reservation, bound, updates, histogram, parts)
                });
                Plan::Lossy(plan)
            }
            _ => return Err(damaged("a frame is drawn as there is not")),
        };
        quantiser.seen = seen;
        quantiser.prepared = Some(Prepared { frame, delay_cs, first, drifts, buffers, plan });
        Ok(quantiser)
    }
}

fn rows(image: &RgbImage) -> impl Iterator<Item = &[u8]> {
    image.as_raw().chunks(3 * image.width() as usize)
}

impl Buffers {
    fn new() -> Self {
        Self { updates: UpdateMap::default(), histogram: Histogram::new(MAX_BINS) }
    }
}

impl Preparation<'_> {
    /// Compares the frame with the canvas, and reserves a part of the refine budget. Makes no reservation if all of
    /// the frame is drawn. `seen`: the canvas before the previous frame is drawn.
    fn compare(&mut self, seen: &RgbImage) -> (Kind, Option<Reservation>) {
        let Self { pixels, width, previous, drawn_error, exact, .. } = *self;
        let before = previous.map(|previous| (pixels_of(&previous.frame), previous.drifts));
        let kind = Kind::of(pixels, before, exact);
        let updates = &mut self.buffers.updates;
        let Some(previous) = previous.filter(|_| kind.few.is_none()) else {
            updates.draw_all(width, pixels.len());
            return (kind, None);
        };
        let skip_error = if kind.drifts { EXACT_SKIP_ERROR } else { SKIP_ERROR };
        let previous = previous.seen_after(seen, drawn_error, skip_error);
        let refining = kind.change != Change::Slight && self.budget.is_left();
        let still = updates.compare(pixels, width, previous, refining);
        let reservation = self.budget.reserve(&still, pixels.len());
        self.budget.waited = updates.confine(reservation.least_error, self.budget.waited);
        (kind, Some(reservation))
    }

    /// Plans how the frame is drawn. Returns also whether it drifts.
    fn plan(self, (kind, reservation): (Kind, Option<Reservation>)) -> (Plan, bool) {
        let Self { pixels, width, parts, whole, budget, buffers: Buffers { updates, histogram }, .. } = self;
        let mut reservation = reservation;
        let plan = match kind.few {
            Some(colours) => Plan::Lossless(colours),
            None => {
                let bound = match reservation {
                    None => bound::NONE,
                    Some(_) if kind.drifts => bound::DRIFTING,
                    Some(_) => {
                        whole.count(pixels, parts);
                        bound::of(pixels, whole)
                    }
                };
                let plan = LossyPlan::new(pixels, width, &mut reservation, bound, updates, histogram, parts);
                if let Some(reservation) = reservation {
                    budget.release(&reservation);
                }
                Plan::Lossy(plan)
            }
        };
        (plan, kind.drifts)
    }
}

impl Prepared {
    /// Returns the data with which the next frame is compared. `seen`: the canvas before this frame is drawn.
    fn seen_after<'a>(&'a self, seen: &'a RgbImage, error: f32, skip_error: f32) -> Previous<'a> {
        Previous {
            frame: pixels_of(&self.frame),
            updates: &self.buffers.updates.pixels,
            seen: pixels_of(seen),
            error,
            skip_error,
            nearest: match &self.plan {
                Plan::Lossless(_) => None,
                Plan::Lossy(plan) => Some((&self.buffers.histogram, &plan.quantised.nearest)),
            },
        }
    }

    /// Draws the frame. Returns the block, and the static pixels that were redrawn. `next`: the pixels of the frame after it.
    fn draw(
        &self,
        seen: &mut RgbImage,
        of_file: Option<&FewColours>,
        next: Option<&[[u8; 3]]>,
    ) -> (Block, Vec<Redrawn>) {
        let (width, pixels) = (self.frame.width() as usize, pixels_of(&self.frame));
        let seen = seen.as_chunks_mut::<3>().0;
        match &self.plan {
            Plan::Lossless(colours) => {
                let block = exact::draw(pixels, width, self.first, seen, colours, of_file, self.delay_cs);
                (block, Vec::new())
            }
            Plan::Lossy(LossyPlan { area: None, .. }) => (Block::nothing(self.delay_cs), Vec::new()),
            Plan::Lossy(LossyPlan { area: Some(area), quantised, changed, reservation, bound, .. }) => {
                let Quantised { palette, nearest, error } = &**quantised;
                let transparent = reservation.is_some().then_some(palette.colours.len() as u8);
                let histogram = &self.buffers.histogram;
                let (changed, error, bound) = (*changed, *error, *bound);
                let is_alone = false;
                let colours =
                    Colours { palette, nearest, histogram, transparent, is_alone, changed, error, bound };
                // A frame that is encoded as if it were alone knows no other.
                let next = next.filter(|_| reservation.is_some());
                let updates = &self.buffers.updates.pixels;
                draw((pixels, next), width, *area, updates, seen, colours, self.delay_cs)
            }
        }
    }
}

fn pixels_of(image: &RgbImage) -> &[[u8; 3]] {
    image.as_raw().as_chunks().0
}

/// Returns the least number of stripes of a frame. `changed`: the part of it that is drawn because it changed.
/// `colours`: the number of its colours.
fn least_stripes(changed: f64, colours: usize) -> usize {
    match colours {
        _ if changed >= MOST => STRIPES_IF_MOST,
        0..MANY_COLOURS => 1,
        _ => 2,
    }
}

/// Draws an area of a frame with the colours of a palette. `next`: the pixels of the frame after it. Returns the block, and
/// the static pixels that were redrawn.
pub(crate) fn draw(
    (pixels, next): (&[[u8; 3]], Option<&[[u8; 3]]>),
    width: usize,
    area: Area,
    updates: &[PixelUpdate],
    seen: &mut [[u8; 3]],
    colours: Colours<'_>,
    delay_cs: u16,
) -> (Block, Vec<Redrawn>) {
    let layout = Layout {
        area,
        width,
        colours: &colours.palette.colours,
        transparent: colours.transparent,
        delay_cs,
        stripes: least_stripes(colours.changed, colours.histogram.bins().len()),
    };
    stripe::in_stripes(layout, seen, |writer, top, seen| {
        let mut stripe = Stripe::new(colours, writer);
        for (y, seen) in (top..).zip(seen.chunks_exact_mut(width)) {
            let part = y * width + area.left..y * width + area.right;
            let above = if y == 0 { part.clone() } else { part.start - width..part.end - width };
            stripe.draw(Row {
                pixels: &pixels[part.clone()],
                above: &pixels[above],
                next: next.map(|next| &next[part.clone()]),
                updates: &updates[part],
                seen: &mut seen[area.left..area.right],
            });
        }
        stripe.redrawn()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stripes_where_they_cost_little() {
        assert_eq!(least_stripes(0.0, MANY_COLOURS - 1), 1);
        assert_eq!(least_stripes(0.49, MANY_COLOURS), 2);
        assert_eq!(least_stripes(MOST, 1), STRIPES_IF_MOST);
    }

    /// A frame of many colours, which from row `from` on are `by` levels higher.
    fn frame(from: u32, by: u8) -> RgbImage {
        let level = |x: u32, y: u32| [x as u8 * 2, y as u8 * 2, (x + y) as u8];
        RgbImage::from_fn(64, 64, |x, y| {
            let [r, g, b] = level(x, y);
            image::Rgb(if y >= from { [r, g + by, b] } else { [r, g, b] })
        })
    }

    #[test]
    fn each_frame_is_planned_by_what_is_seen_before_it() {
        let mut quantiser = Quantiser::new(false, None);
        assert!(quantiser.push(frame(64, 0), 5).is_none());
        let Some(Prepared { first: true, plan: Plan::Lossy(plan), .. }) = &quantiser.prepared else {
            panic!("{:?}", quantiser.prepared)
        };
        assert_eq!((plan.area.map(|area| area.size()), plan.changed), (Some(64 * 64), 1.0));
        assert!(plan.reservation.is_none());

        let whole = quantiser.push(frame(48, 100), 6).unwrap();
        assert_eq!((whole.area.size(), whole.transparent, whole.delay_cs), (64 * 64, None, 5));
        let Some(Prepared { first: false, plan: Plan::Lossy(plan), .. }) = &quantiser.prepared else {
            panic!("{:?}", quantiser.prepared)
        };
        // Pixels refined above it wait for a later frame, or are part of the area.
        assert!(plan.area.is_some_and(|area| area.bottom == 64 && area.top <= 48));
        assert_eq!(plan.changed, 0.25);
        assert!(plan.reservation.is_some());

        let block = quantiser.finish().unwrap();
        assert_eq!(block.delay_cs, 6);
        assert!(block.transparent.is_some());
    }

    #[test]
    fn what_the_next_frame_changes_takes_fewer_bytes() {
        let bytes = |next: RgbImage| {
            let mut quantiser = Quantiser::new(false, None);
            quantiser.push(frame(64, 0), 5);
            quantiser.push(frame(48, 100), 5);
            quantiser.push(next, 5).unwrap().data.len()
        };
        let (gone, stays) = (bytes(frame(64, 0)), bytes(frame(48, 100)));
        assert!(gone < stays, "{gone} bytes, {stays} if it stays");
    }

    #[test]
    fn few_colours_are_planned_without_loss() {
        let mut quantiser = Quantiser::new(false, None);
        quantiser.push(RgbImage::from_pixel(16, 16, image::Rgb([9; 3])), 5);
        assert!(matches!(quantiser.prepared, Some(Prepared { plan: Plan::Lossless(_), .. })));
    }
}
