//! The samples of a tile's pixels in a pass: their rays and their results.

use core::ops::Range;
use std::sync::atomic::AtomicBool;

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;

use super::Moment;
use crate::fast::acceleration::candidates::Candidates;
use crate::fast::arithmetic::real::{Lanes, Real, Vec3, constant};
use crate::fast::build::features::{BUILT, Kernel, Variant, fitted};
use crate::fast::film::cover::cover_hits;
use crate::fast::film::tile::{HitBatch, Scratch, shade};
use crate::fast::film::trace::trace_queue;
use crate::fast::placement::lens::Aperture;
use crate::fast::rays::bounce::{Column, Hits, RayBatch};
use crate::fast::rays::pixels::Rays;
use crate::fast::transport::paths::PathNumbers;
use crate::fast::transport::soft_light::{LightPoints, SoftLight};
use crate::parallel::CHANNELS;
use crate::parts;
use crate::sampling::film::{BitRows, CoverTile, FirstRows, Judged, PassTargets, Pixel, quantised};
use crate::sampling::places::on_disc;
use crate::sampling::{BATCH, Dimensions, Points};

/// The number of a pixel that shows no object.
const NOTHING: u32 = u32::MAX;

/// The number of samples that are drawn at once.
const ROOM: usize = BATCH;

/// The columns and rows of the blocks in which a tile's pixels are visited, so that those of a packet are neighbours.
const BLOCK: usize = 4;

/// The data that all tiles of a pass share.
pub(super) struct Pass<'a, E> {
    pub(super) moments: &'a [Moment<E>],
    pub(super) points: &'a Points,
    pub(super) dimensions: &'a Dimensions,
    pub(super) bounces: u32,
    /// The largest number of diffuse reflections.
    pub(super) indirect: u32,
    pub(super) wanted: PassTargets<'a>,
    /// The number of rows of the image.
    pub(super) height: u32,
}

/// A tile of the image. Its first row is at the top.
pub(super) struct SampledTile {
    /// The numbers of columns and rows of tiles before it.
    pub(super) place: (usize, usize),
    pub(super) left: usize,
    /// The number of rows of the film above it.
    pub(super) top: usize,
    /// The number of rows of the image above the film.
    pub(super) above: usize,
    pub(super) width: usize,
    pub(super) height: usize,
    /// The columns and rows of a tile that the edge of the image does not cut.
    pub(super) side: (usize, usize),
    /// The number of columns of the image.
    pub(super) stride: usize,
}

/// A ray to be drawn.
#[derive(Clone, Copy, Debug, Default)]
struct Item {
    moment: u32,
    sample: u32,
    /// The column and the row in the tile.
    pixel: (u32, u32),
}

/// The memory of a worker, which is used again for each of its tiles.
pub(super) struct Workspace<'a, E> {
    scratch: Scratch<'a, E>,
    items: Vec<Item>,
    /// The first samples of all pixels of a tile. `size` is the size of that tile.
    firsts: Vec<Item>,
    size: (usize, usize),
    /// Memory for sorting them.
    sorted: Vec<Item>,
    lights: LightPoints<E>,
    seeds: [u32; ROOM],
    samples: [u32; ROOM],
    columns: [f64; ROOM],
    rows: [f64; ROOM],
    coordinates: [[f64; ROOM]; 3],
    /// The objects that the camera rays hit.
    objects: [u32; ROOM],
    /// Whether each of them, or a ray that goes on from it, came near a watched box.
    is_near: [bool; ROOM],
}

impl<'a, E: Real> Workspace<'a, E> {
    /// Makes the memory. A tile with much glass stops halfway once `cancel` is set.
    pub(super) fn new(cancel: Option<&'a AtomicBool>) -> Self {
        Self {
            scratch: Scratch::new(cancel),
            items: vec![],
            firsts: vec![],
            size: (0, 0),
            sorted: vec![],
            lights: LightPoints::default(),
            seeds: [0; ROOM],
            samples: [0; ROOM],
            columns: [0.0; ROOM],
            rows: [0.0; ROOM],
            coordinates: [[0.0; ROOM]; 3],
            objects: [NOTHING; ROOM],
            is_near: [false; ROOM],
        }
    }
}

