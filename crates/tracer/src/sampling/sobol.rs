//! Points that fill a cube evenly: Sobol's sequence with Owen scrambling, which differs for each pixel and dimension.
//!
//! The direction numbers are those of Joe and Kuo, "Constructing Sobol sequences with better two-dimensional
//! projections" (2008). The scrambling is the hash of Laine and Karras (2011) with the constants of Vegdahl (2021), on
//! the bits in reverse order, as in Burley, "Practical hash-based Owen scrambling" (2020). This module does not depend
//! on the use of the points.

/// The number of dimensions that have direction numbers of their own.
pub(super) const OWN: usize = 21;

/// The numbers of a polynomial: its degree, its inner coefficients as bits, and the first direction numbers.
const POLYNOMIALS: [(u32, u32, &[u32]); OWN - 1] = [
    (1, 0, &[1]),
    (2, 1, &[1, 3]),
    (3, 1, &[1, 3, 1]),
    (3, 2, &[1, 1, 1]),
    (4, 1, &[1, 1, 3, 3]),
    (4, 4, &[1, 3, 5, 13]),
    (5, 2, &[1, 1, 5, 5, 17]),
    (5, 4, &[1, 1, 5, 5, 5]),
    (5, 7, &[1, 1, 7, 11, 19]),
    (5, 11, &[1, 1, 5, 1, 1]),
    (5, 13, &[1, 1, 1, 3, 11]),
    (5, 14, &[1, 3, 5, 5, 31]),
    (6, 1, &[1, 3, 3, 9, 7, 49]),
    (6, 13, &[1, 1, 1, 15, 21, 21]),
    (6, 16, &[1, 3, 1, 13, 27, 49]),
    (6, 19, &[1, 1, 1, 15, 7, 5]),
    (6, 22, &[1, 3, 1, 15, 13, 25]),
    (6, 25, &[1, 1, 5, 5, 19, 61]),
    (7, 1, &[1, 3, 7, 11, 23, 15, 103]),
    (7, 4, &[1, 3, 7, 13, 13, 15, 69]),
];

/// For each dimension, the number that each bit of an index adds. Bits are in reverse order: the lowest is the half.
static DIRECTIONS: [[u32; 32]; OWN] = directions();

const fn directions() -> [[u32; 32]; OWN] {
    let mut all = [[0; 32]; OWN];
    let mut bit = 0;
    while bit < 32 {
        all[0][bit] = 1 << bit;
        bit += 1;
    }
    let mut dimension = 1;
    while dimension < OWN {
        let (degree, coefficients, first) = POLYNOMIALS[dimension - 1];
        let degree = degree as usize;
        let mut v = [0u32; 32];
        let mut bit = 0;
        while bit < 32 {
            if bit < degree {
                v[bit] = first[bit] << (31 - bit);
            } else {
                let mut next = v[bit - degree] ^ (v[bit - degree] >> degree);
                let mut k = 1;
                while k < degree {
                    if coefficients >> (degree - 1 - k) & 1 != 0 {
                        next ^= v[bit - k];
                    }
                    k += 1;
                }
                v[bit] = next;
            }
            all[dimension][bit] = v[bit].reverse_bits();
            bit += 1;
        }
        dimension += 1;
    }
    all
}

/// Returns the point with this index along a dimension below [`OWN`], as 32 bits in reverse order: the lowest is the
/// half.
pub(super) fn reversed(index: u32, dimension: usize) -> u32 {
    let mut bits = index;
    let mut point = 0;
    while bits != 0 {
        point ^= DIRECTIONS[dimension][bits.trailing_zeros() as usize];
        bits &= bits - 1;
    }
    point
}

/// Returns an Owen scramble, one for each seed, of a number whose bits are in reverse order. Each bit is flipped or not
/// by a hash of the more significant bits, which are stored below it.
#[inline(always)]
pub(super) const fn scrambled(reversed: u32, seed: u32) -> u32 {
    let mut x = reversed;
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x
}

/// Returns a hash. Each of its bits depends on all bits of `x` (Wellons' lowbias32, 2018).
#[inline(always)]
pub(super) const fn mixed(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x21f0_aaad);
    x ^= x >> 15;
    x = x.wrapping_mul(0x735a_2d97);
    x ^ (x >> 15)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the cells of equal size, along one dimension, in which the first `2^bits` points lie.
    fn cells(bits: u32, point: impl Fn(u32) -> u32) -> Vec<u32> {
        let mut cells: Vec<u32> = (0..1 << bits).map(|k| point(k).reverse_bits() >> (32 - bits)).collect();
        cells.sort_unstable();
        cells
    }

    #[test]
    fn every_cell_along_every_dimension_holds_one_point() {
        for dimension in 0..OWN {
            for bits in 1..=10 {
                let expected: Vec<u32> = (0..1 << bits).collect();
                assert_eq!(cells(bits, |k| reversed(k, dimension)), expected, "{dimension} {bits}");
                let seed = mixed(dimension as u32 + 77);
                let scrambled = cells(bits, |k| scrambled(reversed(k, dimension), seed));
                assert_eq!(scrambled, expected, "{dimension} {bits}, scrambled");
            }
        }
    }

    #[test]
    fn the_first_two_dimensions_are_a_net() {
        // Of 2^m points each box of the area 2^-m holds one, whatever its shape (a (0, m, 2)-net in base 2).
        for scramble in [None, Some((0x1234_5678, 0x9abc_def1))] {
            for m in 1..=8u32 {
                for wide in 0..=m {
                    let mut seen = vec![false; 1 << m];
                    for k in 0..1 << m {
                        let (mut x, mut y) = (reversed(k, 0), reversed(k, 1));
                        if let Some((a, b)) = scramble {
                            (x, y) = (scrambled(x, a), scrambled(y, b));
                        }
                        let part = |v: u32, bits: u32| (u64::from(v.reverse_bits()) >> (32 - bits)) as usize;
                        let cell = part(x, wide) << (m - wide) | part(y, m - wide);
                        assert!(!core::mem::replace(&mut seen[cell], true), "{m} {wide}");
                    }
                }
            }
        }
    }

    #[test]
    fn scrambles_of_different_seeds_have_nothing_in_common() {
        // The mean product of two centred scrambles of the same point is that of independent numbers.
        let centred = |x: u32| f64::from(x.reverse_bits()) / 4_294_967_296.0 - 0.5;
        let count = 1 << 16;
        let sum: f64 = (0..count)
            .map(|seed| {
                let (a, b) = (scrambled(12345, mixed(2 * seed)), scrambled(12345, mixed(2 * seed + 1)));
                centred(a) * centred(b)
            })
            .sum();
        let deviation = 1.0 / 12.0 / f64::from(count).sqrt();
        assert!((sum / f64::from(count)).abs() < 4.0 * deviation, "{}", sum / f64::from(count) / deviation);
    }
}
