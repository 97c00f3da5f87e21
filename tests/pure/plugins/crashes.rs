//! A plugin that ends the whole process is named at the next start.

use crate::plugins::fixture::{load, request};
use std::path::PathBuf;
use std::process::{Command, ExitStatus};
use std::thread;
use std::time::Duration;
use surfelshop_api::{HostInfo, UnitKind};
use surfelshop_runtime::plugins::{CrashGuard, Timeouts, UnitRef};

/// Tells the program below what to do, and where marks lie.
const UNIT: &str = "SURFELSHOP_TEST_UNIT";
const FOLDER: &str = "SURFELSHOP_TEST_MARKS";

/// A live program that tries a unit, in a process of its own.
#[test]
fn live_program() {
    let (Ok(id), Some(folder)) = (std::env::var(UNIT), std::env::var_os(FOLDER)) else { return };
    let marks = CrashGuard::in_folder(folder);
    assert_eq!(marks.crashed_last_time(), None, "programs that run do not count");
    let (package, path) = ("org.example".to_owned(), PathBuf::from("/somewhere/lib.so"));
    let unit = UnitRef::named(UnitKind::Renderer, &package, &id, path);
    let mark = marks.leave(&unit).unwrap();
    let loaded = load(UnitKind::Renderer, &id);
    let patience = Timeouts::of(Duration::from_millis(300));
    let mut hosted = loaded.start(&HostInfo::default(), &patience).unwrap();
    drop(hosted.frame(request()));
    drop(mark);
}

fn run(marks: &std::path::Path, unit: &str) -> ExitStatus {
    Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "plugins::crashes::live_program"])
        .env(UNIT, unit)
        .env(FOLDER, marks)
        .output()
        .unwrap()
        .status
}

/// Invariant: the plugin at work in a crash is known at the next start
#[test]
fn a_crash_inside_a_plugin_is_known_at_the_next_start() {
    let folder = tempfile::tempdir().unwrap();
    let marks = CrashGuard::in_folder(folder.path());
    assert!(!run(folder.path(), "aborts-in-frame").success());
    let crash = marks.crashed_last_time().expect("it crashed");
    assert_eq!(crash.unit, "renderer org.example/aborts-in-frame");
    assert_eq!(crash.file, "/somewhere/lib.so");
    assert_eq!(marks.crashed_last_time(), None, "it is told once");
}

#[test]
fn programs_that_end_well_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    for unit in ["fine", "panics-in-frame", "hangs-in-frame"] {
        assert!(run(folder.path(), unit).success(), "{unit}");
        assert_eq!(folder.path().read_dir().unwrap().count(), 0, "{unit}");
    }
}

#[test]
fn programs_side_by_side_do_not_count_as_crashed() {
    let folder = tempfile::tempdir().unwrap();
    let own = UnitRef::named(UnitKind::Renderer, "org.example", "own", PathBuf::new());
    let mark = CrashGuard::in_folder(folder.path()).leave(&own).unwrap();
    thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| assert!(run(folder.path(), "fine").success()));
        }
    });
    assert!(!run(folder.path(), "aborts-in-frame").success());
    let crash = CrashGuard::in_folder(folder.path()).crashed_last_time().unwrap();
    assert!(crash.unit.ends_with("/aborts-in-frame"), "{crash:?}");
    drop(mark);
}
