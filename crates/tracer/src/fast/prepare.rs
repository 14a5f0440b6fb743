//! A scene as the kernels read it: arrays by kind, constants worked out in `f64` and rounded once.
//!
//! What is the same for all rays of a kind is computed here and not by lane: for rays from the eye and for rays
//! towards a sun the tests of spheres and triangles shrink to a few products with such constants.

use std::sync::Arc;

use fearless_simd::Simd;
use glam::DVec3;
use rayfold_scene::{Material, Object, Scene};

use super::beyond::Beyond;
use super::bodies::{ANY, Bodies};
use super::bounce::Queue;
use super::bounding_cone::Balls;
use super::candidates::{Candidates, MASKED, Masks};
use super::features::{BUILT, Needs};
use super::geometry::Geometry;
use super::kind::{ByKind, Kind, Row};
use super::lights::buffer::LightBuffer;
use super::lights::sun::{Direction, Outline, Outlines, Sun};
use super::lists::LISTED;
use super::parts;
use super::placed::Placed;
use super::rays::{Pixels, Rays};
use super::real::Real;
use super::shapes::{Obstacles, Shape, Shapes, Solid, Sorted};
use super::shared::SharedSurfaces;
use super::sights::Sights;
use super::sky::Sky;
use super::tree::{Tree, stump};
use super::view::View;
use super::window::{Grid, Window};
use crate::RenderError;
use crate::parallel::map;

/// As many lanes as a packet has at most.
const WIDEST: usize = 16;

/// A sun and every obstacle as it sees it.
#[derive(Clone, Debug)]
pub(super) struct Sunlight<E> {
    pub(super) sun: Sun<E>,
    pub(super) obstacles: Obstacles<E>,
    /// For scenes without a tree: what can meet a ray from a region.
    pub(super) outlines: Outlines<E>,
    /// For scenes of many objects, where it helps.
    pub(super) buffer: Option<LightBuffer>,
    /// Of few bodies, what can meet a ray from a region.
    pub(super) bodies: Option<Outlines<E>>,
}

/// How a scene's objects are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Search {
    Masks,
    /// Lists, and down a tree where they would be long.
    Lists,
    Tree,
}

/// What lies behind a position in the script.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry<E> {
    pub(super) kind: Kind,
    /// Position in the array of its kind.
    pub(super) index: u32,
    pub(super) mirrors: bool,
    /// Whether the position is that of a body.
    pub(super) is_body: bool,
    pub(super) ambient: [E; 3],
    pub(super) diffuse: [E; 3],
    pub(super) mirror: [E; 3],
}

/// Everything that the kernels read.
#[derive(Debug)]
pub(super) struct Prepared<E> {
    pub(super) rays: Rays<E>,
    pub(super) shapes: Shapes<E>,
    /// How many there are of each kind, and how they stand in the row that masks and lists count by.
    counts: ByKind<usize>,
    row: Row,
    pub(super) entries: Vec<Entry<E>>,
    pub(super) suns: Vec<Sunlight<E>>,
    pub(super) tree: Option<Arc<Tree<E>>>,
    /// For scenes of many objects, where it helps: what the tiles show.
    pub(super) sights: Option<Sights>,
    /// Unclamped, for mirrored rays; of a sky its first colour.
    pub(super) background: [E; 3],
    /// A background that depends on where a ray goes.
    sky: Option<Sky<E>>,
    /// What it has.
    pub(super) needs: Needs,
    /// What few scenes have.
    pub(super) beyond: Option<Beyond<E>>,
    /// The objects that share surfaces, if there are any.
    pub(super) shared: Option<SharedSurfaces>,
    /// Of scenes with glass and few objects: those of the row, and the bodies that have bounds.
    balls: Option<[Balls; 2]>,
}

