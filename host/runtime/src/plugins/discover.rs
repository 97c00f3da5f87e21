//! Where plugins lie: beside the program, in the user's folder, in `SURFELSHOP_PLUGINS` and where
//! the command line says.

use super::trust::{Trust, located, resolved};
use serde::Serialize;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Paths of plugin files and folders, separated as in `PATH`.
const VARIABLE: &str = "SURFELSHOP_PLUGINS";

/// Who named the place a plugin was found in; later ones take precedence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// The folder of the running program, or its subfolder `plugins`.
    BesideProgram,
    /// The folder for plugins among the user's data.
    UserFolder,
    /// The variable `SURFELSHOP_PLUGINS`.
    Environment,
    /// The option `--plugin`.
    CommandLine,
}

/// A file or folder to search.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The file or folder.
    pub path: PathBuf,
    /// Who named it.
    pub origin: Origin,
    /// Whether other libraries are at home here too, so that those without a manifest are left
    /// out of the list instead of being refused.
    pub shared: bool,
}

impl Place {
    /// A place that is meant for plugins.
    #[must_use]
    pub fn new(path: impl Into<PathBuf>, origin: Origin) -> Self {
        Self { path: path.into(), origin, shared: false }
    }
}

/// Where to look for plugins.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SearchPath {
    /// Folders whose libraries are listed, without their subfolders; missing ones are fine.
    pub folders: Vec<Place>,
    /// Files that are listed whatever they are; missing ones are listed as refused.
    pub files: Vec<Place>,
    /// What of it may run.
    pub trust: Trust,
}

impl SearchPath {
    /// The program's own folder and its `plugins`, the user's folder, the places in
    /// `SURFELSHOP_PLUGINS`, and these files; what of them may run.
    #[must_use]
    pub fn standard(extra_files: Vec<PathBuf>, trust: Trust) -> Self {
        let mut search = Self { trust, ..Self::default() };
        if let Some(folder) = std::env::current_exe().ok().as_deref().and_then(Path::parent) {
            let origin = Origin::BesideProgram;
            search.folders.push(Place { shared: true, ..Place::new(folder, origin) });
            search.folders.push(Place::new(folder.join("plugins"), origin));
            search.trust.own_folder(folder);
            search.trust.own_folder(&folder.join("plugins"));
        }
        if let Some(folder) = user_plugins_folder() {
            search.folders.push(Place::new(folder, Origin::UserFolder));
        }
        if let Some(list) = std::env::var_os(VARIABLE) {
            search.add_list(&list);
        }
        let origin = Origin::CommandLine;
        search.files.extend(extra_files.into_iter().map(|path| Place::new(path, origin)));
        search
    }

    /// Adds the files and folders of a list as it stands in `SURFELSHOP_PLUGINS`.
    pub fn add_list(&mut self, list: &OsString) {
        for path in std::env::split_paths(list).filter(|path| !path.as_os_str().is_empty()) {
            // What does not exist is reported where its name says that a file was meant.
            let is_file = path.is_file() || (!path.exists() && has_library_extension(&path));
            let places = if is_file { &mut self.files } else { &mut self.folders };
            places.push(Place::new(path, Origin::Environment));
        }
    }

    /// The files to inspect: by origin, folders before files, names in order; each file once, at
    /// the place of highest precedence that names it, but that a link from elsewhere takes the place of no
    /// file of the program.
    pub(super) fn candidates(&self) -> Vec<Place> {
        let mut found: Vec<Place> = Vec::new();
        for origin in
            [Origin::BesideProgram, Origin::UserFolder, Origin::Environment, Origin::CommandLine]
        {
            for folder in self.folders.iter().filter(|place| place.origin == origin) {
                found.extend(libraries_in(folder));
            }
            found.extend(self.files.iter().filter(|place| place.origin == origin).cloned());
        }
        let identities: Vec<PathBuf> = found.iter().map(|place| resolved(&place.path)).collect();
        // Among places of one origin the first name stays: it is the one to expect in a list.
        let mut keep: BTreeMap<&Path, usize> = BTreeMap::new();
        for (i, identity) in identities.iter().enumerate() {
            let kept = keep.entry(identity).or_insert(i);
            let lies_there = |place: &Place| located(&place.path) == *identity;
            let is_of_program =
                found[*kept].origin == Origin::BesideProgram && lies_there(&found[*kept]);
            if found[*kept].origin < found[i].origin && (lies_there(&found[i]) || !is_of_program) {
                *kept = i;
            }
        }
        let mut order: Vec<usize> = keep.into_values().collect();
        order.sort_unstable();
        order.into_iter().map(|i| found[i].clone()).collect()
    }
}

/// The libraries of a folder in the order of their names.
pub(super) fn libraries_in(folder: &Place) -> Vec<Place> {
    let Ok(listing) = folder.path.read_dir() else { return Vec::new() };
    let mut paths: Vec<PathBuf> = listing
        .flatten()
        .map(|found| found.path())
        .filter(|path| has_library_extension(path))
        .collect();
    paths.sort();
    paths.into_iter().map(|path| Place { path, ..folder.clone() }).collect()
}

