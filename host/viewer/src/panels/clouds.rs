//! The panel of the open clouds.

use super::parameters;
use super::row::row_of;
use crate::document::OpenCloud;
use crate::window::Window;
use eframe::egui::{self, RichText, Role, Ui, WidgetInfo};
use std::collections::HashMap;
use std::path::PathBuf;
use surfelshop_api::UnitKind;
use surfelshop_api::params::{ParamDecl, ParamKind, Values};
use surfelshop_cloud::Loaded;
use surfelshop_cloud::scene::CloudRenderer;
use surfelshop_runtime::plugins::Registry;
use surfelshop_session::input::plausibility;
use surfelshop_session::input::scenes::NamedRenderer;
use surfelshop_session::output::provenance;

/// Shows the panel.
pub(super) fn show(window: &mut Window, ui: &mut Ui) {
    uploading(window, ui);
    let Some(shown) = &window.document.clouds else {
        ui.weak(if window.document.loader.is_some() { "reading" } else { "none is open" });
        return;
    };
    let (mut changed, mut framed) = (None, None);
    for (i, open_cloud) in shown.open_clouds.all().iter().enumerate() {
        let Loaded { cloud, summary } = &open_cloud.loaded;
        // The scene may name it.
        let entry =
            open_cloud.entry.and_then(|i| window.document.scene_file.as_ref()?.clouds.get(i));
        let name = entry.and_then(|entry| entry.name.clone()).unwrap_or_else(|| open_cloud.name());
        let mut visible = open_cloud.visible;
        let about = std::iter::once(summary.to_string()).chain(provenance::lines(cloud));
        let name = RichText::new(name).strong();
        // A single cloud cannot be hidden.
        match shown.open_clouds.all().len() == 1 && visible {
            true => ui.label(name),
            false => ui.checkbox(&mut visible, name),
        }
        .on_hover_text(about.collect::<Vec<_>>().join("\n"));
        if visible != open_cloud.visible {
            changed = Some(shown.open_clouds.showing(i, visible));
        }
        if shown.open_clouds.all().len() > 1 && !cloud.is_empty() {
            let zoom = ui
                .small_button("zoom to it")
                .on_hover_text("Moves the camera to where this cloud fills the view.");
            framed = zoom.clicked().then_some(i).or(framed);
        }
        let renderer = renderer_of(ui, (i, open_cloud), &window.plugins.registry)
            .or_else(|| values_of(ui, (i, open_cloud), &window.plugins.declared).map(Some));
        if let Some(renderer) = renderer {
            changed = Some(shown.open_clouds.drawn_by(i, renderer));
        }
        let is_pyramid = shown.open_clouds.clouds.pyramid_of(cloud).is_some();
        facts_of(ui, open_cloud, is_pyramid);
    }
    if let Some(line) = plausibility::far_apart(&shown.clouds) {
        ui.colored_label(ui.visuals().warn_fg_color, format!("{line}. Zoom to one of them."));
    }
    let facts = &shown.open_clouds.clouds.facts;
    let size = facts.bounds_max - facts.bounds_min;
    if size.max_element() < 1e6 && size.max_element() > 1e-3 {
        ui.label(format!("size {:.4} x {:.4} x {:.4}", size.x, size.y, size.z));
    } else {
        ui.label(format!("size {:.3e} x {:.3e} x {:.3e}", size.x, size.y, size.z));
    }
    ui.weak(facts.columns.join(", "));
    if let Some(open_clouds) = changed {
        window.show_clouds(open_clouds);
    }
    if let Some(i) = framed {
        window.frame_cloud(i);
    }
}

/// The choice of what draws a cloud; the renderer that was chosen, none for that of the view.
fn renderer_of(
    ui: &mut Ui,
    (index, open_cloud): (usize, &OpenCloud),
    registry: &Registry,
) -> Option<Option<NamedRenderer>> {
    const AS_THE_VIEW: &str = "as the view";
    let own = open_cloud.renderer.as_ref().map(|named| named.renderer.name.as_str());
    let facts = open_cloud.loaded.cloud.facts();
    let suits = |name: &String| registry.suits(name, &facts.clouds);
    let mut chosen = None;
    let name = open_cloud.name();
    row_of(ui, "renderer", "", |ui, _label| {
        let menu = egui::ComboBox::from_id_salt(("renderer of a cloud", index)).width(150.0);
        let shown = menu.selected_text(own.unwrap_or(AS_THE_VIEW)).show_ui(ui, |ui| {
            if ui.selectable_label(own.is_none(), AS_THE_VIEW).clicked() && own.is_some() {
                chosen = Some(None);
            }
            for known in registry.names(UnitKind::Renderer).into_iter().filter(suits) {
                let is_own = own == Some(known.as_str());
                if ui.selectable_label(is_own, &known).clicked() && !is_own {
                    let renderer = CloudRenderer { name: known, values: Values::new() };
                    let (place, folder) = (name.clone(), PathBuf::new());
                    chosen = Some(Some(NamedRenderer { renderer, place, folder }));
                }
            }
        });
        let what = format!("renderer of {name}");
        let is_enabled = shown.response.enabled();
        shown.response.widget_info(|| WidgetInfo::labeled(Role::ComboBox, is_enabled, &what));
        shown
            .response
            .on_hover_text("What draws this cloud, where others are drawn by the view's renderer.")
    });
    chosen
}

