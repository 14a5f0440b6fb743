//! Frames to encode: the project's rendered scenes, and drawn sets that are difficult for an encoder.

use anyhow::Result;
use image::{Rgb, RgbImage};
use rayfold_scene::Screen;
use rayfold_tracer::RenderOptions;
use rayon::prelude::*;

use crate::scenes;

/// An animation to be encoded.
pub(super) struct Set {
    pub(super) name: &'static str,
    pub(super) about: &'static str,
    source: Source,
}

enum Source {
    /// The first frames of a folder in `scenes/`, in their own size or in the given one.
    Traced {
        folder: &'static str,
        size: Option<(u32, u32)>,
        most: usize,
    },
    Drawn {
        draw: fn(Canvas) -> RgbImage,
        size: (u32, u32),
        count: u32,
    },
}

/// The number and the size of a frame to draw.
#[derive(Clone, Copy)]
struct Canvas {
    width: u32,
    height: u32,
    number: u32,
}

impl Set {
    /// Returns all frames in order.
    ///
    /// # Errors
    /// Fails if a script cannot be read or traced.
    pub(super) fn frames(&self) -> Result<Vec<RgbImage>> {
        match self.source {
            Source::Traced { folder, size, most } => {
                let scripts = scenes::scripts(folder)?;
                let trace = |script: &String| {
                    let mut scene = scenes::first_frame(folder, script)?;
                    if let Some((width, height)) = size {
                        scene.screen = Screen::new(width, height)?;
                    }
                    Ok(rayfold_tracer::render(&scene, &RenderOptions::default())?)
                };
                scripts.iter().take(most).map(trace).collect()
            }
            Source::Drawn { draw, size: (width, height), count } => {
                Ok((0..count).map(|number| draw(Canvas { width, height, number })).collect())
            }
        }
    }
}

/// Returns all sets: the project's scenes, then common pictures, then difficult ones.
pub(super) fn all() -> Vec<Set> {
    let traced =
        |name, about, size, most| Set { name, about, source: Source::Traced { folder: name, size, most } };
    let drawn = |name, about, size, count, draw: fn(Canvas) -> RgbImage| Set {
        name,
        about,
        source: Source::Drawn { draw, size, count },
    };
    let hello_1080p = Set {
        name: "hello-1080p",
        about: "the first frames of hello, large",
        source: Source::Traced { folder: "hello", size: Some((1920, 1080)), most: 12 },
    };
    vec![
        traced("hello", "five letters wave, balls stroll around them", None, 50),
        hello_1080p,
        traced("artistic", "a crystal turns, a mirror ball circles it", None, 20),
        traced("artisticsss", "colours circle a mirror, the camera sways", None, 20),
        traced("moving_up", "a mirror ball rises and sinks", None, 10),
        traced("sphere_light", "a shadow sweeps a slab", None, 10),
        drawn("spheres", "shaded spheres over a gradient", (640, 480), 50, spheres),
        drawn(LARGE, "the frames of spheres, large", (1920, 1080), 30, spheres),
        drawn("camera", "a moving camera: every pixel changes", (640, 480), 20, camera),
        drawn(
            "light",
            "a light that changes its colour: every pixel changes a little",
            (640, 480),
            20,
            light,
        ),
        drawn("dusk", "a slow gradient of few levels", (640, 360), 20, dusk),
        drawn("texture", "a textured ground, one sphere moves", (640, 480), 20, texture),
        drawn("pixel", "one pixel changes", (480, 360), 20, pixel),
        drawn("flat", "flat colours", (480, 360), 20, flat),
        drawn(NOISE, "noise, new in every frame", (320, 240), 10, noise),
    ]
}

/// The set on which memory is measured.
pub(super) const LARGE: &str = "spheres-1080p";

/// The set whose GIF may be larger than the rival's.
pub(super) const NOISE: &str = "noise";

