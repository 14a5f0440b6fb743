//! The handles that can be dragged, and the numbers that a drag changes: an object by its body, along an axis, by its
//! corners or its radius, and a light by its direction.
//!
//! Knows commands only by the kinds of their parameters. A position is a handle. A length is a handle at that
//! distance from the first position. A direction is the tip of an arrow. Angles and a scale have handles of
//! their own (`rotate_handles`), and so has the size of an object without a scale (`scale_handles`). Invariant: a drag is
//! computed from the state at its start, so returning to the start changes nothing.

use std::cell::Cell;

use glam::{DVec2, DVec3};
use rayfold_scene::{Command, Kind, Parameter};
use serde::{Deserialize, Serialize};

use crate::line::Line;
use crate::rotate_handles;
use crate::scale_handles;
use crate::snap_to_boxes::{Neighbours, Snap};
use crate::steps::{exactly, middle, rounded, shifted};
use crate::tables::{Role, fields, role};
use crate::values::{Keying, Values, changed};
use crate::view::Projection;

/// The length of an arrow in pixels of the picture.
const ARROW: f64 = 72.0;

/// The position of a plane's handle along its two axes, in arrows.
const PLANE: f64 = 0.35;

/// The sine of the smallest angle between the view direction and a plane at which objects can be dragged along the
/// plane. At smaller angles, a pixel would be a huge distance.
const SLANTED: f64 = 0.12;

/// The distance of a handle from the edge of its object in pixels, so that a finger can grab either.
const CLEAR: f64 = 24.0;

/// The length in pixels below which an arrow points at the viewer and is left out.
const POINTED: f64 = 8.0;

/// The smallest width of the snapping grid in pixels, and the distance at which objects are aligned.
const SNAP: f64 = 12.0;

/// The step of a drag that is aligned with another object, in steps of a free one.
const ALIGNED: f64 = 1e-4;

/// The kind of a handle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case", tag = "what")]
pub(crate) enum HandleKind {
    /// All selected lines, along the ground.
    Body,
    /// All selected lines, along an axis: 0 is x.
    Axis {
        /// The index of the axis.
        axis: usize,
    },
    /// All selected lines, along the plane across an axis: 0 is the plane of y and z.
    Plane {
        /// The index of the axis across the plane.
        axis: usize,
    },
    /// The position whose numbers begin here.
    Point {
        /// The index in the line's numbers, from 0.
        first: usize,
    },
    /// The length that is this number.
    Length {
        /// The index in the line's numbers, from 0.
        first: usize,
    },
    /// The direction whose numbers begin here.
    Direction {
        /// The index in the line's numbers, from 0.
        first: usize,
    },
    /// One of the angles whose numbers begin here.
    Turn {
        /// The index in the line's numbers, from 0.
        first: usize,
        /// The axis of the angle: 0 is x.
        axis: usize,
    },
    /// The whole line at a key of its motion path.
    Key {
        /// The frame of the key.
        frame: u32,
    },
    /// The scale that is this number.
    Scale {
        /// The index in the line's numbers, from 0.
        first: usize,
    },
    /// All positions and lengths, from the middle of the positions.
    Size,
}

/// A handle in the picture.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct Handle {
    /// The kind of the handle.
    pub(crate) grip: HandleKind,
    /// The index of its line in the script, from 0.
    pub(crate) line: usize,
    /// A description for screen readers.
    pub(crate) label: String,
    /// The position in pixels.
    pub(crate) at: [f64; 2],
    /// The start of the line to the handle, in pixels.
    pub(crate) from: [f64; 2],
    /// The path along which the handle moves, as an SVG path.
    #[serde(skip_serializing_if = "String::is_empty")]
    #[cfg_attr(test, ts(as = "Option<_>", optional))]
    pub(crate) way: String,
}

