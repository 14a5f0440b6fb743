//! Bright objects as surfaces see them: balls, flat panes, and boxes and rods that contain something bright.

#![expect(clippy::needless_range_loop, reason = "lanes of several columns, which become packets")]

use core::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};
use rayfold_scene::{Object, Outline};

use super::places::{in_cone, on_disc};

/// The largest number of bright objects. Each is tested at each hit.
const MAX_COUNT: usize = 16;

/// The share of the largest face of a box below which a face is left out.
const SMALL_FACE: f64 = 1.0 / 64.0;

/// Something bright.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bright {
    brightness: f64,
    form: Form,
}

#[derive(Clone, Copy, Debug)]
enum Form {
    Ball {
        center: DVec3,
        radius: f64,
    },
    Pane(Pane),
    /// A box along the axes that contains it.
    Within([DVec3; 2]),
    Rod {
        ends: [DVec3; 2],
        radius: f64,
    },
}

/// A flat part of a surface.
#[derive(Clone, Copy, Debug)]
struct Pane {
    edge: Edge,
    origin: DVec3,
    /// Vectors in the plane: the radii of a disc, and the sides at the origin of others.
    sides: [DVec3; 2],
    /// The dot products of these with a vector in the plane are the vector's coordinates along the sides.
    parts: [DVec3; 2],
    normal: DVec3,
    area: f64,
    middle: DVec3,
    /// The distance of the farthest point from the middle.
    radius: f64,
    /// Whether only its front is seen.
    is_closed: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Edge {
    Disc,
    /// A parallelogram, with any angle between its sides.
    Rectangle,
    Triangle,
}

impl Pane {
    /// Returns `None` for a pane without area.
    fn new(edge: Edge, origin: DVec3, sides: [DVec3; 2], is_closed: bool) -> Option<Self> {
        let [a, b] = sides;
        let across = a.cross(b);
        let size = across.length_squared().sqrt();
        let normal = across / size;
        let parts = [b.cross(normal) / size, normal.cross(a) / size];
        let (share, middle) = match edge {
            Edge::Disc => (PI, origin),
            Edge::Rectangle => (1.0, origin + (a + b) / 2.0),
            Edge::Triangle => (0.5, origin + (a + b) / 3.0),
        };
        let radius = match edge {
            Edge::Disc => a.length_squared().sqrt(),
            _ => [origin, origin + a, origin + b, origin + a + b]
                .map(|corner| (corner - middle).length_squared().sqrt())
                .into_iter()
                .fold(0.0, f64::max),
        };
        let is_one = parts.iter().all(|part| part.is_finite()) && radius.is_finite() && size > 0.0;
        let area = share * size;
        is_one.then_some(Self { edge, origin, sides, parts, normal, area, middle, radius, is_closed })
    }
}

impl Bright {
    /// Adds the bright parts of an object to `found`.
    pub(crate) fn add_object(object: &Object, brightness: f64, found: &mut Vec<Self>) {
        let mut add = |form| found.push(Self { brightness, form });
        match object.outline() {
            Some(Outline::Ball { center, radius }) => add(Form::Ball { center, radius }),
            Some(Outline::Triangle([a, b, c])) => {
                if let Some(pane) = Pane::new(Edge::Triangle, a, [b - a, c - a], false) {
                    add(Form::Pane(pane));
                }
            }
            Some(Outline::Disc { center, normal, radius }) => {
                let (x, y) = (normal.normalize() + DVec3::ZERO).any_orthonormal_pair();
                if let Some(pane) = Pane::new(Edge::Disc, center, [radius * x, radius * y], false) {
                    add(Form::Pane(pane));
                }
            }
            Some(Outline::Box { corners, radius: 0.0 }) => {
                let faces = faces(corners);
                let largest = faces.iter().fold(0.0, |most: f64, face| most.max(face.area));
                faces
                    .into_iter()
                    .filter(|face| face.area > SMALL_FACE * largest)
                    .for_each(|face| add(Form::Pane(face)));
            }
            Some(Outline::Rod { ends, radii: [a, b], .. }) => add(Form::Rod { ends, radius: a.max(b) }),
            _ => {
                if let Some(bounds) = object.bounds() {
                    add(Form::Within(bounds));
                }
            }
        }
    }

