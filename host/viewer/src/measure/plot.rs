//! The plot of error against time, with logarithmic axes.

use super::measurement::Measurement;
use super::table::number;
use eframe::egui::{
    Align2, Color32, CursorIcon, Rect, RichText, Role, Sense, Stroke, Ui, Vec2, WidgetInfo,
};
use egui_plot::{
    AxisHints, GridInput, GridMark, HLine, Line, Plot, PlotBounds, PlotPoint, PlotPoints,
    PlotTransform, Points, Text,
};
use std::ops::RangeInclusive;
use surfelshop_evaluate::chart::ticks::label;
use surfelshop_evaluate::chart::ticks::ticks;
use surfelshop_evaluate::report::cells::Cell;
use surfelshop_evaluate::report::page::Time;
use surfelshop_evaluate::report::plot::front;

/// Height in points.
const HEIGHT: f32 = 260.0;

/// Size of the area around a value that the pointer hits, points.
const NEAR: f32 = 16.0;

/// Shares of the plot's width and height within which the values of two points would cover each other: a few letters, and
/// a line.
const CLOSE: [f64; 2] = [0.12, 0.06];

/// The kind of time of the values, as in a `report`.
pub(super) fn time(cells: &[Option<Cell>]) -> Time {
    Time::Passes.among(cells.iter().flatten())
}

/// The values with both an error and a time: milliseconds, RMSE, and the value. A logarithmic axis has
/// no error of 0.
pub(crate) fn points(cells: &[Option<Cell>]) -> Vec<((f64, f64), String)> {
    let time = time(cells);
    let point = |cell: &Cell| {
        let at = (time.of(cell)?.0, cell.error("rmse")?);
        (at.0 > 0.0 && at.1 > 0.0 && !cell.is_faulty()).then(|| (at, cell.value.clone()))
    };
    cells.iter().flatten().filter_map(point).collect()
}

/// The contents of the plot.
struct Drawing {
    knob: String,
    /// Milliseconds, error and value.
    points: Vec<((f64, f64), String)>,
    /// What the milliseconds measure.
    of: &'static str,
    /// The shortest time of a value without error; infinite without one.
    exact_ms: f64,
    /// The noise of the reference, where it has some.
    noise: Option<f64>,
    line: Color32,
    red: Color32,
    text: Color32,
}

/// Draws the plot. Returns the value that was clicked; `now` is the one of the view.
pub(super) fn show(ui: &mut Ui, measurement: &Measurement, now: Option<&str>) -> Option<String> {
    let points = points(&measurement.cells);
    if points.is_empty() {
        return None;
    }
    let cells = || measurement.cells.iter().flatten();
    let time = time(&measurement.cells);
    let noise = cells().map(|cell| cell.noise).fold(0.0, f64::max);
    let exact = cells().filter(|cell| cell.error("rmse") == Some(0.0));
    let drawing = Drawing {
        knob: measurement.basis.knob.clone().unwrap_or_default(),
        points,
        of: cells().find_map(|cell| time.of(cell)).map_or("", |(_, of)| of),
        exact_ms: exact
            .filter_map(|cell| time.of(cell))
            .map(|(ms, _)| ms)
            .fold(f64::INFINITY, f64::min),
        noise: (noise > 0.0).then_some(noise),
        line: match ui.visuals().dark_mode {
            true => Color32::from_rgb(110, 170, 255),
            false => Color32::from_rgb(20, 80, 200),
        },
        red: ui.visuals().error_fg_color,
        text: ui.visuals().text_color(),
    };
    let transform = drawing.draw(ui);
    let chosen = drawing.handle_pointer(ui, &transform, now);
    ui.weak(match drawing.noise {
        Some(_) => "thick: beaten by none; red: the reference's own noise",
        None => "thick: beaten by none",
    });
    let equal: Vec<&str> = cells()
        .filter(|cell| cell.error("rmse") == Some(0.0))
        .map(|cell| cell.value.as_str())
        .collect();
    if !equal.is_empty() {
        ui.weak(format!("not drawn, no error is left: {}", equal.join(", ")));
    }
    chosen
}

