//! The page, its table and its plots.

use std::fmt::Write as _;

use anyhow::{Context, Result};

use super::measure::{Agreement, Args, Drawn};
use super::scenes::EFFECTS;
use super::small;
use crate::plot::{Labels, Series, log_log};

const WAYS: [(&str, &str); 4] = [
    ("adaptive", "adaptive"),
    ("uniform", "as many everywhere"),
    ("pairs", "pairs of dimensions"),
    ("independent", "independent samples"),
];

pub(super) fn write(
    args: &Args,
    (width, height): (u32, u32),
    drawn: &[Drawn],
    agreements: &[Agreement],
) -> Result<()> {
    let truth = args.truth;
    let mut table = csv::Writer::from_path(args.output.path("sampling.csv"))?;
    table.write_record([
        "effect",
        "way",
        "most",
        "error asked",
        "ms",
        "rays a pixel",
        "error",
        "off by > 4 %",
        "error of blocks",
    ])?;
    for row in drawn {
        table.write_record([
            row.effect.to_owned(),
            row.way.to_owned(),
            row.asked.most().to_string(),
            row.asked.error().to_string(),
            format!("{:.3}", 1e3 * row.seconds),
            format!("{:.3}", row.rays),
            format!("{:.4}", row.error),
            format!("{:.4}", 100.0 * row.off),
            format!("{:.4}", row.of_blocks),
        ])?;
    }
    table.flush()?;
    let mut page = format!(
        "# Sampling: error against time\n\n\
         Written by `rayfold-bench sampling`; all figures are in [sampling.csv](sampling.csv). Pictures have {width} x \
         {height} pixels and are drawn on one thread. Times are processor times of preparation and drawing, the \
         shortest of three runs. The error is the root mean square over pixels and channels, in levels (0..255) before \
         rounding. It is measured against the truth, which is the same picture in `f64` with {truth} samples in every \
         pixel. The samplers *pairs of dimensions* and *independent samples* are measured for their errors only: their \
         points are computed one by one, so their times say little.\n\n"
    );
    page.push_str(&slopes(drawn));
    page.push_str(&rays_saved(drawn));
    page.push_str(&small::at_random(args)?);
    page.push_str(&agreement(agreements, args));
    page.push_str("## Error against time\n\n");
    for effect in &EFFECTS {
        let series: Vec<Series> = WAYS
            .iter()
            .map(|&(way, name)| Series {
                name: name.to_owned(),
                points: rows(drawn, effect.name, way).map(|row| (1e3 * row.seconds, row.error)).collect(),
                joined: true,
            })
            .filter(|series| !series.points.is_empty())
            .collect();
        if series.is_empty() {
            continue;
        }
        let file = format!("sampling-{}.svg", effect.name);
        let labels = Labels { title: effect.about, x: "processor time, ms", y: "error, levels" };
        log_log(&args.output.path(&file), &labels, &series)?;
        writeln!(page, "![{}: {}]({file})\n", effect.name, effect.about)?;
    }
    args.output.write("sampling.md", page.trim_end().to_owned() + "\n")
}

/// Renews the part of the page on floors and scenes drawn at random, and leaves the rest.
pub(super) fn renew_random(args: &Args, part: &str) -> Result<()> {
    if args.check {
        eprint!("{part}");
        return Ok(());
    }
    let page = std::fs::read_to_string(args.output.path("sampling.md"))?;
    let next = page.find("## Against").context("no page to renew")?;
    let before = page.find(small::HEADING).unwrap_or(next);
    args.output.write("sampling.md", format!("{}{part}{}", &page[..before], &page[next..]))
}

fn rows<'a>(drawn: &'a [Drawn], effect: &'a str, way: &'a str) -> impl Iterator<Item = &'a Drawn> {
    drawn.iter().filter(move |row| row.effect == effect && row.way == way)
}

/// Returns the exponents of the error by samples, between 4 and 64 per pixel.
fn slopes(drawn: &[Drawn]) -> String {
    let mut text = "## Slopes\n\nThe table shows the exponent of the error as a power of the samples per pixel, \
                    between 4 and 64. Independent samples have an exponent of -0.5.\n\n\
                    | effect | all dimensions | pairs of dimensions | independent |\n| ------ | ------ | ------ | ------ |\n"
        .to_owned();
    for effect in &EFFECTS {
        let slope = |way: &str| {
            let at = |count: u32| rows(drawn, effect.name, way).find(|row| row.asked.most() == count);
            let (few, many) = (at(4)?, at(64)?);
            Some(format!("{:.2}", (many.error / few.error).ln() / 16f64.ln()))
        };
        if let (Some(all), Some(pairs), Some(independent)) =
            (slope("uniform"), slope("pairs"), slope("independent"))
        {
            let _ = writeln!(text, "| {}: {} | {all} | {pairs} | {independent} |", effect.name, effect.about);
        }
    }
    text.push('\n');
    text
}

/// Returns the section on the rays of adaptive pictures, compared with pictures that have as many samples everywhere.
fn rays_saved(drawn: &[Drawn]) -> String {
    let mut text = "## The cost of adaptive pictures\n\nEach adaptive picture has a limit of *n* rays per pixel and a \
                    requested error of *e* levels. *Blocks* is the error of the means of 4 x 4 pixels. It is a quarter \
                    of the error if the error is noise alone, and larger if the error has a bias.\n\n\
                    | effect | n, e | rays a pixel | error | share of pixels off by > 4 levels | blocks | ms | the error with n everywhere | ms |\n\
                    | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n"
        .to_owned();
    for row in drawn.iter().filter(|row| row.way == "adaptive") {
        let all = rows(drawn, row.effect, "uniform").find(|all| all.asked.most() == row.asked.most());
        let all = all.map_or((String::new(), String::new()), |all| {
            (format!("{:.3}", all.error), format!("{:.1}", 1e3 * all.seconds))
        });
        let _ = writeln!(
            text,
            "| {} | {}, {} | {:.2} | {:.3} | {:.3} % | {:.3} | {:.1} | {} | {} |",
            row.effect,
            row.asked.most(),
            row.asked.error(),
            row.rays,
            row.error,
            100.0 * row.off,
            row.of_blocks,
            1e3 * row.seconds,
            all.0,
            all.1
        );
    }
    text.push('\n');
    text
}

/// Returns the section that checks the truth itself.
fn agreement(agreements: &[Agreement], args: &Args) -> String {
    let mut text = format!(
        "## Against independent samples of the plain tracer\n\nThis section checks the truth itself. The kernels draw \
         small pictures (48 x 36) with {} samples in every pixel, and the plain tracer draws them with {} independent \
         random samples. *Mean square* and *largest* describe the difference of the two pictures, divided by the \
         standard error of the plain tracer. *Difference* and *standard error* are root mean squares in levels. Two \
         estimates of the same value have a mean square of about 1, or less if most pixels have one colour.\n\n\
         | effect | mean square | largest | difference, levels | standard error, levels |\n| --- | --- | --- | --- | --- |\n",
        args.truth.max(args.independent),
        args.independent
    );
    for row in agreements {
        let Agreement { effect, mean_square, largest, difference, standard_error } = row;
        let _ = writeln!(
            text,
            "| {effect} | {mean_square:.3} | {largest:.2} | {difference:.4} | {standard_error:.4} |"
        );
    }
    text.push('\n');
    text
}
