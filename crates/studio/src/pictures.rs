//! Rendering of the pictures that the page requests, on a thread of its own. The newest request wins.
//!
//! A waiting request is replaced by the next one. At rest, a rendering is cancelled for a newer request of another
//! picture. While something moves, a rendering is completed, in a smaller size if it would take too long ([`Pace`]), so
//! that there is always a picture. It then has one ray per pixel, or a few if light goes round, whatever the script
//! says. If even the smallest picture takes too long, it has fewer mirror images. At rest, a slow picture begins with
//! sketches: few pixels with as few rays, then more. A picture with several rays per pixel is shown after each pass, at
//! most five times a second and less and less often ([`APART`]). An object counts as at rest soon after the last
//! request, even while the pointer holds it. The number of pictures on their way to the page is limited: to one while
//! something moves, because a picture that waits behind another is outdated when it is shown.

use std::cell::RefCell;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use rayfold_scene::{Samples, Scene};
use rayfold_tracer::{Drawing, Exposure, RenderError, RenderOptions};

use crate::clock::Instant;
use crate::pace::{
    APART, Effort, FEW, GROWTH, MOVING_UNDER_WAY, PATIENCE, Pace, REST, RESTING_UNDER_WAY, SELDOM, smaller,
};
use crate::packing::{Packer, Picture, Quality};
use crate::wanted::Wanted;

/// A handle of the rendering thread.
#[derive(Clone, Debug)]
pub(crate) struct Painter(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    desk: Mutex<Desk>,
    news: Condvar,
    /// Stops the rendering in progress.
    cancel: AtomicBool,
}

#[derive(Debug, Default)]
struct Desk {
    wanted: Option<Wanted>,
    under_way: u32,
    closed: bool,
    /// The request that is being drawn at full quality, which may be cancelled. It has the number of the last request of
    /// its picture.
    at_rest: Option<Wanted>,
    /// The last request while something moves, once its picture has been begun.
    moved: Option<Wanted>,
    /// The time from which that object is at rest.
    rests: Option<Instant>,
}

impl Painter {
    /// Starts the thread, which ends when the painter is closed. `send` gets each packed picture in order, and
    /// returns whether a receiver is left.
    ///
    /// # Errors
    /// Fails if the system cannot start a thread.
    pub(crate) fn start(send: impl Fn(Vec<u8>) -> bool + Send + 'static) -> std::io::Result<Self> {
        let shared =
            Arc::new(Shared { desk: Mutex::default(), news: Condvar::new(), cancel: AtomicBool::new(false) });
        let own = Arc::clone(&shared);
        thread::Builder::new().name("painter".into()).spawn(move || own.work(&send))?;
        Ok(Self(shared))
    }

    /// Requests a picture, in place of any that is waiting.
    pub(crate) fn want(&self, wanted: Wanted) {
        self.0.change(|desk| {
            let is_cancelled = self.0.cancel.load(Ordering::Relaxed);
            match &mut desk.at_rest {
                // It goes on, and answers this request, too.
                Some(at_rest) if !is_cancelled && at_rest.is_same(&wanted) => {
                    at_rest.number = wanted.number;
                    return;
                }
                Some(_) => self.0.cancel.store(true, Ordering::Relaxed),
                None => {}
            }
            desk.moved = None;
            desk.rests = wanted.moving.then(|| Instant::now() + REST);
            desk.wanted = Some(wanted);
        });
    }

    /// Records that the page has shown a picture.
    pub(crate) fn shown(&self) {
        self.0.change(|desk| desk.under_way = desk.under_way.saturating_sub(1));
    }

    /// Stops rendering and ends the thread.
    pub(crate) fn close(&self) {
        self.0.cancel.store(true, Ordering::Relaxed);
        self.0.change(|desk| desk.closed = true);
    }
}

impl Shared {
    fn change<T>(&self, change: impl FnOnce(&mut Desk) -> T) -> T {
        let changed = change(&mut self.desk.lock().unwrap_or_else(PoisonError::into_inner));
        self.news.notify_all();
        changed
    }

