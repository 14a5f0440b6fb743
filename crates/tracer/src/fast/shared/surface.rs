//! The parts of surfaces, and the test of whether two of them coincide.

use glam::DVec3;

/// The distance between numbers that count as the same, in roundoffs of the largest number involved.
pub(crate) const SAME: f64 = 64.0 * f64::EPSILON / 2.0;

/// A part of the surface of an object.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Surface {
    Flat(Flat),
    Ball { center: DVec3, radius: f64 },
    Side(Side),
    Ring(Ring),
}

/// A flat part: a face, a cap, or all of what is flat.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Flat {
    /// A unit vector.
    pub(crate) normal: DVec3,
    /// `normal · point` of its points.
    pub(crate) height: f64,
    /// The middle of a circle around it, and its radius.
    pub(crate) center: DVec3,
    pub(crate) radius: f64,
    pub(crate) plain: Plain,
}

/// The formula for the distance to a flat part. The same formula with the same numbers gives the same distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Plain {
    Triangle,
    /// From the numbers of a plane that is perpendicular to an axis.
    ByAxis,
    /// From a point of the part itself.
    No,
}

/// The side of a cone or a cylinder.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Side {
    pub(crate) end: DVec3,
    /// A unit vector.
    pub(crate) axis: DVec3,
    pub(crate) height: f64,
    /// The radii at the end and at the other end.
    pub(crate) radii: [f64; 2],
}

/// The surface of a torus.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ring {
    pub(crate) center: DVec3,
    /// A unit vector.
    pub(crate) axis: DVec3,
    pub(crate) radius: f64,
    pub(crate) thickness: f64,
}

/// A direction that is perpendicular to no plane normal in practice. It distinguishes the two sides of a plane.
pub(crate) const ASIDE: DVec3 = DVec3::new(0.577_215_664_9, 0.302_775_637_7, 0.141_592_653_6);

/// Another such direction, along which places are sorted.
const ACROSS: DVec3 = DVec3::new(-0.261_497_212_8, 0.662_743_419_3, 0.428_249_505_6);

/// Returns whether a direction is that of an axis. The test counts the coordinates other than 0, because a direction
/// that is tilted by less than a roundoff may have a coordinate of 1, too.
pub(crate) fn is_square(direction: DVec3) -> bool {
    direction.to_array().iter().filter(|&&part| part != 0.0).count() == 1
}

impl Surface {
    /// Returns two numbers that are nearly the same for parts that lie in one surface: for flat parts, one for the
    /// direction and one for the place.
    pub(crate) fn key(&self) -> (f64, f64) {
        match self {
            Self::Flat(flat) => {
                let side = flat.normal.dot(ASIDE).signum();
                (side * flat.normal.dot(ACROSS), side * flat.height)
            }
            Self::Ball { center, radius } => (4.0, center.dot(ACROSS) + radius),
            Self::Side(side) => {
                let axis = side.axis * side.axis.dot(ASIDE).signum();
                let foot = side.end - side.end.dot(axis) * axis;
                (8.0 + axis.dot(ACROSS), foot.dot(ACROSS))
            }
            Self::Ring(ring) => (16.0, ring.center.dot(ACROSS) + ring.radius + ring.thickness),
        }
    }

    /// Returns the centre and the radius of a ball around it.
    pub(crate) fn ball(&self) -> (DVec3, f64) {
        match self {
            Self::Flat(flat) => (flat.center, flat.radius),
            Self::Ball { center, radius } => (*center, *radius),
            Self::Side(side) => {
                let half = 0.5 * side.height;
                (side.end + half * side.axis, libm::hypot(half, side.radii[0].max(side.radii[1])))
            }
            Self::Ring(ring) => (ring.center, ring.radius + ring.thickness),
        }
    }

    /// Returns whether rays hit both at the same distance, bit for bit.
    pub(crate) fn is_met_with(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Flat(one), Self::Flat(other)) => one.is_met_with(other),
            _ => false,
        }
    }

    /// Returns the size of the numbers that define where two parts lie, if both lie in one surface and may overlap.
    /// `sizes` are the largest numbers of both objects along each axis.
    pub(crate) fn shared(&self, other: &Self, sizes: DVec3) -> Option<f64> {
        match (self, other) {
            (Self::Flat(one), Self::Flat(other)) => {
                if one.radius <= other.radius {
                    one.lies_in(other, sizes)
                } else {
                    other.lies_in(one, sizes)
                }
            }
            (Self::Ball { center, radius }, Self::Ball { center: c, radius: r }) => {
                let size = sizes.max_element();
                (center.distance(*c) + (radius - r).abs() <= SAME * size).then_some(size)
            }
            (Self::Side(one), Self::Side(other)) => {
                if one.height <= other.height {
                    one.lies_in(other, sizes)
                } else {
                    other.lies_in(one, sizes)
                }
            }
            (Self::Ring(one), Self::Ring(other)) => {
                let size = sizes.max_element();
                let apart = one.center.distance(other.center)
                    + (one.radius - other.radius).abs()
                    + (one.thickness - other.thickness).abs()
                    + one.axis.cross(other.axis).length() * one.radius;
                (apart <= SAME * size).then_some(size)
            }
            _ => None,
        }
    }
}

impl Flat {
    /// Returns the size if the smaller part lies in the larger one's plane.
    fn lies_in(&self, larger: &Self, sizes: DVec3) -> Option<f64> {
        if self.center.distance(larger.center) >= self.radius + larger.radius {
            return None;
        }
        // Where planes are square to an axis, numbers along the others do not count.
        let is_askew = self.normal.cmpne(DVec3::ZERO) | larger.normal.cmpne(DVec3::ZERO);
        let size = DVec3::select(is_askew, sizes, DVec3::ZERO).element_sum();
        let above = (larger.normal.dot(self.center) - larger.height).abs();
        let radius = if self.radius.is_finite() { self.radius } else { self.center.length() };
        let tilt = radius * self.normal.cross(larger.normal).length();
        (above <= SAME * size && tilt <= SAME * size).then_some(size)
    }

    pub(crate) fn is_met_with(&self, other: &Self) -> bool {
        let is_equal = self.normal == other.normal && self.height == other.height
            || self.normal == -other.normal && self.height == -other.height;
        is_equal
            && match (self.plain, other.plain) {
                (Plain::No, _) | (_, Plain::No) => false,
                (Plain::Triangle, Plain::Triangle) => true,
                _ => is_square(self.normal),
            }
    }
}

impl Side {
    /// Returns the size if the shorter side coincides with the longer one along the length that both have.
    fn lies_in(&self, longer: &Self, sizes: DVec3) -> Option<f64> {
        let size = sizes.max_element();
        let at = |height: f64| self.end + height * self.axis;
        let along = longer.axis.dot(self.axis).signum();
        // The heights of this one at which the other begins and ends.
        let begin = longer.axis.dot(longer.end - self.end) * along;
        let span = [begin, begin + along * longer.height];
        let (from, to) = (span[0].min(span[1]).max(0.0), span[0].max(span[1]).min(self.height));
        let is_one = |height: f64| {
            let place = at(height) - longer.end;
            let over = place.dot(longer.axis);
            let radius =
                |of: &Self, height: f64| of.radii[0] + (of.radii[1] - of.radii[0]) * (height / of.height);
            let aside = (place - over * longer.axis).length();
            aside + (radius(self, height) - radius(longer, over)).abs() <= SAME * size
        };
        (from < to && is_one(from) && is_one(to)).then_some(size)
    }
}
