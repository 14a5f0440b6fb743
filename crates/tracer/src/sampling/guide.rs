//! A guide of scattered rays to bright light: to what glows, to windows, and to the bright parts of a sky's picture.
//!
//! Chance alone rarely finds a small pane that glows, or the sun of a sky. So beside the ray that a surface scatters by the cosine,
//! another one is aimed at these. Each of the two counts for the density that the language asks for, divided by the sum of the
//! densities of both ways of drawing: the balance heuristic of Veach and Guibas (1995). The expectation stays as it is, and no ray
//! counts for more than it would without a guide.
//!
//! Cones around boxes hold what glows, and the windows of a room. The sky is drawn by a table of how much brighter than the
//! mean it is, since the cosine finds the rest as well (Karlík, Šik, Vévoda, Skřivan and Křivánek, 2019).

use core::f64::consts::{FRAC_1_PI, PI};
use std::sync::Arc;

use glam::DVec3;
use rayfold_scene::Scene;

use super::bright::{Bright, Seen, brightest, see};
use super::sky_table::{SkyTable, brightness};
use crate::pictures::Panorama;

/// The part of the light from all around that is weighed against what is bright. Walls often keep most of it out.
const OPENNESS: f64 = 0.2;

/// From so large a part of all light on, what is bright is always aimed at.
const BRIGHT: f64 = 0.4;

/// The bright light of a scene at a moment.
#[derive(Clone, Debug)]
pub(crate) struct Guide {
    /// Glowing things, and after them the windows.
    lights: Vec<Bright>,
    /// The number of those that glow.
    glowing: usize,
    /// The box in which windows are seen.
    room: Option<[DVec3; 2]>,
    sky: Option<(Arc<SkyTable>, Panorama)>,
    /// The light that the bright parts of the sky give a surface, about.
    sky_weight: f64,
    /// The light that a surface gets from all around, about.
    around: f64,
}

impl Guide {
    /// Returns the guide of each moment of a scene; `None` if nothing is bright, or if no ray is scattered. `windows` are those of
    /// the first moment.
    pub(crate) fn of(moments: &[Scene], windows: Option<Windows>) -> Vec<Option<Self>> {
        let of = |scene: &Scene| {
            if scene.indirect_bounces() == 0 {
                return None;
            }
            let sky = Panorama::of(scene).and_then(|panorama| Some((SkyTable::of(&panorama)?, panorama)));
            let (mean, sky_weight) = match &sky {
                Some((table, sky)) => (table.mean * sky.strength(), table.excess * sky.strength() / 2.0),
                None => {
                    let (low, high) = scene.surroundings().colors();
                    (brightness(low.midpoint(high.unwrap_or(low))), 0.0)
                }
            };
            let glowing = glowing(scene);
            let is_bright = sky.is_some() || windows.is_some() || !glowing.is_empty();
            is_bright.then(|| Self::new(glowing, windows.as_ref(), (sky, sky_weight), PI * mean))
        };
        moments.iter().map(of).collect()
    }

    fn new(
        mut lights: Vec<Bright>,
        windows: Option<&Windows>,
        (sky, sky_weight): (Option<(Arc<SkyTable>, Panorama)>, f64),
        around: f64,
    ) -> Self {
        let glowing = lights.len();
        lights.extend(windows.iter().flat_map(|windows| &windows.lights));
        Self { lights, glowing, room: windows.map(|windows| windows.room), sky, sky_weight, around }
    }

