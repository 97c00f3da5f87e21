//! Unsaved edits: asked about before they are lost, and recovered after a crash.

use super::tools::{items, run, with_tools};
use super::{SAMPLE, Screen};
use crate::document::recovery::JournalEnd;
use crate::document::recovery::Recovery;
use crate::document::{OpenCloud, undo};
use crate::window::Window;
use eframe::egui::{ViewportCommand, ViewportEvent, ViewportId};
use egui_kittest::kittest::Queryable as _;
use std::path::{Path, PathBuf};
use surfelshop_cloud::{Cloud, ReadOptions, WriteOptions};

impl Screen {
    /// Requests that the window closes; returns whether it would.
    fn close(&mut self) -> bool {
        let viewports = &mut self.harness.input_mut().viewports;
        viewports.get_mut(&ViewportId::ROOT).unwrap().events.push(ViewportEvent::Close);
        self.harness.step();
        let commands = &self.harness.output().viewport_output[&ViewportId::ROOT].commands;
        !commands.contains(&ViewportCommand::CancelClose)
    }

    pub(super) fn click(&mut self, label: &str) {
        // Questions come after the panels.
        self.harness.get_all_by_label(label).last().unwrap().click();
        self.frames();
    }

    fn asks(&self, words: &str) -> bool {
        self.harness.query_all_by_label(words).count() > 0
    }

    /// Uses a folder for recovery.
    pub(super) fn keeps_edits(&mut self, folder: &Path) {
        self.window().document.recovery = Some(Recovery::in_folder(folder));
        self.frames();
    }

    #[track_caller]
    pub(super) fn until_saved(&mut self) {
        self.until("the edits on disk", |window| {
            window.document.recovery.as_ref().is_some_and(|recovery| recovery.journal.is_idle())
        });
    }
}

/// The number of files in all sessions of a state folder.
fn n_files(folder: &Path) -> usize {
    let sessions = folder.join("recovery").read_dir().into_iter().flatten().flatten();
    let folders = sessions.filter(|found| found.path().is_dir());
    folders.flat_map(|found| found.path().read_dir().unwrap()).count()
}

/// Invariant: edits that are in no file are asked about once before they are lost
#[test]
fn closing_over_edits_asks_once_and_saves_discards_or_stays() {
    const QUESTION: &str = "Save edits before closing?";
    let mut screen = with_tools(&[SAMPLE]);
    run(&mut screen, "Stages AO");
    screen.until_said("stages-ao made ao");
    assert!(!screen.close(), "edits would be lost");
    screen.frames();
    assert!(screen.asks(QUESTION));
    screen.click("cancel");
    assert!(!screen.asks(QUESTION) && items(screen.window())[0].is_unsaved());
    // The cloud is saved in the program's own dialog; cancelling it loses nothing.
    screen.window().panels.dialogs.check_desktop = || Err("a test has no desktop".to_owned());
    for answer in ["cancel", "save"] {
        assert!(!screen.close());
        screen.frames();
        screen.click("save …");
        screen.until_label("Save the cloud");
        screen.frames();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("saved.ply");
        if answer == "save" {
            let field = screen.harness.get_by_label("name");
            field.focus();
            screen.frames();
            screen
                .harness
                .key_press_modifiers(eframe::egui::Modifiers::COMMAND, eframe::egui::Key::A);
            screen.harness.get_by_label("name").type_text(path.to_str().unwrap());
            screen.frames();
        }
        screen.click(answer);
        if answer == "cancel" {
            screen.until("the window", |window| window.document.unsaved_prompt.is_none());
            assert!(
                !screen.window().document.close_confirmed && items(screen.window())[0].is_unsaved()
            );
        } else {
            screen.until("the end", |window| window.document.close_confirmed);
            assert!(path.is_file() && !items(screen.window())[0].is_unsaved());
        }
    }
    assert!(screen.close(), "nothing would be lost");
}

/// Costs 3 s
#[test]
fn changes_of_a_scene_are_asked_about_and_written_to_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("a.scene.toml");
    let mut screen = Screen::sample();
    assert!(screen.close(), "there is no scene");
    screen.window().document.close_confirmed = false;
    screen.window().save_scene(&scene);
    assert!(!screen.window().has_unsaved());
    screen.window().settings.scene.exposure_stops = 1.5;
    assert!(!screen.close());
    screen.frames();
    assert!(screen.asks("Changes of this scene are not in its file:"));
    screen.click("cancel");
    assert!(screen.window().has_unsaved());
    assert!(!screen.close());
    screen.frames();
    screen.click("save");
    screen.until("the end", |window| window.document.close_confirmed);
    assert!(std::fs::read_to_string(&scene).unwrap().contains("exposure = 1.5"));
    // As opened, and with a change that is taken back.
    let mut screen = Screen::open(&[scene.to_str().unwrap()]);
    screen.settle();
    assert!(!screen.window().has_unsaved());
    screen.window().settings.scene.exposure_stops = -1.0;
    screen.until("a step", |window| window.has_unsaved());
    undo::undo(screen.window());
    screen.settle();
    assert!(screen.close());
}

