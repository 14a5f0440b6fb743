//! The typed scene: what a `Trace` command renders.
//!
//! A bad value cannot be built: every type with a condition has private fields, a constructor that checks it and
//! accessors. Lengths are world units, colours are display values (0 black, 1 white, unclamped), positions and
//! directions are right-handed with y up on the screen. All numbers are finite.

use std::fmt;

use glam::{DVec2, DVec3, Vec3Swizzles};

use crate::shared_slice::SharedSlice;

/// Why a value cannot be part of a scene or of an animation's settings.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum InvalidValue {
    /// A component is infinite or not a number.
    #[error("{0} must be finite")]
    NotFinite(Parameter),
    /// A length that must be positive is zero or negative.
    #[error("{0} must be greater than zero")]
    NotPositive(Parameter),
    /// A direction has no length.
    #[error("{0} must not be zero")]
    ZeroDirection(Parameter),
    /// Gaze and view-up span no plane.
    #[error("the gaze and the view-up must not be parallel")]
    GazeParallelToUp,
    /// The window has no width: au equals bu.
    #[error("the window must not be empty: au equals bu")]
    EmptyWindowWidth,
    /// The window has no height: av equals bv.
    #[error("the window must not be empty: av equals bv")]
    EmptyWindowHeight,
    /// A count is zero.
    #[error("{0} must be at least 1")]
    Zero(Parameter),
    /// A number lies outside the range that makes sense for it.
    #[error("{0} must be from {1} to {2}")]
    OutOfRange(Parameter, f64, f64),
    /// A triangle or a box was given a mirror coefficient, which the language has for spheres only.
    #[error("only a sphere can have a mirror coefficient")]
    MirrorOnFlat,
}

