//! How calls into plugins fail.

use std::fmt;
use std::time::Duration;

/// How a call into a plugin failed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The plugin said what went wrong.
    Error(String),
    /// The plugin's code panicked; says where.
    Panic(String),
    /// The plugin broke the boundary's rules.
    Misbehaved(String),
    /// The plugin was still at work when the host stopped waiting, after this time.
    TimedOut(Duration),
    /// The plugin was not asked; says why.
    NotAsked(String),
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Error(line) | Self::Panic(line) => f.write_str(line),
            Self::Misbehaved(line) => write!(f, "broke the plugin interface: {line}"),
            Self::TimedOut(limit) => write!(f, "did not answer within {} s", limit.as_secs_f64()),
            Self::NotAsked(line) => write!(f, "is not asked any more: {line}"),
        }
    }
}

impl std::error::Error for Fault {}
