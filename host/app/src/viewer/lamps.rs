//! Lights with a place, shown over the pictures as handles that can be dragged.

use super::lights;
use super::sight;
use super::window::Window;
use crate::camera;
use eframe::egui::{
    self, Color32, CursorIcon, Id, Painter, Pos2, Rect, Response, Sense, Stroke, Ui, Vec2,
};
use glam::{DVec2, DVec3, Vec3};
use surfelshop_api::params::linear_to_srgb;
use surfelshop_api::{Camera, Light, View};

/// Radius of a lamp's disc, points of the screen.
const RADIUS: f32 = 6.0;

/// Radius of the disc where a spot is turned to.
const TARGET_RADIUS: f32 = 4.0;

/// What is added where the pointer is, and all around it for the pointer.
const MORE: f32 = 2.0;

/// What the pointer does with the handles.
#[derive(Default)]
pub(crate) struct Touched {
    /// Whether one is dragged.
    pub(crate) dragged: bool,
    /// The pointer, where it is over one.
    pub(crate) hovered: Option<Pos2>,
}

/// What of a light is dragged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Part {
    Itself,
    /// Where a spot is turned to.
    Target,
}

/// A place that can be dragged.
struct Handle {
    /// The light's number in the scene.
    light: usize,
    part: Part,
    id: Id,
}

impl Handle {
    /// What screen readers call it.
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

/// The place of a part of a light, if it has one.
fn place_of(light: &mut Light, part: Part) -> Option<&mut DVec3> {
    match (part, light) {
        (Part::Itself, Light::Point { position, .. } | Light::Spot { position, .. }) => {
            Some(position)
        }
        (Part::Target, Light::Spot { target, .. }) => Some(target),
        _ => None,
    }
}

/// Shows the handles over the pictures of a pane while the pointer is over them, and moves lights with
/// them.
pub(crate) fn show(
    window: &mut Window,
    ui: &Ui,
    pane: u32,
    rects: &[Rect],
    is_over: bool,
) -> Touched {
    let mut touched = Touched::default();
    let camera = window.camera_of(pane);
    let size_px = window.panes.get(&pane).map_or([0; 2], |pane| pane.size_px);
    let Some(shown) = &window.shown else { return touched };
    if !window.settings.shows_lamps || size_px.contains(&0) {
        return touched;
    }
    let view = camera::framed_view(camera, &shown.extent, size_px);
    // A drag may lead out of the pane.
    let dragged = ui.scope_id().with("lamp dragged");
    let is_over = is_over || ui.ctx().data(|data| data.get_temp(dragged)).unwrap_or(false);
    for (side, &rect) in rects.iter().enumerate() {
        let picture = Picture { view, rect, painter: ui.painter_at(rect), is_over };
        for (i, light) in window.settings.scene.lights.iter_mut().enumerate() {
            picture.line(light);
            // The lamp lies over its target, should both be seen at one place.
            for part in [Part::Target, Part::Itself] {
                let id = ui.scope_id().with(("lamp", side, i, part));
                picture.handle(ui, &Handle { light: i, part, id }, light, &mut touched);
            }
        }
    }
    ui.ctx().data_mut(|data| data.insert_temp(dragged, touched.dragged));
    touched
}

/// One of a pane's pictures.
struct Picture {
    view: View,
    rect: Rect,
    painter: Painter,
    /// Whether the pointer is over the pane.
    is_over: bool,
}

impl Picture {
    fn camera(&self) -> &Camera {
        &self.view.camera
    }

    /// Where on the screen a position of the picture is.
    fn on_screen(&self, position: DVec2) -> Pos2 {
        self.rect.center() + Vec2::from(position.as_vec2().to_array()) * self.rect.height()
    }

    /// The position of a point of the screen.
    fn position(&self, at: Pos2) -> DVec2 {
        let offset = at - self.rect.center();
        DVec2::new(f64::from(offset.x), f64::from(offset.y)) / self.height()
    }

    fn height(&self) -> f64 {
        f64::from(self.rect.height().max(1.0))
    }

