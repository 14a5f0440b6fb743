//! `rayfold-bench models`: the time to load models of many triangles, and to draw them with normals, colours and glass,
//! as instances, and frame after frame.
//!
//! Models are generated, written as files in memory and read as the program reads them. Pictures have one light and one
//! ray per pixel.

use std::fmt::Write as _;

use anyhow::{Context, Result, ensure};
use glam::DVec3;
use rayfold_scene::assets::{Library, MemoryFiles, Smoothing};
use rayfold_scene::{Limits, Object, Scene, Script, parse_with_files};
use rayfold_tracer::{Drawing, RenderOptions};

use crate::cpu_time;
use crate::report_folder::ReportFolder;

/// The options of the subcommand.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    output: ReportFolder,
    /// Use few triangles and rounds: a check that everything runs, not a measurement
    #[arg(long)]
    quick: bool,
}

/// The number of threads that load a model.
const THREADS: usize = 2;

/// The sizes of all parts.
struct Plan {
    rounds: usize,
    /// The triangles of the model that is loaded.
    loaded: usize,
    /// The triangles of the model that is drawn.
    drawn: usize,
    side: u32,
    /// The number of triangles of the model that is drawn many times, and how many times it is drawn.
    used: usize,
    times: usize,
    /// The triangles of the wine glass.
    glass: usize,
}

const FULL: Plan =
    Plan { rounds: 5, loaded: 870_000, drawn: 1_300_000, side: 1024, used: 1300, times: 1000, glass: 25_000 };

const QUICK: Plan = Plan { rounds: 1, loaded: 2000, drawn: 2000, side: 64, used: 80, times: 20, glass: 500 };

/// The seconds of several rounds.
struct Rounds(Vec<f64>);

impl Rounds {
    /// Runs `work` several times.
    fn of<T>(rounds: usize, mut work: impl FnMut() -> Result<(f64, T)>) -> Result<(Self, T)> {
        let (first, mut last) = work()?;
        let mut seconds = vec![first];
        for _ in 1..rounds {
            let (time, result) = work()?;
            seconds.push(time);
            last = result;
        }
        Ok((Self(seconds), last))
    }

    fn mean(&self) -> f64 {
        self.0.iter().sum::<f64>() / self.0.len() as f64
    }

    fn worst(&self) -> f64 {
        self.0.iter().copied().fold(0.0, f64::max)
    }

    /// Returns the mean and the worst round as cells of a table.
    fn cells(&self) -> String {
        format!("{:.3} | {:.3}", self.mean(), self.worst())
    }
}

/// Measures and writes the report.
///
/// # Errors
/// Fails if a model cannot be read or drawn, or the report cannot be written.
pub fn run(args: &Args) -> Result<()> {
    args.output.prepare()?;
    let plan = if args.quick { &QUICK } else { &FULL };
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut goals = Vec::new();
    let two = rayon::ThreadPoolBuilder::new().num_threads(THREADS).build()?;
    let mut parts = loading(plan, &two, &mut goals)?;
    parts += &one.install(|| drawing(plan, &mut goals))?;
    parts += &one.install(|| instances(plan, &mut goals))?;
    parts += &one.install(|| glass(plan, &mut goals))?;
    parts += &animation(plan, &mut goals)?;
    let command = if args.quick { " --quick" } else { "" };
    let mut report = format!(
        "# Models\n\n\
         Written by `cargo run --release -p rayfold-bench -- models{command}`. The models are generated. All times are \
         processor times, because the machine may be busy with other work. The time to load is that of the busier of \
         {THREADS} threads, which is the elapsed time on idle cores. The time of the next frame is that of all \
         threads. All other times are those of one thread. Each part runs {} times. The tables show the mean and the \
         worst of these runs.\n\n\
         | what | measured | goal | |\n| --- | ---: | ---: | --- |\n",
        plan.rounds
    );
    for Goal { what, is, most, unit } in &goals {
        let verdict = if is <= most { "met" } else { "**missed**" };
        writeln!(report, "| {what} | {is:.2}{unit} | at most {most}{unit} | {verdict} |")?;
    }
    report += "\n";
    report += &parts;
    eprint!("{report}");
    args.output.write("models.md", &report)
}

