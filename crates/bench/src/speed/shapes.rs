//! `rayfold-bench shapes`: the cost of a ray by shape, and with glass, patterns, highlights and lamps, compared with
//! peers.

use std::fmt::Write as _;
use std::sync::Arc;

use anyhow::{Context, Result};
use fastrand::Rng;
use glam::{DMat3, DVec3};
use image::RgbImage;
use rayfold_scene::model::{Finish, Glass, Pattern, Shine, Weight};
use rayfold_scene::{
    Capsule, Coefficients, Cone, Cuboid, Cylinder, Disc, Instance, Lamp, Material, Object, Placement, Plane,
    Roundbox, Scene, Screen, Sphere, Torus, Triangle,
};
use rayfold_tracer::{MAX_BOUNCES, RenderOptions};

use super::{mitsuba, povray};
use crate::accuracy::rays;
use crate::backends::{Backend, levels, packets};
use crate::cpu_time::{self, median};
use crate::report_folder::ReportFolder;
use crate::scenes::{light, looking_at};

/// The options of the subcommand.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    output: ReportFolder,
    /// Use small pictures, drawn once: a check that everything runs, not a measurement
    #[arg(long)]
    quick: bool,
    /// Draw everything this often, in turn
    #[arg(long, default_value_t = 7, value_parser = clap::value_parser!(u32).range(1..))]
    rounds: u32,
    /// Measure only scenes whose name contains this
    #[arg(long, default_value = "")]
    scene: String,
}

/// The feature that a scene measures. It determines the goals: POV-Ray's time divided by ours, on AVX-512 and on AVX2.
#[derive(Clone, Copy)]
enum Asked {
    Shape,
    Torus,
    Surface,
}

impl Asked {
    fn ratios(self) -> [f64; 2] {
        match self {
            Self::Shape => [30.0, 20.0],
            // Roots of quartics take most of the time in both programs.
            Self::Torus => [10.0, 10.0],
            Self::Surface => [15.0, 15.0],
        }
    }
}

/// The vector widths that are measured.
const WIDTHS: [&str; 2] = ["AVX-512", "AVX2"];

/// The objects of a scene, except planes, form a grid of this many columns and rows.
const GRID: (u32, u32) = (6, 4);