    /// Returns the rectangle with these opposite corners. It is flat along an axis.
    pub(crate) fn rectangle(brightness: f64, corners: [DVec3; 2]) -> Option<Self> {
        let pane = Pane::new(Edge::Rectangle, corners[0], sides_of(corners), false)?;
        Some(Self { brightness, form: Form::Pane(pane) })
    }

    /// Returns the parallelogram with this corner and the sides there. It is seen from the side of its normal.
    pub(crate) fn parallelogram(
        brightness: f64,
        origin: DVec3,
        [a, b]: [DVec3; 2],
        normal: DVec3,
    ) -> Option<Self> {
        let sides = if a.cross(b).dot(normal) > 0.0 { [a, b] } else { [b, a] };
        Some(Self { brightness, form: Form::Pane(Pane::new(Edge::Rectangle, origin, sides, true)?) })
    }

    /// Returns a bright object somewhere in a box.
    pub(crate) fn within(brightness: f64, bounds: [DVec3; 2]) -> Self {
        Self { brightness, form: Form::Within(bounds) }
    }

    /// Returns the approximate power of its light.
    pub(crate) fn power(&self) -> f64 {
        self.brightness
            * match self.form {
                Form::Ball { radius, .. } => 2.0 * PI * radius * radius,
                Form::Pane(pane) => pane.area,
                Form::Within(bounds) => half_area(bounds),
                Form::Rod { ends: [a, b], radius } => PI * radius * ((b - a).length() + radius),
            }
    }

    /// Returns a measure of the light that a division into halves affects, and the halves, if it is long. The measure
    /// is 0 for a short one.
    fn halves(&self) -> (f64, [Self; 2]) {
        let with = |forms: [Form; 2]| forms.map(|form| Self { form, ..*self });
        let (length, width, halves) = match self.form {
            Form::Ball { .. } | Form::Pane(_) => return (0.0, [*self; 2]),
            Form::Within([low, high]) => {
                let sides = high - low;
                let longest = sides.max_position();
                let second =
                    (0..3).filter(|&axis| axis != longest).fold(0.0, |most: f64, axis| most.max(sides[axis]));
                let half = DVec3::AXES[longest] * sides / 2.0;
                (sides[longest], second, [[low, high - half], [low + half, high]].map(Form::Within))
            }
            Form::Rod { ends: [a, b], radius } => {
                let middle = a.midpoint(b);
                let rods = [[a, middle], [middle, b]].map(|ends| Form::Rod { ends, radius });
                ((b - a).length() + 2.0 * radius, 2.0 * radius, rods)
            }
        };
        let stake = if length > 2.0 * width { self.brightness * length * length } else { 0.0 };
        (stake, with(halves))
    }

    /// Returns the ball around it.
    fn around(&self) -> (DVec3, f64) {
        match self.form {
            Form::Ball { center, radius } => (center, radius),
            Form::Pane(pane) => (pane.middle, pane.radius),
            Form::Within([low, high]) => (low.midpoint(high), (high - low).length() / 2.0),
            Form::Rod { ends: [a, b], radius } => (a.midpoint(b), (b - a).length() / 2.0 + radius),
        }
    }

