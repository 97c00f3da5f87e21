//! The mouse over a picture, and keys that fly.

use super::Panes;
use super::surfel;
use crate::preferences::Orbit;
use crate::views::hands::HandMode;
use crate::views::{measuring, navigation, picking};
use crate::window::Window;
use eframe::egui::{self, Color32, Event, Key, Painter, PointerButton, Rect, Stroke, Ui, Vec2};
use glam::{DVec2, DVec3};

impl Panes<'_> {
    /// Moves the camera; `over` is the side under the pointer and the position in its picture. Where a hand has taken
    /// the first button, the one in the middle turns.
    pub(super) fn mouse(
        &mut self,
        ui: &Ui,
        response: &egui::Response,
        id: u32,
        size: Vec2,
        (over, is_taken): (Option<(usize, Vec2)>, bool),
    ) {
        let turning = if is_taken { PointerButton::Middle } else { PointerButton::Primary };
        let turns = response.dragged_by(turning);
        let mut camera = self.window.camera_of(id);
        let before = camera;
        let modifiers = ui.ctx().input(|input| input.modifiers);
        let per_height = |drag: Vec2| {
            DVec2::new(f64::from(drag.x), f64::from(drag.y)) / f64::from(size.y.max(1.0))
        };
        let drag = per_height(response.drag_delta());
        let pans = response.dragged_by(PointerButton::Secondary)
            || (response.dragged_by(PointerButton::Middle) && !is_taken)
            || (turns && modifiers.shift);
        if pans {
            navigation::pan(&mut camera, drag);
        } else if turns && modifiers.ctrl != self.window.views.walking {
            navigation::look(&mut camera, drag * 1.5);
        } else if turns {
            // A drag over the whole height is half a turn.
            let drag = drag * std::f64::consts::PI;
            match self.window.preferences.orbit {
                Orbit::Turntable => navigation::orbit(&mut camera, drag),
                Orbit::Trackball => navigation::tumble(&mut camera, drag),
            }
        }
        if let Some((side, at)) = over {
            self.pointer(ui, response, id, &mut camera, (side, at, size));
        }
        if camera != before {
            self.window.set_camera(id, camera);
            ui.ctx().request_repaint();
        }
    }

    /// Zooms to the pointer, flies, and describes the surfel under it. The last argument is the side under
    /// the pointer, the position in its picture and the picture's size.
    fn pointer(
        &mut self,
        ui: &Ui,
        response: &egui::Response,
        id: u32,
        camera: &mut surfelshop_api::Camera,
        (side, at, size): (usize, Vec2, Vec2),
    ) {
        let before = self.window.camera_of(id);
        let position = DVec2::new(f64::from(at.x - 0.5 * size.x), f64::from(at.y - 0.5 * size.y))
            / f64::from(size.y.max(1.0));
        let depth = self.depth_at(id, side, at / size);
        let target_depth = (camera.target - camera.eye).dot(camera.forward());
        // The wheel keeps its anchor while the picture is too coarse to have depths.
        let target_depth = match (depth, self.window.views.anchor_depth) {
            (None, Some((pane, depth))) if pane == id => depth,
            _ => target_depth,
        };
        if let Some(depth) = depth {
            self.window.views.anchor_depth = Some((id, depth));
        }
        let wheel = f64::from(ui.ctx().input(|input| input.smooth_scroll_delta().y));
        if wheel.abs() > 0.0 {
            let anchor = navigation::point_at(camera, position, depth.unwrap_or(target_depth));
            navigation::zoom(camera, (-wheel * 0.004).exp(), anchor);
            let depth = (anchor - camera.eye).dot(camera.forward());
            self.window.views.anchor_depth = Some((id, depth));
        }
        if response.double_clicked()
            && self.window.views.hands.mode == HandMode::Camera
            && let Some(depth) = depth
        {
            let target = navigation::point_at(camera, position, depth);
            // Inside a scan one turns to it, from outside one moves over it.
            let from_target = camera.eye - camera.target;
            let eye = if self.window.views.walking { camera.eye } else { target + from_target };
            self.window.fly_to(id, surfelshop_api::Camera { eye, target, ..*camera });
        }
        let shown = self.window.document.clouds.as_ref().filter(|_| self.window.views.walking);
        let metres = shown.and_then(|shown| shown.clouds.metres_per_unit());
        fly(ui, camera, metres);
        let found = depth.map(|depth| navigation::point_at(&before, position, depth));
        // The search visits every surfel: only for another point, and not while a button drags.
        let is_searched = self.window.views.pointer_position == found
            && (found.is_none() || self.window.views.pointer_cloud.is_some());
        if response.dragged() {
            let views = &mut self.window.views;
            (views.pointer_position, views.measuring.pointer) = (found, found);
            views.pointer_cloud = None;
            views.pointer_text.clear();
        } else if !is_searched {
            self.window.views.pointer_position = found;
            let (text, place, cloud) = self.window.surfel_at(&before, position, found);
            let views = &mut self.window.views;
            (views.pointer_text, views.measuring.pointer) = (text, place);
            views.pointer_cloud = cloud;
        }
    }

    /// The depth of a side's picture at a position in fractions of its size.
    fn depth_at(&self, id: u32, side: usize, at: Vec2) -> Option<f64> {
        let rendered = &self.window.views.panes.get(&id)?.sides[side].shown.as_ref()?.rendered;
        let image = rendered.depth.as_ref()?;
        let (x, y) = ((at.x * image.width as f32) as u32, (at.y * image.height as f32) as u32);
        let inside = x < image.width && y < image.height;
        let depth = inside.then(|| f64::from(image.pixel(x, y)[0]))?;
        (depth > 0.0).then_some(depth)
    }
}

