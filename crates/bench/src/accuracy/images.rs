//! Cost and error of each backend for whole images of each scene.

use anyhow::{Context, Result};
use glam::DVec3;
use image::RgbImage;
use rayfold_scene::Scene;
use rayfold_tracer::{MAX_BOUNCES, Precision, RenderOptions, reference};
use rayon::prelude::*;

use super::flip::flip;
use super::rays;
use crate::backends::{self, Backend, packets};
use crate::cpu_time;
use crate::oracle;
use crate::outlines::dots;

/// The greatest depth that is measured. Errors of lower depths are relative to it.
pub(crate) const DEEPEST: u32 = 16;

/// A scene, and the options for measuring it.
pub(crate) struct Subject {
    pub(crate) name: String,
    pub(crate) scene: Scene,
    /// The number of times that each image is drawn.
    pub(crate) rounds: usize,
    /// The number of pixels that the oracle draws as well.
    pub(crate) samples: usize,
    /// Whether the plain tracer draws the true image, testing every object for every ray. If that takes too long, the
    /// f64 packets draw it.
    pub(crate) plain: bool,
    /// Whether the scene is also drawn at other depths than the language's.
    pub(crate) deep: bool,
}

/// A measurement of a backend on a scene, at a depth.
pub(crate) struct Measurement {
    pub(crate) backend: String,
    pub(crate) bounces: u32,
    pub(crate) rays: u64,
    /// The time of one image on one thread: the median of the rounds.
    pub(crate) seconds: f64,
    /// The error relative to the true image of the same depth.
    pub(crate) error: Error,
    /// The root mean square error relative to the true image of the greatest depth, in levels.
    pub(crate) unfinished: f64,
    /// Whether the measurement is on the Pareto front: no other backend and depth is both at least as fast and as
    /// accurate, relative to the true image of the greatest depth.
    pub(crate) on_front: bool,
}

/// The difference of two images.
pub(crate) struct Error {
    /// The root mean square over all channels, in levels.
    pub(crate) rmse: f64,
    /// The largest difference in levels.
    pub(crate) largest: u8,
    /// The number of pixels off by more than 2 levels in a channel.
    pub(crate) off: usize,
    /// The number of pixels that differ from all pixels around them in the true image.
    pub(crate) dots: usize,
    pub(crate) flip: f64,
    /// The number of channels that were NaN before they were converted to a level.
    pub(crate) nans: u64,
}

/// The measurements of all backends on a scene.
pub(crate) struct Comparison {
    pub(crate) scene: String,
    pub(crate) objects: usize,
    pub(crate) size: (u32, u32),
    /// By backend, and for each from the least depth to the greatest. A depth that adds no ray is omitted.
    pub(crate) measurements: Vec<Measurement>,
    pub(crate) truth: Truth,
}

impl Comparison {
    pub(crate) fn pixels(&self) -> usize {
        self.size.0 as usize * self.size.1 as usize
    }

    /// Returns the measurements at the language's depth.
    pub(crate) fn pictures(&self) -> impl Iterator<Item = &Measurement> {
        self.measurements.iter().filter(|m| m.bounces == MAX_BOUNCES)
    }
}

/// The error of the image that the others are compared with.
pub(crate) struct Truth {
    pub(crate) backend: String,
    /// The number of pixels that the oracle drew as well.
    pub(crate) samples: usize,
    /// The largest difference from the oracle in a channel, in levels, without the pixels counted in `off`.
    pub(crate) largest: f64,
    /// The number of pixels that show or shade another object than the oracle: off by more than half a level, or two if
    /// the true image has whole levels.
    pub(crate) off: usize,
}

/// An image that is not yet compared.
struct Drawn {
    backend: String,
    depth: usize,
    image: RgbImage,
    nans: u64,
    seconds: Vec<f64>,
}

