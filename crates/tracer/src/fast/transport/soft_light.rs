//! Light from suns and lamps that have an extent. Each camera ray has a point of each light, for all its bounces.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;
use rayfold_scene::{Light, Scene};

use crate::fast::acceleration::candidates::Candidates;
use crate::fast::arithmetic::real::{Lanes, Mask, Real, Vec3, constant};
use crate::fast::build::extensions::Extensions;
use crate::fast::build::features::Features;
use crate::fast::build::prepare::Prepared;
use crate::fast::lights::lamp::Rays;
use crate::fast::materials::finish::{Finishes, Lit};
use crate::fast::placement::geometry::Geometry;
use crate::fast::rays::bounce::{Column, Columns, Hits, RayBatch, columns};
use crate::fast::rays::packet::Ray;
use crate::fast::shapes::Shape;
use crate::fast::transport::hulls::{Cone, Hulls, Region};
use crate::fast::transport::light::{Occluders, add_light, region, shows, widened};
use crate::fast::transport::search::{nearest, unoccluded};
use crate::fast::transport::transmittance::{IncidentLight, Panes, Shadow};
use crate::sampling::places::{in_ball, in_cone};
use crate::sampling::{BATCH, Dimensions, Points};

/// The extents of a scene's lights.
#[derive(Debug)]
pub(crate) struct Extents {
    /// For each sun with an extent, the index of its [`LightPoints`].
    suns: Vec<Option<(usize, SoftSun)>>,
    /// The same for each lamp.
    lamps: Vec<Option<(usize, Ball)>>,
    /// The balls and boxes around objects, if they are few.
    hulls: Option<Hulls>,
    /// The same of few bodies.
    bodies: Option<Hulls>,
    /// The first dimension of each of the points.
    dimensions: Vec<usize>,
}

#[derive(Debug)]
struct SoftSun {
    /// The cone's axes. The last one points towards the middle.
    axes: [DVec3; 3],
    spread: f64,
    cone: Cone,
}

#[derive(Clone, Copy, Debug)]
struct Ball {
    middle: DVec3,
    radius: f64,
}

/// Lights with an extent, and their points for the rays of a tile.
#[derive(Clone, Copy)]
pub(crate) struct SoftLight<'a, E> {
    pub(crate) extents: &'a Extents,
    pub(crate) points: &'a LightPoints<E>,
}

/// The objects of the row and the bodies that shadow rays to a light test, as bits: at first, and for glass.
#[derive(Clone, Copy)]
struct Asked {
    first: [u64; 2],
    through: [u64; 2],
}

/// The points of a tile's camera rays: for a sun the unit vector towards it, for a lamp a position.
#[derive(Default)]
pub(crate) struct LightPoints<E> {
    of: Vec<Columns<E>>,
}

impl Extents {
    /// Returns `None` if all lights are points.
    pub(crate) fn new<E: Real>(
        scene: &Scene,
        geometry: &Geometry,
        (shapes, bodies): (Option<&[Shape]>, Option<&[Shape]>),
        dimensions: &Dimensions,
    ) -> Option<Self> {
        let (mut suns, mut lamps, mut firsts) = (vec![], vec![], vec![]);
        for (k, light) in scene.lights.iter().enumerate() {
            let own = dimensions.lights.get(k).copied().flatten().map(|first| {
                firsts.push(first);
                firsts.len() - 1
            });
            match light {
                Light::Directional(_) => {
                    let sun = &geometry.suns[suns.len()];
                    let (x, y) = sun.towards.any_orthonormal_pair();
                    let cone = Cone::new(sun.towards, sun.spread);
                    let axes = [x, y, sun.towards];
                    suns.push(own.map(|own| (own, SoftSun { axes, spread: sun.spread, cone })));
                }
                Light::Lamp(_) => {
                    let lamp = &geometry.lamps[lamps.len()];
                    let ball = Ball { middle: lamp.position, radius: lamp.radius };
                    lamps.push(own.map(|own| (own, ball)));
                }
            }
        }
        let [hulls, bodies] =
            [shapes, bodies].map(|shapes| shapes.map(|shapes| Hulls::new::<E>(shapes.iter())));
        (!firsts.is_empty()).then_some(Self { suns, lamps, hulls, bodies, dimensions: firsts })
    }

