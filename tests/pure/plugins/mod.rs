//! Hostile plugins, one test per way to be hostile: each is refused or contained with a reason a
//! person can act on, and the plugins beside it go on working.

mod calls;
mod crashes;
mod deadlines;
mod files;
mod fixture;
mod health;
mod links;
mod loading;
mod lookup;
mod rebuilt;
mod sandboxed;
mod search;
mod watching;
