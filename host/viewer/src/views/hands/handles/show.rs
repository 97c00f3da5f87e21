//! The lines of a box or a plane over the pictures, and its handles.

use super::shape::{Part, PlaneShape, Ray, Shape};
use crate::theme::AXES;
use crate::views::hands::gesture::picture_at;
use crate::views::hands::state::HandMode;
use crate::views::light_handles::{HandleInteraction, Picture, disc, grabbed};
use crate::views::navigation::point_at;
use crate::views::picking;
use crate::window::Window;
use eframe::egui::{
    self, Color32, CursorIcon, PointerButton, Rect, Response, Role, Sense, Stroke, Ui, Vec2,
};
use glam::{DVec2, DVec3};
use surfelshop_api::Camera;
use surfelshop_session::options::camera;

/// Radius of a handle, and of what the pointer hits around it, points of the screen.
const RADIUS: f32 = 5.0;
const HIT_RADIUS: f32 = 9.0;

/// The colour of handles that are of no axis.
const OTHER: Color32 = Color32::from_rgb(245, 190, 60);

/// The line of sight through a place of the picture.
fn ray(camera: &Camera, position: DVec2) -> Ray {
    let (start, next) = (point_at(camera, position, 0.0), point_at(camera, position, 1.0));
    Ray { start, direction: (next - start).normalize_or(camera.forward()) }
}

/// Shows the box or the plane over a pane's pictures, and changes it by its handles.
pub(in crate::views) fn show(
    window: &mut Window,
    ui: &Ui,
    pane: u32,
    rects: &[Rect],
) -> HandleInteraction {
    let mut interaction = HandleInteraction::default();
    let Some(shape) = window.shape() else { return interaction };
    let camera = window.camera_of(pane);
    let size_px = window.views.panes.get(&pane).map_or([0; 2], |pane| pane.size_px);
    let Some(shown) = &window.document.clouds else { return interaction };
    if size_px.contains(&0) {
        return interaction;
    }
    let view = camera::framed_view(camera, &shown.extent, size_px);
    let up = window.document.up.axis();
    let mut changed = None;
    let mut has_ended = false;
    for (side, &rect) in rects.iter().enumerate() {
        let picture = Picture { view, rect, painter: ui.painter_at(rect), is_over: true };
        let lines: Vec<_> = shape
            .edges(up)
            .into_iter()
            .filter_map(|ends| picking::project_line(&camera, ends))
            .map(|ends| ends.map(|end| picture.on_screen(end)))
            .collect();
        for (width, color) in [(3.0, Color32::from_black_alpha(110)), (1.0, Color32::WHITE)] {
            for ends in &lines {
                picture.painter.line_segment(*ends, Stroke::new(width, color));
            }
        }
        for (part, place) in shape.handles(up) {
            let Some(projected) = picking::project(&camera, place) else { continue };
            let id = ui.scope_id().with(("selecting handle", side, part));
            let is_dragged = ui.ctx().is_being_dragged(id);
            if !is_dragged && !picking::is_in_view(&view, projected.position) {
                continue;
            }
            let at = picture.on_screen(projected.position);
            let around = Rect::from_center_size(at, Vec2::splat(2.0 * HIT_RADIUS));
            let response = ui.interact(around, id, Sense::CLICK | Sense::DRAG);
            let name = part.name();
            let info = || egui::WidgetInfo::labeled(Role::GraphicsSymbol, true, &name);
            response.widget_info(info);
            if response.dragged_by(PointerButton::Primary) {
                interaction.dragged = true;
                ui.ctx().set_cursor_icon(CursorIcon::Grabbing);
                if let Some(to) = grabbed(ui, &response, at) {
                    let to = picture.position(to);
                    let across = picking::drag_across(&camera, place, to);
                    changed = shape.dragged(part, &ray(&camera, to), across, up).or(changed);
                }
            } else if response.hovered() {
                interaction.hovered = response.hover_pos();
                ui.ctx().set_cursor_icon(CursorIcon::Grab);
            }
            has_ended |= response.drag_stopped_by(PointerButton::Primary);
            let touches = response.hovered() || response.dragged();
            let color = match part {
                Part::Side(axis, _) => AXES[axis.min(2)],
                _ => OTHER,
            };
            disc(&picture.painter, at, RADIUS + if touches { 2.0 } else { 0.0 }, color);
            response.on_hover_text(format!("{name}; {}", part.about()));
        }
    }
    let is_another = changed.is_some_and(|changed| window.set_shape(changed));
    if is_another || has_ended {
        window.select_by_shape(has_ended);
        ui.ctx().request_repaint();
    }
    interaction
}

/// Puts the plane where a click meets the surface, turned as that is.
pub(in crate::views) fn click_plane(
    window: &mut Window,
    response: &Response,
    pane: u32,
    rects: &[Rect],
) {
    if window.views.hands.mode != HandMode::Plane || !response.clicked() {
        return;
    }
    let (Some(at), Some(Shape::Plane(before))) = (response.interact_pointer_pos(), window.shape())
    else {
        return;
    };
    let hit = picture_at(window, pane, rects, at).and_then(|picture| picture.hit(at));
    let Some((point, normal)) = hit else { return };
    let normal = normal.as_dvec3().normalize_or(DVec3::Y);
    window.set_shape(Shape::Plane(PlaneShape { point, normal, ..before }));
    window.select_by_shape(true);
}
