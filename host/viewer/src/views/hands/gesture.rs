//! The pointer over a picture.

use super::cursor;
use super::place::{Picture, rounded};
use super::state::{Gesture, HandMode};
use crate::window::Window;
use eframe::egui::{
    CursorIcon, Event, Modifiers, Painter, PointerButton, Pos2, Rect, Response, Ui,
};
use surfelshop_api::StrokeSample;
use surfelshop_cloud::selection::Combine;
use surfelshop_image::Image;

/// Points that a line of a lasso is made of are at least so far apart, points.
const LEAST_STEP: f32 = 2.0;

/// Samples of a stroke are at least so far apart, in radii.
const LEAST_SAMPLE: f64 = 0.1;

/// Radii between places that are looked up on the way of a fast hand, and how many at most.
const STEP: f32 = 0.5;
const MOST_STEPS: f32 = 256.0;

/// What keys that are held make of a selection.
fn how(modifiers: Modifiers) -> Combine {
    match (modifiers.shift, modifiers.command) {
        (true, true) => Combine::Intersect,
        (true, false) => Combine::Add,
        (false, true) => Combine::Subtract,
        (false, false) => Combine::Replace,
    }
}

/// Follows the pointer over the pictures of a pane where a hand does something; returns whether a drag with the first
/// button is taken from the camera.
pub(in crate::views) fn over_picture(
    window: &mut Window,
    ui: &Ui,
    response: &Response,
    painter: &Painter,
    pane: u32,
    rects: &[Rect],
) -> bool {
    window.advance_stroke(ui.ctx());
    let moves_camera = matches!(
        window.views.hands.mode,
        HandMode::Camera | HandMode::Measure(_) | HandMode::Pairs | HandMode::Box | HandMode::Plane
    );
    if moves_camera || window.document.complete_clouds().is_none() {
        return false;
    }
    let pointer = response.interact_pointer_pos().or(response.hover_pos());
    let is_over = response.contains_pointer() || response.is_pointer_button_down_on();
    // As they came: between two frames of the window there may be a whole stroke.
    let events = ui.ctx().input(|input| input.events.clone());
    for event in &events {
        let own = window.views.hands.gesture.as_ref().is_some_and(|own| own.pane == pane);
        match event {
            Event::PointerButton { pos, button: PointerButton::Primary, pressed, .. } => {
                match pressed {
                    true if is_over => begin(window, ui, pane, rects, *pos),
                    false if own => {
                        follow(window, ui, *pos);
                        if let Some(gesture) = window.views.hands.gesture.take() {
                            window.end_gesture(ui.ctx(), gesture);
                        }
                    }
                    _ => {}
                }
            }
            Event::PointerMoved(at) if own => follow(window, ui, *at),
            _ => {}
        }
    }
    if window.views.hands.gesture.is_some() && !events.is_empty() {
        window.preview_gesture(ui.ctx());
    }
    if response.contains_pointer() || window.views.hands.gesture.is_some() {
        ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
        cursor::show(window, painter, pane, rects, pointer);
    }
    true
}

/// The picture under a place, where it has depths.
pub(super) fn picture_at(window: &Window, pane: u32, rects: &[Rect], at: Pos2) -> Option<Picture> {
    let side = rects.iter().position(|rect| rect.contains(at))?;
    let shown = window.views.panes.get(&pane)?.sides.get(side)?.shown.as_ref()?;
    let depth = distances(shown.rendered.depth.as_ref()?);
    Some(Picture { rect: rects[side], view: shown.rendered.view, depth })
}

/// The first component of each pixel: some pictures of distances come with more.
fn distances(depth: &Image) -> Image {
    let n = (depth.components as usize).max(1);
    let data = depth.data.chunks_exact(n).map(|pixel| pixel[0]).collect();
    Image { components: 1, data, ..*depth }
}

fn begin(window: &mut Window, ui: &Ui, pane: u32, rects: &[Rect], at: Pos2) {
    // A stroke that is not over yet is waited for.
    if window.views.hands.stroke.is_some() {
        return;
    }
    let Some(picture) = picture_at(window, pane, rects, at) else { return };
    let before = window.visible_selections();
    let (began, modifiers) = ui.ctx().input(|input| (input.time, input.modifiers));
    let how = how(modifiers);
    let share = f64::from(window.views.hands.radius);
    let hit = picture.hit(at);
    if let (HandMode::Tool(tool), true) = (window.views.hands.mode.clone(), modifiers.command) {
        match hit {
            Some((place, _)) => window.take_color(&tool, place),
            None => window.messages.report("no surfel is there"),
        }
        return;
    }
    let radius = hit.map(|(place, _)| picture.length_at(place, share));
    if window.views.hands.mode.has_radius() && radius.is_none() {
        // Beside the cloud nothing is painted, and a click there selects nothing.
        if window.views.hands.mode.selects() && how == Combine::Replace {
            window.select_no_surfels();
        }
        return;
    }
    let (line, samples, radius) = (Vec::new(), Vec::new(), radius.unwrap_or(1.0));
    let gesture = Gesture { pane, line, picture, samples, radius, began, how, before };
    window.views.hands.gesture = Some(gesture);
    follow(window, ui, at);
}

/// Takes in where the pointer is now, and with a radius places on its way: a fast hand sends few, between which a line
/// would pass below what is curved.
fn follow(window: &mut Window, ui: &Ui, at: Pos2) {
    let hands = &window.views.hands;
    let Some(gesture) = &hands.gesture else { return };
    let step = (STEP * hands.radius * gesture.picture.rect.height()).max(LEAST_STEP);
    let last = gesture.line.last().copied().filter(|_| hands.mode.has_radius());
    let n_steps = last.map_or(1.0, |last| (last.distance(at) / step).ceil().clamp(1.0, MOST_STEPS));
    for i in 1..=n_steps as u32 {
        let share = i as f32 / n_steps;
        take_in(window, ui, last.map_or(at, |last| last.lerp(at, share)));
    }
}

/// Takes a place of the gesture in.
fn take_in(window: &mut Window, ui: &Ui, at: Pos2) {
    let (time, force) = ui.ctx().input(|input| {
        let force = input.events.iter().rev().find_map(|event| match event {
            Event::Touch { force, .. } => *force,
            _ => None,
        });
        (input.time, force)
    });
    let mode = window.views.hands.mode.clone();
    let Some(gesture) = &mut window.views.hands.gesture else { return };
    let is_far = |last: &Pos2| last.distance(at) >= LEAST_STEP;
    if !gesture.line.last().is_none_or(is_far) {
        return;
    }
    match (&mode, gesture.line.len()) {
        // A rectangle has two corners.
        (HandMode::Rectangle, 2) => gesture.line[1] = at,
        _ => gesture.line.push(at),
    }
    if mode.has_radius() {
        let Some((place, normal)) = gesture.picture.hit(at) else { return };
        let place = rounded(place, gesture.radius);
        let least = LEAST_SAMPLE * gesture.radius;
        if gesture.samples.last().is_some_and(|last| last.place.distance(place) < least) {
            return;
        }
        let shorter = |value: f32| (value * 1e4).round() / 1e4;
        gesture.samples.push(StrokeSample {
            place,
            normal: normal.map(shorter),
            time: ((time - gesture.began) * 1e3).round() / 1e3,
            pressure: shorter(force.unwrap_or(1.0).clamp(0.0, 1.0)),
        });
    }
}
