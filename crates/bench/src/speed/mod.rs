//! `rayfold-bench speed`: processor time by the amount of work, and compared with peers.

mod embree;
pub(crate) mod mitsuba;
pub(crate) mod povray;
pub mod shapes;

use std::fmt::Write as _;

use anyhow::Result;
use image::RgbImage;
use rayfold_scene::Scene;
use rayfold_tracer::{Drawing, RenderOptions};

use crate::backends::{Backend, levels, packets, reference};
use crate::cpu_time::{self, median};
use crate::plot::{Labels, Series, log_log};
use crate::report_folder::ReportFolder;
use crate::scenes::{EXAMPLES, cloud, example, rock, table};

/// The options of the subcommand.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    output: ReportFolder,
    /// Use small sizes and few rounds: a check that everything runs, not a measurement
    #[arg(long)]
    quick: bool,
}

/// The sizes of all parts.
struct Plan {
    rounds: usize,
    objects: &'static [u32],
    triangles: &'static [usize],
    screens: &'static [(u32, u32)],
    peer_triangles: usize,
    peer_side: u32,
}

const FULL: Plan = Plan {
    rounds: 7,
    objects: &[4, 16, 64, 256, 1024, 4096, 10_000],
    triangles: &[1280, 20_480, 327_680, 1_310_720],
    screens: &[(256, 256), (512, 512), (1024, 1024), (2048, 2048), (3840, 2160)],
    peer_triangles: 1_310_720,
    peer_side: 1024,
};

const QUICK: Plan = Plan {
    rounds: 1,
    objects: &[4, 64, 1024],
    triangles: &[1280, 20_480],
    screens: &[(64, 64), (256, 256)],
    peer_triangles: 20_480,
    peer_side: 256,
};

/// Measures and writes the report.
///
/// # Errors
/// Fails if a scene cannot be rendered, a peer that is here fails, or the report cannot be written.
pub fn run(args: &Args) -> Result<()> {
    let plan = if args.quick { &QUICK } else { &FULL };
    args.output.prepare()?;
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let command = if args.quick { " --quick" } else { "" };
    let widths: Vec<_> = levels().iter().map(|(name, _)| *name).collect();
    let mut report = format!(
        "# Speed\n\n\
         Written by `cargo run --release -p rayfold-bench -- speed{command}`; all figures are from one run on a \
         machine with {}. Times are processor times, because the machine may be busy with other work. Programs that \
         are compared run in turn, {} times; the table shows medians. *One core* is a pool of one thread.\n\n",
        widths.join(", "),
        plan.rounds
    );
    let mut ratios = Vec::new();
    let mut rest = one.install(|| beside_povray(plan, &mut ratios))?;
    rest += &one.install(|| beside_embree(plan, &mut ratios))?;
    rest += &examples(plan, &one, &mut ratios)?;
    rest += &one.install(|| growth(plan, &args.output))?;
    report += "| their time / ours | measured | goal |\n| --- | --- | --- |\n";
    for Ratio { what, is, least } in &ratios {
        writeln!(report, "| {what} | {is:.2} | {least} |")?;
    }
    report += "\n";
    report += &rest;
    args.output.write("speed.md", report)
}

/// The peer's time divided by ours.
struct Ratio {
    what: String,
    is: f64,
    /// The goals of the project.
    least: &'static str,
}

/// The time of the original tracer for a frame of its `hello`, 512 x 512, in seconds. It was optimised for the machine
/// on which it was measured, the one of these reports. This run does not measure it.
const ORIGINAL_HELLO: f64 = 0.057;

fn best() -> Backend {
    packets("rayfold", RenderOptions::default())
}

/// Draws with several backends in turn. Returns the median processor time of each.
fn in_turn(scene: &Scene, backends: &[&Backend], rounds: usize) -> Result<Vec<f64>> {
    let mut seconds = vec![Vec::new(); backends.len()];
    for _ in 0..rounds {
        for (backend, seconds) in backends.iter().zip(&mut seconds) {
            let (time, image) = cpu_time::of(|| backend.render(scene))?;
            image?;
            seconds.push(time);
        }
    }
    Ok(seconds.into_iter().map(median).collect())
}

