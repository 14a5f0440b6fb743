//! A frame and what a viewer sees before it, to the block that turns the one into the other.
//!
//! Two frames are worked on at once: while one is drawn, the next is prepared. To [look](crate::look) at it is the step
//! between them; then a palette is made of the colours that need drawing, and each colour has its [ink](crate::ink),
//! while the [stripes](crate::stripe) choose the indices of the frame before.

use image::RgbImage;

use crate::allowance::{Allowance, Loan, Redrawn};
use crate::block::{Area, Block};
use crate::colour::Near;
use crate::exact::{self, Change, FewColours};
use crate::histogram::{Histogram, MOST_BINS};
use crate::ink::{self, Ink};
use crate::look::{Before, Need, Needs, TOLERATED, TOLERATED_IF_EXACT};
use crate::palette::{Palette, Sample};
use crate::stripe::{self, Inks, Row, Sheet, Stripe};

/// Parts of a frame whose colours are counted side by side.
const PARTS: usize = 2;
/// Mean squared error (see [`colour`](crate::colour)) up to which a palette of half as many colours is taken: it takes up
/// half as many bytes, and the indices fewer, too. More of it by a number for all pixels together, up to a limit: where
/// little is drawn, a palette is much of the file.
const GOOD_ENOUGH: f32 = 0.8;
const BY_PIXELS: f32 = 5000.0;
const AT_MOST: f32 = 3.0;
/// The fewest colours that a palette is halved to, with the one that is clear.
const FEWEST: usize = 16;
/// With more bins than that, no palette is good enough but by much work.
const MOST_BINS_HALVED: usize = 4096;

/// From which part of a frame on that changes many stripes cost little size. Several to a thread, for one of them begins
/// late: it has prepared the next frame.
const MOST: f64 = 0.5;
const STRIPES_IF_MOST: usize = 5;
/// From how many colours on a book is soon full, so that two stripes cost next to nothing.
const MANY_COLOURS: usize = 4096;

/// Turns frames into blocks, one after the other.
#[derive(Debug)]
pub(crate) struct Quantiser {
    waiting: Option<Waiting>,
    /// What a viewer sees after the last block.
    seen: RgbImage,
    allowance: Allowance,
    /// Used for each frame anew.
    parts: Vec<Histogram>,
    spare: Option<(Needs, Histogram)>,
    /// Mean level error of what the last palette draws.
    drawn_error: f32,
}

/// A frame that is ready to be drawn.
#[derive(Debug)]
struct Waiting {
    frame: RgbImage,
    delay_cs: u16,
    /// Whether there is none before it.
    first: bool,
    /// Whether it has at most 256 colours and is not exact, because it changes slightly from frame to frame.
    drifts: bool,
    needs: Needs,
    histogram: Histogram,
    plan: Plan,
}

/// How a frame is to be drawn.
#[derive(Debug)]
enum Plan {
    /// Without loss.
    Exactly(FewColours),
    With(Paint),
}

#[derive(Debug)]
struct Paint {
    /// `None` for the first frame.
    loan: Option<Loan>,
    /// The part of the frame that is drawn because it changed.
    changed: f64,
    /// `None` if nothing is to be drawn.
    area: Option<Area>,
    inked: Box<Inked>,
    /// Mean level error of what is drawn.
    level_error: f32,
}

/// A palette, which of its colours is nearest to each bin, and the mean squared error of what is drawn.
#[derive(Debug)]
struct Inked {
    palette: Palette,
    of_bins: Vec<Ink>,
    error: f32,
}

impl Quantiser {
    pub(crate) fn new() -> Self {
        Self {
            waiting: None,
            seen: RgbImage::default(),
            allowance: Allowance::new(),
            parts: (1..PARTS).map(|_| Histogram::new(MOST_BINS)).collect(),
            spare: None,
            drawn_error: 0.0,
        }
    }

    /// Takes the next frame, and gives the block of the one before it.
    pub(crate) fn push(&mut self, frame: RgbImage, delay_cs: u16) -> Option<Block> {
        // All of it in the pool: each part by itself would have to get in.
        rayon::scope(|_| self.step(frame, delay_cs))
    }

