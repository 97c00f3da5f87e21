//! `surfelshop setup`: what a desktop and a shell need to know of the program.
//!
//! Files go below a prefix, and a list of them beside, by which they are removed again.

mod desktop;
mod generated;

use crate::arguments::SetupArguments;
use anyhow::{Context as _, ensure};
use serde_json::json;
use std::fs;
use std::path::{Component, Path, PathBuf};
use surfelshop_cloud::files::write_whole;
use surfelshop_session::output::terminal;

/// The list of what was written, below the prefix.
const LIST: &str = "share/surfelshop/setup.txt";

/// Most bytes of a list: some forty names.
const LARGEST_LIST: u64 = 1 << 20;

/// A file below the prefix, and what it holds.
struct File {
    path: PathBuf,
    bytes: Vec<u8>,
}

/// Runs the command.
pub(crate) fn run(arguments: &SetupArguments) -> anyhow::Result<()> {
    let prefix = match &arguments.prefix {
        Some(prefix) => std::path::absolute(prefix)
            .with_context(|| format!("{}: there is no current folder", prefix.display()))?,
        None => own_prefix()?,
    };
    let removed = remove(&prefix)?;
    if arguments.remove {
        return told(arguments, "removed", &prefix, &removed);
    }
    let files = files(arguments)?;
    let mut written = Vec::new();
    // First the list, so that what is written after a failure can be removed, too.
    let names = files.iter().map(|file| file.path.as_path());
    let link = linked(arguments).then(|| PathBuf::from("bin/surfelshop"));
    // Before anything is written: what is in the list is removed later, and a link of the user's must not be in it.
    if let Some(link) = &link {
        check_free(&prefix.join(link))?;
    }
    let names: Vec<&Path> = names.chain(link.as_deref()).chain([Path::new(LIST)]).collect();
    let list: String = names.iter().map(|name| format!("{}\n", name.display())).collect();
    write(&prefix.join(LIST), list.as_bytes())?;
    for file in &files {
        write(&prefix.join(&file.path), &file.bytes)?;
        written.push(file.path.clone());
    }
    if let Some(link) = link {
        make_link(&prefix.join(&link))?;
        written.push(link);
    }
    written.push(PathBuf::from(LIST));
    told(arguments, "wrote", &prefix, &written)
}

/// The user's own prefix.
fn own_prefix() -> anyhow::Result<PathBuf> {
    let home = std::env::home_dir().filter(|home| home.is_absolute());
    let home = home.context("there is no home folder; name a folder with --prefix")?;
    Ok(home.join(".local"))
}

/// Everything that is written, but the list and the link.
fn files(arguments: &SetupArguments) -> anyhow::Result<Vec<File>> {
    let program = match &arguments.program {
        Some(program) => program.clone(),
        None => own_program()?.display().to_string(),
    };
    let mut files = generated::files()?;
    files.extend(desktop::files(&program)?);
    Ok(files)
}

fn own_program() -> anyhow::Result<PathBuf> {
    std::env::current_exe()
        .context("the place of this program is not known; name it with --program")
}

/// Whether a link to this program is made: where nobody says how it is started.
fn linked(arguments: &SetupArguments) -> bool {
    cfg!(unix) && arguments.program.is_none()
}

/// Refuses to link where something stands.
fn check_free(at: &Path) -> anyhow::Result<()> {
    let name = at.display();
    ensure!(
        own_program()? != at,
        "{name}: this program stands there itself; choose another --prefix"
    );
    ensure!(
        at.symlink_metadata().is_err(),
        "{name}: expected nothing there, or a link of an earlier setup; remove it first"
    );
    Ok(())
}

#[cfg(unix)]
fn make_link(at: &Path) -> anyhow::Result<()> {
    let cannot = || format!("{}: the link cannot be made", at.display());
    fs::create_dir_all(at.parent().unwrap_or(at)).with_context(cannot)?;
    std::os::unix::fs::symlink(own_program()?, at).with_context(cannot)
}

#[cfg(not(unix))]
fn make_link(_: &Path) -> anyhow::Result<()> {
    Ok(())
}

/// Writes a file, whole or not at all, and makes its folder.
fn write(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let cannot = || format!("{}: cannot be written", path.display());
    fs::create_dir_all(path.parent().unwrap_or(path)).with_context(cannot)?;
    write_whole(path, bytes).with_context(cannot)
}

