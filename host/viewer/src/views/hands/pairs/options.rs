//! The small window while pairs are clicked: what is to be clicked next, the picture, and all pairs.

use super::state::Pairing;
use crate::theme::space;
use crate::views::hands::HandMode;
use crate::window::Window;
use eframe::egui::{Button, Role, ScrollArea, Ui, WidgetInfo};

/// Pairs that are listed without scrolling.
const ROWS: f32 = 6.0;

/// Shows it.
pub(in crate::views::hands) fn show(window: &mut Window, ui: &mut Ui) {
    ui.label(next(window));
    ui.weak("Backspace takes the last place back, Escape ends; drags move the camera.");
    let pairs = window.pairs();
    let shown = pairs.as_deref().unwrap_or_default();
    if let Some(Pairing { picture: Some(picture), share, .. }) = &mut window.views.hands.pairing {
        let number = |i: usize| format!("{}", i + 1);
        let mut dots: Vec<([f64; 2], String)> = shown
            .iter()
            .enumerate()
            .filter_map(|(i, pair)| Some(([*pair.get(3)?, *pair.get(4)?], number(i))))
            .collect();
        dots.extend(share.map(|share| (share, number(shown.len()))));
        if let Some(clicked) = picture.show(ui, &dots) {
            *share = Some(clicked);
            window.finish_pair();
        }
    }
    if pairs.is_none() {
        ui.weak("What was typed is no list of pairs; the next pair takes its place.");
    }
    list(window, ui, shown);
    ui.horizontal(|ui| {
        let is_begun = window.views.hands.pairing.as_ref().is_some_and(Pairing::is_begun);
        let has_some = is_begun || pairs.as_ref().is_none_or(|pairs| !pairs.is_empty());
        if ui.add_enabled(has_some, Button::new("clear")).clicked() {
            window.set_pairs(&[]);
            window.views.hands.pairing.as_mut().map(Pairing::forget_place);
        }
        if ui.button("done").clicked() {
            window.end_pairs();
        }
    });
}

/// What is to be clicked next.
fn next(window: &Window) -> String {
    let Some(pairing) = &window.views.hands.pairing else { return String::new() };
    let own = window.cloud_of_pairs().map_or_else(|| "the cloud".to_owned(), |(_, name, _)| name);
    match (&pairing.picture, pairing.place, pairing.share) {
        (Some(_), Some(_), _) => "Now click it in the picture.".to_owned(),
        (Some(_), None, Some(_)) => "Now click it on the cloud.".to_owned(),
        (Some(_), None, None) => "Click a place on the cloud, then in the picture.".to_owned(),
        (None, Some(_), _) => "Now click the same place on another cloud.".to_owned(),
        (None, None, _) => format!("Click a place on {own}."),
    }
}

fn list(window: &mut Window, ui: &mut Ui, pairs: &[Vec<f64>]) {
    let mut removed = None;
    let height = ROWS * (ui.spacing().interact_size.y + space::SMALL);
    ScrollArea::vertical().max_height(height).show(ui, |ui| {
        for (i, pair) in pairs.iter().enumerate() {
            ui.horizontal(|ui| {
                let button = ui.add(Button::new("×").small());
                let label = format!("remove pair {}", i + 1);
                button.widget_info(|| WidgetInfo::labeled(Role::Button, true, &label));
                if button.on_hover_text(label.clone()).clicked() {
                    removed = Some(i);
                }
                let short = |numbers: &[f64]| {
                    numbers.iter().map(|x| format!("{x:.3}")).collect::<Vec<_>>().join(" ")
                };
                let (own, other) = pair.split_at(3.min(pair.len()));
                ui.label(format!("{}:  {}  –  {}", i + 1, short(own), short(other)));
            });
        }
    });
    if let Some(i) = removed {
        let mut pairs = pairs.to_vec();
        pairs.remove(i);
        window.set_pairs(&pairs);
    }
}

impl Window {
    /// Ends the clicking of pairs, where they are clicked; a tool's window is there again.
    pub(crate) fn end_pairs(&mut self) {
        let hands = &mut self.views.hands;
        hands.pairing = None;
        if hands.mode == HandMode::Pairs {
            hands.mode = HandMode::Camera;
        }
    }
}
