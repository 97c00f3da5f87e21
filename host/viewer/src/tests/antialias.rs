//! Views at rest become antialiased: further frames are drawn until there are as many as were asked for.

use super::scenes::n_pixels_unlike_rendered;
use super::{Screen, built_plugins};
use crate::render_thread::RenderedView;
use crate::window::Window;
use glam::DVec2;
use std::time::Duration;

fn shown(window: &Window) -> (u64, &RenderedView) {
    let shown = window.views.panes[&0].sides[0].shown.as_ref().unwrap();
    (shown.serial, &shown.rendered)
}

fn turn(screen: &mut Screen) {
    let mut camera = screen.window().views.camera;
    crate::views::navigation::orbit(&mut camera, DVec2::new(0.3, 0.1));
    screen.window().set_camera(0, camera);
}

/// Invariant: what the window shows of an antialiased view at rest is what `render` makes of the saved scene,
/// pixel by pixel
#[test]
fn an_antialiased_view_is_what_render_makes_of_the_saved_scene() {
    let mut screen = Screen::sample();
    let folder = tempfile::tempdir().unwrap();
    for renderer in ["ewa-phong", "environment"] {
        // The panel is as wide as what a renderer's parameters take, and views have the rest.
        screen.window().settings.antialias = 1;
        screen.window().settings.panes[0].renderers[0] = renderer.to_owned();
        screen.settle();
        let sharp = shown(screen.window()).1.clone();
        assert_eq!(sharp.samples, [1, 1]);
        screen.window().settings.antialias = 6;
        screen.settle();
        let rendered = shown(screen.window()).1.clone();
        assert_eq!((rendered.samples, rendered.n_frames, rendered.refines), ([6, 6], 6, false));
        assert!(rendered.color != sharp.color, "nothing is averaged");
        assert!(rendered.explained.is_some());
        // The pointer reads depths of the first frame, as without antialiasing.
        assert!(rendered.depth == sharp.depth, "depths are of other frames");
        let scene = folder.path().join(format!("{renderer}.scene.toml"));
        screen.window().save_scene(&scene);
        assert!(std::fs::read_to_string(&scene).unwrap().contains("antialias = 6"));
        assert_eq!(n_pixels_unlike_rendered(&mut screen, &scene, built_plugins()), 0);
    }
}

/// Invariant: with eye-dome lighting, chosen or automatic, the window shows what `render` makes of the saved scene,
/// pixel by pixel
#[test]
fn eye_dome_lighting_is_what_render_makes_of_the_saved_scene() {
    use surfelshop_cloud::display::Look;
    use surfelshop_cloud::scene::EyeDomeUse;
    let mut screen = Screen::sample();
    let folder = tempfile::tempdir().unwrap();
    screen.window().settings.antialias = 2;
    screen.settle();
    let mut levels = vec![shown(screen.window()).1.levels.clone()];
    for (name, look, when) in [
        ("on", Look::Surface, EyeDomeUse::On),
        ("points", Look::Points { radius: 0.0 }, EyeDomeUse::Automatic),
        ("off", Look::Points { radius: 0.0 }, EyeDomeUse::Off),
    ] {
        screen.window().settings.splats.look = look;
        screen.window().settings.eye_dome.when = when;
        screen.settle();
        let now = shown(screen.window()).1.levels.clone();
        assert!(levels.iter().all(|before| *before != now), "{name} changes nothing");
        levels.push(now);
        let scene = folder.path().join(format!("{name}.scene.toml"));
        screen.window().save_scene(&scene);
        assert_eq!(n_pixels_unlike_rendered(&mut screen, &scene, built_plugins()), 0, "{name}");
    }
}

#[test]
fn the_first_frame_is_shown_at_once_and_a_change_begins_anew() {
    let mut screen = Screen::sample();
    screen.window().settings.antialias = 200;
    screen.until("some samples", |window| shown(window).1.samples[0] > 3);
    let (before, rendered) = shown(screen.window());
    assert!(rendered.refines && rendered.samples[1] == 200);
    assert!(screen.window().works(), "the status line says so");
    turn(&mut screen);
    screen.until("another picture", |window| shown(window).0 > before);
    assert_eq!(shown(screen.window()).1.samples, [1, 200], "samples of another view are in it");
    // What is shown of a view that has moved is one frame of it, and at rest it goes on.
    screen.until("some samples", |window| shown(window).1.samples[0] > 1);
    // Less is done at once.
    screen.window().settings.antialias = 2;
    screen.settle();
    assert_eq!(shown(screen.window()).1.samples, [2, 2]);
}

#[test]
fn a_settled_view_draws_nothing_more() {
    let mut screen = Screen::sample();
    screen.window().settings.antialias = 3;
    screen.settle();
    screen.frames();
    assert!(!screen.window().works());
    let counts = |screen: &mut Screen| {
        let window = screen.window();
        (window.render.counters.surfaces, shown(window).0, shown(window).1.samples)
    };
    let rests = counts(&mut screen);
    std::thread::sleep(Duration::from_millis(300));
    screen.frames();
    assert_eq!(counts(&mut screen), rests);
    // Off, the picture is that of one frame again.
    screen.window().settings.antialias = 1;
    screen.settle();
    let (_, rendered) = shown(screen.window());
    assert_eq!((rendered.samples, rendered.n_frames), ([1, 1], 1));
}
