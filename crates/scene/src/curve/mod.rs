//! Curves: numbers that change over the frames, by interpolation between keys.
//!
//! Times are frame numbers and may be fractional. Everything is computed in 64-bit floats in the order of
//! `docs/language.md`, with no function whose last bit differs between machines. This module knows no text except the
//! written form of a curve.
//!
//! Invariants: there is at least one key, and two for a cycle. Their frames are finite and strictly increasing. No
//! value overflows at any time.

mod mode;

use std::fmt::{self, Display, Formatter};

pub use mode::Mode;

use crate::form::write_number;

/// A number that changes over time.
///
/// ```
/// let curve = rayfold_scene::parse_curve("(smooth 1:0 25:3)").unwrap();
/// assert_eq!(curve.at(13.0), 1.5);
/// assert_eq!(curve.with_key(13.0, 2.0).unwrap().to_string(), "(smooth 1:0 13:2 25:3)");
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    mode: Mode,
    cycle: bool,
    keys: Vec<Key>,
    largest: f64,
}

/// A key of a curve: its value at a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key {
    /// The frame; may be fractional.
    pub frame: f64,
    /// The value at that frame.
    pub value: f64,
}

/// The word that makes a curve restart after its last key.
pub(crate) const CYCLE: &str = "cycle";

/// The error that a curve overflows after the key with this index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Overflow(pub(crate) usize);

/// A value at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Moment {
    pub(crate) frame: f64,
    pub(crate) value: f64,
}

/// A time between two keys is short if it is below this share of an exposure: then a few moments of the exposure can
/// miss it. An exposure takes at most a frame.
pub(crate) const QUICK: f64 = 0.125;

/// The distance by which computed values may lie outside of the values at the ends of an interval without
/// keys, relative to the largest value. A cubic's terms are at most 23 times its ends, and there are
/// less than 16 roundings.
const SLACK: f64 = 1.0 / (1u64 << 43) as f64;

impl Curve {
    /// Makes a curve through keys. Returns `None` for no key, or one key of a cycle; for frames or values that are
    /// not finite; for frames that are not strictly increasing; and if a value between keys overflows.
    pub fn through(mode: Mode, cycle: bool, keys: Vec<Key>) -> Option<Self> {
        let is_finite = keys.iter().all(|key| key.frame.is_finite() && key.value.is_finite());
        let is_in_order = keys.windows(2).all(|pair| pair[0].frame < pair[1].frame);
        let is_enough = keys.len() > usize::from(cycle);
        if is_finite && is_in_order && is_enough { Self::new(mode, cycle, keys).ok() } else { None }
    }

    /// Returns the interpolation between two keys.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Returns whether the curve restarts at its last key.
    pub fn is_cycle(&self) -> bool {
        self.cycle
    }

    /// Returns the keys, at least one, with strictly increasing frames.
    pub fn keys(&self) -> &[Key] {
        &self.keys
    }

    /// Returns the key exactly at a time, if there is one. For a cycle, the time is reduced to the first cycle, and
    /// at the end of a cycle the first key counts.
    pub fn key_at(&self, frame: f64) -> Option<Key> {
        let frame = if self.cycle { self.within_cycle(frame) } else { frame };
        self.keys.iter().find(|key| key.frame == frame).copied()
    }

    /// Returns the curve with a key at a time, in place of an existing one. For a cycle, the time is reduced to the
    /// first cycle. Returns `None` if a value would overflow.
    pub fn with_key(&self, frame: f64, value: f64) -> Option<Self> {
        let frame = if self.cycle { self.within_cycle(frame) } else { frame };
        let mut keys = self.keys.clone();
        let at = keys.partition_point(|key| key.frame < frame);
        match keys.get_mut(at) {
            Some(key) if key.frame == frame => key.value = value,
            _ => keys.insert(at, Key { frame, value }),
        }
        Self::through(self.mode, self.cycle, keys)
    }

