//! Who made what, in words and in JSON.

use crate::output::json::plain;
use serde_json::{Map, Value, json};
use surfelshop_api::params;
use surfelshop_cloud::{AMONG_NOTE, Cloud, CloudEdit, How, ToolRun};
use surfelshop_runtime::tools::STROKE_NOTE;

/// A run of a tool in JSON.
pub fn object(made: &ToolRun) -> Value {
    let ToolRun { tool, version, values, time } = made;
    let parameters: Map<String, Value> =
        values.iter().map(|(id, value)| (id.clone(), plain(value))).collect();
    json!({
        "tool": tool,
        "version": version,
        "time": time,
        "seed": made.seed(),
        "parameters": parameters,
    })
}

/// What a run did to a cloud as a whole, in JSON.
pub fn cloud_object(note: &CloudEdit) -> Value {
    json!({
        "what": word(note.how),
        "surfels": note.n_surfels,
        "surfels_before": note.n_before,
        "made": object(&note.made),
    })
}

/// The word for what a run did to a cloud as a whole.
pub fn word(how: How) -> &'static str {
    match how {
        How::Kept => "kept",
        How::Derived => "derived",
        How::Enlarged => "enlarged",
        How::Stroked => "stroked",
    }
}

/// A line for each column that a tool made and for each run on the whole cloud.
pub fn lines(cloud: &Cloud) -> Vec<String> {
    let of_column = |column: &surfelshop_cloud::Column| {
        column.made().map(|made| format!("{} by {}", column.name(), text(made)))
    };
    let of_cloud = |note: &CloudEdit| {
        let CloudEdit { how, n_surfels, n_before, made } = note;
        let made = text(made);
        match how {
            How::Kept => format!("{n_surfels} of {n_before} surfels kept by {made}"),
            // Whether it made them of the cloud that it was given, only the tool knows.
            How::Derived => format!("{n_surfels} surfels made by {made}; it was given {n_before}"),
            How::Enlarged => {
                format!("{n_surfels} surfels of {n_before}, with those added by {made}")
            }
            How::Stroked => format!("a stroke over {n_surfels} of {n_before} surfels by {made}"),
        }
    };
    let columns = cloud.columns().iter().filter_map(of_column);
    columns.chain(cloud.history().iter().map(of_cloud)).collect()
}

fn text(made: &ToolRun) -> String {
    let ToolRun { tool, version, values, time } = made;
    let value = |value: &params::Value| plain(value).to_string();
    // The places of a stroke are for programs.
    let told = values.iter().filter(|(id, _)| ![STROKE_NOTE, AMONG_NOTE].contains(&id.as_str()));
    let values: Vec<String> = told.map(|(id, given)| format!("{id} {}", value(given))).collect();
    let with = if values.is_empty() { String::new() } else { format!(": {}", values.join(", ")) };
    format!("{tool} {version}, {time}{with}")
}
