//! The listing of a folder.

use std::io;
use std::path::{Path, PathBuf};

/// Most entries that are listed: others can be typed.
const MOST: usize = 10_000;

/// A folder or file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Entry {
    pub(super) path: PathBuf,
    pub(super) is_folder: bool,
    /// Bytes of a file.
    pub(super) len: u64,
}

impl Entry {
    /// Its name; a folder's ends with a slash.
    pub(super) fn name(&self) -> String {
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        if self.is_folder { format!("{name}/") } else { name.into_owned() }
    }
}

/// The contents of a folder.
#[derive(Debug, Default)]
pub(super) struct Listing {
    /// Folders first, sorted by name.
    pub(super) entries: Vec<Entry>,
    /// Whether there are more entries.
    pub(super) is_cut: bool,
}

/// Whether a file has one of these endings, or one with a dot in it as its whole name; with no endings every file fits.
pub(super) fn fits(path: &Path, endings: &[String]) -> bool {
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    let fits = |known: &String| match known.contains('.') {
        true => name == *known || name.ends_with(&format!(".{known}")),
        false => ending.eq_ignore_ascii_case(known),
    };
    endings.is_empty() || endings.iter().any(fits)
}

/// Lists folders and the files with these endings, without hidden ones.
pub(super) fn list(folder: &Path, endings: &[String]) -> io::Result<Listing> {
    let mut listing = Listing::default();
    for found in folder.read_dir()?.flatten() {
        let path = found.path();
        if found.file_name().to_string_lossy().starts_with('.') {
            continue;
        }
        // Metadata follow links.
        let Ok(facts) = path.metadata() else { continue };
        if !facts.is_dir() && !fits(&path, endings) {
            continue;
        }
        if listing.entries.len() == MOST {
            listing.is_cut = true;
            break;
        }
        listing.entries.push(Entry { path, is_folder: facts.is_dir(), len: facts.len() });
    }
    listing.entries.sort_by_cached_key(|entry| (!entry.is_folder, entry.name().to_lowercase()));
    Ok(listing)
}

/// The path of typed text: `~` is the user's home, and a relative path begins in `folder`.
pub(super) fn typed(text: &str, folder: &Path) -> PathBuf {
    let text = text.trim();
    match (text.strip_prefix('~'), std::env::home_dir()) {
        (Some(rest), Some(home)) if rest.is_empty() || rest.starts_with('/') => {
            home.join(rest.trim_start_matches('/'))
        }
        _ => folder.join(text),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_come_first_and_files_are_chosen_by_their_endings() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["b.ply", "A.PLY", "notes.txt", ".hidden.ply", "Meta.json", "x.json"] {
            std::fs::write(folder.path().join(name), "12").unwrap();
        }
        std::fs::create_dir(folder.path().join("scans")).unwrap();
        let names = |endings: &[String]| {
            let listed = list(folder.path(), endings).unwrap();
            listed.entries.iter().map(Entry::name).collect::<Vec<_>>()
        };
        assert_eq!(names(&["ply".to_owned()]), ["scans/", "A.PLY", "b.ply"]);
        assert_eq!(names(&["meta.json".to_owned()]), ["scans/", "Meta.json"]);
        assert_eq!(names(&[]), ["scans/", "A.PLY", "b.ply", "Meta.json", "notes.txt", "x.json"]);
        assert!(list(&folder.path().join("none"), &[]).is_err());
    }

    #[test]
    fn what_is_typed_may_be_whole_or_begin_in_the_folder() {
        let folder = Path::new("/data");
        assert_eq!(typed(" a.ply ", folder), Path::new("/data/a.ply"));
        assert_eq!(typed("/tmp/a.ply", folder), Path::new("/tmp/a.ply"));
        let home = std::env::home_dir().unwrap();
        assert_eq!(typed("~/a.ply", folder), home.join("a.ply"));
        assert_eq!(typed("~a.ply", folder), Path::new("/data/~a.ply"));
    }
}
