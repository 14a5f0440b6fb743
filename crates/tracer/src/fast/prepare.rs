//! A scene as the kernels read it: arrays by kind, constants worked out in `f64` and rounded once.
//!
//! What is the same for all rays of a kind is computed here and not by lane: for rays from the eye and for rays
//! towards a light the tests of spheres and triangles shrink to a few products with such constants.

use std::sync::Arc;

use glam::{DMat3, DVec3};
use rayfold_scene::{Object, Scene};

use super::doubt::Corners;
use super::features::Needs;
use super::geometry::{Geometry, Shape, Solid, Sun, View};
use super::lists::{LISTED, LightBuffer, Outline, Sights};
use super::real::Real;
use super::tree::{Tree, stump};
use crate::RenderError;
use crate::parallel::map;

/// Rounding errors that add up on the way to a hit and to a shadow ray's test, in roundoffs of the largest coordinate;
/// the offset of a new ray's origin exceeds them.
pub(super) const OFFSET: f64 = 32.0;

/// Rounding errors of an edge's side, in roundoffs of the sum of the products' magnitudes: one of the constant, four of
/// the sum without fused multiply-add, and what is of second order.
const SIDE: f64 = 5.25;

/// Rounding errors of the constants of an edge in `f64`, before they are rounded to the kernels' numbers.
const CONSTANT: f64 = 4.0 * f64::EPSILON;

/// Rounding errors of a triangle's volume with the eye.
const VOLUME: f64 = 4.0 * f64::EPSILON;

/// Rounding errors of bounds on where objects lie, and how far beside them rays meet them (triangles: [`Beside`]).
///
/// [`Beside`]: super::doubt::Beside
pub(super) const BOUNDS: f64 = 64.0;

/// Below this many roundoffs the sine of the angle between a ray and a triangle's plane is noise.
pub(super) const GRAZING: f64 = 4.0;

/// Below this many roundoffs the sine of the angle between the light and a triangle's plane is noise: both directions are
/// rounded. Such a triangle has no shadow; taken for one that has, its sides would bound a line without ends.
const EDGE_ON: f64 = 16.0;

#[derive(Clone, Copy, Debug)]
pub(super) struct Sphere<E> {
    pub(super) center: [E; 3],
    /// r²
    pub(super) square: E,
    /// Position in the script.
    pub(super) order: E,
    /// |c|² - r² without cancellation: the power of the eye, for rays from there.
    pub(super) power: E,
    /// Distance from the centre at which rays leave its outside and its inside.
    pub(super) outer: E,
    pub(super) inner: E,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Cuboid<E> {
    pub(super) min: [E; 3],
    pub(super) max: [E; 3],
    pub(super) order: E,
}

/// Plücker coordinates of an edge: its direction and its moment, the cross product of its ends.
///
/// `d · moment + direction · (o × d)` tells on which side of the edge the ray from `o` along `d` passes, with an error
/// below `slack.0 + slack.1 · |o|₁`: what is within the error belongs to the triangle unless it lies beyond its tips, so
/// that meshes have no cracks, neither along edges nor at vertices.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge<E> {
    pub(super) direction: [E; 3],
    pub(super) moment: [E; 3],
    pub(super) slack: (E, E),
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle<E> {
    pub(super) edges: [Edge<E>; 3],
    /// The same edges for rays from the eye, in units of twice a bound on the error, turned so that what is visible is
    /// not negative: below 0 is outside, from 0 to 1 in doubt. The last is a half, or less than zero where the eye lies in
    /// the plane.
    pub(super) from_eye: [([E; 3], E); 3],
    pub(super) normal: [E; 3],
    /// `normal · point` of its points.
    pub(super) height: E,
    pub(super) order: E,
}

/// A triangle as an obstacle to one light: affine functions of the ray's origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shade<E> {
    /// In units of twice a bound on the error: below 0 is outside the triangle, from 0 to 1 in doubt.
    pub(super) sides: [([E; 3], E); 3],
    /// The same for the side that the light does not shine on: below 0 is the other one.
    pub(super) depth: ([E; 3], E),
}

/// A light and every obstacle as it sees it.
#[derive(Clone, Debug)]
pub(super) struct Light<E> {
    /// Orthonormal; the last points towards the light.
    pub(super) axes: [[E; 3]; 3],
    pub(super) color: [E; 3],
    /// 1 / direction for the axes where it is not zero.
    pub(super) inverse: [Option<E>; 3],
    /// Centres along `axes`, and r².
    pub(super) spheres: Vec<[E; 4]>,
    pub(super) shades: Vec<Shade<E>>,
    /// For scenes without a tree: what can meet a ray from a region.
    pub(super) outlines: Outlines<E>,
    /// For scenes of many objects, where it helps.
    pub(super) buffer: Option<LightBuffer>,
}

