//! Pictures as the tracers see them: their places, and the mean of the four pixels around a place.
//!
//! A place on a picture is (u, v), from (0, 0) in its upper left corner to (1, 1) in its lower right one. The level of a
//! pixel is that of its middle; between middles it is interpolated.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DVec2, DVec3};
use rayfold_scene::assets::{Picture, Texture, Wrap};
use rayfold_scene::{Axes, Image, ImageMap, Object, Scene, Tone};

/// A picture all around the scene.
#[derive(Clone, Debug)]
pub(crate) struct Panorama {
    picture: Arc<Picture>,
    /// Whether encoded levels are decoded to linear light.
    is_linear: bool,
    strength: f64,
    /// The sine and cosine of the angle by which the picture is turned.
    turn: (f64, f64),
}

impl Panorama {
    /// Returns the picture around a scene, if there is one.
    pub(crate) fn of(scene: &Scene) -> Option<Self> {
        let (file, turn) = scene.sky_picture()?;
        let is_linear = scene.tone == Tone::Srgb;
        let angle = (turn.degrees() % 360.0).to_radians();
        let turn_of = (libm::sin(angle), libm::cos(angle));
        Some(Self { picture: file.picture().clone(), is_linear, strength: turn.strength(), turn: turn_of })
    }

    /// Returns the light that comes from this unit direction.
    pub(crate) fn along(&self, direction: DVec3) -> DVec3 {
        self.strength * self.level(Self::place(self.turned(direction)))
    }

    /// Returns the place on the picture of a direction in the picture's axes.
    pub(crate) fn place(DVec3 { x, y, z }: DVec3) -> [f64; 2] {
        let u = 0.5 + libm::atan2(x, -z) / TAU;
        let v = libm::atan2(libm::hypot(x, z), y) / PI;
        [u, v]
    }

    /// Returns the level at a place on the picture, without the factor of the sky.
    pub(crate) fn level(&self, place: [f64; 2]) -> DVec3 {
        mean(&self.picture, place, false, |column, row| self.picture.level(column, row, self.is_linear))
    }

    /// Returns the direction of a place on the picture, in the picture's axes.
    pub(crate) fn direction([u, v]: [f64; 2]) -> DVec3 {
        let (around, down) = ((u - 0.5) * TAU, v * PI);
        let across = libm::sin(down);
        DVec3::new(across * libm::sin(around), libm::cos(down), -across * libm::cos(around))
    }

    /// Returns a direction of the scene in the picture's axes.
    pub(crate) fn turned(&self, direction: DVec3) -> DVec3 {
        let (sine, cosine) = self.turn;
        let DVec3 { x, y, z } = direction;
        DVec3::new(x * cosine - z * sine, y, x * sine + z * cosine)
    }

    /// Returns a direction in the picture's axes as one of the scene.
    pub(crate) fn turned_back(&self, direction: DVec3) -> DVec3 {
        let (sine, cosine) = self.turn;
        let DVec3 { x, y, z } = direction;
        DVec3::new(x * cosine + z * sine, y, z * cosine - x * sine)
    }

    /// Returns the picture, and whether its levels are decoded to linear light.
    pub(crate) fn picture(&self) -> (&Arc<Picture>, bool) {
        (&self.picture, self.is_linear)
    }

    /// Returns the factor of the picture's light.
    pub(crate) fn strength(&self) -> f64 {
        self.strength
    }
}

/// A picture that alone defines the colour of the faces of a model, by their texture coordinates.
#[derive(Clone, Debug)]
pub(crate) struct FacePicture {
    pub(crate) picture: Arc<Picture>,
    pub(crate) wraps: [Wrap; 2],
    /// Whether (0, 0) of the texture coordinates is its upper left corner, and not the lower left one.
    pub(crate) is_from_top: bool,
    /// Whether encoded levels are decoded to linear light.
    pub(crate) is_linear: bool,
    /// The factor of a picture of the model's file. `None` for a picture of a material, whose alpha is used.
    pub(crate) tint: Option<DVec3>,
}

impl FacePicture {
    /// Returns a picture of a material.
    pub(crate) fn of_material(picture: &Arc<Picture>, is_from_top: bool, is_linear: bool) -> Self {
        Self { picture: picture.clone(), wraps: [Wrap::Repeat; 2], is_from_top, is_linear, tint: None }
    }

    /// Returns the value of a pixel.
    pub(crate) fn value(&self, column: u32, row: u32) -> DVec3 {
        match self.tint {
            Some(_) => self.picture.level(column, row, self.is_linear),
            None => self.picture.factor(column, row, self.is_linear),
        }
    }
}

/// Returns the factor of a picture on an object's surface at a place in the coordinates of its numbers; 1 for a picture by
/// texture coordinates, whose factor is that of [`factor_at`].
pub(crate) fn factor(image: &Image, object: &Object, place: DVec3, is_linear: bool) -> DVec3 {
    let picture = image.file().picture();
    match image.map() {
        ImageMap::Uv => DVec3::ONE,
        ImageMap::Flat(width, axes) => {
            let (right, up) = match axes {
                Axes::Xy => (place.x, place.y),
                Axes::Xz => (place.x, -place.z),
                Axes::Zy => (place.z, place.y),
            };
            let shape = f64::from(picture.width()) / f64::from(picture.height());
            factor_at(picture, [right / width, 1.0 - up / width * shape], true, is_linear)
        }
        ImageMap::Ball => {
            let DVec3 { x, y, z } = match object {
                Object::Sphere(sphere) => place - sphere.center(),
                _ => place,
            };
            let u = 0.5 + libm::atan2(x, z) / TAU;
            let v = libm::atan2(libm::hypot(x, z), y) / PI;
            factor_at(picture, [u, v], false, is_linear)
        }
    }
}

