//! The outliner and the properties of what is selected, by mouse, keyboard and screen reader.

use super::{SAMPLE, Screen};
use crate::commands::{self, COMMANDS};
use crate::document::Mode;
use crate::panels::Selection;
use crate::preferences::Page;
use crate::views::CameraMode;
use crate::window::Window;
use eframe::egui::accesskit::{Role, Toggled};
use eframe::egui::{Key, Modifiers, Vec2};
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use glam::DVec3;
use std::collections::BTreeMap;
use surfelshop_api::{Light, Scene};
use surfelshop_cloud::Transform;

fn run(screen: &mut Screen, id: &str) {
    let ctx = screen.harness.ctx.clone();
    let command = commands::find(id).unwrap();
    commands::run(screen.window(), &ctx, command);
    screen.frames();
}

/// A window with two clouds.
fn two() -> Screen {
    let mut screen = Screen::open(&[SAMPLE, SAMPLE]);
    screen.harness.set_size(Vec2::new(1280.0, 1000.0));
    screen.settle();
    screen
}

fn visible(window: &Window) -> Vec<bool> {
    let shown = window.document.clouds.as_ref().unwrap();
    shown.open_clouds.all().iter().map(|cloud| cloud.visible).collect()
}

#[test]
fn clouds_are_selected_hidden_renamed_and_removed_and_undo_brings_them_back() {
    let mut screen = two();
    screen.harness.get_all_by_label("sample.ply").next().unwrap().click();
    screen.frames();
    assert_eq!(screen.window().selection(), Selection::Cloud(0));
    assert!(screen.harness.query_all_by_label("Colours of all clouds").count() > 0);
    screen.harness.get_all_by_label("show sample.ply").next().unwrap().click();
    screen.until("one cloud", |window| visible(window) == [false, true]);
    screen.harness.key_press_modifiers(Modifiers::ALT, Key::H);
    screen.until("both", |window| visible(window) == [true, true]);
    screen.window().select(Selection::Cloud(1));
    screen.harness.key_press(Key::F2);
    screen.frames();
    screen.harness.get_by_label("new name").type_text("a copy");
    screen.frames();
    screen.harness.key_press(Key::Enter);
    screen.frames();
    assert_eq!(screen.window().name_of(Selection::Cloud(1)), "a copy");
    // A shortcut of one letter is typed and does not run meanwhile.
    assert_eq!(visible(screen.window()), [true, true]);
    screen.until("a step to undo", |window| window.document.history.has_undo(&window.snapshot()));
    screen.window().select(Selection::Cloud(0));
    screen.harness.key_press(Key::Delete);
    screen.until("one left", |window| visible(window) == [true]);
    assert_eq!(screen.window().name_of(Selection::Cloud(0)), "a copy");
    screen.window().select(Selection::Cloud(0));
    run(&mut screen, "remove-selected");
    assert!(screen.window().messages.contains("it is the only cloud"));
    screen.until("a step to undo", |window| window.document.history.has_undo(&window.snapshot()));
    screen.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    screen.until("both again", |window| visible(window).len() == 2);
}

