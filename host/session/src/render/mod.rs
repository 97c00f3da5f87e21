//! `surfelshop render`: clouds and a renderer in, pictures out.

mod arguments;
pub mod camera_path;
mod chosen;
mod columns;
pub mod path_pictures;
pub mod traced;

pub use arguments::RenderArguments;
use chosen::choose_suited;
pub use chosen::{known_now, suited_or};

use crate::captured_graph;
use crate::cloud_renderers;
use crate::eye_dome;
use crate::input::clouds::Clouds;
use crate::input::displayed::DisplayedClouds;
use crate::input::environment_map::{self, LoadedEnvironment};
use crate::input::formats::SessionFormats;
use crate::input::inside;
use crate::input::plausibility;
use crate::input::probe_info;
use crate::input::scenes::Inputs;
use crate::options::camera::{self, Extent};
use crate::options::explicit::ExplicitOptions;
use crate::options::values::{Format, OutputFile};
use crate::options::{Bits, PictureArguments};
use crate::output::json::{self, Written};
use crate::output::overlay::Overlay;
use crate::output::{files, measures, terminal};
use crate::session::{self, ConvergedFrame, LoadedRenderer, RenderSession};
use crate::setup::{self, RenderSetup, SelectedView};
use anyhow::{Context as _, anyhow, ensure};
use serde::Serialize;
use serde_json::json;
use std::path::Path;
use std::time::Instant;
use surfelshop_api::graph::Output;
use surfelshop_api::{UnitKind, View};
use surfelshop_cloud::display::Legend;
use surfelshop_cloud::scene::{OpenedScene, Units};
use surfelshop_image::display_transform::{Background, DisplayTransform};
use surfelshop_image::{exr, outputs, png};
use surfelshop_render::{RenderRequest, Rendered};
use surfelshop_runtime::plugins::{Registry, UnitRef};

/// What an EXR file holds unless one output was asked for.
const EXR_LAYERS: [Output; 4] = [Output::Color, Output::Depth, Output::Normal, Output::Albedo];

/// Milliseconds of wall clock.
#[derive(Default, Serialize)]
struct Timings {
    /// Plugin and device, and all that is looked for before.
    open_ms: f64,
    device_ms: f64,
    /// Loading the plugin and starting the renderer.
    plugin_ms: f64,
    /// Clouds and the light around them.
    load_ms: f64,
    /// All frames, compilation included.
    render_ms: f64,
    /// The first of them.
    frame_ms: f64,
    /// What columns took of that on their way to where they are drawn.
    columns_ms: f64,
    write_ms: f64,
}

impl Timings {
    /// Takes the times of a picture's frames.
    fn frames(&mut self, settled: &ConvergedFrame) {
        self.render_ms = settled.milliseconds;
        self.frame_ms = settled.first_ms;
        self.columns_ms = settled.columns_ms;
    }
}

/// Loads the renderer of the view, with the parameters that are meant for it.
fn choose(
    arguments: &RenderArguments,
    inputs: &Inputs,
    studio: &RenderSession,
    reference: UnitRef,
    seen: Option<&SelectedView<'_>>,
) -> anyhow::Result<LoadedRenderer> {
    let named = cloud_renderers::named(&inputs.sources);
    let of_view = cloud_renderers::settings_of_view(&arguments.set, &reference, &named);
    studio.choose_for(reference, seen, &of_view)
}

/// Writes the graph that the renderer described, where that is asked for.
fn save_graph(arguments: &RenderArguments, chosen: &LoadedRenderer) -> anyhow::Result<()> {
    match &arguments.save_graph {
        Some(path) => captured_graph::save(path, chosen.view.graph()),
        None => Ok(()),
    }
}

