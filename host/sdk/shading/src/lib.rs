//! Light on surfaces that several renderers share: passes and shader modules to put into a graph.
//!
//! Invariants: no GPU, no files, no parameters of its own: a renderer declares those and says what a
//! pixel is made of; what it does not use is neither bound nor computed. Shader text comes along
//! with the pass as a module below `shading`, so it belongs to the plugin's build and not to the
//! host's.

mod diffuse;
mod natural;
mod reflectance;

pub use natural::{Model, NaturalLight, NaturalLighting};
pub use reflectance::Reflectance;
