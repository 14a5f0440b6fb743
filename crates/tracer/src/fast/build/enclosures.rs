//! The objects that a ray can hit while it is within an object of glass: that object, and those that reach into the box
//! around it.
//!
//! A ray within a sphere or a box leaves it at its next hit with it. Up to there it is in the box around the object. So
//! if all rays of a packet are within the same object and hit it again, only the objects that reach into that box are
//! tested.

use crate::fast::acceleration::candidates::Masks;
use crate::fast::rays::bounds::Bounds;
use crate::fast::rays::kind::{ByKind, Kind, Row};
use crate::fast::rays::placed::RenderSpaceShape;
use crate::fast::shapes::Solid;

/// The distance from the surface of an object within which a ray in the object may start, and within which it may hit
/// another object outside, in the kernels' coordinates. Both are millions of times smaller in double precision, in
/// which glass is drawn.
const ROOM: f64 = 1e-6;

/// An object of glass that has an inside.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Enclosure {
    pub(crate) kind: Kind,
    /// The index in the array of its kind.
    pub(crate) index: u32,
    /// The other objects that a ray within it can hit.
    pub(crate) others: Masks,
}

/// Returns the enclosures by the orders of the objects. `in_row` are all solids in the order of the row, at most as
/// many as a mask has bits. `has_inside` returns whether the object of an order is of glass and has an inside.
pub(crate) fn enclosures(
    in_row: &[&Solid],
    (row, counts): (Row, ByKind<usize>),
    has_inside: impl Fn(u32) -> bool,
) -> Vec<Option<Enclosure>> {
    let mut all = vec![];
    for (place, solid) in in_row.iter().enumerate() {
        let (kind, index) = row.find(place as u32);
        if kind == Kind::Triangle || !has_inside(solid.order) {
            continue;
        }
        let mut others = 0;
        for (bit, other) in in_row.iter().enumerate() {
            others |= u64::from(bit != place && reaches_into(solid, other)) << bit;
        }
        let order = solid.order as usize;
        if all.len() <= order {
            all.resize(order + 1, None);
        }
        all[order] = Some(Enclosure { kind, index, others: Masks::split(others, row, counts) });
    }
    all
}

/// Returns whether a solid may reach into the ball or the box around another, to within [`ROOM`].
fn reaches_into(solid: &Solid, other: &Solid) -> bool {
    let ((low, high), (from, to)): (Bounds, Bounds) = (solid.shape.bounds(), other.shape.bounds());
    let overlap = (from - ROOM).cmple(high).all() && (to + ROOM).cmpge(low).all();
    match (solid.shape.ball(), other.shape.ball()) {
        (Some((center, radius)), Some((other, its))) => center.distance(other) <= radius + its + ROOM,
        (Some((center, radius)), None) => center.distance(center.clamp(from, to)) <= radius + ROOM,
        (None, _) => overlap,
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use rayfold_scene::{Cuboid, Material, Object, Sphere};

    use super::*;
    use crate::fast::acceleration::candidates::CandidateSet;
    use crate::fast::shapes::Shape;
    use crate::fast::shapes::shape::Items;

    fn ball(radius: f64, x: f64) -> Object {
        Sphere::new(radius, DVec3::X * x, Material::default()).unwrap().into()
    }

    fn cube(half: f64, place: DVec3) -> Object {
        Cuboid::new([place - half, place + half], Material::default()).unwrap().into()
    }

    #[test]
    fn what_reaches_into_an_object_is_known() {
        let at = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        // A ball with a bubble, one that touches it, one apart; a cube in whose corner is no part of the ball, one that cuts it.
        let objects = [
            ball(0.2, 0.0),
            ball(0.1, 0.0),
            ball(0.1, 0.3),
            ball(0.1, 0.8),
            cube(0.05, at(0.2, 0.2)),
            cube(0.1, at(-0.2, 0.0)),
        ];
        let solids: Vec<Solid> = (0..)
            .zip(&objects)
            .map(|(order, object)| Solid { shape: Shape::new(object, DVec3::ZERO, 1.0).unwrap(), order })
            .collect();
        let in_row: Vec<&Solid> = solids.iter().collect();
        let counts = ByKind { spheres: 4, cuboids: 2, triangles: 0 };
        let found = enclosures(&in_row, (Row::new(counts), counts), |order| order != 1);
        let bits = |order: usize| {
            let others = found[order]?.others;
            let of = |kind: Kind| others.of(kind).of(&[(); 8]).map(|(at, _)| at).collect::<Vec<_>>();
            Some((of(Kind::Sphere), of(Kind::Cuboid)))
        };
        assert_eq!(bits(0), Some((vec![1, 2], vec![1])));
        assert_eq!(bits(1), None);
        assert_eq!(bits(2), Some((vec![0], vec![])));
        assert_eq!(bits(3), Some((vec![], vec![])));
        assert_eq!(bits(4), Some((vec![0], vec![])));
    }
}
