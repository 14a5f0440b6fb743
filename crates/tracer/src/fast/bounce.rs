//! The rays of a tile between two bounces: what the steps of drawing it hand to each other.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::packet::Nearest;
use super::real::{Lanes, Real, Vec3};

/// Pixels of a tile at most.
pub(super) const PIXELS: usize = 256;

/// A tile's pixels, and room for a packet that begins at the last of them.
pub(super) const ROOM: usize = PIXELS + 16;

/// A number for each ray of a tile.
#[derive(Clone)]
#[repr(align(64))]
pub(super) struct Column<E>(pub(super) [E; ROOM]);

impl<E> AsRef<[E]> for Column<E> {
    #[inline(always)]
    fn as_ref(&self) -> &[E] {
        &self.0
    }
}

impl<E> AsMut<[E]> for Column<E> {
    #[inline(always)]
    fn as_mut(&mut self) -> &mut [E] {
        &mut self.0
    }
}

pub(super) type Columns<E> = [Column<E>; 3];

impl<E: Real> Column<E> {
    pub(super) fn new() -> Self {
        Self([E::narrow(0.0); ROOM])
    }
}

pub(super) fn columns<E: Real>() -> Columns<E> {
    [Column::new(), Column::new(), Column::new()]
}

/// Rays that wait to be traced.
pub(super) struct Queue<E> {
    pub(super) origin: Columns<E>,
    pub(super) direction: Columns<E>,
    /// What their colour counts for in the pixel's.
    pub(super) weight: Columns<E>,
    pub(super) pixel: Column<E>,
    pub(super) count: usize,
}

impl<E: Real> Queue<E> {
    pub(super) fn new() -> Self {
        Self { origin: columns(), direction: columns(), weight: columns(), pixel: Column::new(), count: 0 }
    }

    /// Fills the last packet of so many lanes up with the last ray, of no pixel.
    #[inline(always)]
    pub(super) fn fill_up(&mut self, lanes: usize) {
        let last = self.count - 1;
        let end = self.count.next_multiple_of(lanes);
        for columns in [&mut self.origin, &mut self.direction, &mut self.weight] {
            for column in columns {
                let value = column.0[last];
                column.0[last + 1..end].fill(value);
            }
        }
        self.pixel.0[last + 1..end].fill(E::narrow(-1.0));
    }
}

/// What the rays of a tile meet.
pub(super) struct Hits<E> {
    /// How far they go.
    pub(super) distance: Column<E>,
    /// The object's position in the script.
    pub(super) order: Column<E>,
    pub(super) start: Columns<E>,
    pub(super) normal: Columns<E>,
    /// How far the start is off the surface, and 1 for rays that come from within the object, 0 for the others; made for
    /// scenes that have glass.
    pub(super) sides: [Column<E>; 2],
    /// Diffuse coefficient times the ray's weight.
    pub(super) diffuse: Columns<E>,
    pub(super) color: Columns<E>,
    /// Mirror coefficient times the ray's weight; made for scenes that have patterns.
    pub(super) mirror: [Vec<E>; 3],
    /// For each packet with hits: where it begins, and the spheres that can be in its light, as bits.
    pub(super) packets: Vec<(usize, u64)>,
    /// For each packet with mirrors: where it begins, and the lanes that meet them, as bits.
    pub(super) mirrors: Vec<(usize, u64)>,
}

impl<E: Real> Hits<E> {
    pub(super) fn new() -> Self {
        Self {
            distance: Column::new(),
            order: Column::new(),
            start: columns(),
            normal: columns(),
            sides: [Column::new(), Column::new()],
            diffuse: columns(),
            color: columns(),
            mirror: [vec![], vec![], vec![]],
            packets: Vec::with_capacity(PIXELS),
            mirrors: Vec::new(),
        }
    }

    /// Notes what a packet of rays meets; where that is nothing, the background is their colour.
    #[inline(always)]
    pub(super) fn add<S: Simd>(
        &mut self,
        simd: S,
        at: usize,
        found: Nearest<S, E>,
        background: impl FnOnce() -> Vec3<S, E>,
    ) {
        if !found.hit(simd).any_true() {
            return background().store(&mut self.color, at);
        }
        let end = at + Lanes::<S, E>::LEN;
        found.distance.store_slice(&mut self.distance.0[at..end]);
        found.order.store_slice(&mut self.order.0[at..end]);
        // There is room for all packets of a tile; said, so that the loop holds no code to make more.
        assert!(self.packets.len() < self.packets.capacity());
        self.packets.push((at, u64::MAX));
    }
}

/// Columns and rows of a packet's pixels.
#[inline(always)]
pub(super) fn packet_shape<S: Simd, E: Real>() -> (usize, usize) {
    match Lanes::<S, E>::LEN {
        16 => (4, 4),
        8 => (4, 2),
        4 => (2, 2),
        n => (n, 1),
    }
}

/// `from` and on, a number a lane.
#[inline(always)]
pub(super) fn count_from<S: Simd, E: Real>(simd: S, from: usize) -> Lanes<S, E> {
    Lanes::<S, E>::from_slice(simd, &E::COUNT[..Lanes::<S, E>::LEN]) + E::narrow(from as f64)
}

/// The number of a lane modulo `width`, which is a power of two.
#[inline(always)]
pub(super) fn lanes_modulo<S: Simd, E: Real>(simd: S, width: usize) -> Lanes<S, E> {
    let mut numbers = E::COUNT;
    for (lane, number) in numbers.iter_mut().enumerate() {
        *number = E::COUNT[lane & (width - 1)];
    }
    Lanes::<S, E>::from_slice(simd, &numbers[..Lanes::<S, E>::LEN])
}

/// A colour times the weights of a packet's rays, which are 1 for rays from the eye.
#[inline(always)]
pub(super) fn weigh<S: Simd, E: Real, const EYE: bool>(
    simd: S,
    color: [E; 3],
    queue: &Queue<E>,
    at: usize,
) -> Vec3<S, E> {
    let color = Vec3::splat(simd, color);
    if EYE { color } else { color.mul(Vec3::load(simd, &queue.weight, at)) }
}
