//! Pictures of a model: how they lie on its faces.

use std::sync::Arc;

use glam::DVec2;

use crate::picture::Picture;

/// The continuation of a picture beyond its edges, along one of its axes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The picture repeats.
    #[default]
    Repeat,
    /// The picture repeats, every other time mirrored.
    Mirror,
    /// The first and last pixels of the picture continue.
    Clamp,
}

/// The use of a picture by the faces of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slot {
    /// A factor of their colour.
    Color,
    /// A factor of the light that they give off.
    Glow,
}

/// A picture on the faces of a model.
#[derive(Clone, Debug)]
pub struct Texture {
    pub(crate) picture: Arc<Picture>,
    pub(crate) wraps: [Wrap; 2],
    /// Whether it lies by texture coordinates of its own, and not by those of an `image` with `uv`.
    pub(crate) has_own_uvs: bool,
    /// The rows of an affine map of texture coordinates: the factors of u and v, and what is added.
    pub(crate) transform: Option<[[f64; 3]; 2]>,
}

impl Texture {
    /// Makes a picture that repeats, with the texture coordinates unchanged.
    pub(crate) fn new(picture: Arc<Picture>) -> Self {
        Self { picture, wraps: [Wrap::Repeat; 2], has_own_uvs: false, transform: None }
    }

    /// Returns the picture.
    pub fn picture(&self) -> &Arc<Picture> {
        &self.picture
    }

    /// Returns how the picture continues across and down.
    pub fn wraps(&self) -> [Wrap; 2] {
        self.wraps
    }

    /// Returns whether it lies by [texture coordinates of its own](crate::Model::own_uvs).
    pub fn has_own_uvs(&self) -> bool {
        self.has_own_uvs
    }

    /// Returns whether the material has a transform of texture coordinates.
    pub fn has_transform(&self) -> bool {
        self.transform.is_some()
    }

    /// Returns the place of texture coordinates after the transform of the material.
    pub fn transformed(&self, uv: DVec2) -> DVec2 {
        let Some([across, down]) = self.transform else { return uv };
        let row = |[a, b, c]: [f64; 3]| a * uv.x + b * uv.y + c;
        DVec2::new(row(across), row(down))
    }
}