/// Returns the factor of a picture at a place on it.
pub(crate) fn factor_at(picture: &Picture, place: [f64; 2], repeats_down: bool, is_linear: bool) -> DVec3 {
    mean(picture, place, repeats_down, |column, row| picture.factor(column, row, is_linear))
}

/// Returns the level of a picture of a model at a place that counts from its upper left corner.
pub(crate) fn level_at(texture: &Texture, place: DVec2, is_linear: bool) -> DVec3 {
    let picture = texture.picture();
    interpolated(picture, place.into(), texture.wraps(), |column, row| picture.level(column, row, is_linear))
}

/// Returns the alpha of a picture of a model at a place that counts from its upper left corner.
pub(crate) fn alpha_at(texture: &Texture, place: DVec2) -> f64 {
    let picture = texture.picture();
    let alpha = |column, row| DVec3::splat(picture.alpha(column, row));
    interpolated(picture, place.into(), texture.wraps(), alpha).x
}

/// Returns the interpolated value at a place on a picture. The picture repeats across, and down as well if `repeats_down`;
/// otherwise its first and last row go on.
#[inline]
pub(crate) fn mean(
    picture: &Picture,
    place: [f64; 2],
    repeats_down: bool,
    value: impl Fn(u32, u32) -> DVec3,
) -> DVec3 {
    let down = if repeats_down { Wrap::Repeat } else { Wrap::Clamp };
    interpolated(picture, place, [Wrap::Repeat, down], value)
}

/// Returns the interpolated value at a place on a picture. `wraps` defines how the picture continues across and down.
#[inline]
fn interpolated(
    picture: &Picture,
    [u, v]: [f64; 2],
    wraps: [Wrap; 2],
    value: impl Fn(u32, u32) -> DVec3,
) -> DVec3 {
    let (columns, x) = neighbours(u, picture.width(), wraps[0]);
    let (rows, y) = neighbours(v, picture.height(), wraps[1]);
    let of_row = |row: u32| mixed(value(columns[0], row), value(columns[1], row), x);
    mixed(of_row(rows[0]), of_row(rows[1]), y)
}

/// Returns the two pixels, out of `count`, whose middles are around a place, and the share of the second.
pub(crate) fn neighbours(place: f64, count: u32, wrap: Wrap) -> ([u32; 2], f64) {
    // A place that is no number, of an object at the end of all numbers, is the corner.
    let place = if place.is_finite() { place } else { 0.0 };
    let repeats = wrap == Wrap::Repeat;
    let place = match wrap {
        Wrap::Repeat => place - place.floor(),
        Wrap::Clamp => place.clamp(0.0, 1.0),
        // From 0 to 2, and back from the middle. There the pixels at an edge are their own neighbours.
        Wrap::Mirror => {
            let place = place - 2.0 * (0.5 * place).floor();
            if place > 1.0 { 2.0 - place } else { place }
        }
    };
    let at = place * f64::from(count) - 0.5;
    let before = at.floor();
    let pixels = [before, before + 1.0].map(|pixel| {
        let last = f64::from(count - 1);
        let pixel = match repeats {
            true if pixel < 0.0 => last,
            true if pixel > last => pixel - f64::from(count),
            _ => pixel.clamp(0.0, last),
        };
        pixel as u32
    });
    (pixels, at - before)
}

/// Returns a mean of two values, without a rounding error if they are equal.
fn mixed(a: DVec3, b: DVec3, share: f64) -> DVec3 {
    a + share * (b - a)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_those_whose_middles_are_around_a_place() {
        assert_eq!(neighbours(0.5, 1, Wrap::Repeat), ([0, 0], 0.0));
        assert_eq!(neighbours(0.375, 4, Wrap::Repeat), ([1, 2], 0.0));
        assert_eq!(neighbours(0.5, 4, Wrap::Clamp), ([1, 2], 0.5));
        assert_eq!(neighbours(0.0, 4, Wrap::Repeat), ([3, 0], 0.5));
        assert_eq!(neighbours(1.0, 4, Wrap::Repeat), ([3, 0], 0.5));
        assert_eq!(neighbours(-1e-20, 4, Wrap::Repeat), ([3, 0], 0.5));
        assert_eq!(neighbours(0.0, 4, Wrap::Clamp), ([0, 0], 0.5));
        assert_eq!(neighbours(1.0, 4, Wrap::Clamp), ([3, 3], 0.5));
        assert_eq!(neighbours(-3.0, 4, Wrap::Clamp), ([0, 0], 0.5));
        assert_eq!(neighbours(1.125, 4, Wrap::Mirror), ([3, 3], 0.0));
        assert_eq!(neighbours(1.375, 4, Wrap::Mirror), ([2, 3], 0.0));
        assert_eq!(neighbours(-0.125, 4, Wrap::Mirror), ([0, 1], 0.0));
        assert_eq!(neighbours(2.0, 4, Wrap::Mirror), ([0, 0], 0.5));
        assert_eq!(neighbours(1.0, 4, Wrap::Mirror), ([3, 3], 0.5));
        assert_eq!(neighbours(f64::NAN, 4, Wrap::Repeat).0, [3, 0]);
        for place in [1e300, -1e300, 1e17, 0.1, -0.1] {
            for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
                let ([a, b], share) = neighbours(place, 7, wrap);
                assert!(a < 7 && b < 7 && (0.0..1.0).contains(&share), "{place}");
            }
        }
    }
}