/// A goal of the project, and what was measured.
struct Goal {
    what: &'static str,
    is: f64,
    most: f64,
    unit: &'static str,
}

/// The data that the vertices of a file have beside their positions.
#[derive(Clone, Copy, Default)]
struct Extras {
    normals: bool,
    colors: bool,
    uvs: bool,
}

/// A surface of squares of two triangles each, closed around the y axis.
struct Surface {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// Makes a surface of about `count` triangles. `point` returns the place for an angle around y and a height, as a
    /// share of the way from bottom to top.
    fn new(count: usize, point: impl Fn(f64, f64) -> DVec3) -> Self {
        let rows = ((count / 4) as f64).sqrt().max(3.0) as u32;
        let columns = 2 * rows;
        let place = |row: u32, column: u32| {
            let around = f64::from(column) / f64::from(columns) * std::f64::consts::TAU;
            // The poles are points, and all formats hold the same numbers.
            (1e6 * point(around, f64::from(row) / f64::from(rows))).round() / 1e6
        };
        let positions = (0..=rows)
            .flat_map(|row| (0..columns).map(move |column| (row, column)))
            .map(|(r, c)| place(r, c));
        let index = |row: u32, column: u32| row * columns + column % columns;
        let squares = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
        let triangles = squares.flat_map(|(row, column)| {
            let [a, b] = [index(row, column), index(row, column + 1)];
            let [c, d] = [index(row + 1, column + 1), index(row + 1, column)];
            [[a, b, c], [a, c, d]]
        });
        Self { positions: positions.collect(), triangles: triangles.collect() }
    }

    /// Makes a ball with waves.
    fn ball(count: usize) -> Self {
        Self::new(count, |around, share| {
            let height = std::f64::consts::PI * (share - 0.5);
            let radius = 1.0 + 0.05 * (9.0 * around).sin() * (7.0 * height).cos();
            radius * DVec3::new(height.cos() * around.cos(), height.sin(), -height.cos() * around.sin())
        })
    }

    /// Makes a wine glass: foot, stem and bowl, with a wall of even thickness.
    fn wine_glass(count: usize) -> Self {
        // Radius and height, from the foot's middle outside up to the rim and inside down to the bowl's bottom.
        const PROFILE: [[f64; 2]; 14] = [
            [0.0, 0.0],
            [0.7, 0.0],
            [0.72, 0.04],
            [0.15, 0.12],
            [0.07, 0.3],
            [0.07, 1.0],
            [0.25, 1.15],
            [0.62, 1.5],
            [0.65, 1.9],
            [0.52, 2.5],
            [0.49, 2.5],
            [0.61, 1.9],
            [0.57, 1.52],
            [0.0, 1.2],
        ];
        Self::new(count, |around, share| {
            let at = share * (PROFILE.len() - 1) as f64;
            let piece = (at.floor() as usize).min(PROFILE.len() - 2);
            let part = at - piece as f64;
            let [radius, height] =
                [0, 1].map(|k| PROFILE[piece][k] * (1.0 - part) + PROFILE[piece + 1][k] * part);
            DVec3::new(radius * around.cos(), height, -radius * around.sin())
        })
    }

