//! The light of rays that hit nothing.

use std::f64::consts::PI;

use glam::DVec3;
use rayfold_scene::assets::Picture;
use rayfold_scene::{Scene, Sky, Tone};

/// Returns the light along a unit direction. Pictures have an error of some roundoffs of `f64`.
pub(crate) fn along(scene: &Scene, direction: DVec3) -> DVec3 {
    if let Some((fog, _)) = scene.fog.get() {
        return fog;
    }
    let height = 0.5 + 0.5 * direction.y;
    let gradient = |(low, high): (DVec3, Option<DVec3>)| low + (high.unwrap_or(low) - low) * height;
    match &scene.sky {
        None => gradient(scene.background.colors()),
        Some(Sky::Colors(colors)) => gradient(colors.colors()),
        Some(Sky::Picture(file, turn)) => {
            let picture = file.picture();
            // The longitude from -z towards +x, less the turn, which goes from -z towards -x.
            let longitude = direction.x.atan2(-direction.z) + turn.degrees().to_radians();
            let latitude = direction.y.clamp(-1.0, 1.0).asin();
            let at = [0.5 + longitude / (2.0 * PI), 0.5 - latitude / PI];
            let level = |column, row| picture.level(column, row, scene.tone == Tone::Srgb);
            turn.strength() * interpolated(picture, at, false, level)
        }
    }
}

/// Returns the interpolated value at a place, from (0, 0) in the upper left corner to (1, 1) in the lower right one.
pub(super) fn interpolated(
    picture: &Picture,
    [u, v]: [f64; 2],
    repeats_down: bool,
    value: impl Fn(u32, u32) -> DVec3,
) -> DVec3 {
    let (width, height) = (i64::from(picture.width()), i64::from(picture.height()));
    let v = if repeats_down { v.rem_euclid(1.0) } else { v };
    let (x, y) = (u.rem_euclid(1.0) * width as f64 - 0.5, v * height as f64 - 0.5);
    let mut sum = DVec3::ZERO;
    for (row, of_row) in shares(y) {
        let row = if repeats_down { row.rem_euclid(height) } else { row.clamp(0, height - 1) };
        for (column, share) in shares(x) {
            sum += of_row * share * value(column.rem_euclid(width) as u32, row as u32);
        }
    }
    sum
}

/// Returns the two pixels around a place, and their shares.
fn shares(place: f64) -> [(i64, f64); 2] {
    let before = place.floor();
    [(before as i64, before + 1.0 - place), (before as i64 + 1, place - before)]
}
