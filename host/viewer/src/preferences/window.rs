//! The window of settings, page by page, and the file that holds them.

use super::{Orbit, Page, ThemeChoice, UI_SCALES, Unit};
use super::{drawing_page, plugins_page, shortcuts_page};
use crate::panels::row::{axes, check_row, row_of};
use crate::theme::space;
use crate::window::Window;
use eframe::egui::{self, Align2, Context, Label, RichText, ScrollArea, Ui, vec2};

/// Width of the list of pages, and size of a page at most.
const PAGES: f32 = 110.0;
const PAGE: [f32; 2] = [520.0, 420.0];

/// Shows the window if it is open.
pub(crate) fn show(window: &mut Window, ctx: &Context) {
    let mut open = window.panels.settings_window;
    let screen = ctx.content_rect();
    let shown = egui::Window::new("Settings")
        .open(&mut open)
        .pivot(Align2::CENTER_CENTER)
        .default_pos(screen.center())
        .resizable(false)
        .show(ctx, |ui| contents(window, ui, screen.size()));
    window.panels.settings_window = open;
    if shown.is_none() {
        window.panels.settings.waits = None;
        (window.panels.settings.trusted, window.panels.settings.cache) = (None, None);
    }
}

fn contents(window: &mut Window, ui: &mut Ui, screen: egui::Vec2) {
    let size = vec2(PAGE[0].min(screen.x - PAGES - 80.0), PAGE[1].min(screen.y - 170.0));
    ui.set_width(PAGES + size.x + 2.0 * space::MEDIUM);
    ui.horizontal_top(|ui| {
        ui.set_height(size.y);
        ui.vertical(|ui| {
            ui.set_width(PAGES);
            for page in Page::ALL {
                let is_shown = window.panels.settings.page == page;
                let button = egui::Button::selectable(is_shown, page.name());
                if ui.add_sized(vec2(PAGES, 24.0), button).clicked() {
                    window.panels.settings.page = page;
                    // The entries above are drawn already.
                    ui.ctx().request_repaint();
                }
            }
        });
        ui.vertical(|ui| {
            ui.set_width(size.x);
            let page = window.panels.settings.page;
            let area = ScrollArea::vertical().id_salt(page.name()).auto_shrink(false);
            area.max_height(size.y).show(ui, |ui| {
                ui.set_max_width(ui.available_width() - 12.0);
                match page {
                    Page::Appearance => appearance(window, ui),
                    Page::Views => views(window, ui),
                    Page::Drawing => drawing_page::show(window, ui),
                    Page::Shortcuts => shortcuts_page::show(window, ui),
                    Page::Plugins => plugins_page::show(window, ui),
                }
            });
        });
    });
    ui.separator();
    match window.preference_file.path() {
        Some(path) => {
            let text = format!("These settings are in {}.", path.display());
            ui.add(Label::new(RichText::new(text).weak()).wrap());
        }
        None => {
            let warns = ui.visuals().warn_fg_color;
            ui.colored_label(warns, "Changes hold until the window is closed.");
        }
    }
}

/// Theme, size, motion, and which bars and panels are shown.
fn appearance(window: &mut Window, ui: &mut Ui) {
    let preferences = &mut window.preferences;
    row_of(ui, "theme", "Dark or light, or as the desktop is.", |ui, _label| {
        let themes = [
            (ThemeChoice::System, "as the desktop"),
            (ThemeChoice::Dark, "dark"),
            (ThemeChoice::Light, "light"),
        ];
        let shown = ui.horizontal(|ui| {
            for (theme, name) in themes {
                ui.selectable_value(&mut preferences.theme, theme, name);
            }
        });
        shown.response
    });
    let about = "Over the scale of the screen.";
    row_of(ui, "size of everything", about, |ui, _label| {
        let shown = ui.horizontal_wrapped(|ui| {
            for scale in UI_SCALES {
                let is_this = (preferences.ui_scale - scale).abs() < 1e-3;
                if ui.selectable_label(is_this, format!("{:.0} %", 100.0 * scale)).clicked() {
                    preferences.ui_scale = scale;
                }
            }
        });
        shown.response
    });
    let about = "Cameras jump to where they go, and nothing fades.";
    check_row(ui, "reduced motion", about, &mut preferences.reduced_motion);
    ui.add_space(space::MEDIUM);
    ui.strong("Shown");
    check_row(ui, "toolbar", "The row of icons below the menus.", &mut preferences.toolbar);
    let about = "The list of clouds, lights, cameras and views at the left.";
    check_row(ui, "outliner", about, &mut preferences.panels);
    let about = "Of what is selected, at the right.";
    check_row(ui, "properties", about, &mut preferences.properties);
}

/// What lies over pictures, how the mouse turns, units and the axis that points upwards.
fn views(window: &mut Window, ui: &mut Ui) {
    let preferences = &mut window.preferences;
    ui.strong("Over pictures");
    let about = "In a corner of each view; a click looks along one, a drag turns.";
    check_row(ui, "axes", about, &mut preferences.axes);
    check_row(ui, "ground grid", "Below what is open.", &mut preferences.grid);
    let about = "At the distance of what the camera turns about.";
    check_row(ui, "scale bar", about, &mut preferences.scale_bar);
    ui.add_space(space::MEDIUM);
    ui.strong("Camera");
    let about = "Turntable: up stays up. Trackball: over the poles, too.";
    row_of(ui, "a drag turns as", about, |ui, _label| {
        let orbit = &mut preferences.orbit;
        let shown = ui.horizontal(|ui| {
            ui.selectable_value(orbit, Orbit::Turntable, "turntable");
            ui.selectable_value(orbit, Orbit::Trackball, "trackball");
        });
        shown.response
    });
    ui.add_space(space::MEDIUM);
    ui.strong("Files that do not say it themselves");
    let about = "What a length of 1 is: for the scale bar. LAS and E57 say it.";
    row_of(ui, "unit", about, |ui, _label| {
        let unit = &mut preferences.unit;
        let combo = egui::ComboBox::from_id_salt("unit").selected_text(unit.name());
        let shown = combo.show_ui(ui, |ui| {
            for one in Unit::ALL {
                ui.selectable_value(unit, one, one.name());
            }
        });
        shown
            .response
            .widget_info(|| egui::WidgetInfo::labeled(egui::Role::ComboBox, true, "unit of files"));
        shown.response
    });
    up_axes(window, ui);
}

/// What points upwards in files of a kind, as it was chosen.
fn up_axes(window: &mut Window, ui: &mut Ui) {
    let mut removed = None;
    if window.preferences.up.is_empty() {
        ui.weak("The up axis is remembered for a kind of file once it is changed: Camera > z points up.");
    }
    for (ending, up) in &mut window.preferences.up {
        let about = "What points upwards in files of this kind.";
        row_of(ui, &format!("up in .{ending}"), about, |ui, _label| {
            let shown = axes(ui, up);
            if ui.button("forget").clicked() {
                removed = Some(ending.clone());
            }
            shown
        });
    }
    if let Some(ending) = removed {
        window.preferences.up.remove(&ending);
    }
}
