//! One frame of the window: results are taken in, panels and views are shown, requests are sent.

use crate::commands::{keys, menus, toolbar};
use crate::desktop::{screen, title};
use crate::dialogs::files;
use crate::document::recovery::{self, JournalEnd};
use crate::document::unsaved_prompt::is_terminating;
use crate::panels::{sides, status, windows};
use crate::views::{canvas, hands};
use crate::window::Window;
use crate::{export, measure, start, theme};
use eframe::egui::{self, Context, Ui};
use std::time::{Duration, Instant};
use surfelshop_cloud::display::ColorSource;

/// Time between two frames of the window while pictures are pending, on software drivers.
const FRAME_INTERVAL: Duration = Duration::from_millis(20);

/// The same while something moves and no new picture is there: ten a second still follow the pointer elsewhere.
const MOTION_INTERVAL: Duration = Duration::from_millis(100);

impl Window {
    /// Leaves the CPU to the engine: where both draw on the CPU, a frame of the window for every
    /// move of the mouse would delay the pending picture. In motion the window is painted when there is a new one.
    fn limit_frame_rate(&mut self) {
        if self.render.software && self.works() {
            let elapsed = self.render.last_frame.elapsed();
            match self.waits_in_motion() {
                true => self.render.thread.wait(MOTION_INTERVAL.saturating_sub(elapsed)),
                false => std::thread::sleep(FRAME_INTERVAL.saturating_sub(elapsed)),
            }
        }
        self.render.last_frame = Instant::now();
    }

    /// Whether a picture in motion is pending in a view.
    fn waits_in_motion(&self) -> bool {
        self.settings.panes.iter().any(|settings| {
            let sides = self.views.panes.get(&settings.id).map(|pane| &pane.sides);
            sides.is_some_and(|sides| {
                sides[..settings.mode.sides()].iter().any(|side| side.waits_in_motion())
            })
        })
    }

    /// Takes in the edit of a tool that has ended.
    fn take_edits(&mut self, ctx: &Context) {
        let open_clouds = self.document.clouds.as_ref().map(|shown| &shown.open_clouds);
        if let Some(edited) = self.plugins.tools.advance(ctx, open_clouds, &mut self.messages) {
            // Earlier changes are a step of their own.
            self.document.history.record(&self.snapshot());
            self.show_clouds(edited.clouds);
            if let Some(column) = edited.colors_by {
                self.settings.color = ColorSource::of_share(column);
            }
        }
    }

    /// One frame of the window.
    pub(crate) fn frame(&mut self, ui: &mut Ui) {
        let ctx = ui.ctx().clone();
        theme::apply(&ctx, &self.preferences);
        self.check_close(&ctx);
        self.limit_frame_rate();
        self.update_extent();
        self.take_events(&ctx);
        self.take_preview();
        self.take_loaded();
        self.take_saved();
        self.take_edits(&ctx);
        export::advance(self);
        measure::advance(self, &ctx);
        self.take_dropped_files(&ctx);
        files::show(self, &ctx);
        keys::handle(self, &ctx);
        self.advance_flight(&ctx);
        egui::Panel::top("menu").show(ui, |ui| menus::show(self, ui));
        egui::Panel::bottom("status").show(ui, |ui| status::show(self, ui));
        if self.preferences.toolbar {
            egui::Panel::top("toolbar").show(ui, |ui| toolbar::show(self, ui));
        }
        let shows_start_page = self.shows_start_page();
        if !shows_start_page {
            sides::show(self, ui);
        }
        let pictures = egui::CentralPanel::no_frame().show(ui, |ui| match shows_start_page {
            true => start::show_page(self, ui),
            false => canvas::show(self, ui),
        });
        hands::show_options(self, &ctx, pictures.response.rect);
        start::show_progress(self, &ctx, pictures.response.rect);
        self.messages.show(&ctx, pictures.response.rect);
        windows::show(self, &ctx);
        self.save_preferences();
        title::update(self, &ctx);
        screen::fit(&ctx);
        self.update_display(&ctx);
        self.update_measures(&ctx);
        self.copy_shared_camera();
        recovery::update(self, &ctx);
        self.send_requests(&ctx);
        // A stroke is a step once it is over.
        let is_idle = !self.views.hands.is_at_work();
        if is_idle && !ctx.egui_is_using_pointer() && !ctx.input(|input| input.pointer.any_down()) {
            if self.document.preview.is_none() {
                self.document.history.record(&self.snapshot());
            }
            self.save_session(&ctx, false);
        }
    }
}

impl eframe::App for Window {
    fn logic(&mut self, ctx: &Context, _frame: &mut eframe::Frame) {
        self.check_close(ctx);
    }

    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        self.frame(ui);
    }

    fn on_exit(&mut self, _gl: Option<&eframe::glow::Context>) {
        self.save_session(&Context::default(), true);
        // The user has decided about the edits, unless the system ends the program.
        let end = match self.document.close_confirmed && !is_terminating() {
            true => JournalEnd::Remove,
            false => JournalEnd::Keep,
        };
        recovery::end(self, end);
    }
}
