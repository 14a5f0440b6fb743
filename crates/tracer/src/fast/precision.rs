//! Which numbers a scene is traced with.
//!
//! Bounds on the rounding errors of the `f32` kernels are set against the size of a pixel and of a level: what moves an
//! outline or a shadow by less than a small part of a pixel, or a colour by less than a part of a level, cannot be seen.
//! Triangles and boxes that are seen need no bound of their own: their errors are relative to the distance of what is
//! seen, as those of the directions are. Those of a shadow are relative to the distance of what casts it, which may be
//! far from where it falls. Which of two surfaces comes first is known, whatever the rounding, if they do not
//! all but [coincide](super::coincidence). What the kernels' numbers cannot hold at all is known here too.
//!
//! The choice does not depend on the order of the objects.

use glam::DVec3;
use rayfold_scene::Scene;

use super::beyond::is_needed;
use super::bodies;
use super::coincidence::surfaces_blur;
use super::geometry::Geometry;
use super::glass::SURFACES_OF_ONE;
use super::placed::{Placed, Sight};
use super::real::Real;
use super::rounding::OFFSET;
use super::shapes::{Shape, Solid};
use super::view::View;
use crate::camera::Axis;
use crate::{Precision, RenderOptions};

/// Rounding errors that add up in an outline that is seen from the eye, in roundoffs of its distance.
///
/// Those of the ray's direction are 3, and a triangle is met up to 16 beside its edges (`Beside::Eye` in the predicate).
const OUTLINE: f64 = 19.0;

/// Rounding errors that add up in a point on a sphere, in roundoffs of its distance and radius.
const POINT: f64 = 2.0;

/// The same in where a ray starts that goes on from a surface, and in the test of what it meets.
const START: f64 = OFFSET + POINT;

/// Rounding errors that add up in the edge of a shadow, in roundoffs of the coordinates of what casts it.
///
/// The direction of the light is rounded: 1 in each of three coordinates. A box has 8 of its test ([`LATE`]) and 1 of its
/// corners; a circle on the sun's screen 4 of each centre's coordinate and as much of the point's; a triangle 4
/// (`Beside::Light`), and 5 of a point's sides. Together 12, and room.
///
/// [`LATE`]: super::rounding::LATE
const SHADOW: f64 = 16.0;

/// Pairs of what casts a shadow and what it may fall on that are looked at before the search is given up.
const PAIRS: usize = 1 << 22;

/// The part of a pixel that nothing may move by.
const INVISIBLE: f64 = 0.05;

/// The error of a normal, as a sine, that stays below a quarter of a level.
const SHADE: f64 = 1e-3;

/// The brightness of a light on a surface at which the rounding of a cosine becomes a level.
const BRIGHTEST: f64 = 1e3;

/// The size of a pixel, as an angle, for an image of one.
const ONE_PIXEL: f64 = 1e-3;

/// What a kind of number can hold.
struct Range {
    /// A solid this much smaller than the scene has products that vanish.
    least: f64,
    /// Slopes of the window's corners that have squares, and colours that are sums of products.
    most: f64,
    /// Positions in the script are whole numbers.
    count: usize,
}

const SINGLE: Range = Range { least: 1e-15, most: 1e15, count: 1 << f32::MANTISSA_DIGITS };
const DOUBLE: Range = Range { least: 1e-100, most: 1e100, count: 1 << 32 };

/// The numbers that are meant by a setting: never [`Precision::Auto`], and none if no kernel can hold the scene.
pub(super) fn resolve(options: &RenderOptions, geometry: &Geometry, scene: &Scene) -> Option<Precision> {
    let colors = Colors::of(scene, options.bounces(scene));
    let is_pinhole = matches!(geometry.view, View::Pinhole { .. });
    // Which side of such a surface the eye is on is decided with more than these numbers.
    let is_at_eye = is_pinhole && geometry.bodies.iter().any(bodies::Solid::is_at_origin);
    if is_at_eye || !DOUBLE.holds(geometry, scene, &colors) || is_too_deep(&geometry.view) {
        return None;
    }
    // The errors of what few scenes have are bounded for `f64` alone.
    let single = !is_needed(geometry)
        && match options.precision {
            Precision::F64 => false,
            Precision::F32 => SINGLE.holds(geometry, scene, &colors),
            Precision::Auto => SINGLE.holds(geometry, scene, &colors) && is_enough(geometry, scene, &colors),
        };
    Some(if single { Precision::F32 } else { Precision::F64 })
}

/// Whether parallel rays go so far that the errors of `f64` there can be seen in a pixel.
fn is_too_deep(view: &View) -> bool {
    match *view {
        View::Parallel { pixel, .. } => START * <f64 as Real>::ROUNDOFF > INVISIBLE * pixel,
        View::Pinhole { .. } => false,
    }
}

impl Range {
    fn holds(&self, geometry: &Geometry, scene: &Scene, colors: &Colors) -> bool {
        let widest = match geometry.view {
            View::Parallel { .. } => 1.0,
            View::Pinhole { x, y, .. } => {
                let (x, y) = widest((x, y), (scene.screen.width(), scene.screen.height()));
                x.max(y)
            }
        };
        let is_held = |solid: &Solid| {
            let (min, max) = solid.shape.bounds();
            let size = (max - min).max_element();
            size == 0.0 || size > self.least
        };
        // Written so that what is not a number is not held.
        widest < self.most
            && colors.largest < self.most
            && scene.objects.len() < self.count
            && geometry.solids.iter().all(is_held)
    }
}

