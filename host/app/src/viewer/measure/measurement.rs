//! One measurement, step by step: the reference, then each picture with its numbers and a first time,
//! then further times in turns.
//!
//! One thing happens at a time, so that nothing that is timed shares the processor with the comparing
//! of another picture. The first frame of each, in which shaders are compiled, is drawn apart from
//! those that are timed.

use super::plan::{Basis, Plan, Source, Subject};
use super::truth::{Coming, Tracing};
use crate::camera::{self, Extent};
use crate::clouds::Clouds;
use crate::compare::Truth;
use crate::compare::candidate::nudged;
use crate::compare::measured::errors;
use crate::pictures::four_components;
use crate::sweep::cells::Cell;
use crate::times;
use crate::viewer::darkroom::{Order, Place, Shot};
use crate::viewer::detail::Detail;
use std::collections::VecDeque;
use std::sync::Arc;
use surfelshop_api::View;
use surfelshop_api::graph::Output;
use surfelshop_engine::Image;
use surfelshop_engine::metrics::Comparison;

/// No pane has this number.
pub(crate) const PANE: u32 = u32::MAX - 1;

/// What is done next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// The reference.
    Truth,
    /// The first frame of a subject.
    Draw(usize),
    /// Its numbers.
    Compare(usize),
    /// Another frame, to be timed.
    Time(usize),
}

/// What is waited for.
pub(super) enum Waiting {
    Nothing,
    /// A picture of the darkroom, by the number of its order.
    Picture(u64, Step),
    File(Coming<Result<Truth, String>>),
    Tracer(Box<Tracing>),
    Numbers(usize, Coming<Result<Comparison, String>>),
}

/// How far a measurement is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum State {
    AtWork,
    Done,
    Cancelled,
    /// Why there is nothing to measure against, in one line.
    Failed(String),
}

/// A measurement, at work or over.
pub(crate) struct Measurement {
    pub(crate) basis: Basis,
    pub(crate) subjects: Vec<Subject>,
    /// What was measured of each subject.
    pub(crate) cells: Vec<Option<Cell>>,
    pub(crate) state: State,
    work: Option<Work>,
}

/// What is needed until a measurement is over.
struct Work {
    clouds: Arc<Clouds>,
    extent: Extent,
    truth: Option<Arc<Truth>>,
    waiting: Waiting,
    steps: VecDeque<Step>,
    n_steps: usize,
    /// Pictures that were ordered to be timed.
    n_timed: u32,
    /// The picture to be compared, and what its frame took in milliseconds.
    drawn: Option<(Image, f64)>,
    first_ms: f64,
}

impl Measurement {
    /// Plans all steps; a reference that is known already is not made again.
    pub(super) fn new(plan: Plan, truth: Option<Arc<Truth>>) -> Self {
        let Plan { basis, subjects, clouds, extent, repeats } = plan;
        let n = subjects.len();
        let mut steps: VecDeque<Step> =
            truth.is_none().then_some(Step::Truth).into_iter().collect();
        for i in 0..n {
            steps.extend([Step::Draw(i), Step::Compare(i)]);
            steps.extend((repeats > 0).then_some(Step::Time(i)));
        }
        for _ in 1..repeats {
            steps.extend((0..n).map(Step::Time));
        }
        let (n_steps, waiting, drawn) = (steps.len(), Waiting::Nothing, None);
        let (n_timed, first_ms) = (0, 0.0);
        let work =
            Work { clouds, extent, truth, waiting, steps, n_steps, n_timed, drawn, first_ms };
        Self { basis, subjects, cells: vec![None; n], state: State::AtWork, work: Some(work) }
    }

    pub(crate) fn is_at_work(&self) -> bool {
        self.state == State::AtWork
    }

    /// The share that is done, and what is being done.
    pub(crate) fn progress(&self) -> (f32, String) {
        let Some(work) = &self.work else { return (1.0, String::new()) };
        if let Waiting::Tracer(tracing) = &work.waiting {
            let (name, done) = (&tracing.reference.id, tracing.fraction());
            let text = match tracing.is_stopping() {
                true => format!("{name} is stopping"),
                false => format!("tracing with {name}: {:.0} %", 100.0 * done),
            };
            return (done, text);
        }
        let n_done = work.n_steps - work.steps.len();
        let known = self.cells.iter().flatten().count();
        let text = match &work.truth {
            None => "making the reference".to_owned(),
            Some(_) if known < self.cells.len() => format!("{} of {}", known + 1, self.cells.len()),
            Some(_) => "timing in turns".to_owned(),
        };
        (n_done as f32 / work.n_steps.max(1) as f32, text)
    }

    /// What is waited for while it is at work.
    pub(super) fn waiting(&self) -> Option<&Waiting> {
        self.work.as_ref().map(|work| &work.waiting)
    }

    pub(super) fn wait_for(&mut self, what: Waiting) {
        if let Some(work) = &mut self.work {
            work.waiting = what;
        }
    }

    /// Takes the next step out, unless something is waited for; ends where there is none.
    pub(super) fn next_step(&mut self) -> Option<Step> {
        let work = self.work.as_mut()?;
        if !matches!(work.waiting, Waiting::Nothing) {
            return None;
        }
        while let Some(step) = work.steps.pop_front() {
            match step {
                // There is no point in it.
                Step::Compare(i) | Step::Time(i)
                    if self
                        .cells
                        .get(i)
                        .is_some_and(|c| c.as_ref().is_some_and(Cell::is_faulty)) => {}
                step => return Some(step),
            }
        }
        self.state = State::Done;
        None
    }

