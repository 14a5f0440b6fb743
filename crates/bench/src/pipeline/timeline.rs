//! The timeline of a run: one row per process, one bar per invocation.

use std::path::Path;

use anyhow::{Result, anyhow};
use plotters::prelude::*;
use rayfold_local::routes::Function;

use super::Scene;

const SIZE: (u32, u32) = (900, 360);

/// Plots the cold run of the scene with the largest number of concurrent invocations.
pub(super) fn plot(path: &Path, scene: &Scene) -> Result<()> {
    draw(path, scene).map_err(|error| anyhow!("{}: {error}", path.display()))
}

fn draw(path: &Path, scene: &Scene) -> Result<(), Box<dyn std::error::Error>> {
    let Some(runs) = scene.runs.first() else { return Ok(()) };
    let mut processes: Vec<(Function, u32)> = Vec::new();
    for (function, pid, ..) in &runs.cold.invocations {
        if !processes.contains(&(*function, *pid)) {
            processes.push((*function, *pid));
        }
    }
    processes.sort();
    let end = runs.cold.invocations.iter().map(|(.., end)| end.as_secs_f64()).fold(0.1, f64::max);
    let area = SVGBackend::new(path, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let title =
        format!("{}: every invocation of a cold run, {} at once", scene.folder.name, super::AT_ONCE[0]);
    let mut chart = ChartBuilder::on(&area)
        .caption(title, ("sans-serif", 20))
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(72)
        .build_cartesian_2d(0.0..end, 0.0..processes.len() as f64)?;
    chart
        .configure_mesh()
        .disable_y_mesh()
        .x_desc("seconds after the first upload")
        .y_desc("process")
        .draw()?;
    for (function, pid, from, to) in &runs.cold.invocations {
        let row =
            processes.iter().position(|process| process == &(*function, *pid)).unwrap_or_default() as f64;
        let color = match function {
            Function::Render => RGBColor(0, 114, 178),
            Function::Assemble => RGBColor(213, 94, 0),
        };
        let corners = [(from.as_secs_f64(), row + 0.1), (to.as_secs_f64(), row + 0.9)];
        chart.draw_series([
            Rectangle::new(corners, color.mix(0.75).filled()),
            Rectangle::new(corners, color.stroke_width(1)),
        ])?;
    }
    area.present()?;
    Ok(())
}