    /// Waits for a request that can be drawn. Returns `None` when the painter is closed.
    fn next(&self) -> Option<Wanted> {
        let mut desk = self.desk.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            if desk.closed {
                return None;
            }
            let under_way = desk.under_way;
            let has_room = |wanted: &mut Wanted| {
                under_way < if wanted.moving { MOVING_UNDER_WAY } else { RESTING_UNDER_WAY }
            };
            let left = desk.rests.map(|rests| rests.saturating_duration_since(Instant::now()));
            let mut next = desk.wanted.take_if(has_room);
            if next.is_none() && desk.wanted.is_none() && left == Some(Duration::ZERO) {
                let at_rest = |moved: Wanted| Wanted { moving: false, ..moved };
                desk.moved = desk.moved.take().map(at_rest);
                next = desk.moved.take_if(has_room);
            }
            if let Some(wanted) = next {
                desk.under_way += 1;
                if wanted.moving {
                    desk.moved = Some(wanted.clone());
                } else {
                    (desk.at_rest, desk.rests) = (Some(wanted.clone()), None);
                }
                self.cancel.store(false, Ordering::Relaxed);
                return Some(wanted);
            }
            desk = match left.filter(|left| !left.is_zero()) {
                Some(left) => self.news.wait_timeout(desk, left).unwrap_or_else(PoisonError::into_inner).0,
                None => self.news.wait(desk).unwrap_or_else(PoisonError::into_inner),
            };
        }
    }

    fn work(&self, send: &impl Fn(Vec<u8>) -> bool) {
        let mut pace = Pace::default();
        let packer = RefCell::new(Packer::default());
        let pack = |picture| send(packer.borrow_mut().pack(picture));
        // The request whose final picture was sent last, with nothing after it.
        let mut finished: Option<Wanted> = None;
        while let Some(wanted) = self.next() {
            let drawn = match finished.take() {
                Some(finished) if finished.is_same(&wanted) => {
                    Ok(Picture::again(wanted.number, packer.borrow().before()))
                }
                _ if wanted.moving => {
                    let effort = pace.moving(&wanted.scene);
                    self.sketch(&wanted, effort, &mut pace)
                }
                _ => {
                    pace.rested();
                    self.at_rest(&wanted, &mut pace, &pack)
                }
            };
            let at_rest = self.change(|desk| desk.at_rest.take());
            match drawn {
                Ok(picture) => {
                    let number = at_rest.as_ref().map_or(wanted.number, |wanted| wanted.number);
                    if !pack(Picture { number, ..picture }) {
                        return;
                    }
                    finished = at_rest;
                }
                // The rendering was cancelled for a newer one, or the picture is beyond the limits.
                Err(_) => self.change(|desk| desk.under_way = desk.under_way.saturating_sub(1)),
            }
        }
    }

    /// Renders a picture at full quality, after sketches if it is slow.
    fn at_rest(
        &self,
        wanted: &Wanted,
        pace: &mut Pace,
        send: &impl Fn(Picture) -> bool,
    ) -> Result<Picture, RenderError> {
        let start = Instant::now();
        let scene = &wanted.scene;
        let is_sampled = scene.samples.most() > 1;
        let mut share = pace.share(scene, PATIENCE);
        // With one ray per pixel, a sketch of the full size is the picture. With several, the first pass comes as soon as one.
        let is_soon = is_sampled && GROWTH * share >= 1.0;
        while (share < 1.0 || is_sampled) && !is_soon {
            let sketch = self.sketch(wanted, Effort { share, bounces: None }, pace)?;
            // A sketch that the page cannot show in time is skipped: a finer one follows.
            if let Some(number) = self.another() {
                send(Picture { number, ..sketch });
            }
            if share >= 1.0 {
                break;
            }
            share = pace.share(scene, PATIENCE).max(GROWTH * share).min(1.0);
        }
        let after = |frames| match &wanted.motion {
            Some(motion) => motion.after(scene, frames),
            None => scene.clone(),
        };
        let exposure = match &wanted.motion {
            Some(_) => Exposure::moving(scene, &after),
            None => Exposure::still(scene),
        };
        let options = RenderOptions { cancel: Some(&self.cancel), ..RenderOptions::default() };
        let drawing = Drawing::exposed(exposure, &options)?;
        let begin = Instant::now();
        let mut seen: Option<Instant> = None;
        let image = drawing.draw_progressively(|image| {
            if seen.is_none() && !scene.goes_round() {
                // The first pass is one ray per pixel.
                pace.drawn(scene.screen, None, begin.elapsed());
            }
            if seen.is_none_or(|seen| {
                seen.elapsed() >= seen.saturating_duration_since(start).clamp(APART, SELDOM)
            }) && let Some(number) = self.another()
            {
                let image = image()?.into_rgba8();
                send(Picture { number, image, took: start.elapsed(), quality: Quality::Coarse });
                seen = Some(Instant::now());
            }
            Ok(())
        })?;
        if !is_sampled {
            pace.drawn(scene.screen, None, begin.elapsed());
        }
        let image = image.into_rgba8();
        Ok(Picture { number: wanted.number, image, took: start.elapsed(), quality: Quality::Final })
    }

    /// Renders a picture with one ray per pixel, or a few if light goes round.
    fn sketch(&self, wanted: &Wanted, effort: Effort, pace: &mut Pace) -> Result<Picture, RenderError> {
        let start = Instant::now();
        let whole = &wanted.scene;
        let few = if whole.goes_round() { FEW } else { 1 };
        let samples = Samples::new(few, 0.0).unwrap_or_default();
        let scene = Scene { screen: smaller(whole.screen, effort.share), samples, ..whole.clone() };
        let options =
            RenderOptions { cancel: Some(&self.cancel), bounces: effort.bounces, ..RenderOptions::default() };
        let drawing = Drawing::new(&scene, &options)?;
        pace.prepared(start.elapsed());
        let begin = Instant::now();
        let image = drawing.draw_picture()?.into_rgba8();
        pace.drawn(scene.screen, effort.bounces, begin.elapsed());
        let quality = if effort.bounces.is_some() { Quality::Simple } else { Quality::Coarse };
        Ok(Picture { number: wanted.number, image, took: start.elapsed(), quality })
    }

    /// Returns the number of another picture at rest, if one may be sent to the page, and counts it.
    fn another(&self) -> Option<u32> {
        self.change(|desk| {
            let number = desk.at_rest.as_ref()?.number;
            if desk.under_way >= RESTING_UNDER_WAY {
                return None;
            }
            desk.under_way += 1;
            Some(number)
        })
    }
}

