//! The camera of the viewport (the script's or a free one), and the projection from the world to
//! its picture and back.
//!
//! Points of a picture are in its pixels, with (0, 0) at the upper left corner of the upper left one. A pinhole
//! camera's pixel (i, j) is the ray of the language through its middle.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec2, DVec3};
use rayfold_scene::{Camera, InvalidValue, Look, Pinhole, Scene};

/// The nearest and farthest distance of the free camera, in sizes of the target.
const NEAR_AND_FAR: (f64, f64) = (1e-3, 1e3);

/// The radians by which the free camera rotates when the pointer crosses the picture's height.
const TURN: f64 = PI;

/// An upright camera that rotates around its target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Orbit {
    /// The point that the camera looks at.
    pub(crate) target: DVec3,
    /// The distance from the target.
    pub(crate) distance: f64,
    /// Radians to the right from looking along -z.
    pub(crate) yaw: f64,
    /// Radians from above; a quarter turn looks straight down.
    pub(crate) pitch: f64,
    /// Half the vertical angle of view, in radians.
    pub(crate) half_fov: f64,
}

/// A bounding box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    /// The least coordinates.
    pub(crate) low: DVec3,
    /// The greatest coordinates.
    pub(crate) high: DVec3,
}

impl Bounds {
    /// Returns the bounds of points with a radius around each, or `None` without points.
    pub(crate) fn of(points: impl IntoIterator<Item = (DVec3, f64)>) -> Option<Self> {
        points.into_iter().map(|(p, r)| Self { low: p - r, high: p + r }).reduce(Self::with)
    }

    /// Returns the bounds of both boxes.
    pub(crate) fn with(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Returns the middle of the box.
    pub(crate) fn center(&self) -> DVec3 {
        0.5 * self.low + 0.5 * self.high
    }

    /// Returns half the diagonal, or 1 for a single point.
    pub(crate) fn radius(&self) -> f64 {
        let radius = (0.5 * self.high - 0.5 * self.low).length();
        if radius > 0.0 { radius } else { 1.0 }
    }
}

impl Orbit {
    /// Looks at all of `bounds` from a direction given by yaw and pitch.
    pub(crate) fn at(bounds: Bounds, yaw: f64, pitch: f64) -> Self {
        let half_fov = 0.35_f64;
        Self {
            target: bounds.center(),
            distance: 1.1 * bounds.radius() / half_fov.sin(),
            yaw,
            pitch,
            half_fov,
        }
    }

    /// Starts at the view of a script's camera. `bounds` are those of the scene.
    pub(crate) fn from_camera(camera: &Camera, bounds: Bounds) -> Self {
        let (eye, w, half_fov, target) = match camera {
            Camera::Orthographic => return Self::at(bounds, 0.0, 0.0),
            Camera::Pinhole(pinhole) => {
                let half = pinhole.lower_left().y.abs().max(pinhole.upper_right().y.abs());
                (pinhole.eye(), pinhole.basis().2, (half / pinhole.distance()).atan(), bounds.center())
            }
            Camera::Look(look) => {
                (look.eye(), look.basis().2, 0.5 * look.field_of_view().to_radians(), look.target())
            }
        };
        let along = (target - eye).dot(-w);
        let distance = if along > 0.0 { along } else { bounds.radius() };
        Self {
            target: eye - w * distance,
            distance,
            yaw: w.x.atan2(w.z),
            pitch: w.y.clamp(-1.0, 1.0).asin(),
            half_fov,
        }
    }

    /// Returns the unit vector from the target to the eye.
    fn backward(&self) -> DVec3 {
        let (sin, cos) = self.pitch.sin_cos();
        DVec3::new(cos * self.yaw.sin(), sin, cos * self.yaw.cos())
    }

    fn up(&self) -> DVec3 {
        let (sin, cos) = self.pitch.sin_cos();
        DVec3::new(-sin * self.yaw.sin(), cos, -sin * self.yaw.cos())
    }

