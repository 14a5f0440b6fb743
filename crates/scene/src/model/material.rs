//! Materials: the response of a surface to light.

use std::sync::Arc;

use glam::DVec3;

use super::image::Image;
use super::invalid::{InvalidValue, Parameter, finite, positive};

/// The coefficients of a surface per channel; any finite numbers.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Coefficients {
    ambient: DVec3,
    diffuse: DVec3,
    mirror: DVec3,
}

/// The coefficients of a surface, and the optional finish.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Material {
    coefficients: Coefficients,
    finish: Option<Arc<Finish>>,
}

/// The optional properties of a surface besides its coefficients.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Finish {
    /// The specular highlights of the surface.
    pub shine: Option<Shine>,
    /// The transmission, if the surface is glass.
    pub glass: Option<Glass>,
    /// The pattern of other coefficients.
    pub pattern: Option<Pattern>,
    /// The picture that multiplies the ambient and diffuse coefficients.
    pub image: Option<Image>,
    /// Whether the colour of a model's file multiplies the ambient and diffuse coefficients.
    pub own: bool,
    /// The light that the surface gives off on both sides, per channel; any finite numbers. No pattern changes it.
    pub glow: DVec3,
    /// The roughness of mirror and glass; `None` for the number 0.
    pub rough: Option<Rough>,
}

/// The width α of the microfacets of a rough mirror or of rough glass (isotropic GGX), from 0 to 1. A curve may be 0 at
/// some moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rough(f64);

impl Rough {
    /// The least width above 0.
    pub const LEAST: f64 = 1.0 / 1024.0;

    /// The roughness of a curve that is 0.
    pub(crate) const NONE: Self = Self(0.0);

    /// Makes a roughness.
    ///
    /// # Errors
    /// Fails if it is not from 0 to 1.
    pub fn new(alpha: f64) -> Result<Self, InvalidValue> {
        if (0.0..=1.0).contains(&alpha) {
            Ok(Self(alpha))
        } else {
            Err(InvalidValue::OutOfRange(Parameter::Roughness, 0.0, 1.0))
        }
    }

    /// Returns the width as it was given.
    pub fn given(self) -> f64 {
        self.0
    }

    /// Returns the width: 0, or from [`Self::LEAST`] to 1.
    pub fn alpha(self) -> f64 {
        if self.0 > 0.0 { self.0.max(Self::LEAST) } else { 0.0 }
    }
}

/// Highlights: for each visible light, light·shine·max(0, N·h)ⁿ (Blinn and Phong).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shine {
    color: DVec3,
    exponent: f64,
}

impl Shine {
    /// Makes highlights.
    ///
    /// # Errors
    /// Fails if the exponent is less than 1 or a number is not finite.
    pub fn new(color: DVec3, exponent: f64) -> Result<Self, InvalidValue> {
        finite(Parameter::Shine, color)?;
        if !exponent.is_finite() {
            return Err(InvalidValue::NotFinite(Parameter::ShineExponent));
        }
        if exponent < 1.0 {
            return Err(InvalidValue::TooSmall(Parameter::ShineExponent, 1.0));
        }
        Ok(Self { color, exponent })
    }

    /// Returns the reflected share of a light, per channel.
    pub fn color(&self) -> DVec3 {
        self.color
    }

    /// Returns the exponent n, at least 1.
    pub fn exponent(&self) -> f64 {
        self.exponent
    }
}

/// A surface that transmits light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glass {
    color: DVec3,
    ior: f64,
}

impl Glass {
    /// Makes a transmitting surface. `ior` is the index of refraction of the inside relative to the outside.
    ///
    /// # Errors
    /// Fails if the index is not positive or a number is not finite.
    pub fn new(color: DVec3, ior: f64) -> Result<Self, InvalidValue> {
        finite(Parameter::Glass, color)?;
        positive(Parameter::Ior, ior)?;
        Ok(Self { color, ior })
    }

    /// Returns the transmitted share of light, per channel.
    pub fn color(&self) -> DVec3 {
        self.color
    }

    /// Returns the index of refraction, greater than 0.
    pub fn ior(&self) -> f64 {
        self.ior
    }
}

/// A blend of two sets of coefficients over the surface: (1 - w)·own + w·other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pattern {
    /// The weight w as a function of the position.
    pub weight: Weight,
    /// The coefficients at w = 1.
    pub other: Coefficients,
}

