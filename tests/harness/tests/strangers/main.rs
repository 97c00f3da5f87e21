//! Plugins as strangers make them: projects of every kind, other settings of the compiler, another
//! language, and libraries that mean harm.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod kinds;
mod settings;
mod workshop;

// Another compiler than Rust's is called as Unix systems do it.
#[cfg(unix)]
mod c;
#[cfg(unix)]
mod hostile;
