//! Libraries that break the boundary, one way each.

use crate::third_party::c::cc;
use crate::third_party::project::{folder, graph, registry, renderer, root, surfelshop};
use std::path::{Path, PathBuf};
use surfelshop_api::UnitKind;
use surfelshop_api::params::Values;
use surfelshop_runtime::boundary::Fault;
use surfelshop_runtime::plugins::Entry;

/// The library with a fault, by its name in `hostile.c`.
fn library(fault: &str) -> PathBuf {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("program/third_party/hostile.c");
    let library = folder(&format!("hostile_{}.so", fault.to_lowercase()));
    cc(&source, &library, &["-shared", "-fPIC", &format!("-DFAULT={fault}")]);
    library
}

/// Why a library is not taken.
fn refusal(fault: &str) -> String {
    let registry = registry(&library(fault));
    registry.entries().iter().find_map(Entry::refusal).unwrap_or_default()
}

/// How its frame fails.
#[track_caller]
fn frame_fails(fault: &str, words: &str) {
    let found = graph(&renderer(&library(fault)), &Values::new());
    // What can be written is decoded by the engine.
    let line = match found {
        Ok(graph) => {
            let mut engine = surfelshop_tests::stage::engine();
            engine.compute(&graph, &[]).unwrap_err().to_string()
        }
        Err(fault) => fault.to_string(),
    };
    assert!(line.contains(words) && !line.contains('\n') && line.len() < 5000, "{line}");
}

#[test]
fn no_units_or_two_of_a_name_are_refused_unloaded() {
    let line = refusal("NO_UNITS");
    assert!(line.contains("it exports no renderer, tracer, tool or format"), "{line}");
    let line = refusal("TWO_OF_A_NAME");
    assert!(line.contains("it exports two renderers `hostile`"), "{line}");
}

#[test]
fn two_kinds_under_one_name_are_two_units() {
    let registry = registry(&library("TWO_KINDS"));
    for kind in [UnitKind::Renderer, UnitKind::Tool] {
        assert_eq!(registry.find(kind, "hostile").unwrap().kind, kind);
    }
}

/// Invariant: a gigabyte as a graph, graphs without end, no units, two of a name, answers that
/// are none, and frames that never end are answered in a line
#[test]
fn a_graph_of_a_gigabyte_is_refused_before_it_is_copied() {
    frame_fails("GIGABYTE", "it wrote 1073741824 bytes where at most 16777216 are taken");
}

#[test]
fn graphs_without_end_or_beginning_are_refused() {
    frame_fails("NESTED", "its graph is unreadable");
    frame_fails("COUNT", "its graph is unreadable");
    frame_fails("NOTHING", "it wrote no graph");
}

#[test]
fn answers_that_are_none_are_refused() {
    frame_fails("STATUS", "the unknown status 77");
    frame_fails("NO_INSTANCE", "it made no instance and gave no reason");
    frame_fails("LONG_ERROR", "xxxx");
}

#[test]
fn a_table_without_a_function_is_refused_by_its_name() {
    let registry = registry(&library("NO_FUNCTION"));
    let unit = registry.find(UnitKind::Renderer, "hostile").unwrap();
    let line = registry.load(&unit).unwrap_err().to_string();
    assert!(line.contains("its function table has no `run`"), "{line}");
}

#[test]
fn an_endless_frame_is_given_up() {
    let found = graph(&renderer(&library("ENDLESS")), &Values::new());
    assert!(matches!(found, Err(Fault::TimedOut(_))), "{found:?}");
}

#[test]
fn a_segmentation_fault_leaves_no_half_file() {
    let (library, out) = (library("SEGFAULT"), folder("never.png"));
    let sample = root().join("assets/sample.ply");
    let [library, out, sample] = [&library, &out, &sample].map(|path| path.to_str().unwrap());
    let line = ["render", sample, "-r", "hostile", "-o", out, "--trust", "--plugin", library];
    let ended = surfelshop(&line);
    assert_eq!(ended.status.code(), None, "a signal ends it: {ended:?}");
    assert!(!Path::new(out).exists());
}