/// The drawn samples of a tile.
pub(super) struct Drawn<'a, 'b> {
    /// The sums of the tile's pixels.
    pub(super) pixels: &'a mut Vec<Pixel>,
    /// The first samples of the tile's row of tiles.
    pub(super) first: Option<&'a mut FirstRows<'b>>,
    /// The sums and the first samples of the cover, in scenes without background.
    pub(super) cover: Option<CoverTile<'a, 'b>>,
    /// The state of the pixels of the tile's row of tiles.
    pub(super) judged: &'a mut Judged<'b>,
    /// The pixels of the tile's row of tiles whose rays come near a watched box.
    pub(super) near: Option<&'a mut BitRows<'b>>,
}

/// Draws the samples that a tile's pixels lack.
#[inline(always)]
pub(super) fn draw<S: Simd, E: Real, N: Kernel<E>>(
    simd: S,
    pass: &Pass<E>,
    tile: &SampledTile,
    Drawn { pixels, mut first, mut cover, judged, mut near }: Drawn,
    workspace: &mut Workspace<E>,
) {
    let mut items = core::mem::take(&mut workspace.items);
    items.clear();
    let is_unclamped = pass.wanted.is_unclamped();
    let still = if let [moment] = pass.moments { Some(moment) } else { None };
    let nothing = still.filter(|moment| moment.shows_nothing(tile));
    let backdrop = nothing.map(|moment| moment.prepared.backdrop().map(E::widen));
    if pass.wanted.is_first_look {
        match (backdrop, &mut first) {
            (Some(color), Some(first)) => {
                let color = color.map(quantised);
                tile.each_pixel(|pixel| first.put(tile.in_rows(pixel), color, NOTHING));
                if let Some(CoverTile { first: Some(first), .. }) = &mut cover {
                    tile.each_pixel(|pixel| first.put(tile.in_rows(pixel), [0; CHANNELS], NOTHING));
                }
            }
            _ => {
                let Workspace { firsts, size, .. } = workspace;
                let first_of = |pixel| Item { moment: 0, sample: 0, pixel };
                if tile.is_wanted_whole(pass.wanted) {
                    if *size != (tile.width, tile.height) {
                        *size = (tile.width, tile.height);
                        firsts.clear();
                        tile.each_pixel(|pixel| firsts.push(first_of(pixel)));
                    }
                    items.extend_from_slice(firsts);
                } else {
                    tile.each_wanted_pixel(pass.wanted, |pixel| items.push(first_of(pixel)));
                }
            }
        }
    } else {
        pixels.resize(tile.side.0 * tile.side.1, Pixel::default());
        if let Some(cover) = &mut cover {
            cover.begin(tile.side.0 * tile.side.1);
        }
        let looked = u32::from(first.is_some());
        if let Some(color) = backdrop {
            let cover = cover.as_mut().map(|cover| &mut cover.pixels[..]);
            add_backdrop(pass, tile, color, looked, (pixels, cover));
        } else {
            // Where samples are not clamped the first look is none of them.
            let counted = first.as_deref().filter(|_| !is_unclamped);
            tile.each_wanted_pixel(pass.wanted, |at| {
                let pixel = &mut pixels[tile.in_tile(at)];
                let goal = pass.wanted.goal(pixel.count().max(looked));
                if let (0, Some(first)) = (pixel.count(), counted) {
                    pixel.add_equal(first.color(tile.in_rows(at)), 1);
                    if let Some(CoverTile { pixels, first: Some(first) }) = &mut cover {
                        pixels[tile.in_tile(at)].add_equal(first.color(tile.in_rows(at)), 1);
                    }
                }
                items.extend((pixel.count()..goal).map(|sample| Item { moment: 0, sample, pixel: at }));
            });
        }
    }
    if let Some(time) = pass.dimensions.time {
        set_moments(pass, tile, time, &mut items, &mut workspace.sorted);
    }
    if let (Some(near), Some(_)) = (&mut near, backdrop) {
        // Beside what such a tile shows there may be something wider.
        tile.each_pixel(|at| near.set(tile.left + at.0 as usize, at.1 as usize, true));
    }
    for of_moment in items.chunk_by(|a, b| a.moment == b.moment) {
        let moment = &pass.moments[of_moment[0].moment as usize];
        for batch in of_moment.chunks(ROOM) {
            draw_batch::<S, E, N>(simd, pass, (tile, moment), batch, workspace);
            if let Some(near) = &mut near {
                for (item, _) in batch.iter().zip(&workspace.is_near).filter(|(_, is_near)| **is_near) {
                    near.set(tile.left + item.pixel.0 as usize, item.pixel.1 as usize, true);
                }
            }
            match &mut first {
                Some(first) if pass.wanted.is_first_look => {
                    put_first::<S, E>(simd, tile, batch, workspace, first);
                }
                Some(_) | None if is_unclamped => add_up_unclamped(tile, batch, workspace, pixels),
                Some(_) | None => add_up::<S, E>(simd, tile, batch, workspace, pixels),
            }
            if let Some(cover) = &mut cover {
                cover_batch(pass, tile, batch, workspace, cover);
            }
        }
    }
    workspace.items = items;
    if first.is_some() && !pass.wanted.is_first_look {
        tile.each_wanted_pixel(pass.wanted, |at| {
            let (column, row) = (tile.left + at.0 as usize, at.1 as usize);
            let place = (column, tile.top + row);
            let verdict = |pixels: &[Pixel]| pass.wanted.verdict(&pixels[tile.in_tile(at)], place);
            let of_cover = cover.as_ref().map(|cover| verdict(cover.pixels));
            judged.set(column, row, &verdict(pixels), of_cover.as_ref());
        });
    }
}

