//! The renderers and tracers that are compared: their pictures and their times.

use super::Stage;
use crate::settings;
use crate::studio::{self, Chosen, Studio};
use crate::values::Setting;
use anyhow::{anyhow, bail};
use std::sync::Arc;
use std::time::Instant;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{FrameRequest, UnitKind};
use surfelshop_engine::plugins::{LoadedUnit, UnitRef};
use surfelshop_engine::trace::{TraceOrder, samples_of, trace};
use surfelshop_engine::{Image, PassReport, PassState, RenderRequest, Rendered};

/// One of those that are compared.
pub(crate) struct Candidate {
    pub(crate) name: String,
    pub(crate) reference: UnitRef,
    pub(crate) unit: LoadedUnit,
    pub(crate) values: Values,
    /// The instance of a renderer.
    chosen: Option<Chosen>,
    /// What it made, or a line that says why not.
    pub(crate) drawn: Result<Drawn, String>,
}

/// A picture and what it took.
pub(crate) struct Drawn {
    pub(crate) color: Image,
    /// Variance of the mean, of tracers.
    pub(crate) variance: Option<Image>,
    /// Milliseconds of the first frame, everything that had to be made for it included.
    pub(crate) first_ms: f64,
    /// Milliseconds of the frames after it.
    pub(crate) frames_ms: Vec<f64>,
    /// Milliseconds of its own passes on the device, frame by frame.
    pub(crate) passes_ms: Vec<f64>,
}

/// Loads all and makes their instances, each with the settings that are meant for it.
pub(super) fn all(
    stage: &Stage<'_>,
    studio: Option<&Studio>,
    references: Vec<UnitRef>,
) -> anyhow::Result<Vec<Candidate>> {
    let typed = &stage.arguments.set;
    let mut used = vec![false; typed.len()];
    let mut wanted = Vec::with_capacity(references.len());
    for reference in references {
        let unit = studio::load(&reference, &stage.arguments.plugins.patience())?;
        // What is meant for nobody in particular is meant for all that have it.
        let is_meant = |setting: &Setting| match &setting.unit {
            Some(name) => settings::names(&reference, name),
            None => unit.description.params.iter().any(|declared| declared.id == setting.id),
        };
        let mut own = Vec::new();
        for (setting, used) in typed.iter().zip(&mut used).filter(|(s, _)| is_meant(s)) {
            own.push(setting.clone());
            *used = true;
        }
        wanted.push((reference, own));
    }
    if let Some((setting, _)) = typed.iter().zip(used).find(|(_, used)| !used) {
        let Setting { unit, id, value } = setting;
        let whose = unit.as_ref().map(|unit| format!("{unit}:")).unwrap_or_default();
        bail!("--set {whose}{id}={value} is meant for none of the renderers that are compared");
    }
    with(stage, studio, wanted)
}

/// Loads units and makes their instances, each with its own settings.
pub(crate) fn with(
    stage: &Stage<'_>,
    studio: Option<&Studio>,
    wanted: Vec<(UnitRef, Vec<Setting>)>,
) -> anyhow::Result<Vec<Candidate>> {
    let mut candidates = Vec::with_capacity(wanted.len());
    for (reference, own) in wanted {
        let unit = studio::load(&reference, &stage.arguments.plugins.patience())?;
        let values = settings::values(&reference, &unit.description.params, &own)?;
        let chosen = match (reference.kind, studio) {
            (UnitKind::Renderer, Some(studio)) => {
                Some(studio.choose_for(reference.clone(), None, &own)?)
            }
            _ => None,
        };
        let (name, drawn) = (reference.id.clone(), Err("it was not drawn".to_owned()));
        candidates.push(Candidate { name, reference, unit, values, chosen, drawn });
    }
    Ok(candidates)
}

/// Draws all once.
pub(crate) fn draw_once(
    stage: &Stage<'_>,
    mut studio: Option<&mut Studio>,
    candidates: &mut [Candidate],
) {
    for candidate in candidates.iter_mut() {
        let drawn = match (&mut candidate.chosen, studio.as_deref_mut()) {
            (Some(chosen), Some(studio)) => first(stage, studio, chosen),
            _ => traced(stage, candidate),
        };
        candidate.drawn = drawn.map_err(|error| format!("{error:#}"));
    }
}

