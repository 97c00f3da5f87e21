//! The lists of the outliner.

use super::entry::Entry;
use super::{Dragged, drop_line, part};
use crate::document::Mode;
use crate::panels::Selection;
use crate::panels::properties::{facts, light_name};
use crate::theme::Icon;
use crate::views::measuring;
use crate::window::Window;
use eframe::egui::{Context, Id, LayerId, Order, Ui};
use surfelshop_api::UnitKind;
use surfelshop_session::input::environment_map;

/// The clouds that are open.
pub(super) fn clouds(window: &mut Window, ui: &mut Ui) {
    let Some(shown) = &window.document.clouds else {
        ui.weak(if window.document.loader.is_some() { "reading" } else { "none is open" });
        return;
    };
    let all = shown.open_clouds.clone();
    for (i, cloud) in all.all().iter().enumerate() {
        let (name, selection) = (cloud.name(), Selection::Cloud(i));
        let is_pyramid = all.clouds.pyramid_of(&cloud.loaded.cloud).is_some();
        let n = match is_pyramid {
            true => cloud.loaded.summary.n_surfels,
            false => cloud.loaded.cloud.len() as u64,
        };
        let edited = if cloud.recovered { "recovered" } else { "edited" };
        let number = compact(n);
        let entry = Entry {
            note: if cloud.is_unsaved() { edited } else { &number },
            warns: cloud.is_unsaved(),
            about: match cloud.is_unsaved() {
                true => format!("{edited}, not saved\n{}", facts(cloud)),
                false => facts(cloud),
            },
            is_selected: window.selection() == selection,
            eye: Some(cloud.visible),
            ..Entry::new(Icon::Cloud, &name)
        };
        let menu = [
            "zoom-selected",
            "toggle-selected",
            "show-all-clouds",
            "rename-selected",
            "-",
            "compare-clouds",
            "save-cloud",
            "-",
            "remove-selected",
        ];
        let Some(done) = part(window, ui, selection, &entry, &menu) else { continue };
        if done.eye_clicked {
            window.toggle_cloud(i);
        }
        if done.is_activated {
            window.frame_cloud(i);
        }
    }
}

/// A number of surfels with three digits: the properties have all.
fn compact(n: u64) -> String {
    let [thousands, millions] = [n as f64 * 1e-3, n as f64 * 1e-6];
    match n {
        0..1000 => n.to_string(),
        1000..10_000 => format!("{thousands:.1} k"),
        10_000..999_500 => format!("{thousands:.0} k"),
        999_500..9_995_000 => format!("{millions:.2} M"),
        9_995_000..99_950_000 => format!("{millions:.1} M"),
        _ => format!("{millions:.0} M"),
    }
}

/// The lights of the scene, those that are off, and the light around it.
pub(super) fn lights(window: &mut Window, ui: &mut Ui) {
    let lights = window.settings.scene.lights.clone();
    let off = window.settings.lights_off.clone();
    let all = lights.iter().enumerate().map(|(i, light)| (Selection::Light(i), light));
    let all = all.chain(off.iter().enumerate().map(|(i, light)| (Selection::LightOff(i), light)));
    let mut moved = None;
    for (selection, light) in all {
        let name = window.name_of(selection);
        let (icon, kind) = light_name(light);
        let is_on = matches!(selection, Selection::Light(_));
        let entry = Entry {
            note: kind,
            is_selected: window.selection() == selection,
            eye: Some(is_on),
            ..Entry::new(icon, &name)
        };
        let menu =
            ["toggle-selected", "duplicate-selected", "zoom-selected", "-", "remove-selected"];
        let Some(done) = part(window, ui, selection, &entry, &menu) else { continue };
        if done.eye_clicked {
            window.toggle_light(selection);
        }
        if let Selection::Light(i) = selection {
            if done.row.drag_started() {
                done.row.dnd_set_drag_payload(Dragged::Light(i));
            }
            let dropped = drop_line(ui, &done.row, |dragged| matches!(dragged, Dragged::Light(_)));
            if let Some(&Dragged::Light(from)) = dropped.as_deref() {
                moved = Some((from, i));
            }
        }
    }
    if let Some((from, to)) = moved {
        reorder(&mut window.settings.scene.lights, from, to);
        window.select(Selection::Light(to));
    }
    environment(window, ui);
}

