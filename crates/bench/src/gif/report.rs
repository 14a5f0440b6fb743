//! `docs/reports/gif.md`: tables, plots and enlarged crops.

use std::fmt::Write as _;
use std::path::Path;

use image::{GenericImage, Rgb, RgbImage, imageops};

use super::Outcome;
use super::programs::{Program, decode};
use super::sets::Set;
use crate::plot::{Labels, Series, log_log};

/// Which program is the one to beat.
const RIVAL: &str = "gifski --quality 100";
/// Sets and places of which crops are shown: left, top.
const CROPS: [(&str, u32, u32); 3] = [("spheres", 380, 180), ("camera", 250, 190), ("texture", 260, 150)];
const CROP: u32 = 96;
const ENLARGED: u32 = 3;

const HEAD: &str = "\
| program | wall s | CPU s | MB | file MB | PSNR | worst | dE | dE 2000 | blurred | blurred 2000 | flicker | share | frames |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |
";

/// A row of the table.
pub(super) fn line(o: &Outcome) -> String {
    let q = &o.quality;
    format!(
        "| {} | {:.2} | {:.2} | {:.0} | {:.3} | {:.2} | {:.2} | {:.3} | {:.3} | {:.3} | {:.3} | {:.3} | {:.3} | {} |",
        o.program,
        o.cost.wall,
        o.cost.cpu,
        o.cost.memory,
        o.bytes as f64 / 1e6,
        q.psnr,
        q.psnr_worst,
        q.de76,
        q.de2000,
        q.blurred,
        q.blurred2000,
        q.flicker,
        q.flicker_share,
        o.frames
    )
}

pub(super) fn write(
    folder: &Path,
    programs: &[Program],
    results: &[(Set, Vec<Outcome>)],
) -> anyhow::Result<()> {
    let beside = folder.join("gif");
    std::fs::create_dir_all(&beside)?;
    let mut text = String::from(
        "# GIFs: rayfold beside other encoders\n\n\
        Written by `cargo run --release -p rayfold-bench -- gif`. All programs encode the same PNG files, one after \
        the other on the same machine, at their defaults but for the flags shown; FFmpeg decodes every result. PSNR is \
        over the three channels of sRGB, the mean of the frames' and the worst frame's (99: exact). dE is the CIE 1976 \
        colour difference, dE 2000 that of CIE 142-2001; blurred: of pictures averaged over 5 x 5 pixels. Flicker: of \
        pixels that stay from one frame to the next, the mean CIE 1976 difference of what is shown, and the share of \
        them that changes. Where a program leaves frames out, what it shows at the frame's time is judged.\n\n\
        The wall times are only as good as the machine was idle.\n\n## Programs\n\n",
    );
    for program in programs {
        writeln!(text, "- {}: {}", program.name, program.version)?;
    }
    text.push_str("\n## rayfold against gifski at quality 100\n\n");
    text.push_str(
        "Ratios of CPU and size; differences of PSNR in dB; ratios of dE. Bold: worse by more than 1 %.\n\n",
    );
    text.push_str("| set | CPU | wall | size | PSNR | worst | dE | dE 2000 | blurred | blurred 2000 |\n");
    text.push_str("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
    for (set, outcomes) in results {
        if let (Some(ours), Some(rival)) = (outcomes.first(), outcomes.iter().find(|o| o.program == RIVAL)) {
            writeln!(text, "| {} {}", set.name, against(ours, rival))?;
        }
    }
    for (set, outcomes) in results {
        let (width, height) = set.size;
        writeln!(text, "\n## {}\n\n{} frames of {width} x {height}: {}.\n", set.name, set.count, set.about)?;
        text.push_str(HEAD);
        for outcome in outcomes {
            writeln!(text, "{}", line(outcome))?;
        }
        if let Some(&(_, left, top)) = CROPS.iter().find(|(name, ..)| *name == set.name) {
            let file = format!("{}.png", set.name);
            crops(set, outcomes, left, top)?.save(beside.join(&file))?;
            writeln!(text, "\n![Enlarged crops: the frame, then each program's](gif/{file})")?;
        }
    }
    plots(&beside, results)?;
    text.push_str("\n## All sets\n\n![Size and CPU time](gif/cost.svg)\n\n![Size and dE](gif/quality.svg)\n");
    std::fs::write(folder.join("gif.md"), text)?;
    Ok(())
}

fn against(ours: &Outcome, rival: &Outcome) -> String {
    let ratio = |a: f64, b: f64| {
        if b == 0.0 {
            return if a == 0.0 { "both 0".to_owned() } else { "**more than 0**".to_owned() };
        }
        let text = format!("{:.2}", a / b);
        if a / b > 1.01 { format!("**{text}**") } else { text }
    };
    let more =
        |a: f64, b: f64| if a < b * 0.99 { format!("**{:+.2}**", a - b) } else { format!("{:+.2}", a - b) };
    let (q, r) = (&ours.quality, &rival.quality);
    format!(
        "| {} | {} | {} | {} | {} | {} | {} | {} | {} |",
        ratio(ours.cost.cpu, rival.cost.cpu),
        ratio(ours.cost.wall, rival.cost.wall),
        ratio(ours.bytes as f64, rival.bytes as f64),
        more(q.psnr, r.psnr),
        more(q.psnr_worst, r.psnr_worst),
        ratio(q.de76, r.de76),
        ratio(q.de2000, r.de2000),
        ratio(q.blurred, r.blurred),
        ratio(q.blurred2000, r.blurred2000),
    )
}

/// The middle frame's crop as it is meant, then as each program shows it, side by side.
fn crops(set: &Set, outcomes: &[Outcome], left: u32, top: u32) -> anyhow::Result<RgbImage> {
    let number = set.count / 2;
    let mut panels = vec![set.frame(number)];
    for outcome in outcomes {
        let (shown, _) = decode(&outcome.gif, set.size)?;
        panels.push(shown[shown.len() / 2].clone());
    }
    let side = CROP * ENLARGED;
    let mut sheet = RgbImage::from_pixel((side + 6) * panels.len() as u32, side, Rgb([255; 3]));
    for (panel, x) in panels.iter().zip((0..).step_by(side as usize + 6)) {
        let crop = imageops::crop_imm(panel, left, top, CROP, CROP).to_image();
        sheet.copy_from(&imageops::resize(&crop, side, side, imageops::FilterType::Nearest), x, 0)?;
    }
    Ok(sheet)
}

fn plots(folder: &Path, results: &[(Set, Vec<Outcome>)]) -> anyhow::Result<()> {
    let names = results.iter().flat_map(|(_, outcomes)| outcomes).map(|o| o.program.clone());
    let mut programs = names.collect::<Vec<_>>();
    programs.sort();
    programs.dedup();
    let series = |y: fn(&Outcome) -> f64| {
        let of = |name: &String| {
            let outcomes = results.iter().flat_map(|(_, outcomes)| outcomes).filter(|o| o.program == *name);
            let points = outcomes.map(|o| (o.bytes as f64, y(o))).filter(|p| p.1 > 0.0).collect();
            Series { name: name.clone(), points, joined: false }
        };
        programs.iter().map(of).collect::<Vec<_>>()
    };
    let cost = Labels { title: "CPU time and size of each set", x: "bytes", y: "CPU seconds" };
    log_log(&folder.join("cost.svg"), &cost, &series(|o| o.cost.cpu))?;
    let quality = Labels { title: "dE and size of each set", x: "bytes", y: "mean CIE 1976 difference" };
    log_log(&folder.join("quality.svg"), &quality, &series(|o| o.quality.de76))
}
