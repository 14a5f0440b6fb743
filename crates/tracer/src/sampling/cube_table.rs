//! A density of directions, in cells on the six faces of a cube.
//!
//! A direction is found on a cube by one division, and has its density by one root.

use glam::DVec3;

/// A density of directions that is even in each cell of the cube.
#[derive(Clone, Debug)]
pub(crate) struct CubeTable {
    /// The cells along an edge of the cube.
    side: usize,
    /// The share of all cells before each cell, and 1.
    before: Vec<f64>,
}

impl CubeTable {
    /// Makes a table of cells with these weights, of which not all are 0.
    pub(crate) fn new(side: usize, cells: &[f64]) -> Self {
        let total: f64 = cells.iter().sum();
        let mut sum = 0.0;
        let mut before: Vec<f64> = cells.iter().map(|&of| (sum / total, sum += of).0).collect();
        before.push(1.0);
        Self { side, before }
    }

    /// Returns the density of a direction.
    pub(crate) fn density(&self, direction: DVec3) -> f64 {
        let (cell, [s, t]) = cell(direction, self.side);
        let share = self.before[cell + 1] - self.before[cell];
        share / solid_angle(self.side, [s, t])
    }

    /// Returns the direction of two numbers from 0 to 1.
    pub(crate) fn direction(&self, u: f64, v: f64) -> DVec3 {
        let cell = self.before.partition_point(|&before| before <= u).clamp(1, self.before.len() - 1) - 1;
        let [from, to] = [self.before[cell], self.before[cell + 1]];
        let u = if to > from { ((u - from) / (to - from)).clamp(0.0, 1.0) } else { 0.5 };
        within(self.side, cell, [u, v]).0
    }
}

/// Returns the solid angle that a cell would have if all of it were like the place (s, t) on its face.
fn solid_angle(side: usize, [s, t]: [f64; 2]) -> f64 {
    let stretch = 1.0 + s * s + t * t;
    4.0 / ((side * side) as f64 * stretch * stretch.sqrt())
}

/// Returns the cell of a direction, of so many along an edge, and its place on the face, from -1 to 1.
pub(crate) fn cell(direction: DVec3, side: usize) -> (usize, [f64; 2]) {
    let size = direction.abs();
    let (axis, [major, s, t]) = if size.x >= size.y && size.x >= size.z {
        (0, [direction.x, direction.y, direction.z])
    } else if size.y >= size.z {
        (1, [direction.y, direction.z, direction.x])
    } else {
        (2, [direction.z, direction.x, direction.y])
    };
    let [s, t] = [s / major.abs(), t / major.abs()];
    let index = |place: f64| ((0.5 * (place + 1.0) * side as f64) as usize).min(side - 1);
    let face = 2 * axis + usize::from(major < 0.0);
    ((face * side + index(t)) * side + index(s), [s, t])
}

/// Returns the direction of a place in a cell, from (0, 0) to (1, 1), and the solid angle of the cell there.
pub(crate) fn within(side: usize, cell: usize, [u, v]: [f64; 2]) -> (DVec3, f64) {
    let (face, at) = (cell / (side * side), cell % (side * side));
    let place = |index: usize, share: f64| 2.0 * (index as f64 + share) / side as f64 - 1.0;
    let (s, t) = (place(at % side, u), place(at / side, v));
    let sign = if face.is_multiple_of(2) { 1.0 } else { -1.0 };
    let direction = match face / 2 {
        0 => DVec3::new(sign, s, t),
        1 => DVec3::new(t, sign, s),
        _ => DVec3::new(s, t, sign),
    };
    (direction.normalize(), solid_angle(side, [s, t]))
}

#[cfg(test)]
mod tests {
    use core::f64::consts::PI;

    use super::*;

    #[test]
    fn directions_are_drawn_with_their_density() {
        let weights: Vec<f64> = (0..54).map(|cell| [0.0, 1.0, 5.0, 0.5][cell % 4]).collect();
        let total: f64 = weights.iter().sum();
        let table = CubeTable::new(3, &weights);
        let mut dice = fastrand::Rng::with_seed(3);
        let (count, mut solid, mut found) = (400_000, 0.0, [0.0; 54]);
        for _ in 0..count {
            let direction = table.direction(dice.f64(), dice.f64());
            assert!((direction.length() - 1.0).abs() < 1e-14);
            // 1 over the density has the mean of the solid angle of all cells that count.
            solid += 1.0 / table.density(direction) / f64::from(count);
            found[cell(direction, 3).0] += 1.0 / f64::from(count);
        }
        for (at, (found, weight)) in found.iter().zip(&weights).enumerate() {
            assert!((found - weight / total).abs() < 0.002, "{at}: {found} {}", weight / total);
        }
        // By uniform directions: the integral of the density is 1, and so many cells count.
        let (mut all, mut counted) = (0.0, 0.0);
        for _ in 0..count {
            let direction = loop {
                let at = DVec3::from_array([0; 3].map(|_| dice.f64() * 2.0 - 1.0));
                if (0.01..1.0).contains(&at.length_squared()) {
                    break at.normalize();
                }
            };
            let density = table.density(direction);
            all += density * 4.0 * PI / f64::from(count);
            counted += f64::from(u8::from(density > 0.0)) * 4.0 * PI / f64::from(count);
        }
        assert!((all - 1.0).abs() < 0.02 && (counted - solid).abs() < 0.05, "{all} {counted} {solid}");
    }

    #[test]
    fn a_place_in_a_cell_is_found_in_it() {
        let mut dice = fastrand::Rng::with_seed(4);
        let mut sum = 0.0;
        for index in 0..6 * 49 {
            let (direction, _) = within(7, index, [dice.f64(), dice.f64()]);
            assert_eq!(cell(direction, 7).0, index);
            sum += within(7, index, [0.5, 0.5]).1;
        }
        assert!((sum - 4.0 * PI).abs() < 0.1, "{sum}");
    }
}
