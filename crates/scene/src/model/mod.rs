//! The typed scene: what a `Trace` command renders.
//!
//! A bad value cannot be built: every type with a condition has private fields, a constructor that checks it and
//! accessors. Lengths are world units, colours are display values (0 black, 1 white, unclamped), positions and
//! directions are right-handed with y up on the screen. All numbers are finite.
mod camera;
mod invalid;
mod light;
mod object;

use glam::DVec3;

pub use camera::{Camera, Pinhole};
pub use invalid::{InvalidValue, Parameter};
pub use light::{DirectionalLight, Light};
pub use object::{Cuboid, Material, Object, Sphere, Triangle};

use crate::shared_slice::SharedSlice;
use invalid::finite;

/// Everything that a frame is drawn from.
///
/// Objects and lights are shared, so that a script of many frames that adds to one scene does not copy it.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Size of the image.
    pub screen: Screen,
    /// Where the rays come from.
    pub camera: Camera,
    /// Colour of a ray that hits nothing, each channel in 0..=1.
    background: DVec3,
    /// In the order of the script: of hits at the same distance the first object wins.
    pub objects: SharedSlice<Object>,
    /// In the order of the script, which is the order of summation.
    pub lights: SharedSlice<Light>,
}

impl Scene {
    /// An empty scene on a black background.
    pub fn new(screen: Screen, camera: Camera) -> Self {
        Self {
            screen,
            camera,
            background: DVec3::ZERO,
            objects: SharedSlice::default(),
            lights: SharedSlice::default(),
        }
    }

    /// Colour of a ray that hits nothing, each channel in 0..=1.
    pub fn background(&self) -> DVec3 {
        self.background
    }

    /// Sets the background; each channel is clamped to 0..=1.
    ///
    /// # Errors
    /// When a channel is not finite.
    pub fn set_background(&mut self, color: DVec3) -> Result<(), InvalidValue> {
        self.background = displayable(finite(Parameter::Background, color)?);
        Ok(())
    }

    /// Sets a background that was clamped before.
    pub(crate) fn restore_background(&mut self, color: DVec3) {
        self.background = color;
    }
}

/// Size of an image in pixels, at least 1 x 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Screen {
    width: u32,
    height: u32,
}

impl Screen {
    /// # Errors
    /// When a side is zero.
    pub fn new(width: u32, height: u32) -> Result<Self, InvalidValue> {
        if width == 0 {
            return Err(InvalidValue::Zero(Parameter::ScreenWidth));
        }
        if height == 0 {
            return Err(InvalidValue::Zero(Parameter::ScreenHeight));
        }
        Ok(Self { width, height })
    }

    /// Columns.
    pub fn width(self) -> u32 {
        self.width
    }

    /// Rows.
    pub fn height(self) -> u32 {
        self.height
    }

    /// Pixels in all.
    pub fn pixels(self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }
}

/// `v / |v|` for any finite non-zero vector, also where `|v|²` would overflow or vanish.
pub fn unit(v: DVec3) -> DVec3 {
    let largest = v.abs().max_element();
    // Powers of two, so that the direction of a scaled vector is the same bit for bit.
    let scaled = if largest > 2f64.powi(500) {
        v * 2f64.powi(-600)
    } else if largest < 2f64.powi(-500) {
        v * 2f64.powi(600)
    } else {
        v
    };
    scaled / scaled.length()
}

/// The power of two that brings a positive `largest` to 1..2; 1 for zero.
fn to_unit_scale(largest: f64) -> f64 {
    if largest == 0.0 {
        return 1.0;
    }
    let exponent = ((largest.to_bits() >> 52) & 0x7ff) as i32 - 1023;
    2f64.powi(-exponent)
}

/// Each channel clamped to 0..=1, and zero without a sign.
pub(crate) fn displayable(color: DVec3) -> DVec3 {
    color.clamp(DVec3::ZERO, DVec3::ONE) + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_screen_has_pixels() {
        assert_eq!(Screen::new(0, 1), Err(InvalidValue::Zero(Parameter::ScreenWidth)));
        assert_eq!(Screen::new(1, 0), Err(InvalidValue::Zero(Parameter::ScreenHeight)));
        assert_eq!(Screen::new(u32::MAX, u32::MAX).unwrap().pixels(), 0xffff_fffe_0000_0001);
    }

    #[test]
    fn a_background_is_clamped_and_finite() {
        let mut scene = Scene::new(Screen::new(1, 1).unwrap(), Camera::default());
        scene.set_background(DVec3::new(-1.0, 0.5, 7.0)).unwrap();
        assert_eq!(scene.background(), DVec3::new(0.0, 0.5, 1.0));
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let fault = scene.set_background(DVec3::new(0.0, bad, 0.0));
            assert_eq!(fault, Err(InvalidValue::NotFinite(Parameter::Background)));
        }
        assert_eq!(scene.background().y, 0.5, "what stood before stays");
    }

    #[test]
    fn unit_vectors_of_any_length() {
        let check = |v: DVec3, expect: DVec3| assert!(unit(v).distance(expect) < 1e-15, "{v}");
        let diagonal = DVec3::ONE / 3f64.sqrt();
        for length in [5e-324, 1e-310, 1e-200, 1.0, 1e200, f64::MAX] {
            check(DVec3::NEG_Y * length, DVec3::NEG_Y);
            check(DVec3::ONE * length, diagonal);
        }
        check(DVec3::new(f64::MAX, 0.0, f64::MIN_POSITIVE), DVec3::X);
    }

    #[test]
    fn a_power_of_two_does_not_turn_a_vector() {
        let v = DVec3::new(0.1, -0.7, 0.3);
        for exponent in [-1000, -501, -499, -1, 1, 499, 501, 1000] {
            assert_eq!(unit(v * 2f64.powi(exponent)), unit(v), "2^{exponent}");
        }
    }
}
