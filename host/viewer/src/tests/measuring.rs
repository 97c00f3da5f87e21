//! Measures: clicked, drawn, undone, copied and saved with the scene; and surfels that are hidden.

use super::tools::items;
use super::{SAMPLE, Screen, built_plugins};
use crate::ViewerArguments;
use crate::commands::{self, find};
use crate::panels::Selection;
use crate::views::hands::HandMode;
use eframe::egui::{Event, Key, Modifiers, PointerButton, Pos2, pos2, vec2};
use egui_kittest::kittest::Queryable as _;
use glam::DVec3;
use surfelshop_api::params::Value;
use surfelshop_cloud::Transform;
use surfelshop_cloud::scene::{Measure, MeasureKind, read};
use surfelshop_session::options::{DeviceArguments, UpAxis};

/// In the picture, in the middle of the sample.
const MIDDLE: Pos2 = pos2(450.0, 380.0);

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

/// A window over files with the tools of `Pointshop3D`, and the window of one of them open.
fn with_tool(files: &[&str], tool: &str) -> Screen {
    let mut plugins = built_plugins();
    let library =
        plugins.plugin[0].to_string_lossy().replace("surfelshop_flat", "surfelshop_pointshop");
    plugins.plugin.push(library.into());
    let mut screen = Screen::with(&ViewerArguments {
        memory: None,
        in_place: false,
        colors: Default::default(),
        files: files.iter().map(Into::into).collect(),
        up: UpAxis::Y,
        plugins,
        device: DeviceArguments::default(),
    });
    let window = screen.window();
    (window.preferences.panels, window.preferences.properties) = (false, false);
    window.plugins.tools.open = Some(tool.to_owned());
    screen.frames();
    screen.settle();
    screen.until_label("pick pairs in the picture");
    screen
}

fn value(screen: &mut Screen, tool: &str, id: &str) -> String {
    match screen.window().plugins.tools.values.get(tool).and_then(|values| values.get(id)) {
        Some(Value::Text(text)) => text.clone(),
        _ => String::new(),
    }
}

/// Invariant: a picture is laid on the surface by clicks on both
#[test]
fn pairs_with_a_picture_are_clicked() {
    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("red.png");
    image::RgbaImage::from_pixel(40, 20, image::Rgba([255, 0, 0, 255])).save(&picture).unwrap();
    let mut screen = with_tool(&[SAMPLE], "texture");
    // Without a picture there is nothing to click in.
    screen.harness.get_by_label("pick pairs in the picture").click();
    screen.frames();
    assert_eq!(screen.window().views.hands.mode, HandMode::Camera);
    assert!(screen.window().messages.contains("choose the picture first"));
    let values = screen.window().plugins.tools.values.entry("texture".to_owned()).or_default();
    values.insert("image".to_owned(), Value::Text(picture.display().to_string()));
    screen.harness.get_by_label("pick pairs in the picture").click();
    screen.frames();
    assert_eq!(screen.window().views.hands.mode, HandMode::Pairs);
    screen.until_label("the picture");
    assert_eq!(screen.harness.query_all_by_label("run").count(), 0, "the tool's window is away");
    let rect = screen.harness.get_by_label("the picture").rect();
    assert!((rect.width() / rect.height() - 2.0).abs() < 0.05, "{rect}");
    let mut places = Vec::new();
    for (offset, share) in [(-30.0, 0.25), (30.0, 0.75)] {
        let at = MIDDLE + vec2(offset, -30.0);
        click(&mut screen, at, Modifiers::NONE);
        places.push(screen.window().views.measuring.pointer.unwrap());
        click(&mut screen, rect.lerp_inside(vec2(share, 0.5)), Modifiers::NONE);
    }
    let text = value(&mut screen, "texture", "pairs");
    let rows: Vec<Vec<f64>> = text
        .split(';')
        .map(|row| row.split_whitespace().map(|word| word.parse().unwrap()).collect())
        .collect();
    assert_eq!(rows.len(), 2, "{text}");
    for (row, (place, u)) in rows.iter().zip(places.iter().zip([0.25, 0.75])) {
        assert!(place.distance(DVec3::from_slice(&row[..3])) < 1e-6, "{text} {place}");
        assert!((row[3] - u).abs() < 0.02 && (row[4] - 0.5).abs() < 0.03, "{text}");
    }
    // The picture may come first; what is begun is taken back before what is done.
    click(&mut screen, rect.center(), Modifiers::NONE);
    screen.harness.hover_at(MIDDLE);
    screen.harness.key_press(Key::Backspace);
    screen.frames();
    assert_eq!(value(&mut screen, "texture", "pairs"), text);
    click(&mut screen, rect.center(), Modifiers::NONE);
    click(&mut screen, MIDDLE + vec2(0.0, 30.0), Modifiers::NONE);
    assert_eq!(value(&mut screen, "texture", "pairs").split(';').count(), 3);
    screen.harness.key_press(Key::Backspace);
    screen.frames();
    assert_eq!(value(&mut screen, "texture", "pairs"), text);
    screen.harness.get_by_label("done").click();
    screen.frames();
    assert_eq!(screen.window().views.hands.mode, HandMode::Camera);
    let before = items(screen.window())[0].loaded.cloud.clone();
    screen.harness.get_by_label("run").click();
    screen.until("the picture on the surface", |window| items(window)[0].is_unsaved());
    let after = items(screen.window())[0].loaded.cloud.clone();
    let color = |cloud: &surfelshop_cloud::Cloud| cloud.column("color").unwrap().generation();
    assert_ne!(color(&before), color(&after));
}

