//! Surfels are selected and tools are led by hand.

mod pyramids;

use super::plugins::faulty;
use super::{SAMPLE, Screen, built_plugins};
use crate::ViewerArguments;
use crate::plugins::Readiness;
use crate::views::hands::HandMode;
use eframe::egui::{Event, Key, Modifiers, PointerButton, Pos2, pos2};
use egui_kittest::kittest::Queryable as _;
use std::path::PathBuf;
use std::time::Duration;
use surfelshop_api::columns::COLOR;
use surfelshop_api::params::Value;
use surfelshop_cloud::selection::{NamedStroke, Tint};
use surfelshop_cloud::{Cloud, CloudPart, How};
use surfelshop_runtime::tools::{Ended, Running};
use surfelshop_session::input::strokes;
use surfelshop_session::options::select::{SelectStep, select};
use surfelshop_session::options::{DeviceArguments, UpAxis};

/// In the picture: in the middle of the sample, and beside it.
const MIDDLE: Pos2 = pos2(450.0, 380.0);
const CORNER: Pos2 = pos2(60.0, 420.0);

fn with_brushes() -> Screen {
    with(Vec::new())
}

/// A window with the brushes and further plugins, which have a second for a run.
fn with(more: Vec<PathBuf>) -> Screen {
    of_file(SAMPLE.into(), more)
}

fn of_file(file: PathBuf, more: Vec<PathBuf>) -> Screen {
    let mut plugins = built_plugins();
    plugins.patience = Some(Duration::from_secs(1)).filter(|_| !more.is_empty());
    plugins.plugin.extend(more);
    let brush = plugins.plugin[0].with_file_name(format!(
        "{}surfelshop_brush{}",
        std::env::consts::DLL_PREFIX,
        std::env::consts::DLL_SUFFIX
    ));
    plugins.plugin.push(brush);
    let mut screen = Screen::with(&ViewerArguments {
        memory: None,
        in_place: false,
        colors: Default::default(),
        files: vec![file],
        up: UpAxis::Y,
        plugins,
        device: DeviceArguments::default(),
    });
    screen.settle();
    // Without panels the picture is all of the window.
    let window = screen.window();
    (window.preferences.panels, window.preferences.properties) = (false, false);
    screen.frames();
    screen.settle();
    screen
}

fn cloud(screen: &mut Screen) -> Cloud {
    let shown = screen.window().document.clouds.as_ref().unwrap();
    shown.open_clouds.all()[0].loaded.cloud.clone()
}

fn drag(screen: &mut Screen, line: &[Pos2], modifiers: Modifiers) {
    screen.settle();
    screen.harness.hover_at(line[0]);
    screen.frames();
    screen.harness.event(Event::ModifiersChanged(modifiers));
    let button = |pos: Pos2, pressed: bool| Event::PointerButton {
        pos,
        button: PointerButton::Primary,
        pressed,
        modifiers,
    };
    screen.harness.event(button(line[0], true));
    screen.harness.step();
    for ends in line.windows(2) {
        for i in 1..=8u8 {
            let at = ends[0].lerp(ends[1], f32::from(i) / 8.0);
            screen.harness.event(Event::PointerMoved(at));
            screen.harness.step();
        }
    }
    screen.harness.event(button(*line.last().unwrap(), false));
    screen.harness.event(Event::ModifiersChanged(Modifiers::NONE));
    screen.until("the end of the gesture", |window| !window.views.hands.is_at_work());
    screen.frames();
}

fn generation(cloud: &Cloud, name: &str) -> Option<u64> {
    cloud.column(name).map(|column| column.generation())
}

