//! A script as lines, with its history. Every change is a splice of lines and has an inverse.
//!
//! Knows no file and no scene. A step may also hold the frame rate of the animation, which is not part of a line.
//! Invariant: undoing everything restores the original bytes.

use std::collections::VecDeque;

use crate::line::Line;

/// The size of the lines in the history in bytes. Beyond it the oldest steps are dropped.
const HISTORY_BYTES: usize = 64 << 20;

/// A replacement of some lines by others.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Splice {
    /// The index of the first line that changes, from 0.
    pub at: usize,
    /// The number of lines that are removed.
    pub removed: usize,
    /// The lines that are inserted in their place.
    pub inserted: Vec<Line>,
}

/// A script that is being edited.
#[derive(Clone, Debug, Default)]
pub struct Document {
    lines: Vec<Line>,
    done: VecDeque<Step>,
    undone: Vec<Step>,
    held: usize,
}

/// A step that one undo reverts: the inverses of some splices, in the order in which they were made.
#[derive(Clone, Debug)]
struct Step {
    gesture: Option<u64>,
    inverses: Vec<Splice>,
    /// The frame rate before the step, if the step changed it.
    fps: Option<f64>,
}

impl Splice {
    fn size(&self) -> usize {
        self.inserted.iter().map(|line| line.bytes().len() + size_of::<Line>()).sum::<usize>()
            + size_of::<Self>()
    }
}

impl Step {
    fn size(&self) -> usize {
        self.inverses.iter().map(Splice::size).sum()
    }
}

impl Document {
    /// Makes a document of a text, without a history.
    pub fn new(text: &[u8]) -> Self {
        Self { lines: Line::split(text), ..Self::default() }
    }

    /// Returns the lines of the document.
    pub fn lines(&self) -> &[Line] {
        &self.lines
    }

