//! The modes of a curve: the interpolation between two keys.
//!
//! The shapes of the modes that ease by name are those of Penner's easing functions, as animation tools and CSS use
//! them (easings.net; CSS Easing Functions Level 1). Their functions come from `libm`, so that the last bit is the same
//! on all machines.

use std::f64::consts::{LN_2, PI};
use std::fmt::{self, Display, Formatter};

use crate::form::write_number;

/// The interpolation between two keys.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Mode {
    /// Linear interpolation.
    #[default]
    Linear,
    /// Cubic interpolation that never overshoots (Fritsch and Butland 1984, "A method for constructing local
    /// monotone piecewise cubic interpolants").
    Smooth,
    /// The value of the last key, until the next one.
    Step,
    /// Slow after each key, then ever faster: a cubic.
    In,
    /// Fast after each key, then ever slower: a cubic.
    Out,
    /// Slow at both keys and fast between them: two cubics.
    InOut,
    /// Passes the next key by a tenth of the way and comes back.
    Back,
    /// Swings around the next key like a spring.
    Elastic,
    /// Falls to the next key and bounces there three times.
    Bounce,
    /// CSS's `cubic-bezier` with the control points (a, b) and (c, d); a and c are 0 to 1.
    Bezier([f64; 4]),
}

/// The coefficient of the square in `back`. It overshoots by 10 %.
const BACK: f64 = 1.70158;
/// The time of a swing of `elastic`, relative to the distance of the keys.
const SWING: f64 = 0.3;
/// The time of the first zero of `elastic`'s swing.
const SWING_START: f64 = 0.075;
/// The factor of the parabolas of `bounce`.
const FALL: f64 = 7.5625;
/// The inverse time of its first fall, the root of `FALL`.
const FALLS: f64 = 2.75;
/// The arcs of `bounce`: where each ends, the time of its lowest point, both as multiples of `1 / FALLS`, and its height.
const ARCS: [(f64, f64, f64); 4] =
    [(1.0, 0.0, 0.0), (2.0, 1.5, 0.75), (2.5, 2.25, 0.9375), (f64::INFINITY, 2.625, 0.984_375)];

/// Writes the mode as a curve of a script has it: `smooth`, or `bezier 0.25 0.1 0.25 1`.
impl Display for Mode {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())?;
        if let Self::Bezier(points) = self {
            for &point in points {
                f.write_str(" ")?;
                write_number(f, point)?;
            }
        }
        Ok(())
    }
}

impl Mode {
    /// All modes, in the order of the documentation; `bezier` with the control points of CSS's `ease`.
    pub const ALL: &[Self] = &[
        Self::Linear,
        Self::Smooth,
        Self::Step,
        Self::In,
        Self::Out,
        Self::InOut,
        Self::Back,
        Self::Elastic,
        Self::Bounce,
        Self::Bezier([0.25, 0.1, 0.25, 1.0]),
    ];

