//! Tools as the engine runs them: over a snapshot, on threads of their own, committed whole or not
//! at all.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod device;
mod endings;
mod fixture;
mod results;
