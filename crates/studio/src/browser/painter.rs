//! The order in which several workers draw pictures of the viewport. It works as `pictures` does on a thread, but with
//! pieces of rows, because a worker's tracer cannot be stopped.
//!
//! The newest request wins. While something moves, a picture is completed, in a smaller size if it would take too long.
//! At rest, a slow picture begins with sketches. A rendering gives way to a newer request once the workers have drawn
//! their current rows, so a worker gets only as many rows as it can draw soon.

use std::collections::VecDeque;
use std::time::Duration;

use image::RgbaImage;
use rayfold_scene::Screen;

use super::drawer::{Rows, Sketch};
use crate::clock::Instant;
use crate::pace::{
    APART, Effort, FEW, GROWTH, MOVING_UNDER_WAY, PATIENCE, Pace, REST, RESTING_UNDER_WAY, smaller,
};
use crate::packing::{Packer, Picture, Quality};
use crate::wanted::Wanted;

/// The time for the rows that a worker draws at once, in seconds.
const PIECE: f64 = 0.1;

/// The rows of a tile of the tracer.
const TILE: u32 = 16;

#[derive(Debug)]
pub(super) struct Painter {
    workers: u32,
    wanted: Option<Wanted>,
    /// The number of pictures on their way to the page.
    under_way: u32,
    drawing: Option<Drawing>,
    /// The last request while something moves, and the time from which it is at rest.
    moved: Option<Wanted>,
    rests: Option<Instant>,
    /// The request whose final picture was sent last, if nothing was sent after it.
    finished: Option<Wanted>,
    pace: Pace,
    packer: Packer,
    drawings: u64,
}

/// A picture in progress.
#[derive(Debug)]
struct Drawing {
    id: u64,
    wanted: Wanted,
    /// The quality of a sketch; `None` for the final picture.
    effort: Option<Effort>,
    sketch: Option<Sketch>,
    image: RgbaImage,
    pieces: VecDeque<(u32, u32)>,
    in_hand: usize,
    asked: Instant,
    begun: Instant,
    seen: Instant,
}

/// Rows for a worker, and the picture to which they belong.
#[derive(Debug)]
pub(super) struct Piece {
    pub(super) id: u64,
    pub(super) file: usize,
    pub(super) rows: Rows,
}

impl Painter {
    pub(super) fn new(workers: usize) -> Self {
        Self {
            workers: workers.max(1) as u32,
            wanted: None,
            under_way: 0,
            drawing: None,
            moved: None,
            rests: None,
            finished: None,
            pace: Pace::default(),
            packer: Packer::default(),
            drawings: 0,
        }
    }

    /// Requests a picture, in place of any that is waiting.
    pub(super) fn want(&mut self, wanted: Wanted) {
        match &mut self.drawing {
            Some(drawing) if drawing.wanted.is_same(&wanted) && !wanted.moving => {
                drawing.wanted.number = wanted.number;
                return;
            }
            Some(drawing) if !drawing.wanted.moving => self.give_up(),
            _ => {}
        }
        self.moved = None;
        self.rests = wanted.moving.then(|| Instant::now() + REST);
        self.wanted = Some(wanted);
    }

    /// Records that the page has shown a picture.
    pub(super) fn shown(&mut self) {
        self.under_way = self.under_way.saturating_sub(1);
    }

    /// Returns the time until there is something to draw, if something will be drawn then.
    pub(super) fn pause(&self) -> Option<Duration> {
        self.rests
            .filter(|_| self.moved.is_some())
            .map(|rests| rests.saturating_duration_since(Instant::now()))
    }

    /// Returns rows for a worker that has nothing to do.
    pub(super) fn next(&mut self, send: &mut impl FnMut(Vec<u8>)) -> Option<Piece> {
        while self.drawing.is_none() {
            let wanted = self.next_wanted()?;
            self.begin(wanted, send);
        }
        let drawing = self.drawing.as_mut()?;
        let rows = drawing.pieces.pop_front()?;
        drawing.in_hand += 1;
        let Wanted { place, view, .. } = &drawing.wanted;
        let rows = Rows {
            script: String::new(),
            frame: place.frame,
            view: (*view).into(),
            sketch: drawing.sketch,
            rows,
        };
        Some(Piece { id: drawing.id, file: place.file, rows })
    }

    /// Takes rows that a worker has drawn; `pixels` is empty if it could not draw them.
    pub(super) fn drawn(
        &mut self,
        id: u64,
        (top, end): (u32, u32),
        pixels: &[u8],
        send: &mut impl FnMut(Vec<u8>),
    ) {
        let Some(drawing) = self.drawing.as_mut().filter(|drawing| drawing.id == id) else { return };
        drawing.in_hand -= 1;
        let across = drawing.image.width() as usize * 4;
        if pixels.len() != (end - top) as usize * across {
            self.give_up();
            return;
        }
        let image: &mut [u8] = &mut drawing.image;
        image[top as usize * across..][..pixels.len()].copy_from_slice(pixels);
        if drawing.pieces.is_empty() && drawing.in_hand == 0 {
            if let Some(drawing) = self.drawing.take() {
                self.complete(drawing, send);
            }
        } else if drawing.effort.is_none() && drawing.seen.elapsed() > APART {
            let (number, image, took) =
                (drawing.wanted.number, drawing.image.clone(), drawing.asked.elapsed());
            drawing.seen = Instant::now();
            self.glimpse(Picture { number, image, took, quality: Quality::Coarse }, send);
        }
    }