/// Runs the command.
pub fn run(arguments: &RenderArguments, given: &ExplicitOptions) -> anyhow::Result<()> {
    let mut timings = Timings::default();
    let started = Instant::now();
    let inputs = Inputs::open(&arguments.files)?;
    // What can fail at once is tried before a large cloud is read.
    files::check_outputs(&outputs(arguments))?;
    let opened = inputs.opened.as_ref();
    let registry = session::registry(&arguments.plugins)?;
    let graph = arguments.graph.as_deref().map(captured_graph::renderer).transpose()?;
    let of_setup = || setup::renderer(arguments, given, opened, &registry);
    let (reference, seen) =
        graph.as_ref().map_or_else(of_setup, |graph| Ok((graph.reference.clone(), None)))?;
    let staging = RenderSetup::new(&arguments.picture, given, opened, seen.as_ref())?;
    let mut staging = staging.showing(arguments.output.clone());
    if reference.kind == UnitKind::Tracer {
        ensure!(arguments.save_graph.is_none(), "{reference} describes no graph to save");
        return traced::render(arguments, &inputs, &reference, seen.as_ref(), &staging);
    }
    let mut studio = open_studio(arguments, &registry, &staging, &mut timings)?;
    let loading = Instant::now();
    let is_said = given.has("renderer") || setup::first_view(opened).is_some() || graph.is_some();
    let first =
        graph.map_or_else(|| choose(arguments, &inputs, &studio, reference, seen.as_ref()), Ok);
    let first = (is_said, known_now(first, is_said || arguments.set.is_empty())?);
    timings.plugin_ms = since(loading);
    timings.open_ms = since(started);

    let started = Instant::now();
    let (surroundings, displayed) = opened_scene(arguments, &inputs, &mut staging)?;
    let clouds = &displayed.clouds;
    timings.load_ms = since(started);
    let mut chosen = choose_suited(arguments, &inputs, &registry, clouds, &mut studio, first)?;

    let scene =
        Drawing { arguments, staging: &staging, clouds, surroundings: surroundings.as_ref() };
    if arguments.path.is_some() {
        let film = path_pictures::PathPictures {
            arguments,
            staging: &staging,
            displayed: &displayed,
            opened,
            units: path_pictures::units_of(&chosen),
            sources: &inputs.sources,
            device: studio.engine.gpu().describe(),
        };
        studio.engine.draw_in_passing(true);
        let timed = |done: ConvergedFrame| (done.rendered, done.milliseconds);
        return film.render(|view| scene.frame(&mut studio, &mut chosen, view).map(timed));
    }
    let view = view(&arguments.picture, &staging, clouds);
    let settled = scene.frame(&mut studio, &mut chosen, view)?;
    timings.frames(&settled);
    note(clouds, &staging, &chosen, &settled);
    let n_not_finite = check_finite(&settled.rendered);

    let started = Instant::now();
    let overlay = overlay_of(arguments, inputs.opened.as_ref(), &staging, &displayed, view);
    let written = write_all(&arguments.out, arguments, &staging, &overlay, &settled.rendered)?;
    save_graph(arguments, &chosen)?;
    timings.write_ms = since(started);
    if !arguments.report.json {
        let line = |file: &Written| terminal::line(file.line(&studio, &chosen, &settled));
        return written.iter().try_for_each(line);
    }
    terminal::json(&json!({
        "command": "render",
        "version": env!("CARGO_PKG_VERSION"),
        "files": written,
        "scene_file": opened.map(|opened| opened.path.display().to_string()),
        "clouds": displayed.summaries(),
        "facts": clouds.facts,
        "display": displayed.object(),
        "scene": staging.scene,
        "environment": surroundings.as_ref().map(|light| probe_info::object(&light.probe)),
        "tone_map": format!("{:?}", staging.how.tone_map).to_lowercase(),
        "background": encoded(staging.how.background),
        "eye_dome_lighting": eye_dome::shown(&staging.eye_dome, clouds).map(|how| [how.strength, how.radius]),
        "renderer": json::renderer(&chosen),
        "renderers": json::renderers(&chosen, &settled),
        "adapter": json::adapter(&studio),
        "frame": json::frame(&settled, &view),
        "pixels_not_finite": n_not_finite,
        "timings": timings,
        "counters": studio.engine.counters(),
    }))
}

/// What pictures are drawn of.
struct Drawing<'a> {
    arguments: &'a RenderArguments,
    staging: &'a RenderSetup,
    clouds: &'a Clouds,
    surroundings: Option<&'a LoadedEnvironment>,
}

impl Drawing<'_> {
    /// The picture of a view.
    fn frame(
        &self,
        studio: &mut RenderSession,
        chosen: &mut LoadedRenderer,
        view: View,
    ) -> anyhow::Result<ConvergedFrame> {
        let Self { arguments, staging, clouds, surroundings } = *self;
        let values = chosen.values.clone();
        let drawn = staging.drawn(clouds, &view)?;
        let drawn_views = drawn.with(clouds);
        let request = RenderRequest {
            clouds: drawn_views.clouds(),
            facts: &clouds.facts,
            scene: &staging.scene,
            view,
            values: &values,
            outputs: &wanted(arguments, staging.output.as_ref()),
            frame_index: 0,
            environment: surroundings.map(LoadedEnvironment::view),
            stride: 1,
            detail_px: staging.detail_px,
            parts: drawn_views.parts(),
            eye_dome: eye_dome::shown(&staging.eye_dome, clouds),
        };
        studio.settle_antialiased(chosen, &request, staging.antialias)
    }
}

