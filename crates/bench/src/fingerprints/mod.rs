//! `rayfold-bench fingerprints`: prints a line per picture, by which two builds of the program can be compared.
//!
//! If a change of the tracer must not change pictures, the lines of the program before and after are equal byte for
//! byte. The pictures are those of the scripts in the given folders and of random scenes. These are small and meant to
//! be difficult: every kind of object alone and together, few and many of them, coplanar faces, eyes within objects,
//! lights along the axes. Each is drawn with every instruction set and every precision. Tests check whether a picture
//! is right; this program does not.
//!
//! ```text
//! rayfold-bench fingerprints scenes --random 10000 > after.txt
//! cmp before.txt after.txt
//! ```
//!
//! With `--check` it compares other pictures with a table that is kept: those that every kind of machine must draw
//! alike (`machines`).

mod folders;
mod lights;
mod machines;
mod scripts;

use std::fmt::Write as _;
use std::hash::{DefaultHasher, Hasher};
use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use glam::{DVec2, DVec3};
use rayfold_scene::{
    Camera, Cuboid, DirectionalLight, Light, Limits, Material, Object, Pinhole, Scene, Screen, Sphere,
    Triangle, parse,
};
use rayfold_tracer::{Precision, RenderOptions, probe, reference, render, render_naive};
use rayon::prelude::*;

use self::folders::find;
use self::machines::Machine;
pub(crate) use self::machines::in_small;
use crate::backends::levels;

/// The options of the subcommand.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folders of scripts; subfolders are included
    folders: Vec<PathBuf>,
    /// Number of random scenes in addition
    #[arg(long, default_value_t = 0)]
    random: u64,
    /// Seed of the first random scene; the others have the seeds that follow. With `--check`, from any other than 1 on only
    /// random scripts are drawn
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Draw the examples and this many `--random` scripts of all versions of the language, and compare them with the table
    /// of fingerprints: this machine, with each of its instruction sets, draws the same pictures as every other
    #[arg(long, conflicts_with = "folders")]
    check: bool,
    /// With `--check`: draw them on another kind of machine, too, which is emulated
    #[arg(long, value_enum, requires = "check", value_name = "MACHINE")]
    on: Vec<Machine>,
    /// With `--on`: draw no examples, and not on this machine, by a program that is sooner built
    #[arg(long, requires = "on")]
    slice: bool,
    /// Write that table anew
    #[arg(long, conflicts_with_all = ["folders", "seed", "check"])]
    write: bool,
}

/// Draws all pictures and prints a line for each.
///
/// # Errors
/// Fails if a folder cannot be read, a script is wrong or a scene cannot be rendered, or if a picture is not that of
/// the table.
pub fn run(args: &Args) -> Result<()> {
    if args.check || args.write {
        let of = machines::IN_A_LINE;
        ensure!(args.random.is_multiple_of(of), "--random must be a multiple of {of}");
        ensure!(args.seed % of == 1, "--seed must be 1 more than a multiple of {of}");
    }
    if args.write {
        ensure!(args.random > 0, "--random says how many random scripts the table has");
        return machines::write(args.random);
    }
    if args.check {
        return machines::check(args.seed..args.seed + args.random, &args.on, args.slice);
    }
    let mut scripts = Vec::new();
    for folder in &args.folders {
        find(folder, &mut scripts)?;
    }
    let lines: Vec<String> = scripts.par_iter().map(|script| of_script(script)).collect::<Result<_>>()?;
    print(&lines)?;
    // In batches, so that progress is visible and lines need not be kept.
    for from in (0..args.random).step_by(200) {
        let seeds = args.seed + from..args.seed + args.random.min(from + 200);
        let lines: Vec<String> = seeds.into_par_iter().map(of_seed).collect::<Result<_>>()?;
        print(&lines)?;
    }
    Ok(())
}

fn print(lines: &[String]) -> Result<()> {
    let mut out = std::io::stdout().lock();
    lines.iter().try_for_each(|line| out.write_all(line.as_bytes()))?;
    Ok(out.flush()?)
}

fn of_script(path: &Path) -> Result<String> {
    let name = path.display().to_string();
    let parsed = parse(&name, &std::fs::read(path)?, &Limits::default());
    let script = parsed.script.with_context(|| format!("{name}: {:?}", parsed.diagnostics))?;
    let mut lines = String::new();
    let mut frame = 0;
    while let Some(scene) = script.frame(frame) {
        // The picture is drawn once at its own size. Kernels are compared on a smaller one, which shows differences as
        // well.
        writeln!(
            lines,
            "{name} {frame}: {:016x}",
            digest(render(&scene, &RenderOptions::default())?.as_raw())
        )?;
        let mut small = scene.clone();
        small.screen = Screen::new(scene.screen.width().min(97), scene.screen.height().min(83))?;
        lines += &of_scene(&format!("{name} {frame}"), &small, RenderOptions::default())?;
        frame += 1;
    }
    ensure!(frame > 0, "{name} shows nothing");
    Ok(lines)
}

