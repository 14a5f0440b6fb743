//! Buffers for the rays and hits of a tile, as structures of arrays. Each step reads the output of the step before.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use crate::fast::arithmetic::real::{Lanes, Mask, Real, Vec3};
use crate::fast::rays::packet::Nearest;

/// The largest number of pixels in a tile.
pub(crate) const PIXELS: usize = 256;

/// The length of a column: a tile's pixels, and room for a packet that begins at the last of them.
pub(crate) const ROOM: usize = PIXELS + 16;

/// A column of a structure of arrays: a number for each ray of a tile.
#[derive(Clone)]
#[repr(align(64))]
pub(crate) struct Column<E>(pub(crate) [E; ROOM]);

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

pub(crate) type Columns<E> = [Column<E>; 3];

impl<E: Real> Column<E> {
    pub(crate) fn new() -> Self {
        Self([E::narrow(0.0); ROOM])
    }
}

pub(crate) fn columns<E: Real>() -> Columns<E> {
    [Column::new(), Column::new(), Column::new()]
}

/// A batch of rays to be traced.
pub(crate) struct RayBatch<E> {
    pub(crate) origin: Columns<E>,
    pub(crate) direction: Columns<E>,
    /// The factor of the rays' colour in the colour of the pixel.
    pub(crate) weight: Columns<E>,
    pub(crate) pixel: Column<E>,
    /// For each ray, one more than the order of the glass object that the ray is within, or 0 if it is not known.
    /// Filled only for rays that wait in the queues of glass.
    pub(crate) inside: Column<E>,
    pub(crate) count: usize,
}

impl<E: Real> RayBatch<E> {
    pub(crate) fn new() -> Self {
        let [pixel, inside] = [Column::new(), Column::new()];
        Self { origin: columns(), direction: columns(), weight: columns(), pixel, inside, count: 0 }
    }

    /// Fills the last packet up to `lanes` lanes with copies of the last ray. The copies belong to no pixel.
    #[inline(always)]
    pub(crate) fn fill_up(&mut self, lanes: usize) {
        let last = self.count - 1;
        let end = self.count.next_multiple_of(lanes);
        for columns in [&mut self.origin, &mut self.direction, &mut self.weight] {
            for column in columns {
                let value = column.0[last];
                column.0[last + 1..end].fill(value);
            }
        }
        self.pixel.0[last + 1..end].fill(E::narrow(-1.0));
        let inside = self.inside.0[last];
        self.inside.0[last + 1..end].fill(inside);
    }
}

/// The hits of a tile's rays.
pub(crate) struct Hits<E> {
    /// The distances along the rays.
    pub(crate) distance: Column<E>,
    /// The object's position in the script.
    pub(crate) order: Column<E>,
    pub(crate) start: Columns<E>,
    pub(crate) normal: Columns<E>,
    /// The offset of the start from the surface, and the side: 1 for rays that come from within the object, 0 for
    /// others. Filled only for scenes with glass.
    pub(crate) sides: [Column<E>; 2],
    /// The diffuse coefficient times the ray's weight.
    pub(crate) diffuse: Columns<E>,
    pub(crate) color: Columns<E>,
    /// The mirror coefficient times the ray's weight, times the share that fog leaves of it. Filled only for scenes
    /// with patterns or fog.
    pub(crate) mirror: [Vec<E>; 3],
    /// The share that fog leaves of a ray's light. Filled only for scenes with fog.
    pub(crate) clearness: Vec<E>,
    /// The normals of the faces of meshes. These four are filled only for scenes with faces that have normals, colours or
    /// an inside; in them `start` is where shadow rays start, and `normal` that of the light.
    pub(crate) face: [Vec<E>; 3],
    /// The starts of rays that go on.
    pub(crate) place: [Vec<E>; 3],
    /// The vector from the starts of shadow rays to the other side of the face, for lights behind the face. It is 0 if
    /// the face hides them.
    pub(crate) under: [Vec<E>; 3],
    /// The normals at which rays go on.
    pub(crate) onward: [Vec<E>; 3],
    /// For each packet with hits: its first index, and the spheres that can occlude its light, as bits.
    pub(crate) packets: Vec<(usize, u64)>,
    /// For each packet with mirrors: its first index, and the lanes that hit them, as bits.
    pub(crate) mirrors: Vec<(usize, u64)>,
}

impl<E: Real> Hits<E> {
    pub(crate) fn new() -> Self {
        Self {
            distance: Column::new(),
            order: Column::new(),
            start: columns(),
            normal: columns(),
            sides: [Column::new(), Column::new()],
            diffuse: columns(),
            color: columns(),
            mirror: [vec![], vec![], vec![]],
            clearness: vec![],
            face: [vec![], vec![], vec![]],
            place: [vec![], vec![], vec![]],
            under: [vec![], vec![], vec![]],
            onward: [vec![], vec![], vec![]],
            packets: Vec::with_capacity(PIXELS),
            mirrors: Vec::new(),
        }
    }

