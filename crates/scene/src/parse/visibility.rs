//! Checks animated lines in the frames in which they are visible.
//!
//! A constraint on one number must hold from the first shutter opening that uses the line to the last closing; the
//! ends and keys of the curve decide that. Constraints on several numbers must hold at each frame's opening, middle
//! and closing. Whole ranges of frames are checked at once by the ranges of their numbers. If these do not prove a
//! constraint, the halves of the range are checked, and finally single frames. The work is counted over the whole
//! script ([`MAX_WORK`]), so that no number of frames takes longer than about a second.

use std::ops::Range;

use super::wording;
use crate::command::Command;
use crate::form::{Form, Numbers};
use crate::model::{Clause, Clauses, Coefficients, Faults, FrameNumbers, Material, Tone};
use crate::report::{Line, Report};
use crate::row::{Number, Row};

/// The largest number of keys that are visited, over all ranges of frames in a script.
const MAX_WORK: usize = 1 << 24;

/// The number of keys that count as much as reading a line.
const READING: usize = 32;

/// The frames and the shutter of one `Trace`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Exposure {
    pub(super) numbers: FrameNumbers,
    /// The open share of the shutter in a frame.
    pub(super) open: f64,
}

/// The time in which a line is visible.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct VisibleSpan {
    /// The time of the first opening; `to` is that of the last closing.
    pub(super) from: f64,
    pub(super) to: f64,
    /// The first and the last Trace that render it. Traces between them may not.
    traces: Range<usize>,
}

/// A line, or a part of it, with curves.
pub(super) struct Animated<'a> {
    pub(super) line: Line<'a>,
    /// The range of each of its numbers in the line.
    pub(super) spans: Vec<Range<usize>>,
    pub(super) row: Row,
    pub(super) origin: Origin,
    pub(super) visible_span: Option<VisibleSpan>,
}

/// The item to which the numbers belong.
#[derive(Clone, Copy, Debug)]
pub(super) enum Origin {
    Command(Command),
    Clause(Clause),
}

impl Exposure {
    fn opening(&self) -> f64 {
        f64::from(self.numbers.first) - 0.5 * self.open
    }

    fn closing(&self) -> f64 {
        f64::from(self.numbers.last) + 0.5 * self.open
    }
}

/// The last Traces of a script, extended step by step.
pub(super) struct Suffix<'e> {
    exposures: &'e [Exposure],
    start: usize,
    visible_span: Option<VisibleSpan>,
}

impl<'e> Suffix<'e> {
    /// Starts with no Traces.
    pub(super) fn of(exposures: &'e [Exposure]) -> Self {
        Self { exposures, start: exposures.len(), visible_span: None }
    }

    /// Returns the visible span of the Traces from number `start` on. `start` must not grow from call to call.
    pub(super) fn from(&mut self, start: usize) -> Option<&VisibleSpan> {
        for i in (start..self.start).rev() {
            let exposure = &self.exposures[i];
            let one = VisibleSpan { from: exposure.opening(), to: exposure.closing(), traces: i..i + 1 };
            join(&mut self.visible_span, Some(&one));
        }
        self.start = self.start.min(start);
        self.visible_span.as_ref()
    }
}

/// Extends a span to include another.
pub(super) fn join(visible_span: &mut Option<VisibleSpan>, also: Option<&VisibleSpan>) {
    match (visible_span.as_mut(), also) {
        (_, None) => {}
        (None, Some(also)) => *visible_span = Some(also.clone()),
        (Some(visible_span), Some(also)) => {
            visible_span.from = visible_span.from.min(also.from);
            visible_span.to = visible_span.to.max(also.to);
            let (start, end) = (
                visible_span.traces.start.min(also.traces.start),
                visible_span.traces.end.max(also.traces.end),
            );
            visible_span.traces = start..end;
        }
    }
}