/// What stands beside points, at the first of those that lie so close that their values would cover each other.
fn labels(
    places: &[[f64; 2]],
    points: &[((f64, f64), String)],
    ranges: [[f64; 2]; 2],
) -> Vec<([f64; 2], String)> {
    let mut labels: Vec<([f64; 2], String)> = Vec::new();
    let is_close = |a: [f64; 2], b: [f64; 2]| {
        (0..2).all(|i| (a[i] - b[i]).abs() < CLOSE[i] * (ranges[i][1] - ranges[i][0]))
    };
    for (at, (_, value)) in places.iter().zip(points) {
        match labels.iter_mut().find(|(other, _)| is_close(*other, *at)) {
            Some((_, values)) => {
                values.push_str(", ");
                values.push_str(value);
            }
            None => labels.push((*at, value.clone())),
        }
    }
    labels
}

impl Drawing {
    fn draw(&self, ui: &mut Ui) -> PlotTransform {
        let log = |(ms, error): &(f64, f64)| [ms.log10(), error.log10()];
        let all: Vec<[f64; 2]> = self.points.iter().map(|(at, _)| log(at)).collect();
        // A value without error is not drawn, and beats every slower one.
        let best = front(&self.points).into_iter().filter(|(ms, _)| *ms < self.exact_ms);
        let best: Vec<[f64; 2]> = best.map(|at| log(&at)).collect();
        let [x, y] = self.ranges();
        let marks = |mark: GridMark, _: &RangeInclusive<f64>| label(10f64.powf(mark.value));
        let axes = [
            AxisHints::new_x().label(format!("milliseconds {}", self.of)),
            AxisHints::new_y().label("RMSE of radiance"),
        ];
        let [across, up] = axes.map(|axis| axis.formatter(marks));
        let plot = Plot::new("error against time")
            .height(HEIGHT)
            .sense(Sense::hover())
            .allow_drag(false)
            .allow_zoom(false)
            .allow_scroll(false)
            .allow_boxed_zoom(false)
            .allow_double_click_reset(false)
            .allow_axis_zoom_drag(false)
            .show_x(false)
            .show_y(false)
            .x_grid_spacer(grid)
            .y_grid_spacer(grid)
            .custom_x_axes(vec![across.label_spacing(24.0..=40.0)])
            .custom_y_axes(vec![up.label_spacing(14.0..=20.0)]);
        let shown = plot.show(ui, |plot| {
            plot.set_plot_bounds(PlotBounds::from_min_max([x[0], y[0]], [x[1], y[1]]));
            let line = |name: &'static str, points: &[[f64; 2]]| {
                Line::new(name, PlotPoints::from(points.to_vec())).allow_hover(false)
            };
            plot.line(line("in turn", &all).color(self.line.gamma_multiply(0.5)).width(1.0));
            plot.line(line("best", &best).color(self.line).width(3.0));
            let points = Points::new("values", PlotPoints::from(all.clone()));
            plot.points(points.color(self.line).radius(4.0).allow_hover(false));
            let points = Points::new("best values", PlotPoints::from(best));
            plot.points(points.color(self.line).radius(5.5).allow_hover(false));
            if let Some(noise) = self.noise {
                let line = HLine::new("noise", noise.log10()).stroke(Stroke::new(1.5, self.red));
                plot.hline(line.allow_hover(false));
            }
            for (at, values) in labels(&all, &self.points, [x, y]) {
                let at = PlotPoint::new(at[0], at[1]);
                let values = RichText::new(format!(" {values}")).size(13.0).color(self.text);
                let text = Text::new("value", at, values).anchor(Align2::LEFT_BOTTOM);
                plot.text(text.allow_hover(false));
            }
        });
        shown.transform
    }

    /// The ends of both axes, as logarithms.
    fn ranges(&self) -> [[f64; 2]; 2] {
        let range = |values: &mut dyn Iterator<Item = f64>| {
            let (low, high) = values.fold((f64::MAX, 0.0f64), |(a, b), v| (a.min(v), b.max(v)));
            [(0.7 * low).log10(), (1.5 * high).log10()]
        };
        let errors = self.points.iter().map(|(at, _)| at.1);
        [range(&mut self.points.iter().map(|(at, _)| at.0)), range(&mut errors.chain(self.noise))]
    }

    /// Shows the value under the pointer, and returns the one that was clicked.
    fn handle_pointer(
        &self,
        ui: &Ui,
        transform: &PlotTransform,
        now: Option<&str>,
    ) -> Option<String> {
        let (mut chosen, knob) = (None, &self.knob);
        let stroke = Stroke::new(1.5, self.text);
        for (i, ((ms, error), value)) in self.points.iter().enumerate() {
            let at = PlotPoint::new(ms.log10(), error.log10());
            let center = transform.position_from_point(&at);
            let place = Rect::from_center_size(center, Vec2::splat(NEAR));
            let id = ui.scope_id().with(("point", i));
            let response = ui.interact(place, id, Sense::click());
            let (error, ms) = (number(*error), number(*ms));
            let text = format!("{knob} {value}: RMSE {error}, {ms} ms {}", self.of);
            response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &text));
            if response.hovered() {
                ui.painter().circle_stroke(center, 8.0, stroke);
                ui.ctx().set_cursor_icon(CursorIcon::PointingHand);
            }
            if now == Some(value) {
                ui.painter().circle_stroke(center, 6.0, stroke);
            }
            let help = format!("{text}\na click sets {knob} in the view");
            if response.on_hover_text(help).clicked() {
                chosen = Some(value.clone());
            }
        }
        chosen
    }
}

