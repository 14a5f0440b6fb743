//! Perlin's improved noise (SIGGRAPH 2002), as a sum over the corners of a cell.

/// Perlin's permutation of the numbers 0 to 255, in hexadecimal.
const SHUFFLED: [&str; 8] = [
    "97a0895b5a0f830dc95f6035c2e907e18c24671e458e086325f0150a17be0694",
    "f778ea4b001ac53e5efcdbcb75230b2039b12158ed953857ae147d88aba844af",
    "4aa547868b301ba64d929ee7536fe57a3cd385e6dc695c29372ef528f4668f36",
    "41193fa101d85049d14c84bbd05912a9c8c4878274bc9f56a4646dc6adba0340",
    "34d9e2fa7c7b05ca2693767eff5255d4cfce3be32f103a11b6bd1c2adfb7aad5",
    "77f898022c9aa346dd99659ba72bac09811627fd13626c6e4f71e0e8b2b97068",
    "daf661e4fb22f2c1eed2900cbfb3a2f1513391ebf90eef6b31c0d61fb5c76a9d",
    "b854ccb07379322d7f0496fe8aeccd5dde72431d1848f38d80c34e42d73d9cb4",
];

/// The directions from the centre of a cube to the centres of its edges, in the order of the last four bits of a hash.
const EDGES: [[i8; 3]; 16] = [
    [1, 1, 0],
    [-1, 1, 0],
    [1, -1, 0],
    [-1, -1, 0],
    [1, 0, 1],
    [-1, 0, 1],
    [1, 0, -1],
    [-1, 0, -1],
    [0, 1, 1],
    [0, -1, 1],
    [0, 1, -1],
    [0, -1, -1],
    [1, 1, 0],
    [0, -1, 1],
    [-1, 1, 0],
    [0, -1, -1],
];

/// Returns the noise at a point, approximately in -1..1.
pub(super) fn noise(place: [f64; 3]) -> f64 {
    let cell = place.map(f64::floor);
    let mut sum = 0.0;
    for corner in 0..8usize {
        let step = [corner & 1, corner >> 1 & 1, corner >> 2];
        let hash = (0..3).fold(0, |hash, axis| {
            shuffled(hash + (cell[axis].rem_euclid(256.0) as usize + step[axis]) % 256)
        });
        let (mut weight, mut slope) = (1.0, 0.0);
        for axis in 0..3 {
            let along = place[axis] - cell[axis];
            let smooth = 6.0 * along.powi(5) - 15.0 * along.powi(4) + 10.0 * along.powi(3);
            weight *= if step[axis] == 1 { smooth } else { 1.0 - smooth };
            slope += f64::from(EDGES[hash % 16][axis]) * (along - step[axis] as f64);
        }
        sum += weight * slope;
    }
    sum
}

fn shuffled(index: usize) -> usize {
    let (row, column) = (index % 256 / 32, index % 32);
    let digits = SHUFFLED[row].get(2 * column..2 * column + 2);
    digits.and_then(|digits| usize::from_str_radix(digits, 16).ok()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_numbers_are_shuffled() {
        let mut all: Vec<usize> = (0..256).map(shuffled).collect();
        all.sort_unstable();
        assert!(all.into_iter().eq(0..256));
    }
}
