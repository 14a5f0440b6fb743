//! Lights: what a surface is lit by.
//!
//! A light is a file: its checked constructor, and how a script writes it. Here stands only which there are; the
//! compiler lists what a new one lacks.

mod lamp;
mod sun;

use std::fmt::{self, Formatter};

use glam::DVec3;
pub use lamp::Lamp;
pub use sun::DirectionalLight;

use crate::form::write_line;

/// Something that lights the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// A light at infinity.
    Directional(DirectionalLight),
    /// A light at a place.
    Lamp(Lamp),
}

impl Light {
    /// Its colour, any finite numbers.
    pub fn color(&self) -> DVec3 {
        match self {
            Self::Directional(light) => light.color(),
            Self::Lamp(light) => light.color(),
        }
    }

    /// As a line of a script.
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
