//! One measurement, step by step: the reference, then each picture with its numbers and a first time,
//! then further times in turns.
//!
//! Only one step runs at a time, so that no timed picture shares the CPU with a comparison. The
//! first frame of each subject, in which shaders are compiled, is not timed.

use super::background::BackgroundJob;
use super::pictures::Pictures;
use super::plan::{Basis, Plan, ReferenceSource, Subject};
use super::reference::TraceJob;
use crate::render_thread::{Detail, MEASURE_PANE, RenderedView, ViewRequest, ViewSlot};
use eframe::egui::{Context, TextureId};
use std::collections::VecDeque;
use std::sync::Arc;
use surfelshop_api::View;
use surfelshop_api::graph::Output;
use surfelshop_evaluate::compare::Truth;
use surfelshop_evaluate::compare::candidate::nudged;
use surfelshop_evaluate::compare::measured::errors;
use surfelshop_evaluate::report::cells::Cell;
use surfelshop_image::Image;
use surfelshop_image::metrics::Comparison;
use surfelshop_image::outputs::{self, four_components};
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::options::camera;
use surfelshop_session::options::camera::Extent;
use surfelshop_session::timing;

/// A step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// The reference.
    Reference,
    /// The first frame of a subject.
    Draw(usize),
    /// The numbers of a subject.
    Compare(usize),
    /// A timed frame of a subject.
    Time(usize),
}

/// The pending result.
pub(super) enum Pending {
    Nothing,
    /// A picture, by the number of its request.
    Picture(u64, Step),
    File(BackgroundJob<Result<Truth, String>>),
    Tracer(Box<TraceJob>),
    Numbers(usize, BackgroundJob<Result<Comparison, String>>),
}

/// The status of a measurement.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Status {
    Running,
    Done,
    Cancelled,
    /// Why it failed, in one line.
    Failed(String),
}

/// A running or ended measurement.
pub(crate) struct Measurement {
    pub(crate) basis: Basis,
    pub(crate) subjects: Vec<Subject>,
    /// The numbers of each subject.
    pub(crate) cells: Vec<Option<Cell>>,
    /// A small picture of each subject.
    pictures: Pictures,
    pub(crate) status: Status,
    work: Option<Work>,
}

/// The resources of a running measurement.
struct Work {
    clouds: Arc<Clouds>,
    extent: Extent,
    reference: Option<Arc<Truth>>,
    pending: Pending,
    steps: VecDeque<Step>,
    n_steps: usize,
    /// Timed pictures that were requested.
    n_timed: u32,
    /// The picture to be compared, and its frame's time in milliseconds.
    drawn: Option<(Image, f64)>,
    first_ms: f64,
}

impl Measurement {
    /// Lists all steps, without the one of a known reference.
    pub(super) fn new(plan: Plan, reference: Option<Arc<Truth>>) -> Self {
        let Plan { basis, subjects, clouds, extent, repeats } = plan;
        let n = subjects.len();
        let mut steps: VecDeque<Step> =
            reference.is_none().then_some(Step::Reference).into_iter().collect();
        for i in 0..n {
            steps.extend([Step::Draw(i), Step::Compare(i)]);
            steps.extend((repeats > 0).then_some(Step::Time(i)));
        }
        for _ in 1..repeats {
            steps.extend((0..n).map(Step::Time));
        }
        let (n_steps, pending, drawn) = (steps.len(), Pending::Nothing, None);
        let (n_timed, first_ms) = (0, 0.0);
        let work =
            Work { clouds, extent, reference, pending, steps, n_steps, n_timed, drawn, first_ms };
        let (cells, pictures, status) = (vec![None; n], Pictures::new(n), Status::Running);
        Self { basis, subjects, cells, pictures, status, work: Some(work) }
    }

    pub(crate) fn is_running(&self) -> bool {
        self.status == Status::Running
    }

    /// The small picture of a subject, once it is drawn.
    pub(crate) fn picture(&self, ctx: &Context, i: usize) -> Option<TextureId> {
        self.pictures.texture(ctx, i)
    }