/// Returns the handles of a line with these values. `around` is the point where lights without a position are shown,
/// and `size` the radius of the drawn objects, if that is not in its numbers.
pub(crate) fn handles(
    number: usize,
    values: &Values,
    projection: &Projection,
    around: DVec3,
    size: Option<f64>,
) -> Vec<Handle> {
    let mut handles = Vec::new();
    let positions: Vec<_> = values.positions().collect();
    let is_camera = role(values.command) == Role::Camera;
    let (center, body) = if positions.is_empty() || is_camera {
        (around, 0.0)
    } else {
        let center = middle(&positions);
        let spread = positions.iter().map(|(_, at)| at.distance(center)).fold(0.0, f64::max);
        (center, size.unwrap_or(spread + values.reach()))
    };
    let edge = projection.point(center).map(|at| (at, body / projection.pixel_at(center) + CLEAR));
    // The body under the pointer is dragged, so no handle is in front of it.
    let outside = |grip: HandleKind, at: DVec2| {
        let Some((middle, least)) = edge.filter(|_| body > 0.0) else { return Some(at) };
        let off = at - middle;
        let is_arrow = matches!(grip, HandleKind::Axis { .. } | HandleKind::Plane { .. });
        match off.length() {
            length if length >= least => Some(at),
            length if is_arrow && length < POINTED => None,
            length if length < 1e-6 => Some(middle + least * DVec2::X),
            length => Some(middle + off * (least / length)),
        }
    };
    let mut add = |grip, from: DVec3, to: DVec3, label: &str, way: String| {
        let at = projection.point(to).and_then(|at| outside(grip, at));
        if let (Some(from), Some(at)) = (projection.point(from), at) {
            let label = format!("{} of {}", label, values.command.name());
            handles.push(Handle { grip, line: number, label, at: at.into(), from: from.into(), way });
        }
    };
    let straight = String::new;
    let anchor = values.positions().next().map_or(around, |(_, position)| position);
    let arrow = ARROW * projection.pixel_at(anchor);
    // A camera is moved by its eye, if that is seen.
    if !positions.is_empty() && (!is_camera || projection.point(anchor).is_some()) {
        let middle = if is_camera { anchor } else { middle(&positions) };
        // Beyond the handle of a radius.
        let arrow = arrow + body;
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            add(
                HandleKind::Axis { axis },
                middle,
                middle + arrow * DVec3::AXES[axis],
                &format!("along {name}: place"),
                straight(),
            );
        }
        let (_, _, w) = projection.axes();
        for (axis, names) in ["y and z", "x and z", "x and y"].into_iter().enumerate() {
            // A plane that is seen edge on is a line.
            if w[axis].abs() > SLANTED {
                let to = middle + PLANE * arrow * (DVec3::ONE - DVec3::AXES[axis]);
                add(HandleKind::Plane { axis }, middle, to, &format!("along {names}: place"), straight());
            }
        }
    }
    let mut lengths = 0;
    for (first, field) in fields(values.command) {
        let label = field.parameter.to_string();
        match field.kind {
            Kind::Position => {
                if let (Some(position), true) = (values.vector(first), positions.len() > 1) {
                    add(HandleKind::Point { first }, position, position, &label, straight());
                }
            }
            Kind::Length if !positions.is_empty() && !is_camera => {
                if let Some(length) = values.number(first) {
                    let at = anchor + length * toward(lengths, projection);
                    lengths += 1;
                    add(HandleKind::Length { first }, anchor, at, &label, straight());
                }
            }
            Kind::Direction => {
                if let Some(direction) = values.vector(first).and_then(DVec3::try_normalize) {
                    let tip = anchor + arrow * facing(values.command) * direction;
                    add(HandleKind::Direction { first }, anchor, tip, &label, straight());
                }
            }
            Kind::Rotation => {
                if let Some(degrees) = values.vector(first) {
                    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
                        let (about, reference) = rotate_handles::frame(degrees, axis);
                        // Around the body, as the arrows are. The handle is between two axes, whose arrows are elsewhere.
                        let radius = rotate_handles::RADIUS * (arrow + body);
                        let spoke = (reference - about.cross(reference)).normalize_or_zero();
                        let way = rotate_handles::circle(projection, anchor, degrees, axis, radius);
                        let label = format!("about {name}: {label}");
                        add(HandleKind::Turn { first, axis }, anchor, anchor + radius * spoke, &label, way);
                    }
                }
            }
            Kind::Plain if field.parameter == Parameter::Scale => {
                let (right, up, _) = projection.axes();
                let at = anchor + arrow * rotate_handles::SCALE * (right + up);
                add(HandleKind::Scale { first }, anchor, at, &label, straight());
            }
            Kind::Count(_)
            | Kind::Length
            | Kind::WindowPosition
            | Kind::Angle
            | Kind::Plain
            | Kind::Color
            | Kind::Coefficients
            | Kind::Error
            | Kind::Word => {}
        }
    }
    if scale_handles::is_scaled(values) {
        let (right, up, _) = projection.axes();
        let (middle, arrow) = (middle(&positions), arrow + body);
        let at = middle + arrow * rotate_handles::SCALE * (right + up);
        add(HandleKind::Size, middle, at, "scale", straight());
    }
    handles
}

