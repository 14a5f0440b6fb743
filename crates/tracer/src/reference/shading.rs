//! The colour along a ray, in the terms of the language.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use rayfold_scene::{Glass, Object, Tone};

use super::Hit;
use super::glass::{Refraction, refract};
use super::light::{arriving, held, highlight};
use super::pattern::coefficients;
use super::shapes::Surface;
use super::world::{World, glass};
use crate::camera::Ray;
use crate::meshes::Shading;
use crate::sampling::guide::{Guide, Scattering};
use crate::sampling::paths::{Way, scattered};
use crate::sampling::rough::{Energies, Microfacets};

/// The weight, in every channel, below which a ray is not followed once its path has hit glass.
pub(crate) const FAINT: f64 = 1.0 / 4096.0;

/// The limit of the weight for pictures of linear light, whose tone curve expands dark tones.
pub(crate) const FAINT_LINEAR: f64 = 1.0 / 65536.0;

/// Returns the share that fog leaves of a ray's light over a length.
pub(crate) fn clearness(length: f64, distance: f64) -> f64 {
    libm::exp(-length / distance)
}

/// A shader: traces rays and computes their colours.
pub(super) struct Shader<'a> {
    pub(super) world: &'a World<'a>,
    /// The sampled point of each light, as for [`arriving`].
    pub(super) lights: &'a [DVec3],
    pub(super) cancel: Option<&'a AtomicBool>,
    /// The random numbers of paths, in scenes in which surfaces light each other.
    pub(super) paths: Option<PathNumbers<'a>>,
}

/// The random numbers of a path.
#[derive(Clone, Copy)]
pub(super) struct PathNumbers<'a> {
    /// Returns the numbers of the direction after `hits` hits.
    pub(super) direction: &'a dyn Fn(u32) -> (f64, f64),
    /// Returns the number that decides whether the path continues in a way after `hits` hits.
    pub(super) choice: &'a dyn Fn(u32, Way) -> f64,
    /// The microfacets of rough objects.
    pub(super) energies: &'a Energies,
    /// The guide of scattered rays to bright light.
    pub(super) guide: Option<&'a Guide>,
}

/// A path from the camera.
#[derive(Clone, Copy)]
struct Path {
    /// The number of further reflections and refractions that are followed.
    bounces: u32,
    /// The absolute value of the product of all factors so far.
    weight: DVec3,
    has_met_glass: bool,
    /// The number of hits before.
    hits: u32,
    /// The number of further diffuse reflections that are followed.
    scatters: u32,
    /// The share of the pixel that stays clear if the ray hits nothing; `None` for rays that see the surroundings.
    clear: Option<f64>,
}

/// The light of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Seen {
    /// The colour, unclamped.
    pub(super) color: DVec3,
    /// The share of the ray that hits nothing, directly or through glass, in a scene without background: 0 to 1.
    pub(super) clear: f64,
}

impl Seen {
    pub(super) const BLACK: Self = Self { color: DVec3::ZERO, clear: 0.0 };
}

