//! Files that appear whole or not at all.

use anyhow::{Context as _, bail};
use std::fs::File;
use std::io::{Read as _, Write as _};
use std::path::Path;

/// The folder a file lies in.
fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The contents of a file that is expected to be short: no folder, pipe or device is read, and nothing longer.
pub(crate) fn read_short(path: &Path, most: u64) -> anyhow::Result<Vec<u8>> {
    let name = path.display();
    let cannot = || format!("{name}: cannot be read");
    // Opening a pipe would wait for a writer, so the type is asked for first.
    let facts = path.metadata().with_context(cannot)?;
    if !facts.is_file() {
        let found = if facts.is_dir() { "a folder" } else { "no regular file" };
        bail!("{name}: expected a file, found {found}");
    }
    let mut bytes = Vec::new();
    if facts.len() <= most {
        File::open(path)
            .with_context(cannot)?
            .take(most + 1)
            .read_to_end(&mut bytes)
            .with_context(cannot)?;
    }
    let found = facts.len().max(bytes.len() as u64);
    if found > most {
        bail!("{name}: expected at most {most} bytes, found {found}");
    }
    Ok(bytes)
}

/// Says early, before long work, that a file could not be written.
pub(crate) fn check_folder(path: &Path) -> anyhow::Result<()> {
    let folder = folder_of(path);
    if !folder.is_dir() {
        let found = if folder.exists() { "a file of that name" } else { "no such folder" };
        let (path, folder) = (path.display(), folder.display());
        bail!("{path}: expected a folder {folder} to write into, found {found}; make it first");
    }
    if path.is_dir() {
        bail!("{}: expected a file to write, found a folder; name a file", path.display());
    }
    Ok(())
}

/// Says early, before long work, that the folder of a file takes no new files.
pub(crate) fn check_writable(path: &Path) -> anyhow::Result<()> {
    check_folder(path)?;
    let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let made = tempfile::Builder::new().prefix(".surfelshop-").tempfile_in(folder_of(&target));
    made.map(drop).with_context(|| format!("{}: cannot be written", path.display()))
}

/// Writes a file beside its target and renames it when it is complete, so that a failure leaves
/// what stood there before.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    check_folder(path)?;
    // Renaming onto a link would replace the link rather than the file it names.
    let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let write = || -> std::io::Result<()> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(".surfelshop-").suffix(".part");
        // Temporary files are private by default; a picture that a user asked for has the usual
        // rights.
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt as _;
            builder.permissions(std::fs::Permissions::from_mode(0o666));
        }
        let mut file = builder.tempfile_in(folder_of(&target))?;
        file.write_all(bytes)?;
        file.flush()?;
        file.persist(&target)?;
        Ok(())
    };
    write().with_context(|| format!("{}: cannot be written", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_replaced_whole_and_nothing_else_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        write_whole(&path, b"first").unwrap();
        write_whole(&path, b"second").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"second");
        assert_eq!(folder.path().read_dir().unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn files_have_the_usual_rights() {
        use std::os::unix::fs::PermissionsExt as _;
        let folder = tempfile::tempdir().unwrap();
        let (ours, usual) = (folder.path().join("a"), folder.path().join("b"));
        write_whole(&ours, b"").unwrap();
        std::fs::write(&usual, b"").unwrap();
        let mode = |path: &Path| path.metadata().unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&usual));
    }

    #[test]
    fn missing_folders_are_named() {
        let error = check_folder(Path::new("no-such-folder/a.png")).unwrap_err().to_string();
        assert!(error.contains("no-such-folder") && error.contains("make it first"), "{error}");
    }
}
