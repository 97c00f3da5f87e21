//! `surfelshop demo`: the sample cloud by every renderer.

use crate::arguments::{Bits, DemoArguments, LensArguments, UpAxis};
use crate::camera::CameraSpec;
use crate::clouds::Clouds;
use crate::render::{write_exr, write_png};
use crate::report::Written;
use crate::scenes::Source;
use crate::studio::{self, Studio};
use crate::surroundings::{Probes, Surroundings};
use crate::values::Backdrop;
use crate::{camera, report, terminal};
use anyhow::{Context as _, bail};
use serde_json::json;
use std::path::{Path, PathBuf};
use surfelshop_api::graph::Output;
use surfelshop_api::{Scene, UnitKind, View};
use surfelshop_cloud::scene::{ProbeSource, SceneEnvironment};
use surfelshop_engine::RenderRequest;
use surfelshop_engine::picture::Development;

/// Where the sample lies, from a folder above the program or from the current one.
const SAMPLE: &str = "assets/sample.ply";

/// The renderer whose first view is stored as EXR, too.
const SHOWPIECE: &str = "ewa-phong";

/// Runs the command.
pub(crate) fn run(arguments: &DemoArguments) -> anyhow::Result<()> {
    let sample = find_sample()?;
    let registry = studio::registry(&arguments.plugins)?;
    let renderers = registry.names(UnitKind::Renderer);
    if renderers.is_empty() {
        bail!("no renderer is installed; `surfelshop plugins` says where it looked");
    }
    let mut studio = Studio::open(&arguments.device, &arguments.plugins)?;
    let clouds = Clouds::read(&[Source::file(&sample)])?;
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
            "adapter": report::adapter(&studio),
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
    let (out, sample) = (arguments.out.display(), sample.display());
    let renderer = renderers.iter().find(|name| *name == SHOWPIECE).or(renderers.last());
    let renderer = renderer.map_or(SHOWPIECE, String::as_str);
    format!(
        "\nMade {n_files} pictures in {out} from {sample}. Try next:\n  \
         surfelshop render {sample} -r {renderer} -o side.png --camera right --zoom 2\n  \
         surfelshop info {sample}\n  \
         surfelshop plugins"
    )
}

struct Stage<'a> {
    arguments: &'a DemoArguments,
    clouds: &'a Clouds,
    scene: Scene,
    /// For the renderers that use light from around.
    surroundings: Surroundings,
}

impl Stage<'_> {
    /// One renderer's pictures from every camera.
    fn pictures(
        &self,
        studio: &mut Studio,
        registry: &surfelshop_engine::plugins::Registry,
        renderer: &str,
    ) -> anyhow::Result<Vec<Written>> {
        let mut chosen = studio.choose(registry, renderer, &[])?;
        let views = self.clouds.views();
        let values = chosen.values.clone();
        let stem = renderer.replace('/', "-");
        let how = Development { background: backdrop(), ..Development::default() };
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
            };
            let settled = studio.settle(&mut chosen, &request)?;
            let path = |ending: &str| self.arguments.out.join(format!("{stem}-{name}.{ending}"));
            let rendered = &settled.rendered;
            let mut files =
                vec![write_png(&path("png"), &Output::Color, rendered, &how, Bits::Eight)?];
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

fn backdrop() -> surfelshop_engine::picture::Background {
    Backdrop::parse("#e8e6e1").map_or_else(|_| Default::default(), |backdrop| backdrop.0)
}

/// The sample cloud beside the program or in the current folder.
/// The sample cloud.
pub(crate) fn find_sample() -> anyhow::Result<PathBuf> {
    let program = std::env::current_exe().ok();
    let above = program.iter().flat_map(|program| program.ancestors().skip(1));
    let found = above.map(|folder| folder.join(SAMPLE)).find(|sample| sample.is_file());
    found.or_else(|| Some(PathBuf::from(SAMPLE)).filter(|sample| sample.is_file())).with_context(
        || {
            format!(
                "expected the sample cloud {SAMPLE} in the current folder or in one above the \
             program, found none; run this in a checkout of Surfelshop"
            )
        },
    )
}