/// Invariant: a scene has what was removed, renamed and moved in the window
#[test]
fn scenes_keep_names_places_cameras_and_lights_that_are_off() {
    let mut screen = two();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("two.scene.toml");
    let moved = Transform { translation: DVec3::new(3.0, 0.5, 0.0), ..Transform::default() };
    let window = screen.window();
    let open = window.document.clouds.as_ref().unwrap().open_clouds.clone();
    let open = open.titled(1, "the other").placed(1, &moved).unwrap().without(0);
    window.show_clouds(open);
    screen.frames();
    assert!(!screen.window().document.clouds.as_ref().unwrap().open_clouds.all()[0].is_unsaved());
    run(&mut screen, "remember-camera");
    screen.window().add_light(None);
    screen.window().toggle_light(Selection::Light(1));
    screen.window().rename(Selection::View, "mine");
    screen.settle();
    let window = screen.window();
    let (bookmarks, off) = (window.settings.bookmarks.clone(), window.settings.lights_off.clone());
    assert!(bookmarks[0].picture.is_some() && off.len() == 1);
    window.save_scene(&path);
    let saved = surfelshop_cloud::scene::read(&path).unwrap();
    assert!(saved.warnings.is_empty(), "{:?}", saved.warnings);
    assert_eq!(saved.scene.clouds.len(), 1, "one was removed");
    let n_opened = screen.window().document.n_opened;
    let ctx = screen.harness.ctx.clone();
    screen.window().open(&ctx, vec![path.clone()]);
    screen.until("the scene", |window| window.document.n_opened > n_opened);
    screen.settle();
    let window = screen.window();
    assert_eq!(window.name_of(Selection::Cloud(0)), "the other");
    assert_eq!(window.name_of(Selection::View), "mine");
    assert_eq!(window.settings.lights_off, off);
    assert_eq!(window.settings.bookmarks[0].camera, bookmarks[0].camera);
    assert!(window.settings.bookmarks[0].picture.is_some());
    let center = |window: &Window| {
        let facts = &window.document.clouds.as_ref().unwrap().clouds.facts;
        0.5 * (facts.bounds_min + facts.bounds_max)
    };
    let first = center(window);
    // Saved again it is the same file.
    let text = std::fs::read_to_string(&path).unwrap();
    window.save_scene(&path);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
    screen.window().open(&ctx, vec![SAMPLE.into()]);
    screen.until("the sample", |window| {
        window.document.clouds.as_ref().is_some_and(|shown| shown.frames)
            && window.document.loader.is_none()
            && window.document.scene_file.is_none()
    });
    screen.settle();
    let plain = center(screen.window());
    assert!((first - plain - moved.translation).length() < 1e-5, "{first} {plain}");
    assert!(screen.window().settings.bookmarks.is_empty());
}

#[test]
fn cameras_are_remembered_and_stepped_through() {
    let mut screen = Screen::sample();
    screen.window().preferences.reduced_motion = true;
    let first = screen.window().views.camera;
    screen.harness.key_press_modifiers(Modifiers::SHIFT, Key::C);
    screen.frames();
    run(&mut screen, "view-top");
    let second = screen.window().views.camera;
    run(&mut screen, "remember-camera");
    assert_eq!(screen.window().settings.bookmarks.len(), 2);
    for expected in [first, second, first] {
        screen.harness.key_press(Key::PageDown);
        screen.frames();
        assert_eq!(screen.window().views.camera, expected);
    }
    screen.harness.key_press(Key::PageUp);
    screen.frames();
    assert_eq!(screen.window().views.camera, second);
    run(&mut screen, "remove-selected");
    assert_eq!(screen.window().settings.bookmarks.len(), 1);
}

#[test]
fn the_mouse_moves_the_camera_as_it_was_chosen() {
    let mut screen = Screen::sample();
    screen.window().preferences.reduced_motion = true;
    let mode = |screen: &mut Screen| screen.window().camera_mode();
    assert_eq!(mode(&mut screen), CameraMode::Turntable);
    run(&mut screen, "trackball");
    assert_eq!(mode(&mut screen), CameraMode::Trackball);
    let before = screen.window().views.camera;
    let at = middle_of_picture(&screen);
    drag(&mut screen, at, Vec2::new(0.0, 120.0));
    let tumbled = screen.window().views.camera;
    assert!(tumbled.up.distance(before.up) > 0.01 && tumbled.target == before.target);
    run(&mut screen, "walk");
    assert_eq!(mode(&mut screen), CameraMode::Walk);
    let standing = screen.window().views.camera;
    drag(&mut screen, at, Vec2::new(60.0, 0.0));
    let turned = screen.window().views.camera;
    assert!(turned.eye == standing.eye && turned.target != standing.target);
    run(&mut screen, "turntable");
    assert_eq!(screen.window().views.camera.up, DVec3::Y, "it stands upright again");
}

/// The middle of the first picture.
fn middle_of_picture(screen: &Screen) -> eframe::egui::Pos2 {
    let size = screen.harness.ctx.content_rect().size();
    eframe::egui::pos2(0.42 * size.x, 0.7 * size.y)
}

