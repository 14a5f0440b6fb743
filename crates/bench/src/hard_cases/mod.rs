//! Inputs on which ray tracers are known to go wrong, each with a figure and the bound that it must keep.
//!
//! The table [`CASES`] is the list; a case measures every backend and says by how much it stays within its bound.
//! What is right is said by the [oracle], or where an image is compared with itself by that image. Rays
//! and positions are numbers that `f32` holds, unless the case is about those that it does not: so a figure is the
//! error of tracing, not that of rounding the input. Everything random comes from [`SEED`].

mod bounces;
mod boxes;
mod everyday;
mod extremes;
mod figures;
mod images;
mod nasty;
mod searched;
mod setup;
mod spheres;
mod ties;
mod triangles;

use anyhow::{Context, Result};

use crate::backends::Backend;

pub use figures::{Figure, Size};
pub(crate) use nasty::one_of_each;

use figures::Figures;

/// Where all random numbers of the cases come from.
pub const SEED: u64 = 20_240_607;

/// A hard case.
pub struct Case {
    /// Its number.
    pub number: &'static str,
    /// What makes it hard.
    pub title: &'static str,
    run: fn(&[Backend], Size, &mut Figures) -> Result<()>,
}

impl Case {
    /// Measures every tracer.
    ///
    /// # Errors
    /// When a scene cannot be built or rendered.
    pub fn figures(&self, backends: &[Backend], size: Size) -> Result<Vec<Figure>> {
        let mut figures = Figures::default();
        (self.run)(backends, size, &mut figures).with_context(|| format!("case {}", self.number))?;
        Ok(figures.0)
    }
}

/// All hard cases.
pub const CASES: &[Case] = &[
    Case { number: "1-2", title: "a sphere at 10 to 1e6 radii", run: spheres::distant },
    Case { number: "3", title: "a sphere of radius 1e7 from height 1", run: spheres::horizon },
    Case { number: "4", title: "tangent rays", run: spheres::tangent },
    Case { number: "5", title: "an origin on or in a sphere or box", run: spheres::inside },
    Case { number: "6", title: "radii 1e7 : 1 in one scene", run: spheres::giant_and_dwarf },
    Case { number: "7", title: "scaled by powers of two", run: images::scaled_by_two },
    Case { number: "8", title: "scaled by powers of ten", run: images::scaled_by_ten },
    Case { number: "9", title: "a scene of size 1 at offset 1e6", run: images::far_from_the_origin },
    Case { number: "10", title: "shared edges", run: triangles::shared_edges },
    Case { number: "11", title: "shared vertices", run: triangles::shared_vertices },
    Case { number: "12", title: "a needle triangle 1e6 : 1", run: triangles::needles },
    Case { number: "13", title: "degenerate triangles", run: triangles::degenerate },
    Case { number: "14", title: "rays in a triangle's plane", run: triangles::in_plane },
    Case { number: "15-16", title: "rays parallel to slabs, with +0 and -0", run: boxes::parallel },
    Case { number: "17", title: "a BVH against brute force", run: triangles::tree_or_not },
    Case { number: "18", title: "flat boxes", run: boxes::flat },
    Case { number: "19", title: "subnormal, huge and infinite inputs", run: extremes::inputs },
    Case { number: "20", title: "lit convex objects", run: images::acne },
    Case { number: "21", title: "a contact shadow", run: images::contact_shadow },
    Case { number: "22", title: "grazing light on a coarse mesh", run: images::grazing_light },
    Case { number: "23", title: "mirror spheres face to face", run: bounces::face_to_face },
    Case { number: "24", title: "identical objects", run: ties::identical },
    Case { number: "25", title: "random scenes", run: nasty::scenes },
    Case { number: "26", title: "random scenes as people write them", run: everyday::scenes },
    Case { number: "27", title: "random scenes searched in every way", run: searched::scenes },
];
