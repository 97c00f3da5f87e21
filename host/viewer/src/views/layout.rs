//! Panes are split, closed, and brought in line with the settings.

use super::arrangement;
use super::pane::Pane;
use crate::document::PaneSettings;
use crate::render_thread::ViewSlot;
use crate::window::Window;
use eframe::egui;
use egui_tiles::{TileId, Tree};
use surfelshop_api::Camera;

/// Most panes at once.
pub(crate) const MOST_PANES: usize = 4;

fn tile_of(tree: &Tree<u32>, pane: u32) -> Option<TileId> {
    tree.tiles.find_pane(&pane)
}

/// Puts a pane with the same settings beside one, or below it; all others stay where they are.
pub(crate) fn split(window: &mut Window, tree: &mut Tree<u32>, pane: u32, below: bool) {
    let Some(settings) = window.settings.pane(pane).cloned() else { return };
    if window.settings.panes.len() >= MOST_PANES {
        window.messages.warn(format!("there are at most {MOST_PANES} panes"));
        return;
    }
    window.views.framed = framed(window);
    let id = window.settings.free_id();
    window.settings.panes.push(PaneSettings { id, title: String::new(), ..settings });
    window.views.panes.insert(id, Pane::new());
    if let Some(camera) = window.views.own_cameras.get(&pane).copied() {
        window.views.own_cameras.insert(id, camera);
    }
    let panes = window.settings.pane_ids();
    // A high one is halved across, so that no view becomes a strip.
    let [width, height] = window.views.panes.get(&pane).map_or([1, 0], |pane| pane.size_px);
    let beside = arrangement::beside(tree, &panes, (pane, id), below || width < height);
    *tree = beside.unwrap_or_else(|| arrangement::default_tree(&panes));
    window.views.focused = id;
}

/// The shared camera where it sees everything, and nobody has moved it.
fn framed(window: &Window) -> Option<Camera> {
    let shown = window.document.clouds.as_ref()?;
    let camera = window.views.camera;
    (window.framing(&shown.extent) == camera).then_some(camera)
}

/// Moves a camera that saw everything back to where it does, once all panes have their sizes.
pub(super) fn keep_framing(window: &mut Window) {
    let has_size = |pane: &Pane| !pane.size_px.contains(&0);
    if window.views.framed.is_none() || !window.views.panes.values().all(has_size) {
        return;
    }
    let is_still = window.views.framed.take() == Some(window.views.camera);
    if let Some(shown) = window.document.clouds.as_ref().filter(|_| is_still) {
        window.views.camera = window.framing(&shown.extent);
    }
}

/// Splits the focused pane.
pub(crate) fn split_focused(window: &mut Window, below: bool) {
    let mut tree = take_tree(window);
    split(window, &mut tree, window.views.focused, below);
    window.views.tree = tree;
}

/// Closes the focused pane, unless it is the only one.
pub(crate) fn close_focused(window: &mut Window) {
    let mut tree = take_tree(window);
    close(window, &mut tree, window.views.focused);
    window.views.tree = tree;
}

/// Takes the tree out of the window while the window is changed.
pub(crate) fn take_tree(window: &mut Window) -> Tree<u32> {
    std::mem::replace(&mut window.views.tree, Tree::empty(egui::Id::unique("panes")))
}

/// Replaces the tree by the default one.
fn arrange(window: &Window, tree: &mut Tree<u32>) {
    *tree = arrangement::default_tree(&window.settings.pane_ids());
}

/// Closes a pane, unless it is the only one.
pub(crate) fn close(window: &mut Window, tree: &mut Tree<u32>, pane: u32) {
    if window.settings.panes.len() < 2 {
        return;
    }
    if let Some(tile) = tile_of(tree, pane) {
        tree.remove_recursively(tile);
    }
    window.settings.panes.retain(|settings| settings.id != pane);
    // The pane's camera stays for an undo.
    window.views.panes.remove(&pane);
    release(window, pane);
    if window.views.focused == pane {
        window.views.focused = window.settings.panes[0].id;
    }
}

/// Releases the renderers of a pane.
fn release(window: &Window, pane: u32) {
    for side in 0..2 {
        window.render.thread.release(ViewSlot { pane, side });
    }
}

/// Brings panes and tiles in line with the settings, after an undo or with a new scene.
pub(crate) fn follow_settings(window: &mut Window) {
    let mut tree = take_tree(window);
    let known: Vec<u32> = window.views.panes.keys().copied().collect();
    for pane in known {
        if window.settings.pane(pane).is_none() {
            if let Some(tile) = tile_of(&tree, pane) {
                tree.remove_recursively(tile);
            }
            window.views.panes.remove(&pane);
            release(window, pane);
        }
    }
    let mut added = false;
    for id in window.settings.pane_ids() {
        if let std::collections::btree_map::Entry::Vacant(missing) = window.views.panes.entry(id) {
            missing.insert(Pane::new());
            added = true;
        }
    }
    if added {
        arrange(window, &mut tree);
    }
    if window.settings.pane(window.views.focused).is_none() {
        window.views.focused = window.settings.panes.first().map_or(0, |pane| pane.id);
    }
    window.views.tree = tree;
}
