//! The objects that can be between a region and a light with an extent: a few objects, each with a ball and a box
//! around it.

use glam::DVec3;

use crate::fast::arithmetic::real::Real;
use crate::fast::arithmetic::rounding::BOUNDS;
use crate::fast::rays::bounds::Bounds;
use crate::fast::rays::placed::RenderSpaceShape;
use crate::fast::shapes::Shape;

/// The balls and boxes of up to 64 objects, in columns.
#[derive(Debug, Default)]
pub(crate) struct Hulls {
    center: [Vec<f64>; 3],
    radius: Vec<f64>,
    low: [Vec<f64>; 3],
    high: [Vec<f64>; 3],
}

/// The places at which shadow rays start.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Region {
    low: [f64; 3],
    high: [f64; 3],
    center: DVec3,
    radius: f64,
}

/// A cone of directions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cone {
    axis: DVec3,
    cosine: f64,
    sine: f64,
    /// The smallest and the largest coordinate of the cone's directions along each axis.
    least: [f64; 3],
    largest: [f64; 3],
}

/// The factor that covers the rounding errors of this module.
const WIDER: f64 = 1.0 + 1e-9;

impl Region {
    #[inline(always)]
    pub(crate) fn new<E: Real>(low: [E; 3], high: [E; 3]) -> Self {
        let (low, high) = (low.map(Real::widen), high.map(Real::widen));
        let (from, to) = (DVec3::from_array(low), DVec3::from_array(high));
        Self { low, high, center: 0.5 * (from + to), radius: 0.5 * (to - from).length() * WIDER }
    }
}

impl Cone {
    /// Makes a cone. `spread` is 1 - cos of its half angle.
    pub(crate) fn new(axis: DVec3, spread: f64) -> Self {
        // Wider by the rounding of its rays' directions.
        let cosine = (1.0 - spread - 1e-6).max(-1.0);
        let sine = (1.0 - cosine * cosine).sqrt();
        // cos(a + b) and cos(a - b), where a is the angle between the cone's axis and a coordinate's.
        let bound = |along: f64, sign: f64| {
            let across = (1.0 - along * along).max(0.0).sqrt();
            if sign * along >= cosine { sign } else { along * cosine + sign * across * sine }
        };
        let axes = axis.to_array();
        Self {
            axis,
            cosine,
            sine,
            least: axes.map(|along| bound(along, -1.0)),
            largest: axes.map(|along| bound(along, 1.0)),
        }
    }
}

impl Hulls {
    /// Makes the hulls of shapes, in the order of the bits.
    pub(crate) fn new<'a, E: Real>(shapes: impl Iterator<Item = &'a Shape>) -> Self {
        let mut hulls = Self::default();
        for shape in shapes {
            let slack = if shape.is_its_box() { 0.0 } else { BOUNDS * E::ROUNDOFF * shape.magnitude() };
            let (min, max): Bounds = shape.bounds();
            // A face is exact: what starts beyond it, if only by its offset, is beyond it.
            let rounded = |x: f64| if slack == 0.0 { E::narrow(x).widen() } else { x };
            let (center, radius) = shape.ball().unwrap_or((0.5 * (min + max), 0.5 * (max - min).length()));
            hulls
                .radius
                .push(radius * (1.0 + 8.0 * E::ROUNDOFF) + 8.0 * slack + 8.0 * E::ROUNDOFF * center.length());
            for axis in 0..3 {
                hulls.center[axis].push(center[axis]);
                hulls.low[axis].push(rounded(min[axis]) - slack);
                hulls.high[axis].push(rounded(max[axis]) + slack);
            }
        }
        hulls
    }

    /// Returns, as bits, the objects that rays from a region in a cone's directions can hit.
    #[inline(always)]
    pub(crate) fn towards(&self, region: &Region, cone: &Cone) -> u64 {
        let mut bits = 0;
        for k in 0..self.radius.len() {
            let center = DVec3::new(self.center[0][k], self.center[1][k], self.center[2][k]);
            let to = center - region.center;
            let along = to.dot(cone.axis);
            let across = (to.length_squared() - along * along).max(0.0).sqrt();
            // How far the middle is from the cone around the region's, at least.
            let apart = across * cone.cosine - along * cone.sine;
            let mut meets = apart <= (self.radius[k] + region.radius) * WIDER;
            for axis in 0..3 {
                meets &= cone.least[axis] < 0.0 || self.high[axis][k] >= region.low[axis];
                meets &= cone.largest[axis] > 0.0 || self.low[axis][k] <= region.high[axis];
            }
            bits |= u64::from(meets) << k;
        }
        bits
    }

    /// Returns, as bits, the objects that rays from a region to a ball can hit.
    #[inline(always)]
    pub(crate) fn between(&self, region: &Region, middle: DVec3, radius: f64) -> u64 {
        let mut bits = 0;
        let way = middle - region.center;
        let square = way.length_squared();
        let wide = region.radius.max(radius);
        for k in 0..self.radius.len() {
            let center = DVec3::new(self.center[0][k], self.center[1][k], self.center[2][k]);
            let to = center - region.center;
            let part = if square > 0.0 { (to.dot(way) / square).clamp(0.0, 1.0) } else { 0.0 };
            let mut meets = (to - part * way).length() <= (self.radius[k] + wide) * WIDER;
            for axis in 0..3 {
                let reach = radius * WIDER + 1e-6 * (middle[axis].abs() + radius);
                meets &= self.high[axis][k] >= region.low[axis].min(middle[axis] - reach);
                meets &= self.low[axis][k] <= region.high[axis].max(middle[axis] + reach);
            }
            bits |= u64::from(meets) << k;
        }
        bits
    }
}
