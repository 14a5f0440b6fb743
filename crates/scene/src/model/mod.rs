//! The typed scene that a `Trace` command renders.
//!
//! An invalid value cannot be built: every type with a constraint has private fields, a checking constructor and
//! accessors. The file of a type also defines its syntax in a script (`form::Scripted`). Lengths are world units.
//! Colours are display values (0 black, 1 white, unclamped). Positions and directions are right-handed with y up on
//! the screen. All numbers are finite.

mod background;
mod camera;
mod clause;
mod fog;
mod image;
mod indirect;
mod invalid;
mod lights;
mod look;
mod material;
mod picture_file;
mod sampling;
mod screen;
pub mod shapes;
mod sky;
mod surface;
mod vector;

use glam::DVec3;

pub use background::Background;
pub use camera::{Camera, Pinhole};
pub use clause::Clause;
pub use fog::Fog;
pub use image::{Axes, Image, ImageMap};
pub use indirect::Indirect;
pub use invalid::{InvalidValue, Parameter};
pub use lights::{DirectionalLight, Lamp, Light};
pub use look::Look;
pub use material::{Coefficients, Finish, Glass, Material, Pattern, Rough, Shine, Weight};
pub use picture_file::PictureFile;
pub use sampling::{Depth, Lens, Samples, Shutter, Tone};
pub use screen::Screen;
pub use shapes::{Instance, Mesh, Object, Placement, Source};
pub use sky::{Sky, SkyColors, SkyTurn};
pub use vector::unit;

pub(crate) use camera::{ORTHOCAMERA, unsquashed};
pub(crate) use clause::{Clauses, MATERIAL};
pub(crate) use image::{AXES, MAPS};
pub(crate) use invalid::{Faults, Lint};
pub(crate) use sampling::FrameNumbers;
pub(crate) use shapes::{
    FLAT, FONT, MESH, TEXT, USE, align_from_word, letter_plate, letter_surface, mesh_surface, with_shapes,
};
pub(crate) use vector::PARALLEL;

use crate::shared_slice::SharedSlice;

/// The complete input of a frame's rendering.
///
/// Objects and lights are shared, so that a script of many frames that adds to one scene does not copy it.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// The size of the image.
    pub screen: Screen,
    /// The camera that generates the rays.
    pub camera: Camera,
    /// The colour of rays that hit nothing. If there is a sky, only whether camera rays see no background.
    pub background: Background,
    /// The light of rays that hit nothing, in place of the background's colours.
    pub sky: Option<Sky>,
    /// The objects in the order of the script: of hits at the same distance, the first object wins.
    pub objects: SharedSlice<Object>,
    /// The lights in the order of the script, which is the order of summation.
    pub lights: SharedSlice<Light>,
    /// The number of rays per pixel.
    pub samples: Samples,
    /// Whether the only rough objects are hidden at the moment, so that none of them is visible.
    pub hides_rough: bool,
    /// The exposure time of a frame.
    pub shutter: Shutter,
    /// The shortest time between two neighbouring keys of a curve while the shutter is open, in frames, if a few moments can
    /// miss what happens between them. It is known in the middle of an exposure alone.
    pub shortest_step: Option<f64>,
    /// The conversion of colours to levels.
    pub tone: Tone,
    /// The largest number of bounces.
    pub depth: Depth,
    /// The largest number of diffuse reflections of a ray.
    pub indirect: Indirect,
    /// The lens of the camera.
    pub lens: Lens,
    /// The fog that rays go through.
    pub fog: Fog,
}

impl Scene {
    /// Makes an empty scene with a black background.
    pub fn new(screen: Screen, camera: Camera) -> Self {
        Self {
            screen,
            camera,
            background: Background::default(),
            sky: None,
            objects: SharedSlice::default(),
            lights: SharedSlice::default(),
            samples: Samples::default(),
            hides_rough: false,
            shutter: Shutter::default(),
            shortest_step: None,
            tone: Tone::default(),
            depth: Depth::default(),
            indirect: Indirect::default(),
            lens: Lens::default(),
            fog: Fog::default(),
        }
    }

    /// Returns how many diffuse reflections a ray of the picture follows: none in a picture of one ray per pixel.
    pub fn indirect_bounces(&self) -> u32 {
        if self.samples.most() > 1 { self.indirect.bounces() } else { 0 }
    }

    /// Returns whether light goes round in the picture. Then no ray's colour is clamped, and no ray is left out because
    /// its factor is small.
    pub fn goes_round(&self) -> bool {
        self.samples.most() > 1 && (self.indirect.bounces() > 0 || self.hides_rough || self.shows_rough())
    }

    /// Returns whether an object that is not hidden is rough.
    pub(crate) fn shows_rough(&self) -> bool {
        let is_rough = |object: &Object| object.material().finish().is_some_and(|f| f.rough.is_some());
        self.objects.iter().any(is_rough)
    }

    /// Returns the colours of rays that hit nothing: those of the sky, of the background, or of the fog, which hides
    /// both. The picture of a sky is not included ([`Self::sky_picture`]).
    pub fn surroundings(&self) -> Background {
        match (self.fog.get(), &self.sky) {
            (Some((color, _)), _) => Background::of_fog(color),
            (None, Some(Sky::Colors(colors))) => colors.background(),
            (None, _) => self.background,
        }
    }

    /// Returns the picture for rays that hit nothing, unless fog hides it.
    pub fn sky_picture(&self) -> Option<(&PictureFile, SkyTurn)> {
        match (&self.sky, self.fog.get()) {
            (Some(Sky::Picture(file, turn)), None) => Some((file, *turn)),
            _ => None,
        }
    }

    /// Returns the colour of all rays that hit nothing, or `None` if it depends on their direction.
    pub fn one_color(&self) -> Option<DVec3> {
        self.surroundings().color().filter(|_| self.sky_picture().is_none())
    }

    /// Sets the background; each channel is clamped to 0..=1.
    ///
    /// # Errors
    /// Fails if a channel is not finite.
    pub fn set_background(&mut self, color: DVec3) -> Result<(), InvalidValue> {
        self.background = Background::new(color)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_background_is_clamped_and_finite() {
        let mut scene = Scene::new(Screen::new(1, 1).unwrap(), Camera::default());
        scene.set_background(DVec3::new(-1.0, 0.5, 7.0)).unwrap();
        assert_eq!(scene.background.color(), Some(DVec3::new(0.0, 0.5, 1.0)));
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let fault = scene.set_background(DVec3::new(0.0, bad, 0.0));
            assert_eq!(fault, Err(InvalidValue::NotFinite(Parameter::Background)));
        }
        assert_eq!(scene.background.along(DVec3::X).y, 0.5, "what stood before stays");
    }
}