/// Returns the direction of the handle of a line's length number `index`.
fn toward(index: usize, projection: &Projection) -> DVec3 {
    let (right, up, _) = projection.axes();
    if index == 0 { right } else { up }
}

/// Returns -1 for a light, whose arrow points to where the light comes from, else 1.
fn facing(command: Command) -> f64 {
    if role(command) == Role::Light { -1.0 } else { 1.0 }
}

/// A drag with its start.
#[derive(Clone, Debug)]
pub(crate) struct Drag {
    grip: HandleKind,
    /// The original lines.
    lines: Vec<(usize, Line, Values)>,
    /// The grabbed point in the world.
    grabbed: DVec3,
    keying: Keying,
    /// The objects that the lines can be aligned with.
    neighbours: Option<Neighbours>,
    /// The degrees turned so far, so that a drag can make several turns.
    turned: Cell<f64>,
}

/// The lines after a drag.
#[derive(Debug, Default)]
pub(crate) struct Dragged {
    /// The lines with their indices.
    pub(crate) lines: Vec<(usize, Line)>,
    /// The ends of a line in the world for each axis on which the drag aligned the lines with another object.
    pub(crate) guides: Vec<[DVec3; 2]>,
}

/// The modifiers of a drag.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct DragOptions {
    /// Move up and down instead of along the ground.
    #[serde(default)]
    pub(crate) upright: bool,
    /// Align with other objects, else move in steps of a grid.
    #[serde(default)]
    pub(crate) snap: bool,
    /// Move curves as a whole, in all frames.
    #[serde(default)]
    pub(crate) whole: bool,
}

impl Drag {
    /// Starts a drag of some lines. `grabbed` is the point of an object that was hit, if there is one. `neighbours` are
    /// the objects that the lines can be aligned with.
    pub(crate) fn new(
        grip: HandleKind,
        lines: Vec<(usize, Line)>,
        grabbed: Option<DVec3>,
        around: DVec3,
        keying: Keying,
        neighbours: Option<Neighbours>,
    ) -> Option<Self> {
        let lines: Vec<_> = lines
            .into_iter()
            .filter_map(|(number, line)| Values::of(&line, keying.time).map(|values| (number, line, values)))
            .collect();
        let (_, _, values) = lines.first()?;
        let anchor = values.positions().next().map_or(around, |(_, position)| position);
        let positions: Vec<_> = values.positions().collect();
        let grabbed = match grip {
            HandleKind::Body => grabbed.unwrap_or(anchor),
            HandleKind::Key { .. } | HandleKind::Size => middle(&positions),
            HandleKind::Axis { .. } | HandleKind::Plane { .. } if role(values.command) != Role::Camera => {
                middle(&positions)
            }
            HandleKind::Point { first } => values.vector(first)?,
            HandleKind::Axis { .. }
            | HandleKind::Plane { .. }
            | HandleKind::Length { .. }
            | HandleKind::Direction { .. }
            | HandleKind::Turn { .. }
            | HandleKind::Scale { .. } => anchor,
        };
        Some(Self { grip, lines, grabbed, keying, neighbours, turned: Cell::new(0.0) })
    }

