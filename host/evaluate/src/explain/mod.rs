//! `surfelshop explain`: what a frame is made of for a scene, what was left out of it, and why.

mod arguments;
mod measured;

pub use arguments::ExplainArguments;

use anyhow::bail;
use measured::Side;
use serde::Serialize;
use serde_json::{Value, json};
use surfelshop_api::graph::Output;
use surfelshop_api::{UnitKind, View};
use surfelshop_render::{Explanation, PassState, PassUse, RenderRequest, RendererUse};
use surfelshop_runtime::plugins::{Registry, UnitRef};
use surfelshop_session::cloud_renderers;
use surfelshop_session::eye_dome;
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::input::environment_map::LoadedEnvironment;
use surfelshop_session::input::formats::SessionFormats;
use surfelshop_session::input::scenes::Inputs;
use surfelshop_session::options::explicit::ExplicitOptions;
use surfelshop_session::output::{json, terminal};
use surfelshop_session::render;
use surfelshop_session::session::{self, RenderSession};
use surfelshop_session::setup::{self, RenderSetup};

/// Runs the command.
pub fn run(arguments: &ExplainArguments, given: &ExplicitOptions) -> anyhow::Result<()> {
    let inputs = Inputs::open(&arguments.files)?;
    let opened = inputs.opened.as_ref();
    let registry = session::registry(&arguments.plugins)?;
    let reference = renderer_of(arguments, &registry)?;
    let seen = setup::view_of(opened, &reference);
    let mut staging = RenderSetup::new(&arguments.picture, given, opened, seen.as_ref())?;
    let mut studio = open_studio(arguments, &staging)?;
    let mut named = cloud_renderers::named(&inputs.sources);
    let typed = &arguments.set;
    let of_view = cloud_renderers::settings_of_view(typed, &reference, &named);
    let first = studio.choose_for(reference, seen.as_ref(), &of_view);
    let is_said = given.has("renderer") || setup::first_view(opened).is_some();
    let first = render::known_now(first, is_said || typed.is_empty())?;
    let formats = SessionFormats::new(&arguments.plugins);
    let (surroundings, displayed) = staging.read(&inputs.sources, &formats)?;
    let clouds = &displayed.clouds;
    let view = render::view(&arguments.picture, &staging, clouds);
    let chosen_nodes = staging.drawn(clouds, &view)?;
    let drawn = chosen_nodes.with(clouds);
    let infos = &clouds.facts.clouds;
    let mut suited =
        |first| render::suited_or(first, typed, &inputs, &registry, infos, &mut named, &studio);
    let mut chosen = if is_said { first } else { suited(first) }?;
    let reference = chosen.reference.clone();
    let of_view = cloud_renderers::settings_of_view(typed, &reference, &named);
    let deal = || cloud_renderers::dealt(&registry, &named, infos);
    studio.share(&mut chosen, deal()?, &arguments.set, infos)?;
    let values = chosen.values.clone();
    let outputs = outputs(arguments);
    let request = RenderRequest {
        clouds: drawn.clouds(),
        facts: &clouds.facts,
        scene: &staging.scene,
        view,
        environment: surroundings.as_ref().map(LoadedEnvironment::view),
        values: &values,
        outputs: &outputs,
        frame_index: 0,
        stride: 1,
        detail_px: staging.detail_px,
        parts: drawn.parts(),
        eye_dome: eye_dome::measured(&staging.eye_dome),
    };
    let explained = studio.explain(&mut chosen, &request)?;
    let adapter = json::adapter(&studio);
    let drawn_by = studio.engine.gpu().describe();
    let drawing = chosen.references();
    let others = not_loaded(&registry, &drawing);
    let savings = match arguments.measure {
        Some(n_frames) => {
            // Its columns would stand in memory besides those of the two that are measured.
            drop((studio, chosen));
            let side = || {
                let studio = open_studio(arguments, &staging)?;
                let mut chosen = studio.choose_for(reference.clone(), seen.as_ref(), &of_view)?;
                studio.share(&mut chosen, deal()?, &arguments.set, infos)?;
                Ok(Side::new(studio, chosen))
            };
            measured::savings(side, &request, n_frames)?
        }
        None => Vec::new(),
    };
    if arguments.report.json {
        return terminal::json(&json!({
            "command": "explain",
            "version": env!("CARGO_PKG_VERSION"),
            "renderer": reference,
            "adapter": adapter,
            "display": displayed.object(),
            "explained": explained,
            "antialias": antialias(&staging, &view),
            "pyramids": chosen_nodes.pyramids(),
            "savings": savings,
            "plugins_not_loaded": others,
        }));
    }
    tell_who(&explained, &drawing, &drawn_by, clouds)?;
    terminal::line(text(&explained))?;
    antialias(&staging, &view).iter().try_for_each(terminal::line)?;
    chosen_nodes.pyramids().iter().try_for_each(terminal::line)?;
    tell_rest(arguments, &others, &savings)
}