/// Gives the pixels of a tile that shows only the background the samples that they lack.
#[inline(never)]
fn add_backdrop<E>(
    pass: &Pass<E>,
    tile: &SampledTile,
    color: [f64; CHANNELS],
    looked: u32,
    layers: (&mut [Pixel], Option<&mut [Pixel]>),
) {
    if pass.wanted.is_unclamped() {
        let colors = (DVec3::from_array(color), DVec3::ZERO);
        add_equal(pass.wanted, tile, colors, looked, layers, Pixel::add_unclamped);
    } else {
        let colors = (color.map(quantised), [0; CHANNELS]);
        add_equal(pass.wanted, tile, colors, looked, layers, Pixel::add_equal);
    }
}

/// Adds equal samples to the pixels of a tile and to their cover.
#[inline(always)]
fn add_equal<T: Copy>(
    wanted: PassTargets,
    tile: &SampledTile,
    (color, none): (T, T),
    looked: u32,
    (pixels, mut cover): (&mut [Pixel], Option<&mut [Pixel]>),
    add: impl Fn(&mut Pixel, T, u32),
) {
    tile.each_wanted_pixel(wanted, |at| {
        let pixel = &mut pixels[tile.in_tile(at)];
        let count = wanted.goal(pixel.count().max(looked)) - pixel.count();
        add(pixel, color, count);
        if let Some(cover) = &mut cover {
            add(&mut cover[tile.in_tile(at)], none, count);
        }
    });
}

impl SampledTile {
    /// Returns the tile's columns of the film.
    pub(super) fn columns(&self) -> Range<usize> {
        self.left..self.left + self.width
    }

    /// Returns the tile's rows of the film, from the top.
    pub(super) fn rows(&self) -> Range<usize> {
        self.top..self.top + self.height
    }

    /// Calls `each` with the column and row in the tile of each of its pixels, block by block.
    #[inline(always)]
    fn each_pixel(&self, mut each: impl FnMut((u32, u32))) {
        self.each_block(|left, row, columns| {
            (left..left + columns).for_each(|column| each((column as u32, row as u32)));
        });
    }

    /// Does the same for the pixels that are wanted.
    #[inline(always)]
    fn each_wanted_pixel(&self, wanted: PassTargets, mut each: impl FnMut((u32, u32))) {
        self.each_block(|left, row, columns| {
            let mut bits = wanted.pixels.run(self.left + left, self.top + row) & ((1 << columns) - 1);
            while bits != 0 {
                each((left as u32 + bits.trailing_zeros(), row as u32));
                bits &= bits - 1;
            }
        });
    }

