//! The panes: their tool rows, the mouse over their pictures, and the line of a wipe.

use super::layout;
use super::legend;
use super::light_handles;
use super::navigation;
use super::paint;
use super::surfel;
use crate::document::{Mode, PaneSettings};
use crate::orientation;
use crate::theme::{Icon, icon_text, tokens};
use crate::window::Window;
use eframe::egui::{
    self, CursorIcon, Key, PointerButton, Pos2, Rect, Sense, Stroke, Ui, Vec2, WidgetText, pos2,
    vec2,
};
use egui_tiles::{Behavior, TileId, UiResponse};
use glam::{DVec2, DVec3};

/// Height of the row above a picture.
const TOOL_ROW: f32 = 28.0;

/// Least width of a box of choices.
const LEAST_BOX: f32 = 56.0;

/// Shows all panes.
pub(crate) fn show(window: &mut Window, ui: &mut Ui) {
    // The tree is out of the window while its panes use the window.
    let mut tree = layout::take_tree(window);
    let mut panes = Panes { window, action: None };
    tree.ui(&mut panes, ui);
    let action = panes.action.take();
    match action {
        Some(PaneAction::Split(pane)) => layout::split(window, &mut tree, pane),
        Some(PaneAction::Close(pane)) => layout::close(window, &mut tree, pane),
        None => {}
    }
    window.views.tree = tree;
}

/// What the tool row of a pane asks for.
enum PaneAction {
    Split(u32),
    Close(u32),
}

/// The panes of one frame.
struct Panes<'a> {
    window: &'a mut Window,
    action: Option<PaneAction>,
}

impl Behavior<u32> for Panes<'_> {
    fn tab_title_for_pane(&mut self, pane: &u32) -> WidgetText {
        format!("view {}", pane + 1).into()
    }

    fn pane_ui(&mut self, ui: &mut Ui, _tile: TileId, pane: &mut u32) -> UiResponse {
        let id = *pane;
        // A tool row that is too long must not widen the picture.
        let whole = ui.max_rect();
        ui.push_id(("pane", id), |ui| {
            let dragged = self.tools(ui, id);
            let below = Rect::from_min_max(pos2(whole.left(), ui.cursor().top()), whole.max);
            self.pictures(ui, id, below);
            dragged
        })
        .inner
    }

    fn simplification_options(&self) -> egui_tiles::SimplificationOptions {
        egui_tiles::SimplificationOptions { all_panes_must_have_tabs: false, ..Default::default() }
    }
}

