//! What the window shows and how: everything that undo covers.

use std::collections::BTreeMap;
use surfelshop_api::Scene;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_cloud::scene::{SceneEnvironment, Table};
use surfelshop_engine::picture::{Background, Development, ToneMap};

/// How the pictures of a pane's two renderers are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Mode {
    /// The first alone.
    #[default]
    Single,
    /// Beside each other.
    SideBySide,
    /// The first left of a line that can be dragged, the second right of it.
    Wipe,
    /// One or the other, changed with a key.
    Flicker,
    /// How much they differ.
    Difference,
}

impl Mode {
    /// All, in the order of the menu.
    pub(crate) const ALL: [Self; 5] =
        [Self::Single, Self::SideBySide, Self::Wipe, Self::Flicker, Self::Difference];

    /// The name in the menu.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::SideBySide => "side by side",
            Self::Wipe => "wipe",
            Self::Flicker => "flicker",
            Self::Difference => "difference",
        }
    }

    /// How many renderers it shows.
    pub(crate) fn sides(self) -> usize {
        if self == Self::Single { 1 } else { 2 }
    }
}

/// One view of the scene.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PaneSettings {
    pub(crate) id: u32,
    /// The renderers by name; the second counts in modes with two.
    pub(crate) renderers: [String; 2],
    pub(crate) mode: Mode,
    /// Parameters by renderer.
    pub(crate) values: BTreeMap<String, Values>,
    /// Whether the camera is the one that all linked panes share.
    pub(crate) linked: bool,
    /// Where the line of a wipe stands, in [0, 1].
    pub(crate) wipe: f32,
    /// What the view of a scene shows: kept, since this window shows colours only.
    pub(crate) output: Output,
    /// Keys of the view in the scene that nobody here knows.
    pub(crate) unknown: Table,
}

impl PaneSettings {
    /// A pane with a renderer.
    pub(crate) fn new(id: u32, renderer: &str) -> Self {
        let other = if renderer == "flat" { "ewa-phong" } else { "flat" };
        Self {
            id,
            renderers: [renderer.to_owned(), other.to_owned()],
            mode: Mode::Single,
            values: BTreeMap::new(),
            linked: true,
            wipe: 0.5,
            output: Output::Color,
            unknown: Table::new(),
        }
    }

    /// The values of one side's renderer.
    pub(crate) fn values_of(&self, side: usize) -> Values {
        self.values.get(&self.renderers[side]).cloned().unwrap_or_default()
    }
}

/// Scene and panes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Settings {
    pub(crate) scene: Scene,
    /// The light around the scene; paths can be opened from the current folder.
    pub(crate) environment: Option<SceneEnvironment>,
    pub(crate) tone_map: ToneMap,
    pub(crate) background: Background,
    /// Whether lights with a place are shown over the pictures.
    pub(crate) shows_lamps: bool,
    pub(crate) panes: Vec<PaneSettings>,
}

impl Default for Settings {
    fn default() -> Self {
        // A dark gray on which both dark and bright edges are seen.
        let background = Background::Color([41.0, 43.0, 46.0].map(|level| level / 255.0));
        Self {
            scene: Scene::default(),
            environment: None,
            tone_map: ToneMap::default(),
            background,
            shows_lamps: true,
            panes: vec![PaneSettings::new(0, "ewa-phong")],
        }
    }
}

impl Settings {
    /// How pictures are developed.
    pub(crate) fn development(&self) -> Development {
        Development {
            exposure_stops: self.scene.exposure_stops,
            tone_map: self.tone_map,
            background: self.background,
        }
    }

    /// A pane by its number.
    pub(crate) fn pane(&self, id: u32) -> Option<&PaneSettings> {
        self.panes.iter().find(|pane| pane.id == id)
    }

    /// A pane by its number, to be changed.
    pub(crate) fn pane_mut(&mut self, id: u32) -> Option<&mut PaneSettings> {
        self.panes.iter_mut().find(|pane| pane.id == id)
    }

    /// The panes' numbers, in their order.
    pub(crate) fn pane_ids(&self) -> Vec<u32> {
        self.panes.iter().map(|pane| pane.id).collect()
    }

    /// A number no pane has.
    pub(crate) fn free_id(&self) -> u32 {
        self.panes.iter().map(|pane| pane.id + 1).max().unwrap_or(0)
    }
}