/// How bright a scene can become.
struct Colors {
    /// At least every sum of colours on the way to a pixel's.
    largest: f64,
    /// Light that a surface can scatter: what an error of a cosine is multiplied by.
    scattered: f64,
    /// Whether terms of different signs can cancel.
    signed: bool,
}

impl Colors {
    fn of(scene: &Scene, bounces: u32) -> Self {
        let mut arriving: f64 = scene.lights.iter().map(|light| light.color().abs().max_element()).sum();
        let (mut ambient, mut diffuse, mut mirror, mut least) = (0f64, 0f64, 0f64, 0f64);
        // What glass sends on besides.
        let mut through = 0f64;
        for object in scene.objects.iter() {
            let material = object.material();
            ambient = ambient.max(material.ambient().abs().max_element());
            diffuse = diffuse.max(material.diffuse().abs().max_element());
            mirror = mirror.max(material.mirror().abs().max_element());
            let signs = material.ambient().min(material.diffuse()).min(material.mirror());
            least = least.min(signs.min_element());
            // Such scenes are drawn in `f64`: only what that holds matters.
            let Some(finish) = material.finish() else { continue };
            if let Some(other) = finish.pattern.map(|pattern| pattern.other) {
                ambient = ambient.max(other.ambient().abs().max_element());
                diffuse = diffuse.max(other.diffuse().abs().max_element());
                mirror = mirror.max(other.mirror().abs().max_element());
            }
            if let Some(shine) = finish.shine {
                diffuse = diffuse.max(shine.color().abs().max_element());
            }
            if let Some(glass) = finish.glass {
                let most = glass.color().abs().max_element().max(1.0);
                through = through.max(most);
                arriving *= most.powi(SURFACES_OF_ONE as i32);
            }
        }
        mirror += through;
        for light in scene.lights.iter() {
            least = least.min(light.color().min_element());
        }
        let scattered = arriving * diffuse;
        let seen = |weight: f64, _| weight * mirror + ambient.max(1.0) + scattered;
        let largest = (0..=bounces).fold(1.0, seen).max(mirror.powi(bounces as i32));
        Self { largest, scattered, signed: least < 0.0 }
    }
}

/// The largest slopes across and along the window.
fn widest((x, y): (Axis, Axis), size: (u32, u32)) -> (f64, f64) {
    let of = |axis: Axis, samples: u32| axis.at(0.0).abs().max(axis.at(f64::from(samples - 1)).abs());
    (of(x, size.0), of(y, size.1))
}

/// Whether the errors of single precision cannot be seen.
fn is_enough(geometry: &Geometry, scene: &Scene, colors: &Colors) -> bool {
    let roundoff = <f32 as Real>::ROUNDOFF;
    // Where colours only add up, those that are not clipped in the end are sums of small ones.
    if colors.scattered > BRIGHTEST || colors.signed && colors.largest > BRIGHTEST {
        return false;
    }
    // Pixels per unit: an angle from the eye, a length in parallel projection.
    let pixel = match geometry.view {
        View::Parallel { pixel, .. } => pixel,
        View::Pinhole { x, y, .. } => {
            let size = (scene.screen.width(), scene.screen.height());
            let (across, along) = widest((x, y), size);
            let farthest = 1.0 + across * across + along * along;
            let steps = [x.step, y.step].map(f64::abs).into_iter().filter(|step| *step > 0.0);
            // Pixels at the window's corners are the smallest from the eye.
            steps.reduce(f64::min).unwrap_or(ONE_PIXEL) / farthest
        }
    };
    let parallel = matches!(geometry.view, View::Parallel { .. });
    if !parallel && OUTLINE * roundoff > INVISIBLE * pixel {
        return false;
    }
    let sight = Sight {
        roundoff,
        pixel,
        parallel,
        normal: SHADE / colors.scattered.max(1.0),
        invisible: INVISIBLE,
        point: POINT,
        start: START,
    };
    geometry.solids.iter().all(|solid| solid.shape.is_fine(&sight))
        && are_shadows_fine(geometry, &sight)
        && !surfaces_blur(geometry, scene, pixel)
}

/// Whether the errors of shadows cannot be seen where these fall: no nearer to the eye than the nearest surface, nor than
/// their edges pass it.
fn are_shadows_fine(geometry: &Geometry, sight: &Sight) -> bool {
    if geometry.suns.is_empty() {
        return true;
    }
    let nearest = geometry.nearest();
    let (min, max) = geometry.whole();
    if sight.is_invisible(SHADOW * min.abs().max(max.abs()).length(), nearest) {
        return true;
    }
    let mut left = PAIRS;
    geometry.suns.iter().all(|sun| {
        let (x, y) = sun.towards.any_orthonormal_pair();
        geometry.solids.iter().all(|Solid { shape, .. }| {
            let error = SHADOW * shape.farthest();
            sight.is_invisible(error, nearest)
                || sight.is_invisible(error, shape.shadow_nearest(x, y))
                || has_nothing_behind(shape, sun.towards, error * sight.roundoff, geometry, &mut left)
        })
    })
}

/// Whether a flat solid hides the light of a sun from none: all others lie before its plane, but for a `slack`. False where
/// `left` comparisons are not enough.
fn has_nothing_behind(
    shape: &Shape,
    towards: DVec3,
    slack: f64,
    geometry: &Geometry,
    left: &mut usize,
) -> bool {
    let Some(normal) = shape.plane() else { return false };
    let behind = if normal.dot(towards) > 0.0 { -normal } else { normal };
    let depth = shape.support(behind) + slack;
    *left = left.saturating_sub(geometry.solids.len());
    *left > 0 && geometry.solids.iter().all(|other| other.shape.support(behind) <= depth)
}
