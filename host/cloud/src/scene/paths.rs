//! Paths of clouds relative to the scene that names them.

use std::path::{Component, Path, PathBuf};

/// A path from the current folder as one from another folder, where it lies in that folder or in
/// the one around it; absolute elsewhere.
pub(super) fn relative(path: &Path, folder: &Path) -> PathBuf {
    let (path, folder) = (absolute(path), absolute(folder));
    if let Ok(inside) = path.strip_prefix(&folder) {
        return inside.to_owned();
    }
    let beside = folder.parent().filter(|around| around.parent().is_some());
    match beside.and_then(|around| path.strip_prefix(around).ok()) {
        Some(beside) => Path::new("..").join(beside),
        None => path,
    }
}

/// The path of a cloud of a scene in `old`, as a scene in `new` names it.
pub(super) fn moved(path: &Path, old: &Path, new: &Path) -> PathBuf {
    let stays = path.is_absolute() || absolute(old) == absolute(new);
    if stays { path.to_owned() } else { relative(&old.join(path), new) }
}

/// The path from the root, without `.` and `..`. Folders that exist are followed through links,
/// since what `..` means depends on them; the file itself keeps its name.
fn absolute(path: &Path) -> PathBuf {
    let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
    // Nothing is absolute where the current folder is gone.
    let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let mut known = PathBuf::new();
    for component in whole.components() {
        match component {
            Component::ParentDir => drop(known.pop()),
            Component::CurDir => {}
            other => known.push(other),
        }
        if known.is_dir()
            && let Ok(followed) = known.canonicalize()
        {
            known = followed;
        }
    }
    known
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    fn named(path: &str, folder: &str) -> String {
        relative(Path::new(path), Path::new(folder)).display().to_string()
    }

    #[test]
    fn what_lies_in_the_folder_or_beside_it_is_relative() {
        assert_eq!(named("/no/such/a.ply", "/no/such"), "a.ply");
        assert_eq!(named("/no/such/x/../y/a.ply", "/no/./such/"), "y/a.ply");
        assert_eq!(named("/no/data/a.ply", "/no/such"), "../data/a.ply");
        assert_eq!(named("/no/a.ply", "/no/such"), "../a.ply");
        assert_eq!(named("/other/a.ply", "/no/such/folder"), "/other/a.ply");
        // Everything lies beside a folder at the root.
        assert_eq!(named("/other/a.ply", "/no"), "/other/a.ply");
    }

    #[test]
    fn the_current_folder_has_an_empty_name() {
        assert_eq!(named("no-such/a.ply", ""), "no-such/a.ply");
        assert_eq!(named("./no-such/a.ply", "."), "no-such/a.ply");
    }

    #[test]
    fn a_scene_that_stays_names_its_clouds_as_before() {
        let same =
            |path: &str, old: &str, new: &str| moved(path.as_ref(), old.as_ref(), new.as_ref());
        assert_eq!(
            same("../../far/./a.ply", "/no/such", "/no/such/."),
            Path::new("../../far/./a.ply")
        );
        assert_eq!(same("/no/such/a.ply", "/no/such", "/no/other"), Path::new("/no/such/a.ply"));
        assert_eq!(same("a.ply", "/no/such", "/no/other"), Path::new("../such/a.ply"));
        assert_eq!(same("a.ply", "/no/such", "/elsewhere/other"), Path::new("/no/such/a.ply"));
    }

    #[test]
    fn links_are_followed_to_the_folder_and_not_to_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let [real, link] = ["real", "link"].map(|name| folder.path().join(name));
        std::fs::create_dir(&real).unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        std::fs::write(real.join("a.ply"), "").unwrap();
        std::os::unix::fs::symlink(real.join("a.ply"), real.join("b.ply")).unwrap();
        assert_eq!(relative(&link.join("b.ply"), &real), Path::new("b.ply"));
        assert_eq!(relative(&folder.path().join("c.ply"), &link), Path::new("../c.ply"));
    }
}
