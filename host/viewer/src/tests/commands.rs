//! Commands by keyboard, palette, toolbar and axes.

use super::{SAMPLE, Screen, built_plugins};
use crate::ViewerArguments;
use crate::commands::{self, COMMANDS, name_alone, palette_entries};
use eframe::egui::{Event, Key, Modifiers, pos2};
use egui_kittest::kittest::Queryable as _;
use glam::DVec3;
use surfelshop_api::Projection;
use surfelshop_cloud::display::{Attribute, ColorBy};
use surfelshop_cloud::scene::Axis;
use surfelshop_session::input::sample::find_sample;
use surfelshop_session::options::{DeviceArguments, UpAxis};

fn run(screen: &mut Screen, id: &str) {
    let ctx = screen.harness.ctx.clone();
    let command = commands::find(id).unwrap();
    commands::run(screen.window(), &ctx, command);
    screen.frames();
}

fn empty() -> Screen {
    let mut screen = Screen::with(&ViewerArguments {
        memory: None,
        in_place: false,
        colors: Default::default(),
        files: Vec::new(),
        up: UpAxis::Auto,
        plugins: built_plugins(),
        device: DeviceArguments::default(),
    });
    screen.frames();
    screen
}

/// Invariant: every command is in the palette, and says there why it cannot be used
#[test]
fn every_command_is_in_the_palette_and_says_why_it_does_not_apply() {
    let mut screen = empty();
    for command in COMMANDS.iter() {
        let rows = palette_entries(screen.window());
        let row = rows.iter().find(|row| row.name == name_alone(command)).unwrap();
        let reason = (command.applies)(screen.window()).err();
        assert_eq!(row.reason, reason, "{}", command.id);
        assert!(reason.is_none_or(|reason| reason.len() > 10 && !reason.ends_with('.')));
    }
    let n_refused =
        palette_entries(screen.window()).iter().filter(|row| row.reason.is_some()).count();
    assert!(n_refused > 12, "{n_refused} commands need something open");
    // One that does not apply says so, and changes nothing.
    run(&mut screen, "save-scene");
    assert!(screen.window().messages.contains("Save scene: no cloud is open"));
}

#[test]
fn a_command_is_found_by_words_and_run_by_keyboard_alone() {
    let mut screen = empty();
    screen.harness.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::P);
    screen.frames();
    assert!(screen.window().panels.palette.is_open());
    screen.harness.get_by_label("Search commands").type_text("ground gr");
    screen.frames();
    assert!(screen.harness.query_all_by_label("Ground grid").count() > 1, "toolbar and row");
    let before = screen.window().preferences.grid;
    screen.harness.key_press(Key::Enter);
    screen.frames();
    assert!(
        screen.window().preferences.grid != before && !screen.window().panels.palette.is_open()
    );
    // The second row, and back without it.
    screen.harness.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::P);
    screen.frames();
    screen.harness.key_press(Key::ArrowDown);
    screen.harness.key_press(Key::Escape);
    screen.frames();
    assert!(!screen.window().panels.palette.is_open());
}

#[test]
fn the_palette_colours_by_what_clouds_have() {
    let mut screen = Screen::sample();
    screen.harness.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::P);
    screen.frames();
    screen.harness.get_by_label("Search commands").type_text("colour height");
    screen.frames();
    screen.harness.key_press(Key::Enter);
    screen.frames();
    let by = screen.window().settings.color.by.clone();
    assert_eq!(by, ColorBy::Attribute(Attribute::Height));
    screen.settle();
    assert!(screen.window().legend().is_some(), "heights have a legend");
    // A change as any other.
    run(&mut screen, "undo");
    assert_eq!(screen.window().settings.color.by, ColorBy::File);
}

#[test]
fn help_opens_by_f1_and_by_the_question_mark_and_closes_by_escape() {
    let mut screen = empty();
    for key in [Key::F1, Key::Questionmark] {
        screen.harness.key_press(key);
        screen.frames();
        assert!(screen.window().panels.key_list, "{key:?}");
        assert!(screen.harness.query_all_by_label("Ctrl+Shift+P").count() > 0);
        screen.harness.key_press(Key::Escape);
        screen.frames();
        assert!(!screen.window().panels.key_list, "{key:?}");
    }
}

