//! The origin and direction of the rays of pixels, in the coordinates of [`geometry`](super::geometry), in `f64`.

use glam::DVec3;
use rayfold_scene::{Camera, Scene, Screen};

use crate::camera::{Axis, Single, grid, look_grid};

/// Where the rays of the pixels come from.
#[derive(Clone, Copy, Debug)]
pub(super) enum View {
    /// The eye is the origin; `right`, `up` and `back` are orthonormal. The ray of column `i` and row `j` (from the
    /// bottom) goes along `x.at(i)·right + y.at(j)·up - back`.
    Pinhole { right: DVec3, up: DVec3, back: DVec3, x: Axis, y: Axis },
    /// The ray starts at `corner + (i·pixel, j·pixel, 0)` and goes along `(0, 0, -1)`.
    Parallel { corner: DVec3, pixel: f64 },
}

/// The middle of the picture of a parallel view, in pixels.
pub(super) fn middle(screen: Screen) -> DVec3 {
    DVec3::new(f64::from(screen.width()), f64::from(screen.height()), 0.0) / 2.0
}

/// Where the rays of a scene's pixels come from, in lengths of `scale`.
pub(super) fn view(scene: &Scene, scale: f64) -> View {
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
