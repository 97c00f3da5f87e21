//! Links that are turned to another file: what is loaded is the file that was judged.

#![cfg(unix)]

use crate::plugins::fixture::{FAULTY, PluginFolder, RIVAL, faulty_bytes, rival};
use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use surfelshop_api::UnitKind;
use surfelshop_runtime::plugins::{
    LoadError, Origin, Place, Registry, SearchPath, Trust, TrustState,
};

/// Puts a link in the place of another one, as `ln -s` and `mv -T` do.
fn turn(link: &Path, target: &Path) {
    let new = link.with_extension("new");
    symlink(target, &new).unwrap();
    fs::rename(&new, link).unwrap();
}

/// A folder with a link to `file`, and a registry that found it and has this trust.
fn scanned(file: &Path, trust: Trust) -> (PluginFolder, Registry) {
    let shelf = PluginFolder::new();
    symlink(file, shelf.at("link")).unwrap();
    let folders = vec![Place::new(shelf.path(), Origin::Environment)];
    let registry = Registry::scan(&SearchPath { folders, trust, ..SearchPath::default() });
    (shelf, registry)
}

#[test]
fn a_link_turned_after_it_was_judged_loads_what_was_judged() {
    let home = PluginFolder::new();
    // Bytes that no other test has loaded.
    let mut bytes = fs::read(rival()).unwrap();
    bytes.extend(*b"judged");
    let trusted = home.put("trusted", &bytes);
    let stranger = home.put("stranger", &faulty_bytes());
    let mut trust = Trust::default();
    trust.place(&trusted);
    let (shelf, registry) = scanned(&trusted, trust);
    let unit = registry.find(UnitKind::Renderer, "fine").unwrap();
    assert_eq!(unit.package, RIVAL);
    let judged = registry.entries()[0].contents();
    assert_eq!(registry.entries()[0].trust, TrustState::Place);

    // Between judging and loading.
    turn(&shelf.at("link"), &stranger);
    assert_eq!(registry.load(&unit).unwrap().contents, judged);

    // The file itself becomes a link: nobody has said yes to what that leads to.
    fs::remove_file(&trusted).unwrap();
    symlink(&stranger, &trusted).unwrap();
    assert!(matches!(registry.load(&unit), Err(LoadError::Untrusted { .. })));
}

#[test]
fn what_a_turned_link_leads_to_is_judged_anew() {
    let home = PluginFolder::new();
    let trusted = home.put("trusted", &fs::read(rival()).unwrap());
    let stranger = home.put("stranger", &faulty_bytes());
    let mut trust = Trust::default();
    trust.place(&trusted);
    let (shelf, before) = scanned(&trusted, trust.clone());
    turn(&shelf.at("link"), &stranger);
    let folders = vec![Place::new(shelf.path(), Origin::Environment)];
    let after = Registry::scan(&SearchPath { folders, trust, ..SearchPath::default() });
    let entry = &after.entries()[0];
    assert_eq!(
        (entry.trust, entry.file.clone()),
        (TrustState::New, stranger.canonicalize().unwrap())
    );
    // The unit that a view has in use, as it is there now.
    let used = before.find(UnitKind::Renderer, "fine").unwrap();
    assert!(after.at(&shelf.at("link"), &used).is_none(), "it is {FAULTY} now");
    let unit = after.find(UnitKind::Renderer, "fine").unwrap();
    assert!(matches!(after.load(&unit), Err(LoadError::Untrusted { .. })));
}
