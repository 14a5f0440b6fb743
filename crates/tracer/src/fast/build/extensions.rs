//! Features that few scenes use: other shapes, lamps, highlights, patterns, glass, fog. Separate code draws them, so that
//! scenes without them run no extra instructions. All but the faces of meshes are drawn in `f64`.

use rayfold_scene::Scene;

use crate::fast::arithmetic::real::Real;
use crate::fast::bodies::Bodies;
use crate::fast::build::features::BUILT;
use crate::fast::lights::lamp::Lamp;
use crate::fast::materials::faces::ShadedFaces;
use crate::fast::materials::finish::Finishes;
use crate::fast::materials::fog::Fog;
use crate::fast::materials::glass::{Glass, GlassBits};
use crate::fast::materials::paths::Paths;
use crate::fast::placement::geometry::Geometry;
use crate::parts;

/// The features that few scenes use.
#[derive(Debug)]
pub(crate) struct Extensions<E> {
    bodies: Option<Bodies<E>>,
    lamps: Vec<Lamp<E>>,
    finishes: Option<Finishes>,
    glass: Option<Glass<E>>,
    fog: Option<Fog>,
    shaded: Option<ShadedFaces<E>>,
    paths: Option<Paths>,
}

impl<E: Real> Extensions<E> {
    /// Returns `None` for a scene that uses none of these features.
    pub(crate) fn new(scene: &Scene, geometry: &Geometry) -> Option<Self> {
        is_needed(geometry).then(|| Self {
            bodies: (!geometry.bodies.is_empty())
                .then(|| Bodies::new(&geometry.bodies, &scene.objects, geometry.holes.as_ref())),
            lamps: geometry.lamps.iter().map(Lamp::new).collect(),
            finishes: Finishes::new(scene, geometry),
            glass: Glass::new(scene, geometry.faces.as_deref()),
            fog: Fog::new(scene, geometry.scale),
            shaded: ShadedFaces::new(scene, geometry),
            paths: Paths::new(scene, geometry),
        })
    }

    /// Returns the bodies, if there are any.
    #[inline(always)]
    pub(crate) fn bodies(&self) -> Option<&Bodies<E>> {
        if E::IS_DOUBLE { self.bodies.as_ref() } else { None }
    }

    /// Returns the glass, if there is any.
    #[inline(always)]
    pub(crate) fn glass(&self) -> Option<&Glass<E>> {
        if E::IS_DOUBLE && BUILT.glass { self.glass.as_ref() } else { None }
    }

    /// Makes shadow rays test glass separately from opaque objects. `orders` are those of the row of all objects.
    /// Returns the objects of glass, or `None` if the bodies cannot be separated.
    pub(crate) fn part_glass(&mut self, orders: impl Iterator<Item = u32>) -> Option<GlassBits> {
        let glass = self.glass.as_ref()?;
        let is_glass = |order: E| glass.of(order).is_some();
        let bits = orders
            .enumerate()
            .map(|(bit, order)| u64::from(is_glass(E::narrow(f64::from(order)))) << bit)
            .sum();
        let bodies = match &mut self.bodies {
            Some(bodies) => bodies.part_glass(is_glass)?,
            None => 0,
        };
        Some(GlassBits { shapes: bits, bodies })
    }

    /// Returns the fog, if there is any.
    #[inline(always)]
    pub(crate) fn fog(&self) -> Option<&Fog> {
        if E::IS_DOUBLE && parts::BUILT.fogs { self.fog.as_ref() } else { None }
    }

    /// Returns the faces of meshes, if any of them has data beyond its triangle.
    #[inline(always)]
    pub(crate) fn shaded(&self) -> Option<&ShadedFaces<E>> {
        if parts::BUILT.meshes { self.shaded.as_ref() } else { None }
    }

    /// Returns the surfaces that scatter paths, if light goes round.
    #[inline(always)]
    pub(crate) fn paths(&self) -> Option<&Paths> {
        if E::IS_DOUBLE && parts::BUILT.paths { self.paths.as_ref() } else { None }
    }

    #[inline(always)]
    pub(crate) fn lamps(&self) -> &[Lamp<E>] {
        if E::IS_DOUBLE && parts::BUILT.lamps { &self.lamps } else { &[] }
    }

    #[inline(always)]
    fn finishes(&self) -> Option<&Finishes> {
        if E::IS_DOUBLE { self.finishes.as_ref() } else { None }
    }

    /// Returns the finishes, if any surface has highlights.
    #[inline(always)]
    pub(crate) fn glossy(&self) -> Option<&Finishes> {
        let has_highlights = |finishes: &&Finishes| parts::BUILT.highlights && finishes.has_highlights;
        self.finishes().filter(|finishes| has_highlights(finishes) || self.has_rough())
    }

    /// Returns the finishes, if any surface has a pattern or a picture, or if highlights need the mirror coefficients.
    #[inline(always)]
    pub(crate) fn patterned(&self) -> Option<&Finishes> {
        let has_patterns =
            |finishes: &&Finishes| (parts::BUILT.patterns || parts::BUILT.pictures) && finishes.has_patterns;
        self.finishes().filter(|finishes| has_patterns(finishes) || self.has_rough())
    }

    /// Returns the surfaces of paths, if any is rough.
    #[inline(always)]
    pub(crate) fn rough(&self) -> Option<&Paths> {
        self.paths().filter(|paths| paths.has_rough())
    }

    #[inline(always)]
    fn has_rough(&self) -> bool {
        self.rough().is_some()
    }

    /// Returns the finishes, if any surface glows.
    #[inline(always)]
    pub(crate) fn glowing(&self) -> Option<&Finishes> {
        self.finishes().filter(|finishes| parts::BUILT.glows && finishes.glows())
    }

    pub(crate) fn has_glass(&self) -> bool {
        self.glass.is_some()
    }
}

/// Returns whether the scene uses any of these features.
fn is_needed(geometry: &Geometry) -> bool {
    needs_double(geometry) || geometry.faces.is_some()
}

/// Returns whether the scene uses any of these features that are drawn in `f64`: all except the normals of meshes.
pub(crate) fn needs_double(geometry: &Geometry) -> bool {
    !geometry.bodies.is_empty()
        || !geometry.lamps.is_empty()
        || geometry.is_finished
        || geometry.is_foggy
        || geometry.goes_round
        || geometry.are_distinct()
}
