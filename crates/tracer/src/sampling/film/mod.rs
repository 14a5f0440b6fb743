//! The samples of an image, summed pixel by pixel, and the choice of pixels that get more.
//!
//! Passes are synchronous. The next samples of a pixel depend on the counts and sums after the pass before, of the
//! pixel and of its neighbours. So a picture does not depend on tiles or threads, and a part of an animation that does
//! not move depends only on what is near it.
//!
//! Most pixels get one sample only. These samples are stored compactly ([`First`]), and pixels that need more are found
//! by comparing rows. All decisions about pixels are made for 64 at once ([`Bits`]). Only pixels that get more samples
//! have sums.

mod bits;
mod chain;
mod cover;
mod curve;
mod density;
mod first;
mod floors;
mod pixel;
mod plan;

use glam::DVec3;
use rayfold_scene::{Samples, Tone};

pub(crate) use self::bits::{BitRows, Bits};
use self::chain::SampleSchedule;
pub(crate) use self::cover::CoverTile;
use self::cover::{CoverRows, Layer};
pub(crate) use self::first::{First, FirstRows};
pub(crate) use self::floors::{Difference, Floors};
use self::pixel::ONE;
pub(crate) use self::pixel::{Pixel, quantised};
use self::plan::Plan;
pub(crate) use self::plan::{Judged, PassTargets, Work};
use crate::parallel::CHANNELS;

/// The number of rows above and below a band that influence it, in a picture with a requested error: the neighbours in
/// the first look, one more row for each decision about which pixels get more, the rows in which densities are counted,
/// and those that are near narrow objects.
pub(crate) const MARGIN: u32 = 1 + plan::MAX_ROUNDS + density::ROWS as u32 + BESIDE as u32;

/// In moving scenes, pixels within this distance of those whose first rays come near narrow objects count as near them
/// as well. Together, the pixels within this distance have first samples at all moments.
pub(crate) const BESIDE: usize = 3;

/// The least number of samples of each pixel if samples are not clamped. With fewer, no sample would see rare bright
/// light.
const FEWEST: u32 = 16;

/// The samples of an image or of a band of one. The first row is at the top.
#[derive(Debug)]
pub(crate) struct Film {
    size: (usize, usize),
    /// The columns and rows of a tile.
    side: (usize, usize),
    /// `None` if all pixels get the same number of samples.
    first: Option<First>,
    /// The sums, tile by tile, and row by row in each tile. If there is a [`First`], a tile whose pixels have one
    /// sample each has no sums.
    tiles: Vec<Vec<Pixel>>,
    /// The cover, in scenes without background.
    cover: Option<Layer>,
    plan: Plan,
    /// The pixels that the first look has found near narrow objects, if it records them.
    near: Option<Bits>,
}

/// A row of tiles.
pub(crate) struct Band<'a> {
    /// The sums of each tile, row by row. Empty for a tile that has no sums yet.
    pub(crate) tiles: &'a mut [Vec<Pixel>],
    /// The first samples, row by row.
    pub(crate) first: Option<FirstRows<'a>>,
    /// The cover, in scenes without background.
    pub(crate) cover: Option<CoverRows<'a>>,
    /// The state of the band's pixels, which is recorded when samples are added.
    pub(crate) judged: Judged<'a>,
    /// The pixels of the band that are near narrow objects.
    pub(crate) near: Option<BitRows<'a>>,
}

