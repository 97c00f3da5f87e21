//! Files of a command: what it reads is not replaced by what it writes, and what it writes appears whole or not
//! at all.

use anyhow::{Context as _, anyhow, bail, ensure};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use surfelshop_cloud::files::{self, OpenFault, folder_of};

/// What the running command reads, by where it really lies.
static INPUTS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// The contents of a file that is expected to be short: no folder, pipe or device is read, and nothing longer.
pub fn read_short(path: &Path, most: u64) -> anyhow::Result<Vec<u8>> {
    let name = path.display();
    files::read(path, most).map_err(|fault| match fault {
        OpenFault::Io(error) => {
            anyhow::Error::new(error).context(format!("{name}: cannot be read"))
        }
        OpenFault::NotAFile { found } => anyhow!("{name}: expected a file, found {found}"),
        other => anyhow!("{name}: {other}"),
    })
}

/// Notes files that the command reads: whatever it writes, it does not replace them.
pub fn protect<'a>(inputs: impl IntoIterator<Item = &'a Path>) {
    let mut known = INPUTS.lock().unwrap_or_else(PoisonError::into_inner);
    known.extend(inputs.into_iter().filter_map(|path| path.canonicalize().ok()));
}

/// Lets a file that the command reads be replaced by it after all.
pub fn allow(input: &Path) {
    let input = input.canonicalize().ok();
    let mut known = INPUTS.lock().unwrap_or_else(PoisonError::into_inner);
    known.retain(|other| Some(other) != input.as_ref());
}

/// Refuses to replace what the command reads.
fn check_no_input(path: &Path, target: &Path) -> anyhow::Result<()> {
    let inputs = INPUTS.lock().unwrap_or_else(PoisonError::into_inner);
    ensure!(
        !inputs.iter().any(|input| input == target),
        "{}: expected a file to write, found one that the same command reads; name another",
        path.display()
    );
    Ok(())
}

/// Says early, before long work, which of these files could not be written: there is no such folder, the
/// command reads it, or writes it twice.
pub fn check_outputs(outputs: &[&Path]) -> anyhow::Result<()> {
    let mut targets: Vec<PathBuf> = Vec::with_capacity(outputs.len());
    for path in outputs {
        check_folder(path)?;
        let target = target(path)?;
        check_no_input(path, &target)?;
        ensure!(
            !targets.contains(&target),
            "{}: expected a file to write, found one that the same command writes already; name \
             another",
            path.display()
        );
        targets.push(target);
    }
    Ok(())
}

/// Where a file would be written, links and the folder's other names resolved.
fn target(path: &Path) -> anyhow::Result<PathBuf> {
    let target = files::replaceable(path).with_context(|| path.display().to_string())?;
    let folder =
        folder_of(&target).canonicalize().unwrap_or_else(|_| folder_of(&target).to_owned());
    Ok(folder.join(target.file_name().unwrap_or_default()))
}

/// Says early, before long work, that a file could not be written.
pub fn check_folder(path: &Path) -> anyhow::Result<()> {
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
pub fn check_writable(path: &Path) -> anyhow::Result<()> {
    check_outputs(&[path])?;
    files::check_writable(path).with_context(|| format!("{}: cannot be written", path.display()))
}

/// Writes a file beside its target and renames it when it is complete, so that a failure leaves
/// what stood there before.
pub fn write_whole(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    check_folder(path)?;
    check_no_input(path, &target(path)?)?;
    files::write_whole(path, bytes)
        .with_context(|| format!("{}: cannot be written", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_folders_are_named() {
        let error = check_folder(Path::new("no-such-folder/a.png")).unwrap_err().to_string();
        assert!(error.contains("no-such-folder") && error.contains("make it first"), "{error}");
    }

    #[test]
    fn a_file_is_written_once_and_never_over_what_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let input = at("in.ply");
        std::fs::write(&input, "points").unwrap();
        protect([input.as_path()]);
        let refused = |outputs: &[&Path]| check_outputs(outputs).unwrap_err().to_string();
        assert!(refused(&[&input]).contains("the same command reads"));
        let other_name = folder.path().join("..").join(folder.path().file_name().unwrap());
        assert!(refused(&[&other_name.join("in.ply")]).contains("the same command reads"));
        assert!(refused(&[&at("a.png"), &at("a.png")]).contains("writes already"));
        assert!(refused(&[&at("a.png"), &other_name.join("a.png")]).contains("writes already"));
        check_outputs(&[&at("a.png"), &at("b.png")]).unwrap();
        assert!(write_whole(&input, b"graph").is_err());
        assert_eq!(std::fs::read(&input).unwrap(), b"points");
    }
}