fn environment(window: &mut Window, ui: &mut Ui) {
    let source = window.settings.environment.as_ref().map(|known| &known.source);
    let note = match source.map(environment_map::name) {
        None => "none".to_owned(),
        Some(name) => name.rsplit(['/', '\\']).next().unwrap_or_default().to_owned(),
    };
    let entry = Entry {
        note: &note,
        about: "A studio, a sky or a light probe that lights everything from all around."
            .to_owned(),
        is_selected: window.selection() == Selection::Environment,
        ..Entry::new(Icon::Globe, "environment")
    };
    part(window, ui, Selection::Environment, &entry, &["remove-selected"]);
}

/// The camera of the focused view, and those that are remembered.
pub(super) fn cameras(window: &mut Window, ui: &mut Ui) {
    let entry = Entry {
        note: window.camera_mode().name(),
        about: "The camera of the focused view.".to_owned(),
        is_selected: window.selection() == Selection::Camera,
        ..Entry::new(Icon::Video, "camera")
    };
    part(window, ui, Selection::Camera, &entry, &["remember-camera", "frame-all"]);
    let bookmarks = window.settings.bookmarks.clone();
    window.panels.pictures.retain(bookmarks.iter().filter_map(|one| one.picture.as_ref()));
    let mut moved = None;
    for (i, bookmark) in bookmarks.iter().enumerate() {
        let selection = Selection::Bookmark(i);
        let picture = bookmark.picture.as_ref();
        let picture = picture.map(|picture| window.panels.pictures.of(ui.ctx(), picture));
        let entry = Entry {
            picture,
            about:
                "A click looks from there; drag it onto a view, or to another place of the list."
                    .to_owned(),
            is_selected: window.selection() == selection,
            ..Entry::new(Icon::Bookmark, &bookmark.name)
        };
        let menu = ["zoom-selected", "rename-selected", "-", "remove-selected"];
        let Some(done) = part(window, ui, selection, &entry, &menu) else { continue };
        if done.row.clicked() {
            window.go_to_bookmark(i);
        }
        if done.row.drag_started() {
            done.row.dnd_set_drag_payload(Dragged::Bookmark(i));
        }
        let dropped = drop_line(ui, &done.row, |dragged| matches!(dragged, Dragged::Bookmark(_)));
        if let Some(&Dragged::Bookmark(from)) = dropped.as_deref() {
            moved = Some((from, i));
        }
    }
    if let Some((from, to)) = moved {
        reorder(&mut window.settings.bookmarks, from, to);
        window.select(Selection::Bookmark(to));
    }
}

/// What is measured.
pub(super) fn measures(window: &mut Window, ui: &mut Ui) {
    let all = window.settings.measures.clone();
    for (i, measure) in all.iter().enumerate() {
        let (name, selection) = (window.name_of(Selection::Measure(i)), Selection::Measure(i));
        let first = window.quantities_of(measure).into_iter().next();
        let number = first.map(|first| window.units().text(&first)).unwrap_or_default();
        let entry = Entry {
            note: &number,
            about: format!("{}; a double click looks there.", measure.kind.name()),
            is_selected: window.selection() == selection,
            eye: Some(!measure.hidden),
            ..Entry::new(measuring::icon(measure.kind), &name)
        };
        let menu = [
            "zoom-selected",
            "toggle-selected",
            "rename-selected",
            "copy-measure",
            "-",
            "save-measures",
            "-",
            "remove-selected",
        ];
        let Some(done) = part(window, ui, selection, &entry, &menu) else { continue };
        if done.eye_clicked {
            window.toggle_measure(i);
        }
        if done.is_activated {
            window.zoom_to_selected();
        }
    }
}

/// Moves an element to another place.
fn reorder<T>(all: &mut Vec<T>, from: usize, to: usize) {
    if from < all.len() && to < all.len() {
        let one = all.remove(from);
        all.insert(to, one);
    }
}

