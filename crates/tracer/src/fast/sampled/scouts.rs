//! Pixels that may show something smaller than a pixel, found before the first sample of the picture.
//!
//! A wire that is a hundredth of a pixel wide is missed by most first samples, and whoever asks the samples of a pixel how many
//! more it needs hears nothing of it. So a ray a pixel is drawn of two other scenes: in one, what is too narrow is missing,
//! in the other [stand-ins](super::stand_ins) are in its place, so wide that no pixel misses them. Where the two pictures differ
//! the narrow objects matter, be it by themselves, by their shadows, in mirrors, or behind glass. Those pixels get a number of
//! samples that is chosen by the width of what is there, and not by what samples show, so that their means have no bias.
//! Highlights that are too narrow are treated alike: missing in the one, and wider in the other.

use core::ops::Range;
use std::borrow::Cow;
use std::collections::HashMap;

use glam::DVec3;
use rayfold_scene::model::Finish;
use rayfold_scene::{Material, Object, Samples, Scene, Shine};

use super::gauge::{Gauge, Hull, Width, hull};
use super::stand_ins::{Widener, repainted};
use crate::RenderOptions;
use crate::fast::build::precision;
use crate::fast::placement::geometry::Geometry;
use crate::fast::rays::bounds::{Bounds, join};
use crate::fast::sampled::Sampled;
use crate::parts;
use crate::reference::triangle_normal;
use crate::sampling::film::{Bits, Difference, Floors};
use crate::{Precision, RenderError, Sampler};

/// Moments of an exposure that are looked at.
const MOMENTS: usize = 16;

/// Objects at all of them together, at most: each moment is prepared by itself.
const OBJECTS: usize = 1 << 18;

/// What is wider, in pixels, is found by the samples of those that it covers.
const NARROW: f64 = 1.0;

/// By how many pixels a stand-in is wider on each side: by the diagonal of a pixel, and a little.
const WIDER: f64 = 1.5;

/// The same of what is seen by its shadow, in mirrors or through glass: pixels may be larger there.
const NARROW_INDIRECTLY: f64 = 2.0;
const WIDER_INDIRECTLY: f64 = 4.5;

/// A highlight this wide, in pixels, stands in for a narrower one.
const WIDE_GLEAM: f64 = 3.0;

/// How many samples a pixel gets in which something is narrow: so many times the inverse of its width.
const SEEN: f64 = 32.0;

/// Numbers of samples between which that is chosen; the last is all that a pixel may have.
const FLOORS: [u32; 3] = [64, 256, u32::MAX];
const ALL: usize = FLOORS.len() - 1;

/// More boxes are joined, so that few are watched.
const BOXES: usize = 16;

/// Two scenes, ready to be drawn.
#[derive(Debug)]
struct Pair<'a> {
    without: Sampled<'a, f64>,
    with: Sampled<'a, f64>,
    marks: Marks,
    boxes: Option<Vec<Bounds>>,
}

/// What a difference between two scenes says.
#[derive(Debug)]
struct Marks {
    /// Objects before the first stand-in.
    others: usize,
    /// Which of the [`FLOORS`] belongs to each stand-in.
    floors: Vec<u8>,
    /// Whether stand-ins count where they are not seen themselves.
    is_indirect: bool,
}

/// The pairs of scenes that are compared.
#[derive(Debug, Default)]
pub(super) struct Scouts<'a>(Vec<Pair<'a>>);

