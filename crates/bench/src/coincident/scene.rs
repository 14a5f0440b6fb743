//! Random scripts of two solids that share a surface.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::fmt::Write as _;

use fastrand::Rng;
use glam::{DMat3, DVec3};

use super::solid::Solid;

/// A script, and one without the coincidence that must give the same picture.
#[derive(Clone, Debug)]
pub(super) struct Pair {
    pub(super) script: String,
    /// The script in which the winning solid is slightly thicker, or the other one is omitted.
    pub(super) expected: String,
    /// Whether single precision cannot decide which solid is in front.
    pub(super) is_fine: bool,
    /// Whether a pixel has several samples.
    pub(super) is_sampled: bool,
}

/// The added thickness: far more than rounding, far less than a pixel.
const THICKER: f64 = 1e-6;

/// The distance of surfaces that do not coincide, relative to the largest number of the scene: some thousand roundoffs.
const APART: f64 = 1e-12;

/// The largest distance of a scene from the origin.
const FARTHEST: f64 = 1e7;

/// The way in which the position of the solids is written.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Written {
    /// The lines contain the position, and the solids are aligned with the axes.
    Straight,
    /// The lines contain the position, and the solids are rotated.
    Turned,
    OneGroup,
    TwoGroups,
    /// The first in a group, the second by the numbers of its line.
    Mixed,
}

const WRITTEN: [Written; 5] =
    [Written::Straight, Written::Turned, Written::OneGroup, Written::TwoGroups, Written::Mixed];

/// The materials of the solids and their distance. If two hits are at the same distance, the first object in the script
/// wins, but a glass one loses to one without glass.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Matter {
    Opaque,
    FirstOfGlass,
    BothOfGlass,
    /// Opaque solids, of which the second is in front by more than rounding.
    SecondInFront,
}

/// A solid and the name of its material.
type Named = (Solid, &'static str);

/// Returns the scene of a seed.
pub(super) fn of_seed(seed: u64) -> Pair {
    let rng = &mut Rng::with_seed(seed);
    let matter = match rng.u32(0..10) {
        0 => Matter::FirstOfGlass,
        1 => Matter::BothOfGlass,
        2 | 3 => Matter::SecondInFront,
        _ => Matter::Opaque,
    };
    let [first, second] = if matter == Matter::BothOfGlass { twins(rng) } else { two(rng) };
    let second = if rng.u32(0..3) == 0 { second.jittered(rng) } else { second };
    let shift = match shift(rng) {
        // At this distance the added thickness could not be distinguished from the gap in front.
        far if matter == Matter::SecondInFront && far.length() > 1e4 => far * 1e-4,
        shift => shift,
    };
    let place = Place { angles: angles(rng), shift };
    let written = WRITTEN[rng.usize(0..WRITTEN.len())];
    // Only a group can rotate a box.
    let is_written = |solid: &Solid| solid.placed(place.turn(), place.shift).is_some();
    let written = match written {
        Written::Turned if !is_written(&first) || !is_written(&second) => Written::OneGroup,
        Written::Mixed if !is_written(&second) => Written::TwoGroups,
        other => other,
    };
    let place = if written == Written::Straight { Place { angles: DVec3::ZERO, ..place } } else { place };
    let around = Surroundings::new(rng, matter, place);
    let by = |depth: f64, solid: &Solid, name| solid.thicker(depth).into_iter().map(|s| (s, name)).collect();
    let thicker = |solid: &Solid, name| -> Vec<Named> { by(THICKER, solid, name) };
    let (one, other): (Vec<Named>, Vec<Named>) = match matter {
        Matter::Opaque => (thicker(&first, "first"), vec![(second.clone(), "second")]),
        Matter::FirstOfGlass => (vec![(first.clone(), "first")], thicker(&second, "second")),
        Matter::BothOfGlass => (vec![(first.clone(), "first")], vec![]),
        Matter::SecondInFront => (vec![(first.clone(), "first")], thicker(&second, "second")),
    };
    let drawn = match matter {
        Matter::SecondInFront => by(APART * around.largest, &second, "second"),
        Matter::Opaque | Matter::FirstOfGlass | Matter::BothOfGlass => vec![(second, "second")],
    };
    Pair {
        expected: around.script(&one, &other, written),
        script: around.script(&[(first, "first")], &drawn, written),
        is_fine: matter == Matter::SecondInFront,
        is_sampled: around.is_sampled,
    }
}

/// The position and rotation of the solids.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// The angles in degrees, as `Use` takes them.
    angles: DVec3,
    shift: DVec3,
}

