//! Plots for the reports, as SVG.

use std::path::Path;

use anyhow::{Result, anyhow};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// A named series of points, optionally joined by lines.
pub(crate) struct Series {
    pub(crate) name: String,
    pub(crate) points: Vec<(f64, f64)>,
    pub(crate) joined: bool,
}

/// The texts of a plot.
pub(crate) struct Labels<'a> {
    pub(crate) title: &'a str,
    pub(crate) x: &'a str,
    pub(crate) y: &'a str,
}

const SIZE: (u32, u32) = (900, 560);

/// The width of the legend beside a chart, in pixels.
const LEGEND: u32 = 280;

/// Colours that are distinguishable with colour-blindness (Okabe and Ito, 2008).
const COLORS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(60, 60, 60),
];

/// Draws series over two logarithmic axes.
pub(crate) fn log_log(path: &Path, labels: &Labels, series: &[Series]) -> Result<()> {
    draw(path, labels, series).map_err(|error| anyhow!("{}: {error}", path.display()))
}

/// Draws a column of points for each name, and level lines. x is the index of the name; y is logarithmic. Points that
/// are not above 0 are omitted.
pub(crate) fn columns(
    path: &Path,
    labels: &Labels,
    names: &[&str],
    lines: &[f64],
    series: &[Series],
) -> Result<()> {
    draw_columns(path, labels, names, lines, series).map_err(|error| anyhow!("{}: {error}", path.display()))
}

/// Draws cumulative shares in percent over a linear axis from 0 to `end`, and the points that should be to their right.
pub(crate) fn shares(
    path: &Path,
    labels: &Labels,
    end: f64,
    goals: &[(f64, f64)],
    series: &[Series],
) -> Result<()> {
    draw_shares(path, labels, end, goals, series).map_err(|error| anyhow!("{}: {error}", path.display()))
}

fn draw_shares(
    path: &Path,
    labels: &Labels,
    end: f64,
    goals: &[(f64, f64)],
    series: &[Series],
) -> Result<(), Box<dyn std::error::Error>> {
    let area = SVGBackend::new(path, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&area)
        .caption(labels.title, ("sans-serif", 20))
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(72)
        .build_cartesian_2d(0.0..end, 0.0..100.0)?;
    chart
        .configure_mesh()
        .x_desc(labels.x)
        .y_desc(labels.y)
        .label_style(("sans-serif", 14))
        .max_light_lines(0)
        .draw()?;
    for (k, series) in series.iter().enumerate() {
        let style = COLORS[k % COLORS.len()].stroke_width(2);
        let points = series.points.iter().copied().filter(|point| point.0 <= end);
        chart
            .draw_series(LineSeries::new(points, style))?
            .label(&series.name)
            .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], style));
    }
    for &goal in goals {
        chart
            .draw_series([Cross::new(goal, 7, BLACK.stroke_width(2))])?
            .label("goal")
            .legend(|(x, y)| Cross::new((x + 9, y), 6, BLACK.stroke_width(2)));
    }
    chart
        .configure_series_labels()
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.3))
        .label_font(("sans-serif", 14))
        .position(SeriesLabelPosition::LowerRight)
        .draw()?;
    area.present()?;
    Ok(())
}

fn draw_columns(
    path: &Path,
    labels: &Labels,
    names: &[&str],
    lines: &[f64],
    series: &[Series],
) -> Result<(), Box<dyn std::error::Error>> {
    let shown = || series.iter().flat_map(|s| &s.points).map(|p| p.1).filter(|&y| y > 0.0);
    let (low, high) = shown().fold((1.0_f64, 1.0_f64), |(low, high), y| (low.min(y), high.max(y)));
    let (bottom, top) = (low / 1.2, high * 1.2);
    let area = SVGBackend::new(path, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    // The names of the series are to the right of the columns.
    let width = names.len() as f64 * 1.2;
    let mut chart = ChartBuilder::on(&area)
        .caption(labels.title, ("sans-serif", 20))
        .margin(12)
        .x_label_area_size(110)
        .y_label_area_size(72)
        .build_cartesian_2d(-0.6..width - 0.4, (bottom..top).log_scale())?;
    chart
        .configure_mesh()
        .disable_x_mesh()
        .disable_x_axis()
        .y_desc(labels.y)
        .y_labels(24)
        .y_label_formatter(&|y| ratio_label(*y))
        .max_light_lines(0)
        .label_style(("sans-serif", 14))
        .draw()?;
    let turned = ("sans-serif", 14).into_font().transform(FontTransform::Rotate270);
    for (k, name) in names.iter().enumerate() {
        let place = chart.backend_coord(&(k as f64, bottom));
        area.draw(&Text::new(*name, (place.0 - 8, place.1 + 8 + 8 * name.len() as i32), turned.clone()))?;
    }
    for &line in lines {
        let ends = [(-0.6, line), (names.len() as f64 - 0.4, line)];
        chart.draw_series(LineSeries::new(ends, BLACK.mix(0.5).stroke_width(1)))?;
    }
    for (k, series) in series.iter().enumerate() {
        let style = COLORS[k % COLORS.len()].filled();
        let shift = 0.1 * (k as f64 - 0.5 * (COLORS.len() - 1) as f64);
        let points = series.points.iter().filter(|point| point.1 > 0.0);
        chart
            .draw_series(points.map(|&(x, y)| Circle::new((x + shift, y), 4, style)))?
            .label(&series.name)
            .legend(move |(x, y)| Circle::new((x + 8, y), 5, style));
    }
    chart
        .configure_series_labels()
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.3))
        .label_font(("sans-serif", 14))
        .position(SeriesLabelPosition::UpperRight)
        .draw()?;
    area.present()?;
    Ok(())
}

