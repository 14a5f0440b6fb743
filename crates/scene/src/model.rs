//! The typed scene: what a `Trace` command renders.
//!
//! A bad value cannot be built: every type with a condition has private fields, a constructor that checks it and
//! accessors. Lengths are world units, colours are display values (0 black, 1 white, unclamped), positions and
//! directions are right-handed with y up on the screen. All numbers are finite.

use std::sync::Arc;

use glam::{DVec2, DVec3};

/// Why a value cannot be part of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidValue {
    /// A component is infinite or not a number.
    #[error("{0} must be finite")]
    NotFinite(&'static str),
    /// A length that must be positive is zero or negative.
    #[error("{0} must be greater than zero")]
    NotPositive(&'static str),
    /// A direction has no length.
    #[error("{0} must not be zero")]
    ZeroDirection(&'static str),
    /// Gaze and view-up span no plane.
    #[error("gaze and up must not be parallel")]
    GazeParallelToUp,
    /// The window has no width or no height.
    #[error("the window must not be empty: {0}")]
    EmptyWindow(&'static str),
    /// The image has no pixels.
    #[error("{0} must be at least 1")]
    NoPixels(&'static str),
}

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
    pub objects: Arc<Vec<Object>>,
    /// In the order of the script, which is the order of summation.
    pub lights: Arc<Vec<Light>>,
}

impl Scene {
    /// An empty scene on a black background.
    pub fn new(screen: Screen, camera: Camera) -> Self {
        Self { screen, camera, background: DVec3::ZERO, objects: Arc::default(), lights: Arc::default() }
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
        self.background = finite("background", color)?.clamp(DVec3::ZERO, DVec3::ONE);
        Ok(())
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
            return Err(InvalidValue::NoPixels("nx"));
        }
        if height == 0 {
            return Err(InvalidValue::NoPixels("ny"));
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

/// Where the ray of a pixel starts and where it goes.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Camera {
    /// The ray of column i, row j (from the bottom) starts at (i, j, 0) and goes (0, 0, -1).
    #[default]
    Orthographic,
    /// All rays start at the eye.
    Pinhole(Pinhole),
}

/// A pinhole camera: the window lies at a distance in front of the eye, square to the gaze.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pinhole {
    eye: DVec3,
    gaze: DVec3,
    up: DVec3,
    distance: f64,
    lower_left: DVec2,
    upper_right: DVec2,
}

impl Pinhole {
    /// `eye` is a position, `gaze` and `up` directions of any length, `distance` that of the window from the eye;
    /// `lower_left` (au, av) and `upper_right` (bu, bv) are the window's corners in its own plane. A window whose
    /// corners are swapped mirrors the image.
    ///
    /// # Errors
    /// When a number is not finite, gaze or up is zero, the two are parallel, the distance is not positive, or the
    /// window is empty.
    pub fn new(
        eye: DVec3,
        gaze: DVec3,
        up: DVec3,
        distance: f64,
        lower_left: DVec2,
        upper_right: DVec2,
    ) -> Result<Self, InvalidValue> {
        finite("eye", eye)?;
        direction("gaze", gaze)?;
        direction("up", up)?;
        positive("window distance s", distance)?;
        finite("window corner au, av", lower_left.extend(0.0))?;
        finite("window corner bu, bv", upper_right.extend(0.0))?;
        if lower_left.x == upper_right.x {
            return Err(InvalidValue::EmptyWindow("au equals bu"));
        }
        if lower_left.y == upper_right.y {
            return Err(InvalidValue::EmptyWindow("av equals bv"));
        }
        if unit(up).cross(unit(gaze)).length() < PARALLEL {
            return Err(InvalidValue::GazeParallelToUp);
        }
        Ok(Self { eye, gaze, up, distance, lower_left, upper_right })
    }

    /// Where the rays start.
    pub fn eye(&self) -> DVec3 {
        self.eye
    }

    /// Direction of the gaze, of any length.
    pub fn gaze(&self) -> DVec3 {
        self.gaze
    }

    /// View-up, of any length.
    pub fn up(&self) -> DVec3 {
        self.up
    }

    /// Distance of the window from the eye, greater than zero.
    pub fn distance(&self) -> f64 {
        self.distance
    }

    /// The window's lower-left corner (au, av).
    pub fn lower_left(&self) -> DVec2 {
        self.lower_left
    }

    /// The window's upper-right corner (bu, bv).
    pub fn upper_right(&self) -> DVec2 {
        self.upper_right
    }

    /// The orthonormal frame (u, v, w): u to the right, v up, w against the gaze.
    ///
    /// w = -g/|g|, u = (up x w)/|up x w|, v = w x u.
    pub fn basis(&self) -> (DVec3, DVec3, DVec3) {
        let w = -unit(self.gaze);
        let u = unit(unit(self.up).cross(w));
        (u, w.cross(u), w)
    }
}

/// Below this sine the angle between two unit vectors is lost in the rounding of their cross product.
const PARALLEL: f64 = 4.0 * f64::EPSILON;

/// Something that a ray can hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Object {
    /// A sphere.
    Sphere(Sphere),
    /// A triangle.
    Triangle(Triangle),
    /// An axis-aligned box.
    Cuboid(Cuboid),
}

impl Object {
    /// How its surface answers light.
    pub fn material(&self) -> &Material {
        match self {
            Self::Sphere(o) => &o.material,
            Self::Triangle(o) => &o.material,
            Self::Cuboid(o) => &o.material,
        }
    }
}

/// A sphere of positive radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    radius: f64,
    center: DVec3,
    material: Material,
}

impl Sphere {
    /// # Errors
    /// When the radius is not positive or a number is not finite.
    pub fn new(radius: f64, center: DVec3, material: Material) -> Result<Self, InvalidValue> {
        positive("radius", radius)?;
        finite("centre", center)?;
        Ok(Self { radius, center, material })
    }

    /// Greater than zero.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Its middle.
    pub fn center(&self) -> DVec3 {
        self.center
    }

    /// How its surface answers light.
    pub fn material(&self) -> &Material {
        &self.material
    }
}

/// A two-sided triangle; one of no area is allowed and never hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    vertices: [DVec3; 3],
    material: Material,
}

