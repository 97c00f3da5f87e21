//! Files that the window reads and writes.

use super::Screen;
use crate::document::Mode;
use crate::window::Window;
use eframe::egui::{self, DroppedFile};
use egui_kittest::kittest::Queryable as _;
use std::path::{Path, PathBuf};
use surfelshop_api::params::Value;
use surfelshop_cloud::WriteOptions;
use surfelshop_session::options::lights;

#[test]
fn a_file_that_cannot_be_read_is_named_and_the_cloud_stays() {
    let mut screen = Screen::sample();
    let context = screen.harness.ctx.clone();
    screen.window().open(&context, vec!["no/such/cloud.ply".into()]);
    screen.until("the message", |window| window.messages.last().is_some());
    let window = screen.window();
    let message = window.messages.last().unwrap().to_owned();
    assert!(message.contains("no/such/cloud.ply"), "{message}");
    assert_eq!(window.document.clouds.as_ref().unwrap().clouds.facts.n_surfels, 119_051);
}

/// Invariant: adding files changes nothing but the clouds, and is one step of undo
#[test]
fn further_files_are_added_beside_what_is_open() {
    let folder = tempfile::tempdir().unwrap();
    let (more, scene) = (folder.path().join("more.ply"), folder.path().join("a.scene.toml"));
    std::fs::copy(super::SAMPLE, &more).unwrap();
    let mut screen = Screen::sample();
    let context = screen.harness.ctx.clone();
    let names = |window: &Window| {
        let shown = window.document.clouds.as_ref().unwrap();
        shown.open_clouds.all().iter().map(|cloud| cloud.name()).collect::<Vec<_>>()
    };
    screen.window().settings.scene.exposure_stops = 0.5;
    screen.window().views.camera.eye *= 1.25;
    screen.settle();
    let (settings, camera) = (screen.window().settings.clone(), screen.window().views.camera);
    screen.window().add(&context, vec![more.clone()]);
    screen.until("both clouds", |window| window.document.loader.is_none());
    screen.settle();
    let window = screen.window();
    assert_eq!(names(window), ["sample.ply", "more.ply"]);
    assert_eq!(window.document.clouds.as_ref().unwrap().clouds.facts.n_surfels, 2 * 119_051);
    assert!(window.settings == settings && window.views.camera == camera && !window.has_unsaved());
    assert_eq!(window.selection(), crate::panels::Selection::Cloud(1));
    window.save_scene(&scene);
    let saved = |scene: &Path| surfelshop_cloud::scene::read(scene).unwrap().scene.clouds.len();
    assert_eq!(saved(&scene), 2);
    crate::document::undo::undo(window);
    assert_eq!(names(window), ["sample.ply"]);
    window.save_scene(&scene);
    assert_eq!(saved(&scene), 1);
    crate::document::undo::redo(window);
    assert_eq!(names(window), ["sample.ply", "more.ply"]);
    window.add(&context, vec![scene]);
    assert!(window.messages.contains("expected clouds to add, found a scene"));
}

