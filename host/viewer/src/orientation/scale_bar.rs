//! The scale bar: how long something is at the distance of what the camera orbits about.

use super::nice;
use crate::theme::space;
use crate::views::navigation;
use eframe::egui::{
    Align2, Color32, FontId, Painter, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2,
};
use surfelshop_api::Camera;

/// Longest bar, points of the screen.
const LONGEST: f32 = 130.0;

/// Views that are narrower have none, points of the screen.
const NARROWEST: f32 = 150.0;

/// A length for people, in scene units that are so many metres.
fn label(length: f64, metres: Option<f64>) -> String {
    let (number, unit) = match metres.map(|metres| length * metres) {
        None if (length - 1.0).abs() < 1e-9 => (1.0, "unit"),
        None => (length, "units"),
        Some(length) if length >= 1000.0 => (length / 1000.0, "km"),
        Some(length) if length >= 1.0 => (length, "m"),
        Some(length) if length >= 0.01 => (length * 100.0, "cm"),
        Some(length) if length >= 0.001 => (length * 1000.0, "mm"),
        Some(length) => (length * 1e6, "µm"),
    };
    if !(1e-3..1e6).contains(&number) {
        return format!("{number:.0e} {unit}");
    }
    let text = format!("{number:.3}");
    format!("{} {unit}", text.trim_end_matches('0').trim_end_matches('.'))
}

/// Shows the bar so far above the lower edge of a picture.
pub(super) fn show(
    ui: &Ui,
    painter: &Painter,
    (rect, raised): (Rect, f32),
    camera: &Camera,
    metres: Option<f64>,
) {
    let per_unit = f64::from(rect.height()) / navigation::height_at_target(camera);
    let unit = metres.unwrap_or(1.0);
    // A third of a narrow view at most.
    let longest = LONGEST.min(rect.width() / 3.0);
    let length = nice(f64::from(longest) / per_unit * unit) / unit;
    if !(per_unit > 0.0 && length.is_finite() && length > 0.0) || rect.width() < NARROWEST {
        return;
    }
    let width = (length * per_unit) as f32;
    let (left, bottom) = (rect.center().x - 0.5 * width, rect.bottom() - 14.0 - raised);
    let dark = Stroke::new(4.0, Color32::from_black_alpha(150));
    for stroke in [dark, Stroke::new(2.0, Color32::WHITE)] {
        painter.hline(left..=left + width, bottom, stroke);
        for x in [left, left + width] {
            painter.vline(x, bottom - 4.0..=bottom + 4.0, stroke);
        }
    }
    let text = label(length, metres);
    let middle = pos2(rect.center().x, bottom - 7.0);
    let font = FontId::proportional(12.0);
    for (offset, color) in
        [(vec2(1.0, 1.0), Color32::from_black_alpha(200)), (vec2(0.0, 0.0), Color32::WHITE)]
    {
        painter.text(middle + offset, Align2::CENTER_BOTTOM, &text, font.clone(), color);
    }
    let area =
        Rect::from_min_max(pos2(left, bottom - 22.0), pos2(left + width, bottom + space::MEDIUM));
    let hover =
        ui.interact(area, ui.scope_id().with(("scale bar", rect.left() as i32)), Sense::hover());
    hover.widget_info(|| WidgetInfo::labeled(Role::Label, true, format!("scale bar: {text}")));
    let about = match metres {
        Some(_) => {
            "At the distance of what the camera orbits about; nearer things look larger in perspective."
        }
        None => {
            "In the units of the file, which does not say how long they are; at the distance of what the \
             camera orbits about."
        }
    };
    hover.on_hover_text(about);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_have_the_unit_that_suits_them() {
        for (length, metres, expected) in [
            (0.2, None, "0.2 units"),
            (1.0, None, "1 unit"),
            (50.0, Some(0.001), "5 cm"),
            (2.0, Some(1.0), "2 m"),
            (5000.0, Some(1.0), "5 km"),
            (0.002, Some(1.0), "2 mm"),
            (2e-5, Some(1.0), "20 µm"),
            (1e-7, None, "1e-7 units"),
            (5e7, None, "5e7 units"),
        ] {
            assert_eq!(label(length, metres), expected);
        }
    }
}
