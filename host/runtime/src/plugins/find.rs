//! Finds a unit by the name a person types.

use super::discover::{Origin, Place};
use super::inspect::Contents;
use super::registry::{Registry, lossy};
use super::trust::{Trust, TrustState};
use serde::Serialize;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use surfelshop_api::UnitKind;

/// A unit of a plugin file, found and not loaded. Two are the same where they name the same unit of the
/// same file, whatever the file holds.
#[derive(Clone, Debug, Serialize)]
pub struct UnitRef {
    /// What the unit is.
    pub kind: UnitKind,
    /// Id of its package.
    pub package: String,
    /// Its id inside the package.
    pub id: String,
    /// The file that exports it, as its place names it.
    #[serde(serialize_with = "lossy")]
    pub path: PathBuf,
    /// The file that this led to when it was found, links resolved: what is loaded.
    #[serde(skip)]
    pub(super) file: PathBuf,
    /// Who named the place.
    #[serde(skip)]
    pub(super) origin: Origin,
    /// Whether its code might run when it was found.
    #[serde(skip)]
    pub(super) found: TrustState,
    /// What says whether it may now.
    #[serde(skip)]
    pub(super) trust: Arc<Trust>,
}

impl UnitRef {
    /// A unit by its names alone, which nobody trusts.
    #[must_use]
    pub fn named(kind: UnitKind, package: &str, id: &str, path: impl Into<PathBuf>) -> Self {
        let (package, id, path) = (package.to_owned(), id.to_owned(), path.into());
        let (file, origin, found) = (path.clone(), Origin::CommandLine, TrustState::New);
        Self { kind, package, id, path, file, origin, found, trust: Arc::default() }
    }

    /// Whether a file may run that the unit's place leads to.
    pub(super) fn standing(&self, file: &Path, contents: Contents) -> TrustState {
        self.trust.standing(&Place::new(&self.path, self.origin), file, || contents)
    }

    /// Whether it runs in processes of its own, where it is no WebAssembly module.
    #[must_use]
    pub fn is_isolated(&self) -> bool {
        self.trust.is_isolated(&self.package, &self.file)
    }

    fn names(&self) -> (UnitKind, &str, &str, &Path) {
        (self.kind, &self.package, &self.id, &self.path)
    }
}

impl PartialEq for UnitRef {
    fn eq(&self, other: &Self) -> bool {
        self.names() == other.names()
    }
}

impl Eq for UnitRef {}

impl fmt::Display for UnitRef {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} `{}/{}` ({})", self.kind.word(), self.package, self.id, self.path.display())
    }
}

/// Why no unit was found by a name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FindError {
    /// Nothing of that kind has the name.
    #[error("{}", unknown(.kind, .name, .installed, .suggestion, .other_kinds, .refused))]
    Unknown {
        /// What was asked for.
        kind: UnitKind,
        /// The name as typed.
        name: String,
        /// The names of all units of that kind.
        installed: Vec<String>,
        /// The installed name most like it, where one is.
        suggestion: Option<String>,
        /// Units of other kinds with this name.
        other_kinds: Vec<UnitKind>,
        /// The files refused, each with its reason.
        refused: Vec<String>,
    },
    /// Several packages have a unit of that name.
    #[error("{} `{name}` is in several packages; say which: {}", .kind.word(), .candidates.join(" or "))]
    Ambiguous {
        /// What was asked for.
        kind: UnitKind,
        /// The name as typed.
        name: String,
        /// The names that would be unique.
        candidates: Vec<String>,
    },
}

impl Registry {
    /// Finds a unit by its id, or by package and id as in `org.example.mine/flat`. Where several have the id, those
    /// named on the command line come first, and those that nobody asked for last.
    ///
    /// # Errors
    /// Where there is no such unit or there are several; the message lists what there is.
    pub fn find(&self, kind: UnitKind, name: &str) -> Result<UnitRef, FindError> {
        let mut found = self.preferred(kind, name);
        match found.len() {
            1 => Ok(found.remove(0)),
            0 => Err(self.unknown(kind, name)),
            _ => Err(FindError::Ambiguous {
                kind,
                name: name.to_owned(),
                candidates: found.iter().map(|u| format!("{}/{}", u.package, u.id)).collect(),
            }),
        }
    }

