//! The renderers and tracers that are compared: their pictures and their times.

use anyhow::{Context as _, anyhow, bail};
use std::time::Instant;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{UnitKind, View};
use surfelshop_image::{Image, TracedPicture, outputs, png};
use surfelshop_render::{PassState, RenderRequest, StageTime};
use surfelshop_runtime::plugins::{LoadedUnit, UnitRef};
use surfelshop_runtime::trace::trace;
use surfelshop_session::cloud_renderers::Beside;
use surfelshop_session::cpu_time::{clocks, cpu_ms_since, cpu_time};
use surfelshop_session::eye_dome;
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::input::drawn::{Drawn as DrawnClouds, DrawnViews};
use surfelshop_session::input::environment_map::LoadedEnvironment;
use surfelshop_session::options::PluginFiles;
use surfelshop_session::output::terminal;
use surfelshop_session::render::traced;
use surfelshop_session::session::{ConvergedFrame, LoadedRenderer, RenderSession};
use surfelshop_session::setup::RenderSetup;
use surfelshop_session::timing::Run;

/// What all candidates draw.
#[derive(Clone, Copy)]
pub struct Stage<'a> {
    /// Plugins beside the installed ones.
    pub plugins: &'a PluginFiles,
    /// What is rendered, and how.
    pub staging: &'a RenderSetup,
    /// The clouds.
    pub clouds: &'a Clouds,
    /// The environment map.
    pub surroundings: Option<&'a LoadedEnvironment>,
    /// The view.
    pub view: View,
}

impl Stage<'_> {
    /// What a view is drawn from.
    pub fn drawn(&self, view: &View) -> anyhow::Result<DrawnClouds<'_>> {
        self.staging.drawn(self.clouds, view)
    }

    /// The colour of a view; `drawn` is what the stage draws it from.
    pub fn request<'b>(
        &'b self,
        drawn: &'b DrawnViews<'b>,
        view: View,
        values: &'b Values,
    ) -> RenderRequest<'b> {
        RenderRequest {
            clouds: drawn.clouds(),
            facts: &self.clouds.facts,
            scene: &self.staging.scene,
            view,
            values,
            outputs: &[Output::Color],
            frame_index: 0,
            environment: self.surroundings.map(LoadedEnvironment::view),
            stride: 1,
            detail_px: self.staging.detail_px,
            parts: drawn.parts(),
            eye_dome: eye_dome::measured(&self.staging.eye_dome),
        }
    }
}

/// A renderer or tracer with its parameters.
#[derive(Clone)]
pub struct CandidateRequest {
    /// What it is called in tables: its id, or what the user says.
    pub name: String,
    /// The unit as it was named.
    pub reference: UnitRef,
    /// In memory, or a line that says why not.
    pub unit: Result<LoadedUnit, String>,
    /// Its parameters.
    pub values: Values,
    /// What draws the clouds that name a renderer.
    pub beside: Beside,
}

/// One of those that are compared.
pub struct Candidate {
    /// The name.
    pub name: String,
    /// The unit as it was named.
    pub reference: UnitRef,
    /// Its parameters.
    pub values: Values,
    /// A line where it could not be loaded or started.
    pub ready: Result<Ready, String>,
}

/// A unit in memory.
pub struct Ready {
    /// The unit, loaded.
    pub unit: LoadedUnit,
    /// The instance of a renderer.
    chosen: Option<LoadedRenderer>,
}

/// A picture, and what the first frame took.
pub struct Drawn {
    /// Linear radiance, straight alpha.
    pub color: Image,
    /// Variance of the mean, of tracers.
    pub variance: Option<Image>,
    /// Milliseconds of the first frame, everything that had to be made for it included.
    pub first_ms: f64,
    /// Passes of a renderer that ran.
    pub n_passes: Option<usize>,
    /// Bytes of the textures and buffers of a renderer's graph.
    pub graph_bytes: Option<u64>,
}

impl Candidate {
    /// Makes an instance of a renderer; one that fails in this draws nothing.
    pub fn new(
        studio: Option<&RenderSession>,
        CandidateRequest { name, reference, unit, values, beside }: CandidateRequest,
    ) -> Self {
        let start = |unit: LoadedUnit| -> Result<Ready, String> {
            let chosen = match (reference.kind, studio) {
                (UnitKind::Renderer, Some(studio)) => {
                    let started = studio.start(reference.clone(), unit.clone(), values.clone());
                    let mut chosen = started.map_err(|error| format!("{error:#}"))?;
                    let shared = studio.share_measured(&mut chosen, &beside);
                    shared.map_err(|error| format!("{error:#}"))?;
                    Some(chosen)
                }
                _ => None,
            };
            Ok(Ready { unit, chosen })
        };
        let ready = unit.and_then(start);
        Self { name, reference, values, ready }
    }

    /// What made it fail before it could draw.
    fn ready(&mut self) -> anyhow::Result<&mut Ready> {
        self.ready.as_mut().map_err(|line| anyhow!(line.clone()))
    }

