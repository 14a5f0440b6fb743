//! Finishes beyond the coefficients that all surfaces have: highlights, patterns of other coefficients, pictures, and glow.
//!
//! They are computed lane by lane, with the functions of the plain tracer. Only few pixels need them, and their powers
//! and lattices must give the same bytes everywhere. Patterns depend on the numbers of the script, so a hit is
//! converted back to the script's coordinates.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;
use rayfold_scene::model::{Finish, Shine};
use rayfold_scene::{Coefficients, ImageMap, Object, Scene, Tone};

use crate::fast::arithmetic::real::{Lanes, Mask, Real, Vec3, constant};
use crate::fast::materials::paths::Paths;
use crate::fast::placement::geometry::Geometry;
use crate::fast::rays::bounce::{Column, Hits, ROOM, RayBatch};
use crate::fast::rays::packet::Ray;
use crate::parallel::map;
use crate::reference::{self, coefficients, highlight};

/// The surfaces of a scene that uses some of these.
#[derive(Debug)]
pub(crate) struct Finishes {
    scene: Scene,
    center: DVec3,
    scale: f64,
    pub(crate) has_patterns: bool,
    pub(crate) has_highlights: bool,
    /// The glow of each object; empty if none glows.
    glows: Vec<DVec3>,
    /// The square of the cosine from which the highlights of each object can be seen: [`NEVER`] without highlights, and
    /// negative if they can be seen from anywhere.
    least_cosines: Vec<f32>,
    /// The mirror coefficients of each object, and whether its coefficients depend on the position of the hit. Empty if
    /// they are not needed: without patterns and rough mirrors.
    mirrors: Vec<(DVec3, bool)>,
    /// The highlights of each object; empty if none has any.
    shines: Vec<Option<Shine>>,
}

/// A value above the square of any cosine.
const NEVER: f32 = 2.0;

/// The brightness below which no highlight is visible.
const UNSEEN: f64 = 1.0 / (1u64 << 63) as f64;

/// The highlights of a packet of hits.
pub(crate) struct Gloss<'a> {
    finishes: &'a Finishes,
    sum: [DVec3; 16],
    /// The highlights on rough mirrors, times the weights of the rays.
    of_mirrors: [DVec3; 16],
    /// Whether any light adds a highlight.
    pub(crate) is_seen: bool,
}

impl Finishes {
    /// Returns `None` if no object has any of these.
    pub(crate) fn new(scene: &Scene, geometry: &Geometry) -> Option<Self> {
        let finishes = || scene.objects.iter().filter_map(|object| object.material().finish());
        finishes().next()?;
        let has_patterns = finishes().any(is_painted);
        let has_highlights = finishes().any(|finish| finish.shine.is_some());
        let glow = |object: &Object| object.material().finish().map_or(DVec3::ZERO, |finish| finish.glow);
        let glows = if finishes().any(|finish| finish.glow != DVec3::ZERO) {
            scene.objects.iter().map(glow).collect()
        } else {
            vec![]
        };
        let (center, scale) = (geometry.center, geometry.scale);
        // Looked up only where there is glass.
        let is_glass = |finish: &Finish| finish.glass.is_some();
        let least_cosines = if finishes().any(is_glass) {
            let light: f64 = scene.lights.iter().map(|light| light.color().abs().max_element()).sum();
            let of = |finish: &Finish| least_cosine(finish, light);
            map(&scene.objects, |object| object.material().finish().map_or(NEVER, of))
        } else {
            vec![]
        };
        let shine = |object: &Object| object.material().finish().and_then(|finish| finish.shine);
        let shines = if has_highlights { map(&scene.objects, shine) } else { vec![] };
        let is_painted = |object: &Object| object.material().finish().is_some_and(is_painted);
        let mirrors = if has_patterns || finishes().any(|finish| finish.rough.is_some()) {
            map(&scene.objects, |object| (object.material().mirror(), is_painted(object)))
        } else {
            vec![]
        };
        let scene = scene.clone();
        Some(Self {
            scene,
            center,
            scale,
            has_patterns,
            has_highlights,
            glows,
            least_cosines,
            mirrors,
            shines,
        })
    }

    /// Whether any object glows.
    #[inline(always)]
    pub(crate) fn glows(&self) -> bool {
        !self.glows.is_empty()
    }

