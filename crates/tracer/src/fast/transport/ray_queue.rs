//! Queues of the secondary rays of a tile, by bounce.
//!
//! Glass splits a ray into two, so the rays of a bounce can be many times the pixels. Reflected and refracted rays have
//! separate queues, because neighbours in a queue are then coherent. Rays are traced a batch ([`RayBatch`]) at a time,
//! from the deepest bounce that can fill one. So no queue holds more than [`MOST`] rays, however many there are in all.
//!
//! The contributions to a pixel are summed exactly, as integers. So a picture does not depend on which rays share a
//! batch or are traced first, and therefore not on tiles or widths.

use std::sync::atomic::{AtomicBool, Ordering};

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use crate::fast::arithmetic::real::{Lanes, Mask, Real, Vec3, constant};
use crate::fast::rays::bounce::{Column, Columns, Hits, PIXELS, ROOM, RayBatch};
use crate::fast::transport::path_queue::PathQueues;

/// The number of rays in a full batch.
const FULL: usize = PIXELS;

/// The largest number of rays in a queue: a queue with fewer than a full batch gets at most one more for each ray of a
/// full batch.
const MOST: usize = 2 * FULL;

/// The scale of the integers in which contributions to a pixel are summed: 1.0 is 2⁴⁰. One contribution is at most 2²³
/// times white.
const ONE: f64 = (1u64 << 40) as f64;

/// The number of values per queued ray: its origin, its direction, its weight in the pixel's colour, its pixel, its
/// mark, and what it is within.
const NUMBERS: usize = 12;

/// A packet of spawned rays.
#[derive(Clone, Copy)]
pub(crate) struct SpawnedRays<S: Simd, E: Real> {
    pub(crate) origin: Vec3<S, E>,
    pub(crate) direction: Vec3<S, E>,
    pub(crate) weight: Vec3<S, E>,
    /// One more than the order of the object of glass that a ray is within, or 0 if it is not known.
    pub(crate) inside: Lanes<S, E>,
    /// The lanes that hold a ray.
    pub(crate) lanes: Mask<S, E>,
}

impl<S: Simd, E: Real> SpawnedRays<S, E> {
    #[inline(always)]
    fn numbers(self, pixel: Lanes<S, E>, mark: Lanes<S, E>) -> [Lanes<S, E>; NUMBERS] {
        let [o, d, w] = [self.origin, self.direction, self.weight];
        [o.x, o.y, o.z, d.x, d.y, d.z, w.x, w.y, w.z, pixel, mark, self.inside]
    }
}

/// A queue of rays, first in, first out.
struct Line<E> {
    columns: [Vec<E>; NUMBERS],
    first: usize,
    end: usize,
}

impl<E: Real> Line<E> {
    fn new() -> Self {
        Self { columns: core::array::from_fn(|_| vec![E::narrow(0.0); MOST + FULL]), first: 0, end: 0 }
    }

    fn len(&self) -> usize {
        self.end - self.first
    }

    /// Adds some lanes of a packet.
    #[inline(always)]
    fn push<S: Simd>(&mut self, numbers: [Lanes<S, E>; NUMBERS], lanes: Mask<S, E>) {
        if !lanes.any_true() {
            return;
        }
        if self.end + Lanes::<S, E>::LEN > self.columns[0].len() {
            self.move_up(Lanes::<S, E>::LEN);
        }
        let room = self.end..self.end + Lanes::<S, E>::LEN;
        if lanes.all_true() {
            for (column, numbers) in self.columns.iter_mut().zip(numbers) {
                numbers.store_slice(&mut column[room.clone()]);
            }
            self.end = room.end;
            return;
        }
        for (column, numbers) in self.columns.iter_mut().zip(numbers) {
            numbers.compress(lanes).store_slice(&mut column[room.clone()]);
        }
        self.end += lanes.to_bitmask().count_ones() as usize;
    }

    /// Moves all rays to the beginning, so that there is room for `count` more.
    #[cold]
    fn move_up(&mut self, count: usize) {
        let len = self.len();
        for column in &mut self.columns {
            column.copy_within(self.first..self.end, 0);
            if column.len() < len + count {
                column.resize(len + count, E::narrow(0.0));
            }
        }
        (self.first, self.end) = (0, len);
    }

