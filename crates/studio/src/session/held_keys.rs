//! Keys of the timeline while they are dragged.

use crate::document::Splice;
use crate::edits;
use crate::line::Line;
use crate::tracks::{self, KeyPlace};

/// The keys that are being dragged, with the original lines.
#[derive(Debug)]
pub(super) struct HeldKeys {
    numbers: Vec<usize>,
    lines: Vec<Line>,
    /// The keys. Their lines are indices of `lines`.
    keys: Vec<KeyPlace>,
    pub(super) gesture: u64,
}

impl HeldKeys {
    pub(super) fn new(lines: &[Line], keys: &[KeyPlace], gesture: u64) -> Self {
        let mut numbers: Vec<_> = keys.iter().map(|key| key.line).filter(|&at| at < lines.len()).collect();
        numbers.sort_unstable();
        numbers.dedup();
        let place = |key: &KeyPlace| Some(KeyPlace { line: numbers.binary_search(&key.line).ok()?, ..*key });
        let keys = keys.iter().filter_map(place).collect();
        let lines = numbers.iter().map(|&at| lines[at].clone()).collect();
        Self { numbers, lines, keys, gesture }
    }

    /// Returns the changes of the lines if the keys are moved by this many frames and by this value.
    pub(super) fn moved(&self, by: f64, value: f64) -> Vec<Splice> {
        let mut lines = self.lines.clone();
        for (at, line) in tracks::moved(&self.lines, &self.keys, by, value) {
            lines[at] = line;
        }
        self.numbers.iter().zip(lines).map(|(&at, line)| edits::set(at, line)).collect()
    }
}
