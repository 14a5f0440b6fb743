//! Positions and numbers that move in steps of a power of ten, so that scripts have few decimals.

use glam::DVec3;

/// Returns the mean of some positions.
pub(crate) fn middle(positions: &[(usize, DVec3)]) -> DVec3 {
    positions.iter().map(|(_, position)| position).sum::<DVec3>() / positions.len().max(1) as f64
}

/// Returns the multiple of a power of ten nearest to `x`, as its shortest decimal.
pub(crate) fn rounded(x: f64, step: f64) -> f64 {
    let decimals = -step.log10().round();
    let x = (x / step).round() * step;
    if decimals > 0.0 { format!("{x:.*}", decimals as usize).parse().unwrap_or(x) } else { x.round() }
}

/// Moves a position along some of the axes, on each by a multiple of its step. The other coordinates keep their numbers.
pub(crate) fn shifted(position: DVec3, by: DVec3, axes: [bool; 3], steps: [f64; 3]) -> [f64; 3] {
    let mut to = position.to_array();
    for axis in (0..3).filter(|&axis| axes[axis]) {
        let way = rounded(by[axis], steps[axis]);
        if way != 0.0 {
            to[axis] = exactly(to[axis], way, steps[axis]);
        }
    }
    to
}

/// Returns the sum without rounding noise: it has as many decimals as the longer of the two numbers.
pub(crate) fn exactly(x: f64, way: f64, step: f64) -> f64 {
    let sum = x + way;
    let of = |x: f64| x.to_string().split_once('.').map_or(0, |(_, decimals)| decimals.len());
    let decimals = of(x).max((-step.log10().round()).max(0.0) as usize);
    if decimals <= 12 { format!("{sum:.decimals$}").parse().unwrap_or(sum) } else { sum }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_decimals_of_their_step() {
        assert_eq!(rounded(1.23456, 1e-2), 1.23);
        assert_eq!(rounded(1234.0, 100.0), 1200.0);
        assert_eq!(exactly(-3.515, 0.1, 0.01), -3.415);
    }
}
