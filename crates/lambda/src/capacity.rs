//! The capacity of an invocation, and the number of bands for a frame that exceeds it.
//!
//! Time is measured: thin strips of the frame, spread over its height, are drawn until it is clear whether the whole
//! fits. Frames of few rays are drawn without measurement; if one of them takes too long, it is cut into bands. Memory
//! is computed from the number of pixels. This module knows no scene, only numbers.

use std::num::NonZeroU32;
use std::ops::Range;
use std::time::Duration;

/// A frame with at most this many camera rays is drawn without measurement: on the slowest machine most take seconds.
pub(crate) const FEW_RAYS: u64 = 1 << 24;

/// The rows of a strip, which are the rows of a tile of most pictures.
pub(crate) const STRIP: u32 = 16;

/// The largest number of strips that are drawn to measure a frame.
const MAX_STRIPS: u32 = 16;

/// A frame is drawn in one piece if that is estimated to take at most this share of the remaining time. Estimates
/// from a few strips were off by a factor of up to 1.7 (docs/decisions/frames-in-bands.md).
const WHOLE_SHARE: f64 = 0.5;

/// The share for a band: its rows may be the most expensive ones, and its processor a slower one.
const BAND_SHARE: f64 = 0.4;

/// No more strips are drawn if the frame would fit even if all rows cost this many times the most expensive strip.
const SURELY: f64 = 8.0;

/// A drawing that was expected to fit is stopped after this share of the time, so that there is time to cut it.
pub(crate) const STOP_SHARE: f64 = 0.8;

/// The share of the function's memory that pixels may take. The rest is for the script, the prepared
/// scene, and the program.
const PIXELS_SHARE: f64 = 0.5;

/// The bytes per pixel of the image and of its PNG. The PNG may be as large as the image, and is
/// copied when it grows.
const IMAGE_BYTES: u64 = 9;

/// The default maximum number of bands of a frame. Each band is an invocation that is billed.
pub const MAX_BANDS: NonZeroU32 = NonZeroU32::new(64).expect("64 is not zero");

/// The resources of an invocation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Capacity {
    /// The function's memory in bytes, if it is known.
    pub memory: Option<u64>,
    /// The maximum number of bands of a frame. With 1, no frame is cut.
    pub most_bands: NonZeroU32,
}

impl Default for Capacity {
    fn default() -> Self {
        Self { memory: None, most_bands: MAX_BANDS }
    }
}

/// The quantities of a frame that depend on its size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Extent {
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// The bytes per pixel while it is drawn, besides the image.
    pub(crate) pixel_bytes: u64,
    /// The rows above and below a band that are drawn with it.
    pub(crate) margin: u32,
}

impl Extent {
    /// Returns the memory for drawing this many rows and for their file.
    fn bytes(&self, rows: u32) -> u64 {
        let width = u64::from(self.width);
        let drawn = u64::from(rows.saturating_add(self.margin.saturating_mul(2)).min(self.height));
        let drawing = drawn.saturating_mul(self.pixel_bytes);
        width.saturating_mul(drawing.saturating_add(u64::from(rows).saturating_mul(IMAGE_BYTES)))
    }

    /// Returns the memory for joining the frame: its file, and one band.
    fn bytes_joined(&self, bands: u32) -> u64 {
        let rows = u64::from(self.height) + u64::from(self.height.div_ceil(bands));
        u64::from(self.width).saturating_mul(rows).saturating_mul(IMAGE_BYTES - 3)
    }
}

/// The measurements of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Measured {
    /// The time before the first pixel: reading the script, preparing the scene. Each band takes this time, too.
    pub(crate) before: Duration,
    /// The mean time of a row, in seconds.
    pub(crate) row: f64,
    /// The time of a row of the most expensive strip, in seconds.
    pub(crate) dearest_row: f64,
}

