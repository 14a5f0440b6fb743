//! The visible surfaces of a picture, without their light: distance, normal, object and colour.
//!
//! The kernels in double precision find the objects. The data of a hit are computed as the reference tracer does.

use std::borrow::Cow;

use glam::DVec3;
use rayfold_scene::{Fog, Scene, SharedSlice};

use crate::camera::{Rays, Single};
use crate::fast::Finder;
use crate::meshes::{Expanded, Shared};
use crate::parallel::bands_of;
use crate::parts;
use crate::reference::{FirstSurface, FirstSurfaces};
use crate::{RenderError, RenderOptions};

/// The first hit of the ray through the middle of a pixel.
///
/// ```
/// use glam::DVec3;
/// use rayfold_scene::{Camera, Material, Scene, Screen, Sphere};
/// use rayfold_tracer::{FirstHit, RenderOptions, first_hits};
///
/// let mut scene = Scene::new(Screen::new(1, 2)?, Camera::Orthographic);
/// let red = Material::new(DVec3::ZERO, DVec3::X, DVec3::ZERO)?;
/// scene.objects = vec![Sphere::new(0.5, DVec3::new(0.0, 0.0, -5.0), red)?.into()].into();
/// let hits = first_hits(&scene, &RenderOptions::default())?;
/// let ball = FirstHit { depth: 4.5, normal: [0.0, 0.0, 1.0], object: 1, albedo: [1.0, 0.0, 0.0] };
/// assert_eq!(hits, [FirstHit::NOTHING, ball]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstHit {
    /// The distance from the eye along the view axis, in world units. For a camera with parallel rays it is the
    /// distance from the plane in which they start. It is infinite only if nothing is hit.
    pub depth: f32,
    /// The unit normal in the world, on the side of the viewer. For a mesh with normals it is their mean at the hit. It
    /// is 0 if nothing is hit.
    pub normal: [f32; 3],
    /// The position of the object in the script, from 1; 0 if nothing is hit.
    pub object: u32,
    /// The share of light that the surface reflects, from 0 to 1: the sum of its diffuse and its mirror coefficient
    /// with patterns, pictures and colours of meshes. It is 1 for glass, and 0 if nothing is hit.
    pub albedo: [f32; 3],
}

impl FirstHit {
    /// The hit of a ray that hits nothing.
    pub const NOTHING: Self = Self { depth: f32::INFINITY, normal: [0.0; 3], object: 0, albedo: [0.0; 3] };
}

impl Default for FirstHit {
    fn default() -> Self {
        Self::NOTHING
    }
}

/// Returns the surface behind the middle of each pixel of a scene, row by row from the top. The scene is used as it is
/// given, seen through a pinhole and without fog, whatever its lens, its shutter and its number of samples. Uses the
/// current rayon pool.
///
/// # Errors
/// The errors of [`crate::render`].
pub fn first_hits(scene: &Scene, options: &RenderOptions) -> Result<Vec<FirstHit>, RenderError> {
    parts::check(scene)?;
    let dark = Scene { lights: SharedSlice::default(), fog: Fog::default(), ..scene.clone() };
    let finder = Finder::new(&dark, options)?;
    let (ranked, faces) = match &finder {
        Some(finder) => finder.scene(),
        None => (&dark, None),
    };
    let expanded = match &finder {
        Some(_) => Expanded { scene: Cow::Borrowed(ranked), faces },
        None => Expanded::new(Cow::Borrowed(ranked), Shared::NONE),
    };
    let surfaces = FirstSurfaces::new(&expanded);
    let in_script = |object: usize| match &finder {
        Some(finder) => finder.in_script(object),
        None => expanded.faces.as_ref().map_or(object, |faces| faces.origin(object)),
    };
    let rays = Rays::new(&scene.camera, scene.screen, Single::of(scene));
    let forward = rays.forward();
    let (width, height) = (scene.screen.width(), scene.screen.height());
    bands_of::<_, FirstHit, 1>(
        scene.screen,
        0..height,
        1,
        options,
        || (Vec::new(), Vec::new()),
        |(row, found), top, hits| {
            let j = f64::from(height - 1 - top);
            row.clear();
            row.extend((0..width).map(|i| {
                let ray = rays.ray(f64::from(i), j);
                (ray.origin, ray.direction)
            }));
            if let Some(finder) = &finder {
                finder.nearest(row, found);
            }
            for (i, hit) in hits.iter_mut().enumerate() {
                let column = i as f64;
                let surface = match &finder {
                    Some(_) => found[i].and_then(|found| surfaces.of_object(column, j, found.object)),
                    None => surfaces.nearest(column, j),
                };
                let Some(FirstSurface { object, distance, normal, albedo }) = surface else { continue };
                *hit = FirstHit {
                    depth: ((distance * row[i].1.dot(forward)) as f32).min(f32::MAX),
                    normal: single(normal),
                    object: in_script(object) as u32 + 1,
                    albedo: single(albedo),
                };
            }
        },
    )
}

fn single(v: DVec3) -> [f32; 3] {
    v.to_array().map(|x| x as f32)
}
