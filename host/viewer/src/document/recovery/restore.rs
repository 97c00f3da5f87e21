//! Edits of an earlier session are read again.

use super::session::{OrphanSession, RECOVERED_SCENE};
use crate::document::open::file_loader::{FileLoader, LoadedFiles};
use crate::document::open_clouds::OpenClouds;
use crate::window::Window;
use eframe::egui::Context;
use std::path::PathBuf;
use surfelshop_cloud::scene::{self, SceneFile};

/// Starts to read the edits of a session.
pub(crate) fn restore(window: &mut Window, ctx: &Context, session: OrphanSession) {
    let later = "; the edits are kept, and the next start offers them again";
    let path = match prepare(window, &session) {
        Ok(path) => path,
        Err(error) => return window.messages.warn(format!("{error:#}{later}")),
    };
    let wake = ctx.clone();
    let (formats, up) = (window.plugins.formats(), window.document.typed_up);
    match FileLoader::start(vec![path], false, (formats, up), move || wake.request_repaint()) {
        Ok(loader) => {
            window.document.loader = Some(loader);
            if let Some(recovery) = &mut window.document.recovery {
                recovery.reading = Some(session);
            }
        }
        Err(error) => window.messages.warn(format!("nothing can be read: {error}{later}")),
    }
}

/// Writes the scene to be read: the session's, without clouds whose files are gone.
fn prepare(window: &mut Window, session: &OrphanSession) -> anyhow::Result<PathBuf> {
    let folder = &session.session.folder;
    let mut file = scene::read(folder.join(&session.manifest.shown))?.scene;
    for i in 0..file.clouds.len() {
        let path = file.path_of(&file.clouds[i]);
        if file.clouds[i].visible && !path.exists() {
            file.clouds[i].visible = false;
            window.messages.warn(format!("{}: left out, there is no such file", path.display()));
        }
    }
    let path = folder.join(RECOVERED_SCENE);
    file.write(&path)?;
    Ok(path)
}

/// The recovered clouds, their scene and its path. The session stays on disk until the journal holds
/// its edits.
pub(crate) fn restored_clouds(
    window: &mut Window,
    session: OrphanSession,
    loaded: LoadedFiles,
) -> Option<(OpenClouds, SceneFile, Option<PathBuf>)> {
    let LoadedFiles { clouds, scene, entries, .. } = loaded;
    let mut file = scene?.scene;
    match scene::read(session.session.folder.join(&session.manifest.opened)) {
        Ok(opened) => {
            // Absolute paths, since the session's folder will be removed.
            let absolute = |path: PathBuf| std::path::absolute(&path).unwrap_or(path);
            let clouds = opened.scene.clouds.iter().map(|cloud| {
                let mut cloud = cloud.clone();
                cloud.layer = opened.scene.path_of_layer(&cloud).map(absolute);
                cloud.path = absolute(opened.scene.path_of(&cloud));
                cloud
            });
            (file.clouds, file.folder) = (clouds.collect(), PathBuf::new());
        }
        Err(error) => {
            window.messages.warn(error.to_string());
            return None;
        }
    }
    let open_clouds =
        OpenClouds::recovered(clouds, &entries, &session.manifest.clouds, file.clouds.len());
    let names = session.manifest.names().join(", ");
    window.messages.report(format!("recovered {names}, not saved yet"));
    let scene = session.manifest.scene.clone();
    if let Some(recovery) = &window.document.recovery {
        recovery.journal.adopt(session);
    }
    Some((open_clouds, file, scene))
}
