//! Time against what it grows with, both in ratios.

use crate::sweep::plot::axis;
use crate::sweep::ticks::label;
use anyhow::anyhow;
use plotters::prelude::*;

/// A line of a plot.
pub(super) struct Line {
    pub(super) name: String,
    /// Lines of a variant have its number, and so one colour.
    pub(super) variant: usize,
    /// Thick or thin.
    pub(super) is_frame: bool,
    pub(super) points: Vec<(f64, f64)>,
}

const COLORS: [RGBColor; 6] = [
    RGBColor(31, 90, 200),
    RGBColor(200, 60, 30),
    RGBColor(30, 140, 60),
    RGBColor(140, 60, 170),
    RGBColor(180, 130, 0),
    RGBColor(60, 60, 60),
];

/// The plot; `None` where no line has two points.
pub(super) fn svg(title: &str, across: &str, lines: &[Line]) -> anyhow::Result<Option<String>> {
    let is_sound = |(x, y): &(f64, f64)| *x > 0.0 && *y > 0.0 && x.is_finite() && y.is_finite();
    let points = || lines.iter().flat_map(|line| &line.points).filter(|at| is_sound(at));
    if lines.iter().all(|line| line.points.len() < 2) || points().count() < 2 {
        return Ok(None);
    }
    let range = |of: fn(&(f64, f64)) -> f64| {
        let ends = points().map(of).fold((f64::MAX, 0.0f64), |(a, b), v| (a.min(v), b.max(v)));
        0.7 * ends.0..1.5 * ends.1
    };
    let (x, y) = (range(|at| at.0), range(|at| at.1));
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, (760, 500)).into_drawing_area();
        let drawn = || -> Result<(), Box<dyn std::error::Error>> {
            root.fill(&WHITE)?;
            let mut chart = ChartBuilder::on(&root)
                .caption(title, ("sans-serif", 17))
                .margin(12)
                .x_label_area_size(38)
                .y_label_area_size(64)
                .build_cartesian_2d(axis(x), axis(y))?;
            chart
                .configure_mesh()
                .x_desc(across)
                .y_desc("milliseconds, median")
                .light_line_style(TRANSPARENT)
                .x_label_formatter(&|value| label(*value))
                .y_label_formatter(&|value| label(*value))
                .draw()?;
            for line in lines {
                let color = COLORS[line.variant % COLORS.len()];
                let style = color.stroke_width(if line.is_frame { 3 } else { 1 });
                let sound = || line.points.iter().copied().filter(is_sound);
                chart
                    .draw_series(LineSeries::new(sound(), style))?
                    .label(&line.name)
                    .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], style));
                chart.draw_series(sound().map(|at| Circle::new(at, 3, color.filled())))?;
            }
            chart
                .configure_series_labels()
                .position(SeriesLabelPosition::UpperLeft)
                .background_style(WHITE.mix(0.8))
                .border_style(BLACK.mix(0.3))
                .draw()?;
            root.present()?;
            Ok(())
        };
        drawn().map_err(|error| anyhow!("the plot could not be drawn: {error}"))?;
    }
    Ok(Some(text))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(points: &[(f64, f64)]) -> Line {
        Line { name: "a".to_owned(), variant: 7, is_frame: true, points: points.to_vec() }
    }

    #[test]
    fn two_points_are_drawn_and_one_is_not() {
        let drawn = |points: &[(f64, f64)]| svg("title", "surfels", &[line(points)]).unwrap();
        assert_eq!(drawn(&[(1.0, 2.0)]), None);
        assert_eq!(drawn(&[(1.0, 2.0), (f64::NAN, 1.0)]), None);
        let text = drawn(&[(1e4, 2.0), (1e5, 9.0)]).unwrap();
        assert!(text.contains("surfels") && text.contains("<svg") && text.ends_with("</svg>\n"));
    }
}