#[test]
fn pictures_are_written_at_any_size_and_all_around() {
    let folder = tempfile::tempdir().unwrap();
    let mut screen = Screen::sample();
    screen.window().panels.export_form.open = true;
    let path = |name: &str| folder.path().join(name);
    for (choice, file, expected) in [
        ("this view", "one.png", vec!["one.png"]),
        ("this view", "one.exr", vec!["one.exr"]),
        ("a turn around", "turn.png", vec!["turn-0001.png", "turn-0002.png", "turn-0003.png"]),
    ] {
        screen.frames();
        screen.harness.get_by_label(choice).click();
        screen.window().panels.export_form.set(path(file).to_str().unwrap(), [123, 77], 3);
        screen.frames();
        screen.harness.get_by_label("save").click();
        screen.until("the files", |window| window.messages.contains("wrote "));
        screen.window().messages.dismiss_all();
        for name in expected {
            assert!(path(name).is_file(), "{name}");
        }
    }
    assert_eq!(image::image_dimensions(path("turn-0002.png")).unwrap(), (123, 77));
    assert_ne!(
        std::fs::read(path("turn-0001.png")).unwrap(),
        std::fs::read(path("turn-0002.png")).unwrap()
    );
    // No file is overwritten without a question.
    let old = std::fs::read(path("one.png")).unwrap();
    screen.window().messages.dismiss_all();
    screen.frames();
    screen.harness.get_by_label("this view").click();
    screen.window().panels.export_form.set(path("one.png").to_str().unwrap(), [50, 40], 2);
    screen.frames();
    screen.harness.get_by_label("save").click();
    screen.frames();
    screen.harness.get_by_label("back").click();
    screen.frames();
    assert_eq!(std::fs::read(path("one.png")).unwrap(), old);
    screen.harness.get_by_label("save").click();
    screen.frames();
    screen.harness.get_by_label("replace").click();
    screen.until("the file", |window| window.messages.contains("wrote "));
    assert_eq!(image::image_dimensions(path("one.png")).unwrap(), (50, 40));
    screen.window().messages.dismiss_all();
    // A corner, where nothing is drawn, is what the background is.
    let corner = |name: &str| image::open(path(name)).unwrap().into_rgba8().get_pixel(0, 0).0[3];
    assert_eq!(corner("one.png"), 255);
    screen.frames();
    screen.harness.get_by_label("leave the background out of PNG files").click();
    screen.window().panels.export_form.set(path("cut.png").to_str().unwrap(), [50, 40], 2);
    screen.frames();
    screen.harness.get_by_label("save").click();
    screen.until("the file", |window| window.messages.contains("wrote "));
    assert_eq!(corner("cut.png"), 0);
    screen.window().messages.dismiss_all();
    // The pictures of both renderers.
    screen.window().settings.panes[0].mode = Mode::Wipe;
    screen.window().panels.export_form.set(path("two.png").to_str().unwrap(), [50, 40], 2);
    screen.frames();
    screen.harness.get_by_label("both").click();
    screen.frames();
    screen.harness.get_by_label("save").click();
    screen.until("the files", |window| window.messages.contains("wrote 2 "));
    let levels = |name: &str| image::open(path(name)).unwrap().into_rgba8().into_raw();
    assert_ne!(levels("two-1-ewa-phong.png"), levels("two-2-flat.png"));
    screen.window().messages.dismiss_all();
    screen.window().panels.export_form.set("picture.jpg", [8, 8], 2);
    screen.frames();
    screen.harness.get_by_label("save").click();
    screen.until("the refusal", |window| window.messages.last().is_some());
    assert!(screen.window().messages.last().unwrap().contains(".png or .exr"));
}

#[test]
fn presets_are_kept_for_the_next_start() {
    use surfelshop_api::params::Value;
    let folder = tempfile::tempdir().unwrap();
    let mut screen = Screen::sample();
    let memory = || Some(crate::document::StateFolder::in_folder(folder.path().to_owned()));
    screen.window().document.state_folder = memory();
    let values = screen.window().settings.panes[0].values.entry("ewa-phong".into()).or_default();
    values.insert("specular".to_owned(), Value::Float(0.9));
    screen.window().panels.preset = "shiny".to_owned();
    screen.settle();
    screen.harness.get_by_label("presets of ewa-phong").click();
    screen.frames();
    screen.harness.get_by_label("save").click();
    screen.until("the file", |_| memory().unwrap().preset_names("ewa-phong") == ["shiny"]);
    screen.window().settings.panes[0].values.clear();
    screen.settle();
    screen.harness.get_by_label("presets of ewa-phong").click();
    screen.frames();
    screen.harness.get_by_label("shiny").click();
    screen.until("the values", |window| {
        window.settings.panes[0].values_of(0).get("specular") == Some(&Value::Float(0.9))
    });
}

#[test]
fn a_late_picture_of_a_cancelled_export_goes_nowhere() {
    let folder = tempfile::tempdir().unwrap();
    let mut screen = Screen::sample();
    screen.window().panels.export_form.open = true;
    screen.frames();
    let file = folder.path().join("large.png");
    screen.window().panels.export_form.set(file.to_str().unwrap(), [2000, 2000], 2);
    screen.frames();
    screen.harness.get_by_label("save").click();
    screen.frames();
    screen.harness.get_by_label("cancel").click();
    screen.frames();
    let file = folder.path().join("small.png");
    screen.window().messages.dismiss_all();
    screen.window().panels.export_form.set(file.to_str().unwrap(), [64, 48], 2);
    screen.frames();
    screen.harness.get_by_label("save").click();
    screen.until("the file", |window| window.messages.last().is_some());
    assert_eq!(image::image_dimensions(file).unwrap(), (64, 48));
}