    /// Returns how surfaces see it.
    #[inline(always)]
    pub(super) fn seen<const N: usize>(&self, places: &Places<N>, normals: &Places<N>) -> Seen<N> {
        let mut seen = Seen { weight: [0.0; N], scale: [0.0; N], view: [[0.0; N]; 4] };
        match &self.form {
            Form::Pane(pane) => {
                for k in 0..N {
                    let (place, normal) = (at(places, k), at(normals, k));
                    let towards = pane.middle - place;
                    let distance = towards.length_squared().sqrt();
                    let height = pane.normal.dot(towards);
                    // No point of it is seen under a larger cosine.
                    let cosine = ((towards.dot(normal) + pane.radius) / distance).min(1.0);
                    // About its solid angle. A pane that is near fills a half of all.
                    let solid = TAU * pane.area * height.abs()
                        / (TAU * distance * distance * distance + pane.area * height.abs());
                    let weight = self.brightness * cosine * solid;
                    let is_seen = weight > 0.0 && weight < f64::INFINITY && !(pane.is_closed && height > 0.0);
                    let origin = pane.origin - place;
                    seen.set(
                        k,
                        is_seen,
                        (weight, weight / pane.area),
                        [origin.x, origin.y, origin.z, height],
                    );
                }
            }
            _ => {
                let (center, radius) = self.around();
                for k in 0..N {
                    let (place, normal) = (at(places, k), at(normals, k));
                    let towards = center - place;
                    let nearness = 1.0 / towards.length_squared().sqrt();
                    let axis = towards * nearness;
                    let sine = radius * nearness;
                    let cosine = (axis.dot(normal) + sine).min(1.0);
                    // A little above 1 - √(1 - sine²), by its series.
                    let share = sine * sine;
                    let spread = share * (0.5 + share * (0.125 + share * (0.0625 + share * 0.3125)));
                    let scale = self.brightness * cosine;
                    let is_seen = sine < 1.0 && share > 1e-30 && cosine > 0.0;
                    let axis = axis + DVec3::ZERO;
                    seen.set(k, is_seen, (scale * TAU * spread, scale), [axis.x, axis.y, axis.z, spread]);
                }
            }
        }
        seen
    }
}

/// Returns the sides of a rectangle that is flat along an axis.
pub(crate) fn sides_of([low, high]: [DVec3; 2]) -> [DVec3; 2] {
    let sides = high - low;
    let flat = sides.abs().min_position();
    [1, 2].map(|k| DVec3::AXES[(flat + k) % 3] * sides)
}

/// Returns the faces of a box. Their normals point outwards.
fn faces([low, high]: [DVec3; 2]) -> Vec<Pane> {
    let sides = high - low;
    let face = |face: usize| {
        let [a, b] = [1, 2].map(|k| DVec3::AXES[(face / 2 + k) % 3] * sides);
        let (origin, sides) = if face.is_multiple_of(2) {
            (low, [b, a])
        } else {
            (low + DVec3::AXES[face / 2] * sides, [a, b])
        };
        Pane::new(Edge::Rectangle, origin, sides, true)
    };
    (0..6).filter_map(face).collect()
}

/// Returns half of the area of a box.
pub(crate) fn half_area([low, high]: [DVec3; 2]) -> f64 {
    let DVec3 { x, y, z } = high - low;
    x * y + y * z + z * x
}

/// Returns the brightest of all, with long ones divided into parts.
pub(crate) fn brightest(mut all: Vec<Bright>) -> Vec<Bright> {
    // The ones to find are those that give most light.
    all.sort_by(|a, b| b.power().total_cmp(&a.power()));
    all.truncate(MAX_COUNT);
    while all.len() < MAX_COUNT {
        let longest = (0..all.len()).max_by(|&a, &b| all[a].halves().0.total_cmp(&all[b].halves().0));
        let Some(at) = longest.filter(|&at| all[at].halves().0 > 0.0) else { break };
        let (_, [first, second]) = all[at].halves();
        all[at] = first;
        all.push(second);
    }
    all.retain(|bright| {
        let (_, radius) = bright.around();
        radius > 0.0 && radius.is_finite()
    });
    all
}

/// Vectors, with an array for each axis.
pub(crate) type Places<const N: usize> = [[f64; N]; 3];

/// Returns one of the vectors.
#[inline(always)]
pub(crate) fn at<const N: usize>([x, y, z]: &Places<N>, k: usize) -> DVec3 {
    DVec3::new(x[k], y[k], z[k])
}

#[inline(always)]
fn places<const N: usize>(place: impl Fn(usize) -> DVec3) -> Places<N> {
    let mut all = [[0.0; N]; 3];
    for k in 0..N {
        let of = place(k);
        (all[0][k], all[1][k], all[2][k]) = (of.x, of.y, of.z);
    }
    all
}

/// A bright object, as some surfaces see it.
pub(crate) struct Seen<const N: usize> {
    /// The approximate light that it gives each surface. It is 0 if the surface is inside it, or if one of the two is
    /// behind the other.
    pub(super) weight: [f64; N],
    /// The weight per unit of solid angle for a cone, and per area for a pane.
    scale: [f64; N],
    /// For a pane: its origin relative to the place, and the distance of its plane from the place along its normal. For
    /// others: the axis of a cone around it, and 1 - cos of the cone's half angle.
    view: [[f64; N]; 4],
}

impl<const N: usize> Seen<N> {
    #[inline(always)]
    fn set(&mut self, k: usize, is_seen: bool, (weight, scale): (f64, f64), view: [f64; 4]) {
        self.weight[k] = if is_seen { weight } else { 0.0 };
        self.scale[k] = if is_seen { scale } else { 0.0 };
        for (column, part) in self.view.iter_mut().zip(view) {
            column[k] = part;
        }
    }

