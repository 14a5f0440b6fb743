//! Whole images: cost and error of each way on each scene.

use anyhow::{Context, Result};
use glam::DVec3;
use image::RgbImage;
use rayfold_scene::Scene;
use rayfold_tracer::reference;
use rayon::prelude::*;

use super::flip::flip;
use super::rays;
use crate::cpu_time;
use crate::oracle;
use crate::tracers::Tracer;

/// A way on a scene.
pub(crate) struct Measurement {
    pub(crate) tracer: String,
    /// Of one image, on one thread: the median of the rounds.
    pub(crate) seconds: f64,
    /// In levels, over all channels.
    pub(crate) rmse: f64,
    /// In levels.
    pub(crate) largest: u8,
    /// Pixels off by more than 2 levels in a channel.
    pub(crate) off: usize,
    pub(crate) flip: f64,
    /// Whether no other way is both as fast and as close.
    pub(crate) on_front: bool,
}

/// All ways on a scene.
pub(crate) struct Comparison {
    pub(crate) scene: String,
    pub(crate) objects: usize,
    pub(crate) pixels: usize,
    /// Camera, shadow and mirror rays of one image.
    pub(crate) rays: u64,
    pub(crate) measurements: Vec<Measurement>,
    pub(crate) truth: Truth,
}

/// The error of the image that the others are compared with.
pub(crate) struct Truth {
    /// Pixels that the oracle drew as well.
    pub(crate) samples: usize,
    /// Largest difference from the oracle in a channel, in levels before rounding; pixels that see another object apart.
    pub(crate) largest: f64,
    /// Pixels that see or shade another object than the oracle: off by more than half a level.
    pub(crate) off: usize,
}

/// Draws the scene with every way in turn, `rounds` times. The first way draws the truth.
pub(crate) fn compare(
    name: &str,
    scene: &Scene,
    tracers: &[&Tracer],
    rounds: usize,
    samples: usize,
) -> Result<Comparison> {
    let (truth, others) = tracers.split_first().context("no way to trace")?;
    let mut seconds = vec![Vec::new(); tracers.len()];
    let mut images = Vec::new();
    for round in 0..rounds {
        for (tracer, seconds) in tracers.iter().zip(&mut seconds) {
            let (time, image) = cpu_time::of(|| tracer.render(scene))?;
            seconds.push(time);
            if round == 0 {
                images.push(image?);
            }
        }
    }
    let mut measurements: Vec<Measurement> = std::iter::once(truth)
        .chain(others)
        .zip(seconds)
        .zip(&images)
        .map(|((tracer, seconds), image)| measure(tracer, cpu_time::median(seconds), image, &images[0]))
        .collect();
    let costs: Vec<_> = measurements.iter().map(|m| (m.seconds, m.rmse)).collect();
    for m in &mut measurements {
        m.on_front = !costs.iter().any(|&(seconds, rmse)| {
            seconds <= m.seconds && rmse <= m.rmse && (seconds < m.seconds || rmse < m.rmse)
        });
    }
    Ok(Comparison {
        scene: name.into(),
        objects: scene.objects.len(),
        pixels: images[0].pixels().len(),
        rays: rays::count(scene, truth)?,
        measurements,
        truth: against_oracle(scene, samples),
    })
}

fn measure(tracer: &Tracer, seconds: f64, image: &RgbImage, truth: &RgbImage) -> Measurement {
    let mut squares = 0.0;
    let (mut largest, mut off) = (0, 0);
    for (a, b) in image.pixels().zip(truth.pixels()) {
        let differences = [0, 1, 2].map(|c| a.0[c].abs_diff(b.0[c]));
        squares += differences.iter().map(|&d| f64::from(d).powi(2)).sum::<f64>();
        let worst = differences.into_iter().max().unwrap_or(0);
        largest = largest.max(worst);
        off += usize::from(worst > 2);
    }
    Measurement {
        tracer: tracer.name.clone(),
        seconds,
        rmse: (squares / (3 * image.pixels().len()) as f64).sqrt(),
        largest,
        off,
        flip: flip(image, truth),
        on_front: false,
    }
}

/// The plain tracer's colours against the oracle's, at pixels spread evenly over the image.
fn against_oracle(scene: &Scene, samples: usize) -> Truth {
    let (width, height) = (scene.screen.width(), scene.screen.height());
    let pixels = u64::from(width) * u64::from(height);
    let step = (pixels as f64 / samples as f64).max(1.0);
    let count = samples.min(pixels as usize);
    let displayed = |color: DVec3| 255.0 * color.clamp(DVec3::ZERO, DVec3::ONE);
    let errors: Vec<f64> = (0..count)
        .into_par_iter()
        .map(|k| {
            let pixel = (k as f64 * step) as u64;
            let (i, j) = ((pixel % u64::from(width)) as u32, (pixel / u64::from(width)) as u32);
            let (exact, computed) = (oracle::color(scene, i, j), reference::color(scene, i, j));
            (displayed(exact) - displayed(computed)).abs().max_element()
        })
        .collect();
    let near = |e: &&f64| **e <= 0.5;
    Truth {
        samples: count,
        largest: errors.iter().filter(near).copied().fold(0.0, f64::max),
        off: errors.len() - errors.iter().filter(near).count(),
    }
}
