//! Exposure, tone mapping, antialiasing and background of the pictures.

use super::{Scale, background, row_of, slider_row};
use crate::window::Window;
use eframe::egui::{self, Ui};
use surfelshop_cloud::scene::{EyeDomeLighting, EyeDomeUse};
use surfelshop_image::display_transform::ToneMap;

/// Shows the section.
pub(super) fn show(window: &mut Window, ui: &mut Ui) {
    let settings = &mut window.settings;
    let (exposure, scale) = (&mut settings.scene.exposure_stops, Scale::linear(-8.0..=8.0, " EV"));
    slider_row(ui, "exposure", "A factor of two for each stop (EV).", exposure, &scale);
    row_of(ui, "tone mapping", "", |ui, _label| {
        let none = ui.selectable_value(&mut settings.tone_map, ToneMap::Clamp, "none");
        let none = none.on_hover_text("What is brighter than white is white.");
        let neutral = ui.selectable_value(&mut settings.tone_map, ToneMap::Neutral, "neutral");
        none | neutral.on_hover_text("Khronos PBR Neutral: highlights are compressed.")
    });
    antialiasing(&mut settings.antialias, ui);
    eye_dome(&mut settings.eye_dome, ui);
    background::show(window, ui);
}

/// Of how many pictures a view at rest is the mean.
fn antialiasing(antialias: &mut u32, ui: &mut Ui) {
    let about = "At rest, edges become smooth: so many pictures are drawn, each seen at another place of every \
                 pixel, and their mean is shown.";
    row_of(ui, "antialiasing", about, |ui, label| {
        let mut choices = vec![1, 16, 32];
        if !choices.contains(antialias) {
            choices.push(*antialias);
        }
        let mut all: Option<egui::Response> = None;
        for n in choices {
            let text = if n == 1 { "off".to_owned() } else { n.to_string() };
            let one = ui.selectable_value(antialias, n, text);
            all = Some(all.map_or_else(|| one.clone(), |all| all | one.clone()));
        }
        all.unwrap_or_else(|| ui.label("")).labelled_by(label)
    });
}

/// What is darkened for lying behind something.
fn eye_dome(lighting: &mut EyeDomeLighting, ui: &mut Ui) {
    let about = "Eye-dome lighting: what lies behind something near it on the screen is darker, which shows shapes \
                 without normals. Automatic: where many surfels are points.";
    row_of(ui, "depth cue", about, |ui, label| {
        let choices = [
            (EyeDomeUse::Automatic, "automatic"),
            (EyeDomeUse::Off, "off"),
            (EyeDomeUse::On, "on"),
        ];
        let choice = |(when, text)| ui.selectable_value(&mut lighting.when, when, text);
        let all = choices.map(choice).into_iter().reduce(|all, one| all | one);
        all.unwrap_or_else(|| ui.label("")).labelled_by(label)
    });
    if lighting.when == EyeDomeUse::Off {
        return;
    }
    let about = "How dark it becomes; 1 is usual.";
    slider_row(ui, "strength", about, &mut lighting.strength, &Scale::linear(0.0..=4.0, ""));
    let about = "How far on the screen what is nearer darkens what is behind it.";
    slider_row(ui, "radius", about, &mut lighting.radius, &Scale::linear(1.0..=8.0, " px"));
}