/// A file that was dropped onto the window.
#[derive(Debug)]
struct Dropped(PathBuf);

impl DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|error| error.to_string())
    }
}

#[test]
fn files_dropped_onto_the_window_are_opened() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("three.ply");
    let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                property float z\nend_header\n0 0 0\n1 0 0\n0 1 0\n";
    std::fs::write(&path, text).unwrap();
    let mut screen = Screen::sample();
    screen.harness.input_mut().dropped_files.push(std::sync::Arc::new(Dropped(path)));
    screen.until("the cloud", |window| {
        window.document.clouds.as_ref().is_some_and(|shown| shown.clouds.facts.n_surfels == 3)
    });
    screen.settle();
}

/// A parameter's file is watched: a change is drawn, each mistake is reported, and a scene names the
/// file relative to its own folder.
///
/// Invariant: a file that a parameter names is drawn again when it changes, and cannot switch
/// its renderer off
#[test]
fn a_pattern_is_drawn_again_when_its_file_changes() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("mine.wgsl");
    let write = |albedo: &str| {
        let wgsl = format!(
            "#import surfelshop::noise::Place\n#import procedural::pattern::Look\n\
             fn look(at: Place, albedo: vec3<f32>) -> Look {{\n\
             return Look({albedo}, 0.0, 1.0, 0.0);\n}}\n"
        );
        std::fs::write(&file, wgsl).unwrap();
    };
    write("vec3(1.0, 0.0, 0.0)");
    let mut screen = Screen::sample();
    let pane = &mut screen.window().settings.panes[0];
    pane.renderers[0] = "procedural".to_owned();
    let text = |text: &str| Value::Text(text.to_owned());
    let values = [("file", text(&file.display().to_string())), ("lighting", text("none"))];
    let values = values.map(|(id, value)| (id.to_owned(), value));
    pane.values.insert("procedural".to_owned(), values.into());
    screen.settle();
    let middle = |window: &Window| {
        let rendered = &window.views.panes[&0].sides[0].shown.as_ref().unwrap().rendered;
        let [w, h] = rendered.size.map(|side| side as usize);
        let at = 4 * (h / 2 * w + w / 2);
        [rendered.levels[at], rendered.levels[at + 1], rendered.levels[at + 2]]
    };
    let [r, g, _] = middle(screen.window());
    assert!(r > 200 && g == 0, "{r} {g}");
    write("vec3(0.0, 1.0, 0.0)");
    screen.until("the green picture", |window| middle(window)[1] > 200);
    // More failures than a plugin may have: they do not count, since the file is faulty.
    for i in 0..4 {
        screen.window().messages.dismiss_all();
        write(&format!("nothing{i}"));
        let words = format!("nothing{i}");
        screen.until("the mistake", |window| window.messages.contains(&words));
        assert!(middle(screen.window())[1] > 200, "the last good picture stays");
    }
    write("vec3(0.0, 0.0, 1.0)");
    screen.until("the blue picture", |window| middle(window)[2] > 200);
    assert!(screen.window().plugins.unit_health.iter().all(|unit| !unit.off));
    // A typed path is used once the field loses focus.
    let of = |window: &mut Window| window.settings.panes[0].values["procedural"]["file"].clone();
    let before = of(screen.window());
    screen.frames();
    let field = |screen: &Screen| {
        let node = screen.harness.get_by_role_and_label(egui::accesskit::Role::TextInput, "file");
        node.focus();
        node.type_text("x");
    };
    field(&screen);
    screen.frames();
    assert_eq!(of(screen.window()), before);
    screen.harness.key_press(egui::Key::Enter);
    screen.frames();
    let typed = of(screen.window());
    assert_ne!(typed, before);
    screen.until("the refusal", |window| window.messages.contains("No such file"));
    let pane = &mut screen.window().settings.panes[0];
    pane.values.get_mut("procedural").unwrap().insert("file".to_owned(), before);
    screen.settle();
    let scene = folder.path().join("mine.scene.toml");
    screen.window().save_scene(&scene);
    let saved = std::fs::read_to_string(&scene).unwrap();
    assert!(saved.contains("file = \"mine.wgsl\""), "{saved}");
}

