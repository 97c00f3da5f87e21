//! Plots of functions on straight axes, as SVG.

use anyhow::anyhow;
use plotters::prelude::*;
use std::error::Error;

/// A function by its points.
pub(super) struct Line<'a> {
    pub(super) name: &'a str,
    pub(super) points: Vec<(f64, f64)>,
}

/// Pixels of a plot.
const SIZE: (u32, u32) = (620, 320);

/// A plot of lines; what is not finite is left out.
pub(super) fn chart(
    title: &str,
    across: &str,
    up: &str,
    lines: &[Line<'_>],
) -> anyhow::Result<String> {
    let mut text = String::new();
    draw(&mut text, (title, across, up), lines)
        .map_err(|error| anyhow!("the plot `{title}` could not be drawn: {error}"))?;
    Ok(text)
}

fn range(values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
    let found = values.filter(|v| v.is_finite());
    let (low, high) = found.fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(v), b.max(v)));
    if low > high {
        return 0.0..1.0;
    }
    let room = 0.04 * (high - low).max(1e-12);
    low - room..high + room
}

fn draw(
    text: &mut String,
    (title, across, up): (&str, &str, &str),
    lines: &[Line<'_>],
) -> Result<(), Box<dyn Error>> {
    let root = SVGBackend::with_string(text, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let points = || lines.iter().flat_map(|line| &line.points);
    let (x, y) = (range(points().map(|p| p.0)), range(points().map(|p| p.1)));
    let mut chart = ChartBuilder::on(&root)
        .caption(title, ("sans-serif", 16))
        .margin(10)
        .x_label_area_size(36)
        .y_label_area_size(56)
        .build_cartesian_2d(x, y)?;
    chart.configure_mesh().x_desc(across).y_desc(up).light_line_style(TRANSPARENT).draw()?;
    for (i, line) in lines.iter().enumerate() {
        let color = Palette99::pick(i).to_rgba();
        let finite = line.points.iter().copied().filter(|(x, y)| x.is_finite() && y.is_finite());
        chart
            .draw_series(LineSeries::new(finite, color.stroke_width(2)))?
            .label(line.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 14, y)], color.stroke_width(2)));
    }
    chart.configure_series_labels().background_style(WHITE.mix(0.8)).border_style(BLACK).draw()?;
    root.present()?;
    Ok(())
}

/// A function at equal steps.
pub(super) fn sampled(from: f64, to: f64, f: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    // So many that noise of the frequency 32 has more than two for each cell of it.
    let n = 640;
    (0..=n).map(|i| from + (to - from) * f64::from(i) / f64::from(n)).map(|x| (x, f(x))).collect()
}
