//! What scenes have beyond spheres, and the variants of steps that are made for it.
//!
//! A step is compiled for a few sets of kinds, so that a tile does not pay for looking for what cannot be in it: see
//! [`Variant`]. A constant here takes what is left out of a build (a cargo feature of this crate) out of every step, and a
//! scene that needs it is refused.

use core::marker::PhantomData;

use super::kind::{ByKind, Kind};
use super::real::Real;
use super::shapes::Formulas;
use crate::RenderError;

/// What a scene has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Needs {
    pub(super) kinds: ByKind<bool>,
    pub(super) mirrors: bool,
    /// Lights, and something to stand in their way: all but an opaque sphere alone, seen from outside.
    pub(super) shadows: bool,
    /// More objects than masks have bits.
    pub(super) tree: bool,
    /// More than objects of these kinds, suns, and a background of one colour.
    pub(super) beyond: bool,
    pub(super) glass: bool,
}

/// What this build has.
pub(super) const BUILT: Needs = Needs {
    kinds: ByKind { spheres: true, cuboids: cfg!(feature = "boxes"), triangles: cfg!(feature = "triangles") },
    mirrors: cfg!(feature = "mirrors"),
    shadows: cfg!(feature = "shadows"),
    tree: cfg!(feature = "tree"),
    beyond: cfg!(feature = "beyond"),
    glass: cfg!(feature = "glass"),
};

impl Needs {
    /// # Errors
    /// When the build lacks what the scene has.
    pub(super) fn check(self) -> Result<(), RenderError> {
        let mut missing = None;
        Kind::each(|kind| {
            if *self.kinds.of(kind) && !*BUILT.kinds.of(kind) {
                missing = missing.or(Some(feature(kind)));
            }
        });
        let lacks = [
            (self.mirrors && !BUILT.mirrors, "mirrors"),
            (self.shadows && !BUILT.shadows, "shadows"),
            (self.tree && !BUILT.tree, "tree"),
            (self.beyond && !BUILT.beyond, "beyond"),
            (self.glass && !BUILT.glass, "glass"),
        ];
        let missing = missing.or(lacks.into_iter().find(|(lacks, _)| *lacks).map(|(_, feature)| feature));
        missing.map_or(Ok(()), |feature| Err(RenderError::LeftOut { feature }))
    }
}

/// The cargo feature that a kind comes with.
fn feature(kind: Kind) -> &'static str {
    match kind {
        Kind::Sphere => unreachable!("spheres are in every build"),
        Kind::Cuboid => "boxes",
        Kind::Triangle => "triangles",
    }
}

/// What a variant of a step can do; what it cannot is not compiled into its loops.
pub(super) trait Features<E: Real>: 'static {
    /// The tests by which rays meet shapes.
    type By: Formulas<E>;

    /// The kinds that it looks for.
    const KINDS: ByKind<bool>;

    /// Whether it looks on lists and down a tree, and not by masks.
    const TREE: bool;

    /// Whether surfaces can be those of bodies.
    const BODIES: bool = false;

    /// A kind that is one of [`Self::KINDS`], so that the compiler knows that it is.
    #[inline(always)]
    fn one_of_these(kind: Kind) -> Kind {
        debug_assert!(*Self::KINDS.of(kind), "{kind:?} was not looked for");
        if *Self::KINDS.of(kind) { kind } else { Kind::Sphere }
    }
}

/// A variant of a step: one that looks for spheres and what it says.
///
/// The kinds that scenes have most have variants for each company that they come in. A kind that is rarer adds none: it
/// goes with the one that looks for all.
pub(super) struct Variant<By, const CUBOIDS: bool, const TRIANGLES: bool, const TREE: bool>(PhantomData<By>);

impl<E: Real, By: Formulas<E>, const CUBOIDS: bool, const TRIANGLES: bool, const TREE: bool> Features<E>
    for Variant<By, CUBOIDS, TRIANGLES, TREE>
{
    type By = By;

    const KINDS: ByKind<bool> = ByKind {
        spheres: true,
        cuboids: CUBOIDS && BUILT.kinds.cuboids,
        triangles: TRIANGLES && BUILT.kinds.triangles,
    };
    const TREE: bool = TREE && BUILT.tree;
}

/// All kinds, any number.
pub(super) type Everything<By> = Variant<By, true, true, true>;

/// All kinds, any number, and bodies.
pub(super) struct Anything<By>(PhantomData<By>);

impl<E: Real, By: Formulas<E>> Features<E> for Anything<By> {
    type By = By;

    const KINDS: ByKind<bool> = BUILT.kinds;
    const TREE: bool = BUILT.tree;
    const BODIES: bool = true;
}

/// What pictures are drawn with.
pub(super) trait Kernel<E: Real>: 'static {
    type By: Formulas<E>;

    /// Whether each tile is drawn by the variants that fit it, and not all by [`Everything`].
    const FITTED: bool;
}

/// The kernel of instruction sets that machines have today.
pub(super) struct Fitted<By>(PhantomData<By>);

impl<E: Real, By: Formulas<E>> Kernel<E> for Fitted<By> {
    type By = By;
    const FITTED: bool = true;
}

/// The kernel of those that only old machines are without: smaller, and somewhat slower.
#[cfg(all(target_arch = "x86_64", feature = "narrow"))]
pub(super) struct Unfitted<By>(PhantomData<By>);

#[cfg(all(target_arch = "x86_64", feature = "narrow"))]
impl<E: Real, By: Formulas<E>> Kernel<E> for Unfitted<By> {
    type By = By;
    const FITTED: bool = false;
}

/// Calls a step in the variant that fits the kinds that are looked for: `fitted!(N, kinds, C T => step::<Variant<By, C, T,
/// false>>(...))` evaluates the last with the constants `C` and `T` of that variant, in the kernel `N`. A step that looks
/// for objects itself also fits whether it does on lists and down a tree: `fitted!(N, kinds, tree, C T D => ...)`.
macro_rules! fitted {
    ($kernel:ident, $kinds:expr, $tree:expr, $c:ident $t:ident $d:ident => $step:expr) => {
        if $kernel::FITTED && !$tree {
            const $d: bool = false;
            fitted!($kernel, $kinds, $c $t => $step)
        } else {
            const $d: bool = true;
            fitted!($kernel, $kinds, $c $t => $step)
        }
    };
    ($kernel:ident, $kinds:expr, $c:ident $t:ident => $step:expr) => {
        if $kernel::FITTED {
            // Kinds that are not named here are looked for by what looks for all.
            let $crate::fast::kind::ByKind { spheres: _, cuboids, triangles } = $kinds;
            match (cuboids, triangles) {
                (false, false) => fitted!(@ $c false, $t false => $step),
                (false, true) => fitted!(@ $c false, $t true => $step),
                (true, false) => fitted!(@ $c true, $t false => $step),
                (true, true) => fitted!(@ $c true, $t true => $step),
            }
        } else {
            fitted!(@ $c true, $t true => $step)
        }
    };
    (@ $c:ident $cuboids:literal, $t:ident $triangles:literal => $step:expr) => {{
        const $c: bool = $cuboids;
        const $t: bool = $triangles;
        $step
    }};
}

pub(super) use fitted;
