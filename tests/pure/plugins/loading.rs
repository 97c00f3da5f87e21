//! Loading: from private copies, once per contents, whatever happens to the file.

use crate::plugins::fixture::{
    FAULTY, PluginFolder, RIVAL, assert_good_plugin_works, assert_makes_graph, assert_says, faulty,
    faulty_bytes, find, load, replaced, request, rival,
};
use std::fs;
use surfelshop_api::abi::table;
use surfelshop_api::{HostInfo, UnitKind};
use surfelshop_runtime::plugins::{LoadError, Registry, UnitRef};

/// A folder with the good plugin and a copy of the faulty one, scanned, and a unit of the copy.
fn shelf_and_unit() -> (PluginFolder, Registry, UnitRef) {
    let shelf = PluginFolder::with_good_plugin();
    shelf.put("subject", &faulty_bytes());
    let registry = shelf.scan();
    let unit = registry.find(UnitKind::Renderer, &format!("{FAULTY}/fine")).unwrap();
    (shelf, registry, unit)
}

#[track_caller]
fn assert_load_fails(registry: &Registry, unit: &UnitRef, words: &[&str]) -> LoadError {
    let error = registry.load(unit).unwrap_err();
    let line = error.to_string();
    assert_says(&line, &[FAULTY, &unit.path.display().to_string()]);
    assert_says(&line, words);
    assert_good_plugin_works(registry);
    error
}

#[test]
fn wrong_function_table_magic() {
    let shelf = PluginFolder::with_good_plugin();
    shelf.put("subject", &replaced(faulty_bytes(), &table::MAGIC, b"SURFELQ\0"));
    let registry = shelf.scan();
    let unit = registry.find(UnitKind::Renderer, &format!("{FAULTY}/fine")).unwrap();
    let words = ["broke the plugin interface", "function table's magic bytes are wrong"];
    assert_load_fails(&registry, &unit, &words);
}

#[test]
fn function_table_of_another_size_or_version() {
    let own_major = surfelshop_api::manifest::ABI_MAJOR;
    for (offset, words) in [
        (8, "function table has 1 bytes, expected"),
        (12, "function table speaks ABI 257."),
        (14, &format!("function table speaks ABI {own_major}.257")),
    ] {
        let mut bytes = faulty_bytes();
        let at = find(&bytes, &table::MAGIC);
        let patch: &[u8] = if offset == 8 { &[1, 0, 0, 0] } else { &[1, 1] };
        bytes[at + offset..at + offset + patch.len()].copy_from_slice(patch);
        let shelf = PluginFolder::with_good_plugin();
        shelf.put("subject", &bytes);
        let registry = shelf.scan();
        let unit = registry.find(UnitKind::Renderer, &format!("{FAULTY}/fine")).unwrap();
        assert_load_fails(&registry, &unit, &[words]);
    }
}

#[test]
#[cfg(target_os = "linux")]
fn library_that_needs_a_missing_one() {
    let shelf = PluginFolder::with_good_plugin();
    let path = shelf.put("subject", &replaced(faulty_bytes(), b"\0libc.so.6\0", b"\0libq.so.6\0"));
    let registry = shelf.scan();
    let unit = registry.find(UnitKind::Renderer, &format!("{FAULTY}/fine")).unwrap();
    let error = assert_load_fails(&registry, &unit, &["could not be loaded", "libq.so.6"]);
    assert!(matches!(error, LoadError::Open { .. }));
    assert!(!error.to_string().contains("surfelshop-plugin-"), "{error} names {}", path.display());
}

#[test]
fn replaced_by_garbage_between_scan_and_load() {
    let (shelf, registry, unit) = shelf_and_unit();
    shelf.put("subject", b"no library any more");
    let words = ["changed since it was listed", "is not a shared library"];
    assert_load_fails(&registry, &unit, &words);
}

#[test]
fn cut_between_scan_and_load() {
    let (shelf, registry, unit) = shelf_and_unit();
    let bytes = faulty_bytes();
    shelf.put("subject", &bytes[..bytes.len() / 3]);
    assert_load_fails(&registry, &unit, &["changed since it was listed", "is cut off"]);
}

#[test]
fn removed_between_scan_and_load() {
    let (shelf, registry, unit) = shelf_and_unit();
    fs::remove_file(shelf.at("subject")).unwrap();
    assert_load_fails(&registry, &unit, &["changed since it was listed", "does not exist"]);
}

#[test]
fn replaced_by_another_plugin_between_scan_and_load() {
    let (shelf, registry, unit) = shelf_and_unit();
    fs::copy(rival(), shelf.at("subject")).unwrap();
    let exports = format!("the file now exports {RIVAL}/fine");
    assert_load_fails(&registry, &unit, &["changed since it was listed", &exports]);
}