impl Shader<'_> {
    /// Returns the colour along a ray from the camera, unclamped.
    pub(super) fn color(&self, ray: Ray, bounces: u32) -> DVec3 {
        self.seen(ray, bounces).color
    }

    /// Returns the light of a ray from the camera.
    pub(super) fn seen(&self, ray: Ray, bounces: u32) -> Seen {
        let clear = self.world.scene.background.is_none().then_some(1.0);
        self.seen_along(
            ray,
            Path {
                bounces,
                weight: DVec3::ONE,
                has_met_glass: false,
                hits: 0,
                scatters: self.paths.map_or(0, |_| self.world.scene.indirect_bounces()),
                clear,
            },
        )
    }

    pub(super) fn is_cancelled(&self) -> bool {
        self.cancel.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }

    fn seen_along(&self, ray: Ray, path: Path) -> Seen {
        if self.is_cancelled() {
            return Seen::BLACK;
        }
        let world = self.world;
        let Some(hit) = world.nearest(ray) else {
            return match path.clear {
                Some(clear) => Seen { clear, ..Seen::BLACK },
                None => Seen { color: world.around(ray.direction), ..Seen::BLACK },
            };
        };
        let Some((fog, distance)) = world.scene.fog.get() else { return self.seen_at(ray, &hit, path) };
        let left = clearness(hit.distance, distance);
        let Seen { color, clear } = self.seen_at(ray, &hit, Path { weight: path.weight * left, ..path });
        Seen { color: held(left * color + (1.0 - left) * fog), clear }
    }

    /// Returns the light that a hit sends back along the ray.
    fn seen_at(&self, ray: Ray, hit: &Hit, path: Path) -> Seen {
        let world = self.world;
        let (object, place, local_normal) = world.in_script(hit.object, &hit.surface);
        let coefficients =
            coefficients(object, place, local_normal, &hit.surface, world.scene.tone == Tone::Srgb);
        let face = hit.surface.normal;
        let start = hit.surface.point + hit.surface.offset * face;
        let shading = world.shading(hit, ray.direction);
        let normal = shading.map_or(face, |shading| shading.normal);
        let tint = shading.map_or(DVec3::ONE, |shading| shading.color);

        let mut color = coefficients.ambient();
        if let Some(shading) = shading {
            color = held(color * tint + shading.glow);
        }
        let finish = object.material().finish();
        if let Some(finish) = finish {
            color = held(color + finish.glow);
        }
        let shine = finish.and_then(|finish| finish.shine);
        let facets = self.paths.and_then(|numbers| numbers.energies.microfacets(object));
        for (light, point) in world.lights.iter().zip(self.lights) {
            let Some(arriving) = arriving(light, *point, &hit.surface) else { continue };
            let cosine = normal.dot(arriving.towards);
            if cosine <= 0.0 {
                continue;
            }
            let start =
                shading.map_or(start, |shading| shadow_start(&hit.surface, shading, arriving.towards));
            let Some(left) = arriving.let_through(world, start) else { continue };
            let light = held(arriving.color * left);
            color = held(color + light * (coefficients.diffuse() * tint) * cosine);
            if let Some(shine) = shine {
                let part = highlight(&shine, normal, arriving.towards, -ray.direction);
                color = held(color + light * shine.color() * part);
            }
            if let Some(facets) = &facets {
                let part = facets.highlight(normal, -ray.direction, arriving.towards);
                color = held(color + light * coefficients.mirror() * part);
            }
        }
        let mut clear = 0.0;
        if path.scatters > 0
            && let Some(numbers) = self.paths
        {
            let factor = coefficients.diffuse() * tint;
            if let Some((next, factor)) = self.sent(path, factor, Way::Scattered) {
                let uv = (numbers.direction)(path.hits);
                let by_cosine = scattered(uv, normal, face);
                let rays = match numbers.guide {
                    Some(guide) => {
                        let hit = Scattering::of_one(uv, by_cosine, world.in_scene(start), (normal, face));
                        guide.scattered(&hit, &mut vec![]).of_one(by_cosine)
                    }
                    None => [(by_cosine, 1.0), (DVec3::Y, 0.0)],
                };
                for (direction, share) in rays.into_iter().filter(|&(_, share)| share > 0.0) {
                    let next = Path { clear: None, weight: held(next.weight * share), ..next };
                    let seen = self.seen_along(Ray { origin: start, direction }, next);
                    color = held(color + factor * share * seen.color);
                }
            }
        }
        if path.bounces == 0 {
            return Seen { color, clear };
        }

        let Onward { mut factor, mirrored, refracted } = match (&facets, self.paths) {
            (Some(facets), Some(numbers)) => {
                let facet = facets.normal(-ray.direction, normal, (numbers.direction)(path.hits));
                self.onward_of_facet(ray, hit, (facets, facet), coefficients.mirror(), shading)
            }
            _ => self.onward_of_surface(ray, hit, coefficients.mirror(), shading),
        };
        factor = held(factor);
        let refracted = refracted
            .map(|(factor, direction, share)| (factor, direction, path.clear.map(|clear| clear * share)));
        let has_met_glass = path.has_met_glass || refracted.is_some();
        let path = Path { has_met_glass, ..path };
        if let Some((path, factor)) = self.sent(path, factor, Way::Mirrored) {
            let mirrored =
                self.seen_along(Ray { origin: start, direction: mirrored }, Path { clear: None, ..path });
            color = held(color + factor * mirrored.color);
        }
        if let Some((factor, direction, share)) = refracted
            && let Some((path, factor)) = self.sent(path, factor, Way::Refracted)
        {
            let origin = hit.surface.point - hit.surface.offset * face;
            let seen = self.seen_along(Ray { origin, direction }, Path { clear: share, ..path });
            color = held(color + factor * seen.color);
            clear = seen.clear;
        }
        Seen { color, clear }
    }

    /// Returns the rays that go on from a smooth surface with this mirror coefficient.
    fn onward_of_surface(&self, ray: Ray, hit: &Hit, mirror: DVec3, shading: Option<Shading>) -> Onward {
        let (object, within, is_flat) = self.side(hit, shading);
        let normal = shading.map_or(hit.surface.normal, |shading| shading.onward);
        let mut factor = mirror;
        let refracted = glass(object).map(|glass| {
            let Refraction { mirrored, direction } = refract(glass, ray.direction, normal, within, is_flat);
            factor += mirrored;
            ((1.0 - mirrored) * glass.color(), direction, (1.0 - mirrored) * clearness_of(glass))
        });
        Onward { factor, mirrored: reflected(ray.direction, normal), refracted }
    }

    /// Returns the rays that go on from a microfacet with this normal.
    fn onward_of_facet(
        &self,
        ray: Ray,
        hit: &Hit,
        (facets, facet): (&Microfacets, DVec3),
        mirror: DVec3,
        shading: Option<Shading>,
    ) -> Onward {
        let (object, within, is_flat) = self.side(hit, shading);
        let face = hit.surface.normal;
        let normal = shading.map_or(face, |shading| shading.normal);
        let towards = reflected(ray.direction, facet);
        let shown = if towards.dot(face) > 0.0 { facets.masking(towards.dot(normal)) } else { 0.0 };
        let mut factor = mirror / facets.energy(-ray.direction.dot(normal));
        let refracted = glass(object).map(|glass| {
            let Refraction { mirrored, direction } = refract(glass, ray.direction, facet, within, is_flat);
            factor += mirrored;
            // Through a pane, the ray goes on as the mirrored one does on the other side.
            let direction = if is_flat { towards - 2.0 * towards.dot(normal) * normal } else { direction };
            let left = if direction.dot(face) < 0.0 { facets.masking(-direction.dot(normal)) } else { 0.0 };
            let left = left * (1.0 - mirrored);
            (left * glass.color(), direction, left * clearness_of(glass))
        });
        Onward { factor: factor * shown, mirrored: towards, refracted }
    }

    /// Returns the object of a hit, whether the ray comes from within it, and whether it has no inside.
    fn side(&self, hit: &Hit, shading: Option<Shading>) -> (&Object, bool, bool) {
        let (object, ..) = self.world.in_script(hit.object, &hit.surface);
        let within = shading.map_or(hit.surface.within, |shading| shading.within);
        (object, within, !self.world.has_inside(hit.object, object))
    }

    /// Returns the path of a ray with this factor, and the factor with which the ray counts, or `None` if it is not
    /// followed.
    fn sent(&self, path: Path, factor: DVec3, way: Way) -> Option<(Path, DVec3)> {
        let weight = held(path.weight * factor.abs());
        let faint = match self.world.scene.tone {
            Tone::Plain => FAINT,
            Tone::Srgb => FAINT_LINEAR,
        };
        let chance = match self.paths {
            Some(numbers) => {
                let chance = way.chance(weight);
                let is_followed = chance >= 1.0 || (numbers.choice)(path.hits, way) < chance;
                if is_followed { chance } else { 0.0 }
            }
            None if path.has_met_glass => f64::from(weight.max_element() >= faint),
            None => f64::from(factor != DVec3::ZERO),
        };
        let next = Path { weight: weight / chance, hits: path.hits + 1, ..path };
        let next = match way {
            Way::Scattered => Path { scatters: path.scatters - 1, ..next },
            Way::Mirrored | Way::Refracted => Path { bounces: path.bounces - 1, ..next },
        };
        (chance > 0.0).then_some((next, factor / chance))
    }
}