    /// Returns whether all of the tile's pixels are wanted.
    #[inline(always)]
    fn is_wanted_whole(&self, wanted: PassTargets) -> bool {
        self.rows().all(|row| wanted.pixels.has_all(self.columns(), row))
    }

    /// Calls `each` with the rows of each block: the left column, the row, and the number of columns.
    #[inline(always)]
    fn each_block(&self, mut each: impl FnMut(usize, usize, usize)) {
        for top in (0..self.height).step_by(BLOCK) {
            for left in (0..self.width).step_by(BLOCK) {
                for row in top..(top + BLOCK).min(self.height) {
                    each(left, row, BLOCK.min(self.width - left));
                }
            }
        }
    }

    /// Returns a pixel's place in the tile.
    #[inline(always)]
    fn in_tile(&self, (column, row): (u32, u32)) -> usize {
        row as usize * self.side.0 + column as usize
    }

    /// Returns a pixel's place in the rows of the tile.
    #[inline(always)]
    fn in_rows(&self, (column, row): (u32, u32)) -> usize {
        row as usize * self.stride + self.left + column as usize
    }

    /// Returns the column and row of the image, both counted from the upper left corner.
    #[inline(always)]
    fn in_image(&self, (column, row): (u32, u32)) -> (u32, u32) {
        (self.left as u32 + column, (self.above + self.top) as u32 + row)
    }
}

impl<E: Real> Moment<E> {
    #[inline(always)]
    fn lens(&self) -> Option<&Aperture<E>> {
        if parts::BUILT.lenses { self.lens.as_ref() } else { None }
    }

    /// Returns the bodies that the tile can show, as bits.
    #[inline(always)]
    fn bodies_in(&self, tile: &SampledTile) -> u64 {
        self.prepared.bodies_in(self.bodies.as_ref(), tile.place)
    }

    /// Returns whether a tile certainly shows only a background of one colour.
    #[inline(always)]
    fn shows_nothing(&self, tile: &SampledTile) -> bool {
        self.window.candidates(tile.place.0, tile.place.1) == 0
            && self.prepared.shows_nothing(self.bodies_in(tile))
    }
}

/// Gives each ray its moment and sorts the rays by moment. The sort is stable, so that rays of neighbouring pixels stay
/// together.
#[inline(never)]
fn set_moments<E: Real>(
    pass: &Pass<E>,
    tile: &SampledTile,
    time: usize,
    items: &mut Vec<Item>,
    sorted: &mut Vec<Item>,
) {
    let count = pass.moments.len() as u32;
    let mut ends = vec![0; pass.moments.len()];
    let mut coordinates = [0.0; ROOM];
    for batch in items.chunks_mut(ROOM) {
        let (mut seeds, mut samples) = ([0; ROOM], [0; ROOM]);
        for (k, item) in batch.iter().enumerate() {
            let (column, row) = tile.in_image(item.pixel);
            seeds[k] = pass.points.pixel_seed(column, row);
            samples[k] = item.sample;
        }
        let rays = batch.len();
        pass.points.coordinates(time, &seeds[..rays], &samples[..rays], &mut coordinates[..rays]);
        for (item, time) in batch.iter_mut().zip(coordinates) {
            let moments = pass.wanted.moments(item.sample, count);
            let apart = count / moments;
            item.moment = (time * f64::from(moments)) as u32 * apart + apart / 2;
            ends[item.moment as usize] += 1;
        }
    }
    let mut before = 0;
    for end in &mut ends {
        before += core::mem::replace(end, before);
    }
    sorted.resize(items.len(), Item::default());
    for item in items.iter() {
        let place = &mut ends[item.moment as usize];
        sorted[*place] = *item;
        *place += 1;
    }
    core::mem::swap(items, sorted);
}

