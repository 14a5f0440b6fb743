//! Which object a ray meets first.

use glam::DVec3;
use rayfold_scene::{Glass, Object};

use super::line::Line;
use super::real::{Real, Vector};
use super::shapes;

/// Where a ray meets an object first.
#[derive(Clone, Debug)]
pub struct Hit {
    /// Position of the object in the script.
    pub object: usize,
    /// In lengths of the direction.
    pub t: Real,
    /// Unit normal, facing the ray. On the edge of a box that of the first axis which leads there, on a rim the side's.
    pub normal: Vector,
    /// Whether normals that point out of the object point along the ray.
    pub(super) leaves: bool,
}

/// The nearest hit of the ray exactly as given.
pub fn nearest(objects: &[Object], origin: DVec3, direction: DVec3) -> Option<Hit> {
    nearest_on(objects, &Line { origin: origin.into(), direction: direction.into() }, &Real::zero())
}

/// The nearest hit farther than `start`, in lengths of the direction, of a ray that is itself without rounding.
pub fn nearest_beyond(objects: &[Object], origin: &Vector, direction: &Vector, start: &Real) -> Option<Hit> {
    nearest_on(objects, &Line { origin: origin.clone(), direction: direction.clone() }, start)
}

/// The nearest hit farther away than `start`; of hits at the same distance that of the first object without glass, or else of
/// the first. Distances that differ by less than one part in 2^400 are the same: roots are rounded.
pub(super) fn nearest_on(objects: &[Object], line: &Line, start: &Real) -> Option<Hit> {
    let mut best: Option<(usize, Real)> = None;
    for (index, object) in objects.iter().enumerate() {
        let Some(t) = shapes::first(object, line, start) else { continue };
        let is_before = best.as_ref().is_none_or(|(other, least)| {
            let hair = t.shifted(-400);
            let before_glass = glass_of(object).is_none() && glass_of(&objects[*other]).is_some();
            if before_glass { t <= least + &hair } else { &t + &hair < *least }
        });
        if is_before {
            best = Some((index, t));
        }
    }
    let (object, t) = best?;
    let (normal, leaves) = shapes::normal(&objects[object], line, &t);
    Some(Hit { object, t, normal, leaves })
}

/// What an object lets through.
pub(super) fn glass_of(object: &Object) -> Option<Glass> {
    object.material().finish().and_then(|finish| finish.glass)
}
