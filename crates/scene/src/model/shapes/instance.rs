//! Objects of a group, where a `Use` draws them.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::Object;
use crate::model::invalid::InvalidValue;
use crate::model::material::Material;
use crate::shared_slice::SharedSlice;

/// Moves, turns and scales: p' = t + s·R·p.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    translation: DVec3,
    rotation: DMat3,
    scale: f64,
}

impl Placement {
    /// A `rotation` is orthonormal, with determinant 1; the `scale` is greater than zero.
    ///
    /// # Errors
    /// When the scale is not positive or a number is not finite.
    pub fn new(translation: DVec3, rotation: DMat3, scale: f64) -> Result<Self, InvalidValue> {
        use crate::model::invalid::{Parameter, finite, positive};
        finite(Parameter::Translation, translation)?;
        positive(Parameter::Scale, scale)?;
        Ok(Self { translation, rotation, scale })
    }

    /// t.
    pub fn translation(&self) -> DVec3 {
        self.translation
    }

    /// R.
    pub fn rotation(&self) -> DMat3 {
        self.rotation
    }

    /// s, greater than zero.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Where a point of the group lies in the world.
    pub fn point(&self, p: DVec3) -> DVec3 {
        self.translation + self.scale * (self.rotation * p)
    }

    /// Where a point of the world lies in the group.
    pub fn local_point(&self, p: DVec3) -> DVec3 {
        (self.rotation.transpose() * (p - self.translation)) / self.scale
    }

    /// This one within another: first this, then `outer`.
    ///
    /// # Errors
    /// When a number leaves the range of those that are finite, or the scale vanishes.
    pub fn within(&self, outer: &Self) -> Result<Self, InvalidValue> {
        Self::new(outer.point(self.translation), outer.rotation * self.rotation, outer.scale * self.scale)
    }
}

/// An object of a group, as one `Use` of it draws it. The numbers of the object are those of the group.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// Of the group, none of them an instance.
    objects: SharedSlice<Object>,
    index: usize,
    placement: Arc<Placement>,
}

impl Instance {
    /// Object `index` of the group's `objects`, moved by `placement`.
    ///
    /// # Panics
    /// When there is no such object, or it is an instance itself.
    pub fn new(objects: &SharedSlice<Object>, index: usize, placement: &Arc<Placement>) -> Self {
        assert!(!matches!(objects[index], Object::Instance(_)), "an instance of an instance");
        Self { objects: objects.clone(), index, placement: placement.clone() }
    }

    /// The object, with the numbers that it has in its group; never an instance.
    pub fn object(&self) -> &Object {
        &self.objects[self.index]
    }

    /// From the group's coordinates to the world's.
    pub fn placement(&self) -> &Placement {
        &self.placement
    }

    /// How its surface answers light; a pattern lies in the group's coordinates.
    pub fn material(&self) -> &Material {
        self.object().material()
    }

    pub(super) fn placed(&self, scale: f64, place: impl Fn(DVec3) -> DVec3) -> Result<Self, InvalidValue> {
        let Placement { translation, rotation, scale: own } = *self.placement;
        let placement = Placement::new(place(translation), rotation, scale * own)?;
        Ok(Self { placement: Arc::new(placement), ..self.clone() })
    }
}
