//! Whose code may run.
//!
//! A native plugin can do whatever the program can, so its code runs only after somebody has said yes.
//! The program's own folder needs no yes: who can write there can replace the program. Everything else is
//! trusted by its contents, as they were when the yes was given, or by its place, whatever is built there.
//!
//! Invariants: what is asked is asked of the very bytes that are loaded; a yes to one build is none to the
//! next; judging runs no code.

use super::discover::{Origin, Place};
use super::inspect::Contents;
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// What a person has said yes to.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Trust {
    all: bool,
    builds: BTreeSet<Contents>,
    places: BTreeSet<PathBuf>,
    /// Folders of the program itself.
    own: BTreeSet<PathBuf>,
}

/// Whether a plugin's code may run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Standing {
    /// It lies beside the program.
    OfProgram,
    /// This build is trusted.
    Build,
    /// What is built in this place is trusted.
    Place,
    /// Everything that was named is trusted, this once.
    Once,
    /// Nobody has said yes.
    New,
}

impl Trust {
    /// Trust in everything that is found.
    #[must_use]
    pub fn everything() -> Self {
        Self { all: true, ..Self::default() }
    }

    /// Trusts a file with these contents, wherever it lies.
    pub fn build(&mut self, contents: Contents) {
        self.builds.insert(contents);
    }

    /// Trusts whatever stands at this path.
    pub fn place(&mut self, path: &Path) {
        self.places.insert(resolved(path));
    }

    /// Trusts what lies in a folder of the program itself, whoever names it.
    pub(super) fn own_folder(&mut self, folder: &Path) {
        self.own.insert(resolved(folder));
    }

    /// Trusts what the other does, too.
    pub fn add(&mut self, other: Self) {
        self.all |= other.all;
        self.builds.extend(other.builds);
        self.places.extend(other.places);
        self.own.extend(other.own);
    }

    /// Whether a file of a place may run.
    #[must_use]
    pub fn standing(&self, place: &Place, contents: Contents) -> Standing {
        let path = resolved(&place.path);
        let folder = path.parent();
        // A link beside the program may lead anywhere.
        let lies_there = folder == place.path.parent().map(resolved).as_deref();
        let is_own = folder.is_some_and(|folder| self.own.contains(folder));
        if is_own || (place.origin == Origin::BesideProgram && lies_there) {
            Standing::OfProgram
        } else if self.builds.contains(&contents) {
            Standing::Build
        } else if self.places.contains(&path) {
            Standing::Place
        } else if self.all {
            Standing::Once
        } else {
            Standing::New
        }
    }
}

impl Standing {
    /// Whether a file may run that was judged with some contents and has others now.
    #[must_use]
    pub(super) fn allows(self, judged: Contents, now: Contents) -> bool {
        match self {
            Self::OfProgram | Self::Place | Self::Once => true,
            Self::Build => judged == now,
            Self::New => false,
        }
    }
}

/// One name for each file, where the system can tell it.
fn resolved(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_yes_to_a_build_is_none_to_the_next_and_one_to_a_place_is() {
        let place = |origin| Place::new("/nowhere/plugin.so", origin);
        let (old, new) = (Contents::of(b"old"), Contents::of(b"new"));
        let mut trust = Trust::default();
        assert_eq!(trust.standing(&place(Origin::BesideProgram), old), Standing::OfProgram);
        for origin in [Origin::UserFolder, Origin::Environment, Origin::CommandLine] {
            assert_eq!(trust.standing(&place(origin), old), Standing::New);
        }
        trust.build(old);
        assert_eq!(trust.standing(&place(Origin::UserFolder), old), Standing::Build);
        assert_eq!(trust.standing(&place(Origin::UserFolder), new), Standing::New);
        assert!(Standing::Build.allows(old, old) && !Standing::Build.allows(old, new));
        trust.place(Path::new("/nowhere/plugin.so"));
        assert_eq!(trust.standing(&place(Origin::UserFolder), new), Standing::Place);
        assert!(Standing::Place.allows(old, new));
        let mut all = Trust::everything();
        assert_eq!(all.standing(&place(Origin::CommandLine), old), Standing::Once);
        all.add(trust);
        assert_eq!(all.standing(&place(Origin::CommandLine), old), Standing::Build);
    }
}