    fn obj(&self, Extras { normals, colors, uvs }: Extras) -> Result<Vec<u8>> {
        let mut text = String::new();
        for p in &self.positions {
            write!(text, "v {:.6} {:.6} {:.6}", p.x, p.y, p.z)?;
            if colors {
                let color = (0.5 + 0.4 * *p).clamp(DVec3::ZERO, DVec3::ONE);
                write!(text, " {:.3} {:.3} {:.3}", color.x, color.y, color.z)?;
            }
            text += "\n";
        }
        if normals {
            for p in &self.positions {
                let n = p.normalize_or_zero();
                writeln!(text, "vn {:.5} {:.5} {:.5}", n.x, n.y, n.z)?;
            }
        }
        if uvs {
            // Four times around, and once up.
            for p in &self.positions {
                let around = f64::atan2(-p.z, p.x) / std::f64::consts::TAU;
                writeln!(text, "vt {:.5} {:.5}", 4.0 * around, 0.5 + 0.45 * p.y)?;
            }
        }
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|i| i + 1);
            match (normals, uvs) {
                (true, true) => writeln!(text, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}")?,
                (true, false) => writeln!(text, "f {a}//{a} {b}//{b} {c}//{c}")?,
                (false, true) => writeln!(text, "f {a}/{a} {b}/{b} {c}/{c}")?,
                (false, false) => writeln!(text, "f {a} {b} {c}")?,
            }
        }
        Ok(text.into_bytes())
    }

    fn ply(&self) -> Vec<u8> {
        let (vertices, faces) = (self.positions.len(), self.triangles.len());
        let mut bytes = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
             property float z\nelement face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
        )
        .into_bytes();
        bytes.extend(self.floats());
        for triangle in &self.triangles {
            bytes.push(3);
            bytes.extend(triangle.iter().flat_map(|i| i.to_le_bytes()));
        }
        bytes
    }

    fn stl(&self) -> Vec<u8> {
        let mut bytes = vec![0; 80];
        bytes.extend((self.triangles.len() as u32).to_le_bytes());
        for triangle in &self.triangles {
            bytes.extend([0; 12]);
            let corners = triangle.iter().map(|i| self.positions[*i as usize].as_vec3().to_array());
            bytes.extend(corners.flatten().flat_map(f32::to_le_bytes));
            bytes.extend([0; 2]);
        }
        bytes
    }

    fn glb(&self) -> Vec<u8> {
        let mut binary: Vec<u8> = self.floats().collect();
        let (vertices, indices) = (self.positions.len(), 3 * self.triangles.len());
        let at = binary.len();
        binary.extend(self.triangles.iter().flatten().flat_map(|i| i.to_le_bytes()));
        let json = serde_json::json!({
            "asset": {"version": "2.0"},
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
            "buffers": [{"byteLength": binary.len()}],
            "bufferViews": [{"buffer": 0, "byteLength": at},
                            {"buffer": 0, "byteOffset": at, "byteLength": binary.len() - at}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": vertices, "type": "VEC3"},
                          {"bufferView": 1, "componentType": 5125, "count": indices, "type": "SCALAR"}]
        });
        let mut json = json.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut bytes = b"glTF\x02\0\0\0".to_vec();
        bytes.extend((28 + (json.len() + binary.len()) as u32).to_le_bytes());
        for (kind, chunk) in [(b"JSON", json), (b"BIN\0", binary)] {
            bytes.extend((chunk.len() as u32).to_le_bytes());
            bytes.extend(kind);
            bytes.extend(chunk);
        }
        bytes
    }

    fn floats(&self) -> impl Iterator<Item = u8> {
        self.positions.iter().flat_map(|p| p.as_vec3().to_array()).flat_map(f32::to_le_bytes)
    }
}

/// Parses lines after a camera and a light.
fn script(side: u32, library: &Library, lines: &str) -> Result<Script> {
    let text = format!(
        "Screen {side} {side}\nLook .6 1.2 4  0 0 0  32\nBackground .8 .9 1\nIlight .9 .9 .85  -1 -2 -1.5\n{lines}\nTrace\n"
    );
    let limits = Limits { max_pixels: u64::from(side) * u64::from(side), ..Limits::default() };
    let parsed = parse_with_files("models", text.as_bytes(), &limits, library);
    parsed.script.with_context(|| format!("{lines}: {:?}", parsed.diagnostics))
}

fn scene(side: u32, library: &Library, lines: &str) -> Result<Scene> {
    script(side, library, lines)?.frame(0).context("a script without a frame")
}

