//! A tool that ran, in JSON.

use serde_json::{Map, Value, json};
use surfelshop_session::tool_run::Step;

/// Which tool it was, with every parameter.
pub(crate) fn tool_object(step: &Step, parameters: Map<String, Value>) -> Value {
    json!({
        "package": step.reference.package,
        "id": step.reference.id,
        "version": step.unit.manifest.version,
        "file": step.reference.path.display().to_string(),
        "parameters": parameters,
    })
}
