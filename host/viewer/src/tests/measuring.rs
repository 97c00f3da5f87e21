//! Measures: clicked, drawn, undone, copied and saved with the scene; and surfels that are hidden.

use super::{Screen, built_plugins};
use crate::commands::{self, find};
use crate::panels::Selection;
use crate::views::hands::HandMode;
use eframe::egui::{Event, Key, Modifiers, PointerButton, Pos2, vec2};
use egui_kittest::kittest::Queryable as _;
use surfelshop_cloud::scene::{Measure, MeasureKind, read};

/// In the picture, in the middle of the sample.
const MIDDLE: Pos2 = eframe::egui::pos2(450.0, 380.0);

fn run(screen: &mut Screen, id: &str) {
    let ctx = screen.harness.ctx.clone();
    commands::run(screen.window(), &ctx, find(id).unwrap());
    screen.frames();
}

/// A window whose picture is all of it.
fn screen() -> Screen {
    let mut screen = Screen::sample();
    let window = screen.window();
    (window.preferences.panels, window.preferences.properties) = (false, false);
    screen.frames();
    screen.settle();
    screen
}

fn click(screen: &mut Screen, pos: Pos2, modifiers: Modifiers) {
    screen.harness.hover_at(pos);
    screen.frames();
    screen.harness.event(Event::ModifiersChanged(modifiers));
    for pressed in [true, false] {
        let button = PointerButton::Primary;
        screen.harness.event(Event::PointerButton { pos, button, pressed, modifiers });
        screen.harness.step();
    }
    screen.harness.event(Event::ModifiersChanged(Modifiers::NONE));
    screen.frames();
    // Two clicks that follow each other slowly are no double click.
    for _ in 0..40 {
        screen.harness.step();
    }
}

fn measures(screen: &mut Screen) -> Vec<Measure> {
    screen.window().settings.measures.clone()
}

/// Invariant: clicks measure between surfels, drags move the camera, and each measure is a step of undo
#[test]
fn clicks_measure_between_surfels() {
    let mut screen = screen();
    screen.harness.key_press(Key::K);
    screen.frames();
    assert_eq!(screen.window().views.hands.mode, HandMode::Measure(MeasureKind::Distance));
    let [a, b] = [MIDDLE - vec2(60.0, 30.0), MIDDLE + vec2(60.0, 30.0)];
    click(&mut screen, a, Modifiers::NONE);
    assert_eq!(screen.window().views.measuring.places.len(), 1);
    click(&mut screen, b, Modifiers::NONE);
    let all = measures(&mut screen);
    let [measure] = &all[..] else { panic!("{all:?}") };
    assert_eq!((measure.kind, measure.places.len()), (MeasureKind::Distance, 2));
    assert_eq!(screen.window().selection(), Selection::Measure(0));
    // Each end is on a surfel, to the last digits.
    let shown = screen.window().document.clouds.as_ref().unwrap();
    let cloud = shown.open_clouds.all()[0].loaded.cloud.clone();
    for place in &measure.places {
        let on_disc = (0..cloud.len()).any(|i| {
            let offset = *place - cloud.world_position(i).unwrap();
            let above = offset.dot(cloud.normals()[i].as_dvec3());
            above.abs() < 1e-9 && offset.length() <= 2.0 * f64::from(cloud.radii()[i])
        });
        assert!(on_disc, "{place}");
    }
    // What the window says is what the places are.
    let number = screen.window().quantities_of(measure)[0].value;
    assert_eq!(number, measure.places[0].distance(measure.places[1]));
    // With Shift a line goes on; Backspace takes a place back.
    for pos in [a, MIDDLE, b] {
        click(&mut screen, pos, Modifiers::SHIFT);
    }
    assert_eq!(screen.window().views.measuring.places.len(), 3);
    screen.harness.key_press(Key::Backspace);
    screen.frames();
    assert_eq!(screen.window().views.measuring.places.len(), 2);
    screen.harness.key_press(Key::Enter);
    screen.frames();
    assert_eq!(measures(&mut screen).len(), 2);
    // Escape drops what is unfinished, then the mode.
    click(&mut screen, a, Modifiers::NONE);
    screen.harness.key_press(Key::Escape);
    screen.frames();
    assert!(screen.window().views.measuring.places.is_empty());
    screen.harness.key_press(Key::Escape);
    screen.frames();
    assert_eq!(screen.window().views.hands.mode, HandMode::Camera);
    assert_eq!(measures(&mut screen).len(), 2);
    screen.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    screen.frames();
    assert_eq!(measures(&mut screen).len(), 1, "one step");
    screen.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    screen.frames();
    assert!(measures(&mut screen).is_empty());
}