/// The goals for POV-Ray's time divided by ours.
const ASKED: [(&str, &str); 2] = [("AVX-512", "16, goal 30"), ("AVX2", "11, goal 20")];

fn beside_povray(plan: &Plan, ratios: &mut Vec<Ratio>) -> Result<String> {
    let mut text = String::from("## Comparison with POV-Ray\n\n");
    if !povray::is_here() {
        text += "`povray` is not on this machine: not measured.\n\n";
        return Ok(text);
    }
    eprintln!("POV-Ray");
    let folder = tempfile::tempdir()?;
    let scene = table(1024, 768)?;
    let mut backends: Vec<Backend> = levels()
        .into_iter()
        .map(|(name, level)| packets(name, RenderOptions { level: Some(level), ..Default::default() }))
        .collect();
    backends.push(reference());
    let mut ours = vec![Vec::new(); backends.len()];
    let (mut whole, mut start) = (Vec::new(), Vec::new());
    let mut theirs = RgbImage::new(0, 0);
    for _ in 0..plan.rounds {
        for (backend, ours) in backends.iter().zip(&mut ours) {
            let (time, image) = cpu_time::of(|| backend.render(&scene))?;
            image?;
            ours.push(time);
        }
        start.push(povray::render(&scene, folder.path(), (8, 6))?.0);
        let (time, image) = povray::render(&scene, folder.path(), (1024, 768))?;
        whole.push(time);
        theirs = image;
    }
    let (whole, start) = (median(whole), median(start));
    let drawing = whole - start;
    let image = backends[0].render(&scene)?;
    let off =
        image.pixels().zip(theirs.pixels()).filter(|(a, b)| (0..3).any(|c| a.0[c].abs_diff(b.0[c]) > 2));
    let off = 100.0 * off.count() as f64 / image.pixels().len() as f64;
    write!(
        text,
        "1024 x 768, 22 spheres, 2 boxes, 2 triangles, 2 lights, shadows, 5 bounces, one core, precision chosen by the \
         program. POV-Ray draws the same picture ({off:.3} % of the pixels off by more than 2 levels), without \
         anti-aliasing and radiosity. Its time includes its start and reading the scene; *drawing* is its time minus \
         that of an image of 8 x 6 pixels. Ours is that of `render`.\n\n\
         | renderer | CPU ms | POV-Ray's / ours | POV-Ray's drawing / ours |\n\
         | --- | --- | --- | --- |\n\
         | POV-Ray | {:.1}, drawing {:.1} | 1 | 1 |\n",
        1e3 * whole,
        1e3 * drawing
    )?;
    for (backend, ours) in backends.iter().zip(ours) {
        let ours = median(ours);
        let name = &backend.name;
        if let Some((_, least)) = ASKED.iter().find(|(level, _)| level == name) {
            ratios.push(Ratio { what: format!("POV-Ray, {name}"), is: whole / ours, least });
        }
        writeln!(
            text,
            "| rayfold, {name} | {:.2} | {:.2} | {:.2} |",
            1e3 * ours,
            whole / ours,
            drawing / ours
        )?;
    }
    text.push('\n');
    Ok(text)
}

