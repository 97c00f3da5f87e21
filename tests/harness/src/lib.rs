//! What the tests of the whole share: clouds, a ray caster, an engine to render with, and what
//! work costs.

pub mod agreement;
pub mod cast;
pub mod clouds;
pub mod desk;
pub mod lamp;
pub mod materials;
pub mod measure;
pub mod natural_light;
pub mod occlusion;
pub mod procedural;
pub mod stage;
pub mod twin;