    /// The picture; its time includes everything that has to be made for it.
    pub fn first(
        &mut self,
        stage: &Stage<'_>,
        studio: Option<&mut RenderSession>,
    ) -> anyhow::Result<Drawn> {
        let started = Instant::now();
        let Some(chosen) = &mut self.ready()?.chosen else {
            let traced = self.traced(stage)?;
            let first_ms = traced.took.as_secs_f64() * 1e3;
            let variance = (traced.samples > 1).then_some(traced.variance);
            let (n_passes, graph_bytes) = (None, None);
            return Ok(Drawn { color: traced.color, variance, first_ms, n_passes, graph_bytes });
        };
        let rendered = frame(stage, studio, chosen, stage.view)?.rendered;
        let first_ms = started.elapsed().as_secs_f64() * 1e3;
        let color = rendered.image(&Output::Color);
        let color = color.ok_or_else(|| anyhow!("{} gave no colour", chosen.reference))?;
        let ran = rendered.passes.iter().filter(|pass| pass.state == PassState::Ran);
        Ok(Drawn {
            color: outputs::four_components(&Output::Color, color),
            variance: None,
            first_ms,
            n_passes: Some(ran.count()),
            graph_bytes: Some(rendered.graph_bytes),
        })
    }

    /// Whether further frames are worth their time: a tracer takes as long each time as the first.
    pub fn is_worth_timing(&self) -> bool {
        self.ready.as_ref().is_ok_and(|ready| ready.chosen.is_some())
    }

    /// The same picture again, to be timed. No two of the candidates have the same `number`, above 0.
    pub fn again(
        &mut self,
        stage: &Stage<'_>,
        studio: Option<&mut RenderSession>,
        number: u32,
    ) -> anyhow::Result<Run> {
        let (started, cpu) = (Instant::now(), cpu_time());
        let own_passes_ms = match &mut self.ready()?.chosen {
            Some(chosen) => frame(stage, studio, chosen, nudged(stage.view, number))?.own_passes_ms,
            None => {
                self.traced(stage)?;
                None
            }
        };
        let wall_ms = started.elapsed().as_secs_f64() * 1e3;
        Ok(Run { wall_ms, own_passes_ms, cpu_ms: cpu_ms_since(cpu) })
    }

    /// What the stages of such a frame of a renderer take, of its display and of a PNG; a frame's parts are waited for
    /// one by one.
    pub fn split(
        &mut self,
        stage: &Stage<'_>,
        studio: &mut RenderSession,
        number: u32,
    ) -> anyhow::Result<Vec<StageTime>> {
        let clocks = clocks().context("this system does not tell CPU time")?;
        let Some(chosen) = &mut self.ready()?.chosen else { bail!("a tracer has no stages") };
        studio.engine.tell_stages(clocks);
        let drawn = frame(stage, Some(&mut *studio), chosen, nudged(stage.view, number));
        let shown = drawn.and_then(|frame| {
            studio.engine.end_stage("what is left of the frame");
            let color = frame.rendered.image(&Output::Color);
            let color = color.ok_or_else(|| anyhow!("{} gave no colour", chosen.reference))?;
            let levels = outputs::levels(color, &stage.staging.how);
            studio.engine.end_stage("display transform");
            let encoded = png::encode_levels([color.width, color.height], levels)?;
            studio.engine.end_stage("PNG encoding");
            Ok(encoded.len())
        });
        let stages = studio.engine.stages();
        shown.map(|_| stages)
    }

    fn traced(&mut self, stage: &Stage<'_>) -> anyhow::Result<TracedPicture> {
        let unit = self.ready()?.unit.clone();
        let Stage { clouds, surroundings, view, .. } = *stage;
        let scene = &stage.staging.scene;
        let order = traced::order(&unit, &self.values, clouds, scene, surroundings, view);
        let progress = terminal::Progress::new(format!("tracing with {}", self.name));
        let goes_on = |done| progress.tell(done).is_continue();
        trace(&unit, order, &stage.plugins.patience(), goes_on)
            .map_err(|fault| anyhow!("{}: {fault}", self.reference))
    }
}

/// Frames until the picture stays, of all that an antialiased one is the mean of.
fn frame(
    stage: &Stage<'_>,
    studio: Option<&mut RenderSession>,
    chosen: &mut LoadedRenderer,
    view: View,
) -> anyhow::Result<ConvergedFrame> {
    let studio = studio.context("there is no graphics device")?;
    // Another may have drawn the same view, and each pays for its own.
    studio.engine.forget_surfaces();
    let values = chosen.values.clone();
    let drawn = stage.drawn(&view)?;
    let drawn = drawn.with(stage.clouds);
    let request = stage.request(&drawn, view, &values);
    studio.settle_antialiased(chosen, &request, stage.staging.antialias)
}

/// A view from a camera that is moved by less than anything shows, another for each number: nothing is
/// kept from another's frame.
pub fn nudged(mut view: View, number: u32) -> View {
    let camera = &mut view.camera;
    let x = camera.eye.x.abs();
    // Far from the origin, not less than what an f64 tells apart there.
    let step = (1e-12 * (camera.eye - camera.target).length()).max(4.0 * f64::EPSILON * x);
    camera.eye.x += step * f64::from(number);
    view
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use surfelshop_api::{Camera, Projection};

    #[test]
    fn no_two_nudges_are_the_same_however_far_from_the_origin() {
        for offset in [0.0, 5e6, -1e12] {
            let target = DVec3::splat(offset);
            let projection = Projection::Perspective { fov_y: 0.6 };
            let eye = target + DVec3::Z * 1e-3;
            let camera = Camera { eye, target, up: DVec3::Y, projection };
            let view = View { camera, size_px: [8; 2], near: 1e-9, far: 1.0 };
            let places: Vec<f64> = (0..50).map(|n| nudged(view, n).camera.eye.x).collect();
            assert!(places.windows(2).all(|pair| pair[0] < pair[1]), "{offset}");
        }
    }
}
