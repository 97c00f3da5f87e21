//! What a render tells: a line per file, or one JSON object.

use crate::session::{ConvergedFrame, LoadedRenderer, RenderSession};
use serde::Serialize;
use serde_json::{Value, json};
use std::path::Path;
use surfelshop_api::graph::Output;
use surfelshop_api::{View, params};
use surfelshop_render::RendererPart;
use surfelshop_runtime::plugins::{LoadedUnit, UnitRef};

/// A file that was written.
#[derive(Clone, Debug, Serialize)]
pub struct Written {
    /// The file.
    path: String,
    /// `png` or `exr`.
    format: &'static str,
    /// The outputs in it.
    outputs: Vec<String>,
    width: u32,
    height: u32,
    /// Bits per channel.
    bits: u32,
    /// Bytes of the file.
    bytes: usize,
}

impl Written {
    /// Notes a file.
    pub fn new(
        path: &Path,
        format: &'static str,
        outputs: &[&Output],
        size: [u32; 2],
        bits: u32,
        bytes: usize,
    ) -> Self {
        Self {
            path: path.display().to_string(),
            format,
            outputs: outputs.iter().map(|output| output.name()).collect(),
            width: size[0],
            height: size[1],
            bits,
            bytes,
        }
    }

    /// What is in the file, for people.
    pub fn what(&self) -> String {
        let Self { path, outputs, width, height, bits, .. } = self;
        format!("{path}: {} {width} x {height}, {bits} bit", outputs.join(" + "))
    }

    /// The line for people.
    pub fn line(
        &self,
        studio: &RenderSession,
        chosen: &LoadedRenderer,
        settled: &ConvergedFrame,
    ) -> String {
        let adapter = &studio.engine.gpu().info;
        let samples = match settled.n_samples {
            1 => String::new(),
            n => format!(", {n} samples"),
        };
        format!(
            "{}, {}{samples} in {:.0} ms on {}, {}",
            self.what(),
            chosen.ids(),
            settled.milliseconds,
            adapter.name,
            adapter.backend.to_str()
        )
    }
}

/// The device in JSON.
pub fn adapter(studio: &RenderSession) -> Value {
    let gpu = studio.engine.gpu();
    json!({
        "name": gpu.info.name,
        "backend": gpu.info.backend.to_str(),
        "driver": gpu.info.driver,
        "driver_info": gpu.info.driver_info,
        "software": gpu.is_software(),
        "blends_f32": gpu.blends_f32,
        "times_passes": gpu.times_passes,
        "description": gpu.describe(),
    })
}

/// The renderer and its parameters in JSON.
pub fn renderer(chosen: &LoadedRenderer) -> Value {
    unit(&chosen.reference, &chosen.unit, &chosen.values)
}

/// The renderers of a picture that several draw, and which clouds each draws, in JSON; none where one draws all.
pub fn renderers(chosen: &LoadedRenderer, settled: &ConvergedFrame) -> Vec<Value> {
    let of = |part: &RendererPart| {
        let names = chosen.view.others().iter().map(|other| other.name.as_str());
        let at = names.zip(&chosen.beside).find(|(name, _)| *name == part.renderer);
        let mut object = match at {
            Some((_, other)) => unit(&other.reference, &other.unit, &other.values),
            None => renderer(chosen),
        };
        object["clouds"] = json!(part.clouds);
        object["graph_bytes"] = json!(part.graph_bytes);
        object
    };
    settled.rendered.parts.iter().map(of).collect()
}

/// A unit and its parameters in JSON.
pub fn unit(reference: &UnitRef, unit: &LoadedUnit, values: &params::Values) -> Value {
    let declared = unit.description.params.iter();
    let parameters: serde_json::Map<String, Value> =
        declared.map(|p| (p.id.clone(), plain(&p.sanitise(values.get(&p.id))))).collect();
    json!({
        "package": reference.package,
        "id": reference.id,
        "version": unit.manifest.version,
        "file": reference.path.display().to_string(),
        "parameters": parameters,
    })
}

/// A parameter's value as JSON writes such values.
pub fn plain(value: &params::Value) -> Value {
    match value {
        params::Value::Bool(value) => json!(value),
        params::Value::Int(value) => json!(value),
        params::Value::Float(value) => json!(value),
        params::Value::Text(value) => json!(value),
        params::Value::Color(value) => json!(value),
    }
}

/// One settled frame in JSON.
pub fn frame(settled: &ConvergedFrame, view: &View) -> Value {
    json!({
        "view": view,
        "frames": settled.n_frames,
        "samples": settled.n_samples,
        "render_ms": settled.milliseconds,
        "passes": settled.rendered.passes,
    })
}
