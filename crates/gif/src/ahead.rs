//! Looks ahead in a row of pixels for the string of indices that costs least.
//!
//! LZW writes a string that it knows as one code. Several indices may be good enough for a pixel, and the best of them can
//! lead to a string that soon ends. So the strings of the code table that fit the next pixels are searched, depth first. The
//! cost of a string is one code and the errors of its pixels, divided by their number.

use crate::lzw::Writer;
use crate::nearest::Nearest;

/// The largest number of indices that a pixel may have.
const MOST: usize = 10;
/// The cost of a code, in tolerances of a pixel.
const CODE: f32 = 4.0;
/// The number of strings that are tried for each string written. More take time, and make the file larger: strings that
/// are worse but longer teach the code table less.
const TRIED: usize = 8;
/// Pixels whose choices are kept; a power of two above `TRIED`.
const KEPT: usize = 16;

/// The indices that a pixel may have, best first, and their errors in parts of the tolerance.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Choices {
    /// The palette entry nearest to the pixel, if it is drawn.
    pub(crate) nearest: Option<Nearest>,
    count: usize,
    indices: [u8; MOST],
    errors: [f32; MOST],
}

impl Choices {
    /// Adds an index.
    pub(crate) fn add(&mut self, index: u8, error: f32) {
        if self.count < MOST {
            (self.indices[self.count], self.errors[self.count]) = (index, error);
            self.count += 1;
        }
    }
}

/// The string that is being written in a row.
#[derive(Debug, Default)]
pub(crate) struct Ahead {
    /// The choices of the pixels before column `known`, at their column modulo `KEPT`.
    choices: Vec<Choices>,
    known: usize,
    /// The indices that are not written yet, last first.
    planned: Vec<u8>,
}

impl Ahead {
    /// Starts a row.
    pub(crate) fn start_row(&mut self) {
        self.choices.resize(KEPT, Choices::default());
        self.known = 0;
        self.planned.clear();
    }

    /// Returns whether an index is planned for the next pixel.
    pub(crate) fn is_planned(&self) -> bool {
        !self.planned.is_empty()
    }

    /// Takes the index that is planned for the next pixel, which is in this column, and the palette entry nearest to it.
    pub(crate) fn take(&mut self, column: usize) -> Option<(u8, Option<Nearest>)> {
        self.planned.pop().map(|index| (index, self.choices[column % KEPT].nearest))
    }

    /// Drops the plan.
    pub(crate) fn drop_plan(&mut self) {
        self.planned.clear();
    }

    /// Plans the pixels from a column on: those that continue the writer's string, or else those of a new one. `end`: the
    /// column after the last. `choices` returns the choices of a column.
    pub(crate) fn plan(
        &mut self,
        writer: &Writer,
        column: usize,
        end: usize,
        choices: impl Fn(usize) -> Choices,
    ) {
        self.known = self.known.max(column);
        if writer.is_known() {
            self.search(writer, writer.string(), column, end, &choices);
        }
        if self.planned.is_empty() {
            self.search(writer, None, column, end, &choices);
        }
    }

    fn search(
        &mut self,
        writer: &Writer,
        string: Option<u16>,
        column: usize,
        end: usize,
        choices: &impl Fn(usize) -> Choices,
    ) {
        // Of the string of each length: its code, its error, and the number of choices tried to continue it.
        let (mut strings, mut errors, mut next) =
            ([string; TRIED + 1], [0.0_f32; TRIED + 1], [0_usize; TRIED + 1]);
        let (mut indices, mut best, mut best_length) = ([0; TRIED], [0; TRIED], 0);
        let (mut length, mut tried, mut least) = (0, 0, f32::INFINITY);
        while tried < TRIED {
            let at = column + length;
            if at == self.known && at < end {
                self.choices[at % KEPT] = choices(at);
                self.known += 1;
            }
            let of = &self.choices[at % KEPT];
            let count = if at < end { of.count } else { 0 };
            let found =
                (next[length]..count).find_map(|k| Some((k, writer.longer(strings[length], of.indices[k])?)));
            let Some((k, longer)) = found else {
                if length == 0 {
                    break;
                }
                length -= 1;
                continue;
            };
            next[length] = k + 1;
            indices[length] = of.indices[k];
            let error = errors[length] + of.errors[k];
            length += 1;
            tried += 1;
            (strings[length], errors[length], next[length]) = (Some(longer), error, 0);
            let cost = (CODE + error) / length as f32;
            if cost < least {
                (least, best, best_length) = (cost, indices, length);
            }
        }
        self.planned.extend(best[..best_length].iter().rev());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the plan after the indices 1, 2, 7 for pixels with these choices.
    fn planned(of: &[&[(u8, f32)]]) -> Vec<u8> {
        let mut writer = Writer::new(8);
        [1, 2, 7].iter().for_each(|&index| writer.put(index));
        let mut ahead = Ahead::default();
        ahead.start_row();
        ahead.plan(&writer, 0, of.len(), |column| {
            let mut choices = Choices::default();
            of[column].iter().for_each(|&(index, error)| choices.add(index, error));
            choices
        });
        (0..of.len()).map_while(|column| ahead.take(column)).map(|(index, _)| index).collect()
    }

    #[test]
    fn an_index_that_leads_to_a_longer_string_is_planned_in_place_of_the_best() {
        assert_eq!(planned(&[&[(5, 0.0), (1, 0.5)], &[(2, 0.0)], &[(3, 0.0)]]), [1, 2]);
        assert_eq!(planned(&[&[(5, 0.0), (3, 0.5)], &[(2, 0.0)]]), [5]);
    }

    #[test]
    fn a_string_ends_where_another_pixel_would_cost_more_than_it_saves() {
        assert_eq!(planned(&[&[(1, 0.0)], &[(2, 9.0)]]), [1]);
    }

    #[test]
    fn nothing_is_planned_for_a_pixel_without_choices() {
        assert!(planned(&[&[], &[(2, 0.0)]]).is_empty());
    }
}
