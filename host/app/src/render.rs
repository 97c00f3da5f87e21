//! `surfelshop render`: clouds and a renderer in, pictures out.

use crate::arguments::{Bits, RenderArguments, ToneMapChoice};
use crate::clouds::Clouds;
use crate::report::Written;
use crate::studio::{self, Studio};
use crate::values::{Format, OutputFile};
use crate::{camera, exr_file, files, pictures, report, terminal};
use anyhow::Context as _;
use serde::Serialize;
use serde_json::json;
use std::path::Path;
use std::time::Instant;
use surfelshop_api::graph::Output;
use surfelshop_api::{Scene, UnitKind};
use surfelshop_engine::picture::{Background, Development, ToneMap};
use surfelshop_engine::{RenderRequest, Rendered};

/// What an EXR file holds unless one output was asked for.
const EXR_LAYERS: [Output; 4] = [Output::Color, Output::Depth, Output::Normal, Output::Albedo];

/// Milliseconds of wall clock.
#[derive(Default, Serialize)]
struct Timings {
    /// Plugin and device.
    open_ms: f64,
    load_ms: f64,
    /// All frames, compilation included.
    render_ms: f64,
    write_ms: f64,
}

/// Runs the command.
pub(crate) fn run(arguments: &RenderArguments) -> anyhow::Result<()> {
    let mut timings = Timings::default();
    let started = Instant::now();
    // What can fail at once is tried before a large cloud is read.
    for file in &arguments.out {
        files::check_folder(file.path())?;
    }
    let scene = scene(arguments)?;
    let registry = studio::registry(&arguments.plugins.plugin)?;
    registry.find(UnitKind::Renderer, &arguments.renderer)?;
    let mut studio = Studio::open(&arguments.device, &arguments.plugins)?;
    let mut chosen = studio.choose(&registry, &arguments.renderer, &arguments.set)?;
    timings.open_ms = since(started);

    let started = Instant::now();
    let clouds = Clouds::read(&arguments.files)?;
    timings.load_ms = since(started);

    let extent = clouds.extent(scene.surface.radius_scale);
    let view = camera::view(&arguments.lens, &extent, arguments.size.0);
    let values = chosen.values.clone();
    let request = RenderRequest {
        clouds: &clouds.views(),
        facts: &clouds.facts,
        scene: &scene,
        view,
        values: &values,
        outputs: &wanted(arguments),
        frame_index: 0,
    };
    let settled = studio.settle(&mut chosen, &request)?;
    timings.render_ms = settled.milliseconds;
    let n_not_finite = check_finite(&settled.rendered);

    let started = Instant::now();
    let written = write_all(arguments, &settled.rendered)?;
    timings.write_ms = since(started);
    if !arguments.report.json {
        let line = |file: &Written| terminal::line(file.line(&studio, &chosen, &settled));
        return written.iter().try_for_each(line);
    }
    terminal::json(&json!({
        "command": "render",
        "version": env!("CARGO_PKG_VERSION"),
        "files": written,
        "clouds": clouds.loaded.iter().map(|loaded| &loaded.summary).collect::<Vec<_>>(),
        "facts": clouds.facts,
        "scene": scene,
        "tone_map": format!("{:?}", arguments.tone_map).to_lowercase(),
        "background": match arguments.background.0 {
            Background::Transparent => None,
            Background::Color(encoded) => Some(encoded),
        },
        "renderer": report::renderer(&chosen),
        "adapter": report::adapter(&studio),
        "frame": report::frame(&settled, &view),
        "pixels_not_finite": n_not_finite,
        "timings": timings,
        "counters": studio.engine.counters(),
    }))
}

/// Writes every file asked for.
fn write_all(arguments: &RenderArguments, rendered: &Rendered) -> anyhow::Result<Vec<Written>> {
    let how = development(arguments);
    let shown = arguments.output.clone().unwrap_or(Output::Color);
    let write = |file: &OutputFile| match file.format {
        Format::Png => write_png(file.path(), &shown, rendered, &how, arguments.bits),
        Format::Exr => write_exr(file.path(), arguments.output.as_ref(), rendered),
    };
    arguments.out.iter().map(write).collect()
}