    /// Excludes the surfaces for which `is_kept` is false.
    #[inline(always)]
    pub(super) fn keep(&mut self, is_kept: &[bool; N]) {
        for k in 0..N {
            self.weight[k] = if is_kept[k] { self.weight[k] } else { 0.0 };
            self.scale[k] = if is_kept[k] { self.scale[k] } else { 0.0 };
        }
    }

    #[inline(always)]
    fn view(&self, k: usize) -> (DVec3, f64) {
        let [x, y, z, last] = self.view.each_ref().map(|column| column[k]);
        (DVec3::new(x, y, z), last)
    }

    /// Adds the density of directions towards it, times the weight. `bright` is the object that is seen.
    #[inline(always)]
    pub(super) fn add_density(&self, bright: &Bright, directions: &Places<N>, sums: &mut [f64; N]) {
        // A little more, for the rounding of directions to an edge.
        const MORE: f64 = 1e-9;
        match &bright.form {
            Form::Pane(pane) => match pane.edge {
                Edge::Disc => {
                    self.add_of_pane(pane, directions, sums, |s, t| s * s + t * t <= 1.0 + MORE);
                }
                Edge::Rectangle => self.add_of_pane(pane, directions, sums, |s, t| {
                    (s - 0.5).abs().max((t - 0.5).abs()) <= 0.5 + MORE
                }),
                Edge::Triangle => {
                    self.add_of_pane(pane, directions, sums, |s, t| s.min(t).min(1.0 - s - t) >= -MORE);
                }
            },
            _ => {
                for k in 0..N {
                    let (axis, spread) = self.view(k);
                    // Of narrow cones the cosine is no measure.
                    let is_within = (at(directions, k) - axis).length_squared() <= 2.0 * spread;
                    sums[k] += if is_within { self.scale[k] } else { 0.0 };
                }
            }
        }
    }

    /// Adds the density for a pane. `holds` returns whether a place is on it, by the place's coordinates along the
    /// sides.
    #[inline(always)]
    fn add_of_pane(
        &self,
        pane: &Pane,
        directions: &Places<N>,
        sums: &mut [f64; N],
        holds: impl Fn(f64, f64) -> bool,
    ) {
        for k in 0..N {
            let direction = at(directions, k);
            let (origin, height) = self.view(k);
            let across = pane.normal.dot(direction);
            let distance = height / across;
            let [s, t] = pane.parts.map(|part| part.dot(direction * distance - origin));
            let density = self.scale[k] * distance * distance / across.abs();
            sums[k] += if (distance > 0.0) & (self.scale[k] > 0.0) & holds(s, t) { density } else { 0.0 };
        }
    }

    /// Returns the directions towards it for two numbers from 0 to 1, for each surface. `bright` is the object that is
    /// seen.
    #[inline(always)]
    pub(super) fn towards(&self, bright: &Bright, numbers: &[[f64; N]; 2]) -> Places<N> {
        match &bright.form {
            Form::Pane(pane) => match pane.edge {
                Edge::Disc => self.towards_pane(pane, numbers, on_disc),
                Edge::Rectangle => self.towards_pane(pane, numbers, DVec2::new),
                Edge::Triangle => self.towards_pane(pane, numbers, |u, v| {
                    let is_beyond = u + v > 1.0;
                    let [x, y] = [u, v].map(|part| if is_beyond { 1.0 - part } else { part });
                    DVec2::new(x, y)
                }),
            },
            _ => places(|k| {
                let (axis, spread) = self.view(k);
                let (x, y) = axis.any_orthonormal_pair();
                let DVec3 { x: across, y: down, z: along } = in_cone(numbers[0][k], numbers[1][k], spread);
                (across * x + down * y + along * axis).normalize()
            }),
        }
    }