fn paint(canvas: Canvas, colour: impl Fn(f32, f32) -> [f32; 3] + Sync) -> RgbImage {
    let Canvas { width, height, .. } = canvas;
    let mut image = RgbImage::new(width, height);
    image.as_mut().par_chunks_exact_mut(3 * width as usize).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            let [u, v] = [
                (x as f32 + 0.5 - width as f32 / 2.0) / height as f32,
                0.5 - (y as f32 + 0.5) / height as f32,
            ];
            *pixel = colour(u, v).map(|level| (level.clamp(0.0, 1.0) * 255.0 + 0.5) as u8);
        }
    });
    image
}

fn mix(a: [f32; 3], b: [f32; 3], part: f32) -> [f32; 3] {
    [0, 1, 2].map(|k| a[k] + (b[k] - a[k]) * part)
}

fn scatter(k: u32) -> u32 {
    let k = (k ^ k >> 16).wrapping_mul(0x7feb_352d);
    let k = (k ^ k >> 15).wrapping_mul(0x846c_a68b);
    k ^ k >> 16
}

struct Ball {
    at: [f32; 3],
    radius: f32,
    colour: [f32; 3],
}

/// Returns the nearest sphere along a parallel ray, lit by Lambert and Phong.
fn shade(balls: &[Ball], light: [f32; 3], u: f32, v: f32) -> Option<[f32; 3]> {
    let hit = |ball: &Ball| {
        let (dx, dy) = ((u - ball.at[0]) / ball.radius, (v - ball.at[1]) / ball.radius);
        let square = 1.0 - dx * dx - dy * dy;
        (square > 0.0)
            .then(|| (ball.at[2] + ball.radius * square.sqrt(), [dx, dy, square.sqrt()], ball.colour))
    };
    let (_, normal, colour) = balls.iter().filter_map(hit).max_by(|a, b| a.0.total_cmp(&b.0))?;
    let towards = [0.48, 0.64, 0.6];
    let dot = (0..3).map(|k| normal[k] * towards[k]).sum::<f32>();
    let mirrored = 2.0 * dot * normal[2] - towards[2];
    let gloss = if dot > 0.0 { mirrored.max(0.0).powi(24) } else { 0.0 };
    Some([0, 1, 2].map(|k| light[k] * (colour[k] * (0.12 + 0.88 * dot.max(0.0)) + 0.5 * gloss)))
}

fn ring(number: u32, count: u32) -> Vec<Ball> {
    let colours = [
        [0.9, 0.2, 0.15],
        [0.2, 0.7, 0.25],
        [0.2, 0.35, 0.9],
        [0.95, 0.75, 0.2],
        [0.8, 0.8, 0.85],
        [0.6, 0.2, 0.7],
        [0.2, 0.75, 0.75],
    ];
    let ball = |k: u32| {
        let turn = (number as f32 / 50.0 + k as f32 / count as f32) * std::f32::consts::TAU;
        let depth = turn.sin();
        Ball {
            at: [0.42 * turn.cos(), 0.1 * depth + 0.03 * (3.0 * turn).cos(), depth],
            radius: 0.12 + 0.03 * depth,
            colour: colours[k as usize % colours.len()],
        }
    };
    (0..count).map(ball).collect()
}

fn spheres(canvas: Canvas) -> RgbImage {
    let balls = ring(canvas.number, 7);
    paint(canvas, |u, v| {
        shade(&balls, [1.0; 3], u, v)
            .unwrap_or_else(|| mix([0.95, 0.9, 0.8], [0.25, 0.45, 0.75], 0.5 + v + 0.1 * u))
    })
}

fn camera(canvas: Canvas) -> RgbImage {
    let shift = canvas.number as f32 * 0.021;
    let mut balls = ring(7, 5);
    for ball in &mut balls {
        ball.at[0] -= shift - 0.2;
    }
    paint(canvas, |u, v| {
        if let Some(colour) = shade(&balls, [1.0; 3], u, v) {
            return colour;
        }
        if v > -0.05 {
            return mix([0.8, 0.85, 0.95], [0.2, 0.4, 0.8], (v + 0.05) * 1.6 + 0.08 * (u + shift));
        }
        let depth = 0.12 / (-v - 0.02);
        let (x, z) = ((u + shift * 2.0) * depth * 4.0, depth * 4.0);
        let dark = (x.floor() + z.floor()).rem_euclid(2.0) < 1.0;
        let tile = if dark { [0.25, 0.22, 0.2] } else { [0.8, 0.76, 0.7] };
        mix(tile, [0.6, 0.65, 0.75], (depth * 0.25).min(1.0))
    })
}

