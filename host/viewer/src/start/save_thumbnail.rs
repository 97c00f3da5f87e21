//! A small picture of what is open is written for the start page.

use super::thumbnails::{file_of, remove_others, write};
use crate::window::Window;
use std::path::PathBuf;

impl Window {
    /// Writes a small picture of what is open, where the picture of its first view is final. It is no loss if that fails.
    pub(crate) fn save_thumbnail(&mut self) {
        let Some(path) = self.only_file() else { return };
        let Some(folder) = &self.document.state_folder else { return };
        let first = self.settings.panes.first().map(|pane| pane.id);
        let side = first.and_then(|pane| Some(&self.views.panes.get(&pane)?.sides[0]));
        let Some(side) = side.filter(|side| side.is_converged()) else { return };
        let Some(shown) = &side.shown else { return };
        let picture = (path, shown.serial);
        let thumbnails = &mut self.panels.thumbnails;
        if thumbnails.written.as_ref() == Some(&picture) {
            return;
        }
        let file = file_of(folder, &picture.0);
        if let Err(error) = write(&file, shown.rendered.size, &shown.rendered.levels) {
            tracing::debug!("no thumbnail was written: {error:#}");
        }
        remove_others(folder, &self.document.recent, &file);
        thumbnails.shown.remove(&picture.0);
        thumbnails.written = Some(picture);
    }

    /// The file that is open, as the list of recent files names it, where it is one.
    fn only_file(&self) -> Option<PathBuf> {
        let document = &self.document;
        let path = match (&document.scene_path, document.files.as_slice()) {
            (Some(scene), []) => scene,
            // Others may have been opened beside it since, and itself removed.
            (None, [cloud]) if matches!(&self.file_names()[..], [one] if one.file_name() == cloud.file_name()) => {
                cloud
            }
            _ => return None,
        };
        let path = std::path::absolute(path).ok()?;
        document.recent.contains(&path).then_some(path)
    }
}