    /// Returns the starts of shadow rays towards a light. A face with normals does not hide a light from a ray that starts
    /// on it.
    #[inline(always)]
    pub(crate) fn shadow_start<S: Simd>(&self, simd: S, at: usize, towards: Vec3<S, E>) -> Vec3<S, E> {
        let start = Vec3::load(simd, &self.start, at);
        if self.under[0].is_empty() {
            return start;
        }
        let under = Vec3::<S, E>::load(simd, &self.under, at);
        let is_behind = under.dot(towards).simd_gt(Lanes::<S, E>::splat(simd, E::narrow(0.0)));
        Vec3::select(is_behind, start.sub(under.scale(Lanes::<S, E>::splat(simd, E::narrow(-1.0)))), start)
    }

    /// Returns the hits as lights see them. Their points are those of the surface, even if shadow rays start elsewhere.
    #[inline(always)]
    pub(crate) fn places<S: Simd>(&self, simd: S, at: usize) -> Vec3<S, E> {
        if self.place[0].is_empty() {
            Vec3::load(simd, &self.start, at)
        } else {
            Vec3::load(simd, &self.place, at)
        }
    }

    /// Returns the hits of rays that come from within the glass that they hit. Scenes without glass have none.
    #[inline(always)]
    pub(crate) fn are_within<S: Simd>(&self, simd: S, at: usize) -> Mask<S, E> {
        let within = Lanes::<S, E>::from_slice(simd, &self.sides[1].0[at..at + Lanes::<S, E>::LEN]);
        within.simd_gt(Lanes::<S, E>::splat(simd, E::narrow(0.0)))
    }

    /// Stores the hits of a packet of rays. If none hits anything, stores the background as their colour.
    #[inline(always)]
    pub(crate) fn add<S: Simd>(
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
        // There is room for all packets of a tile. The assertion lets the compiler leave out the code that grows the
        // vector.
        assert!(self.packets.len() < self.packets.capacity());
        self.packets.push((at, u64::MAX));
    }

    /// Returns whether the ray in a lane of one of the `packets` hits anything. The distance of a miss is
    /// [`Real::FAR`], rounded.
    #[inline(always)]
    pub(crate) fn is_hit(&self, lane: usize) -> bool {
        self.distance.0[lane].widen() < E::narrow(E::FAR).widen()
    }
}

/// Returns the columns and rows of a packet's pixels.
#[inline(always)]
pub(crate) fn packet_shape<S: Simd, E: Real>() -> (usize, usize) {
    match Lanes::<S, E>::LEN {
        16 => (4, 4),
        8 => (4, 2),
        4 => (2, 2),
        n => (n, 1),
    }
}

/// Returns consecutive numbers from `from`, one per lane.
#[inline(always)]
pub(crate) fn count_from<S: Simd, E: Real>(simd: S, from: usize) -> Lanes<S, E> {
    Lanes::<S, E>::from_slice(simd, &E::COUNT[..Lanes::<S, E>::LEN]) + E::narrow(from as f64)
}

/// Returns the index of each lane modulo `width`, which is a power of two.
#[inline(always)]
pub(crate) fn lanes_modulo<S: Simd, E: Real>(simd: S, width: usize) -> Lanes<S, E> {
    let mut numbers = E::COUNT;
    for (lane, number) in numbers.iter_mut().enumerate() {
        *number = E::COUNT[lane & (width - 1)];
    }
    Lanes::<S, E>::from_slice(simd, &numbers[..Lanes::<S, E>::LEN])
}

/// Returns a colour times the weights of a packet's rays. The weight of a camera ray is 1.
#[inline(always)]
pub(crate) fn weigh<S: Simd, E: Real, const EYE: bool>(
    simd: S,
    color: [E; 3],
    queue: &RayBatch<E>,
    at: usize,
) -> Vec3<S, E> {
    let color = Vec3::splat(simd, color);
    if EYE { color } else { color.mul(Vec3::load(simd, &queue.weight, at)) }
}

#[cfg(test)]
mod tests {
    use fearless_simd::Level;

    use super::*;
    use crate::fast::arithmetic::dispatch::on;
    use crate::fast::arithmetic::real::constant;

    fn lanes_without_a_hit_are_known<E: Real>() {
        let mut hits = Hits::<E>::new();
        on!(Level::new(), simd => {
            let mut found = Nearest::none(simd);
            let lanes = count_from::<_, E>(simd, 0);
            let near = constant::<_, E>(simd, 0.5);
            found.offer(simd, lanes.simd_lt(near), near, E::narrow(7.0));
            hits.add(simd, 0, found, || Vec3::zero(simd));
        });
        assert_eq!([0, 1].map(|lane| hits.is_hit(lane)), [true, false]);
    }

    #[test]
    fn lanes_without_a_hit_are_known_in_single_and_double_precision() {
        lanes_without_a_hit_are_known::<f32>();
        lanes_without_a_hit_are_known::<f64>();
    }
}