/// What is asked before other files are opened.
const BEFORE_OPENING: &str = "Save edits before opening other files?";

/// A file of three points.
fn three_points(folder: &Path) -> PathBuf {
    let path = folder.join("other.ply");
    let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                property float z\nend_header\n0 0 0\n1 0 0\n0 1 0\n";
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn other_files_take_the_place_of_edits_after_a_question() {
    let folder = tempfile::tempdir().unwrap();
    let other = three_points(folder.path());
    let mut screen = with_tools(&[SAMPLE]);
    run(&mut screen, "Stages AO");
    screen.until_said("stages-ao made ao");
    for (answer, n_left) in [("cancel", 119_051), ("discard", 3)] {
        let context = screen.harness.ctx.clone();
        screen.window().open(&context, vec![other.clone()]);
        screen.until_label(BEFORE_OPENING);
        screen.click(answer);
        screen.until("the answer", |window| window.document.loader.is_none());
        assert_eq!(items(screen.window())[0].loaded.cloud.len(), n_left);
    }
    assert!(screen.close());
}

/// Invariant: a scene that was put together in the window is not replaced without a question
/// Costs 4 s
#[test]
fn other_files_take_the_place_of_a_scene_in_no_file_after_a_question() {
    let folder = tempfile::tempdir().unwrap();
    let other = three_points(folder.path());
    let mut screen = Screen::open(&[SAMPLE]);
    let context = screen.harness.ctx.clone();
    // A look of its own is no work that is lost.
    screen.window().settings.scene.exposure_stops = 1.5;
    screen.settle();
    let n_clouds = |screen: &mut Screen| items(screen.window()).len();
    screen.window().add(&context, vec![other.clone()]);
    screen.until("both", |window| items(window).len() == 2);
    screen.settle();
    assert!(!screen.window().has_unsaved(), "closing loses nothing");
    assert!(screen.window().replacing_loses(), "nor is a preview shown in its place");
    screen.window().open(&context, vec![other.clone()]);
    screen.until_label(BEFORE_OPENING);
    assert!(
        screen.asks("The scene as you put it together is in no file yet, and is lost otherwise.")
    );
    screen.click("cancel");
    screen.until("the answer", |window| window.document.loader.is_none());
    assert_eq!(n_clouds(&mut screen), 2);
    let scene = folder.path().join("both.scene.toml");
    screen.window().save_scene(&scene);
    screen.window().open(&context, vec![other]);
    screen.until("the other", |window| items(window).len() == 1);
}

/// The program of the test below, not a test itself.
#[test]
fn edits_until_killed() {
    let Some(folder) = std::env::var_os("SURFELSHOP_TEST_EDITS") else { return };
    let folder = Path::new(&folder);
    let mut screen = with_tools(&[SAMPLE]);
    screen.keeps_edits(folder);
    run(&mut screen, "Stages AO");
    screen.until_said("stages-ao made ao");
    screen.until_saved();
    let cloud = &items(screen.window())[0].loaded.cloud;
    let (unfinished, done) = (folder.join("unfinished.ply"), folder.join("expected.ply"));
    surfelshop_cloud::write(&unfinished, cloud, &WriteOptions::default()).unwrap();
    std::fs::rename(unfinished, done).unwrap();
    loop {
        screen.harness.step();
    }
}

fn same(a: &Cloud, b: &Cloud) {
    assert_eq!(a.columns().len(), b.columns().len());
    for (a, b) in a.columns().iter().zip(b.columns()) {
        assert_eq!((a.name(), a.values()), (b.name(), b.values()));
        assert_eq!(a.made(), b.made());
    }
    assert_eq!((a.origin(), a.history()), (b.origin(), b.history()));
}

/// Invariant: edits survive a kill with their very columns, and are nobody else's while their
/// window lives
#[test]
fn edits_are_recovered_after_a_kill() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = std::process::Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "tests::edits::edits_until_killed"])
        .env("SURFELSHOP_TEST_EDITS", folder.path())
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let expected = folder.path().join("expected.ply");
    let started = std::time::Instant::now();
    while !expected.is_file() {
        assert!(child.try_wait().unwrap().is_none() && started.elapsed() < super::TIMEOUT);
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    // The folder of a running window is locked.
    assert!(!Recovery::in_folder(folder.path()).asks());
    child.kill().unwrap();
    child.wait().unwrap();
    let mut screen = with_tools(&[SAMPLE]);
    screen.keeps_edits(folder.path());
    for label in ["Recover edits?", "sample.ply"] {
        assert!(screen.asks(label), "{label}");
    }
    screen.click("recover");
    screen.until_said("recovered sample.ply, not saved yet");
    let expected = surfelshop_cloud::read(&expected, &ReadOptions::default()).unwrap().cloud;
    same(&items(screen.window())[0].loaded.cloud, &expected);
    assert!(items(screen.window())[0].is_unsaved() && screen.asks("recovered"));
    // The scene names the source file.
    let scene = folder.path().join("a.scene.toml");
    screen.window().save_scene(&scene);
    assert!(std::fs::read_to_string(&scene).unwrap().contains("sample.ply"));
    screen.until_saved();
    // Ended by the system it is offered again, and deleted by the user it is not.
    let end = |screen: &mut Screen, end| {
        screen.window().document.recovery.as_mut().unwrap().journal.finish(end);
        screen.window().document.recovery = None;
    };
    end(&mut screen, JournalEnd::Keep);
    assert!(Recovery::in_folder(folder.path()).asks());
    screen.keeps_edits(folder.path());
    screen.click("delete");
    assert!(screen.asks("Delete these edits for good?"));
    screen.click("delete");
    end(&mut screen, JournalEnd::Remove);
    assert!(!Recovery::in_folder(folder.path()).asks());
    assert_eq!(n_files(folder.path()), 0);
}

