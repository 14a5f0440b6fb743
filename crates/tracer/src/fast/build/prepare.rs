//! A scene as the kernels use it: arrays by kind, and constants computed in `f64` and rounded once.
//!
//! Values that are the same for all rays of a kind are computed here, not per lane. For rays from the eye and for rays
//! towards a sun, the tests of spheres and triangles reduce to a few products with such constants.

use std::sync::Arc;

use fearless_simd::Simd;
use glam::DVec3;
use rayfold_scene::{Material, Object, Scene};

use crate::RenderError;
use crate::fast::acceleration::candidates::{Candidates, MASKED, Masks};
use crate::fast::acceleration::light_buffer::LightBuffer;
use crate::fast::acceleration::lists::LISTED;
use crate::fast::acceleration::tree::{Tree, stump};
use crate::fast::arithmetic::real::Real;
use crate::fast::bodies::{ANY, Bodies};
use crate::fast::build::enclosures::{Enclosure, enclosures};
use crate::fast::build::extensions::Extensions;
use crate::fast::build::features::{BUILT, Needs};
use crate::fast::lights::sun::{Direction, Outline, Outlines, Sun};
use crate::fast::materials::fog::Fog;
use crate::fast::materials::glass::GlassBits;
use crate::fast::materials::sky::Sky;
use crate::fast::placement::geometry::Geometry;
use crate::fast::placement::tile_lists::TileLists;
use crate::fast::placement::window::{Grid, Window};
use crate::fast::rays::bounce::RayBatch;
use crate::fast::rays::bounding_cone::BoundingSpheres;
use crate::fast::rays::kind::{ByKind, Kind, Row};
use crate::fast::rays::pixels::{Pixels, Rays};
use crate::fast::rays::placed::RenderSpaceShape;
use crate::fast::rays::view::View;
use crate::fast::shapes::{Obstacles, Seen, Shape, Shapes, Solid, Sorted};
use crate::fast::shared::SharedSurfaces;
use crate::parallel::map;
use crate::parts;
use crate::pictures::Panorama;

/// The largest number of lanes in a packet.
const WIDEST: usize = 16;

/// The largest number of mirror planes behind which outlines are followed.
const MIRROR_PLANES: usize = 8;

/// The largest difference of the numbers of planes that count as one.
const SAME_PLANE: f64 = 16.0 * f64::EPSILON;

/// A sun, and every occluder as seen from it.
#[derive(Clone, Debug)]
pub(crate) struct Sunlight<E> {
    pub(crate) sun: Sun<E>,
    pub(crate) obstacles: Obstacles<E>,
    /// The outlines for finding possible occluders of a region, in scenes without a tree.
    pub(crate) outlines: Outlines<E>,
    /// The light buffer for scenes of many objects, if it helps.
    pub(crate) buffer: Option<LightBuffer>,
    /// The outlines of the bodies, if there are few.
    pub(crate) bodies: Option<Outlines<E>>,
}

/// The method of finding a scene's objects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Search {
    Masks,
    /// Lists, and the tree where lists would be long.
    Lists,
    Tree,
}

/// The object at a position in the script.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry<E> {
    pub(crate) kind: Kind,
    /// The index in the array of its kind.
    pub(crate) index: u32,
    pub(crate) mirrors: bool,
    /// Whether the object is a body.
    pub(crate) is_body: bool,
    pub(crate) ambient: [E; 3],
    pub(crate) diffuse: [E; 3],
    pub(crate) mirror: [E; 3],
}

