//! Lights, which illuminate surfaces.
//!
//! Each light has a file with its checking constructor and its syntax. This file only lists them; for a new light,
//! the compiler reports the missing parts.

mod lamp;
mod sun;

use std::fmt::{self, Formatter};

use glam::DVec3;
pub use lamp::Lamp;
pub use sun::DirectionalLight;

use crate::form::write_line;

/// A light of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// A light at infinity.
    Directional(DirectionalLight),
    /// A light with a position.
    Lamp(Lamp),
}

impl Light {
    /// Returns the colour; any finite numbers.
    pub fn color(&self) -> DVec3 {
        match self {
            Self::Directional(light) => light.color(),
            Self::Lamp(light) => light.color(),
        }
    }

    /// Returns whether it has an extent, so that its shadows are soft: a sun has an angle, a lamp a radius.
    pub fn has_extent(&self) -> bool {
        match self {
            Self::Directional(light) => light.angle() > 0.0,
            Self::Lamp(light) => light.radius() > 0.0,
        }
    }

    /// Writes a line of a script.
    pub(crate) fn write(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Directional(light) => write_line(f, light, None),
            Self::Lamp(light) => write_line(f, light, None),
        }
    }
}

impl From<DirectionalLight> for Light {
    fn from(light: DirectionalLight) -> Self {
        Self::Directional(light)
    }
}

impl From<Lamp> for Light {
    fn from(light: Lamp) -> Self {
        Self::Lamp(light)
    }
}
