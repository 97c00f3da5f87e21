//! `surfelshop demo`: the sample cloud by every renderer.

use anyhow::{Context as _, bail};
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use surfelshop_api::graph::Output;
use surfelshop_api::{Scene, UnitKind, View};
use surfelshop_cloud::scene::{ProbeSource, SceneEnvironment};
use surfelshop_image::display_transform::DisplayTransform;
use surfelshop_render::RenderRequest;
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::input::environment_map::{LoadedEnvironment, Probes};
use surfelshop_session::input::formats::SessionFormats;
use surfelshop_session::input::sample::find_sample;
use surfelshop_session::input::scenes::Source;
use surfelshop_session::options::camera::{self, CameraSpec};
use surfelshop_session::options::values::{self, Backdrop, Size};
use surfelshop_session::options::{
    Bits, DeviceArguments, LensArguments, PluginFiles, PrintArguments, UpAxis,
};
use surfelshop_session::output::command_line;
use surfelshop_session::output::json::{self, Written};
use surfelshop_session::output::terminal;
use surfelshop_session::render::{write_exr, write_png};
use surfelshop_session::session::{self, RenderSession};

/// Options of `surfelshop demo`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  surfelshop demo --out pictures --size 640x480")]
pub struct DemoArguments {
    /// The folder to write pictures into; made where it does not exist.
    #[arg(short, long, value_name = "DIR", default_value = "demo")]
    pub out: PathBuf,
    /// Width and height in pixels, or one number for a square.
    #[arg(long, value_name = "WxH", default_value = "1024x1024", value_parser = Size::parse)]
    pub size: Size,
    /// Make edges smooth: draw so many frames, each seen at another place of every pixel, and show their mean.
    #[arg(long, value_name = "FRAMES", default_value_t = 1, value_parser = values::antialias)]
    pub antialias: u32,
    /// Plugins beside the installed ones.
    #[command(flatten)]
    pub plugins: PluginFiles,
    /// The graphics device.
    #[command(flatten)]
    pub device: DeviceArguments,
    /// The form of what is printed.
    #[command(flatten)]
    pub report: PrintArguments,
}

/// The renderer whose first view is stored as EXR, too.
const SHOWPIECE: &str = "ewa-phong";

/// Runs the command.
pub fn run(arguments: &DemoArguments) -> anyhow::Result<()> {
    let sample = find_sample()?;
    let registry = session::registry(&arguments.plugins)?;
    let installed = registry.names(UnitKind::Renderer);
    if installed.is_empty() {
        bail!("no renderer is installed; `surfelshop plugins` says where it looked");
    }
    let mut studio = RenderSession::open(&arguments.device, &arguments.plugins)?;
    let clouds = Clouds::read(&[Source::file(&sample)], &SessionFormats::new(&arguments.plugins))?;
    // Some read columns that the sample does not have.
    let suits = |name: &String| registry.suits(name, &clouds.facts.clouds);
    let renderers: Vec<String> = installed.into_iter().filter(suits).collect();
    std::fs::create_dir_all(&arguments.out)
        .with_context(|| format!("{}: the folder cannot be made", arguments.out.display()))?;
    let surroundings =
        Probes::default().light(&SceneEnvironment::new(ProbeSource::Studio), drop)?;
    let stage = Stage { arguments, clouds: &clouds, scene: Scene::default(), surroundings };
    let mut written = Vec::new();
    let mut failures = Vec::new();
    for renderer in &renderers {
        match stage.pictures(&mut studio, &registry, renderer) {
            Ok(files) => written.extend(files),
            // One broken plugin must not keep the others from being shown.
            Err(error) => {
                terminal::note(format!("{error:#}"));
                failures.push(renderer.as_str());
            }
        }
    }
    if arguments.report.json {
        terminal::json(&json!({
            "command": "demo",
            "version": env!("CARGO_PKG_VERSION"),
            "files": written,
            "failed": failures,
            "cloud": clouds.loaded[0].summary,
            "adapter": json::adapter(&studio),
            "counters": studio.engine.counters(),
        }))?;
    } else {
        terminal::line(closing(arguments, &sample, written.len(), &renderers))?;
    }
    match failures.as_slice() {
        [] => Ok(()),
        failed => {
            bail!("{} of {} renderers failed: {}", failed.len(), renderers.len(), failed.join(", "))
        }
    }
}