    /// The progress in [0, 1], and the present step in words.
    pub(crate) fn progress(&self) -> (f32, String) {
        let Some(work) = &self.work else { return (1.0, String::new()) };
        if let Pending::Tracer(tracing) = &work.pending {
            let (name, done) = (&tracing.tracer.id, tracing.fraction());
            let text = match tracing.is_stopping() {
                true => format!("{name} is stopping"),
                false => format!("tracing with {name}: {:.0} %", 100.0 * done),
            };
            return (done, text);
        }
        let n_done = work.n_steps - work.steps.len();
        let known = self.cells.iter().flatten().count();
        let text = match &work.reference {
            None => "making the reference".to_owned(),
            Some(_) if known < self.cells.len() => format!("{} of {}", known + 1, self.cells.len()),
            Some(_) => "timing, interleaved".to_owned(),
        };
        (n_done as f32 / work.n_steps.max(1) as f32, text)
    }

    /// The pending result while it runs.
    pub(super) fn pending(&self) -> Option<&Pending> {
        self.work.as_ref().map(|work| &work.pending)
    }

    pub(super) fn set_pending(&mut self, what: Pending) {
        if let Some(work) = &mut self.work {
            work.pending = what;
        }
    }

    /// Removes the next step, unless a result is pending; ends the measurement after the last one.
    pub(super) fn next_step(&mut self) -> Option<Step> {
        let work = self.work.as_mut()?;
        if !matches!(work.pending, Pending::Nothing) {
            return None;
        }
        while let Some(step) = work.steps.pop_front() {
            match step {
                // Faulty pictures are not compared or timed.
                Step::Compare(i) | Step::Time(i)
                    if self
                        .cells
                        .get(i)
                        .is_some_and(|c| c.as_ref().is_some_and(Cell::is_faulty)) => {}
                step => return Some(step),
            }
        }
        self.status = Status::Done;
        None
    }

    /// Puts a step back that cannot begin yet.
    pub(super) fn put_back(&mut self, step: Step) {
        if let Some(work) = &mut self.work {
            work.steps.push_front(step);
        }
    }

    pub(super) fn fail(&mut self, line: String) {
        self.status = Status::Failed(line);
    }

    pub(super) fn cancel(&mut self) {
        self.status = Status::Cancelled;
    }

    /// Drops the resources, where it still has them; returns the reference.
    pub(super) fn release(&mut self) -> Option<Option<Arc<Truth>>> {
        self.work.take().map(|work| work.reference)
    }

    /// The slots of its pictures.
    pub(super) fn slots(&self) -> impl Iterator<Item = ViewSlot> + use<> {
        (0..=self.subjects.len()).map(|side| ViewSlot { pane: MEASURE_PANE, side })
    }

    /// The clouds and the view of all pictures.
    pub(super) fn subject_view(&self) -> Option<(Arc<Clouds>, View)> {
        let work = self.work.as_ref()?;
        let reference_size = work.reference.as_ref().map(|t| [t.picture.width, t.picture.height]);
        let size = self.basis.size.or(reference_size)?;
        Some((work.clouds.clone(), camera::framed_view(self.basis.camera, &work.extent, size)))
    }

    /// The request of a step and its slot: each subject has its own.
    pub(super) fn request(&mut self, step: Step, serial: u64) -> Option<(ViewSlot, ViewRequest)> {
        let (clouds, view) = self.subject_view()?;
        let work = self.work.as_mut()?;
        let of = |i: usize| self.subjects.get(i).map(|s: &Subject| (&s.renderer, &s.values));
        let (side, of, view) = match (step, &self.basis.source) {
            (Step::Reference, ReferenceSource::Renderer { name, values }) => {
                (0, Some((name, values)), view)
            }
            (Step::Draw(i), _) => (i + 1, of(i), view),
            (Step::Time(i), _) => {
                work.n_timed += 1;
                (i + 1, of(i), nudged(view, work.n_timed))
            }
            (Step::Reference | Step::Compare(_), _) => return None,
        };
        let (renderer, values) = of?;
        let request = ViewRequest {
            renderer: renderer.clone(),
            values: values.clone(),
            clouds,
            // As `compare` does: what clouds name draws them beside each subject.
            named: self.basis.named.clone(),
            scene: self.basis.scene.clone(),
            environment: self.basis.environment.clone(),
            display: self.basis.display,
            view,
            antialias: self.basis.antialias,
            tint_backs: self.basis.tint_backs,
            eye_dome: self.basis.eye_dome,
            detail: Detail::FULL,
            in_motion: false,
            for_measurement: true,
            serial,
        };
        Some((ViewSlot { pane: MEASURE_PANE, side }, request))
    }

