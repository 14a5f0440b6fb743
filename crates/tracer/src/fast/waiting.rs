//! Rays of a tile that wait to be traced, by how often they were mirrored or refracted.
//!
//! Where glass makes two rays of one, the rays of a bounce can be many times the pixels. They are traced a queue at a time,
//! of the farthest bounce that fills one: so no bounce has more than [`MOST`] rays that wait, however many there are in
//! all. Those of a bounce are taken in the order in which they were added, and each bounce has a sum of its own: which rays
//! share a queue changes no sum, and a picture depends on neither tiles nor widths.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};

use super::bounce::{Columns, Hits, PIXELS, Queue, ROOM, columns};
use super::real::Real;

/// Rays of a full queue.
const FULL: usize = PIXELS;

/// Rays of a bounce that wait at most: with fewer than a queue's it is given two each for those of a full one.
const MOST: usize = 3 * FULL;

/// A ray that waits.
#[derive(Clone, Copy, Debug)]
pub(super) struct OneRay<E> {
    pub(super) origin: [E; 3],
    pub(super) direction: [E; 3],
    /// What its colour counts for in the pixel's.
    pub(super) weight: [E; 3],
    pub(super) pixel: E,
    pub(super) has_met_glass: bool,
}

/// The rays of a tile that were sent on equally often.
struct Bounce<E> {
    rays: VecDeque<OneRay<E>>,
    /// What they add to each pixel.
    sum: Columns<E>,
    is_used: bool,
}

/// All rays that wait.
pub(super) struct Waiting<'a, E> {
    /// Once it is raised no more rays are taken.
    cancel: Option<&'a AtomicBool>,
    /// The first is that of rays sent on once.
    bounces: Vec<Bounce<E>>,
    /// How often the rays in the queue were sent on.
    depth: u32,
    /// How often rays are.
    most: u32,
    /// Which of them have met glass.
    has_met_glass: [bool; ROOM],
}

impl<'a, E: Real> Waiting<'a, E> {
    pub(super) fn new(cancel: Option<&'a AtomicBool>) -> Self {
        Self { cancel, bounces: Vec::new(), depth: 0, most: 0, has_met_glass: [false; ROOM] }
    }

    /// Starts a tile: the rays in the queue are those of the camera, and are sent on so often at most.
    pub(super) fn begin(&mut self, most: u32) {
        self.depth = 0;
        self.most = most;
        self.has_met_glass.fill(false);
        for bounce in &mut self.bounces {
            bounce.rays.clear();
            bounce.is_used = false;
        }
    }

    /// Whether the rays in the queue are sent on no more.
    pub(super) fn is_at_the_end(&self) -> bool {
        self.depth == self.most
    }

    /// Whether the ray at a place of the queue has met glass.
    #[inline(always)]
    pub(super) fn has_met_glass(&self, at: usize) -> bool {
        self.has_met_glass[at]
    }

    /// Adds a ray that a ray of the queue is sent on as; those of a pixel in the order of theirs.
    pub(super) fn push(&mut self, ray: OneRay<E>) {
        let next = self.depth as usize;
        if self.bounces.len() == next {
            let rays = VecDeque::with_capacity(MOST);
            self.bounces.push(Bounce { rays, sum: columns(), is_used: false });
        }
        self.bounces[next].rays.push_back(ray);
    }

    /// Fills the queue with rays of a bounce; false if there are none, or the drawing was cancelled.
    pub(super) fn take(&mut self, queue: &mut Queue<E>) -> bool {
        let is_full = |bounce: &Bounce<E>| bounce.rays.len() >= FULL;
        let some = |bounce: &Bounce<E>| !bounce.rays.is_empty();
        let found = self.bounces.iter().rposition(is_full).or_else(|| self.bounces.iter().position(some));
        let Some(at) = found else { return false };
        if self.cancel.is_some_and(|flag| flag.load(Ordering::Relaxed)) {
            return false;
        }
        let rays = &mut self.bounces[at].rays;
        debug_assert!(rays.len() <= MOST, "{} rays wait", rays.len());
        self.depth = at as u32 + 1;
        queue.count = rays.len().min(FULL);
        for (slot, ray) in rays.drain(..queue.count).enumerate() {
            for axis in 0..3 {
                queue.origin[axis].0[slot] = ray.origin[axis];
                queue.direction[axis].0[slot] = ray.direction[axis];
                queue.weight[axis].0[slot] = ray.weight[axis];
            }
            queue.pixel.0[slot] = ray.pixel;
            self.has_met_glass[slot] = ray.has_met_glass;
        }
        true
    }

    /// Adds the colours of the rays in the queue to the sums of their bounce.
    pub(super) fn add(&mut self, queue: &Queue<E>, hits: &Hits<E>) {
        let bounce = &mut self.bounces[self.depth as usize - 1];
        for (sum, color) in bounce.sum.iter_mut().zip(&hits.color) {
            if !bounce.is_used {
                sum.0.fill(E::narrow(0.0));
            }
            for (pixel, color) in queue.pixel.0[..queue.count].iter().zip(&color.0) {
                sum.0[pixel.to_index()] += *color;
            }
        }
        bounce.is_used = true;
    }

    /// Adds what all bounces have to the pixels.
    pub(super) fn sum_up(&self, pixels: &mut Columns<E>) {
        for bounce in self.bounces.iter().filter(|bounce| bounce.is_used) {
            for (pixels, sum) in pixels.iter_mut().zip(&bounce.sum) {
                for (pixel, sum) in pixels.0.iter_mut().zip(&sum.0) {
                    *pixel += *sum;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ray(pixel: usize) -> OneRay<f64> {
        let vector = [1.0; 3];
        OneRay { origin: vector, direction: vector, weight: vector, pixel: pixel as f64, has_met_glass: true }
    }

    #[test]
    fn few_rays_wait_however_many_come() {
        let (mut waiting, mut queue) = (Waiting::<f64>::new(None), Queue::new());
        waiting.begin(8);
        (0..2 * FULL).for_each(|k| waiting.push(ray(k / 2)));
        let (mut traced, mut most) = ([0; 9], 0);
        while waiting.take(&mut queue) {
            assert!((1..=FULL).contains(&queue.count));
            traced[waiting.depth as usize] += queue.count;
            if !waiting.is_at_the_end() {
                let pixels = queue.pixel.0[..queue.count].iter();
                pixels.for_each(|&pixel| {
                    [pixel; 2].map(f64::to_index).into_iter().for_each(|k| waiting.push(ray(k)))
                });
            }
            most = waiting.bounces.iter().map(|bounce| bounce.rays.len()).fold(most, usize::max);
        }
        let expected: Vec<usize> = (1..9).map(|depth| FULL << depth).collect();
        assert_eq!(traced[1..], expected);
        assert!((FULL..=MOST).contains(&most), "{most}");
    }

    #[test]
    fn rays_of_a_bounce_are_taken_as_they_came() {
        let (mut waiting, mut queue) = (Waiting::<f64>::new(None), Queue::new());
        waiting.begin(1);
        (0..600).for_each(|k| waiting.push(ray(k % ROOM)));
        let mut taken = vec![];
        while waiting.take(&mut queue) {
            taken.extend(queue.pixel.0[..queue.count].iter().map(|pixel| pixel.to_index()));
            assert!(waiting.has_met_glass(0) && waiting.is_at_the_end());
        }
        assert!(taken.into_iter().eq((0..600).map(|k| k % ROOM)));
        waiting.begin(1);
        assert!(!waiting.has_met_glass(0) && !waiting.is_at_the_end());
    }
}
