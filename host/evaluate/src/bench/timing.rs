//! Times frames and surfels alone, the variants in turns.

use super::variant::{Contestant, LeftOut};
use crate::compare::Stage;
use crate::compare::candidate::{Candidate, CandidateRequest};
use anyhow::bail;
use std::time::{Duration, Instant};
use surfelshop_api::View;
use surfelshop_api::params::Values;
use surfelshop_render::{PassReport, PassState};
use surfelshop_session::cpu_time::{cpu_ms_since, cpu_time};
use surfelshop_session::session::RenderSession;
use surfelshop_session::timing::Run;

/// Fewest runs that are made however long they take.
const FEWEST: usize = 3;

/// What is timed.
#[derive(Clone, Copy)]
pub(super) enum What<'a> {
    /// A renderer's frame, its colour read back.
    Frame(&'a CandidateRequest),
    /// The surface buffer that frames begin with; nothing is read back.
    Surfels,
}

impl What<'_> {
    /// What it is called in tables.
    pub(super) fn name(&self) -> &str {
        match self {
            Self::Frame(wanted) => &wanted.name,
            // No renderer has a name with a space.
            Self::Surfels => "surfels alone",
        }
    }
}

/// The times of a variant.
pub(super) struct Timed {
    pub(super) variant: String,
    /// Milliseconds of the first one, everything that had to be made for it included.
    pub(super) first_ms: f64,
    pub(super) runs: Vec<Run>,
    /// The passes that drew surfels alone.
    pub(super) passes: Vec<String>,
}

/// A renderer's instance; none where surfels are drawn alone.
struct Drawer(Option<Candidate>);

impl Drawer {
    fn new(what: What<'_>, studio: &RenderSession) -> Self {
        let What::Frame(CandidateRequest { name, reference, unit, values, beside }) = what else {
            return Self(None);
        };
        let wanted = CandidateRequest {
            name: name.clone(),
            reference: reference.clone(),
            unit: unit.clone(),
            values: values.clone(),
            beside: beside.clone(),
        };
        Self(Some(Candidate::new(Some(studio), wanted)))
    }

    /// Milliseconds, and the passes that drew surfels alone.
    fn first(
        &mut self,
        stage: &Stage<'_>,
        studio: &mut RenderSession,
    ) -> anyhow::Result<(f64, Vec<String>)> {
        let Some(candidate) = &mut self.0 else {
            let (run, passes) = surfels(stage, studio)?;
            return Ok((run.wall_ms, passes.into_iter().map(|pass| pass.name).collect()));
        };
        Ok((candidate.first(stage, Some(studio))?.first_ms, Vec::new()))
    }

    fn again(
        &mut self,
        stage: &Stage<'_>,
        studio: &mut RenderSession,
        number: u32,
    ) -> anyhow::Result<Run> {
        match &mut self.0 {
            Some(candidate) => candidate.again(stage, Some(studio), number),
            None => Ok(surfels(stage, studio)?.0),
        }
    }
}

/// The surface buffer of the stage's view.
fn surfels(
    stage: &Stage<'_>,
    studio: &mut RenderSession,
) -> anyhow::Result<(Run, Vec<PassReport>)> {
    let (drawn, values) = (stage.drawn(&stage.view)?, Values::new());
    let drawn = drawn.with(stage.clouds);
    let request = stage.request(&drawn, stage.view, &values);
    let (started, cpu) = (Instant::now(), cpu_time());
    // As in frames, where letting go of the surface before counts.
    studio.engine.forget_surfaces();
    let mut passes = studio.engine.draw_surfels(&request)?;
    let wall_ms = started.elapsed().as_secs_f64() * 1e3;
    let cpu_ms = cpu_ms_since(cpu);
    passes.retain(|pass| pass.state == PassState::Ran);
    let own_passes_ms = passes.iter().map(|pass| pass.gpu_ms).sum();
    Ok((Run { wall_ms, own_passes_ms, cpu_ms }, passes))
}

/// Times each contestant in each view, after a frame of the first view that does not count. Who begins
/// changes from view to view, so that none always follows the same one. Once `longest` has passed no
/// further views are drawn, beyond a few. One that fails is left out.
pub(super) fn timed(
    contestants: &mut [Contestant],
    what: What<'_>,
    stage: &Stage<'_>,
    views: &[View],
    longest: Duration,
    left_out: &mut LeftOut,
) -> anyhow::Result<Vec<Timed>> {
    let mut all = Vec::with_capacity(contestants.len());
    for contestant in contestants.iter_mut() {
        let mut drawer = Drawer::new(what, &contestant.studio);
        let staging = contestant.variant.staging(stage.staging);
        let stage = Stage { staging: &staging, ..*stage };
        match drawer.first(&stage, &mut contestant.studio) {
            Ok((first_ms, passes)) => {
                let variant = contestant.variant.name.clone();
                // Passes do not say how finely they draw.
                let detail_px = contestant.variant.detail_px;
                let is_alike = |(_, other, _, timed): &&(_, &mut Contestant, _, Timed)| {
                    timed.passes == passes && other.variant.detail_px == detail_px
                };
                if let Some((.., other)) = all.iter().find(is_alike)
                    && !passes.is_empty()
                {
                    left_out.alike(&variant, &other.variant);
                }
                let timed = Timed { variant, first_ms, runs: Vec::new(), passes };
                all.push((all.len(), contestant, drawer, timed));
            }
            Err(error) => left_out.add(&contestant.variant, &error),
        }
    }
    let started = Instant::now();
    let mut number = 0;
    for (i, &view) in views.iter().enumerate() {
        if i >= FEWEST && started.elapsed() > longest {
            break;
        }
        let turn = usize::from(i > 0).min(all.len());
        all.rotate_left(turn);
        let mut still = Vec::with_capacity(all.len());
        for (place, contestant, mut drawer, mut timed) in all {
            number += 1;
            let staging = contestant.variant.staging(stage.staging);
            let stage = Stage { staging: &staging, view, ..*stage };
            match drawer.again(&stage, &mut contestant.studio, number) {
                Ok(run) => {
                    timed.runs.push(run);
                    still.push((place, contestant, drawer, timed));
                }
                Err(error) => left_out.add(&contestant.variant, &error),
            }
        }
        all = still;
    }
    if all.is_empty() {
        bail!(left_out.last());
    }
    all.sort_by_key(|(place, ..)| *place);
    Ok(all.into_iter().map(|(.., timed)| timed).collect())
}