/// The weight of the other coefficients, from 0 to 1, as a function of the position in the coordinates of the script.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Weight {
    /// The weight is 1 in every other cell of this size, greater than 0, along the three axes.
    Checker(f64),
    /// The weight is 1 in every other cell of this size, greater than 0, along x.
    Stripes(f64),
    /// The weight is Perlin's improved noise (2002) in cells of this size, greater than 0.
    Noise(f64),
    /// The weight goes from 0 at the first height y to 1 at the second, which differ.
    Gradient(f64, f64),
}

impl Weight {
    /// Checks the numbers of the weight.
    ///
    /// # Errors
    /// Fails if a size is not positive, the ends of a gradient are the same, or a number is not finite.
    pub fn checked(self) -> Result<Self, InvalidValue> {
        match self {
            Self::Checker(size) | Self::Stripes(size) | Self::Noise(size) => {
                positive(Parameter::CellSize, size)?;
            }
            Self::Gradient(start, end) => {
                for (name, x) in [(Parameter::GradientStart, start), (Parameter::GradientEnd, end)] {
                    if !x.is_finite() {
                        return Err(InvalidValue::NotFinite(name));
                    }
                }
                if start == end {
                    return Err(InvalidValue::EmptyGradient);
                }
            }
        }
        Ok(self)
    }
}

impl Coefficients {
    /// Makes coefficients.
    ///
    /// # Errors
    /// Fails if a number is not finite.
    pub fn new(ambient: DVec3, diffuse: DVec3, mirror: DVec3) -> Result<Self, InvalidValue> {
        finite(Parameter::Ambient, ambient)?;
        finite(Parameter::Diffuse, diffuse)?;
        finite(Parameter::Mirror, mirror)?;
        Ok(Self { ambient, diffuse, mirror })
    }

    /// Returns the colour without light.
    pub fn ambient(&self) -> DVec3 {
        self.ambient
    }

    /// Returns the diffuse reflectance (Lambert).
    pub fn diffuse(&self) -> DVec3 {
        self.diffuse
    }

    /// Returns the share of the colour along the reflected ray.
    pub fn mirror(&self) -> DVec3 {
        self.mirror
    }

    /// Returns (1 - w)·own + w·other for a weight from 0 to 1, else the own coefficients.
    #[must_use]
    pub fn mixed(&self, other: &Self, w: f64) -> Self {
        // If one of them has the whole weight, the other may be any number.
        if w == 1.0 {
            return *other;
        }
        if !(w > 0.0 && w < 1.0) {
            return *self;
        }
        // A mean of finite numbers is finite.
        let mixed = |a: DVec3, b: DVec3| (1.0 - w) * a + w * b;
        Self {
            ambient: mixed(self.ambient, other.ambient),
            diffuse: mixed(self.diffuse, other.diffuse),
            mirror: mixed(self.mirror, other.mirror),
        }
    }
}

impl Material {
    /// Makes a material without a finish.
    ///
    /// # Errors
    /// Fails if a number is not finite.
    pub fn new(ambient: DVec3, diffuse: DVec3, mirror: DVec3) -> Result<Self, InvalidValue> {
        Ok(Coefficients::new(ambient, diffuse, mirror)?.into())
    }

    /// Makes a material with a finish.
    pub fn finished(coefficients: Coefficients, finish: Finish) -> Self {
        let finish = if finish == Finish::default() { None } else { Some(Arc::new(finish)) };
        Self { coefficients, finish }
    }

    /// Returns the material's own coefficients, without its pattern.
    pub fn coefficients(&self) -> Coefficients {
        self.coefficients
    }

    /// Returns the finish, or `None` for materials of language version 1.
    pub fn finish(&self) -> Option<&Finish> {
        self.finish.as_deref()
    }

    /// Returns the colour without light.
    pub fn ambient(&self) -> DVec3 {
        self.coefficients.ambient
    }

    /// Returns the diffuse reflectance (Lambert).
    pub fn diffuse(&self) -> DVec3 {
        self.coefficients.diffuse
    }

    /// Returns the share of the colour along the reflected ray.
    pub fn mirror(&self) -> DVec3 {
        self.coefficients.mirror
    }
}

impl From<Coefficients> for Material {
    fn from(coefficients: Coefficients) -> Self {
        Self { coefficients, finish: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_coefficient_is_finite() {
        for bad in [DVec3::NAN, DVec3::INFINITY] {
            let fault = |parameter| Err(InvalidValue::NotFinite(parameter));
            assert_eq!(Material::new(bad, DVec3::X, DVec3::X), fault(Parameter::Ambient));
            assert_eq!(Material::new(DVec3::X, bad, DVec3::X), fault(Parameter::Diffuse));
            assert_eq!(Material::new(DVec3::X, DVec3::X, bad), fault(Parameter::Mirror));
        }
    }
}