    /// Adds the glow of the objects to the colours of the hits. With `EYE` the rays have a weight of 1.
    #[inline(never)]
    pub(crate) fn glow<E: Real, const EYE: bool>(
        &self,
        queue: &RayBatch<E>,
        hits: &mut Hits<E>,
        lanes: usize,
    ) {
        for &(at, _) in &hits.packets {
            for lane in at..at + lanes {
                if !hits.is_hit(lane) {
                    continue;
                }
                let glow = self.glows[hits.order.0[lane].to_index()];
                for channel in 0..3 {
                    let weight = if EYE { 1.0 } else { queue.weight[channel].0[lane].widen() };
                    let color = &mut hits.color[channel].0[lane];
                    *color = E::narrow(color.widen() + weight * glow[channel]);
                }
            }
        }
    }

    /// Mixes the coefficients of patterns and the factors of pictures into the colours and diffuse coefficients of the
    /// hits, and stores the mirror coefficients of all. With `EYE` the rays have a weight of 1.
    #[inline(never)]
    pub(crate) fn paint<E: Real, const EYE: bool>(
        &self,
        queue: &RayBatch<E>,
        hits: &mut Hits<E>,
        lanes: usize,
    ) {
        for column in &mut hits.mirror {
            column.resize(ROOM, E::narrow(0.0));
        }
        for &(at, _) in &hits.packets {
            for lane in at..at + lanes {
                if !hits.is_hit(lane) {
                    continue;
                }
                let order = hits.order.0[lane].to_index();
                let read = |columns: &[Column<E>; 3]| {
                    DVec3::new(
                        columns[0].0[lane].widen(),
                        columns[1].0[lane].widen(),
                        columns[2].0[lane].widen(),
                    )
                };
                let weight = if EYE { DVec3::ONE } else { read(&queue.weight) };
                let (mirror, is_painted) = self.mirrors[order];
                if !is_painted {
                    write(&mut hits.mirror, lane, mirror * weight);
                    continue;
                }
                let origin = if EYE { DVec3::ZERO } else { read(&queue.origin) };
                let ray = (origin, read(&queue.direction));
                let seen = self.coefficients_at(order, ray, (read(&hits.start), read(&hits.normal)));
                write(&mut hits.color, lane, seen.ambient() * weight);
                write(&mut hits.diffuse, lane, seen.diffuse() * weight);
                write(&mut hits.mirror, lane, seen.mirror() * weight);
            }
        }
    }

    /// Along an axis that is perpendicular to the ray, a hit has the coordinate of the ray's start, so that walls
    /// between cells are exact.
    fn coefficients_at(
        &self,
        order: usize,
        (origin, direction): (DVec3, DVec3),
        (start, normal): (DVec3, DVec3),
    ) -> Coefficients {
        let place = DVec3::select(direction.cmpeq(DVec3::ZERO), origin, start);
        let world = place / self.scale + self.center;
        let (object, place, normal) = match &self.scene.objects[order] {
            Object::Instance(instance) => {
                let placement = instance.placement();
                let normal = placement.rotation().transpose() * normal;
                (instance.object(), placement.local_point(world), normal)
            }
            object => (object, world, normal),
        };
        let flat = reference::is_flat_at(object, normal);
        let surface = reference::Surface { point: world, normal, offset: 0.0, flat, within: false };
        coefficients(object, place, normal, &surface, self.scene.tone == Tone::Srgb)
    }

    /// Returns the lanes in which the highlights of a light in the direction `towards` are visible. `orders` are those
    /// of the objects that the lanes hit, along `direction`.
    #[inline(always)]
    pub(crate) fn shines<S: Simd, E: Real>(
        &self,
        simd: S,
        orders: &[E],
        normal: Vec3<S, E>,
        (towards, direction): (Vec3<S, E>, Vec3<S, E>),
    ) -> Mask<S, E> {
        let mut least = [E::narrow(f64::from(NEVER)); 16];
        for (least, order) in least.iter_mut().zip(orders) {
            if let Some(of_object) = self.least_cosines.get(order.to_index()) {
                *least = E::narrow(f64::from(*of_object));
            }
        }
        let least = Lanes::<S, E>::from_slice(simd, &least[..Lanes::<S, E>::LEN]);
        let halfway = towards.sub(direction);
        let cosine = normal.dot(halfway);
        let zero = constant::<S, E>(simd, 0.0);
        let is_near = cosine.simd_gt(zero) & (cosine * cosine).simd_ge(least * halfway.dot(halfway));
        is_near | least.simd_lt(zero)
    }

