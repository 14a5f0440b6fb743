//! Finds, before the first sample of the picture, the pixels that may show an object narrower than a pixel.
//!
//! Most first samples miss a wire that is a hundredth of a pixel wide. So the samples of a pixel do not show how many
//! more it needs. Therefore two other scenes are drawn first, with a ray per pixel. In one of them the narrow objects
//! are missing. In the other, [stand-ins](super::stand_ins) replace them, so wide that no pixel misses them. The
//! pictures differ in the pixels in which narrow objects matter: directly, by their shadows, in mirrors or behind
//! glass. Those pixels get a number of samples that depends on the width of the objects and not on the samples, so that
//! their means have no bias. Narrow highlights are treated alike: they are missing in one scene and wider in the other.

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

/// The number of moments of an exposure that are looked at.
const MOMENTS: usize = 16;

/// The largest number of objects at all of these moments together. Each moment is prepared separately.
const OBJECTS: usize = 1 << 18;

/// The width, in pixels, below which an object is narrow. The samples of a pixel find wider objects.
const NARROW: f64 = 1.0;

/// The number of pixels by which a stand-in is wider on each side: the diagonal of a pixel, plus a margin.
const WIDER: f64 = 1.5;

/// [`NARROW`] for objects that are seen by their shadow, in mirrors or through glass, where pixels may be larger.
const NARROW_INDIRECTLY: f64 = 2.0;
const WIDER_INDIRECTLY: f64 = 4.5;

/// The width, in pixels, of a highlight that replaces a narrower one.
const WIDE_GLEAM: f64 = 3.0;

/// The number of samples of a pixel that shows a narrow object, as a multiple of the inverse of the object's width.
const SEEN: f64 = 32.0;

/// The numbers of samples from which that of a pixel is chosen. The last one stands for the largest number that a pixel
/// may have.
const FLOORS: [u32; 3] = [64, 256, u32::MAX];
const ALL: usize = FLOORS.len() - 1;

/// The largest number of boxes that are watched. If there are more, boxes are joined.
const BOXES: usize = 16;

/// Two scenes, ready to be drawn.
#[derive(Debug)]
struct Pair<'a> {
    without: Sampled<'a, f64>,
    with: Sampled<'a, f64>,
    marks: Marks,
    boxes: Option<Vec<Bounds>>,
}

/// The meaning of a difference between two scenes.
#[derive(Debug)]
struct Marks {
    /// The number of objects before the first stand-in.
    others: usize,
    /// The index in [`FLOORS`] of each stand-in.
    floors: Vec<u8>,
    /// Whether stand-ins count only where they are not seen directly.
    is_indirect: bool,
}

/// The pairs of scenes that are compared.
#[derive(Debug, Default)]
pub(super) struct Scouts<'a>(Vec<Pair<'a>>);

impl<'a> Scouts<'a> {
    /// Makes the scouts of a scene at its moments.
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

    /// Returns at most [`BOXES`] boxes around everything in which any two scenes differ. Returns `None` if something is
    /// infinite, or if nothing differs.
    pub(super) fn boxes(&self) -> Option<Vec<Bounds>> {
        let all = self.0.iter().map(|pair| pair.boxes.as_deref()).collect::<Option<Vec<_>>>()?.concat();
        let boxes = all.chunks(all.len().div_ceil(BOXES).max(1));
        let joined: Vec<Bounds> = boxes.filter_map(|some| some.iter().copied().reduce(join)).collect();
        (!joined.is_empty()).then_some(joined)
    }

    /// Finds the pixels of some rows that get a fixed number of samples, and that number. Returns `None` if there are
    /// no such pixels. If `some` are given, only those are considered.
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

/// Prepares a scene for a first look. Returns `None` if the kernels cannot hold its stand-ins, because their numbers
/// are too large or too small.
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

/// Two scenes: one without narrow objects, and one with stand-ins for them.
struct Compared {
    without: Scene,
    with: Scene,
    marks: Marks,
    /// Boxes around everything in which they differ from each other and from the picture's scene. `None` if something
    /// of it is infinite.
    boxes: Option<Vec<Bounds>>,
}

/// Returns the pairs of scenes to compare for a scene. `near` holds the scene at the moments before and after.
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

/// Makes the pair for objects that are narrower than `narrow` pixels, with stand-ins that are `wider` pixels wider.
/// `drift` returns the number of pixels by which an object moves until the next moment that is looked at.
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

/// Returns a box around an object, or `None` if it is infinite: that of its hull, with a margin if the hull has rings
/// of few points.
fn box_around(object: &Object) -> Option<Bounds> {
    let points = hull(object)?.points;
    let (low, high) = points.into_iter().map(|point| (point, point)).reduce(join)?;
    let is_exact = matches!(object, Object::Triangle(_) | Object::Cuboid(_) | Object::Sphere(_));
    let more = DVec3::splat(if is_exact { 1e-6 } else { 0.1 } * (high - low).max_element());
    Some((low - more, high + more))
}

/// Returns an object whose highlight is narrower than a pixel in two versions: without the highlight, and with a wider
/// one.
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

/// Returns the width of each object.
fn widths(objects: &[Object], gauge: &Gauge) -> Vec<Width> {
    let mut widths: Vec<Width> =
        objects.iter().map(|object| hull(object).map_or(Width::UNKNOWN, |hull| gauge.width(&hull))).collect();
    join_triangles(objects, gauge, &mut widths);
    widths
}

/// Sets the width of triangles that share edges to their common width.
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