/// A large cloud is uploaded in the background; until then a subset covers the same pixels.
///
/// Invariant: a large cloud is shown at once by a few of its surfels, and then whole
#[test]
fn a_few_surfels_of_a_large_cloud_are_shown_until_all_are_there() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("large.ply");
    let clouds = surfelshop_evaluate::bench::body::body(1_100_000).unwrap();
    surfelshop_cloud::write(&file, &clouds.loaded[0].cloud, &WriteOptions::default()).unwrap();
    let mut screen = Screen::open(&[file.to_str().unwrap()]);
    let covered = |window: &mut Window| {
        let id = window.settings.panes[0].id;
        let rendered = &window.views.panes[&id].sides[0].shown.as_ref()?.rendered;
        let n = rendered.color.data.chunks_exact(4).filter(|pixel| pixel[3] > 0.0).count();
        Some((rendered.describe_detail(), n as f64))
    };
    screen.until("a first picture", |window| covered(window).is_some());
    let (detail, few) = covered(screen.window()).unwrap();
    assert_eq!(detail, "1 surfel of 6");
    screen.settle();
    let (detail, all) = covered(screen.window()).unwrap();
    assert!(detail == "full detail" && screen.window().render.upload_progress.is_none());
    // The discs of the subset are 2.4 times as large, which changes the outline alone.
    assert!((0.99..1.02).contains(&(few / all)), "{few} and {all} pixels");
    // The cloud is not uploaded again.
    let uploads = screen.window().render.counters.uploads;
    screen.window().settings.panes[0].renderers[0] = "environment".to_owned();
    screen.settle();
    assert_eq!(screen.window().render.counters.uploads, uploads);
    // A cloud that is replaced during its upload is dropped.
    let context = screen.harness.ctx.clone();
    clouds_changed(&file);
    screen.window().open(&context, vec![file.clone()]);
    screen.until("the other one", |window| window.render.upload_progress.is_some());
    screen.window().open(&context, vec![super::SAMPLE.into()]);
    screen.until("the sample", |window| {
        window.document.clouds.as_ref().unwrap().clouds.facts.n_surfels == 119_051
    });
    screen.settle();
    assert!(screen.window().render.upload_progress.is_none());
}

/// Writes another large cloud.
fn clouds_changed(file: &Path) {
    let clouds = surfelshop_evaluate::bench::body::body(1_200_000).unwrap();
    surfelshop_cloud::write(file, &clouds.loaded[0].cloud, &WriteOptions::default()).unwrap();
}

/// The inner sides of a box, with normals that face the middle.
fn room() -> String {
    let mut rows = String::new();
    let mut n = 0;
    for side in 0..6 {
        let (axis, far) = (side % 3, side / 3);
        for i in 0..40 {
            for j in 0..40 {
                let mut place = [0.0; 3];
                place[axis] = f64::from(far as u32) * 3.0;
                place[(axis + 1) % 3] = (f64::from(i) + 0.5) * 0.075;
                place[(axis + 2) % 3] = (f64::from(j) + 0.5) * 0.075;
                let mut normal = [0.0; 3];
                normal[axis] = if far == 0 { 1.0 } else { -1.0 };
                let numbers = place.iter().chain(&normal).map(f64::to_string);
                rows += &(numbers.collect::<Vec<_>>().join(" ") + " 0.06\n");
                n += 1;
            }
        }
    }
    let names = ["x", "y", "z", "nx", "ny", "nz", "radius"];
    let names = names.map(|name| format!("property float {name}\n")).concat();
    format!("ply\nformat ascii 1.0\nelement vertex {n}\n{names}end_header\n{rows}")
}

/// Invariant: a room is first seen from within, in even light; a thing from outside, in the usual one
#[test]
fn a_room_is_first_seen_from_within() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("room.ply");
    std::fs::write(&path, room()).unwrap();
    let mut screen = Screen::open(&[path.to_str().unwrap()]);
    screen.settle();
    let window = screen.window();
    let eye = window.views.camera.eye;
    assert!(window.views.walking && eye.min_element() > 0.3 && eye.max_element() < 2.7, "{eye}");
    assert_eq!(window.settings.scene.lights, lights::even());

    let mut screen = Screen::sample();
    screen.settle();
    let window = screen.window();
    assert!(!window.views.walking);
    assert_eq!(window.settings.scene.lights, surfelshop_api::Scene::default().lights);
}
