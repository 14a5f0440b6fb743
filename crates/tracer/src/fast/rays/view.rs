//! The origins and directions of the rays of pixels, in the coordinates of [`geometry`](crate::fast::placement::geometry), in `f64`.

use glam::DVec3;
use rayfold_scene::{Camera, Scene, Screen};

use crate::camera::{Axis, Single, grid, look_grid};

/// The rays of the pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) enum View {
    /// A perspective camera. The eye is the origin; `right`, `up` and `back` are orthonormal. The ray of column `i` and
    /// row `j` (from the bottom) goes along `x.at(i)·right + y.at(j)·up - back`.
    Pinhole { right: DVec3, up: DVec3, back: DVec3, x: Axis, y: Axis },
    /// A parallel projection. The ray starts at `corner + (i·pixel, j·pixel, 0)` and goes along `(0, 0, -1)`.
    Parallel { corner: DVec3, pixel: f64 },
}

/// Returns the centre of the picture of a parallel view, in pixels.
pub(crate) fn middle(screen: Screen) -> DVec3 {
    DVec3::new(f64::from(screen.width()), f64::from(screen.height()), 0.0) / 2.0
}

/// Returns the rays of a scene's pixels, with lengths multiplied by `scale`.
pub(crate) fn view(scene: &Scene, scale: f64) -> View {
    match &scene.camera {
        Camera::Orthographic => View::Parallel { corner: -middle(scene.screen) * scale, pixel: scale },
        Camera::Pinhole(pinhole) => {
            let (right, up, back) = pinhole.basis();
            let from = pinhole.lower_left() / pinhole.distance();
            let to = pinhole.upper_right() / pinhole.distance();
            let (x, y) = grid(from, to, scene.screen, Single::of(scene));
            View::Pinhole { right, up, back, x, y }
        }
        Camera::Look(look) => {
            let (right, up, back) = look.basis();
            let (x, y) = look_grid(look, scene.screen);
            View::Pinhole { right, up, back, x, y }
        }
    }
}