impl<'a> Scouts<'a> {
    /// Of a scene at its moments.
    pub(super) fn new(moments: &[Scene], options: &RenderOptions<'a>) -> Result<Self, RenderError> {
        let Some(first) = moments.first() else { return Ok(Self::default()) };
        if !(first.samples.error() > 0.0
            && parts::BUILT.cones
            && parts::BUILT.groups
            && parts::BUILT.tori
            && parts::BUILT.turned_boxes)
        {
            return Ok(Self::default());
        }
        let most = (OBJECTS / first.objects.len().max(1)).clamp(1, MOMENTS);
        let step = moments.len().div_ceil(most);
        let options = RenderOptions {
            precision: Precision::F64,
            sampler: Sampler::default(),
            progress: None,
            ..*options
        };
        let mut all = vec![];
        let moments: Vec<&Scene> = moments.iter().skip(step / 2).step_by(step).collect();
        for (k, moment) in moments.iter().enumerate() {
            let near = [k.checked_sub(1), Some(k + 1)].into_iter().flatten();
            let near: Vec<&Scene> = near.filter_map(|k| moments.get(k).copied()).collect();
            for Compared { without, with, marks, boxes } in pairs(moment, &near) {
                let ready = |scene| ready(scene, options);
                if let (Some(without), Some(with)) = (ready(without)?, ready(with)?) {
                    all.push(Pair { without, with, marks, boxes });
                }
            }
        }
        Ok(Self(all))
    }

    /// Boxes around all in which any two scenes differ, at most [`BOXES`]; none where something has no end, or nothing differs.
    pub(super) fn boxes(&self) -> Option<Vec<Bounds>> {
        let all = self.0.iter().map(|pair| pair.boxes.as_deref()).collect::<Option<Vec<_>>>()?.concat();
        let boxes = all.chunks(all.len().div_ceil(BOXES).max(1));
        let joined: Vec<Bounds> = boxes.filter_map(|some| some.iter().copied().reduce(join)).collect();
        (!joined.is_empty()).then_some(joined)
    }

    /// Finds the pixels of some rows that get a number of samples in any case, and that number; none if there are no such
    /// pixels. If `some` are given, only they can be such pixels.
    pub(super) fn floors(
        &self,
        rows: Range<u32>,
        some: Option<&Bits>,
    ) -> Result<Option<Floors>, RenderError> {
        let Some(first) = self.0.first() else { return Ok(None) };
        let size = (first.with.scene().screen.width(), rows.end - rows.start);
        let too_large = || RenderError::TooLarge { width: size.0, height: size.1 };
        let mut floors = Floors::new(size, &FLOORS).ok_or_else(too_large)?;
        for Pair { without, with, marks, .. } in &self.0 {
            let looks = (without.first_look(rows.clone(), some)?, with.first_look(rows.clone(), some)?);
            if let (Some(without), Some(with)) = looks {
                floors.add((&without, &with), some, |difference| marks.floor(difference));
            }
        }
        Ok(Some(floors))
    }
}

/// A scene to be looked at; none if the kernels cannot hold its stand-ins, which are at the end of all numbers then.
fn ready(scene: Scene, options: RenderOptions) -> Result<Option<Sampled<f64>>, RenderError> {
    let Ok(geometry) = Geometry::new(&scene, options.tree) else { return Ok(None) };
    if precision::resolve(&options, &geometry, &scene).is_none() {
        return Ok(None);
    }
    let moments = [scene.clone()];
    Sampled::of_one_look(Cow::Owned(scene), &moments, &[geometry], options).map(Some)
}

impl Marks {
    fn floor(&self, difference: Difference) -> Option<usize> {
        match difference {
            Difference::Color => Some(ALL),
            Difference::Object(_) if self.is_indirect => None,
            Difference::Object(number) => {
                let stand_in = usize::from(number).checked_sub(self.others);
                let is_numbered = self.others + self.floors.len() < usize::from(u16::MAX);
                let floor = stand_in.filter(|_| is_numbered).and_then(|at| self.floors.get(at));
                Some(floor.map_or(ALL, |&floor| usize::from(floor)))
            }
        }
    }
}

/// Two scenes without narrow objects and with stand-ins for them.
struct Compared {
    without: Scene,
    with: Scene,
    marks: Marks,
    /// Around all in which they differ from each other and from the picture's scene; none where that has no end.
    boxes: Option<Vec<Bounds>>,
}

