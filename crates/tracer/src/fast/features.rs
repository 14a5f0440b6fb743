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
const BUILT: Needs = Needs {
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
}

macro_rules! kernels {
    ($($(#[$doc:meta])* $name:ident: $cuboids:literal, $triangles:literal, $mirrors:literal, $shadows:literal, $tree:literal;)*) => {
        $(
            $(#[$doc])*
            pub(super) struct $name;

            impl Formulas for $name {}

            impl Features for $name {
                const CUBOIDS: bool = $cuboids && BUILT.cuboids;
                const TRIANGLES: bool = $triangles && BUILT.triangles;
                const MIRRORS: bool = $mirrors && BUILT.mirrors;
                const SHADOWS: bool = $shadows && BUILT.shadows;
                const TREE: bool = $tree && BUILT.tree;
            }
        )*
    };
}

kernels! {
    // boxes, triangles, mirrors, shadows, tree
    /// Spheres that mirror nothing.
    Balls: false, false, false, true, false;
    /// Spheres, some of them mirrors.
    Mirrors: false, false, true, true, false;
    /// All kinds, as many as masks have bits.
    Solids: true, true, true, true, false;
    /// Triangles and spheres that mirror nothing, any number.
    Mesh: false, true, false, true, true;
    /// All kinds, any number.
    Everything: true, true, true, true, true;
}
