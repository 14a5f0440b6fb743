//! The picture does not depend on the search structure (masks, lists or a tree) or on the shape of the tiles.

use anyhow::Result;
use fastrand::Rng;
use rayfold_tracer::{Precision, RenderOptions};
use rayon::prelude::*;

use super::figures::{Figures, Size};
use super::nasty::{Kind, first_seed};
use super::{everyday, nasty};
use crate::backends::{Backend, packets};

/// Seeds of scenes in which a tile or a leaf once cut off a triangle that is thin or seen edge-on.
const ONCE_TOLD_APART: [&[u64]; 2] = [
    &[1137, 1251, 1566, 5301, 5706, 7917, 8496, 9537, 12_456, 12_672, 14_487, 25_971, 37_791, 48_147, 54_381],
    &[],
];

/// Draws each scene with every search structure, and checks that the pictures are equal bit for bit.
pub(super) fn scenes(_: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    let kinds = [nasty::KINDS, everyday::KINDS];
    let mut seeds: Vec<(&[Kind], u64)> = Vec::new();
    for (kinds, told_apart) in kinds.into_iter().zip(ONCE_TOLD_APART) {
        let drawn = first_seed()..first_seed() + size.pick(200, 50_000);
        seeds.extend(told_apart.iter().copied().chain(drawn).map(|seed| (kinds, seed)));
    }
    for precision in [Precision::F32, Precision::F64] {
        let options = RenderOptions { precision, ..Default::default() };
        let expected = packets(format!("{precision:?}"), options);
        let backends = [
            ("by a tree", RenderOptions { tree: Some(true), ..options }),
            ("without a tree", RenderOptions { tree: Some(false), ..options }),
            ("4 x 4 tiles", RenderOptions { tile: Some((4, 4)), ..options }),
            ("64 x 4 tiles", RenderOptions { tile: Some((64, 4)), ..options }),
        ]
        .map(|(name, options)| packets(format!("{precision:?} {name}"), options));
        let counts = seeds
            .par_iter()
            .map(|&(kinds, seed)| {
                let (_, make) = kinds[(seed % kinds.len() as u64) as usize];
                let scene = make(&mut Rng::with_seed(seed))?;
                let expected = expected.render(&scene)?;
                let differing = |backend: &Backend| -> Result<usize> {
                    let image = backend.render(&scene)?;
                    Ok(image.pixels().zip(expected.pixels()).filter(|(a, b)| a != b).count())
                };
                backends.iter().map(differing).collect::<Result<Vec<_>>>()
            })
            .collect::<Result<Vec<_>>>()?;
        for (k, backend) in backends.iter().enumerate() {
            let count: usize = counts.iter().map(|of| of[k]).sum();
            let told_apart: Vec<String> = counts
                .iter()
                .zip(&seeds)
                .filter(|(of, _)| of[k] > 0)
                .take(4)
                .map(|(_, (kinds, seed))| {
                    format!(", {} {seed}", kinds[(seed % kinds.len() as u64) as usize].0)
                })
                .collect();
            let what = format!("pixels that differ{}", told_apart.concat());
            figures.add(backend, what, seeds.len(), count as f64, 0.0);
        }
    }
    Ok(())
}