    /// Returns the word for the mode.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Smooth => "smooth",
            Self::Step => "step",
            Self::In => "in",
            Self::Out => "out",
            Self::InOut => "inout",
            Self::Back => "back",
            Self::Elastic => "elastic",
            Self::Bounce => "bounce",
            Self::Bezier(_) => "bezier",
        }
    }

    /// Returns a one-line summary of the mode.
    pub(crate) fn summary(self) -> &'static str {
        match self {
            Self::Linear => "Straight lines from key to key.",
            Self::Smooth => "A smooth curve that eases in and out and never overshoots a key.",
            Self::Step => "The value of the last key until the next one.",
            Self::In => "Slow after each key, then ever faster.",
            Self::Out => "Fast after each key, then ever slower.",
            Self::InOut => "Slow at both keys, fast between them.",
            Self::Back => "Passes the next key by a tenth of the way, and comes back.",
            Self::Elastic => "Swings around the next key like a spring.",
            Self::Bounce => "Falls to the next key and bounces there.",
            Self::Bezier(_) => {
                "CSS's cubic-bezier: four numbers follow, the control points a b and c d; a and c are 0 to 1."
            }
        }
    }

    /// Returns the share of the way to the next key that is done after a share `x` of the time, for modes that depend on
    /// nothing else. `x` is between 0 and 1, neither included.
    ///
    /// # Panics
    /// For `step` and `smooth`.
    pub(super) fn share(self, x: f64) -> f64 {
        let back = x - 1.0;
        match self {
            Self::Linear => x,
            Self::In => x * x * x,
            Self::Out => 1.0 - (1.0 - x) * (1.0 - x) * (1.0 - x),
            Self::InOut if x < 0.5 => 4.0 * (x * x * x),
            Self::InOut => 1.0 - 4.0 * ((1.0 - x) * (1.0 - x) * (1.0 - x)),
            Self::Back => 1.0 + (BACK + 1.0) * (back * back * back) + BACK * (back * back),
            Self::Elastic => libm::exp2(-10.0 * x) * libm::sin(2.0 * PI * (x - SWING_START) / SWING) + 1.0,
            Self::Bounce => {
                let arc = ARCS.iter().find(|(end, ..)| x < end / FALLS);
                let &(_, lowest, height) = arc.expect("the last arc never ends");
                // Rounding must not pass the key.
                let since = x - lowest / FALLS;
                (FALL * (since * since) + height).min(1.0)
            }
            Self::Bezier([a, b, c, d]) => bezier(b, d, bezier_time(a, c, x)),
            Self::Step | Self::Smooth => unreachable!("steps and smooth curves depend on more"),
        }
    }

    /// Returns the times between two keys, as shares in increasing order, at which the way has a maximum or a minimum.
    pub(super) fn turns(self) -> Vec<f64> {
        match self {
            Self::Linear | Self::Smooth | Self::Step | Self::In | Self::Out | Self::InOut => Vec::new(),
            // 3 (BACK + 1) (x - 1)² + 2 BACK (x - 1) = 0.
            Self::Back => vec![1.0 - 2.0 * BACK / (3.0 * (BACK + 1.0))],
            // The derivative of 2^(-10x) sin θ is 0 where tan θ = θ' / (10 ln 2).
            Self::Elastic => {
                let first = libm::atan(2.0 * PI / SWING / (10.0 * LN_2)) * SWING / (2.0 * PI) + SWING_START;
                (0..6).map(|half| first + 0.5 * SWING * f64::from(half)).collect()
            }
            Self::Bounce => {
                let [(a, ..), (b, lowest_b, _), (c, lowest_c, _), (_, lowest_d, _)] = ARCS;
                [a, lowest_b, b, lowest_c, c, lowest_d].map(|x| x / FALLS).to_vec()
            }
            Self::Bezier([a, b, c, d]) => {
                let mut turns: Vec<f64> =
                    bezier_turns(b, d).into_iter().map(|time| bezier(a, c, time)).collect();
                turns.retain(|x| *x > 0.0 && *x < 1.0);
                turns.sort_by(f64::total_cmp);
                turns
            }
        }
    }

    /// Returns whether the value just before a key may lie outside of the values at the keys and turns.
    pub(super) fn jumps(self) -> bool {
        self == Self::Elastic
    }
}

/// Returns a coordinate of CSS's curve at a parameter: 0 and 1 at its ends, with the control points `p` and `q`.
fn bezier(p: f64, q: f64, time: f64) -> f64 {
    let rest = 1.0 - time;
    3.0 * p * (rest * rest * time) + 3.0 * q * (rest * (time * time)) + time * time * time
}

