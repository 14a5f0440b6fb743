//! The candidates of the camera rays of each tile.
//!
//! A tile's rays lie between four planes through the eye: two for its columns of pixels and two for its rows. An object
//! is a candidate if it reaches inside all four. A sphere must also reach the tile's cone. Everything is widened by a
//! part of a pixel and by the rounding errors of the kernels, so that no candidate is ever missed.

use glam::DVec3;

use crate::camera::Axis;
use crate::fast::arithmetic::rounding::BOUNDS;
use crate::fast::placement::lens::Lens;
use crate::fast::rays::placed::RenderSpaceShape;
use crate::fast::rays::view::View;
use crate::fast::shapes::Shape;

/// The tiling of an image, and the extent of a tile's rays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid {
    /// The columns and rows of the image.
    pub(crate) size: (u32, u32),
    /// The columns and rows of a tile.
    pub(crate) side: (u32, u32),
    /// The largest distance of a ray from the centre of its pixel, in pixels.
    pub(crate) margin: f64,
    /// The lens, if rays do not start at the eye.
    pub(crate) lens: Option<Lens>,
}

/// A sphere as seen from the eye.
#[derive(Clone, Copy, Debug)]
struct Cap {
    bit: u32,
    towards: DVec3,
    sine: f64,
    cosine: f64,
}

/// The candidates of every tile.
#[derive(Debug)]
pub(crate) struct Window {
    columns: Vec<Span>,
    rows: Vec<Span>,
    caps: Vec<Cap>,
    view: View,
}

/// The pixels of a column or a row of tiles in the view's own coordinates, and the objects that reach into it.
#[derive(Clone, Copy, Debug)]
struct Span {
    from: f64,
    to: f64,
    candidates: u64,
}

impl Window {
    /// Makes the window. `shapes` are in the order of the bits, at most 64. `roundoff` is that of the kernels. Rows of
    /// tiles are counted from the top.
    pub(crate) fn new(view: View, shapes: &[Shape], grid: &Grid, roundoff: f64) -> Self {
        let Grid { size: (width, height), side, margin, lens } = *grid;
        let slack = |shape: &Shape| BOUNDS * roundoff * shape.magnitude();
        // Shapes behind the eye are not visible.
        let ahead = match view {
            View::Pinhole { back, .. } => -back,
            View::Parallel { .. } => DVec3::NEG_Z,
        };
        let visible = mask(shapes, |shape| shape.support(ahead) >= -2.0 * slack(shape));
        // The largest distance between a ray from the lens and the eye's own, over the depths of a shape.
        let circle_of_confusion =
            |shape: &Shape| lens.map_or(0.0, |lens| lens.circle_of_confusion(shape, ahead));
        let span = |from: f64, to: f64, axis: fn(&View) -> DVec3| {
            let (from, to) = (from.min(to), from.max(to));
            let (along, back) = (axis(&view), back(&view));
            let candidates = mask(shapes, |shape| {
                let beyond = |normal: DVec3, distance: f64| {
                    shape.support(normal)
                        >= distance - slack(shape) * (1.0 + normal.length()) - circle_of_confusion(shape)
                };
                match back {
                    Some(back) => beyond(along + from * back, 0.0) && beyond(-along - to * back, 0.0),
                    None => beyond(along, from) && beyond(-along, -to),
                }
            });
            Span { from, to, candidates: candidates & visible }
        };
        let (x, y) = axes(&view);
        let tiles = |pixels: u32, side: u32| {
            (0..pixels).step_by(side as usize).map(move |i| (i, (i + side).min(pixels) - 1))
        };
        let columns = tiles(width, side.0).map(|(first, last)| {
            span(x.at(f64::from(first) - margin), x.at(f64::from(last) + margin), right)
        });
        let rows = tiles(height, side.1).map(|(first, last)| {
            let (first, last) = (height - 1 - first, height - 1 - last);
            span(y.at(f64::from(first) + margin), y.at(f64::from(last) - margin), up)
        });
        let caps = match view {
            View::Pinhole { .. } if lens.is_none() => caps(shapes, slack),
            View::Pinhole { .. } | View::Parallel { .. } => vec![],
        };
        Self { columns: columns.collect(), rows: rows.collect(), caps, view }
    }