impl Place {
    fn turn(&self) -> DMat3 {
        if self.angles == DVec3::ZERO {
            return DMat3::IDENTITY;
        }
        let [x, y, z] = self.angles.map(f64::to_radians).to_array();
        DMat3::from_rotation_z(z) * DMat3::from_rotation_y(y) * DMat3::from_rotation_x(x)
    }
}

fn angles(rng: &mut Rng) -> DVec3 {
    let which = rng.u32(0..4);
    let mut angle = || (rng.f64() * 360.0).round();
    match which {
        0 => DVec3::new(0.0, angle(), 0.0),
        1 => 90.0 * DVec3::new(1.0, 2.0, 3.0),
        2 => DVec3::new(angle(), 0.0, 0.0),
        _ => DVec3::new(angle(), angle() + 0.1, angle() + 0.37),
    }
}

fn shift(rng: &mut Rng) -> DVec3 {
    let far = match rng.u32(0..4) {
        0 => 0.0,
        1 => 3.0,
        _ => 10f64.powf(rng.f64() * FARTHEST.log10()),
    };
    let shift = (direction(rng) * far * 1000.0).round() / 1000.0;
    if rng.bool() { DVec3::new(shift.x, 0.0, 0.0) } else { shift }
}

fn direction(rng: &mut Rng) -> DVec3 {
    let (height, turn) = (2.0 * rng.f64() - 1.0, TAU * rng.f64());
    let aside = (1.0 - height * height).sqrt();
    DVec3::new(aside * turn.cos(), height, aside * turn.sin())
}

/// Returns a random length, half of the time a multiple of 0.1.
fn length(rng: &mut Rng, from: f64, to: f64) -> f64 {
    let length = from + (to - from) * rng.f64();
    if rng.bool() { (10.0 * length).round().max(1.0) / 10.0 } else { length }
}

/// Returns the same solid twice.
fn twins(rng: &mut Rng) -> [Solid; 2] {
    let solid = match rng.u32(0..8) {
        0 => return [ball(rng), ball(rng)].map(|_| Solid::Sphere { radius: 0.9, center: DVec3::Y * 0.1 }),
        1 => return rings(rng),
        2 => Solid::Cylinder { radius: 0.7, ends: [DVec3::Y * -0.4, DVec3::Y * 0.9] },
        3 => Solid::Cone { radii: [0.9, 0.2], ends: [DVec3::Y * -0.4, DVec3::Y * 0.9] },
        4 => Solid::Disc { radius: 1.1, center: DVec3::Y * 0.3, normal: DVec3::new(0.1, 1.0, -0.3) },
        5 => Solid::Capsule { radius: 0.5, ends: [DVec3::Y * -0.4, DVec3::new(0.3, 0.7, 0.2)] },
        6 => round_edged([DVec3::new(-0.6, -0.5, -0.8), DVec3::new(0.7, 0.9, 0.3)], length(rng, 0.1, 0.5)),
        _ => Solid::Box([DVec3::new(-0.6, -0.5, -0.8), DVec3::new(0.7, 0.9, 0.3)]),
    };
    [solid.clone(), solid]
}