    /// Turns the camera to another target, from its present position.
    pub(crate) fn aimed(self, target: DVec3) -> Self {
        let back = self.eye() - target;
        let distance = back.length();
        if !(distance.is_normal()) {
            return self;
        }
        let pitch = (back.y / distance).clamp(-1.0, 1.0).asin();
        Self { target, distance, yaw: back.x.atan2(back.z), pitch, ..self }
    }

    /// Looks at the same target from the opposite side.
    pub(crate) fn opposite(self) -> Self {
        Self { yaw: self.yaw + std::f64::consts::PI, pitch: -self.pitch, ..self }
    }

    /// Returns the position of the camera.
    pub(crate) fn eye(&self) -> DVec3 {
        self.target + self.distance * self.backward()
    }

    /// Converts to a camera of the language, for a picture whose width is `aspect` heights.
    ///
    /// # Errors
    /// Fails if its numbers are beyond the limits of a camera.
    pub(crate) fn camera(&self, aspect: f64) -> Result<Pinhole, InvalidValue> {
        let half = self.half_fov.tan();
        let corner = DVec2::new(half * aspect, half);
        Pinhole::new(self.eye(), -self.backward(), self.up(), 1.0, -corner, corner)
    }

    /// Rotates around the target; the distance is in heights of the picture.
    pub(crate) fn turn(&mut self, moved: DVec2) {
        self.yaw = (self.yaw - TURN * moved.x) % (2.0 * PI);
        self.pitch = (self.pitch + TURN * moved.y).clamp(-FRAC_PI_2, FRAC_PI_2);
    }

    /// Moves sideways, so that the target follows the pointer; the distance is in heights of the picture.
    pub(crate) fn pan(&mut self, moved: DVec2) {
        let height = 2.0 * self.distance * self.half_fov.tan();
        let right = self.up().cross(self.backward());
        self.target += height * (moved.y * self.up() - moved.x * right);
    }

    /// Multiplies the distance by a factor. `size` is that of the scene.
    pub(crate) fn zoom(&mut self, factor: f64, size: f64) {
        self.distance = (self.distance * factor).clamp(NEAR_AND_FAR.0 * size, NEAR_AND_FAR.1 * size);
    }
}

/// The projection from the world to the picture of a scene and back.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Projection<'a> {
    scene: &'a Scene,
}

impl<'a> Projection<'a> {
    /// Makes the projection of a scene. Its screen is the size of the picture.
    pub(crate) fn new(scene: &'a Scene) -> Self {
        Self { scene }
    }

    /// Returns the position of a point in the picture, or `None` behind the eye.
    pub(crate) fn point(&self, point: DVec3) -> Option<DVec2> {
        let (width, height) = self.size();
        let (i, j) = match &self.scene.camera {
            Camera::Orthographic => (point.x, point.y),
            Camera::Pinhole(pinhole) => {
                let (u, v, w) = pinhole.basis();
                let to = point - pinhole.eye();
                let depth = -to.dot(w);
                if depth <= 1e-9 * to.length() {
                    return None;
                }
                let on_window = DVec2::new(to.dot(u), to.dot(v)) * (pinhole.distance() / depth);
                let share =
                    (on_window - pinhole.lower_left()) / (pinhole.upper_right() - pinhole.lower_left());
                (share.x * (width - 1.0), share.y * (height - 1.0))
            }
            Camera::Look(look) => {
                let (u, v, w) = look.basis();
                let to = point - look.eye();
                let depth = -to.dot(w);
                if depth <= 1e-9 * to.length() {
                    return None;
                }
                let pixels = height / (slope(look) * depth);
                (0.5 * (to.dot(u) * pixels + width - 1.0), 0.5 * (to.dot(v) * pixels + height - 1.0))
            }
        };
        let seen = DVec2::new(i + 0.5, height - 0.5 - j);
        seen.is_finite().then_some(seen)
    }