impl Triangle {
    /// # Errors
    /// When a number is not finite.
    pub fn new(vertices: [DVec3; 3], material: Material) -> Result<Self, InvalidValue> {
        finite("vertex u", vertices[0])?;
        finite("vertex v", vertices[1])?;
        finite("vertex w", vertices[2])?;
        Ok(Self { vertices, material })
    }

    /// u, v, w in the order of the script.
    pub fn vertices(&self) -> &[DVec3; 3] {
        &self.vertices
    }

    /// How its surface answers light.
    pub fn material(&self) -> &Material {
        &self.material
    }
}

/// An axis-aligned box, closed: its faces, edges and corners belong to it. One without thickness is a rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cuboid {
    corners: [DVec3; 2],
    material: Material,
}

impl Cuboid {
    /// From any two opposite corners.
    ///
    /// # Errors
    /// When a number is not finite.
    pub fn new(corners: [DVec3; 2], material: Material) -> Result<Self, InvalidValue> {
        finite("corner u", corners[0])?;
        finite("corner v", corners[1])?;
        Ok(Self { corners, material })
    }

    /// The two corners as the script gave them.
    pub fn corners(&self) -> &[DVec3; 2] {
        &self.corners
    }

    /// The corner with the smallest coordinates.
    pub fn min(&self) -> DVec3 {
        self.corners[0].min(self.corners[1])
    }

    /// The corner with the largest coordinates.
    pub fn max(&self) -> DVec3 {
        self.corners[0].max(self.corners[1])
    }

    /// How its surface answers light.
    pub fn material(&self) -> &Material {
        &self.material
    }
}

/// Coefficients of a surface, a channel each; any finite numbers.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Material {
    ambient: DVec3,
    diffuse: DVec3,
    mirror: DVec3,
}

impl Material {
    /// # Errors
    /// When a number is not finite.
    pub fn new(ambient: DVec3, diffuse: DVec3, mirror: DVec3) -> Result<Self, InvalidValue> {
        finite("ambient coefficient", ambient)?;
        finite("diffuse coefficient", diffuse)?;
        finite("mirror coefficient", mirror)?;
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
}

/// Something that lights the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// A light at infinity.
    Directional(DirectionalLight),
}

/// A light at infinity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionalLight {
    color: DVec3,
    direction: DVec3,
}

impl DirectionalLight {
    /// `direction` is the one in which the light travels, of any length but zero.
    ///
    /// # Errors
    /// When the direction is zero or a number is not finite.
    pub fn new(color: DVec3, direction: DVec3) -> Result<Self, InvalidValue> {
        finite("light colour", color)?;
        self::direction("light direction", direction)?;
        Ok(Self { color, direction })
    }

    /// Its colour, any finite numbers.
    pub fn color(&self) -> DVec3 {
        self.color
    }

    /// The direction in which it travels, of any length but zero.
    pub fn direction(&self) -> DVec3 {
        self.direction
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

fn finite(name: &'static str, v: DVec3) -> Result<DVec3, InvalidValue> {
    if v.is_finite() { Ok(v) } else { Err(InvalidValue::NotFinite(name)) }
}

fn positive(name: &'static str, x: f64) -> Result<f64, InvalidValue> {
    if !x.is_finite() {
        Err(InvalidValue::NotFinite(name))
    } else if x > 0.0 {
        Ok(x)
    } else {
        Err(InvalidValue::NotPositive(name))
    }
}

fn direction(name: &'static str, v: DVec3) -> Result<DVec3, InvalidValue> {
    finite(name, v)?;
    if v == DVec3::ZERO { Err(InvalidValue::ZeroDirection(name)) } else { Ok(v) }
}
