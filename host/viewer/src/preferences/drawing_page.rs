//! The page of what draws: device and way to draw, memory, and what is kept on disk.

use super::device::words;
use crate::panels::row::{check_row, row, row_of};
use crate::theme::space;
use crate::window::Window;
use eframe::egui::{self, Label, Response, RichText, Role, TextEdit, Ui, WidgetInfo};
use std::path::Path;
use surfelshop_runtime::plugins::cache_folder;
use surfelshop_session::options::{BackendChoice, SurfelChoice, values};

/// Shows the page.
pub(super) fn show(window: &mut Window, ui: &mut Ui) {
    ui.strong("Device");
    let adapter = window.render.adapter.clone();
    let now = match (window.render.no_device, adapter.as_str()) {
        (true, _) => "none",
        (false, "") => "being opened",
        (false, adapter) => adapter,
    };
    row_of(ui, "draws now", "", |ui, _label| ui.add(Label::new(now).wrap()));
    let device = &mut window.preferences.device;
    let about = "How surfels are drawn: as quads by the device, by its compute where they are small, or by the CPU, \
                 which on software devices takes a fraction of the time.";
    choice(ui, ("way to draw", about), &mut device.surfels, words::<SurfelChoice>());
    let about = "The graphics interface, instead of the best one.";
    choice(ui, ("interface", about), &mut device.backend, words::<BackendChoice>());
    row(ui, "adapter", "Any part of its name; empty for the best one.", |ui| {
        let line = TextEdit::singleline(&mut device.adapter).hint_text("the best one");
        ui.add(line.desired_width(ui.available_width()))
    });
    row(ui, "memory", "Most that an open pyramid takes, such as 500MB or 4GB.", |ui| {
        let line = TextEdit::singleline(&mut window.preferences.memory);
        ui.add(line.hint_text("half of what is free").desired_width(ui.available_width()))
    });
    let memory = window.preferences.memory.trim();
    if !memory.is_empty()
        && let Err(reason) = values::memory(memory)
    {
        let text = RichText::new(reason).color(ui.visuals().error_fg_color);
        ui.add(Label::new(text).wrap());
    }
    ui.weak("These hold from the next start on; options of the command line go before them.");
    ui.add_space(space::MEDIUM);
    ui.strong("Motion");
    let about = "Fewer surfels and pixels while something moves, so that pictures come quickly.";
    check_row(ui, "draw less in motion", about, &mut window.views.adaptive);
    ui.add_space(space::MEDIUM);
    ui.strong("Cache");
    cache(window, ui);
}

/// The choice of a word; empty for the usual.
fn choice(
    ui: &mut Ui,
    (label, about): (&str, &str),
    chosen: &mut String,
    words: Vec<String>,
) -> Response {
    row_of(ui, label, about, |ui, _label| {
        let text = if chosen.is_empty() { "automatic" } else { chosen.as_str() };
        let combo = egui::ComboBox::from_id_salt(label).selected_text(text.to_owned());
        let shown = combo.show_ui(ui, |ui| {
            ui.selectable_value(chosen, String::new(), "automatic");
            for word in words.into_iter().filter(|word| word != "auto") {
                ui.selectable_value(chosen, word.clone(), word);
            }
        });
        shown.response.widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, label));
        shown.response
    })
}

/// What is kept on disk to be found again, and a button that removes it.
fn cache(window: &mut Window, ui: &mut Ui) {
    let Some(folder) = cache_folder() else {
        ui.weak("This system names no folder for it.");
        return;
    };
    let bytes = *window.panels.settings.cache.get_or_insert_with(|| size(&folder));
    row_of(
        ui,
        "folder",
        "Light probes as they are prepared: made again where they are gone.",
        |ui, _| ui.add(Label::new(folder.display().to_string()).wrap()),
    );
    row_of(ui, "size", "", |ui, _label| {
        ui.label(format!("{:.1} MB", bytes as f64 * 1e-6));
        let empty = ui.add_enabled(bytes > 0, egui::Button::new("empty it"));
        if empty.clicked() {
            let n_left = remove(&folder);
            if n_left > 0 {
                let folder = folder.display();
                window.messages.warn(format!("{folder}: {n_left} files could not be removed"));
            }
            window.panels.settings.cache = None;
        }
        empty
    });
}

/// The files of the cache, which has no folders.
fn files(folder: &Path) -> impl Iterator<Item = std::fs::DirEntry> {
    let all = folder.read_dir().into_iter().flatten().flatten();
    all.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_file()))
}

fn size(folder: &Path) -> u64 {
    files(folder).filter_map(|entry| Some(entry.metadata().ok()?.len())).sum()
}

/// Removes all files; the number of those that could not be.
fn remove(folder: &Path) -> usize {
    files(folder).filter(|entry| std::fs::remove_file(entry.path()).is_err()).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_the_cache_are_counted_and_removed_and_folders_stay() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a"), [0; 30]).unwrap();
        std::fs::create_dir(folder.path().join("own")).unwrap();
        std::fs::write(folder.path().join("own/b"), [0; 7]).unwrap();
        assert_eq!(size(folder.path()), 30);
        assert_eq!(remove(folder.path()), 0);
        assert_eq!((size(folder.path()), size(&folder.path().join("own"))), (0, 7));
        assert_eq!(size(&folder.path().join("gone")), 0);
    }
}