/// Where one of the visible clouds is seen, beside the small window and above messages.
fn place_on(screen: &mut Screen, cloud: usize) -> Pos2 {
    let mut places = (0..12).flat_map(|y| (0..30).map(move |x| (x, y)));
    let found = places.find_map(|(x, y)| {
        let at = pos2(340.0 + 18.0 * x as f32, 250.0 + 25.0 * y as f32);
        // Over the small window nothing is looked for.
        let views = &mut screen.window().views;
        (views.pointer_position, views.pointer_cloud) = (None, None);
        screen.harness.hover_at(at);
        screen.frames();
        (screen.window().views.pointer_cloud == Some(cloud)).then_some(at)
    });
    found.unwrap_or_else(|| panic!("cloud {cloud} is not seen"))
}

/// Invariant: pairs of two clouds are a place of the tool's own and then one of another
#[test]
fn pairs_of_two_clouds_are_clicked_in_their_order() {
    let folder = tempfile::tempdir().unwrap();
    let other = folder.path().join("other.ply");
    let sample = surfelshop_cloud::read(SAMPLE, &Default::default()).unwrap().cloud;
    let places = || sample.positions().iter();
    let width = |of: fn(f32, f32) -> f32| places().map(|place| place.x).reduce(of).unwrap();
    let size = 1.2 * f64::from(width(f32::max) - width(f32::min));
    let aside = Transform { translation: DVec3::X * size, ..Transform::default() };
    let moved = sample.transformed(&aside).unwrap();
    surfelshop_cloud::write(&other, &moved, &Default::default()).unwrap();
    let mut screen = with_tool(&[SAMPLE, other.to_str().unwrap()], "register");
    screen.harness.get_by_label("pick pairs in the picture").click();
    screen.frames();
    let [own, others] = [0, 1].map(|cloud| place_on(&mut screen, cloud));
    click(&mut screen, others, Modifiers::NONE);
    assert!(screen.window().messages.contains("click on sample.ply first"));
    click(&mut screen, own, Modifiers::NONE);
    click(&mut screen, own, Modifiers::NONE);
    assert!(screen.window().messages.contains("click the same place on another cloud"));
    click(&mut screen, others, Modifiers::NONE);
    assert_eq!(value(&mut screen, "register", "start"), "pairs", "what they are for");
    let text = value(&mut screen, "register", "pairs");
    let numbers: Vec<f64> = text.split_whitespace().map(|word| word.parse().unwrap()).collect();
    assert_eq!(numbers.len(), 6, "{text}");
    assert!(numbers[0] < 0.5 * size && numbers[3] > 0.5 * size, "{text}");
    // Escape leaves what is begun, and then the clicking; the pairs stay.
    click(&mut screen, own, Modifiers::NONE);
    for mode in [HandMode::Pairs, HandMode::Camera] {
        screen.harness.key_press(Key::Escape);
        screen.frames();
        assert_eq!(screen.window().views.hands.mode, mode);
    }
    assert_eq!(value(&mut screen, "register", "pairs"), text);
    // What was typed and is no pair is left out by the next one.
    let values = screen.window().plugins.tools.values.get_mut("register").unwrap();
    values.insert("pairs".to_owned(), Value::Text("left of the door".to_owned()));
    screen.harness.get_by_label("pick pairs in the picture").click();
    screen.frames();
    screen.harness.get_by_label_contains("no list of pairs");
    for at in [own, others] {
        click(&mut screen, at, Modifiers::NONE);
    }
    assert_eq!(value(&mut screen, "register", "pairs"), text);
    screen.harness.get_by_label("remove pair 1").click();
    screen.frames();
    assert_eq!(value(&mut screen, "register", "pairs"), "");
    assert_eq!(value(&mut screen, "register", "start"), "", "as it was");
    // Nothing is picked on a cloud that is hidden.
    screen.window().toggle_cloud(0);
    screen.frames();
    screen.settle();
    let others = place_on(&mut screen, 0);
    click(&mut screen, others, Modifiers::NONE);
    assert!(screen.window().messages.contains("it is hidden"));
    // Another tool's window is shown meanwhile.
    screen.window().plugins.tools.open = Some("texture".to_owned());
    screen.until_label("pick pairs in the picture");
}
