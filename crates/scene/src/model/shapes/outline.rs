//! The simplest solid that shows the size and the position of a shape.
//!
//! Code that needs only the size of an object matches its outline. A new shape returns one of these, and such code does
//! not change.

use glam::DVec3;

/// A simple solid that encloses a shape closely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outline {
    /// A ball.
    Ball {
        /// Its centre.
        center: DVec3,
        /// Its radius.
        radius: f64,
    },
    /// A triangle, by its corners.
    Triangle([DVec3; 3]),
    /// A box along the axes.
    Box {
        /// The corners with the smallest and the largest coordinates.
        corners: [DVec3; 2],
        /// The radius of its edges; 0 if they are sharp.
        radius: f64,
    },
    /// An infinite plane, by one of its points.
    Plane(DVec3),
    /// A flat disc.
    Disc {
        /// Its centre.
        center: DVec3,
        /// A vector perpendicular to it, of any length.
        normal: DVec3,
        /// Its radius.
        radius: f64,
    },
    /// A solid of revolution around a line segment.
    Rod {
        /// The radius at each end.
        radii: [f64; 2],
        /// The ends of the axis.
        ends: [DVec3; 2],
        /// Whether half a ball is added at each end.
        is_round: bool,
    },
    /// A ring.
    Ring {
        /// The distance of the middle of the tube from the centre.
        radius: f64,
        /// The radius of the ring's body.
        thickness: f64,
        /// Its centre.
        center: DVec3,
        /// A vector along its axis, of any length.
        normal: DVec3,
    },
}

impl Outline {
    /// Returns the least radius of curvature of the surface and the middle of the solid; `None` if all of its faces are flat.
    pub fn curvature(&self) -> Option<(f64, DVec3)> {
        match *self {
            Self::Ball { center, radius } => Some((radius, center)),
            Self::Box { corners: [low, high], radius } if radius > 0.0 => {
                Some((radius, 0.5 * low + 0.5 * high))
            }
            Self::Rod { radii, ends: [a, b], .. } => Some((radii[0].max(radii[1]), 0.5 * (a + b))),
            Self::Ring { thickness, center, .. } => Some((thickness, center)),
            Self::Triangle(_) | Self::Box { .. } | Self::Plane(_) | Self::Disc { .. } => None,
        }
    }
}
