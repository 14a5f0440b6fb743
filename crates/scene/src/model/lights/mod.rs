//! Lights: what a surface is lit by.
//!
//! A light is a file: its checked constructor, and how a script writes it. Here stands only which there are; the
//! compiler lists what a new one lacks.

mod sun;

use std::fmt::{self, Formatter};

pub use sun::DirectionalLight;

use crate::form::write_line;

/// Something that lights the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// A light at infinity.
    Directional(DirectionalLight),
}

impl Light {
    /// As a line of a script.
    pub(crate) fn write(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Directional(light) => write_line(f, light),
        }
    }
}

impl From<DirectionalLight> for Light {
    fn from(light: DirectionalLight) -> Self {
        Self::Directional(light)
    }
}
