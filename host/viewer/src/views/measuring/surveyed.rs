//! What is measured of surfels, on a thread of its own: a large cloud takes a tenth of a second.

use eframe::egui::Context;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use surfelshop_cloud::scene::Axis;
use surfelshop_cloud::scene::{Measure, MeasureKind, Profile, Quantity, Volume};
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::output::measures::measured;

/// Most points that a plot shows.
const MOST_POINTS: usize = 4000;

/// What a measure is of: what else changes leaves its numbers alone.
#[derive(Clone, PartialEq)]
struct Subject {
    measure: Measure,
    up: Axis,
    revision: u64,
}

/// What was measured of surfels.
#[derive(Clone, Default)]
pub(crate) struct Surveyed {
    pub(crate) quantities: Vec<Quantity>,
    /// Of a profile some of the surfels: along and high.
    pub(crate) points: Vec<[f64; 2]>,
    /// A profile's whole surfels, for its file.
    pub(crate) profile: Option<Arc<Profile>>,
    /// Why there are none.
    pub(crate) fault: Option<String>,
}

/// What is known of measures.
#[derive(Default)]
pub(crate) struct Surveys {
    known: Vec<(Subject, Surveyed)>,
    running: Option<(Subject, Receiver<Surveyed>)>,
}

impl Surveys {
    /// What was measured, of the clouds as they are or as they were before.
    pub(crate) fn of(&self, measure: &Measure) -> Option<&Surveyed> {
        let same = |subject: &Subject| is_alike(&subject.measure, measure);
        self.known.iter().find(|(subject, _)| same(subject)).map(|(_, surveyed)| surveyed)
    }
}

fn is_alike(a: &Measure, b: &Measure) -> bool {
    a.kind == b.kind && a.places == b.places && a.thickness == b.thickness
}

/// A measure without what does not change its numbers.
fn bare(measure: &Measure) -> Measure {
    Measure { thickness: measure.thickness, ..Measure::new(measure.kind, measure.places.clone()) }
}

fn survey(measure: &Measure, up: Axis, clouds: &Clouds) -> Surveyed {
    let up = up.direction();
    let failed = |fault: String| Surveyed { fault: Some(fault), ..Surveyed::default() };
    let clouds = match measured(clouds, measure, up) {
        Ok(clouds) => clouds,
        Err(error) => return failed(error.to_string()),
    };
    let clouds: Vec<_> = clouds.iter().collect();
    match measure.kind {
        MeasureKind::Profile => match Profile::of(measure, up, &clouds) {
            Ok(profile) => Surveyed {
                quantities: profile.quantities(),
                points: profile.some(MOST_POINTS),
                profile: Some(Arc::new(profile)),
                fault: None,
            },
            Err(error) => failed(error.to_string()),
        },
        _ => match Volume::of(measure, up, &clouds) {
            Ok(volume) => Surveyed { quantities: volume.quantities(), ..Surveyed::default() },
            Err(error) => failed(error.to_string()),
        },
    }
}

impl Surveys {
    /// Measures what is new, one measure after the other; `clouds` are what is displayed, and the revision tells these
    /// from others.
    pub(super) fn advance(
        &mut self,
        measures: &[Measure],
        up: Axis,
        (clouds, revision): (&Arc<Clouds>, u64),
        ctx: &Context,
    ) {
        if let Some((subject, outcome)) = &self.running {
            match outcome.try_recv() {
                Ok(surveyed) => {
                    let subject = subject.clone();
                    self.known.retain(|(known, _)| !is_alike(&known.measure, &subject.measure));
                    self.known.push((subject, surveyed));
                    self.running = None;
                }
                Err(TryRecvError::Disconnected) => self.running = None,
                Err(TryRecvError::Empty) => return,
            }
        }
        let all = || measures.iter().filter(|measure| measure.kind.is_of_surfels());
        self.known.retain(|(subject, _)| all().any(|one| is_alike(one, &subject.measure)));
        let mut subjects = all().map(|one| Subject { measure: bare(one), up, revision });
        let is_known = |subject: &Subject| self.known.iter().any(|(known, _)| known == subject);
        let Some(next) = subjects.find(|subject| !is_known(subject)) else { return };
        let (send, outcome) = channel();
        let (subject, clouds, wake) = (next.clone(), Arc::clone(clouds), ctx.clone());
        let started = std::thread::Builder::new().name("measures".to_owned()).spawn(move || {
            // The window may be closed already.
            drop(send.send(survey(&subject.measure, subject.up, &clouds)));
            wake.request_repaint();
        });
        match started {
            Ok(_) => self.running = Some((next, outcome)),
            Err(error) => {
                let fault = Some(format!("no thread could be started: {error}"));
                self.known.push((next, Surveyed { fault, ..Surveyed::default() }));
            }
        }
    }
}
