//! `surfelshop render` with a tracer: no graphics device, on all cores.

use crate::input::clouds::Clouds;
use crate::input::environment_map::LoadedEnvironment;
use crate::input::formats::SessionFormats;
use crate::input::plausibility;
use crate::input::pyramids;
use crate::input::scenes::Inputs;
use crate::output::json::{self, Written};
use crate::output::terminal;
use crate::render::path_pictures::{DrawingUnit, PathPictures};
use crate::render::{self, RenderArguments};
use crate::setup::{RenderSetup, SelectedView};
use crate::{cloud_renderers, eye_dome, parameters, session};
use anyhow::{anyhow, bail};
use serde_json::json;
use std::sync::Arc;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{FrameRequest, Scene, View};
use surfelshop_image::TracedPicture;
use surfelshop_render::Rendered;
use surfelshop_runtime::plugins::{LoadedUnit, UnitRef};
use surfelshop_runtime::trace::{TraceOrder, samples_of, trace};

/// What a tracer offers besides its colour: the variance of each pixel's mean.
const VARIANCE: &str = "variance";

/// Traces a picture and writes it.
pub fn render(
    arguments: &RenderArguments,
    inputs: &Inputs,
    reference: &UnitRef,
    seen: Option<&SelectedView<'_>>,
    staging: &RenderSetup,
) -> anyhow::Result<()> {
    let variance = Output::Debug(VARIANCE.to_owned());
    if let Some(wanted) = &staging.output
        && ![Output::Color, variance.clone()].contains(wanted)
    {
        let wanted = wanted.name();
        bail!("{reference} offers no output `{wanted}`; it offers color, {}", variance.name());
    }
    let unit = session::load(reference, &arguments.plugins.patience())?;
    let declared = &unit.description.params;
    let (values, unknown) = parameters::resolved(reference, declared, seen, &arguments.set)?;
    unknown.iter().for_each(terminal::warn);
    let left_out = format!("{} traces the whole scene", reference.id);
    cloud_renderers::note_left_out(&inputs.sources, &left_out);
    let formats = SessionFormats::new(&arguments.plugins);
    let staging = &mut staging.clone();
    let (surroundings, displayed) = staging.read(&inputs.sources, &formats)?;
    let clouds = &displayed.clouds;
    plausibility::note(clouds, &staging.scene);
    pyramids::note_traced(clouds);
    note_without_effect(staging, clouds, &reference.id);
    let traced = |view: View| -> anyhow::Result<TracedPicture> {
        let order = order(&unit, &values, clouds, &staging.scene, surroundings.as_ref(), view);
        let progress = terminal::Progress::new(format!("tracing with {}", reference.id));
        let goes_on = |done| progress.tell(done).is_continue();
        trace(&unit, order, &arguments.plugins.patience(), goes_on)
            .map_err(|fault| anyhow!("{reference}: {fault}"))
    };
    if arguments.path.is_some() {
        let own = DrawingUnit {
            reference: reference.clone(),
            unit: unit.clone(),
            values: values.clone(),
        };
        let film = PathPictures {
            arguments,
            staging,
            displayed: &displayed,
            opened: inputs.opened.as_ref(),
            units: vec![own],
            sources: &inputs.sources,
            device: "no graphics device".to_owned(),
        };
        return film.render(|view| {
            let picture = traced(view)?;
            Ok((rendered(&picture), picture.took.as_secs_f64() * 1e3))
        });
    }
    let view = render::view(&arguments.picture, staging, clouds);
    let picture = traced(view)?;
    let rendered = rendered(&picture);
    let n_not_finite = render::check_finite(&rendered);
    let overlay = render::overlay_of(arguments, inputs.opened.as_ref(), staging, &displayed, view);
    let written = render::write_all(&arguments.out, arguments, staging, &overlay, &rendered)?;
    if !arguments.report.json {
        return written.iter().try_for_each(|file| terminal::line(line(file, reference, &picture)));
    }
    terminal::json(&json!({
        "command": "render",
        "version": env!("CARGO_PKG_VERSION"),
        "files": written,
        "clouds": clouds.loaded.iter().map(|loaded| &loaded.summary).collect::<Vec<_>>(),
        "facts": clouds.facts,
        "display": displayed.object(),
        "scene": staging.scene,
        "renderer": json::unit(reference, &unit, &values),
        "frame": frame(&picture, &view),
        "pixels_not_finite": n_not_finite,
    }))
}

/// Says which settings change nothing of what is traced.
fn note_without_effect(staging: &RenderSetup, clouds: &Clouds, id: &str) {
    if staging.antialias > 1 {
        terminal::note(format!(
            "--antialias changes nothing: {id} takes samples of its own in each pixel"
        ));
    }
    if eye_dome::shown(&staging.eye_dome, clouds).is_some() {
        terminal::note(format!(
            "eye-dome lighting changes nothing: {id} gives no distances (`--eye-dome-lighting=off` leaves this note out)"
        ));
    }
}

/// What was traced, as renderers' pictures are.
fn rendered(picture: &TracedPicture) -> Rendered {
    let variance = Output::Debug(VARIANCE.to_owned());
    let images = vec![(Output::Color, picture.color.clone()), (variance, picture.variance.clone())];
    let (passes, graph_bytes, wants_another_frame) = (Vec::new(), 0, false);
    let columns_ms = 0.0;
    // A tracer meets every surfel.
    let merged = false;
    let parts = Vec::new();
    Rendered { images, passes, graph_bytes, merged, columns_ms, wants_another_frame, parts }
}

/// What a tracer is asked for, on all cores.
pub fn order(
    unit: &LoadedUnit,
    values: &Values,
    clouds: &Clouds,
    scene: &Scene,
    surroundings: Option<&LoadedEnvironment>,
    view: View,
) -> TraceOrder {
    let light = surroundings.map(LoadedEnvironment::view);
    TraceOrder {
        clouds: clouds.loaded.iter().map(|loaded| loaded.cloud.clone()).collect(),
        request: FrameRequest {
            view,
            scene: scene.clone(),
            cloud: clouds.facts.clone(),
            frame_index: 0,
            values: values.clone(),
            environment: light.map(|light| light.environment.clone()),
        },
        texels: light.map(|light| Arc::from(light.texels)).unwrap_or_default(),
        samples: samples_of(unit, values),
        threads: 0,
    }
}

fn line(file: &Written, reference: &UnitRef, picture: &TracedPicture) -> String {
    format!(
        "{}, {}, {} samples in {:.1} s, standard error {:.5}",
        file.what(),
        reference.id,
        picture.samples,
        picture.took.as_secs_f64(),
        picture.standard_error()
    )
}

fn frame(picture: &TracedPicture, view: &View) -> serde_json::Value {
    json!({
        "size": view.size_px,
        "samples": picture.samples,
        "seconds": picture.took.as_secs_f64(),
        "standard_error": picture.standard_error(),
    })
}
