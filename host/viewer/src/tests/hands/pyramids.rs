//! Hands over pyramids: regions are selected, and edits are layers.

use super::{MIDDLE, drag, of_file};
use crate::document::OpenCloud;
use crate::tests::Screen;
use crate::window::Window;
use eframe::egui::{Key, Modifiers, pos2, vec2};
use glam::DVec3;
use std::path::{Path, PathBuf};
use surfelshop_cloud::{Buffer, Cloud, Column, ReadOptions, WriteOptions};
use surfelshop_pyramid::{IndexOptions, index};
use surfelshop_session::input::layers;

/// Surfels of the ball.
const N: usize = 150_000;

/// A ball with classes as a pyramid of several nodes.
fn pyramid(folder: &Path) -> PathBuf {
    let golden = std::f32::consts::PI * (3.0 - 5f32.sqrt());
    let place = |i: usize| {
        let y = 1.0 - 2.0 * (i as f32 + 0.5) / N as f32;
        let (sin, cos) = (golden * i as f32).sin_cos();
        let around = (1.0 - y * y).sqrt();
        [around * cos, y, around * sin]
    };
    let places: Vec<f32> = (0..N).flat_map(place).collect();
    let radius = 1.5 * (4.0 * std::f32::consts::PI / N as f32).sqrt() / 2.0;
    let cloud = Cloud::new(
        DVec3::ZERO,
        vec![
            Column::new("position", 3, Buffer::F32(places.clone())),
            Column::new("normal", 3, Buffer::F32(places)),
            Column::new("radius", 1, Buffer::F32(vec![radius; N])),
            Column::new("class", 1, Buffer::U8(vec![1; N])),
            Column::new("color", 3, Buffer::U8(vec![188; 3 * N])),
        ],
    )
    .unwrap();
    let [file, output] = ["a.ply", "a.surfels"].map(|name| folder.join(name));
    surfelshop_cloud::write(&file, &cloud, &WriteOptions::default()).unwrap();
    let options = IndexOptions { read: ReadOptions::default(), memory: 64_000_000 };
    let done = index(&[file], &output, &options).unwrap();
    assert!(done.n_leaves > 4, "{done:?}");
    output
}

fn only(window: &mut Window) -> &OpenCloud {
    &window.document.clouds.as_ref().unwrap().open_clouds.all()[0]
}

fn n_edits(screen: &mut Screen) -> usize {
    only(screen.window()).pyramid().unwrap().layer().len()
}

/// The colour in the middle of the picture, and how much it is covered there.
fn middle(screen: &mut Screen) -> [f32; 4] {
    screen.settle();
    let pane = screen.window().views.panes.values().next().unwrap();
    let shown = pane.sides[0].shown.as_ref().unwrap();
    let image = &shown.rendered.color;
    let [x, y] = [MIDDLE.x / 900.0, MIDDLE.y / 640.0];
    let (x, y) = ((x * image.width as f32) as usize, (y * image.height as f32) as usize);
    let at = 4 * (y * image.width as usize + x);
    std::array::from_fn(|i| image.data[at + i])
}

