//! A guide of scattered rays to bright light: to what glows, to windows, and to the bright parts of a sky's picture.
//!
//! Chance alone rarely finds a small pane that glows, or the sun of a sky. So beside the ray that a surface scatters by the cosine,
//! another one is aimed at these. Each of the two counts for the density that the language asks for, divided by the sum of the
//! densities of both ways of drawing: the balance heuristic of Veach and Guibas (1995). The expectation stays as it is, and no ray
//! counts for more than it would without a guide.
//!
//! Cones around boxes hold what glows, and the windows of a room. The sky is drawn by a table of how much brighter than the
//! mean it is, since the cosine finds the rest as well (Karlík, Šik, Vévoda, Skřivan and Křivánek, 2019).

use core::f64::consts::{FRAC_1_PI, PI, TAU};
use std::sync::Arc;

use glam::DVec3;
use rayfold_scene::{Object, Scene};

use super::paths::scattered;
use super::places::in_cone;
use super::sky_table::{SkyTable, brightness};
use crate::pictures::Panorama;

/// The largest number of cones. Each is asked for at each hit.
const MAX_CONES: usize = 16;

/// The part of the light from all around that is weighed against what is bright. Walls often keep most of it out.
const OPENNESS: f64 = 0.2;

/// The bright light of a scene at a moment.
#[derive(Clone, Debug)]
pub(crate) struct Guide {
    cones: Vec<Ball>,
    sky: Option<(Arc<SkyTable>, Panorama)>,
    windows: Option<Arc<Windows>>,
    /// The light that the bright parts of the sky give a surface, about.
    sky_weight: f64,
    /// The light that a surface gets from all around, about.
    around: f64,
}

/// A ball around a part of what glows.
#[derive(Clone, Copy, Debug)]
struct Ball {
    center: DVec3,
    radius: f64,
    brightness: f64,
}

impl Guide {
    /// Returns the guide of each moment of a scene; `None` if nothing is bright, or if no ray is scattered. `windows` are those of
    /// the first moment.
    pub(crate) fn of(moments: &[Scene], windows: Option<Windows>) -> Vec<Option<Self>> {
        let windows = windows.map(Arc::new);
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
            let cones = balls(glowing(scene));
            let is_bright = sky.is_some() || windows.is_some() || !cones.is_empty();
            let windows = windows.clone();
            is_bright.then(|| Self { cones, sky, windows, sky_weight, around: PI * mean })
        };
        moments.iter().map(of).collect()
    }

    /// Returns the rays that a surface scatters at a place of the scene: their directions, and the factors with which they count. A
    /// factor is 0 for a ray that is none. The other arguments are those of [`scattered`].
    pub(crate) fn scattered(
        &self,
        (u, v): (f64, f64),
        place: DVec3,
        (normal, face): (DVec3, DVec3),
        aims: &mut Aims,
    ) -> [(DVec3, f64); 2] {
        let seen = &mut aims.0;
        seen.clear();
        let mut lit = self.sky_weight;
        let windows = self.windows.as_ref().filter(|windows| windows.contain(place));
        let windows = windows.map_or(&[][..], |windows| &windows.balls);
        for cone in self.cones.iter().chain(windows).filter_map(|ball| ball.seen(place, normal)) {
            lit += cone.weight;
            seen.push(cone);
        }
        let by_cosine = scattered((u, v), normal, face);
        // The chance of a second ray. It is no number without light.
        let share = lit / (lit + OPENNESS * self.around);
        if share.is_nan() || share == 0.0 {
            return [(by_cosine, 1.0), (by_cosine, 0.0)];
        }
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
        seen.iter().fold(of_sky, |sum, seen| sum + seen.weighted_density(direction))
    }

    /// Returns a direction towards light. `at` is below the sum of all weights.
    fn towards_light(&self, (mut at, v): (f64, f64), seen: &[Seen]) -> DVec3 {
        for seen in seen {
            if at < seen.weight {
                return seen.within(at / seen.weight, v);
            }
            at -= seen.weight;
        }
        match &self.sky {
            Some((table, panorama)) => {
                panorama.turned_back(table.directions.direction((at / self.sky_weight).min(1.0), v))
            }
            // The sum was rounded.
            None => seen.last().map_or(DVec3::Y, |seen| seen.within(1.0, v)),
        }
    }
}

/// Room for what a surface sees, used for one hit after another.
#[derive(Default)]
pub(crate) struct Aims(Vec<Seen>);

/// A ball as a surface sees it.
struct Seen {
    /// The light that it gives the surface, about.
    weight: f64,
    /// Its weight in a unit of solid angle.
    flux: f64,
    /// Its direction.
    axis: DVec3,
    /// 1 - cos of half the angle of a cone around it.
    spread: f64,
}

impl Seen {
    /// Returns the density of directions in the cone, times the weight.
    #[inline(always)]
    fn weighted_density(&self, direction: DVec3) -> f64 {
        // Of narrow cones the cosine is no measure.
        if (direction - self.axis).length_squared() <= 2.0 * self.spread { self.flux } else { 0.0 }
    }

    /// Returns a direction in the cone.
    fn within(&self, u: f64, v: f64) -> DVec3 {
        let (x, y) = self.axis.any_orthonormal_pair();
        let DVec3 { x: across, y: down, z: along } = in_cone(u, v, self.spread);
        (across * x + down * y + along * self.axis).normalize()
    }
}