/// Draws at most [`ROOM`] rays of one moment. Their colours are then those of the hits. In a first look, records which
/// rays came near a watched box.
#[inline(always)]
fn draw_batch<S: Simd, E: Real, N: Kernel<E>>(
    simd: S,
    pass: &Pass<E>,
    (tile, moment): (&SampledTile, &Moment<E>),
    batch: &[Item],
    workspace: &mut Workspace<E>,
) {
    place::<S, E>(simd, pass, (tile, moment), batch, workspace);
    let Workspace { scratch, lights, objects, seeds, samples, is_near, .. } = workspace;
    let (scene, count) = (&moment.prepared, batch.len());
    let soft = moment
        .extents
        .as_ref()
        .filter(|_| parts::BUILT.extents)
        .map(|extents| SoftLight { extents, points: lights });
    // The first look at pixels is one by closed paths alone.
    let paths = (pass.wanted.is_unclamped() && !pass.wanted.is_first_look).then_some(PathNumbers {
        points: pass.points,
        dimensions: pass.dimensions,
        seeds,
        samples,
        bounces: pass.bounces,
        indirect: pass.indirect,
    });
    aim::<S, E>(simd, moment, &mut scratch.queue);
    let Scratch { queue, hits, next, waiting, occluders, sights, cover, .. } = &mut *scratch;
    let tree = BUILT.tree && scene.tree.is_some();
    let candidates = match &scene.sights {
        Some(all) if BUILT.tree && all.gather(tile.place.0, tile.place.1, sights) => {
            Candidates::listed(sights)
        }
        _ if tree => scene.all(),
        _ => Candidates::masked(scene.masks(moment.window.candidates(tile.place.0, tile.place.1))),
    };
    next.count = 0;
    hits.packets.clear();
    if scene.has_glass() || paths.is_some() {
        waiting.begin(pass.bounces);
        waiting.paths.begin();
    }
    let (kinds, background) = (candidates.kinds, scene.backdrop());
    let bodies = moment.bodies_in(tile);
    let watch = moment.watch.as_ref().filter(|_| pass.wanted.is_first_look);
    if watch.is_some() {
        is_near.fill(false);
    }
    if matches!(scene.rays, Rays::Pinhole(_)) && moment.lens().is_none() {
        fitted!(N, kinds, tree, C T D => {
            trace_queue::<S, E, Variant<N::By, C, T, D>, true>(simd, scene, candidates, background, queue, hits)
        });
        let next = Some(&mut *next);
        let met =
            HitBatch { kinds, bodies, background, queue, count, next, waiting, soft, is_first: true, paths };
        shade::<S, E, N, true>(simd, scene, met, hits, occluders);
        if let Some(watch) = watch {
            watch.note::<S, true>(simd, queue, hits, is_near);
        }
    } else {
        fitted!(N, kinds, tree, C T D => {
            trace_queue::<S, E, Variant<N::By, C, T, D>, false>(simd, scene, candidates, background, queue, hits)
        });
        let next = Some(&mut *next);
        let met =
            HitBatch { kinds, bodies, background, queue, count, next, waiting, soft, is_first: true, paths };
        shade::<S, E, N, false>(simd, scene, met, hits, occluders);
        if let Some(watch) = watch {
            watch.note::<S, false>(simd, queue, hits, is_near);
        }
    }
    if pass.wanted.is_first_look {
        note_objects(hits, Lanes::<S, E>::LEN, objects);
    }
    if scene.is_clear() {
        cover_hits(hits, count, Lanes::<S, E>::LEN, cover);
    }
    let watch = watch.map(|watch| (watch, &mut *is_near));
    scratch.follow::<S, N>(simd, scene, pass.bounces, (soft, paths), watch);
}

/// Returns the [`quantised`] colours of a batch.
#[inline(always)]
fn levels<E: Real>(count: usize, workspace: &Workspace<E>) -> [[u32; ROOM]; CHANNELS] {
    let mut levels = [[0; ROOM]; CHANNELS];
    for (levels, column) in levels.iter_mut().zip(&workspace.scratch.hits.color) {
        for (level, color) in levels.iter_mut().zip(&column.0[..count]) {
            *level = quantised(color.widen());
        }
    }
    levels
}