/// What was not loaded, and what leaving out saves, where that was measured.
fn tell_rest(
    arguments: &ExplainArguments,
    others: &[Value],
    savings: &[measured::Saving],
) -> anyhow::Result<()> {
    terminal::line(not_asked_for(others))?;
    match arguments.measure {
        Some(n_frames) => terminal::line(measured::lines(savings, n_frames).join("\n")),
        None => Ok(()),
    }
}

/// What draws, in the colours that the scene says.
fn open_studio(
    arguments: &ExplainArguments,
    staging: &RenderSetup,
) -> anyhow::Result<RenderSession> {
    let mut studio = RenderSession::open(&arguments.device, &arguments.plugins)?;
    studio.engine.tint_backs(staging.display.splats.tint_backs);
    Ok(studio)
}

/// The renderer whose frame is explained.
fn renderer_of(arguments: &ExplainArguments, registry: &Registry) -> anyhow::Result<UnitRef> {
    let reference = setup::drawer(registry, &arguments.renderer)?;
    if reference.kind != UnitKind::Renderer {
        bail!("-r {}: expected a renderer; a tracer has no graph", arguments.renderer);
    }
    Ok(reference)
}

/// The outputs that are asked for.
fn outputs(arguments: &ExplainArguments) -> Vec<Output> {
    match arguments.output.as_slice() {
        [] => vec![Output::Color],
        outputs => outputs.to_vec(),
    }
}

/// Says what draws on which device, and where several do which clouds each draws.
fn tell_who(
    explained: &Explanation,
    drawing: &[UnitRef],
    drawn_by: &str,
    clouds: &Clouds,
) -> anyhow::Result<()> {
    let drawing: Vec<String> = drawing.iter().map(ToString::to_string).collect();
    terminal::line(format!("{} on {drawn_by}", drawing.join(" and ")))?;
    let files = clouds.loaded.iter().map(|loaded| loaded.summary.file.as_str());
    who_draws(explained, &files.collect::<Vec<_>>()).iter().try_for_each(terminal::line)
}

/// What antialiasing multiplies.
#[derive(Serialize)]
struct Antialias {
    /// Settled pictures, each of all frames and passes that are explained.
    samples: u32,
    /// Sums of the colour's numbers, in memory.
    host_bytes: u64,
}

impl std::fmt::Display for Antialias {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "antialiasing: all of this {} times, and {:.2} MB of sums in memory; outputs other than color once",
            self.samples,
            self.host_bytes as f64 / 1e6
        )
    }
}

/// What antialiasing costs; none without it.
fn antialias(staging: &RenderSetup, view: &View) -> Option<Antialias> {
    let n_pixels = view.size_px.into_iter().map(u64::from).product::<u64>();
    let host_bytes = n_pixels * 4 * size_of::<f32>() as u64;
    let samples = staging.antialias;
    (samples > 1).then_some(Antialias { samples, host_bytes })
}

/// Packages of which nothing is used.
fn not_loaded(registry: &Registry, used: &[UnitRef]) -> Vec<Value> {
    let available = registry.entries().iter().filter_map(|entry| entry.available());
    let is_used = |id: &str| used.iter().any(|used| used.package == id);
    available.filter(|manifest| !is_used(&manifest.id)).map(|m| json!(m.id)).collect()
}

/// Which of several renderers draws which cloud, a line for each.
pub fn who_draws(explained: &Explanation, clouds: &[&str]) -> Vec<String> {
    // A file that a scene has several times is told by its place there.
    let name = |cloud: &u32| {
        let name = clouds.get(*cloud as usize).copied().unwrap_or("a cloud");
        match clouds.iter().filter(|other| **other == name).count() {
            0 | 1 => name.to_owned(),
            _ => format!("{name} (cloud {})", cloud + 1),
        }
    };
    let line = |renderer: &RendererUse| {
        let part = &renderer.part;
        let names: Vec<String> = part.clouds.iter().map(name).collect();
        let how = if part.taken.is_empty() { "surfels" } else { "splats of its own" };
        let ms =
            renderer.gpu_ms.map_or_else(String::new, |ms| format!(", {ms:.2} ms in its passes"));
        format!(
            "`{}` draws {} as {how}; its graph takes {:.2} MB{ms}",
            part.renderer,
            names.join(", "),
            part.graph_bytes as f64 / 1e6
        )
    };
    explained.renderers.iter().map(line).collect()
}