/// Returns the parameter at which the first coordinate is `x`, by bisection to 2⁻⁵³. The coordinate increases, since its
/// control points are between 0 and 1.
fn bezier_time(a: f64, c: f64, x: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..53 {
        let middle = 0.5 * (low + high);
        if bezier(a, c, middle) < x { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Returns the parameters between 0 and 1 at which the second coordinate has a maximum or a minimum: the roots of
/// (1 - t)² b + 2 t (1 - t) (d - b) + t² (1 - d), scaled so that nothing overflows.
fn bezier_turns(b: f64, d: f64) -> Vec<f64> {
    let scale = b.abs().max(d.abs()).max(1.0);
    let (b, d, one) = (b / scale, d / scale, 1.0 / scale);
    let (square, linear, constant) = (3.0 * b - 3.0 * d + one, 2.0 * d - 4.0 * b, b);
    let discriminant = linear * linear - 4.0 * square * constant;
    if discriminant < 0.0 {
        return Vec::new();
    }
    // The form that does not cancel.
    let sum = -0.5 * (linear + discriminant.sqrt().copysign(linear));
    [sum / square, constant / sum].into_iter().filter(|time| *time > 0.0 && *time < 1.0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_have_the_values_of_their_formulas() {
        let check = |mode: Mode, x: f64, expected: f64| {
            let value = mode.share(x);
            assert!((value - expected).abs() < 1e-12, "{mode:?} at {x}: {value}, not {expected}");
        };
        check(Mode::In, 0.5, 0.125);
        check(Mode::Out, 0.5, 0.875);
        check(Mode::InOut, 0.25, 0.0625);
        check(Mode::InOut, 0.75, 0.9375);
        check(Mode::Back, 0.5, 1.087_697_5);
        check(Mode::Back, 0.25, 0.817_409_687_5);
        check(Mode::Elastic, 0.25, 0.911_611_652_351_681_6);
        check(Mode::Elastic, 0.5, 1.015_625);
        check(Mode::Bounce, 0.25, 0.472_656_25);
        check(Mode::Bounce, 0.5, 0.765_625);
        check(Mode::Bounce, 0.95, 0.984_531_25);
        // CSS's ease: t = 0.5 is where x is 0.3125.
        check(Mode::Bezier([0.25, 0.1, 0.25, 1.0]), 0.3125, 0.5375);
        check(Mode::Bezier([0.0, 0.0, 1.0, 1.0]), 0.3, 0.3);
    }

    #[test]
    fn between_two_turns_the_way_goes_one_way() {
        let mut modes: Vec<Mode> =
            Mode::ALL.iter().copied().filter(|mode| !matches!(mode, Mode::Smooth | Mode::Step)).collect();
        for (a, c) in [(0.0, 0.0), (0.0, 1.0), (0.2, 0.7), (0.5, 0.5), (1.0, 0.0), (1.0, 1.0)] {
            for b in -8..8 {
                modes.extend((-8..8).map(|d| Mode::Bezier([a, f64::from(b) / 2.0, c, f64::from(d) / 2.0])));
            }
        }
        for mode in modes {
            let mut ends = vec![0.0];
            ends.extend(mode.turns());
            ends.push(1.0);
            assert!(ends.is_sorted(), "{mode:?} {ends:?}");
            for pair in ends.windows(2) {
                let values: Vec<f64> = (1..400)
                    .map(|k| mode.share(pair[0] + (pair[1] - pair[0]) * f64::from(k) / 400.0))
                    .collect();
                let rises = values.windows(2).all(|v| v[1] >= v[0] - 1e-9);
                let falls = values.windows(2).all(|v| v[1] <= v[0] + 1e-9);
                assert!(rises || falls, "{mode:?} between {} and {}", pair[0], pair[1]);
            }
        }
    }

    #[test]
    fn steep_control_points_do_not_hide_a_turn() {
        assert_eq!(Mode::Bezier([0.5, 1e300, 0.5, -1e300]).turns().len(), 2);
        assert_eq!(Mode::Bezier([0.3, 0.0, 0.3, 1.0]).turns(), [0.0; 0]);
    }
}
