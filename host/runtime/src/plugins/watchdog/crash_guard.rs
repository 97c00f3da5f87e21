//! Which plugin was at work when the program crashed.
//!
//! Before a plugin's code runs for the first time, a live program leaves a mark: a small file that
//! names the unit. It goes when the unit has proven itself or the program ends well; a crash, which
//! nothing in the process could report any more, leaves it to the next start.
//!
//! Invariants: a mark is locked by its process for as long as that lives, and the system frees the
//! lock however the process ends, so a mark whose lock can be had is one of a crash, and marks of
//! programs that run beside this one are not; a mark appears under its name locked and whole; what
//! is no mark is never taken for one.

use crate::plugins::discover::state_folder;
use crate::plugins::find::UnitRef;
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::process;
use std::time::{Duration, SystemTime};

const EXTENSION: &str = "at-work";
/// A mark before it has its name.
const UNFINISHED: &str = "new";
const TITLE: &str = "surfelshop: this plugin is at work";
/// Far more than two paths and two names need.
const MAX_LEN: u64 = 1 << 16;
/// Marks get their names within moments of being made.
const STALE: Duration = Duration::from_secs(3600);

/// The folder of marks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CrashGuard {
    folder: PathBuf,
}

/// A unit's mark; dropping it says that the unit did no harm.
#[derive(Debug)]
pub struct CrashMark {
    path: PathBuf,
    /// Locked until the end.
    _file: File,
}

/// What a crashed program left behind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Crash {
    /// Kind, package and id of the unit that was at work, such as `renderer org.example.mine/rim`.
    pub unit: String,
    /// Its file.
    pub file: String,
    /// The program's process id.
    pub process: u32,
}

impl CrashGuard {
    /// The marks of this user's programs; `None` where the system names no folder for them.
    #[must_use]
    pub fn of_user() -> Option<Self> {
        state_folder().map(|folder| Self::in_folder(folder.join("at-work")))
    }

