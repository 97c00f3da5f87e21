//! A measure: its name, its numbers, its places, and the plot of a profile.

use super::{command_button, row};
use crate::views::measuring::Surveyed;
use crate::window::Window;
use eframe::egui::{self, DragValue, RichText, Sense, TextEdit, Ui, vec2};
use egui_plot::{Plot, PlotPoints, Points};
use surfelshop_cloud::scene::{LONGEST_NOTE, Measure, MeasureKind, Profile, Quantity};

/// Height of the plot, points.
const PLOT: f32 = 190.0;

/// Most places that are listed.
const MOST_LISTED: usize = 12;

/// Letters of a place that stand in one line of the narrowest panel.
const LONGEST_PLACE: usize = 24;

/// Shows it.
pub(super) fn show(window: &mut Window, ui: &mut Ui, index: usize) {
    let Some(measure) = window.settings.measures.get_mut(index) else { return };
    text(ui, measure, index);
    let measure = measure.clone();
    let surveyed = window.views.measuring.surveys.of(&measure).cloned();
    if measure.kind == MeasureKind::Profile {
        thickness(window, ui, index);
        if let Some(surveyed) = surveyed.as_ref().filter(|known| !known.points.is_empty()) {
            plot(ui, surveyed);
        }
    }
    numbers(window, ui, &measure, surveyed.as_ref());
    places(ui, &measure);
    ui.horizontal_wrapped(|ui| {
        command_button(window, ui, "zoom-selected", "look there");
        command_button(window, ui, "copy-measure", "copy");
        if measure.kind == MeasureKind::Profile {
            command_button(window, ui, "save-profile", "save points");
        }
        command_button(window, ui, "remove-selected", "remove");
    });
}

fn text(ui: &mut Ui, measure: &mut Measure, index: usize) {
    let usual = measure.title(index);
    let is_note = measure.kind == MeasureKind::Note;
    let text = if is_note { &mut measure.text } else { &mut measure.name };
    let label = if is_note { "text" } else { "name" };
    row(ui, label, "", |ui| {
        let line = match is_note {
            true => TextEdit::multiline(text).desired_rows(2),
            false => TextEdit::singleline(text),
        };
        ui.add(line.hint_text(usual).char_limit(LONGEST_NOTE))
    });
}

fn numbers(window: &Window, ui: &mut Ui, measure: &Measure, surveyed: Option<&Surveyed>) {
    let units = window.units();
    // How thick a slab is stands above, to be changed.
    let shown = |quantity: &Quantity| quantity.name != "thickness";
    for (i, quantity) in window.quantities_of(measure).iter().filter(|q| shown(q)).enumerate() {
        let text = RichText::new(units.text(quantity));
        let text = if i == 0 { text.strong() } else { text };
        let exact = format!("{:?} {}", units.number(quantity), units.unit(quantity.kind));
        row(ui, quantity.name, "", |ui| ui.label(text).on_hover_text(exact));
    }
    if !measure.kind.is_of_surfels() {
        return;
    }
    match surveyed {
        None => drop(ui.weak("measuring …")),
        Some(Surveyed { fault: Some(fault), .. }) => {
            ui.colored_label(ui.visuals().warn_fg_color, fault);
        }
        Some(_) => {}
    }
    if units.metres.is_none() {
        ui.weak("In units of the file, which does not say how long they are.");
    }
}

fn places(ui: &mut Ui, measure: &Measure) {
    for (i, place) in measure.places.iter().take(MOST_LISTED).enumerate() {
        let numbers = place.to_array().map(|number| format!("{number:.4}"));
        // Coordinates of a map stand below each other.
        let is_long = numbers.iter().map(String::len).sum::<usize>() > LONGEST_PLACE;
        let text = numbers.join(if is_long { "\n" } else { "  " });
        let exact = format!("{:?} {:?} {:?}", place.x, place.y, place.z);
        row(ui, &format!("place {}", i + 1), "x, y and z, scene units", |ui| {
            ui.label(RichText::new(text).monospace().size(11.5)).on_hover_text(exact)
        });
    }
    if let Some(more) = measure.places.len().checked_sub(MOST_LISTED).filter(|more| *more > 0) {
        ui.weak(format!("and {more} more places"));
    }
}

/// How thick the slab is.
fn thickness(window: &mut Window, ui: &mut Ui, index: usize) {
    let up = window.document.up.axis();
    let Some(measure) = window.settings.measures.get_mut(index) else { return };
    let [first, last] = &measure.places[..] else { return };
    let (way, up) = (*last - *first, up.direction());
    let usual = Profile::USUAL_THICKNESS * (way - way.dot(up) * up).length();
    let mut thickness = measure.thickness.unwrap_or(usual);
    let about = "Of the slab around the plane, scene units: surfels in it are in the profile.";
    let value =
        DragValue::new(&mut thickness).speed(0.02 * usual).range(1e-3 * usual..=1e3 * usual);
    let shown = row(ui, "thickness", about, |ui| {
        ui.add_sized(vec2(ui.available_width(), ui.spacing().interact_size.y), value)
    });
    if shown.changed() {
        measure.thickness = Some(thickness);
    }
}

/// The surfels of a profile, as high as they are wide.
fn plot(ui: &mut Ui, surveyed: &Surveyed) {
    let color = match ui.visuals().dark_mode {
        true => egui::Color32::from_rgb(120, 180, 255),
        false => egui::Color32::from_rgb(20, 80, 200),
    };
    let plot = Plot::new("profile")
        .height(PLOT)
        .data_aspect(1.0)
        .sense(Sense::hover())
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .x_axis_label("along, scene units")
        .y_axis_label("height");
    plot.show(ui, |plot| {
        let points = PlotPoints::from(surveyed.points.clone());
        plot.points(Points::new("surfels", points).color(color).radius(1.2));
    });
}
