//! The range of a colour map over a histogram, whose two handles are its ends.

use crate::panels::row::row_of;
use crate::window::Window;
use eframe::egui::{self, Color32, CursorIcon, Rect, Response, Sense, Stroke, Ui, pos2, vec2};
use surfelshop_cloud::Cloud;
use surfelshop_cloud::display::{
    ColorSource, Filter, FilterAction, FilterTest, Histogram, Ramp, RangeEnd, Scale, Statistics,
    histogram,
};
use surfelshop_session::input::clouds::Clouds;

/// Percentages between which the histogram shows everything, and the share of them that it shows besides
/// at either end.
const DOMAIN: ([f64; 2], f64) = ([0.5, 99.5], 0.12);

const HEIGHT: f32 = 64.0;

/// Shows scale, histogram and ends.
pub(super) fn show(window: &mut Window, ui: &mut Ui, ramp: &Ramp, whole: &Clouds) {
    let up = window.document.up.into();
    let clouds: Vec<&Cloud> = whole.loaded.iter().map(|loaded| &loaded.cloud).collect();
    let color = &mut window.settings.color;
    row_of(ui, "scale", "Even steps of numbers, or of their powers of ten.", |ui, _label| {
        let shown = ui.horizontal(|ui| {
            for scale in Scale::ALL {
                ui.selectable_value(&mut color.scale, scale, scale.name());
            }
        });
        shown.response
    });
    // Both are known already from colouring, or found in milliseconds, and kept.
    let known = Statistics::of(&clouds, &ramp.attribute, up);
    let Some(domain) = known.ok().and_then(|known| domain(&known, ramp)) else {
        ui.weak("no numbers");
        return;
    };
    let Ok(bins) = histogram(&clouds, &ramp.attribute, up, domain, ramp.scale) else { return };
    handles(ui, color, ramp, &bins);
    ends(ui, color, ramp);
    ui.horizontal(|ui| {
        if ui
            .button("hide the rest")
            .on_hover_text("Shows only surfels whose numbers lie between the ends.")
            .clicked()
        {
            let (attribute, test) = (ramp.attribute.clone(), FilterTest::Range(ramp.range));
            let filters = &mut window.settings.filters;
            let is_same = |filter: &Filter| {
                filter.attribute == attribute && matches!(filter.test, FilterTest::Range(_))
            };
            filters.retain(|filter| !is_same(filter));
            filters.push(Filter { attribute, action: FilterAction::Keep, test });
        }
        let is_usual = window.settings.color.range == ColorSource::USUAL_RANGE;
        let usual = egui::Button::new("usual range");
        if ui
            .add_enabled(!is_usual, usual)
            .on_hover_text("From 2 % to 98 % of the numbers.")
            .clicked()
        {
            window.settings.color.range = ColorSource::USUAL_RANGE;
        }
    });
}

/// The numbers that the histogram shows: the same while its handles are dragged.
fn domain(known: &Statistics, ramp: &Ramp) -> Option<[f64; 2]> {
    let ([low, high], share) = DOMAIN;
    let inner = [known.percentile(low)?, known.percentile(high)?];
    let ends = known.ends()?;
    let inner = match ramp.scale {
        Scale::Linear => inner,
        Scale::Logarithmic => {
            let least = known.least_positive()?;
            [inner[0].max(least), inner[1].max(least)]
        }
    };
    let wide = |at: f64| ramp.scale.at_share(at, inner);
    let wide = [wide(-share).max(ends[0]), wide(1.0 + share).min(ends[1])];
    let wide = match ramp.scale {
        Scale::Linear => wide,
        Scale::Logarithmic => [wide[0].max(known.least_positive()?), wide[1]],
    };
    Some(if wide[0] < wide[1] { wide } else { ramp.range })
}

/// The histogram in the colours of the map, with a handle at each end of the range.
fn handles(ui: &mut Ui, color: &mut ColorSource, ramp: &Ramp, bins: &Histogram) {
    let size = vec2(ui.available_width(), HEIGHT);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
    let name = format!("range of {}", ramp.attribute.title());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, &name));
    let share = |number: f64| ramp.scale.share(number, bins.range).clamp(0.0, 1.0) as f32;
    let x = |number: f64| rect.left() + share(number) * rect.width();
    paint(ui, rect, ramp, bins, ramp.range.map(x));
    if response.double_clicked() {
        color.range = ColorSource::USUAL_RANGE;
    } else if let Some((end, at)) = dragged(ui, &response, rect, ramp.range.map(x)) {
        let number = rounded(ramp.scale.at_share(f64::from(at), bins.range), bins.range);
        let other = ramp.range[1 - end];
        let is_in_order = if end == 0 { number < other } else { number > other };
        if is_in_order {
            color.range[end] = RangeEnd::Value(number);
        }
    }
    response.on_hover_text("drag the ends of the map; a double click brings back 2 % to 98 %");
}

