//! Where the camera is: axes, ground grid and scale bar over pictures, standard views, and moves between them.
//!
//! Everything here is drawn by the toolkit over the pictures: saved and measured pictures do not have it.

mod flight;
mod gizmo;
mod grid;
mod moves;
mod scale_bar;
mod standard_views;
mod up_axis;

pub(crate) use flight::Flight;
pub(crate) use standard_views::StandardView;

use crate::views::picking;
use crate::window::Window;
use eframe::egui::{Pos2, Rect, Ui, Vec2};
use glam::{DVec2, DVec3};
use surfelshop_api::Camera;

/// What the pointer does with the axes.
#[derive(Default)]
pub(crate) struct AxesInteraction {
    pub(crate) dragged: bool,
    /// The pointer's position over them.
    pub(crate) hovered: Option<Pos2>,
}

/// Shows grid and scale bar over the pictures of a pane; the sides are those that each picture shows.
///
/// The bar stands `raised` above the lower edge, where a caption is.
pub(crate) fn show_under(
    window: &Window,
    ui: &Ui,
    pane: u32,
    pictures: &[(usize, Rect)],
    raised: f32,
) {
    let Some(shown) = &window.document.clouds else { return };
    for &(side, rect) in pictures {
        let side = window.views.panes.get(&pane).map(|pane| &pane.sides[side]);
        let Some(picture) = side.and_then(|side| side.shown.as_ref()) else { continue };
        let painter = ui.painter_at(rect);
        // The camera of the picture: what is drawn over it moves when it does.
        let camera = picture.rendered.view.camera;
        if window.preferences.grid && !window.views.walking {
            let facts = &shown.open_clouds.clouds.facts;
            let ground = grid::Ground {
                bounds: [facts.bounds_min, facts.bounds_max],
                up: window.document.up,
                background: window.settings.background,
            };
            grid::show(&painter, rect, &camera, &picture.rendered, &ground);
        }
        if window.preferences.scale_bar {
            let unit = window.metres_per_unit();
            scale_bar::show(ui, &painter, (rect, raised), &camera, unit);
        }
    }
}

/// Shows the axes over the last picture of a pane, and moves the camera by them.
pub(crate) fn show_axes(
    window: &mut Window,
    ui: &Ui,
    pane: u32,
    rects: &[Rect],
) -> AxesInteraction {
    match rects.last() {
        Some(rect) if window.preferences.axes && window.document.clouds.is_some() => {
            gizmo::show(window, ui, pane, *rect)
        }
        _ => AxesInteraction::default(),
    }
}

/// Where a point of the scene is on the screen, and its distance along the viewing axis.
fn on_screen(camera: &Camera, rect: Rect, place: DVec3) -> Option<(Pos2, f64)> {
    let found = picking::project(camera, place)?;
    Some((at(rect, found.position), found.depth))
}

fn at(rect: Rect, position: DVec2) -> Pos2 {
    rect.center() + Vec2::from(position.as_vec2().to_array()) * rect.height()
}

/// The largest of 1, 2 and 5 times a power of ten that is at most this.
fn nice(most: f64) -> f64 {
    let power = 10f64.powf(most.log10().floor());
    let share = most / power;
    power
        * if share >= 5.0 {
            5.0
        } else if share >= 2.0 {
            2.0
        } else {
            1.0
        }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nice_lengths_are_at_most_what_is_asked_for() {
        for (most, expected) in [(1.0, 1.0), (4.9, 2.0), (73.0, 50.0), (0.3, 0.2), (1.5e-7, 1e-7)] {
            assert!((nice(most) / expected - 1.0).abs() < 1e-9, "{most}: {}", nice(most));
        }
    }
}
