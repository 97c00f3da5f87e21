//! The tables of a measurement.

use super::card::Card;
use super::measurement::Measurement;
use super::plot::time;
use super::words::words;
use crate::theme::{Icon, space};
use eframe::egui::{Grid, RichText, Ui, vec2};
use surfelshop_evaluate::compare::METRICS;
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
        for (id, meaning, better) in METRICS {
            let (title, help) = match words(id) {
                Some(words) => (words.title(), words.help(id)),
                None => (id.to_owned(), format!("{meaning}; {better} is better")),
            };
            row(ui, &title, &help, known.iter().map(|cell| metric(cell, id)));
        }
        let noise = |cell: &&Cell| Some(cell.noise).filter(|_| !cell.is_faulty());
        let wall = |cell: &Cell| cell.times(|run| Some(run.wall_ms));
        let own = |cell: &&Cell| median(&cell.times(|run| run.own_passes_ms));
        let (of_frame, between) =
            (|cell: &&Cell| median(&wall(cell)), |c: &&Cell| spread(&wall(c)));
        let texts = |of: &dyn Fn(&&Cell) -> Option<f64>| -> Vec<String> {
            known.iter().map(|cell| of(cell).map_or("-".to_owned(), number)).collect()
        };
        row(
            ui,
            "noise of the reference",
            "Root of the reference's own mean squared error: no error below it can be told.",
            texts(&noise),
        );
        row(
            ui,
            &format!("time, ms {}", Icon::ArrowDown.unicode()),
            "Milliseconds of a picture: the median of those after the first; all frames together where one is refined.",
            texts(&of_frame),
        );
        row(ui, "spread of times, ms", "Between the quartiles.", texts(&between));
        row(
            ui,
            &format!("its own passes, ms {}", Icon::ArrowDown.unicode()),
            "Milliseconds of the renderer's own passes on the device, without the surfels' and the window's: the median.",
            texts(&own),
        );
    });
}

fn row(ui: &mut Ui, name: &str, help: &str, cells: impl IntoIterator<Item = String>) {
    ui.label(name).on_hover_text(help);
    for cell in cells {
        ui.monospace(cell).on_hover_text(help);
    }
    ui.end_row();
}

/// Error and time of each value as a card. Returns the value that was clicked.
pub(super) fn values(ui: &mut Ui, measurement: &Measurement, now: Option<&str>) -> Option<String> {
    let knob = measurement.basis.knob.as_deref().unwrap_or_default();
    measurement.cells.iter().flatten().next()?;
    for cell in measurement.cells.iter().flatten() {
        if let Some(fault) = &cell.fault {
            faulty(ui, &cell.value, fault);
        }
    }
    let time = time(&measurement.cells);
    let fastest = measurement.cells.iter().flatten().filter_map(|cell| time.of(cell));
    let fastest = fastest.map(|(ms, _)| ms).fold(f64::INFINITY, f64::min);
    let errors = measurement.cells.iter().flatten().filter_map(|cell| cell.error("rmse"));
    let least = errors.fold(f64::INFINITY, f64::min);
    let mut chosen = None;
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(space::SMALL, space::SMALL);
        for (i, cell) in measurement.cells.iter().enumerate() {
            let Some(cell) = cell else { continue };
            let ms = time.of(cell).map(|(ms, _)| ms);
            let marks = [
                (cell.error("rmse") == Some(least)).then_some("closest"),
                (ms == Some(fastest)).then_some("fastest"),
            ];
            let card = Card {
                picture: measurement.picture(ui.ctx(), i),
                title: &cell.value,
                lines: [
                    format!("RMSE {}", metric(cell, "rmse")),
                    format!("FLIP {}", metric(cell, "flip.mean")),
                    ms.map_or_else(|| "no time".to_owned(), |ms| format!("{} ms", number(ms))),
                ],
                mark: marks.into_iter().flatten().collect::<Vec<_>>().join(", "),
                is_chosen: now == Some(cell.value.as_str()),
            };
            let response = card.show(ui).on_hover_text(format!("sets {knob} in the view"));
            if response.clicked() {
                chosen = Some(cell.value.clone());
            }
        }
    });
    chosen
}

/// All numbers of a measurement as lines with tabs, which spreadsheets take.
pub(super) fn as_text(measurement: &Measurement) -> String {
    let known: Vec<&Cell> = measurement.cells.iter().flatten().collect();
    let first = measurement.basis.knob.as_deref().unwrap_or("picture");
    let line = |name: &str, cells: Vec<String>| format!("{name}\t{}\n", cells.join("\t"));
    let mut text = line(first, known.iter().map(|cell| cell.value.clone()).collect());
    for (id, ..) in METRICS {
        let cells = known.iter().map(|cell| match cell.error(id) {
            Some(value) => value.to_string(),
            None => metric(cell, id),
        });
        text += &line(id, cells.collect());
    }
    let time = time(&measurement.cells);
    let times =
        known.iter().map(|cell| time.of(cell).map_or(String::new(), |(ms, _)| ms.to_string()));
    text + &line("milliseconds", times.collect())
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
