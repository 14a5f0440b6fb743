//! The numbers of a line, each constant or a curve, and the proof that they satisfy constraints.
//!
//! Knows forms, but neither the effect of the numbers nor their places in a text.

use std::fmt::{self, Formatter};
use std::sync::Arc;

use crate::command::MAX_NUMBERS;
use crate::curve::Curve;
use crate::form::{Constraint, Form, Presence, Values, write_number};
use crate::model::{PARALLEL, Tone};

/// A number of a line.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Number {
    Constant(f64),
    Animated(Box<Curve>),
    /// A channel of a colour that is written as `#rrggbb`. Such a colour is three of these.
    Level(u8),
}

/// The numbers of a line, shared by all users.
#[derive(Clone, Debug)]
pub(crate) struct Row(Arc<[Number]>);

/// The least and the greatest value of a number in an interval.
type Range = (f64, f64);

impl Row {
    pub(crate) fn new(numbers: Vec<Number>) -> Self {
        Self(numbers.into())
    }

    /// Returns the count of written numbers.
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns whether no number is a curve.
    pub(crate) fn is_constant(&self) -> bool {
        !self.0.iter().any(|number| matches!(number, Number::Animated(_)))
    }

    /// Returns whether the numbers depend on the tone of the picture.
    pub(crate) fn depends_on_tone(&self) -> bool {
        self.0.iter().any(|number| matches!(number, Number::Level(_)))
    }

    pub(crate) fn numbers(&self) -> &[Number] {
        &self.0
    }

    /// Returns the curves of the numbers.
    pub(crate) fn curves(&self) -> impl Iterator<Item = &Curve> {
        self.0.iter().filter_map(|number| match number {
            Number::Animated(curve) => Some(&**curve),
            Number::Constant(_) | Number::Level(_) => None,
        })
    }

    /// Returns the values at a time, for a picture of this tone; 0 for omitted ones.
    pub(crate) fn at(&self, frame: f64, tone: Tone) -> [f64; MAX_NUMBERS] {
        let mut values = [0.0; MAX_NUMBERS];
        for (value, number) in values.iter_mut().zip(self.0.iter()) {
            *value = number.at(frame, tone);
        }
        values
    }

    /// Returns a bound on the absolute value of number `i` at any time, or `None` if it was omitted.
    pub(crate) fn largest(&self, i: usize) -> Option<f64> {
        self.0.get(i).map(|number| match number {
            Number::Constant(value) => value.abs(),
            Number::Animated(curve) => curve.largest(),
            Number::Level(level) => Tone::Plain.light(*level),
        })
    }

    /// Returns whether the numbers provably satisfy all constraints of `form` in an interval. If not, they may
    /// satisfy them nevertheless. Adds the number of visited keys to `work`.
    pub(crate) fn provably_satisfies(&self, form: &Form, from: f64, to: f64, work: &mut usize) -> bool {
        let mut ranges = [(0.0, 0.0); MAX_NUMBERS];
        for (range, number) in ranges.iter_mut().zip(self.0.iter()) {
            *range = match number {
                Number::Constant(value) => (*value, *value),
                Number::Animated(curve) => curve.range(from, to, work),
                Number::Level(level) => {
                    let light = Tone::Plain.light(*level);
                    (light, light)
                }
            };
        }
        let field = |i: usize| &ranges[form.span(i)];
        let alone = (0..form.fields.len()).all(|i| {
            // An omitted number satisfies every constraint.
            form.span(i).start >= self.len() || keeps(form.fields[i].values, field(i))
        });
        alone && form.constraints.iter().all(|constraint| self.keeps_constraint(form, *constraint, &field))
    }