/// Whether a name ends as libraries of any system do, or WebAssembly modules: libraries of other systems are listed
/// with the reason why they do not work here.
#[must_use]
pub fn has_library_extension(path: &Path) -> bool {
    let extension = path.extension().and_then(|extension| extension.to_str());
    extension
        .is_some_and(|e| ["so", "dylib", "dll", "wasm"].iter().any(|l| e.eq_ignore_ascii_case(l)))
}

/// The folder for the user's own plugins; `None` where the system names none.
#[must_use]
pub fn user_plugins_folder() -> Option<PathBuf> {
    user_folder(|name| std::env::var_os(name))
}

fn user_folder(variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    let base = Base {
        windows: ("APPDATA", "Surfelshop"),
        macos: "Library/Application Support/Surfelshop",
        variable: "XDG_DATA_HOME",
        home: ".local/share",
    };
    base.folder(variable).map(|data| data.join("plugins"))
}

/// The folder for what the program remembers from one start to the next; `None` where the system
/// names none.
#[must_use]
pub fn state_folder() -> Option<PathBuf> {
    state_folder_of(|name| std::env::var_os(name))
}

fn state_folder_of(variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    let base = Base {
        windows: ("LOCALAPPDATA", "Surfelshop"),
        macos: "Library/Application Support/Surfelshop",
        variable: "XDG_STATE_HOME",
        home: ".local/state",
    };
    base.folder(variable)
}

/// The folder for what could be made again; `None` where the system names none.
#[must_use]
pub fn cache_folder() -> Option<PathBuf> {
    let base = Base {
        windows: ("LOCALAPPDATA", "Surfelshop/cache"),
        macos: "Library/Caches/Surfelshop",
        variable: "XDG_CACHE_HOME",
        home: ".cache",
    };
    base.folder(|name| std::env::var_os(name))
}

/// Where systems have a folder of one kind.
struct Base {
    /// Variable, and path from what it names.
    windows: (&'static str, &'static str),
    /// Path from the home folder.
    macos: &'static str,
    /// Elsewhere: the variable of the base directory rules, and the usual path from the home folder.
    variable: &'static str,
    home: &'static str,
}

impl Base {
    fn folder(&self, variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
        // An empty or relative folder would depend on where the program was started.
        let folder = |name| variable(name).map(PathBuf::from).filter(|path| path.is_absolute());
        if cfg!(windows) {
            folder(self.windows.0).map(|base| base.join(self.windows.1))
        } else if cfg!(target_os = "macos") {
            folder("HOME").map(|home| home.join(self.macos))
        } else {
            folder(self.variable)
                .or_else(|| folder("HOME").map(|home| home.join(self.home)))
                .map(|base| base.join("surfelshop"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(not(any(windows, target_os = "macos")))]
    fn user_folder_follows_the_base_directory_rules() {
        let with = |data: &'static str| {
            user_folder(move |name| match name {
                "XDG_DATA_HOME" => Some(data.into()),
                "HOME" => Some("/home/me".into()),
                _ => None,
            })
        };
        assert_eq!(with("/data"), Some("/data/surfelshop/plugins".into()));
        let home = Some(PathBuf::from("/home/me/.local/share/surfelshop/plugins"));
        assert_eq!(with(""), home);
        assert_eq!(with("relative"), home);
        assert_eq!(user_folder(|_| None), None);
        let at_home = |name: &str| (name == "HOME").then(|| "/home/me".into());
        assert_eq!(state_folder_of(at_home), Some("/home/me/.local/state/surfelshop".into()));
    }

    #[test]
    fn lists_are_split_into_files_and_folders() {
        let folder = tempfile::tempdir().unwrap();
        let missing_file = folder.path().join("missing.so");
        let missing_folder = folder.path().join("missing");
        let list = [folder.path(), &missing_file, &missing_folder, Path::new("")];
        let mut search = SearchPath::default();
        search.add_list(&std::env::join_paths(list).unwrap());
        assert_eq!(search.files, [Place::new(missing_file, Origin::Environment)]);
        let folders = [folder.path().to_owned(), missing_folder];
        assert_eq!(search.folders, folders.map(|path| Place::new(path, Origin::Environment)));
    }

    #[test]
    fn candidates_are_ordered_by_origin_then_name_and_listed_once() {
        let (beside, user) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        for name in ["b.so", "a.dll", "notes.txt", "c.so"] {
            std::fs::write(beside.path().join(name), "").unwrap();
        }
        std::fs::write(user.path().join("a.so"), "").unwrap();
        let search = SearchPath {
            folders: vec![
                Place::new(user.path(), Origin::UserFolder),
                Place::new(beside.path(), Origin::BesideProgram),
                Place::new(beside.path(), Origin::BesideProgram),
            ],
            files: vec![Place::new(beside.path().join("b.so"), Origin::CommandLine)],
            ..SearchPath::default()
        };
        let found: Vec<(Origin, PathBuf)> =
            search.candidates().into_iter().map(|place| (place.origin, place.path)).collect();
        let expected = [
            (Origin::BesideProgram, beside.path().join("a.dll")),
            (Origin::BesideProgram, beside.path().join("c.so")),
            (Origin::UserFolder, user.path().join("a.so")),
            (Origin::CommandLine, beside.path().join("b.so")),
        ];
        assert_eq!(found, expected);
    }
}
