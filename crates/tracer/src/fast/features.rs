//! What scenes have beyond spheres, and the kernels that are made for it.
//!
//! The one place that knows the crate's cargo features: a constant here takes what is left out of a build out of every
//! kernel, and a scene that needs it is refused.

use super::intersect::Formulas;
use crate::RenderError;

/// What a scene has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Needs {
    pub(super) cuboids: bool,
    pub(super) triangles: bool,
    pub(super) mirrors: bool,
    /// Lights, and something to stand in their way: all but an opaque sphere alone, seen from outside.
    pub(super) shadows: bool,
    /// More objects than masks have bits.
    pub(super) tree: bool,
}

/// What this build has.
pub(super) const BUILT: Needs = Needs {
    cuboids: cfg!(feature = "boxes"),
    triangles: cfg!(feature = "triangles"),
    mirrors: cfg!(feature = "mirrors"),
    shadows: cfg!(feature = "shadows"),
    tree: cfg!(feature = "tree"),
};

impl Needs {
    /// # Errors
    /// When the build lacks what the scene has.
    pub(super) fn check(self) -> Result<(), RenderError> {
        let lacks = [
            (self.cuboids && !BUILT.cuboids, "boxes"),
            (self.triangles && !BUILT.triangles, "triangles"),
            (self.mirrors && !BUILT.mirrors, "mirrors"),
            (self.shadows && !BUILT.shadows, "shadows"),
            (self.tree && !BUILT.tree, "tree"),
        ];
        match lacks.into_iter().find(|(lacks, _)| *lacks) {
            Some((_, feature)) => Err(RenderError::LeftOut { feature }),
            None => Ok(()),
        }
    }
}

/// What a kernel can draw; what it cannot is not compiled into its loops.
pub(super) trait Features: Formulas + 'static {
    const CUBOIDS: bool;
    const TRIANGLES: bool;
    const MIRRORS: bool;
    const SHADOWS: bool;
    const TREE: bool;

    /// The same with mirrors, for what mirrors make no difference to.
    type WithMirrors: Features;

    /// The same with a tree, for what a tree makes no difference to.
    type WithTree: Features;
}

/// A kernel that can draw spheres and what it says.
pub(super) struct Kernel<const CUBOIDS: bool, const TRIANGLES: bool, const MIRRORS: bool, const TREE: bool>;

impl<const CUBOIDS: bool, const TRIANGLES: bool, const MIRRORS: bool, const TREE: bool> Formulas
    for Kernel<CUBOIDS, TRIANGLES, MIRRORS, TREE>
{
}

impl<const CUBOIDS: bool, const TRIANGLES: bool, const MIRRORS: bool, const TREE: bool> Features
    for Kernel<CUBOIDS, TRIANGLES, MIRRORS, TREE>
{
    const CUBOIDS: bool = CUBOIDS && BUILT.cuboids;
    const TRIANGLES: bool = TRIANGLES && BUILT.triangles;
    const MIRRORS: bool = MIRRORS && BUILT.mirrors;
    const SHADOWS: bool = BUILT.shadows;
    const TREE: bool = TREE && BUILT.tree;

    type WithMirrors = Kernel<CUBOIDS, TRIANGLES, true, TREE>;
    type WithTree = Kernel<CUBOIDS, TRIANGLES, MIRRORS, true>;
}

/// Spheres, as many as masks have bits.
pub(super) type Spheres = Kernel<false, false, false, false>;

/// All kinds, as many as masks have bits.
#[cfg(feature = "accuracy")]
pub(super) type Solids = Kernel<true, true, true, false>;

/// Triangles and spheres that mirror nothing, any number.
#[cfg(feature = "accuracy")]
pub(super) type Mesh = Kernel<false, true, false, true>;

/// All kinds, any number.
pub(super) type Everything = Kernel<true, true, true, true>;
