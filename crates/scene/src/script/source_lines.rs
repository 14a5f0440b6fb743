//! The lines of the text that the objects of a script come from.

use std::ops::Range;

/// The lines of items in their order, as runs of items on consecutive lines.
///
/// All source lines count as equal, because two texts with the same content in other lines are the same script.
#[derive(Clone, Debug, Default)]
pub(crate) struct SourceLines(Vec<Run>);

/// Items on consecutive lines.
#[derive(Clone, Copy, Debug)]
struct Run {
    /// The index of the first item.
    first: usize,
    /// The line of the first item, counted from 1; 0 if the items come from no text.
    line: usize,
}

impl Run {
    fn line_of(self, i: usize) -> usize {
        if self.line == 0 { 0 } else { self.line + (i - self.first) }
    }
}

impl SourceLines {
    /// Records the line of item `i`, which is the last so far.
    pub(crate) fn add(&mut self, i: usize, line: usize) {
        if self.0.last().is_none_or(|run| run.line_of(i) != line) {
            self.0.push(Run { first: i, line });
        }
    }

    /// Removes the lines of the items from `count` on.
    pub(crate) fn truncate(&mut self, count: usize) {
        self.0.truncate(self.0.partition_point(|run| run.first < count));
    }

    /// Returns the line of item `i`, counted from 1, or 0 if it comes from no text.
    pub(crate) fn line_of(&self, i: usize) -> usize {
        let run = self.0[..self.0.partition_point(|run| run.first <= i)].last();
        run.map_or(0, |run| run.line_of(i))
    }

    /// Returns the lines of some items, which are then numbered from 0.
    pub(crate) fn part(&self, items: Range<usize>) -> Self {
        let within = self.0.iter().filter(|run| (items.start + 1..items.end).contains(&run.first));
        let start = items.clone().next().map(|first| Run { first: 0, line: self.line_of(first) });
        let moved = within.map(|run| Run { first: run.first - items.start, ..*run });
        Self(start.into_iter().chain(moved).collect())
    }
}

impl PartialEq for SourceLines {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_on_consecutive_lines_are_one_run() {
        let given = [0, 0, 5, 6, 7, 7, 9, 10, 12];
        let mut lines = SourceLines::default();
        given.iter().enumerate().for_each(|(i, line)| lines.add(i, *line));
        assert_eq!(lines.0.len(), 5);
        let all =
            |lines: &SourceLines, count: usize| (0..count).map(|i| lines.line_of(i)).collect::<Vec<_>>();
        assert_eq!(all(&lines, given.len()), given);
        for start in 0..given.len() {
            for end in start..=given.len() {
                assert_eq!(all(&lines.part(start..end), end - start), given[start..end]);
            }
        }
        lines.truncate(4);
        lines.add(4, 20);
        assert_eq!(all(&lines, 5), [0, 0, 5, 6, 20]);
    }
}
