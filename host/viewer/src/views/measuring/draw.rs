//! Lines, dots and numbers of measures over the pictures.

use crate::panels::Selection;
use crate::theme::{ON_OVERLAY, OVERLAY};
use crate::views::hands::{HandMode, pair_figures};
use crate::views::picking::{project, project_line};
use crate::window::Window;
use eframe::egui::{
    Align2, Color32, FontId, Painter, Pos2, Rect, Shape, Stroke, StrokeKind, Ui, Vec2, vec2,
};
use glam::{DVec2, DVec3};
use surfelshop_api::Camera;
use surfelshop_cloud::scene::{Figure, Measure};
use surfelshop_image::Image;
use surfelshop_session::output::measures::INK;

/// Pieces of a line that may each lie behind something, points of the screen, and the most of them.
const PIECE: f64 = 7.0;
const MOST_PIECES: f64 = 160.0;

/// What lies behind the surface by less than this share of its distance lies on it.
const ON_SURFACE: f64 = 0.004;

/// How lines are drawn.
#[derive(Clone, Copy)]
struct Look {
    color: Color32,
    width: f32,
}

fn ink() -> Color32 {
    let [red, green, blue] = INK.map(|level| (255.0 * level).round() as u8);
    Color32::from_rgb(red, green, blue)
}

/// Where the pictures of a pane are, and what is near in them.
struct Canvas<'a> {
    painter: &'a Painter,
    rect: Rect,
    camera: Camera,
    depth: Option<&'a Image>,
}

/// Shows all measures over the pictures of a pane; the sides are those that each picture shows.
pub(in crate::views) fn show(window: &Window, ui: &Ui, pane: u32, pictures: &[(usize, Rect)]) {
    if window.document.clouds.is_none() {
        return;
    }
    let (up, units) = (window.document.up.axis().direction(), window.units());
    let selection = window.selection();
    let all = window.settings.measures.iter().enumerate();
    let shown: Vec<(Figure, String, bool)> = all
        .filter(|(_, measure)| !measure.hidden)
        .map(|(i, measure)| {
            let label = window.measure_label(measure);
            (Figure::of(measure, up), label, selection == Selection::Measure(i))
        })
        .collect();
    let pairs = pair_figures(window);
    let unfinished = unfinished(window).map(|measure| {
        let label = units.label(&measure, up, &[]);
        (Figure::of(&measure, up), label)
    });
    for &(side, rect) in pictures {
        let side = window.views.panes.get(&pane).map(|pane| &pane.sides[side]);
        let Some(picture) = side.and_then(|side| side.shown.as_ref()) else { continue };
        let painter = ui.painter_at(rect);
        let camera = picture.rendered.view.camera;
        let canvas =
            Canvas { painter: &painter, rect, camera, depth: picture.rendered.depth.as_ref() };
        for (figure, _, is_selected) in &shown {
            let look = Look { color: ink(), width: if *is_selected { 3.0 } else { 2.0 } };
            canvas.figure(figure, look);
        }
        for (figure, _) in &pairs {
            canvas.figure(figure, Look { color: Color32::WHITE, width: 2.0 });
        }
        if let Some((figure, _)) = &unfinished {
            canvas.figure(figure, Look { color: Color32::WHITE, width: 2.0 });
        }
        for (figure, label, is_selected) in &shown {
            canvas.label(figure, label, *is_selected);
        }
        for (figure, label) in pairs.iter().chain(&unfinished) {
            canvas.label(figure, label, false);
        }
    }
}

/// What would be measured if the pointer were clicked now.
fn unfinished(window: &Window) -> Option<Measure> {
    let HandMode::Measure(kind) = window.views.hands.mode else { return None };
    let measuring = &window.views.measuring;
    let mut places = measuring.places.clone();
    // Where the pointer is between clicks.
    places.extend(measuring.pointer.filter(|place| places.last() != Some(place)));
    let most = *kind.n_places().end();
    places.truncate(most);
    (!places.is_empty()).then(|| Measure::new(kind, places))
}