    /// The shortest names that [`find`](Self::find) finds the units of a kind by, sorted.
    #[must_use]
    pub fn names(&self, kind: UnitKind) -> Vec<String> {
        let units = self.units(kind);
        let names = units.map(|(_, manifest, unit)| self.shortest(kind, &manifest.id, &unit.id));
        let mut names: Vec<String> = names.collect();
        names.sort();
        names
    }

    /// The shortest name that [`find`](Self::find) finds a unit by.
    #[must_use]
    pub fn name(&self, unit: &UnitRef) -> String {
        self.shortest(unit.kind, &unit.package, &unit.id)
    }

    fn shortest(&self, kind: UnitKind, package: &str, id: &str) -> String {
        match &self.preferred(kind, id)[..] {
            [only] if only.package == package => id.to_owned(),
            _ => format!("{package}/{id}"),
        }
    }

    /// Those units of a name that come before all others of it.
    fn preferred(&self, kind: UnitKind, name: &str) -> Vec<UnitRef> {
        let rank = |unit: &UnitRef| unit.found.rank(unit.origin);
        let mut found: Vec<UnitRef> = self.matching(kind, name).collect();
        let first = found.iter().map(rank).max();
        found.retain(|unit| Some(rank(unit)) == first);
        found
    }

    fn matching(&self, kind: UnitKind, name: &str) -> impl Iterator<Item = UnitRef> {
        let (package, id) = match name.rsplit_once('/') {
            Some((package, id)) => (Some(package), id),
            None => (None, name),
        };
        self.units(kind)
            .filter(move |(_, manifest, unit)| {
                unit.id == id && package.is_none_or(|package| manifest.id == package)
            })
            .map(|(entry, manifest, unit)| entry.unit(manifest, unit))
    }

    fn unknown(&self, kind: UnitKind, name: &str) -> FindError {
        let installed = self.names(kind);
        let id = name.rsplit_once('/').map_or(name, |(_, id)| id);
        let suggestion = installed
            .iter()
            .map(|known| {
                let known_id = known.rsplit_once('/').map_or(known.as_str(), |(_, id)| id);
                (edit_distance(id, known_id), known)
            })
            // A third of the letters wrong is still likely to be a slip.
            .filter(|(distance, known)| *distance <= 1.max(known.len().min(id.len()) / 3))
            .min()
            .map(|(_, known)| known.clone());
        let other_kinds = [UnitKind::Renderer, UnitKind::Tracer, UnitKind::Tool, UnitKind::Format]
            .into_iter()
            .filter(|&other| other != kind && self.matching(other, name).next().is_some())
            .collect();
        FindError::Unknown {
            kind,
            name: name.to_owned(),
            installed,
            suggestion,
            other_kinds,
            refused: self.entries().iter().filter_map(super::Entry::refusal).collect(),
        }
    }
}

fn unknown(
    kind: &UnitKind,
    name: &str,
    installed: &[String],
    suggestion: &Option<String>,
    other_kinds: &[UnitKind],
    refused: &[String],
) -> String {
    let word = kind.word();
    let mut text = format!("there is no {word} `{name}`");
    for other in other_kinds {
        text += &format!(" (`{name}` is a {})", other.word());
    }
    if let Some(suggestion) = suggestion {
        text += &format!("; did you mean `{suggestion}`?");
    }
    text += &match installed {
        [] => format!("; no {word} is installed"),
        // The host reads these itself.
        _ if *kind == UnitKind::Format => {
            format!("; installed: ply, obj, off, {}", installed.join(", "))
        }
        _ => format!("; installed: {}", installed.join(", ")),
    };
    text += &match refused {
        [] => String::new(),
        [only] => format!("; one plugin was refused: {only}"),
        [first, ..] => format!("; {} plugins were refused, the first: {first}", refused.len()),
    };
    text
}

/// How many letters must be inserted, removed or replaced to turn one word into the other.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, letter) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, other) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(letter != *other);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::edit_distance;

    #[test]
    fn edit_distance_counts_changes() {
        assert_eq!(edit_distance("flat", "flat"), 0);
        assert_eq!(edit_distance("flt", "flat"), 1);
        assert_eq!(edit_distance("kitten", "sitting"), 3);
        assert_eq!(edit_distance("", "abc"), 3);
    }
}