    /// Makes a curve. `keys` are at least one, or two for a cycle, with finite and strictly increasing frames.
    ///
    /// # Errors
    /// Returns the index of the first key after which a value overflows.
    pub(crate) fn new(mode: Mode, cycle: bool, keys: Vec<Key>) -> Result<Self, Overflow> {
        debug_assert!(
            keys.len() > usize::from(cycle) && keys.windows(2).all(|pair| pair[0].frame < pair[1].frame)
        );
        let largest = keys.iter().fold(0.0, |largest: f64, key| largest.max(key.value.abs()));
        let mut curve = Self { mode, cycle, keys, largest };
        let turns = mode.turns();
        for i in 0..curve.keys.len() - 1 {
            if !curve.is_bounded(i) {
                return Err(Overflow(i));
            }
            for &turn in &turns {
                let value = curve.eased(i, turn).abs();
                if !value.is_finite() {
                    return Err(Overflow(i));
                }
                curve.largest = curve.largest.max(value);
            }
        }
        if cycle && !curve.period().is_finite() { Err(Overflow(0)) } else { Ok(curve) }
    }

    /// Returns the value at a time.
    pub fn at(&self, frame: f64) -> f64 {
        let (first, last) = (self.keys[0], self.keys[self.keys.len() - 1]);
        let frame = if self.cycle { self.within_cycle(frame) } else { frame };
        if frame <= first.frame {
            first.value
        } else if frame >= last.frame {
            if self.cycle { first.value } else { last.value }
        } else {
            self.between(self.keys.partition_point(|key| key.frame <= frame) - 1, frame)
        }
    }

    /// Visits the moments of an interval that determine the range of its values, in order: its ends, the keys
    /// between, the maxima and minima between keys, and the moments just before a jump. Of many cycles, only one is
    /// visited.
    pub(crate) fn moments(&self, from: f64, to: f64, mut seen: impl FnMut(Moment)) {
        seen(Moment { frame: from, value: self.at(from) });
        let turns = self.mode.turns();
        if self.cycle {
            let start = self.within_cycle(from);
            let period = self.period();
            let to = to.min(from + period);
            for shift in [from - start, from - start + period] {
                for i in 0..self.keys.len() - 1 {
                    self.stretch(i, &turns, shift, (from, to), &mut seen);
                }
            }
        } else {
            let first = self.keys.partition_point(|key| key.frame <= from).saturating_sub(1);
            let inside = (first..self.keys.len()).take_while(|&i| self.keys[i].frame < to);
            inside.for_each(|i| self.stretch(i, &turns, 0.0, (from, to), &mut seen));
        }
        seen(Moment { frame: to, value: self.at(to) });
    }

    /// Visits the moments of [`Curve::moments`] inside an interval, from key `i` until just before the next key, with
    /// their frames shifted.
    fn stretch(
        &self,
        i: usize,
        turns: &[f64],
        shift: f64,
        (from, to): (f64, f64),
        seen: &mut impl FnMut(Moment),
    ) {
        let here = self.keys[i];
        let mut visit = |frame: f64, value: f64| {
            if frame > from && frame < to {
                seen(Moment { frame, value });
            }
        };
        visit(here.frame + shift, here.value);
        let Some(next) = self.keys.get(i + 1) else { return };
        for &turn in turns {
            visit(here.frame + turn * (next.frame - here.frame) + shift, self.eased(i, turn));
        }
        let restarts = self.cycle && i + 2 == self.keys.len();
        let jump = next.frame + shift;
        if self.mode != Mode::Step && (restarts || self.mode.jumps()) && jump > from && jump <= to {
            let before = jump.next_down();
            seen(Moment { frame: before, value: self.between(i, next.frame.next_down()) });
        }
    }

    /// Returns bounds on the least and the greatest value in an interval. They may be slightly too wide. Adds the
    /// number of visited keys to `work`.
    pub(crate) fn range(&self, from: f64, to: f64, work: &mut usize) -> (f64, f64) {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        *work += if self.cycle { 2 * self.keys.len() } else { 0 };
        self.moments(from, to, |moment| {
            *work += 1;
            (low, high) = (low.min(moment.value), high.max(moment.value));
        });
        if low == high {
            return (low, high);
        }
        let slack = SLACK * self.largest + f64::MIN_POSITIVE;
        (low - slack, high + slack)
    }