#[cfg(test)]
mod tests {
    use image::DynamicImage;
    use rayfold_scene::Screen;
    use rayfold_tracer::{picture_of_frame, render, render_picture};
    use std::sync::mpsc;

    use super::*;
    use crate::packing::HEADER;
    use crate::packing::tests::Shown;
    use crate::project::Place;
    use crate::wanted::{Motion, ViewSettings};

    fn wanted(number: u32, moving: bool) -> Wanted {
        let text = "Screen 64 48\nBackground 0 0.5 1\nSphere 10 30 20 -20  1 0 0  0 0 0\nTrace";
        let scene =
            rayfold_scene::parse("a", text.as_bytes(), &Default::default()).script.unwrap().frame(0).unwrap();
        Wanted { scene, motion: None, moving, number, place: Place::default(), view: ViewSettings::default() }
    }

    /// Returns a request for a picture that may be rendered in any size.
    fn pinhole(number: u32, text: &str) -> Wanted {
        let text = format!("Screen 96 64\nLook 0 1 6  0 0 0  50\nIlight 1 1 1  1 -1 -1\n{text}\nTrace");
        let parsed = rayfold_scene::parse("a", text.as_bytes(), &Default::default());
        let script = Arc::new(parsed.script.unwrap());
        let scene = script.frame(0).unwrap();
        let motion = Some(Motion { script, frame: 0, is_free: false });
        let (place, view) = (Place::default(), ViewSettings::default());
        Wanted { scene, motion, moving: false, number, place, view }
    }

    fn is_final(picture: &[u8]) -> bool {
        picture[16] == 1
    }

    /// Returns all pictures up to the final one.
    fn drawn(painter: &Painter, pictures: &mpsc::Receiver<Vec<u8>>, wanted: Wanted) -> Vec<Vec<u8>> {
        painter.want(wanted);
        let mut seen: Vec<Vec<u8>> = vec![];
        while !seen.last().is_some_and(|picture| is_final(picture)) {
            seen.push(pictures.recv_timeout(Duration::from_secs(20)).unwrap());
            painter.shown();
        }
        seen
    }

    fn number_at(picture: &[u8], at: usize) -> u32 {
        u32::from_le_bytes(picture[at..][..4].try_into().unwrap())
    }

    fn number(picture: &[u8]) -> u32 {
        number_at(picture, 0)
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
        let mut shown = Shown::default();
        shown.put(&picture);
        assert_eq!(shown.0, DynamicImage::ImageRgb8(expected).into_rgba8());
        painter.close();
    }

    #[test]
    fn at_rest_a_picture_gets_finer_and_ends_as_the_tracers() {
        let ball = "Sphere 1 (1:-3 9:3) 0 0  0.2 0.1 0.1  0.7 0.5 0.3";
        for background in [".2 .4 .9", "none"] {
            ends_as_the_tracers(&format!(
                "Samples 64 1\nShutter 0.8\nBackground {background}\nFrames 5 5\n{ball}"
            ));
        }
    }