impl<E: Real> Prepared<E> {
    /// What masks cannot hold is one leaf if `tree` says that there shall be none.
    ///
    /// # Errors
    /// When the build leaves out what the scene has.
    pub(super) fn new(
        scene: &Scene,
        geometry: &Geometry,
        tree: Option<bool>,
        grid: &Grid,
    ) -> Result<Self, RenderError> {
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
        let mut sorted = Sorted::default();
        for (place, solid) in solids.iter().enumerate() {
            let of_kind = sorted.of_mut(solid.shape.kind());
            let entry = &mut entries[solid.order as usize];
            entry.kind = solid.shape.kind();
            entry.index = of_kind.len() as u32;
            needs.mirrors |= entry.mirrors;
            of_kind.push(place as u32);
        }
        let sky = Sky::new(scene.background);
        let beyond = Beyond::new(scene, geometry);
        let shared = geometry.shared.clone().filter(|_| BUILT.beyond);
        needs.beyond = beyond.is_some() || sky.is_some() || shared.is_some();
        needs.glass = beyond.as_ref().is_some_and(Beyond::has_glass);
        for (order, at) in beyond.iter().filter_map(Beyond::bodies).flat_map(|bodies| bodies.places()) {
            let entry = &mut entries[order];
            entry.is_body = true;
            entry.index = at as u32;
            needs.mirrors |= entry.mirrors;
        }
        let counts = ByKind::new(|kind| sorted.of(kind).len());
        let row = Row::new(counts);
        needs.kinds = ByKind::new(|kind| *counts.of(kind) > 0);
        needs.check()?;
        let standing = Standing { solids, sorted: &sorted, row };
        let sights = (search == Search::Lists)
            .then(|| Sights::new(&geometry.view, standing.shapes(), row, grid, E::ROUNDOFF))
            .flatten();
        let boxes = beyond.as_ref().and_then(Beyond::bodies).and_then(Bodies::boxes);
        let suns = geometry.suns.iter().map(|sun| standing.lit_by(sun, search, boxes)).collect();
        let balls = (needs.glass && search == Search::Masks).then(|| {
            let of_bodies = boxes.unwrap_or_default().iter().map(Placed::bounds);
            [Balls::new(standing.shapes().map(Placed::bounds)), Balls::new(of_bodies)]
        });
        let tree = branches.map(|branches| {
            Arc::new(Tree::new(branches, solids, |place| entries[solids[place].order as usize].index))
        });
        let pixels = if scene.samples.most() > 1 { None } else { Pixels::of(&geometry.view) };
        let shapes = Shapes::new(solids, sorted, tree.clone().map(|tree| tree as _), pixels);
        let alone = match (&solids[..], &geometry.view) {
            ([solid], View::Pinhole { .. }) if grid.lens.is_none() => {
                !needs.mirrors && shapes.is_seen_from_outside(solid.shape.kind(), 0)
            }
            _ => count == 0,
        };
        needs.shadows = !geometry.suns.is_empty() && !alone;
        needs.check()?;
        Ok(Self {
            rays: Rays::new(&geometry.view),
            shapes,
            suns,
            counts,
            row,
            needs,
            background: narrow(scene.background.colors().0),
            sky,
            tree,
            sights,
            entries,
            beyond,
            shared,
            balls,
        })
    }

    /// The boxes of its bodies that have bounds, where they are few.
    pub(super) fn boxes_of_bodies(&self) -> Option<&[Shape]> {
        self.beyond.as_ref()?.bodies()?.boxes()
    }

    /// Which bodies a tile can show, by bits: those of a window of their boxes, or any.
    #[inline(always)]
    pub(super) fn bodies_in(&self, window: Option<&Window>, (column, row): (usize, usize)) -> u64 {
        match (window, &self.beyond) {
            (Some(window), _) => window.candidates(column, row),
            (None, Some(beyond)) if beyond.bodies().is_some() => ANY,
            (None, _) => 0,
        }
    }

    /// Whether a tile shows a background of one colour that shows nothing but `bodies`.
    #[inline(always)]
    pub(super) fn shows_nothing(&self, bodies: u64) -> bool {
        let has_planes = || self.beyond.as_ref().and_then(Beyond::bodies).is_some_and(Bodies::has_planes);
        self.is_plain() || bodies == 0 && self.sky().is_none() && !has_planes()
    }