/// Invariant: what is selected by hand is tinted and nothing else, and deleting it is one step of undo
#[test]
fn a_rectangle_selects_what_is_seen_and_delete_is_undone() {
    let mut screen = with_brushes();
    let before = cloud(&mut screen);
    let displayed = |screen: &mut Screen| {
        let shown = screen.window().document.clouds.as_ref().unwrap();
        generation(&shown.clouds.loaded[0].cloud, COLOR)
    };
    let plain = displayed(&mut screen);
    screen.harness.key_press(Key::T);
    screen.frames();
    assert_eq!(screen.window().views.hands.mode, HandMode::Rectangle);
    let camera = screen.window().views.camera;
    let around = [MIDDLE - eframe::egui::vec2(60.0, 60.0), MIDDLE + eframe::egui::vec2(60.0, 60.0)];
    drag(&mut screen, &around, Modifiers::NONE);
    assert_eq!(screen.window().views.camera, camera, "the camera stays");
    let (n, of) = screen.window().n_selected();
    assert!(n > 100 && n < of / 2 && of == before.len(), "{n} of {of}");
    assert_ne!(displayed(&mut screen), plain, "the tint");
    assert_eq!(generation(&cloud(&mut screen), COLOR), generation(&before, COLOR));
    // What lies behind is more.
    screen.window().views.hands.through = true;
    drag(&mut screen, &around, Modifiers::NONE);
    let through = screen.window().n_selected().0;
    assert!(through > n + n / 4, "{through} with what lies behind, {n} of what is seen");
    screen.window().views.hands.through = false;
    drag(&mut screen, &around, Modifiers::COMMAND);
    let left = screen.window().n_selected().0;
    assert_eq!(left, through - n, "Ctrl takes away");
    screen.harness.key_press_modifiers(Modifiers::COMMAND, Key::I);
    screen.frames();
    assert_eq!(screen.window().n_selected().0, of - left);
    assert!(screen.harness.query_all_by_label_contains(" selected").count() > 0, "the status line");
    screen.harness.key_press_modifiers(Modifiers::COMMAND, Key::I);
    screen.frames();
    screen.harness.key_press(Key::Delete);
    screen.frames();
    assert_eq!(cloud(&mut screen).len(), of - left);
    assert_eq!(screen.window().n_selected().0, 0);
    screen.settle();
    screen.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    screen.frames();
    let after = cloud(&mut screen);
    assert_eq!(generation(&after, "position"), generation(&before, "position"), "the same columns");
    assert_eq!(screen.window().n_selected().0, left, "and what was selected of them");
    // Escape lets go of what is selected, and then of the mode.
    for _ in 0..2 {
        screen.harness.key_press(Key::Escape);
        screen.frames();
    }
    assert_eq!(screen.window().n_selected().0, 0);
    assert_eq!(screen.window().views.hands.mode, HandMode::Camera);
    screen.settle();
    assert_eq!(displayed(&mut screen), plain, "nothing is tinted");
}

#[test]
fn lassos_and_brushes_select_and_split_off() {
    let mut screen = with_brushes();
    screen.harness.key_press(Key::L);
    screen.frames();
    let corner = |x: f32, y: f32| MIDDLE + eframe::egui::vec2(x, y);
    drag(
        &mut screen,
        &[corner(-60.0, 60.0), corner(60.0, 60.0), corner(60.0, -60.0)],
        Modifiers::NONE,
    );
    let lasso = screen.window().n_selected().0;
    assert!(lasso > 50, "{lasso}");
    screen.harness.key_press(Key::C);
    screen.frames();
    drag(&mut screen, &[corner(-40.0, -40.0), corner(-20.0, -40.0)], Modifiers::SHIFT);
    let more = screen.window().n_selected().0;
    assert!(more > lasso, "{more} from {lasso}");
    screen.window().grow_surfels();
    let grown = screen.window().n_selected().0;
    assert!(grown > more);
    screen.window().views.hands.value = ("class".to_owned(), 7.0);
    screen.window().set_value_of_surfels();
    let classified = cloud(&mut screen);
    let seven = (0..classified.len())
        .filter(|&i| classified.column("class").unwrap().values().get_f64(i) == Some(7.0));
    assert_eq!(seven.count(), grown);
    let of = classified.len();
    screen.window().split_surfels();
    screen.frames();
    let all: Vec<usize> = screen
        .window()
        .document
        .clouds
        .as_ref()
        .unwrap()
        .open_clouds
        .all()
        .iter()
        .map(|open| {
            assert!(open.visible);
            open.loaded.cloud.len()
        })
        .collect();
    assert_eq!(all, [of - grown, grown]);
    // Beside the cloud nothing is selected, and a click there lets go.
    screen.harness.key_press(Key::T);
    screen.frames();
    screen.window().select_all_surfels();
    drag(&mut screen, &[CORNER, CORNER], Modifiers::NONE);
    assert_eq!(screen.window().n_selected().0, 0);
}

/// Takes the brush in hand.
fn take_brush(screen: &mut Screen) {
    screen.harness.key_press(Key::P);
    screen.frames();
    assert_eq!(screen.window().views.hands.mode, HandMode::Tool("brush".to_owned()));
    screen.until("the tool", |window| {
        matches!(window.plugins.tools.units.readiness("brush"), Readiness::Ready(_))
    });
}