    /// Returns whether two neighbouring keys are so close that the time between them can be [`QUICK`].
    pub(crate) fn is_quick(&self) -> bool {
        self.keys.windows(2).any(|pair| pair[1].frame - pair[0].frame < QUICK)
    }

    /// Returns the shortest time between two neighbouring keys of which both are within an interval.
    pub(crate) fn shortest_step(&self, from: f64, to: f64) -> Option<f64> {
        let shifts = if self.cycle {
            let shift = from - self.within_cycle(from);
            // The interval can begin in one cycle and end in the next.
            vec![shift, shift + self.period()]
        } else {
            vec![0.0]
        };
        let is_within = |frame: f64, shift: f64| (from..=to).contains(&(frame + shift));
        let pairs = shifts.into_iter().flat_map(|shift| self.keys.windows(2).map(move |pair| (pair, shift)));
        let within = pairs.filter(|(pair, shift)| pair.iter().all(|key| is_within(key.frame, *shift)));
        within.map(|(pair, _)| pair[1].frame - pair[0].frame).reduce(f64::min)
    }

    /// Returns the largest absolute value at any time, up to rounding errors.
    pub(crate) fn largest(&self) -> f64 {
        self.largest
    }

    fn period(&self) -> f64 {
        self.keys[self.keys.len() - 1].frame - self.keys[0].frame
    }

    /// Returns the time within the first cycle that corresponds to `frame`.
    fn within_cycle(&self, frame: f64) -> f64 {
        let (start, period) = (self.keys[0].frame, self.period());
        let since = (frame - start).rem_euclid(period);
        start + if since < period { since } else { 0.0 }
    }

    /// Returns the value at `frame`, which is between keys `i` and `i + 1`.
    fn between(&self, i: usize, frame: f64) -> f64 {
        let (here, next) = (self.keys[i], self.keys[i + 1]);
        let (x, h) = (frame - here.frame, next.frame - here.frame);
        let (v, w) = (here.value, next.value);
        if x == 0.0 {
            return v;
        }
        match self.mode {
            Mode::Step => v,
            Mode::Smooth => {
                let (m, c, d) = self.cubic(i);
                (v + x * (m + x * (c + x * d))).clamp(v.min(w), v.max(w))
            }
            _ => self.eased(i, x / h),
        }
    }

    /// Returns the value after a share of the time from key `i` to the next, for modes that depend on nothing else.
    fn eased(&self, i: usize, share: f64) -> f64 {
        let (v, w) = (self.keys[i].value, self.keys[i + 1].value);
        v + (w - v) * self.mode.share(share)
    }

    /// Returns the coefficients of x, x² and x³ after key `i`.
    fn cubic(&self, i: usize) -> (f64, f64, f64) {
        let (here, next) = (self.keys[i], self.keys[i + 1]);
        let (h, slope) = (next.frame - here.frame, self.slope(i));
        let (m, n) = (self.tangent(i), self.tangent(i + 1));
        (m, (3.0 * slope - 2.0 * m - n) / h, (m + n - 2.0 * slope) / (h * h))
    }

    /// Returns the slope from key `i` to the next.
    fn slope(&self, i: usize) -> f64 {
        let (here, next) = (self.keys[i], self.keys[i + 1]);
        (next.value - here.value) / (next.frame - here.frame)
    }

