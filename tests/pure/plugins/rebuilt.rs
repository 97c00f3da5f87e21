//! Plugins that are built again while they are in use: the new one is handed over once it has
//! proven itself, and whatever is wrong with it, the old one runs on.

use crate::plugins::fixture::{
    FAULTY, PluginFolder, assert_says, faulty_bytes, faulty_with_fine_being, find, replaced,
    request, rival,
};
use glam::DVec3;
use std::fs;
use std::sync::mpsc;
use std::time::Duration;
use surfelshop_api::graph::Output;
use surfelshop_api::manifest;
use surfelshop_api::params::Value;
use surfelshop_api::{HostInfo, Scene, UnitKind};
use surfelshop_render::RendererView;
use surfelshop_runtime::plugins::{Hosted, LoadError, Timeouts, UnitRef, Watcher};
use surfelshop_tests::{clouds, stage};

/// A folder with the faulty plugin, its renderer `fine`, and an instance of that in use.
fn in_use() -> (PluginFolder, UnitRef, Hosted) {
    let shelf = PluginFolder::new();
    shelf.put("subject", &faulty_bytes());
    let unit = shelf.scan().find(UnitKind::Renderer, &format!("{FAULTY}/fine")).unwrap();
    let loaded = unit.load(&Timeouts::default()).unwrap();
    let hosted = loaded.start(&HostInfo::default(), &Timeouts::default()).unwrap();
    (shelf, unit, hosted)
}

/// A build without fault and with another version.
fn rebuilt() -> Vec<u8> {
    replaced(faulty_bytes(), b"version\t0.", b"version\t7.")
}

#[test]
#[expect(clippy::print_stdout, reason = "times are shown, not judged")]
fn a_rebuilt_plugin_takes_over_with_its_parameters() {
    let (shelf, unit, mut old) = in_use();
    let (send, changes) = mpsc::channel();
    let watcher = Watcher::start(&shelf.search(), move |c| drop(send.send(c))).unwrap();
    let mut frame = request();
    frame.values.insert("gain".to_owned(), Value::Float(2.5));
    frame.values.insert("forgotten".to_owned(), Value::Bool(true));
    let before = old.frame(frame.clone()).unwrap();

    shelf.put("subject", &rebuilt());
    let changed = changes.recv_timeout(Duration::from_secs(30)).unwrap();
    assert_eq!(changed.path, unit.path);
    let mut new = unit.reload(&HostInfo::default(), &frame, &Timeouts::default()).unwrap();
    println!("noticed and settled in {:?}; {:?}", changed.debounce(), new.took);
    println!("loaded, described and asked for a graph in {:?}", new.took.total());

    assert!(new.unit.manifest.version.starts_with("7."), "{:?}", new.unit.manifest);
    assert_eq!(new.kept.values.len(), 1);
    assert_eq!(new.kept.values["gain"], Value::Float(2.5));
    assert_says(&new.kept.notes.join("; "), &["parameter `forgotten` is gone"]);
    frame.values = new.kept.values.clone();
    assert_eq!(new.hosted.frame(frame.clone()).unwrap(), before, "its frames look as before");
    assert_eq!(old.frame(frame).unwrap(), before, "the old instance lives until it is dropped");
    drop(watcher);
}

#[test]
fn an_unchanged_file_is_recognised() {
    let (shelf, unit, _old) = in_use();
    let loaded = unit.load(&Timeouts::default()).unwrap();
    shelf.put("subject", &faulty_bytes());
    let again = unit.reload(&HostInfo::default(), &request(), &Timeouts::default()).unwrap();
    assert_eq!(again.unit.contents, loaded.contents);
    shelf.put("subject", &rebuilt());
    let changed = unit.reload(&HostInfo::default(), &request(), &Timeouts::default()).unwrap();
    assert_ne!(changed.unit.contents, loaded.contents);
    assert_ne!(changed.unit.scope(), loaded.scope(), "nothing the old build drew is taken over");
}