/// What the brush makes of a stroke that was recorded.
fn led_again(screen: &mut Screen, cloud: &Cloud, led: &NamedStroke) -> Cloud {
    let Readiness::Ready(unit) = screen.window().plugins.tools.units.readiness("brush") else {
        panic!()
    };
    let values = led.fitted(&unit.description.params).unwrap();
    let among = led.among.as_ref().map(|among| among.selection(cloud.len()).unwrap());
    let part = CloudPart::along(cloud, &led.stroke, among.as_ref()).unwrap();
    let stroke = Some(led.stroke.clone());
    let mut running = Running::start_on(unit, &values, part, stroke, &Default::default()).unwrap();
    let Some(Ended::Done(done)) = running.wait(super::TIMEOUT) else { panic!() };
    done.edited.unwrap().cloud
}

/// Invariant: Ctrl and a click give the tool in hand the colour under the pointer and change no cloud
#[test]
fn colours_are_taken_from_the_cloud() {
    let mut screen = with_brushes();
    let before = cloud(&mut screen);
    take_brush(&mut screen);
    drag(&mut screen, &[MIDDLE, MIDDLE], Modifiers::COMMAND);
    let taken = screen.window().plugins.tools.values.get("brush").and_then(|all| all.get("color"));
    let Some(Value::Color(taken)) = taken.cloned() else { panic!("no colour") };
    // The sample's colours differ from place to place: it is one of them.
    assert!(before.view().albedos().iter().any(|albedo| albedo.to_array() == taken), "{taken:?}");
    assert_eq!(generation(&cloud(&mut screen), COLOR), generation(&before, COLOR));
    assert!(screen.window().views.hands.said.starts_with("brush: took the colour"));
    drag(&mut screen, &[CORNER, CORNER], Modifiers::COMMAND);
    assert_eq!(generation(&cloud(&mut screen), COLOR), generation(&before, COLOR));
}

/// Invariant: what is led over a selection alone is done again over it, bit by bit, and over no other cloud
#[test]
fn a_stroke_over_a_selection_is_recorded_with_it() {
    let mut screen = with_brushes();
    let before = cloud(&mut screen);
    screen.harness.key_press(Key::T);
    screen.frames();
    let corner = MIDDLE + eframe::egui::vec2(60.0, 60.0);
    drag(&mut screen, &[MIDDLE, corner], Modifiers::NONE);
    let n_selected = screen.window().n_selected().0;
    assert!(n_selected > 50, "{n_selected}");
    take_brush(&mut screen);
    assert_eq!(screen.window().tint(), Tint::Faint, "what is painted has to be seen");
    let above = MIDDLE - eframe::egui::vec2(0.0, 40.0);
    drag(&mut screen, &[above, MIDDLE + eframe::egui::vec2(5.0, 20.0)], Modifiers::NONE);
    let painted = cloud(&mut screen);
    let noted = strokes::of_cloud(&painted);
    let read: NamedStroke =
        serde_json::from_str(&serde_json::to_string(&noted[0]).unwrap()).unwrap();
    assert_eq!((&read, read.n_surfels), (&noted[0], Some(before.len() as u64)));
    let among = read.among.as_ref().unwrap().selection(before.len()).unwrap();
    assert!(among.count() > 0 && among.count() <= n_selected, "{}", among.count());
    let [old, new] = [&before, &painted].map(|cloud| cloud.view().albedos());
    assert!((0..before.len()).all(|i| old[i] == new[i] || among.contains(i)));
    // It is selected still.
    assert_eq!(screen.window().n_selected().0, n_selected);
    let again = led_again(&mut screen, &before, &read);
    assert!(again.column(COLOR).unwrap().values() == painted.column(COLOR).unwrap().values());
}