impl Panes<'_> {
    /// The tool row above the picture; returns whether the pane is dragged by its handle.
    fn tools(&mut self, ui: &mut Ui, id: u32) -> UiResponse {
        let renderers = self.window.drawers();
        let several = self.window.settings.panes.len() > 1;
        let mut response = UiResponse::None;
        let Some(settings) = self.window.settings.pane_mut(id) else { return response };
        let action = &mut self.action;
        let row = Rect::from_min_size(ui.max_rect().min, vec2(ui.max_rect().width(), TOOL_ROW));
        ui.painter().rect_filled(row, 0.0, tokens(ui).panel);
        ui.spacing_mut().item_spacing.y = 0.0;
        ui.horizontal(|ui| {
            // Of one height in all views, so that their pictures are.
            ui.set_min_height(TOOL_ROW);
            ui.spacing_mut().item_spacing.x = 4.0;
            ui.add_space(4.0);
            if several {
                let grip =
                    egui::Button::new(icon_text(Icon::Grip)).frame(false).sense(Sense::drag());
                if ui.add(grip).on_hover_text("Drag the view to another place.").drag_started() {
                    response = UiResponse::DragStarted;
                }
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                ui.add_space(4.0);
                if several && tool(ui, Icon::X, "close", "Closes this view.", false) {
                    *action = Some(PaneAction::Close(id));
                }
                let about = "A second view beside this one.";
                if tool(ui, Icon::SquareSplitHorizontal, "split", about, false) {
                    *action = Some(PaneAction::Split(id));
                }
                let about = "Moves the camera together with the other linked views.";
                if several && tool(ui, Icon::Link, "linked", about, settings.linked) {
                    settings.linked = !settings.linked;
                }
                ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                    choices(ui, &renderers, settings);
                });
            });
        });
        response
    }

    /// The pictures, below the tool row.
    fn pictures(&mut self, ui: &mut Ui, id: u32, whole: Rect) {
        let Some(settings) = self.window.settings.pane(id).cloned() else { return };
        let scale = ui.ctx().pixels_per_point();
        let response = ui.allocate_rect(whole, Sense::click_and_drag());
        let painter = ui.painter_at(whole);
        let parts = match settings.mode {
            Mode::SideBySide => {
                let middle = whole.center().x;
                vec![
                    Rect::from_min_max(whole.min, pos2(middle - 1.0, whole.max.y)),
                    Rect::from_min_max(pos2(middle + 1.0, whole.min.y), whole.max),
                ]
            }
            _ => vec![whole],
        };
        let size = parts.iter().map(Rect::size).fold(parts[0].size(), Vec2::min) * scale;
        let Some(pane) = self.window.views.panes.get_mut(&id) else { return };
        pane.size_px = [size.x.floor().max(0.0) as u32, size.y.floor().max(0.0) as u32];
        let size = vec2(pane.size_px[0] as f32, pane.size_px[1] as f32) / scale;
        let rects: Vec<Rect> =
            parts.iter().map(|part| Rect::from_min_size(part.min, size)).collect();
        let color = tokens(ui).canvas;
        match pane.covers(&settings) {
            true => around(whole, rects[0]).map(|part| painter.rect_filled(part, 0.0, color)),
            false => [whole, Rect::NOTHING].map(|part| painter.rect_filled(part, 0.0, color)),
        };
        paint::show(ui, &painter, pane, &settings, &rects);
        if self.window.settings.shows_legend
            && settings.mode != Mode::Difference
            && let Some(legend) = self.window.legend()
            && let Some(last) = rects.last()
        {
            legend::show(&painter, *last, &legend);
        }
        let raised = if settings.mode.sides() == 2 { 24.0 } else { 0.0 };
        let pictures = self.of_one_renderer(id, &settings, &rects);
        orientation::show_under(self.window, ui, id, &pictures, raised);
        self.what_it_waits_for(ui, &painter, id);
        let handles = light_handles::show(self.window, ui, id, &rects, response.contains_pointer());
        let axes = orientation::show_axes(self.window, ui, id, &rects);
        if response.clicked() || response.dragged() || handles.dragged || axes.dragged {
            self.window.views.focused = id;
        }
        let dragged_line = self.wipe_line(ui, &response, rects[0], &settings);
        // The wheel zooms over a light handle, too.
        let over = response.hover_pos().or(handles.hovered).or(axes.hovered).and_then(|at| {
            let side = rects.iter().position(|rect| rect.contains(at))?;
            Some((side, at - rects[side].min))
        });
        if !dragged_line && !handles.dragged && !axes.dragged {
            self.mouse(ui, &response, id, size, over);
        }
        let focused = self.window.views.focused == id && self.window.settings.panes.len() > 1;
        if focused {
            let stroke = Stroke::new(1.0, ui.visuals().selection.bg_fill);
            painter.rect_stroke(whole, 0.0, stroke, egui::StrokeKind::Inside);
        }
    }

    /// The pictures that are of one renderer, with its side.
    fn of_one_renderer(
        &self,
        id: u32,
        settings: &PaneSettings,
        rects: &[Rect],
    ) -> Vec<(usize, Rect)> {
        let flicker = self.window.views.panes.get(&id).is_some_and(|pane| pane.flicker);
        match settings.mode {
            Mode::Difference => Vec::new(),
            Mode::Flicker => vec![(usize::from(flicker), rects[0])],
            Mode::Single | Mode::SideBySide | Mode::Wipe => {
                rects.iter().copied().enumerate().collect()
            }
        }
    }

    /// Says why there is no picture yet.
    fn what_it_waits_for(&self, ui: &Ui, painter: &egui::Painter, id: u32) {
        let Some(pane) = self.window.views.panes.get(&id) else { return };
        let side = &pane.sides[0];
        let has_clouds = self.window.document.clouds.is_some();
        if side.shown.is_some() || side.preparing.is_some() || side.error.is_some() || !has_clouds {
            return;
        }
        let text = match (self.window.render.no_device, self.window.render.adapter.is_empty()) {
            (true, _) => "There is no graphics device to draw with.",
            (false, true) => "Opening the graphics device …",
            (false, false) => "Drawing the first picture …",
        };
        let font = egui::TextStyle::Body.resolve(ui.style());
        let place = painter.clip_rect().center();
        painter.text(place, egui::Align2::CENTER_CENTER, text, font, tokens(ui).text);
    }

    /// The line of a wipe; returns whether it is dragged.
    fn wipe_line(
        &mut self,
        ui: &Ui,
        response: &egui::Response,
        rect: Rect,
        settings: &PaneSettings,
    ) -> bool {
        if settings.mode != Mode::Wipe {
            return false;
        }
        let x = rect.left() + settings.wipe * rect.width();
        let near = |at: Option<Pos2>| at.is_some_and(|at| (at.x - x).abs() < 8.0);
        if near(response.hover_pos()) {
            ui.ctx().set_cursor_icon(CursorIcon::ResizeHorizontal);
        }
        let grabbed = ui.scope_id().with("wipe line");
        if response.drag_started() {
            let start = ui.ctx().input(|input| input.pointer.press_origin());
            ui.ctx().data_mut(|data| data.insert_temp(grabbed, near(start)));
        }
        let dragging = response.dragged()
            && ui.ctx().data(|data| data.get_temp::<bool>(grabbed)).unwrap_or(false);
        if dragging
            && let Some(at) = response.interact_pointer_pos()
            && let Some(settings) = self.window.settings.pane_mut(settings.id)
        {
            settings.wipe = ((at.x - rect.left()) / rect.width()).clamp(0.0, 1.0);
        }
        dragging
    }

    /// Moves the camera; `over` is the side under the pointer and the position in its picture.
    fn mouse(
        &mut self,
        ui: &Ui,
        response: &egui::Response,
        id: u32,
        size: Vec2,
        over: Option<(usize, Vec2)>,
    ) {
        let mut camera = self.window.camera_of(id);
        let before = camera;
        let modifiers = ui.ctx().input(|input| input.modifiers);
        let per_height = |drag: Vec2| {
            DVec2::new(f64::from(drag.x), f64::from(drag.y)) / f64::from(size.y.max(1.0))
        };
        let drag = per_height(response.drag_delta());
        let pans = response.dragged_by(PointerButton::Middle)
            || response.dragged_by(PointerButton::Secondary)
            || (response.dragged_by(PointerButton::Primary) && modifiers.shift);
        if pans {
            navigation::pan(&mut camera, drag);
        } else if response.dragged_by(PointerButton::Primary)
            && modifiers.ctrl != self.window.views.walking
        {
            navigation::look(&mut camera, drag * 1.5);
        } else if response.dragged_by(PointerButton::Primary) {
            // A drag over the whole height is half a turn.
            navigation::orbit(&mut camera, drag * std::f64::consts::PI);
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
            && let Some(depth) = depth
        {
            let target = navigation::point_at(camera, position, depth);
            // Inside a scan one turns to it, from outside one moves over it.
            let from_target = camera.eye - camera.target;
            let eye = if self.window.views.walking { camera.eye } else { target + from_target };
            self.window.fly_to(id, surfelshop_api::Camera { eye, target, ..*camera });
        }
        fly(ui, camera);
        let found = depth.map(|depth| navigation::point_at(&before, position, depth));
        // The search visits every surfel, so only for another point.
        if self.window.views.pointer_position != found {
            self.window.views.pointer_position = found;
            self.window.views.pointer_text = match (found, &self.window.document.clouds) {
                (Some(point), Some(shown)) => match &shown.displayed_of {
                    Some(of) => surfel::describe(&shown.displayed, &of.open_clouds.clouds, point),
                    None => String::new(),
                },
                _ => String::new(),
            };
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

/// Flies with the keys while the pointer is over a picture: W A S D, E up, Q down.
fn fly(ui: &Ui, camera: &mut surfelshop_api::Camera) {
    if ui.ctx().egui_wants_keyboard_input() {
        return;
    }
    let (keys, seconds) = ui.ctx().input(|input| {
        let down = |key: Key| f64::from(u8::from(input.key_down(key)));
        let step = DVec3::new(
            down(Key::D) - down(Key::A),
            down(Key::E) - down(Key::Q),
            down(Key::W) - down(Key::S),
        );
        (if input.modifiers.any() { DVec3::ZERO } else { step }, f64::from(input.stable_dt))
    });
    if keys != DVec3::ZERO {
        navigation::fly(camera, keys * seconds.min(0.1));
    }
}

/// The choices of a tool row: renderers, and how two are shown.
fn choices(ui: &mut Ui, renderers: &[String], settings: &mut PaneSettings) {
    let n_boxes = settings.mode.sides() + 1;
    // What does not fit into a narrow view is chosen by commands.
    let n_fitting = ((ui.available_width() / (LEAST_BOX + 8.0)) as usize).min(n_boxes);
    let width = (ui.available_width() / n_fitting.max(1) as f32 - 8.0).clamp(LEAST_BOX, 150.0);
    if n_fitting > 0 {
        choose(ui, "first renderer", renderers, &mut settings.renderers[0], width);
    }
    if n_fitting < 2 {
        return;
    }
    let modes = egui::ComboBox::from_id_salt("mode").selected_text(settings.mode.name());
    let shown = modes.width(width.min(110.0)).truncate().show_ui(ui, |ui| {
        for mode in Mode::ALL {
            ui.selectable_value(&mut settings.mode, mode, mode.name());
        }
    });
    name(&shown.response, "how two renderers are shown");
    if n_fitting > 2 {
        choose(ui, "second renderer", renderers, &mut settings.renderers[1], width);
    }
}

/// A small icon of a tool row; returns whether it was clicked.
fn tool(ui: &mut Ui, icon: Icon, label: &str, about: &str, is_on: bool) -> bool {
    let response = ui.add(egui::Button::selectable(is_on, icon_text(icon)));
    response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, is_on, label));
    response.on_hover_text(about).clicked()
}

fn choose(ui: &mut Ui, what: &str, names: &[String], chosen: &mut String, width: f32) {
    let menu = egui::ComboBox::from_id_salt(what).selected_text(chosen.as_str());
    let shown = menu.width(width).truncate().show_ui(ui, |ui| {
        for name in names {
            ui.selectable_value(chosen, name.clone(), name);
        }
    });
    name(&shown.response, what);
}

/// Names a box without a label for screen readers.
fn name(response: &egui::Response, what: &str) {
    response
        .widget_info(|| egui::WidgetInfo::labeled(egui::Role::ComboBox, response.enabled(), what));
}

/// What of a rectangle lies right of and below a picture in its left upper corner.
fn around(whole: Rect, picture: Rect) -> [Rect; 2] {
    let right = Rect::from_min_max(pos2(picture.max.x, whole.min.y), whole.max);
    let below = Rect::from_min_max(pos2(whole.min.x, picture.max.y), whole.max);
    [right, below]
}