    /// Moves the first `count` rays to the columns.
    fn take(&mut self, count: usize, into: [&mut Column<E>; NUMBERS]) {
        for (from, into) in self.columns.iter().zip(into) {
            into.0[..count].copy_from_slice(&from[self.first..self.first + count]);
        }
        self.first += count;
        if self.first == self.end {
            (self.first, self.end) = (0, 0);
        }
    }
}

/// All queued rays of a tile.
pub(crate) struct RayQueues<'a, E> {
    /// The flag that stops tracing: once it is set, no more rays are taken.
    cancel: Option<&'a AtomicBool>,
    /// The queues by bounce: reflected and refracted. The first pair holds rays that were spawned once.
    bounces: Vec<[Line<E>; 2]>,
    /// The sum of all contributions to each pixel, by channels.
    sums: Vec<[i128; 3]>,
    /// The number of bounces of the rays in the current batch.
    depth: u32,
    /// The largest number of bounces.
    most: u32,
    /// For each ray of the current batch, 0 if it has not met glass. In scenes without background, the share of the pixel
    /// that stays clear if the ray reaches nothing, if it has come through glass alone. 1 or -1 for the others.
    pub(super) marks: Column<E>,
    /// The rays of paths, in scenes in which light goes round.
    pub(crate) paths: PathQueues<E>,
    /// The clear share of each pixel, in scenes without background.
    clear: Vec<i128>,
}

impl<'a, E: Real> RayQueues<'a, E> {
    pub(crate) fn new(cancel: Option<&'a AtomicBool>) -> Self {
        Self {
            cancel,
            bounces: Vec::new(),
            sums: vec![],
            depth: 0,
            most: 0,
            marks: Column::new(),
            paths: PathQueues::new(),
            clear: vec![],
        }
    }

    /// Starts a tile. The rays in the batch are camera rays, and may bounce at most `most` times.
    pub(crate) fn begin(&mut self, most: u32) {
        self.depth = 0;
        self.most = most;
        self.marks.0.fill(E::narrow(0.0));
        for line in self.bounces.as_flattened_mut() {
            (line.first, line.end) = (0, 0);
        }
        self.sums.clear();
        self.sums.resize(ROOM, [0; 3]);
        self.clear.clear();
        self.clear.resize(ROOM, 0);
    }

    /// Returns whether the rays in the batch are at the last bounce.
    pub(crate) fn is_last_bounce(&self) -> bool {
        self.depth == self.most
    }

    /// Returns the rays of the packet at an index of the batch that have met glass.
    #[inline(always)]
    pub(crate) fn have_met_glass<S: Simd>(&self, simd: S, at: usize) -> Mask<S, E> {
        self.marks_of(simd, at).simd_ne(constant::<S, E>(simd, 0.0))
    }

    /// Returns the share of their pixels that stays clear if the rays of the packet at an index of the batch reach nothing.
    #[inline(always)]
    pub(crate) fn clear<S: Simd>(&self, simd: S, at: usize) -> Lanes<S, E> {
        if self.depth == 0 {
            return constant::<S, E>(simd, 1.0);
        }
        self.marks_of(simd, at).max(constant::<S, E>(simd, 0.0))
    }

    #[inline(always)]
    fn marks_of<S: Simd>(&self, simd: S, at: usize) -> Lanes<S, E> {
        Lanes::<S, E>::from_slice(simd, &self.marks.0[at..at + Lanes::<S, E>::LEN])
    }

    /// Adds the reflected and the refracted rays of a packet, with their marks.
    #[inline(always)]
    pub(crate) fn push<S: Simd>(
        &mut self,
        pixel: Lanes<S, E>,
        marks: [Lanes<S, E>; 2],
        rays: [SpawnedRays<S, E>; 2],
    ) {
        let next = self.depth as usize;
        if self.bounces.len() == next {
            self.add_bounce();
        }
        for ((line, ray), mark) in self.bounces[next].iter_mut().zip(rays).zip(marks) {
            line.push::<S>(ray.numbers(pixel, mark), ray.lanes);
        }
    }

    #[cold]
    fn add_bounce(&mut self) {
        self.bounces.push([Line::new(), Line::new()]);
    }

