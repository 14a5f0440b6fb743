//! A density of directions, in cells on the six faces of a cube.
//!
//! A direction is located on a cube by one division, and its density takes one square root.

use glam::DVec3;

/// The parts along an edge of a cell that is divided.
const PARTS: usize = 8;

/// A density of directions that is constant in each cell of the cube, or in each part of a divided cell.
#[derive(Clone, Debug)]
pub(crate) struct CubeTable {
    /// The cells along an edge of the cube.
    side: usize,
    /// The share of all cells before each cell, and 1.
    before: Vec<f64>,
    /// The first cell to search for a number, for each of equal intervals of 0 to 1.
    first: Vec<u32>,
    /// For each cell, one more than its place in `parts_before`; 0 for cells that are not divided.
    divided: Vec<u16>,
    /// For each divided cell, the share of its parts before each part, and 1.
    parts_before: Vec<[f64; PARTS * PARTS + 1]>,
}

/// Returns the sum of the weights before each one as a share of their total, and 1.
fn shares_before(weights: &[f64]) -> impl Iterator<Item = f64> {
    let total: f64 = weights.iter().sum();
    let mut sum = 0.0;
    weights.iter().map(move |&of| (sum / total, sum += of).0).chain([1.0])
}

/// Returns the interval of such sums that contains a number from 0 to 1, and the number's place in it. The interval is
/// not before `first`.
fn interval(before: &[f64], first: usize, u: f64) -> (usize, f64) {
    let mut at = first;
    while at + 2 < before.len() && before[at + 1] <= u {
        at += 1;
    }
    let [from, to] = [before[at], before[at + 1]];
    (at, if to > from { ((u - from) / (to - from)).clamp(0.0, 1.0) } else { 0.5 })
}

impl CubeTable {
    /// Makes a table of cells with these weights, not all 0. At most `divided` cells, those with the largest weights,
    /// and their neighbours are divided. `weight` returns the weight of a direction per unit of solid angle.
    pub(crate) fn new(
        side: usize,
        mut cells: Vec<f64>,
        divided: usize,
        weight: impl Fn(DVec3) -> f64,
    ) -> Self {
        let mut order: Vec<usize> = (0..cells.len()).filter(|&cell| cells[cell] > 0.0).collect();
        order.sort_by(|&a, &b| cells[b].total_cmp(&cells[a]).then(a.cmp(&b)));
        order.truncate(divided);
        let mut of: Vec<u32> = order.into_iter().flat_map(|cell| around(side, cell)).collect();
        of.sort_unstable();
        of.dedup();
        let mut parts_before = vec![];
        of.retain(|&at| {
            let weights = weights_of_parts(side, at as usize, &weight);
            let sum: f64 = weights.iter().sum();
            cells[at as usize] = sum;
            if sum > 0.0 {
                let mut before = shares_before(&weights);
                parts_before.push(core::array::from_fn(|_| before.next().unwrap_or(1.0)));
            }
            sum > 0.0
        });
        let mut divided = vec![0; cells.len()];
        for (place, &at) in (1..).zip(&of) {
            divided[at as usize] = place;
        }
        let before: Vec<f64> = shares_before(&cells).collect();
        let count = cells.len();
        let start = |part: usize| {
            let u = part as f64 / count as f64;
            before.partition_point(|&before| before <= u).clamp(1, count) - 1
        };
        let first = (0..=count).map(|part| start(part) as u32).collect();
        Self { side, before, first, divided, parts_before }
    }

    /// Returns the density of a direction.
    pub(crate) fn density(&self, direction: DVec3) -> f64 {
        let (cell, [s, t]) = cell(direction, self.side);
        let share = self.before[cell + 1] - self.before[cell];
        if share == 0.0 {
            return 0.0;
        }
        let solid = solid_angle(self.side, [s, t]);
        let Some(of) = self.divided[cell].checked_sub(1) else { return share / solid };
        let fine = self.side * PARTS;
        let part = place(t, fine) % PARTS * PARTS + place(s, fine) % PARTS;
        let before = &self.parts_before[usize::from(of)];
        share * (before[part + 1] - before[part]) * (PARTS * PARTS) as f64 / solid
    }

