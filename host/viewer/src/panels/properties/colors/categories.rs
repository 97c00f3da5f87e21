//! The list of categories, each shown or hidden, with its colour and how many surfels it has.

use crate::window::Window;
use eframe::egui::{self, Color32, ScrollArea, Sense, Ui, vec2};
use surfelshop_cloud::display::{Attribute, Categories, Filter, FilterAction, FilterTest};
use surfelshop_cloud::in_groups;

/// Shows the list.
pub(super) fn show(window: &mut Window, ui: &mut Ui, categories: &Categories) {
    let attribute = &categories.attribute;
    let filters = &mut window.settings.filters;
    let mut change = None;
    ui.horizontal(|ui| {
        if ui.small_button("all").on_hover_text("show all of them").clicked() {
            change = Some(Vec::new());
        }
        if ui.small_button("none").on_hover_text("hide all of them").clicked() {
            change = Some(categories.counts.keys().copied().collect());
        }
    });
    let hidden: Vec<i64> = categories
        .counts
        .keys()
        .copied()
        .filter(|value| !is_shown(filters, attribute, *value))
        .collect();
    ScrollArea::vertical().id_salt("categories").max_height(220.0).show(ui, |ui| {
        for (&value, &n) in &categories.counts {
            let mut shown = !hidden.contains(&value);
            ui.horizontal(|ui| {
                let (swatch, _) = ui.allocate_exact_size(vec2(12.0, 12.0), Sense::hover());
                let [red, green, blue] = categories.palette.color(value);
                ui.painter().rect_filled(swatch, 2.0, Color32::from_rgb(red, green, blue));
                let is_changed = ui.checkbox(&mut shown, categories.label(value)).changed();
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    ui.weak(in_groups(n));
                });
                if is_changed {
                    let others = hidden.iter().copied().filter(|other| *other != value);
                    change = Some(match shown {
                        true => others.collect(),
                        false => others.chain([value]).collect(),
                    });
                }
            });
        }
    });
    if let Some(hidden) = change {
        hide(filters, attribute, hidden);
    }
}

/// The filters of an attribute by single values.
fn is_by_values(filter: &Filter, attribute: &Attribute) -> bool {
    filter.attribute == *attribute && matches!(filter.test, FilterTest::Values(_))
}

fn is_shown(filters: &[Filter], attribute: &Attribute, value: i64) -> bool {
    let mut own = filters.iter().filter(|filter| is_by_values(filter, attribute));
    own.all(|filter| filter.shows(value as f64))
}

/// Hides these categories and no others, as one filter in the place of those by single values.
fn hide(filters: &mut Vec<Filter>, attribute: &Attribute, mut hidden: Vec<i64>) {
    let place = filters.iter().position(|filter| is_by_values(filter, attribute));
    filters.retain(|filter| !is_by_values(filter, attribute));
    if hidden.is_empty() {
        return;
    }
    hidden.sort_unstable();
    let (attribute, test) = (attribute.clone(), FilterTest::Values(hidden));
    let filter = Filter { attribute, action: FilterAction::Hide, test };
    filters.insert(place.unwrap_or(filters.len()).min(filters.len()), filter);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_filter_holds_what_is_hidden() {
        let class = Attribute::column("class");
        let filter = |attribute: &Attribute, action, test: FilterTest| Filter {
            attribute: attribute.clone(),
            action,
            test,
        };
        let range = filter(&Attribute::Height, FilterAction::Keep, FilterTest::Range([0.0, 1.0]));
        let keep = filter(&class, FilterAction::Keep, FilterTest::Values(vec![2, 6]));
        let mut filters = vec![keep, range.clone()];
        assert!(is_shown(&filters, &class, 2) && !is_shown(&filters, &class, 7));
        hide(&mut filters, &class, vec![9, 7]);
        let hidden = filter(&class, FilterAction::Hide, FilterTest::Values(vec![7, 9]));
        assert_eq!(filters, [hidden, range.clone()]);
        assert!(is_shown(&filters, &class, 2) && !is_shown(&filters, &class, 7));
        hide(&mut filters, &class, Vec::new());
        assert_eq!(filters, [range]);
    }
}
