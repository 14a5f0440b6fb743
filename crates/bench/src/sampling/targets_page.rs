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
         Written by `rayfold-bench sampling --targets`; all figures are in [time-to-error.csv](time-to-error.csv). The \
         scene is that of the [report on speed](speed.md): 26 objects, two suns, mirrors. Times are processor times of \
         preparation and drawing on one thread, the shortest of three runs. The full frame has 1024 x 768 pixels, a \
         quarter of it 512 x 384. Soft shadows come from suns of 4 degrees. The lens has a radius of .05 at a distance \
         of about 10. Every fourth ball moves. The error is the root mean square over pixels and channels in levels \
         (0..255). It is measured against the truth, which is the same picture in `f64` with {} samples in every \
         pixel. Times are interpolated between neighbouring measurements. A dash means that no measurement reached the \
         error.\n\n",
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
        writeln!(page, "## {}\n\nOne ray per pixel takes {}.\n", work.about, single.join(", "))?;
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
        "POV-Ray draws with {} settings (`+A`, `+AM`, `+R`, `-J`), and the best of them counts. Its time is that of \
         drawing alone. Its picture has whole levels; this rounding is an error of .29.\n\n",
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
        "{} {version} (LLVM variant, single precision, box filter) draws with `path`, of the same depth and without \
         Russian roulette. The best of its samplers `independent`, `stratified`, `multijitter`, `orthogonal` and \
         `ldsampler` counts. They take 4, 16, 64 samples per pixel and so on, until the error is .5 (`orthogonal` \
         rounds up, to 121 for 64). The time is that of drawing alone: the scene is loaded and the kernels are \
         compiled before, and the time of a picture of 8 x 6 pixels is subtracted. Mitsuba's errors are measured \
         against a truth of its own, {samples} samples of `multijitter` with other seeds. The error of that truth is \
         estimated at {} levels. In the language of rayfold, scattered light is not scattered again, and mirrors do \
         not show suns. Mitsuba's own surfaces scatter light again, and its own suns are visible in mirrors, which \
         makes another picture, and a noisier one. Its path tracer therefore uses Python classes for the surfaces and \
         for the suns of 4 degrees, which Mitsuba compiles into its kernels like its own classes. A path continues in \
         the mirror direction. Each hit samples one sun, the brighter sun more often. Ambient light is emitted and not \
         sampled. Mitsuba draws neither the full frame nor the picture with motion, because it has no motion.\n\n",
        mitsuba::NAME,
        errors.join(", ")
    )
}