/// All data that the kernels read.
#[derive(Debug)]
pub(crate) struct Prepared<E> {
    pub(crate) rays: Rays<E>,
    pub(crate) shapes: Shapes<E>,
    /// The number of objects of each kind, and their indices in the row that masks and lists use.
    counts: ByKind<usize>,
    row: Row,
    pub(crate) entries: Vec<Entry<E>>,
    pub(crate) suns: Vec<Sunlight<E>>,
    pub(crate) tree: Option<Arc<Tree<E>>>,
    /// The objects that each tile shows, for scenes of many objects, if it helps.
    pub(crate) sights: Option<TileLists>,
    /// The background, unclamped, for reflected rays. For a sky, its first colour.
    pub(crate) background: [E; 3],
    /// There is no background, so hits of camera rays are counted as cover.
    is_clear: bool,
    /// A background that depends on the ray's direction.
    sky: Option<Sky<E>>,
    /// A picture all around.
    panorama: Option<Panorama>,
    /// The features of the scene.
    pub(crate) needs: Needs,
    /// The features that few scenes use.
    pub(crate) beyond: Option<Extensions<E>>,
    /// The objects that share surfaces, if there are any.
    pub(crate) shared: Option<SharedSurfaces>,
    /// The bounding spheres of the objects of the row and of the bodies with bounding boxes, for scenes with glass and
    /// few objects.
    balls: Option<[BoundingSpheres; 2]>,
    /// The objects of glass, if shadow rays test them separately.
    glass_bits: Option<GlassBits>,
    /// The objects of glass within which rays can hit few other objects, by their orders, in scenes of few objects.
    enclosures: Vec<Option<Enclosure>>,
}