fn of_seed(seed: u64) -> Result<String> {
    let mut dice = Dice(fastrand::Rng::with_seed(seed));
    let scene = dice.scene()?;
    let options = dice.options();
    let mut lines = of_scene(&format!("seed {seed}"), &scene, options)?;
    lines += &of_rays(&format!("seed {seed}"), &scene, &dice.rays(), options)?;
    Ok(lines)
}

const PRECISIONS: [Precision; 3] = [Precision::Auto, Precision::F32, Precision::F64];

/// Returns a line for each way to draw a scene.
fn of_scene(name: &str, scene: &Scene, options: RenderOptions) -> Result<String> {
    let mut lines = String::new();
    for (width, level) in levels() {
        for precision in PRECISIONS {
            let image = render(scene, &RenderOptions { precision, level: Some(level), ..options })?;
            writeln!(lines, "{name}, {width} {precision:?}: {:016x}", digest(image.as_raw()))?;
        }
        if let Ok(image) = render_naive(scene, &RenderOptions { level: Some(level), ..options }) {
            writeln!(lines, "{name}, {width} naive: {:016x}", digest(image.as_raw()))?;
        }
    }
    if scene.objects.len() < 100 {
        let image = reference::render(scene, &options)?;
        writeln!(lines, "{name}, reference: {:016x}", digest(image.as_raw()))?;
    }
    Ok(lines)
}

/// Returns a line for each way to trace single rays.
fn of_rays(name: &str, scene: &Scene, rays: &[(DVec3, DVec3)], options: RenderOptions) -> Result<String> {
    let mut lines = String::new();
    for (width, level) in levels() {
        for precision in PRECISIONS {
            let options = RenderOptions { precision, level: Some(level), ..options };
            let found = probe::nearest_hits(scene, rays, &options)?;
            let mut hasher = DefaultHasher::new();
            for found in &found {
                let Some(found) = found else {
                    hasher.write_u8(0);
                    continue;
                };
                hasher.write_usize(found.object);
                hasher.write_u64(found.distance.to_bits());
                found.normal.to_array().iter().for_each(|x| hasher.write_u64(x.to_bits()));
            }
            let hits = found.iter().flatten().count();
            writeln!(lines, "{name}, {width} {precision:?}, {hits} hits: {:016x}", hasher.finish())?;
        }
    }
    Ok(lines)
}

fn digest(bytes: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    hasher.write(bytes);
    hasher.finish()
}

/// A generator of random scenes.
struct Dice(fastrand::Rng);

impl Dice {
    fn one_in(&mut self, n: u32) -> bool {
        self.0.u32(0..n) == 0
    }