fn beside_embree(plan: &Plan, ratios: &mut Vec<Ratio>) -> Result<String> {
    let mut text = String::from("## Comparison with Embree\n\n");
    let folder = tempfile::tempdir()?;
    let program = match embree::compile(folder.path())? {
        Ok(program) => program,
        Err(reason) => {
            writeln!(text, "The peer program could not be compiled, so this was not measured: {reason}\n")?;
            return Ok(text);
        }
    };
    eprintln!("Embree");
    let lit = rock(plan.peer_triangles, plan.peer_side, plan.peer_side)?;
    let mut unlit = lit.clone();
    unlit.lights = Vec::new().into();
    let levels: Vec<_> = levels().into_iter().filter(|(name, _)| !name.starts_with("SSE")).collect();
    let (mut camera, mut shadows) = (vec![Vec::new(); levels.len()], vec![Vec::new(); levels.len()]);
    let mut theirs: [Vec<f64>; 4] = Default::default();
    let (mut hits, mut dark) = (0, 0);
    for _ in 0..plan.rounds {
        for (k, &(_, level)) in levels.iter().enumerate() {
            let options = RenderOptions { level: Some(level), ..Default::default() };
            camera[k].push(halves(&unlit, &options)?.1);
            shadows[k].push(halves(&lit, &options)?.1);
        }
        let seconds = embree::run(&program, folder.path(), &lit, 3)?;
        let times = seconds.camera.into_iter().chain(seconds.lit);
        theirs.iter_mut().zip(times).for_each(|(all, time)| all.push(time));
        (hits, dark) = (seconds.hits, seconds.dark);
    }
    let theirs = theirs.map(median);
    let rays = f64::from(plan.peer_side).powi(2);
    write!(
        text,
        "{} triangles; {rays} camera rays, of which {hits} hit; then the same rays with a shadow ray from each hit, of \
         which {dark} are blocked. One core, robust intersection. Embree's time is that of its calls, the fastest of \
         three passes, without shading. Ours is that of drawing a prepared scene, with shading and writing pixels. \
         Both exclude the construction of the tree.\n\n\
         | rays | way | CPU ms | Mrays/s | Embree's single rays / this | Embree's packets / this |\n\
         | --- | --- | --- | --- | --- | --- |\n",
        lit.objects.len()
    )?;
    let kinds = [
        ("camera", rays, &camera, [theirs[0], theirs[1]]),
        ("camera and shadow", rays + hits as f64, &shadows, [theirs[2], theirs[3]]),
    ];
    for (kind, rays, ours, [single, several]) in kinds {
        let mut row = |name: &str, seconds: f64| {
            let (a, b) = (single / seconds, several / seconds);
            let speed = rays / seconds / 1e6;
            writeln!(text, "| {kind} | {name} | {:.1} | {speed:.2} | {a:.2} | {b:.2} |", 1e3 * seconds)
        };
        row("Embree 3, one ray at a time", single)?;
        row("Embree 3, packets of 8", several)?;
        for ((level, _), seconds) in levels.iter().zip(ours) {
            let seconds = median(seconds.clone());
            row(&format!("rayfold, {level}"), seconds)?;
            let named = |way: &str| format!("Embree, {way}, {kind} rays, {level}");
            ratios.push(Ratio { what: named("one by one"), is: single / seconds, least: "0.8" });
            ratios.push(Ratio { what: named("packets"), is: several / seconds, least: "0.5" });
        }
    }
    text.push('\n');
    Ok(text)
}

/// Returns the time to prepare a scene, and then to draw it.
fn halves(scene: &Scene, options: &RenderOptions) -> Result<(f64, f64)> {
    let (preparing, drawing) = cpu_time::of(|| Drawing::new(scene, options))?;
    let drawing = drawing?;
    let (drawn, image) = cpu_time::of(|| drawing.draw())?;
    image?;
    Ok((preparing, drawn))
}

fn examples(plan: &Plan, one: &rayon::ThreadPool, ratios: &mut Vec<Ratio>) -> Result<String> {
    let all = rayon::ThreadPoolBuilder::new().build()?;
    let mut text = format!(
        "## The five scenes\n\n\
         One frame of each, on one core and on all {} cores. Both should take the same processor time, because no work \
         is done twice.\n\n\
         | scene | CPU ms, one core | Mpixels/s | CPU ms, all cores | the plain tracer, CPU ms | plain / ours |\n\
         | --- | --- | --- | --- | --- | --- |\n",
        all.current_num_threads()
    );
    let (backend, plain) = (best(), reference());
    for name in EXAMPLES {
        eprintln!("scene {name}");
        let scene = example(name)?;
        let mut together = Vec::new();
        let mut alone = [Vec::new(), Vec::new()];
        for _ in 0..plan.rounds {
            let times = one.install(|| in_turn(&scene, &[&backend, &plain], 1))?;
            alone[0].push(times[0]);
            alone[1].push(times[1]);
            together.push(all.install(|| in_turn(&scene, &[&backend], 1))?[0]);
        }
        let [ours, theirs] = alone.map(median);
        if name == "hello" {
            let what = "the original tracer, a frame of hello (57 ms, measured before)".into();
            ratios.push(Ratio { what, is: ORIGINAL_HELLO / ours, least: "10, goal 25" });
        }
        writeln!(
            text,
            "| {name} | {:.2} | {:.1} | {:.2} | {:.1} | {:.1} |",
            1e3 * ours,
            scene.screen.pixels() as f64 / ours / 1e6,
            1e3 * median(together),
            1e3 * theirs,
            theirs / ours
        )?;
    }
    text.push('\n');
    Ok(text)
}

