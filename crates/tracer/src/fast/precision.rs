//! Which numbers a scene is traced with.
//!
//! Bounds on the rounding errors of the `f32` kernels are set against the size of a pixel and of a level: what moves an
//! outline or a shadow by less than a small part of a pixel, or a colour by less than a part of a level, cannot be seen.
//! Triangles and boxes need no bound of their own: their errors are relative to the distance of what is seen, as those
//! of the directions are. Which of two surfaces comes first is known, whatever the rounding, if they do not
//! all but [coincide](super::coincidence). What the kernels' numbers cannot hold at all is known here too.

use rayfold_scene::Scene;

use super::beyond::is_needed;
use super::bodies;
use super::coincidence::surfaces_blur;
use super::geometry::{Geometry, View};
use super::glass::SURFACES_OF_ONE;
use super::placed::{Placed, Sight};
use super::real::Real;
use super::shapes::Solid;
use crate::camera::Axis;
use crate::{Precision, RenderOptions};

/// Rounding errors that add up in a ray's direction, in roundoffs.
const DIRECTION: f64 = 3.0;

/// Rounding errors that add up in a point on a sphere, in roundoffs of its distance and radius.
const POINT: f64 = 2.0;

/// The part of a pixel that nothing may move by.
const INVISIBLE: f64 = 0.05;

/// The part of a pixel that shadows and mirrored outlines may move by.
const HARDLY_VISIBLE: f64 = 0.2;

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
    if is_at_eye || !DOUBLE.holds(geometry, scene, &colors) {
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
    let of = |axis: Axis, samples: u32| axis.start.abs().max(axis.at(f64::from(samples - 1)).abs());
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
    if !parallel && DIRECTION * roundoff > INVISIBLE * pixel {
        return false;
    }
    let sight = Sight {
        roundoff,
        pixel,
        parallel,
        normal: SHADE / colors.scattered.max(1.0),
        invisible: INVISIBLE,
        hardly_visible: HARDLY_VISIBLE,
        point: POINT,
    };
    geometry.solids.iter().all(|solid| solid.shape.is_fine(&sight)) && !surfaces_blur(geometry, scene, pixel)
}
