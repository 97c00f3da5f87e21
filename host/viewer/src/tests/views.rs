//! Views, panels and menus.

use super::{SAMPLE, Screen};
use crate::document::Mode;
use crate::panels::Selection;
use crate::window::Window;
use egui_kittest::kittest::Queryable as _;

fn covered(window: &Window, pane: u32, side: usize) -> usize {
    let rendered = &window.views.panes[&pane].sides[side].shown.as_ref().unwrap().rendered;
    let depth = rendered.depth.as_ref().unwrap();
    depth.data.chunks_exact(depth.components as usize).filter(|p| p[0] > 0.0).count()
}

#[test]
fn panels_say_what_is_shown() {
    let mut screen = Screen::sample();
    assert!(covered(screen.window(), 0, 0) > 10_000);
    let harness = &screen.harness;
    for text in ["Clouds", "Lights", "Cameras", "Views", "Renderers", "Renderer", "Picture"] {
        assert!(harness.query_all_by_label(text).count() > 0, "nothing is called `{text}`");
    }
    for text in ["sample.ply", "shininess", "exposure", "field of view"] {
        assert!(harness.query_all_by_label(text).count() > 0, "nothing is called `{text}`");
    }
    screen.window().select(Selection::Cloud(0));
    screen.frames();
    for text in ["119,051", "draw both sides", "point size", "colour by", "Placement"] {
        let found = screen.harness.query_all_by_label(text).count();
        assert!(found > 0, "nothing is called `{text}`");
    }
}

/// Invariant: switching never shows an empty or wrong picture; a renderer that fails leaves the
/// old one
#[test]
fn the_old_picture_stays_until_the_new_renderer_has_one() {
    let mut screen = Screen::sample();
    for renderer in ["flat", "ewa-phong", "flat"] {
        screen.window().settings.panes[0].renderers[0] = renderer.to_owned();
        screen.until("the other renderer", |window| {
            let shown = window.views.panes[&0].sides[0].shown.as_ref().unwrap();
            assert!(covered(window, 0, 0) > 10_000, "an empty picture is shown");
            shown.renderer == renderer
        });
    }
}

#[test]
fn two_renderers_are_compared_and_their_columns_are_on_the_device_once() {
    let mut screen = Screen::sample();
    let columns = screen.window().render.counters.column_bytes;
    for mode in [Mode::SideBySide, Mode::Wipe, Mode::Flicker, Mode::Difference] {
        screen.window().settings.panes[0].mode = mode;
        screen.settle();
        let window = screen.window();
        let difference = window.views.panes.get_mut(&0).unwrap().difference().unwrap();
        assert!(difference.rmse > 0.005 && difference.rmse < 0.2, "{}", difference.describe());
        assert_eq!(window.render.counters.column_bytes, columns, "{mode:?}");
    }
    screen.window().settings.panes[0].renderers[1] = "ewa-phong".to_owned();
    screen.settle();
    let difference = screen.window().views.panes.get_mut(&0).unwrap().difference().unwrap();
    assert_eq!(difference.describe(), "equal");
}

/// Invariant: views of one cloud have its columns on the device once
#[test]
fn views_split_and_share_the_columns() {
    let mut screen = Screen::sample();
    let columns = screen.window().render.counters.column_bytes;
    for n_panes in 2..=4 {
        screen.harness.get_all_by_label("split").next().unwrap().click();
        screen.until("another view", |window| window.settings.panes.len() == n_panes);
        screen.settle();
    }
    assert_eq!(screen.window().render.counters.column_bytes, columns);
    screen.harness.get_all_by_label("split").next().unwrap().click();
    screen.until("the message", |window| window.messages.last().is_some());
    assert_eq!(screen.window().settings.panes.len(), 4);
    screen.harness.get_all_by_label("close").next().unwrap().click();
    screen.until("one less", |window| window.settings.panes.len() == 3);
    screen.settle();
}

