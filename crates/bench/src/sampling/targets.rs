//! The scene of the report on speed, with several samples per pixel: the time to an error, compared with other
//! renderers.

use anyhow::Result;
use glam::DVec3;
use rayfold_scene::Samples;
use rayfold_tracer::RenderOptions;

use super::curve::{Curve, Point};
use super::measure::{Args, measure, root_mean_square, shortest, truth};
use super::works::{PEER, WORKS, Work};
use super::{mitsuba, targets_page};
use crate::backends::levels;
use crate::speed::{self, povray};

/// The limits of the pictures: the most rays per pixel, and an error.
const ASKED: [(u32, f64); 10] = [
    (4, 0.0),
    (16, 0.0),
    (64, 0.0),
    (16, 8.0),
    (16, 4.0),
    (64, 3.0),
    (64, 2.0),
    (256, 1.5),
    (256, 1.0),
    (256, 0.7),
];

const POV_RAY: &str = "POV-Ray";

pub(super) fn run(args: &Args) -> Result<()> {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let (mut curves, mut singles, mut truths) = (vec![], vec![], vec![]);
    for work in WORKS.iter().filter(|work| args.only.as_ref().is_none_or(|only| only == work.name)) {
        let picture = work.picture()?;
        let truth = truth(&picture, args.truth)?;
        for (level_name, level) in levels().into_iter().take(2) {
            let options = RenderOptions { level: Some(level), ..RenderOptions::default() };
            let single = 1e3 * one.install(|| shortest(&picture, Samples::default(), &options))?;
            singles.push((work.name, level_name, single));
            for way in ["adaptive", "uniform"] {
                let mut curve = Curve {
                    work: work.name,
                    peer: None,
                    way: format!("{way}, {level_name}"),
                    points: vec![],
                };
                for (most, error) in
                    ASKED.into_iter().filter(|(_, error)| (*error > 0.0) == (way == "adaptive"))
                {
                    let asked = Samples::new(most, error)?;
                    let row =
                        one.install(|| measure(work.name, way, &picture, asked, &options, &truth.means))?;
                    eprintln!(
                        "{:8} {:18} {most:4} {error:4}: {:8.2} ms {:7.2} rays, error {:6.3}, {:.3} % off",
                        work.name,
                        curve.way,
                        1e3 * row.seconds,
                        row.rays,
                        row.error,
                        100.0 * row.off
                    );
                    curve.points.push(Point {
                        ms: 1e3 * row.seconds,
                        rays: row.rays,
                        error: row.error,
                        off: row.off,
                    });
                }
                curves.push(curve);
            }
        }
        let has_soft_parts = work.sun > 0.0 || work.lens > 0.0;
        if !has_soft_parts && povray::is_here() {
            curves.push(peer(work, &truth.means)?);
        }
        // Nothing moves in a picture of Mitsuba's; edges alone are POV-Ray's.
        if has_soft_parts && !work.moves && speed::mitsuba::is_here() {
            let drawn = mitsuba::draw(work.name, &picture.scene, 0.5, false)?;
            curves.extend(drawn.curves);
            truths.push((work.name, drawn.truth));
        }
    }
    if args.check { Ok(()) } else { targets_page::write(args, &curves, &singles, &truths) }
}

/// Measures POV-Ray's times, without those of starting and reading the scene, and its errors.
fn peer(work: &Work, truth: &[DVec3]) -> Result<Curve> {
    let folder = tempfile::tempdir()?;
    let scene = work.scene()?;
    let mut curve = Curve { work: work.name, peer: Some(POV_RAY), way: POV_RAY.to_owned(), points: vec![] };
    for options in PEER {
        let start = povray::render_as(&scene, folder.path(), (8, 6), options)?.0;
        let (seconds, image) = povray::render_as(&scene, folder.path(), work.size, options)?;
        let levels = image.pixels().map(|pixel| DVec3::from_array(pixel.0.map(f64::from)));
        let errors: Vec<DVec3> = levels.zip(truth).map(|(levels, truth)| levels - 255.0 * *truth).collect();
        let off = errors.iter().filter(|error| error.abs().max_element() > 4.0).count() as f64
            / errors.len() as f64;
        let (ms, error) = (1e3 * (seconds - start), root_mean_square(&errors));
        eprintln!(
            "{:8} POV-Ray {options:?}: {ms:.0} ms, error {error:.3}, {:.3} % off",
            work.name,
            100.0 * off
        );
        curve.points.push(Point { ms, rays: f64::NAN, error, off });
    }
    Ok(curve)
}
