//! Fog: a step after lighting, which mixes the fog's colour into the colours of hits, by their distance.
//!
//! It is computed lane by lane, so that the exponential is the same on every machine. Rays that hit nothing have the
//! fog's colour already: it is the background of a scene with fog.

use glam::DVec3;
use rayfold_scene::Scene;

use crate::fast::arithmetic::real::Real;
use crate::fast::rays::bounce::{Columns, Hits, ROOM, RayBatch};
use crate::reference::clearness;

/// The fog of a scene.
#[derive(Debug)]
pub(crate) struct Fog {
    color: DVec3,
    /// The fog's distance in the coordinates of the kernels.
    distance: f64,
}

impl Fog {
    /// Returns `None` for a scene without fog. A length of the scene times `scale` is a length of the kernels.
    pub(crate) fn new(scene: &Scene, scale: f64) -> Option<Self> {
        let (color, distance) = scene.fog.get()?;
        Some(Self { color, distance: scale * distance })
    }

    /// Mixes the fog into the colours of the hits. Stores the rest of the rays' weight ([`Hits::clearness`]), and the
    /// mirror coefficients times that. `mirror` returns the coefficients of an object by its order; `is_painted` says
    /// that the hits already contain them. With `EYE` the rays have a weight of 1.
    #[inline(never)]
    pub(crate) fn dim<E: Real, const EYE: bool>(
        &self,
        mirror: impl Fn(usize) -> [E; 3],
        queue: &RayBatch<E>,
        hits: &mut Hits<E>,
        (lanes, is_painted): (usize, bool),
    ) {
        hits.clearness.resize(ROOM, E::narrow(1.0));
        if !is_painted {
            hits.mirror.iter_mut().for_each(|column| column.resize(ROOM, E::narrow(0.0)));
        }
        for &(at, _) in &hits.packets {
            for lane in at..at + lanes {
                if !hits.is_hit(lane) {
                    continue;
                }
                let clear = clearness(hits.distance.0[lane].widen(), self.distance);
                let weight = if EYE { DVec3::ONE } else { read(&queue.weight, lane) };
                let own = read(&hits.color, lane);
                let color = clear * own + (1.0 - clear) * self.color * weight;
                let share = if is_painted {
                    DVec3::from_array([0, 1, 2].map(|channel: usize| hits.mirror[channel][lane].widen()))
                } else {
                    DVec3::from_array(mirror(hits.order.0[lane].to_index()).map(E::widen)) * weight
                };
                hits.clearness[lane] = E::narrow(clear);
                for channel in 0..3 {
                    hits.color[channel].0[lane] = E::narrow(color[channel]);
                    hits.mirror[channel][lane] = E::narrow(clear * share[channel]);
                }
            }
        }
    }
}

fn read<E: Real>(columns: &Columns<E>, lane: usize) -> DVec3 {
    DVec3::new(columns[0].0[lane].widen(), columns[1].0[lane].widen(), columns[2].0[lane].widen())
}