    /// Returns the lines after the pointer has moved from one point of the picture to another.
    pub(crate) fn to(
        &self,
        projection: &Projection,
        from: DVec2,
        to: DVec2,
        options: DragOptions,
    ) -> Dragged {
        let pixel = projection.pixel_at(self.grabbed);
        let step = step(pixel, options.snap);
        let keying = Keying { whole: options.whole, ..self.keying };
        let mut guides = Vec::new();
        // Everything follows the pointer on a plane, along these axes.
        let mut along = |normal: DVec3, axes: [bool; 3]| {
            let Some(free) = between(projection, self.grabbed, normal, from, to) else { return self.start() };
            let mut by = free;
            let mut steps = [step; 3];
            let neighbours = self.neighbours.as_ref().filter(|_| options.snap && from != to);
            for Snap { axis, way, guide } in
                neighbours.into_iter().flat_map(|all| all.snap(free, axes, SNAP * pixel))
            {
                (by[axis], steps[axis]) = (way, (self::step(pixel, false) * ALIGNED).max(1e-12));
                guides.push(guide);
            }
            let moved = |(number, line, values): &(usize, Line, Values)| {
                let mut line = line.clone();
                for (first, position) in values.positions() {
                    line = changed(&line, first, &shifted(position, by, axes, steps), keying)?;
                }
                Some((*number, line))
            };
            self.lines.iter().filter_map(moved).collect()
        };
        let lines = match self.grip {
            HandleKind::Body | HandleKind::Key { .. } => {
                let (normal, axes) = self.plane(projection, options);
                along(normal, axes)
            }
            HandleKind::Axis { axis } => {
                let axis_way = DVec3::AXES[axis];
                let (_, _, w) = projection.axes();
                // The plane through the axis that faces the eye.
                let normal = axis_way.cross(w).cross(axis_way);
                let Some(normal) = normal.try_normalize() else { return self.unmoved() };
                along(normal, [0, 1, 2].map(|other| other == axis))
            }
            HandleKind::Plane { axis } => along(DVec3::AXES[axis], [0, 1, 2].map(|other| other != axis)),
            HandleKind::Point { first } => {
                let (normal, axes) = self.plane(projection, options);
                let Some(by) = between(projection, self.grabbed, normal, from, to) else {
                    return self.unmoved();
                };
                self.first(|line, values| {
                    let position = values.vector(first)?;
                    changed(line, first, &shifted(position, by, axes, [step; 3]), keying)
                })
            }
            HandleKind::Length { first } => {
                let (_, _, w) = projection.axes();
                let at = |seen| meet(projection.ray(seen), self.grabbed, w).map(|p| p.distance(self.grabbed));
                let (Some(before), Some(now)) = (at(from), at(to)) else { return self.unmoved() };
                if from == to {
                    return self.unmoved();
                }
                self.first(|line, values| {
                    let length = values.number(first)?;
                    let longer = rounded((length + now - before).max(step), step);
                    changed(line, first, &[longer.min(values.most(first))], keying)
                })
            }
            HandleKind::Direction { first } => {
                let radius = ARROW * projection.pixel_at(self.grabbed);
                if from == to {
                    return self.unmoved();
                }
                self.first(|line, values| {
                    let old = values.vector(first)?;
                    let tip = on_sphere(projection.ray(to), self.grabbed, radius) - self.grabbed;
                    let length = old.length();
                    let new = facing(values.command) * tip.normalize_or(DVec3::NEG_Y) * length;
                    let step = self::step(length * 1e-2, options.snap);
                    let new = new.to_array().map(|x| rounded(x, step));
                    if new == [0.0; 3] { None } else { changed(line, first, &new, keying) }
                })
            }
            HandleKind::Turn { first, axis } => self.first(|line, values| {
                let degrees = values.vector(first)?;
                let (about, _) = rotate_handles::frame(degrees, axis);
                let by = rotate_handles::angle(projection, self.grabbed, about, from, to)?;
                let by = rotate_handles::nearest_turn(by, self.turned.get());
                self.turned.set(by);
                let by = rounded(by, if options.snap { rotate_handles::SNAP } else { rotate_handles::STEP });
                if by == 0.0 {
                    return None;
                }
                changed(line, first + axis, &[exactly(degrees[axis], by, rotate_handles::STEP)], keying)
            }),
            HandleKind::Scale { .. } | HandleKind::Size => {
                let Some(center) = projection.point(self.grabbed) else { return self.unmoved() };
                let factor = to.distance(center) / from.distance(center);
                if from == to || !factor.is_finite() {
                    return self.unmoved();
                }
                self.first(|line, values| {
                    let HandleKind::Scale { first } = self.grip else {
                        return scale_handles::scaled(line, values, factor, step, keying);
                    };
                    let scale = values.number(first)?;
                    let step = self::step(scale.abs() * 3e-2, options.snap);
                    changed(line, first, &[rounded((scale * factor).max(step), step)], keying)
                })
            }
        };
        Dragged { lines, guides }
    }