/// How a scene's objects are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Search {
    Masks,
    /// Lists, and down a tree where they would be long.
    Lists,
    Tree,
}

/// Per object, in the order of the masks' bits: a box along the light's axes, and one along the scene's.
///
/// The arrays are as long as a multiple of every packet's width; what is added overlaps nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct Outlines<E> {
    pub(super) low: [Vec<E>; 2],
    pub(super) high: [Vec<E>; 2],
    /// The farthest that the object reaches along each scene axis in the light's direction, times the sign of it.
    pub(super) exits: [Vec<E>; 3],
    /// The farthest that it reaches towards the light.
    pub(super) top: Vec<E>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Sphere,
    Cuboid,
    Triangle,
}

/// What lies behind a position in the script.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry<E> {
    pub(super) kind: Kind,
    /// Position in the array of its kind.
    pub(super) index: u32,
    pub(super) mirrors: bool,
    pub(super) ambient: [E; 3],
    pub(super) diffuse: [E; 3],
    pub(super) mirror: [E; 3],
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Rays<E> {
    Pinhole { corner: [E; 3], right: [E; 3], up: [E; 3] },
    Parallel { corner: [E; 3], pixel: E },
}

/// Everything that the kernels read.
#[derive(Debug)]
pub(super) struct Prepared<E> {
    pub(super) rays: Rays<E>,
    pub(super) spheres: Vec<Sphere<E>>,
    pub(super) cuboids: Vec<Cuboid<E>>,
    pub(super) triangles: Vec<Triangle<E>>,
    pub(super) corners: Corners,
    pub(super) entries: Vec<Entry<E>>,
    pub(super) lights: Vec<Light<E>>,
    pub(super) tree: Option<Tree<E>>,
    /// For scenes of many objects, where it helps: what the tiles show.
    pub(super) sights: Option<Sights>,
    /// Unclamped, for mirrored rays.
    pub(super) background: [E; 3],
    /// What it has.
    pub(super) needs: Needs,
}

/// Objects up to this many are tested by masks over all of them; more are found by a tree.
pub(super) const MASKED: usize = 64;

impl<E: Real> Prepared<E> {
    /// What masks cannot hold is one leaf if `tree` says that there shall be none. Tiles have the size of `side`.
    ///
    /// # Errors
    /// When the build leaves out what the scene has.
    pub(super) fn new(
        scene: &Scene,
        geometry: &Geometry,
        tree: Option<bool>,
        side: (u32, u32),
    ) -> Result<Self, RenderError> {
        let size = (scene.screen.width(), scene.screen.height());
        let stump = (geometry.branches.is_some() && tree == Some(false)).then(|| stump(&geometry.solids));
        let stump = stump.map(|(solids, branches)| (Arc::new(solids), branches));
        let (solids, branches) = match &stump {
            Some((solids, branches)) => (solids, Some(branches)),
            None => (&geometry.solids, geometry.branches.as_ref()),
        };
        let count = solids.len();
        let search = match (branches, tree) {
            (None, _) => Search::Masks,
            (Some(_), None) if count <= LISTED => Search::Lists,
            _ => Search::Tree,
        };
        let mut needs = Needs { tree: search != Search::Masks, ..Needs::default() };
        needs.check()?;
        let mut entries: Vec<Entry<E>> = map(&scene.objects, entry);
        let mut sorted = Sorted { balls: vec![], boxes: vec![], facets: vec![] };
        let mut places = vec![];
        for (place, solid) in solids.iter().enumerate() {
            let of_kind = match solid.shape {
                Shape::Sphere { .. } => &mut sorted.balls,
                Shape::Cuboid { .. } => &mut sorted.boxes,
                Shape::Triangle { .. } => {
                    places.push(place as u32);
                    &mut sorted.facets
                }
            };
            let entry = &mut entries[solid.order as usize];
            entry.index = of_kind.len() as u32;
            needs.mirrors |= entry.mirrors;
            of_kind.push(solid);
        }
        needs.cuboids = !sorted.boxes.is_empty();
        needs.triangles = !sorted.facets.is_empty();
        let spheres: Vec<Sphere<E>> = map(&sorted.balls, |solid| sphere(solid));
        let alone = match (&spheres[..], &geometry.view) {
            ([sphere], View::Pinhole { .. }) => count == 1 && !needs.mirrors && sphere.power > E::narrow(0.0),
            _ => count == 0,
        };
        needs.shadows = !geometry.suns.is_empty() && !alone;
        needs.check()?;
        let sights = (search == Search::Lists)
            .then(|| Sights::new(&geometry.view, &sorted.all(), sorted.before(), size, side, E::ROUNDOFF))
            .flatten();
        Ok(Self {
            rays: rays(&geometry.view),
            spheres,
            cuboids: map(&sorted.boxes, |solid| cuboid(solid)),
            triangles: map(&sorted.facets, |solid| triangle(solid)),
            corners: Corners::new(solids.clone(), places),
            lights: geometry.suns.iter().map(|sun| light(sun, &sorted, search)).collect(),
            needs,
            background: point(scene.background()),
            tree: branches.map(|branches| Tree::new(branches, solids, &entries)),
            sights,
            entries,
        })
    }
}