/// Reads a model and builds its tree, by format.
fn loading(plan: &Plan, pool: &rayon::ThreadPool, goals: &mut Vec<Goal>) -> Result<String> {
    let surface = Surface::ball(plan.loaded);
    let files = [
        ("a.obj", surface.obj(Extras { normals: true, ..Extras::default() })?),
        ("a.ply", surface.ply()),
        ("a.stl", surface.stl()),
        ("a.glb", surface.glb()),
    ];
    let mut part = format!(
        "## Loading {} triangles\n\n*Read*: from bytes in memory to checked triangles. *Prepare*: triangles to the tree. In \
         seconds.\n\n| format | MB | read, mean | worst | prepare, mean | worst |\n| --- | ---: | ---: | ---: | ---: | ---: |\n",
        surface.triangles.len()
    );
    let mut slowest: f64 = 0.0;
    for (name, bytes) in files {
        let size = bytes.len() as f64 / 1e6;
        let (mut read, mut prepared) = (Rounds(Vec::new()), Rounds(Vec::new()));
        for _ in 0..plan.rounds {
            // The tree of a model is made once.
            let library = Library::new(MemoryFiles::from([(name, bytes.clone())]));
            let (time, model) = cpu_time::of_busiest(pool, || library.model(name, Smoothing::OfFile))?;
            model?;
            read.0.push(time);
            let scene = scene(16, &library, &format!("Mesh \"{name}\""))?;
            let prepare = || Drawing::new(&scene, &RenderOptions::default()).map(drop);
            let (time, drawing) = cpu_time::of_busiest(pool, prepare)?;
            drawing?;
            prepared.0.push(time);
        }
        slowest = slowest.max(read.mean() + prepared.mean());
        writeln!(part, "| {} | {size:.1} | {} | {} |", &name[2..], read.cells(), prepared.cells())?;
    }
    goals.push(Goal {
        what: "load the model, the slowest format, on two cores",
        is: slowest,
        most: 0.5,
        unit: " s",
    });
    Ok(part + "\n")
}

/// Returns a picture of 1024 x 512 pixels, as a PNG file.
fn picture() -> Result<Vec<u8>> {
    let level = |x: u32, y: u32, of: u32| (128.0 + 100.0 * f64::sin(f64::from(x * of + y * y) / 40.0)) as u8;
    let picture = image::RgbImage::from_fn(1024, 512, |x, y| image::Rgb([1, 2, 3].map(|of| level(x, y, of))));
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png)?;
    Ok(bytes.into_inner())
}

/// Draws a model of many triangles: flat, with normals, with colours, and with a picture.
fn drawing(plan: &Plan, goals: &mut Vec<Goal>) -> Result<String> {
    let surface = Surface::ball(plan.drawn);
    let smooth = Extras { normals: true, ..Extras::default() };
    let library = Library::new(MemoryFiles::from([
        ("plain.obj", surface.obj(Extras::default())?),
        ("smooth.obj", surface.obj(smooth)?),
        ("colored.obj", surface.obj(Extras { colors: true, ..smooth })?),
        ("textured.obj", surface.obj(Extras { uvs: true, ..smooth })?),
        ("a.png", picture()?),
    ]));
    let scenes = [
        ("flat", "Mesh \"plain.obj\" .1 .1 .1 .7 .7 .6"),
        ("with normals", "Mesh \"smooth.obj\" .1 .1 .1 .7 .7 .6"),
        ("with normals and colours at its vertices", "Mesh \"colored.obj\""),
        (
            "with normals and a picture",
            "Material m ambient .1 .1 .1 diffuse .7 .7 .6 image \"a.png\" uv\nMesh \"textured.obj\" m",
        ),
    ];
    let mut part = format!(
        "## Drawing {} triangles\n\n{} x {} pixels with a shadow ray each, without the time to prepare.\n\n\
         | model | seconds, mean | worst | of flat |\n| --- | ---: | ---: | ---: |\n",
        surface.triangles.len(),
        plan.side,
        plan.side
    );
    let options = RenderOptions::default();
    let scenes = scenes
        .into_iter()
        .map(|(what, line)| Ok((what, scene(plan.side, &library, line)?)))
        .collect::<Result<Vec<_>>>()?;
    let drawings = scenes.iter().map(|(what, scene)| Ok((*what, Drawing::new(scene, &options)?)));
    let drawings = drawings.collect::<Result<Vec<_>>>()?;
    let mut seconds = vec![Vec::new(); drawings.len()];
    for _ in 0..plan.rounds {
        for ((_, drawing), seconds) in drawings.iter().zip(&mut seconds) {
            let (time, image) = cpu_time::of(|| drawing.draw())?;
            image?;
            seconds.push(time);
        }
    }
    let flat = Rounds(seconds[0].clone()).mean();
    for ((what, _), seconds) in drawings.iter().zip(seconds) {
        let rounds = Rounds(seconds);
        let share = rounds.mean() / flat;
        writeln!(part, "| {what} | {} | {share:.2} |", rounds.cells())?;
        let goal = match *what {
            "with normals" => "normals, of the flat model's time",
            "with normals and a picture" => "normals and a picture, of the flat model's time",
            _ => continue,
        };
        goals.push(Goal { what: goal, is: share, most: 1.1, unit: "" });
    }
    Ok(part + "\n")
}