    /// Returns the directions towards a pane. `point` returns the coordinates along the sides for two numbers.
    #[inline(always)]
    fn towards_pane(
        &self,
        pane: &Pane,
        numbers: &[[f64; N]; 2],
        point: impl Fn(f64, f64) -> DVec2,
    ) -> Places<N> {
        places(|k| {
            let DVec2 { x, y } = point(numbers[0][k], numbers[1][k]);
            (self.view(k).0 + (pane.sides[0] * x + pane.sides[1] * y)).normalize()
        })
    }
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Cuboid, Disc, Material, Sphere, Triangle};

    use super::*;

    /// Returns the solid angle of bright objects, computed by directions towards them and by all directions.
    fn solid_angles(all: &[Bright], place: DVec3, normal: DVec3) -> (f64, f64) {
        let column = |v: DVec3| v.to_array().map(|x| [x]);
        let seen: Vec<_> = all.iter().map(|one| one.seen(&column(place), &column(normal))).collect();
        let weights: f64 = seen.iter().map(|one| one.weight[0]).sum();
        let mut dice = fastrand::Rng::with_seed(5);
        let (mut by_aim, mut by_all) = (0.0, 0.0);
        let count = 200_000;
        for _ in 0..count {
            let mut at = dice.f64() * weights;
            let one = seen.iter().position(|one| (at < one.weight[0], at -= one.weight[0]).0).unwrap();
            let numbers = [[dice.f64()], [dice.f64()]];
            let towards = super::at(&seen[one].towards(&all[one], &numbers), 0);
            assert!((towards.length() - 1.0).abs() < 1e-14);
            let density = |direction| {
                let mut sums = [0.0];
                for (seen, bright) in seen.iter().zip(all) {
                    seen.add_density(bright, &column(direction), &mut sums);
                }
                sums[0] / weights
            };
            assert!(density(towards) > 0.0);
            by_aim += 1.0 / density(towards) / f64::from(count);
            let any = in_cone(dice.f64(), dice.f64(), 2.0);
            by_all += f64::from(u8::from(density(any) > 0.0)) * 4.0 * PI / f64::from(count);
        }
        (by_aim, by_all)
    }

    #[test]
    fn directions_towards_what_is_bright_have_their_density() {
        let material = Material::default;
        let (a, b) = (DVec3::new(-0.3, 1.0, 0.2), DVec3::new(0.8, 1.4, 0.9));
        let objects: [Object; 4] = [
            Sphere::new(0.4, a, material()).unwrap().into(),
            Disc::new(0.6, a, DVec3::new(0.2, -0.7, 0.3), material()).unwrap().into(),
            Cuboid::new([a, b], material()).unwrap().into(),
            Triangle::new([a, b, DVec3::new(0.1, 0.9, -0.6)], material()).unwrap().into(),
        ];
        for object in objects {
            let mut all = vec![];
            Bright::add_object(&object, 2.0, &mut all);
            for place in [DVec3::ZERO, DVec3::new(1.5, 0.2, -0.4), DVec3::new(-1.0, 1.8, 0.5)] {
                let towards = (a - place).normalize();
                let (by_aim, by_all) = solid_angles(&all, place, towards);
                assert!((by_aim / by_all - 1.0).abs() < 0.03, "{object:?} {place}: {by_aim} {by_all}");
            }
        }
    }

    #[test]
    fn long_things_are_many_balls_and_the_brightest_are_kept() {
        let rod = |ends| Bright { brightness: 1.0, form: Form::Rod { ends, radius: 0.25 } };
        let tube = brightest(vec![rod([DVec3::ZERO, DVec3::new(5.0, 5.0, 0.0)])]);
        assert_eq!(tube.len(), MAX_COUNT);
        assert!(tube.iter().all(|bright| bright.around().1 < 0.5));
        let crowd = (1..100)
            .map(|k| Bright { brightness: f64::from(k), form: Form::Within([DVec3::ZERO, DVec3::ONE]) });
        let crowd = brightest(crowd.collect());
        assert_eq!(crowd.len(), MAX_COUNT);
        assert!(crowd.iter().all(|bright| bright.brightness > 83.0));
    }
}