/// What is compared of a scene, if anything is; `near` is what it is at the moments before and after.
fn pairs(scene: &Scene, near: &[&Scene]) -> Vec<Compared> {
    let gauge = Gauge::new(scene);
    let near: Vec<(&Scene, Gauge)> = near.iter().map(|scene| (*scene, Gauge::new(scene))).collect();
    let drift = |at: usize| {
        let Some(here) = hull(&scene.objects[at]) else { return 0.0 };
        let drifts = near
            .iter()
            .filter_map(|(scene, other)| Some(gauge.drift(&here, other, &hull(scene.objects.get(at)?)?)));
        drifts.fold(0.0, f64::max)
    };
    let widths = widths(&scene.objects, &gauge);
    let is_indirect = !scene.lights.is_empty()
        || scene.objects.iter().any(|o| {
            let is_mirror = |mirror| mirror != glam::DVec3::ZERO;
            let finish = o.material().finish();
            is_mirror(o.material().mirror())
                || finish.is_some_and(|finish| finish.glass.is_some())
                || finish.and_then(|f| f.pattern).is_some_and(|pattern| is_mirror(pattern.other.mirror()))
        });
    let mut pairs = vec![];
    pairs.extend(pair(scene, (&gauge, &widths, &drift), (NARROW, WIDER), false));
    if is_indirect {
        pairs.extend(pair(scene, (&gauge, &widths, &drift), (NARROW_INDIRECTLY, WIDER_INDIRECTLY), true));
    }
    pairs
}

/// What is narrower than so many pixels, and so many pixels wider. `drift` is by how many pixels an object moves until the next
/// moment that is looked at.
fn pair(
    scene: &Scene,
    (gauge, widths, drift): (&Gauge, &[Width], &dyn Fn(usize) -> f64),
    (narrow, wider): (f64, f64),
    is_indirect: bool,
) -> Option<Compared> {
    let (mut without, mut with) = (vec![], vec![]);
    let (mut stand_ins, mut floors) = (vec![], vec![]);
    let mut widener = Widener::new(gauge, wider);
    let mut boxes = Some(vec![]);
    let mut include = |object: &Object| match (box_around(object), &mut boxes) {
        (Some(around), Some(boxes)) => boxes.push(around),
        _ => boxes = None,
    };
    let mut is_any = false;
    for (at, (object, width)) in scene.objects.iter().zip(widths).enumerate() {
        if width.least < narrow {
            let drift = drift(at);
            let made = widener.stand_ins(object, 0.5 * drift);
            // What moves is in a pixel for a part of the time.
            let wanted = SEEN * (1.0 + drift * MOMENTS as f64) / width.seen;
            let floor = FLOORS.iter().position(|&floor| f64::from(floor) >= wanted).unwrap_or(ALL);
            floors.extend(made.iter().map(|_| floor as u8));
            made.iter().chain([object]).for_each(&mut include);
            stand_ins.extend(made);
            is_any = true;
            continue;
        }
        let gleams = gleams(object, gauge).filter(|_| !is_indirect);
        is_any |= gleams.is_some();
        gleams.iter().for_each(|(_, shiny)| include(shiny));
        let (plain, shiny) = gleams.unwrap_or_else(|| (object.clone(), object.clone()));
        without.push(plain);
        with.push(shiny);
    }
    if !is_any {
        return None;
    }
    let others = with.len();
    with.extend(stand_ins);
    let samples = Samples::new(2, 1.0).ok()?;
    let scene = |objects: Vec<Object>| Scene { objects: objects.into(), samples, ..scene.clone() };
    let marks = Marks { others, floors, is_indirect };
    Some(Compared { without: scene(without), with: scene(with), marks, boxes })
}

