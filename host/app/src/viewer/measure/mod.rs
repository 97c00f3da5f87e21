//! Pictures measured in the window: those of a view against a reference, and a renderer's error against
//! its time while one of its parameters is turned.
//!
//! `form` is what is chosen and `plan` what that comes to; `measurement` takes one step after the
//! other, each of them a picture that the darkroom makes or something that `truth` has a thread for.
//! `panel` is what stands beside the pictures, with a `table` and a `plot`.
//!
//! Invariants: no step is waited for; pictures of views go before those that are measured; the numbers
//! are those of `compare` and `report`; when a measurement ends, nothing of it is left but numbers and
//! the picture that it was measured against, for the next one.

mod form;
mod measurement;
pub(crate) mod panel;
mod plan;
mod plot;
mod table;
mod truth;

#[cfg(test)]
pub(crate) use form::Against;
pub(crate) use form::Form;
#[cfg(test)]
pub(crate) use measurement::State;
pub(crate) use measurement::{Measurement, PANE};
pub(crate) use plan::Kind;

use super::darkroom::{self, Shot};
use super::shelf::{Readiness, Shelf};
use super::window::Window;
use crate::arguments::PluginFiles;
use crate::compare::Truth;
use eframe::egui::Context;
use measurement::{Step, Waiting};
use plan::{Basis, Source};
use std::sync::Arc;
use std::time::Duration;
use surfelshop_api::UnitKind;
use surfelshop_api::abi::host_side::Fault;
use surfelshop_api::job::CANCELLED;
use surfelshop_api::params::Values;
use surfelshop_engine::plugins::{Patience, Standing};
use truth::{Tracing, Untraced};

/// Time between two looks at a tracer that is being loaded.
const TICK: Duration = Duration::from_millis(100);

/// Measurements of the window: the last one of each kind, of which at most one is at work.
pub(crate) struct Measure {
    pub(crate) form: Form,
    pub(crate) present: Option<Measurement>,
    pub(crate) sweep: Option<Measurement>,
    /// Tracers.
    pub(crate) shelf: Shelf,
    /// Counts the pictures that were drawn again since a plugin or a file had changed.
    pub(crate) remade: u64,
    /// What was measured against last, and what it depends on.
    known: Option<(Basis, Arc<Truth>)>,
    patience: Patience,
}

impl Measure {
    pub(crate) fn new(plugins: &PluginFiles) -> Self {
        let patience = plugins.patience();
        Self {
            form: Form::default(),
            present: None,
            sweep: None,
            shelf: Shelf::new(UnitKind::Tracer, patience),
            remade: 0,
            known: None,
            patience,
        }
    }

    /// The last measurement of a kind.
    pub(crate) fn of(&self, kind: Kind) -> Option<&Measurement> {
        match kind {
            Kind::Present => self.present.as_ref(),
            Kind::Sweep => self.sweep.as_ref(),
        }
    }

    /// The one at work.
    fn at_work(&mut self) -> Option<&mut Measurement> {
        [&mut self.present, &mut self.sweep].into_iter().flatten().find(|one| one.is_at_work())
    }

    /// Whether one is at work.
    pub(crate) fn is_busy(&self) -> bool {
        [&self.present, &self.sweep].into_iter().flatten().any(Measurement::is_at_work)
    }

    fn is_tracing(&self) -> bool {
        let all = [&self.present, &self.sweep].into_iter().flatten();
        all.filter_map(|one| one.waiting()).any(|what| matches!(what, Waiting::Tracer(_)))
    }
}

impl Drop for Measure {
    /// A tracer that still works has no part in the end of the program, which must not wait for it.
    fn drop(&mut self) {
        if self.is_tracing() {
            darkroom::abandon();
        }
    }
}

/// Begins a measurement, instead of the last one of its kind; why it cannot, in a line.
pub(crate) fn begin(window: &mut Window, kind: Kind) -> Result<(), String> {
    if window.measure.is_busy() {
        return Err("another measurement is at work".to_owned());
    }
    if window.crash.is_some() || window.no_device {
        return Err("nothing can be drawn".to_owned());
    }
    let plan = plan::plan(window, kind)?;
    // A file is read again: it may be another one by now.
    let keeps = !matches!(plan.basis.source, Source::Picture(_));
    let wanted = plan.basis.of_truth();
    let known = window.measure.known.take().filter(|(of, _)| keeps && *of == wanted);
    let truth = known.as_ref().map(|(_, truth)| truth.clone());
    window.measure.known = known;
    let begun = Some(Measurement::new(plan, truth));
    match kind {
        Kind::Present => window.measure.present = begun,
        Kind::Sweep => window.measure.sweep = begun,
    }
    Ok(())
}

/// Ends the measurement at work. A tracer is asked to stop, and what comes of that ends it.
pub(crate) fn cancel(window: &mut Window) {
    let Some(measurement) = window.measure.at_work() else { return };
    if let Some(Waiting::Tracer(tracing)) = measurement.waiting() {
        tracing.stop();
    } else {
        measurement.cancel();
        clear(window);
    }
}

/// Takes a picture that was made to be measured. One of a measurement that is over comes late and is
/// let go.
pub(crate) fn take(window: &mut Window, serial: u64, outcome: Result<Shot, String>) {
    if let Some(measurement) = window.measure.at_work() {
        measurement.take_picture(serial, outcome);
    }
}

/// Takes what threads have made, and the next step.
pub(crate) fn go_on(window: &mut Window, ctx: &Context) {
    if window.no_device
        && let Some(measurement) = window.measure.at_work()
    {
        measurement.fail("there is no graphics device".to_owned());
    }
    take_made(window);
    let step = window.measure.at_work().and_then(Measurement::next_step);
    if let Some(step) = step {
        let begun = take_step(window, ctx, step);
        if let (Err(line), Some(measurement)) = (begun, window.measure.at_work()) {
            measurement.fail(line);
        }
    }
    clear(window);
}

