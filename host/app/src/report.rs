//! What a render tells: a line per file, or one JSON object.

use crate::studio::{Chosen, Settled, Studio};
use serde::Serialize;
use serde_json::{Value, json};
use std::path::Path;
use surfelshop_api::graph::Output;
use surfelshop_api::{View, params};

/// A file that was written.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Written {
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
    pub(crate) fn new(
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

    /// The line for people.
    pub(crate) fn line(&self, studio: &Studio, chosen: &Chosen, settled: &Settled) -> String {
        let Self { path, outputs, width, height, bits, .. } = self;
        let adapter = &studio.engine.gpu().info;
        format!(
            "{path}: {} {width} x {height}, {bits} bit, {} in {:.0} ms on {}, {}",
            outputs.join(" + "),
            chosen.reference.id,
            settled.milliseconds,
            adapter.name,
            adapter.backend.to_str()
        )
    }
}

/// The device in JSON.
pub(crate) fn adapter(studio: &Studio) -> Value {
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
pub(crate) fn renderer(chosen: &Chosen) -> Value {
    let declared = &chosen.unit.description.params;
    let parameters: serde_json::Map<String, Value> = declared
        .iter()
        .map(|p| (p.id.clone(), plain(&p.sanitise(chosen.values.get(&p.id)))))
        .collect();
    json!({
        "package": chosen.reference.package,
        "id": chosen.reference.id,
        "version": chosen.unit.manifest.version,
        "file": chosen.reference.path.display().to_string(),
        "parameters": parameters,
    })
}

/// A parameter's value as JSON writes such values.
pub(crate) fn plain(value: &params::Value) -> Value {
    match value {
        params::Value::Bool(value) => json!(value),
        params::Value::Int(value) => json!(value),
        params::Value::Float(value) => json!(value),
        params::Value::Text(value) => json!(value),
        params::Value::Color(value) => json!(value),
    }
}

/// One settled frame in JSON.
pub(crate) fn frame(settled: &Settled, view: &View) -> Value {
    json!({
        "view": view,
        "frames": settled.n_frames,
        "render_ms": settled.milliseconds,
        "passes": settled.rendered.passes,
    })
}
