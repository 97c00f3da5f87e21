//! The engine's memory follows the visible views.

use super::{SAMPLE, Screen};
use crate::document::Mode;
use eframe::egui::Vec2;
use std::time::{Duration, Instant};

/// Much longer than the render thread takes to free unused memory, beside other tests too: it does after a second.
const REST: Duration = Duration::from_secs(3);

/// Waits until unused memory is freed, and returns the bytes that are held.
fn held_bytes(screen: &mut Screen) -> u64 {
    screen.settle();
    let (mut before, mut since) = (u64::MAX, Instant::now());
    screen.until("a rest", |window| {
        let now = window.render.counters.kept_bytes;
        if now != before {
            (before, since) = (now, Instant::now());
        }
        since.elapsed() > REST
    });
    before
}

/// Costs 13 s, of which it waits ten.
///
/// Invariant: a window made small again holds what a small one does, and switching renderers
/// keeps no more pipelines
#[test]
fn a_window_made_small_again_holds_what_a_small_one_does() {
    let mut screen = Screen::open(&[SAMPLE]);
    let small = held_bytes(&mut screen);
    assert!(small > 0);
    screen.window().settings.panes[0].mode = Mode::Wipe;
    screen.harness.set_size(Vec2::new(2200.0, 1700.0));
    let large = held_bytes(&mut screen);
    assert!(large > 4 * small, "{large} and {small} bytes");
    screen.window().settings.panes[0].mode = Mode::Single;
    screen.harness.set_size(Vec2::new(900.0, 640.0));
    assert_eq!(held_bytes(&mut screen), small);
    let window = screen.window();
    assert!(
        window.views.panes[&0].sides[1].shown.is_none(),
        "a hidden picture of the large window"
    );
}

#[test]
fn switching_renderers_again_and_again_keeps_no_more_pipelines() {
    let mut screen = Screen::sample();
    let names = ["flat", "ewa-phong", "environment", "procedural"];
    let mut counts = Vec::new();
    for round in 0..4 {
        for name in names {
            screen.window().settings.panes[0].renderers[0] = name.to_owned();
            screen.settle();
        }
        let counters = screen.window().render.counters;
        if round > 0 {
            counts.push((counters.kept_pipelines, counters.kept_modules));
        }
    }
    assert!(counts.iter().all(|count| *count == counts[0]), "{counts:?}");
    assert!(counts[0].0 <= 128, "{counts:?}: the bound is twice that");
}
