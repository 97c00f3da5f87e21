//! `surfelshop share`: one page to show people, with pictures along a path by several renderers.

mod arguments;
mod fit;
mod page;

pub use arguments::ShareArguments;

use crate::compare::Stage;
use crate::compare::candidate::{Candidate, CandidateRequest};
use crate::compare::requests;
use anyhow::{Context as _, ensure};
use page::{SharedPage, SharedRenderer};
use serde_json::{Value, json};
use surfelshop_api::UnitKind;
use surfelshop_cloud::in_groups;
use surfelshop_cloud::scene::OpenedScene;
use surfelshop_image::display_transform::Background;
use surfelshop_image::{outputs, png};
use surfelshop_runtime::plugins::Registry;
use surfelshop_session::input::displayed::DisplayedClouds;
use surfelshop_session::input::formats::SessionFormats;
use surfelshop_session::input::plausibility;
use surfelshop_session::input::scenes::Inputs;
use surfelshop_session::options::explicit::ExplicitOptions;
use surfelshop_session::options::path::PathSpec;
use surfelshop_session::output::machine::Machine;
use surfelshop_session::output::terminal::{self, Progress};
use surfelshop_session::output::{command_line, files, json as session_json};
use surfelshop_session::render::camera_path::{self, Frame};
use surfelshop_session::session::{self, RenderSession};
use surfelshop_session::setup::{self, RenderSetup};
use surfelshop_session::timing::median;

/// What stands behind the clouds where nobody says it: pictures of a page are opaque.
const BACKDROP: [f32; 3] = [0.91, 0.902, 0.882];

/// Bytes by which a page may grow besides its pictures once they are stored: digits of their size and quality.
const MORE: u64 = 64;

/// Runs the command.
pub fn run(arguments: &ShareArguments, given: &ExplicitOptions) -> anyhow::Result<()> {
    let inputs = Inputs::open(&arguments.files)?;
    files::check_outputs(&[&arguments.out])?;
    let opened = inputs.opened.as_ref();
    let registry = session::registry(&arguments.plugins)?;
    let mut wanted = wanted(arguments, &registry, opened)?;
    let mut staging = staging(arguments, given, opened)?;
    let mut studio = match wanted.iter().any(|one| one.reference.kind == UnitKind::Renderer) {
        true => Some(RenderSession::open(&arguments.device, &arguments.plugins)?),
        false => None,
    };
    if let Some(studio) = &mut studio {
        studio.engine.tint_backs(staging.display.splats.tint_backs);
    }
    let formats = SessionFormats::new(&arguments.plugins);
    let (surroundings, displayed) = staging.read(&inputs.sources, &formats)?;
    let clouds = &displayed.clouds;
    requests::draw_beside(&mut wanted, &registry, &inputs.sources, &clouds.facts.clouds)?;
    plausibility::note(clouds, &staging.scene);
    let path = Some(arguments.path);
    let frames = camera_path::frames(path, &arguments.picture, &staging, opened, clouds)?;
    let first = frames.first().context("there is no camera")?;
    let stage = Stage {
        plugins: &arguments.plugins,
        staging: &staging,
        clouds,
        surroundings: surroundings.as_ref(),
        view: first.view,
    };
    let started = wanted.into_iter().map(|wanted| Candidate::new(studio.as_ref(), wanted));
    let mut candidates: Vec<Candidate> = started.collect();
    let drawn = drawn(&stage, studio.as_mut(), &frames, &mut candidates)?;
    let all: Vec<Vec<u8>> = drawn.iter().flat_map(|(pictures, _)| pictures.clone()).collect();
    let device = studio.map_or("no graphics device".to_owned(), |s| s.engine.gpu().describe());
    let machine = Machine::this(device);
    let page = |jpegs: &[Vec<u8>], stored: fit::Stored| SharedPage {
        title: title(arguments),
        notes: notes(&displayed, &machine, first.view.size_px, stored),
        command: command_line::typed(),
        version: env!("CARGO_PKG_VERSION"),
        size: stored.size,
        goes_around: matches!(arguments.path, PathSpec::Orbit(_)),
        frames: frames.iter().map(|frame| frame.name.clone()).collect(),
        renderers: renderers(&candidates, &drawn, jpegs, frames.len()),
        legend: page::legend(displayed.legend().as_ref()),
    };
    let nothing = fit::Stored { size: first.view.size_px, quality: 100 };
    let beside = page(&vec![Vec::new(); all.len()], nothing).html()?.len() as u64 + MORE;
    let (jpegs, stored) = fit::fitted(&all, arguments.most.saturating_sub(beside))?;
    let page = page(&jpegs, stored);
    let html = page.html()?;
    files::write_whole(&arguments.out, html.as_bytes())?;
    told(arguments, &page, html.len(), stored)
}

/// The renderers that are shown: those typed, those of the scene's views, or the usual one.
fn wanted(
    arguments: &ShareArguments,
    registry: &Registry,
    opened: Option<&OpenedScene>,
) -> anyhow::Result<Vec<CandidateRequest>> {
    let mut names = arguments.renderer.clone();
    if names.is_empty() {
        let views = opened.iter().flat_map(|opened| opened.scene.views.iter());
        for view in views {
            if !names.contains(&view.renderer) {
                names.push(view.renderer.clone());
            }
        }
    }
    if names.is_empty() {
        names.push("ewa-phong".to_owned());
    }
    let named = requests::named(registry, &names)?;
    requests::with_settings(named, &arguments.set, opened, &arguments.plugins.patience())
}

