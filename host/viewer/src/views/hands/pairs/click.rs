//! Clicks on the pictures add places.

use crate::views::hands::HandMode;
use crate::views::hands::place::rounded;
use crate::window::Window;
use eframe::egui::{CursorIcon, Key, Modifiers, Response, Ui};
use glam::DVec3;

/// Places are kept to five digits below this share of their distance from the eye.
const SHARE: f64 = 1e-3;

/// Takes clicks and keys in, where pairs are clicked.
pub(in crate::views) fn over_picture(window: &mut Window, ui: &Ui, response: &Response, pane: u32) {
    if window.views.hands.mode != HandMode::Pairs || window.document.complete_clouds().is_none() {
        return;
    }
    if response.contains_pointer() {
        ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
    }
    let is_typed = ui.ctx().egui_wants_keyboard_input();
    if !is_typed && ui.ctx().input_mut(|i| i.consume_key(Modifiers::NONE, Key::Backspace)) {
        window.take_place_back();
    }
    if !response.clicked() {
        return;
    }
    let Some(place) = window.views.measuring.pointer else {
        window.messages.report("click on the surface: there is no surfel here");
        return;
    };
    let eye = window.camera_of(pane).eye;
    let place = rounded(place, SHARE * place.distance(eye).max(f64::MIN_POSITIVE));
    if let Err(line) = window.add_place(place) {
        window.messages.report(line);
    }
}

impl Window {
    /// The cloud that the tool works on: its place among the visible ones, and its name; and how many there are.
    pub(super) fn cloud_of_pairs(&self) -> Option<(usize, String, usize)> {
        let open = &self.document.clouds.as_ref()?.open_clouds;
        let index = self.plugins.tools.cloud_index;
        let own = open.all().get(index).filter(|own| own.visible)?;
        let visible = open.all().iter().filter(|cloud| cloud.visible).count();
        let before = open.all()[..index].iter().filter(|cloud| cloud.visible).count();
        Some((before, own.name(), visible))
    }

    fn add_place(&mut self, place: DVec3) -> Result<(), String> {
        let own = self.cloud_of_pairs();
        let on = self.views.pointer_cloud;
        let Some(pairing) = &mut self.views.hands.pairing else { return Ok(()) };
        let Some((own, name, n_visible)) = own else {
            return Err("show the cloud that the tool works on: it is hidden".to_owned());
        };
        let is_own = on == Some(own);
        if pairing.picture.is_some() {
            if !is_own && n_visible > 1 {
                return Err(format!("click on {name}, which the tool works on"));
            }
            pairing.place = Some(place);
            self.finish_pair();
            return Ok(());
        }
        match pairing.place {
            _ if n_visible < 2 => {
                Err("add the other cloud: pairs are places of two clouds".to_owned())
            }
            None if !is_own => Err(format!("click on {name} first, which the tool works on")),
            None => {
                pairing.place = Some(place);
                Ok(())
            }
            Some(_) if is_own => {
                Err("click the same place on another cloud; Backspace takes the first one back"
                    .to_owned())
            }
            Some(first) => {
                pairing.place = None;
                self.add_pair([first.to_array(), place.to_array()].concat());
                Ok(())
            }
        }
    }

    /// Makes a pair of a place and what lies there in the picture, where both are known.
    pub(super) fn finish_pair(&mut self) {
        let Some(pairing) = &mut self.views.hands.pairing else { return };
        let Some((place, share)) = pairing.place.zip(pairing.share) else { return };
        (pairing.place, pairing.share) = (None, None);
        self.add_pair([&place.to_array()[..], &share].concat());
    }

    /// Takes the last place back: that without a partner, else the last pair.
    pub(super) fn take_place_back(&mut self) {
        let Some(pairing) = &mut self.views.hands.pairing else { return };
        if pairing.forget_place() {
            return;
        }
        if let Some(mut pairs) = self.pairs() {
            pairs.pop();
            self.set_pairs(&pairs);
        }
    }
}
