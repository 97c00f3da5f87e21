//! Tools: run, cancelled, failed, abandoned, undone, saved.

use super::plugins::faulty;
use super::{SAMPLE, Screen, built_plugins};
use crate::ViewerArguments;
use crate::document::OpenCloud;
use crate::document::generations;
use crate::plugins::Readiness;
use crate::window::Window;
use eframe::egui::{Context, Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use std::time::Duration;
use surfelshop_api::params::Value;
use surfelshop_session::options::DeviceArguments;
use surfelshop_session::options::UpAxis;

/// A window over files with the tools of the faulty plugin.
pub(super) fn with_tools(files: &[&str]) -> Screen {
    let mut plugins = built_plugins();
    plugins.plugin.push(faulty());
    // For a tool that never stops; the others stop at once.
    plugins.patience = Some(Duration::from_secs(5));
    let mut screen = Screen::with(&ViewerArguments {
        memory: None,
        in_place: false,
        colors: Default::default(),
        files: files.iter().map(Into::into).collect(),
        up: UpAxis::Y,
        plugins,
        device: DeviceArguments::default(),
    });
    screen.settle();
    screen
}

pub(super) fn items(window: &Window) -> &[OpenCloud] {
    window.document.clouds.as_ref().unwrap().open_clouds.all()
}

fn first_generations(screen: &mut Screen) -> Vec<u64> {
    generations(&items(screen.window())[0].loaded.cloud)
}

/// Opens the window of a tool through the menu.
fn choose(screen: &mut Screen, title: &str) {
    screen.harness.get_by_label("Tools").click();
    screen.frames();
    // The menu scrolls where it is longer than the window.
    screen.harness.get_by_label(&format!("{title} …")).click_accesskit();
    screen.frames();
    screen.until("its code", |window| {
        let name = window.plugins.tools.open.as_deref().unwrap_or_default();
        matches!(window.plugins.tools.units.readiness(name), Readiness::Ready(_))
    });
    screen.frames();
}

/// Runs a tool through its window.
pub(super) fn run(screen: &mut Screen, title: &str) {
    choose(screen, title);
    screen.harness.get_by_label("run").click();
    screen.frames();
}

impl Screen {
    #[track_caller]
    pub(super) fn until_label(&mut self, label: &str) {
        let started = std::time::Instant::now();
        while self.harness.query_all_by_label(label).count() == 0 {
            self.harness.step();
            assert!(started.elapsed() < super::TIMEOUT, "waited for `{label}`");
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    #[track_caller]
    pub(super) fn until_said(&mut self, words: &str) {
        self.until(words, |window| window.messages.count(words) > 0);
    }
}

/// Invariant: what a tool did in the window is undone and redone to the very same columns, in
/// bounded memory
#[test]
fn an_edit_is_shown_told_and_undone_to_the_very_same_columns() {
    let mut screen = with_tools(&[SAMPLE]);
    let before = first_generations(&mut screen);
    let load = screen.window().document.clouds.as_ref().unwrap().revision;
    run(&mut screen, "Stages AO");
    screen.until_said("stages-ao made ao of sample.ply in ");
    let after = first_generations(&mut screen);
    assert_eq!(after[..4], before);
    let shown = screen.window().document.clouds.as_ref().unwrap();
    assert!(shown.revision > load && shown.clouds.facts.columns.contains(&"ao".to_owned()));
    assert!(items(screen.window())[0].is_unsaved());
    screen.settle();
    screen.until_label("edited");
    screen.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    screen.until("the cloud before", |window| !items(window)[0].is_unsaved());
    assert_eq!(first_generations(&mut screen), before);
    screen.settle();
    screen.harness.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    screen.until("the edited cloud", |window| items(window)[0].is_unsaved());
    assert_eq!(first_generations(&mut screen), after);
    screen.settle();
}

/// Invariant: pictures go on while a tool works, and a tool that fails or hangs harms nothing in
/// the window
#[test]
fn a_tool_is_cancelled_while_pictures_go_on() {
    let mut screen = with_tools(&[SAMPLE]);
    let before = first_generations(&mut screen);
    choose(&mut screen, "Works slowly");
    let values = screen.window().plugins.tools.values.entry("works-slowly".to_owned()).or_default();
    values.insert("items".to_owned(), Value::Int(1_000_000));
    screen.harness.get_by_label("run").click();
    screen.until("some progress", |window| {
        window.plugins.tools.running().is_some_and(|(_, progress, _)| progress.fraction > 0.0)
    });
    // The picture follows settings meanwhile.
    let shown = |screen: &mut Screen| {
        screen.window().views.panes[&0].sides[0].shown.as_ref().unwrap().serial
    };
    let picture = shown(&mut screen);
    screen.window().settings.scene.exposure_stops = 1.0;
    screen.settle();
    assert_ne!(shown(&mut screen), picture);
    assert!(screen.window().plugins.tools.running().is_some());
    screen.harness.get_by_label("cancel").click();
    screen.until_said("works-slowly was cancelled; nothing was changed");
    assert_eq!(first_generations(&mut screen), before);
    screen.until_label("run");
}

#[test]
fn failures_are_one_line_and_change_nothing() {
    let mut screen = with_tools(&[SAMPLE]);
    let before = first_generations(&mut screen);
    for (title, words) in [
        ("Panics in run", "run goes wrong"),
        ("Stages and fails", "the tide is out"),
        ("Wrong length", "expected 119051 values, found 119052"),
    ] {
        run(&mut screen, title);
        screen.until_said(words);
        assert!(screen.window().messages.contains("failed, nothing was changed"));
        assert_eq!(first_generations(&mut screen), before);
    }
    run(&mut screen, "Stages AO");
    screen.until_said("stages-ao made ao");
}

#[test]
fn a_tool_that_does_not_stop_is_left_behind_and_switched_off() {
    let mut screen = with_tools(&[SAMPLE]);
    let before = first_generations(&mut screen);
    run(&mut screen, "Ignores cancel");
    screen.until("half of it", |window| {
        window.plugins.tools.running().is_some_and(|(_, progress, _)| progress.fraction > 0.4)
    });
    screen.harness.get_by_label("cancel").click();
    screen.until_said("did not stop within 5 s; it was left behind and is switched off");
    assert_eq!(first_generations(&mut screen), before);
    screen.until("the refusal", |window| {
        window.plugins.tools.units.failures().iter().all(|unit| unit.off)
    });
    assert_eq!(screen.harness.query_all_by_label("run").count(), 0, "it is not offered");
    // The picture and other tools still work.
    screen.window().settings.scene.exposure_stops = 1.0;
    screen.settle();
    run(&mut screen, "Stages AO");
    screen.until_said("stages-ao made ao");
    let window = screen.harness.state_mut();
    window.plugins.tools.units.switch_on(&window.plugins.registry, "ignores-cancel");
    choose(&mut screen, "Ignores cancel");
}

#[test]
fn undo_holds_no_more_than_it_may() {
    let mut screen = with_tools(&[SAMPLE]);
    // Room for two columns of floats.
    screen.window().document.history.most_bytes = 2 * 4 * 119_051;
    choose(&mut screen, "Scatters");
    let mut made = vec![first_generations(&mut screen)];
    for seed in 0..5 {
        let values = screen.window().plugins.tools.values.entry("scatters".to_owned()).or_default();
        values.insert("seed".to_owned(), Value::Int(100 + seed));
        screen.until_label("run");
        screen.harness.get_by_label("run").click();
        let n_before = made.len() as u32;
        screen.until("the noise", |w| w.messages.count("scatters made noise") == n_before);
        screen.frames();
        made.push(first_generations(&mut screen));
        let (window, cap) = (screen.window(), 2 * 4 * 119_051);
        assert!(window.document.history.bytes(&window.snapshot()) <= cap);
    }
    // Undo all steps that are held.
    for expected in made.iter().rev().skip(1).take(2) {
        screen.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
        let expected = expected.clone();
        screen
            .until("a step back", |window| generations(&items(window)[0].loaded.cloud) == expected);
        let window = screen.window();
        assert!(window.document.history.bytes(&window.snapshot()) <= 2 * 4 * 119_051);
    }
    let window = screen.window();
    assert!(!window.document.history.has_undo(&window.snapshot()), "older steps were let go");
}

#[test]
fn a_new_cloud_stands_beside_its_source_which_is_hidden() {
    let mut screen = with_tools(&[SAMPLE]);
    run(&mut screen, "Makes a cloud");
    screen.until_said("made a cloud of 1 surfels, given 119051");
    let window = screen.window();
    let visible: Vec<bool> = items(window).iter().map(|item| item.visible).collect();
    assert_eq!(visible, [false, true]);
    assert_eq!(window.document.clouds.as_ref().unwrap().clouds.loaded.len(), 1);
    assert!(!items(window)[0].is_unsaved() && items(window)[1].is_unsaved());
    screen.settle();
    // With both visible there is a choice of clouds.
    let eye = |name: &str| format!("show {name}");
    screen.harness.get_by_label(&eye("sample.ply")).click();
    screen
        .until("both", |window| window.document.clouds.as_ref().unwrap().clouds.loaded.len() == 2);
    // With both hidden the picture is the background.
    for name in ["sample.ply", "sample.ply (makes-cloud)"] {
        screen.harness.get_by_label(&eye(name)).click();
        screen.frames();
    }
    assert!(screen.window().document.clouds.as_ref().unwrap().clouds.loaded.is_empty());
    screen.settle();
    for name in ["sample.ply", "sample.ply (makes-cloud)"] {
        screen.harness.get_by_label(&eye(name)).click();
        screen.frames();
    }
    screen.window().plugins.tools.cloud_index = 1;
    run(&mut screen, "Stages AO");
    screen.until_said("stages-ao made ao of sample.ply (makes-cloud)");
    assert_eq!(items(screen.window())[1].loaded.cloud.floats("ao", 1), [0.5]);
    assert!(items(screen.window())[0].loaded.cloud.column("ao").is_none());
    // The edit, five clicks on the list, the new cloud.
    for _ in 0..7 {
        screen.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
        screen.frames();
    }
    assert_eq!(items(screen.window()).len(), 1);
    assert!(items(screen.window())[0].visible);
    screen.settle();
}

/// Invariant: an edited cloud is saved with its past, and the scene then names that file
#[test]
fn an_edited_cloud_is_saved_with_its_past_and_the_scene_names_it() {
    let folder = tempfile::tempdir().unwrap();
    let [cloud, scene] = ["edited.ply", "a.scene.toml"].map(|name| folder.path().join(name));
    let mut screen = with_tools(&[SAMPLE]);
    run(&mut screen, "Stages AO");
    screen.until_said("stages-ao made ao");
    screen.window().save_scene(&scene);
    assert!(screen.window().messages.contains("edits of sample.ply are in none yet"));
    let ctx = Context::default();
    // Its ending is added.
    screen.window().save_cloud(&ctx, 0, &cloud.with_extension(""));
    screen.until("the file", |window| window.document.cloud_writer.is_none());
    assert!(screen.window().messages.contains("edited.ply"));
    assert!(!items(screen.window())[0].is_unsaved());
    assert!(cloud.is_file());
    screen.window().messages.dismiss_all();
    for _ in 0..2 {
        screen.window().save_scene(&scene);
    }
    assert!(!screen.window().messages.contains("in none yet"));
    let text = std::fs::read_to_string(&scene).unwrap();
    assert_eq!(text.matches("path = \"edited.ply\"").count(), 1, "{text}");
    let mut other = with_tools(&[scene.to_str().unwrap()]);
    let reopened = &items(other.window())[0].loaded.cloud;
    let made = reopened.column("ao").unwrap().made().unwrap();
    assert_eq!(made.tool, "org.surfelshop.test.faulty/stages-ao");
    // Undone, the cloud is the one of the file it came from.
    screen.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    screen.until("the cloud before", |window| items(window)[0].saved_as.is_none());
    screen.window().save_scene(&scene);
    let text = std::fs::read_to_string(&scene).unwrap();
    assert!(text.contains("sample.ply") && !text.contains("edited.ply"), "{text}");
}
