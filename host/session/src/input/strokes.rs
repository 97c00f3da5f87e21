//! Files of strokes: what hands did over clouds, to be done again.
//!
//! ```text
//! {"format": "surfelshop strokes", "version": 1, "strokes": [
//!   {"tool": "org.surfelshop.brush/brush", "values": {"color": [0.8, 0.1, 0.1]},
//!    "stroke": {"radius": 0.05, "spacing": 0.25, "falloff": "smooth", "reach": "facing",
//!               "samples": [{"place": [0, 1, 0], "normal": [0, 1, 0], "time": 0, "pressure": 1}]}}]}
//! ```

use crate::output::json::plain;
use anyhow::{Context as _, bail, ensure};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value as Json};
use std::path::Path;
use surfelshop_api::Stroke;
use surfelshop_api::params::{ParamDecl, Value, Values};
use surfelshop_cloud::{Cloud, How};
use surfelshop_runtime::plugins::UnitRef;
use surfelshop_runtime::tools::STROKE_NOTE;

/// What the first key says.
const FORMAT: &str = "surfelshop strokes";
/// The version that is written; others are refused.
const VERSION: u32 = 1;
/// Bytes of the largest file that is read: a stroke of a minute takes 100 kB.
const MOST_BYTES: u64 = 1 << 30;

/// A stroke with the tool that it was made with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedStroke {
    /// The tool, as PACKAGE/ID or ID.
    pub tool: String,
    /// Its parameters; those that are missing have their defaults.
    #[serde(default)]
    values: Map<String, Json>,
    /// What the hand did.
    pub stroke: Stroke,
}

#[derive(Serialize, Deserialize)]
struct StrokeFile {
    format: String,
    version: u32,
    strokes: Vec<NamedStroke>,
}

impl NamedStroke {
    /// Whether it was made with a tool.
    pub fn is_of(&self, unit: &UnitRef) -> bool {
        self.tool == unit.id || self.tool == format!("{}/{}", unit.package, unit.id)
    }

    /// Its parameters as a tool declares them.
    ///
    /// # Errors
    /// Where the tool has no such parameter, or it takes other values.
    pub fn values(&self, declared: &[ParamDecl]) -> anyhow::Result<Values> {
        let mut values = Values::new();
        for (id, json) in &self.values {
            let declared = declared.iter().find(|declared| declared.id == *id);
            let declared = declared.with_context(|| format!("it has no parameter `{id}`"))?;
            let value = value_of(json).and_then(|value| declared.fitted(&value));
            let value = value.with_context(|| {
                format!("`{id}`: expected {}, found {json}", declared.expectation())
            })?;
            values.insert(id.clone(), value);
        }
        Ok(values)
    }
}

fn value_of(json: &Json) -> Option<Value> {
    Some(match json {
        Json::Bool(value) => Value::Bool(*value),
        Json::Number(number) => match number.as_i64() {
            Some(value) => Value::Int(value),
            None => Value::Float(number.as_f64()?),
        },
        Json::String(text) => Value::Text(text.clone()),
        Json::Array(channels) => {
            let channels: Option<Vec<f32>> =
                channels.iter().map(|channel| Some(channel.as_f64()? as f32)).collect();
            Value::Color(channels?.try_into().ok()?)
        }
        Json::Null | Json::Object(_) => return None,
    })
}

/// Reads a file of strokes.
///
/// # Errors
/// Where it cannot be read or is none.
pub fn read(path: &Path) -> anyhow::Result<Vec<NamedStroke>> {
    let name = path.display();
    let length = std::fs::metadata(path).with_context(|| format!("{name}"))?.len();
    ensure!(
        length <= MOST_BYTES,
        "{name}: expected strokes of at most 1 GiB, found {length} bytes"
    );
    let text = std::fs::read_to_string(path).with_context(|| format!("{name}"))?;
    let file: StrokeFile = serde_json::from_str(&text)
        .with_context(|| format!("{name}: expected a file of strokes"))?;
    ensure!(
        file.format == FORMAT,
        "{name}: expected \"format\": \"{FORMAT}\", found \"{}\"",
        file.format
    );
    let version = file.version;
    ensure!(
        version == VERSION,
        "{name}: expected version {VERSION} of strokes, found {version}; update Surfelshop"
    );
    if file.strokes.is_empty() {
        bail!("{name}: expected strokes, found none");
    }
    Ok(file.strokes)
}

/// The text of a file of strokes.
///
/// # Errors
/// Where a number is none.
pub fn text(strokes: Vec<NamedStroke>) -> anyhow::Result<String> {
    let file = StrokeFile { format: FORMAT.to_owned(), version: VERSION, strokes };
    Ok(serde_json::to_string(&file)? + "\n")
}

/// The strokes that a cloud's history tells, oldest first.
pub fn of_cloud(cloud: &Cloud) -> Vec<NamedStroke> {
    let strokes = cloud.history().iter().filter(|edit| edit.how == How::Stroked);
    let named = strokes.filter_map(|edit| {
        let Some(Value::Text(text)) = edit.made.values.get(STROKE_NOTE) else { return None };
        let stroke = serde_json::from_str(text).ok()?;
        let values = edit.made.values.iter().filter(|(id, _)| *id != STROKE_NOTE);
        let values = values.map(|(id, value)| (id.clone(), plain(value))).collect();
        Some(NamedStroke { tool: edit.made.tool.clone(), values, stroke })
    });
    named.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strokes_are_read_as_they_are_written_and_damage_is_a_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        let line = |contents: &str| {
            std::fs::write(&path, contents).unwrap();
            format!("{:#}", read(&path).unwrap_err())
        };
        let stroke = r#"{"tool": "brush", "stroke": {"radius": 0.1, "samples": [{"place": [0.1, 1e6, 3e-7]}]}}"#;
        let whole = |version: u32, strokes: &str| {
            format!(
                r#"{{"format": "surfelshop strokes", "version": {version}, "strokes": [{strokes}]}}"#
            )
        };
        assert!(line("").contains("a.json: expected a file of strokes: EOF"));
        assert!(
            line(&whole(2, stroke))
                .ends_with("expected version 1 of strokes, found 2; update Surfelshop")
        );
        assert!(line(&whole(1, "")).ends_with("expected strokes, found none"));
        assert!(
            line(&whole(1, stroke).replace("shop strokes", "shop"))
                .contains("found \"surfelshop\"")
        );
        std::fs::write(&path, whole(1, stroke)).unwrap();
        let strokes = read(&path).unwrap();
        assert_eq!(strokes[0].stroke.samples[0].place.to_array(), [0.1, 1e6, 3e-7]);
        assert_eq!(strokes[0].stroke.dabs, surfelshop_api::Dabs::USUAL);
        std::fs::write(&path, text(strokes.clone()).unwrap()).unwrap();
        assert_eq!(read(&path).unwrap(), strokes);
    }
}