/// The rays that go on from a hit.
struct Onward {
    /// The factor of the mirrored ray.
    factor: DVec3,
    /// The direction of the mirrored ray.
    mirrored: DVec3,
    /// The factor and the direction of the refracted ray, and the share of a pixel that it leaves clear; `None` at an
    /// opaque surface.
    refracted: Option<(DVec3, DVec3, f64)>,
}

/// Returns the share of the background behind glass that stays clear if nothing is reflected.
fn clearness_of(glass: Glass) -> f64 {
    (glass.color().element_sum() / 3.0).clamp(0.0, 1.0)
}

/// Returns the mirrored direction. The normal faces the ray. If rounding has changed the sign of their dot product, the
/// direction stays parallel to the surface.
fn reflected(direction: DVec3, normal: DVec3) -> DVec3 {
    (direction - 2.0 * direction.dot(normal).min(0.0) * normal).normalize()
}

/// Returns the start of the shadow ray towards a light on a face with normals. A face that the start is lifted off can
/// hide the light. A face that it starts on cannot.
fn shadow_start(surface: &Surface, shading: Shading, towards: DVec3) -> DVec3 {
    let Surface { point, normal, offset, .. } = *surface;
    let is_lifted = shading.lift.dot(normal) > offset;
    let side = if is_lifted || towards.dot(normal) >= 0.0 { offset } else { -offset };
    point + shading.lift + side * normal
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{
        Camera, Coefficients, Cuboid, Depth, Disc, Finish, Glass, Lamp, Material, Object, Plane, Scene,
        Screen, Sphere,
    };

    use super::*;

    fn matte(ambient: f64, diffuse: f64) -> Material {
        Material::new(DVec3::splat(ambient), DVec3::splat(diffuse), DVec3::ZERO).unwrap()
    }

    fn pane(color: f64, ior: f64) -> Material {
        let glass = Some(Glass::new(DVec3::splat(color), ior).unwrap());
        Material::finished(Coefficients::default(), Finish { glass, ..Finish::default() })
    }

    fn disc(height: f64, material: Material) -> Object {
        Disc::new(9.0, DVec3::Y * height, DVec3::Y, material).unwrap().into()
    }

    fn brick(low: f64, high: f64, material: Material) -> Object {
        let corners = [DVec3::new(-9.0, low, -9.0), DVec3::new(9.0, high, 9.0)];
        Cuboid::new(corners, material).unwrap().into()
    }

    fn scene(objects: Vec<Object>, lamp: Option<Lamp>) -> Scene {
        let mut scene = Scene::new(Screen::new(1, 1).unwrap(), Camera::Orthographic);
        scene.objects = objects.into();
        scene.lights = lamp.into_iter().map(Into::into).collect();
        scene
    }

    /// Returns the colour along a ray straight down from a height of 5.
    fn down(scene: &Scene, x: f64) -> f64 {
        let ray = Ray { origin: DVec3::new(x, 5.0, 0.0), direction: DVec3::NEG_Y };
        let world = World::new(scene);
        Shader { world: &world, lights: &world.middles(), cancel: None, paths: None }
            .color(ray, scene.depth.bounces())
            .x
    }

    fn lamp(position: DVec3, reach: f64) -> Option<Lamp> {
        Some(Lamp::new(DVec3::ONE, position, 0.0, reach).unwrap())
    }

    #[test]
    fn panes_let_through_what_they_do_not_mirror() {
        let floor = || disc(0.0, matte(1.0, 0.0));
        // An index of 1 reflects no light. Each surface multiplies by its coefficient; surfaces at one place multiply
        // once.
        assert_eq!(down(&scene(vec![floor(), disc(1.0, pane(0.5, 1.0))], None), 0.0), 0.5);
        assert_eq!(down(&scene(vec![floor(), brick(1.0, 2.0, pane(0.5, 1.0))], None), 0.0), 0.25);
        let stacked = vec![floor(), brick(1.0, 2.0, pane(0.5, 1.0)), brick(2.0, 3.0, pane(0.25, 1.0))];
        assert_eq!(down(&scene(stacked, None), 0.0), 0.0625);
        // 4 % at the front of a pane: its reflection is black here.
        let mirrored = down(&scene(vec![floor(), disc(1.0, pane(1.0, 1.5))], None), 0.0);
        assert!((mirrored - 0.96).abs() < 1e-15);
        // A pane that coincides with the floor does not hide it, in either order.
        assert_eq!(down(&scene(vec![disc(0.0, pane(0.5, 1.5)), floor()], None), 0.0), 1.0);
    }

    #[test]
    fn shadows_of_panes_are_as_dark_as_their_glass() {
        let floor = || disc(0.0, matte(0.0, 1.0));
        let lit = |objects: Vec<Object>| down(&scene(objects, lamp(DVec3::new(4.0, 9.0, 0.0), 0.0)), 3.99);
        let clear = lit(vec![floor()]);
        let side = |half: f64| {
            let corners = [DVec3::new(3.0, 6.0, -half), DVec3::new(5.0, 8.0, half)];
            Cuboid::new(corners, pane(0.5, 2.0)).unwrap().into()
        };
        assert!((lit(vec![floor(), side(1.0)]) / clear - 0.25).abs() < 1e-15);
        assert_eq!(lit(vec![floor(), side(1.0), disc(7.0, matte(0.0, 0.0))]), 0.0);
    }

    #[test]
    fn a_lamp_is_not_hidden_by_the_surface_that_it_is_on_and_gives_nothing_there() {
        let floor: Object = Plane::new(DVec3::ZERO, DVec3::Y, matte(0.0, 1.0)).unwrap().into();
        let ceiling: Object =
            Plane::new(DVec3::Y * 0.7, DVec3::new(0.1, 1.0, 0.2), matte(0.0, 0.0)).unwrap().into();
        let light = scene(vec![floor.clone()], lamp(DVec3::new(3.0, 4.0, 0.0), 10.0));
        assert!((down(&light, 0.0) - 0.8 * 4.0).abs() < 1e-14, "(10/5)² of what arrives");
        let below = DVec3::new(0.3, 0.7 - 0.03, 0.0);
        let world_of = |objects| scene(objects, lamp(below, 0.0));
        let from_below = |scene: &Scene| {
            let ray = Ray { origin: DVec3::new(0.2, 0.1, 0.0), direction: DVec3::NEG_Y };
            let world = World::new(scene);
            Shader { world: &world, lights: &world.middles(), cancel: None, paths: None }.color(ray, 0).x
        };
        let open = from_below(&world_of(vec![floor.clone()]));
        assert!(open > 0.5);
        assert_eq!(from_below(&world_of(vec![floor.clone(), ceiling])), open);
        assert_eq!(down(&scene(vec![floor], lamp(DVec3::ZERO, 1.0)), 0.0), 0.0);
    }

    #[test]
    fn faint_rays_are_followed_until_a_path_has_met_glass() {
        let floor = || disc(0.0, matte(4096.0, 0.0));
        let pane = |share: f64| disc(1.0, pane(share, 1.0));
        assert_eq!(down(&scene(vec![floor(), pane(1.0 / 4096.0)], None), 0.0), 1.0);
        assert_eq!(down(&scene(vec![floor(), pane(1.0 / 4097.0)], None), 0.0), 0.0);
        let mut linear = scene(vec![floor(), pane(1.0 / 65536.0)], None);
        linear.tone = Tone::Srgb;
        assert_eq!(down(&linear, 0.0), 0.0625);
        linear.depth = Depth::new(0).unwrap();
        assert_eq!(down(&linear, 0.0), 0.0);
    }

    #[test]
    fn a_pixel_of_endless_glass_can_be_interrupted() {
        let shells = (1..40).map(|k| Sphere::new(f64::from(k), DVec3::ZERO, pane(1.0, 1.5)).unwrap().into());
        let mut endless = scene(shells.collect(), None);
        endless.depth = Depth::new(16).unwrap();
        let flag = AtomicBool::new(true);
        let world = World::new(&endless);
        let shader = Shader { world: &world, lights: &world.middles(), cancel: Some(&flag), paths: None };
        let ray = Ray { origin: DVec3::ZERO, direction: DVec3::X };
        assert_eq!((shader.color(ray, 16), shader.is_cancelled()), (DVec3::ZERO, true));
    }
}
