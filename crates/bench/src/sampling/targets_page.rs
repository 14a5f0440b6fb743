//! The page of times to an error, its table and its plots.

use std::fmt::Write as _;

use anyhow::Result;

use super::curve::{Curve, gathered};
use super::measure::Args;
use super::mitsuba::{self, Truth};
use super::works::{PEER, WORKS};
use crate::plot::{Labels, Series, log_log};
use crate::speed::{self, povray};

/// The errors at which times are given.
const ERRORS: [f64; 4] = [2.0, 1.0, 0.5, 0.25];

pub(super) fn write(
    args: &Args,
    curves: &[Curve],
    singles: &[(&str, &str, f64)],
    truths: &[(&str, Truth)],
) -> Result<()> {
    table(args, curves)?;
    let mut page = format!(
        "# Time to an error\n\n\
         Written by `rayfold-bench sampling --targets`; all figures are in [time-to-error.csv](time-to-error.csv). The scene of \
         the [report on speed](speed.md): 26 objects, two suns, mirrors. One thread, processor time of preparing and drawing, the \
         shortest of three runs; the full frame is 1024 x 768, a quarter of it 512 x 384. Soft shadows are those of suns of 4 \
         degrees; the lens has a radius of .05 at a distance of about 10; every fourth ball moves. An error is the root mean square \
         over pixels and channels in levels (0..255) from the truth, the same picture in `f64` with {} samples in every pixel. \
         Times are read off the line between neighbouring measurements; a dash stands where none was as good.\n\n",
        args.truth,
    );
    page += &about_povray();
    page += &about_mitsuba(truths);
    for work in &WORKS {
        let ways = gathered(curves, work.name);
        let Some(first) = ways.first() else { continue };
        let single: Vec<String> = singles
            .iter()
            .filter(|(name, ..)| *name == work.name)
            .map(|(_, level, ms)| format!("{ms:.1} ms with {level}"))
            .collect();
        writeln!(page, "## {}\n\nOne ray a pixel takes {}.\n", work.about, single.join(", "))?;
        page += "| ms to an error of | 2 | 1 | .5 | .25 |\n| --- | --- | --- | --- | --- |\n";
        for curve in &ways {
            row(&mut page, &curve.way, |error| Some(format!("{:.0}", curve.time(error)?)));
        }
        for peer in ways.iter().filter(|curve| curve.peer.is_some()) {
            let ratio = |error| Some(format!("{:.1}", peer.time(error)? / first.time(error)?));
            row(&mut page, &format!("{} / {}", peer.way, first.way), ratio);
        }
        let series: Vec<Series> = ways
            .iter()
            .map(|curve| Series {
                name: curve.way.clone(),
                points: curve.points.iter().map(|point| (point.ms, point.error)).collect(),
                joined: curve.peer.is_none(),
            })
            .collect();
        let file = format!("time-to-error-{}.svg", work.name);
        let labels = Labels { title: work.about, x: "processor time, ms", y: "error, levels" };
        log_log(&args.output.path(&file), &labels, &series)?;
        writeln!(page, "\n![{}]({file})\n", work.about)?;
    }
    args.output.write("time-to-error.md", page.trim_end().to_owned() + "\n")
}

fn table(args: &Args, curves: &[Curve]) -> Result<()> {
    let mut table = csv::Writer::from_path(args.output.path("time-to-error.csv"))?;
    table.write_record(["work", "way", "ms", "rays a pixel", "error", "off by > 4 %"])?;
    for curve in curves {
        for point in &curve.points {
            let numbers =
                [point.ms, point.rays, point.error, 100.0 * point.off].map(|number| format!("{number:.4}"));
            table.write_record([curve.work.to_owned(), curve.way.clone()].into_iter().chain(numbers))?;
        }
    }
    Ok(table.flush()?)
}

fn row(page: &mut String, name: &str, cell: impl Fn(f64) -> Option<String>) {
    let cells = ERRORS.map(|error| cell(error).unwrap_or("–".to_owned()));
    let _ = writeln!(page, "| {name} | {} |", cells.join(" | "));
}

fn about_povray() -> String {
    if !povray::is_here() {
        return "POV-Ray is not on this machine: not measured.\n\n".to_owned();
    }
    format!(
        "Of POV-Ray the best of {} settings (`+A`, `+AM`, `+R`, `-J`) counts, drawing alone; its picture has whole levels, which \
         are an error of .29.\n\n",
        PEER.len()
    )
}

fn about_mitsuba(truths: &[(&str, Truth)]) -> String {
    if !speed::mitsuba::is_here() {
        return "Mitsuba is not on this machine: not measured.\n\n".to_owned();
    }
    let Some((_, Truth { version, samples, .. })) = truths.first() else { return String::new() };
    let errors: Vec<String> =
        truths.iter().map(|(work, truth)| format!("{:.2} ({work})", truth.error)).collect();
    format!(
        "Of {} {version} (LLVM variant, single precision, `path` of the same depth without roulette, box filter) the best of \
         `independent`, `stratified`, `multijitter`, `orthogonal` and `ldsampler` counts, with 4, 16, 64 samples a pixel and so on \
         until an error of .5 (`orthogonal` rounds up, to 121 for 64), drawing alone: the scene is loaded and the kernels are \
         compiled before, and what a picture of 8 x 6 takes is taken off. Its errors are from a truth of its own, {samples} samples \
         of `multijitter` by other seeds, whose own error is estimated at {} levels. In this language light that was scattered is \
         not scattered again, and suns are not seen \
         in mirrors: Mitsuba's own surfaces and suns do both, which is another picture and a noisier one. So its path tracer is \
         given the surfaces, and the suns of 4 degrees, as classes of Python, which it compiles into its kernels like its own. A \
         path goes on as a mirror does; each hit asks one sun, the brighter one more often; ambient light is emitted and not \
         sampled. It draws neither the full frame nor motion, of which it has none.\n\n",
        mitsuba::NAME,
        errors.join(", ")
    )
}
