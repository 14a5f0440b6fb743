//! Shadow rays through glass. Each glass surface multiplies the light by its transmitted share; an opaque surface
//! blocks it.
//!
//! A ray goes straight on, from surface to surface. It passes all surfaces at the same distance together. Each lane
//! stops on its own, at the light or at an opaque surface.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use crate::fast::acceleration::candidates::Candidates;
use crate::fast::arithmetic::real::{Lanes, Mask, Real, Vec3, constant};
use crate::fast::bodies::{ANY, Bodies};
use crate::fast::build::extensions::Extensions;
use crate::fast::build::features::Features;
use crate::fast::build::prepare::Prepared;
use crate::fast::materials::glass::Glass;
use crate::fast::rays::packet::Ray;
use crate::fast::transport::search::nearest;
use crate::fast::transport::surfaces::{HitPacket, surface};

/// Shadow rays, and their distance to the light.
#[derive(Clone, Copy)]
pub(crate) struct Shadow<S: Simd, E: Real> {
    pub(crate) ray: Ray<S, E>,
    pub(crate) far: Lanes<S, E>,
}

/// The incident light: its colour, and the lanes that it reaches.
#[derive(Clone, Copy)]
pub(crate) struct IncidentLight<S: Simd, E: Real> {
    pub(crate) color: Vec3<S, E>,
    pub(crate) lit: Mask<S, E>,
}

/// The objects that shadow rays test for glass.
#[derive(Clone, Copy)]
pub(crate) struct Panes {
    candidates: Candidates<'static>,
    bodies: u64,
    /// Whether only objects of glass are tested here, because the rays have been tested against all others before.
    are_apart: bool,
}

impl Panes {
    /// Returns those among objects of the row and bodies, given as bits, that are tested for glass: only glass if it is
    /// tested separately, otherwise all.
    #[inline(always)]
    pub(crate) fn new<E: Real>(scene: &Prepared<E>, [shapes, bodies]: [u64; 2]) -> Self {
        match scene.glass_apart() {
            Some(glass) => Self {
                candidates: Candidates::masked(scene.masks(shapes & glass.shapes)),
                bodies: bodies & glass.bodies,
                are_apart: true,
            },
            None => Self { candidates: scene.all(), bodies: ANY, are_apart: false },
        }
    }

    #[inline(always)]
    fn is_empty<E: Real>(&self, bodies: Option<&Bodies<E>>) -> bool {
        self.are_apart
            && !self.candidates.kinds.any()
            && self.bodies == 0
            && !bodies.is_some_and(Bodies::has_planes_of_glass)
    }
}

impl<S: Simd, E: Real> IncidentLight<S, E> {
    /// Follows the light of the `facing` lanes through glass. It has reached the `lit` ones past the objects that were
    /// tested first, and its colour is still that of the light.
    #[inline(always)]
    pub(crate) fn past_glass<F: Features<E>>(
        self,
        simd: S,
        glass: (&Prepared<E>, &Extensions<E>, &Glass<E>),
        (facing, panes): (Mask<S, E>, Panes),
        shadow: Shadow<S, E>,
    ) -> Self {
        let Self { color, lit } = self;
        let hidden = if panes.are_apart { lit } else { facing & !lit };
        if !hidden.any_true() || panes.is_empty(glass.1.bodies()) {
            return self;
        }
        let lit = lit & !hidden;
        Self { color, lit }.through_glass::<F>(simd, glass, (hidden, panes), shadow)
    }

    /// Adds the light that passes through the glass of `panes`, for the `hidden` lanes, whose colour is still that of the light.
    // Out of line, so that it does not use registers of the lighting code for scenes without glass.
    #[inline(never)]
    fn through_glass<F: Features<E>>(
        self,
        simd: S,
        (scene, beyond, glass): (&Prepared<E>, &Extensions<E>, &Glass<E>),
        (hidden, panes): (Mask<S, E>, Panes),
        shadow: Shadow<S, E>,
    ) -> Self {
        simd.vectorize(
            #[inline(always)]
            || {
                let Shadow { mut ray, mut far } = shadow;
                let Self { mut color, mut lit } = self;
                let zero = constant::<S, E>(simd, 0.0);
                let mut open = hidden;
                // A ray that has passed as many surfaces as there are has none ahead.
                for _ in 0..=glass.surfaces {
                    if !open.any_true() {
                        break;
                    }
                    // Lanes that have arrived go along with one that has not, so that they ask for no more objects.
                    let lane = open.to_bitmask().trailing_zeros() as usize;
                    let of = |v: Vec3<S, E>| Vec3::splat(simd, [v.x[lane], v.y[lane], v.z[lane]]);
                    ray.origin = Vec3::select(open, ray.origin, of(ray.origin));
                    ray.direction = Vec3::select(open, ray.direction, of(ray.direction));
                    let mut found = nearest::<S, E, F, false>(simd, scene, ray, panes.candidates);
                    match beyond.bodies() {
                        Some(bodies) if panes.are_apart => {
                            bodies.meet_glass(simd, panes.bodies, ray, &mut found);
                        }
                        Some(bodies) => bodies.intersect(simd, ANY, ray, &mut found),
                        None => {}
                    }
                    if let Some(shared) = &scene.shared {
                        shared.settle::<S, E, F, false>(simd, scene, ray, &mut found);
                    }
                    let hit = open & found.distance.simd_lt(far);
                    lit |= open & !hit;
                    open = hit;
                    let mut orders = [E::narrow(0.0); 16];
                    found.order.store_slice(&mut orders[..Lanes::<S, E>::LEN]);
                    let met = HitPacket { found, orders: &orders, hit };
                    let mut rest = hit.to_bitmask();
                    while rest != 0 {
                        let lane = rest.trailing_zeros();
                        let (entry, same) = met.object(simd, scene, lane);
                        rest &= !same.to_bitmask();
                        let Some(pane) = glass.of(orders[lane as usize]) else {
                            open &= !same;
                            continue;
                        };
                        let dimmed = color.mul(Vec3::splat(simd, pane.color));
                        color = Vec3::select(same, dimmed, color);
                        let object = (entry, orders[lane as usize]);
                        let mut surface = surface::<S, E, F, false>(simd, scene, object, ray, found.distance);
                        if let Some(shared) = &scene.shared {
                            surface = shared.lifted(simd, surface, orders[lane as usize]);
                        }
                        ray.origin = Vec3::select(same, surface.beyond(simd), ray.origin);
                    }
                    far = hit.select(far - found.distance, far);
                }
                lit |= open;
                // Lanes in the dark get no light.
                let color = Vec3::<S, E>::new(
                    lit.select(color.x, zero),
                    lit.select(color.y, zero),
                    lit.select(color.z, zero),
                );
                Self { color, lit }
            },
        )
    }
}
