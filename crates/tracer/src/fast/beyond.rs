//! What few scenes have beyond spheres, boxes, triangles and suns: steps of their own draw it, so that the others pay
//! nothing for it.

use rayfold_scene::Scene;

use super::bodies::Bodies;
use super::features::BUILT;
use super::finish::Finishes;
use super::geometry::Geometry;
use super::glass::Glass;
use super::lights::lamp::Lamp;
use super::parts;
use super::real::Real;

/// What few scenes have.
#[derive(Debug)]
pub(super) struct Beyond<E> {
    bodies: Option<Bodies<E>>,
    lamps: Vec<Lamp<E>>,
    finishes: Option<Finishes>,
    glass: Option<Glass<E>>,
}

impl<E: Real> Beyond<E> {
    /// None for scenes that have nothing of it.
    pub(super) fn new(scene: &Scene, geometry: &Geometry) -> Option<Self> {
        is_needed(geometry).then(|| Self {
            bodies: (!geometry.bodies.is_empty()).then(|| Bodies::new(&geometry.bodies)),
            lamps: geometry.lamps.iter().map(Lamp::new).collect(),
            finishes: Finishes::new(scene, geometry),
            glass: Glass::new(scene),
        })
    }

    /// Its bodies, if it has any.
    #[inline(always)]
    pub(super) fn bodies(&self) -> Option<&Bodies<E>> {
        self.bodies.as_ref()
    }

    /// Its glass, if it has any.
    #[inline(always)]
    pub(super) fn glass(&self) -> Option<&Glass<E>> {
        if BUILT.glass { self.glass.as_ref() } else { None }
    }

    #[inline(always)]
    pub(super) fn lamps(&self) -> &[Lamp<E>] {
        if parts::BUILT.lamps { &self.lamps } else { &[] }
    }

    /// Its surfaces, if any has highlights.
    #[inline(always)]
    pub(super) fn glossy(&self) -> Option<&Finishes> {
        self.finishes.as_ref().filter(|finishes| parts::BUILT.highlights && finishes.has_highlights)
    }

    /// Its surfaces, if any has a pattern.
    #[inline(always)]
    pub(super) fn patterned(&self) -> Option<&Finishes> {
        self.finishes.as_ref().filter(|finishes| parts::BUILT.patterns && finishes.has_patterns)
    }

    pub(super) fn has_glass(&self) -> bool {
        self.glass.is_some()
    }
}

/// Whether the scene has something of it; it is drawn in `f64`, then.
pub(super) fn is_needed(geometry: &Geometry) -> bool {
    !geometry.bodies.is_empty() || !geometry.lamps.is_empty() || geometry.is_finished
}
