//! What colours mean, over a picture in its lower right corner.

use crate::theme::OVERLAY;
use eframe::egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Shape, Stroke, Vec2, pos2, vec2};
use surfelshop_cloud::display::{Legend, LegendBody, LegendEntry, Tick};
use surfelshop_session::output::legend::{apart, heading, listed};

const FONT: FontId = FontId::new(13.0, eframe::egui::FontFamily::Proportional);
const MARGIN: f32 = 9.0;
const LINE: f32 = 18.0;
/// Width of the ramp, and its height at most.
const RAMP: Vec2 = vec2(14.0, 150.0);
const SWATCH: f32 = 12.0;
/// Between a colour and its label.
const GAP: f32 = 8.0;

/// Shows a legend over a picture; where there is no room for it, nothing.
pub(super) fn show(painter: &Painter, over: Rect, legend: &Legend) {
    let room = over.height() - 4.0 * MARGIN - LINE;
    if room < 3.0 * LINE || over.width() < 120.0 {
        return;
    }
    let title = heading(legend);
    match &legend.body {
        LegendBody::Ramp { colors, ticks, beyond } => {
            ramp(painter, over, &title, colors, ticks, *beyond);
        }
        LegendBody::List(entries) => list(painter, over, &title, entries),
    }
}

fn width(painter: &Painter, text: &str) -> f32 {
    painter.layout_no_wrap(text.to_owned(), FONT, Color32::WHITE).size().x
}

/// Shows the panel and the title; the corner of what is in it.
fn panel(painter: &Painter, over: Rect, title: &str, inner: Vec2) -> Pos2 {
    let size = vec2(inner.x.max(width(painter, title)), inner.y + LINE) + Vec2::splat(2.0 * MARGIN);
    let rect = Rect::from_min_size(over.max - size - Vec2::splat(MARGIN), size);
    painter.rect_filled(rect, 4.0, OVERLAY);
    let at = rect.min + Vec2::splat(MARGIN);
    painter.text(at + vec2(0.0, 0.45 * LINE), Align2::LEFT_CENTER, title, FONT, Color32::WHITE);
    at + vec2(0.0, LINE)
}

fn ramp(
    painter: &Painter,
    over: Rect,
    title: &str,
    colors: &[[u8; 3]],
    ticks: &[Tick],
    beyond: [bool; 2],
) {
    let height = RAMP.y.min(over.height() - 4.0 * MARGIN - 2.0 * LINE);
    let ticks = apart(ticks, f64::from(0.9 * LINE / height));
    let widest = ticks.iter().map(|tick| width(painter, &tick.label)).fold(0.0, f32::max);
    let inner = vec2(RAMP.x + GAP + widest, height + 14.0);
    let corner = panel(painter, over, title, inner) + vec2(0.0, 7.0);
    let steps = colors.len().clamp(1, 64);
    for i in 0..steps {
        let share = (i as f32 + 0.5) / steps as f32;
        let Some(&[red, green, blue]) = colors.get((share * colors.len() as f32) as usize) else {
            return;
        };
        let top = corner + vec2(0.0, height * (1.0 - (i + 1) as f32 / steps as f32));
        // A little higher, so that no gap shows between two steps.
        let size = vec2(RAMP.x, height / steps as f32 + if i > 0 { 0.5 } else { 0.0 });
        painter.rect_filled(
            Rect::from_min_size(top, size),
            0.0,
            Color32::from_rgb(red, green, blue),
        );
    }
    let middle = corner.x + 0.5 * RAMP.x;
    for (is_beyond, color, edge, tip) in
        [(beyond[0], colors.first(), height, 7.0), (beyond[1], colors.last(), 0.0, -7.0)]
    {
        let (true, Some(&[red, green, blue])) = (is_beyond, color) else { continue };
        let y = corner.y + edge;
        let corners = vec![pos2(corner.x, y), pos2(corner.x + RAMP.x, y), pos2(middle, y + tip)];
        let fill = Color32::from_rgb(red, green, blue);
        painter.add(Shape::convex_polygon(corners, fill, Stroke::NONE));
    }
    for tick in ticks {
        let at = corner + vec2(RAMP.x, height * (1.0 - tick.share as f32));
        painter.hline(at.x..=at.x + 4.0, at.y, Stroke::new(1.0, Color32::WHITE));
        let place = at + vec2(GAP, 0.0);
        painter.text(place, Align2::LEFT_CENTER, &tick.label, FONT, Color32::WHITE);
    }
}

fn list(painter: &Painter, over: Rect, title: &str, entries: &[LegendEntry]) {
    let room = over.height() - 4.0 * MARGIN - LINE;
    let (shown, n_others) = listed(entries, (room / LINE).max(1.0) as usize);
    let more = (n_others > 0).then(|| format!("{n_others} more"));
    let labels = || shown.iter().map(|entry| &entry.label).chain(&more);
    let widest = labels().map(|label| width(painter, label)).fold(0.0, f32::max);
    let inner = vec2(SWATCH + GAP + widest, labels().count() as f32 * LINE);
    let corner = panel(painter, over, title, inner);
    for (i, label) in labels().enumerate() {
        let middle = pos2(corner.x, corner.y + (i as f32 + 0.5) * LINE);
        if let Some(&LegendEntry { color: [red, green, blue], .. }) = shown.get(i).copied() {
            let swatch =
                Rect::from_center_size(middle + vec2(0.5 * SWATCH, 0.0), Vec2::splat(SWATCH));
            painter.rect_filled(swatch, 2.0, Color32::from_rgb(red, green, blue));
        }
        let place = middle + vec2(SWATCH + GAP, 0.0);
        painter.text(place, Align2::LEFT_CENTER, label, FONT, Color32::WHITE);
    }
}