    /// The marks in a folder, which is made with the first mark.
    #[must_use]
    pub fn in_folder(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    /// Says that a unit's code is about to run. Keep the mark while the unit is on trial.
    ///
    /// # Errors
    /// Where the mark cannot be written; the unit can be used all the same.
    pub fn leave(&self, unit: &UnitRef) -> io::Result<CrashMark> {
        let name = format!("{} {}/{}", unit.kind.word(), unit.package, unit.id);
        self.mark(&name, &one_line(&unit.path))
    }

    /// Keeps a crash that was found until the user has decided about it: a program that is killed
    /// before leaves it to the next start.
    ///
    /// # Errors
    /// Where the mark cannot be written.
    pub fn keep(&self, crash: &Crash) -> io::Result<CrashMark> {
        self.mark(&crash.unit, &crash.file)
    }

    fn mark(&self, name: &str, file: &str) -> io::Result<CrashMark> {
        fs::create_dir_all(&self.folder)?;
        let id = process::id();
        let mut unfinished = tempfile::Builder::new()
            .prefix(&format!("{id}-"))
            .suffix(&format!(".{UNFINISHED}"))
            .tempfile_in(&self.folder)?;
        unfinished.as_file().lock()?;
        let text = format!("{TITLE}\n{id}\n{name}\n{file}\n");
        unfinished.write_all(text.as_bytes())?;
        let path = unfinished.path().with_extension(EXTENSION);
        let file = unfinished.persist(&path)?;
        Ok(CrashMark { path, _file: file })
    }

    /// Takes away all marks of this process, which is being ended from outside: that is no crash.
    pub fn withdraw(&self) {
        let own = format!("{}-", process::id());
        let listing = self.folder.read_dir().ok();
        for found in listing.into_iter().flatten().flatten() {
            let path = found.path();
            let ours = found.file_name().to_string_lossy().starts_with(&own);
            if ours && path.extension().is_some_and(|extension| extension == EXTENSION) {
                remove(&path);
            }
        }
    }

    /// The unit that was last at work in a program that crashed, if one did since this was last
    /// asked.
    #[must_use]
    pub fn crashed_last_time(&self) -> Option<Crash> {
        let listing = self.folder.read_dir().ok()?;
        let mut crashes = Vec::new();
        for found in listing.flatten() {
            // Links are not followed, and pipes are not opened.
            if !found.file_type().is_ok_and(|kind| kind.is_file()) {
                continue;
            }
            let path = found.path();
            match path.extension().and_then(|extension| extension.to_str()) {
                Some(EXTENSION) => crashes.extend(take(&path)),
                Some(UNFINISHED) if age(&path).is_some_and(|age| age > STALE) => remove(&path),
                _ => {}
            }
        }
        crashes.into_iter().max_by_key(|(time, _)| *time).map(|(_, crash)| crash)
    }
}

impl Drop for CrashMark {
    fn drop(&mut self) {
        // Removed before it is unlocked: nobody finds it without an owner.
        remove(&self.path);
    }
}

/// Takes a mark away and reads it, where its process is gone.
fn take(path: &Path) -> Option<(SystemTime, Crash)> {
    let (file, _) = surfelshop_cloud::files::open(path).ok()?;
    file.try_lock().ok()?;
    // Its owner, or another program that looks for crashes, may have been quicker.
    let time = path.symlink_metadata().ok()?.modified().unwrap_or(SystemTime::UNIX_EPOCH);
    let mut text = String::new();
    let read = (&file).take(MAX_LEN).read_to_string(&mut text);
    remove(path);
    read.ok()?;
    Some((time, parse(&text)?))
}

fn parse(text: &str) -> Option<Crash> {
    let mut lines = text.lines().filter(|line| !line.is_empty());
    let title = lines.next()?;
    let process = lines.next()?.parse().ok()?;
    let crash = Crash { process, unit: lines.next()?.to_owned(), file: lines.next()?.to_owned() };
    let readable = !text.chars().any(|c| c.is_control() && c != '\n');
    (title == TITLE && readable && lines.next().is_none()).then_some(crash)
}

/// A path may hold line breaks; a mark has one in its place.
fn one_line(path: &Path) -> String {
    let text = path.display().to_string();
    text.chars().map(|c| if c.is_control() { '?' } else { c }).collect()
}

fn age(path: &Path) -> Option<Duration> {
    path.symlink_metadata().ok()?.modified().ok()?.elapsed().ok()
}

fn remove(path: &Path) {
    if let Err(error) = fs::remove_file(path) {
        tracing::debug!(%error, path = %path.display(), "a mark was not removed");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_api::UnitKind;

    fn unit(id: &str) -> UnitRef {
        UnitRef::named(UnitKind::Renderer, "org.example", id, "/plugins/li\nb.so")
    }

    #[test]
    fn a_mark_of_a_living_program_is_no_crash() {
        let folder = tempfile::tempdir().unwrap();
        let marks = CrashGuard::in_folder(folder.path().join("deep/er"));
        assert_eq!(marks.crashed_last_time(), None, "there is not even a folder");
        let (first, second) = (marks.leave(&unit("a")).unwrap(), marks.leave(&unit("b")).unwrap());
        assert_eq!(marks.crashed_last_time(), None);
        drop(first);
        assert_eq!(marks.folder.read_dir().unwrap().count(), 1);
        drop(second);
        assert_eq!(marks.folder.read_dir().unwrap().count(), 0);
        assert_eq!(marks.crashed_last_time(), None);
    }

    #[test]
    fn what_a_dead_program_left_is_found_once() {
        let folder = tempfile::tempdir().unwrap();
        let marks = CrashGuard::in_folder(folder.path());
        let mark = marks.leave(&unit("a")).unwrap();
        let text = fs::read(&mark.path).unwrap();
        drop(mark);
        // Nobody has locked this one.
        fs::write(folder.path().join("1-0.at-work"), text).unwrap();
        let crash = marks.crashed_last_time().unwrap();
        assert_eq!(crash.unit, "renderer org.example/a");
        assert_eq!(crash.file, "/plugins/li?b.so");
        assert_eq!(crash.process, process::id());
        assert_eq!(marks.crashed_last_time(), None);
    }

    #[test]
    fn marks_of_a_program_that_is_ended_from_outside_go() {
        let folder = tempfile::tempdir().unwrap();
        let marks = CrashGuard::in_folder(folder.path());
        marks.withdraw();
        let _mark = marks.leave(&unit("a")).unwrap();
        fs::write(folder.path().join("1-0.at-work"), "another program's").unwrap();
        marks.withdraw();
        let left: Vec<_> = folder.path().read_dir().unwrap().flatten().collect();
        assert_eq!(left.len(), 1);
        assert_eq!(left[0].file_name(), "1-0.at-work");
    }

    #[test]
    fn garbage_is_no_crash_and_does_no_harm() {
        let folder = tempfile::tempdir().unwrap();
        let good = format!("{TITLE}\n7\nrenderer a/b\n/c.so\n");
        let texts = [
            Vec::new(),
            b"\xff\xfe\x00".to_vec(),
            TITLE.into(),
            good[..good.len() - 7].into(),
            good.replace("at work", "at rest").into(),
            format!("{good}and more\n").into(),
            good.replace("a/b", "a/\x1b[2J").into(),
        ];
        for (i, text) in texts.iter().enumerate() {
            fs::write(folder.path().join(format!("{i}.at-work")), text).unwrap();
        }
        fs::write(folder.path().join("large.at-work"), good.repeat(10_000)).unwrap();
        fs::create_dir(folder.path().join("folder.at-work")).unwrap();
        fs::write(folder.path().join("notes.txt"), &good).unwrap();
        fs::write(folder.path().join("1-1.new"), &good).unwrap();
        let marks = CrashGuard::in_folder(folder.path());
        assert_eq!(marks.crashed_last_time(), None);
        let left = folder.path().read_dir().unwrap().count();
        assert_eq!(left, 3, "what cannot be a mark, or may become one, is left alone");
        fs::write(folder.path().join("2-0.at-work"), &good).unwrap();
        assert_eq!(marks.crashed_last_time().unwrap().file, "/c.so");
    }
}