/// Invariant: a scene has what was measured, and its numbers are those of the command line
#[test]
fn measures_are_in_the_scene_in_the_list_and_in_saved_pictures() {
    let mut screen = screen();
    let at = |screen: &mut Screen, x: f32, y: f32| {
        let pos = MIDDLE + vec2(x, y);
        screen.harness.hover_at(pos);
        screen.frames();
        screen.window().views.measuring.pointer.unwrap()
    };
    screen.settle();
    let places: Vec<_> =
        [(-30.0, -30.0), (30.0, -30.0), (0.0, 30.0)].map(|(x, y)| at(&mut screen, x, y)).to_vec();
    let pair = places[..2].to_vec();
    screen.window().preferences.panels = true;
    screen.window().preferences.properties = true;
    let window = screen.window();
    window.settings.measures = vec![
        Measure { name: "edge".to_owned(), ..Measure::new(MeasureKind::Distance, pair.clone()) },
        Measure::new(MeasureKind::Angle, places.clone()),
        Measure { thickness: Some(0.5), ..Measure::new(MeasureKind::Profile, pair) },
        Measure::new(MeasureKind::Volume, places.clone()),
        Measure { text: "a note".to_owned(), ..Measure::new(MeasureKind::Note, vec![places[2]]) },
    ];
    screen.until("the profile and the volume", |window| {
        let measures = window.settings.measures.clone();
        measures.iter().filter(|m| m.kind.is_of_surfels()).all(|measure| {
            window.views.measuring.surveys.of(measure).is_some_and(|known| known.fault.is_none())
        })
    });
    let profile = measures(&mut screen)[2].clone();
    let n = screen.window().views.measuring.surveys.of(&profile).unwrap().points.len();
    assert!(n > 20, "{n}");
    for label in ["edge", "angle 2", "profile 3", "volume 4", "a note"] {
        assert!(screen.harness.query_all_by_label(label).count() > 0, "{label} in the list");
    }
    screen.harness.get_all_by_label("show edge").next().unwrap().click();
    screen.frames();
    assert!(measures(&mut screen)[0].hidden);
    screen.window().select(Selection::Measure(0));
    run(&mut screen, "rename-selected");
    screen.window().panels.renaming = None;
    run(&mut screen, "copy-measure");
    let number = measures(&mut screen)[0].places[0].distance(measures(&mut screen)[0].places[1]);
    let copied = screen.window().messages.last().unwrap().to_owned();
    assert!(copied.contains(&format!("{number:?}")), "{copied}");
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("a.scene.toml");
    let before = measures(&mut screen);
    screen.window().save_scene(&scene);
    let saved = read(&scene).unwrap().scene;
    let known: Vec<Measure> = saved.measures.iter().map(|measure| measure.known.clone()).collect();
    assert_eq!(known, before);
    // Numbers beside the scene.
    run(&mut screen, "save-measures");
    let csv = std::fs::read_to_string(folder.path().join("a.measures.csv")).unwrap();
    assert!(csv.contains(&format!("edge,distance,distance,{number:?},")), "{csv}");
    assert!(csv.contains(",volume,volume,") && csv.contains(",profile,highest,"), "{csv}");
    // Opened again it is the same.
    let mut again = Screen::open(&[scene.to_str().unwrap()]);
    again.settle();
    assert_eq!(measures(&mut again), before);
    // A saved picture has the lines and labels of those that are shown.
    let picture = |screen: &mut Screen, name: &str, draws: bool| {
        let path = folder.path().join(name);
        screen.window().panels.export_form.set(path.to_str().unwrap(), [320, 240], 2);
        screen.window().panels.export_form.measures = draws;
        screen.window().panels.export_form.open = true;
        screen.frames();
        // The window stands in the middle once it knows its size.
        screen.harness.get_by_label("this view").click();
        screen.frames();
        screen.harness.get_by_label("save").click();
        screen.until("the picture", |window| path.exists() && window.panels.export_job.is_none());
        screen.window().panels.export_form.open = false;
        image::open(&path).unwrap().into_rgb8()
    };
    let [plain, drawn] =
        [("plain.png", false), ("drawn.png", true)].map(|(n, draws)| picture(&mut again, n, draws));
    let unlike = plain.pixels().zip(drawn.pixels()).filter(|(a, b)| a != b).count();
    assert!(unlike > 300, "{unlike} pixels");
}

