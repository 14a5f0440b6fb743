//! Reflection and refraction at a surface of glass.

use glam::DVec3;
use rayfold_scene::Glass;
use rayfold_scene::model::unit;

/// The reflection and refraction of a ray at glass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Refraction {
    /// The reflected share, from 0 to 1, by Fresnel's equations for unpolarised light.
    pub(crate) mirrored: f64,
    /// The direction of the refracted ray; without meaning in total reflection.
    pub(crate) direction: DVec3,
}

/// Refracts a ray of this direction at glass whose `normal` faces it. A ray from `within` leaves the inside. Glass that
/// `is_flat` has no inside, and is entered from both sides.
pub(crate) fn refract(
    glass: Glass,
    direction: DVec3,
    normal: DVec3,
    within: bool,
    is_flat: bool,
) -> Refraction {
    let cosine = -direction.dot(normal);
    let total = Refraction { mirrored: 1.0, direction };
    if cosine <= 0.0 {
        return total;
    }
    // The indices of refraction before and behind the surface.
    let (before, behind) = if within && !is_flat { (glass.ior(), 1.0) } else { (1.0, glass.ior()) };
    let aside = direction + cosine * normal;
    // Snell's law. The ratio may be infinite without this limit, because the larger index has no upper bound.
    let ratio = (before / behind).min(f64::MAX);
    let sine = aside.length() * ratio;
    if sine >= 1.0 {
        return total;
    }
    let cosine_behind = ((1.0 - sine) * (1.0 + sine)).sqrt();
    let part = |a: f64, b: f64| ((a - b) / (a + b)).powi(2);
    let across = part(before * cosine, behind * cosine_behind);
    let along = part(behind * cosine, before * cosine_behind);
    let straight = unit(aside * ratio - cosine_behind * normal);
    Refraction { mirrored: 0.5 * (across + along), direction: if is_flat { direction } else { straight } }
}

/// Returns the normal at which a ray is reflected or refracted at a face: the shading normal, or the face's own normal
/// if the ray would leave on the wrong side of the face. Both face the ray. `glass` is the glass of the face, with
/// whether the ray comes from within and whether it has no inside.
pub(crate) fn onward_normal(
    direction: DVec3,
    normal: DVec3,
    face: DVec3,
    glass: Option<(Glass, bool, bool)>,
) -> DVec3 {
    let mirrored = direction - 2.0 * direction.dot(normal).min(0.0) * normal;
    if mirrored.dot(face) <= 0.0 {
        return face;
    }
    let refraction = glass.map(|(glass, within, is_flat)| refract(glass, direction, normal, within, is_flat));
    let is_above = |bent: Refraction| bent.mirrored < 1.0 && bent.direction.dot(face) >= 0.0;
    if refraction.is_some_and(is_above) { face } else { normal }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(degrees: f64, ior: f64, within: bool, is_flat: bool) -> Refraction {
        let glass = Glass::new(DVec3::ONE, ior).unwrap();
        let angle = degrees.to_radians();
        refract(glass, DVec3::new(angle.sin(), -angle.cos(), 0.0), DVec3::Y, within, is_flat)
    }

    #[test]
    fn glass_mirrors_by_fresnel_and_bends_by_snell() {
        let straight = at(0.0, 1.5, false, false);
        assert!((straight.mirrored - 0.04).abs() < 1e-15 && straight.direction == DVec3::NEG_Y);
        // At Brewster's angle no light polarised along the plane of incidence is reflected.
        let brewster = 1.5f64.atan().to_degrees();
        let across = ((1.0 - 1.5f64.powi(2)) / (1.0 + 1.5f64.powi(2))).powi(2);
        assert!((at(brewster, 1.5, false, false).mirrored - 0.5 * across).abs() < 1e-15);
        let bent = at(30.0, 1.5, false, false).direction;
        assert!((bent.x - 0.5 / 1.5).abs() < 1e-15 && (bent.length() - 1.0).abs() < 1e-15);
        let back = at(bent.x.asin().to_degrees(), 1.5, true, false).direction;
        assert!((back.x - 0.5).abs() < 1e-15);
    }

    #[test]
    fn glass_mirrors_all_beyond_an_angle_and_where_it_is_grazed() {
        assert_eq!(at(42.0, 1.5, true, false).mirrored, 1.0);
        assert!(at(41.0, 1.5, true, false).mirrored < 1.0);
        assert_eq!(at(60.0, 0.5, false, false).mirrored, 1.0);
        assert_eq!(at(90.0, 1.0, false, false).mirrored.round(), 1.0);
        let grazing = refract(Glass::new(DVec3::ONE, 1.0).unwrap(), DVec3::X, DVec3::Y, false, false);
        assert_eq!(grazing.mirrored, 1.0);
        // The critical angle itself, in numbers without rounding: sin = 3/5 and an index of 5/3.
        let glass = Glass::new(DVec3::ONE, 0.6).unwrap();
        assert_eq!(refract(glass, DVec3::new(0.6, -0.8, 0.0), DVec3::Y, false, false).mirrored, 1.0);
    }

    #[test]
    fn flat_glass_and_an_index_of_one_change_no_direction() {
        let pane = at(50.0, 1.5, false, true);
        assert_eq!(pane.direction, DVec3::new(50f64.to_radians().sin(), -50f64.to_radians().cos(), 0.0));
        assert_eq!(pane.mirrored, at(50.0, 1.5, false, false).mirrored);
        assert_eq!(pane, at(50.0, 1.5, true, true), "from both sides");
        let air = at(50.0, 1.0, false, false);
        assert!(air.mirrored < 1e-30 && (air.direction - pane.direction).length() < 1e-15);
    }

    #[test]
    fn indices_of_any_size_give_numbers() {
        for ior in [5e-324, 1e-300, 1e-3, 1e3, 1e300, f64::MAX] {
            for degrees in [0.0, 1e-300, 1.0, 89.0] {
                for within in [false, true] {
                    let found = at(degrees, ior, within, false);
                    assert!((0.0..=1.0).contains(&found.mirrored), "{ior:e} {degrees}: {found:?}");
                    assert!(found.direction.is_finite());
                }
            }
        }
    }
}
