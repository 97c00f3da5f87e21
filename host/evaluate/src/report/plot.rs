//! Error against time, both in ratios.

use super::cells::Cell;
use super::page::Time;
use crate::chart::{Chart, range};
use plotters::prelude::*;

/// A plot of a knob's cells: a line along the knob, the Pareto front thick, and the reference's own
/// noise, below which no error is known. What has no error has no place on an axis in ratios and stands in a
/// row of its own below a cut. `None` where fewer than two cells have both.
pub(super) fn svg(
    title: &str,
    (error, time): (&str, Time),
    cells: &[Cell],
) -> anyhow::Result<Option<String>> {
    let time = time.among(cells);
    let point = |cell: &Cell| {
        let at = (time.of(cell)?.0, cell.error("rmse")?);
        (at.0 > 0.0 && at.1 >= 0.0).then_some((at, cell.value.clone()))
    };
    let points: Vec<((f64, f64), String)> = cells.iter().filter_map(point).collect();
    if points.len() < 2 {
        return Ok(None);
    }
    let of = cells.iter().find_map(|cell| time.of(cell)).map_or("", |(_, of)| of);
    let noise = cells.iter().map(|cell| cell.noise).fold(0.0, f64::max);
    let floor = (noise > 0.0).then_some(noise);
    let none = row_of_none(&points, floor);
    let drawn_at = |at: (f64, f64)| (at.0, if at.1 > 0.0 { at.1 } else { none });
    let has_none = points.iter().any(|(at, _)| at.1 <= 0.0);
    let chart = Chart {
        title,
        across: &format!("milliseconds {of}"),
        up: error,
        height: 460,
        x: range(points.iter().map(|(at, _)| at.0)),
        y: range(points.iter().map(|(at, _)| drawn_at(*at).1).chain(floor)),
        cut: if has_none { 2f64.sqrt() * none } else { 0.0 },
    };
    let drawn = chart.svg(|canvas| {
        let line = points.iter().map(|(at, _)| drawn_at(*at));
        canvas.draw_series(LineSeries::new(line, BLUE.mix(0.5)))?;
        let best = front(&points);
        let best = best.iter().copied().map(drawn_at);
        canvas.draw_series(LineSeries::new(best, BLUE.stroke_width(3)))?;
        for (at, value) in &points {
            let at = drawn_at(*at);
            canvas.draw_series([Circle::new(at, 4, BLUE.filled())])?;
            // Above it to the right, where a line that falls leaves room.
            let label = Text::new(value.clone(), (6, -14), ("sans-serif", 13));
            canvas.draw_series([EmptyElement::at(at) + label])?;
        }
        if has_none {
            let ends = [(chart.x.start, none), (chart.x.end, none)];
            canvas.draw_series(LineSeries::new(ends, BLACK.mix(0.2)))?;
            let font = ("sans-serif", 13).into_font().color(&BLACK.mix(0.6));
            let label = Text::new("0: no error is left", (6, 4), font);
            canvas.draw_series([EmptyElement::at(ends[0]) + label])?;
        }
        if let Some(noise) = floor {
            let ends = [(chart.x.start, noise), (chart.x.end, noise)];
            canvas.draw_series(LineSeries::new(ends, RED))?;
            let font = ("sans-serif", 13).into_font().color(&RED);
            let label = Text::new("noise of the reference", (6, 4), font);
            canvas.draw_series([EmptyElement::at(ends[0]) + label])?;
        }
        Ok(())
    });
    drawn.map(Some)
}

/// Where points without an error are drawn: at a third of the smallest error and of the noise.
fn row_of_none(points: &[((f64, f64), String)], floor: Option<f64>) -> f64 {
    let errors = points.iter().map(|(at, _)| at.1).chain(floor).filter(|error| *error > 0.0);
    let least = errors.fold(f64::INFINITY, f64::min);
    // Where nothing has an error any number will do.
    if least.is_finite() { least / 3.0 } else { 1.0 }
}

/// The points that no other beats in both, by time.
pub fn front(points: &[((f64, f64), String)]) -> Vec<(f64, f64)> {
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
    use surfelshop_session::timing::Run;

    #[test]
    fn points_without_an_error_are_on_the_front_and_below_all_others() {
        let points = [(1.0, 0.5), (2.0, 0.0), (3.0, 0.25), (4.0, 0.0)];
        let points = points.map(|at| (at, String::new()));
        assert_eq!(front(&points), [(1.0, 0.5), (2.0, 0.0)]);
        assert!(row_of_none(&points, None) < 0.25 && row_of_none(&points, Some(0.1)) < 0.1);
    }

    /// Cells of a knob, each with an error and milliseconds.
    fn drawn(cells: &[(f64, f64)]) -> Option<String> {
        let cell = |&(rmse, wall_ms): &(f64, f64)| {
            let run = Run { wall_ms, own_passes_ms: None, cpu_ms: None };
            Cell { runs: vec![run], ..Cell::new("k", "v", &[("rmse", rmse)], 1.0) }
        };
        let cells: Vec<Cell> = cells.iter().map(cell).collect();
        svg("title", ("RMSE", Time::Frames), &cells).unwrap()
    }

    #[test]
    fn values_without_an_error_are_drawn_in_a_row_that_says_so() {
        let row = "0: no error is left";
        let n_points = |text: &str| text.matches("<circle").count();
        let some = drawn(&[(0.5, 1.0), (0.0, 2.0), (0.25, 3.0), (0.0, 4.0)]).unwrap();
        assert_eq!((n_points(&some), some.contains(row)), (4, true));
        let all = drawn(&[(0.0, 1.0), (0.0, 2.0)]).unwrap();
        assert_eq!((n_points(&all), all.contains(row)), (2, true));
        let none = drawn(&[(0.5, 1.0), (0.25, 2.0)]).unwrap();
        assert_eq!((n_points(&none), none.contains(row)), (2, false));
        assert_eq!(drawn(&[(0.0, 1.0)]), None);
    }

    #[test]
    fn the_front_is_what_nothing_beats() {
        let points = [(3.0, 1.0), (1.0, 4.0), (2.0, 5.0), (4.0, 1.0), (1.0, 3.0)];
        let points = points.map(|at| (at, String::new()));
        assert_eq!(front(&points), [(1.0, 3.0), (3.0, 1.0)]);
    }
}
