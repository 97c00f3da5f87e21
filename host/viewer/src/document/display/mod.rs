//! Colours and filters follow the settings: small clouds at once, large ones on a thread of their own.

pub(super) mod job;

use crate::document::visible_clouds::VisibleClouds;
use crate::window::Window;
use eframe::egui::Context;
use job::{DisplayInputs, DisplayJob, DisplayOutcome};
use std::sync::Arc;
use std::sync::mpsc::TryRecvError;
use surfelshop_cloud::display::DisplaySettings;
use surfelshop_cloud::selection::Tint;
use surfelshop_session::input::displayed::DisplayedClouds;
use surfelshop_session::options::camera::Extent;

impl Window {
    /// What colours and filters the clouds.
    pub(crate) fn display_settings(&self) -> DisplaySettings {
        let (color, filters) = (self.settings.color.clone(), self.settings.filters.clone());
        let splats = self.settings.splats;
        DisplaySettings { color, filters, splats, up: self.document.up.into() }
    }

    /// Displays the clouds as the settings say, where they or the settings changed.
    pub(crate) fn update_display(&mut self, ctx: &Context) {
        if let Some(job) = &self.document.display_job {
            match job.outcome.try_recv() {
                Ok(outcome) => {
                    let inputs = job.inputs.clone();
                    self.document.display_job = None;
                    self.show_displayed(inputs, outcome);
                }
                Err(TryRecvError::Disconnected) => self.document.display_job = None,
                Err(TryRecvError::Empty) => {}
            }
        }
        let (settings, selections) = (self.display_settings(), self.visible_selections());
        // Where nothing is selected a tool in hand changes nothing.
        let tint = if selections.iter().any(Option::is_some) { self.tint() } else { Tint::Full };
        let Some(shown) = &mut self.document.clouds else { return };
        let (open_clouds, radius_scale) = (shown.open_clouds.clone(), shown.radius_scale);
        let inputs = DisplayInputs { open_clouds, settings, selections, tint, radius_scale };
        if shown.displayed_of.as_ref().is_some_and(|of| of.is_alike(&inputs)) {
            // A cloud that was saved is the same one.
            shown.displayed_of = Some(inputs);
            return;
        }
        if inputs.is_quick() {
            self.document.display_job = None;
            let outcome = inputs.run();
            self.show_displayed(inputs, outcome);
        } else if self.document.display_job.is_none() {
            match DisplayJob::start(inputs.clone(), ctx) {
                Ok(job) => self.document.display_job = Some(job),
                Err(_none) => {
                    let outcome = inputs.run();
                    self.show_displayed(inputs, outcome);
                }
            }
        }
    }

    /// Shows clouds that were coloured and filtered, unless others are open by now.
    fn show_displayed(&mut self, inputs: DisplayInputs, outcome: DisplayOutcome) {
        let DisplayOutcome { displayed, extent, error } = outcome;
        let Some(shown) = &mut self.document.clouds else { return };
        if shown.open_clouds != inputs.open_clouds {
            return;
        }
        let is_first = shown.displayed_of.is_none();
        shown.show(displayed, inputs, extent);
        // Filters may have hidden what reached far.
        if is_first && shown.frames {
            self.look_first();
        }
        self.views.pointer_position = None;
        if let Some(error) = error {
            self.messages.warn(error);
        }
    }
}

impl VisibleClouds {
    /// Shows them in another way; pictures of them are drawn anew where that differs.
    fn show(&mut self, displayed: DisplayedClouds, of: DisplayInputs, extent: Extent) {
        let is_new = !Arc::ptr_eq(&self.clouds, &displayed.clouds);
        self.clouds = displayed.clouds.clone();
        let is_as_large = of.radius_scale.to_bits() == self.radius_scale.to_bits();
        self.extent = if is_as_large { extent } else { self.clouds.extent(self.radius_scale) };
        (self.displayed, self.displayed_of) = (displayed, Some(of));
        self.revision += u64::from(is_new);
    }
}
