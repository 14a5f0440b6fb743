//! The choice of the precision in which a scene is traced.
//!
//! Bounds on the rounding errors of the `f32` kernels are compared with the size of a pixel and of a level. An error is
//! invisible if it moves an outline or a shadow by less than a small part of a pixel, or a colour by less than a part
//! of a level. Visible triangles and boxes need no bound of their own: their errors are relative to their distance, as
//! those of the directions are. The errors of a shadow are relative to the distance of its occluder, which may be far
//! from the shadow. The order of two surfaces does not depend on rounding if they do not nearly
//! [coincide](crate::fast::placement::coincidence). This module also detects scenes whose numbers the kernels cannot represent at all.
//!
//! The choice does not depend on the order of the objects.

use glam::DVec3;
use rayfold_scene::{Object, Scene};

use crate::camera::Axis;
use crate::fast::arithmetic::real::Real;
use crate::fast::arithmetic::rounding::{OFFSET, side_of_going_on};
use crate::fast::bodies;
use crate::fast::build::extensions::needs_double;
use crate::fast::materials::glass::SURFACES_OF_ONE;
use crate::fast::placement::coincidence::surfaces_z_fight;
use crate::fast::placement::geometry::Geometry;
use crate::fast::rays::placed::{RenderSpaceShape, Sight};
use crate::fast::rays::view::View;
use crate::fast::shapes::{Shape, Solid};
use crate::parallel::all;
use crate::{Precision, RenderOptions};

/// The accumulated rounding error of an outline as seen from the eye, in roundoffs of its distance.
///
/// The ray's direction has an error of 3, and a triangle can be hit up to 16 beside its edges (`Beside::Eye` in the
/// predicate).
const OUTLINE: f64 = 19.0;

/// The accumulated rounding error of a point on a sphere, in roundoffs of its distance and radius.
const POINT: f64 = 2.0;

/// The accumulated rounding error of the start of a ray from a surface and of the test of the next hit, in the same
/// roundoffs.
const START: f64 = OFFSET + POINT;

/// The accumulated rounding error of the edge of a shadow, in roundoffs of the occluder's coordinates.
///
/// The direction of the light is rounded: 1 in each of three coordinates. A box has 8 of its test ([`LATE`]) and 1 of
/// its corners. A circle on the sun's screen has 4 of each coordinate of the centre and as much of the point's. A
/// triangle has 4 (`Beside::Light`), and 5 of a point's sides. The sum is 12; the rest is margin.
///
/// [`LATE`]: crate::fast::arithmetic::rounding::LATE
const SHADOW: f64 = 16.0;

/// The accumulated rounding error of the point in a face at which its normals are interpolated, in roundoffs of its
/// distance: 6 of the ray's direction and of the distance along it, and 8 of the sides of the edges.
const MIXED: f64 = 16.0;

/// The number of pairs of an occluder and a possible receiver after which the search is given up.
const PAIRS: usize = 1 << 22;

/// The number of triangles in whose shadows rays may always be in doubt, and the largest share of all triangles.
const IN_DOUBT: (usize, f64) = (64, 0.125);

/// The largest invisible error of a position, in pixels.
const INVISIBLE: f64 = 0.05;

/// The error of a normal, as a sine, that stays below a quarter of a level.
const SHADE: f64 = 1e-3;

/// The brightness of a light on a surface at which the rounding error of a cosine becomes a level.
const BRIGHTEST: f64 = 1e3;

/// The size of a pixel, as an angle, for an image of one pixel.
const ONE_PIXEL: f64 = 1e-3;

/// The limits of a number type.
struct Range {
    /// The size of a solid, relative to the scene, below which its products underflow.
    least: f64,
    /// The upper limit for the slopes of the window's corners, which are squared, and for colours, which are sums of
    /// products.
    most: f64,
    /// The upper limit for positions in the script, which are stored as whole numbers.
    count: u64,
}

const SINGLE: Range = Range { least: 1e-15, most: 1e15, count: 1 << f32::MANTISSA_DIGITS };
const DOUBLE: Range = Range { least: 1e-100, most: 1e100, count: 1 << 32 };

