//! What the tests and the report of ambient occlusion share: scenes with their triangles, the
//! truth from rays against these, and a job to bake with.

mod bake;
mod scenes;
mod truth;

pub use bake::{Baked, bake, values};
pub use scenes::{Mesh, blob, room, sheet};
pub use truth::{Truth, truth};