type Subject = (&'static str, Asked, fn(&mut Rng) -> Result<Vec<Object>>);

const SUBJECTS: [Subject; 18] = [
    ("spheres", Asked::Shape, |rng| scattered(rng, plain, sphere)),
    ("boxes", Asked::Shape, |rng| scattered(rng, plain, cuboid)),
    ("boxes askew", Asked::Shape, |rng| scattered(rng, plain, askew)),
    ("triangles", Asked::Shape, |rng| scattered(rng, plain, triangle)),
    ("planes", Asked::Shape, planes),
    ("discs", Asked::Shape, |rng| scattered(rng, plain, disc)),
    ("cylinders", Asked::Shape, |rng| scattered(rng, plain, cylinder)),
    ("cones", Asked::Shape, |rng| scattered(rng, plain, cone)),
    ("tori", Asked::Torus, |rng| scattered(rng, plain, torus)),
    ("capsules", Asked::Shape, |rng| scattered(rng, plain, capsule)),
    ("boxes with round edges", Asked::Shape, |rng| scattered(rng, plain, roundbox)),
    ("spheres of glass", Asked::Surface, |rng| scattered(rng, glass, sphere)),
    ("boxes of glass", Asked::Surface, |rng| scattered(rng, glass, cuboid)),
    ("spheres in cells", Asked::Surface, |rng| scattered(rng, checkered, sphere)),
    ("spheres in stripes", Asked::Surface, |rng| scattered(rng, striped, sphere)),
    ("spheres of noise", Asked::Surface, |rng| scattered(rng, noisy, sphere)),
    ("spheres with highlights", Asked::Surface, |rng| scattered(rng, glossy, sphere)),
    ("spheres in lamplight", Asked::Shape, |rng| scattered(rng, plain, sphere)),
];

/// The measurements of a scene, in milliseconds of processor time except for the counts.
struct Row {
    name: &'static str,
    asked: Asked,
    objects: usize,
    /// The number of camera and shadow rays; `None` if glass spawns more.
    rays: Option<u64>,
    /// One for each of [`WIDTHS`] that the machine supports.
    ours: Vec<f64>,
    /// POV-Ray's time to draw, and the share of pixels that differ by more than 2 levels from ours.
    pov: Option<(f64, f64)>,
    /// Mitsuba's time per ray in nanoseconds.
    mitsuba: Option<f64>,
}

/// Measures and writes the report.
///
/// # Errors
/// Fails if a scene cannot be rendered, a peer that is here fails, or the report cannot be written.
pub fn run(args: &Args) -> Result<()> {
    args.output.prepare()?;
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut rows = Vec::new();
    for subject in SUBJECTS.iter().filter(|(name, ..)| name.contains(&args.scene)) {
        eprintln!("{}", subject.0);
        rows.push(one.install(|| measured(subject, args))?);
    }
    args.output.write("shapes.md", report(args, &rows)?)?;
    write_csv(args, &rows)
}

fn measured((name, asked, make): &Subject, args: &Args) -> Result<Row> {
    let size = if args.quick { (96, 72) } else { (1024, 768) };
    let rounds = if args.quick { 1 } else { args.rounds };
    let scene = scene(name, *make, size)?;
    let widths: Vec<Backend> = levels()
        .into_iter()
        .filter(|(name, _)| WIDTHS.contains(name))
        .map(|(name, level)| packets(name, RenderOptions { level: Some(level), ..Default::default() }))
        .collect();
    let image = widths.first().context("a machine without AVX2")?.render(&scene)?;
    let folder = tempfile::tempdir()?;
    let has_pov = povray::is_here();
    let mut ours = vec![Vec::new(); widths.len()];
    let (mut whole, mut start, mut theirs) = (Vec::new(), Vec::new(), None);
    for _ in 0..rounds {
        for (backend, ours) in widths.iter().zip(&mut ours) {
            let (seconds, image) = cpu_time::of(|| backend.render(&scene))?;
            image?;
            ours.push(1e3 * seconds);
        }
        if has_pov {
            start.push(1e3 * povray::render(&scene, folder.path(), (8, 6))?.0);
            let (seconds, image) = povray::render(&scene, folder.path(), size)?;
            whole.push(1e3 * seconds);
            theirs = Some(image);
        }
    }
    let has_glass = scene.objects.iter().any(|o| o.material().finish().is_some_and(|f| f.glass.is_some()));
    let rays = if has_glass {
        None
    } else {
        rays::count(&scene, &packets("auto", RenderOptions::default()), MAX_BOUNCES)?.last().copied()
    };
    let mitsuba = if matches!(asked, Asked::Shape) && mitsuba::is_here() {
        mitsuba::run(&scene, rounds)?
    } else {
        None
    };
    Ok(Row {
        name,
        asked: *asked,
        objects: scene.objects.len(),
        rays,
        ours: ours.into_iter().map(median).collect(),
        pov: theirs.map(|theirs| (median(whole) - median(start), off(&image, &theirs))),
        mitsuba: mitsuba.map(|peer| 1e9 * peer.seconds / peer.rays),
    })
}

/// Returns the share of pixels off by more than 2 levels, in percent.
fn off(a: &RgbImage, b: &RgbImage) -> f64 {
    let is_off = |(a, b): &(&image::Rgb<u8>, &image::Rgb<u8>)| (0..3).any(|c| a.0[c].abs_diff(b.0[c]) > 2);
    100.0 * a.pixels().zip(b.pixels()).filter(is_off).count() as f64 / a.pixels().len() as f64
}

impl Row {
    fn ratio(&self, width: usize) -> Option<f64> {
        Some(self.pov?.0 / self.ours.get(width)?)
    }

    fn nanoseconds(&self, milliseconds: f64) -> Option<f64> {
        Some(1e6 * milliseconds / self.rays? as f64)
    }
}

fn report(args: &Args, rows: &[Row]) -> Result<String> {
    let command = if args.quick { " --quick".into() } else { format!(" --rounds {}", args.rounds) };
    let mut text = format!(
        "# The cost of a ray by shape\n\n\
         Written by `cargo run --release -p rayfold-bench -- shapes{command}`; all figures are from one run. Pictures \
         have 1024 x 768 pixels, 24 objects of one kind (planes: 3) and a sun, with shadows and 5 bounces, on one \
         core. Times are processor times, because the machine may be busy. Programs that are compared draw in turn, \
         and the table shows medians. Our time is that of `render`, including preparation. POV-Ray's time (one thread, \
         no anti-aliasing) excludes its time for an image of 8 x 6 pixels. A ray is a camera ray or a ray to a light \
         that a surface faces. Rays spawned by glass are not counted. *Off* is the share of pixels of POV-Ray's \
         picture that differ by more than 2 levels from ours. POV-Ray's noise is a different function. Mitsuba 3 (LLVM \
         variant, single precision, one thread) gets the rays and computes hits and shadows, without shading; its \
         cylinders have no caps.\n\n"
    );
    let short: Vec<String> = rows.iter().flat_map(short_of).collect();
    let verdict = match (rows.iter().any(|row| row.pov.is_some()), short.is_empty()) {
        (false, _) => "POV-Ray is not on this machine: not compared.".to_owned(),
        (true, true) => "Every ratio meets its goal.".to_owned(),
        (true, false) => format!("Below the goal: {}.", short.join("; ")),
    };
    write!(
        text,
        "{verdict}\n\n\
         | scene | rays | AVX-512, ms | AVX2, ms | POV-Ray, ms | POV-Ray / AVX-512 | goal | POV-Ray / AVX2 | goal | \
         off, % | AVX-512, ns per ray | AVX2 | POV-Ray | Mitsuba |\n\
         | --- | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: |\n"
    )?;
    for row in rows {
        let number = |x: Option<f64>, digits: usize| x.map_or("–".into(), |x| format!("{x:.digits$}"));
        let [wide, narrow] = row.asked.ratios();
        let pov = row.pov.map(|pov| pov.0);
        let of_width = |k: usize| row.ours.get(k).copied();
        let ns = |milliseconds: Option<f64>| milliseconds.and_then(|ms| row.nanoseconds(ms));
        writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {wide} | {} | {narrow} | {} | {} | {} | {} | {} |",
            row.name,
            row.rays.map_or("–".into(), |rays| rays.to_string()),
            number(of_width(0), 2),
            number(of_width(1), 2),
            number(pov, 1),
            number(row.ratio(0), 1),
            number(row.ratio(1), 1),
            number(row.pov.map(|pov| pov.1), 3),
            number(ns(of_width(0)), 2),
            number(ns(of_width(1)), 2),
            number(ns(pov), 1),
            number(row.mitsuba, 2),
        )?;
    }
    Ok(text)
}

