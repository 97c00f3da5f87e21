//! Whose code may run.
//!
//! A native plugin can do whatever the program can, so its code runs only after somebody has said yes.
//! The program's own folder needs no yes: who can write there can replace the program. Everything else is
//! trusted by its contents, as they were when the yes was given, or by its place, whatever is built there. A
//! WebAssembly module needs no yes: it runs in a sandbox, wherever it comes from.
//!
//! Besides, the list says which packages run in processes of their own, however far they are trusted.
//!
//! Links are resolved once, when a file is listed; from then on the file that the link led to is read, judged
//! and loaded, wherever the link leads later. Each load asks again.
//!
//! Invariants: what is asked is asked of the very bytes that are loaded, and of the place that they were read
//! from; a yes to one build is none to the next; a link from elsewhere into the program's folder is not the
//! program's; judging runs no code.

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
    /// Packages and files whose libraries run in processes of their own.
    isolated: BTreeSet<String>,
    isolated_files: BTreeSet<PathBuf>,
}

/// Whether a plugin's code may run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum TrustState {
    /// It lies beside the program.
    OfProgram,
    /// This build is trusted.
    Build,
    /// What is built in this place is trusted.
    Place,
    /// Everything that was named is trusted, this once.
    Once,
    /// It runs in a sandbox, and nobody is asked.
    Sandboxed,
    /// Nobody has said yes.
    New,
}

impl TrustState {
    /// Whether somebody asked for a plugin: by saying yes to it, by naming it, or with the program itself. One that only lies
    /// in a folder takes no other one's package, name or file type, not even a module that may run unasked.
    pub(crate) fn is_asked_for(self, origin: Origin) -> bool {
        !matches!(self, Self::New | Self::Sandboxed) || origin == Origin::CommandLine
    }

    /// Who comes before whom where several have a name: those named on the command line, those that somebody asked for
    /// otherwise, and the others.
    pub(crate) fn rank(self, origin: Origin) -> u8 {
        u8::from(self.is_asked_for(origin)) + u8::from(origin == Origin::CommandLine)
    }
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

    /// Trusts whatever file stands at this path: not what a link there leads to, since that may be another
    /// file tomorrow.
    pub fn place(&mut self, path: &Path) {
        self.places.insert(located(path));
    }

    /// Has the libraries of a package run in processes of their own.
    pub fn isolate(&mut self, package: impl Into<String>) {
        self.isolated.insert(package.into());
    }

    /// Has the library at this path, or that a link there leads to, run in processes of its own.
    pub fn isolate_file(&mut self, path: &Path) {
        self.isolated_files.insert(resolved(path));
    }

    /// Whether a library runs in processes of its own: by its package, or by its file, links resolved.
    #[must_use]
    pub fn is_isolated(&self, package: &str, file: &Path) -> bool {
        self.isolated.contains(package) || self.isolated_files.contains(file)
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
        self.isolated.extend(other.isolated);
        self.isolated_files.extend(other.isolated_files);
    }

    /// Whether a file may run that a place leads to: where it really lies, and what it holds. The contents of the
    /// program's own files are not asked for.
    #[must_use]
    pub fn standing(
        &self,
        place: &Place,
        file: &Path,
        contents: impl FnOnce() -> Contents,
    ) -> TrustState {
        if self.is_own(place, file) {
            return TrustState::OfProgram;
        }
        if self.builds.contains(&contents()) {
            TrustState::Build
        } else if self.places.contains(file) {
            TrustState::Place
        } else if self.all {
            TrustState::Once
        } else {
            TrustState::New
        }
    }

    /// Whether a file that a place leads to is the program's own, whatever it holds.
    pub(super) fn is_own(&self, place: &Place, file: &Path) -> bool {
        // A link beside the program may lead anywhere, and one that leads there may be turned.
        let lies_there = located(&place.path).parent() == file.parent();
        let is_own = place.origin == Origin::BesideProgram
            || file.parent().is_some_and(|folder| self.own.contains(folder));
        is_own && lies_there
    }
}

/// Where a path leads in the end, links resolved; the path itself where there is nothing.
pub(super) fn resolved(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}

/// Where a path lies: one name for its folder, links to that resolved, and its own name in it, whatever that
/// leads to.
pub(super) fn located(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    match path.file_name() {
        Some(name) => resolved(folder.unwrap_or(Path::new("."))).join(name),
        None => resolved(path),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_yes_to_a_build_is_none_to_the_next_and_one_to_a_place_is() {
        let place = |origin| Place::new("/nowhere/plugin.so", origin);
        let (old, new) = (Contents::of(b"old"), Contents::of(b"new"));
        let file = Path::new("/nowhere/plugin.so");
        let standing =
            |trust: &Trust, origin, contents| trust.standing(&place(origin), file, || contents);
        let mut trust = Trust::default();
        assert_eq!(standing(&trust, Origin::BesideProgram, old), TrustState::OfProgram);
        for origin in [Origin::UserFolder, Origin::Environment, Origin::CommandLine] {
            assert_eq!(standing(&trust, origin, old), TrustState::New);
        }
        trust.build(old);
        assert_eq!(standing(&trust, Origin::UserFolder, old), TrustState::Build);
        assert_eq!(standing(&trust, Origin::UserFolder, new), TrustState::New);
        trust.place(file);
        assert_eq!(standing(&trust, Origin::UserFolder, new), TrustState::Place);
        let mut all = Trust::everything();
        assert_eq!(standing(&all, Origin::CommandLine, old), TrustState::Once);
        all.add(trust);
        assert_eq!(standing(&all, Origin::CommandLine, old), TrustState::Build);
    }

    #[cfg(unix)]
    #[test]
    fn links_have_no_share_in_the_trust_of_what_they_lead_to_or_from() {
        use std::os::unix::fs::symlink;
        let (own, other) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let file = own.path().canonicalize().unwrap().join("plugin.so");
        let stranger = other.path().canonicalize().unwrap().join("stranger.so");
        std::fs::write(&file, "own").unwrap();
        std::fs::write(&stranger, "stranger").unwrap();
        symlink(&file, other.path().join("link.so")).unwrap();
        symlink(&stranger, own.path().join("link.so")).unwrap();
        symlink(own.path(), other.path().join("folder")).unwrap();
        let mut trust = Trust::default();
        trust.own_folder(own.path());
        let standing = |trust: &Trust, path: PathBuf| {
            let place = Place::new(&path, Origin::CommandLine);
            trust.standing(&place, &resolved(&path), Contents::default)
        };
        assert_eq!(standing(&trust, file.clone()), TrustState::OfProgram);
        // The folder by another name.
        assert_eq!(standing(&trust, other.path().join("folder/plugin.so")), TrustState::OfProgram);
        assert_eq!(standing(&trust, other.path().join("link.so")), TrustState::New);
        assert_eq!(standing(&trust, own.path().join("link.so")), TrustState::New);
        // A place that has become a link is not what was trusted.
        trust.place(&stranger);
        assert_eq!(standing(&trust, stranger.clone()), TrustState::Place);
        let evil = other.path().join("evil.so");
        std::fs::write(&evil, "evil").unwrap();
        std::fs::remove_file(&stranger).unwrap();
        symlink(&evil, &stranger).unwrap();
        assert_eq!(standing(&trust, stranger), TrustState::New);
    }
}
