//! The size of a picture that can be drawn in time, from the time that the last pictures took.

use std::time::Duration;

use rayfold_scene::{Camera, Scene, Screen};

/// The time for a picture while something moves, in seconds. More than half of the time of a picture at 55 per second
/// goes to packing, the browser, and the wait for the next request.
const MOVING: f64 = 0.009;

/// The share of that time in which a picture larger than the last one must be drawn. So sizes do not go to and fro.
const RESERVE: f64 = 0.75;

/// The shares of width and height that are drawn while something moves. Steps, because the page gets a picture of
/// another size as a whole.
const SHARES: [f64; 5] = [1.0, 0.75, 0.5, 0.375, 0.25];

/// The smallest share of width and height of the first sketch at rest.
const LEAST: f64 = 0.125;

/// The weight of the last picture in the mean of those before it.
const WEIGHT: f64 = 0.4;

/// The duration of the last renderings with one ray per pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pace {
    /// The seconds before the first pixel.
    preparing: f64,
    /// The seconds per pixel, once a picture was rendered.
    per_pixel: Option<f64>,
    /// The share of width and height of the last picture of something that moves.
    share: f64,
}

impl Pace {
    /// Records the time before the first pixel.
    pub(crate) fn prepared(&mut self, took: Duration) {
        self.preparing = took.as_secs_f64();
    }

    /// Records the time for the pixels of a picture.
    pub(crate) fn drawn(&mut self, screen: Screen, took: Duration) {
        let last = took.as_secs_f64() / screen.pixels() as f64;
        self.per_pixel = Some(self.per_pixel.map_or(last, |mean| mean + WEIGHT * (last - mean)));
    }

    /// Returns the share of width and height of the next picture of something that moves: what can be drawn in time, but
    /// no less than a quarter. The pixels of an orthographic camera are world units, so its size does not change.
    pub(crate) fn moving(&mut self, scene: &Scene) -> f64 {
        if matches!(scene.camera, Camera::Orthographic) {
            return 1.0;
        }
        let least = SHARES[SHARES.len() - 1];
        let Some(per_pixel) = self.per_pixel else { return least };
        let pixels = scene.screen.pixels() as f64;
        let is_soon = |share: &f64| {
            let room = if *share > self.share { RESERVE * MOVING } else { MOVING };
            self.preparing + per_pixel * pixels * share * share <= room
        };
        self.share = SHARES.into_iter().find(is_soon).unwrap_or(least);
        self.share
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a scene of 1000 x 500 pixels.
    fn scene() -> Scene {
        let text = "Screen 1000 500\nLook 0 1 6  0 0 0  50\nSphere 1  0 0 0  0 0 0  1 1 1\nTrace";
        rayfold_scene::parse("a", text.as_bytes(), &Default::default()).script.unwrap().frame(0).unwrap()
    }

    /// Makes the pace of pictures that take so many times as long as they may.
    fn pace(preparing: f64, times: f64) -> Pace {
        let whole = MOVING / 500_000.0;
        Pace { preparing: preparing * MOVING, per_pixel: Some(times * whole), share: 1.0 }
    }

    #[test]
    fn what_takes_too_long_is_drawn_smaller_but_no_less_than_a_quarter() {
        let share = |preparing, times| pace(preparing, times).moving(&scene());
        assert_eq!(Pace::default().moving(&scene()), 0.25, "before anything is known");
        assert_eq!(
            [0.0, 0.9, 1.1, 1.7, 1.9, 3.9, 4.1].map(|times| share(0.0, times)),
            [1.0, 1.0, 0.75, 0.75, 0.5, 0.5, 0.375]
        );
        assert_eq!([share(0.5, 0.9), share(0.9, 0.9)], [0.5, 0.25], "preparing takes its time, too");
        assert_eq!([share(0.0, 1000.0), share(1000.0, 0.0)], [0.25; 2]);
        let flat = Scene { camera: Camera::Orthographic, ..scene() };
        assert_eq!(pace(0.0, 1000.0).moving(&flat), 1.0);
    }

    #[test]
    fn sizes_do_not_go_to_and_fro() {
        let mut pace = pace(0.0, 1.05);
        let around = [0.95, 1.05, 0.9, 1.1, 0.8].map(|times| {
            pace.per_pixel = Some(times * MOVING / 500_000.0);
            pace.moving(&scene())
        });
        assert_eq!(around, [1.0, 0.75, 0.75, 0.75, 0.75]);
        pace.per_pixel = Some(0.7 * MOVING / 500_000.0);
        assert_eq!(pace.moving(&scene()), 1.0, "what is much faster is larger");
    }

    #[test]
    fn one_slow_picture_does_not_count_alone() {
        let mut pace = pace(0.0, 0.5);
        let screen = scene().screen;
        pace.drawn(screen, Duration::from_secs_f64(1.5 * MOVING));
        assert_eq!(pace.moving(&scene()), 1.0);
        (0..5).for_each(|_| pace.drawn(screen, Duration::from_secs_f64(1.5 * MOVING)));
        assert_eq!(pace.moving(&scene()), 0.75);
    }

    #[test]
    fn a_sketch_at_rest_is_what_can_be_drawn_in_its_time() {
        let share = |preparing, per_pixel| Pace { preparing, per_pixel, share: 0.0 }.share(&scene(), 0.1);
        let whole = 0.1 / 500_000.0;
        assert_eq!(share(0.0, None), LEAST, "before anything is known");
        assert_eq!(share(0.0, Some(0.0)), 1.0);
        assert!((share(0.0, Some(4.0 * whole)) - 0.5).abs() < 1e-9);
        assert!((share(0.05, Some(2.0 * whole)) - 0.5).abs() < 1e-9);
        assert_eq!(share(9.0, Some(whole)), share(8.0, Some(whole)), "preparing is not to make it tiny");
        assert_eq!(share(0.0, Some(1.0)), LEAST);
    }
}
