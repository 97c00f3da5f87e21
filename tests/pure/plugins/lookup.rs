//! Names of units as people type them.

use crate::plugins::fixture::{FAULTY, PluginFolder, RIVAL, assert_says, faulty_bytes};
use surfelshop_api::UnitKind;
use surfelshop_runtime::plugins::{FindError, Registry};

fn both() -> (PluginFolder, Registry) {
    let shelf = PluginFolder::with_good_plugin();
    shelf.put("faulty", &faulty_bytes());
    let registry = shelf.scan();
    (shelf, registry)
}

#[test]
fn short_and_qualified_names_find_the_same_unit() {
    let (_shelf, registry) = both();
    let short = registry.find(UnitKind::Tool, "stages-ao").unwrap();
    let qualified = registry.find(UnitKind::Tool, &format!("{FAULTY}/stages-ao")).unwrap();
    assert_eq!(short, qualified);
}

#[test]
fn name_in_two_packages_must_be_qualified() {
    let (_shelf, registry) = both();
    let error = registry.find(UnitKind::Renderer, "fine").unwrap_err();
    assert!(matches!(error, FindError::Ambiguous { .. }));
    let names = [format!("{FAULTY}/fine"), format!("{RIVAL}/fine")];
    assert_says(
        &error.to_string(),
        &["renderer `fine` is in several packages", &names[0], &names[1]],
    );
    for name in names {
        assert_eq!(registry.find(UnitKind::Renderer, &name).unwrap().id, "fine");
    }
}

#[test]
fn listed_names_are_found() {
    let (_shelf, registry) = both();
    for kind in [UnitKind::Renderer, UnitKind::Tracer, UnitKind::Tool] {
        let names = registry.names(kind);
        assert!(!names.is_empty() && names.is_sorted());
        for name in names {
            registry.find(kind, &name).unwrap();
        }
    }
}

#[test]
fn unknown_name_is_answered_with_what_there_is() {
    let (_shelf, registry) = both();
    let error = registry.find(UnitKind::Tool, "stage-ao").unwrap_err().to_string();
    assert_says(&error, &["there is no tool `stage-ao`", "did you mean `stages-ao`?"]);
    assert_says(
        &error,
        &["installed: doubles-on-gpu, ", ", stages-ao, works-slowly, wrong-length"],
    );
    let error = registry.find(UnitKind::Tool, "something-else").unwrap_err().to_string();
    assert!(!error.contains("did you mean"), "{error}");
}

#[test]
fn name_of_another_kind_is_pointed_out() {
    let (_shelf, registry) = both();
    let error = registry.find(UnitKind::Renderer, "gradient").unwrap_err();
    assert_says(&error.to_string(), &["no renderer `gradient` (`gradient` is a tracer)"]);
}

#[test]
fn unknown_package_is_no_match() {
    let (_shelf, registry) = both();
    let error = registry.find(UnitKind::Renderer, "org.example/fine").unwrap_err().to_string();
    assert_says(&error, &["no renderer `org.example/fine`", &format!("`{FAULTY}/fine`")]);
}

#[test]
fn refused_files_are_mentioned_where_nothing_is_found() {
    let shelf = PluginFolder::new();
    let path = shelf.put("mine", b"");
    let error = shelf.scan().find(UnitKind::Renderer, "mine").unwrap_err().to_string();
    let refused = format!("one plugin was refused: {} is empty", path.display());
    assert_says(&error, &["no renderer is installed", &refused]);
}
