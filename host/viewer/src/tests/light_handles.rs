//! Lights that are dragged in the picture.

use super::Screen;
use crate::views::navigation;
use crate::views::picking;
use eframe::egui::{Event, Key, Modifiers, PointerButton, Pos2, Vec2, pos2, vec2};
use egui_kittest::kittest::Queryable as _;
use glam::{DVec2, DVec3, Vec3};
use surfelshop_api::{Light, View};
use surfelshop_session::options::camera;

const LIGHT: &str = "light 1: spot";
const TARGET: &str = "light 1: where the spot is turned to";

/// A position in the picture without a handle.
const ELSEWHERE: Pos2 = pos2(480.0, 560.0);

/// A window with a visible spot light.
fn lit() -> Screen {
    let mut screen = Screen::sample();
    let window = screen.window();
    let camera = window.views.camera;
    let place = |x: f64, y: f64, nearer: f64| {
        let depth = nearer * camera.eye.distance(camera.target);
        navigation::point_at(&camera, DVec2::new(x, y), depth)
    };
    window.settings.scene.lights = vec![Light::Spot {
        position: place(0.15, -0.3, 0.8),
        target: place(-0.05, 0.1, 1.0),
        intensity: Vec3::new(4.0, 3.0, 1.0),
        angle: 0.5,
        softness: 0.2,
    }];
    screen.settle();
    screen.harness.hover_at(ELSEWHERE);
    screen.until("a step to undo", |window| window.document.history.has_undo(&window.snapshot()));
    screen
}

fn spot(screen: &mut Screen) -> (DVec3, DVec3) {
    match screen.window().settings.scene.lights[0] {
        Light::Spot { position, target, .. } => (position, target),
        ref other => panic!("{other:?} is no spot"),
    }
}

fn view(screen: &mut Screen) -> View {
    let window = screen.window();
    let size_px = window.views.panes[&0].size_px;
    camera::framed_view(
        window.views.camera,
        &window.document.clouds.as_ref().unwrap().extent,
        size_px,
    )
}

/// The position of a handle.
fn at(screen: &mut Screen, name: &str) -> Pos2 {
    screen.frames();
    screen.harness.get_by_label(name).rect().center()
}

/// Drags from a position in several steps.
fn drag(screen: &mut Screen, from: Pos2, by: Vec2, modifiers: Modifiers) {
    screen.harness.hover_at(from);
    screen.frames();
    screen.harness.event(Event::ModifiersChanged(modifiers));
    let button = |pos: Pos2, pressed: bool| Event::PointerButton {
        pos,
        button: PointerButton::Primary,
        pressed,
        modifiers,
    };
    screen.harness.event(button(from, true));
    screen.harness.step();
    for i in 1..=5u8 {
        screen.harness.event(Event::PointerMoved(from + by * (f32::from(i) / 5.0)));
        screen.harness.step();
    }
    screen.harness.event(button(from + by, false));
    screen.harness.event(Event::ModifiersChanged(Modifiers::NONE));
    screen.frames();
}

/// Invariant: a lamp that is dragged stays under the pointer, in one step to undo
#[test]
fn a_lamp_is_dragged_across_the_picture_in_one_step() {
    let mut screen = lit();
    let (before, target) = spot(&mut screen);
    let (view, camera) = (view(&mut screen), screen.window().views.camera);
    let on_screen = |place: DVec3| picking::project(&camera, place).unwrap();
    let serial = |screen: &mut Screen| {
        screen.window().views.panes[&0].sides[0].shown.as_ref().unwrap().serial
    };
    let (by, picture, start) = (vec2(60.0, 35.0), serial(&mut screen), at(&mut screen, LIGHT));
    drag(&mut screen, start, by, Modifiers::NONE);
    assert!(at(&mut screen, LIGHT).distance(start + by) < 0.01, "it stays under the pointer");
    let (position, target_now) = spot(&mut screen);
    assert_eq!((target_now, screen.window().views.camera), (target, camera));
    let moved =
        (on_screen(position).position - on_screen(before).position) * f64::from(view.size_px[1]);
    assert!(moved.distance(DVec2::new(60.0, 35.0)) < 1e-2, "{moved}");
    assert!((on_screen(position).depth / on_screen(before).depth - 1.0).abs() < 1e-9);
    screen.until("the picture", |window| {
        let side = &window.views.panes[&0].sides[0];
        side.is_converged() && side.shown.as_ref().unwrap().serial > picture
    });
    screen.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    screen.until("one step back", |window| {
        matches!(window.settings.scene.lights[0], Light::Spot { position, .. } if position == before)
    });
    assert_eq!(spot(&mut screen), (before, target));
}

#[test]
fn a_lamp_is_dragged_along_the_line_of_sight_and_its_target_by_itself() {
    let mut screen = lit();
    let camera = screen.window().views.camera;
    for (modifiers, by) in [(Modifiers::SHIFT, 40.0), (Modifiers::ALT, -40.0)] {
        let ((before, target), start) = (spot(&mut screen), at(&mut screen, LIGHT));
        drag(&mut screen, start, vec2(0.0, by), modifiers);
        let (position, target_now) = spot(&mut screen);
        let [was, is] = [before, position].map(|place| picking::project(&camera, place).unwrap());
        assert!(was.position.distance(is.position) < 1e-9);
        // Upwards is farther.
        assert!((is.depth > was.depth) == (by < 0.0) && is.depth != was.depth, "{was:?}, {is:?}");
        assert_eq!((target_now, screen.window().views.camera), (target, camera));
    }
    let (light, before) = spot(&mut screen);
    let start = at(&mut screen, TARGET);
    drag(&mut screen, start, vec2(-30.0, 20.0), Modifiers::NONE);
    assert!(at(&mut screen, TARGET).distance(start + vec2(-30.0, 20.0)) < 0.01);
    let (position, target) = spot(&mut screen);
    assert!(position == light && target != before);
}

#[test]
fn elsewhere_the_view_turns_and_lamps_out_of_sight_have_no_handle() {
    let mut screen = lit();
    let (lights, camera) =
        (screen.window().settings.scene.lights.clone(), screen.window().views.camera);
    drag(&mut screen, ELSEWHERE, vec2(40.0, 0.0), Modifiers::NONE);
    assert_eq!(screen.window().settings.scene.lights, lights);
    assert_ne!(screen.window().views.camera, camera);
    let n_handles = |screen: &mut Screen| {
        screen.frames();
        screen.harness.query_all_by_label_contains("light 1: ").count()
    };
    screen.harness.hover_at(ELSEWHERE);
    assert_eq!(n_handles(&mut screen), 2);
    // Not while the pointer is over a panel.
    screen.harness.hover_at(pos2(100.0, 300.0));
    assert_eq!(n_handles(&mut screen), 0);
    screen.harness.hover_at(ELSEWHERE);
    let mut turned = screen.window().views.camera;
    turned.target = 2.0 * turned.eye - turned.target;
    screen.window().set_camera(0, turned);
    assert_eq!(n_handles(&mut screen), 0, "behind the camera");
    screen.window().set_camera(0, camera);
    assert_eq!(n_handles(&mut screen), 2);
    screen.window().settings.shows_light_handles = false;
    assert_eq!(n_handles(&mut screen), 0);
    // The scene has the setting.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("unlit.scene.toml");
    screen.window().save_scene(&path);
    let mut again = Screen::open(&[path.to_str().unwrap()]);
    again.settle();
    assert!(!again.window().settings.shows_light_handles);
    again.window().settings.shows_light_handles = true;
    again.window().save_scene(&path);
    assert!(!std::fs::read_to_string(&path).unwrap().contains("lamps"));
}
