//! Inputs that are known to be difficult for ray tracers, each with a figure and its bound.
//!
//! The table [`CASES`] lists them. A case measures every backend and reports its error relative to the bound. The right
//! result is that of the [oracle](crate::oracle); an image may also be compared with another one of the same backend.
//! Rays and positions are exact in `f32`, unless the case is about others, so a figure is the error of tracing and not
//! that of rounding the input. All random numbers derive from [`SEED`].

mod bounces;
mod boxes;
mod chosen;
mod crowds;
mod curved;
mod everyday;
mod everything;
mod extremes;
mod figures;
mod images;
mod nasty;
mod report;
mod searched;
mod setup;
mod spheres;
mod ties;
mod triangles;

use anyhow::{Context, Result};
use fastrand::Rng;
use rayfold_scene::Scene;

use crate::backends::Backend;

pub(crate) use everything::{fog_scaled, scaled};
pub use figures::{Figure, Size};
pub(crate) use nasty::{exact_at, is_wrong_at, one_of_each};
pub use report::{Report, Run};

use figures::Figures;

/// The seed of all random numbers of the cases.
pub const SEED: u64 = 20_240_607;

/// A hard case.
pub struct Case {
    /// The number of the case.
    pub number: &'static str,
    /// The difficulty.
    pub title: &'static str,
    /// The required result.
    pub asked: &'static str,
    run: fn(&[Backend], Size, &mut Figures) -> Result<()>,
}

/// The first of the cases that need version 2 of the language, which tracers with textbook formulas do not support.
const FIRST_OF_VERSION_2: u32 = 28;

impl Case {
    /// Returns whether version 1 of the language has all features that the case uses.
    pub(crate) fn is_of_version_1(&self) -> bool {
        let first = self.number.split('-').next().and_then(|number| number.parse::<u32>().ok());
        first.is_some_and(|number| number < FIRST_OF_VERSION_2)
    }

    /// Measures every tracer.
    ///
    /// # Errors
    /// Fails if a scene cannot be built or rendered.
    pub fn figures(&self, backends: &[Backend], size: Size) -> Result<Vec<Figure>> {
        let mut figures = Figures::default();
        (self.run)(backends, size, &mut figures).with_context(|| format!("case {}", self.number))?;
        Ok(figures.0)
    }
}

/// Returns the random scene of a seed and its name. The kinds take turns.
pub(crate) fn random_scene(seed: u64) -> Result<(&'static str, Scene)> {
    let kinds = [everything::KINDS, nasty::KINDS, everyday::KINDS].concat();
    let (name, make) = kinds[(seed % kinds.len() as u64) as usize];
    Ok((name, make(&mut Rng::with_seed(seed))?))
}