/// Draws a model that is used many times, and the same triangles written out.
fn instances(plan: &Plan, goals: &mut Vec<Goal>) -> Result<String> {
    let surface = Surface::ball(plan.used);
    let library = Library::new(MemoryFiles::from([("a.obj", surface.obj(Extras::default())?)]));
    let across = (plan.times as f64).cbrt().ceil() as usize;
    let mut lines = String::from("Group g\nMesh \"a.obj\" .1 .1 .1 .7 .7 .6\nEnd\n");
    for k in 0..plan.times {
        let [x, y, z] = [k % across, k / across % across, k / across / across];
        let place = |x: usize| 2.0 * (x as f64 + 0.5) / across as f64 - 1.0;
        let turn = 37 * k % 360;
        writeln!(
            lines,
            "Use g  {} {} {}  {turn} {turn} 0  {}",
            place(x),
            place(y),
            place(z),
            0.7 / across as f64
        )?;
    }
    let used = scene(plan.side, &library, &lines)?;
    let mut written_out = used.clone();
    let mut triangles = Vec::new();
    for object in used.objects.iter() {
        let Object::Instance(instance) = object else { continue };
        let Object::Mesh(mesh) = instance.object() else { continue };
        for k in 0..mesh.model().triangle_count() {
            let corners = mesh.model().corners(k).map(|p| instance.placement().point(p));
            triangles.push(rayfold_scene::Triangle::new(corners, mesh.material().clone())?.into());
        }
    }
    ensure!(!triangles.is_empty(), "no instance was drawn");
    written_out.objects = triangles.into();
    let mut part = format!(
        "## {} uses of a model of {} triangles\n\n{} x {} pixels. In seconds.\n\n\
         | scene | prepare, mean | worst | draw, mean | worst |\n| --- | ---: | ---: | ---: | ---: |\n",
        plan.times,
        surface.triangles.len(),
        plan.side,
        plan.side
    );
    let mut drawn = Vec::new();
    for (what, scene) in [("instances", &used), ("written out", &written_out)] {
        let options = RenderOptions::default();
        let (prepared, drawing) = Rounds::of(plan.rounds, || {
            let (time, drawing) = cpu_time::of(|| Drawing::new(scene, &options))?;
            Ok((time, drawing?))
        })?;
        let (seconds, ()) = Rounds::of(plan.rounds, || {
            let (time, image) = cpu_time::of(|| drawing.draw())?;
            image?;
            Ok((time, ()))
        })?;
        writeln!(part, "| {what} | {} | {} |", prepared.cells(), seconds.cells())?;
        drawn.push(seconds.mean());
    }
    goals.push(Goal {
        what: "instances, of the time written out",
        is: drawn[0] / drawn[1],
        most: 1.5,
        unit: "",
    });
    Ok(
        part + "\nThe instances share the triangles of their model and its tree. The first round of *prepare* makes that tree.\n\n"
    )
}

