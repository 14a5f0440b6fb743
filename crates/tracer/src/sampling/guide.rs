//! Guides scattered rays to bright light: to glowing surfaces, to windows, and to the bright parts of a sky's picture.
//!
//! Random directions rarely hit a small pane that glows, or the sun of a sky. So a surface scatters two rays: one drawn
//! by the cosine, and one aimed at bright light. Each of the two counts with the density that the language defines,
//! divided by the sum of the densities of both ways of drawing: the balance heuristic of Veach and Guibas (1995). The
//! expectation stays the same, and no ray counts for more than it would without a guide.
//!
//! Glowing objects and the windows of a room are aimed at by cones around boxes. The sky is sampled by a table of its
//! brightness above the mean, because the cosine samples the rest as well (Karlík, Šik, Vévoda, Skřivan and Křivánek,
//! 2019).

#![expect(clippy::needless_range_loop, reason = "lanes of several columns, which become packets")]

use core::f64::consts::{FRAC_1_PI, PI};
use std::sync::Arc;

use glam::DVec3;
use rayfold_scene::Scene;

use super::bright::{Bright, Places, Seen, at, brightest};
use super::sky_table::{SkyTable, brightness};
use crate::pictures::Panorama;

/// The share of the light from all around that is compared with the bright light. Walls often keep out most of the
/// light from all around.
const OPENNESS: f64 = 0.2;

/// The share of all light from which on rays are always aimed at the bright light.
const BRIGHT: f64 = 0.4;

/// The bright light of a scene at a moment.
#[derive(Clone, Debug)]
pub(crate) struct Guide {
    /// Glowing objects, and after them the windows.
    lights: Vec<Bright>,
    /// The number of glowing objects among the lights.
    glowing: usize,
    /// The box in which windows are seen.
    room: Option<[DVec3; 2]>,
    sky: Option<(Arc<SkyTable>, Panorama)>,
    /// The approximate light of the bright parts of the sky at a surface.
    sky_weight: f64,
    /// The approximate light from all around at a surface.
    around: f64,
}

impl Guide {
    /// Returns the guide of each moment of a scene, or `None` if nothing is bright, or if no ray is scattered.
    /// `windows` are those of the first moment.
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

    /// Returns the rays that surfaces scatter: those by the cosine, those aimed at light, and the factors with which
    /// both count. `seen` is working memory.
    #[inline(always)]
    pub(crate) fn scattered<const N: usize>(
        &self,
        hits: &Scattering<N>,
        seen: &mut Vec<Seen<N>>,
    ) -> Aimed<N> {
        let lit = self.see(hits, seen);
        let mut share = [0.0; N];
        for k in 0..N {
            // The chance of a second ray.
            share[k] = (lit[k] / (BRIGHT * (lit[k] + OPENNESS * self.around))).min(1.0);
        }
        let mut is_aimed = [false; N];
        let mut sums = [0.0; N];
        for k in 0..N {
            let u = hits.numbers[0][k];
            is_aimed[k] = hits.is_hit[k] && lit[k] > 0.0 && u < share[k];
            sums[k] = u / share[k] * lit[k];
        }
        let aimed = self.towards_light(&is_aimed, (sums, hits.numbers[1]), seen);
        let by_cosine = self.weighted_densities(&hits.by_cosine, &hits.is_hit, seen);
        let towards_light = self.weighted_densities(&aimed, &is_aimed, seen);
        let mut factors = [[0.0; N]; 2];
        for k in 0..N {
            let part = |directions: &Places<N>, weighted: f64| {
                let asked = density(at(directions, k), at(&hits.normal, k), at(&hits.face, k));
                let aimed = share[k] / lit[k] * weighted;
                if asked > 0.0 { asked / (asked + aimed) } else { 0.0 }
            };
            // A ray by the cosine along the surface counts as nothing.
            let first = part(&hits.by_cosine, by_cosine[k]);
            factors[0][k] = if lit[k] > 0.0 { first } else { 1.0 };
            let second = part(&aimed, towards_light[k]);
            factors[1][k] = if is_aimed[k] { second } else { 0.0 };
        }
        Aimed { directions: aimed, factors }
    }

    /// Finds how surfaces see each of the lights. Returns the approximate light that they get from all of them.
    #[inline(always)]
    fn see<const N: usize>(&self, hits: &Scattering<N>, seen: &mut Vec<Seen<N>>) -> [f64; N] {
        seen.clear();
        let (glowing, windows) = self.lights.split_at(self.glowing);
        let (mut from_glowing, mut from_windows) = ([0.0; N], [0.0; N]);
        for bright in glowing {
            let one = bright.seen(&hits.place, &hits.normal);
            for k in 0..N {
                from_glowing[k] += one.weight[k];
            }
            seen.push(one);
        }
        if let Some([low, high]) = self.room {
            let is_in: [bool; N] = core::array::from_fn(|k| {
                let place = at(&hits.place, k);
                place.cmpge(low).all() && place.cmple(high).all()
            });
            for bright in windows {
                let mut one = bright.seen(&hits.place, &hits.normal);
                one.keep(&is_in);
                for k in 0..N {
                    from_windows[k] += one.weight[k];
                }
                seen.push(one);
            }
        }
        core::array::from_fn(|k| self.sky_weight + from_glowing[k] + from_windows[k])
    }

