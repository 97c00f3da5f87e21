//! Time against what it grows with, both in ratios.

use crate::chart::{Chart, range};
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
    let chart = Chart {
        title,
        across,
        up: "milliseconds, median",
        height: 500,
        x: range(points().map(|at| at.0)),
        y: range(points().map(|at| at.1)),
        cut: 0.0,
    };
    let drawn = chart.svg(|canvas| {
        for line in lines {
            let color = COLORS[line.variant % COLORS.len()];
            let style = color.stroke_width(if line.is_frame { 3 } else { 1 });
            let sound = || line.points.iter().copied().filter(is_sound);
            canvas
                .draw_series(LineSeries::new(sound(), style))?
                .label(&line.name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], style));
            canvas.draw_series(sound().map(|at| Circle::new(at, 3, color.filled())))?;
        }
        canvas
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .background_style(WHITE.mix(0.8))
            .border_style(BLACK.mix(0.3))
            .draw()?;
        Ok(())
    });
    drawn.map(Some)
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