/// The marks of an axis, as in a `report`. The distance to the next mark decides whether a number fits.
fn grid(input: GridInput) -> Vec<GridMark> {
    let (low, high) = input.bounds;
    let marks: Vec<f64> =
        ticks(10f64.powf(low), 10f64.powf(high)).into_iter().map(f64::log10).collect();
    let mark = |(i, value): (usize, &f64)| {
        let others = marks.iter().enumerate().filter(|(other, _)| *other != i);
        let gap = others.map(|(_, other)| (other - value).abs()).fold(high - low, f64::min);
        // A power of ten always fits; a close 9 before it does not.
        let is_power = (value - value.round()).abs() < 1e-9;
        let step_size = if is_power { gap.max(0.3 * (high - low)) } else { gap };
        GridMark { value: *value, step_size }
    };
    marks.iter().enumerate().map(mark).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_marked_in_ratios_as_those_of_reports() {
        let bounds = (0.019f64.log10(), 3f64.log10());
        let marks = grid(GridInput { bounds, base_step_size: 0.01 });
        let values: Vec<String> = marks.iter().map(|mark| label(10f64.powf(mark.value))).collect();
        assert_eq!(values, ["0.02", "0.05", "0.1", "0.2", "0.5", "1", "2"]);
        // 1 to 2 is as far as 0.1 to 0.2, and nearer than 2 to 5.
        assert!((marks[6].step_size - 2f64.log10()).abs() < 1e-9);
        assert!((marks[3].step_size - 2f64.log10()).abs() < 1e-9);
    }

    #[test]
    fn values_without_error_or_time_have_no_point() {
        let run =
            surfelshop_session::timing::Run { wall_ms: 2.0, own_passes_ms: None, cpu_ms: None };
        let of = |rmse: f64, runs: Vec<surfelshop_session::timing::Run>| {
            Some(Cell { runs, ..Cell::new("rays", "4", &[("rmse", rmse)], 1.0) })
        };
        let cells = [of(0.5, vec![run]), of(0.5, Vec::new()), of(0.0, vec![run]), None];
        assert_eq!(points(&cells), [((2.0, 0.5), "4".to_owned())]);
    }

    #[test]
    fn times_of_one_kind_are_compared() {
        let of = |own_passes_ms: Option<f64>| {
            let run = surfelshop_session::timing::Run { wall_ms: 2.0, own_passes_ms, cpu_ms: None };
            Some(Cell { runs: vec![run], ..Cell::new("rays", "4", &[("rmse", 0.5)], 1.0) })
        };
        let unknown = || Some(Cell::new("rays", "5", &[("rmse", 0.5)], 1.0));
        let at = |cells: &[Option<Cell>]| -> Vec<f64> {
            points(cells).into_iter().map(|((ms, _), _)| ms).collect()
        };
        assert_eq!(at(&[of(Some(1.0)), of(Some(1.5)), unknown()]), [1.0, 1.5]);
        assert_eq!(at(&[of(Some(1.0)), of(None), unknown()]), [2.0, 2.0]);
    }

    #[test]
    fn values_of_points_at_one_place_share_a_label() {
        let points = ["1", "2", "3"].map(|value| ((0.0, 0.0), value.to_owned()));
        let places = [[0.0, 0.0], [0.05, 0.05], [0.05, 0.5]];
        let found = labels(&places, &points, [[0.0, 1.0]; 2]);
        assert_eq!(found, [([0.0, 0.0], "1, 2".to_owned()), ([0.05, 0.5], "3".to_owned())]);
    }
}