    fn unmoved(&self) -> Dragged {
        Dragged { lines: self.start(), guides: Vec::new() }
    }

    fn start(&self) -> Vec<(usize, Line)> {
        self.lines.iter().map(|(number, line, _)| (*number, line.clone())).collect()
    }

    fn first(&self, change: impl Fn(&Line, &Values) -> Option<Line>) -> Vec<(usize, Line)> {
        let Some((number, line, values)) = self.lines.first() else { return Vec::new() };
        vec![(*number, change(line, values).unwrap_or_else(|| line.clone()))]
    }

    /// Returns the plane of a free drag, and the coordinates that it changes: the ground, or an upright plane, or the
    /// picture's own plane if the ground is seen edge on.
    fn plane(&self, projection: &Projection, options: DragOptions) -> (DVec3, [bool; 3]) {
        let (_, _, w) = projection.axes();
        if options.upright {
            let facing = DVec3::new(w.x, 0.0, w.z);
            return (facing.try_normalize().unwrap_or(DVec3::Z), [false, true, false]);
        }
        if w.y.abs() > SLANTED {
            return (DVec3::Y, [true, false, true]);
        }
        if w.z.abs() > w.x.abs() { (DVec3::Z, [true, true, false]) } else { (DVec3::X, [false, true, true]) }
    }
}

/// Returns the movement of the pointer along a plane.
fn between(projection: &Projection, through: DVec3, normal: DVec3, from: DVec2, to: DVec2) -> Option<DVec3> {
    let start = meet(projection.ray(from), through, normal)?;
    let end = meet(projection.ray(to), through, normal)?;
    Some(end - start)
}

/// Returns the intersection of a ray and a plane.
fn meet((origin, direction): (DVec3, DVec3), through: DVec3, normal: DVec3) -> Option<DVec3> {
    let distance = (through - origin).dot(normal) / direction.dot(normal);
    let point = origin + distance * direction;
    (distance > 0.0 && point.is_finite()).then_some(point)
}

/// Returns the intersection of a ray and a sphere, or the point of the sphere nearest to the ray.
fn on_sphere((origin, direction): (DVec3, DVec3), center: DVec3, radius: f64) -> DVec3 {
    let along = (center - origin).dot(direction);
    let nearest = origin + along * direction;
    let room = radius * radius - nearest.distance_squared(center);
    if room > 0.0 { nearest - room.sqrt() * direction } else { nearest }
}

