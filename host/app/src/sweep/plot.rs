//! Error against time, both in ratios.

use super::cells::Cell;
use super::ticks::{label, ticks};
use super::told::Swept;
use anyhow::anyhow;
use plotters::coord::combinators::WithKeyPoints;
use plotters::prelude::*;
use std::ops::Range;

/// A plot of a knob's cells: a line along the knob, the Pareto front thick, and the reference's own
/// noise, below which no error is known. `None` where fewer than two cells have both.
pub(super) fn svg(
    title: &str,
    swept: &Swept<'_>,
    cells: &[Cell],
) -> anyhow::Result<Option<String>> {
    let point = |cell: &Cell| {
        let at = (swept.time.of(cell)?.0, cell.error("rmse")?);
        (at.0 > 0.0 && at.1 > 0.0).then_some((at, cell.value.clone()))
    };
    let points: Vec<((f64, f64), String)> = cells.iter().filter_map(point).collect();
    if points.len() < 2 {
        return Ok(None);
    }
    let of = cells.iter().find_map(|cell| swept.time.of(cell)).map_or("", |(_, of)| of);
    let noise = cells.iter().map(|cell| cell.noise).fold(0.0, f64::max);
    let range = |values: &mut dyn Iterator<Item = f64>| {
        let (low, high) = values.fold((f64::MAX, 0.0f64), |(a, b), v| (a.min(v), b.max(v)));
        0.7 * low..1.5 * high
    };
    let x = range(&mut points.iter().map(|(at, _)| at.0));
    let floor = (noise > 0.0).then_some(noise);
    let y = range(&mut points.iter().map(|(at, _)| at.1).chain(floor));
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, (760, 460)).into_drawing_area();
        let drawn = || -> Result<(), Box<dyn std::error::Error>> {
            root.fill(&WHITE)?;
            let mut chart = ChartBuilder::on(&root)
                .caption(title, ("sans-serif", 17))
                .margin(12)
                .x_label_area_size(38)
                .y_label_area_size(64)
                .build_cartesian_2d(axis(x.clone()), axis(y))?;
            chart
                .configure_mesh()
                .x_desc(format!("milliseconds {of}"))
                .y_desc(swept.error)
                .light_line_style(TRANSPARENT)
                .x_label_formatter(&|value| label(*value))
                .y_label_formatter(&|value| label(*value))
                .draw()?;
            let line = points.iter().map(|(at, _)| *at);
            chart.draw_series(LineSeries::new(line, BLUE.mix(0.5)))?;
            let best = front(&points);
            chart.draw_series(LineSeries::new(best.iter().copied(), BLUE.stroke_width(3)))?;
            for (at, value) in &points {
                chart.draw_series([Circle::new(*at, 4, BLUE.filled())])?;
                // Above it to the right, where a line that falls leaves room.
                let label = Text::new(value.clone(), (6, -14), ("sans-serif", 13));
                chart.draw_series([EmptyElement::at(*at) + label])?;
            }
            if let Some(noise) = floor {
                chart.draw_series(LineSeries::new([(x.start, noise), (x.end, noise)], RED))?;
            }
            root.present()?;
            Ok(())
        };
        drawn().map_err(|error| anyhow!("the plot could not be drawn: {error}"))?;
    }
    Ok(Some(text))
}

/// An axis in ratios with labels of our own choice: the crate's leave narrow ranges without any.
pub(crate) fn axis(range: Range<f64>) -> WithKeyPoints<LogCoord<f64>> {
    let ticks = ticks(range.start, range.end);
    range.log_scale().with_key_points(ticks)
}

/// The points that no other beats in both, by time.
pub(crate) fn front(points: &[((f64, f64), String)]) -> Vec<(f64, f64)> {
    let mut sorted: Vec<(f64, f64)> = points.iter().map(|(at, _)| *at).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut least = f64::INFINITY;
    sorted.retain(|(_, error)| {
        let better = *error < least;
        least = least.min(*error);
        better
    });
    sorted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_is_what_nothing_beats() {
        let points = [(3.0, 1.0), (1.0, 4.0), (2.0, 5.0), (4.0, 1.0), (1.0, 3.0)];
        let points = points.map(|at| (at, String::new()));
        assert_eq!(front(&points), [(1.0, 3.0), (3.0, 1.0)]);
    }
}
