//! The window of settings: theme, size, motion, what lies over pictures, and the file that holds them.

use super::{FileUp, ThemeChoice, UI_SCALES};
use crate::commands::COMMANDS;
use crate::theme::space;
use crate::window::Window;
use eframe::egui::{self, Align2, Context, Ui};

/// Shows the window if it is open.
pub(crate) fn show(window: &mut Window, ctx: &Context) {
    let mut open = window.panels.settings_window;
    egui::Window::new("Settings")
        .open(&mut open)
        .pivot(Align2::CENTER_CENTER)
        .default_pos(ctx.content_rect().center())
        .resizable(false)
        .show(ctx, |ui| {
            ui.set_width(400.0);
            contents(window, ui);
        });
    window.panels.settings_window = open;
}

fn contents(window: &mut Window, ui: &mut Ui) {
    egui::Grid::new("settings").num_columns(2).spacing([space::LARGE, space::MEDIUM]).show(
        ui,
        |ui| {
            let preferences = &mut window.preferences;
            ui.label("theme");
            ui.horizontal(|ui| {
                for (theme, name) in [
                    (ThemeChoice::System, "as the desktop"),
                    (ThemeChoice::Dark, "dark"),
                    (ThemeChoice::Light, "light"),
                ] {
                    ui.selectable_value(&mut preferences.theme, theme, name);
                }
            });
            ui.end_row();
            ui.label("size of everything");
            ui.horizontal(|ui| {
                for scale in UI_SCALES {
                    let is_this = (preferences.ui_scale - scale).abs() < 1e-3;
                    if ui.selectable_label(is_this, format!("{:.0} %", 100.0 * scale)).clicked() {
                        preferences.ui_scale = scale;
                    }
                }
            });
            ui.end_row();
            ui.label("motion");
            ui.checkbox(&mut preferences.reduced_motion, "reduced: cameras jump, nothing fades");
            ui.end_row();
            ui.label("over pictures");
            ui.horizontal(|ui| {
                ui.checkbox(&mut preferences.axes, "axes");
                ui.checkbox(&mut preferences.grid, "ground grid");
                ui.checkbox(&mut preferences.scale_bar, "scale bar");
            });
            ui.end_row();
            up_axes(window, ui);
        },
    );
    ui.separator();
    match window.preference_file.path() {
        Some(path) => {
            ui.weak(format!("These settings are in {}.", path.display()));
            ui.weak(format!(
                "The table [shortcuts] there changes shortcuts, of {} commands; the page \"The window\" of \
                 the manual lists their ids.",
                COMMANDS.len()
            ));
        }
        None => {
            ui.colored_label(
                ui.visuals().warn_fg_color,
                "Changes hold until the window is closed.",
            );
        }
    }
}

/// What points upwards in files of a kind, as it was chosen.
fn up_axes(window: &mut Window, ui: &mut Ui) {
    let mut removed = None;
    for (ending, up) in &window.preferences.up {
        ui.label(format!("up in .{ending}"));
        ui.horizontal(|ui| {
            ui.label(match up {
                FileUp::Y => "y",
                FileUp::Z => "z",
            });
            if ui.small_button("forget").clicked() {
                removed = Some(ending.clone());
            }
        });
        ui.end_row();
    }
    if let Some(ending) = removed {
        window.preferences.up.remove(&ending);
    }
}