    fn keeps_constraint<'a>(
        &self,
        form: &Form,
        constraint: Constraint,
        field: &impl Fn(usize) -> &'a [Range],
    ) -> bool {
        let apart = |a: usize, b: usize| field(a).iter().zip(field(b)).map(|(a, b)| a.1 < b.0 || b.1 < a.0);
        match constraint {
            Constraint::Differ(a, b) => apart(a, b).any(|apart| apart),
            Constraint::DifferEverywhere(a, b) => apart(a, b).all(|apart| apart),
            Constraint::NotParallel(a, b) => provably_cross(field(a), field(b)),
            Constraint::LooksAside(from, to, up) => {
                let gaze = [0, 1, 2].map(|i| minus(half(field(to)[i]), half(field(from)[i])));
                let is_left_out =
                    form.span(up).start >= self.len() && form.fields[up].presence != Presence::Required;
                is_left_out || provably_cross(&gaze, field(up))
            }
            Constraint::Greater(a, b) => field(a)[0].0 > field(b)[0].1,
            Constraint::FitsTwice(a, u, v) => {
                let most = 2.0 * field(a)[0].1;
                let sides = field(u).iter().zip(field(v)).map(|(u, v)| (u.0 - v.1).max(v.0 - u.1));
                most == 0.0 || sides.into_iter().all(|side| most <= side)
            }
            Constraint::InOrder(a, b) => field(a)[0].1 <= field(b)[0].0,
        }
    }

    /// Writes the numbers as in a line, each after a space. Numbers that represent words are written as words.
    pub(crate) fn write(&self, f: &mut Formatter<'_>) -> fmt::Result {
        // The number of channels so far of a colour.
        let mut channels = 0;
        for number in self.0.iter() {
            match number {
                Number::Constant(value) => {
                    f.write_str(" ")?;
                    write_number(f, *value)?;
                }
                Number::Animated(curve) => write!(f, " {curve}")?,
                Number::Level(level) => {
                    f.write_str(if channels == 0 { " #" } else { "" })?;
                    write!(f, "{level:02x}")?;
                    channels = (channels + 1) % 3;
                }
            }
        }
        Ok(())
    }
}

impl Number {
    pub(crate) fn at(&self, frame: f64, tone: Tone) -> f64 {
        match self {
            Self::Constant(value) => *value,
            Self::Animated(curve) => curve.at(frame),
            Self::Level(level) => tone.light(*level),
        }
    }
}

impl PartialEq for Row {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0) || self.0 == other.0
    }
}

fn keeps(values: Values, ranges: &[Range]) -> bool {
    let finite = ranges.iter().all(|&(low, high)| low.is_finite() && high.is_finite());
    let excludes_zero = || ranges.iter().any(|&(low, high)| low > 0.0 || high < 0.0);
    finite
        && ranges.iter().all(|&(low, high)| values.take(low, high))
        && (values != Values::NotZero || excludes_zero())
}

fn half((low, high): Range) -> Range {
    (0.5 * low, 0.5 * high)
}

fn minus(a: Range, b: Range) -> Range {
    (a.0 - b.1, a.1 - b.0)
}

fn times(a: Range, b: Range) -> Range {
    let products = [a.0 * b.0, a.0 * b.1, a.1 * b.0, a.1 * b.1];
    (
        products.into_iter().fold(f64::INFINITY, f64::min),
        products.into_iter().fold(f64::NEG_INFINITY, f64::max),
    )
}

/// Returns whether two directions are far from parallel for all values in their ranges: by more than a thousand times
/// the tolerance for parallel, which exceeds all rounding errors here.
fn provably_cross(a: &[Range], b: &[Range]) -> bool {
    let largest =
        |v: &[Range]| v.iter().fold(0.0, |most: f64, (low, high)| most.max(low.abs()).max(high.abs()));
    let (size_a, size_b) = (largest(a), largest(b));
    // Products of other sizes may overflow or underflow.
    let sensible = |size: f64| (1e-100..1e100).contains(&size);
    if !sensible(size_a) || !sensible(size_b) {
        return false;
    }
    let margin = 1000.0 * PARALLEL * 3.0 * size_a * size_b;
    [(1, 2), (2, 0), (0, 1)].into_iter().any(|(i, j)| {
        let (low, high) = minus(times(a[i], b[j]), times(a[j], b[i]));
        low > margin || high < -margin
    })
}