    /// Computes the points for the rays of these samples of pixels.
    #[inline(always)]
    pub(crate) fn place<E: Real>(
        &self,
        points: &Points,
        pixel_seeds: &[u32],
        samples: &[u32],
        coordinates: &mut [[f64; BATCH]; 3],
        into: &mut LightPoints<E>,
    ) {
        into.of.resize_with(self.dimensions.len(), columns);
        // Known to lie within the columns, so that the loops have no checks and are done in packets.
        let count = samples.len().min(BATCH);
        for (own, sun) in self.suns.iter().flatten() {
            let first = self.dimensions[*own];
            let [u, v, _] = &mut *coordinates;
            points.coordinates(first, pixel_seeds, samples, &mut u[..count]);
            points.coordinates(first + 1, pixel_seeds, samples, &mut v[..count]);
            let ([x, y, z], spread) = (sun.axes, sun.spread);
            let [to_x, to_y, to_z] = &mut into.of[*own];
            for k in 0..count {
                let at = in_cone(u[k], v[k], spread);
                let towards = at.x * x + at.y * y + at.z * z;
                to_x.0[k] = E::narrow(towards.x);
                to_y.0[k] = E::narrow(towards.y);
                to_z.0[k] = E::narrow(towards.z);
            }
        }
        for (own, ball) in self.lamps.iter().flatten() {
            let first = self.dimensions[*own];
            let [u, v, w] = &mut *coordinates;
            points.coordinates(first, pixel_seeds, samples, &mut u[..count]);
            points.coordinates(first + 1, pixel_seeds, samples, &mut v[..count]);
            points.coordinates(first + 2, pixel_seeds, samples, &mut w[..count]);
            let [to_x, to_y, to_z] = &mut into.of[*own];
            for k in 0..count {
                let place = ball.middle + ball.radius * in_ball(u[k], v[k], w[k]);
                to_x.0[k] = E::narrow(place.x);
                to_y.0[k] = E::narrow(place.y);
                to_z.0[k] = E::narrow(place.z);
            }
        }
    }
}

impl<E: Real> LightPoints<E> {
    /// The points of a packet's camera rays.
    #[inline(always)]
    fn of<S: Simd, const EYE: bool>(&self, simd: S, own: usize, slots: &Column<E>, at: usize) -> Vec3<S, E> {
        let columns = &self.of[own];
        if EYE {
            return Vec3::load(simd, columns, at);
        }
        let mut gathered = [[E::narrow(0.0); 16]; 3];
        for lane in 0..Lanes::<S, E>::LEN {
            let slot = slots.0[at + lane];
            // Lanes that only repeat another have none.
            let slot = if slot.widen() < 0.0 { 0 } else { slot.to_index() };
            for (gathered, column) in gathered.iter_mut().zip(columns) {
                gathered[lane] = column.0[slot];
            }
        }
        Vec3::load(simd, &gathered, 0)
    }
}