/// The end that is dragged, and the share of the width where the pointer is.
fn dragged(ui: &Ui, response: &Response, rect: Rect, ends: [f32; 2]) -> Option<(usize, f32)> {
    if let Some(at) = response.hover_pos()
        && ends.iter().any(|end| (end - at.x).abs() < 7.0)
    {
        ui.ctx().set_cursor_icon(CursorIcon::ResizeHorizontal);
    }
    let held = response.id.with("end");
    if response.drag_started() {
        let start = ui.ctx().input(|input| input.pointer.press_origin())?;
        let nearer = usize::from((ends[1] - start.x).abs() < (ends[0] - start.x).abs());
        // Where both are at one place, the one on the side of the pointer.
        let end = if ends[0] == ends[1] { usize::from(start.x > ends[0]) } else { nearer };
        ui.ctx().data_mut(|data| data.insert_temp(held, end));
    }
    let at = response.interact_pointer_pos().filter(|_| response.dragged())?;
    let end = ui.ctx().data(|data| data.get_temp::<usize>(held))?;
    Some((end.min(1), ((at.x - rect.left()) / rect.width().max(1.0)).clamp(0.0, 1.0)))
}

/// A number with no more digits than the histogram shows.
fn rounded(number: f64, [low, high]: [f64; 2]) -> f64 {
    let step = 10f64.powf(((high - low) / 500.0).log10().floor());
    let rounded = (number / step).round() * step;
    // In decimals, which is what will be written.
    let text =
        format!("{rounded:.*}", usize::try_from(-(step.log10().round() as i64)).unwrap_or(0));
    text.parse().ok().filter(|short: &f64| short.is_finite()).unwrap_or(number)
}

fn paint(ui: &Ui, rect: Rect, ramp: &Ramp, bins: &Histogram, ends: [f32; 2]) {
    let painter = ui.painter_at(rect.expand(1.0));
    painter.rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
    let most = bins.bins.iter().max().copied().unwrap_or(0).max(1) as f32;
    // Narrower columns than pixels would flicker: several bins share one.
    let n_columns = (rect.width() as usize / 2).clamp(1, bins.bins.len().max(1));
    let per_column = bins.bins.len().div_ceil(n_columns).max(1);
    let n_columns = bins.bins.len().div_ceil(per_column).max(1);
    let width = rect.width() / n_columns as f32;
    for (i, bins_of) in bins.bins.chunks(per_column).enumerate() {
        let n = bins_of.iter().max().copied().unwrap_or(0) as f32;
        if n == 0.0 {
            continue;
        }
        // Roots, so that rare numbers are seen beside frequent ones.
        let height = ((n / most).sqrt() * (rect.height() - 6.0)).max(1.0);
        let middle = (i as f64 + 0.5) / n_columns as f64;
        let [red, green, blue] = ramp.color(ramp.scale.at_share(middle, bins.range));
        let left = rect.left() + i as f32 * width;
        let bar = Rect::from_min_max(
            pos2(left, rect.bottom() - height),
            pos2(left + width, rect.bottom()),
        );
        painter.rect_filled(bar, 0.0, Color32::from_rgb(red, green, blue));
    }
    let shade = Color32::from_black_alpha(90);
    painter.rect_filled(Rect::from_min_max(rect.min, pos2(ends[0], rect.bottom())), 0.0, shade);
    painter.rect_filled(Rect::from_min_max(pos2(ends[1], rect.top()), rect.max), 0.0, shade);
    for end in ends {
        painter.vline(end, rect.y_range(), Stroke::new(3.0, Color32::from_black_alpha(160)));
        painter.vline(end, rect.y_range(), Stroke::new(1.5, Color32::WHITE));
        let grip = Rect::from_center_size(pos2(end, rect.top() + 7.0), vec2(7.0, 12.0));
        painter.rect_filled(grip.expand(1.0), 2.0, Color32::from_black_alpha(160));
        painter.rect_filled(grip, 2.0, Color32::WHITE);
    }
}

/// The ends in digits.
fn ends(ui: &mut Ui, color: &mut ColorSource, ramp: &Ramp) {
    let speed = ((ramp.range[1] - ramp.range[0]).abs() / 200.0).max(f64::MIN_POSITIVE);
    ui.horizontal(|ui| {
        for (i, name) in ["from", "to"].into_iter().enumerate() {
            let label = ui.label(name);
            let mut number = ramp.range[i];
            let value = egui::DragValue::new(&mut number).speed(speed).max_decimals(6);
            let other = ramp.range[1 - i];
            let response = ui.add(value).labelled_by(label.id);
            let is_in_order = if i == 0 { number < other } else { number > other };
            if response.changed() && is_in_order && number.is_finite() {
                color.range[i] = RangeEnd::Value(number);
            }
            if let RangeEnd::Percent(percent) = color.range[i] {
                ui.weak(format!("{percent} %"));
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dragged_numbers_have_few_digits() {
        assert_eq!(rounded(3.456_789_012, [0.0, 10.0]), 3.46);
        assert_eq!(rounded(31_415.926, [0.0, 65_535.0]), 31_400.0);
        assert_eq!(rounded(4_500_000.123_456, [4_500_000.0, 4_500_001.0]), 4_500_000.123);
        assert_eq!(rounded(2e-7, [0.0, 1e-6]), 2e-7);
        assert!(rounded(1.0, [1.0, 1.0]).is_finite());
    }
}