    /// Sends a picture that a finer one will follow, unless the page has not shown the last ones yet.
    fn glimpse(&mut self, picture: Picture, send: &mut impl FnMut(Vec<u8>)) {
        if self.under_way < RESTING_UNDER_WAY {
            self.under_way += 1;
            send(self.packer.pack(picture));
        }
    }

    fn give_up(&mut self) {
        self.drawing = None;
        self.under_way = self.under_way.saturating_sub(1);
    }

    /// Returns the next request, and counts its picture.
    fn next_wanted(&mut self) -> Option<Wanted> {
        let under_way = self.under_way;
        let has_room = |wanted: &mut Wanted| {
            under_way < if wanted.moving { MOVING_UNDER_WAY } else { RESTING_UNDER_WAY }
        };
        let mut next = self.wanted.take_if(has_room);
        if next.is_none() && self.wanted.is_none() && self.pause() == Some(Duration::ZERO) {
            self.moved = self.moved.take().map(|moved| Wanted { moving: false, ..moved });
            next = self.moved.take_if(has_room);
        }
        let wanted = next?;
        self.under_way += 1;
        if wanted.moving {
            self.moved = Some(wanted.clone());
        } else {
            self.rests = None;
        }
        Some(wanted)
    }

    /// Begins a picture. A picture that is already shown is sent at once.
    fn begin(&mut self, wanted: Wanted, send: &mut impl FnMut(Vec<u8>)) {
        if let Some(finished) = self.finished.take().filter(|finished| finished.is_same(&wanted)) {
            send(self.packer.pack(Picture::again(wanted.number, self.packer.before())));
            self.finished = Some(finished);
            return;
        }
        let effort = if wanted.moving {
            Some(self.pace.moving(&wanted.scene))
        } else {
            self.pace.rested();
            let share = self.pace.share(&wanted.scene, PATIENCE);
            let is_sampled = wanted.scene.samples.most() > 1;
            (share < 1.0 || is_sampled).then_some(Effort { share, bounces: None })
        };
        self.start(wanted, effort, Instant::now(), None);
    }

    fn start(&mut self, wanted: Wanted, effort: Option<Effort>, asked: Instant, before: Option<&RgbaImage>) {
        let scene = &wanted.scene;
        let few = if scene.goes_round() { FEW } else { 1 };
        let screen = effort.map_or(scene.screen, |effort| smaller(scene.screen, effort.share));
        let size = (screen.width(), screen.height());
        let sketch = effort.map(|effort| Sketch { size, samples: few, bounces: effort.bounces });
        let rounds = match (effort, self.pace.seconds(screen)) {
            (Some(_), _) => 1.0,
            (None, Some(seconds)) => {
                (seconds * f64::from(scene.samples.most()) / f64::from(few) / PIECE).ceil().max(1.0)
            }
            (None, None) => 4.0,
        };
        let pieces = f64::from(self.workers) * rounds;
        let least = if scene.samples.most() > 1 && effort.is_none() { 2 * TILE } else { TILE };
        let side = (f64::from(screen.height()) / pieces).ceil() as u32;
        let side = side.div_ceil(TILE).saturating_mul(TILE).max(least);
        self.drawings += 1;
        self.drawing = Some(Drawing {
            id: self.drawings,
            effort,
            sketch,
            image: before.map_or_else(|| RgbaImage::new(size.0, size.1), |before| scaled(before, screen)),
            pieces: pieces_of(screen.height(), side),
            in_hand: 0,
            asked,
            begun: Instant::now(),
            seen: Instant::now(),
            wanted,
        });
    }

    /// Sends a picture whose rows are complete, and begins the next finer one.
    fn complete(&mut self, drawing: Drawing, send: &mut impl FnMut(Vec<u8>)) {
        let Drawing { wanted, effort, image, asked, begun, .. } = drawing;
        let is_sampled = wanted.scene.samples.most() > 1;
        let (number, took) = (wanted.number, asked.elapsed());
        let Some(effort) = effort else {
            if !is_sampled {
                self.pace.drawn(wanted.scene.screen, None, begun.elapsed());
            }
            send(self.packer.pack(Picture { number, image, took, quality: Quality::Final }));
            self.finished = Some(wanted);
            return;
        };
        if let Ok(screen) = Screen::new(image.width(), image.height()) {
            self.pace.drawn(screen, effort.bounces, begun.elapsed());
        }
        if wanted.moving {
            let quality = if effort.bounces.is_some() { Quality::Simple } else { Quality::Coarse };
            send(self.packer.pack(Picture { number, image, took, quality }));
            return;
        }
        let share = self.pace.share(&wanted.scene, PATIENCE).max(GROWTH * effort.share).min(1.0);
        let is_last = effort.share >= 1.0 || share >= 1.0 && !is_sampled;
        let next = (!is_last).then_some(Effort { share, bounces: None });
        self.start(wanted, next, asked, Some(&image));
        self.glimpse(Picture { number, image, took, quality: Quality::Coarse }, send);
    }
}

/// Returns the rows of an image of this height in pieces of `side` rows.
fn pieces_of(height: u32, side: u32) -> VecDeque<(u32, u32)> {
    (0..height).step_by(side as usize).map(|top| (top, height.min(top + side))).collect()
}

/// Returns a picture in another size, without interpolation.
fn scaled(image: &RgbaImage, screen: Screen) -> RgbaImage {
    let (width, height) = image.dimensions();
    let of = |at: u32, from: u32, to: u32| (u64::from(at) * u64::from(from) / u64::from(to)) as u32;
    RgbaImage::from_fn(screen.width(), screen.height(), |x, y| {
        *image.get_pixel(of(x, width, screen.width()), of(y, height, screen.height()))
    })
}
