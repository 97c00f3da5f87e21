//! The windows and questions over the views.

use super::{about, manual};
use crate::commands;
use crate::dialogs::{recovery, unsaved};
use crate::document::recovery::Recovery;
use crate::export;
use crate::plugins::{crash, plugin_list, tool_window, trust};
use crate::preferences;
use crate::window::Window;
use eframe::egui::{self, Align2, Context};

/// Shows the windows that are open, and one question at a time.
pub(crate) fn show(window: &mut Window, ctx: &Context) {
    export::window::show(window, ctx);
    tool_window::show(window, ctx);
    crash::show(window, ctx);
    unsaved::show(window, ctx);
    let has_crash = window.plugins.crash.is_some();
    match !has_crash && window.document.recovery.as_ref().is_some_and(Recovery::asks) {
        true => recovery::show(window, ctx),
        false => trust::show(window, ctx),
    }
    window.messages.show_all(ctx);
    let mut open = window.panels.plugin_list;
    let plugins = egui::Window::new("Plugins").open(&mut open).default_width(1100.0);
    let plugins = plugins.pivot(Align2::CENTER_CENTER).default_pos(ctx.content_rect().center());
    plugins.show(ctx, |ui| plugin_list::show(window, ui));
    window.panels.plugin_list = open;
    manual::show(&mut window.panels.manual, ctx);
    commands::show_help(window, ctx);
    preferences::window::show(window, ctx);
    about::show(window, ctx);
    commands::show_palette(window, ctx);
}
