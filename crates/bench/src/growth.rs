//! `rayfold-bench growth`: processor time by number of objects, in scenes where a tree helps least.
//!
//! The scenes have nested shells, slanted triangles in one place, fans and needles that share a corner, and an eye
//! within all objects. Axis-aligned boxes do not separate such objects. Preparing a scene and drawing it are measured
//! separately.

use std::fmt::Write as _;

use anyhow::Result;
use fastrand::Rng;
use glam::{DVec2, DVec3};
use rayfold_scene::{Cone, Cuboid, Cylinder, Disc, Material, Object, Scene, Screen, Sphere, Torus, Triangle};
use rayfold_tracer::{Drawing, RenderOptions};

use crate::cpu_time;
use crate::report_folder::ReportFolder;
use crate::scenes::{light, looking_at};

/// The options of the subcommand.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    output: ReportFolder,
    /// Measure scenes of at most this many objects
    #[arg(long, default_value_t = 1_000_000)]
    most: usize,
    /// Measure only scenes whose names contain this
    #[arg(long, default_value = "")]
    only: String,
    /// After this many seconds of processor time, do not measure the scene with more objects
    #[arg(long, default_value_t = 60.0)]
    seconds: f64,
    /// Print the table and write nothing
    #[arg(long)]
    check: bool,
}

/// Columns and rows of a picture.
const SIZE: (u32, u32) = (64, 48);

/// The number of objects in the first scene of a family, and the factor from one scene to the next.
const FIRST: usize = 1000;
const STEP: usize = 10;

/// A function that makes a random object of a scene. `part` is its position among all objects, from 0 to 1.
type Make = fn(&mut Rng, part: f64) -> Result<Object>;

/// A family of scenes.
struct Family {
    name: &'static str,
    make: Make,
    is_within: bool,
}

const fn before(name: &'static str, make: Make) -> Family {
    Family { name, make, is_within: false }
}

const fn within(name: &'static str, make: Make) -> Family {
    Family { name, make, is_within: true }
}

const FAMILIES: &[Family] = &[
    before("shells of spheres, thin", |rng, part| {
        Ok(Sphere::new(1.0 + 0.01 * part, DVec3::ZERO, matt(rng)?)?.into())
    }),
    before("shells of spheres to the middle", |rng, part| {
        Ok(Sphere::new(0.01 + part, DVec3::ZERO, matt(rng)?)?.into())
    }),
    before("shells of boxes", |rng, part| {
        let half = DVec3::splat(0.5 + 0.5 * part);
        Ok(Cuboid::new([-half, half], matt(rng)?)?.into())
    }),
    before("triangles aslant through one place", |rng, _| {
        let corners = [direction(rng), direction(rng), direction(rng)];
        Ok(Triangle::new(corners, matt(rng)?)?.into())
    }),
    before("a stack of triangles aslant", |rng, part| {
        let up = 0.5 * part * DVec3::new(1.0, 1.0, 1.0);
        let corners = [[-1.0, 1.0, 0.0], [0.0, -1.0, 1.0], [1.0, 0.0, -1.0]];
        Ok(Triangle::new(corners.map(|v| DVec3::from(v) + up), matt(rng)?)?.into())
    }),
    before("a flat fan", |rng, part| {
        let rim = |part: f64| {
            let turn = DVec2::from_angle(std::f64::consts::TAU * part);
            1.5 * DVec3::new(turn.x, turn.y, 0.3 * turn.x)
        };
        Ok(Triangle::new([DVec3::ZERO, rim(part), rim(part + 1e-4)], matt(rng)?)?.into())
    }),
    before("a fan of long needles about a tip", |rng, _| {
        let tip = DVec3::new(-1.0, -1.0, 0.0);
        let mut base = || DVec3::new(1.0, 1.0, 0.3) + 0.01 * direction(rng);
        let corners = [tip, base(), base()];
        Ok(Triangle::new(corners, matt(rng)?)?.into())
    }),
    before("needles from one corner to everywhere", |rng, _| {
        let far = 1.5 * direction(rng);
        Ok(Triangle::new([DVec3::ZERO, far, far + 0.01 * direction(rng)], matt(rng)?)?.into())
    }),
    before("long needles across", |rng, _| {
        let (from, to) = (1.5 * direction(rng), 1.5 * direction(rng));
        Ok(Triangle::new([from, to, to + 0.001 * direction(rng)], matt(rng)?)?.into())
    }),
    within("an eye within spheres", |rng, _| {
        Ok(Sphere::new(3.0 + rng.f64(), direction(rng), matt(rng)?)?.into())
    }),
    within("an eye within boxes", |rng, _| {
        let half = |rng: &mut Rng| DVec3::new(rng.f64(), rng.f64(), rng.f64()) + 3.0;
        Ok(Cuboid::new([-half(rng), half(rng)], matt(rng)?)?.into())
    }),
    within("an eye within triangles", |rng, _| {
        let corners = [direction(rng), direction(rng), direction(rng)].map(|v| 9.0 * v);
        Ok(Triangle::new(corners, matt(rng)?)?.into())
    }),
    within("an eye within cylinders", |rng, _| {
        let (middle, along) = (direction(rng), (4.0 + rng.f64()) * direction(rng));
        Ok(Cylinder::new(3.0 + rng.f64(), [middle - along, middle + along], matt(rng)?)?.into())
    }),
    within("an eye within cones", |rng, _| {
        let (middle, along) = (direction(rng), (4.0 + rng.f64()) * direction(rng));
        Ok(Cone::new([3.0 + rng.f64(), 5.0], [middle - along, middle + along], matt(rng)?)?.into())
    }),
    within("an eye within tori", |rng, _| {
        Ok(Torus::new(3.0 + rng.f64(), 1.0, 0.5 * direction(rng), direction(rng), matt(rng)?)?.into())
    }),
    within("discs around the eye", |rng, _| {
        let up = direction(rng);
        Ok(Disc::new(6.0, (2.0 + rng.f64()) * up, up, matt(rng)?)?.into())
    }),
];