fn draw(path: &Path, labels: &Labels, series: &[Series]) -> Result<(), Box<dyn std::error::Error>> {
    let range = |of: fn(&(f64, f64)) -> f64| {
        let all = series.iter().flat_map(|s| &s.points).map(of);
        let (low, high) = all.fold((f64::INFINITY, 0f64), |(l, h), v| (l.min(v), h.max(v)));
        // Entire decades. The first and the last have labels.
        0.8 * 10f64.powf((low.log10() - 0.2).floor())..1.25 * 10f64.powf((high.log10() + 0.2).ceil())
    };
    let area = SVGBackend::new(path, (SIZE.0 + LEGEND, SIZE.1)).into_drawing_area();
    area.fill(&WHITE)?;
    let (left, legend) = area.split_horizontally(SIZE.0);
    let mut chart = ChartBuilder::on(&left)
        .caption(labels.title, ("sans-serif", 20))
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(72)
        .build_cartesian_2d(range(|p| p.0).log_scale(), range(|p| p.1).log_scale())?;
    chart
        .configure_mesh()
        .x_desc(labels.x)
        .y_desc(labels.y)
        .x_label_formatter(&|x| label(*x))
        .y_label_formatter(&|y| label(*y))
        .max_light_lines(0)
        .label_style(("sans-serif", 14))
        .draw()?;
    for (k, series) in series.iter().enumerate() {
        let color = COLORS[k % COLORS.len()];
        if series.joined {
            chart.draw_series(LineSeries::new(series.points.iter().copied(), color.stroke_width(2)))?;
        }
        // Colours repeat after seven; then hollow points are used.
        let filled = k < COLORS.len();
        let style = if filled { color.filled() } else { color.stroke_width(2) };
        chart.draw_series(series.points.iter().map(|&p| Circle::new(p, 5, style)))?;
        let row = 60 + 22 * k as i32;
        legend.draw(&Circle::new((8, row), 5, style))?;
        let text = ("sans-serif", 14).into_text_style(&legend).pos(Pos::new(HPos::Left, VPos::Center));
        legend.draw_text(&series.name, &text, (20, row))?;
    }
    area.present()?;
    Ok(())
}

/// Returns one digit and the power of ten for 1, 2 and 5. Other grid lines have no space for labels.
fn label(x: f64) -> String {
    let exponent = (x.log10() + 1e-9).floor();
    let digit = (x / 10f64.powf(exponent)).round();
    if [1.0, 2.0, 5.0].contains(&digit) { format!("{digit}e{exponent}") } else { String::new() }
}

/// Returns the number itself, for 1, 2 and 5 times a power of ten.
fn ratio_label(y: f64) -> String {
    if label(y).is_empty() { String::new() } else { format!("{}", (y * 1e6).round() / 1e6) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_short() {
        assert_eq!(
            [1e-6, 9.999_999_999_999_999e-6, 3.000_000_000_000_000_3e-4].map(label),
            ["1e-6", "1e-5", ""]
        );
        assert_eq!([2e-4, 5e7, 1.0].map(label), ["2e-4", "5e7", "1e0"]);
        assert_eq!([0.05, 0.3, 0.5, 1.0, 20.0].map(ratio_label), ["0.05", "", "0.5", "1", "20"]);
    }
}
