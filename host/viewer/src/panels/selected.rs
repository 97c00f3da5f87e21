//! The part that is selected, and its name.

use super::Selection;
use crate::window::Window;

/// Whether there is such a part.
fn exists(window: &Window, selection: Selection) -> bool {
    let settings = &window.settings;
    let n_clouds = window.document.clouds.as_ref().map_or(0, |shown| shown.open_clouds.all().len());
    match selection {
        Selection::View | Selection::Environment | Selection::Camera => true,
        Selection::Cloud(i) => i < n_clouds,
        Selection::Light(i) => i < settings.scene.lights.len(),
        Selection::LightOff(i) => i < settings.lights_off.len(),
        Selection::Bookmark(i) => i < settings.bookmarks.len(),
        Selection::Measure(i) => i < settings.measures.len(),
    }
}

impl Window {
    /// What is selected; the view where that is gone.
    pub(crate) fn selection(&self) -> Selection {
        Some(self.panels.selection).filter(|one| exists(self, *one)).unwrap_or_default()
    }

    /// Selects a part.
    pub(crate) fn select(&mut self, selection: Selection) {
        self.panels.selection = selection;
    }

    /// The name of a part.
    pub(crate) fn name_of(&self, selection: Selection) -> String {
        let cloud = |i: usize| self.document.clouds.as_ref()?.open_clouds.all().get(i);
        match selection {
            Selection::View => {
                let pane = self.settings.pane(self.views.focused);
                pane.map(|pane| pane.name()).unwrap_or_default()
            }
            Selection::Cloud(i) => cloud(i).map(|cloud| cloud.name()).unwrap_or_default(),
            Selection::Light(i) => format!("light {}", i + 1),
            Selection::LightOff(i) => {
                format!("light {}", self.settings.scene.lights.len() + i + 1)
            }
            Selection::Environment => "light around the scene".to_owned(),
            Selection::Camera => "camera".to_owned(),
            Selection::Bookmark(i) => {
                let bookmark = self.settings.bookmarks.get(i);
                bookmark.map(|bookmark| bookmark.name.clone()).unwrap_or_default()
            }
            Selection::Measure(i) => {
                self.settings.measures.get(i).map(|measure| measure.title(i)).unwrap_or_default()
            }
        }
    }
}