/// Draws all: tracers once, renderers once and then in turns to be timed.
pub(crate) fn draw(
    stage: &Stage<'_>,
    mut studio: Option<&mut Studio>,
    candidates: &mut [Candidate],
) {
    draw_once(stage, studio.as_deref_mut(), candidates);
    let Some(studio) = studio else { return };
    let n = candidates.len();
    for repeat in 0..stage.arguments.repeats as usize {
        for (i, candidate) in candidates.iter_mut().enumerate() {
            let (Some(chosen), Ok(drawn)) = (&mut candidate.chosen, &mut candidate.drawn) else {
                continue;
            };
            // A camera that moves by less than anything shows: nothing is kept from another's frame.
            let nudge = 1e-12 * (repeat * n + i + 1) as f64;
            match frame(stage, studio, chosen, nudge) {
                Ok((rendered, milliseconds)) => {
                    drawn.frames_ms.push(milliseconds);
                    drawn.passes_ms.extend(own_passes(&rendered.passes));
                }
                Err(error) => candidate.drawn = Err(format!("{error:#}")),
            }
        }
    }
}

fn first(stage: &Stage<'_>, studio: &mut Studio, chosen: &mut Chosen) -> anyhow::Result<Drawn> {
    let (rendered, first_ms) = frame(stage, studio, chosen, 0.0)?;
    let color = rendered.image(&Output::Color).cloned();
    let color = color.ok_or_else(|| anyhow!("{} gave no colour", chosen.reference))?;
    let color = crate::pictures::four_components(&Output::Color, &color);
    let (frames_ms, passes_ms) = Default::default();
    Ok(Drawn { color, variance: None, first_ms, frames_ms, passes_ms })
}

/// A frame until it settles, seen from a camera that is moved aside by a share of its distance.
fn frame(
    stage: &Stage<'_>,
    studio: &mut Studio,
    chosen: &mut Chosen,
    nudge: f64,
) -> anyhow::Result<(Rendered, f64)> {
    let mut view = stage.view;
    view.camera.eye.x += nudge * (view.camera.eye - view.camera.target).length();
    let values = chosen.values.clone();
    let request = RenderRequest {
        clouds: &stage.clouds.views(),
        facts: &stage.clouds.facts,
        scene: &stage.staging.scene,
        view,
        values: &values,
        outputs: &[Output::Color],
        frame_index: 0,
        environment: stage.surroundings.map(|light| light.view()),
        stride: 1,
    };
    let started = Instant::now();
    let settled = studio.settle(chosen, &request)?;
    Ok((settled.rendered, started.elapsed().as_secs_f64() * 1e3))
}

/// Milliseconds of a frame's own passes, without the host's; none where the device does not tell.
fn own_passes(passes: &[PassReport]) -> Option<f64> {
    let own = passes.iter().filter(|pass| {
        pass.state == PassState::Ran
            && !pass.name.starts_with("surfels:")
            && !pass.name.starts_with("host:")
    });
    own.map(|pass| pass.gpu_ms).sum()
}

fn traced(stage: &Stage<'_>, candidate: &Candidate) -> anyhow::Result<Drawn> {
    let texels = stage.surroundings.map(|light| Arc::from(light.view().texels)).unwrap_or_default();
    let order = TraceOrder {
        clouds: stage.clouds.loaded.iter().map(|loaded| loaded.cloud.clone()).collect(),
        request: FrameRequest {
            view: stage.view,
            scene: stage.staging.scene.clone(),
            cloud: stage.clouds.facts.clone(),
            frame_index: 0,
            values: candidate.values.clone(),
            environment: stage.surroundings.map(|light| light.view().environment.clone()),
        },
        texels,
        samples: samples_of(&candidate.unit, &candidate.values),
        threads: 0,
    };
    let progress = crate::terminal::Progress::new(format!("tracing with {}", candidate.name));
    let patience = stage.arguments.plugins.patience();
    let picture =
        trace(&candidate.unit, order, &patience, |done| progress.tell(done).is_continue())
            .map_err(|fault| anyhow!("{}: {fault}", candidate.reference))?;
    Ok(Drawn {
        color: picture.color,
        variance: Some(picture.variance),
        first_ms: picture.took.as_secs_f64() * 1e3,
        frames_ms: Vec::new(),
        passes_ms: Vec::new(),
    })
}
