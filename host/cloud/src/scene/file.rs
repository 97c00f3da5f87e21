//! What a scene file holds.

use super::display::{Backdrop, EyeDomeLighting, ToneMap};
use super::environment::{ProbeSource, SceneEnvironment};
use super::keyed::Keyed;
use super::measures::Measure;
use super::paths;
use crate::cloud::axis::Axis;
use crate::cloud::selection::SurfelRuns;
use crate::cloud::transform::Transform;
use crate::display::{ColorSource, DisplaySettings, Filter, SplatSettings};
use std::path::{Path, PathBuf};
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{Camera, Light, Scene, SurfaceSettings};
use toml::Table;

/// A scene as it stands in a file.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneFile {
    /// The folder that relative paths of clouds are relative to, not itself a part of the file:
    /// that of the file it was read from; empty for the current folder.
    pub folder: PathBuf,
    /// The clouds.
    pub clouds: Vec<Keyed<SceneCloud>>,
    /// The camera of all views that have none of their own; `None` leaves the choice to the
    /// program.
    pub camera: Option<Keyed<Camera>>,
    /// The lights, at most [`Scene::MAX_LIGHTS`].
    pub lights: Vec<Keyed<Light>>,
    /// The light around it.
    pub environment: Option<Keyed<SceneEnvironment>>,
    /// Factor on radiance before tone mapping in stops, from -60 to 60.
    pub exposure_stops: f32,
    /// How brightness above white is brought down.
    pub tone_map: ToneMap,
    /// What stands where no surfel is.
    pub background: Backdrop,
    /// Frames that a picture at rest is the mean of, seen at other places of each pixel, from 1, which is none, to
    /// 1024.
    pub antialias: u32,
    /// What is darkened for lying behind something.
    pub eye_dome: EyeDomeLighting,
    /// How surfels become a surface.
    pub surface: Keyed<SurfaceSettings>,
    /// The axis that points upwards; `None` where the scene does not say, and its clouds decide.
    pub up: Option<Axis>,
    /// What colours surfels.
    pub color: Keyed<ColorSource>,
    /// Surfels are shown that all of these let through, at most [`MOST_FILTERS`](super::MOST_FILTERS).
    pub filters: Vec<Keyed<Filter>>,
    /// How surfels look.
    pub splats: Keyed<SplatSettings>,
    /// What is measured in it, at most [`MOST_MEASURES`](super::MOST_MEASURES).
    pub measures: Vec<Keyed<Measure>>,
    /// What is shown side by side.
    pub views: Vec<Keyed<SceneView>>,
    /// How the views are laid out: a window's own business, kept as it is.
    pub layout: Table,
    /// Keys beside these that this version does not know, kept as they are.
    pub unknown: Table,
}

/// A cloud of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneCloud {
    /// The file, absolute or relative to the scene's folder; [`SceneFile::path_of`] is what can be
    /// opened, [`SceneFile::path_in_scene`] makes it from what was opened.
    pub path: PathBuf,
    /// What it is called in lists, where that is not its file's name.
    pub name: Option<String>,
    /// Whether it is shown; hidden clouds need not be read.
    pub visible: bool,
    /// Where it stands; `None` where its file says.
    pub transform: Option<Keyed<Transform>>,
    /// What draws it; `None` where that is the view's renderer.
    pub renderer: Option<CloudRenderer>,
    /// Which of its surfels are hidden; `None` where none is.
    pub hidden: Option<SurfelRuns>,
    /// The file of its edits, where it is larger than memory, named as `path` is; `None` where it has none.
    pub layer: Option<PathBuf>,
}

/// A renderer of a cloud's own.
#[derive(Clone, Debug, PartialEq)]
pub struct CloudRenderer {
    /// The renderer, by its id or as PACKAGE/ID.
    pub name: String,
    /// Values of its parameters by id; those left out have their default.
    pub values: Values,
}

impl SceneCloud {
    /// A visible cloud where its file says.
    #[must_use]
    pub fn new(path: impl Into<PathBuf>) -> Self {
        let (name, transform, renderer, hidden, layer) = (None, None, None, None, None);
        Self { path: path.into(), name, visible: true, transform, renderer, hidden, layer }
    }
}

/// What one view of a scene shows.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneView {
    /// The renderer, by its id or as PACKAGE/ID.
    pub renderer: String,
    /// Values of the renderer's parameters by id; those left out have their default.
    pub values: Values,
    /// A camera of its own; `None` for that of the scene.
    pub camera: Option<Keyed<Camera>>,
    /// What is shown.
    pub output: Output,
}

impl SceneView {
    /// The picture of a renderer with its defaults, seen through the scene's camera.
    #[must_use]
    pub fn new(renderer: impl Into<String>) -> Self {
        let renderer = renderer.into();
        Self { renderer, values: Values::new(), camera: None, output: Output::Color }
    }
}

impl Default for SceneFile {
    /// A scene without clouds, with the usual light.
    fn default() -> Self {
        let Scene { lights, exposure_stops, surface } = Scene::default();
        Self {
            folder: PathBuf::new(),
            clouds: Vec::new(),
            camera: None,
            lights: lights.into_iter().map(Keyed::from).collect(),
            environment: None,
            exposure_stops,
            tone_map: ToneMap::default(),
            background: Backdrop::default(),
            antialias: 1,
            eye_dome: EyeDomeLighting::default(),
            surface: surface.into(),
            up: None,
            color: Keyed::default(),
            filters: Vec::new(),
            splats: Keyed::default(),
            measures: Vec::new(),
            views: Vec::new(),
            layout: Table::new(),
            unknown: Table::new(),
        }
    }
}

impl SceneFile {
    /// The scene as renderers get it.
    #[must_use]
    pub fn scene(&self) -> Scene {
        Scene {
            lights: self.lights.iter().map(|light| light.known).collect(),
            exposure_stops: self.exposure_stops,
            surface: self.surface.known,
        }
    }

    /// What colours surfels of its clouds, and which are shown.
    #[must_use]
    pub fn display(&self) -> DisplaySettings {
        DisplaySettings {
            color: self.color.known.clone(),
            filters: self.filters.iter().map(|filter| filter.known.clone()).collect(),
            splats: self.splats.known,
            up: self.up.unwrap_or_default(),
        }
    }

    /// The camera of a view: its own, or that of the scene; `None` where there is neither.
    #[must_use]
    pub fn camera_of(&self, view: &SceneView) -> Option<Camera> {
        view.camera.as_ref().or(self.camera.as_ref()).map(|camera| camera.known)
    }

    /// The file of a cloud, to be opened from the current folder.
    #[must_use]
    pub fn path_of(&self, cloud: &SceneCloud) -> PathBuf {
        self.folder.join(&cloud.path)
    }

    /// The file of a cloud's edits, to be opened from the current folder; `None` where it has none.
    #[must_use]
    pub fn path_of_layer(&self, cloud: &SceneCloud) -> Option<PathBuf> {
        cloud.layer.as_ref().map(|layer| self.folder.join(layer))
    }

    /// The file of a probe, to be opened from the current folder; `None` for built-in ones.
    #[must_use]
    pub fn path_of_probe(&self, source: &ProbeSource) -> Option<PathBuf> {
        match source {
            ProbeSource::File(path) => Some(self.folder.join(path)),
            ProbeSource::Studio | ProbeSource::Sky => None,
        }
    }

    /// How the scene names a file that can be opened from the current folder: relative to the
    /// scene's folder where it lies in it or beside it, and absolute elsewhere.
    #[must_use]
    pub fn path_in_scene(&self, path: &Path) -> PathBuf {
        paths::relative(path, &self.folder)
    }
}