/// What an [`InvalidValue`] is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// nx of `Screen`.
    ScreenWidth,
    /// ny of `Screen`.
    ScreenHeight,
    /// Colour of a ray that hits nothing.
    Background,
    /// Where the rays of a pinhole camera start.
    Eye,
    /// Direction of the camera's gaze.
    Gaze,
    /// The camera's view-up.
    Up,
    /// Distance of the camera's window from the eye.
    WindowDistance,
    /// Corner (au, av) or (bu, bv) of the camera's window.
    WindowCorner,
    /// Radius of a sphere.
    Radius,
    /// Centre of a sphere.
    Center,
    /// A corner of a triangle.
    Vertex,
    /// A corner of a box.
    Corner,
    /// What a surface shows without light.
    Ambient,
    /// What a surface scatters.
    Diffuse,
    /// What a surface mirrors.
    Mirror,
    /// Colour of a light.
    LightColor,
    /// The direction in which a light travels.
    LightDirection,
    /// How many frames an animation waits for.
    FrameCount,
    /// Frames a second.
    FrameRate,
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ScreenWidth => "the width nx",
            Self::ScreenHeight => "the height ny",
            Self::Background => "the background",
            Self::Eye => "the eye",
            Self::Gaze => "the gaze",
            Self::Up => "the view-up",
            Self::WindowDistance => "the window's distance s",
            Self::WindowCorner => "the window's corner",
            Self::Radius => "the radius",
            Self::Center => "the centre",
            Self::Vertex => "the vertex",
            Self::Corner => "the corner",
            Self::Ambient => "the ambient coefficient",
            Self::Diffuse => "the diffuse coefficient",
            Self::Mirror => "the mirror coefficient",
            Self::LightColor => "the light's colour",
            Self::LightDirection => "the light's direction",
            Self::FrameCount => "`frames`",
            Self::FrameRate => "`fps`",
        })
    }
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
        Self::checked(eye, gaze, up, distance, lower_left, upper_right).map_err(|faults| faults[0])
    }

    /// As [`Pinhole::new`], but says everything that is wrong.
    pub(crate) fn checked(
        eye: DVec3,
        gaze: DVec3,
        up: DVec3,
        distance: f64,
        lower_left: DVec2,
        upper_right: DVec2,
    ) -> Result<Self, Vec<InvalidValue>> {
        let (a, b) = (lower_left, upper_right);
        let gaze_and_up = [direction(Parameter::Gaze, gaze), direction(Parameter::Up, up)];
        let parallel =
            gaze_and_up.iter().all(Result::is_ok) && unit(up).cross(unit(gaze)).length() < PARALLEL;
        let faults: Vec<_> = gaze_and_up
            .into_iter()
            .chain([
                finite(Parameter::Eye, eye),
                positive(Parameter::WindowDistance, distance).map(|_| eye),
                finite(Parameter::WindowCorner, a.extend(0.0)),
                finite(Parameter::WindowCorner, b.extend(0.0)),
            ])
            .filter_map(Result::err)
            .chain(parallel.then_some(InvalidValue::GazeParallelToUp))
            .chain((a.x == b.x).then_some(InvalidValue::EmptyWindowWidth))
            .chain((a.y == b.y).then_some(InvalidValue::EmptyWindowHeight))
            .collect();
        if faults.is_empty() {
            Ok(Self { eye, gaze, up, distance, lower_left, upper_right })
        } else {
            Err(faults)
        }
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
        positive(Parameter::Radius, radius)?;
        finite(Parameter::Center, center)?;
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
    /// When a number is not finite or the material mirrors.
    pub fn new(vertices: [DVec3; 3], material: Material) -> Result<Self, InvalidValue> {
        finite(Parameter::Vertex, vertices[0])?;
        finite(Parameter::Vertex, vertices[1])?;
        finite(Parameter::Vertex, vertices[2])?;
        matte(&material)?;
        Ok(Self { vertices, material })
    }

    /// Whether it has no area: its vertices lie on a line or coincide, decided exactly.
    pub fn is_degenerate(&self) -> bool {
        let [u, v, w] = self.vertices;
        // Each axis gets a power of two of its own, which keeps points on a line on a line, so that the products of
        // the predicate neither overflow nor vanish.
        let scale = u.abs().max(v.abs()).max(w.abs()).map(to_unit_scale);
        let [u, v, w] = [u, v, w].map(|p| p * scale);
        let area = |x: fn(DVec3) -> DVec2| {
            let [a, b, c] = [x(u), x(v), x(w)].map(|p| robust::Coord { x: p.x, y: p.y });
            robust::orient2d(a, b, c)
        };
        area(|p| p.truncate()) == 0.0 && area(|p| p.zy()) == 0.0 && area(|p| p.xz()) == 0.0
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
    /// When a number is not finite or the material mirrors.
    pub fn new(corners: [DVec3; 2], material: Material) -> Result<Self, InvalidValue> {
        finite(Parameter::Corner, corners[0])?;
        finite(Parameter::Corner, corners[1])?;
        matte(&material)?;
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
        finite(Parameter::LightColor, color)?;
        self::direction(Parameter::LightDirection, direction)?;
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

fn finite(name: Parameter, v: DVec3) -> Result<DVec3, InvalidValue> {
    if v.is_finite() { Ok(v) } else { Err(InvalidValue::NotFinite(name)) }
}

fn positive(name: Parameter, x: f64) -> Result<f64, InvalidValue> {
    if !x.is_finite() {
        Err(InvalidValue::NotFinite(name))
    } else if x > 0.0 {
        Ok(x)
    } else {
        Err(InvalidValue::NotPositive(name))
    }
}

fn matte(material: &Material) -> Result<(), InvalidValue> {
    if material.mirror == DVec3::ZERO { Ok(()) } else { Err(InvalidValue::MirrorOnFlat) }
}

fn direction(name: Parameter, v: DVec3) -> Result<DVec3, InvalidValue> {
    finite(name, v)?;
    if v == DVec3::ZERO { Err(InvalidValue::ZeroDirection(name)) } else { Ok(v) }
}