/// Puts a build in the place of the plugin in use and expects the plugin to be kept, for a reason
/// with these words.
#[track_caller]
fn assert_kept(build: &[u8], words: &[&str]) -> LoadError {
    let (shelf, unit, mut old) = in_use();
    let before = old.frame(request()).unwrap();
    shelf.put("subject", build);
    let patience = Timeouts::of(Duration::from_millis(500));
    let error = unit.reload(&HostInfo::default(), &request(), &patience).unwrap_err();
    let file = unit.path.display().to_string();
    assert_says(&error.to_string(), &["faulty/fine", &file]);
    assert_says(&error.to_string(), words);
    assert_eq!(old.frame(request()).unwrap(), before);
    // The next build is good again.
    shelf.put("subject", &rebuilt());
    let new = unit.reload(&HostInfo::default(), &request(), &Timeouts::default()).unwrap();
    assert!(new.unit.manifest.version.starts_with("7."));
    assert_eq!(old.frame(request()).unwrap(), before);
    error
}

#[test]
fn files_that_are_no_plugins_leave_the_old_one() {
    let bytes = faulty_bytes();
    assert_kept(b"", &["is empty"]);
    assert_kept(b"no library any more", &["is not a shared library"]);
    assert_kept(&bytes[..bytes.len() / 2], &["is cut off"]);
    assert_kept(&fs::read(rival()).unwrap(), &["the file now exports"]);
    let mut newer = bytes.clone();
    let at = find(&newer, &manifest::MAGIC);
    newer[at + 16] += 1;
    assert_kept(&newer, &["speaks ABI", "update Surfelshop"]);
}

/// Invariant: a rebuild that is no good, whatever is wrong with it, leaves the old plugin
/// running
#[test]
fn plugins_that_fail_leave_the_old_one() {
    let panics = faulty_with_fine_being("panics-in-new", "PanicsInNew");
    let error = assert_kept(&panics, &["could not start", "new goes wrong"]);
    assert!(matches!(error, LoadError::Start { .. }));
    let panics = faulty_with_fine_being("panics-in-describe", "PanicsInDescribe");
    assert_kept(&panics, &["while it was loaded", "declare goes wrong"]);
    let panics = faulty_with_fine_being("panics-in-frame", "PanicsInFrame");
    assert_kept(&panics, &["at its first frame", "frame goes wrong"]);
}

#[test]
fn plugins_that_hang_leave_the_old_one() {
    let late = "did not answer within 0.5 s";
    for (id, title, step) in [
        ("hangs-in-describe", "HangsInDescribe", "while it was loaded"),
        ("hangs-in-new", "HangsInNew", "could not start"),
        ("hangs-in-frame", "HangsInFrame", "at its first frame"),
    ] {
        assert_kept(&faulty_with_fine_being(id, title), &[step, late]);
    }
}

#[test]
fn shaders_that_do_not_compile_leave_the_old_one() {
    let (shelf, unit, old) = in_use();
    let mut engine = stage::engine();
    let cloud = clouds::sphere(500, 1.0).cloud();
    let mut render = |view: &mut RendererView| {
        let at = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 16);
        let outputs = [Output::Color];
        stage::render(&mut engine, view, &cloud, &Scene::default(), at, &outputs)
    };
    let mut shown = RendererView::new(old, "subject");
    let before = render(&mut shown).unwrap().images;
    let mut reload = |build: &[u8]| {
        shelf.put("subject", build);
        let new = unit.reload(&HostInfo::default(), &request(), &Timeouts::default()).unwrap();
        let mut candidate = RendererView::new(new.hosted, new.unit.scope());
        let rendered = render(&mut candidate);
        if rendered.is_ok() {
            shown = candidate;
        }
        let shown = render(&mut shown).unwrap().images;
        assert_eq!(shown, before);
        rendered
    };
    let broken = faulty_with_fine_being("invalid-wgsl", "InvalidWgsl");
    let line = reload(&broken).unwrap_err().to_string();
    assert_says(&line, &["pass `broken`"]);
    reload(&rebuilt()).unwrap();
}
