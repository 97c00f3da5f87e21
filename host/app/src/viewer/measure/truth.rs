//! What is waited for besides pictures of the darkroom, each on a thread of its own: a reference that
//! is read or traced, and the comparing of pictures.

use super::plan::{Basis, MOST_PIXELS};
use crate::clouds::Clouds;
use crate::compare::Truth;
use crate::exr_file;
use crate::surroundings::Probes;
use crate::traced;
use crate::viewer::shelf::mark;
use eframe::egui::Context;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use surfelshop_api::View;
use surfelshop_api::abi::host_side::Fault;
use surfelshop_api::params::Values;
use surfelshop_engine::Image;
use surfelshop_engine::metrics::Comparison;
use surfelshop_engine::picture::Development;
use surfelshop_engine::plugins::{LoadedUnit, Patience, UnitRef};
use surfelshop_engine::trace::{TraceOrder, trace};

/// Something that a thread makes.
pub(super) struct Coming<T>(Receiver<T>);

impl<T: Send + 'static> Coming<T> {
    /// Starts the thread, which wakes the window when it is done.
    fn start(ctx: &Context, make: impl FnOnce() -> T + Send + 'static) -> Result<Self, String> {
        let (send, receive) = channel();
        let wake = ctx.clone();
        let thread = std::thread::Builder::new().name("measure".to_owned()).spawn(move || {
            // Nobody may want it any more.
            drop(send.send(make()));
            wake.request_repaint();
        });
        thread.map(|_| Self(receive)).map_err(|error| format!("nothing can be measured: {error}"))
    }

    /// What was made, if it is; a line where the thread ended without it.
    pub(super) fn arrived(&self) -> Option<Result<T, String>> {
        match self.0.try_recv() {
            Ok(made) => Some(Ok(made)),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => {
                Some(Err("a measurement ended without a word".to_owned()))
            }
        }
    }
}

/// Reads a picture to measure against.
pub(super) fn read(ctx: &Context, path: PathBuf) -> Result<Coming<Result<Truth, String>>, String> {
    Coming::start(ctx, move || {
        let picture = exr_file::read_color(&path, MOST_PIXELS);
        let picture = picture.map_err(|error| format!("{error:#}"))?;
        let name = path.display().to_string();
        Ok(Truth { name, picture, variance: None, candidate: None })
    })
}

/// Compares a picture.
pub(super) fn compare(
    ctx: &Context,
    picture: Image,
    truth: Arc<Truth>,
    development: Development,
) -> Result<Coming<Result<Comparison, String>>, String> {
    Coming::start(ctx, move || truth.compare(&picture, development))
}

/// What a tracer is to make a picture of.
pub(super) struct Traced {
    pub(super) reference: UnitRef,
    pub(super) unit: LoadedUnit,
    pub(super) values: Values,
    pub(super) clouds: Arc<Clouds>,
    pub(super) view: View,
}

/// Why a tracer made no picture.
pub(super) enum Untraced {
    /// It is not the tracer's doing.
    Otherwise(String),
    Fault(Fault),
}

/// A tracer at work.
pub(super) struct Tracing {
    pub(super) reference: UnitRef,
    pub(super) unit: LoadedUnit,
    coming: Coming<Result<Truth, Untraced>>,
    stop: Arc<AtomicBool>,
    /// How much is done, in thousandths.
    done: Arc<AtomicU32>,
}

impl Tracing {
    /// Begins.
    pub(super) fn start(
        ctx: &Context,
        basis: &Basis,
        traced: Traced,
        patience: Patience,
    ) -> Result<Self, String> {
        let (stop, done) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicU32::new(0)));
        let (reference, unit) = (traced.reference.clone(), traced.unit.clone());
        let (scene, environment) = (basis.scene.clone(), basis.environment.clone());
        let name = basis.source.name();
        let (stopped, told, wake) = (stop.clone(), done.clone(), ctx.clone());
        let coming = Coming::start(ctx, move || {
            let Traced { reference, unit, values, clouds, view } = traced;
            let _mark = mark(&reference);
            let light = environment.map(|wanted| Probes::default().light(&wanted, drop));
            let light =
                light.transpose().map_err(|error| Untraced::Otherwise(format!("{error:#}")))?;
            let order = TraceOrder {
                // The window and the views keep one.
                threads: std::thread::available_parallelism()
                    .map_or(1, |n| n.get().saturating_sub(1).max(1)),
                ..traced::order(&unit, &values, &clouds, &scene, light.as_ref(), view)
            };
            let picture = trace(&unit, order, &patience, |fraction| {
                let now = (1000.0 * fraction) as u32;
                if told.swap(now, Ordering::Relaxed) != now {
                    wake.request_repaint();
                }
                !stopped.load(Ordering::Relaxed)
            });
            let traced = picture.map_err(Untraced::Fault)?;
            let variance = (traced.samples > 1).then_some(traced.variance);
            Ok(Truth { name, picture: traced.color, variance, candidate: None })
        })?;
        Ok(Self { reference, unit, coming, stop, done })
    }

    /// The picture as something to measure against, if it is made.
    pub(super) fn arrived(&self) -> Option<Result<Truth, Untraced>> {
        let made = self.coming.arrived()?;
        Some(made.unwrap_or_else(|line| Err(Untraced::Otherwise(line))))
    }

    /// The share that is done.
    pub(super) fn fraction(&self) -> f32 {
        self.done.load(Ordering::Relaxed) as f32 / 1000.0
    }

    /// Asks it to stop.
    pub(super) fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    pub(super) fn is_stopping(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
