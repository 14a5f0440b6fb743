//! Perlin's improved noise: K. Perlin, "Improving noise", SIGGRAPH 2002.

use glam::DVec3;

use super::whole::{floor, remainder};

/// Perlin's permutation of 0..256.
const PERMUTATION: [u8; 256] = [
    151, 160, 137, 91, 90, 15, 131, 13, 201, 95, 96, 53, 194, 233, 7, 225, 140, 36, 103, 30, 69, 142, 8, 99,
    37, 240, 21, 10, 23, 190, 6, 148, 247, 120, 234, 75, 0, 26, 197, 62, 94, 252, 219, 203, 117, 35, 11, 32,
    57, 177, 33, 88, 237, 149, 56, 87, 174, 20, 125, 136, 171, 168, 68, 175, 74, 165, 71, 134, 139, 48, 27,
    166, 77, 146, 158, 231, 83, 111, 229, 122, 60, 211, 133, 230, 220, 105, 92, 41, 55, 46, 245, 40, 244,
    102, 143, 54, 65, 25, 63, 161, 1, 216, 80, 73, 209, 76, 132, 187, 208, 89, 18, 169, 200, 196, 135, 130,
    116, 188, 159, 86, 164, 100, 109, 198, 173, 186, 3, 64, 52, 217, 226, 250, 124, 123, 5, 202, 38, 147,
    118, 126, 255, 82, 85, 212, 207, 206, 59, 227, 47, 16, 58, 17, 182, 189, 28, 42, 223, 183, 170, 213, 119,
    248, 152, 2, 44, 154, 163, 70, 221, 153, 101, 155, 167, 43, 172, 9, 129, 22, 39, 253, 19, 98, 108, 110,
    79, 113, 224, 232, 178, 185, 112, 104, 218, 246, 97, 228, 251, 34, 242, 193, 238, 210, 144, 12, 191, 179,
    162, 241, 81, 51, 145, 235, 249, 14, 239, 107, 49, 192, 214, 31, 181, 199, 106, 157, 184, 84, 204, 176,
    115, 121, 50, 45, 127, 4, 150, 254, 138, 236, 205, 93, 222, 114, 67, 29, 24, 72, 243, 141, 128, 195, 78,
    66, 215, 61, 156, 180,
];

/// Returns the noise at a point, from about -1 to 1. Its lattice repeats after 256 in each direction.
pub(super) fn noise(place: DVec3) -> f64 {
    let cell = DVec3::from_array(place.to_array().map(floor));
    let within = place - cell;
    let [x, y, z] = cell.to_array().map(|c| usize::from(remainder(c)));
    let fade = within * within * within * (within * (within * 6.0 - 15.0) + 10.0);
    let corner = |dx: usize, dy: usize, dz: usize| {
        let hash = permuted(permuted(permuted(x + dx) + y + dy) + z + dz);
        gradient(hash, within - DVec3::new(dx as f64, dy as f64, dz as f64))
    };
    let along_x = |dy, dz| mix(fade.x, corner(0, dy, dz), corner(1, dy, dz));
    let along_y = |dz| mix(fade.y, along_x(0, dz), along_x(1, dz));
    mix(fade.z, along_y(0), along_y(1))
}

fn permuted(index: usize) -> usize {
    usize::from(PERMUTATION[index % PERMUTATION.len()])
}

fn mix(part: f64, a: f64, b: f64) -> f64 {
    a + part * (b - a)
}

