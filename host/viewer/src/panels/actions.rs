//! Actions that menus and keys share.

use crate::views::navigation;
use crate::window::Window;

/// Changes the projection of the focused view.
pub(super) fn toggle_projection(window: &mut Window) {
    let mut camera = window.camera_of(window.views.focused);
    navigation::toggle_projection(&mut camera, 35f64.to_radians());
    window.set_camera(window.views.focused, camera);
}

/// Opens or closes the panel of measurements.
pub(super) fn toggle_measure(window: &mut Window) {
    window.measure.form.open = !window.measure.form.open;
}

/// Shows the next renderer in the focused view.
pub(super) fn next_renderer(window: &mut Window) {
    let names = window.renderers();
    if let Some(pane) = window.settings.pane_mut(window.views.focused) {
        let at = names.iter().position(|name| *name == pane.renderers[0]).map_or(0, |at| at + 1);
        // Beside another one, that one is passed over where there is a third.
        let beside = |name: &str| pane.mode.sides() == 2 && name == pane.renderers[1];
        let after = names.iter().cycle().skip(at).take(names.len());
        if let Some(name) = after.clone().find(|name| !beside(name)).or(after.clone().next()) {
            let name = name.clone();
            pane.renderers[0] = name;
        }
    }
}