    /// Returns the text of the document.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(self.lines.iter().map(|line| line.bytes().len()).sum());
        self.lines.iter().for_each(|line| bytes.extend_from_slice(line.bytes()));
        bytes
    }

    /// Makes a change. It is a step of its own, or part of the previous step if that has the same gesture (a drag, a
    /// slider). Returns the change that was made: the splice is limited to the existing lines, and a last line
    /// without an end gets one before others follow it.
    pub fn apply(&mut self, splice: Splice, gesture: Option<u64>) -> Splice {
        let splice = self.fitted(splice);
        self.apply_exactly(splice, gesture)
    }

    /// Makes a change like [`Document::apply`], but takes the line ends as given.
    pub(crate) fn apply_exactly(&mut self, splice: Splice, gesture: Option<u64>) -> Splice {
        let inverse = self.splice(&splice);
        self.held -= self.undone.drain(..).map(|step| step.size()).sum::<usize>();
        match self.done.back_mut() {
            Some(step) if gesture.is_some() && step.gesture == gesture => {
                // Lines that a drag sets repeatedly are stored once, as they were at its start.
                let in_place = |splice: &Splice| splice.inserted.len() == splice.removed;
                let again = in_place(&inverse)
                    && step.inverses.iter().all(in_place)
                    && step.inverses.iter().any(|old| (old.at, old.removed) == (inverse.at, inverse.removed));
                if !again {
                    self.held += inverse.size();
                    step.inverses.push(inverse);
                }
            }
            _ => {
                self.held += inverse.size();
                self.done.push_back(Step { gesture, inverses: vec![inverse], fps: None });
            }
        }
        while self.held > HISTORY_BYTES && self.done.len() > 1 {
            self.held -= self.done.pop_front().map_or(0, |step| step.size());
        }
        splice
    }

    /// Makes a change exactly as given, including line ends, as a step of its own. Used for the content of a file.
    pub fn replace(&mut self, splice: Splice) -> Vec<Splice> {
        if splice.removed == 0 && splice.inserted.is_empty() {
            return Vec::new();
        }
        let inverse = self.splice(&splice);
        self.held = self.held + inverse.size() - self.undone.drain(..).map(|step| step.size()).sum::<usize>();
        self.done.push_back(Step { gesture: None, inverses: vec![inverse], fps: None });
        vec![splice]
    }

    /// Records a change of the animation's frame rate as a step of its own. `before` is the old frame rate.
    pub fn frame_rate_changed(&mut self, before: f64) {
        self.held -= self.undone.drain(..).map(|step| step.size()).sum::<usize>();
        self.done.push_back(Step { gesture: None, inverses: Vec::new(), fps: Some(before) });
    }

    /// Undoes the last step. Returns the splices in their order. If the step changed the frame rate, `fps` is
    /// exchanged with the old one.
    pub fn undo(&mut self, fps: &mut f64) -> Vec<Splice> {
        let Some(step) = self.done.pop_back() else { return Vec::new() };
        let (splices, inverse) = self.take_back(step, fps);
        self.undone.push(inverse);
        splices
    }

    /// Takes the last step back, if it has this gesture, and forgets it. Returns the splices in their order.
    pub fn give_up(&mut self, gesture: u64) -> Vec<Splice> {
        let Some(step) = self.done.pop_back_if(|step| step.gesture == Some(gesture)) else {
            return Vec::new();
        };
        self.held -= step.size();
        let splices: Vec<_> = step.inverses.into_iter().rev().collect();
        for splice in &splices {
            self.splice(splice);
        }
        splices
    }

    /// Redoes the step that was undone last, like [`Document::undo`].
    pub fn redo(&mut self, fps: &mut f64) -> Vec<Splice> {
        let Some(step) = self.undone.pop() else { return Vec::new() };
        let (splices, inverse) = self.take_back(step, fps);
        self.done.push_back(inverse);
        splices
    }

    /// Returns whether there is a step to undo.
    pub fn can_undo(&self) -> bool {
        !self.done.is_empty()
    }

    /// Returns whether there is a step to redo.
    pub fn can_redo(&self) -> bool {
        !self.undone.is_empty()
    }

    fn take_back(&mut self, step: Step, fps: &mut f64) -> (Vec<Splice>, Step) {
        self.held -= step.size();
        let splices: Vec<_> = step.inverses.into_iter().rev().collect();
        let inverses = splices.iter().map(|splice| self.splice(splice)).collect();
        let frame_rate_changed = step.fps.map(|before| std::mem::replace(fps, before));
        let inverse = Step { gesture: None, inverses, fps: frame_rate_changed };
        self.held += inverse.size();
        (splices, inverse)
    }

    fn fitted(&self, splice: Splice) -> Splice {
        let Splice { at, removed, mut inserted } = splice;
        let mut at = at.min(self.lines.len());
        let mut removed = removed.min(self.lines.len() - at);
        let end: &[u8] =
            if self.lines.first().is_some_and(|line| line.end() == b"\r\n") { b"\r\n" } else { b"\n" };
        // The end of the text stays unchanged.
        let endless = removed > 0
            && at + removed == self.lines.len()
            && self.lines.last().is_some_and(|line| line.end().is_empty());
        let count = inserted.len();
        for (i, line) in inserted.iter_mut().enumerate() {
            if line.end().is_empty() && !(endless && i + 1 == count) {
                *line = line.with_end(end);
            }
        }
        if at == self.lines.len() && !inserted.is_empty() && at > 0 && self.lines[at - 1].end().is_empty() {
            at -= 1;
            removed += 1;
            inserted.insert(0, self.lines[at].with_end(end));
        }
        Splice { at, removed, inserted }
    }

    /// Makes a change. Returns its inverse.
    fn splice(&mut self, splice: &Splice) -> Splice {
        let range = splice.at..splice.at + splice.removed;
        let removed = self.lines.splice(range, splice.inserted.iter().cloned()).collect();
        Splice { at: splice.at, removed: splice.inserted.len(), inserted: removed }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use proptest::test_runner::{Config, TestRunner};

    use super::*;

    fn set(at: usize, text: &str) -> Splice {
        Splice { at, removed: 1, inserted: vec![Line::new(text)] }
    }

    #[test]
    fn a_drag_is_one_step() {
        let mut document = Document::new(b"a\nb\n");
        for text in ["c", "d", "e"] {
            document.apply(set(1, text), Some(7));
        }
        document.apply(set(1, "f"), Some(8));
        assert_eq!(document.bytes(), b"a\nf\n");
        document.undo(&mut 10.0);
        assert_eq!(document.bytes(), b"a\ne\n");
        document.undo(&mut 10.0);
        assert_eq!(document.bytes(), b"a\nb\n");
        assert!(!document.can_undo());
        document.redo(&mut 10.0);
        assert_eq!(document.bytes(), b"a\ne\n");
    }

    #[test]
    fn a_drag_that_is_given_up_leaves_nothing() {
        let mut document = Document::new(b"a \r\nb");
        document.apply(set(1, "c"), Some(7));
        document.apply(set(0, "d"), Some(8));
        document.apply(set(1, "e"), Some(8));
        assert!(document.give_up(7).is_empty(), "only the last one can be given up");
        assert_eq!(document.give_up(8).len(), 2);
        assert_eq!(document.bytes(), b"a \r\nc");
        assert!(!document.can_redo() && document.give_up(8).is_empty());
        document.undo(&mut 10.0);
        assert_eq!((document.bytes(), document.can_undo()), (b"a \r\nb".to_vec(), false));
    }

    #[test]
    fn a_last_line_without_an_end_gets_one_only_when_lines_follow() {
        let mut document = Document::new(b"a\r\nb");
        document.apply(Splice { at: 9, removed: 0, inserted: vec![Line::new("c")] }, None);
        assert_eq!(document.bytes(), b"a\r\nb\r\nc\r\n");
        document.undo(&mut 10.0);
        assert_eq!(document.bytes(), b"a\r\nb");
    }

    #[test]
    fn lines_keep_their_own_ends() {
        let mut document = Document::new(b"a\r\nb\nc");
        let changed = document.lines()[1].with_text("d");
        document.apply(Splice { at: 1, removed: 1, inserted: vec![changed] }, None);
        document.apply(Splice { at: 2, removed: 1, inserted: vec![Line::new("e"), Line::new("f")] }, None);
        assert_eq!(document.bytes(), b"a\r\nd\ne\r\nf");
    }

    #[test]
    fn the_history_forgets_before_it_fills_the_memory() {
        let mut document = Document::new(b"a\n");
        let long = "x".repeat(HISTORY_BYTES / 4);
        for _ in 0..10 {
            document.apply(set(0, &long), None);
        }
        assert!(document.done.len() < 8 && document.held <= HISTORY_BYTES);
    }

    /// A text with all kinds of lines and line ends, and 10,000 random edits, undos and redos of it.
    #[test]
    fn ten_thousand_edits_and_undos_end_in_the_same_bytes() {
        let line = "[ -~\\t\u{e4}\u{20ac}]{0,12}(\n|\r\n)";
        let text = (prop::collection::vec(line, 0..20), "[a-z#]{0,5}")
            .prop_map(|(lines, last)| lines.concat() + &last);
        let edit = (
            0..30usize,
            0..4usize,
            prop::collection::vec("[a-z 0-9]{0,6}", 0..3),
            prop::option::of(0..3u64),
            0..5u8,
        );
        let mut runner = TestRunner::new(Config { cases: 20, ..Config::default() });
        let edits = prop::collection::vec(edit, 500);
        runner
            .run(&(text, edits), |(text, edits)| {
                let mut document = Document::new(text.as_bytes());
                let mut mirror: Vec<Line> = document.lines().to_vec();
                let mut follow = |splices: &[Splice]| {
                    for s in splices {
                        mirror.splice(s.at..s.at + s.removed, s.inserted.iter().cloned());
                    }
                    mirror.clone()
                };
                for (at, removed, inserted, gesture, what) in edits {
                    let splices = match what {
                        0 => document.undo(&mut 10.0),
                        1 => document.redo(&mut 10.0),
                        _ => {
                            let inserted = inserted.iter().map(|text| Line::new(text)).collect();
                            vec![document.apply(Splice { at, removed, inserted }, gesture)]
                        }
                    };
                    prop_assert_eq!(
                        &follow(&splices)[..],
                        document.lines(),
                        "the returned splices are those that were made"
                    );
                }
                let edited = document.bytes();
                let mut steps = 0;
                while document.can_undo() {
                    document.undo(&mut 10.0);
                    steps += 1;
                }
                prop_assert_eq!(document.bytes(), text.as_bytes());
                for _ in 0..steps {
                    document.redo(&mut 10.0);
                }
                prop_assert_eq!(document.bytes(), edited);
                Ok(())
            })
            .unwrap();
    }
}
