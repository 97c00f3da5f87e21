//! Scenes as files: which clouds stand where, the camera, the light and the views of them.
//!
//! A scene is a TOML file whose name ends in `.scene.toml`. [`read()`] opens one, [`SceneFile::write`]
//! saves one whole or not at all. Keys that this version does not know are reported and kept, so
//! that a newer program's scene survives being saved by an older one. Angles are degrees in the
//! file and radians here; colours are linear.
//!
//! Invariants: what is written is read back as it was, and written again byte by byte alike
//! (`scenes_are_read_back_as_they_were_and_written_alike`).

mod angle;
mod environment;
mod error;
mod light;
mod parts;
mod place;
mod read;
mod source;
mod write;

use crate::transform::Transform;
use std::ops::{Deref, DerefMut};
use std::path::{Path, PathBuf};
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{Camera, Light, Scene, SurfaceSettings};

pub use environment::{Axis, ProbeSource, SceneEnvironment};
pub use error::{SceneError, SceneFault, SceneWriteError};
pub(crate) use read::toml_values;
pub use read::{OpenedScene, is_scene, read, read_bytes};
/// A table of TOML, sorted by key.
pub use toml::Table;
pub(crate) use write::toml_text;

/// The version of the format, the value of the key `format`.
pub const FORMAT: i64 = 1;

/// The most bytes a scene may have. Scenes name clouds and do not contain them.
pub const LARGEST_FILE: u64 = 4 << 20;

/// The most clouds of a scene: each takes some 60 kB and a tenth of a millisecond a frame besides what it holds,
/// measured with 100,000.
pub const MOST_CLOUDS: usize = 4096;

/// The most views of a scene; the window shows fewer.
pub const MOST_VIEWS: usize = 64;

/// The most parameters of a view.
pub const MOST_VALUES: usize = 1000;

/// The most keys that are not known, in all of a scene: they are kept, and written again.
pub const MOST_UNKNOWN_KEYS: usize = 10_000;

/// Vertical field of view of a perspective camera that gives none, degrees: about that of a
/// portrait lens, so that objects look neither flat nor stretched.
pub const DEFAULT_FIELD_OF_VIEW_DEG: f64 = 35.0;

/// Between axis and edge of a spot that gives no angle, degrees: about that of a lampshade.
pub const DEFAULT_SPOT_DEG: f64 = 30.0;

/// Softness of a spot that gives none.
pub const DEFAULT_SPOT_SOFTNESS: f32 = 0.2;

/// A part of a scene, and the keys in its table that this version does not know.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Keyed<T> {
    /// What this version knows.
    pub known: T,
    /// What it does not, kept as it is.
    pub unknown: Table,
}

impl<T> From<T> for Keyed<T> {
    fn from(known: T) -> Self {
        Self { known, unknown: Table::new() }
    }
}

impl<T> Deref for Keyed<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.known
    }
}

impl<T> DerefMut for Keyed<T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.known
    }
}

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
    /// How surfels become a surface.
    pub surface: Keyed<SurfaceSettings>,
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
}

impl SceneCloud {
    /// A visible cloud where its file says.
    #[must_use]
    pub fn new(path: impl Into<PathBuf>) -> Self {
        Self { path: path.into(), name: None, visible: true, transform: None }
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

/// How brightness above white is brought down.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneMap {
    /// Cut off.
    #[default]
    Clamp,
    /// Compressed and desaturated (Khronos PBR Neutral).
    Neutral,
}

/// What stands where no surfel is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Backdrop {
    /// Nothing.
    #[default]
    Transparent,
    /// A colour, linear Rec. 709 in [0, 1]; neither exposed nor tone-mapped.
    Color([f32; 3]),
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
            surface: surface.into(),
            views: Vec::new(),
            layout: Table::new(),
            unknown: Table::new(),
        }
    }
}

impl SceneFile {
    /// What renderers are told of the scene.
    #[must_use]
    pub fn scene(&self) -> Scene {
        Scene {
            lights: self.lights.iter().map(|light| light.known).collect(),
            exposure_stops: self.exposure_stops,
            surface: self.surface.known,
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
        place::relative(path, &self.folder)
    }
}