impl Film {
    /// Makes an empty film. No pass adds more than `step` samples to a pixel. Returns `None` if there is not enough
    /// memory.
    pub(crate) fn new(
        size: (u32, u32),
        side: (u32, u32),
        samples: Samples,
        tone: Tone,
        step: u32,
        (has_cover, is_unclamped): (bool, bool),
    ) -> Option<Self> {
        let size = (size.0 as usize, size.1 as usize);
        // No tile is larger than the image.
        let side = ((side.0 as usize).min(size.0), (side.1 as usize).min(size.1));
        let tiles = vec![Vec::new(); size.0.div_ceil(side.0).checked_mul(size.1.div_ceil(side.1))?];
        let pixels = size.0.checked_mul(size.1)?;
        let first = if samples.error() > 0.0 {
            Some(First::new(pixels)?)
        } else {
            // All will be asked for.
            Vec::<Pixel>::new().try_reserve_exact(pixels).ok()?;
            None
        };
        let mut plan = Plan::new(size, SampleSchedule::new(samples, tone, step, is_unclamped))?;
        if is_unclamped {
            plan.raise(FEWEST)?;
        }
        let cover = if has_cover {
            Some(Layer {
                first: first.as_ref().map_or(Some(None), |_| First::new(pixels).map(Some))?,
                tiles: tiles.clone(),
            })
        } else {
            None
        };
        Some(Self { size, side, first, tiles, cover, plan, near: None })
    }

    /// Sets a least number of samples for some pixels.
    pub(crate) fn raise(&mut self, floors: Floors) {
        self.plan.floors.add_all(floors);
    }

    /// Sets a least number of samples for all pixels, and takes them at all moments from the first sample on. Returns
    /// `None` if there is not enough memory.
    pub(crate) fn raise_all(&mut self, count: u32) -> Option<()> {
        self.plan.take_all_moments();
        self.plan.raise(count)
    }

    /// Returns the first samples of the film's pixels.
    pub(crate) fn into_first(self) -> Option<First> {
        self.first
    }

    /// Plans the next pass. Returns the least number of samples of its pixels before it and the largest after it, or
    /// `None` once no pixel needs more.
    pub(crate) fn plan(&mut self) -> Option<(u32, u32)> {
        let cover = self.cover.as_ref().and_then(|cover| cover.first.as_ref());
        self.plan.goes_on().or_else(|| self.plan.next(self.first.as_ref(), cover))
    }

    /// Restricts the pass that [`Self::plan`] planned to some pixels.
    pub(crate) fn want_only(&mut self, some: &Bits) {
        self.plan.want_only(some);
    }

    /// Makes the first look record which pixels are near narrow objects. Returns `None` if there is not enough memory.
    pub(crate) fn watch(&mut self) -> Option<()> {
        self.near = Some(Bits::none(self.size)?);
        Some(())
    }

    /// Takes the pixels that the first look recorded, and all within `beside` pixels of them. Returns `None` if they
    /// were taken before.
    pub(crate) fn near(&mut self, beside: usize) -> Option<Bits> {
        let mut near = self.near.take()?;
        (0..beside).for_each(|_| near.widen());
        Some(near)
    }

    /// Returns the work of the pass that [`Self::plan`] planned, and of those after it.
    pub(crate) fn work(&self) -> Work {
        self.plan.work()
    }