/// Costs 2 s.
#[test]
fn a_cloud_that_was_seen_whole_is_so_beside_another_view() {
    let mut screen = Screen::sample();
    let framing = |window: &Window| {
        let extent = window.document.clouds.as_ref().unwrap().extent;
        window.framing(&extent)
    };
    screen.window().fly_to_all();
    screen.settle();
    let before = screen.window().views.camera;
    assert_eq!(framing(screen.window()), before);
    screen.harness.get_by_label("split").click();
    screen.until("another view", |window| window.settings.panes.len() == 2);
    screen.settle();
    let beside = screen.window().views.camera;
    assert!(beside != before && beside == framing(screen.window()));
    // A camera that somebody has moved stays.
    screen.window().views.camera.eye *= 1.5;
    let moved = screen.window().views.camera;
    screen.harness.get_all_by_label("split").next().unwrap().click();
    screen.until("another view", |window| window.settings.panes.len() == 3);
    screen.settle();
    assert_eq!(screen.window().views.camera, moved);
}

#[test]
fn changes_of_parameters_are_seen_and_undone() {
    use surfelshop_api::params::Value;
    let mut screen = Screen::sample();
    let before =
        screen.window().views.panes[&0].sides[0].shown.as_ref().unwrap().rendered.levels.clone();
    let values = screen.window().settings.panes[0].values.entry("ewa-phong".into()).or_default();
    values.insert("specular".to_owned(), Value::Float(1.0));
    screen.settle();
    let levels = |screen: &mut Screen| {
        screen.window().views.panes[&0].sides[0].shown.as_ref().unwrap().rendered.levels.clone()
    };
    assert_ne!(levels(&mut screen), before);
    screen.until("a step to undo", |window| window.document.history.has_undo(&window.snapshot()));
    use eframe::egui::{Key, Modifiers};
    screen.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    screen.until("the old values", |window| window.settings.panes[0].values.is_empty());
    screen.settle();
    assert_eq!(levels(&mut screen), before);
    screen.harness.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    screen.until("the new values", |window| !window.settings.panes[0].values.is_empty());
}

#[test]
fn help_and_plugins_have_their_windows() {
    for (window, content) in
        [("Plugins", "org.surfelshop.flat"), ("Mouse and keys", "zoom to the pointer")]
    {
        let mut screen = Screen::sample();
        screen.harness.get_by_label("Help").click();
        screen.frames();
        screen.harness.get_all_by_label(window).last().unwrap().click();
        screen.frames();
        assert!(screen.harness.query_all_by_label(content).count() > 0, "{window}: {content}");
    }
}

#[test]
fn views_that_are_let_go_stay_where_they_are() {
    let mut screen = Screen::sample();
    screen.harness.get_all_by_label("split").next().unwrap().click();
    screen.until("another view", |window| window.settings.panes.len() == 2);
    screen.window().settings.panes[1].linked = false;
    screen.frames();
    let before = screen.window().camera_of(1);
    let mut moved = screen.window().views.camera;
    moved.eye *= 2.0;
    screen.window().set_camera(0, moved);
    screen.frames();
    assert_eq!(screen.window().camera_of(1), before);
    assert_eq!(screen.window().camera_of(0), moved);
}

#[test]
fn lights_are_added_changed_into_other_kinds_and_removed() {
    use surfelshop_api::{Light, Scene};
    let mut screen = Screen::sample();
    // High enough for the whole panel.
    screen.harness.set_size(eframe::egui::Vec2::new(900.0, 1600.0));
    screen.settle();
    let levels = |screen: &mut Screen| {
        screen.window().views.panes[&0].sides[0].shown.as_ref().unwrap().rendered.levels.clone()
    };
    let lights = |screen: &mut Screen| screen.window().settings.scene.lights.clone();
    let choose = |screen: &mut Screen, light: &str, entry: &str| {
        screen.harness.get_by_label(light).click();
        screen.frames();
        screen.harness.get_all_by_label(entry).last().unwrap().click();
        screen.frames();
    };
    let press = |screen: &mut Screen, button: &str| {
        let found = screen.harness.get_all_by_label(button);
        found.last().unwrap().click();
        screen.frames();
    };
    screen.window().select(Selection::Light(0));
    screen.frames();
    let usual = levels(&mut screen);
    press(&mut screen, "duplicate");
    screen.until("another light", |window| window.settings.scene.lights.len() == 2);
    screen.settle();
    assert_ne!(levels(&mut screen), usual);
    for (kind, labels) in [
        ("point", &["brightness", "position x"] as &[&str]),
        ("spot", &["target x", "brightness", "half angle", "softness"]),
    ] {
        let before = levels(&mut screen);
        choose(&mut screen, "kind of light 2", kind);
        screen.until("the kind", |window| {
            let light = window.settings.scene.lights[1];
            match kind {
                "point" => matches!(light, Light::Point { .. }),
                _ => matches!(light, Light::Spot { .. }),
            }
        });
        screen.settle();
        assert_ne!(levels(&mut screen), before, "{kind}");
        for label in labels {
            let found = screen.harness.query_all_by_label(label).count();
            assert!(found > 0, "{kind}: nothing is called `{label}`");
        }
    }
    // The lights can be saved and read.
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("spot.scene.toml");
    screen.window().save_scene(&scene);
    let read = surfelshop_cloud::scene::read(&scene).unwrap().scene.scene();
    assert_eq!(read.lights, lights(&mut screen));
    for _ in 0..2 {
        screen.window().select(Selection::Light(0));
        screen.frames();
        press(&mut screen, "remove");
    }
    assert!(lights(&mut screen).is_empty());
    screen.harness.get_by_label("add to lights").click();
    screen.frames();
    screen.harness.get_all_by_label_contains("Add a directional light").next().unwrap().click();
    screen.frames();
    assert_eq!(lights(&mut screen), Scene::default().lights);
    screen.settle();
    assert_eq!(levels(&mut screen), usual);
    for _ in 1..Scene::MAX_LIGHTS {
        press(&mut screen, "duplicate");
    }
    assert_eq!(lights(&mut screen).len(), Scene::MAX_LIGHTS);
    press(&mut screen, "duplicate");
    assert_eq!(lights(&mut screen).len(), Scene::MAX_LIGHTS, "no more than shaders know");
}