    /// Fills the batch with rays of one bounce. Returns false if there are none, or if the drawing was cancelled.
    pub(crate) fn take(&mut self, queue: &mut RayBatch<E>) -> bool {
        let lines = self.bounces.as_flattened_mut();
        let full = lines.iter().rposition(|line| line.len() >= FULL);
        let found = full.or_else(|| lines.iter().position(|line| line.len() > 0));
        let Some(at) = found else { return false };
        if self.cancel.is_some_and(|flag| flag.load(Ordering::Relaxed)) {
            return false;
        }
        let rays = &mut lines[at];
        debug_assert!(rays.len() <= MOST, "{} rays wait", rays.len());
        self.depth = at as u32 / 2 + 1;
        queue.count = rays.len().min(FULL);
        let [ox, oy, oz] = &mut queue.origin;
        let [dx, dy, dz] = &mut queue.direction;
        let [wx, wy, wz] = &mut queue.weight;
        let (pixel, inside) = (&mut queue.pixel, &mut queue.inside);
        rays.take(queue.count, [ox, oy, oz, dx, dy, dz, wx, wy, wz, pixel, &mut self.marks, inside]);
        true
    }

    #[inline(always)]
    pub(super) fn is_cancelled(&self) -> bool {
        self.cancel.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }

    /// Counts a ray of the batch that has hit nothing as clear in its pixel if it has come through glass alone. Returns whether
    /// it has.
    pub(crate) fn lets_through(&mut self, ray: usize, pixel: usize) -> bool {
        let clear = self.marks.0[ray].widen();
        if clear > 0.0 {
            self.clear[pixel] += i128::from((clear * ONE) as i64);
        }
        clear > 0.0
    }

    /// Takes the clear shares from the covers of the first `count` pixels.
    pub(crate) fn uncover(&self, cover: &mut Column<E>, count: usize) {
        for (cover, clear) in cover.0[..count].iter_mut().zip(&self.clear) {
            *cover = E::narrow(cover.widen() - *clear as f64 / ONE);
        }
    }

    /// Adds the colours of the rays in the batch to the sums.
    pub(crate) fn add(&mut self, queue: &RayBatch<E>, hits: &Hits<E>) {
        let zero = E::narrow(0.0);
        let [r, g, b] = &hits.color;
        let colors = r.0.iter().zip(&g.0).zip(&b.0);
        for (pixel, ((r, g), b)) in queue.pixel.0[..queue.count].iter().zip(colors) {
            // Most hits are on glass, and have no colour of their own.
            if *r == zero && *g == zero && *b == zero {
                continue;
            }
            let sums = &mut self.sums[pixel.to_index()];
            for (sum, color) in sums.iter_mut().zip([r, g, b]) {
                let color = color.widen();
                #[cfg(feature = "accuracy")]
                crate::nans::add(color.is_nan().into());
                *sum += i128::from((color * ONE) as i64);
            }
        }
    }

    /// Adds the sums to the pixels.
    pub(crate) fn sum_up(&self, pixels: &mut Columns<E>) {
        for (channel, pixels) in pixels.iter_mut().enumerate() {
            for (pixel, sums) in pixels.0.iter_mut().zip(&self.sums) {
                *pixel += E::narrow(real(sums[channel]) / ONE);
            }
        }
    }
}

/// Returns the number nearest to a sum.
#[inline(always)]
fn real(sum: i128) -> f64 {
    match i64::try_from(sum) {
        Ok(short) => short as f64,
        Err(_) => long(sum),
    }
}

// Out of line, so that the compiler does not round short sums in this way too, which takes many times as long.
#[cold]
#[inline(never)]
fn long(sum: i128) -> f64 {
    sum as f64
}

