//! Incident light.

use glam::DVec3;
use rayfold_scene::{Light, Scene};

use super::hit::{glass_of, nearest_on};
use super::line::Line;
use super::real::{Real, Vector};

/// The incident light of a source.
pub(super) struct Arriving {
    /// The unit vector towards the source.
    pub(super) towards: Vector,
    /// The colour after absorption and attenuation.
    pub(super) color: Vector,
}

/// Returns the light that arrives at `point`, or `None` if the source is behind the surface, hidden, or at `point`
/// itself. Surfaces nearer than `start` contain `point` and are ignored. With a `lift` the shadow ray starts so far from
/// `point`.
pub(super) fn arriving(
    scene: &Scene,
    light: &Light,
    (point, lift): (&Vector, Option<&Vector>),
    normal: &Vector,
    start: &Real,
) -> Option<Arriving> {
    let mut color = Vector::from(light.color());
    let (towards, distance) = match light {
        Light::Directional(sun) => (Vector::from(sun.direction()).opposite().unit(), None),
        Light::Lamp(lamp) => {
            let way = Vector::from(lamp.position()).minus(point);
            let distance = way.dot(&way).root();
            if distance <= *start {
                return None;
            }
            if lamp.reach() > 0.0 {
                let part = Real::from(lamp.reach()).over(&distance);
                color = Vector::from(DVec3::ZERO).plus(&(&part * &part), &color);
            }
            (way.unit(), Some(&distance - start))
        }
    };
    if normal.dot(&towards).sign() <= 0 {
        return None;
    }
    let one = Real::from(1.0);
    let origin = lift.map_or_else(|| point.clone(), |lift| point.plus(&one, lift));
    let (direction, distance) = match light {
        Light::Lamp(lamp) if lift.is_some() => {
            let way = Vector::from(lamp.position()).minus(&origin);
            (way.unit(), Some(&way.dot(&way).root() - start))
        }
        _ => (towards.clone(), distance),
    };
    let line = Line { origin, direction };
    let mut passed = start.clone();
    while let Some(hit) = nearest_on(&scene.objects, &line, &passed) {
        if distance.as_ref().is_some_and(|distance| hit.t >= *distance) {
            break;
        }
        let glass = glass_of(&scene.objects[hit.object])?;
        color = color.times(&glass.color().into());
        passed = &hit.t + start;
    }
    Some(Arriving { towards, color })
}

/// Returns max(0, N·h)ⁿ, with h halfway between two unit vectors.
pub(super) fn highlight(exponent: f64, normal: &Vector, towards: &Vector, towards_eye: &Vector) -> f64 {
    let one = Real::from(1.0);
    let halfway = towards.plus(&one, towards_eye);
    if halfway.dot(&halfway).sign() == 0 {
        return 0.0;
    }
    let cosine = normal.dot(&halfway.unit());
    if cosine.sign() <= 0 {
        return 0.0;
    }
    // cosⁿ = e^(n·ln(1 - (1 - cos))). The inner difference 1 - cos is exact here.
    (exponent * (-(&one - &cosine).to_f64()).ln_1p()).exp()
}