fn point<E: Real>(v: DVec3) -> [E; 3] {
    v.to_array().map(E::narrow)
}

fn order<E: Real>(solid: &Solid) -> E {
    E::narrow(f64::from(solid.order))
}

fn entry<E: Real>(object: &Object) -> Entry<E> {
    let material = object.material();
    Entry {
        kind: match object {
            Object::Sphere(_) => Kind::Sphere,
            Object::Cuboid(_) => Kind::Cuboid,
            Object::Triangle(_) => Kind::Triangle,
        },
        index: 0,
        mirrors: material.mirror() != DVec3::ZERO,
        ambient: point(material.ambient()),
        diffuse: point(material.diffuse()),
        mirror: point(material.mirror()),
    }
}

fn rays<E: Real>(view: &View) -> Rays<E> {
    match *view {
        View::Parallel { corner, pixel } => Rays::Parallel { corner: point(corner), pixel: E::narrow(pixel) },
        View::Pinhole { right, up, back, x, y } => Rays::Pinhole {
            corner: point(x.0 * right + y.0 * up - back),
            right: point(x.1 * right),
            up: point(y.1 * up),
        },
    }
}

/// Shapes are sorted by kind before.
const SORTED: &str = "solids are sorted by kind";

fn cuboid<E: Real>(solid: &Solid) -> Cuboid<E> {
    let Shape::Cuboid { min, max } = solid.shape else { unreachable!("{SORTED}") };
    Cuboid { min: point(min), max: point(max), order: order(solid) }
}

fn sphere<E: Real>(solid: &Solid) -> Sphere<E> {
    let Shape::Sphere { center, radius, power } = solid.shape else { unreachable!("{SORTED}") };
    let offset = OFFSET * E::ROUNDOFF * (center.abs().max_element() + radius);
    Sphere {
        center: point(center),
        square: E::narrow(radius * radius),
        order: order(solid),
        power: E::narrow(power),
        outer: E::narrow(radius + offset),
        inner: E::narrow(radius - offset),
    }
}

#[inline(never)]
fn triangle<E: Real>(solid: &Solid) -> Triangle<E> {
    let Shape::Triangle { vertices, normal } = solid.shape else { unreachable!("{SORTED}") };
    let [a, b, c] = vertices;
    let ends = Ends::new(vertices);
    let [to_a, to_b, to_c] = ends.squares.map(f64::sqrt);
    let volume = a.dot((b - a).cross(c - a));
    let noise = VOLUME * to_a * to_b.max(to_c) * (b - a).length().max((c - a).length());
    let sign = if volume.abs() > noise { volume.signum() } else { 0.0 };
    // From elsewhere a cross product adds its errors.
    let slack = |size: f64, noise: f64| E::narrow(2.0 * SIDE * E::ROUNDOFF * size + noise);
    let edge = |from: usize, to: usize| {
        let (direction, anchor) = (vertices[to] - vertices[from], ends.nearer(from, to));
        let moment = anchor.cross(direction);
        let length = l1(direction);
        let noise = CONSTANT * l1(anchor) * length;
        let scale = 0.5 * sign / (SIDE * E::ROUNDOFF * moment.length() + noise);
        let from_eye = (point(moment * scale), E::narrow(if sign == 0.0 { -1.0 } else { 0.5 }));
        let (direction, slack) = (point(direction), (slack(l1(moment), noise), slack(length, 0.0)));
        (Edge { direction, moment: point(moment), slack }, from_eye)
    };
    let [a, b, c] = [edge(1, 2), edge(2, 0), edge(0, 1)];
    Triangle {
        edges: [a.0, b.0, c.0],
        from_eye: [a.1, b.1, c.1],
        normal: point(normal),
        height: E::narrow(normal.dot(ends.nearest())),
        order: order(solid),
    }
}

/// A triangle's corners by how near they are to the eye: relative to the nearer one numbers are smaller, and rounded
/// less.
struct Ends {
    vertices: [DVec3; 3],
    /// Of their distances.
    squares: [f64; 3],
}

impl Ends {
    #[inline(always)]
    fn new(vertices: [DVec3; 3]) -> Self {
        Self { vertices, squares: vertices.map(|v| v.length_squared()) }
    }

    #[inline(always)]
    fn nearer(&self, i: usize, j: usize) -> DVec3 {
        self.vertices[if self.squares[i] < self.squares[j] { i } else { j }]
    }