/// The parameters of a renderer that draws one cloud; the renderer with those that were changed, once the pointer lets
/// go: each change is a step to undo, and pictures are drawn anew.
fn values_of(
    ui: &mut Ui,
    (index, open_cloud): (usize, &OpenCloud),
    declared: &HashMap<String, Vec<ParamDecl>>,
) -> Option<NamedRenderer> {
    let named = open_cloud.renderer.as_ref()?;
    let renderer = &named.renderer;
    // Paths of files stand in the scene file.
    let is_shown = |parameter: &&ParamDecl| !matches!(parameter.kind, ParamKind::File { .. });
    let declared: Vec<ParamDecl> =
        declared.get(&renderer.name)?.iter().filter(is_shown).cloned().collect();
    let id = ui.scope_id().with(("values of a cloud", index));
    let mut values: Values =
        ui.data(|data| data.get_temp(id)).unwrap_or_else(|| renderer.values.clone());
    let title = format!("{} of {}", renderer.name, open_cloud.name());
    egui::CollapsingHeader::new(title).id_salt(id).show(ui, |ui| {
        parameters::show(ui, &declared, &mut values);
    });
    if values == renderer.values {
        return None;
    }
    if ui.input(|input| input.pointer.any_down()) {
        ui.data_mut(|data| data.insert_temp(id, values));
        return None;
    }
    ui.data_mut(|data| data.remove::<Values>(id));
    let renderer = CloudRenderer { values, ..renderer.clone() };
    Some(NamedRenderer { renderer, ..named.clone() })
}

/// The progress of uploading.
fn uploading(window: &Window, ui: &mut Ui) {
    if let Some(fraction) = window.render.upload_progress {
        ui.label("Uploading surfels; some of them are shown.");
        ui.add(egui::ProgressBar::new(fraction).show_percentage());
    }
}

/// The size and state of a cloud, and what reading changed in it.
fn facts_of(ui: &mut Ui, open_cloud: &OpenCloud, is_pyramid: bool) {
    let Loaded { cloud, summary } = &open_cloud.loaded;
    ui.label(match cloud.len() as u64 {
        _ if is_pyramid => format!("{} surfels, in a pyramid", grouped(summary.n_surfels)),
        0 => "no points".to_owned(),
        1 => "1 surfel".to_owned(),
        n => format!("{} surfels", grouped(n)),
    });
    if open_cloud.is_unsaved() {
        let text = if open_cloud.recovered { "recovered, not saved" } else { "edited, not saved" };
        ui.colored_label(ui.visuals().warn_fg_color, text)
            .on_hover_text("File > Save cloud as … writes it with all its columns");
    }
    // In the words of `info`.
    let done = [
        (summary.n_dropped - summary.n_too_large, "dropped: not finite"),
        (summary.n_too_large, "dropped: coordinates above 8.5e37"),
        (summary.normals.estimated + summary.normals.repaired, "normals estimated"),
        (summary.radii.estimated, "radii estimated"),
        (summary.radii.clamped, "radii shortened"),
    ];
    for (number, what) in done.into_iter().filter(|(number, _)| *number > 0) {
        ui.weak(format!("{} {what}", grouped(number)));
    }
    for warning in &summary.warnings {
        ui.colored_label(ui.visuals().warn_fg_color, warning);
    }
}

/// A number with spaces between groups of three digits.
pub(super) fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut grouped = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            grouped.push(' ');
        }
        grouped.push(digit);
    }
    grouped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_grouped_by_three_digits() {
        for (number, expected) in [(0, "0"), (999, "999"), (1000, "1 000"), (1234567, "1 234 567")]
        {
            assert_eq!(grouped(number), expected);
        }
    }
}