    /// Returns the slope at key `i`: the weighted harmonic mean of the slopes on both sides.
    fn tangent(&self, i: usize) -> f64 {
        let last = self.keys.len() - 1;
        let (before, after) = match (i, self.cycle) {
            (0, true) => (last - 1, 0),
            (0, false) => return 0.0,
            (i, true) if i == last => (last - 1, 0),
            (i, false) if i == last => return 0.0,
            (i, _) => (i - 1, i),
        };
        let (left, right) = (self.slope(before), self.slope(after));
        if left == 0.0 || right == 0.0 || (left > 0.0) != (right > 0.0) {
            return 0.0;
        }
        let length = |i: usize| self.keys[i + 1].frame - self.keys[i].frame;
        let (p, q) = (2.0 * length(after) + length(before), length(after) + 2.0 * length(before));
        (p + q) / (p / left + q / right)
    }

    /// Returns whether nothing overflows between keys `i` and `i + 1`, apart from what a mode overshoots.
    fn is_bounded(&self, i: usize) -> bool {
        let (here, next) = (self.keys[i], self.keys[i + 1]);
        let h = next.frame - here.frame;
        match self.mode {
            Mode::Step => true,
            Mode::Smooth => {
                let (m, c, d) = self.cubic(i);
                let terms = here.value.abs() + h * (m.abs() + h * (c.abs() + h * d.abs()));
                let slopes = [self.slope(i), m, c, d];
                h.is_finite() && slopes.iter().all(|x| x.is_finite()) && terms.is_finite()
            }
            _ => h.is_finite() && (next.value - here.value).is_finite(),
        }
    }
}

/// Writes the curve, such as `(smooth cycle 1:0 25:3)`.
impl Display for Curve {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str("(")?;
        if self.mode != Mode::Linear {
            write!(f, "{} ", self.mode)?;
        }
        if self.cycle {
            write!(f, "{CYCLE} ")?;
        }
        for (i, key) in self.keys.iter().enumerate() {
            f.write_str(if i == 0 { "" } else { " " })?;
            write_number(f, key.frame)?;
            f.write_str(":")?;
            write_number(f, key.value)?;
        }
        f.write_str(")")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(mode: Mode, cycle: bool, keys: &[(f64, f64)]) -> Curve {
        let keys = keys.iter().map(|&(frame, value)| Key { frame, value }).collect();
        Curve::new(mode, cycle, keys).unwrap()
    }

    #[test]
    fn the_shortest_step_is_between_keys_within_the_interval() {
        let step = |text: &str, from, to| crate::parse_curve(text).unwrap().shortest_step(from, to);
        assert_eq!(step("(1:0 2:1 2.5:0 7:1)", 0.0, 3.0), Some(0.5));
        assert_eq!(step("(1:0 2:1 2.5:0 7:1)", 0.0, 2.4), Some(1.0));
        assert_eq!(step("(1:0 2:1 2.5:0 7:1)", 3.0, 8.0), None);
        assert_eq!(step("(cycle 1:0 2:1 2.5:0)", 3.0, 4.25), Some(0.5));
        assert_eq!(step("(cycle 1:0 2:1 2.5:0)", -2.875, -2.25), None);
        assert_eq!(step("(cycle 0:0 .25:1 1:0)", 0.75, 1.5), Some(0.25));
    }

    #[test]
    fn linear_curves_keep_their_ends() {
        let curve = curve(Mode::Linear, false, &[(1.0, 0.0), (25.0, 3.0), (50.0, -1.0)]);
        let check = |frame, value| assert_eq!(curve.at(frame), value, "{frame}");
        check(-7.0, 0.0);
        check(1.0, 0.0);
        check(13.0, 1.5);
        check(25.0, 3.0);
        check(30.0, 2.2);
        check(50.0, -1.0);
        check(1e300, -1.0);
    }