/// Invariant: what is selected of a pyramid is tinted, and its edits are undone, kept beside it, read again and recovered
///
/// Costs 10 s.
#[test]
fn a_pyramid_is_edited_in_a_layer() {
    let folder = tempfile::tempdir().unwrap();
    let file = pyramid(folder.path());
    let mut screen = of_file(file.clone(), Vec::new());
    screen.keeps_edits(&folder.path().join("recovery"));
    let plain = middle(&mut screen);
    let around = [MIDDLE - vec2(60.0, 60.0), MIDDLE + vec2(60.0, 60.0)];
    screen.harness.key_press(Key::T);
    screen.frames();
    drag(&mut screen, &around, Modifiers::NONE);
    // Beside the ball nothing is selected.
    drag(&mut screen, &[pos2(780.0, 420.0), pos2(860.0, 500.0)], Modifiers::NONE);
    assert_eq!(screen.window().n_selected().0, 0);
    drag(&mut screen, &around, Modifiers::NONE);
    let (n, of) = screen.window().n_selected();
    assert!(of == N && n > 500 && n < N / 3, "{n} of {of}");
    let tinted = middle(&mut screen);
    assert!(tinted[0] > 1.5 * tinted[2] && plain[0] < 1.2 * plain[2], "{tinted:?}, {plain:?}");
    // What lies behind is not selected.
    screen.harness.key_press(Key::Delete);
    screen.frames();
    assert!(screen.window().messages.last().unwrap().starts_with("deleted about "));
    assert!(n_edits(&mut screen) == 1 && only(screen.window()).is_unsaved());
    assert_eq!(screen.window().n_selected().0, 0);
    let hole = middle(&mut screen);
    assert!(hole[3] > 0.5 && hole != plain, "the far side is seen: {hole:?}");
    screen.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    screen.frames();
    assert_eq!((n_edits(&mut screen), middle(&mut screen)), (0, tinted));
    assert!(!only(screen.window()).is_unsaved() && screen.window().n_selected().0 > 0);
    screen.harness.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    screen.frames();
    assert_eq!((n_edits(&mut screen), middle(&mut screen)), (1, hole));
    // Everything else gets another class, and what is hidden is shown again.
    screen.window().select_all_surfels();
    screen.window().set_value_of_surfels();
    screen.frames();
    let cloud = only(screen.window()).loaded.cloud.clone();
    assert!(cloud.column("class").is_some() && screen.window().n_selected().0 > 0);
    screen.window().hide_surfels();
    screen.frames();
    assert!(screen.window().messages.last().unwrap().contains("would leave none"), "not all of it");
    screen.window().select_no_surfels();
    drag(&mut screen, &[around[0], MIDDLE], Modifiers::NONE);
    screen.window().hide_surfels();
    screen.frames();
    assert!(n_edits(&mut screen) == 3 && screen.window().has_hidden_surfels());
    screen.window().show_hidden_surfels();
    assert!(n_edits(&mut screen) == 4 && !screen.window().has_hidden_surfels());
    // The scene has the layer beside it.
    let scene = folder.path().join("b.scene.toml");
    screen.window().save_scene(&scene);
    let layer = folder.path().join("b.layer.json");
    assert!(layer.is_file() && !only(screen.window()).is_unsaved());
    assert!(std::fs::read_to_string(&scene).unwrap().contains("layer = \"b.layer.json\""));
    assert_eq!(layers::read(&layer, N as u64).unwrap().len(), 4);
    // What is undone after that is not in there any more once it is saved again.
    for (key, n) in [(Modifiers::COMMAND, 3), (Modifiers::COMMAND | Modifiers::SHIFT, 4)] {
        screen.harness.key_press_modifiers(key, Key::Z);
        screen.frames();
        assert!(n_edits(&mut screen) == n && only(screen.window()).is_unsaved());
        screen.window().save_scene(&scene);
        assert_eq!(layers::read(&layer, N as u64).unwrap().len(), n);
    }
    assert!(!folder.path().join("b.2.layer.json").exists());
    screen.until_saved();
    let before = middle(&mut screen);
    // Recovered after another edit, which another scene gets in a file of its own.
    drag(&mut screen, &around, Modifiers::NONE);
    screen.window().crop_to_surfels();
    screen.frames();
    screen.until_saved();
    let recovery = screen.window().document.recovery.as_mut().unwrap();
    recovery.journal.finish(crate::document::recovery::JournalEnd::Keep);
    screen.window().document.recovery = None;
    drop(screen);
    let mut screen = of_file(scene, Vec::new());
    assert_eq!((n_edits(&mut screen), middle(&mut screen)), (4, before));
    screen.keeps_edits(&folder.path().join("recovery"));
    screen.click("recover");
    screen.until_said("not saved yet");
    assert!(n_edits(&mut screen) == 5 && only(screen.window()).is_unsaved());
    let other = folder.path().join("c.scene.toml");
    screen.window().save_scene(&other);
    assert_eq!(layers::read(&folder.path().join("c.layer.json"), N as u64).unwrap().len(), 5);
    assert_eq!(layers::read(&layer, N as u64).unwrap().len(), 4, "the first one stays");
}

/// Invariant: a tool that is led over a pyramid is an edit of its layer, undone, saved and done again when it is opened
///
/// Costs 5 s.
#[test]
fn a_tool_is_led_over_a_pyramid() {
    let folder = tempfile::tempdir().unwrap();
    let mut screen = of_file(pyramid(folder.path()), Vec::new());
    let plain = middle(&mut screen);
    screen.window().views.hands.radius = 0.15;
    screen.window().take_tool("brush".to_owned());
    screen.settle();
    let line = [MIDDLE - vec2(30.0, 0.0), MIDDLE + vec2(40.0, 0.0)];
    drag(&mut screen, &line, Modifiers::NONE);
    assert_eq!(n_edits(&mut screen), 1, "{:?}", screen.window().messages.last());
    let red = middle(&mut screen);
    assert!(red[0] > 2.0 * red[2] && plain[0] < 1.2 * plain[2], "{red:?}, {plain:?}");
    screen.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    screen.frames();
    assert_eq!((n_edits(&mut screen), middle(&mut screen)), (0, plain));
    screen.harness.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    screen.frames();
    assert_eq!((n_edits(&mut screen), middle(&mut screen)), (1, red));
    // What is erased shows the far side, which faces away.
    screen.window().take_tool("eraser".to_owned());
    screen.settle();
    drag(&mut screen, &line, Modifiers::NONE);
    let hole = middle(&mut screen);
    assert!(n_edits(&mut screen) == 2 && hole != red, "{hole:?}");
    // Surfels of pyramids are not moved.
    screen.window().take_tool("inflate".to_owned());
    screen.settle();
    drag(&mut screen, &[MIDDLE + vec2(110.0, 20.0), MIDDLE + vec2(115.0, 40.0)], Modifiers::NONE);
    let said = screen.window().messages.last().unwrap().to_owned();
    assert!(
        said.contains("the stroke was undone") && said.contains("leaves surfels where they are"),
        "{said}"
    );
    assert_eq!((n_edits(&mut screen), middle(&mut screen)), (2, hole));
    let scene = folder.path().join("led.scene.toml");
    screen.window().save_scene(&scene);
    drop(screen);
    let mut screen = of_file(scene, Vec::new());
    assert_eq!((n_edits(&mut screen), middle(&mut screen)), (2, hole));
}
