//! Handles over the pictures, by which point and spot lights are dragged.

use super::picking;
use crate::document::has_direction;
use crate::panels::Selection;
use crate::window::Window;
use eframe::egui::{
    self, Color32, CursorIcon, Id, Painter, Pos2, Rect, Response, Sense, Stroke, Ui, Vec2,
};
use glam::{DVec2, DVec3, Vec3};
use surfelshop_api::params::linear_to_srgb;
use surfelshop_api::{Camera, Light, View};
use surfelshop_session::options::camera;

/// Radius of a light's handle, points of the screen.
const RADIUS: f32 = 6.0;

/// Radius of a spot target's handle.
const TARGET_RADIUS: f32 = 4.0;

/// Added to the radius of a handle under the pointer, and to the radius that the pointer hits.
const HOVER_MARGIN: f32 = 2.0;

/// The pointer's interaction with the handles.
#[derive(Default)]
pub(crate) struct HandleInteraction {
    /// Whether one is dragged.
    pub(crate) dragged: bool,
    /// The pointer's position over a handle.
    pub(crate) hovered: Option<Pos2>,
}

impl HandleInteraction {
    /// That with these handles or with others.
    pub(crate) fn or(self, other: Self) -> Self {
        let hovered = other.hovered.or(self.hovered);
        Self { dragged: self.dragged || other.dragged, hovered }
    }
}

/// The part of a light that a handle moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Part {
    Itself,
    /// The target of a spot.
    Target,
}

/// A handle of a light.
struct Handle {
    /// The light's index in the scene.
    light: usize,
    part: Part,
    id: Id,
}

impl Handle {
    /// The name for screen readers.
    fn name(&self, light: &Light) -> String {
        let number = self.light + 1;
        match (self.part, light) {
            (Part::Target, _) => format!("light {number}: where the spot is turned to"),
            (Part::Itself, Light::Spot { .. }) => format!("light {number}: spot"),
            (Part::Itself, _) => format!("light {number}: point"),
        }
    }

    fn radius(&self) -> f32 {
        if self.part == Part::Target { TARGET_RADIUS } else { RADIUS }
    }
}

/// The position of a part of a light, if it has one.
fn position_of(light: &mut Light, part: Part) -> Option<&mut DVec3> {
    match (part, light) {
        (Part::Itself, Light::Point { position, .. } | Light::Spot { position, .. }) => {
            Some(position)
        }
        (Part::Target, Light::Spot { target, .. }) => Some(target),
        _ => None,
    }
}

/// Shows the handles over a pane's pictures while the pointer is there, and moves their lights.
pub(crate) fn show(
    window: &mut Window,
    ui: &Ui,
    pane: u32,
    rects: &[Rect],
    is_over: bool,
) -> HandleInteraction {
    let mut interaction = HandleInteraction::default();
    let camera = window.camera_of(pane);
    let size_px = window.views.panes.get(&pane).map_or([0; 2], |pane| pane.size_px);
    let is_selected = matches!(window.selection(), Selection::Light(_));
    let Some(shown) = &window.document.clouds else { return interaction };
    if !window.settings.shows_light_handles || size_px.contains(&0) {
        return interaction;
    }
    let view = camera::framed_view(camera, &shown.extent, size_px);
    // A drag may lead out of the pane.
    let dragged = ui.scope_id().with("light handle dragged");
    let is_over = is_over || ui.ctx().data(|data| data.get_temp(dragged)).unwrap_or(false);
    // Somebody who sets a light in its panel wants to see where it is.
    let is_over = is_over || is_selected;
    for (side, &rect) in rects.iter().enumerate() {
        let picture = Picture { view, rect, painter: ui.painter_at(rect), is_over };
        for (i, light) in window.settings.scene.lights.iter_mut().enumerate() {
            picture.line(light);
            // The light's own handle lies over the one of its target.
            for part in [Part::Target, Part::Itself] {
                let id = ui.scope_id().with(("light handle", side, i, part));
                picture.handle(ui, &Handle { light: i, part, id }, light, &mut interaction);
            }
        }
    }
    ui.ctx().data_mut(|data| data.insert_temp(dragged, interaction.dragged));
    interaction
}

/// One of a pane's pictures.
pub(super) struct Picture {
    pub(super) view: View,
    pub(super) rect: Rect,
    pub(super) painter: Painter,
    /// Whether the pointer is over the pane.
    pub(super) is_over: bool,
}

impl Picture {
    fn camera(&self) -> &Camera {
        &self.view.camera
    }

    /// The point of the screen at a position in the picture.
    pub(super) fn on_screen(&self, position: DVec2) -> Pos2 {
        self.rect.center() + Vec2::from(position.as_vec2().to_array()) * self.rect.height()
    }

    /// The position in the picture of a point of the screen.
    pub(super) fn position(&self, at: Pos2) -> DVec2 {
        let offset = at - self.rect.center();
        DVec2::new(f64::from(offset.x), f64::from(offset.y)) / self.height()
    }

    fn height(&self) -> f64 {
        f64::from(self.rect.height().max(1.0))
    }

