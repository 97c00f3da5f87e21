//! What the tests of the whole share: an engine to render with, twins in f64, and what work costs;
//! clouds and the ray caster are those that plugins are checked with.

pub mod agreement;
pub mod clouds;
pub mod evaluated_light;
pub mod gaussians;
pub mod gi;
pub mod materials;
pub mod measure;
pub mod natural_light;
pub mod occlusion;
pub mod octree;
pub mod precision;
pub mod procedural;
pub mod recording_host;
pub mod screen;
pub mod splats;
pub mod stage;
pub mod twin;

pub use surfelshop_evaluate::conformance::cast;