/// Lists the goals that a row misses.
fn short_of(row: &Row) -> Vec<String> {
    let asked = row.asked.ratios();
    let is_short = |&(k, asked): &(usize, f64)| row.ratio(k).is_some_and(|ratio| ratio < asked);
    let pairs = asked.into_iter().enumerate().filter(is_short);
    pairs.filter_map(|(k, _)| Some(format!("{} on {} ({:.1})", row.name, WIDTHS[k], row.ratio(k)?))).collect()
}

fn write_csv(args: &Args, rows: &[Row]) -> Result<()> {
    let path = args.output.path("shapes.csv");
    let mut csv = csv::Writer::from_path(&path).with_context(|| path.display().to_string())?;
    csv.write_record(["scene", "objects", "rays", "backend", "milliseconds", "nanoseconds_a_ray"])?;
    for row in rows {
        let ours = WIDTHS.into_iter().zip(row.ours.iter().copied());
        for (backend, milliseconds) in ours.chain(row.pov.map(|pov| ("POV-Ray", pov.0))) {
            let rays = row.rays.map_or(String::new(), |rays| rays.to_string());
            let ns = row.nanoseconds(milliseconds).map_or(String::new(), |ns| format!("{ns:.3}"));
            let (objects, milliseconds) = (row.objects.to_string(), format!("{milliseconds:.3}"));
            csv.write_record([row.name, &objects, &rays, backend, &milliseconds, &ns])?;
        }
    }
    Ok(csv.flush()?)
}