    #[test]
    fn keys_are_set_where_a_cycle_is_for_the_first_time() {
        let key = |frame, value| Key { frame, value };
        let once = curve(Mode::Smooth, false, &[(1.0, 5.0)]);
        assert_eq!((once.at(-3.0), once.at(1.0), once.at(9.0)), (5.0, 5.0, 5.0));
        assert_eq!(once.to_string(), "(smooth 1:5)");
        assert_eq!(once.with_key(7.0, 2.0).unwrap().keys(), [key(1.0, 5.0), key(7.0, 2.0)]);
        assert_eq!(once.with_key(1.0, 2.0).unwrap().keys(), [key(1.0, 2.0)]);
        let cycle = curve(Mode::Linear, true, &[(1.0, 0.0), (5.0, 8.0)]);
        for (frame, expected) in
            [(7.0, "(cycle 1:0 3:9 5:8)"), (5.0, "(cycle 1:9 5:8)"), (-3.0, "(cycle 1:9 5:8)")]
        {
            let set = cycle.with_key(frame, 9.0).unwrap();
            assert_eq!((set.to_string().as_str(), set.at(frame)), (expected, 9.0));
            assert_eq!(set.key_at(frame).unwrap().value, 9.0);
        }
        assert_eq!(cycle.key_at(3.0), None);
        let through = |cycle, keys: &[Key]| Curve::through(Mode::Linear, cycle, keys.to_vec());
        assert_eq!(through(false, &[]), None);
        assert_eq!(through(true, &[key(1.0, 0.0)]), None);
        assert_eq!(through(false, &[key(1.0, 0.0), key(1.0, 1.0)]), None);
        assert_eq!(through(false, &[key(1.0, f64::NAN)]), None);
        assert_eq!(through(false, &[key(0.0, -1e308), key(1.0, 1e308)]), None);
    }

    #[test]
    fn steps_wait_for_their_key() {
        let curve = curve(Mode::Step, false, &[(1.0, 5.0), (2.0, 7.0)]);
        assert_eq!([0.0, 1.0, 1.999, 2.0, 3.0].map(|t| curve.at(t)), [5.0, 5.0, 5.0, 7.0, 7.0]);
    }

    #[test]
    fn a_cycle_starts_again_at_its_last_key() {
        let linear = curve(Mode::Linear, true, &[(1.0, 0.0), (5.0, 8.0)]);
        assert_eq!([1.0, 3.0, 5.0, 7.0, -1.0].map(|t| linear.at(t)), [0.0, 4.0, 0.0, 4.0, 4.0]);
        assert_eq!(linear.at(1.0 - 1e-30), 0.0, "what rounds to the period is 0");
        let step = curve(Mode::Step, true, &[(0.0, 1.0), (1.0, 2.0), (2.0, 3.0)]);
        assert_eq!([0.0, 1.0, 2.0, 3.0].map(|t| step.at(t)), [1.0, 2.0, 1.0, 2.0]);
    }

    #[test]
    fn smooth_curves_ease_and_never_overshoot() {
        let eased = curve(Mode::Smooth, false, &[(0.0, 0.0), (1.0, 1.0)]);
        assert_eq!([0.25, 0.5, 0.75].map(|t| eased.at(t)), [0.15625, 0.5, 0.84375]);
        let steep = curve(Mode::Smooth, false, &[(0.0, 0.0), (1.0, 1e-9), (2.0, 1.0), (3.0, 1.0)]);
        for k in 0..=3000 {
            let value = steep.at(f64::from(k) / 1000.0);
            assert!((0.0..=1.0).contains(&value), "{k}: {value}");
        }
        // Slopes 1 and 2 over lengths 1 and 2: p = 5, q = 4, and 9/(5/1 + 4/2).
        let bend = curve(Mode::Smooth, false, &[(0.0, 0.0), (1.0, 1.0), (3.0, 5.0)]);
        assert_eq!(bend.tangent(1), 9.0 / 7.0);
        let seam = curve(Mode::Smooth, true, &[(0.0, 0.0), (1.0, 1.0), (3.0, 5.0)]);
        assert_eq!((seam.tangent(0), seam.tangent(2)), (9.0 / 7.0, 9.0 / 7.0));
    }

