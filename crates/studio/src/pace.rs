//! The size of a picture that can be drawn in time, from the time that the last pictures took.

use std::time::Duration;

use glam::DVec3;
use rayfold_scene::{Camera, Material, Scene, Screen};

/// The largest number of pictures that the page has not shown yet while something moves.
pub(crate) const MOVING_UNDER_WAY: u32 = 1;

/// This limit at rest, when sketches precede the final picture.
pub(crate) const RESTING_UNDER_WAY: u32 = 2;

/// The time from the last request of something that moves to its rest. It is longer than a frame at 24 per second, so
/// playback does not count as rest.
pub(crate) const REST: Duration = Duration::from_millis(50);

/// The time for one ray per pixel at rest, in seconds, above which sketches are drawn first.
pub(crate) const PATIENCE: f64 = 0.1;

/// The shortest time between two views of an unfinished picture. Each takes time to be made and shown.
pub(crate) const APART: Duration = Duration::from_millis(200);

/// The longest time between two views. Until this is reached, each time is as long as the whole time before it.
#[cfg(feature = "server")]
pub(crate) const SELDOM: Duration = Duration::from_secs(2);

/// The rays per pixel of a sketch of a scene in which light goes round. One ray would show no indirect light.
pub(crate) const FEW: u32 = 4;

/// The factor by which the next sketch is wider and higher.
pub(crate) const GROWTH: f64 = 2.0;

/// The time for a picture while something moves, in seconds. More than half of the time of a picture at 55 per second
/// goes to packing, the browser, and the wait for the next request.
const MOVING: f64 = 0.009;

/// The share of that time within which a picture larger than the last one must be drawn, so that sizes do not
/// alternate.
const RESERVE: f64 = 0.75;

/// The shares of width and height that are drawn while something moves. They are few steps, because a picture of
/// another size is sent to the page as a whole.
const SHARES: [f64; 5] = [1.0, 0.75, 0.5, 0.375, LEAST];

/// The smallest share of width and height, while something moves and of the first sketch at rest: a hand that holds still
/// for a moment must not make the picture coarser.
const LEAST: f64 = 0.25;

/// The weight of the last picture in the running mean, if it was faster than the mean, and if it was slower. They
/// differ because other load on the processor makes single pictures slow, and none fast.
const WEIGHTS: (f64, f64) = (0.5, 0.25);

/// The limits on reflections and refractions of a ray while something moves, tried in turn if the smallest picture
/// takes too long.
const BOUNCES: [u32; 4] = [4, 2, 1, 0];

/// The minimum number of bounces with which objects can be seen through glass.
const THROUGH_GLASS: u32 = 2;

/// The duration of the last renderings with one ray per pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pace {
    /// The seconds before the first pixel.
    preparing: f64,
    /// The seconds per pixel with all bounces, once such a picture was rendered.
    per_pixel: Option<f64>,
    /// The same with each of [`BOUNCES`], since the last rest.
    fewer: [Option<f64>; BOUNCES.len()],
    /// The share of width and height of the last picture of something that moves.
    share: f64,
}

/// The quality of a picture of something that moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Effort {
    /// The share of the width and of the height.
    pub(crate) share: f64,
    /// The maximum number of bounces that a ray follows, if that is less than the scene's.
    pub(crate) bounces: Option<u32>,
}

impl Pace {
    /// Records the time before the first pixel.
    #[cfg(feature = "server")]
    pub(crate) fn prepared(&mut self, took: Duration) {
        self.preparing = took.as_secs_f64();
    }

    /// Records the time for the pixels of a picture that was drawn with this limit of bounces.
    pub(crate) fn drawn(&mut self, screen: Screen, bounces: Option<u32>, took: Duration) {
        let mean = match BOUNCES.iter().position(|&few| Some(few) == bounces) {
            Some(at) => &mut self.fewer[at],
            None => &mut self.per_pixel,
        };
        let last = took.as_secs_f64() / screen.pixels() as f64;
        let weight = |mean| if last < mean { WEIGHTS.0 } else { WEIGHTS.1 };
        *mean = Some(mean.map_or(last, |mean| mean + weight(mean) * (last - mean)));
    }

    /// Records that nothing moves now.
    pub(crate) fn rested(&mut self) {
        self.fewer = [None; BOUNCES.len()];
    }