/// Stores the colours of a batch as those of the first samples of its pixels.
#[inline(never)]
fn put_first<S: Simd, E: Real>(
    simd: S,
    tile: &SampledTile,
    batch: &[Item],
    workspace: &Workspace<E>,
    first: &mut FirstRows,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let levels = levels(batch.len(), workspace);
            for (from, run) in (0..ROOM).step_by(BLOCK).zip(batch.chunks(BLOCK)) {
                let (at, last) = (run[0].pixel, run[run.len() - 1].pixel);
                // Pixels are in order, so that as many from one to the other are all between them.
                let is_whole = run.len() == BLOCK && at.0.is_multiple_of(BLOCK as u32);
                if is_whole && (at.0 + BLOCK as u32 - 1, at.1) == last {
                    let run = from..from + BLOCK;
                    let levels = levels.each_ref().map(|levels| &levels[run.clone()]);
                    first.put_run(tile.in_rows(at), levels, &workspace.objects[run]);
                    continue;
                }
                for (k, item) in (from..).zip(run) {
                    let color = levels.each_ref().map(|levels| levels[k]);
                    first.put(tile.in_rows(item.pixel), color, workspace.objects[k]);
                }
            }
        },
    );
}

/// Stores or adds the cover of a batch.
#[inline(never)]
fn cover_batch<E: Real>(
    pass: &Pass<E>,
    tile: &SampledTile,
    batch: &[Item],
    workspace: &Workspace<E>,
    cover: &mut CoverTile,
) {
    for (k, item) in batch.iter().enumerate() {
        let covered = workspace.scratch.cover.0[k].widen();
        let level = [quantised(covered); CHANNELS];
        match &mut cover.first {
            Some(first) if pass.wanted.is_first_look => {
                first.put(tile.in_rows(item.pixel), level, workspace.objects[k]);
            }
            Some(_) | None => {
                let pixel = &mut cover.pixels[tile.in_tile(item.pixel)];
                match pass.wanted.is_unclamped() {
                    true => pixel.add_unclamped(DVec3::splat(covered.clamp(0.0, 1.0)), 1),
                    false => pixel.add_equal(level, 1),
                }
            }
        }
    }
}

/// Adds the colours of a batch to its pixels.
#[inline(never)]
fn add_up<S: Simd, E: Real>(
    simd: S,
    tile: &SampledTile,
    batch: &[Item],
    workspace: &Workspace<E>,
    pixels: &mut [Pixel],
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let levels = levels(batch.len(), workspace);
            let mut from = 0;
            for of_pixel in batch.chunk_by(|a, b| a.pixel == b.pixel) {
                let to = from + of_pixel.len();
                let pixel = &mut pixels[tile.in_tile(of_pixel[0].pixel)];
                pixel.add(levels.each_ref().map(|levels| &levels[from..to]));
                from = to;
            }
        },
    );
}

/// Adds the colours of a batch to its pixels without clamping.
#[inline(never)]
fn add_up_unclamped<E: Real>(
    tile: &SampledTile,
    batch: &[Item],
    workspace: &Workspace<E>,
    pixels: &mut [Pixel],
) {
    let [red, green, blue] = &workspace.scratch.hits.color;
    for (k, item) in batch.iter().enumerate() {
        let color = [red, green, blue].map(|column| column.0[k].widen());
        pixels[tile.in_tile(item.pixel)].add_unclamped(DVec3::from_array(color), 1);
    }
}