/// The decision about a frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Verdict {
    /// The frame fits into an invocation.
    Whole,
    /// The frame is drawn in this many bands.
    Bands(NonZeroU32),
    /// The frame fits in no allowed number of bands. The text says what it takes, and what there is.
    TooBig(String),
}

impl Capacity {
    /// Returns whether frames may be cut.
    pub(crate) fn cuts(&self) -> bool {
        self.most_bands.get() > 1
    }

    /// Returns the least number of bands that memory allows.
    ///
    /// # Errors
    /// Returns what the frame would take and what there is, if no number of bands suffices.
    fn bands_by_memory(&self, extent: &Extent) -> Result<NonZeroU32, String> {
        let Some(memory) = self.memory else { return Ok(NonZeroU32::MIN) };
        let room = (memory as f64 * PIXELS_SHARE) as u64;
        if extent.bytes(extent.height) <= room {
            return Ok(NonZeroU32::MIN);
        }
        let fits = |bands: u32| {
            extent.bytes(extent.height.div_ceil(bands)) <= room && extent.bytes_joined(bands) <= room
        };
        let most = self.most_bands.get().min(extent.height);
        let found = (2..=most).find(|&bands| fits(bands)).and_then(NonZeroU32::new);
        found.ok_or_else(|| {
            let least = extent.bytes(extent.height.div_ceil(most)).max(extent.bytes_joined(most));
            format!(
                "{} x {} pixels take {} MB of memory, in {most} bands {} MB each, and the render function has {} MB \
                 for pixels: give it more memory, or draw fewer pixels",
                extent.width,
                extent.height,
                megabytes(extent.bytes(extent.height)),
                megabytes(least),
                room >> 20,
            )
        })
    }

    /// Decides about a frame whose time is unknown or short.
    pub(crate) fn judge_memory(&self, extent: &Extent) -> Verdict {
        match self.bands_by_memory(extent) {
            Ok(bands) if bands.get() == 1 => Verdict::Whole,
            Ok(bands) => Verdict::Bands(bands),
            Err(why) => Verdict::TooBig(why),
        }
    }

    /// Decides about a frame that was measured, in an invocation with the time `left`. The invocations for
    /// bands have as much.
    pub(crate) fn judge(&self, extent: &Extent, measured: &Measured, left: Duration) -> Verdict {
        let by_memory = match self.bands_by_memory(extent) {
            Ok(bands) => bands,
            Err(why) => return Verdict::TooBig(why),
        };
        let (height, left, before) =
            (f64::from(extent.height), left.as_secs_f64(), measured.before.as_secs_f64());
        let whole = before + height * measured.row;
        if whole <= WHOLE_SHARE * left {
            return self.judge_memory(extent);
        }
        let most = self.most_bands.get().min(extent.height);
        let margin = 2.0 * f64::from(extent.margin);
        let band = |bands: f64| before + (height / bands + margin).min(height) * measured.dearest_row;
        // The part of a band's share that remains for its own rows.
        let own = BAND_SHARE * left - before - margin * measured.dearest_row;
        let wanted = if own > 0.0 { (height * measured.dearest_row / own).ceil() } else { f64::INFINITY };
        // Estimates are not exact: a band that may fit is tried, even if it takes more than its share.
        if most < 2 || wanted > f64::from(most) && band(f64::from(most)) > left {
            let share = if most < 2 {
                String::new()
            } else {
                format!(", each of {most} bands {:.0} s", band(f64::from(most)))
            };
            return Verdict::TooBig(format!(
                "drawing it takes about {whole:.0} s{share}, and the render function has {left:.0} s: give it more time \
                 or memory (more memory is more processor), or draw fewer samples or pixels"
            ));
        }
        let wanted = wanted.clamp(2.0, f64::from(most)) as u32;
        Verdict::Bands(by_memory.max(NonZeroU32::new(wanted).unwrap_or(by_memory)))
    }

