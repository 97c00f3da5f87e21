//! The panes and their pictures.
//!
//! `tools` is the row above a picture, `pointer` moves cameras, `wipe` is the line between two pictures, `dropped` takes
//! what is dragged out of the outliner, and `numbers` explains the numbers below two pictures.

mod dropped;
mod numbers;
mod pointer;
pub(crate) mod surfel;
mod tools;
mod wipe;

use super::hands::{self, HandMode};
use super::layout;
use super::legend;
use super::light_handles;
use super::measuring;
use super::paint;
use crate::document::{Mode, PaneSettings};
use crate::orientation;
use crate::panels::Selection;
use crate::theme::tokens;
use crate::window::Window;
use eframe::egui::{self, Rect, Sense, Stroke, Ui, Vec2, WidgetText, pos2, vec2};
use egui_tiles::{Behavior, TileId, UiResponse};

/// Height of the row above a picture.
const TOOL_ROW: f32 = 28.0;

/// Shows all panes.
pub(crate) fn show(window: &mut Window, ui: &mut Ui) {
    // The tree is out of the window while its panes use the window.
    let mut tree = layout::take_tree(window);
    let mut panes = Panes { window, action: None };
    tree.ui(&mut panes, ui);
    let action = panes.action.take();
    match action {
        Some(PaneAction::Split(pane)) => layout::split(window, &mut tree, pane, false),
        Some(PaneAction::Close(pane)) => layout::close(window, &mut tree, pane),
        None => {}
    }
    window.views.tree = tree;
    layout::keep_framing(window);
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
        let settings = self.window.settings.pane(*pane);
        settings.map_or_else(|| format!("view {}", pane + 1), PaneSettings::name).into()
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
        let described = paint::show(ui, &painter, pane, &settings, &rects);
        if let Some(described) = described {
            numbers::explain(ui, described);
        }
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
        measuring::show(self.window, ui, id, &pictures);
        self.what_it_waits_for(ui, &painter, id);
        let handles = light_handles::show(self.window, ui, id, &rects, response.contains_pointer());
        let handles = handles.or(hands::show_handles(self.window, ui, id, &rects));
        let axes = orientation::show_axes(self.window, ui, id, &rects);
        if response.clicked() || response.dragged() || handles.dragged || axes.dragged {
            self.window.views.focused = id;
        }
        if response.clicked() && self.window.views.hands.mode == HandMode::Camera {
            self.window.select(Selection::View);
        }
        let dragged_line = wipe::show(self.window, ui, &painter, rects[0], &settings);
        let is_free = !dragged_line && !handles.dragged && !axes.dragged;
        let is_taken =
            is_free && hands::over_picture(self.window, ui, &response, &painter, id, &rects);
        if response.dragged() && is_free && !is_taken {
            pointer::pivot(self.window, &painter, id, &rects);
        }
        dropped::show(self.window, ui, &response, &painter, id);
        // The wheel zooms over a light handle, too.
        let over = response.hover_pos().or(handles.hovered).or(axes.hovered).and_then(|at| {
            let side = rects.iter().position(|rect| rect.contains(at))?;
            Some((side, at - rects[side].min))
        });
        if is_free {
            self.mouse(ui, &response, id, size, (over, is_taken));
            measuring::over_picture(self.window, ui, &response, id, &rects);
            hands::click_pairs(self.window, ui, &response, id);
            hands::click_plane(self.window, &response, id, &rects);
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
}

/// What of a rectangle lies right of and below a picture in its left upper corner.
fn around(whole: Rect, picture: Rect) -> [Rect; 2] {
    let right = Rect::from_min_max(pos2(picture.max.x, whole.min.y), whole.max);
    let below = Rect::from_min_max(pos2(whole.min.x, picture.max.y), whole.max);
    [right, below]
}