    /// Returns the rays that a surface scatters at a place of the scene: their directions, and the factors with which they count. A
    /// factor is 0 for a ray that is none. `by_cosine` is the direction that [`super::paths::scattered`] gives for the numbers and the
    /// normals.
    pub(crate) fn scattered(
        &self,
        ((u, v), by_cosine): ((f64, f64), DVec3),
        place: DVec3,
        (normal, face): (DVec3, DVec3),
        aims: &mut Aims,
    ) -> [(DVec3, f64); 2] {
        let seen = &mut aims.0;
        seen.clear();
        let (glowing, windows) = self.lights.split_at(self.glowing);
        let mut lit = self.sky_weight + see(glowing, 0, (place, normal), seen);
        if self.room.is_some_and(|[low, high]| place.cmpge(low).all() && place.cmple(high).all()) {
            lit += see(windows, self.glowing, (place, normal), seen);
        }
        if lit <= 0.0 {
            return [(by_cosine, 1.0), (by_cosine, 0.0)];
        }
        // The chance of a second ray.
        let share = (lit / (BRIGHT * (lit + OPENNESS * self.around))).min(1.0);
        let part = |direction: DVec3| {
            let asked = density(direction, normal, face);
            let aimed = share / lit * self.weighted_density(direction, seen);
            if asked > 0.0 { asked / (asked + aimed) } else { 0.0 }
        };
        // A ray by the cosine along the surface counts as nothing.
        let by_cosine = (by_cosine, part(by_cosine));
        if u >= share {
            return [by_cosine, (by_cosine.0, 0.0)];
        }
        let aimed = self.towards_light((u / share * lit, v), seen);
        [by_cosine, (aimed, part(aimed))]
    }

    /// Returns the sum of the densities of the ways to aim in a direction, each times its weight.
    fn weighted_density(&self, direction: DVec3, seen: &[Seen]) -> f64 {
        let of_sky = match &self.sky {
            Some((table, panorama)) => self.sky_weight * table.directions.density(panorama.turned(direction)),
            None => 0.0,
        };
        seen.iter().fold(of_sky, |sum, seen| sum + seen.weighted_density(direction, &self.lights))
    }

    /// Returns a direction towards light. `at` is below the sum of all weights.
    fn towards_light(&self, (mut at, v): (f64, f64), seen: &[Seen]) -> DVec3 {
        for seen in seen {
            if at < seen.weight {
                return seen.within(at / seen.weight, v, &self.lights);
            }
            at -= seen.weight;
        }
        match &self.sky {
            Some((table, panorama)) => {
                panorama.turned_back(table.directions.direction((at / self.sky_weight).min(1.0), v))
            }
            // The sum was rounded.
            None => seen.last().map_or(DVec3::Y, |seen| seen.within(1.0, v, &self.lights)),
        }
    }
}

/// Room for what a surface sees, used for one hit after another.
#[derive(Default)]
pub(crate) struct Aims(Vec<Seen>);

/// Returns the density of the directions of [`super::paths::scattered`].
fn density(direction: DVec3, normal: DVec3, face: DVec3) -> f64 {
    let above = direction.dot(face);
    if above < 0.0 {
        return 0.0;
    }
    let cosine = normal.dot(direction);
    // A direction that is drawn below a face is mirrored to above it.
    let mirrored = if normal == face { 0.0 } else { cosine - 2.0 * above * normal.dot(face) };
    (cosine.max(0.0) + mirrored.max(0.0)) * FRAC_1_PI
}

/// The windows of a room.
#[derive(Debug)]
pub(crate) struct Windows {
    room: [DVec3; 2],
    lights: Vec<Bright>,
}

impl Windows {
    pub(crate) fn new(room: [DVec3; 2], windows: Vec<Bright>) -> Self {
        Self { room, lights: brightest(windows) }
    }
}

