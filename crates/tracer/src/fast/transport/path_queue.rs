//! Queues of the rays of paths, in scenes in which surfaces light each other.
//!
//! Rays wait by the number of hits before them and by the kind of their last bounce. They are traced a batch at a time,
//! starting with the longest paths that can fill a batch. So no queue holds more than some batches, however many rays
//! there are. A ray's contribution to a pixel is summed as in the other queues.

use crate::fast::arithmetic::real::Real;
use crate::fast::rays::bounce::{Column, PIXELS, ROOM, RayBatch};
use crate::sampling::bright::Seen;
use crate::sampling::paths::Way;

/// The number of rays in a full batch.
const FULL: usize = PIXELS;

/// The numbers of bounces of a path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Turns {
    /// Bounces by mirrors and glass.
    pub(crate) bounced: u8,
    /// Bounces by surfaces that scatter light.
    pub(crate) scattered: u8,
}

impl Turns {
    /// Returns the number of hits before.
    #[inline(always)]
    pub(crate) fn hits(self) -> u32 {
        u32::from(self.bounced) + u32::from(self.scattered)
    }
}

/// A ray that waits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathRay<E> {
    pub(crate) origin: [E; 3],
    pub(crate) direction: [E; 3],
    /// The factor of the ray's colour in the colour of the pixel.
    pub(crate) weight: [E; 3],
    pub(crate) pixel: E,
    /// In scenes without background, the share of the pixel that stays clear if the ray hits nothing, or -1 if a miss
    /// does not count.
    pub(crate) clear: E,
    pub(crate) turns: Turns,
}

/// The number of hits whose rays towards light are drawn at once.
pub(super) const BLOCK: usize = 16;
const _: () = assert!(ROOM.is_multiple_of(BLOCK));

/// The rays that are scattered at the hits of a batch.
pub(super) struct Drawn {
    /// Whether the hit of a ray scatters light and its path may continue in this way.
    pub(super) is_scattered: [bool; ROOM],
    /// The numbers of the directions.
    pub(super) numbers: [Box<Column<f64>>; 2],
    /// The directions by the cosine.
    pub(super) by_cosine: [Box<Column<f64>>; 3],
    /// The directions towards light.
    pub(super) aimed: [Box<Column<f64>>; 3],
    /// The factors with which the rays by the cosine count, and those towards light. The factor is 0 if there is no
    /// ray.
    pub(super) factors: [Box<Column<f64>>; 2],
    /// Working memory for how surfaces see light.
    pub(super) seen: Vec<Seen<BLOCK>>,
}

impl Drawn {
    fn new() -> Self {
        let column = || Box::new(Column::new());
        let columns = || [column(), column(), column()];
        Self {
            is_scattered: [false; ROOM],
            numbers: [column(), column()],
            by_cosine: columns(),
            aimed: columns(),
            factors: [column(), column()],
            seen: vec![],
        }
    }
}

/// The rays of the paths of a tile.
pub(crate) struct PathQueues<E> {
    /// The waiting rays, by the number of hits before and by [`Way`].
    waiting: Vec<[Vec<PathRay<E>>; Way::COUNT]>,
    /// The turns of the rays of the current batch.
    pub(super) turns: [Turns; ROOM],
    pub(super) drawn: Drawn,
}

impl<E: Real> PathQueues<E> {
    pub(crate) fn new() -> Self {
        Self { waiting: vec![], turns: [Turns::default(); ROOM], drawn: Drawn::new() }
    }

    /// Starts with a batch of camera rays.
    pub(crate) fn begin(&mut self) {
        self.waiting.as_flattened_mut().iter_mut().for_each(Vec::clear);
        self.turns.fill(Turns::default());
    }

    /// Returns the numbers of bounces of the path of a ray of the batch.
    #[inline(always)]
    pub(crate) fn turns(&self, ray: usize) -> Turns {
        self.turns[ray]
    }

    /// Adds a ray to the queue of its `way`.
    #[inline(always)]
    pub(crate) fn push(&mut self, way: Way, ray: PathRay<E>) {
        let before = ray.turns.hits() as usize - 1;
        if self.waiting.len() <= before {
            self.waiting.resize_with(before + 1, || [const { vec![] }; Way::COUNT]);
        }
        self.waiting[before][way as usize].push(ray);
    }

    /// Fills the batch with waiting rays. Returns false if there are none. `marks` receives their clear shares.
    pub(super) fn take(&mut self, queue: &mut RayBatch<E>, marks: &mut Column<E>) -> bool {
        let waiting = self.waiting.as_flattened_mut();
        let full = waiting.iter().rposition(|rays| rays.len() >= FULL);
        let found = full.or_else(|| waiting.iter().position(|rays| !rays.is_empty()));
        let Some(at) = found else { return false };
        let rays = &mut waiting[at];
        let first = rays.len().saturating_sub(FULL);
        queue.count = rays.len() - first;
        for (k, ray) in rays.drain(first..).enumerate() {
            for axis in 0..3 {
                queue.origin[axis].0[k] = ray.origin[axis];
                queue.direction[axis].0[k] = ray.direction[axis];
                queue.weight[axis].0[k] = ray.weight[axis];
            }
            queue.pixel.0[k] = ray.pixel;
            marks.0[k] = ray.clear;
            self.turns[k] = ray.turns;
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ray(pixel: usize, bounced: u8, scattered: u8) -> PathRay<f64> {
        let turns = Turns { bounced, scattered };
        PathRay {
            origin: [0.0; 3],
            direction: [1.0; 3],
            weight: [1.0; 3],
            pixel: pixel as f64,
            clear: -1.0,
            turns,
        }
    }

    #[test]
    fn all_rays_are_taken_and_few_wait() {
        let mut queues = PathQueues::new();
        let (mut queue, mut marks) = (RayBatch::new(), Column::new());
        queues.begin();
        let mut sent = 0;
        for pixel in 0..FULL {
            queues.push(Way::Scattered, ray(pixel, 0, 1));
            sent += 1;
        }
        let (mut taken, mut most) = (0, 0);
        while queues.take(&mut queue, &mut marks) {
            taken += queue.count;
            for k in 0..queue.count {
                let Turns { bounced, scattered } = queues.turns(k);
                if queues.turns(k).hits() < 7 {
                    queues.push(Way::Mirrored, ray(k, bounced + 1, scattered));
                    queues.push(Way::Scattered, ray(k, bounced, scattered + 1));
                    sent += 2;
                }
            }
            most = queues.waiting.as_flattened().iter().map(Vec::len).fold(most, usize::max);
        }
        assert_eq!((taken, taken), (sent, FULL * 127));
        assert!(most <= 3 * FULL, "{most}");
    }
}