/// Returns two solids that share a part of their surfaces.
fn two(rng: &mut Rng) -> [Solid; 2] {
    match rng.u32(0..10) {
        0 => cylinders(rng),
        1 => cones(rng),
        2 => rings(rng),
        3 => {
            let ball = ball(rng);
            [ball.clone(), ball]
        }
        4 => boxes(rng),
        5 => capsules(rng),
        6 => round_edged_boxes(rng),
        _ => {
            let height = length(rng, 0.1, 0.9);
            [flat(rng, height), flat(rng, height)]
        }
    }
}

fn ball(rng: &mut Rng) -> Solid {
    Solid::Sphere { radius: length(rng, 0.4, 1.0), center: 0.3 * direction(rng) }
}

fn rings(rng: &mut Rng) -> [Solid; 2] {
    let (radius, thickness) = (length(rng, 0.6, 1.0), length(rng, 0.1, 0.4));
    let (center, normal) = (0.2 * direction(rng), direction(rng));
    let scale = [1.0, -1.0, 3.7, 0.1][rng.usize(0..4)];
    let ring = |normal| Solid::Torus { radius, thickness, center, normal };
    [ring(normal), ring(scale * normal)]
}

/// Returns a range of heights along an axis, which need not be the y axis, and its end points.
fn span(rng: &mut Rng, axis: DVec3) -> ([f64; 2], [DVec3; 2]) {
    let low = length(rng, 0.1, 0.6) - 0.7;
    let high = low + length(rng, 0.3, 1.0);
    let heights = if rng.bool() { [low, high] } else { [high, low] };
    (heights, heights.map(|height| height * axis))
}

fn axis(rng: &mut Rng) -> DVec3 {
    if rng.bool() { DVec3::Y } else { direction(rng) }
}

fn cylinders(rng: &mut Rng) -> [Solid; 2] {
    let (radius, axis) = (length(rng, 0.3, 0.9), axis(rng));
    [(), ()].map(|()| {
        let (_, ends) = span(rng, axis);
        if rng.u32(0..4) == 0 {
            Solid::Cone { radii: [radius; 2], ends }
        } else {
            Solid::Cylinder { radius, ends }
        }
    })
}

/// Returns a capsule and its twin, or a cylinder that shares its side. The cylinder ends where the capsule is not round: beyond, one
/// leaves the other so slowly that a millionth of thickness shows.
fn capsules(rng: &mut Rng) -> [Solid; 2] {
    let (radius, axis) = (length(rng, 0.3, 0.8), axis(rng));
    let (_, [a, b]) = span(rng, axis);
    let within = |share: f64| a + share * (b - a);
    let second = if rng.bool() {
        Solid::Cylinder { radius, ends: [within(length(rng, 0.1, 0.4)), within(length(rng, 0.6, 0.9))] }
    } else {
        Solid::Capsule { radius, ends: [b, a] }
    };
    let mut both = [Solid::Capsule { radius, ends: [a, b] }, second];
    if rng.bool() {
        both.reverse();
    }
    both
}

/// Makes a box with round edges, which are as round as asked for or as they can be.
fn round_edged(corners: [DVec3; 2], radius: f64) -> Solid {
    Solid::Roundbox { corners, radius: radius.min(0.5 * (corners[1] - corners[0]).abs().min_element()) }
}

/// Returns a box with round edges, and another one or a box that shares its faces or one of them.
fn round_edged_boxes(rng: &mut Rng) -> [Solid; 2] {
    let [Solid::Box(first), Solid::Box(second)] = boxes(rng) else { unreachable!("boxes are boxes") };
    let radius = length(rng, 0.1, 0.5);
    let second = match rng.u32(0..4) {
        0 => Solid::Box(first),
        1 => round_edged(first, length(rng, 0.1, 0.5)),
        2 => round_edged(second, radius),
        _ => round_edged(first, radius),
    };
    let mut both = [round_edged(first, radius), second];
    if rng.bool() {
        both.reverse();
    }
    both
}

fn cones(rng: &mut Rng) -> [Solid; 2] {
    let (middle, slope, axis) = (length(rng, 0.5, 0.9), rng.f64() * 0.6 - 0.3, axis(rng));
    [(), ()].map(|()| {
        let (heights, ends) = span(rng, axis);
        Solid::Cone { radii: heights.map(|height| middle + slope * height), ends }
    })
}