impl Ball {
    /// Returns how a surface sees it; `None` for a ball that the surface is in or that is behind it.
    #[inline(always)]
    fn seen(&self, place: DVec3, normal: DVec3) -> Option<Seen> {
        let towards = self.center - place;
        let nearness = 1.0 / towards.length_squared().sqrt();
        let axis = towards * nearness;
        let sine = self.radius * nearness;
        // No point of the ball is seen under a larger cosine.
        let cosine = (axis.dot(normal) + sine).min(1.0);
        // A little above 1 - √(1 - sine²), by its series.
        let share = sine * sine;
        let spread = share * (0.5 + share * (0.125 + share * (0.0625 + share * 0.3125)));
        let flux = self.brightness * cosine;
        (sine < 1.0 && share > 1e-30 && cosine > 0.0).then_some(Seen {
            weight: flux * TAU * spread,
            flux,
            axis: axis + DVec3::ZERO,
            spread,
        })
    }
}

/// Returns the density of the directions of [`scattered`].
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

/// Returns half of the area of a box.
pub(crate) fn half_area([low, high]: [DVec3; 2]) -> f64 {
    let DVec3 { x, y, z } = high - low;
    x * y + y * z + z * x
}

/// A part of what is bright.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    pub(crate) brightness: f64,
    /// The lowest and the highest corner of its box.
    pub(crate) bounds: [DVec3; 2],
}

/// The windows of a room.
#[derive(Debug)]
pub(crate) struct Windows {
    room: [DVec3; 2],
    balls: Vec<Ball>,
}

impl Windows {
    pub(crate) fn new(room: [DVec3; 2], windows: Vec<Part>) -> Self {
        Self { room, balls: balls(windows) }
    }

    fn contain(&self, place: DVec3) -> bool {
        place.cmpge(self.room[0]).all() && place.cmple(self.room[1]).all()
    }
}

/// Returns the parts of a scene that glow.
fn glowing(scene: &Scene) -> Vec<Part> {
    let glow = |object: &Object| object.material().finish().map_or(DVec3::ZERO, |finish| finish.glow);
    let objects = scene.objects.iter().filter(|object| glow(object) != DVec3::ZERO);
    let part =
        |object: &Object| Some(Part { brightness: brightness(glow(object)), bounds: object.bounds()? });
    objects.filter_map(part).collect()
}

/// Returns balls around what is bright: around boxes that are about as long as wide.
fn balls(mut parts: Vec<Part>) -> Vec<Ball> {
    // The ones to find are those that give most light.
    parts.sort_by(|a, b| b.power().total_cmp(&a.power()));
    parts.truncate(MAX_CONES);
    while parts.len() < MAX_CONES {
        let longest =
            (0..parts.len()).max_by(|&a, &b| parts[a].elongation().total_cmp(&parts[b].elongation()));
        let Some(at) = longest.filter(|&at| parts[at].elongation() > 0.0) else { break };
        let Part { bounds: [low, high], .. } = parts[at];
        let half = DVec3::AXES[(high - low).max_position()] * (high - low) / 2.0;
        parts.push(Part { bounds: [low + half, high], ..parts[at] });
        parts[at].bounds[1] = high - half;
    }
    let ball = |Part { brightness, bounds: [low, high] }: Part| Ball {
        center: low.midpoint(high),
        radius: (high - low).length() / 2.0,
        brightness,
    };
    parts.into_iter().map(ball).filter(|ball| ball.radius > 0.0 && ball.radius.is_finite()).collect()
}

impl Part {
    /// Returns about how much light the surface of its box gives off.
    fn power(&self) -> f64 {
        self.brightness * half_area(self.bounds)
    }

    /// Returns how much light is at stake in the halves of a long box; 0 for boxes that are short.
    fn elongation(&self) -> f64 {
        let sides = self.bounds[1] - self.bounds[0];
        let longest = sides.max_position();
        let second =
            (0..3).filter(|&axis| axis != longest).fold(0.0, |most: f64, axis| most.max(sides[axis]));
        if sides[longest] > 2.0 * second { self.brightness * sides[longest] * sides[longest] } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guide(cones: Vec<Part>, windows: Option<Windows>) -> Guide {
        Guide { cones: balls(cones), sky: None, windows: windows.map(Arc::new), sky_weight: 0.0, around: 0.3 }
    }

    fn part(brightness: f64, low: [f64; 3], high: [f64; 3]) -> Part {
        Part { brightness, bounds: [low.into(), high.into()] }
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
                Some(guide) => guide.scattered(numbers, DVec3::ZERO, normals, &mut Aims::default()),
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
    fn light_from_all_directions_is_that_of_the_cosine_with_less_noise() {
        let tube = part(4.0, [-1.0, 1.0, -0.05], [1.0, 1.1, 0.05]);
        let pane = part(2.0, [0.5, 0.3, 0.5], [0.9, 0.3, 0.9]);
        let window = Windows::new(
            [DVec3::splat(-2.0), DVec3::splat(2.0)],
            vec![part(1.0, [-2.0, 0.5, 0.0], [-2.0, 1.0, 0.4])],
        );
        let guide = guide(vec![tube, pane], Some(window));
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

    #[test]
    fn long_boxes_are_many_balls_and_the_brightest_are_kept() {
        let tube = balls(vec![part(1.0, [0.0; 3], [8.0, 0.5, 0.5])]);
        assert_eq!(tube.len(), 8);
        assert!(tube.iter().all(|ball| ball.radius < 0.7));
        let crowd = (1..100).map(|k| part(f64::from(k), [0.0; 3], [1.0; 3])).collect();
        let crowd = balls(crowd);
        assert_eq!(crowd.len(), MAX_CONES);
        assert!(crowd.iter().all(|ball| ball.brightness > 83.0));
    }
}
