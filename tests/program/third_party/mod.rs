//! Plugins as third parties make them: projects of every kind, other settings of the compiler, another
//! language, and libraries that mean harm.

mod kinds;
mod project;
mod settings;

// Another compiler than Rust's is called as Unix systems do it.
#[cfg(unix)]
mod c;
#[cfg(unix)]
mod format_in_c;
#[cfg(unix)]
mod hands;
#[cfg(unix)]
mod hostile;
#[cfg(unix)]
mod isolated;
#[cfg(unix)]
mod modules;
#[cfg(unix)]
mod packs;