    /// Returns the rows of tiles, from the top, and the targets of the pass that [`Self::plan`] planned.
    pub(crate) fn split(&mut self) -> (Vec<Band<'_>>, PassTargets<'_>) {
        let (wanted, judged) = self.plan.split(self.side.1);
        let columns = self.size.0.div_ceil(self.side.0);
        let tiles = self.tiles.chunks_mut(columns).zip(judged);
        let mut bands: Vec<Band<'_>> = match &mut self.first {
            None => tiles
                .map(|(tiles, judged)| Band { tiles, first: None, cover: None, judged, near: None })
                .collect(),
            Some(first) => {
                let first = first.bands(self.size.0 * self.side.1).map(Some);
                let band = |((tiles, judged), first)| Band { tiles, first, cover: None, judged, near: None };
                tiles.zip(first).map(band).collect()
            }
        };
        if let Some(cover) = &mut self.cover {
            let rows = cover.rows(columns, self.size.0 * self.side.1);
            bands.iter_mut().zip(rows).for_each(|(band, rows)| band.cover = Some(rows));
        }
        if let Some(near) = &mut self.near {
            let rows = near.bands(self.side.1);
            bands.iter_mut().zip(rows).for_each(|(band, rows)| band.near = Some(rows));
        }
        (bands, wanted)
    }

    /// Returns whether the film has a cover.
    pub(crate) fn has_cover(&self) -> bool {
        self.cover.is_some()
    }

    /// The columns and rows of a tile.
    pub(crate) fn side(&self) -> (usize, usize) {
        self.side
    }

    /// Calls `each` with the current colours of a row, from the left.
    #[inline(always)]
    pub(crate) fn each_of_row(&self, row: usize, each: impl FnMut(Color)) {
        self.each_in_row((self.first.as_ref(), &self.tiles), row, Pixel::mean, each);
    }

    /// Calls `each` with the colours of a row as displayed, from the left, before the sRGB curve if there is one.
    #[inline(always)]
    pub(crate) fn each_shown_of_row(&self, row: usize, each: impl FnMut(Color)) {
        if self.first.is_some() && self.plan.shows_raised() {
            self.each_in_row((self.first.as_ref(), &self.tiles), row, Pixel::mean_before_curve, each);
        } else {
            self.each_of_row(row, each);
        }
    }

    /// Writes the current levels of a row, without any curve.
    #[inline(always)]
    pub(crate) fn put_levels(&self, row: usize, bytes: &mut [u8]) {
        let (columns, (across, down)) = (self.size.0, self.side);
        let (pixels, _) = bytes.as_chunks_mut::<CHANNELS>();
        let Some(first) = &self.first else {
            let mut pixels = pixels.iter_mut();
            return self.each_of_row(row, |color| {
                if let Some(pixel) = pixels.next() {
                    *pixel = color.levels();
                }
            });
        };
        first.put_levels(row * columns..(row + 1) * columns, pixels.as_flattened_mut());
        let first_tile = row / down * columns.div_ceil(across);
        self.plan.each_with_many(row, |column| {
            let sums = &self.tiles[first_tile + column / across];
            pixels[column] = Color::Mean(sums[row % down * across + column % across].mean()).levels();
        });
    }

    /// Calls `each` with the current covers of a row, from the left, in each channel of a colour. Makes no call if all
    /// is covered.
    pub(crate) fn each_cover_of_row(&self, row: usize, each: impl FnMut(Color)) {
        if let Some(Layer { first, tiles }) = &self.cover {
            self.each_in_row((first.as_ref(), tiles), row, Pixel::mean, each);
        }
    }

    #[inline(always)]
    fn each_in_row(
        &self,
        (first, tiles): (Option<&First>, &[Vec<Pixel>]),
        row: usize,
        mean: impl Fn(&Pixel) -> DVec3,
        mut each: impl FnMut(Color),
    ) {
        let (columns, (across, down)) = (self.size.0, self.side);
        let first_tile = row / down * columns.div_ceil(across);
        for (left, tile) in (0..columns).step_by(across).zip(&tiles[first_tile..]) {
            let right = (left + across).min(columns);
            let samples = first.map(|first| first.run(row * columns + left..row * columns + right));
            let sums = if tile.is_empty() { &[] } else { &tile[row % down * across..][..right - left] };
            match samples {
                None => sums.iter().for_each(|pixel| each(Color::Mean(mean(pixel)))),
                Some(samples) if sums.is_empty() => samples.for_each(|sample| each(Color::Sample(sample))),
                Some(samples) => {
                    for ((column, sample), pixel) in (left..).zip(samples).zip(sums) {
                        let has_many = self.plan.has_many(column, row);
                        each(if has_many { Color::Mean(mean(pixel)) } else { Color::Sample(sample) });
                    }
                }
            }
        }
    }

    /// Returns the means of the pixels as displayed, and the number of samples of each.
    #[cfg(any(test, feature = "accuracy"))]
    pub(crate) fn means(&self) -> impl Iterator<Item = (DVec3, u32)> {
        let ((width, height), (across, down)) = (self.size, self.side);
        (0..height).flat_map(move |row| {
            let mut of_row = Vec::with_capacity(width);
            self.each_shown_of_row(row, |color| {
                let column = of_row.len();
                let tile = row / down * width.div_ceil(across) + column / across;
                let count = match color {
                    Color::Sample(_) => 1,
                    Color::Mean(_) => self.tiles[tile][row % down * across + column % across].count(),
                };
                of_row.push((color.unit(), count));
            });
            of_row
        })
    }
}