/// Costs 2 s.
#[test]
fn a_recovered_scene_has_removed_clouds_no_more_and_keeps_names() {
    let folders = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let other = folders[0].path().join("other.ply");
    std::fs::copy(SAMPLE, &other).unwrap();
    let mut screen = with_tools(&[SAMPLE, other.to_str().unwrap()]);
    screen.keeps_edits(folders[1].path());
    let window = screen.window();
    let open_clouds = window.document.clouds.as_ref().unwrap().open_clouds.clone();
    window.show_clouds(open_clouds.without(0).titled(0, "mine"));
    screen.frames();
    run(&mut screen, "Stages AO");
    screen.until_said("stages-ao made ao");
    screen.until_saved();
    let recovery = screen.window().document.recovery.as_mut().unwrap();
    recovery.journal.finish(JournalEnd::Keep);
    drop(screen);
    let mut screen = with_tools(&[SAMPLE]);
    screen.keeps_edits(folders[1].path());
    screen.click("recover");
    screen.until_said("not saved yet");
    let names = items(screen.window()).iter().map(OpenCloud::name).collect::<Vec<_>>();
    assert_eq!(names, ["mine"]);
    let scene = folders[0].path().join("a.scene.toml");
    screen.window().save_scene(&scene);
    let saved = surfelshop_cloud::scene::read(&scene).unwrap().scene;
    assert_eq!(saved.clouds.len(), 1, "{:?}", saved.clouds);
    assert_eq!(saved.clouds[0].name.as_deref(), Some("mine"));
}

#[test]
fn what_is_kept_follows_undo_and_saving_and_is_bounded() {
    use eframe::egui::{Context, Key, Modifiers};
    let folder = tempfile::tempdir().unwrap();
    let mut screen = with_tools(&[SAMPLE]);
    screen.keeps_edits(folder.path());
    run(&mut screen, "Stages AO");
    screen.until_said("stages-ao made ao");
    screen.until_saved();
    // The cloud, two scenes, the manifest.
    assert_eq!(n_files(folder.path()), 4);
    screen.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    screen.until("the cloud before", |window| !items(window)[0].is_unsaved());
    screen.until_saved();
    assert_eq!(n_files(folder.path()), 0, "nothing is edited any more");
    screen.harness.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    screen.until("the edited cloud", |window| items(window)[0].is_unsaved());
    screen.until_saved();
    assert_eq!(n_files(folder.path()), 4);
    screen.window().save_cloud(&Context::default(), 0, &folder.path().join("saved.ply"));
    screen
        .until("the file", |window: &mut Window| !items(window).iter().any(OpenCloud::is_unsaved));
    screen.until_saved();
    assert_eq!(n_files(folder.path()), 0, "the user's own file has it");
    // What is too large is not written, which is reported.
    screen.window().document.recovery = Some(Recovery::in_folder(folder.path()));
    screen.window().document.recovery.as_mut().unwrap().journal.keep_at_most(1_000);
    screen.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    screen.frames();
    run(&mut screen, "Stages AO");
    screen.until_said("edits are not kept for the case of a crash");
    assert!(items(screen.window())[0].is_unsaved(), "the edit goes on");
}