    /// Returns whether no more strips need be drawn: the frame would fit even if every row cost [`SURELY`] times
    /// the most expensive one.
    pub(crate) fn is_sure(&self, extent: &Extent, measured: &Measured, left: Duration) -> bool {
        let most = measured.before.as_secs_f64() + SURELY * f64::from(extent.height) * measured.dearest_row;
        most <= WHOLE_SHARE * left.as_secs_f64()
    }
}

/// Converts to megabytes, rounded up, so that a size above the limit does not look equal to it.
fn megabytes(bytes: u64) -> u64 {
    bytes.div_ceil(1 << 20)
}

/// Returns the strips of a frame in the order in which they are drawn. After any number of them, the places measured
/// are spread over the frame. Together they are at most a sixteenth of a high frame.
pub(crate) fn strips(height: u32) -> impl Iterator<Item = Range<u32>> {
    let rows_of_strips = height.div_ceil(STRIP);
    let count = (rows_of_strips / MAX_STRIPS).clamp(1, MAX_STRIPS);
    let bits = count.next_power_of_two().trailing_zeros();
    let order = (0..count.next_power_of_two())
        .map(move |k| if bits == 0 { 0 } else { k.reverse_bits() >> (u32::BITS - bits) });
    order.filter(move |&place| place < count).map(move |place| {
        let middle = (u64::from(rows_of_strips) * (2 * u64::from(place) + 1) / (2 * u64::from(count))) as u32;
        let start = middle.min(rows_of_strips - 1) * STRIP;
        start..start.saturating_add(STRIP).min(height)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn extent(width: u32, height: u32, pixel_bytes: u64, margin: u32) -> Extent {
        Extent { width, height, pixel_bytes, margin }
    }

    fn measured(before: u64, row: f64, dearest_row: f64) -> Measured {
        Measured { before: Duration::from_secs(before), row, dearest_row }
    }

    fn capacity(memory_mb: u64, most_bands: u32) -> Capacity {
        Capacity { memory: Some(memory_mb << 20), most_bands: NonZeroU32::new(most_bands).unwrap() }
    }

    const MINUTES: Duration = Duration::from_secs(300);

    #[test]
    fn what_fits_is_drawn_in_one_piece() {
        let frame = extent(1000, 1000, 0, 0);
        assert_eq!(capacity(1769, 64).judge(&frame, &measured(1, 0.149, 0.3), MINUTES), Verdict::Whole);
        assert_eq!(capacity(1769, 64).judge_memory(&frame), Verdict::Whole);
        assert_eq!(Capacity::default().judge_memory(&extent(u32::MAX, u32::MAX, 64, 9)), Verdict::Whole);
    }

    /// Each band, its margin included, takes at most its share of the time, according to the measurements.
    #[test]
    fn bands_of_a_frame_that_takes_long_take_their_share() {
        let mut dice = fastrand::Rng::with_seed(5);
        let (mut cut, mut too_big) = (0, 0);
        for _ in 0..5_000 {
            let frame = extent(100, dice.u32(100..20_000), 0, [0, 65][dice.usize(0..2)]);
            let row = 10_f64.powf(dice.f64() * 6.0 - 4.0);
            let known = measured(dice.u64(0..60), row, row * (1.0 + 3.0 * dice.f64()));
            let whole = known.before.as_secs_f64() + f64::from(frame.height) * row;
            let band = |bands: u32| {
                let rows = (frame.height.div_ceil(bands) + 2 * frame.margin).min(frame.height);
                known.before.as_secs_f64() + f64::from(rows) * known.dearest_row
            };
            match capacity(3008, 64).judge(&frame, &known, MINUTES) {
                Verdict::Whole => assert!(whole <= 150.0),
                Verdict::Bands(bands) => {
                    cut += 1;
                    let rounding = known.dearest_row * 1.01;
                    assert!(whole > 150.0 && (2..=64).contains(&bands.get()));
                    assert!(
                        band(bands.get()) <= 120.0 + rounding || bands.get() == 64,
                        "{frame:?} {known:?}"
                    );
                }
                Verdict::TooBig(_) => {
                    too_big += 1;
                    assert!(band(64) >= 300.0, "{frame:?} {known:?}");
                }
            }
        }
        assert!(cut > 500 && too_big > 100, "{cut} {too_big}");
    }

    #[test]
    fn bands_of_a_frame_of_many_pixels_fit_into_the_memory() {
        let frame = extent(8000, 8000, 64, 65);
        let Verdict::Bands(bands) = capacity(1769, 64).judge_memory(&frame) else { panic!() };
        let room = (1769 << 20) / 2;
        assert!(frame.bytes(8000 / bands.get() + 1) <= room && frame.bytes(8000 / (bands.get() - 1)) > room);
        // A short time does not make fewer of them.
        let known = measured(0, 0.02, 0.02);
        assert_eq!(capacity(1769, 64).judge(&frame, &known, MINUTES), Verdict::Bands(bands));
        // Half of this memory cannot hold a file of all pixels.
        let Verdict::TooBig(why) = capacity(256, 64).judge_memory(&frame) else { panic!() };
        assert!(why.starts_with("8000 x 8000 pixels take 4456 MB of memory, in 64 bands"), "{why}");
        assert!(why.contains("the render function has 128 MB"), "{why}");
    }

    #[test]
    fn what_fits_in_no_number_of_bands_says_how_much_it_takes() {
        let known = measured(2, 10.0, 20.0);
        let judge = |most| capacity(3008, most).judge(&extent(10, 1000, 0, 0), &known, MINUTES);
        let Verdict::TooBig(why) = judge(64) else { panic!() };
        let expected =
            "drawing it takes about 10002 s, each of 64 bands 314 s, and the render function has 300 s";
        assert!(why.starts_with(expected), "{why}");
        // Bands that take more than their share, but may fit, are tried.
        assert_eq!(judge(100), Verdict::Bands(NonZeroU32::new(100).unwrap()));
        let Verdict::TooBig(why) = judge(1) else { panic!() };
        assert!(why.starts_with("drawing it takes about 10002 s, and"), "{why}");
        // A frame has no more bands than rows.
        let flat = capacity(3008, 64).judge(&extent(10, 3, 0, 0), &measured(0, 60.0, 60.0), MINUTES);
        assert_eq!(flat, Verdict::Bands(NonZeroU32::new(2).unwrap()));
    }

    #[test]
    fn strips_lie_all_over_the_frame_and_are_few() {
        for height in [1, 15, 16, 17, 300, 1080, 4_321, 8_000, 100_000] {
            let strips: Vec<_> = strips(height).collect();
            assert!(!strips.is_empty() && strips.len() <= 16);
            assert!(
                strips
                    .iter()
                    .all(|rows| rows.start % STRIP == 0 && rows.start < rows.end && rows.end <= height)
            );
            let rows: u32 = strips.iter().map(|rows| rows.end - rows.start).sum();
            assert!(strips.len() == 1 || rows <= height / 16 + STRIP, "{rows} of {height}");
            let mut sorted = strips.clone();
            sorted.sort_by_key(|rows| rows.start);
            sorted.dedup();
            assert_eq!(sorted.len(), strips.len());
            // The first two are about half of the frame apart.
            if let [first, second, ..] = &strips[..] {
                assert!(first.start.abs_diff(second.start) > height / 4, "{strips:?}");
            }
        }
    }

    #[test]
    fn it_is_sure_early_where_there_is_plenty() {
        let frame = extent(1000, 4000, 0, 0);
        let capacity = Capacity::default();
        assert!(capacity.is_sure(&frame, &measured(1, 0.001, 0.001), MINUTES));
        assert!(!capacity.is_sure(&frame, &measured(1, 0.01, 0.01), MINUTES));
    }
}