fn scene(
    name: &str,
    make: fn(&mut Rng) -> Result<Vec<Object>>,
    (width, height): (u32, u32),
) -> Result<Scene> {
    let screen = Screen::new(width, height)?;
    let camera = looking_at(DVec3::new(0.0, 4.5, 9.0), DVec3::ZERO, 1.1, screen)?;
    let mut scene = Scene::new(screen, camera);
    scene.set_background(DVec3::new(0.25, 0.35, 0.55))?;
    scene.objects = make(&mut Rng::with_seed(7))?.into();
    scene.lights = if name.ends_with("lamplight") {
        vec![Lamp::new(DVec3::splat(0.9), DVec3::new(1.0, 5.0, 3.0), 0.0, 0.0)?.into()].into()
    } else {
        vec![light(0.9, [-1.0, -2.0, -1.0])?].into()
    };
    Ok(scene)
}

type Surface = fn(&mut Rng) -> Result<Material>;
/// A function that makes a shape of about the radius 0.6 around a point.
type Shape = fn(&mut Rng, DVec3, Material) -> Result<Object>;

/// Returns a grid of objects, randomly displaced.
fn scattered(rng: &mut Rng, surface: Surface, shape: Shape) -> Result<Vec<Object>> {
    let (columns, rows) = GRID;
    let places = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
    places
        .map(|(column, row)| {
            let spot = DVec3::new(f64::from(column) * 1.5 - 3.75, 0.0, f64::from(row) * 1.6 - 2.8);
            let aside = DVec3::new(rng.f64(), rng.f64(), rng.f64()) - 0.5;
            let material = surface(rng)?;
            shape(rng, spot + 0.4 * aside, material)
        })
        .collect()
}

fn color(rng: &mut Rng) -> DVec3 {
    DVec3::new(rng.f64(), rng.f64(), rng.f64()) * 0.6 + 0.2
}

fn coefficients(rng: &mut Rng) -> Result<Coefficients> {
    let diffuse = color(rng);
    Ok(Coefficients::new(0.15 * diffuse, diffuse, DVec3::ZERO)?)
}

fn plain(rng: &mut Rng) -> Result<Material> {
    Ok(Material::finished(coefficients(rng)?, Finish::default()))
}

fn glass(rng: &mut Rng) -> Result<Material> {
    let glass = Some(Glass::new(0.5 + 0.5 * color(rng), 1.5)?);
    let nothing = Coefficients::new(DVec3::ZERO, DVec3::ZERO, DVec3::ZERO)?;
    Ok(Material::finished(nothing, Finish { glass, ..Finish::default() }))
}

fn glossy(rng: &mut Rng) -> Result<Material> {
    let shine = Some(Shine::new(DVec3::splat(0.5), 60.0)?);
    Ok(Material::finished(coefficients(rng)?, Finish { shine, ..Finish::default() }))
}

fn patterned(rng: &mut Rng, weight: Weight) -> Result<Material> {
    let pattern = Some(Pattern { weight: weight.checked()?, other: coefficients(rng)? });
    Ok(Material::finished(coefficients(rng)?, Finish { pattern, ..Finish::default() }))
}

fn checkered(rng: &mut Rng) -> Result<Material> {
    patterned(rng, Weight::Checker(0.2))
}

fn striped(rng: &mut Rng) -> Result<Material> {
    patterned(rng, Weight::Stripes(0.2))
}

fn noisy(rng: &mut Rng) -> Result<Material> {
    patterned(rng, Weight::Noise(0.2))
}

fn direction(rng: &mut Rng) -> DVec3 {
    (DVec3::new(rng.f64(), rng.f64(), rng.f64()) - 0.5).normalize_or(DVec3::Y)
}

fn sphere(rng: &mut Rng, at: DVec3, material: Material) -> Result<Object> {
    Ok(Sphere::new(0.5 + 0.2 * rng.f64(), at, material)?.into())
}