/// Returns the precision of a setting. It is never [`Precision::Auto`], and `None` if no kernel can represent the
/// scene.
pub(crate) fn resolve(options: &RenderOptions, geometry: &Geometry, scene: &Scene) -> Option<Precision> {
    let colors = Colors::of(geometry, scene, options.bounces(scene));
    let is_pinhole = matches!(geometry.view, View::Pinhole { .. });
    // These numbers are not precise enough to decide on which side of such a surface the eye is.
    let is_at_eye = is_pinhole && geometry.bodies.iter().any(bodies::Solid::is_at_origin);
    if is_at_eye || !DOUBLE.holds(geometry, scene, &colors) || is_too_deep(&geometry.view) {
        return None;
    }
    // The errors of most extensions have bounds for `f64` alone, and pictures may have many pixels.
    let single = !needs_double(geometry)
        && !bends_rays(geometry, scene)
        && scene.sky_picture().is_none()
        && match options.precision {
            Precision::F64 => false,
            Precision::F32 => SINGLE.holds(geometry, scene, &colors),
            Precision::Auto => SINGLE.holds(geometry, scene, &colors) && is_enough(geometry, scene, &colors),
        };
    Some(if single { Precision::F32 } else { Precision::F64 })
}

/// Returns whether faces with normals of their own spawn rays, or pixels have several rays from such faces. In these
/// cases the errors of normals have bounds only for `f64`.
fn bends_rays(geometry: &Geometry, scene: &Scene) -> bool {
    let is_mirror = |object: &Object| object.material().mirror() != DVec3::ZERO;
    geometry.faces.is_some() && (scene.samples.most() > 1 || geometry.examples(scene).any(is_mirror))
}

/// Returns whether the errors of the normals of faces are invisible.
fn are_normals_fine(geometry: &Geometry, sight: &Sight) -> bool {
    let Some(faces) = &geometry.faces else { return true };
    let nearest = if sight.parallel { 1.0 } else { 0.0 };
    MIXED * sight.roundoff * faces.steepest((geometry.center, geometry.scale), nearest) <= sight.normal
}

/// Returns whether parallel rays go so far that the errors of `f64` there are visible in a pixel.
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
        // Written so that a NaN is rejected.
        widest < self.most
            && colors.largest < self.most
            && (scene.objects.len() as u64) < self.count
            && all(&geometry.solids, is_held)
    }
}

/// The brightness that a scene can reach.
struct Colors {
    /// An upper bound of every sum of colours on the way to a pixel.
    largest: f64,
    /// The light that a surface can scatter: the factor of an error of a cosine.
    scattered: f64,
    /// Whether terms of different signs can cancel.
    signed: bool,
}

impl Colors {
    fn of(geometry: &Geometry, scene: &Scene, bounces: u32) -> Self {
        let mut arriving: f64 = scene.lights.iter().map(|light| light.color().abs().max_element()).sum();
        let (mut ambient, mut diffuse, mut mirror, mut least) = (0f64, 0f64, 0f64, 0f64);
        // The additional light that glass transmits.
        let mut through = 0f64;
        let mut glow = 0f64;
        for object in geometry.examples(scene) {
            let material = object.material();
            ambient = ambient.max(material.ambient().abs().max_element());
            diffuse = diffuse.max(material.diffuse().abs().max_element());
            mirror = mirror.max(material.mirror().abs().max_element());
            let signs = material.ambient().min(material.diffuse()).min(material.mirror());
            least = least.min(signs.min_element());
            // Such scenes are drawn in `f64`, so only its limits matter.
            let Some(finish) = material.finish() else { continue };
            glow = glow.max(finish.glow.abs().max_element());
            if let Some(other) = finish.pattern.map(|pattern| pattern.other) {
                ambient = ambient.max(other.ambient().abs().max_element());
                diffuse = diffuse.max(other.diffuse().abs().max_element());
                mirror = mirror.max(other.mirror().abs().max_element());
            }
            if let Some(shine) = finish.shine {
                diffuse = diffuse.max(shine.color().abs().max_element());
            }
            if let Some(glass) = finish.glass {
                through = through.max(glass.color().abs().max_element().max(1.0));
            }
        }
        if through > 1.0 {
            // Each surface can be passed.
            for object in scene.objects.iter() {
                let glass = object.material().finish().and_then(|finish| finish.glass);
                let most = glass.map_or(1.0, |glass| glass.color().abs().max_element().max(1.0));
                arriving *= most.powi(SURFACES_OF_ONE as i32);
            }
        }
        mirror += through;
        ambient += glow;
        for light in scene.lights.iter() {
            least = least.min(light.color().min_element());
        }
        if let Some((fog, _)) = scene.fog.get() {
            ambient += fog.abs().max_element();
            least = least.min(fog.min_element());
        }
        let scattered = arriving * diffuse;
        let around = brightest_around(scene);
        let seen = |weight: f64, _| weight * mirror + ambient.max(around) + scattered;
        let largest = (0..=bounces).fold(around, seen).max(mirror.powi(bounces as i32));
        Self { largest, scattered, signed: least < 0.0 }
    }
}