fn drag(screen: &mut Screen, from: eframe::egui::Pos2, by: Vec2) {
    screen.harness.drag_at(from);
    screen.frames();
    for step in 1..=4 {
        screen.harness.hover_at(from + by * (step as f32 / 4.0));
        screen.harness.step();
    }
    screen.harness.drop_at(from + by);
    screen.frames();
}

#[test]
fn a_renderer_is_dragged_onto_a_view_and_compared_by_a_line_that_keys_move() {
    let mut screen = Screen::sample();
    screen.harness.set_size(Vec2::new(1280.0, 900.0));
    screen.settle();
    let row = screen.harness.get_all_by_label("flat").next().unwrap().rect().center();
    let size = screen.window().views.panes[&0].size_px;
    assert!(size[0] > 400, "{size:?}");
    drag(&mut screen, row, eframe::egui::pos2(800.0, 500.0) - row);
    let pane = screen.window().settings.panes[0].clone();
    assert_eq!((pane.mode, pane.renderers[1].as_str()), (Mode::Wipe, "flat"));
    screen.settle();
    screen.harness.get_by_label("line between the two pictures").focus();
    screen.frames();
    screen.harness.key_press(Key::ArrowRight);
    screen.frames();
    assert!(screen.window().settings.panes[0].wipe > 0.5);
    let row = screen.harness.get_all_by_label("environment").last().unwrap().rect().center();
    drag(&mut screen, row, eframe::egui::pos2(350.0, 500.0) - row);
    assert_eq!(screen.window().settings.panes[0].renderers[0], "environment");
}

#[test]
fn two_clouds_are_compared_by_one_renderer() {
    let mut screen = two();
    let moved = Transform { translation: DVec3::new(0.4, 0.0, 0.0), ..Transform::default() };
    let window = screen.window();
    let open = window.document.clouds.as_ref().unwrap().open_clouds.clone();
    window.show_clouds(open.titled(1, "moved").placed(1, &moved).unwrap());
    screen.settle();
    let columns = screen.window().render.counters.column_bytes;
    screen.window().select(Selection::Cloud(0));
    run(&mut screen, "compare-clouds");
    screen.settle();
    let window = screen.window();
    let pane = &window.settings.panes[0];
    assert_eq!(pane.clouds, [Some("sample.ply".to_owned()), Some("moved".to_owned())]);
    assert_eq!(window.render.counters.column_bytes, columns, "nothing is uploaded again");
    let difference = window.views.panes.get_mut(&0).unwrap().difference().unwrap();
    assert!(difference.rmse > 0.01, "{}", difference.describe());
    // The same cloud on both sides is equal to itself.
    window.settings.panes[0].clouds[1] = Some("sample.ply".to_owned());
    screen.settle();
    let difference = screen.window().views.panes.get_mut(&0).unwrap().difference().unwrap();
    assert_eq!(difference.describe(), "equal");
}

#[test]
fn lights_are_switched_off_and_on_and_duplicated() {
    let mut screen = Screen::sample();
    let usual = Scene::default().lights;
    screen.harness.get_by_label("show light 1").click();
    screen.frames();
    let settings = &screen.window().settings;
    assert_eq!((settings.scene.lights.len(), &settings.lights_off), (0, &usual));
    screen.settle();
    screen.harness.get_by_label("show light 1").click();
    screen.frames();
    assert_eq!(screen.window().settings.scene.lights, usual);
    run(&mut screen, "duplicate-selected");
    assert_eq!(screen.window().settings.scene.lights, [usual[0], usual[0]]);
    assert_eq!(screen.window().selection(), Selection::Light(1));
    let hue = |light: &Light| match light {
        Light::Directional { radiance, .. } => radiance.max_element(),
        Light::Point { .. } | Light::Spot { .. } => 0.0,
    };
    assert!(hue(&screen.window().settings.scene.lights[1]) > 0.0);
}

