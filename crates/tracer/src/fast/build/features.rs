//! The features that scenes have beyond spheres, and the variants of steps that are compiled for them.
//!
//! A step is compiled for a few sets of kinds, so that a tile runs no test for kinds that it cannot contain: see
//! [`Variant`]. A constant here removes a feature that a build leaves out (a cargo feature of this crate) from every
//! step. A scene that needs it is rejected.

use core::marker::PhantomData;

use crate::RenderError;
use crate::fast::arithmetic::real::Real;
use crate::fast::rays::kind::{ByKind, Kind};
use crate::fast::shapes::Formulas;

/// The features of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Needs {
    pub(crate) kinds: ByKind<bool>,
    pub(crate) mirrors: bool,
    /// Whether there are lights and possible occluders: any object except a single opaque sphere seen from outside.
    pub(crate) shadows: bool,
    /// Whether there are more objects than a mask has bits.
    pub(crate) tree: bool,
    /// Whether the scene has more than objects of these kinds, suns, and a background of one colour.
    pub(crate) beyond: bool,
    pub(crate) glass: bool,
}

/// The features of this build.
pub(crate) const BUILT: Needs = Needs {
    kinds: ByKind { spheres: true, cuboids: cfg!(feature = "boxes"), triangles: cfg!(feature = "triangles") },
    mirrors: cfg!(feature = "mirrors"),
    shadows: cfg!(feature = "shadows"),
    tree: cfg!(feature = "tree"),
    beyond: cfg!(feature = "beyond"),
    glass: cfg!(feature = "glass"),
};

impl Needs {
    /// Rejects a scene whose features this build lacks.
    ///
    /// # Errors
    /// Fails if the build lacks a feature of the scene.
    pub(crate) fn check(self) -> Result<(), RenderError> {
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

/// Returns the cargo feature of a kind.
fn feature(kind: Kind) -> &'static str {
    match kind {
        Kind::Sphere => unreachable!("spheres are in every build"),
        Kind::Cuboid => "boxes",
        Kind::Triangle => "triangles",
    }
}

/// The abilities of a variant of a step. An ability that it lacks is not compiled into its loops.
pub(crate) trait Features<E: Real>: 'static {
    /// The intersection tests of the shapes.
    type By: Formulas<E>;

    /// The kinds that it searches.
    const KINDS: ByKind<bool>;

    /// Whether it searches lists and a tree instead of masks.
    const TREE: bool;

    /// Whether surfaces can be those of bodies.
    const BODIES: bool = false;

    /// Returns a kind that is one of [`Self::KINDS`], so that the compiler can rely on it.
    #[inline(always)]
    fn one_of_these(kind: Kind) -> Kind {
        debug_assert!(*Self::KINDS.of(kind), "{kind:?} was not looked for");
        if *Self::KINDS.of(kind) { kind } else { Kind::Sphere }
    }
}

/// A variant of a step that searches spheres and the kinds given.
///
/// Each combination of the most common kinds has its own variant. A rarer kind adds no variant: it uses the one that
/// searches all kinds.
pub(crate) struct Variant<By, const CUBOIDS: bool, const TRIANGLES: bool, const TREE: bool>(PhantomData<By>);

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

/// The variant for all kinds, with any number of objects.
pub(crate) type Everything<By> = Variant<By, true, true, true>;

/// The variant for all kinds, with any number of objects, and for bodies.
pub(crate) struct Anything<By>(PhantomData<By>);

impl<E: Real, By: Formulas<E>> Features<E> for Anything<By> {
    type By = By;

    const KINDS: ByKind<bool> = BUILT.kinds;
    const TREE: bool = BUILT.tree;
    const BODIES: bool = true;
}

/// A kernel: the code that draws pictures.
pub(crate) trait Kernel<E: Real>: 'static {
    type By: Formulas<E>;

    /// Whether each tile is drawn by the variants for its kinds, instead of [`Everything`].
    const FITTED: bool;
}

/// The kernel for the instruction sets of current machines.
#[cfg_attr(
    all(test, target_arch = "x86_64", feature = "narrow"),
    expect(dead_code, reason = "the crate's own tests are compiled for the narrowest instruction set alone")
)]
pub(crate) struct FullKernel<By>(PhantomData<By>);

impl<E: Real, By: Formulas<E>> Kernel<E> for FullKernel<By> {
    type By = By;
    // A browser loads the kernel from a network.
    const FITTED: bool = !cfg!(target_arch = "wasm32");
}

/// The kernel for the instruction sets of old machines: smaller, and somewhat slower.
#[cfg(all(target_arch = "x86_64", feature = "narrow"))]
pub(crate) struct CompactKernel<By>(PhantomData<By>);

#[cfg(all(target_arch = "x86_64", feature = "narrow"))]
impl<E: Real, By: Formulas<E>> Kernel<E> for CompactKernel<By> {
    type By = By;
    const FITTED: bool = false;
}

/// Calls a step in the variant for the kinds that are searched.
/// `fitted!(N, kinds, C T => step::<Variant<By, C, T, false>>(...))` evaluates the call with the constants `C` and `T`
/// of that variant, in the kernel `N`. For a step that itself searches objects, the variant also depends on whether it
/// searches lists and a tree: `fitted!(N, kinds, tree, C T D => ...)`.
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
            // Kinds that are not named here use the variant for all kinds.
            let $crate::fast::rays::kind::ByKind { spheres: _, cuboids, triangles } = $kinds;
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

pub(crate) use fitted;
