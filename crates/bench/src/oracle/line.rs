//! Exact rays, and the ray of a pixel.

use glam::DVec3;
use rayfold_scene::{Camera, Look, Screen};

use super::real::{Real, Vector};

/// A ray. Its direction has any length but zero.
#[derive(Clone, Debug)]
pub struct Line {
    /// The start of the ray.
    pub origin: Vector,
    /// The direction of the ray.
    pub direction: Vector,
}

impl Line {
    /// Returns the ray of a pixel, by the formulas of the language reference. Indices may be fractions.
    pub(super) fn of_pixel(camera: &Camera, screen: Screen, x: f64, y: f64) -> Self {
        let pinhole = match camera {
            Camera::Orthographic => {
                return Self { origin: DVec3::new(x, y, 0.0).into(), direction: DVec3::NEG_Z.into() };
            }
            Camera::Look(look) => return Self::of_look(look, screen, x, y),
            Camera::Pinhole(pinhole) => pinhole,
        };
        let w = Vector::from(pinhole.gaze()).opposite().unit();
        let u = Vector::from(pinhole.up()).cross(&w).unit();
        let v = w.cross(&u);
        let along = |from: f64, to: f64, index: f64, count: u32| {
            let (from, to) = (Real::from(from), Real::from(to));
            // A single sample is at the centre. The distance to its neighbours is that of an image of 1,000 pixels.
            let (index, last) =
                if count == 1 { (index + 500.0, 1000.0) } else { (index, f64::from(count - 1)) };
            let part = Real::from(index).over(&Real::from(last));
            &from + &(&(&to - &from) * &part)
        };
        let (a, b) = (pinhole.lower_left(), pinhole.upper_right());
        let across = along(a.x, b.x, x, screen.width());
        let upward = along(a.y, b.y, y, screen.height());
        let nowhere = Vector::from(DVec3::ZERO);
        let direction =
            nowhere.plus(&across, &u).plus(&upward, &v).plus(&-&Real::from(pinhole.distance()), &w);
        Self { origin: pinhole.eye().into(), direction: direction.unit() }
    }

    fn of_look(look: &Look, screen: Screen, x: f64, y: f64) -> Self {
        let w = Vector::from(look.eye()).minus(&look.target().into()).unit();
        let u = Vector::from(look.up()).cross(&w).unit();
        let v = w.cross(&u);
        let (width, height) = (f64::from(screen.width()), f64::from(screen.height()));
        let slope = Real::tangent_of_half(look.field_of_view());
        // Indices and sizes are exact.
        let part = |index: f64, count: f64| {
            &slope * &Real::from(2.0 * index + 1.0 - count).over(&Real::from(height))
        };
        let direction = w.opposite().plus(&part(x, width), &u).plus(&part(y, height), &v);
        Self { origin: look.eye().into(), direction: direction.unit() }
    }

    /// Returns the point at the distance `t`, in units of the length of the direction.
    pub(super) fn at(&self, t: &Real) -> Vector {
        self.origin.plus(t, &self.direction)
    }
}