    /// Returns, for each direction, the sum of the densities with which it can be aimed at, each times its weight.
    /// Results for directions that are not wanted are undefined.
    #[inline(always)]
    fn weighted_densities<const N: usize>(
        &self,
        directions: &Places<N>,
        is_wanted: &[bool; N],
        seen: &[Seen<N>],
    ) -> [f64; N] {
        let mut sums = [0.0; N];
        if let Some((table, panorama)) = &self.sky {
            for k in (0..N).filter(|&k| is_wanted[k]) {
                sums[k] = self.sky_weight * table.directions.density(panorama.turned(at(directions, k)));
            }
        }
        for (seen, bright) in seen.iter().zip(&self.lights) {
            seen.add_density(bright, directions, &mut sums);
        }
        sums
    }

    /// Returns the directions towards light of the surfaces that aim. The sums choose the lights, and are below those
    /// of all weights.
    #[inline(always)]
    fn towards_light<const N: usize>(
        &self,
        is_aimed: &[bool; N],
        (mut sums, v): ([f64; N], [f64; N]),
        seen: &[Seen<N>],
    ) -> Places<N> {
        // The number of the light, and the first of the numbers of the direction to it.
        let (mut chosen, mut u) = ([usize::MAX; N], [0.0; N]);
        for k in (0..N).filter(|&k| is_aimed[k]) {
            let of = seen.iter().position(|seen| {
                let weight = seen.weight[k];
                let is_it = sums[k] < weight;
                if is_it {
                    u[k] = sums[k] / weight;
                } else {
                    sums[k] -= weight;
                }
                is_it
            });
            chosen[k] = of.unwrap_or(usize::MAX);
            if of.is_none() && self.sky.is_none() {
                // The sum was rounded.
                chosen[k] = seen.iter().rposition(|seen| seen.weight[k] > 0.0).unwrap_or(usize::MAX);
                u[k] = 1.0;
            }
        }
        let mut aimed = [[0.0; N]; 3];
        for (number, (seen, bright)) in seen.iter().zip(&self.lights).enumerate() {
            if !chosen.contains(&number) {
                continue;
            }
            let towards = seen.towards(bright, &[u, v]);
            for (aimed, towards) in aimed.iter_mut().zip(&towards) {
                for k in 0..N {
                    aimed[k] = if chosen[k] == number { towards[k] } else { aimed[k] };
                }
            }
        }
        if let Some((table, panorama)) = &self.sky {
            for k in (0..N).filter(|&k| is_aimed[k] && chosen[k] == usize::MAX) {
                let u = (sums[k] / self.sky_weight).min(1.0);
                let towards = panorama.turned_back(table.directions.direction(u, v[k]));
                (aimed[0][k], aimed[1][k], aimed[2][k]) = (towards.x, towards.y, towards.z);
            }
        }
        aimed
    }
}

/// Hits at which light is scattered.
pub(crate) struct Scattering<const N: usize> {
    /// Whether there is a hit. Results for other lanes are undefined.
    pub(crate) is_hit: [bool; N],
    /// The numbers of the directions.
    pub(crate) numbers: [[f64; N]; 2],
    /// The directions that [`super::paths::scattered`] gives for them and for the normals.
    pub(crate) by_cosine: Places<N>,
    /// The places in the scene.
    pub(crate) place: Places<N>,
    pub(crate) normal: Places<N>,
    pub(crate) face: Places<N>,
}

impl Scattering<1> {
    pub(crate) fn of_one(
        numbers: (f64, f64),
        by_cosine: DVec3,
        place: DVec3,
        (normal, face): (DVec3, DVec3),
    ) -> Self {
        let column = |v: DVec3| v.to_array().map(|x| [x]);
        Self {
            is_hit: [true],
            numbers: [[numbers.0], [numbers.1]],
            by_cosine: column(by_cosine),
            place: column(place),
            normal: column(normal),
            face: column(face),
        }
    }
}

/// Rays that are aimed at light.
pub(crate) struct Aimed<const N: usize> {
    pub(crate) directions: Places<N>,
    /// The factors with which the rays by the cosine count, and the aimed ones. The factor is 0 if there is no ray.
    pub(crate) factors: [[f64; N]; 2],
}

impl Aimed<1> {
    /// Returns the two rays of one surface, and the factors with which they count.
    pub(crate) fn of_one(&self, by_cosine: DVec3) -> [(DVec3, f64); 2] {
        let [[first], [second]] = self.factors;
        [(by_cosine, first), (at(&self.directions, 0), second)]
    }
}

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

    /// The rays of one surface: their directions, and the factors with which they count.
    fn rays(guide: &Guide, numbers: (f64, f64), normals: (DVec3, DVec3)) -> [(DVec3, f64); 2] {
        let by_cosine = scattered(numbers, normals.0, normals.1);
        let hit = Scattering::of_one(numbers, by_cosine, DVec3::ZERO, normals);
        guide.scattered(&hit, &mut vec![]).of_one(by_cosine)
    }

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
            let drawn = match guide {
                Some(guide) => rays(guide, numbers, normals),
                None => [(scattered(numbers, normal, face), 1.0), (DVec3::Y, 0.0)],
            };
            for (direction, share) in drawn.iter().filter(|ray| ray.1 > 0.0) {
                assert!((direction.length() - 1.0).abs() < 1e-14 && *share <= 1.0);
            }
            let of = |(direction, share): (DVec3, f64)| if is_lit(direction) { share } else { 0.0 };
            let light: f64 = drawn.map(of).into_iter().sum();
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
        let rays = rays(&dark, (0.3, 0.4), (DVec3::Y, DVec3::Y));
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
