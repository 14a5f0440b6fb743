//! The outline of a glyph as contours without curves, on a grid.

use glam::{DVec2, I64Vec2};
use harfrust::GlyphId;
use harfrust::font::glyph::outline::{DrawMemory, DrawOptions, PathSink};

use super::Font;
use crate::error::Fault;

/// A corner of a contour, with the directions in which the outline comes and goes. Each is a unit vector.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub(super) at: I64Vec2,
    pub(super) before: DVec2,
    pub(super) after: DVec2,
}

/// A closed line of corners.
pub(super) type Contour = Vec<Corner>;

/// The inverse of the distance, in ems, by which a chord may be off its curve. Rounding to the grid adds less than an em / 2¹⁵.
const CLOSENESS: f64 = 2500.0;

/// The largest turn of an outline along a chord, in degrees.
const TURN: f64 = 15.0;

/// The maximum number of corners of a glyph whose curves are written as chords.
pub(super) const CORNERS: usize = 200_000;

/// Returns the contours of a glyph.
pub(super) fn contours(font: &Font, glyph: u32) -> Result<Vec<Contour>, Fault> {
    let Some(outline) = font.font.outline_glyphs().get(GlyphId::new(glyph)) else {
        return Ok(Vec::new());
    };
    let units = font.font.units_per_em();
    let mut pen = Pen {
        unit: font.unit as f64,
        tolerance: f64::from(units) / CLOSENESS,
        contours: Vec::new(),
        contour: Vec::new(),
        start: DVec2::ZERO,
        here: DVec2::ZERO,
        is_good: true,
        corners: 0,
    };
    let drawn = outline.draw(&DrawOptions::new(), DrawMemory::default(), &mut pen);
    drawn.map_err(|error| Fault::new(format!("glyph {glyph} of the font is faulty ({error})")))?;
    pen.end();
    if !pen.is_good {
        return Err(Fault::new(format!("glyph {glyph} of the font has more than {CORNERS} corners")));
    }
    Ok(pen.contours)
}

/// Writes down the path of a glyph. Coordinates are in units of the font.
struct Pen {
    /// The number of grid units per unit of the font.
    unit: f64,
    tolerance: f64,
    contours: Vec<Contour>,
    /// The ends of the chords of the current contour, each with the directions at its two ends.
    contour: Vec<(DVec2, [DVec2; 2])>,
    start: DVec2,
    here: DVec2,
    is_good: bool,
    corners: usize,
}

impl Pen {
    /// Adds a piece of the outline, `point` and `slope` of which are given by a parameter from 0 to 1. `bend` is its largest
    /// second derivative, and `hull` its control points.
    fn add(&mut self, point: impl Fn(f64) -> DVec2, slope: impl Fn(f64) -> DVec2, bend: f64, hull: &[DVec2]) {
        let Some(end) = hull.last().copied() else { return };
        let legs = || hull.windows(2).map(|pair| pair[1] - pair[0]).filter(|leg| *leg != DVec2::ZERO);
        let turn: f64 = legs().zip(legs().skip(1)).map(|(a, b)| angle(a, b)).sum();
        let chords = (bend / (8.0 * self.tolerance)).sqrt().max(turn / TURN).ceil().max(1.0);
        self.corners = self.corners.saturating_add(chords as usize);
        if self.corners > CORNERS || !hull.iter().all(|p| p.is_finite()) {
            self.is_good = false;
            return;
        }
        let (first, last) = (legs().next(), legs().next_back());
        let direction = |k: f64| {
            let slope = match k {
                0.0 => first.unwrap_or_default(),
                k if k == chords => last.unwrap_or_default(),
                k => slope(k / chords),
            };
            slope.normalize_or_zero()
        };
        for k in 0..chords as usize {
            let (from, to) = (k as f64, (k + 1) as f64);
            let corner = if to == chords { end } else { point(to / chords) };
            self.contour.push((corner, [direction(from), direction(to)]));
        }
        self.here = end;
    }

    /// Ends the contour, with a line to its start where it is open.
    fn end(&mut self) {
        if self.contour.is_empty() {
            return;
        }
        if self.here != self.start {
            self.line_to(self.start.x as f32, self.start.y as f32);
        }
        // Chords that the grid swallows are left out.
        let mut chords: Vec<(I64Vec2, [DVec2; 2])> = Vec::with_capacity(self.contour.len());
        let mut last = (self.start * self.unit).round().as_i64vec2();
        for (corner, directions) in self.contour.drain(..) {
            let corner = (corner * self.unit).round().as_i64vec2();
            if corner != last {
                let along = (corner - last).as_dvec2().normalize();
                chords.push((corner, directions.map(|d| if d == DVec2::ZERO { along } else { d })));
                last = corner;
            }
        }
        if chords.len() > 2 {
            let corner = |i: usize| {
                let (at, [_, before]) = chords[i];
                let (_, [after, _]) = chords[(i + 1) % chords.len()];
                Corner { at, before, after }
            };
            self.contours.push((0..chords.len()).map(corner).collect());
        }
    }
}

/// Returns the angle between two directions, in degrees.
fn angle(a: DVec2, b: DVec2) -> f64 {
    libm::atan2(a.perp_dot(b).abs(), a.dot(b)).to_degrees()
}

impl PathSink for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.end();
        self.start = DVec2::new(f64::from(x), f64::from(y));
        self.here = self.start;
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let (a, b) = (self.here, DVec2::new(f64::from(x), f64::from(y)));
        self.add(|t| a.lerp(b, t), |_| b - a, 0.0, &[a, b]);
    }

    fn quad_to(&mut self, cx: f32, cy: f32, x: f32, y: f32) {
        let (a, b) = (self.here, DVec2::new(f64::from(cx), f64::from(cy)));
        let c = DVec2::new(f64::from(x), f64::from(y));
        let bend = 2.0 * (a - 2.0 * b + c).length();
        let point = |t| a.lerp(b, t).lerp(b.lerp(c, t), t);
        self.add(point, |t| (b - a).lerp(c - b, t), bend, &[a, b, c]);
    }

    fn curve_to(&mut self, cx0: f32, cy0: f32, cx1: f32, cy1: f32, x: f32, y: f32) {
        let (a, b) = (self.here, DVec2::new(f64::from(cx0), f64::from(cy0)));
        let (c, d) = (DVec2::new(f64::from(cx1), f64::from(cy1)), DVec2::new(f64::from(x), f64::from(y)));
        let bend = 6.0 * (a - 2.0 * b + c).length().max((b - 2.0 * c + d).length());
        let quad = |a: DVec2, b: DVec2, c: DVec2, t| a.lerp(b, t).lerp(b.lerp(c, t), t);
        self.add(
            |t| quad(a, b, c, t).lerp(quad(b, c, d, t), t),
            |t| quad(b - a, c - b, d - c, t),
            bend,
            &[a, b, c, d],
        );
    }

    fn close(&mut self) {
        self.end();
        self.here = self.start;
    }
}