fn matt(rng: &mut Rng) -> Result<Material> {
    let color = DVec3::new(rng.f64(), rng.f64(), rng.f64());
    Ok(Material::new(0.3 * color, 0.6 * color, DVec3::ZERO)?)
}

/// Returns a point of the unit sphere.
fn direction(rng: &mut Rng) -> DVec3 {
    loop {
        let v = DVec3::new(rng.f64(), rng.f64(), rng.f64()) * 2.0 - 1.0;
        if (0.01..=1.0).contains(&v.length_squared()) {
            return v.normalize();
        }
    }
}

impl Family {
    fn scene(&self, count: usize) -> Result<Scene> {
        let mut rng = Rng::with_seed(35);
        let objects: Result<Vec<_>> =
            (0..count).map(|k| (self.make)(&mut rng, k as f64 / count as f64)).collect();
        let screen = Screen::new(SIZE.0, SIZE.1)?;
        let (eye, target, width) = if self.is_within {
            (DVec3::new(0.1, 0.05, 0.2), DVec3::new(0.4, 0.2, -1.0), 1.0)
        } else {
            (DVec3::new(0.3, 1.5, 5.0), DVec3::ZERO, 0.8)
        };
        let mut scene = Scene::new(screen, looking_at(eye, target, width, screen)?);
        scene.lights = vec![light(0.8, [0.3, -1.0, -0.4])?].into();
        scene.objects = objects?.into();
        Ok(scene)
    }
}

/// The processor time in seconds.
#[derive(Clone, Copy, Debug)]
struct Taken {
    count: usize,
    prepared: f64,
    drawn: f64,
}

/// Measures and writes the report.
///
/// # Errors
/// Fails if a scene cannot be drawn, or the report cannot be written.
pub fn run(args: &Args) -> Result<()> {
    if !args.check {
        args.output.prepare()?;
    }
    let mut report = format!(
        "# Cost of objects that a tree cannot separate\n\n\
         Written by `cargo run --release -p rayfold-bench -- growth --seconds {}`. Pictures have {} x {} pixels and \
         one light. The table shows the processor time in seconds to prepare a scene and to draw it, with 1,000 to \
         1,000,000 objects. A dash means that a scene with fewer objects took more than {} s. *Exponent* is the power \
         of the number of objects with which the sum of both times grows in the last step.\n\n\
         | scene | 1,000 | 10,000 | 100,000 | 1,000,000 | exponent |\n\
         | --- | --- | --- | --- | --- | --: |\n",
        args.seconds, SIZE.0, SIZE.1, args.seconds
    );
    for family in FAMILIES.iter().filter(|family| family.name.contains(&args.only)) {
        let mut taken: Vec<Taken> = Vec::new();
        let mut count = FIRST;
        while count <= args.most && taken.last().is_none_or(|last| last.prepared + last.drawn < args.seconds)
        {
            taken.push(measure(family, count)?);
            count *= STEP;
        }
        let row = row(family.name, &taken)?;
        eprint!("{row}");
        report += &row;
    }
    if !args.check {
        args.output.write("growth.md", &report)?;
    }
    Ok(())
}

fn measure(family: &Family, count: usize) -> Result<Taken> {
    let (scene, options) = (family.scene(count)?, RenderOptions::default());
    let (prepared, drawing) = cpu_time::of(|| Drawing::new(&scene, &options))?;
    let drawing = drawing?;
    let (drawn, image) = cpu_time::of(|| drawing.draw())?;
    image?;
    Ok(Taken { count, prepared, drawn })
}

fn row(name: &str, taken: &[Taken]) -> Result<String> {
    let mut row = format!("| {name} |");
    for step in 0..4 {
        match taken.get(step) {
            Some(Taken { prepared, drawn, .. }) => write!(row, " {prepared:.2} + {drawn:.2} |")?,
            None => row += " - |",
        }
    }
    match exponent(taken) {
        Some(exponent) => writeln!(row, " {exponent:.2} |")?,
        None => row += " |\n",
    }
    Ok(row)
}

/// Returns the exponent of the growth of the time in the last step.
fn exponent(taken: &[Taken]) -> Option<f64> {
    let [.., before, last] = taken else { return None };
    let seconds = |taken: &Taken| taken.prepared + taken.drawn;
    Some((seconds(last) / seconds(before)).ln() / (last.count as f64 / before.count as f64).ln())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_family_can_be_drawn_and_shows_something() {
        let draw = |scene: &Scene| Drawing::new(scene, &RenderOptions::default()).unwrap().draw().unwrap();
        for family in FAMILIES {
            let scene = family.scene(200).unwrap();
            let empty = Scene { objects: Vec::new().into(), ..scene.clone() };
            assert_ne!(draw(&scene), draw(&empty), "{}", family.name);
        }
    }

    #[test]
    fn the_exponent_of_a_square_is_two() {
        let taken = |count, seconds| Taken { count, prepared: 0.25 * seconds, drawn: 0.75 * seconds };
        let exponent = exponent(&[taken(10, 8.0), taken(1000, 1.0), taken(10_000, 100.0)]).unwrap();
        assert!((exponent - 2.0).abs() < 1e-12);
        assert_eq!(row("a", &[taken(1000, 1.0)]).unwrap(), "| a | 0.25 + 0.75 | - | - | - | |\n");
    }
}