/// Draws the scene with every backend at every depth in turn.
pub(crate) fn compare(subject: &Subject) -> Result<Comparison> {
    let scene = &subject.scene;
    let counter = if subject.plain {
        backends::reference()
    } else {
        packets("f64", RenderOptions { precision: Precision::F64, ..Default::default() })
    };
    let counts = rays::count(scene, &counter, if subject.deep { DEEPEST } else { MAX_BOUNCES })?;
    let adds =
        |bounces: &u32| *bounces == MAX_BOUNCES || counts[*bounces as usize] > counts[*bounces as usize - 1];
    let depths: Vec<u32> =
        if subject.deep { (1..=DEEPEST).filter(adds).collect() } else { vec![MAX_BOUNCES] };
    let backends: Vec<Vec<Backend>> = depths.iter().map(|&bounces| backends::for_pictures(bounces)).collect();
    let truth_of = |backends: &[Backend]| if subject.plain { 0 } else { backends.len() - 1 };
    let mut drawn: Vec<Drawn> = Vec::new();
    for k in 0..backends[0].len() {
        for (depth, backends) in backends.iter().enumerate() {
            let backend = &backends[k];
            if k == 0 && !subject.plain {
                continue;
            }
            rayfold_tracer::take_nans();
            let (seconds, image) = cpu_time::of(|| backend.render(scene))?;
            let (backend, nans) = (backend.name.clone(), rayfold_tracer::take_nans());
            drawn.push(Drawn { backend, depth, image: image?, nans, seconds: vec![seconds] });
        }
    }
    for _ in 1..subject.rounds {
        for one in &mut drawn {
            // The plain tracer is drawn once only: it is slow, and its time is not reported.
            let backend = backends[one.depth].iter().skip(1).find(|backend| backend.name == one.backend);
            if let Some(backend) = backend {
                let (seconds, image) = cpu_time::of(|| backend.render(scene))?;
                image?;
                one.seconds.push(seconds);
            }
        }
    }
    let truth = &backends[0][truth_of(&backends[0])];
    let truths: Vec<&RgbImage> =
        drawn.iter().filter(|one| one.backend == truth.name).map(|one| &one.image).collect();
    let last = truths.last().context("no truth")?;
    let mut measurements: Vec<Measurement> = drawn
        .par_iter()
        .map(|one| Measurement {
            backend: one.backend.clone(),
            bounces: depths[one.depth],
            rays: counts[depths[one.depth] as usize],
            seconds: cpu_time::median(one.seconds.clone()),
            error: Error { nans: one.nans, ..error(&one.image, truths[one.depth]) },
            unfinished: rmse(&one.image, last),
            on_front: false,
        })
        .collect();
    let costs: Vec<_> = measurements.iter().map(|m| (m.seconds, m.unfinished)).collect();
    for m in &mut measurements {
        m.on_front = !costs.iter().any(|&(seconds, rmse)| {
            seconds <= m.seconds && rmse <= m.unfinished && (seconds < m.seconds || rmse < m.unfinished)
        });
    }
    let picture = depths.iter().position(|&depth| depth == MAX_BOUNCES).context("the language's depth")?;
    Ok(Comparison {
        scene: subject.name.clone(),
        objects: scene.objects.len(),
        size: truths[0].dimensions(),
        measurements,
        truth: against_oracle(subject, truth, truths[picture]),
    })
}

fn error(image: &RgbImage, truth: &RgbImage) -> Error {
    let (mut largest, mut off) = (0, 0);
    for (a, b) in image.pixels().zip(truth.pixels()) {
        let worst = (0..3).map(|c| a.0[c].abs_diff(b.0[c])).max().unwrap_or(0);
        largest = largest.max(worst);
        off += usize::from(worst > 2);
    }
    let flip = if largest == 0 { 0.0 } else { flip(image, truth) };
    Error { rmse: rmse(image, truth), largest, off, dots: dots(image, truth).len(), flip, nans: 0 }
}

fn rmse(image: &RgbImage, truth: &RgbImage) -> f64 {
    let squares = |(a, b): (&image::Rgb<u8>, &image::Rgb<u8>)| -> f64 {
        (0..3).map(|c| f64::from(a.0[c].abs_diff(b.0[c])).powi(2)).sum()
    };
    let sum: f64 = image.pixels().zip(truth.pixels()).map(squares).sum();
    (sum / (3 * image.pixels().len()) as f64).sqrt()
}

/// Compares the true image with the oracle, at pixels spread evenly over the image.
fn against_oracle(subject: &Subject, backend: &Backend, image: &RgbImage) -> Truth {
    let scene = &subject.scene;
    let (width, height) = image.dimensions();
    let pixels = u64::from(width) * u64::from(height);
    let count = subject.samples.min(pixels as usize);
    let step = pixels as f64 / count as f64;
    let displayed = |color: DVec3| 255.0 * color.clamp(DVec3::ZERO, DVec3::ONE);
    let errors: Vec<f64> = (0..count)
        .into_par_iter()
        .map(|k| {
            let pixel = ((k as f64 + 0.5) * step) as u64;
            let (i, j) = ((pixel % u64::from(width)) as u32, (pixel / u64::from(width)) as u32);
            let drawn = if subject.plain {
                displayed(reference::color(scene, i, j))
            } else {
                DVec3::from_array(image.get_pixel(i, height - 1 - j).0.map(f64::from))
            };
            (displayed(oracle::color(scene, i, j)) - drawn).abs().max_element()
        })
        .collect();
    let other = if subject.plain { 0.5 } else { 2.0 };
    let near = |e: &&f64| **e <= other;
    Truth {
        backend: backend.name.clone(),
        samples: count,
        largest: errors.iter().filter(near).copied().fold(0.0, f64::max),
        off: errors.len() - errors.iter().filter(near).count(),
    }
}