#[test]
fn rebuilt_between_scan_and_load() {
    let (shelf, registry, unit) = shelf_and_unit();
    let before = registry.load(&unit).unwrap();
    let mut old = before.create(&HostInfo::default()).unwrap();
    shelf.put("subject", &replaced(faulty_bytes(), b"version\t0.", b"version\t7."));
    let after = registry.load(&unit).unwrap();
    assert!(before.manifest.version.starts_with("0."));
    assert!(after.manifest.version.starts_with("7."), "the new contents are loaded");
    assert_makes_graph(&after);
    assert_makes_graph(&before);
    assert!(old.frame(&request()).is_ok(), "instances of the old contents go on");
}

/// Invariant: a plugin file destroyed on disk does not touch the running plugin
#[test]
fn file_destroyed_in_place_while_its_plugin_runs() {
    let (shelf, registry, unit) = shelf_and_unit();
    let loaded = registry.load(&unit).unwrap();
    let mut instance = loaded.create(&HostInfo::default()).unwrap();
    // Had the file itself been mapped, the next call would end the process.
    fs::File::options().write(true).open(shelf.at("subject")).unwrap().set_len(0).unwrap();
    assert!(instance.frame(&request()).is_ok());
    drop(instance);
    assert_makes_graph(&loaded);
}

#[test]
fn units_of_one_package_share_one_copy() {
    let shelf = PluginFolder::new();
    let stem = "shared-by-many-threads";
    shelf.put(stem, &faulty_bytes());
    let registry = shelf.scan();
    let names = ["fine", "no-output", "huge-texture", "panics-in-frame"];
    std::thread::scope(|scope| {
        for name in names.into_iter().cycle().take(64) {
            let registry = &registry;
            scope.spawn(move || {
                let unit = registry.find(UnitKind::Renderer, name).unwrap();
                assert_eq!(registry.load(&unit).unwrap().unit.id, name);
            });
        }
    });
    if let Ok(maps) = fs::read_to_string("/proc/self/maps") {
        let mapped: std::collections::BTreeSet<&str> = maps
            .lines()
            .filter(|l| l.contains(stem))
            .filter_map(|l| l.split('/').nth_back(1))
            .collect();
        assert_eq!(mapped.len(), 1, "{mapped:?}");
    }
}

#[test]
fn unit_index_is_the_position_in_the_manifest() {
    let unit = load(UnitKind::Tool, "stages-ao");
    assert_eq!(unit.manifest.units[unit.unit_index as usize], unit.unit);
    assert_eq!(unit.unit.title, "Stages AO");
}

/// What the program below does: everything that panics, in a process of its own.
#[test]
fn quiet_program() {
    if std::env::var_os("SURFELSHOP_TEST_QUIET").is_none() {
        return;
    }
    use surfelshop_api::params::Values;
    assert_makes_graph(&load(UnitKind::Renderer, "fine"));
    let host = HostInfo::default();
    for name in ["panics-in-frame", "panics-twice", "panics-in-drop", "returns-error"] {
        let mut instance = load(UnitKind::Renderer, name).create(&host).unwrap();
        assert_eq!(instance.frame(&request()).is_ok(), name == "panics-in-drop");
    }
    assert!(load(UnitKind::Renderer, "panics-in-new").create(&host).is_err());
    struct Idle;
    impl surfelshop_api::job::JobHost for Idle {
        fn progress(&self, _fraction: f64, _message: &str) {}
        fn cancelled(&self) -> bool {
            false
        }
        fn stage(
            &self,
            _header: &surfelshop_api::tool::EditHeader,
            _values: &[&[u8]],
        ) -> surfelshop_api::Result<()> {
            Ok(())
        }
    }
    let mut tool = load(UnitKind::Tool, "panics-in-run").create(&host).unwrap();
    assert!(tool.run(&Values::new(), &surfelshop_api::CloudView::default(), &Idle).is_err());
}

#[test]
fn contained_panics_print_nothing_and_copies_leave_nothing() {
    let temporary = tempfile::tempdir().unwrap();
    let output = std::process::Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "plugins::loading::quiet_program", "--nocapture"])
        .env("SURFELSHOP_TEST_QUIET", "1")
        .env("TMPDIR", temporary.path())
        .output()
        .unwrap();
    let printed = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{printed}{}", String::from_utf8_lossy(&output.stdout));
    assert!(String::from_utf8_lossy(&output.stdout).contains("1 passed"));
    assert_eq!(printed, "");
    if cfg!(unix) {
        let left: Vec<_> = temporary.path().read_dir().unwrap().flatten().collect();
        assert!(left.is_empty(), "{left:?}");
    }
}

#[test]
#[cfg(unix)]
fn folder_for_copies_that_cannot_be_written() {
    let output = std::process::Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "plugins::loading::quiet_program", "--nocapture"])
        .env("SURFELSHOP_TEST_QUIET", "1")
        .env("TMPDIR", faulty().join("not-a-folder"))
        .output()
        .unwrap();
    assert!(!output.status.success());
    let printed = String::from_utf8_lossy(&output.stderr);
    assert!(printed.contains("could not be copied to the folder for temporary files"), "{printed}");
}
