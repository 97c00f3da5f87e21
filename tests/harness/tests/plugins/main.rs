//! Hostile plugins, one test per way to be hostile: each is refused or contained with a reason a
//! person can act on, and the plugins beside it go on working.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod calls;
mod conduct;
mod crashes;
mod deadlines;
mod files;
mod fixture;
mod links;
mod loading;
mod lookup;
mod rebuilt;
mod search;
mod watching;