#[test]
fn keys_and_axes_look_from_the_sides() {
    let mut screen = Screen::sample();
    screen.window().preferences.reduced_motion = true;
    let front = |screen: &mut Screen| screen.window().views.camera.forward();
    let keys = [
        (Modifiers::NONE, Key::Num1, DVec3::NEG_Z),
        (Modifiers::COMMAND, Key::Num1, DVec3::Z),
        (Modifiers::NONE, Key::Num3, DVec3::NEG_X),
        (Modifiers::COMMAND, Key::Num3, DVec3::X),
        (Modifiers::NONE, Key::Num7, DVec3::NEG_Y),
        (Modifiers::COMMAND, Key::Num7, DVec3::Y),
    ];
    for (modifiers, key, expected) in keys {
        screen.harness.key_press_modifiers(modifiers, key);
        screen.frames();
        let found = front(&mut screen);
        assert!(found.distance(expected) < 1e-3, "{key:?}: {found}");
    }
    screen.harness.get_by_label("view from the right").click();
    screen.frames();
    assert!(front(&mut screen).distance(DVec3::NEG_X) < 1e-3);
    screen.harness.key_press(Key::Num5);
    screen.frames();
    let camera = screen.window().views.camera;
    assert!(matches!(camera.projection, Projection::Orthographic { .. }));
}

#[test]
fn a_camera_arrives_after_a_moment_and_a_user_stops_it() {
    let mut screen = Screen::sample();
    let before = screen.window().views.camera;
    run(&mut screen, "view-left");
    assert!(screen.window().views.flight.is_none() || screen.window().views.camera != before);
    screen.until("the end of the move", |window| window.views.flight.is_none());
    assert!(screen.window().views.camera.forward().distance(DVec3::X) < 1e-9);
    let command = commands::find("view-back").unwrap();
    let ctx = screen.harness.ctx.clone();
    commands::run(screen.window(), &ctx, command);
    screen.harness.step();
    screen.window().views.camera = before;
    screen.frames();
    assert_eq!(screen.window().views.camera, before, "it is the user's");
}

#[test]
fn looks_are_one_step_of_undo_each_and_the_menu_marks_the_one_that_is_shown() {
    let mut screen = Screen::sample();
    let before = screen.window().settings.clone();
    let marked = |screen: &mut Screen| -> Vec<&str> {
        let mut marked = Vec::new();
        for command in COMMANDS.iter().filter(|command| command.id.starts_with("look-")) {
            if command.is_on.is_some_and(|is_on| is_on(screen.window())) {
                marked.push(command.id);
            }
        }
        marked
    };
    assert_eq!(marked(&mut screen), ["look-headlight"]);
    for id in ["look-studio", "look-sunlight", "look-clay", "look-points"] {
        run(&mut screen, id);
        assert_ne!(screen.window().settings, before, "{id}");
        assert_eq!(marked(&mut screen), [id]);
        screen.settle();
        screen.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
        screen.until("the former look", |window| window.settings == before);
    }
    // Without a column of occlusion there is nothing to show.
    run(&mut screen, "look-occlusion");
    assert!(screen.window().messages.contains("no ambient occlusion yet"));
    run(&mut screen, "look-headlight");
    assert_eq!(screen.window().settings, before, "it is how new files are shown");
}

/// A key that is down as part of a shortcut does not fly, even where the other one is let go first.
#[test]
fn shortcuts_do_not_move_the_camera() {
    let mut screen = Screen::sample();
    let size = screen.harness.ctx.content_rect().size();
    let middle = pos2(0.42 * size.x, 0.7 * size.y);
    screen.harness.hover_at(middle);
    screen.settle();
    let before = screen.window().views.camera;
    let press = |screen: &mut Screen, pressed: bool, modifiers: Modifiers, repeat: bool| {
        let (key, physical_key) = (Key::S, None);
        let event = Event::Key { key, physical_key, pressed, repeat, modifiers };
        screen.harness.event(event);
        screen.frames();
    };
    press(&mut screen, true, Modifiers::ALT, false);
    press(&mut screen, true, Modifiers::NONE, true);
    screen.frames();
    assert_eq!(screen.window().views.camera, before);
    press(&mut screen, false, Modifiers::NONE, false);
    press(&mut screen, true, Modifiers::NONE, false);
    screen.frames();
    assert_ne!(screen.window().views.camera, before, "alone it flies");
    press(&mut screen, false, Modifiers::NONE, false);
}

