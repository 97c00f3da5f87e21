//! Renderers that refine their picture: each frame is shown, and none delays other pictures.

use super::plugins::faulty;
use super::scenes::n_pixels_unlike_rendered;
use super::{SAMPLE, Screen, TIMEOUT, built_plugins, request_of};
use crate::ViewerArguments;
use crate::render_thread::EXPORT_SLOT;
use crate::render_thread::{RenderEvent, RenderThread, RenderedView, ViewRequest, ViewSlot};
use crate::window::Window;
use egui_kittest::kittest::Queryable as _;
use std::time::{Duration, Instant};
use surfelshop_api::params::{Value, Values};
use surfelshop_session::options::DeviceArguments;
use surfelshop_session::options::PluginFiles;
use surfelshop_session::options::UpAxis;

fn plugins() -> PluginFiles {
    let mut plugin = built_plugins().plugin;
    plugin.push(faulty());
    PluginFiles { plugin, trust: true, ..PluginFiles::default() }
}

fn screen() -> Screen {
    let mut screen = Screen::with(&ViewerArguments {
        memory: None,
        in_place: false,
        colors: Default::default(),
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

/// Shows the renderer in a view.
fn refine(screen: &mut Screen, pane: u32, frames: i64, pause: i64) {
    let settings = screen.window().settings.pane_mut(pane).unwrap();
    settings.renderers[0] = "refines".to_owned();
    settings.values.insert("refines".to_owned(), values(frames, pause));
}

/// The renderer's picture in a view: request number, frames so far, and whether more follow.
fn progress(window: &Window, pane: u32) -> Option<(u64, u32, bool)> {
    let shown = window.views.panes[&pane].sides[0].shown.as_ref()?;
    let rendered = (shown.renderer == "refines").then_some(&shown.rendered)?;
    assert_eq!(index(rendered), rendered.n_frames - 1, "the picture is of another frame");
    // Only the last frame is explained.
    assert!(!rendered.refines || rendered.explained.is_none());
    Some((shown.serial, rendered.n_frames, rendered.refines))
}

/// The index of the frame that a picture shows.
fn index(rendered: &RenderedView) -> u32 {
    let covered = rendered.color.data.chunks_exact(4).filter(|pixel| pixel[3] > 0.5);
    let brightest = covered.map(|pixel| pixel[0] / pixel[3]).fold(-1.0, f32::max);
    assert!(brightest >= 0.0, "nothing is shown");
    (brightest * 256.0).round() as u32
}

/// Invariant: a renderer that refines its picture is shown frame by frame up to what `render`
/// makes, and keeps nothing else waiting
#[test]
fn frames_are_shown_as_they_come_until_the_last_one() {
    let mut screen = screen();
    refine(&mut screen, 0, 40, 20);
    let mut n_frames_shown = Vec::new();
    screen.until("the last frame", |window| {
        let Some((_, n_frames, refines)) = progress(window, 0) else { return false };
        if n_frames_shown.last() != Some(&n_frames) {
            n_frames_shown.push(n_frames);
        }
        assert!(refines == window.works(), "the status line says so");
        !refines
    });
    assert!(n_frames_shown.is_sorted() && n_frames_shown.len() > 3, "{n_frames_shown:?}");
    assert_eq!(n_frames_shown[n_frames_shown.len() - 1], 40, "{n_frames_shown:?}");
    let side = &screen.window().views.panes[&0].sides[0];
    assert!(side.is_converged() && side.shown.as_ref().unwrap().rendered.explained.is_some());
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
        window.views.panes[&1].sides[0].shown.as_ref().unwrap().renderer == "flat"
    });
    assert!(progress(screen.window(), 0).unwrap().2, "it was waited for");
    // A hidden picture is not refined until it is visible again.
    let settings = screen.window().settings.pane_mut(0).unwrap();
    settings.renderers.swap(0, 1);
    settings.mode = crate::document::Mode::SideBySide;
    screen.until("the second side", |window| {
        let shown = window.views.panes[&0].sides[1].shown.as_ref();
        shown.is_some_and(|shown| shown.renderer == "refines" && shown.rendered.n_frames > 3)
    });
    screen.window().settings.panes[0].mode = crate::document::Mode::Single;
    screen.settle();
    assert!(!screen.window().works());
    let hidden = |window: &Window| {
        let shown = window.views.panes[&0].sides[1].shown.as_ref().unwrap();
        (shown.serial, shown.rendered.n_frames)
    };
    screen.frames();
    let rests = hidden(screen.window());
    std::thread::sleep(Duration::from_millis(300));
    screen.frames();
    assert_eq!(hidden(screen.window()), rests);
    screen.window().settings.panes[0].mode = crate::document::Mode::SideBySide;
    screen.until("another beginning", |window| hidden(window).0 > rests.0);
    screen.until("more frames", |window| hidden(window).1 > rests.1);
}

/// A render thread without a window.
struct TestThread {
    render_thread: RenderThread,
    request: ViewRequest,
}

impl TestThread {
    fn open(screen: &mut Screen) -> Self {
        let render_thread =
            RenderThread::start(DeviceArguments::default(), plugins(), || ()).unwrap();
        let request =
            ViewRequest { values: values(20, 20), ..request_of(screen.window(), "refines") };
        Self { render_thread, request }
    }

    /// The frame numbers of the replies within a time, at most so many.
    fn replies(&self, most: usize, timeout: Duration) -> Vec<u32> {
        let (started, mut n_frames) = (Instant::now(), Vec::new());
        while started.elapsed() < timeout && n_frames.len() < most {
            for event in self.render_thread.events() {
                if let RenderEvent::Reply(reply) = event {
                    let rendered = reply.outcome.unwrap();
                    assert_eq!(index(&rendered), rendered.n_frames - 1);
                    n_frames.push(rendered.n_frames);
                }
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        n_frames
    }
}

#[test]
fn nothing_is_refined_where_nobody_looks_or_something_moves() {
    let mut screen = screen();
    let thread = TestThread::open(&mut screen);
    let (place, later) = (ViewSlot { pane: 0, side: 0 }, Duration::from_millis(700));
    thread.render_thread.request(place, ViewRequest { in_motion: true, ..thread.request.clone() });
    assert_eq!(thread.replies(1, TIMEOUT), [1]);
    assert!(thread.replies(1, later).is_empty(), "a picture in motion was refined");
    thread
        .render_thread
        .request(place, ViewRequest { values: values(255, 20), ..thread.request.clone() });
    assert_eq!(thread.replies(2, TIMEOUT).len(), 2);
    thread.render_thread.release(place);
    assert!(thread.replies(9, later).len() <= 2, "it was drawn on");
    assert!(thread.replies(1, later).is_empty(), "it was drawn on");
    // Measured and exported pictures are drawn until they are final.
    thread
        .render_thread
        .request(place, ViewRequest { for_measurement: true, ..thread.request.clone() });
    assert_eq!(thread.replies(1, TIMEOUT), [20]);
    thread.render_thread.request(EXPORT_SLOT, thread.request.clone());
    assert_eq!(thread.replies(1, TIMEOUT), [20]);
    assert!(thread.replies(1, later).is_empty());
}

/// Invariant: a whole picture that is begun is left once its view moves, and for nothing else
#[test]
fn a_whole_picture_is_left_once_its_view_moves() {
    use std::sync::atomic::Ordering;
    let mut screen = screen();
    let request = request_of(screen.window(), "refines");
    let queue = crate::render_thread::CommandQueue::default();
    let (here, there) = (ViewSlot { pane: 0, side: 0 }, ViewSlot { pane: 0, side: 1 });
    let moved = ViewRequest { in_motion: true, ..request.clone() };
    let stop = queue.draws_whole(Some(here));
    queue.request(here, request.clone());
    queue.request(there, moved.clone());
    assert!(!stop.load(Ordering::Relaxed), "another view moves, and this one does not");
    queue.request(here, moved.clone());
    assert!(stop.load(Ordering::Relaxed));
    // It has moved before it began.
    assert!(queue.draws_whole(Some(here)).load(Ordering::Relaxed));
    // What is in motion itself is drawn to its end.
    let none = queue.draws_whole(None);
    queue.request(here, moved);
    assert!(!none.load(Ordering::Relaxed));
}
