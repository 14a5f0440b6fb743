//! Drawing what the page asks for, on a thread of its own: the newest request wins.
//!
//! A request that waits is replaced by the next one. One that is being drawn at full size is given up for a newer one;
//! while something moves it is drawn to the end, smaller where it would take too long, so that there always is a
//! picture, and with one ray a pixel, whatever the script says. At rest a picture of several rays a pixel is shown after each
//! pass over it. No more pictures are under way than the page keeps up with.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use image::RgbImage;
use rayfold_scene::{Camera, Samples, Scene, Screen};
use rayfold_tracer::{Drawing, RenderOptions};

/// Pictures that the page has not shown yet, at most.
const UNDER_WAY: u32 = 2;

/// Seconds that a picture may take while something moves.
const MOVING: f64 = 0.03;

/// The least share of width and height that is drawn while something moves.
const LEAST: f64 = 0.125;

/// Bytes before the pixels: the picture's number, width, height, and microseconds that it took; little-endian.
pub(crate) const HEADER: usize = 16;

/// A picture that is wanted.
#[derive(Clone, Debug)]
pub(crate) struct Wanted {
    /// What to draw; its screen is the size.
    pub(crate) scene: Scene,
    /// Something is being dragged: better now than sharp.
    pub(crate) moving: bool,
    /// What the page calls it.
    pub(crate) number: u32,
}

/// Where pictures are ordered.
#[derive(Clone, Debug)]
pub(crate) struct Painter(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    desk: Mutex<Desk>,
    news: Condvar,
    /// Ends the drawing that goes on.
    cancel: AtomicBool,
}

#[derive(Debug, Default)]
struct Desk {
    wanted: Option<Wanted>,
    under_way: u32,
    closed: bool,
    /// The picture that is being drawn may be given up.
    at_rest: bool,
}

impl Painter {
    /// Starts the thread, which ends when the painter is closed; `send` gets each picture with its header, and says
    /// whether there is still somebody to take it.
    ///
    /// # Errors
    /// When the system has no thread.
    pub(crate) fn start(send: impl Fn(Vec<u8>) -> bool + Send + 'static) -> std::io::Result<Self> {
        let shared =
            Arc::new(Shared { desk: Mutex::default(), news: Condvar::new(), cancel: AtomicBool::new(false) });
        let own = Arc::clone(&shared);
        thread::Builder::new().name("painter".into()).spawn(move || own.work(&send))?;
        Ok(Self(shared))
    }

    /// Orders a picture, instead of any that is waiting.
    pub(crate) fn want(&self, wanted: Wanted) {
        self.0.change(|desk| {
            if desk.at_rest {
                self.0.cancel.store(true, Ordering::Relaxed);
            }
            desk.wanted = Some(wanted);
        });
    }

    /// The page has shown one.
    pub(crate) fn shown(&self) {
        self.0.change(|desk| desk.under_way = desk.under_way.saturating_sub(1));
    }

    /// No more pictures.
    pub(crate) fn close(&self) {
        self.0.cancel.store(true, Ordering::Relaxed);
        self.0.change(|desk| desk.closed = true);
    }
}

impl Shared {
    fn change(&self, change: impl FnOnce(&mut Desk)) {
        change(&mut self.desk.lock().unwrap_or_else(PoisonError::into_inner));
        self.news.notify_all();
    }

    fn next(&self) -> Option<Wanted> {
        let mut desk = self.desk.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            if desk.closed {
                return None;
            }
            if desk.under_way < UNDER_WAY
                && let Some(wanted) = desk.wanted.take()
            {
                desk.under_way += 1;
                desk.at_rest = !wanted.moving;
                self.cancel.store(false, Ordering::Relaxed);
                return Some(wanted);
            }
            desk = self.news.wait(desk).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn work(&self, send: &impl Fn(Vec<u8>) -> bool) {
        // Seconds that a pixel took last.
        let mut per_pixel = 0.0;
        while let Some(wanted) = self.next() {
            let mut scene = wanted.scene;
            if wanted.moving {
                scene.screen = smaller(scene.screen, &scene.camera, per_pixel);
                scene.samples = Samples::default();
            }
            let start = Instant::now();
            let options = RenderOptions { cancel: Some(&self.cancel), ..RenderOptions::default() };
            let drawn = Drawing::new(&scene, &options).and_then(|drawing| {
                drawing.draw_progressively(|image| {
                    // What the page cannot show in time is left out: a finer one follows.
                    if self.another() {
                        send(packed(wanted.number, &image, start.elapsed()));
                    }
                })
            });
            let Ok(image) = drawn else {
                // Given up for a newer one, or beyond what can be drawn.
                self.change(|desk| desk.under_way = desk.under_way.saturating_sub(1));
                continue;
            };
            let took = start.elapsed();
            if wanted.moving {
                per_pixel = took.as_secs_f64() / scene.screen.pixels() as f64;
            }
            if !send(packed(wanted.number, &image, took)) {
                return;
            }
        }
    }

    /// Whether the page has room for a picture more; if so, that is under way.
    fn another(&self) -> bool {
        let mut is_free = false;
        self.change(|desk| {
            is_free = desk.under_way < UNDER_WAY;
            desk.under_way += u32::from(is_free);
        });
        is_free
    }
}

/// A picture as the page takes it.
fn packed(number: u32, image: &RgbImage, took: Duration) -> Vec<u8> {
    let (width, height) = image.dimensions();
    let micros = u32::try_from(took.as_micros()).unwrap_or(u32::MAX);
    let mut bytes = Vec::with_capacity(HEADER + image.len() / 3 * 4);
    for number in [number, width, height, micros] {
        bytes.extend_from_slice(&number.to_le_bytes());
    }
    bytes.extend(image.as_raw().as_chunks::<3>().0.iter().flat_map(|&[r, g, b]| [r, g, b, 255]));
    bytes
}

/// A size that is drawn in time. The pixels of an orthographic camera are world units, and stay.
fn smaller(screen: Screen, camera: &Camera, per_pixel: f64) -> Screen {
    if matches!(camera, Camera::Orthographic) {
        return screen;
    }
    let share = (MOVING / (per_pixel * screen.pixels() as f64)).sqrt();
    if share >= 1.0 {
        return screen;
    }
    let side = |side: u32| (f64::from(side) * share.max(LEAST)).round().max(1.0) as u32;
    Screen::new(side(screen.width()), side(screen.height())).unwrap_or(screen)
}

#[cfg(test)]
mod tests {
    use rayfold_tracer::render;
    use std::sync::mpsc;