/// The line of packages of which nothing is used.
fn not_asked_for(others: &[Value]) -> String {
    let others: Vec<&str> = others.iter().filter_map(Value::as_str).collect();
    let others = if others.is_empty() { "none".to_owned() } else { others.join(", ") };
    format!("plugins not loaded, since nobody asked for them: {others}")
}

/// A line about something that is used, or is not.
pub struct UseLine {
    /// Whether the frame needs it.
    pub used: bool,
    /// The word for that.
    pub word: &'static str,
    /// The name.
    pub name: String,
    /// A line about it.
    pub about: String,
}

/// What bytes mean, in megabytes; nothing where there are none.
fn cost(bytes: u64, used: bool) -> String {
    let verb = if used { "takes" } else { "saves" };
    match bytes {
        0 => String::new(),
        _ => format!("{verb} {:.2} MB; ", bytes as f64 / 1e6),
    }
}

/// Everything in sections, what is used before what is not.
pub fn sections(explained: &Explanation) -> Vec<(&'static str, Vec<UseLine>)> {
    let columns = explained.columns.iter().map(|column| UseLine {
        used: column.read,
        word: if column.read { "read" } else { "not" },
        name: column.name.clone(),
        about: format!("{}{}", cost(column.bytes, column.read), column.why),
    });
    let mut columns: Vec<UseLine> = columns.collect();
    columns.sort_by_key(|column| !column.used);
    let surfels = explained.surfels.iter().map(|line| UseLine {
        used: true,
        word: "",
        name: String::new(),
        about: line.clone(),
    });
    let resources = explained.resources.iter().map(|resource| {
        let cost = cost(resource.bytes, resource.made);
        UseLine {
            used: resource.made,
            word: if resource.made { "made" } else { "not" },
            name: resource.label.clone(),
            about: format!("{cost}{}; {}", resource.what, resource.why),
        }
    });
    let outputs = explained.outputs.iter().map(|output| UseLine {
        used: output.wanted,
        word: if output.wanted { "wanted" } else { "not" },
        name: output.name.clone(),
        about: String::new(),
    });
    let features = explained.features.iter().map(|feature| UseLine {
        used: feature.here,
        word: match (feature.here, feature.counts) {
            (true, true) => "used",
            (true, false) => "has",
            (false, true) => "missed",
            (false, false) => "lacks",
        },
        name: feature.name.to_owned(),
        about: match feature.counts {
            true => feature.means.to_owned(),
            false => format!("{}; this frame has no need of it", feature.means),
        },
    });
    vec![
        ("columns", columns),
        ("surfels", surfels.collect()),
        ("passes", explained.passes.iter().map(pass).collect()),
        ("textures and buffers", resources.collect()),
        ("outputs", outputs.collect()),
        ("adapter", features.collect()),
    ]
}

fn pass(pass: &PassUse) -> UseLine {
    let word = match pass.state {
        PassState::Ran => "ran",
        PassState::Culled => "culled",
        PassState::Reused => "reused",
    };
    let ms = pass.gpu_ms.map_or_else(String::new, |ms| format!("{ms:.2} ms; "));
    let constants = pass.constants.iter().map(|(name, value)| format!("; {name} = {value}"));
    let features = pass.features.iter().map(|(name, there)| match there {
        true => format!("; with {name}"),
        false => format!("; without {name}"),
    });
    let constants = features.chain(constants);
    UseLine {
        used: pass.state != PassState::Culled,
        word,
        name: pass.name.clone(),
        about: format!("{ms}{}{}", pass.why, constants.collect::<String>()),
    }
}

/// The sections as lines.
fn text(explained: &Explanation) -> String {
    let mut lines = Vec::new();
    for (title, all) in sections(explained) {
        lines.push(format!("{title}:"));
        for UseLine { word, name, about, .. } in all {
            lines.push(match name.as_str() {
                "" => format!("  {about}"),
                _ => format!("  {word:<7} {name:<28} {about}").trim_end().to_owned(),
            });
        }
    }
    lines.join("\n")
}