    fn ends_as_the_tracers(moves: &str) {
        let (sender, pictures) = mpsc::channel();
        let painter = Painter::start(move |picture| sender.send(picture).is_ok()).unwrap();
        let request = pinhole(9, moves);
        let script = Arc::clone(&request.motion.as_ref().unwrap().script);
        let expected = picture_of_frame(&script, 0, &RenderOptions::default()).unwrap().unwrap();
        let still = Exposure::still(&request.scene);
        assert_ne!(expected, render_picture(still, &RenderOptions::default()).unwrap(), "it moves");
        let seen = drawn(&painter, &pictures, request);
        let sizes: Vec<_> = seen.iter().map(|picture| [4, 8].map(|at| number_at(picture, at))).collect();
        assert_eq!(sizes[0], [24, 16], "the first one has few pixels, whatever the rest takes");
        assert!(sizes.is_sorted() && seen.len() > 2, "{sizes:?}");
        assert!(seen.iter().all(|picture| number(picture) == 9));
        let mut shown = Shown::default();
        seen.iter().for_each(|picture| shown.put(picture));
        assert_eq!(shown.0, expected.into_rgba8());
        painter.close();
    }

    #[test]
    fn while_something_moves_indirect_light_is_shown() {
        let (sender, pictures) = mpsc::channel();
        let painter = Painter::start(move |picture| sender.send(picture).is_ok()).unwrap();
        // The ball is lit by the glowing floor alone.
        let text = "Material lit glow 1 1 1\nSphere 1 0 0 0  0 0 0  1 1 1\nPlane 0 -1 0 0 1 0 lit";
        let brightness = |indirect: &str| {
            let mut request = pinhole(1, &format!("Samples 16\nIndirect {indirect}\n{text}"));
            request.scene.lights = Vec::new().into();
            request.moving = true;
            painter.want(request);
            let picture = pictures.recv_timeout(Duration::from_secs(20)).unwrap();
            painter.shown();
            let mut shown = Shown::default();
            shown.put(&picture);
            let (width, height) = shown.0.dimensions();
            shown.0.get_pixel(width / 2, height / 2).0[0]
        };
        assert_eq!(brightness("0"), 0);
        assert!(brightness("1") > 0);
        painter.close();
    }

    #[test]
    fn where_the_first_pass_comes_soon_there_is_no_sketch_and_not_each_pass_is_sent() {
        let (sender, pictures) = mpsc::channel();
        let painter = Painter::start(move |picture| sender.send(picture).is_ok()).unwrap();
        let ball = "Samples 64 1\nSphere 1  0 0 0  0.2 0.1 0.1  0.7 0.5 0.3";
        let first = drawn(&painter, &pictures, pinhole(1, ball));
        assert!(size(&first[0]) < [96, 64], "a sketch: its time is not known at first");
        let again = drawn(&painter, &pictures, pinhole(2, &ball.replace("0.7", "0.6")));
        assert!(again.iter().all(|picture| size(picture) == [96, 64]), "no sketch");
        assert!(again.len() < 10, "{} passes were sent", again.len());
        painter.close();
    }

    #[test]
    fn what_is_drawn_at_once_has_no_sketch_once_that_is_known() {
        let (sender, pictures) = mpsc::channel();
        let painter = Painter::start(move |picture| sender.send(picture).is_ok()).unwrap();
        let ball = "Sphere 1  0 0 0  0.2 0.1 0.1  0.7 0.5 0.3";
        let request = pinhole(1, ball);
        let expected = render(&request.scene, &RenderOptions::default()).unwrap();
        let first = drawn(&painter, &pictures, request);
        assert!(first.len() > 1, "it is not known at first");
        let again = drawn(&painter, &pictures, pinhole(2, ball));
        assert_eq!(again.len(), 1);
        let mut shown = Shown::default();
        first.iter().chain(&again).for_each(|picture| shown.put(picture));
        assert_eq!(shown.0, DynamicImage::ImageRgb8(expected).into_rgba8());
        painter.close();
    }

    #[test]
    fn the_newest_request_wins_and_no_more_than_one_is_under_way_while_something_moves() {
        let (sender, pictures) = mpsc::channel();
        let painter = Painter::start(move |picture| sender.send(picture).is_ok()).unwrap();
        painter.want(wanted(1, true));
        assert_eq!(number(&pictures.recv_timeout(Duration::from_secs(20)).unwrap()), 1);
        for request in 2..=50 {
            painter.want(wanted(request, true));
        }
        assert!(pictures.recv_timeout(Duration::from_millis(200)).is_err(), "the page has shown none yet");
        painter.shown();
        assert_eq!(number(&pictures.recv_timeout(Duration::from_secs(20)).unwrap()), 50);
        painter.close();
    }

