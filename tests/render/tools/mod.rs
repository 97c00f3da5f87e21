//! Tools as the engine runs them: over a snapshot, on threads of their own, committed whole or not
//! at all.

mod device;
mod endings;
mod fixture;
mod results;
