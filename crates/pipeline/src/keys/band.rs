//! The rows of a frame that are one band: the second of five bands is `2-of-5`. The script
//! determines the frame's height.

use std::fmt;
use std::num::NonZeroU64;
use std::ops::Range;

/// One of the bands into which a frame is cut. Their heights differ by at most one row.
///
/// ```
/// use rayfold_pipeline::keys::Band;
/// let bands = Band::all(3.try_into()?);
/// let rows: Vec<_> = bands.map(|band| band.rows(100)).collect();
/// assert_eq!(rows, [0..33, 33..66, 66..100]);
/// # Ok::<(), std::num::TryFromIntError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Band {
    number: NonZeroU64,
    of: NonZeroU64,
}

impl Band {
    /// Returns the bands of a frame that is cut into `count`, from the top.
    pub fn all(count: NonZeroU64) -> impl Iterator<Item = Band> + Clone {
        (1..=count.get()).filter_map(NonZeroU64::new).map(move |number| Band { number, of: count })
    }

    /// Returns its number, counted from 1 at the top.
    pub fn number(self) -> NonZeroU64 {
        self.number
    }

    /// Returns the number of bands of the frame.
    pub fn of(self) -> NonZeroU64 {
        self.of
    }

    /// Returns its rows in a frame of `height` rows, counted from the top; none of them if there are
    /// more bands than rows.
    pub fn rows(self, height: u32) -> Range<u32> {
        let before = |bands: u64| {
            let rows = u128::from(bands) * u128::from(height) / u128::from(self.of.get());
            u32::try_from(rows).unwrap_or(height)
        };
        before(self.number.get() - 1)..before(self.number.get())
    }

    pub(super) fn parse(text: &str) -> Option<Self> {
        let (number, of) = text.split_once("-of-")?;
        let band = Band { number: number.parse().ok()?, of: of.parse().ok()? };
        // A number can be written in several ways.
        (band.number <= band.of && band.to_string() == text).then_some(band)
    }
}

impl fmt::Display for Band {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}-of-{}", self.number, self.of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_are_all_rows_once_and_alike_but_for_a_row() {
        for height in [1, 2, 7, 100, 4_001, u32::MAX] {
            for count in [1, 2, 3, 5, 64, 1_000] {
                let count = NonZeroU64::new(count).unwrap();
                let mut next = 0;
                for band in Band::all(count) {
                    let rows = band.rows(height);
                    assert_eq!(rows.start, next);
                    let high = u64::from(rows.end - rows.start);
                    assert!(high.abs_diff(u64::from(height) / count) <= 1, "{band} of {height}: {rows:?}");
                    next = rows.end;
                }
                assert_eq!(next, height);
            }
        }
    }

    #[test]
    fn a_band_is_written_in_one_way() {
        assert_eq!(Band::parse("2-of-5").unwrap().to_string(), "2-of-5");
        for text in ["0-of-5", "6-of-5", "02-of-5", "2-of-05", "2-of", "2", "-of-", "2-of-5-of-5"] {
            assert_eq!(Band::parse(text), None, "{text}");
        }
    }
}