    /// Whether there is nothing to be seen but what masks, lists and trees hold, which shares no surface, on a background of
    /// one colour.
    #[inline(always)]
    pub(super) fn is_plain(&self) -> bool {
        !self.needs.beyond || !BUILT.beyond
    }

    /// Its background, if that depends on where a ray goes.
    #[inline(always)]
    pub(super) fn sky(&self) -> Option<&Sky<E>> {
        if parts::BUILT.skies { self.sky.as_ref() } else { None }
    }

    /// Whether it has glass.
    #[inline(always)]
    pub(super) fn has_glass(&self) -> bool {
        BUILT.glass && self.needs.glass
    }

    /// All objects: by masks, or by all that is in the tree.
    #[inline(always)]
    pub(super) fn all(&self) -> Candidates<'static> {
        Candidates { masks: self.masks(u64::MAX), list: None, kinds: self.needs.kinds }
    }

    /// What the rays of a queue, which is filled up, can meet: objects, and bodies by bits.
    #[inline(always)]
    pub(super) fn met_by<S: Simd>(&self, simd: S, queue: &Queue<E>) -> (Candidates<'static>, u64) {
        let Some([shapes, bodies]) = &self.balls else { return (self.all(), ANY) };
        (Candidates::masked(self.masks(shapes.met_by(simd, queue))), bodies.met_by(simd, queue))
    }

    /// The objects whose bits are set in a word in which all stand in a row.
    #[inline(always)]
    pub(super) fn masks(&self, bits: u64) -> Masks {
        Masks::split(bits, self.row, self.counts)
    }
}

fn narrow<E: Real>(v: DVec3) -> [E; 3] {
    v.to_array().map(E::narrow)
}

/// Its place is known once the solids are sorted; what can never be hit has none.
fn entry<E: Real>(object: &Object) -> Entry<E> {
    let material = object.material();
    Entry {
        kind: Kind::Sphere,
        index: 0,
        is_body: false,
        mirrors: mirrors(material),
        ambient: narrow(material.ambient()),
        diffuse: narrow(material.diffuse()),
        mirror: narrow(material.mirror()),
    }
}

/// Whether it sends rays on: a mirror, anywhere, or glass.
fn mirrors(material: &Material) -> bool {
    let finish = material.finish();
    let other = || finish?.pattern.map(|pattern| pattern.other.mirror());
    material.mirror() != DVec3::ZERO
        || other().is_some_and(|mirror| mirror != DVec3::ZERO)
        || finish.is_some_and(|finish| finish.glass.is_some())
}

/// The solids as they stand in a row, kind after kind.
struct Standing<'a> {
    solids: &'a [Solid],
    sorted: &'a Sorted,
    row: Row,
}

impl Standing<'_> {
    /// In the order of the row.
    fn shapes(&self) -> impl Iterator<Item = &Shape> {
        let mut places = vec![];
        Kind::each(|kind| places.push(&self.sorted.of(kind)[..]));
        places.into_iter().flatten().map(|&place| &self.solids[place as usize].shape)
    }

    /// `boxes` are those of few bodies.
    fn lit_by<E: Real>(&self, sun: &Direction, search: Search, boxes: Option<&[Shape]>) -> Sunlight<E> {
        let sun = Sun::new(sun);
        let axes = sun.rounded();
        let bodies = boxes.map(|boxes| {
            let outlines: Vec<_> = boxes.iter().map(|of| Outline::new::<E>(of, axes)).collect();
            Outlines::new(&outlines, outlines.len().next_multiple_of(WIDEST))
        });
        let outlines = || {
            let shapes: Vec<&Shape> = self.shapes().collect();
            map(&shapes, |shape| Outline::new::<E>(*shape, axes))
        };
        Sunlight {
            obstacles: Obstacles::new(self.solids, self.sorted, axes),
            outlines: match search {
                Search::Masks => Outlines::new(&outlines(), MASKED),
                Search::Lists | Search::Tree => Outlines::default(),
            },
            buffer: match search {
                Search::Lists => LightBuffer::new(outlines(), self.row),
                Search::Masks | Search::Tree => None,
            },
            bodies,
            sun,
        }
    }
}