/// Takes what is waited for, if a thread has made it.
fn take_made(window: &mut Window) {
    let Some(measurement) = window.measure.at_work() else { return };
    match measurement.waiting() {
        Some(Waiting::File(coming)) => match coming.arrived() {
            None => {}
            Some(Ok(Ok(truth))) => measurement.take_truth(truth),
            Some(Ok(Err(line)) | Err(line)) => measurement.fail(line),
        },
        Some(Waiting::Numbers(i, coming)) => {
            let i = *i;
            if let Some(compared) = coming.arrived() {
                measurement.take_numbers(i, compared.and_then(|compared| compared));
            }
        }
        Some(Waiting::Tracer(tracing)) => {
            if let Some(made) = tracing.arrived() {
                take_traced(window, made);
            }
        }
        Some(Waiting::Nothing | Waiting::Picture(..)) | None => {}
    }
}

/// Takes a traced picture, or what kept it from being made.
fn take_traced(window: &mut Window, made: Result<Truth, Untraced>) {
    let Measure { present, sweep, shelf, patience, .. } = &mut window.measure;
    let mut all = [present, sweep].into_iter().flatten();
    let Some(measurement) = all.find(|one| one.is_at_work()) else { return };
    let Some(Waiting::Tracer(tracing)) = measurement.waiting() else { return };
    let (unit, contents, stops) =
        (tracing.reference.clone(), tracing.unit.contents, tracing.is_stopping());
    match made {
        Ok(_) if stops => measurement.cancel(),
        Ok(truth) => {
            shelf.conduct.succeeded(&unit, contents);
            measurement.take_truth(truth);
        }
        Err(Untraced::Otherwise(line)) => measurement.fail(line),
        Err(Untraced::Fault(Fault::Error(line))) if stops && line == CANCELLED => {
            measurement.cancel();
        }
        Err(Untraced::Fault(fault)) => {
            if shelf.conduct.failed(&unit, contents, &fault) == Standing::Off {
                shelf.put_away(&unit.id);
                shelf.put_away(&format!("{}/{}", unit.package, unit.id));
            }
            let line = match (&fault, stops) {
                (Fault::TimedOut(_), true) => {
                    darkroom::abandon();
                    format!(
                        "{unit} did not stop within {} s; it was left behind and is switched off",
                        patience.cancel.as_secs_f64()
                    )
                }
                _ => format!("{unit}: {fault}; there is nothing to measure against"),
            };
            window.messages.warn(line.clone());
            measurement.fail(line);
        }
    }
}

/// Begins a step; why it cannot be taken, in a line.
fn take_step(window: &mut Window, ctx: &Context, step: Step) -> Result<(), String> {
    let serial = window.next_serial();
    let Some(measurement) = window.measure.at_work() else { return Ok(()) };
    let source = measurement.basis.source.clone();
    let waiting = match (step, source) {
        (Step::Truth, Source::Picture(path)) => Waiting::File(truth::read(ctx, path)?),
        (Step::Truth, Source::Tracer { name, values }) => {
            let Some(tracing) = trace(window, ctx, &name, values)? else {
                // Its code is on the way.
                if let Some(measurement) = window.measure.at_work() {
                    measurement.put_back(step);
                }
                ctx.request_repaint_after(TICK);
                return Ok(());
            };
            Waiting::Tracer(Box::new(tracing))
        }
        (Step::Compare(i), _) => {
            let Some((picture, truth)) = measurement.pair() else { return Ok(()) };
            let how = measurement.basis.development;
            Waiting::Numbers(i, truth::compare(ctx, picture, truth, how)?)
        }
        (Step::Truth | Step::Draw(_) | Step::Time(_), _) => {
            let Some((place, order)) = measurement.order(step, serial) else { return Ok(()) };
            window.darkroom.order(place, order);
            Waiting::Picture(serial, step)
        }
    };
    if let Some(measurement) = window.measure.at_work() {
        measurement.wait_for(waiting);
    }
    Ok(())
}

/// Starts a tracer; `None` while it is being loaded.
fn trace(
    window: &mut Window,
    ctx: &Context,
    name: &str,
    values: Values,
) -> Result<Option<Tracing>, String> {
    let Window { measure, registry, .. } = window;
    measure.shelf.prepare(ctx, registry, name);
    let unit = match measure.shelf.readiness(name) {
        Readiness::Loading => return Ok(None),
        Readiness::Refused(reason) => return Err(reason.to_owned()),
        Readiness::Ready(unit) => unit.clone(),
    };
    let reference = registry.find(UnitKind::Tracer, name).map_err(|error| error.to_string())?;
    measure.shelf.conduct.check(&reference).map_err(|barred| barred.to_string())?;
    let patience = measure.patience;
    let Some(measurement) = measure.at_work() else { return Ok(None) };
    let Some((clouds, view)) = measurement.seen() else { return Ok(None) };
    let order = truth::Traced { reference, unit, values, clouds, view };
    Tracing::start(ctx, &measurement.basis, order, patience).map(Some)
}

/// Lets go of what a measurement that has ended worked with, but for what it was measured against.
fn clear(window: &mut Window) {
    let Measure { present, sweep, known, .. } = &mut window.measure;
    for measurement in [present, sweep].into_iter().flatten().filter(|one| !one.is_at_work()) {
        let places = measurement.places();
        let Some(truth) = measurement.let_go() else { continue };
        places.for_each(|place| window.darkroom.let_go(place));
        if let Some(truth) = truth {
            *known = Some((measurement.basis.of_truth(), truth));
        }
    }
}