/// Invariant: a stroke is one step of undo, and its file makes the same bits
#[test]
fn a_stroke_paints_is_undone_and_is_recorded() {
    let mut screen = with_brushes();
    let before = cloud(&mut screen);
    take_brush(&mut screen);
    let paint = Value::Color([0.0, 0.8, 0.1]);
    screen
        .window()
        .plugins
        .tools
        .values
        .entry("brush".to_owned())
        .or_default()
        .insert("color".to_owned(), paint);
    let above = MIDDLE - eframe::egui::vec2(0.0, 40.0);
    drag(&mut screen, &[above - eframe::egui::vec2(40.0, 0.0), above], Modifiers::NONE);
    let painted = cloud(&mut screen);
    assert_ne!(generation(&painted, COLOR), generation(&before, COLOR));
    assert_eq!(generation(&painted, "position"), generation(&before, "position"));
    let [note] = painted.history() else { panic!("one stroke") };
    assert_eq!(note.how, How::Stroked);
    assert!(note.n_surfels > 50 && note.n_surfels < before.len() as u64 / 2, "{}", note.n_surfels);
    let rows = surfelshop_cloud::changed_rows(
        generation(&before, COLOR).unwrap(),
        generation(&painted, COLOR).unwrap(),
    );
    assert!(rows.is_some_and(|rows| rows.len() as u64 <= note.n_surfels));

    // Led again along what was noted it makes the same.
    let noted = strokes::of_cloud(&painted);
    let text = strokes::text(noted).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.strokes.json");
    std::fs::write(&path, text).unwrap();
    let again = strokes::read(&path).unwrap();
    let replayed = led_again(&mut screen, &before, &again[0]);
    assert!(replayed.column(COLOR).unwrap().values() == painted.column(COLOR).unwrap().values());

    screen.settle();
    screen.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    screen.frames();
    assert_eq!(generation(&cloud(&mut screen), COLOR), generation(&before, COLOR), "one step");
    assert!(cloud(&mut screen).history().is_empty());
    // Only what is selected is painted.
    screen.window().change_selections(|_, before| Ok(before.inverted()));
    screen.window().select_no_surfels();
    drag(&mut screen, &[CORNER, CORNER + eframe::egui::vec2(0.0, 10.0)], Modifiers::NONE);
    assert!(cloud(&mut screen).history().is_empty(), "beside the cloud");
}

/// Invariant: a stroke of a tool that panics, hangs or answers for surfels that it did not get is undone with a message, and
/// nothing else is lost
#[test]
fn a_stroke_of_a_tool_that_misbehaves_is_undone_and_nothing_is_lost() {
    let (prefix, suffix) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let library = faulty().with_file_name(format!("{prefix}hands{suffix}"));
    let mut screen = with(vec![library]);
    let above = MIDDLE - eframe::egui::vec2(0.0, 40.0);
    let line = [above - eframe::egui::vec2(40.0, 0.0), above];
    // What was there before stays, and so does what can be undone.
    let paints = |screen: &mut Screen| {
        screen.window().take_tool("brush".to_owned());
        screen.until("the brush", |window| {
            matches!(window.plugins.tools.units.readiness("brush"), Readiness::Ready(_))
        });
        drag(screen, &line, Modifiers::NONE);
    };
    paints(&mut screen);
    let before = cloud(&mut screen);
    assert_eq!(before.history().len(), 1);
    for (tool, words) in [
        ("panics-in-stroke", "at the worst moment"),
        ("answers-for-others", "surfel"),
        ("hangs-in-stroke", "1 s"),
    ] {
        screen.window().take_tool(tool.to_owned());
        screen.until("the tool", |window| {
            matches!(window.plugins.tools.units.readiness(tool), Readiness::Ready(_))
        });
        drag(&mut screen, &line, Modifiers::NONE);
        let told = screen.window().messages.last().unwrap().to_owned();
        assert!(told.contains("the stroke was undone") && told.contains(words), "{tool}: {told}");
        let after = cloud(&mut screen);
        let columns = |cloud: &Cloud| {
            cloud.columns().iter().map(|column| column.generation()).collect::<Vec<_>>()
        };
        assert_eq!(columns(&after), columns(&before), "{tool}");
        assert_eq!(after.history().len(), 1, "{tool}");
        assert!(!screen.window().views.hands.is_at_work());
    }
    // The honest brush paints on, and its strokes are undone as before.
    paints(&mut screen);
    assert_eq!(cloud(&mut screen).history().len(), 2);
    for left in [1, 0] {
        screen.settle();
        screen.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
        screen.frames();
        assert_eq!(cloud(&mut screen).history().len(), left);
    }
}

/// The middle of a handle.
fn handle(screen: &mut Screen, name: &str) -> Pos2 {
    screen.settle();
    screen.frames();
    screen.harness.get_by_label(name).rect().center()
}

/// What is selected, after it was compared with what the copied words select without a window.
fn selected_as_typed(screen: &mut Screen) -> usize {
    screen.frames();
    screen.harness.get_by_label("copy for the command line").click();
    screen.frames();
    let copied =
        screen.window().messages.last().unwrap().strip_prefix("copied ").unwrap().to_owned();
    let copied = copied.split(" --up ").next().unwrap().to_owned();
    let cloud = cloud(screen);
    let up = screen.window().document.up.axis();
    let typed = select(&cloud, &[SelectStep::parse(&copied).unwrap()], up).unwrap();
    let own = screen.window().views.hands.selection_of(&cloud);
    let own: Vec<usize> = own.map_or_else(Vec::new, |own| own.indices().collect());
    assert!(
        typed.indices().eq(own.iter().copied()),
        "{copied}: {} and {}",
        typed.count(),
        own.len()
    );
    own.len()
}