/// All hard cases.
pub const CASES: &[Case] = &[
    Case {
        number: "1-2",
        title: "a sphere at 10 to 1e6 radii",
        asked: "hits and misses right except within 4 ulp of the distance beside the limb, relative error of distances \
         at most 1e-6 (f64: 1e-8 of the radius)",
        run: spheres::distant,
    },
    Case {
        number: "3",
        title: "a sphere of radius 1e7 from height 1",
        asked: "relative error of the distance to the ground at most 5e-6, down to the horizon",
        run: spheres::horizon,
    },
    Case {
        number: "4",
        title: "tangent rays",
        asked: "hits and misses right except within 4 ulp of the radius, along the axes and askew",
        run: spheres::tangent,
    },
    Case {
        number: "5",
        title: "an origin on or in a sphere or box",
        asked: "the right one of two roots",
        run: spheres::inside,
    },
    Case {
        number: "6",
        title: "radii 1e7 : 1 in one scene",
        asked: "each pixel shows an object that the oracle sees within half a pixel of it",
        run: spheres::giant_and_dwarf,
    },
    Case {
        number: "7",
        title: "scaled by powers of two",
        asked: "the same picture bit for bit",
        run: images::scaled_by_two,
    },
    Case {
        number: "8",
        title: "scaled by powers of ten",
        asked: "the same picture except for 0.05 % of its pixels",
        run: images::scaled_by_ten,
    },
    Case {
        number: "9",
        title: "a scene of size 1 at offset 1e6",
        asked: "the same picture except for 0.05 % of its pixels",
        run: images::far_from_the_origin,
    },
    Case {
        number: "10",
        title: "shared edges",
        asked: "no ray slips through a closed surface at an edge",
        run: triangles::shared_edges,
    },
    Case {
        number: "11",
        title: "shared vertices",
        asked: "no ray slips through a closed surface at a corner",
        run: triangles::shared_vertices,
    },
    Case {
        number: "12",
        title: "a needle triangle 1e6 : 1",
        asked: "hits and misses right except within 4 ulp of the edge, distances to 16 ulp",
        run: triangles::needles,
    },
    Case {
        number: "13",
        title: "degenerate triangles",
        asked: "never hit, and a warning by the parser",
        run: triangles::degenerate,
    },
    Case {
        number: "14",
        title: "rays in a triangle's plane",
        asked: "never a hit",
        run: triangles::in_plane,
    },
    Case {
        number: "15-16",
        title: "rays parallel to slabs, with +0 and -0",
        asked: "hits, misses and normals right, distances to 4 ulp",
        run: boxes::parallel,
    },
    Case {
        number: "17",
        title: "a BVH against brute force",
        asked: "the same object, with and without a tree",
        run: triangles::tree_or_not,
    },
    Case {
        number: "18",
        title: "flat boxes",
        asked: "a rectangle, a segment or a point: hits, misses and normals right, distances to 4 ulp",
        run: boxes::flat,
    },
    Case {
        number: "19",
        title: "subnormal, huge and infinite inputs",
        asked: "infinite inputs are rejected, all others are drawn like the oracle does",
        run: extremes::inputs,
    },
    Case {
        number: "20",
        title: "lit convex objects",
        asked: "no spots in the shadow of their own surface",
        run: images::acne,
    },
    Case {
        number: "21",
        title: "a contact shadow",
        asked: "no light leaks in under a body that almost touches the floor",
        run: images::contact_shadow,
    },
    Case {
        number: "22",
        title: "grazing light on a coarse mesh",
        asked: "no facet shades itself",
        run: images::grazing_light,
    },
    Case {
        number: "23",
        title: "mirror spheres face to face",
        asked: "error of the direction after 5 bounces at most 1e-4 of the growth of a small change",
        run: bounces::face_to_face,
    },
    Case {
        number: "24",
        title: "identical objects",
        asked: "the first object in the script is visible, with any number of threads",
        run: ties::identical,
    },
    Case {
        number: "25",
        title: "random scenes",
        asked: "at most 0.01 % of the pixels differ from the oracle's",
        run: nasty::scenes,
    },
    Case {
        number: "26",
        title: "random scenes like those that users write",
        asked: "at most 0.01 % of the pixels differ from the oracle's",
        run: everyday::scenes,
    },
    Case {
        number: "27",
        title: "random scenes with every search structure",
        asked: "the same picture bit for bit",
        run: searched::scenes,
    },
    Case {
        number: "28",
        title: "random scenes with all features of the language",
        asked: "at most 0.01 % of the pixels differ from the oracle's",
        run: everything::scenes,
    },
    Case {
        number: "29",
        title: "outlines of discs, cylinders, cones and tori",
        asked: "hits and misses right except within 16 ulp of the distance, positions to 16 ulp, normals that face the \
         ray",
        run: curved::outlines,
    },
    Case {
        number: "30",
        title: "rays along axes, in planes, on rims, tips and surfaces",
        asked: "hits and misses right, distances to 16 ulp",
        run: curved::exact,
    },
    Case {
        number: "31",
        title: "all features of the language, scaled by powers of two",
        asked: "the same picture bit for bit",
        run: everything::scaled_by_two,
    },
    Case {
        number: "32",
        title: "shadows of distant objects",
        asked: "at most 0.01 % of the pixels differ from the oracle's",
        run: chosen::far_shadows,
    },
    Case {
        number: "33",
        title: "slivers as wide as the last bits of their corners",
        asked: "at most 0.01 % of the pixels differ from the oracle's",
        run: chosen::slivers,
    },
    Case {
        number: "34",
        title: "big spheres, and objects on them",
        asked: "at most 0.01 % of the pixels differ from the oracle's",
        run: chosen::big_balls,
    },
    Case {
        number: "35",
        title: "objects in another order",
        asked: "the same precision is chosen",
        run: chosen::orders,
    },
    Case {
        number: "36",
        title: "triangles in one slanted plane",
        asked: "the first object in the script is visible, except for 0.05 % of the pixels",
        run: chosen::one_plane,
    },
    Case {
        number: "37",
        title: "needles through a telescope",
        asked: "at most 0.01 % of the pixels differ from the oracle's",
        run: chosen::telescopes,
    },
    Case {
        number: "38",
        title: "thousands of objects in one place",
        asked: "drawn like the plain tracer does, and prepared in n log n",
        run: crowds::crowds,
    },
    Case {
        number: "39",
        title: "edges of rectangles, parallel rays over large distances, floors of sizes up to 1e20",
        asked: "at most 0.01 % of the pixels differ from the oracle's",
        run: chosen::edges,
    },
];