/// Reads the light around and the clouds.
fn opened_scene(
    arguments: &RenderArguments,
    inputs: &Inputs,
    staging: &mut RenderSetup,
) -> anyhow::Result<(Option<LoadedEnvironment>, DisplayedClouds)> {
    environment_map::protect(staging.environment.as_ref());
    files::check_outputs(&outputs(arguments))?;
    let formats = SessionFormats::new(&arguments.plugins);
    let (surroundings, displayed) = staging.read(&inputs.sources, &formats)?;
    Ok((surroundings, displayed))
}

/// All files that are to be written.
fn outputs(arguments: &RenderArguments) -> Vec<&Path> {
    let pictures = arguments.out.iter().map(OutputFile::path);
    pictures.chain(arguments.save_graph.as_deref()).collect()
}

/// Opens the device; without one the line says what draws all the same.
fn open_studio(
    arguments: &RenderArguments,
    registry: &Registry,
    staging: &RenderSetup,
    timings: &mut Timings,
) -> anyhow::Result<RenderSession> {
    let opening = Instant::now();
    // What a captured graph would have stored may have been made of another scene than its key says.
    let store = if arguments.graph.is_none() { environment_map::store() } else { None };
    let opened = RenderSession::open_with(&arguments.device, &arguments.plugins, store);
    let mut studio = opened.map_err(|error| match registry.names(UnitKind::Tracer).first() {
        Some(tracer) => anyhow!("{error:#}; `-r {tracer}` draws without one"),
        None => error,
    })?;
    studio.engine.tint_backs(staging.display.splats.tint_backs);
    timings.device_ms = since(opening);
    Ok(studio)
}

/// Says what of the scene cannot be seen, and where less detail was asked for and is not to be had.
fn note(clouds: &Clouds, staging: &RenderSetup, chosen: &LoadedRenderer, settled: &ConvergedFrame) {
    plausibility::note(clouds, &staging.scene);
    columns::note(chosen, &clouds.facts);
    if staging.detail_px > 0.0 && !settled.rendered.merged {
        let renderer = chosen.ids();
        terminal::note(format!("--detail changes nothing: {renderer} takes no merged surfels"));
    }
    if staging.antialias > 1 && settled.n_samples == 1 {
        let shown = staging.output.as_ref().map_or_else(String::new, Output::name);
        terminal::note(format!(
            "--antialias changes nothing: {shown} is that of one frame, only color is a mean"
        ));
    }
}

/// The colour behind the clouds, sRGB-encoded, or those at the upper and the lower edge.
fn encoded(background: Background) -> Option<serde_json::Value> {
    match background {
        Background::Transparent => None,
        Background::Color(encoded) => Some(json!(encoded)),
        Background::Gradient { top, bottom } => Some(json!([top, bottom])),
    }
}

/// The view through the scene's camera, or through the one that was typed.
pub fn view(arguments: &PictureArguments, staging: &RenderSetup, clouds: &Clouds) -> View {
    view_of(arguments, staging, clouds, &clouds.extent(staging.scene.surface.radius_scale))
}

/// The same, where the extent of the clouds is known.
pub fn view_of(
    arguments: &PictureArguments,
    staging: &RenderSetup,
    clouds: &Clouds,
    extent: &Extent,
) -> View {
    let lens = staging.lens(&arguments.lens);
    let (lens, size) = (&inside::lens(&lens, clouds), arguments.size.0);
    match &staging.camera {
        Some(camera) => camera::through(camera, lens, staging.parallel, extent, size),
        None => camera::view(lens, extent, size),
    }
}

/// What is drawn over the picture of a view, where that was asked for.
pub fn overlay_of(
    arguments: &RenderArguments,
    opened: Option<&OpenedScene>,
    staging: &RenderSetup,
    displayed: &DisplayedClouds,
    view: View,
) -> Overlay {
    let scene = opened.iter().filter(|_| arguments.measures).map(|opened| &opened.scene);
    let all = scene.flat_map(|scene| &scene.measures).map(|measure| &measure.known);
    let units = Units { metres: displayed.clouds.metres_per_unit() };
    let measures = measures::drawn(all, staging.display.up, units, &displayed.clouds);
    if arguments.measures && measures.is_empty() {
        terminal::note("--measures draws nothing: no scene with visible measures is rendered");
    }
    Overlay { view, measures, legend: legend_of(arguments, displayed) }
}

