//! Menu entries and buttons of commands.

use super::command::{Command, run, shortcuts, why_not};
use super::table::find;
use crate::theme::{Icon, icon_text, iconed, tokens};
use crate::window::Window;
use eframe::egui::{Button, Response, Role, Ui, WidgetInfo, vec2};

/// The words under the pointer: what a command does, its shortcuts, and why it does not apply.
fn about(window: &Window, command: &Command) -> String {
    let own = shortcuts(window, command);
    let keys = match own.is_empty() {
        true => String::new(),
        false => format!("  ({})", own.join(", ")),
    };
    let reason = why_not(window, command).map(|reason| format!("\nNot now: {reason}."));
    format!("{}{keys}\n{}{}", command.name, command.about, reason.unwrap_or_default())
}

fn describe(response: Response, window: &Window, command: &Command) -> Response {
    let is_enabled = response.enabled();
    response.widget_info(|| match command.is_on {
        Some(is_on) => WidgetInfo::selected(Role::Button, is_enabled, is_on(window), command.name),
        None => WidgetInfo::labeled(Role::Button, is_enabled, command.name),
    });
    let text = about(window, command);
    response.on_hover_text(&text).on_disabled_hover_text(text)
}

/// A menu entry. Runs the command where it is clicked.
pub(crate) fn item(window: &mut Window, ui: &mut Ui, command: &'static Command) {
    let shortcut = shortcuts(window, command).into_iter().next().unwrap_or_default();
    // What has two states shows which, in place of its icon.
    let icon = match command.is_on.map(|is_on| is_on(window)) {
        None => command.icon,
        Some(true) => Icon::SquareCheck,
        Some(false) => Icon::Square,
    };
    let button = Button::new(iconed(ui, icon, command.name)).shortcut_text(shortcut);
    let response = ui.add_enabled(why_not(window, command).is_none(), button);
    if describe(response, window, command).clicked() {
        ui.close();
        run(window, &ui.ctx().clone(), command);
    }
}

/// A button of the toolbar. Runs the command where it is clicked.
pub(crate) fn icon_button(window: &mut Window, ui: &mut Ui, id: &str) {
    let Some(command) = find(id) else { return };
    let is_on = command.is_on.is_some_and(|is_on| is_on(window));
    let response = add_icon(ui, command.icon, is_on, why_not(window, command).is_none());
    if describe(response, window, command).clicked() {
        run(window, &ui.ctx().clone(), command);
    }
}

fn add_icon(ui: &mut Ui, icon: Icon, is_on: bool, is_enabled: bool) -> Response {
    let tokens = tokens(ui);
    let mut text = icon_text(icon).size(16.0);
    if is_on && is_enabled {
        text = text.color(tokens.link);
    }
    let button = Button::new(text).min_size(vec2(28.0, 26.0)).frame_when_inactive(is_on);
    ui.add_enabled(is_enabled, button)
}