    /// The line from a spot to its target.
    fn line(&self, light: &Light) {
        let Light::Spot { position, target, .. } = *light else { return };
        if !self.is_over {
            return;
        }
        if let Some(ends) = picking::project_line(self.camera(), [position, target]) {
            let ends = ends.map(|end| self.on_screen(end));
            for (width, color) in [(3.0, Color32::from_black_alpha(110)), (1.0, Color32::WHITE)] {
                self.painter.line_segment(ends, Stroke::new(width, color));
            }
        }
    }

    /// Shows a handle and moves its light.
    fn handle(
        &self,
        ui: &Ui,
        handle: &Handle,
        light: &mut Light,
        interaction: &mut HandleInteraction,
    ) {
        let is_dragged = ui.ctx().is_being_dragged(handle.id);
        let Some(point) = position_of(light, handle.part).copied() else { return };
        let Some(projected) = picking::project(self.camera(), point) else { return };
        let is_shown = self.is_over && picking::is_in_view(&self.view, projected.position);
        if !is_shown && !is_dragged {
            return;
        }
        let at = self.on_screen(projected.position);
        let around =
            Rect::from_center_size(at, Vec2::splat(2.0 * (handle.radius() + HOVER_MARGIN)));
        let response = ui.interact(around, handle.id, Sense::CLICK | Sense::DRAG);
        let name = handle.name(light);
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::GraphicsSymbol, true, &name));
        if response.dragged() {
            self.drag(ui, handle, light, &response, at);
            interaction.dragged = true;
            ui.ctx().set_cursor_icon(CursorIcon::Grabbing);
        } else if response.hovered() {
            interaction.hovered = response.hover_pos();
            ui.ctx().set_cursor_icon(CursorIcon::Grab);
        }
        // At the new position: a handle that follows a frame later looks as if it lagged.
        let point = position_of(light, handle.part).copied().unwrap_or(point);
        if let Some(projected) = picking::project(self.camera(), point) {
            let touches = response.hovered() || response.dragged();
            let radius = handle.radius() + if touches { HOVER_MARGIN } else { 0.0 };
            disc(&self.painter, self.on_screen(projected.position), radius, color_of(light));
        }
        response
            .on_hover_text(format!("{name}; drag to move, with Shift or Alt nearer or farther"));
    }

    /// Moves a light with the pointer: across the picture, or along the line of sight.
    fn drag(&self, ui: &Ui, handle: &Handle, light: &mut Light, response: &Response, at: Pos2) {
        let modifiers = ui.ctx().input(|input| input.modifiers);
        let is_first = response.drag_started();
        let delta = response.drag_delta();
        let along = modifiers.shift || modifiers.alt;
        if along && !is_first {
            // It is held anew where it is after the drag along the line of sight.
            forget_grab(ui, response);
        }
        let Some(to) = grabbed(ui, response, at) else { return };
        if delta == Vec2::ZERO && !is_first {
            return;
        }
        let before = *light;
        let Some(point) = position_of(light, handle.part) else { return };
        let moved = match along {
            true => picking::drag_along(self.camera(), *point, -f64::from(delta.y) / self.height()),
            false => picking::drag_across(self.camera(), *point, self.position(to)),
        };
        *point = moved.unwrap_or(*point);
        if !has_direction(light) {
            *light = before;
        }
        ui.ctx().request_repaint();
    }
}

/// A light's colour at full brightness.
fn color_of(light: &Light) -> Color32 {
    let (Light::Point { intensity: color, .. }
    | Light::Spot { intensity: color, .. }
    | Light::Directional { radiance: color, .. }) = *light;
    let most = color.max_element();
    let color = if most > 0.0 { color / most } else { Vec3::ZERO };
    let [r, g, b] = color.to_array().map(|channel| (linear_to_srgb(channel) * 255.0) as u8);
    Color32::from_rgb(r, g, b)
}

/// Where a handle `at` a place is dragged to: the pointer holds it where it took it.
pub(super) fn grabbed(ui: &Ui, response: &Response, at: Pos2) -> Option<Pos2> {
    let pointer = response.interact_pointer_pos()?;
    let origin = ui.ctx().input(|input| input.pointer.press_origin());
    let held = response.id.with("held");
    let grab = match response.drag_started() {
        true => origin.unwrap_or(pointer) - at,
        false => ui.ctx().data(|data| data.get_temp(held)).unwrap_or(pointer - at),
    };
    ui.ctx().data_mut(|data| data.insert_temp::<Vec2>(held, grab));
    Some(pointer - grab)
}

/// Has a handle held where the pointer is now.
fn forget_grab(ui: &Ui, response: &Response) {
    ui.ctx().data_mut(|data| data.remove::<Vec2>(response.id.with("held")));
}

/// A disc that is visible on any background.
pub(super) fn disc(painter: &Painter, at: Pos2, radius: f32, color: Color32) {
    painter.circle_filled(at, radius + 2.0, Color32::WHITE);
    painter.circle_filled(at, radius + 1.0, Color32::BLACK);
    painter.circle_filled(at, radius - 1.0, color);
}
