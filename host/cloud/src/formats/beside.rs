//! A file of the system with those of its folder that its format reads, too, which are opened when they are.

use super::positioned::SystemFile;
use crate::files;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};
use surfelshop_api::format::{FileHost, Recognition, WithFilesBeside};

/// Most files of a folder that are lent: scenes have a few, and a folder of scans may have many.
const MOST: usize = 4096;

/// A file of the folder.
struct OnDemand {
    path: PathBuf,
    length: u64,
    opened: OnceLock<Result<SystemFile, String>>,
}

impl FileHost for OnDemand {
    fn length(&self) -> u64 {
        self.length
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
        let open = || {
            let (file, _) = files::open(&self.path).map_err(|fault| fault.to_string())?;
            // As long as it was said to be, whatever somebody writes meanwhile.
            Ok(SystemFile::new(file, self.length))
        };
        let opened = self.opened.get_or_init(open);
        let name = || self.path.file_name().unwrap_or_default().display();
        let file =
            opened.as_ref().map_err(|line| io::Error::other(format!("{}: {line}", name())))?;
        file.read_at(offset, buffer)
    }
}

/// A file, with those beside it that its format says it reads: names, or `*` with what they end with. Links are followed.
/// Of very many the first ones by name, before others those whose names begin like the file's; a folder that cannot be
/// listed has none.
pub(crate) fn with_files_beside(
    path: &Path,
    file: SystemFile,
    beside: Vec<String>,
) -> Arc<dyn FileHost> {
    if beside.is_empty() {
        return Arc::new(file);
    }
    let folder = files::folder_of(path);
    let lent = |path: PathBuf| {
        let metadata = path.metadata().ok().filter(std::fs::Metadata::is_file)?;
        Some(Arc::new(OnDemand { path, length: metadata.len(), opened: OnceLock::new() }) as _)
    };
    // Where whole names say all, the folder is not listed: it may be a large one.
    let named = |name: &String| {
        let file = (!name.starts_with('*')).then(|| lent(folder.join(name))).flatten();
        file.map(|file: Arc<dyn FileHost>| (name.clone(), file))
    };
    let found: Vec<_> = beside.iter().filter_map(named).collect();
    let found = match found.len() == beside.len() {
        true => found,
        false => {
            let names = names_in(folder, path, Recognition { beside, ..Recognition::default() });
            let files =
                names.into_iter().filter_map(|name| Some((name.clone(), lent(folder.join(name))?)));
            files.take(MOST).collect()
        }
    };
    match found.is_empty() {
        true => Arc::new(file),
        false => Arc::new(WithFilesBeside::new(Arc::new(file), found)),
    }
}

/// The names in a folder that a format says it reads beside a file, without that file's own.
fn names_in(folder: &Path, path: &Path, format: Recognition) -> Vec<String> {
    let listed = folder.read_dir().into_iter().flatten().flatten();
    let mut names: Vec<String> = listed
        .filter(|entry| Some(entry.file_name().as_os_str()) != path.file_name())
        .filter_map(|entry| entry.file_name().into_string().ok())
        .filter(|name| format.reads_beside(name))
        .collect();
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    names.sort_unstable_by(|a, b| (!a.starts_with(&stem), a).cmp(&(!b.starts_with(&stem), b)));
    names
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::{self, File};

    fn names(path: &Path, beside: &[&str]) -> Vec<String> {
        let file = SystemFile::new(File::open(path).unwrap(), path.metadata().unwrap().len());
        let beside = beside.iter().map(|&name| name.to_owned()).collect();
        let lent = with_files_beside(path, file, beside);
        lent.beside().into_iter().map(|file| file.name).collect()
    }

    /// Invariant: of a folder a format is lent the files that it names, and no others
    #[test]
    fn a_format_is_lent_the_files_that_it_names() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in ["town.json", "b.bin", "town1.bin", "secret.txt", "A.BIN", "octree.bin.old"] {
            fs::write(at(name), name).unwrap();
        }
        fs::create_dir(at("folder.bin")).unwrap();
        let town = at("town.json");
        assert_eq!(names(&town, &["*.bin"]), ["town1.bin", "A.BIN", "b.bin"]);
        assert_eq!(names(&town, &["b.bin", "town1.bin"]), ["b.bin", "town1.bin"]);
        assert_eq!(names(&town, &["a.bin", "octree.bin"]), ["A.BIN"], "in another case");
        assert_eq!(names(&town, &["*.json", "town.json"]), [""; 0], "itself");
        assert_eq!(names(&town, &[]), [""; 0]);
        assert_eq!(names(&at("b.bin"), &["*.bin"]), ["A.BIN", "town1.bin"]);
    }

    #[test]
    fn a_file_beside_one_is_as_long_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let [town, beside] = ["town.json", "b.bin"].map(|name| folder.path().join(name));
        fs::write(&town, "{}").unwrap();
        fs::write(&beside, "0123").unwrap();
        let file = SystemFile::new(File::open(&town).unwrap(), 2);
        let lent = with_files_beside(&town, file, vec!["b.bin".to_owned()]);
        let [found] = &lent.beside()[..] else { panic!("one file") };
        assert_eq!((found.length, lent.length()), (4, 2));
        fs::write(&beside, "01234567").unwrap();
        let mut buffer = [0; 8];
        assert_eq!(lent.read_at(found.at + 1, &mut buffer).unwrap(), 3);
        assert_eq!(&buffer[..3], b"123");
        assert_eq!(lent.read_at(1, &mut buffer).unwrap(), 1);
        assert_eq!(lent.read_at(found.at + (1 << 48), &mut buffer).unwrap(), 0);
        // What cannot be opened says so.
        let file = SystemFile::new(File::open(&town).unwrap(), 2);
        let lent = with_files_beside(&town, file, vec!["b.bin".to_owned()]);
        fs::remove_file(&beside).unwrap();
        let line = lent.read_at(found.at, &mut buffer).unwrap_err().to_string();
        assert!(line.starts_with("b.bin: "), "{line}");
    }
}