/// The views.
pub(super) fn views(window: &mut Window, ui: &mut Ui) {
    for pane in window.settings.panes.clone() {
        let is_focused = window.views.focused == pane.id;
        let name = pane.name();
        let (note, about) = match pane.mode {
            Mode::Single => (pane.renderers[0].clone(), format!("drawn by {}", pane.renderers[0])),
            mode => {
                let [first, second] = &pane.renderers;
                (mode.short().to_owned(), format!("{first} and {second}, {}", mode.words()))
            }
        };
        let entry = Entry {
            note: &note,
            about,
            is_selected: is_focused && window.selection() == Selection::View,
            ..Entry::new(if is_focused { Icon::PictureInPicture2 } else { Icon::Square }, &name)
        };
        let menu = [
            "rename-selected",
            "split",
            "split-below",
            "link-view",
            "-",
            "one-renderer",
            "side-by-side",
            "wipe",
            "in-turn",
            "difference",
            "-",
            "close-view",
        ];
        // Only the focused one is renamed.
        let selection = Selection::View;
        if !is_focused {
            let shown = super::entry::show(ui, &entry);
            if shown.row.clicked() || shown.row.secondary_clicked() {
                window.views.focused = pane.id;
                window.select(selection);
            }
            continue;
        }
        part(window, ui, selection, &entry, &menu);
    }
}

/// The renderers, to be dragged onto views.
pub(super) fn renderers(window: &mut Window, ui: &mut Ui) {
    let focused = window.settings.pane(window.views.focused);
    let draws = focused.map(|pane| pane.renderers[..pane.mode.sides()].to_vec());
    let draws = draws.unwrap_or_default();
    for name in window.drawers() {
        let is_tracer = window.plugins.registry.find(UnitKind::Renderer, &name).is_err();
        let note = match (draws.contains(&name), is_tracer) {
            (true, _) => "in use",
            (false, true) => "traces",
            (false, false) => "",
        };
        let entry = Entry {
            note,
            about: format!(
                "{}\n\nA click draws the focused view by it. Drag it onto a view: left to draw it, right to compare.",
                summary(window, &name)
            ),
            ..Entry::new(Icon::Brush, &name)
        };
        let shown = super::entry::show(ui, &entry);
        if shown.row.drag_started() {
            shown.row.dnd_set_drag_payload(Dragged::Renderer(name.clone()));
        }
        if shown.row.dragged() {
            ghost(ui.ctx(), &name);
        }
        if shown.row.clicked() {
            let focused = window.views.focused;
            if let Some(pane) = window.settings.pane_mut(focused) {
                pane.renderers[0] = name;
            }
            window.select(Selection::View);
        }
    }
}

/// What a renderer or tracer is, as its package says.
fn summary(window: &Window, name: &str) -> String {
    let registry = &window.plugins.registry;
    let kinds = [UnitKind::Renderer, UnitKind::Tracer];
    let found = kinds.into_iter().find_map(|kind| {
        let unit = registry.find(kind, name).ok()?;
        let mut units = registry.units(kind);
        units.find(|(_, manifest, u)| manifest.id == unit.package && u.id == unit.id)
    });
    found.map_or_else(String::new, |(_, _, unit)| format!("{}: {}", unit.title, unit.summary))
}

/// The name of what is dragged, beside the pointer.
fn ghost(ctx: &Context, name: &str) {
    let Some(at) = ctx.pointer_interact_pos() else { return };
    let painter = ctx.layer_painter(LayerId::new(Order::Tooltip, Id::unique("dragged")));
    crate::views::caption(
        &painter,
        at + eframe::egui::vec2(8.0, 10.0),
        eframe::egui::Align2::LEFT_TOP,
        name,
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_surfels_are_short() {
        for (n, expected) in [
            (0, "0"),
            (999, "999"),
            (4_594, "4.6 k"),
            (254_456, "254 k"),
            (999_500, "1.00 M"),
            (4_800_000, "4.80 M"),
            (24_200_000, "24.2 M"),
            (8_000_000_000, "8000 M"),
        ] {
            assert_eq!(compact(n), expected);
        }
        let mut all = vec![1, 2, 3, 4];
        reorder(&mut all, 0, 2);
        assert_eq!(all, [2, 3, 1, 4]);
        reorder(&mut all, 9, 0);
        assert_eq!(all, [2, 3, 1, 4]);
    }
}
