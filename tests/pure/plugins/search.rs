//! Which files are listed, in which order, and which of two packages of one id wins.

use crate::plugins::fixture::{
    FAULTY, PluginFolder, assert_good_plugin_works, entry, faulty, faulty_bytes, rival,
};
use std::path::PathBuf;
use surfelshop_api::UnitKind;
use surfelshop_runtime::plugins::{Origin, Place, Registry, SearchPath, State, Trust};

fn paths(registry: &Registry) -> Vec<PathBuf> {
    registry.entries().iter().map(|entry| entry.path.clone()).collect()
}

#[test]
fn later_places_win_and_the_others_are_listed_as_shadowed() {
    let (user, named) = (PluginFolder::with_good_plugin(), PluginFolder::new());
    let (loser, winner) = (user.put("mine", &faulty_bytes()), named.put("a", &faulty_bytes()));
    let mut search = user.search();
    search.files.push(Place::new(&winner, Origin::CommandLine));
    let registry = Registry::scan(&search);
    let State::Shadowed { manifest, by } = &entry(&registry, &loser).state else {
        panic!("not shadowed");
    };
    assert_eq!((manifest.id.as_str(), by), (FAULTY, &winner));
    assert!(entry(&registry, &winner).available().is_some());
    assert_eq!(registry.find(UnitKind::Tool, "stages-ao").unwrap().path, winner);
    assert_good_plugin_works(&registry);
}

#[test]
fn a_file_that_nobody_trusts_takes_nobodys_place_unless_it_was_named() {
    let (program, user) = (PluginFolder::with_good_plugin(), PluginFolder::with_good_plugin());
    let (ours, other) = (program.at("good"), user.at("good"));
    let mut search = SearchPath {
        folders: vec![
            Place::new(program.path(), Origin::BesideProgram),
            Place::new(user.path(), Origin::UserFolder),
        ],
        ..SearchPath::default()
    };
    let registry = Registry::scan(&search);
    assert_eq!(registry.find(UnitKind::Renderer, "fine").unwrap().path, ours);
    let waiting = entry(&registry, &other);
    assert!(matches!(&waiting.state, State::Waiting { meanwhile, .. } if *meanwhile == ours));
    assert!(waiting.asks_for_trust() && !entry(&registry, &ours).asks_for_trust());

    // After a yes it takes the place, and one that was named is never passed over in silence.
    search.trust.place(&other);
    let registry = Registry::scan(&search);
    assert_eq!(registry.find(UnitKind::Renderer, "fine").unwrap().path, other);
    let named = PluginFolder::with_good_plugin();
    search.files.push(Place::new(named.at("good"), Origin::CommandLine));
    let registry = Registry::scan(&search);
    let found = registry.find(UnitKind::Renderer, "fine").unwrap();
    assert_eq!(found.path, named.at("good"));
    let line = registry.load(&found).unwrap_err().to_string();
    assert!(line.contains("a place that is new here"), "{line}");
}

#[test]
fn a_damaged_file_shadows_nothing() {
    let (user, named) = (PluginFolder::new(), PluginFolder::new());
    let good = user.put("mine", &faulty_bytes());
    let bytes = faulty_bytes();
    let damaged = named.put("mine", &bytes[..bytes.len() / 2]);
    let mut search = user.search();
    search.files.push(Place::new(&damaged, Origin::CommandLine));
    let registry = Registry::scan(&search);
    assert!(entry(&registry, &damaged).refusal().is_some());
    assert_eq!(registry.find(UnitKind::Tool, "stages-ao").unwrap().path, good);
}

