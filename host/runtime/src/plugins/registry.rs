//! What was found: the plugins at hand, and the files that were refused with the reason.

use super::discover::{Origin, Place, SearchPath};
use super::find::UnitRef;
use super::inspect::{Contents, Refused, inspect_bytes, inspect_in_place, read};
use super::modules::is_module;
use super::trust::{Trust, TrustState, resolved};
use serde::{Serialize, Serializer};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};
use surfelshop_api::UnitKind;
use surfelshop_api::manifest::{Manifest, UnitEntry};

/// What became of a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// Its units can be loaded.
    Available(Manifest),
    /// A good plugin, but a file of higher precedence has the same package id.
    Shadowed {
        /// What the file says of itself.
        manifest: Manifest,
        /// The file used instead.
        #[serde(serialize_with = "lossy")]
        by: PathBuf,
    },
    /// A good plugin that nobody has said yes to, and that would take the place of one that may run.
    Waiting {
        /// What the file says of itself.
        manifest: Manifest,
        /// The file used meanwhile.
        #[serde(serialize_with = "lossy")]
        meanwhile: PathBuf,
    },
    /// Not a plugin this host can use; reads on from the path: `is empty`.
    Refused(String),
}

/// The contents of a file: digested when it is read where trust hangs on them, and when somebody asks where it
/// does not. The program's own plugins are tens of megabytes, which every command would digest.
#[derive(Clone, Debug)]
struct LazyContents {
    file: PathBuf,
    digest: Arc<OnceLock<Contents>>,
}

impl LazyContents {
    fn get(&self) -> Contents {
        *self.digest.get_or_init(|| Contents::of_file(&self.file))
    }
}

/// A file in the list of plugins.
#[derive(Clone, Debug, Serialize)]
pub struct Entry {
    /// The file, as its place names it.
    #[serde(serialize_with = "lossy")]
    pub path: PathBuf,
    /// The file that this leads to, links resolved: what was read, and what is loaded.
    #[serde(serialize_with = "lossy")]
    pub file: PathBuf,
    /// Who named the place.
    pub origin: Origin,
    /// Its contents, where it could be read.
    #[serde(serialize_with = "written")]
    contents: LazyContents,
    /// Whether its code may run.
    pub trust: TrustState,
    /// What became of it.
    pub state: State,
    /// What is asked before it is loaded.
    #[serde(skip)]
    asked: Arc<Trust>,
}

impl Entry {
    /// The contents of its file, as they were when it was listed; those of a file of the program itself as they are
    /// when somebody asks first.
    #[must_use]
    pub fn contents(&self) -> Contents {
        self.contents.get()
    }

    /// Whether its library runs in processes of its own; a WebAssembly module, which runs in a sandbox, never does.
    #[must_use]
    pub fn is_isolated(&self) -> bool {
        let is_isolated = |manifest: &Manifest| self.asked.is_isolated(&manifest.id, &self.file);
        self.trust != TrustState::Sandboxed && self.manifest().is_some_and(is_isolated)
    }

    /// The manifest of a plugin whose units can be loaded.
    #[must_use]
    pub fn available(&self) -> Option<&Manifest> {
        match &self.state {
            State::Available(manifest) => Some(manifest),
            State::Shadowed { .. } | State::Waiting { .. } | State::Refused(_) => None,
        }
    }

    /// What the file says of itself, where it is a good plugin.
    #[must_use]
    pub fn manifest(&self) -> Option<&Manifest> {
        match &self.state {
            State::Available(manifest)
            | State::Shadowed { manifest, .. }
            | State::Waiting { manifest, .. } => Some(manifest),
            State::Refused(_) => None,
        }
    }

    /// A unit of it.
    #[must_use]
    pub fn unit(&self, manifest: &Manifest, unit: &UnitEntry) -> UnitRef {
        UnitRef {
            file: self.file.clone(),
            origin: self.origin,
            found: self.trust,
            trust: Arc::clone(&self.asked),
            ..UnitRef::named(unit.kind, &manifest.id, &unit.id, &self.path)
        }
    }

    /// Whether it could be used if somebody said yes to it.
    #[must_use]
    pub fn asks_for_trust(&self) -> bool {
        let would_be_used = matches!(self.state, State::Available(_) | State::Waiting { .. });
        would_be_used && self.trust == TrustState::New
    }

    /// Why the file was refused, after its path.
    #[must_use]
    pub fn refusal(&self) -> Option<String> {
        match &self.state {
            State::Refused(reason) => Some(format!("{} {reason}", self.path.display())),
            State::Available(_) | State::Shadowed { .. } | State::Waiting { .. } => None,
        }
    }
}