#[test]
fn the_up_axis_is_remembered_for_files_of_a_kind() {
    let mut screen = Screen::sample();
    run(&mut screen, "up-z");
    assert_eq!(screen.window().views.camera.up, DVec3::Z);
    assert_eq!(screen.window().preferences.up.get("ply"), Some(&Axis::PlusZ));
    screen.settle();
    run(&mut screen, "undo");
    assert_eq!(screen.window().views.camera.up, DVec3::Y);
    screen.settle();
    run(&mut screen, "redo");
    assert_eq!(screen.window().views.camera.up, DVec3::Z);
    screen.settle();
    run(&mut screen, "up-down");
    assert_eq!(screen.window().views.camera.up, DVec3::NEG_Z);
    assert_eq!(screen.window().preferences.up.get("ply"), Some(&Axis::MinusZ));
    screen.settle();
    run(&mut screen, "undo");
    run(&mut screen, "up-z");
    screen.window().document.typed_up = UpAxis::Auto;
    let ctx = screen.harness.ctx.clone();
    let folder = tempfile::tempdir().unwrap();
    let other = folder.path().join("other.ply");
    std::fs::copy(SAMPLE, &other).unwrap();
    let cases = [(true, &other, UpAxis::Z), (false, &other, UpAxis::Y)];
    // The program's own stands as it is made.
    let sample = find_sample().unwrap();
    for (remembered, file, expected) in [(true, &sample, UpAxis::Y)].into_iter().chain(cases) {
        if !remembered {
            screen.window().preferences.up.clear();
        }
        let n_opened = screen.window().document.n_opened;
        screen.window().open(&ctx, vec![file.clone()]);
        screen.until("the file", |window| window.document.n_opened > n_opened);
        assert_eq!(screen.window().document.up, expected);
    }
}

#[test]
fn without_files_there_is_the_start_page_and_its_examples_open() {
    let mut screen = empty();
    assert!(screen.window().shows_start_page());
    for label in ["Example: Cornell box", "Example: Gaussian splats", "Example: Sample"] {
        screen.harness.get_by_label(label);
    }
    screen.harness.get_by_label("Example: Sample").click();
    screen.until("the sample", |window| window.document.clouds.is_some());
    assert!(!screen.window().shows_start_page());
    screen.settle();
    run(&mut screen, "start-page");
    assert!(screen.window().shows_start_page());
    screen.harness.key_press(Key::Escape);
    screen.frames();
    assert!(!screen.window().shows_start_page());
}

/// Every command that needs no answer is run, in all states that the others leave.
#[test]
fn every_command_runs() {
    let mut screen = Screen::sample();
    let asks =
        ["open", "open-last", "save-scene", "save-scene-as", "save-cloud", "quit", "full-screen"];
    for command in COMMANDS.iter().filter(|command| !asks.contains(&command.id)) {
        run(&mut screen, command.id);
        screen.harness.key_press(Key::Escape);
        screen.frames();
    }
    assert!(!screen.window().messages.contains("panicked"));
}

#[test]
fn every_button_of_the_toolbar_has_a_name() {
    use egui_kittest::kittest::NodeT as _;
    let mut screen = Screen::sample();
    screen.frames();
    let buttons = screen.harness.query_all_by_role(eframe::egui::accesskit::Role::Button);
    let names: Vec<String> =
        buttons.map(|button| button.accesskit_node().label().unwrap_or_default()).collect();
    assert!(names.len() > 20, "{names:?}");
    let readable = |name: &String| name.chars().any(|c| c.is_ascii_alphanumeric());
    let unnamed = names.iter().filter(|name| !readable(name)).count();
    assert_eq!(unnamed, 0, "{names:?}");
}

#[test]
fn menus_and_the_list_of_renderers_are_led_by_keys() {
    let mut screen = Screen::sample();
    screen.harness.key_press(Key::F10);
    screen.frames();
    for key in [Key::ArrowRight, Key::ArrowLeft, Key::Enter] {
        screen.harness.key_press(key);
        screen.frames();
    }
    assert!(
        screen.harness.query_all_by_label_contains("Open recent").count() > 0,
        "a menu is open"
    );
    screen.harness.key_press(Key::Escape);
    screen.frames();
    let drawn = |screen: &mut Screen| screen.window().settings.panes[0].renderers[0].clone();
    let before = drawn(&mut screen);
    screen.harness.get_by_label("first renderer").click();
    screen.frames();
    for key in [Key::ArrowDown, Key::Enter] {
        screen.harness.key_press(key);
        screen.frames();
    }
    assert_ne!(drawn(&mut screen), before);
    // Beside itself nothing is compared.
    let window = screen.window();
    window.settings.panes[0].renderers = ["flat".to_owned(), "flat".to_owned()];
    run(&mut screen, "wipe");
    assert_eq!(screen.window().settings.panes[0].renderers, ["flat", "ewa-phong"]);
}
