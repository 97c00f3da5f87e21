//! The list of filters.

use crate::theme::dismiss;
use crate::window::Window;
use eframe::egui::{self, RichText, Ui};
use surfelshop_cloud::display::{Filter, FilterAction, FilterTest};

/// Shows the filters, each with a way to remove it.
pub(super) fn show(window: &mut Window, ui: &mut Ui) {
    let mut removed = None;
    for (i, filter) in window.settings.filters.iter_mut().enumerate() {
        ui.push_id(("filter", i), |ui| {
            ui.horizontal_wrapped(|ui| {
                let title = filter.attribute.title();
                if dismiss(ui, "remove this filter") {
                    removed = Some(i);
                }
                action(ui, filter);
                ui.label(RichText::new(title).strong());
                test(ui, &mut filter.test);
            });
        });
    }
    if let Some(i) = removed {
        window.settings.filters.remove(i);
    }
}

/// Whether surfels are kept or hidden.
fn action(ui: &mut Ui, filter: &mut Filter) {
    let word = match filter.action {
        FilterAction::Keep => "only",
        FilterAction::Hide => "hide",
    };
    if ui
        .small_button(word)
        .on_hover_text("click to show what is hidden, and hide what is shown")
        .clicked()
    {
        filter.action = match filter.action {
            FilterAction::Keep => FilterAction::Hide,
            FilterAction::Hide => FilterAction::Keep,
        };
    }
}

fn test(ui: &mut Ui, test: &mut FilterTest) {
    match test {
        FilterTest::Range([low, high]) => {
            let size = (*high - *low).abs();
            let speed = if size.is_finite() { (size / 200.0).max(1e-6) } else { 0.1 };
            let before = [*low, *high];
            for (end, name) in [(&mut *low, "from"), (&mut *high, "to")] {
                let label = ui.label(name);
                // An open end stays open.
                if end.is_infinite() {
                    ui.weak("…");
                } else {
                    let value = egui::DragValue::new(end).speed(speed).max_decimals(6);
                    ui.add(value).labelled_by(label.id);
                }
            }
            if !(*low <= *high && low.is_finite() == before[0].is_finite()) {
                [*low, *high] = before;
            }
        }
        FilterTest::Values(values) => {
            const MOST: usize = 12;
            let shown: Vec<String> = values.iter().take(MOST).map(i64::to_string).collect();
            let more = if values.len() > MOST { " …" } else { "" };
            ui.label(format!("{}{more}", shown.join(", ")));
        }
    }
}
