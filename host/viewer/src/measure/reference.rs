//! Background jobs of a measurement: a reference is read or traced, and pictures are compared.

use super::background::BackgroundJob;
use super::plan::{Basis, MOST_PIXELS};
use crate::plugins::mark_in_use;
use eframe::egui::Context;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use surfelshop_api::View;
use surfelshop_api::params::Values;
use surfelshop_evaluate::compare::Truth;
use surfelshop_image::Image;
use surfelshop_image::display_transform::DisplayTransform;
use surfelshop_image::exr;
use surfelshop_image::metrics::Comparison;
use surfelshop_runtime::boundary::Fault;
use surfelshop_runtime::plugins::{LoadedUnit, Timeouts, UnitRef};
use surfelshop_runtime::trace::{TraceOrder, trace};
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::input::environment_map::Probes;
use surfelshop_session::render::traced;

/// Reads a reference from a file.
pub(super) fn read(
    ctx: &Context,
    path: PathBuf,
) -> Result<BackgroundJob<Result<Truth, String>>, String> {
    BackgroundJob::start(ctx, move || {
        let picture = exr::read_color(&path, MOST_PIXELS);
        let picture = picture.map_err(|error| format!("{error:#}"))?;
        let name = path.display().to_string();
        Ok(Truth { name, picture, variance: None, candidate: None })
    })
}

/// Compares a picture with the reference.
pub(super) fn compare(
    ctx: &Context,
    picture: Image,
    reference: Arc<Truth>,
    display: DisplayTransform,
) -> Result<BackgroundJob<Result<Comparison, String>>, String> {
    BackgroundJob::start(ctx, move || reference.compare(&picture, display))
}

/// What a tracer draws.
pub(super) struct TraceInput {
    pub(super) tracer: UnitRef,
    pub(super) unit: LoadedUnit,
    pub(super) values: Values,
    pub(super) clouds: Arc<Clouds>,
    pub(super) view: View,
}

/// Why a tracer drew no picture.
pub(super) enum TraceError {
    /// The cause is not the tracer.
    Other(String),
    Fault(Fault),
}

/// A running tracer.
pub(super) struct TraceJob {
    pub(super) tracer: UnitRef,
    pub(super) unit: LoadedUnit,
    job: BackgroundJob<Result<Truth, TraceError>>,
    stop: Arc<AtomicBool>,
    /// The progress in thousandths.
    progress: Arc<AtomicU32>,
}

impl TraceJob {
    /// Starts the tracer.
    pub(super) fn start(
        ctx: &Context,
        basis: &Basis,
        traced: TraceInput,
        timeouts: Timeouts,
    ) -> Result<Self, String> {
        let (stop, progress) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicU32::new(0)));
        let (tracer, unit) = (traced.tracer.clone(), traced.unit.clone());
        let (scene, environment) = (basis.scene.clone(), basis.environment.clone());
        let name = basis.source.name();
        let (stopped, reported, wake) = (stop.clone(), progress.clone(), ctx.clone());
        let job = BackgroundJob::start(ctx, move || {
            let TraceInput { tracer, unit, values, clouds, view } = traced;
            let _mark = mark_in_use(&tracer);
            let light = environment.map(|environment| Probes::default().light(&environment, drop));
            let light =
                light.transpose().map_err(|error| TraceError::Other(format!("{error:#}")))?;
            let order = TraceOrder {
                // One core is left for the window and its views.
                threads: std::thread::available_parallelism()
                    .map_or(1, |n| n.get().saturating_sub(1).max(1)),
                ..traced::order(&unit, &values, &clouds, &scene, light.as_ref(), view)
            };
            let picture = trace(&unit, order, &timeouts, |fraction| {
                let now = (1000.0 * fraction) as u32;
                if reported.swap(now, Ordering::Relaxed) != now {
                    wake.request_repaint();
                }
                !stopped.load(Ordering::Relaxed)
            });
            let traced = picture.map_err(TraceError::Fault)?;
            let variance = (traced.samples > 1).then_some(traced.variance);
            Ok(Truth { name, picture: traced.color, variance, candidate: None })
        })?;
        Ok(Self { tracer, unit, job, stop, progress })
    }

    /// The picture as a reference, once it is there.
    pub(super) fn result(&self) -> Option<Result<Truth, TraceError>> {
        let made = self.job.result()?;
        Some(made.unwrap_or_else(|line| Err(TraceError::Other(line))))
    }

    /// The progress in [0, 1].
    pub(super) fn fraction(&self) -> f32 {
        self.progress.load(Ordering::Relaxed) as f32 / 1000.0
    }

    /// Stops the tracer.
    pub(super) fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    pub(super) fn is_stopping(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
