//! `surfelshop explain`: what a frame is made of for a scene, what was left out of it, and why.

use crate::arguments::ExplainArguments;
use crate::clouds::Clouds;
use crate::given::Given;
use crate::scenes::Inputs;
use crate::staging::{self, Staging};
use crate::studio::{self, Studio};
use crate::surroundings::Surroundings;
use crate::{render, report, surroundings, terminal};
use anyhow::bail;
use serde_json::{Value, json};
use surfelshop_api::UnitKind;
use surfelshop_api::graph::Output;
use surfelshop_engine::plugins::{Registry, UnitRef};
use surfelshop_engine::{Explanation, PassState, RenderRequest};

/// Runs the command.
pub(crate) fn run(arguments: &ExplainArguments, given: &Given) -> anyhow::Result<()> {
    let inputs = Inputs::open(&arguments.files)?;
    let opened = inputs.opened.as_ref();
    let registry = studio::registry(&arguments.plugins.plugin)?;
    let reference = staging::drawer(&registry, &arguments.renderer)?;
    if reference.kind != UnitKind::Renderer {
        bail!("-r {}: expected a renderer; a tracer has no graph", arguments.renderer);
    }
    let seen = staging::view_of(opened, &reference);
    let staging = Staging::new(&arguments.picture, given, opened, seen.as_ref())?;
    let mut studio = Studio::open(&arguments.device, &arguments.plugins)?;
    let mut chosen = studio.choose_for(reference.clone(), seen.as_ref(), &arguments.set)?;
    let surroundings = surroundings::read_wanted(staging.environment.as_ref())?;
    let clouds = Clouds::read(&inputs.sources)?;
    let views = clouds.views();
    let values = chosen.values.clone();
    let outputs = match arguments.output.as_slice() {
        [] => vec![Output::Color],
        outputs => outputs.to_vec(),
    };
    let request = RenderRequest {
        clouds: &views,
        facts: &clouds.facts,
        scene: &staging.scene,
        view: render::view(&arguments.picture, &staging, &clouds),
        environment: surroundings.as_ref().map(Surroundings::view),
        values: &values,
        outputs: &outputs,
        frame_index: 0,
        stride: 1,
        detail_px: staging.detail_px,
    };
    let explained = studio.explain(&mut chosen, &request)?;
    let others = not_loaded(&registry, &reference);
    if arguments.report.json {
        return terminal::json(&json!({
            "command": "explain",
            "version": env!("CARGO_PKG_VERSION"),
            "renderer": reference,
            "adapter": report::adapter(&studio),
            "explained": explained,
            "plugins_not_loaded": others,
        }));
    }
    terminal::line(format!("{reference} on {}", studio.engine.gpu().describe()))?;
    terminal::line(text(&explained))?;
    let others: Vec<String> = others.iter().filter_map(Value::as_str).map(str::to_owned).collect();
    terminal::line(format!(
        "plugins not loaded, since nobody asked for them: {}",
        if others.is_empty() { "none".to_owned() } else { others.join(", ") }
    ))
}

/// Packages of which nothing is used.
fn not_loaded(registry: &Registry, used: &UnitRef) -> Vec<Value> {
    let available = registry.entries().iter().filter_map(|entry| entry.available());
    available.filter(|manifest| manifest.id != used.package).map(|m| json!(m.id)).collect()
}

/// Sections of lines, what is used before what is not.
fn text(explained: &Explanation) -> String {
    let mut lines = vec!["columns:".to_owned()];
    let mut columns: Vec<_> = explained.columns.iter().collect();
    columns.sort_by_key(|column| !column.read);
    for column in columns {
        let (word, verb) = if column.read { ("read", "takes") } else { ("not", "saves") };
        let megabytes = column.bytes as f64 / 1e6;
        let cost = match column.bytes {
            0 => String::new(),
            _ => format!("{verb} {megabytes:.2} MB; "),
        };
        lines.push(format!("  {word:<7} {:<12} {cost}{}", column.name, column.why));
    }
    lines.push("surfels:".to_owned());
    lines.extend(explained.surfels.iter().map(|line| format!("  {line}")));
    lines.push("passes:".to_owned());
    for pass in &explained.passes {
        let word = match pass.state {
            PassState::Ran => "ran",
            PassState::Culled => "culled",
            PassState::Reused => "reused",
        };
        let ms = pass.gpu_ms.map_or_else(String::new, |ms| format!("{ms:.2} ms; "));
        let constants: Vec<String> =
            pass.constants.iter().map(|(name, value)| format!("{name} = {value}")).collect();
        let constants = match constants.is_empty() {
            true => String::new(),
            false => format!("; {}", constants.join(", ")),
        };
        lines.push(format!("  {word:<7} {:<28} {ms}{}{constants}", pass.name, pass.why));
    }
    lines.push("textures and buffers of the graph:".to_owned());
    for resource in &explained.resources {
        let (word, verb) = if resource.made { ("made", "takes") } else { ("not", "saves") };
        let megabytes = resource.bytes as f64 / 1e6;
        lines.push(format!(
            "  {word:<7} {:<28} {verb} {megabytes:.2} MB; {}; {}",
            resource.label, resource.what, resource.why
        ));
    }
    lines.push("outputs:".to_owned());
    for output in &explained.outputs {
        let word = if output.wanted { "wanted" } else { "not" };
        lines.push(format!("  {word:<7} {}", output.name));
    }
    lines.push("adapter:".to_owned());
    for feature in &explained.features {
        let word = if feature.here { "has" } else { "lacks" };
        lines.push(format!("  {word:<7} {:<28} {}", feature.name, feature.means));
    }
    lines.join("\n")
}
