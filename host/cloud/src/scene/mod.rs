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
mod color;
mod display;
mod environment;
mod error;
mod file;
mod keyed;
mod light;
mod limits;
mod measures;
mod parts;
mod paths;
mod read;
mod source;
mod splats;
mod write;

pub use crate::cloud::axis::Axis;
pub use display::{Backdrop, EyeDomeLighting, EyeDomeUse, ToneMap};
pub use environment::{ProbeSource, SceneEnvironment};
pub use error::{SceneError, SceneFault, SceneWriteError};
pub use file::{CloudRenderer, SceneCloud, SceneFile, SceneView};
pub use keyed::Keyed;
pub use limits::*;
pub use measures::{
    Figure, LONGEST_NOTE, MOST_MEASURES, MOST_PLACES, Measure, MeasureError, MeasureKind,
    MeasuredRow, Profile, Quantity, QuantityKind, Segment, Units, Volume,
};
pub use read::{OpenedScene, is_scene, read, read_bytes};
pub use source::distance;
/// A table of TOML, sorted by key.
pub use toml::Table;