/// Invariant: a box selects while its handles are dragged, as the same box does on the command line
#[test]
fn a_box_selects_what_is_between_its_sides() {
    let mut screen = with_brushes();
    screen.harness.key_press_modifiers(Modifiers::SHIFT, Key::T);
    screen.frames();
    assert_eq!(screen.window().views.hands.mode, HandMode::Box);
    assert!(selected_as_typed(&mut screen) > 0, "before anything is dragged");
    let camera = screen.window().views.camera;
    let side = handle(&mut screen, "+y side of the box");
    drag(&mut screen, &[side, side + eframe::egui::vec2(3.0, 60.0)], Modifiers::NONE);
    assert_eq!(screen.window().views.camera, camera, "the camera stays");
    let few = selected_as_typed(&mut screen);
    let side = handle(&mut screen, "+y side of the box");
    drag(&mut screen, &[side, side - eframe::egui::vec2(0.0, 100.0)], Modifiers::NONE);
    let more = selected_as_typed(&mut screen);
    let of = cloud(&mut screen).len();
    assert!(few > 50 && more > few && more < of, "{few}, {more} of {of}");
    let edge = handle(&mut screen, "edge that turns the box");
    drag(&mut screen, &[edge, edge + eframe::egui::vec2(70.0, 0.0)], Modifiers::NONE);
    let turned = selected_as_typed(&mut screen);
    let typed = screen.window().messages.last().unwrap().matches(':').count();
    assert_eq!(typed, 3, "degrees are typed, too");
    assert!(screen.window().messages.last().unwrap().ends_with(" --up y"));
    // What is kept stays, and another box takes from it.
    screen.harness.get_by_label("keep").click();
    screen.frames();
    screen.harness.get_by_label("remove").click();
    screen.frames();
    assert_eq!(screen.window().n_selected().0, 0, "all of it");
    let middle = handle(&mut screen, "middle of the box");
    drag(&mut screen, &[middle, middle + eframe::egui::vec2(0.0, 90.0)], Modifiers::NONE);
    let left = screen.window().n_selected().0;
    assert!(left > 0 && left < turned, "{left} of {turned}");
    // Begun anew with nothing selected, a box does not remove.
    screen.window().toggle_hand(HandMode::Box);
    screen.window().select_no_surfels();
    screen.window().toggle_hand(HandMode::Box);
    assert!(screen.window().n_selected().0 > 0);
    let left = screen.window().n_selected().0;
    // Around what is selected is nothing else.
    screen.harness.get_by_label("around the selection").click();
    screen.frames();
    screen.harness.get_by_label("only").click();
    screen.frames();
    let around = screen.window().n_selected().0;
    assert!(around >= left && around < of, "{around} of {of} around {left}");
    // Beside handles a drag moves the camera.
    let beside = pos2(820.0, 480.0);
    drag(&mut screen, &[beside, beside + eframe::egui::vec2(40.0, 0.0)], Modifiers::NONE);
    assert_ne!(screen.window().views.camera, camera);
}

/// Invariant: a plane lies where the cloud is clicked, and its sides have all surfels between them
#[test]
fn a_plane_selects_one_side() {
    let mut screen = with_brushes();
    screen.harness.key_press_modifiers(Modifiers::SHIFT, Key::L);
    screen.frames();
    screen.settle();
    // Beside the handles.
    let at = MIDDLE + eframe::egui::vec2(-40.0, 30.0);
    drag(&mut screen, &[at], Modifiers::NONE);
    let one = selected_as_typed(&mut screen);
    screen.harness.get_by_label("flip").click();
    screen.frames();
    let other = selected_as_typed(&mut screen);
    let of = cloud(&mut screen).len();
    assert!(one > 0 && other > 0, "{one} and {other}");
    assert!((of..of + 3).contains(&(one + other)), "{one} and {other} of {of}");
    screen.harness.get_by_label("level").click();
    screen.frames();
    let level = selected_as_typed(&mut screen);
    let place = handle(&mut screen, "place of the plane");
    drag(&mut screen, &[place, place + eframe::egui::vec2(0.0, 15.0)], Modifiers::NONE);
    let lower = selected_as_typed(&mut screen);
    assert!(lower > level, "{lower} above a lower plane, {level} above the one before");
    let tip = handle(&mut screen, "direction of the plane");
    drag(&mut screen, &[tip, tip + eframe::egui::vec2(80.0, 10.0)], Modifiers::NONE);
    let tilted = selected_as_typed(&mut screen);
    assert!(tilted != lower && lower < of, "{tilted} after {lower} of {of}");
}