    fn step(&mut self, frame: RgbImage, delay_cs: u16) -> Option<Block> {
        let (width, pixels) = (frame.width() as usize, frame.as_raw().as_chunks::<3>().0);
        let before = self.waiting.take();
        let first = before.is_none();
        if first {
            self.seen = RgbImage::new(frame.width(), frame.height());
        }
        let spare = self.spare.take();
        let (mut needs, mut histogram) =
            spare.unwrap_or_else(|| (Needs::default(), Histogram::new(MOST_BINS)));

        let (seen, allowance, parts) = (&mut self.seen, &mut self.allowance, &mut self.parts);
        let error = self.drawn_error;
        let mut drifting = false;
        let mut look = |seen: &RgbImage, needs: &mut Needs| {
            let before = before.as_ref();
            let few = exact::few_colours(pixels);
            let change = match before {
                Some(before) if few.is_some() => exact::change(pixels, before.frame.as_raw().as_chunks().0),
                _ => Change::Large,
            };
            let drifts = match change {
                Change::Little => before.is_some_and(|before| before.drifts),
                Change::Slight => true,
                Change::Large => false,
            };
            let few = few.filter(|_| !drifts);
            let before = before.filter(|_| few.is_none()).map(|before| Before {
                frame: before.frame.as_raw().as_chunks().0,
                needs: &before.needs.pixels,
                seen: seen.as_raw().as_chunks().0,
                error,
                tolerated: if drifts { TOLERATED_IF_EXACT } else { TOLERATED },
                inks: match &before.plan {
                    Plan::Exactly(_) => None,
                    Plan::With(paint) => Some((&before.histogram, &paint.inked.of_bins)),
                },
            });
            let loan = match before {
                Some(before) => {
                    let still =
                        needs.look(pixels, width, before, change != Change::Slight && allowance.is_left());
                    let loan = allowance.lend(&still, pixels.len());
                    allowance.waited = needs.confine(loan.least_error, allowance.waited);
                    Some(loan)
                }
                None => {
                    needs.want_all(width, pixels.len());
                    None
                }
            };
            drifting = drifts;
            (few, loan)
        };
        let (plan, drawn) = match &before {
            // What will be seen is the frame itself.
            Some(before) if matches!(before.plan, Plan::Exactly(_)) => {
                let plan = || {
                    let looked = look(&before.frame, &mut needs);
                    Plan::new(pixels, width, looked, &mut needs, &mut histogram, parts)
                };
                let (plan, drawn) = rayon::join(plan, || before.draw(seen));
                (plan, Some(drawn))
            }
            before => {
                let looked = look(seen, &mut needs);
                let plan = || Plan::new(pixels, width, looked, &mut needs, &mut histogram, parts);
                rayon::join(plan, || match before {
                    Some(before) => Some(before.draw(seen)),
                    None => {
                        Near::prepare();
                        None
                    }
                })
            }
        };
        if let Plan::With(Paint { area: Some(_), level_error, .. }) = plan {
            self.drawn_error = level_error;
        }
        self.waiting = Some(Waiting { frame, delay_cs, first, drifts: drifting, needs, histogram, plan });
        let (before, (block, redrawn)) = (before?, drawn?);
        if let Plan::With(Paint { loan: Some(loan), changed, .. }) = &before.plan {
            self.allowance.pay(loan, &redrawn, *changed);
        }
        self.spare = Some((before.needs, before.histogram));
        Some(block)
    }

    /// The block of the last frame.
    pub(crate) fn finish(&mut self) -> Option<Block> {
        let last = self.waiting.take()?;
        rayon::scope(|_| Some(last.draw(&mut self.seen).0))
    }
}

impl Plan {
    fn new(
        pixels: &[[u8; 3]],
        width: usize,
        (few, loan): (Option<FewColours>, Option<Loan>),
        needs: &mut Needs,
        histogram: &mut Histogram,
        parts: &mut [Histogram],
    ) -> Self {
        match few {
            Some(colours) => Self::Exactly(colours),
            None => Self::With(Paint::new(pixels, width, loan, needs, histogram, parts)),
        }
    }
}