    pub(crate) fn gloss(&self) -> Gloss<'_> {
        let nothing = [DVec3::ZERO; 16];
        Gloss { finishes: self, sum: nothing, of_mirrors: nothing, is_seen: false }
    }
}

/// Returns slightly less than the square of the cosine from which the highlights of a finish in a light are visible.
fn least_cosine(finish: &Finish, light: f64) -> f32 {
    match finish.shine {
        _ if finish.rough.is_some() => -1.0,
        Some(shine) => {
            let most = shine.color().abs().max_element().max(1.0) * light.max(1.0);
            (0.999 * libm::pow(UNSEEN / most, 2.0 / shine.exponent())) as f32
        }
        None => NEVER,
    }
}

/// Returns whether the coefficients of a surface depend on the position of a hit.
fn is_painted(finish: &Finish) -> bool {
    finish.pattern.is_some() || finish.image.as_ref().is_some_and(|image| image.map() != ImageMap::Uv)
}

fn write<E: Real>(columns: &mut [impl AsMut<[E]>; 3], lane: usize, color: DVec3) {
    for (column, value) in columns.iter_mut().zip(color.to_array()) {
        column.as_mut()[lane] = E::narrow(value);
    }
}

/// A surface in a light.
#[derive(Clone, Copy)]
pub(crate) struct Lit<S: Simd, E: Real> {
    /// The lanes that the light reaches.
    pub(crate) lanes: Mask<S, E>,
    /// The unit vector towards it.
    pub(crate) towards: Vec3<S, E>,
    /// The share of its colour that arrives.
    pub(crate) color: Vec3<S, E>,
}

impl Gloss<'_> {
    /// Adds the highlights of a light. `ray` are the rays that see them, and `orders` those of their hits.
    #[inline(never)]
    pub(crate) fn add<S: Simd, E: Real>(
        &mut self,
        Lit { lanes, towards, color }: Lit<S, E>,
        (ray, normal): (Ray<S, E>, Vec3<S, E>),
        orders: &[E],
    ) {
        let mut bits = lanes.to_bitmask();
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let Some(Some(shine)) = self.finishes.shines.get(orders[lane].to_index()) else { continue };
            let at = |v: Vec3<S, E>| DVec3::new(v.x[lane].widen(), v.y[lane].widen(), v.z[lane].widen());
            let seen = highlight(shine, at(normal), at(towards), -at(ray.direction));
            self.sum[lane] += at(color) * shine.color() * seen;
            self.is_seen = true;
        }
    }

    /// Adds the highlights of a light on rough mirrors. `mirror` are their coefficients times the weights of the rays,
    /// from the first lane on.
    #[inline(never)]
    pub(crate) fn add_rough<S: Simd, E: Real>(
        &mut self,
        paths: &Paths,
        Lit { lanes, towards, color }: Lit<S, E>,
        (ray, normal): (Ray<S, E>, Vec3<S, E>),
        (orders, mirror, at): (&[E], &[Vec<E>; 3], usize),
    ) {
        let mut bits = lanes.to_bitmask();
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let Some(facets) = paths.microfacets(orders[lane].to_index()) else { continue };
            let of = |v: Vec3<S, E>| DVec3::new(v.x[lane].widen(), v.y[lane].widen(), v.z[lane].widen());
            let mirror = DVec3::from_array(mirror.each_ref().map(|channel| channel[at + lane].widen()));
            let seen = facets.highlight(of(normal), -of(ray.direction), of(towards));
            self.of_mirrors[lane] += of(color) * mirror * seen;
            self.is_seen = true;
        }
    }

    /// The sum of all highlights on rough mirrors, times the weights of the rays.
    #[inline(always)]
    pub(crate) fn sum_of_mirrors<S: Simd, E: Real>(&self, simd: S) -> Vec3<S, E> {
        Self::loaded(simd, &self.of_mirrors)
    }

    /// The sum of all other highlights.
    #[inline(always)]
    pub(crate) fn sum<S: Simd, E: Real>(&self, simd: S) -> Vec3<S, E> {
        Self::loaded(simd, &self.sum)
    }

    #[inline(always)]
    fn loaded<S: Simd, E: Real>(simd: S, sums: &[DVec3; 16]) -> Vec3<S, E> {
        let mut columns = [[E::narrow(0.0); 16]; 3];
        for (lane, color) in sums.iter().enumerate() {
            for (column, channel) in columns.iter_mut().zip(color.to_array()) {
                column[lane] = E::narrow(channel);
            }
        }
        Vec3::load(simd, &columns, 0)
    }
}