    /// Returns the ray through a point of the picture: its origin and its unit direction.
    pub(crate) fn ray(&self, at: DVec2) -> (DVec3, DVec3) {
        let (_, height) = self.size();
        rayfold_tracer::pixel_ray(self.scene, at.x - 0.5, height - 0.5 - at.y)
    }

    /// Returns the extent of a pixel in the world at the depth of a point.
    pub(crate) fn pixel_at(&self, point: DVec3) -> f64 {
        let (_, height) = self.size();
        match &self.scene.camera {
            Camera::Orthographic => 1.0,
            Camera::Pinhole(pinhole) => {
                let (_, _, w) = pinhole.basis();
                let depth = (point - pinhole.eye()).dot(w).abs();
                let window = (pinhole.upper_right().y - pinhole.lower_left().y).abs();
                depth * window / (pinhole.distance() * (height - 1.0).max(1.0))
            }
            Camera::Look(look) => {
                let (_, _, w) = look.basis();
                (point - look.eye()).dot(w).abs() * 2.0 * slope(look) / height
            }
        }
    }

    /// Returns the unit vectors to the right, up and towards the eye.
    pub(crate) fn axes(&self) -> (DVec3, DVec3, DVec3) {
        match &self.scene.camera {
            Camera::Orthographic => (DVec3::X, DVec3::Y, DVec3::Z),
            Camera::Pinhole(pinhole) => pinhole.basis(),
            Camera::Look(look) => look.basis(),
        }
    }

    fn size(&self) -> (f64, f64) {
        (f64::from(self.scene.screen.width()), f64::from(self.scene.screen.height()))
    }
}

/// Returns the height of the view's upper edge above its middle, at distance 1.
fn slope(look: &Look) -> f64 {
    (0.5 * look.field_of_view().to_radians()).tan()
}

#[cfg(test)]
mod tests {
    use rayfold_scene::Screen;

    use super::*;

    fn bounds() -> Bounds {
        Bounds { low: DVec3::new(-1.0, 0.0, -3.0), high: DVec3::new(2.0, 4.0, 1.0) }
    }

    fn scene(orbit: &Orbit) -> Scene {
        Scene::new(Screen::new(160, 90).unwrap(), Camera::Pinhole(orbit.camera(16.0 / 9.0).unwrap()))
    }

    #[test]
    fn a_point_is_seen_where_its_ray_goes() {
        let mut orbit = Orbit::at(bounds(), 0.4, 0.3);
        for turned in 0..8 {
            orbit.turn(DVec2::new(0.3, 0.07 * f64::from(turned)));
            let scene = scene(&orbit);
            let projection = Projection::new(&scene);
            for at in [DVec2::new(0.5, 0.5), DVec2::new(80.0, 45.0), DVec2::new(159.5, 12.25)] {
                let (origin, direction) = projection.ray(at);
                let seen = projection.point(origin + 7.0 * direction).unwrap();
                assert!(seen.distance(at) < 1e-9, "{seen} {at}");
                assert_eq!(projection.point(origin - 7.0 * direction), None);
            }
        }
    }

    #[test]
    fn panning_follows_the_pointer_and_straight_down_is_no_hole() {
        let mut orbit = Orbit::at(bounds(), 1.0, FRAC_PI_2);
        let target = orbit.target;
        orbit.pan(DVec2::new(0.25, -0.125));
        let scene = scene(&orbit);
        let moved = Projection::new(&scene).point(target).unwrap() - DVec2::new(80.0, 45.0);
        assert!((moved - DVec2::new(22.5, -11.25)).length() < 0.6, "{moved}");
    }

    #[test]
    fn a_free_camera_goes_on_from_that_of_the_script() {
        let orbit = Orbit::at(bounds(), -2.0, 0.7);
        let again = Orbit::from_camera(&scene(&orbit).camera, bounds());
        assert!(again.eye().distance(orbit.eye()) < 1e-9);
        assert!((again.half_fov - orbit.half_fov).abs() < 1e-12);
        assert!(again.backward().distance(orbit.backward()) < 1e-12);
    }
}