/// Returns the step to which numbers are rounded, given the extent of a pixel: the power of ten at or below half a
/// pixel, or at or above the snapping grid.
fn step(pixel: f64, snap: bool) -> f64 {
    let least = if snap { SNAP * pixel } else { 0.5 * pixel };
    let power = if snap { least.log10().ceil() } else { least.log10().floor() };
    if power.is_finite() { 10f64.powi(power.clamp(-12.0, 12.0) as i32) } else { 1e-3 }
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Camera, Scene, Screen};

    use super::*;
    use crate::view::{Bounds, Orbit};

    const STILL: Keying = Keying { time: 1.0, first: 1.0, auto: false, whole: false };

    /// Returns the handles of a line at the first frame.
    fn handles(number: usize, line: &Line, projection: &Projection, around: DVec3) -> Vec<Handle> {
        super::handles(number, &Values::of(line, 1.0).unwrap(), projection, around, None)
    }

    fn scene() -> Scene {
        let bounds = Bounds { low: DVec3::splat(-2.0), high: DVec3::splat(2.0) };
        let camera = Orbit::at(bounds, 0.0, 0.6).camera(1.5).unwrap();
        Scene::new(Screen::new(300, 200).unwrap(), Camera::Pinhole(camera))
    }

    fn drag(grip: HandleKind, text: &str, from: DVec2, by: DVec2, options: DragOptions) -> String {
        let scene = scene();
        let drag = Drag::new(grip, vec![(0, Line::new(text))], None, DVec3::ZERO, STILL, None).unwrap();
        drag.to(&Projection::new(&scene), from, from + by, options).lines[0].1.text()
    }

    const BALL: &str = "Sphere 1  0 1 0  .1 .1 .1  1 1 1 # ball";

    #[test]
    fn going_back_to_the_start_changes_nothing() {
        let text = "Box -1.005 0 1e0  2 .50 -0 .1 .1 .1 1 1 1";
        let grips = [HandleKind::Body, HandleKind::Axis { axis: 1 }, HandleKind::Point { first: 3 }];
        for grip in grips {
            assert_eq!(drag(grip, text, DVec2::new(120.0, 90.0), DVec2::ZERO, DragOptions::default()), text);
        }
        for grip in [HandleKind::Length { first: 0 }, HandleKind::Body] {
            assert_eq!(drag(grip, BALL, DVec2::new(120.0, 90.0), DVec2::ZERO, DragOptions::default()), BALL);
        }
        let sun = "Ilight 1 1 1  .3 -1 -.123456789";
        let grip = HandleKind::Direction { first: 3 };
        assert_eq!(drag(grip, sun, DVec2::new(120.0, 90.0), DVec2::ZERO, DragOptions::default()), sun);
    }

    #[test]
    fn a_body_goes_along_the_ground_under_the_pointer() {
        let scene = scene();
        let projection = Projection::new(&scene);
        let grabbed = DVec3::new(0.0, 1.0, 0.0);
        let to = DVec3::new(0.5, 1.0, -0.25);
        let (from, by) = (projection.point(grabbed).unwrap(), projection.point(to).unwrap());
        let text = drag(HandleKind::Body, BALL, from, by - from, DragOptions::default());
        assert_eq!(text, "Sphere 1  0.5 1 -0.25  .1 .1 .1  1 1 1 # ball");
    }

    #[test]
    fn upright_and_axes_change_one_number() {
        let up = DVec2::new(13.0, -31.0);
        let upright = drag(
            HandleKind::Body,
            BALL,
            DVec2::new(150.0, 80.0),
            up,
            DragOptions { upright: true, ..DragOptions::default() },
        );
        let axis =
            drag(HandleKind::Axis { axis: 1 }, BALL, DVec2::new(150.0, 80.0), up, DragOptions::default());
        for text in [upright, axis] {
            let y: f64 = text.split_whitespace().nth(3).unwrap().parse().unwrap();
            assert!(
                y > 1.2 && text.starts_with("Sphere 1  0 ") && text.ends_with(" 0  .1 .1 .1  1 1 1 # ball"),
                "{text}"
            );
        }
    }

    #[test]
    fn a_square_moves_along_its_plane_and_is_not_there_edge_on() {
        let scene = scene();
        let projection = Projection::new(&scene);
        let all = handles(0, &Line::new(BALL), &projection, DVec3::ZERO);
        let planes: Vec<_> =
            all.iter().filter(|handle| matches!(handle.grip, HandleKind::Plane { .. })).collect();
        assert!((1..3).contains(&planes.len()), "{planes:?}");
        for handle in planes {
            let HandleKind::Plane { axis } = handle.grip else { unreachable!() };
            let text =
                drag(handle.grip, BALL, handle.at.into(), DVec2::new(17.0, -11.0), DragOptions::default());
            let place = text.split_whitespace().skip(2).take(3).map(|word| word.parse::<f64>().unwrap());
            let old = BALL.split_whitespace().skip(2).take(3).map(|word| word.parse::<f64>().unwrap());
            let moved: Vec<_> = place.zip(old).map(|(new, old)| new != old).collect();
            assert_eq!(moved, [0, 1, 2].map(|other| other != axis), "{text}");
        }
    }

    #[test]
    fn a_radius_follows_its_handle_and_stays_positive() {
        let scene = scene();
        let projection = Projection::new(&scene);
        let of_radius = |text: &str| {
            let all = handles(0, &Line::new(text), &projection, DVec3::ZERO);
            DVec2::from(all.iter().find(|h| h.grip == HandleKind::Length { first: 0 }).unwrap().at)
        };
        let (one, two) = (of_radius(BALL), of_radius(&BALL.replacen('1', "2", 1)));
        let text = drag(HandleKind::Length { first: 0 }, BALL, one, two - one, DragOptions::default());
        assert!(
            text.starts_with("Sphere 2 ")
                || text.starts_with("Sphere 2.00")
                || text.starts_with("Sphere 1.99"),
            "{text}"
        );
        let text =
            drag(HandleKind::Length { first: 0 }, BALL, one, DVec2::new(-38.0, 0.0), DragOptions::default());
        let radius: f64 = text.split_whitespace().nth(1).unwrap().parse().unwrap();
        assert!(radius > 0.0 && radius < 1.0, "{text}");
    }

    #[test]
    fn edges_are_made_no_rounder_than_they_can_be() {
        let scene = scene();
        let projection = Projection::new(&scene);
        let (soap, grip) = ("Roundbox 0 0 0  2 .5 3  .1  1 0 0  0 0 0", HandleKind::Length { first: 6 });
        let all = handles(0, &Line::new(soap), &projection, DVec3::ZERO);
        let at = DVec2::from(all.iter().find(|handle| handle.grip == grip).unwrap().at);
        let corner = projection.point(DVec3::ZERO).unwrap();
        let text = drag(grip, soap, at, 400.0 * (at - corner).normalize(), DragOptions::default());
        assert_eq!(text, soap.replace(" .1 ", " 0.25 "));
    }

    #[test]
    fn a_lights_handle_leads_to_its_direction() {
        let scene = scene();
        let projection = Projection::new(&scene);
        let handle = |text: &str| {
            let all = handles(0, &Line::new(text), &projection, DVec3::ZERO);
            assert_eq!(all.len(), 1, "a sun has no place");
            DVec2::from(all[0].at)
        };
        let (old, new) = (handle("Ilight 1 1 1  0 -2 0"), handle("Ilight 1 1 1  1.2 -1.6 0"));
        let text = drag(
            HandleKind::Direction { first: 3 },
            "Ilight 1 1 1  0 -2 0",
            old,
            new - old,
            DragOptions::default(),
        );
        let numbers: Vec<f64> = text.split_whitespace().skip(4).map(|n| n.parse().unwrap()).collect();
        let off = DVec3::from_slice(&numbers).distance(DVec3::new(1.2, -1.6, 0.0));
        assert!(off < 0.1, "{text}");
    }

    #[test]
    fn a_group_turns_about_an_axis_and_grows() {
        let scene = scene();
        let projection = Projection::new(&scene);
        let table = "Use table  0 0 0  0 (1:10 9:20) 0";
        let all = handles(0, &Line::new(table), &projection, DVec3::ZERO);
        let turn = all.iter().find(|handle| handle.grip == HandleKind::Turn { first: 3, axis: 1 }).unwrap();
        assert!(turn.way.starts_with('M'));
        let at = |degrees: f64| {
            let text = format!("Use table  0 0 0  0 {degrees} 0");
            let all = handles(0, &Line::new(&text), &projection, DVec3::ZERO);
            DVec2::from(all.iter().find(|handle| handle.grip == turn.grip).unwrap().at)
        };
        let by = at(47.0) - at(10.0);
        assert_eq!(
            drag(turn.grip, table, at(10.0), by, DragOptions::default()),
            "Use table  0 0 0  0 (1:47 9:20) 0"
        );
        let snap = DragOptions { snap: true, ..DragOptions::default() };
        assert_eq!(drag(turn.grip, table, at(10.0), by, snap), "Use table  0 0 0  0 (1:40 9:20) 0");
        let scale = all.iter().find(|handle| handle.grip == HandleKind::Scale { first: 6 }).unwrap();
        let (from, to) = (DVec2::from(scale.from), DVec2::from(scale.at));
        let text = drag(scale.grip, "Use table", to, to - from, DragOptions::default());
        assert_eq!(text, "Use table 0 0 0 0 0 0 2", "twice as far is twice as large");
    }

    #[test]
    fn each_handle_of_a_group_has_a_place_of_its_own() {
        let bounds = Bounds { low: DVec3::splat(-2.0), high: DVec3::splat(2.0) };
        let camera = Orbit::at(bounds, 0.0, 0.3).camera(1.5).unwrap();
        let scene = Scene::new(Screen::new(300, 200).unwrap(), Camera::Pinhole(camera));
        let values = Values::of(&Line::new("Use table"), 1.0).unwrap();
        for size in [None, Some(0.5), Some(1.5)] {
            let all = super::handles(0, &values, &Projection::new(&scene), DVec3::ZERO, size);
            for (number, one) in all.iter().enumerate() {
                for other in &all[..number] {
                    let apart = DVec2::from(one.at).distance(other.at.into());
                    assert!(apart > 12.0, "{:?} and {:?} are {apart} pixels apart", one.grip, other.grip);
                }
            }
        }
    }

    #[test]
    fn a_drag_that_goes_around_turns_more_than_once() {
        let scene = scene();
        let projection = Projection::new(&scene);
        let line = vec![(0, Line::new("Use table"))];
        let grip = HandleKind::Turn { first: 3, axis: 1 };
        let drag = Drag::new(grip, line, None, DVec3::ZERO, STILL, None).unwrap();
        let at = |degrees: f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            projection.point(0.5 * DVec3::new(sin, 0.0, cos)).unwrap()
        };
        let mut text = String::new();
        for step in 0..=45 {
            text = drag.to(&projection, at(0.0), at(10.0 * f64::from(step)), DragOptions::default()).lines[0]
                .1
                .text();
        }
        assert_eq!(text, "Use table 0 0 0 0 450 0");
    }

    #[test]
    fn a_drag_at_a_later_frame_writes_a_key_there() {
        let keying = Keying { time: 25.0, auto: true, ..STILL };
        let scene = scene();
        let line = vec![(0, Line::new(BALL))];
        let drag = Drag::new(HandleKind::Axis { axis: 1 }, line, None, DVec3::ZERO, keying, None).unwrap();
        let to = |by: f64, options| {
            let from = DVec2::new(150.0, 80.0);
            drag.to(&Projection::new(&scene), from, from + DVec2::new(0.0, by), options).lines[0].1.text()
        };
        let text = to(-30.0, DragOptions::default());
        assert!(
            text.starts_with("Sphere 1  0 (smooth 1:1 25:") && text.ends_with(") 0  .1 .1 .1  1 1 1 # ball"),
            "{text}"
        );
        assert_eq!(to(0.0, DragOptions::default()), BALL, "back at the start there is none");
        assert!(!to(-30.0, DragOptions { whole: true, ..DragOptions::default() }).contains('('));
    }

    #[test]
    fn steps_are_powers_of_ten() {
        assert_eq!(step(0.013, false), 1e-3);
        assert_eq!(step(0.013, true), 1.0);
    }
}
