//! Measurements proceed step by step.

use super::measurement::{Measurement, Pending, Step};
use super::plan::{Kind, ReferenceSource};
use super::planning;
use super::reference::{self, TraceError, TraceInput, TraceJob};
use super::state::Measure;
use crate::plugins::Readiness;
use crate::render_thread::{RenderedView, mark_abandoned};
use crate::window::Window;
use eframe::egui::Context;
use std::time::Duration;
use surfelshop_api::UnitKind;
use surfelshop_api::job::CANCELLED;
use surfelshop_api::params::Values;
use surfelshop_evaluate::compare::Truth;
use surfelshop_runtime::boundary::Fault;
use surfelshop_runtime::plugins::UnitState;

/// Time between two checks of a tracer that is being loaded.
const POLL_INTERVAL: Duration = Duration::from_millis(100);

/// Begins a measurement, which replaces the last one of its kind; an error in one line where it cannot.
pub(crate) fn begin(window: &mut Window, kind: Kind) -> Result<(), String> {
    if window.measure.is_busy() {
        return Err("another measurement is at work".to_owned());
    }
    if window.plugins.crash.is_some() || window.render.no_device {
        return Err("nothing can be drawn".to_owned());
    }
    let plan = planning::plan(window, kind)?;
    // A file is read again, since it may have changed.
    let keeps = !matches!(plan.basis.source, ReferenceSource::Picture(_));
    let inputs = plan.basis.reference_inputs();
    let known = window.measure.known.take().filter(|(of, _)| keeps && *of == inputs);
    let reference = known.as_ref().map(|(_, reference)| reference.clone());
    window.measure.known = known;
    let begun = Some(Measurement::new(plan, reference));
    match kind {
        Kind::CurrentView => window.measure.current_view = begun,
        Kind::Series => window.measure.series = begun,
    }
    Ok(())
}

/// Cancels the running measurement. One that waits for a tracer ends with the tracer.
pub(crate) fn cancel(window: &mut Window) {
    let Some(measurement) = window.measure.running() else { return };
    if let Some(Pending::Tracer(tracing)) = measurement.pending() {
        tracing.stop();
    } else {
        measurement.cancel();
        clear(window);
    }
}

/// Takes in a measured picture. One of an ended measurement comes late and is dropped.
pub(crate) fn take_reply(window: &mut Window, serial: u64, outcome: Result<RenderedView, String>) {
    if let Some(measurement) = window.measure.running() {
        measurement.take_picture(serial, outcome);
    }
}

/// Takes in the results of background jobs, and begins the next step.
pub(crate) fn advance(window: &mut Window, ctx: &Context) {
    if window.render.no_device
        && let Some(measurement) = window.measure.running()
    {
        measurement.fail("there is no graphics device".to_owned());
    }
    take_result(window);
    let step = window.measure.running().and_then(Measurement::next_step);
    if let Some(step) = step {
        let begun = begin_step(window, ctx, step);
        if let (Err(line), Some(measurement)) = (begun, window.measure.running()) {
            measurement.fail(line);
        }
    }
    clear(window);
}

/// Takes in the result of the pending background job.
fn take_result(window: &mut Window) {
    let Some(measurement) = window.measure.running() else { return };
    match measurement.pending() {
        Some(Pending::File(job)) => match job.result() {
            None => {}
            Some(Ok(Ok(reference))) => measurement.take_reference(reference),
            Some(Ok(Err(line)) | Err(line)) => measurement.fail(line),
        },
        Some(Pending::Numbers(i, job)) => {
            let i = *i;
            if let Some(compared) = job.result() {
                measurement.take_numbers(i, compared.and_then(|compared| compared));
            }
        }
        Some(Pending::Tracer(tracing)) => {
            if let Some(made) = tracing.result() {
                take_traced(window, made);
            }
        }
        Some(Pending::Nothing | Pending::Picture(..)) | None => {}
    }
}