    #[test]
    fn overflow_is_found_before_it_happens() {
        let new = |mode, keys: &[(f64, f64)]| {
            Curve::new(mode, false, keys.iter().map(|&(frame, value)| Key { frame, value }).collect())
        };
        let wide = [(0.0, 0.0), (1.0, -1e308), (2.0, 1e308)];
        assert_eq!(new(Mode::Linear, &wide), Err(Overflow(1)));
        assert_eq!(new(Mode::Smooth, &wide), Err(Overflow(0)));
        assert!(new(Mode::Step, &wide).is_ok());
        assert_eq!(new(Mode::Linear, &[(-1e308, 0.0), (1e308, 1.0)]), Err(Overflow(0)));
        assert_eq!(new(Mode::Smooth, &[(0.0, 0.0), (1e-200, 1.0)]), Err(Overflow(0)));
    }

    #[test]
    fn moments_hold_all_extremes() {
        let moments = |curve: &Curve, from, to| {
            let mut moments = Vec::new();
            curve.moments(from, to, |moment| moments.push((moment.frame, moment.value)));
            moments
        };
        let hill = curve(Mode::Linear, false, &[(0.0, 0.0), (2.0, 4.0), (4.0, 0.0)]);
        assert_eq!(moments(&hill, 1.0, 3.5), [(1.0, 2.0), (2.0, 4.0), (3.5, 1.0)]);
        assert_eq!(moments(&hill, -9.0, 9.0).len(), 5);
        let saw = curve(Mode::Linear, true, &[(0.0, 1.0), (10.0, -1.0)]);
        let seen = moments(&saw, 1.0, 11.0);
        assert!(
            seen.iter().any(|&(frame, value)| frame < 10.0 && frame > 9.999 && value < -0.999),
            "{seen:?}"
        );
        assert!(seen.iter().any(|&(frame, value)| frame == 10.0 && value == 1.0), "{seen:?}");
    }

    #[test]
    fn modes_that_overshoot_have_their_extremes_among_the_moments() {
        for mode in [Mode::Back, Mode::Elastic, Mode::Bounce, Mode::Bezier([0.2, -2.0, 0.4, 3.0])] {
            for cycle in [false, true] {
                let curve = curve(mode, cycle, &[(1.0, 2.0), (4.0, -1.0), (9.0, 5.0)]);
                for (from, to) in [(-3.0, 20.0), (1.5, 3.0), (2.0, 8.9), (4.0, 4.2), (8.0, 9.5)] {
                    let (low, high) = curve.range(from, to, &mut 0);
                    let mut last = from;
                    curve.moments(from, to, |moment| {
                        assert!((last..=to).contains(&moment.frame), "{curve} {from} {to}: {moment:?}");
                        last = moment.frame;
                    });
                    for k in 0..=5000 {
                        let frame = from + (to - from) * f64::from(k) / 5000.0;
                        let value = curve.at(frame);
                        assert!(
                            (low..=high).contains(&value),
                            "{curve} at {frame}: {value}, {low} to {high}"
                        );
                        assert!(value.abs() <= curve.largest() * (1.0 + 1e-9));
                    }
                }
                assert_eq!([1.0, 4.0].map(|frame| curve.at(frame)), [2.0, -1.0]);
            }
        }
        // At the first maximum, 3.02 is the tangent of 71.7 degrees.
        let spring = curve(Mode::Elastic, false, &[(0.0, 0.0), (1.0, 1.0)]);
        let (low, high) = spring.range(0.0, 1.0, &mut 0);
        assert!(low > -1e-9 && (high - 1.373).abs() < 1e-3, "{low} {high}");
    }

    #[test]
    fn what_overshoots_may_not_overflow() {
        let new = |mode| {
            let keys = [(0.0, 0.0), (1.0, 1.5e308)].map(|(frame, value)| Key { frame, value });
            Curve::new(mode, false, keys.to_vec())
        };
        assert!(new(Mode::Out).is_ok() && new(Mode::Bounce).is_ok());
        assert_eq!(new(Mode::Elastic), Err(Overflow(0)));
        assert_eq!(new(Mode::Bezier([0.5, 9.0, 0.5, 0.0])), Err(Overflow(0)));
    }
}