/// How pictures are made: opaque.
fn staging(
    arguments: &ShareArguments,
    given: &ExplicitOptions,
    opened: Option<&OpenedScene>,
) -> anyhow::Result<RenderSetup> {
    let seen = setup::first_view(opened);
    let mut staging = RenderSetup::new(&arguments.picture, given, opened, seen.as_ref())?;
    if staging.how.background == Background::Transparent {
        staging.how.background = Background::Color(BACKDROP);
    }
    Ok(staging)
}

/// The pictures of a renderer, as PNG, and milliseconds that each took.
type DrawnPath = (Vec<Vec<u8>>, Vec<f64>);

/// All pictures, renderer by renderer.
fn drawn(
    stage: &Stage<'_>,
    mut studio: Option<&mut RenderSession>,
    frames: &[Frame],
    candidates: &mut [Candidate],
) -> anyhow::Result<Vec<DrawnPath>> {
    let progress = Progress::new(format!("drawing {} pictures", frames.len() * candidates.len()));
    let mut all = vec![DrawnPath::default(); candidates.len()];
    for (i, frame) in frames.iter().enumerate() {
        let stage = Stage { view: frame.view, ..*stage };
        for (candidate, (pictures, times)) in candidates.iter_mut().zip(&mut all) {
            let drawn = candidate.first(&stage, studio.as_deref_mut())?;
            let levels = outputs::levels(&drawn.color, &stage.staging.how);
            pictures.push(png::encode_levels([drawn.color.width, drawn.color.height], levels)?);
            times.push(drawn.first_ms);
        }
        ensure!(
            progress.tell((i + 1) as f64 / frames.len() as f64).is_continue(),
            "ended before the page was written"
        );
    }
    Ok(all)
}

/// What the page shows of each renderer.
fn renderers(
    candidates: &[Candidate],
    drawn: &[DrawnPath],
    jpegs: &[Vec<u8>],
    n_frames: usize,
) -> Vec<SharedRenderer> {
    let each = candidates.iter().zip(drawn).zip(jpegs.chunks(n_frames.max(1)));
    let renderer = |((candidate, (_, times)), own): ((&Candidate, &DrawnPath), &[Vec<u8>])| {
        let parameters = match &candidate.ready {
            Ok(ready) => {
                let mut unit =
                    session_json::unit(&candidate.reference, &ready.unit, &candidate.values);
                unit["parameters"].take()
            }
            Err(_) => Value::Null,
        };
        SharedRenderer {
            name: candidate.name.clone(),
            ms: median(times.get(1..).unwrap_or_default()),
            first_ms: times.first().copied().unwrap_or(0.0),
            parameters,
            pictures: own.iter().map(|jpeg| page::address(jpeg)).collect(),
        }
    };
    each.map(renderer).collect()
}

fn title(arguments: &ShareArguments) -> String {
    let name = |file: &std::path::PathBuf| {
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        name.split('.').next().unwrap_or_default().to_owned()
    };
    let names = || arguments.files.iter().map(name).collect::<Vec<_>>().join(", ");
    arguments.title.clone().unwrap_or_else(names)
}

/// What was shown, and how.
fn notes(
    displayed: &DisplayedClouds,
    machine: &Machine,
    [width, height]: [u32; 2],
    stored: fit::Stored,
) -> Vec<String> {
    let n = displayed.clouds.facts.n_surfels;
    let mut notes = vec![format!("{} surfels, drawn at {width} x {height} pixels.", in_groups(n))];
    notes.extend(displayed.line());
    let [width, height] = stored.size;
    let quality = stored.quality;
    notes.push(format!("Stored at {width} x {height} pixels as JPEG of quality {quality}."));
    // The machine's name is not for those who get the page.
    notes.push(format!("Times: {}.", Machine { host: String::new(), ..machine.clone() }));
    notes
}

fn told(
    arguments: &ShareArguments,
    page: &SharedPage,
    bytes: usize,
    stored: fit::Stored,
) -> anyhow::Result<()> {
    let [width, height] = stored.size;
    if arguments.report.json {
        let renderer = |one: &SharedRenderer| {
            json!({
                "name": one.name,
                "ms": one.ms,
                "first_ms": one.first_ms,
                "parameters": one.parameters,
            })
        };
        return terminal::json(&json!({
            "command": "share",
            "version": env!("CARGO_PKG_VERSION"),
            "file": arguments.out.display().to_string(),
            "bytes": bytes,
            "frames": page.frames.len(),
            "size": stored.size,
            "quality": stored.quality,
            "renderers": page.renderers.iter().map(renderer).collect::<Vec<_>>(),
        }));
    }
    let (n, n_renderers) = (page.frames.len(), page.renderers.len());
    terminal::line(format!(
        "{}: {n} picture{} by {n_renderers} renderer{}, {width} x {height}, JPEG of quality {}, {:.1} MB",
        arguments.out.display(),
        plural(n),
        plural(n_renderers),
        stored.quality,
        bytes as f64 / 1e6
    ))
}

/// What the name of so many things ends with.
fn plural(n: usize) -> &'static str {
    if n == 1 { "" } else { "s" }
}