    /// Takes in a picture, or why there is none, if it is the pending one.
    pub(super) fn take_picture(&mut self, serial: u64, outcome: Result<RenderedView, String>) {
        let Some(Pending::Picture(expected, step)) = self.pending() else { return };
        let step = *step;
        if *expected != serial {
            return;
        }
        self.set_pending(Pending::Nothing);
        match (step, outcome) {
            (Step::Reference, Ok(rendered)) => {
                let (name, picture) = (self.basis.source.name(), color(&rendered));
                self.take_reference(Truth { name, picture, variance: None, candidate: None });
            }
            (Step::Reference, Err(line)) => {
                let name = self.basis.source.name();
                self.fail(format!("{name}: {line}; there is nothing to measure against"));
            }
            (Step::Draw(i), Ok(rendered)) => {
                // Pictures that are measured have no levels of their own.
                let levels = outputs::levels(&rendered.color, &self.basis.display);
                self.pictures.put(i, rendered.size, &levels);
                if let Some(work) = &mut self.work {
                    work.drawn = Some((color(&rendered), rendered.frame_ms));
                }
            }
            (Step::Time(i), Ok(rendered)) => {
                if let Some(Some(cell)) = self.cells.get_mut(i) {
                    cell.runs.push(timing::Run {
                        wall_ms: rendered.frame_ms,
                        own_passes_ms: rendered.own_passes_ms,
                        // The window draws on the same processors.
                        cpu_ms: None,
                    });
                }
            }
            (Step::Draw(i) | Step::Time(i), Err(line)) => self.put(i, Err(line)),
            (Step::Compare(_), _) => {}
        }
    }

    /// Takes in the reference.
    pub(super) fn take_reference(&mut self, reference: Truth) {
        self.set_pending(Pending::Nothing);
        let Truth { name, picture, .. } = &reference;
        let n_values = picture.data.iter().filter(|value| !value.is_finite()).count();
        if n_values > 0 {
            self.fail(format!(
                "{name}: {n_values} of its values are not finite; nothing can be measured against it"
            ));
        } else if let Some(work) = &mut self.work {
            work.reference = Some(Arc::new(reference));
        }
    }

    /// The picture to be compared, and the reference.
    pub(super) fn pair(&mut self) -> Option<(Image, Arc<Truth>)> {
        let work = self.work.as_mut()?;
        let (picture, first_ms) = work.drawn.take()?;
        work.first_ms = first_ms;
        Some((picture, work.reference.clone()?))
    }

    /// Takes in the numbers of a subject.
    pub(super) fn take_numbers(&mut self, i: usize, compared: Result<Comparison, String>) {
        self.set_pending(Pending::Nothing);
        self.put(i, compared);
    }

    fn put(&mut self, i: usize, compared: Result<Comparison, String>) {
        let first_ms = self.work.as_ref().map_or(0.0, |work| work.first_ms);
        let (Some(subject), Some(place)) = (self.subjects.get(i), self.cells.get_mut(i)) else {
            return;
        };
        let Subject { knob, value, .. } = subject;
        *place = Some(match errors(&compared) {
            Ok(errors) => Cell::of_picture(knob, value, errors, first_ms),
            Err(line) => Cell::faulty(knob, value, line),
        });
    }
}

fn color(rendered: &RenderedView) -> Image {
    four_components(&Output::Color, &rendered.color)
}