/// The legend that was asked for; says where there is nothing to explain.
fn legend_of(arguments: &RenderArguments, displayed: &DisplayedClouds) -> Option<Legend> {
    if !arguments.legend {
        return None;
    }
    let legend = displayed.legend();
    if legend.is_none() {
        terminal::note("--legend draws nothing: name what colours surfels with --color-by");
    }
    legend
}

/// Writes every file asked for; an overlay is drawn into those that a screen shows.
pub fn write_all(
    out: &[OutputFile],
    arguments: &RenderArguments,
    staging: &RenderSetup,
    overlay: &Overlay,
    rendered: &Rendered,
) -> anyhow::Result<Vec<Written>> {
    let shown = staging.output.as_ref();
    let overlay = Some(overlay).filter(|overlay| !overlay.is_empty());
    let write = |file: &OutputFile| match file.format {
        Format::Png => {
            let shown = shown.unwrap_or(&Output::Color);
            write_png(file.path(), shown, rendered, &staging.how, arguments.bits, overlay)
        }
        Format::Exr => write_exr(file.path(), shown, rendered),
    };
    out.iter().map(write).collect()
}

fn since(started: Instant) -> f64 {
    started.elapsed().as_secs_f64() * 1e3
}

/// The outputs that the files need.
fn wanted(arguments: &RenderArguments, shown: Option<&Output>) -> Vec<Output> {
    match shown {
        Some(output) => vec![output.clone()],
        None if arguments.out.iter().any(|file| file.format == Format::Exr) => EXR_LAYERS.to_vec(),
        None => vec![Output::Color],
    }
}

/// Counts pixels that are not finite and says so: they are a fault of the renderer.
pub fn check_finite(rendered: &Rendered) -> usize {
    let mut total = 0;
    for (output, image) in &rendered.images {
        let n_pixels = outputs::not_finite(image);
        if n_pixels > 0 {
            let name = output.name();
            terminal::warn(format!("{n_pixels} pixels of {name} are not finite"));
        }
        total += n_pixels;
    }
    total
}

/// Writes one output as a screen shows it.
pub fn write_png(
    path: &Path,
    output: &Output,
    rendered: &Rendered,
    how: &DisplayTransform,
    bits: Bits,
    overlay: Option<&Overlay>,
) -> anyhow::Result<Written> {
    let image = rendered
        .image(output)
        .ok_or_else(|| anyhow::anyhow!("the renderer gave no output `{}`", output.name()))?;
    let encoded = match (output, bits, overlay) {
        // The same levels, many times faster.
        (Output::Color | Output::Debug(_), Bits::Eight, None) => {
            png::encode_levels([image.width, image.height], outputs::levels(image, how))
        }
        _ => {
            let mut visible = match (output, bits) {
                // The window draws over levels, too: so both write the same picture.
                (Output::Color | Output::Debug(_), Bits::Eight) => {
                    let levels = outputs::levels(image, how);
                    let data = levels.iter().map(|&level| f32::from(level) / 255.0).collect();
                    surfelshop_image::Image {
                        width: image.width,
                        height: image.height,
                        components: 4,
                        data,
                    }
                }
                _ => outputs::visible(output, image, how),
            };
            if let Some(overlay) = overlay {
                overlay.draw(&mut visible);
            }
            png::encode(&visible, bits.into())
        }
    };
    let bytes = encoded.with_context(|| format!("{}: cannot be encoded", path.display()))?;
    files::write_whole(path, &bytes)?;
    let size = [image.width, image.height];
    Ok(Written::new(path, "png", &[output], size, bits.number(), bytes.len()))
}

/// Writes one output, or all, as linear floats.
pub fn write_exr(
    path: &Path,
    only: Option<&Output>,
    rendered: &Rendered,
) -> anyhow::Result<Written> {
    let is_wanted = |output: &Output| only.is_none_or(|only| only == output);
    let images: Vec<_> = rendered.images.iter().filter(|(output, _)| is_wanted(output)).collect();
    let bytes =
        exr::encode(&images).with_context(|| format!("{}: cannot be encoded", path.display()))?;
    files::write_whole(path, &bytes)?;
    let outputs: Vec<&Output> = images.iter().map(|(output, _)| output).collect();
    let size = images.first().map_or([0; 2], |(_, image)| [image.width, image.height]);
    Ok(Written::new(path, "exr", &outputs, size, 32, bytes.len()))
}
