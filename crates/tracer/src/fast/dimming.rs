//! Shadow rays through glass: each surface on the way to a light dims it by its coefficient, an opaque one takes all of it.
//!
//! A ray goes straight on, from surface to surface, and surfaces at the same place are passed together. Lanes end one by
//! one; each goes its own way, whatever the others do.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::beyond::Beyond;
use super::bodies::ANY;
use super::features::Features;
use super::glass::Glass;
use super::packet::Ray;
use super::prepare::Prepared;
use super::real::{Lanes, Mask, Real, Vec3, constant};
use super::search::nearest;
use super::surfaces::{Met, surface};

/// Shadow rays, and how far it is to the light.
#[derive(Clone, Copy)]
pub(super) struct Shadow<S: Simd, E: Real> {
    pub(super) ray: Ray<S, E>,
    pub(super) far: Lanes<S, E>,
}

/// What arrives of a light's colour, and the lanes in which it does.
#[derive(Clone, Copy)]
pub(super) struct Arriving<S: Simd, E: Real> {
    pub(super) color: Vec3<S, E>,
    pub(super) lit: Mask<S, E>,
}

impl<S: Simd, E: Real> Arriving<S, E> {
    /// Adds what reaches the lanes that something hides, in which the colour is still that of the light, through glass.
    // Out of line, so that the registers of what shines on other scenes are its own.
    #[inline(never)]
    pub(super) fn through_glass<F: Features<E>>(
        self,
        simd: S,
        (scene, beyond, glass): (&Prepared<E>, &Beyond<E>, &Glass<E>),
        hidden: Mask<S, E>,
        shadow: Shadow<S, E>,
    ) -> Self {
        simd.vectorize(
            #[inline(always)]
            || {
                let Shadow { mut ray, mut far } = shadow;
                let Self { mut color, mut lit } = self;
                let zero = constant::<S, E>(simd, 0.0);
                let mut open = hidden;
                // What has passed all surfaces that there are has nothing before it.
                for _ in 0..=glass.surfaces {
                    if !open.any_true() {
                        break;
                    }
                    let mut found = nearest::<S, E, F, false>(simd, scene, ray, scene.all());
                    if let Some(bodies) = beyond.bodies() {
                        bodies.meet(simd, ANY, ray, &mut found);
                    }
                    if let Some(shared) = &scene.shared {
                        shared.settle::<S, E, F, false>(simd, scene, ray, &mut found);
                    }
                    let hit = open & found.distance.simd_lt(far);
                    lit |= open & !hit;
                    open = hit;
                    let mut orders = [E::narrow(0.0); 16];
                    found.order.store_slice(&mut orders[..Lanes::<S, E>::LEN]);
                    let met = Met { found, orders: &orders, hit };
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
                        let mut surface = surface::<S, E, F, false>(simd, scene, entry, ray, found.distance);
                        if let Some(shared) = &scene.shared {
                            surface = shared.lifted(simd, surface, orders[lane as usize]);
                        }
                        ray.origin = Vec3::select(same, surface.beyond(simd), ray.origin);
                    }
                    far = hit.select(far - found.distance, far);
                }
                lit |= open;
                // In the dark nothing is left.
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