fn boxes(rng: &mut Rng) -> [Solid; 2] {
    let mut corner =
        |sign: f64| DVec3::new(length(rng, 0.3, 0.9), length(rng, 0.3, 0.9), length(rng, 0.3, 0.9)) * sign;
    let (low, high) = (corner(-1.0), corner(1.0));
    let mut other = high;
    let axis = rng.usize(0..3);
    other[axis] = low[axis] + (high[axis] - low[axis]) * length(rng, 0.2, 1.0);
    [Solid::Box([low, high]), Solid::Box([other, low])]
}

/// Returns a solid with a face at this height.
fn flat(rng: &mut Rng, height: f64) -> Solid {
    let middle = DVec3::new(rng.f64() * 0.8 - 0.4, height, rng.f64() * 0.8 - 0.4);
    let size = length(rng, 0.4, 1.2);
    let normal = [DVec3::Y, DVec3::NEG_Y, 0.3 * DVec3::Y][rng.usize(0..3)];
    let aside = size * DVec3::new(1.0, 0.0, 0.8);
    let depth = length(rng, 0.2, 0.8) * if rng.bool() { DVec3::Y } else { DVec3::NEG_Y };
    match rng.u32(0..10) {
        0 => Solid::Plane { point: middle, normal },
        1 => Solid::Disc { radius: size, center: middle, normal },
        2 => Solid::Box([middle - aside, middle + aside]),
        3 => Solid::Box([middle - aside, middle + aside + depth]),
        4 => Solid::Cylinder { radius: size, ends: [middle, middle + depth] },
        5 => Solid::Cylinder { radius: size, ends: [middle + depth, middle] },
        6 => Solid::Cone { radii: [size, length(rng, 0.1, 0.8)], ends: [middle, middle + depth] },
        7 => round_edged([middle - aside, middle + aside + depth], length(rng, 0.1, 0.4)),
        _ => {
            let turn = TAU * rng.f64();
            Solid::Triangle([0.0, 1.3, 3.0].map(|part| {
                let angle = turn + FRAC_PI_2 * part;
                middle + size * DVec3::new(angle.cos(), 0.0, angle.sin())
            }))
        }
    }
}

/// The parts of a script other than the two solids.
struct Surroundings {
    place: Place,
    /// The largest number of the scene, approximately.
    largest: f64,
    is_sampled: bool,
    before: String,
    after: String,
}