    use super::*;

    fn wanted(number: u32, moving: bool) -> Wanted {
        let text = "Screen 64 48\nBackground 0 0.5 1\nSphere 10 30 20 -20  1 0 0  0 0 0\nTrace";
        let scene =
            rayfold_scene::parse("a", text.as_bytes(), &Default::default()).script.unwrap().frame(0).unwrap();
        Wanted { scene, moving, number }
    }

    fn number(picture: &[u8]) -> u32 {
        u32::from_le_bytes(picture[..4].try_into().unwrap())
    }

    #[test]
    fn a_picture_is_the_tracers() {
        let (sender, pictures) = mpsc::channel();
        let painter = Painter::start(move |picture| sender.send(picture).is_ok()).unwrap();
        let request = wanted(7, true);
        let expected = render(&request.scene, &RenderOptions::default()).unwrap();
        painter.want(request);
        let picture = pictures.recv_timeout(Duration::from_secs(20)).unwrap();
        assert_eq!((number(&picture), picture.len()), (7, HEADER + 64 * 48 * 4));
        let (pixels, _) = picture[HEADER..].as_chunks::<4>();
        assert!(pixels.iter().zip(expected.pixels()).all(|(a, b)| a[..3] == b.0 && a[3] == 255));
        painter.close();
    }

    #[test]
    fn at_rest_a_picture_gets_finer_and_ends_as_the_tracers() {
        let (sender, pictures) = mpsc::channel();
        let painter = Painter::start(move |picture| sender.send(picture).is_ok()).unwrap();
        let mut request = wanted(9, false);
        request.scene.samples = Samples::new(64, 1.0).unwrap();
        let expected = render(&request.scene, &RenderOptions::default()).unwrap();
        painter.want(request);
        let mut seen = vec![];
        let is_last = |picture: &Vec<u8>| {
            let (pixels, _) = picture[HEADER..].as_chunks::<4>();
            pixels.iter().zip(expected.pixels()).all(|(a, b)| a[..3] == b.0)
        };
        while !seen.last().is_some_and(is_last) {
            seen.push(pictures.recv_timeout(Duration::from_secs(20)).unwrap());
            painter.shown();
        }
        assert!(seen.len() > 1 && seen.iter().all(|picture| number(picture) == 9), "{}", seen.len());
        painter.close();
    }

    #[test]
    fn the_newest_request_wins_and_no_more_than_two_are_under_way() {
        let (sender, pictures) = mpsc::channel();
        let painter = Painter::start(move |picture| sender.send(picture).is_ok()).unwrap();
        for request in 1..=2 {
            painter.want(wanted(request, true));
            assert_eq!(number(&pictures.recv_timeout(Duration::from_secs(20)).unwrap()), request);
        }
        for request in 3..=50 {
            painter.want(wanted(request, true));
        }
        assert!(pictures.recv_timeout(Duration::from_millis(200)).is_err(), "the page has shown none yet");
        painter.shown();
        assert_eq!(number(&pictures.recv_timeout(Duration::from_secs(20)).unwrap()), 50);
        painter.close();
    }

    #[test]
    fn what_takes_too_long_is_drawn_smaller() {
        let screen = Screen::new(1000, 500).unwrap();
        let orbit = crate::view::Orbit {
            target: glam::DVec3::ZERO,
            distance: 1.0,
            yaw: 0.0,
            pitch: 0.0,
            half_fov: 0.4,
        };
        let camera = Camera::Pinhole(orbit.camera(2.0).unwrap());
        let size = |per_pixel| {
            let screen = smaller(screen, &camera, per_pixel);
            (screen.width(), screen.height())
        };
        assert_eq!(size(0.0), (1000, 500));
        assert_eq!(size(MOVING / 500_000.0 * 4.0), (500, 250));
        assert_eq!(size(1.0), (125, 63));
        assert_eq!(smaller(screen, &Camera::Orthographic, 1.0), screen);
    }
}