impl<E: Real> Prepared<E> {
    /// Prepares a scene. If there are more objects than a mask has bits, and `tree` forbids a tree, each kind is one
    /// leaf.
    ///
    /// # Errors
    /// Fails if the build leaves out a feature of the scene.
    pub(crate) fn new(
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
        let surroundings = scene.surroundings();
        let sky = Sky::new(surroundings);
        let panorama = Panorama::of(scene);
        let mut beyond = Extensions::new(scene, geometry);
        let shared = geometry.shared.clone().filter(|_| BUILT.beyond);
        needs.beyond = beyond.is_some() || sky.is_some() || panorama.is_some() || shared.is_some();
        needs.glass = beyond.as_ref().is_some_and(Extensions::has_glass);
        for (order, at) in beyond.iter().filter_map(Extensions::bodies).flat_map(|bodies| bodies.places()) {
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
            .then(|| TileLists::new(&geometry.view, standing.shapes(), row, grid, E::ROUNDOFF))
            .flatten();
        let glass_bits = beyond.as_mut().filter(|_| needs.glass && search == Search::Masks);
        let glass_bits = glass_bits.and_then(|beyond| beyond.part_glass(standing.orders()));
        let glass = beyond.as_ref().and_then(Extensions::glass).filter(|_| search == Search::Masks);
        let enclosures = glass.map(|glass| {
            let in_row: Vec<&Solid> = standing.in_row().collect();
            let has_inside = |order| glass.has_inside(E::narrow(f64::from(order)));
            enclosures(&in_row, (row, counts), has_inside)
        });
        let boxes = beyond.as_ref().and_then(Extensions::bodies).and_then(Bodies::boxes);
        let suns = geometry.suns.iter().map(|sun| standing.lit_by(sun, search, boxes)).collect();
        let balls = (needs.glass && search == Search::Masks).then(|| {
            let of_bodies = boxes.unwrap_or_default().iter().map(RenderSpaceShape::bounds);
            [
                BoundingSpheres::new(standing.shapes().map(RenderSpaceShape::bounds)),
                BoundingSpheres::new(of_bodies),
            ]
        });
        let tree = branches.map(|branches| {
            Arc::new(Tree::new(branches, solids, |place| entries[solids[place].order as usize].index))
        });
        let pixels = if scene.samples.most() > 1 { None } else { Pixels::of(&geometry.view) };
        let seen = Seen {
            pixels,
            suns: geometry.suns.iter().map(|sun| sun.towards).collect(),
            mirrors: if pixels.is_some() && needs.mirrors { mirror_planes(scene, solids) } else { vec![] },
        };
        let shapes = Shapes::new(solids, sorted, tree.clone().map(|tree| tree as _), seen);
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
            background: narrow(surroundings.colors().0),
            is_clear: scene.background.is_none(),
            sky,
            panorama,
            tree,
            sights,
            entries,
            beyond,
            shared,
            balls,
            glass_bits,
            enclosures: enclosures.unwrap_or_default(),
        })
    }

    /// Returns the boxes of the bodies that have bounding boxes, if there are few.
    pub(crate) fn boxes_of_bodies(&self) -> Option<&[Shape]> {
        self.beyond.as_ref()?.bodies()?.boxes()
    }

    /// Returns the bodies that a tile can show, as bits: those in a window of their boxes, or all.
    #[inline(always)]
    pub(crate) fn bodies_in(&self, window: Option<&Window>, (column, row): (usize, usize)) -> u64 {
        match (window, &self.beyond) {
            (Some(window), _) => window.candidates(column, row),
            (None, Some(beyond)) if beyond.bodies().is_some() => ANY,
            (None, _) => 0,
        }
    }

    /// Returns whether a tile that shows no objects except `bodies` is all background, of one colour.
    #[inline(always)]
    pub(crate) fn shows_nothing(&self, bodies: u64) -> bool {
        let has_planes = || self.beyond.as_ref().and_then(Extensions::bodies).is_some_and(Bodies::has_planes);
        self.is_plain() || bodies == 0 && self.has_one_backdrop() && !has_planes()
    }

    /// Returns whether the scene consists of objects in masks, lists and trees that share no surface, on a background
    /// of one colour.
    #[inline(always)]
    pub(crate) fn is_plain(&self) -> bool {
        !self.needs.beyond || !BUILT.beyond
    }

    /// Returns whether it has no background, so that pixels have a cover.
    #[inline(always)]
    pub(crate) fn is_clear(&self) -> bool {
        parts::BUILT.covers && self.is_clear
    }

    /// Returns the colour of camera rays that hit nothing; for a sky, its first colour.
    #[inline(always)]
    pub(crate) fn backdrop(&self) -> [E; 3] {
        if self.is_clear() { [E::narrow(0.0); 3] } else { self.background }
    }

    /// Returns its background, if it depends on the ray's direction.
    #[inline(always)]
    pub(crate) fn sky(&self) -> Option<&Sky<E>> {
        if parts::BUILT.skies { self.sky.as_ref() } else { None }
    }

    /// Returns the picture around it, if there is one.
    #[inline(always)]
    pub(crate) fn panorama(&self) -> Option<&Panorama> {
        if E::IS_DOUBLE && parts::BUILT.pictures { self.panorama.as_ref() } else { None }
    }

    /// Returns whether all camera rays that hit nothing have the same colour.
    #[inline(always)]
    fn has_one_backdrop(&self) -> bool {
        self.is_clear() || self.sky().is_none() && self.panorama().is_none()
    }

    /// Returns its fog, if it has any.
    #[inline(always)]
    pub(crate) fn fog(&self) -> Option<&Fog> {
        self.beyond.as_ref().and_then(Extensions::fog)
    }

    /// Returns whether it has glass.
    #[inline(always)]
    pub(crate) fn has_glass(&self) -> bool {
        E::IS_DOUBLE && BUILT.glass && self.needs.glass
    }

    /// Returns whether rays can be within objects of glass for which the nearby objects are known.
    #[inline(always)]
    pub(crate) fn has_enclosures(&self) -> bool {
        E::IS_DOUBLE && BUILT.glass && !self.enclosures.is_empty()
    }

    /// Returns the objects that rays can hit within the object of this order, if they are known.
    #[inline(always)]
    pub(crate) fn enclosure(&self, order: usize) -> Option<&Enclosure> {
        self.enclosures.get(order)?.as_ref()
    }

    /// Returns the objects of glass, if shadow rays test opaque objects first, and then glass.
    #[inline(always)]
    pub(crate) fn glass_apart(&self) -> Option<GlassBits> {
        if E::IS_DOUBLE && BUILT.glass { self.glass_bits } else { None }
    }

    /// Returns the objects that shadow rays test first, as bits: of the row of all objects, and of the bodies. These
    /// are all objects, or the opaque ones.
    #[inline(always)]
    pub(crate) fn asked_first(&self) -> [u64; 2] {
        match self.glass_apart() {
            Some(GlassBits { shapes, bodies }) => [!shapes, !bodies],
            None => [u64::MAX, ANY],
        }
    }

    /// Returns all objects: as masks, or as the whole tree.
    #[inline(always)]
    pub(crate) fn all(&self) -> Candidates<'static> {
        Candidates { masks: self.masks(u64::MAX), list: None, kinds: self.needs.kinds }
    }

    /// Returns the candidates of the rays of a queue, which is padded to whole packets: objects, and bodies as bits.
    #[inline(always)]
    pub(crate) fn met_by<S: Simd>(&self, simd: S, queue: &RayBatch<E>) -> (Candidates<'static>, u64) {
        let Some([shapes, bodies]) = &self.balls else { return (self.all(), ANY) };
        (Candidates::masked(self.masks(shapes.met_by(simd, queue))), bodies.met_by(simd, queue))
    }

    /// Returns the objects whose bits are set in a word with the order of the row of all objects.
    #[inline(always)]
    pub(crate) fn masks(&self, bits: u64) -> Masks {
        Masks::split(bits, self.row, self.counts)
    }
}

