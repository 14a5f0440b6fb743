//! How a surface answers light.

use std::sync::Arc;

use glam::DVec3;

use super::invalid::{InvalidValue, Parameter, finite, positive};

/// Coefficients of a surface, a channel each; any finite numbers.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Coefficients {
    ambient: DVec3,
    diffuse: DVec3,
    mirror: DVec3,
}

/// Coefficients of a surface, and what few surfaces have.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Material {
    coefficients: Coefficients,
    finish: Option<Arc<Finish>>,
}

/// What a surface has beyond coefficients.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Finish {
    /// Highlights.
    pub shine: Option<Shine>,
    /// Whether it is glass.
    pub glass: Option<Glass>,
    /// Other coefficients here and there.
    pub pattern: Option<Pattern>,
}

/// Highlights: for each light that is not hidden, light·shine·max(0, N·h)ⁿ (Blinn and Phong).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shine {
    color: DVec3,
    exponent: f64,
}

impl Shine {
    /// # Errors
    /// When the exponent is less than 1 or a number is not finite.
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

    /// What share of a light, a channel each.
    pub fn color(&self) -> DVec3 {
        self.color
    }

    /// n, at least 1.
    pub fn exponent(&self) -> f64 {
        self.exponent
    }
}

/// A surface that light goes through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glass {
    color: DVec3,
    ior: f64,
}

impl Glass {
    /// `ior` is the index of refraction of the inside over that of the outside.
    ///
    /// # Errors
    /// When the index is not positive or a number is not finite.
    pub fn new(color: DVec3, ior: f64) -> Result<Self, InvalidValue> {
        finite(Parameter::Glass, color)?;
        positive(Parameter::Ior, ior)?;
        Ok(Self { color, ior })
    }

    /// What it lets through, a channel each.
    pub fn color(&self) -> DVec3 {
        self.color
    }

    /// Greater than zero.
    pub fn ior(&self) -> f64 {
        self.ior
    }
}

/// Where a surface has other coefficients: (1 - w)·own + w·other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pattern {
    /// How w comes from the place.
    pub weight: Weight,
    /// The coefficients where w is 1.
    pub other: Coefficients,
}

/// How much of the other coefficients there is at a place, from 0 to 1; the place in the coordinates of the script.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Weight {
    /// 1 in every other cell of that size, greater than 0, along the three axes.
    Checker(f64),
    /// 1 in every other cell of that size, greater than 0, along x.
    Stripes(f64),
    /// Perlin's improved noise (2002) of cells of that size, greater than 0.
    Noise(f64),
    /// From 0 at the first height y to 1 at the second, which differ.
    Gradient(f64, f64),
}

impl Weight {
    /// # Errors
    /// When a size is not positive, the ends of a gradient are the same, or a number is not finite.
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
    /// # Errors
    /// When a number is not finite.
    pub fn new(ambient: DVec3, diffuse: DVec3, mirror: DVec3) -> Result<Self, InvalidValue> {
        finite(Parameter::Ambient, ambient)?;
        finite(Parameter::Diffuse, diffuse)?;
        finite(Parameter::Mirror, mirror)?;
        Ok(Self { ambient, diffuse, mirror })
    }

    /// The colour that needs no light.
    pub fn ambient(&self) -> DVec3 {
        self.ambient
    }

    /// What is scattered of the light that arrives (Lambert).
    pub fn diffuse(&self) -> DVec3 {
        self.diffuse
    }

    /// What is mirrored of the colour along the reflected ray.
    pub fn mirror(&self) -> DVec3 {
        self.mirror
    }

    /// (1 - w)·own + w·other for a weight from 0 to 1; its own for what is no such weight.
    #[must_use]
    pub fn mixed(&self, other: &Self, w: f64) -> Self {
        // Where one of them is all, the other may be any number.
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
    /// Without a finish.
    ///
    /// # Errors
    /// When a number is not finite.
    pub fn new(ambient: DVec3, diffuse: DVec3, mirror: DVec3) -> Result<Self, InvalidValue> {
        Ok(Coefficients::new(ambient, diffuse, mirror)?.into())
    }

    /// Coefficients and what there is beside them.
    pub fn finished(coefficients: Coefficients, finish: Finish) -> Self {
        let finish = if finish == Finish::default() { None } else { Some(Arc::new(finish)) };
        Self { coefficients, finish }
    }

    /// Its own, where a pattern says nothing else.
    pub fn coefficients(&self) -> Coefficients {
        self.coefficients
    }

    /// What few surfaces have; `None` for those of version 1.
    pub fn finish(&self) -> Option<&Finish> {
        self.finish.as_deref()
    }

    /// The colour that needs no light.
    pub fn ambient(&self) -> DVec3 {
        self.coefficients.ambient
    }

    /// What is scattered of the light that arrives (Lambert).
    pub fn diffuse(&self) -> DVec3 {
        self.coefficients.diffuse
    }

    /// What is mirrored of the colour along the reflected ray.
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
