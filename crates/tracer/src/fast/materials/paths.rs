//! The surfaces of a scene in which light goes round.

use glam::DVec3;
use rayfold_scene::{Glass, Object, Scene};

use crate::fast::placement::geometry::Geometry;
use crate::reference;
use crate::sampling::guide::Guide;
use crate::sampling::rough::Microfacets;

/// The surfaces of a scene in which light goes round.
#[derive(Debug)]
pub(crate) struct Paths {
    /// The glass of each object, and whether it has no inside.
    glass: Vec<Option<(Glass, bool)>>,
    /// The microfacets of each object that is rough; empty if none is.
    rough: Vec<Option<Microfacets>>,
    /// The guide of scattered rays to bright light.
    guide: Option<Guide>,
    /// The origin and the scale of the kernels' coordinates in the scene.
    center: DVec3,
    scale: f64,
}

impl Paths {
    /// Returns `None` for a scene in which light does not go round.
    pub(crate) fn new(scene: &Scene, geometry: &Geometry) -> Option<Self> {
        let faces = geometry.faces.as_deref();
        geometry.goes_round.then(|| {
            let glass = |(order, object): (usize, &Object)| {
                let glass = object.material().finish()?.glass?;
                let shape = match object {
                    Object::Instance(instance) => instance.object(),
                    shape => shape,
                };
                let is_filled = faces.is_some_and(|faces| faces.is_filled(order));
                Some((glass, !is_filled && !reference::has_inside(shape)))
            };
            let mut rough: Vec<_> =
                scene.objects.iter().map(|object| geometry.energies.microfacets(object)).collect();
            if rough.iter().all(Option::is_none) {
                rough.clear();
            }
            let glass = scene.objects.iter().enumerate().map(glass).collect();
            let &Geometry { center, scale, .. } = geometry;
            Self { glass, rough, guide: geometry.guide.clone(), center, scale }
        })
    }

    /// Returns the glass of the object with this order, and whether it has no inside; `None` if it is opaque.
    #[inline(always)]
    pub(crate) fn glass(&self, order: usize) -> Option<(Glass, bool)> {
        self.glass[order]
    }

    /// Returns the microfacets of the object with this order, unless it is smooth.
    #[inline(always)]
    pub(crate) fn microfacets(&self, order: usize) -> Option<&Microfacets> {
        self.rough.get(order)?.as_ref()
    }

    /// Returns the guide of scattered rays to bright light.
    #[inline(always)]
    pub(crate) fn guide(&self) -> Option<&Guide> {
        self.guide.as_ref()
    }

    /// Converts a point from the kernels' coordinates to the scene.
    #[inline(always)]
    pub(crate) fn in_scene(&self, place: DVec3) -> DVec3 {
        place / self.scale + self.center
    }

    /// Returns whether any object is rough.
    #[inline(always)]
    pub(crate) fn has_rough(&self) -> bool {
        !self.rough.is_empty()
    }
}