fn light(canvas: Canvas) -> RgbImage {
    let balls = ring(11, 6);
    let turn = canvas.number as f32 * 0.06;
    let light =
        [0.85 + 0.15 * turn.cos(), 0.85 + 0.15 * (turn + 2.1).cos(), 0.85 + 0.15 * (turn + 4.2).cos()];
    paint(canvas, |u, v| {
        shade(&balls, light, u, v).unwrap_or_else(|| {
            let glow = 0.55 / (1.0 + 2.5 * (u * u + v * v));
            [glow * light[0], glow * light[1] * 0.9, glow * light[2] * 0.8]
        })
    })
}

fn dusk(canvas: Canvas) -> RgbImage {
    let time = canvas.number as f32 / 400.0;
    paint(canvas, |u, v| {
        let far = (u * u + (v + 0.3) * (v + 0.3)).sqrt();
        mix([0.24 + time, 0.15 + time * 0.5, 0.17], [0.05, 0.05, 0.11], (far * 1.1).min(1.0))
    })
}

fn lattice(x: i32, y: i32, seed: u32) -> f32 {
    (scatter(x as u32 ^ scatter(y as u32 ^ scatter(seed))) & 0xffff) as f32 / 65_535.0
}

/// Returns value noise of several octaves.
fn cloud(x: f32, y: f32, octaves: u32) -> f32 {
    let mut sum = 0.0;
    let mut size = 0.5;
    for octave in 0..octaves {
        let scale = (1 << octave) as f32;
        let (x, y) = (x * scale, y * scale);
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let (sx, sy) = (fx * fx * (3.0 - 2.0 * fx), fy * fy * (3.0 - 2.0 * fy));
        let at = |dx, dy| lattice(x.floor() as i32 + dx, y.floor() as i32 + dy, octave);
        let (top, bottom) = (at(0, 0) + (at(1, 0) - at(0, 0)) * sx, at(0, 1) + (at(1, 1) - at(0, 1)) * sx);
        sum += size * (top + (bottom - top) * sy);
        size *= 0.55;
    }
    sum
}

fn texture(canvas: Canvas) -> RgbImage {
    let mut balls = ring(canvas.number * 2, 1);
    balls[0].radius = 0.2;
    paint(canvas, |u, v| {
        shade(&balls, [1.0; 3], u, v).unwrap_or_else(|| {
            let (a, b) = (cloud(u * 5.0 + 9.0, v * 5.0 + 9.0, 7), cloud(u * 3.0 + 40.0, v * 3.0 + 7.0, 5));
            [0.2 + 0.7 * a, 0.15 + 0.45 * a + 0.3 * b, 0.1 + 0.6 * b * a]
        })
    })
}

fn pixel(canvas: Canvas) -> RgbImage {
    let mut image = spheres(Canvas { number: 3, ..canvas });
    let at = canvas.number * 17;
    image.put_pixel(at % canvas.width, at % canvas.height, Rgb([255, 0, 255]));
    image
}

fn flat(canvas: Canvas) -> RgbImage {
    let number = canvas.number as f32;
    paint(canvas, |u, v| {
        let column = ((u + 1.0) * 12.0) as u32;
        if (u - 0.02 * number + 0.3).abs() < 0.12 && v.abs() < 0.2 {
            [0.95, 0.3, 0.1]
        } else {
            let [r, g, b, _] = scatter(column + 40).to_le_bytes();
            [r, g, b].map(|level| f32::from(level) / 255.0)
        }
    })
}

fn noise(canvas: Canvas) -> RgbImage {
    RgbImage::from_fn(canvas.width, canvas.height, |x, y| {
        let [r, g, b, _] = scatter(canvas.number << 24 ^ y << 12 ^ x).to_le_bytes();
        Rgb([r, g, b])
    })
}
