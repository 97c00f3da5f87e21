//! What of the scene is selected: its properties are shown, and commands are about it.

use crate::window::Window;

/// A part of the scene, as the outliner lists it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) enum Selection {
    /// The focused view.
    #[default]
    View,
    /// A cloud, by its index among those that are open.
    Cloud(usize),
    /// A light of the scene.
    Light(usize),
    /// A light that is switched off.
    LightOff(usize),
    Environment,
    /// The camera of the focused view.
    Camera,
    /// A remembered camera.
    Bookmark(usize),
}

impl Selection {
    /// Whether there is such a part.
    fn exists(self, window: &Window) -> bool {
        let settings = &window.settings;
        let n_clouds =
            window.document.clouds.as_ref().map_or(0, |shown| shown.open_clouds.all().len());
        match self {
            Self::View | Self::Environment | Self::Camera => true,
            Self::Cloud(i) => i < n_clouds,
            Self::Light(i) => i < settings.scene.lights.len(),
            Self::LightOff(i) => i < settings.lights_off.len(),
            Self::Bookmark(i) => i < settings.bookmarks.len(),
        }
    }
}

impl Window {
    /// What is selected; the view where that is gone.
    pub(crate) fn selection(&self) -> Selection {
        Some(self.panels.selection).filter(|one| one.exists(self)).unwrap_or_default()
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
        }
    }
}
