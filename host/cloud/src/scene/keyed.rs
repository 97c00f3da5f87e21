//! Parts of a scene that keep the keys which this version does not know.

use std::ops::{Deref, DerefMut};
use toml::Table;

/// A part of a scene, and the keys in its table that this version does not know.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Keyed<T> {
    /// What this version knows.
    pub known: T,
    /// What it does not, kept as it is.
    pub unknown: Table,
}

impl<T> From<T> for Keyed<T> {
    fn from(known: T) -> Self {
        Self { known, unknown: Table::new() }
    }
}

impl<T> Deref for Keyed<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.known
    }
}

impl<T> DerefMut for Keyed<T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.known
    }
}