    /// Returns the quality of the next picture of something that moves: the size that can be drawn in time, but no less
    /// than a quarter each way. If that takes too long, rays follow fewer mirrors and glass. The pixels of an orthographic
    /// camera are world units, so its size does not change.
    pub(crate) fn moving(&mut self, scene: &Scene) -> Effort {
        if matches!(scene.camera, Camera::Orthographic) {
            return Effort { share: 1.0, bounces: None };
        }
        let pixels = scene.screen.pixels() as f64;
        let fewest = fewest(scene);
        let costs = std::iter::once((None, self.per_pixel))
            .chain(BOUNCES.into_iter().map(Some).zip(self.fewer))
            .filter(|&(bounces, _)| bounces.is_none_or(|few| few < scene.depth.bounces() && few >= fewest));
        let mut effort = Effort { share: LEAST, bounces: None };
        for (bounces, per_pixel) in costs {
            effort.bounces = bounces;
            // What is not known yet is tried with the smallest picture.
            let Some(per_pixel) = per_pixel else { break };
            let is_soon = |share: &f64| {
                let room = if *share > self.share { RESERVE * MOVING } else { MOVING };
                self.preparing + per_pixel * pixels * share * share <= room
            };
            if let Some(share) = SHARES.into_iter().find(is_soon) {
                effort.share = share;
                break;
            }
        }
        self.share = effort.share;
        effort
    }

    /// Returns the seconds that a picture of this size with one ray per pixel takes, once one was rendered.
    pub(crate) fn seconds(&self, screen: Screen) -> Option<f64> {
        self.per_pixel.map(|per_pixel| self.preparing + per_pixel * screen.pixels() as f64)
    }

    /// Returns the share of width and height of a sketch that can be rendered in this many seconds.
    pub(crate) fn share(&self, scene: &Scene, seconds: f64) -> f64 {
        if matches!(scene.camera, Camera::Orthographic) {
            return 1.0;
        }
        let Some(per_pixel) = self.per_pixel else { return LEAST };
        // Preparing takes the same time for few pixels as for many.
        let left = (seconds - self.preparing).max(seconds / 3.0);
        (left / (per_pixel * scene.screen.pixels() as f64)).sqrt().clamp(LEAST, 1.0)
    }
}

/// Returns the minimum number of bounces with which the scene can be recognised. Without mirrors and glass there are
/// none to save.
fn fewest(scene: &Scene) -> u32 {
    let of = |material: &Material| {
        let is_glass = material.finish().is_some_and(|finish| finish.glass.is_some());
        let is_mirror = material.mirror() != DVec3::ZERO;
        if is_glass { Some(THROUGH_GLASS) } else { is_mirror.then_some(0) }
    };
    scene.objects.iter().filter_map(|object| of(object.material())).max().unwrap_or(u32::MAX)
}