/// Sets the samples of a batch: columns and rows of the image, and points of the lens and of the lights.
#[inline(never)]
fn place<S: Simd, E: Real>(
    simd: S,
    pass: &Pass<E>,
    (tile, moment): (&SampledTile, &Moment<E>),
    batch: &[Item],
    workspace: &mut Workspace<E>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let Workspace { scratch, lights, seeds, samples, columns, rows, coordinates, .. } = workspace;
            let anchor = moment.prepared.rays.anchor();
            // Known to lie within the columns, so that loops have no checks and are done in packets.
            let count = batch.len().min(ROOM);
            // In two loops, of which the second is.
            let mut pixels = [[0; ROOM]; 2];
            for (k, item) in batch.iter().enumerate() {
                (pixels[0][k], pixels[1][k]) = tile.in_image(item.pixel);
                samples[k] = item.sample;
            }
            let last = pass.height - 1;
            for k in 0..count {
                let (column, row) = (pixels[0][k], pixels[1][k]);
                columns[k] = f64::from(column) - anchor.0;
                rows[k] = f64::from(last - row) - anchor.1;
                seeds[k] = pass.points.pixel_seed(column, row);
            }
            let (seeds, samples) = (&seeds[..count], &samples[..count]);
            let [u, v, _] = coordinates;
            pass.points.coordinates(0, seeds, samples, &mut u[..count]);
            pass.points.coordinates(1, seeds, samples, &mut v[..count]);
            let queue = &mut scratch.queue;
            queue.count = count;
            // The first columns of the weights, which are filled anew by `aim`.
            let [i, j, _] = &mut queue.weight;
            for (i, (column, u)) in i.0.iter_mut().zip(columns.iter().zip(&*u)).take(count) {
                *i = E::narrow(column + (u - 0.5));
            }
            for (j, (row, v)) in j.0.iter_mut().zip(rows.iter().zip(&*v)).take(count) {
                *j = E::narrow(row + (v - 0.5));
            }
            for (slot, pixel) in queue.pixel.0.iter_mut().enumerate().take(count) {
                *pixel = E::narrow(slot as f64);
            }
            if let Some((first, lens)) = pass.dimensions.lens.zip(moment.lens()) {
                pass.points.coordinates(first, seeds, samples, &mut u[..count]);
                pass.points.coordinates(first + 1, seeds, samples, &mut v[..count]);
                let [x, y, _] = &mut queue.origin;
                let radius = lens.radius;
                for k in 0..count {
                    let at = on_disc(u[k], v[k]) * radius;
                    (x.0[k], y.0[k]) = (E::narrow(at.x), E::narrow(at.y));
                }
            }
            if parts::BUILT.extents
                && let Some(extents) = &moment.extents
            {
                extents.place(pass.points, seeds, samples, coordinates, lights);
            }
        },
    );
}

/// Sets the rays of a batch. Before, the first two columns of the weights hold their columns and rows, and those of the
/// origins hold their points of the lens.
#[inline(never)]
fn aim<S: Simd, E: Real>(simd: S, moment: &Moment<E>, queue: &mut RayBatch<E>) {
    simd.vectorize(
        #[inline(always)]
        || {
            let one = constant::<S, E>(simd, 1.0);
            for at in (0..queue.count).step_by(Lanes::<S, E>::LEN) {
                let end = at + Lanes::<S, E>::LEN;
                let load = |column: &Column<E>| Lanes::<S, E>::from_slice(simd, &column.0[at..end]);
                let (i, j) = (load(&queue.weight[0]), load(&queue.weight[1]));
                let (origin, direction) = match (&moment.prepared.rays, moment.lens()) {
                    (Rays::Pinhole(rays), None) => (Vec3::zero(simd), rays.along(simd, i, j)),
                    (Rays::Pinhole(rays), Some(lens)) => {
                        let (x, y) = (load(&queue.origin[0]), load(&queue.origin[1]));
                        lens.ray(simd, rays.along(simd, i, j), x, y)
                    }
                    (Rays::Parallel(rays), _) => (rays.origin(simd, i, j), rays.direction(simd)),
                };
                origin.store(&mut queue.origin, at);
                direction.normalize(simd).store(&mut queue.direction, at);
                Vec3::<S, E>::new(one, one, one).store(&mut queue.weight, at);
            }
        },
    );
}

/// Records the object that each ray of a batch has hit.
fn note_objects<E: Real>(hits: &Hits<E>, lanes: usize, objects: &mut [u32; ROOM]) {
    objects.fill(NOTHING);
    for &(at, _) in &hits.packets {
        let end = (at + lanes).min(ROOM);
        let (distances, orders) = (&hits.distance.0[at..end], &hits.order.0[at..end]);
        for ((object, distance), order) in objects[at..end].iter_mut().zip(distances).zip(orders) {
            let is_hit = distance.widen() < E::narrow(E::FAR).widen();
            *object = if is_hit { order.to_index() as u32 } else { NOTHING };
        }
    }
}