/// Returns a bound of the light of rays that hit nothing, at least 1.
fn brightest_around(scene: &Scene) -> f64 {
    let (low, high) = scene.surroundings().colors();
    let of_picture =
        scene.sky_picture().map_or(0.0, |(file, turn)| turn.strength() * file.picture().largest());
    [low, high.unwrap_or(low)]
        .map(|color| color.max_element())
        .into_iter()
        .fold(of_picture.max(1.0), f64::max)
}

/// Returns the largest slopes across and along the window.
fn widest((x, y): (Axis, Axis), size: (u32, u32)) -> (f64, f64) {
    let of = |axis: Axis, samples: u32| axis.at(0.0).abs().max(axis.at(f64::from(samples - 1)).abs());
    (of(x, size.0), of(y, size.1))
}

/// Returns whether the errors of single precision are invisible.
fn is_enough(geometry: &Geometry, scene: &Scene, colors: &Colors) -> bool {
    let roundoff = <f32 as Real>::ROUNDOFF;
    // If colours only add up, those that are not clipped in the end are sums of small ones.
    if colors.scattered > BRIGHTEST || colors.signed && colors.largest > BRIGHTEST {
        return false;
    }
    // The size of a pixel: an angle from the eye, or a length in parallel projection.
    let pixel = match geometry.view {
        View::Parallel { pixel, .. } => pixel,
        View::Pinhole { x, y, .. } => {
            let size = (scene.screen.width(), scene.screen.height());
            let (across, along) = widest((x, y), size);
            let farthest = 1.0 + across * across + along * along;
            let steps = [x.step, y.step].map(f64::abs).into_iter().filter(|step| *step > 0.0);
            // Pixels at the window's corners have the smallest angle from the eye.
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
    all(&geometry.solids, |solid| solid.shape.is_fine(&sight))
        && are_normals_fine(geometry, &sight)
        && !are_shadows_in_doubt(geometry, roundoff)
        && are_shadows_fine(geometry, &sight)
        && !surfaces_z_fight(geometry, scene, pixel)
}

/// Returns whether many triangles are so small compared with the scene that each ray towards a sun that passes near one
/// is in doubt, and must be decided exactly. That takes hundreds of times as long as a ray in `f64`, which is not in
/// doubt.
fn are_shadows_in_doubt(geometry: &Geometry, roundoff: f64) -> bool {
    // The width of the doubt at an edge, for points of coordinates up to 1 (`Prism`).
    let width = 2.0 * side_of_going_on::<f32>() * roundoff;
    let is_triangle = |solid: &Solid| matches!(solid.shape, Shape::Triangle(_));
    let is_small = |solid: &Solid| {
        let (min, max) = solid.shape.bounds();
        is_triangle(solid) && (max - min).max_element() < width
    };
    if geometry.suns.is_empty() || all(&geometry.solids, |solid| !is_small(solid)) {
        return false;
    }
    let count = |is: &dyn Fn(&Solid) -> bool| geometry.solids.iter().filter(|solid| is(solid)).count();
    let small = count(&is_small);
    small > IN_DOUBT.0 && small as f64 > IN_DOUBT.1 * count(&is_triangle) as f64
}

/// Returns whether the errors of shadows are invisible where they fall. That is no nearer to the eye than the nearest
/// surface, and no nearer than the shadow's edge passes the eye.
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

/// Returns whether a flat solid casts no shadow on others, because all others are in front of its plane except for a
/// `slack`. Returns false if `left` comparisons are not enough.
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