    /// The line from a spot to where it is turned.
    fn line(&self, light: &Light) {
        let Light::Spot { position, target, .. } = *light else { return };
        if !self.is_over {
            return;
        }
        if let Some(ends) = sight::line(self.camera(), [position, target]) {
            let ends = ends.map(|end| self.on_screen(end));
            for (width, color) in [(3.0, Color32::from_black_alpha(110)), (1.0, Color32::WHITE)] {
                self.painter.line_segment(ends, Stroke::new(width, color));
            }
        }
    }

    /// Shows a handle where its place is seen, and moves that.
    fn handle(&self, ui: &Ui, handle: &Handle, light: &mut Light, touched: &mut Touched) {
        let is_dragged = ui.ctx().is_being_dragged(handle.id);
        let Some(place) = place_of(light, handle.part).copied() else { return };
        let Some(seen) = sight::seen(self.camera(), place) else { return };
        let is_shown = self.is_over && sight::is_inside(&self.view, seen.position);
        if !is_shown && !is_dragged {
            return;
        }
        let at = self.on_screen(seen.position);
        let around = Rect::from_center_size(at, Vec2::splat(2.0 * (handle.radius() + MORE)));
        let response = ui.interact(around, handle.id, Sense::CLICK | Sense::DRAG);
        let name = handle.name(light);
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::GraphicsSymbol, true, &name));
        if response.dragged() {
            self.drag(ui, handle, light, &response, at);
            touched.dragged = true;
            ui.ctx().set_cursor_icon(CursorIcon::Grabbing);
        } else if response.hovered() {
            touched.hovered = response.hover_pos();
            ui.ctx().set_cursor_icon(CursorIcon::Grab);
        }
        // Where it is now: a handle that follows a frame later looks as if it were pulled.
        let place = place_of(light, handle.part).copied().unwrap_or(place);
        if let Some(seen) = sight::seen(self.camera(), place) {
            let touches = response.hovered() || response.dragged();
            let radius = handle.radius() + if touches { MORE } else { 0.0 };
            disc(&self.painter, self.on_screen(seen.position), radius, color_of(light));
        }
        response
            .on_hover_text(format!("{name}; drag to move, with Shift or Alt nearer or farther"));
    }

    /// Moves the place that a handle stands for: across the picture as the pointer does, or along the line
    /// of sight.
    fn drag(&self, ui: &Ui, handle: &Handle, light: &mut Light, response: &Response, at: Pos2) {
        let Some(pointer) = response.interact_pointer_pos() else { return };
        let (origin, modifiers) =
            ui.ctx().input(|input| (input.pointer.press_origin(), input.modifiers));
        // From the handle to the pointer: it keeps to where it was taken.
        let is_first = response.drag_started();
        let held = handle.id.with("held");
        let grab = match ui.ctx().data(|data| data.get_temp::<Vec2>(held)) {
            Some(grab) if !is_first => grab,
            _ => origin.unwrap_or(pointer) - at,
        };
        let delta = response.drag_delta();
        let along = modifiers.shift || modifiers.alt;
        let grab = if along && !is_first { pointer - at } else { grab };
        ui.ctx().data_mut(|data| data.insert_temp(held, grab));
        if delta == Vec2::ZERO && !is_first {
            return;
        }
        let before = *light;
        let Some(place) = place_of(light, handle.part) else { return };
        let moved = match along {
            true => sight::moved_along(self.camera(), *place, -f64::from(delta.y) / self.height()),
            false => sight::moved_across(self.camera(), *place, self.position(pointer - grab)),
        };
        *place = moved.unwrap_or(*place);
        if !lights::is_aimed(light) {
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

/// A disc that is seen on any background.
fn disc(painter: &Painter, at: Pos2, radius: f32, color: Color32) {
    painter.circle_filled(at, radius + 2.0, Color32::WHITE);
    painter.circle_filled(at, radius + 1.0, Color32::BLACK);
    painter.circle_filled(at, radius - 1.0, color);
}