/// Adds the light of suns and lamps that reaches the hits past objects and bodies.
#[inline(never)]
pub(crate) fn light_up_softly<S: Simd, E: Real, F: Features<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    soft: SoftLight<E>,
    queue: &RayBatch<E>,
    hits: &mut Hits<E>,
    obstacles: &Occluders,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let SoftLight { extents, points } = soft;
            let zero = constant::<S, E>(simd, 0.0);
            let far = constant::<S, E>(simd, E::FAR);
            let (low, high) = region(simd, hits);
            let from = Region::new(low, high);
            let beyond = scene.beyond.as_ref();
            let lamps = beyond.map_or(&[][..], Extensions::lamps);
            let bodies = beyond.and_then(Extensions::bodies);
            let finishes = beyond.and_then(Extensions::glossy);
            let rough = beyond.and_then(Extensions::rough);
            let glass = beyond.and_then(|beyond| Some((scene, beyond, beyond.glass()?)));
            // Glass is asked for from where rays start again behind other glass.
            let again = {
                let (low, high) = widened(low, high);
                Region::new(low, high)
            };
            let is_apart = scene.glass_apart().is_some();
            let all = |mask: u64| match &extents.hulls {
                Some(_) => Candidates::masked(scene.masks(mask)),
                None if is_apart => Candidates::masked(scene.masks(mask)),
                None => scene.all(),
            };
            let towards_sun = |hulls: &Option<Hulls>, from: &Region, sun: &SoftSun| match hulls {
                Some(hulls) => hulls.towards(from, &sun.cone),
                None => u64::MAX,
            };
            let to_lamp = |hulls: &Option<Hulls>, from: &Region, ball: &Ball| match hulls {
                Some(hulls) => hulls.between(from, ball.middle, ball.radius),
                None => u64::MAX,
            };
            // Of objects and of bodies.
            let all_hulls = [&extents.hulls, &extents.bodies];
            let asked_first = scene.asked_first();
            let first = |[shapes, bodies]: [u64; 2]| [shapes & asked_first[0], bodies & asked_first[1]];
            let sun_masks: Vec<Asked> = extents
                .suns
                .iter()
                .zip(&obstacles.of)
                .map(|(sun, occluders)| match sun {
                    Some((_, sun)) => Asked {
                        first: first(all_hulls.map(|hulls| towards_sun(hulls, &from, sun))),
                        through: match is_apart {
                            true => all_hulls.map(|hulls| towards_sun(hulls, &again, sun)),
                            false => [u64::MAX; 2],
                        },
                    },
                    None => Asked { first: [0, occluders.bodies], through: occluders.through },
                })
                .collect();
            let lamp_masks: Vec<Asked> = extents
                .lamps
                .iter()
                .map(|lamp| match lamp {
                    Some((_, ball)) => Asked {
                        first: first(all_hulls.map(|hulls| to_lamp(hulls, &from, ball))),
                        through: match is_apart {
                            true => all_hulls.map(|hulls| to_lamp(hulls, &again, ball)),
                            false => [u64::MAX; 2],
                        },
                    },
                    None => Asked { first: asked_first, through: [u64::MAX; 2] },
                })
                .collect();
            for &(at, others) in &hits.packets {
                let normal = Vec3::load(simd, &hits.normal, at);
                let start = Vec3::load(simd, &hits.start, at);
                let orders = &hits.order.0[at..at + Lanes::<S, E>::LEN];
                let seen = Ray { origin: start, direction: Vec3::load(simd, &queue.direction, at) };
                let mut gloss = finishes.map(Finishes::gloss);
                let mut sum = Vec3::zero(simd);
                for (index, light) in scene.suns.iter().enumerate() {
                    let own = extents.suns[index].as_ref();
                    let towards = match own {
                        None => light.sun.towards(simd),
                        Some((own, _)) => points.of::<S, EYE>(simd, *own, &queue.pixel, at),
                    };
                    let start = hits.shadow_start(simd, at, towards);
                    let ray = Ray { origin: start, direction: towards };
                    let cosine = normal.dot(towards);
                    let mut facing = cosine.simd_gt(zero);
                    let mut shines = facing;
                    if glass.is_some() {
                        let scatters;
                        (scatters, shines) =
                            shows(simd, hits, at, finishes, (normal, towards, seen.direction));
                        facing &= scatters | shines;
                    }
                    let mut lit = facing;
                    if lit.any_true() {
                        lit = if own.is_some() {
                            let mut candidates = all(sun_masks[index].first[0]);
                            candidates.masks = candidates.masks.and_spheres(others);
                            unmet::<S, E, F>(simd, scene, ray, far, lit, candidates)
                        } else {
                            let candidates = obstacles.of[index].candidates(others, F::KINDS);
                            unoccluded::<S, E, F>(simd, scene, light, start, lit, candidates)
                        };
                    }
                    if let Some(bodies) = bodies
                        && lit.any_true()
                    {
                        lit = bodies.unoccluded(simd, sun_masks[index].first[1], ray, far, lit);
                    }
                    let mut color = Vec3::splat(simd, light.sun.color);
                    if let Some(glass) = glass {
                        let panes = Panes::new(scene, sun_masks[index].through);
                        let arriving = IncidentLight { color, lit };
                        let shadow = Shadow { ray, far };
                        let through = arriving.past_glass::<F>(simd, glass, (facing, panes), shadow);
                        (color, lit) = (through.color, through.lit);
                    }
                    sum = color.scale_add(lit.select(cosine, zero), sum);
                    if let Some(gloss) = &mut gloss {
                        let lit = Lit { lanes: lit & shines, towards, color };
                        gloss.add(lit, (seen, normal), orders);
                        if let Some(paths) = rough {
                            gloss.add_rough(paths, lit, (seen, normal), (orders, &hits.mirror, at));
                        }
                    }
                }
                for (index, lamp) in lamps.iter().enumerate() {
                    let rays_from = |start: Vec3<S, E>| match &extents.lamps[index] {
                        None => lamp.rays(simd, start),
                        Some((own, _)) => {
                            let point = points.of::<S, EYE>(simd, *own, &queue.pixel, at);
                            lamp.rays_to(simd, start, point)
                        }
                    };
                    let Rays { ray, far, part } = rays_from(hits.places(simd, at));
                    let (towards, cosine) = (ray.direction, normal.dot(ray.direction));
                    let (ray, far) = match hits.place[0].is_empty() {
                        true => (ray, far),
                        false => {
                            let Rays { ray, far, .. } = rays_from(hits.shadow_start(simd, at, towards));
                            (ray, far)
                        }
                    };
                    let mut facing = cosine.simd_gt(zero);
                    let mut shines = facing;
                    if glass.is_some() {
                        let scatters;
                        (scatters, shines) =
                            shows(simd, hits, at, finishes, (normal, towards, seen.direction));
                        facing &= scatters | shines;
                    }
                    let mut lit = facing;
                    if let Some(bodies) = bodies
                        && lit.any_true()
                    {
                        lit = bodies.unoccluded(simd, lamp_masks[index].first[1], ray, far, lit);
                    }
                    let mut candidates = all(lamp_masks[index].first[0]);
                    candidates.masks = candidates.masks.and_spheres(others);
                    lit = unmet::<S, E, F>(simd, scene, ray, far, lit, candidates);
                    let mut color = Vec3::splat(simd, lamp.color);
                    if let Some(glass) = glass {
                        let panes = Panes::new(scene, lamp_masks[index].through);
                        let arriving = IncidentLight { color, lit };
                        let shadow = Shadow { ray, far };
                        let through = arriving.past_glass::<F>(simd, glass, (facing, panes), shadow);
                        (color, lit) = (through.color, through.lit);
                    }
                    sum = color.scale_add(lit.select(cosine * part, zero), sum);
                    if let Some(gloss) = &mut gloss {
                        let lit = Lit { lanes: lit & shines, towards, color: color.scale(part) };
                        gloss.add(lit, (seen, normal), orders);
                        if let Some(paths) = rough {
                            gloss.add_rough(paths, lit, (seen, normal), (orders, &hits.mirror, at));
                        }
                    }
                }
                let colors = (&hits.diffuse, &mut hits.color);
                add_light::<S, E, EYE>(simd, queue, at, colors, (sum, gloss, rough.is_some()));
            }
        },
    );
}

/// Returns which of the rays in `lit` hit nothing nearer than `far`.
#[inline(always)]
fn unmet<S: Simd, E: Real, F: Features<E>>(
    simd: S,
    scene: &Prepared<E>,
    ray: Ray<S, E>,
    far: Lanes<S, E>,
    lit: Mask<S, E>,
    candidates: Candidates,
) -> Mask<S, E> {
    if !lit.any_true() || !candidates.kinds.any() {
        return lit;
    }
    let met = nearest::<S, E, F, false>(simd, scene, ray, candidates);
    lit & !met.distance.simd_lt(far)
}
