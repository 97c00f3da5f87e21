//! File dialogs, which the system shows on threads of their own.

use super::surroundings;
use super::window::Window;
use eframe::egui::{Context, Ui};
use std::path::Path;
use std::sync::mpsc::{TryRecvError, channel};
use surfelshop_api::params::{ParamDecl, ParamKind, Value};

/// What a file dialog is for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Asked {
    /// Clouds or a scene to look at.
    Open,
    /// A scene to write.
    SaveScene,
    /// One of the clouds to write.
    SaveCloud(usize),
    /// Pictures to write.
    Pictures,
    /// A light probe.
    Probe,
    /// A picture to measure against.
    Reference,
    /// The file of a parameter.
    Value { whose: Whose, id: String, endings: Vec<String> },
}

/// Whose parameter a file is for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Whose {
    /// A renderer's in a view.
    Renderer { pane: u32, renderer: String },
    /// A tool's.
    Tool(String),
    /// That of a tracer that is measured against.
    Tracer(String),
}

/// Asks for the file of a parameter.
pub(crate) fn value_dialog(
    window: &mut Window,
    ctx: &Context,
    whose: Whose,
    parameter: &ParamDecl,
) {
    let ParamKind::File { endings } = &parameter.kind else { return };
    let (id, endings) = (parameter.id.clone(), endings.clone());
    dialog(window, ctx, Asked::Value { whose, id, endings });
}

/// Sets a parameter to a path.
fn put_value(window: &mut Window, whose: &Whose, id: &str, path: &Path) {
    let values = match whose {
        Whose::Renderer { pane, renderer } => {
            let pane = window.settings.pane_mut(*pane);
            pane.map(|pane| pane.values.entry(renderer.clone()).or_default())
        }
        Whose::Tool(tool) => Some(window.tools.values.entry(tool.clone()).or_default()),
        Whose::Tracer(tracer) => {
            Some(window.measure.form.tracer_values.entry(tracer.clone()).or_default())
        }
    };
    if let Some(values) = values {
        values.insert(id.to_owned(), Value::Text(path.display().to_string()));
    }
}

/// Asks for files on a thread of its own, since the system's dialog waits.
pub(crate) fn dialog(window: &mut Window, ctx: &Context, asked: Asked) {
    if window.dialog.is_some() {
        return;
    }
    let (send, receive) = channel();
    let wake = ctx.clone();
    let what = asked.clone();
    let thread = std::thread::Builder::new().name("dialog".to_owned()).spawn(move || {
        let dialog = rfd::FileDialog::new();
        let files = match what {
            Asked::Open => dialog
                .set_title("Open clouds or a scene")
                .add_filter("clouds and scenes", &["ply", "obj", "off", "toml", "hdr", "exr"])
                .pick_files(),
            Asked::SaveScene => dialog
                .set_title("Save the scene")
                .set_file_name("surfelshop.scene.toml")
                .save_file()
                .map(|file| vec![file]),
            Asked::SaveCloud(_) => dialog
                .set_title("Save the cloud")
                .set_file_name("cloud.ply")
                .add_filter("clouds", &["ply"])
                .save_file()
                .map(|file| vec![file]),
            Asked::Pictures => dialog
                .set_title("Save pictures")
                .set_file_name("surfelshop.png")
                .add_filter("pictures", &["png", "exr"])
                .save_file()
                .map(|file| vec![file]),
            Asked::Probe => dialog
                .set_title("Open a light probe")
                .add_filter("light probes", &["hdr", "exr"])
                .pick_file()
                .map(|file| vec![file]),
            Asked::Reference => dialog
                .set_title("Choose a picture to measure against")
                .add_filter("pictures of linear radiance", &["exr"])
                .pick_file()
                .map(|file| vec![file]),
            Asked::Value { id, endings, .. } => {
                let dialog = dialog.set_title(format!("Choose a file for {id}"));
                let dialog = match endings.is_empty() {
                    true => dialog,
                    false => dialog.add_filter(endings.join(", "), &endings),
                };
                dialog.pick_file().map(|file| vec![file])
            }
        };
        // The window may be gone already.
        drop(send.send(files));
        wake.request_repaint();
    });
    match thread {
        Ok(_) => window.dialog = Some((asked, receive)),
        Err(error) => window.messages.warn(format!("no dialog could be opened: {error}")),
    }
}

pub(crate) fn open_dialog(window: &mut Window, ctx: &Context) {
    dialog(window, ctx, Asked::Open);
}

pub(crate) fn scene_dialog(window: &mut Window, ctx: &Context) {
    dialog(window, ctx, Asked::SaveScene);
}

/// Saves the scene where it came from, or asks where to.
pub(crate) fn save_scene(window: &mut Window, ctx: &Context) {
    match window.scene_path.clone() {
        Some(path) => window.save_scene(&path),
        None => scene_dialog(window, ctx),
    }
}

/// Takes the files chosen in a dialog.
pub(crate) fn take_dialog(window: &mut Window, ctx: &Context) {
    let Some((asked, dialog)) = &window.dialog else { return };
    let asked = asked.clone();
    match dialog.try_recv() {
        Ok(chosen) => {
            window.dialog = None;
            let chosen = chosen.unwrap_or_default();
            match (asked, chosen.first()) {
                (_, None) => {}
                (Asked::Open, _) => window.open(ctx, chosen),
                (Asked::SaveScene, Some(path)) => {
                    // Under another name it could not be opened as a scene.
                    let named = match surfelshop_cloud::scene::is_scene(path) {
                        true => path.clone(),
                        false => path.with_added_extension("scene.toml"),
                    };
                    window.save_scene(&named);
                }
                (Asked::SaveCloud(item), Some(path)) => window.save_cloud(ctx, item, path),
                (Asked::Probe, Some(path)) => surroundings::put(window, path),
                (Asked::Reference, Some(path)) => {
                    window.measure.form.path = path.display().to_string();
                }
                (Asked::Value { whose, id, .. }, Some(path)) => {
                    put_value(window, &whose, &id, path);
                }
                (Asked::Pictures, Some(path)) => {
                    window.export_window.path = path.display().to_string();
                }
            }
        }
        Err(TryRecvError::Disconnected) => window.dialog = None,
        Err(TryRecvError::Empty) => {}
    }
}

/// Asks where to write one of the clouds: which, where there are several.
pub(crate) fn save_cloud(window: &mut Window, ui: &mut Ui, ctx: &Context) {
    let items = window.shown.iter().flat_map(|shown| shown.stock.items());
    let names: Vec<String> = items.map(|item| item.name()).collect();
    let mut chosen = None;
    match names.len() {
        0 => {}
        1 => chosen = ui.button("Save cloud as …").clicked().then_some(0),
        _ => drop(ui.menu_button("Save cloud as …", |ui| {
            for (i, name) in names.iter().enumerate() {
                if ui.button(name).clicked() {
                    chosen = Some(i);
                }
            }
        })),
    }
    if let Some(item) = chosen {
        ui.close();
        dialog(window, ctx, Asked::SaveCloud(item));
    }
}
