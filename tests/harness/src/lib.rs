//! What the tests of the whole share: small clouds, a ray caster, and an engine to render with.

pub mod cast;
pub mod clouds;
pub mod stage;
pub mod twin;
