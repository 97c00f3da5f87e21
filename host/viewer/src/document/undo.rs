//! Steps of the history are undone and redone.

use super::history::Snapshot;
use crate::views::layout;
use crate::window::Window;

/// Undoes a step.
pub(crate) fn undo(window: &mut Window) {
    let snapshot = window.document.history.undo(&window.snapshot());
    restore(window, snapshot);
}

/// Redoes a step.
pub(crate) fn redo(window: &mut Window) {
    let snapshot = window.document.history.redo(&window.snapshot());
    restore(window, snapshot);
}

fn restore(window: &mut Window, snapshot: Option<Snapshot>) {
    let Some(Snapshot { settings, up, open_clouds }) = snapshot else { return };
    window.messages.dismiss_reports();
    window.settings = settings;
    layout::follow_settings(window);
    if let Some(open_clouds) = open_clouds {
        window.show_clouds(open_clouds);
    }
    if window.document.up != up {
        window.turn_up(up);
    }
}
