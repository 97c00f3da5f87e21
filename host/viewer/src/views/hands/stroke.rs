//! Tools that are led: what a tool makes of a stroke is shown while it goes on, and is a step of undo once it is over.

use super::state::Gesture;
use super::stroke_run::StrokeRun;
use crate::document::{OpenClouds, generations};
use crate::plugins::{Readiness, mark_in_use};
use crate::render_thread::mark_abandoned;
use crate::window::Window;
use eframe::egui::Context;
use std::sync::Arc;
use std::time::Duration;
use surfelshop_api::columns::COLOR;
use surfelshop_api::{Handling, Stroke, UnitKind};
use surfelshop_cloud::display::ColorBy;
use surfelshop_cloud::{Cloud, CloudPart};
use surfelshop_runtime::plugins::UnitState;
use surfelshop_runtime::tools::{Ended, Running};

impl Window {
    /// Leads a tool along the gesture so far; `over` where it has ended.
    pub(super) fn lead_tool(&mut self, ctx: &Context, name: &str, over: bool) {
        self.plugins.tools.units.prepare(ctx, &self.plugins.registry, name);
        let handling = match self.plugins.tools.units.readiness(name) {
            Readiness::Ready(unit) => unit.description.handling,
            Readiness::Loading => return,
            Readiness::Refused(reason) => {
                let line = format!("{name}: {reason}");
                if over {
                    self.messages.warn(line);
                }
                return;
            }
        };
        let Some(gesture) = &self.views.hands.gesture else { return };
        let stroke = self.stroke_of(gesture, handling);
        if stroke.samples.is_empty() {
            return;
        }
        if self.views.hands.stroke.is_none() {
            match self.begin_stroke(name, &stroke) {
                Ok(begun) => self.views.hands.stroke = Some(begun),
                Err(line) => {
                    if over {
                        self.messages.warn(line);
                    }
                    return;
                }
            }
        }
        if let Some(run) = &mut self.views.hands.stroke {
            run.whole = over.then(|| stroke.clone());
        }
        self.start_run(&stroke);
        self.advance_stroke(ctx);
    }

    fn stroke_of(&self, gesture: &Gesture, handling: Handling) -> Stroke {
        let samples = match handling {
            Handling::Click(_) => gesture.samples.iter().take(1).copied().collect(),
            _ => gesture.samples.clone(),
        };
        Stroke { radius: gesture.radius, dabs: self.dabs_of(handling), samples }
    }

    /// The visible cloud of which a stroke concerns most surfels.
    fn begin_stroke(&self, name: &str, stroke: &Stroke) -> Result<StrokeRun, String> {
        let reference = self.plugins.registry.find(UnitKind::Tool, name);
        let reference = reference.map_err(|error| error.to_string())?;
        let health = &self.plugins.tools.units.health;
        health.check(&reference).map_err(|refusal| refusal.to_string())?;
        if self.plugins.crash.is_some() {
            return Err("no plugin runs before the question about the crash is answered".to_owned());
        }
        let mut most: Option<(usize, usize, Cloud)> = None;
        for (index, _, cloud) in self.hand_clouds() {
            let selection = self.led_over(&cloud);
            let part = CloudPart::along(&cloud, stroke, selection.as_deref());
            let n = part.map_err(|error| error.to_string())?.rows.len();
            if n > most.as_ref().map_or(0, |(most, ..)| *most) {
                most = Some((n, index, cloud));
            }
        }
        let found = match most {
            Some((_, index, base)) => Some((index, base, None)),
            None => self.pyramid_near(stroke)?,
        };
        let (index, base, regions) = found.ok_or_else(|| match self.n_selected() {
            (0, _) => format!("{name}: no surfel is near the stroke"),
            _ => format!("{name}: the stroke goes over nothing that is selected"),
        })?;
        let shown = self.document.clouds.as_ref().ok_or("no cloud is open")?;
        Ok(StrokeRun {
            name: name.to_owned(),
            mark: mark_in_use(&reference),
            reference,
            index,
            before: shown.open_clouds.clone(),
            base,
            regions,
            running: None,
            given: None,
            paints: false,
            n_samples: 0,
            whole: None,
        })
    }

    /// Starts the tool over a stroke, unless it is at work or knows as much of it.
    fn start_run(&mut self, stroke: &Stroke) {
        let Some(run) = &mut self.views.hands.stroke else { return };
        if run.running.is_some() || run.n_samples == stroke.samples.len() {
            return;
        }
        let Readiness::Ready(unit) = self.plugins.tools.units.readiness(&run.name) else { return };
        let values = self.plugins.tools.values.get(&run.name).cloned().unwrap_or_default();
        let (base, contents) = (run.base.clone(), unit.contents);
        run.n_samples = stroke.samples.len();
        run.given = Some((values.clone(), stroke.clone()));
        let selection = match &run.regions {
            Some(regions) => regions.select_in_world(&base).map(|some| Some(Arc::new(some))),
            None => Ok(self.led_over(&base)),
        };
        let started = selection
            .map_err(|error| error.to_string())
            .and_then(|some| {
                let part = CloudPart::along(&base, stroke, some.as_deref());
                part.map_err(|error| error.to_string())
            })
            .and_then(|part| {
                let options = self.plugins.tools.options();
                let running = Running::start_on(unit, &values, part, Some(stroke.clone()), options);
                running.map_err(|fault| fault.to_string())
            });
        match (started, &mut self.views.hands.stroke) {
            (Ok(running), Some(run)) => run.running = Some((running, contents)),
            (Err(line), _) => self.fail_stroke(&line),
            _ => {}
        }
    }