    /// Returns the direction for two numbers from 0 to 1.
    pub(crate) fn direction(&self, u: f64, v: f64) -> DVec3 {
        let first = self.first[(u * (self.first.len() - 1) as f64) as usize];
        let (cell, u) = interval(&self.before, first as usize, u);
        let Some(of) = self.divided[cell].checked_sub(1) else {
            return within(self.side, cell, [u, v]).0;
        };
        let before = &self.parts_before[usize::from(of)];
        // The row first: the shares of a part's row are read one after another.
        let row = (1..PARTS).take_while(|row| before[row * PARTS] <= u).count() * PARTS;
        let (part, u) = interval(before, row, u);
        let place = [(part % PARTS) as f64 + u, (part / PARTS) as f64 + v].map(|place| place / PARTS as f64);
        within(self.side, cell, place).0
    }
}

/// Returns a cell and its neighbours.
fn around(side: usize, cell: usize) -> impl Iterator<Item = u32> {
    let beside = [-0.01, 0.5, 1.01];
    let places = beside.into_iter().flat_map(move |v| beside.map(|u| [u, v]));
    places.map(move |place| self::cell(within(side, cell, place).0, side).0 as u32)
}

/// Returns the weights of the parts of a cell: the means of those at their corners and centres.
fn weights_of_parts(side: usize, cell: usize, weight: &impl Fn(DVec3) -> f64) -> Vec<f64> {
    let at = |column: f64, row: f64| within(side, cell, [column, row].map(|place| place / PARTS as f64));
    let corners: Vec<f64> = (0..(PARTS + 1) * (PARTS + 1))
        .map(|k| weight(at((k % (PARTS + 1)) as f64, (k / (PARTS + 1)) as f64).0))
        .collect();
    let of_part = |part: usize| {
        let (column, row) = (part % PARTS, part / PARTS);
        let (middle, solid) = at(column as f64 + 0.5, row as f64 + 0.5);
        let first = row * (PARTS + 1) + column;
        let corners = [0, 1, PARTS + 1, PARTS + 2].map(|corner| corners[first + corner]);
        (corners.iter().sum::<f64>() + weight(middle)) * solid / (5 * PARTS * PARTS) as f64
    };
    (0..PARTS * PARTS).map(of_part).collect()
}

/// Returns the solid angle that a cell would have if all of it were as at the place (s, t) on its face.
fn solid_angle(side: usize, [s, t]: [f64; 2]) -> f64 {
    let stretch = 1.0 + s * s + t * t;
    4.0 / ((side * side) as f64 * stretch * stretch.sqrt())
}

/// Returns the number of the cell at a place from -1 to 1, for `cells` cells along an edge.
fn place(at: f64, side: usize) -> usize {
    ((0.5 * (at + 1.0) * side as f64) as usize).min(side - 1)
}

/// Returns the cell of a direction, for `cells` cells along an edge, and the direction's place on the face, from -1
/// to 1.
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
    let face = 2 * axis + usize::from(major < 0.0);
    ((face * side + place(t, side)) * side + place(s, side), [s, t])
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
        // Some cells are divided; their weights are those of their directions.
        let bright = |direction: DVec3| 0.2 + direction.x.max(0.0);
        let table = CubeTable::new(3, weights.clone(), 2, bright);
        let weights: Vec<f64> = (0..54)
            .map(|cell| match table.divided[cell] {
                0 => weights[cell],
                _ => weights_of_parts(3, cell, &bright).iter().sum(),
            })
            .collect();
        let total: f64 = weights.iter().sum();
        assert!(table.parts_before.len() >= 9);
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