fn since(started: Instant) -> f64 {
    started.elapsed().as_secs_f64() * 1e3
}

/// The scene these options describe.
fn scene(arguments: &RenderArguments) -> anyhow::Result<Scene> {
    let mut scene = Scene { exposure_stops: arguments.exposure, ..Scene::default() };
    if !arguments.light.is_empty() {
        scene.lights = arguments.light.iter().map(|light| light.0).collect();
    }
    let (n_lights, most) = (scene.lights.len(), Scene::MAX_LIGHTS);
    anyhow::ensure!(n_lights <= most, "expected at most {most} lights, found {n_lights} --light");
    if let Some(scale) = arguments.radius_scale {
        scene.surface.radius_scale = scale;
    }
    if let Some(tolerance) = arguments.depth_tolerance {
        scene.surface.depth_tolerance = tolerance;
    }
    if let Some(low_pass) = arguments.low_pass {
        scene.surface.low_pass = low_pass;
    }
    scene.surface.two_sided = !arguments.one_sided;
    Ok(scene)
}

fn development(arguments: &RenderArguments) -> Development {
    let tone_map = match arguments.tone_map {
        ToneMapChoice::Clamp => ToneMap::Clamp,
        ToneMapChoice::Neutral => ToneMap::Neutral,
    };
    Development { exposure_stops: arguments.exposure, tone_map, background: arguments.background.0 }
}

/// The outputs that the files need.
fn wanted(arguments: &RenderArguments) -> Vec<Output> {
    match &arguments.output {
        Some(output) => vec![output.clone()],
        None if arguments.out.iter().any(|file| file.format == Format::Exr) => EXR_LAYERS.to_vec(),
        None => vec![Output::Color],
    }
}

/// Counts pixels that are not finite and says so: they are a fault of the renderer.
fn check_finite(rendered: &Rendered) -> usize {
    let mut total = 0;
    for (output, image) in &rendered.images {
        let n_pixels = pictures::not_finite(image);
        if n_pixels > 0 {
            let name = output.name();
            terminal::note(format!("warning: {n_pixels} pixels of {name} are not finite"));
        }
        total += n_pixels;
    }
    total
}

/// Writes one output as a screen shows it.
pub(crate) fn write_png(
    path: &Path,
    output: &Output,
    rendered: &Rendered,
    how: &Development,
    bits: Bits,
) -> anyhow::Result<Written> {
    let image = rendered
        .image(output)
        .ok_or_else(|| anyhow::anyhow!("the renderer gave no output `{}`", output.name()))?;
    let bytes = pictures::png(&pictures::visible(output, image, how), bits)
        .with_context(|| format!("{}: cannot be encoded", path.display()))?;
    files::write_whole(path, &bytes)?;
    let size = [image.width, image.height];
    Ok(Written::new(path, "png", &[output], size, bits.number(), bytes.len()))
}

/// Writes one output, or all, as linear floats.
pub(crate) fn write_exr(
    path: &Path,
    only: Option<&Output>,
    rendered: &Rendered,
) -> anyhow::Result<Written> {
    let is_wanted = |output: &Output| only.is_none_or(|only| only == output);
    let images: Vec<_> = rendered.images.iter().filter(|(output, _)| is_wanted(output)).collect();
    let bytes =
        exr_file::exr(&images).with_context(|| format!("{}: cannot be encoded", path.display()))?;
    files::write_whole(path, &bytes)?;
    let outputs: Vec<&Output> = images.iter().map(|(output, _)| output).collect();
    let size = images.first().map_or([0; 2], |(_, image)| [image.width, image.height]);
    Ok(Written::new(path, "exr", &outputs, size, 32, bytes.len()))
}