/// What was made and what to try next.
fn closing(
    arguments: &DemoArguments,
    sample: &Path,
    n_files: usize,
    renderers: &[String],
) -> String {
    let (out, program) = (arguments.out.display(), command_line::program());
    let sample = command_line::from_here(sample);
    let renderer = renderers.iter().find(|name| *name == SHOWPIECE).or(renderers.last());
    let renderer = renderer.map_or(SHOWPIECE, String::as_str);
    format!(
        "\nMade {n_files} pictures in {out} from {sample}. Try next:\n  \
         {program} render {sample} -r {renderer} -o side.png --camera right --zoom 2\n  \
         {program} info {sample}\n  \
         {program} plugins"
    )
}

struct Stage<'a> {
    arguments: &'a DemoArguments,
    clouds: &'a Clouds,
    scene: Scene,
    /// For the renderers that use light from around.
    surroundings: LoadedEnvironment,
}

impl Stage<'_> {
    /// One renderer's pictures from every camera.
    fn pictures(
        &self,
        studio: &mut RenderSession,
        registry: &surfelshop_runtime::plugins::Registry,
        renderer: &str,
    ) -> anyhow::Result<Vec<Written>> {
        let mut chosen = studio.choose(registry, renderer, &[])?;
        let views = self.clouds.views();
        let values = chosen.values.clone();
        let stem = renderer.replace('/', "-");
        let how = DisplayTransform { background: backdrop(), ..DisplayTransform::default() };
        let mut written = Vec::new();
        for (i, (name, view)) in self.views().into_iter().enumerate() {
            let with_layers = i == 0 && renderer == SHOWPIECE;
            let layers = [Output::Color, Output::Depth, Output::Normal, Output::Albedo];
            let outputs = if with_layers { &layers[..] } else { &layers[..1] };
            let request = RenderRequest {
                clouds: &views,
                facts: &self.clouds.facts,
                scene: &self.scene,
                view,
                values: &values,
                outputs,
                frame_index: 0,
                environment: Some(self.surroundings.view()),
                stride: 1,
                detail_px: 0.0,
                parts: None,
                eye_dome: None,
            };
            let n_samples = self.arguments.antialias;
            let settled = studio.settle_antialiased(&mut chosen, &request, n_samples)?;
            let path = |ending: &str| self.arguments.out.join(format!("{stem}-{name}.{ending}"));
            let rendered = &settled.rendered;
            let mut files =
                vec![write_png(&path("png"), &Output::Color, rendered, &how, Bits::Eight, None)?];
            if with_layers {
                files.push(write_exr(&path("exr"), None, rendered)?);
            }
            if !self.arguments.report.json {
                for file in &files {
                    terminal::line(file.line(studio, &chosen, &settled))?;
                }
            }
            written.append(&mut files);
        }
        Ok(written)
    }

    fn views(&self) -> [(&'static str, View); 2] {
        let extent = self.clouds.extent(self.scene.surface.radius_scale);
        let lens = |camera, zoom| LensArguments {
            camera,
            up: UpAxis::Y,
            fov: None,
            orthographic: false,
            zoom,
        };
        [
            ("three-quarter", lens(CameraSpec::three_quarter(), 1.08)),
            ("close", lens(CameraSpec::front(), 2.2)),
        ]
        .map(|(name, lens)| (name, camera::view(&lens, &extent, self.arguments.size.0)))
    }
}

fn backdrop() -> surfelshop_image::display_transform::Background {
    Backdrop::parse("#e8e6e1").map_or_else(|_| Default::default(), |backdrop| backdrop.0)
}
