//! Renderers that ask for another frame: each is shown as it comes, and none keeps others waiting.

use super::plugins::faulty;
use super::scenes::n_pixels_unlike_rendered;
use super::{PATIENCE, SAMPLE, Screen, built_plugins, order_of};
use crate::arguments::{DeviceArguments, PluginFiles, UpAxis, ViewerArguments};
use crate::viewer::darkroom::{Darkroom, News, Order, Place, Shot};
use crate::viewer::export;
use crate::viewer::window::Window;
use egui_kittest::kittest::Queryable as _;
use std::time::{Duration, Instant};
use surfelshop_api::params::{Value, Values};

fn plugins() -> PluginFiles {
    let mut plugin = built_plugins().plugin;
    plugin.push(faulty());
    PluginFiles { plugin, trust: true, ..PluginFiles::default() }
}

fn screen() -> Screen {
    let mut screen = Screen::with(&ViewerArguments {
        files: vec![SAMPLE.into()],
        up: UpAxis::Y,
        plugins: plugins(),
        device: DeviceArguments::default(),
    });
    screen.settle();
    screen
}

/// Values of the renderer `refines`.
fn values(frames: i64, pause: i64) -> Values {
    let values = [("frames", frames), ("pause", pause)];
    values.map(|(id, value)| (id.to_owned(), Value::Int(value))).into_iter().collect()
}

/// Has a view show the renderer.
fn refine(screen: &mut Screen, pane: u32, frames: i64, pause: i64) {
    let settings = screen.window().settings.pane_mut(pane).unwrap();
    settings.renderers[0] = "refines".to_owned();
    settings.values.insert("refines".to_owned(), values(frames, pause));
}

/// What a view shows of the renderer: the number of its order, the frames so far, and whether there
/// will be more.
fn progress(window: &Window, pane: u32) -> Option<(u64, u32, bool)> {
    let shown = window.panes[&pane].sides[0].shown.as_ref()?;
    let shot = (shown.renderer == "refines").then_some(&shown.shot)?;
    assert_eq!(index(shot), shot.n_frames - 1, "the picture is of another frame");
    // What it is made of is said of the last one.
    assert!(!shot.refines || shot.explained.is_none());
    Some((shown.serial, shot.n_frames, shot.refines))
}

/// The index of the frame that a picture shows.
fn index(shot: &Shot) -> u32 {
    let covered = shot.color.data.chunks_exact(4).filter(|pixel| pixel[3] > 0.5);
    let brightest = covered.map(|pixel| pixel[0] / pixel[3]).fold(-1.0, f32::max);
    assert!(brightest >= 0.0, "nothing is shown");
    (brightest * 256.0).round() as u32
}

#[test]
fn frames_are_shown_as_they_come_until_the_last_one() {
    let mut screen = screen();
    refine(&mut screen, 0, 40, 20);
    let mut seen = Vec::new();
    screen.until("the last frame", |window| {
        let Some((_, n_frames, refines)) = progress(window, 0) else { return false };
        if seen.last() != Some(&n_frames) {
            seen.push(n_frames);
        }
        assert!(refines == window.works(), "the status line says so");
        !refines
    });
    assert!(seen.is_sorted() && seen.len() > 3, "{seen:?}");
    assert_eq!(seen[seen.len() - 1], 40, "{seen:?}");
    let side = &screen.window().panes[&0].sides[0];
    assert!(side.settled() && side.shown.as_ref().unwrap().shot.explained.is_some());
    // Times are those of one frame.
    assert!(side.timings.whole().unwrap().0 < 20.0 * 40.0);
    screen.frames();
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("refined.scene.toml");
    screen.window().save_scene(&scene);
    assert_eq!(n_pixels_unlike_rendered(&mut screen, &scene, plugins()), 0);
    let said = screen.harness.get_all_by_label_contains("refines: ").next().is_some();
    assert!(said && screen.harness.query_all_by_label_contains(", 40 frames").count() == 1);
}

#[test]
fn what_changes_begins_anew_at_once() {
    let mut screen = screen();
    refine(&mut screen, 0, 255, 20);
    screen.until("some frames", |window| progress(window, 0).is_some_and(|(_, n, _)| n > 10));
    let (before, _, _) = progress(screen.window(), 0).unwrap();
    screen.window().settings.scene.exposure_stops = 1.0;
    screen.until("the first frame", |window| progress(window, 0).unwrap().0 > before);
    assert!(progress(screen.window(), 0).unwrap().1 < 10, "it went on");
    screen.until("refinement", |window| progress(window, 0).unwrap().1 > 5);
    refine(&mut screen, 0, 7, 5);
    screen.settle();
    assert_eq!(progress(screen.window(), 0).unwrap().1, 7);
}