/// Returns what glows in a scene.
fn glowing(scene: &Scene) -> Vec<Bright> {
    let mut found = vec![];
    for object in scene.objects.iter() {
        let glow = object.material().finish().map_or(DVec3::ZERO, |finish| finish.glow);
        if glow != DVec3::ZERO {
            Bright::add_object(object, brightness(glow), &mut found);
        }
    }
    brightest(found)
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Capsule, Material};

    use super::super::paths::scattered;
    use super::*;

    fn guide(lights: Vec<Bright>, windows: &Windows) -> Guide {
        Guide::new(brightest(lights), Some(windows), (None, 0.0), 0.3)
    }

    /// The mean of the light of scattered rays from directions in which `is_lit`, and its standard error.
    fn light(guide: Option<&Guide>, normals: (DVec3, DVec3), is_lit: impl Fn(DVec3) -> bool) -> (f64, f64) {
        let (normal, face) = normals;
        let mut dice = fastrand::Rng::with_seed(11);
        let (mut sum, mut squares) = (0.0, 0.0);
        let count = 200_000;
        for _ in 0..count {
            let numbers = (dice.f64(), dice.f64());
            let rays = match guide {
                Some(guide) => {
                    let drawn = (numbers, scattered(numbers, normal, face));
                    guide.scattered(drawn, DVec3::ZERO, normals, &mut Aims::default())
                }
                None => [(scattered(numbers, normal, face), 1.0), (DVec3::Y, 0.0)],
            };
            for (direction, share) in rays.iter().filter(|ray| ray.1 > 0.0) {
                assert!((direction.length() - 1.0).abs() < 1e-14 && *share <= 1.0);
            }
            let of = |(direction, share): (DVec3, f64)| if is_lit(direction) { share } else { 0.0 };
            let light: f64 = rays.map(of).into_iter().sum();
            sum += light;
            squares += light * light;
        }
        let (mean, square) = (sum / f64::from(count), squares / f64::from(count));
        (mean, ((square - mean * mean) / f64::from(count)).sqrt())
    }

    #[test]
    fn a_place_that_sees_nothing_bright_has_a_ray_by_the_cosine() {
        let pane = Bright::rectangle(1.0, [DVec3::new(-1.0, -1.0, -1.0), DVec3::new(1.0, -1.0, 1.0)]);
        let dark = Guide::new(vec![pane.unwrap()], None, (None, 0.0), 0.0);
        let drawn = ((0.3, 0.4), DVec3::Y);
        let rays = dark.scattered(drawn, DVec3::ZERO, (DVec3::Y, DVec3::Y), &mut Aims::default());
        assert_eq!(rays.map(|ray| ray.1), [1.0, 0.0]);
    }

    #[test]
    fn light_from_all_directions_is_that_of_the_cosine_with_less_noise() {
        let mut lights = vec![];
        let tube = Capsule::new(
            0.05,
            [DVec3::new(-1.0, 1.05, 0.0), DVec3::new(1.0, 1.05, 0.0)],
            Material::default(),
        );
        Bright::add_object(&tube.unwrap().into(), 4.0, &mut lights);
        let rectangle = |brightness, low: [f64; 3], high: [f64; 3]| {
            Bright::rectangle(brightness, [low.into(), high.into()]).unwrap()
        };
        lights.push(rectangle(2.0, [0.5, 0.3, 0.5], [0.9, 0.3, 0.9]));
        let window = vec![rectangle(1.0, [-2.0, 0.5, 0.0], [-2.0, 1.0, 0.4])];
        let window = Windows::new([DVec3::splat(-2.0), DVec3::splat(2.0)], window);
        let guide = guide(lights, &window);
        let bent = DVec3::new(0.6, 0.8, 0.0);
        for normals in [(DVec3::Y, DVec3::Y), (bent, DVec3::Y), (bent, bent)] {
            let is_in = |[low, high]: [[f64; 3]; 2]| {
                move |direction: DVec3| {
                    let middle = (DVec3::from(low) + DVec3::from(high)) / 2.0;
                    (direction - middle.normalize()).length() < 0.1
                }
            };
            for place in [
                [[0.5, 0.3, 0.5], [0.9, 0.3, 0.9]],
                [[-2.0, 0.5, 0.0], [-2.0, 1.0, 0.4]],
                [[-1.0, 1.0, 0.0], [-0.8, 1.1, 0.0]],
            ] {
                let (by_guide, error) = light(Some(&guide), normals, is_in(place));
                let (by_cosine, noise) = light(None, normals, is_in(place));
                let apart = (by_guide - by_cosine).abs();
                assert!(
                    apart <= 4.0 * (error * error + noise * noise).sqrt(),
                    "{by_guide} {by_cosine} {normals:?}"
                );
                assert!(error <= 0.8 * noise || noise == 0.0, "{error} {noise}");
            }
            // From everywhere, and from a direction in which nothing is known.
            let (all, error) = light(Some(&guide), normals, |_| true);
            assert!((all - 1.0).abs() < 4.0 * error.max(1e-9), "{all} {error}");
            let far = |direction: DVec3| direction.z < -0.5;
            let ((by_guide, error), (by_cosine, noise)) =
                (light(Some(&guide), normals, far), light(None, normals, far));
            assert!((by_guide - by_cosine).abs() <= 4.0 * (error * error + noise * noise).sqrt());
        }
    }
}
