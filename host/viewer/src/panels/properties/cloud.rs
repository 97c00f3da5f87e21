//! The properties of a cloud.

use super::command_button;
use super::row_of;
use crate::document::OpenCloud;
use crate::panels::parameters;
use crate::window::Window;
use eframe::egui::{self, Label, RichText, Role, Ui, WidgetInfo};
use std::collections::HashMap;
use std::path::PathBuf;
use surfelshop_api::UnitKind;
use surfelshop_api::params::{ParamDecl, ParamKind, Values};
use surfelshop_cloud::display::length_unit;
use surfelshop_cloud::scene::CloudRenderer;
use surfelshop_cloud::{Loaded, in_groups};
use surfelshop_runtime::plugins::Registry;
use surfelshop_session::input::plausibility;
use surfelshop_session::input::scenes::NamedRenderer;
use surfelshop_session::output::provenance;

/// Shows a cloud.
pub(super) fn show(window: &mut Window, ui: &mut Ui, index: usize) {
    uploading(window, ui);
    let Some(shown) = &window.document.clouds else { return };
    let Some(open_cloud) = shown.open_clouds.all().get(index) else { return };
    let cloud = &open_cloud.loaded.cloud;
    let mut changed = None;
    let renderer = renderer_of(ui, (index, open_cloud), &window.plugins.registry)
        .or_else(|| values_of(ui, (index, open_cloud), &window.plugins.declared).map(Some));
    if let Some(renderer) = renderer {
        changed = Some(shown.open_clouds.drawn_by(index, renderer));
    }
    let is_pyramid = shown.open_clouds.clouds.pyramid_of(cloud).is_some();
    facts_of(ui, open_cloud, is_pyramid);
    if let Some(line) = plausibility::far_apart(&shown.clouds) {
        let line = format!("{line}. Zoom to one of them.");
        let text = RichText::new(line).color(ui.visuals().warn_fg_color);
        ui.add(Label::new(text).wrap());
    }
    if let Some(open_clouds) = changed {
        window.show_clouds(open_clouds);
    }
    ui.horizontal_wrapped(|ui| {
        command_button(window, ui, "zoom-selected", "zoom to it");
        command_button(window, ui, "save-cloud", "save as …");
        command_button(window, ui, "remove-selected", "remove");
    });
}

/// What is known of a cloud, in lines.
pub(in crate::panels) fn facts(open_cloud: &OpenCloud) -> String {
    let Loaded { cloud, summary } = &open_cloud.loaded;
    let lines = std::iter::once(summary.to_string()).chain(provenance::lines(cloud));
    lines.collect::<Vec<_>>().join("\n")
}

/// A fact: its name in the column of labels, and what it is.
fn fact(ui: &mut Ui, name: &str, about: &str, what: &str) {
    row_of(ui, name, about, |ui, _label| ui.add(Label::new(what).wrap()));
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
    row_of(ui, "drawn by", "", |ui, _label| {
        let menu = egui::ComboBox::from_id_salt(("renderer of a cloud", index)).truncate();
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
    let number = match cloud.len() as u64 {
        _ if is_pyramid => format!("{}, in a pyramid", in_groups(summary.n_surfels)),
        n => in_groups(n),
    };
    fact(ui, "surfels", "Oriented discs, one for each point.", &number);
    let facts = cloud.facts();
    let size = facts.bounds_max - facts.bounds_min;
    if !cloud.is_empty() {
        let digits = |size: f64| match size {
            size if (1e-3..1e6).contains(&size) => format!("{size:.3}"),
            size => format!("{size:.3e}"),
        };
        let text = size.to_array().map(digits).join(" x ");
        let unit = length_unit(&[cloud]).map(|unit| format!(" {unit}")).unwrap_or_default();
        fact(ui, "size", "Along x, y and z, in the file's units.", &format!("{text}{unit}"));
        // As the scale bar and measures tell it.
        if let Some(metres) = cloud.source().metres().filter(|metres| (metres - 1.0).abs() > 1e-6) {
            let text = (metres * size).to_array().map(digits).join(" x ");
            fact(ui, "size in metres", "Along x, y and z.", &format!("{text} m"));
        }
    }
    let columns = cloud.columns().iter().map(|column| column.name()).collect::<Vec<_>>();
    fact(ui, "columns", "What is known of each surfel.", &columns.join(", "));
    fact(ui, "file", "", &summary.file);
    if open_cloud.is_unsaved() {
        let text = if open_cloud.recovered { "recovered, not saved" } else { "edited, not saved" };
        row_of(ui, "state", "File > Save cloud as … writes it with all its columns.", |ui, _| {
            ui.colored_label(ui.visuals().warn_fg_color, text)
        });
    }
    // In the words of `info`.
    let done = [
        (summary.n_dropped - summary.n_too_large, "dropped: not finite"),
        (summary.n_too_large, "dropped: coordinates above 8.5e37"),
        (summary.normals.estimated + summary.normals.repaired, "normals estimated"),
        (summary.normals.towards_scanner, "of them face the scanner"),
        (summary.normals.towards_free_space, "of them face free space"),
        (summary.normals.of_unsure_side, "of them of uncertain side"),
        (summary.normals.turned, "of them flipped for it"),
        (summary.radii.estimated, "radii estimated"),
        (summary.radii.clamped, "radii shortened"),
    ];
    for (number, what) in done.into_iter().filter(|(number, _)| *number > 0) {
        ui.weak(format!("{} {what}", in_groups(number)));
    }
    for warning in &summary.warnings {
        let text = RichText::new(warning).color(ui.visuals().warn_fg_color);
        ui.add(Label::new(text).wrap());
    }
}
