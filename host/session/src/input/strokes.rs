//! Files of strokes: what hands did over clouds, to be done again.
//!
//! ```text
//! {"format": "surfelshop strokes", "version": 1, "strokes": [
//!   {"tool": "org.surfelshop.brush/brush", "values": {"color": [0.8, 0.1, 0.1]},
//!    "n_surfels": 49990, "among": "xoYDsAkFAyg",
//!    "stroke": {"radius": 0.05, "spacing": 0.25, "falloff": "smooth", "reach": "facing",
//!               "samples": [{"place": [0, 1, 0], "normal": [0, 1, 0], "time": 0, "pressure": 1}]}}]}
//! ```
//!
//! `n_surfels` is how many the cloud had. `among` is there where others near the stroke were left out, since some were
//! selected or hidden: how many surfels there are, so many that it did not concern, so many that it did, and so on; each number
//! in bytes of seven bits, the lowest first, and these in base64, as scenes note what is hidden.

use crate::output::json::plain;
use anyhow::{Context as _, bail, ensure};
use serde::{Deserialize, Serialize};
use std::path::Path;
use surfelshop_api::Stroke;
use surfelshop_api::params::{Value, Values};
pub use surfelshop_cloud::selection::NamedStroke;
use surfelshop_cloud::selection::SurfelRuns;
use surfelshop_cloud::{AMONG_NOTE, Cloud, How};
use surfelshop_runtime::tools::STROKE_NOTE;

/// What the first key says.
const FORMAT: &str = "surfelshop strokes";
/// The version that is written; others are refused.
const VERSION: u32 = 1;
/// Bytes of the largest file that is read: a stroke of a minute takes 100 kB.
const MOST_BYTES: u64 = 1 << 30;

#[derive(Serialize, Deserialize)]
struct StrokeFile {
    format: String,
    version: u32,
    strokes: Vec<NamedStroke>,
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
    let bytes = std::fs::read(path).with_context(|| format!("{name}"))?;
    let file: StrokeFile = serde_json::from_slice(&bytes)
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

/// A stroke of a tool, as PACKAGE/ID, with the parameters it ran with.
pub fn named(tool: &str, values: &Values, stroke: Stroke) -> NamedStroke {
    let values = values.iter().filter(|(id, _)| ![STROKE_NOTE, AMONG_NOTE].contains(&id.as_str()));
    let values = values.map(|(id, value)| (id.clone(), plain(value))).collect();
    NamedStroke { tool: tool.to_owned(), values, stroke, n_surfels: None, among: None }
}

/// The strokes that a cloud's history tells, oldest first.
pub fn of_cloud(cloud: &Cloud) -> Vec<NamedStroke> {
    let strokes = cloud.history().iter().filter(|edit| edit.how == How::Stroked);
    let all = strokes.filter_map(|edit| {
        let noted = |id: &str| match edit.made.values.get(id) {
            Some(Value::Text(text)) => Some(text),
            _ => None,
        };
        let stroke = serde_json::from_str(noted(STROKE_NOTE)?).ok()?;
        let among = match noted(AMONG_NOTE) {
            Some(text) => Some(SurfelRuns::parse(text)?),
            None => None,
        };
        let stroke = named(&edit.made.tool, &edit.made.values, stroke);
        Some(NamedStroke { n_surfels: Some(edit.n_before), among, ..stroke })
    });
    all.collect()
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