impl Origin {
    fn form(self) -> &'static Form {
        match self {
            Self::Command(command) => command.form(),
            Self::Clause(clause) => clause.form(),
        }
    }

    /// Returns the errors in these numbers.
    fn faults(self, numbers: &mut Numbers<'_>) -> Option<Faults> {
        match self {
            Self::Clause(clause) => Clauses::default().add(clause, numbers, Coefficients::default()).err(),
            Self::Command(command) => command.faults(numbers),
        }
    }
}

/// Checks all lines with curves at the times at which they are visible.
pub(super) fn check(moving: &[Animated<'_>], exposures: &[Exposure], report: &mut Report<'_>) {
    let mut work = 0;
    for line in moving {
        if let Some(visible_span) = &line.visible_span
            && line.check_alone(visible_span, report)
            && !line.row.provably_satisfies(line.origin.form(), visible_span.from, visible_span.to, &mut 0)
        {
            line.check_together(&exposures[visible_span.traces.clone()], &mut work, report);
        }
    }
}

impl Animated<'_> {
    /// Checks the constraints on single numbers. Returns whether all hold.
    fn check_alone(&self, visible_span: &VisibleSpan, report: &mut Report<'_>) -> bool {
        let form = self.origin.form();
        let mut good = true;
        for (i, number) in self.row.numbers().iter().enumerate() {
            let Number::Animated(curve) = number else { continue };
            let (_, field) = form.number(i);
            let is_wrong = |value: f64| !field.values.take(value, value);
            let mut wrong = None;
            curve.moments(visible_span.from, visible_span.to, |moment| {
                if wrong.is_none() && is_wrong(moment.value) {
                    wrong = Some(moment);
                }
            });
            let Some(mut wrong) = wrong else { continue };
            // A whole frame is easier to understand than the moment before a cycle restarts.
            let frames = [wrong.frame.round(), wrong.frame.floor(), wrong.frame.ceil()];
            let whole = frames.into_iter().find(|frame| {
                (visible_span.from..=visible_span.to).contains(frame) && is_wrong(curve.at(*frame))
            });
            if let Some(frame) = whole {
                wrong.frame = frame;
                wrong.value = curve.at(frame);
            }
            good = false;
            report.error(self.line, self.spans[i].clone(), || {
                wording::wrong_at(field, wrong, visible_span.from, visible_span.to)
            });
        }
        good
    }

    /// Checks all constraints, frame by frame if no range proves them.
    fn check_together(&self, exposures: &[Exposure], work: &mut usize, report: &mut Report<'_>) {
        let form = self.origin.form();
        for exposure in exposures {
            let half = 0.5 * exposure.open;
            let mut ranges = vec![(exposure.numbers.first, exposure.numbers.last)];
            while let Some((first, last)) = ranges.pop() {
                *work += READING;
                if *work > MAX_WORK {
                    let span = self.spans[0].start..self.spans[self.spans.len() - 1].end;
                    report.error(self.line, span, wording::too_much_work);
                    return;
                }
                let (from, to) = (f64::from(first) - half, f64::from(last) + half);
                if self.row.provably_satisfies(form, from, to, work) {
                    continue;
                }
                if first < last {
                    let middle = first + (last - first) / 2;
                    ranges.extend([(middle + 1, last), (first, middle)]);
                } else if self.is_faulty_at(&[from, f64::from(first), to], report) {
                    return;
                }
            }
        }
    }

    /// Returns whether a constraint fails at one of some times. Reports the first.
    fn is_faulty_at(&self, frames: &[f64], report: &mut Report<'_>) -> bool {
        let form = self.origin.form();
        for &frame in frames {
            let mut values = self.row.at(frame, Tone::Plain);
            form.show(&mut values);
            let surface = Material::default();
            let mut numbers = Numbers::new(&values, self.row.len(), form.surface().map(|_| &surface));
            let Some(faults) = self.origin.faults(&mut numbers) else { continue };
            for fault in faults.0 {
                let place = form.place(|name, parameter| fault.is_about(parameter, name));
                let last = place.end.min(self.spans.len()) - 1;
                let span = self.spans[place.start.min(last)].start..self.spans[last].end;
                report.error(self.line, span, || wording::invalid_at(fault, frame));
            }
            return true;
        }
        false
    }
}