/// Plots time by objects, triangles and pixels, and fits the exponent of the power.
fn growth(plan: &Plan, output: &ReportFolder) -> Result<String> {
    let backend = best();
    let time = |scene: Result<Scene>, rounds: usize| -> Result<f64> {
        let seconds = in_turn(&scene?, &[&backend], rounds)?;
        Ok(seconds[0])
    };
    let mut courses = Vec::new();
    let mut objects = Vec::new();
    for &count in plan.objects {
        eprintln!("{count} spheres");
        objects.push((f64::from(count), time(cloud(count, 512, 512), plan.rounds)?));
    }
    courses.push(("spheres, 512 x 512", objects));
    let (mut drawn, mut prepared) = (Vec::new(), Vec::new());
    for &count in plan.triangles {
        eprintln!("{count} triangles");
        let scene = rock(count, 512, 512)?;
        let options = RenderOptions::default();
        let times: Result<Vec<_>> = (0..plan.rounds).map(|_| halves(&scene, &options)).collect();
        let (preparing, drawing) = times?.into_iter().unzip();
        let count = scene.objects.len() as f64;
        drawn.push((count, median(drawing)));
        prepared.push((count, median(preparing)));
    }
    courses.push(("triangles, 512 x 512, drawing alone", drawn));
    courses.push(("triangles, preparing alone", prepared));
    let mut pixels = Vec::new();
    for &(width, height) in plan.screens {
        eprintln!("{width} x {height}");
        pixels.push((f64::from(width) * f64::from(height), time(table(width, height), plan.rounds)?));
    }
    courses.push(("pixels of the table", pixels));

    let mut text = String::from(
        "## Cost by amount of work\n\n\
         On one core. The exponent is that of the power law fitted to the points (least squares of the logarithms): 1 \
         means proportional cost, 0 constant cost.\n\n\
         ![Cost by amount of work](speed-growth.svg)\n\n\
         | what grows | exponent | points: count, CPU ms |\n\
         | --- | --- | --- |\n",
    );
    for (name, points) in &courses {
        let shown: Vec<_> = points.iter().map(|(count, s)| format!("{count}: {:.2}", 1e3 * s)).collect();
        writeln!(text, "| {name} | {:.2} | {} |", exponent(points), shown.join(", "))?;
    }
    let series: Vec<Series> = courses
        .into_iter()
        .map(|(name, points)| Series { name: name.into(), points, joined: true })
        .collect();
    let labels = Labels {
        title: "Cost by amount of work",
        x: "spheres, triangles, pixels",
        y: "CPU seconds per image",
    };
    log_log(&output.path("speed-growth.svg"), &labels, &series)?;
    Ok(text)
}

/// Returns the slope of the line through the logarithms.
fn exponent(points: &[(f64, f64)]) -> f64 {
    let logs: Vec<_> = points.iter().map(|&(x, y)| (x.ln(), y.ln())).collect();
    let count = logs.len() as f64;
    let (mx, my) = logs.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / count, b + y / count));
    let over: f64 = logs.iter().map(|(x, y)| (x - mx) * (y - my)).sum();
    let under: f64 = logs.iter().map(|(x, _)| (x - mx).powi(2)).sum();
    over / under
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponent_of_a_power_is_found() {
        let points: Vec<_> = [1.0f64, 10.0, 1000.0].iter().map(|&x| (x, 3.0 * x.powf(0.75))).collect();
        assert!((exponent(&points) - 0.75).abs() < 1e-12);
    }
}