/// Invariant: hidden surfels are drawn by no renderer, are in no selection, stay in the cloud and its file, and are
/// hidden again when the scene is opened, in the window and on the command line
#[test]
fn hidden_surfels_stay_in_the_cloud_and_are_in_the_scene() {
    let mut screen = screen();
    let shown = |screen: &mut Screen| {
        screen.settle();
        screen.window().document.clouds.as_ref().unwrap().clouds.facts.n_surfels as usize
    };
    let whole = shown(&mut screen);
    let unsaved = |screen: &mut Screen| {
        screen.window().document.clouds.as_ref().unwrap().open_clouds.all()[0].is_unsaved()
    };
    let select = |screen: &mut Screen| {
        screen.window().change_selections(|cloud, _| {
            surfelshop_cloud::selection::Selection::of(cloud.len(), |i| {
                cloud.positions()[i].y < 0.0 || i % 7 == 0
            })
        });
        screen.window().n_selected().0
    };
    let n = select(&mut screen);
    assert!(n > whole / 8 && n < whole, "{n}");
    screen.harness.key_press(Key::H);
    screen.frames();
    assert_eq!(shown(&mut screen), whole - n);
    assert_eq!(screen.window().n_selected().0, 0);
    assert!(!unsaved(&mut screen), "the cloud is as its file has it");
    // They cannot be selected.
    screen.window().select_all_surfels();
    assert_eq!(screen.window().n_selected().0, whole - n);
    screen.window().select_no_surfels();
    screen.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    screen.frames();
    assert_eq!(shown(&mut screen), whole, "one step of undo");
    // All others.
    select(&mut screen);
    screen.harness.key_press_modifiers(Modifiers::SHIFT, Key::H);
    screen.frames();
    assert_eq!(shown(&mut screen), n);
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("a.scene.toml");
    screen.window().save_scene(&scene);
    let differing = super::scenes::n_pixels_unlike_rendered(&mut screen, &scene, built_plugins());
    assert_eq!(differing, 0, "the command line draws the same");
    let mut again = Screen::open(&[scene.to_str().unwrap()]);
    assert_eq!(shown(&mut again), n);
    again.harness.key_press_modifiers(Modifiers::ALT, Key::H);
    again.frames();
    assert_eq!(shown(&mut again), whole);
    // A scene whose cloud's file has other surfels by now says so, and shows them.
    let text = std::fs::read_to_string(&scene).unwrap();
    let other = text.lines().map(|line| match line.starts_with("hidden = ") {
        true => "hidden = \"BQEC\"",
        false => line,
    });
    let other: Vec<&str> = other.collect();
    std::fs::write(&scene, other.join("\n")).unwrap();
    let mut again = Screen::open(&[scene.to_str().unwrap()]);
    assert_eq!(shown(&mut again), whole);
    assert!(again.window().messages.contains("what was hidden is shown"));
}