    /// Puts a step back that cannot be taken yet.
    pub(super) fn put_back(&mut self, step: Step) {
        if let Some(work) = &mut self.work {
            work.steps.push_front(step);
        }
    }

    pub(super) fn fail(&mut self, line: String) {
        self.state = State::Failed(line);
    }

    pub(super) fn cancel(&mut self) {
        self.state = State::Cancelled;
    }

    /// Lets go of what it worked with, where it still has that: the reference, if there is one.
    pub(super) fn let_go(&mut self) -> Option<Option<Arc<Truth>>> {
        self.work.take().map(|work| work.truth)
    }

    /// The places that it has had pictures made for.
    pub(super) fn places(&self) -> impl Iterator<Item = Place> + use<> {
        (0..=self.subjects.len()).map(|side| Place { pane: PANE, side })
    }

    /// The clouds, and what all pictures see of them.
    pub(super) fn seen(&self) -> Option<(Arc<Clouds>, View)> {
        let work = self.work.as_ref()?;
        let of_truth = work.truth.as_ref().map(|t| [t.picture.width, t.picture.height]);
        let size = self.basis.size.or(of_truth)?;
        Some((work.clouds.clone(), camera::framed_view(self.basis.camera, &work.extent, size)))
    }

    /// The order of a step, and the place it is made for: each subject has its own.
    pub(super) fn order(&mut self, step: Step, serial: u64) -> Option<(Place, Order)> {
        let (clouds, view) = self.seen()?;
        let work = self.work.as_mut()?;
        let of = |i: usize| self.subjects.get(i).map(|s: &Subject| (&s.renderer, &s.values));
        let (side, of, view) = match (step, &self.basis.source) {
            (Step::Truth, Source::Renderer { name, values }) => (0, Some((name, values)), view),
            (Step::Draw(i), _) => (i + 1, of(i), view),
            (Step::Time(i), _) => {
                work.n_timed += 1;
                (i + 1, of(i), nudged(view, work.n_timed))
            }
            (Step::Truth | Step::Compare(_), _) => return None,
        };
        let (renderer, values) = of?;
        let order = Order {
            renderer: renderer.clone(),
            values: values.clone(),
            clouds,
            scene: self.basis.scene.clone(),
            environment: self.basis.environment.clone(),
            development: self.basis.development,
            view,
            detail: Detail::FULL,
            moves: false,
            is_measured: true,
            serial,
        };
        Some((Place { pane: PANE, side }, order))
    }

    /// Takes a picture, or why there is none, where it is the one that is waited for.
    pub(super) fn take_picture(&mut self, serial: u64, outcome: Result<Shot, String>) {
        let Some(Waiting::Picture(expected, step)) = self.waiting() else { return };
        let step = *step;
        if *expected != serial {
            return;
        }
        self.wait_for(Waiting::Nothing);
        match (step, outcome) {
            (Step::Truth, Ok(shot)) => {
                let (name, picture) = (self.basis.source.name(), color(&shot));
                self.take_truth(Truth { name, picture, variance: None, candidate: None });
            }
            (Step::Truth, Err(line)) => {
                let name = self.basis.source.name();
                self.fail(format!("{name}: {line}; there is nothing to measure against"));
            }
            (Step::Draw(_), Ok(shot)) => {
                if let Some(work) = &mut self.work {
                    work.drawn = Some((color(&shot), shot.frame_ms));
                }
            }
            (Step::Time(i), Ok(shot)) => {
                if let Some(Some(cell)) = self.cells.get_mut(i) {
                    cell.runs.push(times::Run {
                        wall_ms: shot.frame_ms,
                        own_passes_ms: shot.own_passes_ms,
                        // The window draws meanwhile, on the same processors.
                        cpu_ms: None,
                    });
                }
            }
            (Step::Draw(i) | Step::Time(i), Err(line)) => self.put(i, Err(line)),
            (Step::Compare(_), _) => {}
        }
    }

    /// Takes what is measured against.
    pub(super) fn take_truth(&mut self, truth: Truth) {
        self.wait_for(Waiting::Nothing);
        let Truth { name, picture, .. } = &truth;
        let n_values = picture.data.iter().filter(|value| !value.is_finite()).count();
        if n_values > 0 {
            self.fail(format!(
                "{name}: {n_values} of its values are not finite; nothing can be measured against it"
            ));
        } else if let Some(work) = &mut self.work {
            work.truth = Some(Arc::new(truth));
        }
    }

    /// The picture that waits to be compared, and what it is compared with.
    pub(super) fn pair(&mut self) -> Option<(Image, Arc<Truth>)> {
        let work = self.work.as_mut()?;
        let (picture, first_ms) = work.drawn.take()?;
        work.first_ms = first_ms;
        Some((picture, work.truth.clone()?))
    }

    /// Takes the numbers of a subject.
    pub(super) fn take_numbers(&mut self, i: usize, compared: Result<Comparison, String>) {
        self.wait_for(Waiting::Nothing);
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

fn color(shot: &Shot) -> Image {
    four_components(&Output::Color, &shot.color)
}
