//! The tables of a measurement.

use super::measurement::Measurement;
use super::plot::time;
use eframe::egui::{Grid, RichText, Ui};
use surfelshop_evaluate::compare::report::METRICS;
use surfelshop_evaluate::report::cells::Cell;
use surfelshop_session::timing::median;
use surfelshop_session::timing::spread;

/// Space between columns and rows, points.
const SPACING: [f32; 2] = [14.0, 4.0];

/// Every metric of each picture, below the faults of pictures.
pub(super) fn pictures(ui: &mut Ui, measurement: &Measurement) {
    let known: Vec<&Cell> = measurement.cells.iter().flatten().collect();
    if known.is_empty() {
        return;
    }
    for cell in known.iter().filter_map(|cell| Some((&cell.value, cell.fault.as_ref()?))) {
        faulty(ui, cell.0, cell.1);
    }
    let grid = Grid::new("measured").num_columns(1 + known.len()).striped(true);
    grid.spacing(SPACING).show(ui, |ui| {
        ui.weak("metric");
        for cell in &known {
            ui.strong(&cell.value);
        }
        ui.end_row();
        for (name, meaning, better) in METRICS {
            let help = format!("{meaning}; {better} is better");
            row(ui, name, &help, known.iter().map(|cell| metric(cell, name)));
        }
        let noise = |cell: &&Cell| Some(cell.noise).filter(|_| !cell.is_faulty());
        let wall = |cell: &Cell| cell.times(|run| Some(run.wall_ms));
        let own = |cell: &&Cell| median(&cell.times(|run| run.own_passes_ms));
        let (of_frame, between) =
            (|cell: &&Cell| median(&wall(cell)), |c: &&Cell| spread(&wall(c)));
        let texts = |of: &dyn Fn(&&Cell) -> Option<f64>| -> Vec<String> {
            known.iter().map(|cell| of(cell).map_or("-".to_owned(), number)).collect()
        };
        row(ui, "noise", "root of the reference's own mean squared error", texts(&noise));
        row(
            ui,
            "frame, ms",
            "median of those after the first; all frames together where a picture is refined",
            texts(&of_frame),
        );
        row(ui, "spread, ms", "between the quartiles", texts(&between));
        row(ui, "own passes, ms", "its own passes on the device, median", texts(&own));
    });
}

fn row(ui: &mut Ui, name: &str, help: &str, cells: impl IntoIterator<Item = String>) {
    ui.label(name).on_hover_text(help);
    for cell in cells {
        ui.monospace(cell);
    }
    ui.end_row();
}

/// Error and time of each value. Returns the value that was clicked.
pub(super) fn values(ui: &mut Ui, measurement: &Measurement, now: Option<&str>) -> Option<String> {
    let knob = measurement.basis.knob.as_deref().unwrap_or_default();
    measurement.cells.iter().flatten().next()?;
    for cell in measurement.cells.iter().flatten() {
        if let Some(fault) = &cell.fault {
            faulty(ui, &cell.value, fault);
        }
    }
    let mut chosen = None;
    let time = time(&measurement.cells);
    Grid::new("swept").num_columns(4).striped(true).spacing(SPACING).show(ui, |ui| {
        for title in [knob, "rmse", "flip.mean", "ms"] {
            ui.weak(title);
        }
        ui.end_row();
        for cell in measurement.cells.iter().flatten() {
            let button = ui.selectable_label(now == Some(cell.value.as_str()), &cell.value);
            if button.on_hover_text(format!("sets {knob} in the view")).clicked() {
                chosen = Some(cell.value.clone());
            }
            ui.monospace(metric(cell, "rmse"));
            ui.monospace(metric(cell, "flip.mean"));
            ui.monospace(time.of(cell).map_or("-".to_owned(), |(ms, _)| number(ms)));
            ui.end_row();
        }
    });
    chosen
}

fn faulty(ui: &mut Ui, value: &str, fault: &str) {
    let text = format!("{value}: {fault}; it is not measured");
    let text = RichText::new(text).color(ui.visuals().error_fg_color);
    ui.add(eframe::egui::Label::new(text).wrap());
}

/// A metric as text; `equal` where PSNR is infinite.
fn metric(cell: &Cell, name: &str) -> String {
    match (cell.error(name), name) {
        (Some(value), "psnr") => format!("{value:.2} dB"),
        (Some(value), _) => number(value),
        (None, "psnr") if !cell.is_faulty() => "equal".to_owned(),
        (None, _) => "-".to_owned(),
    }
}

/// A number with four digits.
pub(super) fn number(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 {
        "0".to_owned()
    } else if !(1e-4..1e6).contains(&size) {
        format!("{value:.3e}")
    } else {
        let digits = (3 - size.log10().floor() as i32).max(0) as usize;
        format!("{value:.digits$}")
    }
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn numbers_have_four_digits() {
        for (value, expected) in [
            (0.0, "0"),
            (0.0123456, "0.01235"),
            (0.9876543, "0.9877"),
            (12.3456, "12.35"),
            (-123_456.7, "-123457"),
            (0.00001234, "1.234e-5"),
        ] {
            assert_eq!(number(value), expected);
        }
    }
}