impl Surroundings {
    fn new(rng: &mut Rng, matter: Matter, place: Place) -> Self {
        let towards_eye = direction(rng);
        let target = place.shift;
        let distance =
            if rng.u32(0..4) == 0 { 10f64.powf(1.0 + 3.0 * rng.f64()) } else { 3.0 + 3.0 * rng.f64() };
        let eye = target + distance * towards_eye;
        let field = 2.0 * (1.5 / distance).atan().to_degrees();
        // A plain scene has no feature that forces double precision.
        let is_plain = rng.u32(0..3) == 0 && matches!(matter, Matter::Opaque | Matter::SecondInFront);
        let mut before = String::from("Screen 40 32\nBackground .1 .1 .3\n");
        let vector = |v: DVec3| format!("{} {} {}", v.x, v.y, v.z);
        let mut line = |text: String| {
            before += &text;
            before.push('\n');
        };
        line(format!("Look {} {} {field}", vector(eye), vector(target)));
        let is_lit = rng.bool();
        if is_lit {
            line(format!("Ilight .8 .8 .8 {}", vector(-(towards_eye + 0.8 * direction(rng)))));
        }
        if is_lit && !is_plain {
            let lamp = target + 2.5 * (towards_eye + 0.6 * direction(rng)).normalize();
            line(format!("Plight .6 .6 .6 {}", vector(lamp)));
        }
        let is_sampled = !is_lit && rng.u32(0..4) == 0;
        if is_sampled {
            line("Samples 4".into());
        }
        for (name, color, is_glass) in [
            ("first", "1 0 0", matches!(matter, Matter::FirstOfGlass | Matter::BothOfGlass)),
            ("second", "0 1 0", matter == Matter::BothOfGlass),
        ] {
            line(if is_glass {
                format!("Material {name} ambient {color} glass .6 .7 .8 1.0")
            } else if is_lit {
                format!("Material {name} ambient {color} diffuse .5 .5 .5")
            } else {
                format!("Material {name} ambient {color}")
            });
        }
        line("Material back diffuse .7 .7 .2".into());
        line("Material mirror ambient .05 .05 .05 mirror .9 .9 .9".into());
        line("Material pane glass .9 .9 1 1.5".into());
        let mut after = String::new();
        let mut add = |text: String| {
            after += &text;
            after.push('\n');
        };
        // A mirror that shows the back, a pane in front, a floor for shadows, and many objects, for which the tracer
        // uses other search structures.
        if is_plain && rng.bool() {
            let (x, y) = towards_eye.any_orthonormal_pair();
            let corner = |turn: f64| target - 3.0 * towards_eye + 9.0 * (turn.cos() * x + turn.sin() * y);
            let [a, b, c] = [0.1, 2.2, 4.3].map(|turn| vector(corner(turn)));
            add(format!("Triangle {a} {b} {c} mirror"));
        }
        if !is_plain && rng.bool() {
            let tilted = (towards_eye + 0.3 * direction(rng)).normalize();
            add(format!("Disc 9 {} {} mirror", vector(target - 2.5 * towards_eye), vector(tilted)));
        }
        if !is_plain && rng.u32(0..3) == 0 {
            let tilted = towards_eye + 0.3 * direction(rng);
            add(format!("Disc 9 {} {} pane", vector(target + 2.2 * towards_eye), vector(tilted)));
        }
        if !is_plain && rng.bool() {
            add(format!("Disc 5 {} 0 1 0 back", vector(target - 2.1 * DVec3::Y)));
        }
        let crowd = [0, 0, 5, 80][rng.usize(0..4)];
        for k in 0..crowd {
            let beside = target + 4.0 * direction(rng) - 2.5 * towards_eye;
            let is_ball = is_plain || k % 2 == 0;
            let name = if is_ball { "Sphere .2" } else { "Disc .3" };
            let normal = if is_ball { String::new() } else { vector(direction(rng)) };
            add(format!("{name} {} {normal} back", vector(beside)));
        }
        let largest = target.abs().max_element() + distance;
        Self { place, largest, is_sampled, before, after }
    }

    fn script(&self, first: &[Named], second: &[Named], written: Written) -> String {
        let Place { angles, shift } = self.place;
        let mut text = self.before.clone();
        let by_hand = |solids: &[Named]| {
            let mut lines = String::new();
            for (solid, material) in solids {
                // Only groups rotate boxes.
                let Some(placed) = solid.placed(self.place.turn(), shift) else { continue };
                let _ = writeln!(lines, "{} {material}", placed.line());
            }
            lines
        };
        let group = |name: &str, parts: &[&[Named]]| {
            let mut lines = format!("Group {name}\n");
            for (solid, material) in parts.iter().copied().flatten() {
                let _ = writeln!(lines, "{} {material}", solid.line());
            }
            let [tx, ty, tz] = shift.to_array();
            let _ = writeln!(lines, "End\nUse {name} {tx} {ty} {tz} {} {} {}", angles.x, angles.y, angles.z);
            lines
        };
        text += &match written {
            Written::Straight | Written::Turned => by_hand(first) + &by_hand(second),
            Written::OneGroup => group("both", &[first, second]),
            Written::TwoGroups if second.is_empty() => group("one", &[first]),
            Written::TwoGroups => group("one", &[first]) + &group("other", &[second]),
            Written::Mixed => group("one", &[first]) + &by_hand(second),
        };
        text += &self.after;
        text + "Trace\n"
    }
}
