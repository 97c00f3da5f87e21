//! The journal follows the open clouds.

use super::journal::{EditedCloud, JournalEnd, JournalTarget};
use super::session::{CloudRow, RECOVERED_SCENE};
use crate::document::open_clouds::{OpenCloud, OpenClouds};
use crate::document::scene_file::{self, placement};
use crate::window::Window;
use eframe::egui::Context;
use std::path::PathBuf;
use surfelshop_cloud::display::unhidden;
use surfelshop_cloud::scene::{SceneCloud, SceneFile};

/// Updates the journal, where clouds or scene changed since the last call.
pub(crate) fn update(window: &mut Window, ctx: &Context) {
    let Some(recovery) = &mut window.document.recovery else { return };
    for fault in recovery.journal.faults() {
        window.messages.warn(fault);
    }
    // A preview is no document.
    let shown = window.document.clouds.as_ref().filter(|_| window.document.preview.is_none());
    let Some(shown) = shown else { return };
    let is_same = |(open_clouds, scene): &(OpenClouds, Option<PathBuf>)| {
        open_clouds.is_same(&shown.open_clouds) && *scene == window.document.scene_path
    };
    if recovery.last.as_ref().is_some_and(is_same) {
        return;
    }
    recovery.last = Some((shown.open_clouds.clone(), window.document.scene_path.clone()));
    let open_clouds = shown.open_clouds.clone();
    let target = target(window, &open_clouds);
    let wake = ctx.clone();
    if let Some(recovery) = &mut window.document.recovery {
        recovery.journal.update(target, move || wake.request_repaint());
    }
}

/// What the journal has to hold of these clouds.
fn target(window: &Window, open_clouds: &OpenClouds) -> JournalTarget {
    let is_edited = open_clouds.all().iter().any(OpenCloud::is_unsaved);
    if !is_edited {
        return JournalTarget::default();
    }
    // None of the user's files is in this folder, so that their paths stay absolute.
    let recovery = window.document.recovery.as_ref();
    let folder = recovery.map(|recovery| recovery.journal.folder.clone()).unwrap_or_default();
    let mut shown = scene_file::scene_of(window, &folder.join(RECOVERED_SCENE));
    let clouds = scene_file::opened_clouds(window, &folder);
    let mut opened = SceneFile { clouds: clouds.clone(), ..shown.clone() };
    shown.clouds = clouds;
    // Clouds without a row are not read again.
    shown.clouds.iter_mut().for_each(|cloud| cloud.visible = false);
    let (mut rows, mut edited) = (Vec::new(), Vec::new());
    for open_cloud in open_clouds.all() {
        let at = match open_cloud.entry.filter(|entry| *entry < shown.clouds.len()) {
            Some(entry) => entry,
            None => {
                let path = open_cloud.saved_as.clone().unwrap_or_default();
                shown.clouds.push(SceneCloud::new(path).into());
                shown.clouds.len() - 1
            }
        };
        if let Some(cloud) = shown.clouds.get_mut(at) {
            // Hidden ones are read, too: they can be shown again.
            cloud.visible = true;
            cloud.hidden = open_cloud.hidden();
            cloud.layer = scene_file::layer_in(open_cloud, &folder);
            // What was saved since it was opened is the scene's now.
            if let Some(own) = opened.clouds.get_mut(at) {
                own.layer.clone_from(&cloud.layer);
            }
            if let Some(path) = &open_cloud.saved_as {
                (cloud.path, cloud.transform) = (path.clone(), None);
            }
            // What is written for the case of a crash has it.
            if !open_cloud.is_unsaved() {
                let before = cloud.transform.take();
                cloud.transform = placement::over(before, &open_cloud.placement());
            }
        }
        if open_cloud.is_unsaved() {
            let loaded = &open_cloud.loaded;
            let (cloud, comments) = (unhidden(&loaded.cloud), loaded.summary.comments.clone());
            let layer = open_cloud
                .pyramid()
                .map(|pyramid| (pyramid.layer().clone(), pyramid.pyramid().directory().n_surfels));
            edited.push(EditedCloud { row: rows.len(), cloud, comments, layer });
        }
        rows.push(CloudRow {
            at,
            was_opened: open_cloud.entry.is_some(),
            visible: open_cloud.visible,
            name: open_cloud.loaded.summary.file.clone(),
            saved_as: open_cloud.saved_as.clone(),
            file: None,
            title: open_cloud.title().cloned(),
        });
    }
    JournalTarget { scene: window.document.scene_path.clone(), rows, edited, shown, opened }
}

/// Ends the journal when the window closes.
pub(crate) fn end(window: &mut Window, end: JournalEnd) {
    if let Some(recovery) = &mut window.document.recovery {
        recovery.journal.finish(end);
    }
}