impl Paint {
    fn new(
        pixels: &[[u8; 3]],
        width: usize,
        loan: Option<Loan>,
        needs: &mut Needs,
        histogram: &mut Histogram,
        parts: &mut [Histogram],
    ) -> Self {
        let least = loan.as_ref().map_or(0.0, |loan| loan.least_error);
        let changed = needs.count(pixels, least, histogram, parts) as f64 / pixels.len() as f64;
        let area = Area::around(&needs.pixels, width, |need| matches!(need, Need::Draw | Need::Better));
        let bins = Sample::of_bins(histogram);
        let inked = match loan {
            // A viewer may see it for long, or see nothing else.
            None => Inked::new(histogram, &bins, 256),
            Some(_) => Inked::new(histogram, &bins, 255).of_fewer_colours(histogram, &bins),
        };
        let level_error = ink::mean_level_error(histogram, &inked.of_bins, &inked.palette);
        Self { loan, changed, area, inked: Box::new(inked), level_error }
    }
}

impl Inked {
    /// With at most so many colours.
    fn new(histogram: &Histogram, bins: &[Sample], size: usize) -> Self {
        let (palette, guesses) = Palette::of_bins(histogram, bins, size);
        let of_bins = Ink::of_bins(bins, &palette, &guesses);
        let error = ink::mean_error(histogram, &of_bins);
        Self { palette, of_bins, error }
    }

    /// Halves the palette as long as what it draws stays good enough; one index is left free.
    fn of_fewer_colours(mut self, histogram: &Histogram, bins: &[Sample]) -> Self {
        if bins.len() > MOST_BINS_HALVED {
            return self;
        }
        let bound = GOOD_ENOUGH + (BY_PIXELS / histogram.pixels() as f32).min(AT_MOST);
        // Half as many colours draw with twice the error or more.
        while self.error * 2.0 <= bound {
            let size = (self.palette.colours.len() + 1).next_power_of_two() / 2;
            if size < FEWEST {
                break;
            }
            let fewer = Self::new(histogram, bins, size - 1);
            if fewer.error > bound {
                break;
            }
            self = fewer;
        }
        self
    }
}

impl Waiting {
    /// Gives the block, and what was drawn anew.
    fn draw(&self, seen: &mut RgbImage) -> (Block, Vec<Redrawn>) {
        let (width, pixels) = (self.frame.width() as usize, self.frame.as_raw().as_chunks::<3>().0);
        let seen = seen.as_chunks_mut::<3>().0;
        match &self.plan {
            Plan::Exactly(colours) => {
                (exact::draw(pixels, width, self.first, seen, colours, self.delay_cs), Vec::new())
            }
            Plan::With(Paint { area: None, .. }) => (Block::nothing(self.delay_cs), Vec::new()),
            Plan::With(Paint { area: Some(area), inked, changed, .. }) => {
                let Inked { palette, of_bins, error } = &**inked;
                let clear = (!self.first).then_some(palette.colours.len() as u8);
                let (changed, error) = (*changed, *error);
                let inks = Inks { palette, of_bins, histogram: &self.histogram, clear, changed, error };
                draw(pixels, width, *area, &self.needs.pixels, seen, inks, self.delay_cs)
            }
        }
    }
}

fn draw(
    pixels: &[[u8; 3]],
    width: usize,
    area: Area,
    needs: &[Need],
    seen: &mut [[u8; 3]],
    inks: Inks<'_>,
    delay_cs: u16,
) -> (Block, Vec<Redrawn>) {
    let colours = &inks.palette.colours;
    let stripes = match inks.histogram.bins().len() {
        _ if inks.changed >= MOST => STRIPES_IF_MOST,
        0..MANY_COLOURS => 1,
        _ => 2,
    };
    let sheet = Sheet { area, width, colours, clear: inks.clear, delay_cs, stripes };
    stripe::in_stripes(sheet, seen, |writer, top, seen| {
        let mut stripe = Stripe::new(inks, writer);
        for (y, seen) in (top..).zip(seen.chunks_exact_mut(width)) {
            let part = y * width + area.left..y * width + area.right;
            let above = if y == 0 { part.clone() } else { part.start - width..part.end - width };
            stripe.draw(Row {
                pixels: &pixels[part.clone()],
                above: &pixels[above],
                needs: &needs[part],
                seen: &mut seen[area.left..area.right],
            });
        }
        stripe.redrawn()
    })
}
