//! The size of an object with several positions or lengths, as one handle: scales all of them from their middle.
//!
//! Knows commands only by the kinds of their parameters.

use glam::DVec3;
use rayfold_scene::{Field, Kind, Parameter};

use crate::line::Line;
use crate::steps::{middle, rounded, shifted};
use crate::tables::{Role, fields, of_kind, role};
use crate::values::{Keying, Values, changed};

/// Returns whether a line has this handle: it draws an object with several positions or lengths, and no number is its
/// scale. The radius of a sphere has a handle of its own.
pub(crate) fn is_scaled(values: &Values) -> bool {
    let is_object = role(values.command) == Role::Object;
    let is_scale = |field: &Field| field.parameter == Parameter::Scale;
    let positions = values.positions().count();
    let measures = positions + of_kind(values.command, Kind::Length).count();
    is_object
        && positions > 0
        && (positions > 1 || measures > 2)
        && !fields(values.command).any(|(_, field)| is_scale(field))
}

/// Returns a line with its positions and lengths `factor` times as far from their middle, in multiples of a step. Lengths
/// stay positive.
pub(crate) fn scaled(line: &Line, values: &Values, factor: f64, step: f64, keying: Keying) -> Option<Line> {
    let positions: Vec<(usize, DVec3)> = values.positions().collect();
    let center = middle(&positions);
    // No two different coordinates become equal.
    let differences = positions.windows(2).flat_map(|pair| (pair[1].1 - pair[0].1).abs().to_array());
    let smallest = differences.filter(|difference| *difference > 0.0).fold(f64::INFINITY, f64::min);
    let factor = factor.max((2.0 * step / smallest).min(1.0));
    let mut line = line.clone();
    for (first, position) in positions {
        let by = (factor - 1.0) * (position - center);
        line = changed(&line, first, &shifted(position, by, [true; 3], [step; 3]), keying)?;
    }
    // Its new positions bound a radius of edges.
    let moved = Values::of(&line, keying.time)?;
    for first in of_kind(values.command, Kind::Length) {
        let Some(length) = values.number(first).filter(|length| *length > 0.0) else { continue };
        let length = rounded((length * factor).max(step), step).min(moved.most(first));
        line = changed(&line, first, &[length], keying)?;
    }
    Some(line)
}

#[cfg(test)]
mod tests {
    use super::*;

    const STILL: Keying = Keying { time: 1.0, first: 1.0, auto: false, whole: false };

    fn after(text: &str, factor: f64) -> String {
        let line = Line::new(text);
        let values = Values::of(&line, 1.0).unwrap();
        assert!(is_scaled(&values), "{text}");
        scaled(&line, &values, factor, 0.01, STILL).unwrap().text()
    }

    #[test]
    fn all_positions_and_lengths_grow_from_the_middle() {
        assert_eq!(
            after("Box -1 0 1e0  2 .50 0  red # crate", 2.0),
            "Box -2.5 -0.25 1.5  3.5 0.75 -0.5  red # crate"
        );
        assert_eq!(after("Torus 1 .25  0 1.0 2  0 1 0  red", 0.5), "Torus 0.5 0.13  0 1.0 2  0 1 0  red");
        assert_eq!(after("Cylinder .5  0 0 0  0 2 0  red", 1.5), "Cylinder 0.75  0 -0.5 0  0 2.5 0  red");
        assert_eq!(after("Triangle 0 0 0  3 0 0  0 3 0  red", 2.0), "Triangle -1 -1 0  5 -1 0  -1 5 0  red");
    }

    #[test]
    fn nothing_becomes_flat_or_rounder_than_it_can_be() {
        assert_eq!(after("Box 0 0 0  1 2 1  red", 0.0), "Box 0.49 0.98 0.49  0.51 1.02 0.51  red");
        assert_eq!(after("Torus 1 .25  0 1 2  0 1 0  red", 1e-9), "Torus 0.01 0.01  0 1 2  0 1 0  red");
        assert_eq!(
            after("Roundbox 0 0 0  2 1 3  .5  red", 0.1),
            "Roundbox 0.9 0.45 1.35  1.1 0.55 1.65  0.05  red"
        );
        assert_eq!(after("Cone .5 0  0 0 0  0 1 0  red", 2.0), "Cone 1 0  0 -0.5 0  0 1.5 0  red");
    }

    #[test]
    fn what_has_one_measure_or_a_scale_has_no_such_handle() {
        let others = ["Use tie", "Plane 0 0 0  0 1 0  red", "Plight 1 1 1  0 2 0", "Look 0 1 5  0 0 0  40"];
        for text in others.into_iter().chain(["Sphere 1  0 0 0  red"]) {
            assert!(!is_scaled(&Values::of(&Line::new(text), 1.0).unwrap()), "{text}");
        }
    }
}
