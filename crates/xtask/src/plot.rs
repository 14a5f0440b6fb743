//! A plot of a number that changes: the height of a script's first ball over its frames.

use anyhow::{Context, bail};
use plotters::prelude::*;
use rayfold_scene::{Object, Script};

/// The size of a plot in pixels.
const SIZE: (u32, u32) = (420, 150);
/// The number of points of the line per frame.
const STEPS: u32 = 10;
const LINE: RGBColor = RGBColor(200, 60, 30);

/// Plots the frame numbers to the right and the height of the first ball upwards. Each dot is a frame.
pub(crate) fn svg(script: &Script) -> anyhow::Result<String> {
    let first = script.frame_number(0).context("a script has a frame")?;
    let last = script.frame_number(script.frame_count() - 1).context("and a last one")?;
    let frames: Vec<(f64, f64)> = (0..script.frame_count())
        .map(|k| {
            let time = script.frame_number(k).context("a frame has a number")?;
            Ok((time, height(script, time)?))
        })
        .collect::<anyhow::Result<_>>()?;
    let count = ((last - first) * f64::from(STEPS)).round();
    let line: Vec<(f64, f64)> = (0..=count as u32)
        .map(|i| {
            let time = first + f64::from(i) / f64::from(STEPS);
            Ok((time, height(script, time)?))
        })
        .collect::<anyhow::Result<_>>()?;
    let (low, high) = line
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, y)| (low.min(*y), high.max(*y)));
    let margin = 0.1 * (high - low).max(1e-9);

    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&area)
            .margin(8)
            .x_label_area_size(22)
            .y_label_area_size(34)
            .build_cartesian_2d(first - 1.0..last + 1.0, low - margin..high + margin)?;
        let whole = |x: &f64| format!("{x:.0}");
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .x_labels(12)
            .y_labels(5)
            .x_label_formatter(&whole)
            .draw()?;
        chart.draw_series(LineSeries::new(line, LINE.stroke_width(2)))?;
        chart.draw_series(frames.iter().map(|place| Circle::new(*place, 2, LINE.filled())))?;
        area.present()?;
    }
    Ok(svg)
}

fn height(script: &Script, time: f64) -> anyhow::Result<f64> {
    let scene = script.frame_at(0, time).context("a script has a frame")??;
    let ball = scene.objects.iter().find_map(|object| match object {
        Object::Sphere(sphere) => Some(sphere.center().y),
        _ => None,
    });
    match ball {
        Some(y) => Ok(y),
        None => bail!("the script has no ball whose height could be plotted"),
    }
}