    /// Returns a number in -1..1, often one that repeats.
    fn number(&mut self) -> f64 {
        if self.one_in(3) { f64::from(self.0.i32(-4..5)) / 4.0 } else { 2.0 * self.0.f64() - 1.0 }
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.number(), self.number(), self.number())
    }

    /// Returns a vector of non-zero length, often along an axis or perpendicular to one.
    fn direction(&mut self) -> DVec3 {
        let mut direction = self.vector();
        for axis in 0..3 {
            if self.one_in(4) {
                direction[axis] = 0.0;
            }
        }
        if direction == DVec3::ZERO { DVec3::NEG_Y } else { direction }
    }

    fn color(&mut self) -> DVec3 {
        0.5 * self.vector() + 0.5
    }

    fn material(&mut self, mirrors: bool) -> Result<Material> {
        let mirror = if mirrors && self.0.bool() { 0.7 * self.color() } else { DVec3::ZERO };
        Ok(Material::new(0.2 * self.color(), self.color(), mirror)?)
    }

    fn object(&mut self, kinds: &[u8], size: f64, mirrors: bool) -> Result<Object> {
        let material = self.material(mirrors)?;
        let at = 2.0 * self.vector();
        let dull = Material::new(material.ambient(), material.diffuse(), DVec3::ZERO)?;
        Ok(match kinds[self.0.usize(0..kinds.len())] {
            0 => Object::Sphere(Sphere::new(size * (self.number().abs() + 0.01), at, material)?),
            1 => Object::Cuboid(Cuboid::new([at, at + size * self.vector()], dull)?),
            _ => {
                let corners = [at, at + 2.0 * size * self.vector(), at + 2.0 * size * self.vector()];
                Object::Triangle(Triangle::new(corners, dull)?)
            }
        })
    }

    fn camera(&mut self, screen: Screen) -> Result<Camera> {
        if self.one_in(6) {
            return Ok(Camera::Orthographic);
        }
        let away = [0.5, 4.0, 9.0, 40.0][self.0.usize(0..4)];
        let eye = away * self.direction().normalize();
        let gaze = if self.one_in(4) { -eye } else { 0.5 * self.vector() - eye };
        let half = (1.5 / away).clamp(0.05, 0.6);
        let tall = half * f64::from(screen.height()) / f64::from(screen.width());
        let flip = if self.one_in(8) { -1.0 } else { 1.0 };
        let (from, to) = (DVec2::new(-half * flip, -tall), DVec2::new(half * flip, tall));
        loop {
            // Only an up vector parallel to the view direction is an error.
            if let Ok(pinhole) = Pinhole::new(eye, gaze, self.direction(), 1.0, from, to) {
                return Ok(Camera::Pinhole(pinhole));
            }
        }
    }

    fn scene(&mut self) -> Result<Scene> {
        let side = [2, 24, 64, 100][self.0.usize(0..4)];
        let screen = Screen::new(1 + self.0.u32(0..side), 1 + self.0.u32(0..side))?;
        let mut scene = Scene::new(screen, self.camera(screen)?);
        scene.set_background(self.color())?;
        let most = [2, 8, 30, 64, 90, 300, 700][self.0.usize(0..7)];
        let count = 1 + self.0.usize(0..most);
        let kinds: &[u8] =
            [&[0][..], &[1], &[2], &[0, 1], &[0, 2], &[1, 2], &[0, 1, 2], &[0, 1, 2]][self.0.usize(0..8)];
        let size = [1.5, 0.8, 0.4][self.0.usize(0..3)] * if count > 60 { 0.4 } else { 1.0 };
        let mirrors = self.0.bool();
        let objects = (0..count).map(|_| self.object(kinds, size, mirrors));
        let mut objects: Vec<Object> = objects.collect::<Result<_>>()?;
        if self.one_in(5) {
            // Two equal objects at the same position: the first wins.
            let again = objects[self.0.usize(0..count)].clone();
            objects.push(again);
        }
        if matches!(scene.camera, Camera::Orthographic) {
            let scale = 0.2 * f64::from(side);
            let middle = DVec3::new(0.5, 0.5, -1.0) * f64::from(side);
            let place = |o: &Object| o.placed(scale, |p| scale * p + middle);
            objects = objects.iter().map(place).collect::<Result<_, _>>()?;
        }
        scene.objects = objects.into();
        let lights = (0..self.0.usize(0..4))
            .map(|_| Ok(Light::Directional(DirectionalLight::new(0.8 * self.color(), self.direction())?)));
        scene.lights = lights.collect::<Result<Vec<_>>>()?.into();
        if self.one_in(20) && !matches!(scene.camera, Camera::Orthographic) {
            // Far from the origin, in another unit.
            scene = crate::scenes::moved(&scene, 1e3, 1e6 * self.direction())?;
        }
        Ok(scene)
    }

    /// Returns options that must not change the picture, except for the number of bounces.
    fn options(&mut self) -> RenderOptions<'static> {
        let tiles = [None, None, None, Some((4, 4)), Some((8, 8)), Some((64, 4)), Some((8, 32))];
        RenderOptions {
            tile: tiles[self.0.usize(0..tiles.len())],
            tree: [None, None, None, Some(true), Some(false)][self.0.usize(0..5)],
            bounces: [None, None, Some(0), Some(1)][self.0.usize(0..4)],
            ..RenderOptions::default()
        }
    }

    fn rays(&mut self) -> Vec<(DVec3, DVec3)> {
        let mut ray = || {
            let origin = 3.0 * self.vector();
            let towards = if self.0.bool() { self.vector() - origin } else { self.direction() };
            (origin, towards.normalize_or(DVec3::X))
        };
        (0..101).map(|_| ray()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_of_all_sizes_and_kinds_come_up_and_are_the_same_again() {
        let mut kinds = [0; 3];
        let (mut few, mut many, mut parallel, mut lit) = (0, 0, 0, 0);
        for seed in 1..200 {
            let draw = || Dice(fastrand::Rng::with_seed(seed)).scene().unwrap();
            let scene = draw();
            assert_eq!(scene.to_string(), draw().to_string());
            for object in scene.objects.iter() {
                kinds[match object {
                    Object::Sphere(_) => 0,
                    Object::Cuboid(_) => 1,
                    Object::Triangle(_) => 2,
                    _ => unreachable!("not drawn here: {object:?}"),
                }] += 1;
            }
            few += usize::from(scene.objects.len() <= 64);
            many += usize::from(scene.objects.len() > 64);
            parallel += usize::from(matches!(scene.camera, Camera::Orthographic));
            lit += usize::from(!scene.lights.is_empty());
        }
        assert!(kinds.iter().all(|&count| count > 1000), "{kinds:?}");
        assert!(few.min(many) > 20 && parallel > 10 && lit > 100, "{few} {many} {parallel} {lit}");
    }

    #[test]
    fn another_picture_has_another_line() {
        let mut dice = Dice(fastrand::Rng::with_seed(3));
        let mut scene = dice.scene().unwrap();
        let before = of_scene("a", &scene, RenderOptions::default()).unwrap();
        assert_eq!(before, of_scene("a", &scene, RenderOptions::default()).unwrap());
        scene.set_background(DVec3::new(0.1, 0.2, 0.3)).unwrap();
        scene.objects = Vec::new().into();
        let after = of_scene("a", &scene, RenderOptions::default()).unwrap();
        assert!(before.lines().zip(after.lines()).all(|(a, b)| a != b), "{before}{after}");
    }
}
