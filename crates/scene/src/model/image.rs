//! Pictures on surfaces: the clause `image`.

use super::invalid::{InvalidValue, Parameter, positive};
use super::picture_file::PictureFile;

/// A picture on a surface, which multiplies the ambient and diffuse coefficients.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    file: PictureFile,
    map: ImageMap,
}

/// The mapping of a picture onto a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ImageMap {
    /// The texture coordinates of a mesh place the picture.
    Uv,
    /// The picture lies on a plane of the coordinates of the object's numbers. It has this width, greater than 0, and
    /// its lower left corner is at 0. It repeats.
    Flat(f64, Axes),
    /// The picture surrounds the centre of a sphere, or else the origin of the coordinates of the object's numbers.
    Ball,
}

/// The axes of a plane: that along which a picture goes right, and that along which it goes up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Axes {
    /// Right along x, up along y.
    #[default]
    Xy,
    /// Right along x, up against z: on a floor.
    Xz,
    /// Right along z, up along y.
    Zy,
}

/// The words for ways and axes.
pub(crate) const MAPS: [&str; 3] = ["uv", "flat", "ball"];
pub(crate) const AXES: [(&str, Axes); 3] = [("xy", Axes::Xy), ("xz", Axes::Xz), ("zy", Axes::Zy)];

impl Image {
    /// Makes a picture on a surface.
    ///
    /// # Errors
    /// Fails if its width is not positive or not finite.
    pub fn new(file: PictureFile, map: ImageMap) -> Result<Self, InvalidValue> {
        if let ImageMap::Flat(width, _) = map {
            positive(Parameter::PictureWidth, width)?;
        }
        Ok(Self { file, map })
    }

    /// Returns the picture and its file.
    pub fn file(&self) -> &PictureFile {
        &self.file
    }

    /// Returns its mapping onto the surface.
    pub fn map(&self) -> ImageMap {
        self.map
    }

    /// Returns the same picture with another width, if it is flat.
    pub(crate) fn with_width(&self, width: Option<f64>) -> Result<Self, InvalidValue> {
        let map = match (self.map, width) {
            (ImageMap::Flat(_, axes), Some(width)) => ImageMap::Flat(width, axes),
            (map, _) => map,
        };
        Self::new(self.file.clone(), map)
    }
}