/// A box around an object, if it has an end: that of its hull, and a part more where that is rings of few points.
fn box_around(object: &Object) -> Option<Bounds> {
    let points = hull(object)?.points;
    let (low, high) = points.into_iter().map(|point| (point, point)).reduce(join)?;
    let is_exact = matches!(object, Object::Triangle(_) | Object::Cuboid(_) | Object::Sphere(_));
    let more = DVec3::splat(if is_exact { 1e-6 } else { 0.1 } * (high - low).max_element());
    Some((low - more, high + more))
}

/// An object whose highlight is narrower than a pixel without it, and with a wider one.
fn gleams(object: &Object, gauge: &Gauge) -> Option<(Object, Object)> {
    let material = object.material();
    let finish = material.finish()?;
    let shine = finish.shine?;
    let width = gauge.gleam(object, &shine).filter(|width| *width < NARROW)?;
    let part = width / WIDE_GLEAM;
    let wider = Shine::new(shine.color(), (shine.exponent() * part * part).max(1.0)).ok()?;
    let painted = |shine| {
        let finish = Finish { shine, ..finish.clone() };
        repainted(object, Material::finished(material.coefficients(), finish))
    };
    Some((painted(None)?, painted(Some(wider))?))
}

/// How wide each object is.
fn widths(objects: &[Object], gauge: &Gauge) -> Vec<Width> {
    let mut widths: Vec<Width> =
        objects.iter().map(|object| hull(object).map_or(Width::UNKNOWN, |hull| gauge.width(&hull))).collect();
    join_triangles(objects, gauge, &mut widths);
    widths
}

/// Triangles that share edges are as wide as they are together.
fn join_triangles(objects: &[Object], gauge: &Gauge, widths: &mut [Width]) {
    let is_narrow = |width: &Width| width.least < NARROW_INDIRECTLY;
    let vertices = |object: &Object| match object {
        Object::Triangle(o) => Some(*o.vertices()),
        Object::Instance(o) => match o.object() {
            Object::Triangle(triangle) => Some(triangle.vertices().map(|p| o.placement().point(p))),
            _ => None,
        },
        _ => None,
    };
    let is_any = objects.iter().zip(&*widths).any(|(o, width)| is_narrow(width) && vertices(o).is_some());
    if !is_any {
        return;
    }
    // Each points to one that it belongs to, or to itself.
    let mut belongs: Vec<usize> = (0..objects.len()).collect();
    let root = |belongs: &mut Vec<usize>, mut at: usize| {
        while belongs[at] != at {
            belongs[at] = belongs[belongs[at]];
            at = belongs[at];
        }
        at
    };
    let mut edges = HashMap::new();
    for (at, object) in objects.iter().enumerate() {
        let Some(corners) = vertices(object) else { continue };
        if triangle_normal(&corners) == glam::DVec3::ZERO {
            // Never seen.
            widths[at] = Width::UNKNOWN;
            continue;
        }
        let bits = corners.map(|p| p.to_array().map(|x| (x + 0.0).to_bits()));
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let edge = (bits[a].min(bits[b]), bits[a].max(bits[b]));
            let other = *edges.entry(edge).or_insert(at);
            let (a, b) = (root(&mut belongs, at), root(&mut belongs, other));
            belongs[a.max(b)] = a.min(b);
        }
    }
    let mut joined: HashMap<usize, Vec<glam::DVec3>> = HashMap::new();
    for (at, object) in objects.iter().enumerate() {
        let of = root(&mut belongs, at);
        if let Some(corners) = vertices(object).filter(|_| of != at) {
            let points = joined.entry(of).or_insert_with(|| vertices(&objects[of]).map_or(vec![], Vec::from));
            points.extend(corners);
        }
    }
    let of_joined: HashMap<usize, Width> = joined
        .into_iter()
        .map(|(of, points)| (of, gauge.width(&Hull { points, girth: f64::INFINITY, is_flat: false })))
        .collect();
    for (at, width) in widths.iter_mut().enumerate() {
        if let Some(joined) = of_joined.get(&root(&mut belongs, at)) {
            *width = *joined;
        }
    }
}