    #[inline(always)]
    fn nearest(&self) -> DVec3 {
        let [a, b, c] = self.squares;
        self.vertices[if a <= b && a <= c {
            0
        } else if b <= c {
            1
        } else {
            2
        }]
    }
}

fn l1(v: DVec3) -> f64 {
    v.abs().element_sum()
}

/// The scene's solids by kind, each in the order of its array.
struct Sorted<'a> {
    balls: Vec<&'a Solid>,
    boxes: Vec<&'a Solid>,
    facets: Vec<&'a Solid>,
}

impl Sorted<'_> {
    /// In the order of the masks' bits.
    fn all(&self) -> Vec<&Solid> {
        [&self.balls, &self.boxes, &self.facets].into_iter().flatten().copied().collect()
    }

    /// How many come before the boxes, and before the triangles.
    fn before(&self) -> (u32, u32) {
        let spheres = self.balls.len() as u32;
        (spheres, spheres + self.boxes.len() as u32)
    }
}

fn light<E: Real>(sun: &Sun, sorted: &Sorted, search: Search) -> Light<E> {
    let (x, y) = sun.towards.any_orthonormal_pair();
    let axes: [[E; 3]; 3] = [point(x), point(y), point(sun.towards)];
    // The axes as the kernels have them, so that both sides of a test see the same map.
    let rounded = DMat3::from_cols_array_2d(&axes.map(|axis| axis.map(Real::widen))).transpose();
    let circle = |solid: &&Solid| {
        let Shape::Sphere { center, radius, .. } = solid.shape else { unreachable!("{SORTED}") };
        let [x, y, z] = point(rounded * center);
        [x, y, z, E::narrow(radius * radius)]
    };
    let facet = |solid: &&Solid| {
        let Shape::Triangle { vertices, normal } = solid.shape else { unreachable!("{SORTED}") };
        shade(vertices, normal, rounded.row(2))
    };
    let outlines = || map(&sorted.all(), |solid| Outline::new::<E>(solid, rounded));
    Light {
        axes,
        color: point(sun.color),
        inverse: sun.towards.to_array().map(|d| (d != 0.0).then(|| E::narrow(1.0 / d))),
        spheres: map(&sorted.balls, circle),
        shades: map(&sorted.facets, facet),
        outlines: if search == Search::Masks { masks(&outlines()) } else { Outlines::default() },
        buffer: if search == Search::Lists { LightBuffer::new(outlines(), sorted.before()) } else { None },
    }
}

/// From the Plücker coordinates of the ray through `o` along `d`: `d · moment + direction · (o × d)`.
#[inline(never)]
fn shade<E: Real>(vertices: [DVec3; 3], normal: DVec3, towards: DVec3) -> Shade<E> {
    let facing = normal.dot(towards);
    let sign = facing.signum();
    if facing.abs() <= EDGE_ON * E::ROUNDOFF {
        return Shade {
            sides: [([E::narrow(0.0); 3], E::narrow(-1.0)); 3],
            depth: ([E::narrow(0.0); 3], E::narrow(-1.0)),
        };
    }
    let ends = Ends::new(vertices);
    // No point has a coordinate beyond 1, no corner is farther away than the root of 3.
    let scale =
        |slope: DVec3, start: f64, noise: f64| 0.5 / (SIDE * E::ROUNDOFF * (l1(slope) + start.abs()) + noise);
    let side = |from: usize, to: usize| {
        let edge = vertices[to] - vertices[from];
        let slope = towards.cross(edge) * sign;
        let start = -slope.dot(ends.nearer(from, to));
        let scale = scale(slope, start, 3.0 * CONSTANT * l1(edge));
        (point(slope * scale), E::narrow(start * scale + 0.5))
    };
    let height = normal.dot(ends.nearest());
    let scale = sign * scale(normal, height, CONSTANT);
    Shade {
        sides: [side(1, 2), side(2, 0), side(0, 1)],
        depth: (point(-normal * scale), E::narrow(height * scale)),
    }
}

fn masks<E: Real>(of: &[Outline]) -> Outlines<E> {
    let column = |value: &dyn Fn(&Outline) -> f64, never: f64| {
        let mut column: Vec<E> = of.iter().map(|outline| E::narrow(value(outline))).collect();
        column.resize(MASKED, E::narrow(never));
        column
    };
    Outlines {
        low: [0, 1].map(|axis| column(&|o| o.low[axis], E::FAR)),
        high: [0, 1].map(|axis| column(&|o| o.high[axis], -E::FAR)),
        exits: [0, 1, 2].map(|axis| column(&|o| o.exits[axis], -E::FAR)),
        top: column(&|o| o.top, -E::FAR),
    }
}
