//! What the engine holds follows what is on show.

use super::{SAMPLE, Screen};
use crate::viewer::settings::Mode;
use eframe::egui::Vec2;

/// Waits until what is not needed any more is let go, and says how many bytes are kept.
fn kept_bytes(screen: &mut Screen) -> u64 {
    screen.settle();
    let (mut before, mut n_same) = (u64::MAX, 0);
    // As long as it may take the engine's thread to come to rest, and then some.
    screen.until("a rest", |window| {
        let now = window.counters.kept_bytes;
        n_same = if now == before { n_same + 1 } else { 0 };
        before = now;
        n_same > 150
    });
    before
}

#[test]
fn a_window_made_small_again_holds_what_a_small_one_does() {
    let mut screen = Screen::open(&[SAMPLE]);
    let small = kept_bytes(&mut screen);
    assert!(small > 0);
    screen.window().settings.panes[0].mode = Mode::Wipe;
    screen.harness.set_size(Vec2::new(2200.0, 1700.0));
    let large = kept_bytes(&mut screen);
    assert!(large > 4 * small, "{large} and {small} bytes");
    screen.window().settings.panes[0].mode = Mode::Single;
    screen.harness.set_size(Vec2::new(900.0, 640.0));
    assert_eq!(kept_bytes(&mut screen), small);
    let window = screen.window();
    assert!(window.panes[&0].sides[1].shown.is_none(), "a hidden picture of the large window");
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
        let counters = screen.window().counters;
        if round > 0 {
            counts.push((counters.kept_pipelines, counters.kept_modules));
        }
    }
    assert!(counts.iter().all(|count| *count == counts[0]), "{counts:?}");
    assert!(counts[0].0 <= 128, "{counts:?}: the bound is twice that");
}