fn cuboid(rng: &mut Rng, at: DVec3, material: Material) -> Result<Object> {
    let half = DVec3::new(rng.f64(), rng.f64(), rng.f64()) * 0.3 + 0.25;
    Ok(Cuboid::new([at - half, at + half], material)?.into())
}

fn askew(rng: &mut Rng, at: DVec3, material: Material) -> Result<Object> {
    let group = vec![cuboid(rng, DVec3::ZERO, material)?].into();
    let rotation = DMat3::from_axis_angle(direction(rng), 6.0 * rng.f64());
    Ok(Instance::new(&group, 0, &Arc::new(Placement::new(at, rotation, 1.0)?)).into())
}

fn triangle(rng: &mut Rng, at: DVec3, material: Material) -> Result<Object> {
    Ok(Triangle::new([(); 3].map(|()| at + 0.9 * direction(rng)), material)?.into())
}

fn disc(rng: &mut Rng, at: DVec3, material: Material) -> Result<Object> {
    Ok(Disc::new(0.7, at, direction(rng), material)?.into())
}

fn cylinder(rng: &mut Rng, at: DVec3, material: Material) -> Result<Object> {
    let half = 0.6 * direction(rng);
    Ok(Cylinder::new(0.3 + 0.2 * rng.f64(), [at - half, at + half], material)?.into())
}

fn cone(rng: &mut Rng, at: DVec3, material: Material) -> Result<Object> {
    let half = 0.6 * direction(rng);
    let tip = if rng.bool() { 0.0 } else { 0.2 };
    Ok(Cone::new([0.4 + 0.2 * rng.f64(), tip], [at - half, at + half], material)?.into())
}

fn torus(rng: &mut Rng, at: DVec3, material: Material) -> Result<Object> {
    Ok(Torus::new(0.5, 0.1 + 0.1 * rng.f64(), at, direction(rng), material)?.into())
}

fn capsule(rng: &mut Rng, at: DVec3, material: Material) -> Result<Object> {
    let half = 0.55 * direction(rng);
    Ok(Capsule::new(0.4, [at - half, at + half], material)?.into())
}

fn roundbox(rng: &mut Rng, at: DVec3, material: Material) -> Result<Object> {
    let half = 0.4 + 0.35 * DVec3::new(rng.f64(), rng.f64(), rng.f64());
    Ok(Roundbox::new([at - half, at + half], 0.05 + 0.3 * rng.f64(), material)?.into())
}

/// Returns a floor and two walls.
fn planes(rng: &mut Rng) -> Result<Vec<Object>> {
    let walls = [
        (DVec3::NEG_Y, DVec3::Y),
        (DVec3::NEG_Z * 8.0, DVec3::new(0.3, 0.1, 1.0)),
        (DVec3::NEG_X * 5.0, DVec3::new(1.0, 0.1, 0.2)),
    ];
    walls.into_iter().map(|(at, normal)| Ok(Plane::new(at, normal, plain(rng)?)?.into())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_are_what_they_are_called_and_show_it() {
        for (name, _, make) in SUBJECTS {
            let scene = scene(name, make, (64, 48)).unwrap();
            assert_eq!(scene.objects.len(), if name == "planes" { 3 } else { 24 }, "{name}");
            let image = packets("auto", RenderOptions::default()).render(&scene).unwrap();
            let background = [64, 89, 140];
            let shown = image.pixels().filter(|pixel| pixel.0 != background).count();
            assert!(shown > image.pixels().len() / 20, "{name}: {shown}");
        }
    }

    #[test]
    fn a_row_that_is_short_is_told() {
        let row = |pov| Row {
            name: "discs",
            asked: Asked::Shape,
            objects: 24,
            rays: Some(1_000_000),
            ours: vec![10.0, 20.0],
            pov: Some((pov, 0.0)),
            mitsuba: None,
        };
        assert_eq!(short_of(&row(400.0)), [""; 0]);
        assert_eq!(short_of(&row(399.0)), ["discs on AVX2 (19.9)"]);
        assert_eq!(row(300.0).nanoseconds(10.0), Some(10.0));
    }
}