/// Removes what an earlier setup wrote below a prefix, and folders that are empty then; their names.
fn remove(prefix: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let list = prefix.join(LIST);
    let size = match fs::metadata(&list) {
        Ok(metadata) => metadata.len(),
        Err(_) => return Ok(Vec::new()),
    };
    let cannot = || format!("{}: cannot be read", list.display());
    ensure!(
        size <= LARGEST_LIST,
        "{}: expected a list of files, found {size} bytes",
        list.display()
    );
    let text = fs::read_to_string(&list).with_context(cannot)?;
    let mut removed = Vec::new();
    for name in text.lines().map(Path::new) {
        let is_below = name.components().all(|part| matches!(part, Component::Normal(_)));
        ensure!(
            is_below && name.components().next().is_some(),
            "{}: expected names below {}, found `{}`; nothing more is removed",
            list.display(),
            prefix.display(),
            name.display()
        );
        let path = prefix.join(name);
        // A program that was put in place of the link is not this command's.
        let is_ours = path.symlink_metadata().is_ok_and(|found| {
            !found.is_dir() && (found.is_symlink() || name != Path::new("bin/surfelshop"))
        });
        if !is_ours {
            continue;
        }
        fs::remove_file(&path).with_context(|| format!("{}: cannot be removed", path.display()))?;
        removed.push(name.to_owned());
        for folder in name.ancestors().skip(1).filter(|folder| !folder.as_os_str().is_empty()) {
            // One that holds something else stays.
            if fs::remove_dir(prefix.join(folder)).is_err() {
                break;
            }
        }
    }
    Ok(removed)
}

/// Says what was done.
fn told(
    arguments: &SetupArguments,
    what: &str,
    prefix: &Path,
    files: &[PathBuf],
) -> anyhow::Result<()> {
    if arguments.report.json {
        return terminal::json(&json!({
            "command": "setup",
            "prefix": prefix.display().to_string(),
            "done": what,
            "files": files.iter().map(|file| file.display().to_string()).collect::<Vec<_>>(),
        }));
    }
    let (n, prefix) = (files.len(), prefix.display());
    terminal::line(format!("{what} {n} files below {prefix}"))?;
    if what == "wrote" {
        terminal::line(
            "A new shell completes commands, `man surfelshop` shows them, and desktops open clouds and scenes.\n\
             `surfelshop setup --remove` with the same --prefix takes everything away again.",
        )?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arguments(prefix: &Path) -> SetupArguments {
        SetupArguments {
            prefix: Some(prefix.to_owned()),
            program: Some("surfelshop".to_owned()),
            remove: false,
            report: Default::default(),
        }
    }

    #[test]
    fn what_is_written_is_removed_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let prefix = folder.path().join("usr");
        let other = prefix.join("share/man/man1/other.1");
        fs::create_dir_all(other.parent().unwrap()).unwrap();
        fs::write(&other, "mine").unwrap();
        let given = arguments(&prefix);
        run(&given).unwrap();
        for name in
            ["share/man/man1/surfelshop-render.1", "share/applications/surfelshop.desktop", LIST]
        {
            assert!(prefix.join(name).is_file(), "{name}");
        }
        // Once more: what an earlier version wrote does not stay.
        let list = prefix.join(LIST);
        let more = fs::read_to_string(&list).unwrap() + "share/surfelshop/old.txt\n";
        fs::write(&list, more).unwrap();
        fs::write(prefix.join("share/surfelshop/old.txt"), "").unwrap();
        run(&given).unwrap();
        assert!(!prefix.join("share/surfelshop/old.txt").exists());
        run(&SetupArguments { remove: true, ..given }).unwrap();
        let mut left = Vec::new();
        let mut folders = vec![prefix.clone()];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() { folders.push(path) } else { left.push(path) }
            }
        }
        assert_eq!(left, [other]);
    }

    #[test]
    #[cfg(unix)]
    fn what_stands_where_the_link_goes_stays() {
        let folder = tempfile::tempdir().unwrap();
        let prefix = folder.path().join("usr");
        let link = prefix.join("bin/surfelshop");
        fs::create_dir_all(link.parent().unwrap()).unwrap();
        std::os::unix::fs::symlink("elsewhere", &link).unwrap();
        let given = SetupArguments { program: None, ..arguments(&prefix) };
        let error = run(&given).unwrap_err();
        assert!(error.to_string().contains("expected nothing there"), "{error}");
        assert!(!prefix.join(LIST).exists(), "nothing was written");
        run(&SetupArguments { remove: true, ..given }).unwrap();
        assert!(link.is_symlink());
    }

    #[test]
    fn a_list_that_leads_elsewhere_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let (prefix, outside) = (folder.path().join("usr"), folder.path().join("outside"));
        fs::write(&outside, "stays").unwrap();
        for name in ["../outside", "/etc/hostname", ""] {
            write(&prefix.join(LIST), format!("{name}\n").as_bytes()).unwrap();
            let error = run(&SetupArguments { remove: true, ..arguments(&prefix) }).unwrap_err();
            assert!(error.to_string().contains("expected names below"), "{error}");
        }
        assert!(outside.exists());
    }
}
