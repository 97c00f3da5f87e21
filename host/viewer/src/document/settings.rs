//! The settings of scene and panes, which undo covers.

use super::scene_file::bookmarks::Bookmark;
use std::collections::BTreeMap;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{Light, Scene};
use surfelshop_cloud::display::{ColorSource, Filter, SplatSettings};
use surfelshop_cloud::scene::{EyeDomeLighting, Measure, SceneEnvironment, Table};
use surfelshop_image::display_transform::{Background, DisplayTransform, ToneMap};

/// How a pane shows the pictures of its two renderers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Mode {
    /// The first alone.
    #[default]
    Single,
    /// Side by side.
    SideBySide,
    /// The first left of a draggable line, the second right of it.
    Wipe,
    /// One of them, changed with a key.
    Flicker,
    /// A heat map of their difference.
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

    /// What it does, in a word or two.
    pub(crate) fn short(self) -> &'static str {
        match self {
            Self::Flicker => "in turn",
            other => other.name(),
        }
    }

    /// What it does, in words.
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Single => "one picture",
            Self::SideBySide => "side by side",
            Self::Wipe => "with a wipe line",
            Self::Flicker => "in turn",
            Self::Difference => "their difference",
        }
    }

    /// The number of renderers it shows.
    pub(crate) fn sides(self) -> usize {
        if self == Self::Single { 1 } else { 2 }
    }
}

/// One view of the scene.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PaneSettings {
    pub(crate) id: u32,
    /// The renderers by name; the second is for modes with two.
    pub(crate) renderers: [String; 2],
    pub(crate) mode: Mode,
    /// What it is called; empty for its number.
    pub(crate) title: String,
    /// The cloud that each side shows alone, by its name; none for all.
    pub(crate) clouds: [Option<String>; 2],
    /// Parameters by renderer.
    pub(crate) values: BTreeMap<String, Values>,
    /// Whether it uses the camera that linked panes share.
    pub(crate) linked: bool,
    /// The position of the wipe line, in [0, 1].
    pub(crate) wipe: f32,
    /// The output of the scene's view, kept for saving: the window shows colours only.
    pub(crate) output: Output,
    /// Unknown keys of the scene's view.
    pub(crate) unknown: Table,
}

/// What draws where nobody chooses.
pub(crate) const USUAL_RENDERER: &str = "ewa-phong";

/// What a renderer is compared with where nobody chooses.
fn beside(renderer: &str) -> &'static str {
    if renderer == "flat" { USUAL_RENDERER } else { "flat" }
}

impl PaneSettings {
    /// A pane with a renderer.
    pub(crate) fn new(id: u32, renderer: &str) -> Self {
        Self {
            id,
            renderers: [renderer.to_owned(), beside(renderer).to_owned()],
            mode: Mode::Single,
            title: String::new(),
            clouds: [None, None],
            values: BTreeMap::new(),
            linked: true,
            wipe: 0.5,
            output: Output::Color,
            unknown: Table::new(),
        }
    }

    /// Compares with another renderer where it would be compared with itself.
    pub(crate) fn tell_renderers_apart(&mut self) {
        if self.renderers[0] == self.renderers[1] {
            beside(&self.renderers[0]).clone_into(&mut self.renderers[1]);
        }
    }

    /// What it is called.
    pub(crate) fn name(&self) -> String {
        match self.title.as_str() {
            "" => format!("view {}", self.id + 1),
            title => title.to_owned(),
        }
    }

    /// The values of one side's renderer.
    pub(crate) fn values_of(&self, side: usize) -> Values {
        self.values.get(&self.renderers[side]).cloned().unwrap_or_default()
    }
}

/// The settings of the whole window.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Settings {
    pub(crate) scene: Scene,
    /// The environment map; its path is absolute or relative to the current folder.
    pub(crate) environment: Option<SceneEnvironment>,
    pub(crate) tone_map: ToneMap,
    pub(crate) background: Background,
    /// Settled pictures that a view at rest shows the mean of, each seen at another place of every pixel; 1 is none.
    pub(crate) antialias: u32,
    /// What is darkened for lying behind something.
    pub(crate) eye_dome: EyeDomeLighting,
    /// What colours surfels.
    pub(crate) color: ColorSource,
    /// Which of them are shown.
    pub(crate) filters: Vec<Filter>,
    /// How they look.
    pub(crate) splats: SplatSettings,
    /// Whether what colours mean is shown over the pictures.
    pub(crate) shows_legend: bool,
    /// Whether light handles are shown.
    pub(crate) shows_light_handles: bool,
    /// Lights that are switched off.
    pub(crate) lights_off: Vec<Light>,
    /// Remembered cameras.
    pub(crate) bookmarks: Vec<Bookmark>,
    /// What is measured.
    pub(crate) measures: Vec<Measure>,
    pub(crate) panes: Vec<PaneSettings>,
}

/// Grays on which both dark and bright edges are visible.
pub(crate) const USUAL_BACKGROUND: Background = Background::Gradient {
    top: [66.0 / 255.0, 70.0 / 255.0, 76.0 / 255.0],
    bottom: [32.0 / 255.0, 33.0 / 255.0, 35.0 / 255.0],
};

impl Default for Settings {
    fn default() -> Self {
        Self {
            scene: Scene::default(),
            environment: None,
            tone_map: ToneMap::default(),
            background: USUAL_BACKGROUND,
            antialias: 1,
            eye_dome: EyeDomeLighting::default(),
            color: ColorSource::default(),
            filters: Vec::new(),
            splats: SplatSettings::default(),
            shows_legend: true,
            shows_light_handles: true,
            lights_off: Vec::new(),
            bookmarks: Vec::new(),
            measures: Vec::new(),
            panes: vec![PaneSettings::new(0, USUAL_RENDERER)],
        }
    }
}

impl Settings {
    /// Exposure, tone mapping and background of the pictures.
    pub(crate) fn display_transform(&self) -> DisplayTransform {
        DisplayTransform {
            exposure_stops: self.scene.exposure_stops,
            tone_map: self.tone_map,
            background: self.background,
        }
    }

    /// A pane by its number.
    pub(crate) fn pane(&self, id: u32) -> Option<&PaneSettings> {
        self.panes.iter().find(|pane| pane.id == id)
    }

    /// A pane by its number, mutable.
    pub(crate) fn pane_mut(&mut self, id: u32) -> Option<&mut PaneSettings> {
        self.panes.iter_mut().find(|pane| pane.id == id)
    }

    /// The panes' numbers, in their order.
    pub(crate) fn pane_ids(&self) -> Vec<u32> {
        self.panes.iter().map(|pane| pane.id).collect()
    }

    /// A number that no pane has.
    pub(crate) fn free_id(&self) -> u32 {
        self.panes.iter().map(|pane| pane.id + 1).max().unwrap_or(0)
    }
}

/// Whether a light has the direction that it needs: a spot without one could not be read back from a
/// scene.
pub(crate) fn has_direction(light: &Light) -> bool {
    match light {
        Light::Spot { position, target, .. } => (*target - *position).try_normalize().is_some(),
        Light::Directional { .. } | Light::Point { .. } => true,
    }
}