#[test]
fn panels_keep_their_widths_and_a_narrow_window_has_one_panel() {
    let mut screen = Screen::sample();
    screen.harness.set_size(Vec2::new(1280.0, 720.0));
    screen.frames();
    let width = |screen: &mut Screen| screen.window().views.panes[&0].size_px[0];
    let first = width(&mut screen);
    for renderer in ["flat", "environment", "procedural", "ewa-phong"] {
        screen.window().settings.panes[0].renderers[0] = renderer.to_owned();
        screen.settle();
        assert_eq!(width(&mut screen), first, "{renderer}");
    }
    for selection in [Selection::Cloud(0), Selection::Light(0), Selection::Environment] {
        screen.window().select(selection);
        screen.frames();
        assert_eq!(width(&mut screen), first, "{selection:?}");
    }
    screen.harness.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::B);
    screen.frames();
    assert!(width(&mut screen) > first + 200);
    screen.harness.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::B);
    screen.harness.set_size(Vec2::new(640.0, 360.0));
    screen.frames();
    assert!(width(&mut screen) > 280, "{}", width(&mut screen));
    assert!(screen.harness.query_all_by_label("sample.ply").count() > 0);
}

/// Controls whose name or role a screen reader would miss; and how many there are of each role.
fn unnamed(screen: &Screen) -> (Vec<String>, BTreeMap<String, usize>) {
    let interactive = [
        Role::Button,
        Role::CheckBox,
        Role::ComboBox,
        Role::Slider,
        Role::SpinButton,
        Role::TextInput,
        Role::ColorWell,
        Role::RadioButton,
        Role::ListItem,
        Role::Link,
    ];
    let (mut missing, mut counts) = (Vec::new(), BTreeMap::new());
    for role in interactive {
        for node in screen.harness.query_all_by_role(role) {
            let node = node.accesskit_node();
            let by_label =
                || node.labelled_by().filter_map(|label| label.value().or(label.label()));
            let name = node.label().or_else(|| by_label().next()).unwrap_or_default();
            *counts.entry(format!("{role:?}")).or_insert(0) += 1;
            // The name is read, so that an icon is none.
            if !name.chars().any(|c| c.is_ascii_alphanumeric()) {
                missing.push(format!("{role:?} {name:?} at {:?}", node.raw_bounds()));
            }
        }
    }
    (missing, counts)
}

/// Invariant: every control has a name and a role
#[test]
fn every_control_of_every_panel_has_a_name_and_a_role() {
    let mut screen = two();
    screen.harness.set_size(Vec2::new(1280.0, 1900.0));
    screen.window().settings.panes[0].mode = Mode::Wipe;
    run(&mut screen, "remember-camera");
    screen
        .window()
        .settings
        .scene
        .lights
        .push(Light::Point { position: DVec3::ONE, intensity: glam::Vec3::ONE });
    screen.window().toggle_light(Selection::Light(0));
    crate::document::set_environment_map(
        screen.window(),
        surfelshop_cloud::scene::ProbeSource::Studio,
    );
    screen.settle();
    let mut total = BTreeMap::new();
    let mut check = |screen: &mut Screen, what: &str| {
        screen.frames();
        let (missing, counts) = unnamed(screen);
        assert!(missing.is_empty(), "{what}: {missing:#?}");
        counts.into_iter().for_each(|(role, n)| *total.entry(role).or_insert(0) += n);
    };
    for selection in [
        Selection::View,
        Selection::Cloud(0),
        Selection::Light(0),
        Selection::LightOff(0),
        Selection::Environment,
        Selection::Camera,
        Selection::Bookmark(0),
    ] {
        screen.window().select(selection);
        check(&mut screen, &format!("{selection:?}"));
    }
    screen.window().settings.color = surfelshop_cloud::display::ColorSource::new(
        surfelshop_cloud::display::ColorBy::Attribute(surfelshop_cloud::display::Attribute::Height),
    );
    screen.window().select(Selection::Cloud(1));
    screen.settle();
    check(&mut screen, "colours by height");
    run(&mut screen, "measure");
    check(&mut screen, "compare quality");
    run(&mut screen, "measure");
    for page in Page::ALL {
        screen.window().panels.settings_window = true;
        screen.window().panels.settings.page = page;
        check(&mut screen, page.name());
    }
    screen.window().panels.settings_window = false;
    for id in ["save-pictures", "keys", "manual", "plugins", "messages", "all-commands"] {
        run(&mut screen, id);
        check(&mut screen, id);
        screen.harness.key_press(Key::Escape);
        screen.frames();
    }
    for tool in screen.window().plugins.registry.names(surfelshop_api::UnitKind::Tool) {
        screen.window().plugins.tools.open = Some(tool.clone());
        screen.frames();
        screen.frames();
        check(&mut screen, &tool);
    }
    screen.window().plugins.tools.open = None;
    for role in ["Button", "CheckBox", "ComboBox", "Slider", "SpinButton", "TextInput", "ListItem"]
    {
        assert!(total.get(role).is_some_and(|n| *n > 3), "{role}: {total:?}");
    }
    let eye = screen.harness.get_all_by_label("show sample.ply").next().unwrap();
    assert_eq!(eye.accesskit_node().toggled(), Some(Toggled::True));
}