    /// Takes in what the tool made of the stroke so far.
    pub(super) fn advance_stroke(&mut self, ctx: &Context) {
        let Some(run) = &mut self.views.hands.stroke else { return };
        let Some((running, contents)) = &mut run.running else { return self.go_on(ctx) };
        let contents = *contents;
        let Some(ended) = running.wait(Duration::ZERO) else {
            ctx.request_repaint();
            return;
        };
        run.running = None;
        let (reference, name) = (run.reference.clone(), run.name.clone());
        let units = &mut self.plugins.tools.units;
        match ended.fault() {
            Some(fault) => {
                if units.health.failed(&reference, contents, &fault) == UnitState::Off {
                    units.unload(&name);
                }
            }
            None => units.health.succeeded(&reference, contents),
        }
        match ended {
            Ended::Done(done) => {
                let columns = done.edited.as_ref().map(|edited| &edited.columns[..]);
                let paints = columns.is_some_and(|all| all.iter().any(|name| name == COLOR));
                if let Some(run) = &mut self.views.hands.stroke {
                    run.paints |= paints;
                }
                let run = self.views.hands.stroke.as_ref();
                if run.is_some_and(|run| run.regions.is_some()) {
                    let shown = done.edited.map(|edited| self.show_stroke_of_pyramid(&edited));
                    if let Some(Err(line)) = shown {
                        return self.fail_stroke(&line);
                    }
                } else if let (Some(edited), Some(run)) = (done.edited, run) {
                    if edited.cloud.is_empty() {
                        return self
                            .fail_stroke("it leaves no surfel; a cloud cannot be without any");
                    }
                    let clouds = run.before.edited(run.index, edited.cloud.clone());
                    let selection = self.views.hands.selection_of(&run.base);
                    // What was moved is selected still, and what was added beside it, too.
                    let selection = selection
                        .map(|before| before.followed(edited.kept.as_deref(), edited.n_added));
                    match selection.transpose() {
                        Ok(selection) => {
                            let some = selection.filter(|selection| !selection.is_empty());
                            self.views.hands.set_selection(&edited.cloud, some.map(Arc::new));
                        }
                        Err(error) => return self.fail_stroke(&error.to_string()),
                    }
                    self.show_clouds(clouds);
                }
                self.go_on(ctx);
            }
            Ended::Cancelled => self.fail_stroke("it was cancelled"),
            Ended::Failed(fault) => self.fail_stroke(&fault.to_string()),
            Ended::LeftBehind(limit) => {
                mark_abandoned();
                let seconds = limit.as_secs_f64();
                self.fail_stroke(&format!(
                    "it did not stop within {seconds} s; it was left behind and is switched off"
                ));
            }
        }
    }

    /// Goes on with what is new of the stroke, and ends it where that is all.
    fn go_on(&mut self, ctx: &Context) {
        let Some(run) = &self.views.hands.stroke else { return };
        match &run.whole {
            Some(whole) if run.n_samples >= whole.samples.len() => {
                let n = run.n_samples;
                self.views.hands.said = format!("{}: a stroke of {n} samples", run.name);
                self.tell_of_hidden_colors();
                self.views.hands.stroke = None;
                self.document.history.record(&self.snapshot());
            }
            Some(whole) => {
                let whole = whole.clone();
                self.start_run(&whole);
            }
            None => {}
        }
        ctx.request_repaint();
    }

    /// Says where colours were painted that the colours of the view do not show.
    fn tell_of_hidden_colors(&mut self) {
        let is_painted = self.views.hands.stroke.as_ref().is_some_and(|run| run.paints);
        if is_painted && self.settings.color.by != ColorBy::File {
            self.views.hands.said += "; its colours do not show: the cloud is coloured by something else (Properties > colours)";
        }
    }

    /// Shows the clouds as they were before a stroke that failed, and says why.
    fn fail_stroke(&mut self, why: &str) {
        self.views.hands.gesture = None;
        let Some(run) = self.views.hands.stroke.take() else { return };
        let name = run.reference.to_string();
        self.bring_back(&run);
        self.messages.warn(format!("{name} failed, and the stroke was undone: {why}"));
    }

    /// Ends a stroke without a trace.
    pub(super) fn cancel_stroke(&mut self) {
        if let Some(run) = self.views.hands.stroke.take() {
            self.bring_back(&run);
        }
    }

    fn bring_back(&mut self, run: &StrokeRun) {
        let Some(shown) = &self.document.clouds else { return };
        // Nobody else may have changed other clouds meanwhile.
        let others = |clouds: &OpenClouds| -> Vec<Vec<u64>> {
            let all = clouds.all().iter().enumerate().filter(|(i, _)| *i != run.index);
            all.map(|(_, open)| generations(&open.loaded.cloud)).collect()
        };
        if others(&shown.open_clouds) == others(&run.before) {
            self.show_clouds(run.before.clone());
        }
    }
}