fn narrow<E: Real>(v: DVec3) -> [E; 3] {
    v.to_array().map(E::narrow)
}

/// Makes an entry. Its index is set once the solids are sorted; an object that can never be hit has none.
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

/// Returns the normals and heights of the mirror faces' planes, or none if there are many.
fn mirror_planes(scene: &Scene, solids: &[Solid]) -> Vec<(DVec3, f64)> {
    let mut planes: Vec<(DVec3, f64)> = vec![];
    for solid in solids.iter().filter(|solid| mirrors(scene.objects[solid.order as usize].material())) {
        for face in solid.shape.faces().map(|number| solid.shape.face(number)) {
            let is_known = planes.iter().any(|&(normal, height)| {
                (normal - face.normal).length() <= SAME_PLANE && (height - face.height).abs() <= SAME_PLANE
            });
            if !is_known {
                planes.push((face.normal, face.height));
            }
        }
        if planes.len() > MIRROR_PLANES {
            return vec![];
        }
    }
    planes
}

/// Returns whether it spawns rays, because it is glass, or a mirror in some place.
fn mirrors(material: &Material) -> bool {
    let finish = material.finish();
    let other = || finish?.pattern.map(|pattern| pattern.other.mirror());
    material.mirror() != DVec3::ZERO
        || other().is_some_and(|mirror| mirror != DVec3::ZERO)
        || finish.is_some_and(|finish| finish.glass.is_some())
}

/// The solids in a row, kind after kind.
struct Standing<'a> {
    solids: &'a [Solid],
    sorted: &'a Sorted,
    row: Row,
}

impl Standing<'_> {
    /// Returns the solids in the order of the row.
    fn in_row(&self) -> impl Iterator<Item = &Solid> {
        let mut places = vec![];
        Kind::each(|kind| places.push(&self.sorted.of(kind)[..]));
        places.into_iter().flatten().map(|&place| &self.solids[place as usize])
    }

    /// Returns the shapes in the order of the row.
    fn shapes(&self) -> impl Iterator<Item = &Shape> {
        self.in_row().map(|solid| &solid.shape)
    }

    /// Returns the positions in the script in the order of the row.
    fn orders(&self) -> impl Iterator<Item = u32> {
        self.in_row().map(|solid| solid.order)
    }

    /// Returns a sun and its occluders. `boxes` are those of the bodies, if there are few.
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