    /// Returns the pixels of the pictures.
    fn shown(pictures: &[Vec<u8>]) -> image::RgbaImage {
        let mut shown = Shown::default();
        pictures.iter().for_each(|picture| shown.put(picture));
        shown.0
    }

    /// Returns the width and height of a picture.
    fn size(picture: &[u8]) -> [u32; 2] {
        [4, 8].map(|at| number_at(picture, at))
    }

    #[test]
    fn what_is_held_still_is_refined_and_its_release_draws_nothing_anew() {
        let (sender, pictures) = mpsc::channel();
        let painter = Painter::start(move |picture| sender.send(picture).is_ok()).unwrap();
        let mut request = pinhole(1, "Samples 16\nSphere 1  0 0 0  0.2 0.1 0.1  0.7 0.5 0.3");
        let expected = render(&request.scene, &RenderOptions::default()).unwrap();
        request.moving = true;
        let mut seen = drawn(&painter, &pictures, request.clone());
        assert!(!is_final(&seen[0]) && seen.iter().all(|picture| number(picture) == 1));
        assert_eq!(shown(&seen), DynamicImage::ImageRgb8(expected).into_rgba8());
        let released = Wanted { number: 2, moving: false, ..request.clone() };
        let last = drawn(&painter, &pictures, released.clone());
        assert_eq!((last.len(), last[0].len(), number(&last[0])), (1, HEADER, 2), "it is there already");
        seen.extend(last);
        // What moves on is drawn coarsely again.
        let mut moves = pinhole(3, "Samples 16\nSphere 1  0.5 0 0  0.2 0.1 0.1  0.7 0.5 0.3");
        moves.moving = true;
        painter.want(moves);
        let moved = pictures.recv_timeout(Duration::from_secs(20)).unwrap();
        painter.shown();
        assert!(number(&moved) == 3 && !is_final(&moved));
        painter.close();
    }

    #[test]
    fn a_release_does_not_interrupt_what_is_refined() {
        let (sender, pictures) = mpsc::channel();
        let painter = Painter::start(move |picture| sender.send(picture).is_ok()).unwrap();
        let mut request = pinhole(1, "Samples 1024\nSphere 1  0 0 0  0.2 0.1 0.1  0.7 0.5 0.3");
        request.scene.screen = Screen::new(480, 320).unwrap();
        let expected = render(&request.scene, &RenderOptions::default()).unwrap();
        request.moving = true;
        painter.want(request.clone());
        let next = || {
            let picture = pictures.recv_timeout(Duration::from_secs(60)).unwrap();
            painter.shown();
            picture
        };
        // One while it moves, and one at rest.
        let mut seen = vec![next(), next()];
        assert!(number(&seen[1]) == 1 && !is_final(&seen[1]), "the rest is under way");
        painter.want(Wanted { number: 2, moving: false, ..request });
        while !is_final(&seen[seen.len() - 1]) {
            seen.push(next());
        }
        assert_eq!(number(&seen[seen.len() - 1]), 2);
        let sizes: Vec<_> = seen[1..].iter().map(|picture| size(picture)).collect();
        assert!(sizes.is_sorted(), "it begins anew: {sizes:?}");
        assert_eq!(shown(&seen), DynamicImage::ImageRgb8(expected).into_rgba8());
        painter.close();
    }

    #[test]
    fn what_moves_has_at_least_a_quarter_of_the_size_each_way() {
        let (sender, pictures) = mpsc::channel();
        let painter = Painter::start(move |picture| sender.send(picture).is_ok()).unwrap();
        // A hundred balls of glass, which take longer than a picture may.
        let balls: String =
            (0..100).map(|at| format!("Sphere .3 {} {} 0 clear\n", at % 10 - 5, at / 10 - 5)).collect();
        for (number, shift) in [(1, 0), (2, 1), (3, 2)] {
            let text =
                format!("Depth 16\nMaterial clear glass 1 1 1 1.5\nSphere 1 {shift} 0 2 clear\n{balls}");
            let mut request = pinhole(number, &text);
            request.scene.screen = Screen::new(1602, 1001).unwrap();
            request.moving = true;
            painter.want(request);
            let picture = pictures.recv_timeout(Duration::from_secs(60)).unwrap();
            painter.shown();
            let [width, height] = size(&picture);
            assert!(4 * width >= 1602 && 4 * height >= 1001, "{width} x {height}");
        }
        painter.close();
    }
}