/// The plugins at hand.
#[derive(Clone, Debug, Default, Serialize)]
#[serde(transparent)]
pub struct Registry {
    entries: Vec<Entry>,
}

impl Registry {
    /// Inspects every file of the search path; runs none of them.
    #[must_use]
    pub fn scan(search: &SearchPath) -> Self {
        let mut entries = Vec::new();
        let asked = Arc::new(search.trust.clone());
        for place in search.candidates() {
            // Once: what is judged here is what is loaded later, whatever links lead to by then.
            let file = resolved(&place.path);
            let contents = LazyContents { file: file.clone(), digest: Arc::default() };
            let (trust, found) = judged(&asked, &place, &contents);
            let state = match found {
                Ok(manifest) => State::Available(manifest),
                Err(Refused::NoManifest | Refused::OtherMachine { .. }) if place.shared => continue,
                Err(refused) if place.shared && refused.is_foreign_module() => continue,
                Err(refused) => {
                    tracing::debug!(path = %place.path.display(), %refused, "plugin refused");
                    State::Refused(refused.to_string())
                }
            };
            let (path, origin, asked) = (place.path, place.origin, Arc::clone(&asked));
            entries.push(Entry { path, file, origin, contents, trust, state, asked });
        }
        shadow_duplicates(&mut entries);
        Self { entries }
    }

    /// A unit of the file that a path leads to now, which need not be one that may run or be used.
    #[must_use]
    pub fn at(&self, path: &Path, unit: &UnitRef) -> Option<UnitRef> {
        let entry = self.entries.iter().find(|entry| entry.path == path)?;
        let manifest = entry.manifest().filter(|manifest| manifest.id == unit.package)?;
        let is_unit = |entry: &&UnitEntry| entry.kind == unit.kind && entry.id == unit.id;
        Some(entry.unit(manifest, manifest.units.iter().find(is_unit)?))
    }

    /// Every file found, lowest precedence first.
    #[must_use]
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// The units of a kind that can be loaded, with the entry and manifest they belong to.
    pub fn units(&self, kind: UnitKind) -> impl Iterator<Item = (&Entry, &Manifest, &UnitEntry)> {
        self.entries
            .iter()
            .filter_map(|entry| Some((entry, entry.available()?)))
            .flat_map(|(entry, manifest)| manifest.units.iter().map(move |u| (entry, manifest, u)))
            .filter(move |(_, _, unit)| unit.kind == kind)
    }
}

/// Whether the code of a file may run, and what the file says of itself.
fn judged(
    asked: &Trust,
    place: &Place,
    contents: &LazyContents,
) -> (TrustState, Result<Manifest, Refused>) {
    let file = &contents.file;
    // Trust in the program's own files does not hang on what they hold, so they are not read whole.
    if asked.is_own(place, file)
        && let Some(found) = inspect_in_place(file).transpose()
    {
        return (TrustState::OfProgram, found);
    }
    let bytes = read(file);
    let digest = || bytes.as_deref().map(Contents::of).unwrap_or_default();
    let trust = match bytes.as_deref().is_ok_and(is_module) {
        true => TrustState::Sandboxed,
        false => asked.standing(place, file, || *contents.digest.get_or_init(digest)),
    };
    (trust, bytes.and_then(|bytes| inspect_bytes(&bytes)))
}

/// Leaves one available entry per package id: the last that somebody asked for, and where there is none the last.
fn shadow_duplicates(entries: &mut [Entry]) {
    let counts = |entry: &Entry| entry.trust.is_asked_for(entry.origin);
    let mut used: BTreeMap<String, (usize, PathBuf)> = BTreeMap::new();
    for (i, entry) in entries.iter().enumerate() {
        let Some(manifest) = entry.available() else { continue };
        if counts(entry) || !used.get(&manifest.id).is_some_and(|(best, _)| counts(&entries[*best]))
        {
            used.insert(manifest.id.clone(), (i, entry.path.clone()));
        }
    }
    for (i, entry) in entries.iter_mut().enumerate() {
        let State::Available(manifest) = &entry.state else { continue };
        let Some((best, path)) = used.get(&manifest.id).filter(|(best, _)| *best != i) else {
            continue;
        };
        let (manifest, path) = (manifest.clone(), path.clone());
        // A module waits for no yes, so it is not used at all.
        entry.state = match i < *best || entry.trust == TrustState::Sandboxed {
            true => State::Shadowed { manifest, by: path },
            false => State::Waiting { manifest, meanwhile: path },
        };
    }
}

fn written<S: Serializer>(contents: &LazyContents, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&contents.get())
}

/// Paths need not be UTF-8; lists show what can be shown.
pub(super) fn lossy<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&path.display())
}