/// Returns a share of a screen's size, rounded up.
pub(crate) fn smaller(screen: Screen, share: f64) -> Screen {
    let side = |side: u32| (f64::from(side) * share).ceil().max(1.0) as u32;
    Screen::new(side(screen.width()), side(screen.height())).unwrap_or(screen)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a scene of 1000 x 500 pixels without mirrors.
    fn scene() -> Scene {
        of("")
    }

    /// Returns the same scene with something in it.
    fn of(more: &str) -> Scene {
        let text =
            format!("Screen 1000 500\nLook 0 1 6  0 0 0  50\n{more}\nSphere 1  0 0 0  0 0 0  1 1 1\nTrace");
        rayfold_scene::parse("a", text.as_bytes(), &Default::default()).script.unwrap().frame(0).unwrap()
    }

    /// Makes a pace after pictures that took this many times as long as allowed.
    fn pace(preparing: f64, times: f64) -> Pace {
        let whole = MOVING / 500_000.0;
        Pace { preparing: preparing * MOVING, per_pixel: Some(times * whole), share: 1.0, ..Pace::default() }
    }

    #[test]
    fn what_takes_too_long_is_drawn_smaller_but_no_less_than_a_quarter() {
        let share = |preparing, times| pace(preparing, times).moving(&scene()).share;
        assert_eq!(Pace::default().moving(&scene()).share, 0.25, "before anything is known");
        assert_eq!(
            [0.0, 0.9, 1.1, 1.7, 1.9, 3.9, 4.1].map(|times| share(0.0, times)),
            [1.0, 1.0, 0.75, 0.75, 0.5, 0.5, 0.375]
        );
        assert_eq!([share(0.5, 0.9), share(0.9, 0.9)], [0.5, 0.25], "preparing takes its time, too");
        assert_eq!([share(0.0, 1000.0), share(1000.0, 0.0)], [0.25; 2]);
        let flat = Scene { camera: Camera::Orthographic, ..scene() };
        assert_eq!(pace(0.0, 1000.0).moving(&flat), Effort { share: 1.0, bounces: None });
    }

    #[test]
    fn sizes_do_not_go_to_and_fro() {
        let mut pace = pace(0.0, 1.05);
        let around = [0.95, 1.05, 0.9, 1.1, 0.8].map(|times| {
            pace.per_pixel = Some(times * MOVING / 500_000.0);
            pace.moving(&scene()).share
        });
        assert_eq!(around, [1.0, 0.75, 0.75, 0.75, 0.75]);
        pace.per_pixel = Some(0.7 * MOVING / 500_000.0);
        assert_eq!(pace.moving(&scene()).share, 1.0, "what is much faster is larger");
    }

    #[test]
    fn one_slow_picture_does_not_count_alone() {
        let mut pace = pace(0.0, 0.5);
        let screen = scene().screen;
        pace.drawn(screen, None, Duration::from_secs_f64(1.5 * MOVING));
        assert_eq!(pace.moving(&scene()).share, 1.0);
        (0..5).for_each(|_| pace.drawn(screen, None, Duration::from_secs_f64(1.5 * MOVING)));
        assert_eq!(pace.moving(&scene()).share, 0.75);
    }

    #[test]
    fn mirrors_and_glass_are_simplified_only_where_the_smallest_picture_takes_too_long() {
        let deep = of("Depth 8\nMaterial clear glass 1 1 1 1.5\nSphere 2 0 0 0 clear");
        let mut pace = pace(0.0, 15.0);
        assert_eq!(pace.moving(&deep), Effort { share: 0.25, bounces: None });
        pace.per_pixel = Some(20.0 * MOVING / 500_000.0);
        assert_eq!(pace.moving(&deep), Effort { share: 0.25, bounces: Some(4) }, "it is tried");
        let took = |times: f64| Duration::from_secs_f64(times * MOVING);
        pace.drawn(deep.screen, Some(4), took(17.0));
        assert_eq!(pace.moving(&deep), Effort { share: 0.25, bounces: Some(2) });
        pace.drawn(deep.screen, Some(2), took(2.0));
        assert_eq!(pace.moving(&deep), Effort { share: 0.5, bounces: Some(2) });
        pace.rested();
        assert_eq!(pace.moving(&deep).bounces, Some(4), "each drag tries anew");
        assert_eq!(pace.moving(&scene()), Effort { share: 0.25, bounces: None }, "there is no mirror");
        let mirror = of("Depth 3\nSphere 1 0 0 0  0 0 0  0 0 0  1 1 1");
        assert_eq!(pace.moving(&mirror).bounces, Some(2), "4 are more than its own");
        pace.fewer = [Some(1.0); BOUNCES.len()];
        assert_eq!([&deep, &mirror].map(|scene| pace.moving(scene).bounces), [Some(2), Some(0)]);
    }

    #[test]
    fn a_sketch_at_rest_is_what_can_be_drawn_in_its_time() {
        let share =
            |preparing, per_pixel| Pace { preparing, per_pixel, ..Pace::default() }.share(&scene(), 0.1);
        let whole = 0.1 / 500_000.0;
        assert_eq!(share(0.0, None), LEAST, "before anything is known");
        assert_eq!(share(0.0, Some(0.0)), 1.0);
        assert!((share(0.0, Some(4.0 * whole)) - 0.5).abs() < 1e-9);
        assert!((share(0.05, Some(2.0 * whole)) - 0.5).abs() < 1e-9);
        assert_eq!(share(9.0, Some(whole)), share(8.0, Some(whole)), "preparing is not to make it tiny");
        assert_eq!(share(0.0, Some(1.0)), LEAST);
    }
}