#[test]
fn a_shortcut_is_changed_by_pressing_it_and_a_taken_one_is_refused() {
    let mut screen = Screen::sample();
    screen.window().panels.settings_window = true;
    screen.window().panels.settings.page = Page::Shortcuts;
    screen.harness.set_size(Vec2::new(1280.0, 900.0));
    screen.frames();
    screen.harness.get_by_label("search shortcuts").click();
    screen.frames();
    screen.harness.get_by_label("search shortcuts").type_text("split the view below");
    screen.frames();
    screen.harness.get_by_label("shortcut of Split the view below").click();
    screen.frames();
    screen.harness.key_press(Key::M);
    screen.frames();
    assert!(!screen.window().measure.form.open, "it was not run");
    assert!(screen.window().preferences.shortcuts.is_empty(), "M is that of another one");
    screen.harness.get_by_label("shortcut of Split the view below").click();
    screen.frames();
    // The key of a modifier comes before the one that it is held for.
    screen.harness.key_press(Key::ControlLeft);
    screen.frames();
    assert!(screen.window().preferences.shortcuts.is_empty(), "it waits for the next one");
    screen.harness.key_press(Key::F7);
    screen.frames();
    assert_eq!(screen.window().preferences.shortcuts["split-below"], ["F7"]);
    screen.window().panels.settings_window = false;
    screen.frames();
    screen.harness.key_press(Key::F7);
    screen.until("another view", |window| window.settings.panes.len() == 2);
}

/// Invariant: every command is reached by the palette alone
#[test]
fn every_command_is_found_by_its_name_in_the_palette() {
    let mut screen = Screen::sample();
    for command in COMMANDS.iter().filter(|command| command.id != "all-commands") {
        screen.window().panels.palette.open_with(&commands::name_alone(command));
        screen.harness.step();
        let rows = commands::palette_entries(screen.window());
        let name = commands::name_alone(command);
        assert!(rows.iter().any(|row| row.name == name), "{}", command.id);
    }
}

#[test]
fn a_light_of_each_kind_is_added_within_the_view() {
    let mut screen = Screen::sample();
    for (name, is_placed) in
        [("Add a directional light", false), ("Add a point light", true), ("Add a spotlight", true)]
    {
        screen.harness.get_by_label("add to lights").click();
        screen.frames();
        screen.harness.get_all_by_label_contains(name).next().unwrap().click();
        screen.frames();
        let window = screen.window();
        let light = *window.settings.scene.lights.last().unwrap();
        assert_eq!(window.selection(), Selection::Light(window.settings.scene.lights.len() - 1));
        let (Light::Point { position, .. } | Light::Spot { position, .. }) = light else {
            assert!(!is_placed, "{light:?}");
            continue;
        };
        let camera = window.camera_of(window.views.focused);
        let offset = camera.view_from_world() * (position - camera.eye);
        let half = 0.25 * crate::views::navigation::height_at_target(&camera);
        assert!(is_placed && offset.x.abs() < 1e-9 * half && offset.y.abs() < half, "{offset:?}");
    }
    // What is wrong to remove is not removed: somebody who selects surfels means those.
    run(&mut screen, "select-lasso");
    screen.harness.key_press(Key::Delete);
    screen.frames();
    assert_eq!(screen.window().settings.scene.lights.len(), 4, "the usual one and three");
    assert!(screen.window().messages.contains("no surfels are selected"));
}
