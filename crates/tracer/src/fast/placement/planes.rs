//! Triangles in one plane share their plane's numbers, so that they are hit at the same distance.
//!
//! Each triangle has its own normal and height, each with its own rounding errors. In `f64` the kernels do not round
//! these numbers again. Without this module, two triangles in one plane would be hit an ulp apart there, and the first
//! in the script would not always win. So triangles whose planes are equal up to rounding get the numbers of the first
//! of them. Planes are looked up by their numbers, quantised to cells.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, DefaultHasher};

use glam::DVec3;

use crate::fast::shapes::triangle;
use crate::fast::shapes::{Shape, Solid};

/// The tolerance below which planes are equal: absolute for the numbers of the normal; for the height relative to the
/// largest coordinate.
const ONE_PLANE: f64 = 1.0 / (1u64 << 46) as f64;

/// The size of a cell for the numbers of a normal.
const CELL: f64 = 1.0 / (1u64 << 36) as f64;

/// The number of low bits of a height that a cell ignores.
const CUT_OFF: u32 = 22;

/// The largest number of planes that are stored per cell. Further planes in a cell are left unchanged.
const REMEMBERED: usize = 8;

/// A direction that is perpendicular to no plane normal in practice, so that the sign of the product with it selects
/// one of the two normals.
const ASIDE: DVec3 = DVec3::new(0.577_215_664_9, 0.302_775_637_7, 0.141_592_653_6);

/// A plane with its normal on the side of [`ASIDE`].
#[derive(Clone, Copy)]
struct Plane {
    normal: DVec3,
    height: f64,
    /// The largest coordinate of the triangle.
    size: f64,
}

impl Plane {
    fn of(triangle: &triangle::RenderSpaceTriangle) -> Self {
        let side = triangle.normal.dot(ASIDE).signum();
        let size = triangle.vertices.iter().map(|v| v.abs().max_element()).fold(0.0, f64::max);
        Self { normal: side * triangle.normal, height: side * triangle.height, size }
    }

    fn is(&self, other: &Self) -> bool {
        (self.normal - other.normal).abs().max_element() <= ONE_PLANE
            && (self.height - other.height).abs() <= ONE_PLANE * self.size.min(other.size)
    }

    /// Returns the cells in which an equal plane may be stored. The first is the plane's own cell.
    fn cells(&self) -> impl Iterator<Item = [i64; 4]> {
        let normal =
            self.normal.to_array().map(|x| [0.0, -ONE_PLANE, ONE_PLANE].map(|d| cell_of_part(x + d)));
        let slack = ONE_PLANE * self.size;
        let height = [0.0, -slack, slack].map(|d| cell_of_height(self.height + d));
        let [x, y, z] = normal.map(distinct);
        let height = distinct(height);
        x.into_iter().flat_map(move |x| {
            y.into_iter().flat_map(move |y| {
                z.into_iter().flat_map(move |z| {
                    height.into_iter().filter_map(move |height| Some([x?, y?, z?, height?]))
                })
            })
        })
    }
}

/// Removes duplicates.
fn distinct([own, below, above]: [i64; 3]) -> [Option<i64>; 3] {
    [Some(own), (below != own).then_some(below), (above != own).then_some(above)]
}

fn cell_of_part(x: f64) -> i64 {
    (x / CELL).round() as i64
}

/// Returns the leading bits of a height: its exponent and the top of its mantissa.
fn cell_of_height(height: f64) -> i64 {
    let bits = (height.abs().to_bits() >> CUT_OFF) as i64;
    if height < 0.0 { -bits } else { bits }
}

/// Gives triangles in one plane the numbers of the first in the script.
pub(crate) fn share(solids: &mut [Solid]) {
    let mut triangles: Vec<(u32, usize)> = solids
        .iter()
        .enumerate()
        .filter(|(_, solid)| matches!(solid.shape, Shape::Triangle(_)))
        .map(|(at, solid)| (solid.order, at))
        .collect();
    triangles.sort_unstable();
    // The same hashes in every run, so that the same scene always takes as many instructions.
    let mut planes: HashMap<[i64; 4], Vec<Plane>, BuildHasherDefault<DefaultHasher>> = HashMap::default();
    for (_, at) in triangles {
        let Shape::Triangle(triangle) = &mut solids[at].shape else { continue };
        let plane = Plane::of(triangle);
        let found = plane.cells().find_map(|cell| planes.get(&cell)?.iter().find(|other| other.is(&plane)));
        match found {
            Some(first) => {
                let side = triangle.normal.dot(first.normal).signum();
                triangle.normal = side * first.normal;
                triangle.height = side * first.height;
            }
            None => {
                let Some(own) = plane.cells().next() else { continue };
                let remembered = planes.entry(own).or_default();
                if remembered.len() < REMEMBERED {
                    remembered.push(plane);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Material, Triangle};

    use super::*;

    fn placed(vertices: [[f64; 3]; 3], center: DVec3) -> Solid {
        let triangle = Triangle::new(vertices.map(DVec3::from), Material::default()).unwrap();
        let placed = triangle::RenderSpaceTriangle::new(triangle.vertices(), center, 1.0 / 16.0).unwrap();
        Solid { shape: Shape::Triangle(placed), order: 0 }
    }

    fn numbers(solid: &Solid) -> (DVec3, f64) {
        let Shape::Triangle(triangle) = solid.shape else { panic!("a triangle") };
        (triangle.normal, triangle.height)
    }

    #[test]
    fn triangles_in_one_slanted_plane_share_its_numbers_and_others_keep_theirs() {
        let eye = DVec3::new(-0.2, -2.9, 4.4);
        let first = [[-1.0, 2.0, 2.0], [1.0, -4.0, -2.0], [2.0, -5.0, 6.0]];
        // One in the plane of the first, one turned the other way, and one above the plane by a millionth.
        let second = [[0.0, 0.0, 5.0], [3.0, -8.0, 4.0], [1.0, -4.0, -2.0]];
        let above = first.map(|[x, y, z]| [x + 1e-6, y, z]);
        let mut solids: Vec<Solid> =
            [first, second, [second[1], second[0], second[2]], above].map(|v| placed(v, eye)).into();
        for (solid, order) in solids.iter_mut().zip([1, 2, 3, 4]) {
            solid.order = order;
        }
        solids.reverse();
        let before: Vec<_> = solids.iter().map(numbers).collect();
        share(&mut solids);
        let after: Vec<_> = solids.iter().map(numbers).collect();
        assert_eq!(after[3], before[3]);
        let either = |of: (DVec3, f64)| [of, (-of.0, -of.1)];
        assert!(either(before[3]).contains(&after[2]) && either(before[3]).contains(&after[1]), "{after:?}");
        assert_eq!(after[0], before[0]);
        for (before, after) in before.iter().zip(&after) {
            assert!((before.0 - after.0).length() < 1e-15 && (before.1 - after.1).abs() < 1e-15);
        }
    }

    #[test]
    fn small_triangles_near_the_eye_are_told_apart() {
        let high = |z: f64| placed([[0.0, 0.0, z], [z, 0.1 * z, 1.2 * z], [0.0, z, z]], DVec3::ZERO);
        let mut solids = vec![high(1e-15), high(1.000_001e-15), high(1.0)];
        let before: Vec<_> = solids.iter().map(numbers).collect();
        share(&mut solids);
        assert_eq!(solids.iter().map(numbers).collect::<Vec<_>>(), before);
    }
}