/// Takes in a traced reference, or the tracer's failure.
fn take_traced(window: &mut Window, made: Result<Truth, TraceError>) {
    let Measure { current_view, series, units, timeouts, .. } = &mut window.measure;
    let mut all = [current_view, series].into_iter().flatten();
    let Some(measurement) = all.find(|one| one.is_running()) else { return };
    let Some(Pending::Tracer(tracing)) = measurement.pending() else { return };
    let (unit, contents, stops) =
        (tracing.tracer.clone(), tracing.unit.contents, tracing.is_stopping());
    match made {
        Ok(_) if stops => measurement.cancel(),
        Ok(reference) => {
            units.health.succeeded(&unit, contents);
            measurement.take_reference(reference);
        }
        Err(TraceError::Other(line)) => measurement.fail(line),
        Err(TraceError::Fault(Fault::Error(line))) if stops && line == CANCELLED => {
            measurement.cancel();
        }
        Err(TraceError::Fault(fault)) => {
            if units.health.failed(&unit, contents, &fault) == UnitState::Off {
                units.unload(&unit.id);
                units.unload(&format!("{}/{}", unit.package, unit.id));
            }
            let line = match (&fault, stops) {
                (Fault::TimedOut(_), true) => {
                    mark_abandoned();
                    format!(
                        "{unit} did not stop within {} s; it was left behind and is switched off",
                        timeouts.cancel.as_secs_f64()
                    )
                }
                _ => format!("{unit}: {fault}; there is nothing to measure against"),
            };
            window.messages.warn(line.clone());
            measurement.fail(line);
        }
    }
}

/// Begins a step; an error in one line where it cannot.
fn begin_step(window: &mut Window, ctx: &Context, step: Step) -> Result<(), String> {
    let serial = window.next_serial();
    let Some(measurement) = window.measure.running() else { return Ok(()) };
    let source = measurement.basis.source.clone();
    let pending = match (step, source) {
        (Step::Reference, ReferenceSource::Picture(path)) => {
            Pending::File(reference::read(ctx, path)?)
        }
        (Step::Reference, ReferenceSource::Tracer { name, values }) => {
            let Some(tracing) = trace(window, ctx, &name, values)? else {
                // It is being loaded.
                if let Some(measurement) = window.measure.running() {
                    measurement.put_back(step);
                }
                ctx.request_repaint_after(POLL_INTERVAL);
                return Ok(());
            };
            Pending::Tracer(Box::new(tracing))
        }
        (Step::Compare(i), _) => {
            let Some((picture, reference)) = measurement.pair() else { return Ok(()) };
            let how = measurement.basis.display;
            Pending::Numbers(i, reference::compare(ctx, picture, reference, how)?)
        }
        (Step::Reference | Step::Draw(_) | Step::Time(_), _) => {
            let Some((slot, request)) = measurement.request(step, serial) else { return Ok(()) };
            window.render.thread.request(slot, request);
            Pending::Picture(serial, step)
        }
    };
    if let Some(measurement) = window.measure.running() {
        measurement.set_pending(pending);
    }
    Ok(())
}

/// Starts a tracer; `None` while it is being loaded.
fn trace(
    window: &mut Window,
    ctx: &Context,
    name: &str,
    values: Values,
) -> Result<Option<TraceJob>, String> {
    let (measure, registry) = (&mut window.measure, &window.plugins.registry);
    measure.units.prepare(ctx, registry, name);
    let unit = match measure.units.readiness(name) {
        Readiness::Loading => return Ok(None),
        Readiness::Refused(reason) => return Err(reason.to_owned()),
        Readiness::Ready(unit) => unit.clone(),
    };
    let tracer = registry.find(UnitKind::Tracer, name).map_err(|error| error.to_string())?;
    measure.units.health.check(&tracer).map_err(|refusal| refusal.to_string())?;
    let timeouts = measure.timeouts;
    let Some(measurement) = measure.running() else { return Ok(None) };
    let Some((clouds, view)) = measurement.subject_view() else { return Ok(None) };
    let input = TraceInput { tracer, unit, values, clouds, view };
    TraceJob::start(ctx, &measurement.basis, input, timeouts).map(Some)
}

/// Releases the resources of ended measurements, and keeps the reference.
fn clear(window: &mut Window) {
    let Measure { current_view, series, known, .. } = &mut window.measure;
    for measurement in [current_view, series].into_iter().flatten().filter(|one| !one.is_running())
    {
        let slots = measurement.slots();
        let Some(reference) = measurement.release() else { continue };
        slots.for_each(|slot| window.render.thread.release(slot));
        if let Some(reference) = reference {
            *known = Some((measurement.basis.reference_inputs(), reference));
        }
    }
}