/// Draws a wine glass that refracts.
fn glass(plan: &Plan, goals: &mut Vec<Goal>) -> Result<String> {
    let surface = Surface::wine_glass(plan.glass);
    let library = Library::new(MemoryFiles::from([("glass.obj", surface.obj(Extras::default())?)]));
    let lines = "Clear\nScreen 640 480\nLook 0 2.2 7  0 1.2 0  26\nBackground .9 .93 1 .4 .6 .9\nIlight .9 .9 .85  -1 -2 -1.5\n\
                 Material tile ambient .1 .1 .1 diffuse .2 .25 .3\nMaterial floor ambient .1 .1 .1 diffuse .7 .7 .65 checker .5 tile\n\
                 Material clear glass .97 .98 .98 1.5 shine .6 .6 .6 200\nPlane 0 0 0 0 1 0 floor\nMesh \"glass.obj\" clear smooth 40";
    let scene = scene(640, &library, lines)?;
    let options = RenderOptions::default();
    let (seconds, ()) = Rounds::of(plan.rounds, || {
        let (time, image) = cpu_time::of(|| Drawing::new(&scene, &options)?.draw())?;
        image?;
        Ok((time, ()))
    })?;
    goals.push(Goal { what: "the wine glass, one frame", is: seconds.mean(), most: 0.5, unit: " s" });
    Ok(format!(
        "## A wine glass of {} triangles\n\n640 x 480 pixels, with its tree.\n\n| seconds, mean | worst |\n| ---: | ---: |\n| {} |\n\n",
        surface.triangles.len(),
        seconds.cells()
    ))
}

/// Parses and prepares the second frame of an animation in which the model does not change.
fn animation(plan: &Plan, goals: &mut Vec<Goal>) -> Result<String> {
    let library = Library::new(MemoryFiles::from([("a.glb", Surface::ball(plan.loaded).glb())]));
    let line = "Mesh \"a.glb\"";
    scene(16, &library, line)?;
    let (again, scene) = Rounds::of(plan.rounds, || {
        let (time, scene) = cpu_time::of(|| scene(16, &library, line))?;
        Ok((time, scene?))
    })?;
    Drawing::new(&scene, &RenderOptions::default())?;
    let (prepared, ()) = Rounds::of(plan.rounds, || {
        let (time, drawing) = cpu_time::of(|| Drawing::new(&scene, &RenderOptions::default()).map(drop))?;
        drawing?;
        Ok((time, ()))
    })?;
    goals.push(Goal { what: "read an unchanged model again", is: again.mean(), most: 0.01, unit: " s" });
    goals.push(Goal {
        what: "prepare an unchanged model again",
        is: prepared.mean(),
        most: 0.01,
        unit: " s",
    });
    Ok(format!(
        "## The next frame of an animation\n\nThe model of {} triangles does not change. It is read and decoded once in a process. \
         Its tree is built with the first frame.\n\n| step | seconds, mean | worst |\n| --- | ---: | ---: |\n| read | {} |\n| prepare | {} |\n",
        Surface::ball(plan.loaded).triangles.len(),
        again.cells(),
        prepared.cells()
    ))
}

#[cfg(test)]
mod tests {
    use rayfold_scene::assets::Closure;

    use super::*;

    #[test]
    fn every_part_runs_and_all_formats_hold_the_same_model() {
        let folder = tempfile::tempdir().unwrap();
        run(&Args { output: folder.path().into(), quick: true }).unwrap();
        let report = std::fs::read_to_string(folder.path().join("models.md")).unwrap();
        assert!(!report.contains("NaN") && report.contains("| glb |"), "{report}");
        let surface = Surface::ball(500);
        let library = Library::new(MemoryFiles::from([
            ("a.obj", surface.obj(Extras { normals: true, colors: true, uvs: true }).unwrap()),
            ("a.ply", surface.ply()),
            ("a.stl", surface.stl()),
            ("a.glb", surface.glb()),
        ]));
        let model = |name: &str| library.model(name, Smoothing::OfFile).unwrap();
        for name in ["a.ply", "a.stl", "a.glb"] {
            assert_eq!(model(name).triangle_count(), model("a.obj").triangle_count(), "{name}");
        }
        assert_eq!(*model("a.glb").closure(), Closure::Closed);
    }

    #[test]
    fn the_wine_glass_is_closed() {
        let obj = Surface::wine_glass(2000).obj(Extras::default()).unwrap();
        let library = Library::new(MemoryFiles::from([("a.obj", obj)]));
        assert_eq!(*library.model("a.obj", Smoothing::OfFile).unwrap().closure(), Closure::Closed);
    }
}
