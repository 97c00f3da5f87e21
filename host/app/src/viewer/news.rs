//! What the thread that makes pictures tells, and what the window does about it.

use super::darkroom::{News, Print, UnitConduct};
use super::export;
use super::measure;
use super::pane::Shown;
use super::window::Window;
use crate::settings;
use eframe::egui::Context;

impl Window {
    /// Takes what the other thread tells.
    pub(crate) fn take_news(&mut self, ctx: &Context) {
        for news in self.darkroom.news() {
            match news {
                News::Open { adapter, software } => {
                    self.adapter = adapter;
                    self.software = software;
                }
                // The first reason is the one: the thread ends after it.
                News::NoDevice(_) if self.no_device => {}
                News::NoDevice(reason) => {
                    self.no_device = true;
                    self.messages.warn(reason);
                }
                News::Declared { renderer, parameters } => {
                    let known = self.declared.insert(renderer.clone(), parameters);
                    if known != self.declared.get(&renderer).cloned() {
                        self.fit_values(&renderer);
                    }
                }
                News::Preparing { place, renderer } => {
                    if let Some(pane) = self.panes.get_mut(&place.pane) {
                        pane.sides[place.side].preparing = Some(renderer);
                    }
                }
                News::Arriving(fraction) => self.arriving = fraction,
                News::Print(print) => self.take_print(ctx, *print),
                News::Counters(counters) => self.counters = counters,
                News::Plugins(registry) => {
                    self.registry = registry;
                    self.tools.shelf.forget();
                    self.measure.shelf.forget();
                    self.measure.remade += 1;
                    self.try_again();
                }
                News::Reloaded(report) => self.messages.tell(report),
                News::Conduct(conduct) => {
                    let off = |all: &[UnitConduct]| all.iter().filter(|unit| unit.off).count();
                    let fewer = off(&conduct) < off(&self.conduct);
                    self.conduct = conduct;
                    if fewer {
                        self.try_again();
                    }
                }
                News::Message(line) => self.messages.warn(line),
            }
        }
    }

    /// Orders pictures again that could not be made: what kept them from it may be gone.
    fn try_again(&mut self) {
        for side in self.panes.values_mut().flat_map(|pane| &mut pane.sides) {
            side.try_again();
        }
    }

    /// Brings the values of a renderer to what it declares, and says which were meant otherwise.
    pub(crate) fn fit_values(&mut self, renderer: &str) {
        let Some(declared) = self.declared.get(renderer) else { return };
        let folder = self.scene_file.as_ref().map(|file| file.folder.clone()).unwrap_or_default();
        for values in self.settings.panes.iter_mut().filter_map(|p| p.values.get_mut(renderer)) {
            for line in settings::fit(renderer, declared, values, &folder) {
                self.messages.warn(line);
            }
        }
    }

    /// Shows a picture. A renderer that failed gives way to the one whose picture is shown.
    fn take_print(&mut self, ctx: &Context, print: Print) {
        let Print { place, serial, renderer, outcome } = print;
        if place == export::PLACE {
            export::take(self, serial, outcome);
            return;
        }
        if place.pane == measure::PANE {
            measure::take(self, serial, outcome);
            return;
        }
        let Some(pane) = self.panes.get_mut(&place.pane) else { return };
        if let Ok(shot) = &outcome {
            let detail = shot.describe_detail();
            let passes: Vec<String> = (shot.passes.iter())
                .filter_map(|pass| Some(format!("{} {:.1}", pass.name, pass.gpu_ms?)))
                .collect();
            let (ms, passes) = (shot.milliseconds, passes.join(", "));
            tracing::debug!(pane = place.pane, renderer, ms, detail, passes, "picture");
        }
        let failed = outcome.as_ref().err().cloned();
        let side = &mut pane.sides[place.side];
        let same = |shown: &Shown| shown.serial == serial && shown.shot.is_whole();
        if side.shown.as_ref().is_some_and(same) {
            // The same order again: a plugin or a file that it names is another one now.
            self.measure.remade += 1;
        }
        side.take(ctx, place, renderer.clone(), serial, outcome);
        let Some(reason) = failed else { return };
        let before = side.shown.as_ref().map(|shown| shown.renderer.clone());
        self.messages.warn(format!("{renderer}: {reason}"));
        if let Some(before) = before
            && before != renderer
            && let Some(pane) = self.settings.pane_mut(place.pane)
            && pane.renderers[place.side] == renderer
        {
            pane.renderers[place.side] = before;
        }
    }
}