impl Canvas<'_> {
    fn at(&self, position: DVec2) -> Pos2 {
        let offset = Vec2::from(position.as_vec2().to_array()) * self.rect.height();
        self.rect.center() + offset
    }

    /// Whether a place is hidden behind the surface.
    fn is_behind(&self, place: DVec3) -> bool {
        let (Some(depth), Some(seen)) = (self.depth, project(&self.camera, place)) else {
            return false;
        };
        let share = (self.at(seen.position) - self.rect.min) / self.rect.size();
        let at = [share.x * depth.width as f32, share.y * depth.height as f32];
        let is_inside = at[0] >= 0.0
            && at[1] >= 0.0
            && at[0] < depth.width as f32
            && at[1] < depth.height as f32;
        if !is_inside {
            return false;
        }
        let surface = f64::from(depth.pixel(at[0] as u32, at[1] as u32)[0]);
        surface > 0.0 && seen.depth > surface * (1.0 + ON_SURFACE)
    }

    fn figure(&self, figure: &Figure, look: Look) {
        let mut seen = Vec::new();
        for segment in &figure.segments {
            let Some(ends) = project_line(&self.camera, segment.ends) else { continue };
            let length = ends[0].distance(ends[1]) * f64::from(self.rect.height());
            let n = (length / PIECE).ceil().clamp(1.0, MOST_PIECES) as u32;
            let place = |i: u32| segment.ends[0].lerp(segment.ends[1], f64::from(i) / f64::from(n));
            let mut began = 0;
            let mut was = self.is_behind(place(0).lerp(place(1), 0.5));
            // Pieces that are alike are one line.
            for i in 1..=n {
                let is = i < n && self.is_behind(place(i).lerp(place(i + 1), 0.5));
                if i == n || is != was {
                    let part = project_line(&self.camera, [place(began), place(i)]);
                    seen.extend(
                        part.map(|part| (part.map(|end| self.at(end)), was, segment.is_faint)),
                    );
                    (began, was) = (i, is);
                }
            }
        }
        // Halos first, so that no line is below another one's.
        for (ends, is_behind, _) in &seen {
            if !is_behind {
                let halo = Stroke::new(look.width + 2.5, Color32::from_black_alpha(140));
                self.painter.line_segment(*ends, halo);
            }
        }
        for (ends, is_behind, is_faint) in &seen {
            match (is_behind, is_faint) {
                (true, _) => {
                    let halo = Stroke::new(0.7 * look.width + 1.5, Color32::from_black_alpha(90));
                    let stroke = Stroke::new(0.7 * look.width, look.color.gamma_multiply(0.85));
                    for stroke in [halo, stroke] {
                        self.painter.extend(Shape::dashed_line(ends, stroke, 6.0, 4.0));
                    }
                }
                (false, true) => {
                    let stroke = Stroke::new(0.7 * look.width, look.color.gamma_multiply(0.75));
                    self.painter.line_segment(*ends, stroke);
                }
                (false, false) => {
                    self.painter.line_segment(*ends, Stroke::new(look.width, look.color));
                }
            }
        }
        for place in figure.places.iter().filter_map(|place| project(&self.camera, *place)) {
            let at = self.at(place.position);
            let radius = look.width + 1.5;
            self.painter.circle_filled(at, radius + 1.5, Color32::from_black_alpha(160));
            self.painter.circle_filled(at, radius, look.color);
        }
    }

    fn label(&self, figure: &Figure, text: &str, is_selected: bool) {
        let found = figure.anchor.and_then(|anchor| project(&self.camera, anchor));
        let Some(found) = found.filter(|_| !text.is_empty()) else { return };
        let at = self.at(found.position) - vec2(0.0, 12.0);
        if !self.rect.expand(40.0).contains(at) {
            return;
        }
        let font = FontId::proportional(13.5);
        let galley = self.painter.layout_no_wrap(text.to_owned(), font, ON_OVERLAY);
        let place = Align2::CENTER_BOTTOM.anchor_size(at, galley.size());
        let ground = place.expand2(vec2(7.0, 3.5));
        self.painter.rect_filled(ground, 4.0, OVERLAY);
        if is_selected {
            self.painter.rect_stroke(ground, 4.0, Stroke::new(1.5, ink()), StrokeKind::Outside);
        }
        self.painter.galley(place.min, galley, ON_OVERLAY);
    }
}
