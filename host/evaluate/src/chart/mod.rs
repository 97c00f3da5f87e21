//! Plots of pairs of positive numbers, both axes in ratios, as SVG.

pub mod ticks;

use anyhow::anyhow;
use plotters::coord::combinators::WithKeyPoints;
use plotters::prelude::*;
use std::error::Error;
use std::ops::Range;
use ticks::{label, ticks};

/// An axis in ratios.
type Axis = WithKeyPoints<LogCoord<f64>>;

/// A plot that takes lines and points.
pub type Canvas<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<Axis, Axis>>;

/// What stands around a plot, and where it begins and ends.
pub struct Chart<'a> {
    /// The title.
    pub title: &'a str,
    /// Below the plot.
    pub across: &'a str,
    /// Beside it.
    pub up: &'a str,
    /// Height in pixels.
    pub height: u32,
    /// Range of the horizontal axis.
    pub x: Range<f64>,
    /// Range of the vertical axis.
    pub y: Range<f64>,
    /// Where the axis upwards ends below and another begins; 0 where it goes on. What stands below has no place
    /// in ratios, such as nothing.
    pub cut: f64,
}

/// Pixels from left to right.
const WIDTH: u32 = 760;

/// A range around positive numbers, with room on both sides.
pub fn range(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) = values.fold((f64::MAX, 0.0f64), |(a, b), v| (a.min(v), b.max(v)));
    0.7 * low..1.5 * high
}

/// An axis with labels of our own choice, from some number on: the crate's leave narrow ranges without any.
fn axis(range: &Range<f64>, from: f64) -> Axis {
    let ticks = ticks(range.start.max(from), range.end);
    range.clone().log_scale().with_key_points(ticks)
}

impl Chart<'_> {
    /// The plot with what is drawn into it.
    ///
    /// # Errors
    /// Where that cannot be drawn.
    pub fn svg(
        &self,
        draw: impl FnOnce(&mut Canvas<'_>) -> Result<(), Box<dyn Error>>,
    ) -> anyhow::Result<String> {
        let mut text = String::new();
        let drawn = self.draw_into(&mut text, draw);
        drawn.map_err(|error| anyhow!("the plot could not be drawn: {error}"))?;
        Ok(text)
    }

    /// Two strokes across the axis, and a broken line to the other end.
    fn draw_cut(&self, canvas: &mut Canvas<'_>) -> Result<(), Box<dyn Error>> {
        let at = |x| EmptyElement::at((x, self.cut));
        let blank = |y| PathElement::new([(-6, y + 2), (6, y - 2)], WHITE.stroke_width(4));
        let stroke = |y| PathElement::new([(-6, y + 2), (6, y - 2)], BLACK);
        canvas.plotting_area().draw(&(at(self.x.start) + blank(0) + stroke(-3) + stroke(3)))?;
        let ends = [(self.x.start, self.cut), (self.x.end, self.cut)];
        let (dash, gap) = (4, 6);
        canvas.draw_series(DashedLineSeries::new(ends, dash, gap, BLACK.mix(0.4).into()))?;
        Ok(())
    }

    fn draw_into(
        &self,
        text: &mut String,
        draw: impl FnOnce(&mut Canvas<'_>) -> Result<(), Box<dyn Error>>,
    ) -> Result<(), Box<dyn Error>> {
        let root = SVGBackend::with_string(text, (WIDTH, self.height)).into_drawing_area();
        root.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&root)
            .caption(self.title, ("sans-serif", 17))
            .margin(12)
            .x_label_area_size(38)
            .y_label_area_size(64)
            .build_cartesian_2d(axis(&self.x, 0.0), axis(&self.y, self.cut))?;
        chart
            .configure_mesh()
            .x_desc(self.across)
            .y_desc(self.up)
            .light_line_style(TRANSPARENT)
            .x_label_formatter(&|value| label(*value))
            .y_label_formatter(&|value| label(*value))
            .draw()?;
        if self.cut > 0.0 {
            self.draw_cut(&mut chart)?;
        }
        draw(&mut chart)?;
        root.present()?;
        Ok(())
    }
}