impl Window {
    /// What is said of the surfel at a place that is seen at a position of a picture, its exact place, and of which of the
    /// visible clouds it is.
    fn surfel_at(
        &self,
        camera: &surfelshop_api::Camera,
        position: DVec2,
        found: Option<DVec3>,
    ) -> (String, Option<DVec3>, Option<usize>) {
        let shown = self.document.clouds.as_ref();
        let of = shown.and_then(|shown| Some((shown, shown.displayed_of.as_ref()?)));
        let Some((point, (shown, of))) = found.zip(of) else { return (String::new(), found, None) };
        let Some((file, index)) = surfel::nearest_of(&shown.displayed, camera, point) else {
            return (String::new(), Some(point), None);
        };
        let text = surfel::describe(&shown.displayed, &of.open_clouds.clouds, point, (file, index));
        let cloud = &shown.displayed.clouds.loaded[file].cloud;
        // Of a pyramid other surfels are seen than are in memory.
        let place = match shown.displayed.clouds.pyramid_of(cloud) {
            Some(_) => point,
            None => measuring::place_of(camera, position, point, (cloud, index)),
        };
        (text, Some(place), Some(file))
    }
}

/// Marks what the camera turns about, while it is dragged.
pub(super) fn pivot(window: &Window, painter: &Painter, pane: u32, rects: &[Rect]) {
    if window.views.walking {
        return;
    }
    let camera = window.camera_of(pane);
    let Some(found) = picking::project(&camera, camera.target) else { return };
    for rect in rects {
        let offset = Vec2::from(found.position.as_vec2().to_array()) * rect.height();
        let at = rect.center() + offset;
        for (width, color) in [(3.0, Color32::from_black_alpha(150)), (1.0, Color32::WHITE)] {
            let stroke = Stroke::new(width, color);
            painter.circle_stroke(at, 5.0, stroke);
            painter.hline(at.x - 9.0..=at.x + 9.0, at.y, stroke);
            painter.vline(at.x, at.y - 9.0..=at.y + 9.0, stroke);
        }
    }
}

/// Metres that one walks in a second.
const WALK: f64 = 3.0;

/// How many times as fast one is with Shift.
const RUN: f64 = 5.0;

/// The keys that are down and went down by themselves: one that was pressed as part of a shortcut moves nothing, even
/// where the other key is let go first.
fn held_keys(ui: &Ui) -> Vec<Key> {
    let id = egui::Id::unique("keys that fly");
    let mut held: Vec<Key> = ui.data(|data| data.get_temp(id)).unwrap_or_default();
    ui.ctx().input(|input| {
        for event in &input.events {
            if let Event::Key { key, pressed, repeat: false, modifiers, .. } = event {
                held.retain(|other| other != key);
                if *pressed && !(modifiers.alt || modifiers.ctrl || modifiers.command) {
                    held.push(*key);
                }
            }
        }
        held.retain(|key| input.key_down(*key));
    });
    ui.data_mut(|data| data.insert_temp(id, held.clone()));
    held
}

/// Flies with the keys while the pointer is over a picture: W A S D, E up, Q down. Who walks in a scan whose units are
/// known has the speed of a person; others go so many times the distance to what they look at in a second.
fn fly(ui: &Ui, camera: &mut surfelshop_api::Camera, metres_per_unit: Option<f64>) {
    if ui.ctx().egui_wants_keyboard_input() {
        return;
    }
    let held = held_keys(ui);
    let (keys, seconds) = ui.ctx().input(|input| {
        let down = |key: Key| f64::from(u8::from(held.contains(&key)));
        let step = DVec3::new(
            down(Key::D) - down(Key::A),
            down(Key::E) - down(Key::Q),
            down(Key::W) - down(Key::S),
        );
        let modifiers = input.modifiers;
        let speed = match (modifiers.alt || modifiers.ctrl || modifiers.command, modifiers.shift) {
            (true, _) => 0.0,
            (false, true) => RUN,
            (false, false) => 1.0,
        };
        (speed * step, f64::from(input.stable_dt))
    });
    if keys != DVec3::ZERO {
        let step = keys * seconds.min(0.1);
        match metres_per_unit {
            Some(metres) => navigation::walk(camera, step * (WALK / metres)),
            None => navigation::fly(camera, step),
        }
    }
}
