//! Angles about the axes, as circles in the picture with handles.
//!
//! The angles are those of a `Use`: first about x, then about y, then about z, of the world. So a change of
//! the last angle rotates about the world's z axis, and a change of an earlier one about an axis that the
//! later ones have rotated.

use std::fmt::Write;

use glam::{DMat3, DVec2, DVec3};

use crate::view::Projection;

/// The smallest step of an angle, in degrees.
pub(crate) const STEP: f64 = 1.0;

/// The step of an angle that snaps, in degrees.
pub(crate) const SNAP: f64 = 15.0;

/// The radius of the circles, in lengths of an arrow.
pub(crate) const RADIUS: f64 = 0.8;

/// The distance of a scale's handle to the right and upwards, in lengths of an arrow.
pub(crate) const SCALE: f64 = 0.75;

/// The number of line segments of a circle.
const PIECES: u32 = 48;

/// The sine of the smallest angle between a pointer's ray and the plane of rotation at which the rotation follows the
/// plane. At smaller angles, it follows the angle in the picture.
const SLANTED: f64 = 0.15;

/// Returns the axis about which a change of angle `axis` rotates, and a perpendicular direction that rotates with it.
pub(crate) fn frame(degrees: DVec3, axis: usize) -> (DVec3, DVec3) {
    let [x, y, z] = degrees.to_array().map(f64::to_radians);
    let about_z = DMat3::from_rotation_z(z);
    let about_y = about_z * DMat3::from_rotation_y(y);
    match axis {
        2 => (DVec3::Z, about_z * DVec3::X),
        1 => (about_z * DVec3::Y, about_y * DVec3::Z),
        _ => (about_y * DVec3::X, about_y * DMat3::from_rotation_x(x) * DVec3::Y),
    }
}

/// Returns the circle along which the handle of an angle moves, as an SVG path, without the part behind the eye.
pub(crate) fn circle(
    projection: &Projection,
    center: DVec3,
    degrees: DVec3,
    axis: usize,
    radius: f64,
) -> String {
    let (about, reference) = frame(degrees, axis);
    let across = about.cross(reference);
    let mut path = String::new();
    let mut is_open = false;
    for piece in 0..=PIECES {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(piece) / f64::from(PIECES)).sin_cos();
        let point = projection.point(center + radius * (cos * reference + sin * across));
        if let Some(at) = point {
            // Writing to a string cannot fail.
            let _ = write!(path, "{}{:.1} {:.1}", if is_open { 'L' } else { 'M' }, at.x, at.y);
        }
        is_open = point.is_some();
    }
    path
}

/// Returns the degrees by which the pointer rotates about an axis, above -180 and up to 180, or `None` if it
/// is at the axis.
pub(crate) fn angle(
    projection: &Projection,
    center: DVec3,
    about: DVec3,
    from: DVec2,
    to: DVec2,
) -> Option<f64> {
    if from == to {
        return Some(0.0);
    }
    let (_, _, toward) = projection.axes();
    let meet = |at: DVec2| {
        let (origin, direction) = projection.ray(at);
        let slope = direction.dot(about);
        let distance = (center - origin).dot(about) / slope;
        let is_plain = slope.abs() > SLANTED && distance > 0.0;
        is_plain.then(|| origin + distance * direction - center)
    };
    let radians = match (meet(from), meet(to)) {
        (Some(from), Some(to)) => about.dot(from.cross(to)).atan2(from.dot(to)),
        _ => {
            let middle = projection.point(center)?;
            let (from, to) = (from - middle, to - middle);
            // Rows count downwards, so counterclockwise is negative.
            let seen = -from.perp_dot(to).atan2(from.dot(to));
            if about.dot(toward) < 0.0 { -seen } else { seen }
        }
    };
    radians.is_finite().then(|| radians.to_degrees())
}

/// Returns the angle that differs by whole turns and is nearest to the previous one.
pub(crate) fn nearest_turn(angle: f64, before: f64) -> f64 {
    angle + 360.0 * ((before - angle) / 360.0).round()
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Object, parse};

    use super::*;

    /// Returns the position of a point after the tracer's group has rotated it by these angles.
    fn placed(degrees: DVec3, point: DVec3) -> DVec3 {
        let text = format!(
            "Screen 2 2\nGroup a\nSphere 1 0 0 0 1 1 1 0 0 0\nEnd\nUse a 0 0 0 {} {} {}\nTrace",
            degrees.x, degrees.y, degrees.z
        );
        let scene = parse("a", text.as_bytes(), &Default::default()).script.unwrap().frame(0).unwrap();
        let Object::Instance(instance) = &scene.objects[0] else { panic!("a group is drawn") };
        instance.placement().point(point)
    }

    #[test]
    fn a_change_of_an_angle_turns_about_its_axis() {
        let degrees = DVec3::new(20.0, -70.0, 130.0);
        let point = DVec3::new(0.3, -0.5, 0.8);
        for axis in 0..3 {
            let (about, reference) = frame(degrees, axis);
            assert!(about.dot(reference).abs() < 1e-12 && (about.length() - 1.0).abs() < 1e-12);
            let mut turned = degrees;
            turned[axis] += 33.0;
            let expected = DMat3::from_axis_angle(about, 33f64.to_radians()) * placed(degrees, point);
            assert!(placed(turned, point).distance(expected) < 1e-9, "{axis}");
            let (_, moved) = frame(turned, axis);
            assert!((moved.angle_between(reference).to_degrees() - 33.0).abs() < 1e-6);
        }
    }

    #[test]
    fn turns_go_on() {
        assert_eq!(nearest_turn(-170.0, 175.0), 190.0);
        assert_eq!(nearest_turn(10.0, 350.0), 370.0);
        assert_eq!(nearest_turn(10.0, 0.0), 10.0);
    }
}