    /// Makes the window of the boxes of the bodies, if there are few bodies.
    pub(crate) fn of_bodies(view: View, boxes: Option<&[Shape]>, grid: &Grid, roundoff: f64) -> Option<Self> {
        boxes.map(|boxes| Self::new(view, boxes, grid, roundoff))
    }

    /// Returns the candidates of the rays of the tile in this column and row.
    pub(crate) fn candidates(&self, column: usize, row: usize) -> u64 {
        let (x, y) = (self.columns[column], self.rows[row]);
        let mut candidates = x.candidates & y.candidates;
        if candidates == 0 {
            return 0;
        }
        let View::Pinhole { right, up, back, .. } = self.view else { return candidates };
        let corner = |x: f64, y: f64| (x * right + y * up - back).normalize();
        let corners =
            [corner(x.from, y.from), corner(x.from, y.to), corner(x.to, y.from), corner(x.to, y.to)];
        let axis = corners.into_iter().sum::<DVec3>().normalize();
        let cosine = corners.into_iter().map(|corner| corner.dot(axis)).fold(1.0, f64::min);
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        for cap in self.caps.iter().filter(|cap| (x.candidates & y.candidates) >> cap.bit & 1 != 0) {
            // The angle between the axes is larger than the sum of the two half-angles.
            let farthest = cosine * cap.cosine - sine * cap.sine;
            let opposite = cosine < 0.0 || cap.cosine < 0.0;
            if !opposite && axis.dot(cap.towards) < farthest - 1e-9 {
                candidates &= !(1 << cap.bit);
            }
        }
        candidates
    }
}

fn back(view: &View) -> Option<DVec3> {
    match view {
        View::Pinhole { back, .. } => Some(*back),
        View::Parallel { .. } => None,
    }
}

fn right(view: &View) -> DVec3 {
    match view {
        View::Pinhole { right, .. } => *right,
        View::Parallel { .. } => DVec3::X,
    }
}

fn up(view: &View) -> DVec3 {
    match view {
        View::Pinhole { up, .. } => *up,
        View::Parallel { .. } => DVec3::Y,
    }
}

/// Returns the pixels' coordinates along both axes.
pub(crate) fn axes(view: &View) -> (Axis, Axis) {
    match *view {
        View::Pinhole { x, y, .. } => (widened(x), widened(y)),
        View::Parallel { corner, pixel } => (Axis::along(corner.x, pixel), Axis::along(corner.y, pixel)),
    }
}

/// Returns an axis with a step. A single sample has none, but its tile needs a small width.
fn widened(axis: Axis) -> Axis {
    Axis { step: if axis.step == 0.0 { 1e-3 * axis.at_anchor.abs().max(1.0) } else { axis.step }, ..axis }
}

fn mask(shapes: &[Shape], is_candidate: impl Fn(&Shape) -> bool) -> u64 {
    shapes.iter().enumerate().fold(0, |mask, (bit, shape)| mask | u64::from(is_candidate(shape)) << bit)
}

fn caps(shapes: &[Shape], slack: impl Fn(&Shape) -> f64) -> Vec<Cap> {
    let cap = |(bit, shape): (usize, &Shape)| {
        let (center, radius) = shape.ball()?;
        let (away, radius) = (center.length(), radius + 2.0 * slack(shape));
        let sine = radius / away;
        let cosine = (1.0 - sine * sine).sqrt();
        // A sphere around the eye is visible in every direction.
        (away > radius).then(|| Cap { bit: bit as u32, towards: center / away, sine, cosine })
    };
    shapes.iter().enumerate().filter_map(cap).collect()
}
