//! From WGSL text to a checked module whose resources are known by name.

mod bound_loops;
mod compose;
mod reflect;

pub(crate) use compose::{Composed, Library};
pub(crate) use reflect::{Binding, BindingKind, reflect};