/// The 12 directions to the midpoints of a cube's edges, four of which are repeated.
const GRADIENTS: [DVec3; 16] = [
    DVec3::new(1.0, 1.0, 0.0),
    DVec3::new(-1.0, 1.0, 0.0),
    DVec3::new(1.0, -1.0, 0.0),
    DVec3::new(-1.0, -1.0, 0.0),
    DVec3::new(1.0, 0.0, 1.0),
    DVec3::new(-1.0, 0.0, 1.0),
    DVec3::new(1.0, 0.0, -1.0),
    DVec3::new(-1.0, 0.0, -1.0),
    DVec3::new(0.0, 1.0, 1.0),
    DVec3::new(0.0, -1.0, 1.0),
    DVec3::new(0.0, 1.0, -1.0),
    DVec3::new(0.0, -1.0, -1.0),
    DVec3::new(1.0, 1.0, 0.0),
    DVec3::new(0.0, -1.0, 1.0),
    DVec3::new(-1.0, 1.0, 0.0),
    DVec3::new(0.0, -1.0, -1.0),
];

/// Returns the dot product with one of the gradients. Their coordinates are 1, -1 and 0, so that it takes no branches.
fn gradient(hash: usize, v: DVec3) -> f64 {
    GRADIENTS[hash % GRADIENTS.len()].dot(v)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_permutation_has_each_number_once() {
        let mut sorted = PERMUTATION;
        sorted.sort_unstable();
        assert!(sorted.iter().zip(0..=255u8).all(|(x, k)| *x == k));
    }

    #[test]
    fn noise_vanishes_at_the_lattice_and_repeats() {
        for place in [DVec3::ZERO, DVec3::new(3.0, -7.0, 255.0), DVec3::new(256.0, 1e9, -1.0)] {
            assert_eq!(noise(place), 0.0);
        }
        let place = DVec3::new(0.25, 0.5, 0.75);
        assert_eq!(noise(place), noise(place + DVec3::new(256.0, -512.0, 1024.0)));
        assert_ne!(noise(place), noise(place + DVec3::new(1.0, 0.0, 0.0)));
    }

    #[test]
    fn noise_is_that_of_perlins_program() {
        let by_his_program = |x: f64, y: f64, z: f64| {
            let p = |i: usize| usize::from(PERMUTATION[i & 255]);
            let grad = |hash: usize, x: f64, y: f64, z: f64| {
                let h = hash & 15;
                let u = if h < 8 { x } else { y };
                let v = if h < 4 {
                    y
                } else if h == 12 || h == 14 {
                    x
                } else {
                    z
                };
                (if h & 1 == 0 { u } else { -u }) + (if h & 2 == 0 { v } else { -v })
            };
            let fade = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
            let lerp = |t: f64, a: f64, b: f64| a + t * (b - a);
            let [cx, cy, cz] = [x, y, z].map(|c| c.floor() as i64 as usize & 255);
            let (x, y, z) = (x - x.floor(), y - y.floor(), z - z.floor());
            let (u, v, w) = (fade(x), fade(y), fade(z));
            let (a, b) = (p(cx) + cy, p(cx + 1) + cy);
            let (aa, ab, ba, bb) = (p(a) + cz, p(a + 1) + cz, p(b) + cz, p(b + 1) + cz);
            lerp(
                w,
                lerp(
                    v,
                    lerp(u, grad(p(aa), x, y, z), grad(p(ba), x - 1.0, y, z)),
                    lerp(u, grad(p(ab), x, y - 1.0, z), grad(p(bb), x - 1.0, y - 1.0, z)),
                ),
                lerp(
                    v,
                    lerp(u, grad(p(aa + 1), x, y, z - 1.0), grad(p(ba + 1), x - 1.0, y, z - 1.0)),
                    lerp(u, grad(p(ab + 1), x, y - 1.0, z - 1.0), grad(p(bb + 1), x - 1.0, y - 1.0, z - 1.0)),
                ),
            )
        };
        let mut rng = fastrand::Rng::with_seed(2002);
        for _ in 0..10_000 {
            let [x, y, z] = [(); 3].map(|()| 600.0 * (rng.f64() - 0.5));
            let (found, expected) = (noise(DVec3::new(x, y, z)), by_his_program(x, y, z));
            assert!((found - expected).abs() < 1e-12, "at {x} {y} {z}");
        }
    }
}
