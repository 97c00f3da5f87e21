//! From WGSL text to a checked module whose resources are known by name.

mod bound_loops;
mod called;
mod compose;
mod directives;
mod expanded;
mod large_stack;
mod loops;
mod members;
mod numbered;
mod reflect;
mod report;
mod text;
mod tokens;
mod validate;
mod weights;
mod work_limit;

pub(crate) use called::called_by;
pub(crate) use compose::{Composed, Library, fingerprint};
pub(crate) use large_stack::{STACK_BYTES, on_large_stack};
pub(crate) use members::{SurfaceMembers, members_read};
pub(crate) use reflect::{Binding, BindingKind, EntryPoint, UniformMember, reflect};
pub(crate) use work_limit::{MAX_OF_INVOCATION, SPENT};