#[test]
fn light_from_around_is_chosen_turned_and_dropped() {
    use surfelshop_cloud::scene::ProbeSource;
    let mut screen = Screen::sample();
    // High enough for the whole panel.
    screen.harness.set_size(eframe::egui::Vec2::new(900.0, 1400.0));
    screen.window().settings.panes[0].renderers[0] = "environment".to_owned();
    screen.settle();
    let levels = |screen: &mut Screen| {
        screen.window().views.panes[&0].sides[0].shown.as_ref().unwrap().rendered.levels.clone()
    };
    let without = levels(&mut screen);
    screen.window().select(Selection::Environment);
    screen.frames();
    screen.harness.get_all_by_label("light around the scene").last().unwrap().click();
    screen.frames();
    screen.harness.get_by_label("studio").click();
    screen.until("the light", |window| window.settings.environment.is_some());
    screen.settle();
    let studio = levels(&mut screen);
    assert_ne!(studio, without);
    for label in ["rotation", "brightness", "centre of the picture", "up in the picture"] {
        assert!(
            screen.harness.query_all_by_label(label).count() > 0,
            "nothing is called `{label}`"
        );
    }
    screen.window().settings.environment.as_mut().unwrap().rotation = 1.0;
    screen.settle();
    let turned = levels(&mut screen);
    assert_ne!(turned, studio);
    // An opened environment map replaces the studio, with its orientation.
    let sky = std::path::Path::new(SAMPLE).with_file_name("sky.hdr");
    let context = screen.harness.ctx.clone();
    screen.window().open(&context, vec![sky.clone()]);
    screen.settle();
    let environment = screen.window().settings.environment.clone().unwrap();
    assert!(matches!(environment.source, ProbeSource::File(path) if path.ends_with("sky.hdr")));
    assert_eq!(environment.rotation, 1.0);
    assert_ne!(levels(&mut screen), turned);
    // One that cannot be read is reported, and the scene is drawn without it.
    let folder = tempfile::tempdir().unwrap();
    let bad = folder.path().join("bad.hdr");
    std::fs::write(&bad, "no probe").unwrap();
    screen.window().open(&context, vec![bad]);
    screen.until("the refusal", |window| window.messages.contains("bad.hdr"));
    screen.settle();
    assert_eq!(levels(&mut screen), without);
}

#[test]
fn a_still_picture_says_what_it_is_made_of() {
    let mut screen = Screen::sample();
    let window = screen.window();
    let id = window.settings.panes[0].id;
    let rendered = &window.views.panes[&id].sides[0].shown.as_ref().unwrap().rendered;
    let explained = rendered.explained.clone().unwrap();
    let column = |name: &str| explained.columns.iter().find(|column| column.name == name).unwrap();
    assert!(column("color").read && !column("ao").read);
    assert!(explained.outputs.iter().any(|output| output.name == "color" && output.wanted));
    // The panel is there, closed.
    screen.harness.get_by_label("What it is made of");
}