impl<E: Real> RayQueues<'_, E> {
    /// Fills the batch with rays of paths. Returns false if there are none, or if the drawing was cancelled.
    pub(crate) fn take_paths(&mut self, queue: &mut RayBatch<E>) -> bool {
        !self.is_cancelled() && self.paths.take(queue, &mut self.marks)
    }

    /// Returns the share of its pixel that stays clear if a ray of the batch hits nothing after `hits` hits, in scenes
    /// without background. The share is at most 0 if such a miss does not count.
    #[inline(always)]
    pub(crate) fn clear_share(&self, ray: usize, hits: u32) -> f64 {
        if hits == 0 { 1.0 } else { self.marks.0[ray].widen() }
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;

    /// Adds the rays of a pixel for which `are_sent` is true.
    fn push(waiting: &mut RayQueues<f64>, pixel: usize, are_sent: [bool; 2]) {
        dispatch!(Level::new(), simd => push_with(simd, waiting, pixel, are_sent));
    }

    fn push_with<S: Simd>(simd: S, waiting: &mut RayQueues<f64>, pixel: usize, are_sent: [bool; 2]) {
        let rays = are_sent.map(|is_sent| {
            let one = Vec3::splat(simd, [1.0; 3]);
            // In one lane, a different one each time.
            let lane = pixel % Lanes::<S, f64>::LEN;
            let lanes = Mask::<S, f64>::from_bitmask(simd, u64::from(is_sent) << lane);
            SpawnedRays { origin: one, direction: one, weight: one, inside: one.x, lanes }
        });
        let pixel = constant::<S, f64>(simd, pixel as f64);
        waiting.push(pixel, [constant::<S, f64>(simd, 1.0); 2], rays);
    }

    /// Returns whether the first ray of the batch has met glass.
    fn has_met_glass(waiting: &RayQueues<f64>) -> bool {
        dispatch!(Level::new(), simd => waiting.have_met_glass(simd, 0).to_bitmask() & 1 != 0)
    }

    fn pixels(queue: &RayBatch<f64>) -> Vec<usize> {
        queue.pixel.0[..queue.count].iter().map(|pixel| pixel.to_index()).collect()
    }

    #[test]
    fn few_rays_wait_however_many_come() {
        let (mut waiting, mut queue) = (RayQueues::<f64>::new(None), RayBatch::new());
        waiting.begin(8);
        (0..FULL).for_each(|pixel| push(&mut waiting, pixel, [true; 2]));
        let (mut traced, mut most) = ([0; 9], 0);
        while waiting.take(&mut queue) {
            assert!((1..=FULL).contains(&queue.count));
            traced[waiting.depth as usize] += queue.count;
            if !waiting.is_last_bounce() {
                pixels(&queue).into_iter().for_each(|pixel| push(&mut waiting, pixel, [true; 2]));
            }
            most = waiting.bounces.as_flattened().iter().map(Line::len).fold(most, usize::max);
        }
        let expected: Vec<usize> = (1..9).map(|depth| FULL << depth).collect();
        assert_eq!(traced[1..], expected);
        assert!((FULL..=MOST).contains(&most), "{most}");
    }

    #[test]
    fn rays_of_a_line_are_taken_as_they_came_and_none_is_lost() {
        for sent in 0..2 {
            let (mut waiting, mut queue) = (RayQueues::<f64>::new(None), RayBatch::new());
            waiting.begin(1);
            let (mut expected, mut taken) = (vec![], vec![]);
            for k in 0..1200 {
                let is_sent = k % 3 != 0;
                push(&mut waiting, k % PIXELS, [is_sent && sent == 0, is_sent && sent == 1]);
                expected.extend(is_sent.then_some(k % PIXELS));
                // So that the queue moves up while it still holds rays.
                if k % 500 == 499 {
                    assert!(waiting.take(&mut queue));
                    waiting.depth = 0;
                    taken.extend(pixels(&queue));
                }
            }
            while waiting.take(&mut queue) {
                taken.extend(pixels(&queue));
                assert!(has_met_glass(&waiting) && waiting.is_last_bounce());
            }
            assert_eq!(taken, expected);
            waiting.begin(1);
            assert!(!has_met_glass(&waiting) && !waiting.is_last_bounce());
        }
    }

    #[test]
    fn what_rays_add_depends_on_no_order() {
        let (mut queue, mut hits) = (RayBatch::<f64>::new(), Hits::new());
        let colors = [0.1, 0.7, 1e-7, 3.3, -0.2, 1e30, -1e12, 0.3];
        let mut sums = vec![];
        for first in 0..colors.len() {
            let mut waiting = RayQueues::new(None);
            waiting.begin(1);
            queue.count = colors.len();
            for k in 0..colors.len() {
                let color = colors[(first + 3 * k) % colors.len()];
                hits.color.iter_mut().for_each(|column| column.0[k] = color);
                queue.pixel.0[k] = 5.0;
            }
            waiting.add(&queue, &hits);
            let mut pixels = [Column::new(), Column::new(), Column::new()];
            waiting.sum_up(&mut pixels);
            sums.push(pixels.map(|column| column.0[5]));
        }
        assert!(sums.iter().all(|sum| *sum == sums[0]));
        // The two colours farthest from white are clamped to the same magnitude.
        assert!((sums[0][0] - colors[..5].iter().sum::<f64>() - 0.3).abs() < 1e-9, "{sums:?}");
    }
}
