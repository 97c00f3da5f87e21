//! The title of the window: what is open, and whether edits of it are in no file.

use crate::window::Window;
use eframe::egui::{Context, Id, ViewportCommand};

/// Sends the title where it has changed.
pub(crate) fn update(window: &Window, ctx: &Context) {
    let title = title(window);
    let id = Id::unique("title of the window");
    if ctx.data(|data| data.get_temp::<String>(id)).as_ref() != Some(&title) {
        ctx.send_viewport_cmd(ViewportCommand::Title(title.clone()));
        ctx.data_mut(|data| data.insert_temp(id, title));
    }
}

fn title(window: &Window) -> String {
    const PROGRAM: &str = "Surfelshop";
    let document = &window.document;
    let scene = document.scene_path.as_ref().and_then(|path| path.file_name());
    let mut clouds = document.clouds.iter().flat_map(|shown| shown.open_clouds.all());
    let first = clouds.next().map(|cloud| cloud.name());
    let name = scene.map(|name| name.to_string_lossy().into_owned()).or(first);
    let mark = if window.has_unsaved() { "• " } else { "" };
    name.map_or(PROGRAM.to_owned(), |name| format!("{mark}{name} - {PROGRAM}"))
}