#[test]
#[cfg(unix)]
fn links_to_one_file_are_listed_once() {
    let shelf = PluginFolder::with_good_plugin();
    for (stem, target) in [("alias", "good"), ("loop", "loop"), ("nowhere", "missing")] {
        std::os::unix::fs::symlink(shelf.at(target), shelf.at(stem)).unwrap();
    }
    let registry = shelf.scan();
    assert_eq!(paths(&registry), [shelf.at("alias"), shelf.at("loop"), shelf.at("nowhere")]);
    assert!(entry(&registry, &shelf.at("alias")).available().is_some());
    let refusal = entry(&registry, &shelf.at("loop")).refusal().unwrap();
    assert!(refusal.contains("cannot be read"), "{refusal}");
    let refusal = entry(&registry, &shelf.at("nowhere")).refusal().unwrap();
    assert!(refusal.contains("does not exist"), "{refusal}");
    assert_good_plugin_works(&registry);
}

#[test]
fn a_file_named_twice_counts_where_it_has_precedence() {
    let shelf = PluginFolder::with_good_plugin();
    let mut search = shelf.search();
    search.files.push(Place::new(shelf.at("good"), Origin::CommandLine));
    let registry = Registry::scan(&search);
    assert_eq!(registry.entries().len(), 1);
    assert_eq!(registry.entries()[0].origin, Origin::CommandLine);
    assert_good_plugin_works(&registry);
}

#[test]
fn order_does_not_depend_on_the_order_of_the_places() {
    let (user, named) = (PluginFolder::with_good_plugin(), PluginFolder::new());
    for stem in ["b", "a", "c"] {
        user.put(stem, b"");
        named.put(stem, b"");
    }
    let mut search = user.search();
    search.folders.insert(0, Place::new(named.path(), Origin::Environment));
    let registry = Registry::scan(&search);
    let expected = [
        user.at("a"),
        user.at("b"),
        user.at("c"),
        user.at("good"),
        named.at("a"),
        named.at("b"),
        named.at("c"),
    ];
    assert_eq!(paths(&registry), expected);
}

#[test]
fn other_libraries_are_left_out_only_where_they_are_at_home() {
    let shelf = PluginFolder::with_good_plugin();
    let name = b"SURFELSHOP_MANIFEST\0";
    let other = crate::plugins::fixture::replaced(faulty_bytes(), name, b"SURFELSHOP_MANIFOLD\0");
    shelf.put("other", &other);
    shelf.put("empty", b"");
    assert_eq!(paths(&shelf.scan()), [shelf.at("empty"), shelf.at("good"), shelf.at("other")]);
    let mut search = shelf.search();
    search.folders[0].shared = true;
    let registry = Registry::scan(&search);
    assert_eq!(paths(&registry), [shelf.at("empty"), shelf.at("good")]);
}

#[test]
fn subfolders_and_other_names_are_not_searched() {
    let shelf = PluginFolder::with_good_plugin();
    std::fs::create_dir(shelf.path().join("deps")).unwrap();
    let name = crate::plugins::fixture::library_name("inner");
    std::fs::copy(faulty(), shelf.path().join("deps").join(name)).unwrap();
    std::fs::copy(faulty(), shelf.path().join("plugin.bak")).unwrap();
    assert_eq!(paths(&shelf.scan()), [shelf.at("good")]);
}

#[test]
fn standard_places_take_explicit_files_last() {
    let search = SearchPath::standard(vec![rival()], Trust::everything());
    assert_eq!(search.files.last(), Some(&Place::new(rival(), Origin::CommandLine)));
    let beside = std::env::current_exe().unwrap().parent().unwrap().to_owned();
    assert_eq!(search.folders[0].path, beside);
    assert!(search.folders[0].shared);
    assert_eq!(search.folders[1], Place::new(beside.join("plugins"), Origin::BesideProgram));
}

#[test]
fn lists_are_readable_by_machines() {
    let shelf = PluginFolder::with_good_plugin();
    shelf.put("empty", b"");
    let json = serde_json::to_value(shelf.scan()).unwrap();
    assert_eq!(json[0]["origin"], "user-folder");
    assert!(json[0]["state"]["refused"].as_str().unwrap().starts_with("is empty"));
    assert_eq!(json[1]["path"], shelf.at("good").display().to_string());
    let unit = &json[1]["state"]["available"]["units"][0];
    assert_eq!((&unit["kind"], &unit["id"]), (&"renderer".into(), &"fine".into()));
}