#[test]
fn views_get_better_in_turn_and_keep_no_other_waiting() {
    let mut screen = screen();
    screen.harness.get_all_by_label("split").next().unwrap().click();
    screen.until("another view", |window| window.settings.panes.len() == 2);
    screen.settle();
    for pane in [0, 1] {
        refine(&mut screen, pane, 255, 40);
    }
    screen.until("both", |window| {
        [0, 1].iter().all(|pane| progress(window, *pane).is_some_and(|(_, n, _)| n > 5))
    });
    let n_frames = |screen: &mut Screen| {
        [0, 1].map(|pane| progress(screen.window(), pane).map_or(0, |(_, n, _)| n))
    };
    let [a, b] = n_frames(&mut screen);
    assert!(a.abs_diff(b) < 20, "{a} and {b} frames");
    screen.window().settings.panes[1].renderers[0] = "flat".to_owned();
    screen.until("the other renderer", |window| {
        window.panes[&1].sides[0].shown.as_ref().unwrap().renderer == "flat"
    });
    assert!(progress(screen.window(), 0).unwrap().2, "it was waited for");
    // One that is not on show rests, and goes on when it is.
    let settings = screen.window().settings.pane_mut(0).unwrap();
    settings.renderers.swap(0, 1);
    settings.mode = crate::viewer::settings::Mode::SideBySide;
    screen.until("the second side", |window| {
        let shown = window.panes[&0].sides[1].shown.as_ref();
        shown.is_some_and(|shown| shown.renderer == "refines" && shown.shot.n_frames > 3)
    });
    screen.window().settings.panes[0].mode = crate::viewer::settings::Mode::Single;
    screen.settle();
    assert!(!screen.window().works());
    let hidden = |window: &Window| {
        let shown = window.panes[&0].sides[1].shown.as_ref().unwrap();
        (shown.serial, shown.shot.n_frames)
    };
    screen.frames();
    let rests = hidden(screen.window());
    std::thread::sleep(Duration::from_millis(300));
    screen.frames();
    assert_eq!(hidden(screen.window()), rests);
    screen.window().settings.panes[0].mode = crate::viewer::settings::Mode::SideBySide;
    screen.until("another beginning", |window| hidden(window).0 > rests.0);
    screen.until("more frames", |window| hidden(window).1 > rests.1);
}

/// A thread that makes pictures, without a window.
struct Room {
    darkroom: Darkroom,
    order: Order,
}

impl Room {
    fn open(screen: &mut Screen) -> Self {
        let darkroom = Darkroom::open(DeviceArguments::default(), plugins(), || ()).unwrap();
        let order = Order { values: values(20, 20), ..order_of(screen.window(), "refines") };
        Self { darkroom, order }
    }

    /// Frames of the pictures that come within a time, or until there are so many.
    fn shots(&self, most: usize, patience: Duration) -> Vec<u32> {
        let (started, mut shots) = (Instant::now(), Vec::new());
        while started.elapsed() < patience && shots.len() < most {
            for news in self.darkroom.news() {
                if let News::Print(print) = news {
                    let shot = print.outcome.unwrap();
                    assert_eq!(index(&shot), shot.n_frames - 1);
                    shots.push(shot.n_frames);
                }
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        shots
    }
}

#[test]
fn nothing_is_refined_where_nobody_looks_or_something_moves() {
    let mut screen = screen();
    let room = Room::open(&mut screen);
    let (place, later) = (Place { pane: 0, side: 0 }, Duration::from_millis(700));
    room.darkroom.order(place, Order { moves: true, ..room.order.clone() });
    assert_eq!(room.shots(1, PATIENCE), [1]);
    assert!(room.shots(1, later).is_empty(), "a picture in motion was refined");
    room.darkroom.order(place, Order { values: values(255, 20), ..room.order.clone() });
    assert_eq!(room.shots(2, PATIENCE).len(), 2);
    room.darkroom.let_go(place);
    assert!(room.shots(9, later).len() <= 2, "it was drawn on");
    assert!(room.shots(1, later).is_empty(), "it was drawn on");
    // What is measured or written is waited for.
    room.darkroom.order(place, Order { is_measured: true, ..room.order.clone() });
    assert_eq!(room.shots(1, PATIENCE), [20]);
    room.darkroom.order(export::PLACE, room.order.clone());
    assert_eq!(room.shots(1, PATIENCE), [20]);
    assert!(room.shots(1, later).is_empty());
}