/// A colour of a pixel.
pub(crate) enum Color {
    /// The colour of the only sample, [`quantised`].
    Sample([u16; CHANNELS]),
    /// The mean of several samples.
    Mean(DVec3),
}

impl Color {
    /// Returns the colour in 0..1.
    pub(crate) fn unit(&self) -> DVec3 {
        match self {
            Self::Sample(color) => DVec3::from_array(color.map(f64::from)) / ONE,
            Self::Mean(mean) => *mean,
        }
    }

    /// Returns the nearest of 256 levels, without any curve.
    #[inline(always)]
    pub(crate) fn levels(&self) -> [u8; CHANNELS] {
        match self {
            Self::Sample(color) => color.map(first::level),
            Self::Mean(mean) => mean.to_array().map(|channel| (255.0 * channel + 0.5) as u8),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::chain::{CALM, EVEN, MISSED, SLOPE, SPARED, VARYING};
    use super::density;
    use super::plan::{CONTRAST, MAX_ROUNDS};
    use super::*;
    use crate::reference::encoded;

    fn film(most: u32, error: f64, step: u32) -> Film {
        Film::new((8, 4), (3, 2), Samples::new(most, error).unwrap(), Tone::Plain, step, (false, false))
            .unwrap()
    }

    fn counts(film: &Film) -> Vec<u32> {
        film.means().map(|(_, count)| count).collect()
    }

    /// Gives all pixels the samples that they need.
    fn expose(film: &mut Film, mut color: impl FnMut(usize, u32) -> f64) -> Vec<(u32, u32)> {
        let mut passes = vec![];
        let (columns, side) = (film.size.0, film.side());
        while let Some(span) = film.plan() {
            passes.push(span);
            let (bands, wanted) = film.split();
            for (band, mut of_band) in bands.into_iter().enumerate() {
                for (tile, pixels) in of_band.tiles.iter_mut().enumerate() {
                    for place in 0..side.0 * side.1 {
                        let at = (tile * side.0 + place % side.0, place / side.0);
                        let (column, row) = (at.0, band * side.1 + at.1);
                        if column >= columns || row >= film_rows(wanted) || !wanted.pixels.has(column, row) {
                            continue;
                        }
                        let first = of_band.first.as_mut();
                        let mut draw = |sample| {
                            assert!((span.0..span.1).contains(&sample));
                            quantised(color(row * columns + column, sample))
                        };
                        if wanted.is_first_look {
                            first.unwrap().put(at.1 * columns + at.0, [draw(0); 3], 0);
                            continue;
                        }
                        pixels.resize(side.0 * side.1, Pixel::default());
                        let pixel = &mut pixels[place];
                        if let (0, Some(first)) = (pixel.count(), first) {
                            pixel.add_equal(first.color(at.1 * columns + at.0), 1);
                        }
                        for sample in pixel.count()..wanted.goal(pixel.count()) {
                            let level = [draw(sample)];
                            pixel.add([&level; 3]);
                        }
                        let verdict = wanted.verdict(pixel, (column, row));
                        of_band.judged.set(at.0, at.1, &verdict, None);
                    }
                }
            }
        }
        passes
    }

    fn film_rows(wanted: PassTargets<'_>) -> usize {
        wanted.pixels.rows()
    }

    #[test]
    fn without_an_error_all_get_all() {
        let mut film = film(100, 0.0, 64);
        assert_eq!(expose(&mut film, |_, _| 0.5), [(0, 64), (64, 100)]);
        assert_eq!(counts(&film), [100; 32]);
    }

    #[test]
    fn what_is_even_gets_one() {
        let mut film = film(64, 1.0, 1024);
        assert_eq!(expose(&mut film, |_, _| 0.5), [(0, 1)]);
        assert_eq!(counts(&film), [1; 32]);
    }

    #[test]
    fn rays_go_where_the_noise_is_and_fall_off_around_it() {
        for step in [3, 16, 1024] {
            let mut film = film(64, 1.0, step);
            let noise = |place: usize, sample: u32| match place % 8 {
                0 => f64::from(sobol_like(sample) % 2),
                _ => 0.5,
            };
            expose(&mut film, noise);
            assert_eq!(counts(&film)[..8], [64, 64, 8, 1, 1, 1, 1, 1]);
        }
    }

    fn sobol_like(sample: u32) -> u32 {
        sample.wrapping_mul(0x9e37_79b9) >> 7
    }

    /// A line that few first samples hit is found along its length.
    #[test]
    fn a_sliver_is_found_along_its_length() {
        let samples = Samples::new(64, 1.0).unwrap();
        let mut film = Film::new((64, 9), (16, 16), samples, Tone::Plain, 1024, (false, false)).unwrap();
        let mut dice = fastrand::Rng::with_seed(3);
        let mut seen = |place: usize, _| f64::from(u8::from(place / 64 == 4 && dice.f64() < 0.15));
        expose(&mut film, &mut seen);
        let counts = counts(&film);
        let row = &counts[4 * 64..5 * 64];
        assert!(row.iter().all(|&count| count >= 32), "{row:?}");
        assert!(counts[..64].iter().all(|&count| count < 32));
    }

    /// Pixels that are known to show a narrow object get their samples, even if no first sample shows it. Their own
    /// samples do not change the number.
    #[test]
    fn pixels_that_are_raised_get_what_they_are_raised_to() {
        for (floor, given) in [(16, 16), (100, 64), (1, 1)] {
            let mut film =
                Film::new((70, 9), (16, 16), Samples::new(64, 1.0).unwrap(), Tone::Plain, 10, (false, false))
                    .unwrap();
            let mut floors = Floors::new((70, 9), &[floor]).unwrap();
            floors.sets[0].1.put(66, 4);
            film.raise(floors);
            expose(&mut film, |_, _| 0.5);
            let counts = counts(&film);
            assert_eq!(counts[4 * 70 + 66], given);
            assert_eq!(counts[4 * 70 + 60], 1);
            assert!(
                counts
                    .iter()
                    .enumerate()
                    .all(|(place, &count)| count < given || place == 4 * 70 + 66 || given == 1)
            );
        }
    }

    #[test]
    fn pictures_are_told_apart_by_objects_and_by_colours() {
        let look = |objects: [u32; 4], colors: [u32; 4]| {
            let mut first = First::new(4).unwrap();
            let mut rows = first.bands(4).next().unwrap();
            (0..4).for_each(|k| rows.put(k, [colors[k]; 3], objects[k]));
            first
        };
        let mut floors = Floors::new((2, 2), &[8, 16]).unwrap();
        let (a, b) = (look([0, 1, 1, 1], [900; 4]), look([0, 1, 7, 1], [900, 910, 900, 920]));
        floors.add((&a, &b), None, |difference| Some(usize::from(difference == Difference::Color)));
        let of = |set: usize| [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(x, y)| floors.sets[set].1.has(x, y));
        assert_eq!((of(0), of(1)), ([false, false, true, false], [false, false, false, true]));
    }

    /// The code for words of bits is compared with the rule, written pixel by pixel.
    #[test]
    fn who_goes_on_is_as_the_rule_says() {
        for seed in 0..200 {
            let mut dice = fastrand::Rng::with_seed(seed);
            let size = (dice.u32(1..140), dice.u32(1..40));
            let side = (dice.u32(1..40), dice.u32(1..20));
            let (most, tone) = (dice.u32(2..70), [Tone::Plain, Tone::Srgb][dice.usize(..2)]);
            let samples = Samples::new(most, 1.0).unwrap();
            let mut film = Film::new(size, side, samples, tone, 256, (false, false)).unwrap();
            let width = size.0 as usize;
            let share = [5, 120, 230][dice.usize(..3)];
            let lively: Vec<f64> =
                (0..size.0 * size.1).map(|_| if dice.u8(..) < share { 0.4 } else { 0.0 }).collect();
            let drawn = |place: usize, sample: u32| {
                0.3 + lively[place] * f64::from(sobol_like(sample.wrapping_add(17 * place as u32)) % 5) / 5.0
            };
            expose(&mut film, drawn);
            let pixel = |place: usize, count: u32| {
                let mut pixel = Pixel::default();
                (0..count).for_each(|sample| pixel.add([&[quantised(drawn(place, sample))]; 3]));
                pixel
            };
            let around = |place: usize| {
                let (column, row) = ((place % width) as i64, (place / width) as i64);
                let near = (-1..=1).flat_map(move |dy| (-1..=1).map(move |dx| (column + dx, row + dy)));
                let inside = near.filter(move |&(x, y)| {
                    (0..i64::from(size.0)).contains(&x) && (0..i64::from(size.1)).contains(&y)
                });
                inside.map(move |(x, y)| y as usize * width + x as usize).filter(move |&other| other != place)
            };
            let shown = |place: usize| {
                let linear = f64::from(quantised(drawn(place, 0))) / ONE;
                if tone == Tone::Plain { linear } else { encoded(linear) }
            };
            let mut counts = vec![1; lively.len()];
            let mut unsettled: Vec<bool> = (0..lively.len())
                .map(|place| {
                    around(place).any(|other| (shown(other) - shown(place)).abs() > CONTRAST / 255.0)
                })
                .collect();
            // Of columns in parts of words, and of as many rows above and below.
            let share = |varying: &[bool], place: usize| {
                let (columns, beside) = (density::COLUMNS, density::ROWS);
                let (left, row) = (place % width / columns * columns, place / width);
                let rows = row.saturating_sub(beside)..(row + beside + 1).min(size.1 as usize);
                let around =
                    rows.flat_map(|row| (left..(left + columns).min(width)).map(move |x| row * width + x));
                let (varying, all) =
                    around.fold((0, 0), |(v, all), at| (v + u32::from(varying[at]), all + 1));
                usize::from(3 * varying >= all) * usize::from(varying > 0)
                    + usize::from(3 * varying >= 2 * all)
            };
            let mut density = vec![0; counts.len()];
            let (mut varying, mut variances) = (vec![false; counts.len()], vec![0.0; counts.len()]);
            let mut uneven = varying.clone();
            for round in 0..MAX_ROUNDS {
                if round == 1 {
                    density = (0..counts.len()).map(|place| share(&varying, place)).collect();
                }
                let next: Vec<u32> = (0..counts.len())
                    .map(|place| {
                        let is_given = [1, 4, 8][density[place]];
                        let gives = |other: usize| {
                            let many = if density[other] > 0 { 2 } else { 8 };
                            let waits = unsettled[other] && (uneven[place] || density[other] > 0);
                            let calm = CALM * f64::from(counts[place].max(4)).powf(MISSED);
                            (variances[other] > calm * calm || waits) && counts[other] >= counts[place]
                                || counts[other] > many * counts[place].max(2)
                        };
                        let waits = |(dx, dy): (i64, i64)| {
                            let at = ((place % width) as i64 + dx, (place / width) as i64 + dy);
                            let is_inside =
                                (0..width as i64).contains(&at.0) && (0..i64::from(size.1)).contains(&at.1);
                            let other = (at.1 * width as i64 + at.0) as usize;
                            is_inside && unsettled[other] && counts[other] >= counts[place]
                        };
                        let is_between = [(1, 0), (0, 1), (1, 1), (1, -1)]
                            .into_iter()
                            .any(|(dx, dy)| waits((dx, dy)) && waits((-dx, -dy)));
                        let goes_on = unsettled[place]
                            || counts[place] < is_given
                            || is_between
                            || around(place).any(gives);
                        match counts[place] {
                            count if !goes_on => count,
                            1 => 4.min(most),
                            count => (2 * count).min(most),
                        }
                    })
                    .collect();
                if next == counts {
                    break;
                }
                for place in 0..counts.len() {
                    if next[place] > counts[place] {
                        let count = next[place];
                        let limit = SPARED[density[place]] * f64::from(count).powf(-SLOPE);
                        let variance = pixel(place, count).variance(tone);
                        unsettled[place] = count < most && variance > limit * limit;
                        variances[place] = variance;
                        uneven[place] = count < most && variance > EVEN * EVEN;
                        let still = VARYING * f64::from(count).powf(-SLOPE);
                        varying[place] = count < most && variance > still * still;
                    }
                }
                counts = next;
            }
            assert_eq!(self::counts(&film), counts, "seed {seed}");
            for row in 0..size.1 as usize {
                let (mut levels, mut put) = (vec![], vec![0; CHANNELS * width]);
                film.each_of_row(row, |color| levels.extend(color.levels()));
                film.put_levels(row, &mut put);
                assert_eq!(put, levels, "seed {seed}, row {row}");
            }
        }
    }

    #[test]
    fn sums_are_means_and_deviations() {
        let mut pixel = Pixel::default();
        for k in 0..100 {
            pixel.add([f64::from(k % 2), 0.25, f64::NAN].map(quantised).each_ref().map(std::slice::from_ref));
        }
        assert!((pixel.mean() - DVec3::new(0.5, 0.25, 0.0)).abs().max_element() < 1e-5);
        // A channel that is 0 or 1 has the deviation 1/2; a third of the variance is that of the mean over channels.
        let expected = 255.0 * 255.0 * 0.25 * 100.0 / 99.0 / 3.0;
        let variance = pixel.variance(Tone::Plain);
        assert!((variance / expected - 1.0).abs() < 1e-3, "{variance}");
        let mut equal = Pixel::default();
        equal.add_equal([0.5, 2.0, -1.0].map(quantised), 7);
        assert_eq!(equal.variance(Tone::Srgb), 0.0);
        assert!((equal.mean() - DVec3::new(0.5, 1.0, 0.0)).abs().max_element() < 1e-5);
    }

    /// Pixels with an edge through them, and a sample in each quarter.
    #[test]
    fn few_samples_are_hardly_darker_than_many_under_the_curve() {
        const PIXELS: u32 = 20_000;
        for (dark, bright) in [(0.0, 0.8), (0.1, 0.9)] {
            let mut dice = fastrand::Rng::with_seed(5);
            let (mut plain, mut raised) = (0.0, 0.0);
            for _ in 0..PIXELS {
                let (angle, aside) = (dice.f64() * core::f64::consts::TAU, dice.f64() - 0.5);
                let color = |x: f64, y: f64| {
                    let is_bright = (x - 0.5) * angle.cos() + (y - 0.5) * angle.sin() > aside;
                    if is_bright { bright } else { dark }
                };
                let middles = (0..256)
                    .map(|k| color((f64::from(k % 16) + 0.5) / 16.0, (f64::from(k / 16) + 0.5) / 16.0));
                let exact = encoded(middles.sum::<f64>() / 256.0);
                let mut pixel = Pixel::default();
                for quarter in 0..4 {
                    let (x, y) = (f64::from(quarter % 2) + dice.f64(), f64::from(quarter / 2) + dice.f64());
                    pixel.add([&[quantised(color(0.5 * x, 0.5 * y))]; 3]);
                }
                plain += encoded(pixel.mean().x) - exact;
                raised += encoded(pixel.mean_before_curve().x) - exact;
            }
            let [plain, raised] = [plain, raised].map(|sum| 255.0 * sum / f64::from(PIXELS));
            println!("{dark} and {bright}: {plain:.3} and {raised:.3} levels");
            assert!(plain < -1.0 && raised.abs() < 0.6 * plain.abs(), "{dark} {bright}: {plain} {raised}");
        }
    }

    #[test]
    fn levels_are_the_nearest() {
        for channel in 0..=u16::MAX {
            let exact = f64::from(channel) / ONE * 255.0;
            for color in [Color::Sample([channel; 3]), Color::Mean(DVec3::splat(f64::from(channel) / ONE))] {
                assert_eq!(color.levels().map(f64::from), [exact.round(); 3]);
            }
        }
    }
}
