//! The first hit of a ray.

use glam::DVec3;
use rayfold_scene::{Glass, Object};

use super::line::Line;
use super::real::{Real, Vector};
use super::shapes;

/// The first hit of a ray with an object.
#[derive(Clone, Debug)]
pub struct Hit {
    /// The position of the object in the script.
    pub object: usize,
    /// The distance along the ray, in units of the length of its direction.
    pub t: Real,
    /// The unit normal, facing the ray. On the edge of a box it is the normal of the first axis whose face leads to
    /// that edge; on a rim it is the normal of the side.
    pub normal: Vector,
    /// Whether the ray leaves the object: its outward normal points along the ray (positive dot product).
    pub(super) leaves: bool,
}

/// Returns the nearest hit of a ray that is exact in `f64`.
pub fn nearest(objects: &[Object], origin: DVec3, direction: DVec3) -> Option<Hit> {
    nearest_on(objects, &Line { origin: origin.into(), direction: direction.into() }, &Real::zero())
}

/// Returns the nearest hit farther than `start` of an exact ray. Distances are in units of the length of the direction.
pub fn nearest_beyond(objects: &[Object], origin: &Vector, direction: &Vector, start: &Real) -> Option<Hit> {
    nearest_on(objects, &Line { origin: origin.clone(), direction: direction.clone() }, start)
}

/// Returns the nearest hit farther than `start`. If several objects are hit at the same distance, the first one without
/// glass wins, or else the first. Distances that differ by less than one part in 2^400 are equal, because roots are
/// rounded.
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

/// Returns the glass of an object, if its material has one.
pub(super) fn glass_of(object: &Object) -> Option<Glass> {
    object.material().finish().and_then(|finish| finish.glass)
}
