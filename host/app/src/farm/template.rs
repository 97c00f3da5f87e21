//! A job as a template of Open Job Description, `jobtemplate-2023-09`.
//!
//! Source: the specification of Open Job Description, 2023-09.

use super::job::{Job, Step};
use std::fmt::Write as _;

/// The template, in YAML.
pub(super) fn template(job: &Job) -> String {
    let mut text = String::new();
    let mut line = |written: String| {
        text.push_str(&written);
        text.push('\n');
    };
    line("specificationVersion: jobtemplate-2023-09".to_owned());
    line(format!("name: {}", quoted(&short(&job.name))));
    line(format!("description: {}", quoted(&job.name)));
    line("parameterDefinitions:".to_owned());
    line("- { name: Program, type: STRING, description: \"the program surfelshop\" }".to_owned());
    let folder = "type: PATH, objectType: DIRECTORY";
    line(format!(
        "- {{ name: Folder, {folder}, dataFlow: IN, description: \"where the job was ordered\" }}"
    ));
    line(format!(
        "- {{ name: Job, {folder}, dataFlow: INOUT, description: \"the folder of the job\" }}"
    ));
    for (i, input) in job.inputs.iter().enumerate() {
        let name = input.file_name().unwrap_or_default().to_string_lossy();
        let file = "type: PATH, objectType: FILE, dataFlow: IN";
        line(format!("- {{ name: Input{}, {file}, description: {} }}", i + 1, quoted(&name)));
    }
    line("steps:".to_owned());
    let mut before: Option<&Step> = None;
    for one in &job.steps {
        line(step(job, one, before));
        before = Some(one);
    }
    text
}

/// The values of its parameters.
pub(super) fn parameters(job: &Job, program: &str) -> serde_json::Value {
    let mut values = serde_json::Map::new();
    let mut put = |name: String, value: String| values.insert(name, value.into());
    put("Program".to_owned(), program.to_owned());
    put("Folder".to_owned(), job.folder.display().to_string());
    put("Job".to_owned(), job.place.display().to_string());
    for (i, input) in job.inputs.iter().enumerate() {
        put(format!("Input{}", i + 1), input.display().to_string());
    }
    values.into()
}

fn step(job: &Job, step: &Step, before: Option<&Step>) -> String {
    let mut text = format!("- name: {}\n", step.name);
    if let Some(before) = before {
        writeln!(text, "  dependencies: [ {{ dependsOn: {} }} ]", before.name).unwrap_or_default();
    }
    if let Some(parts) = step.parts {
        text.push_str("  parameterSpace:\n    taskParameterDefinitions:\n");
        writeln!(text, "    - {{ name: Part, type: INT, range: \"1-{parts}\" }}")
            .unwrap_or_default();
    }
    text.push_str(
        "  hostRequirements:
    attributes: [ { name: attr.worker.os.family, anyOf: [ linux, macos ] } ]
  script:
    actions:
      onRun:
        command: bash
        args: [ \"{{Task.File.Run}}\" ]
        cancelation: { mode: NOTIFY_THEN_TERMINATE, notifyPeriodInSeconds: 30 }
    embeddedFiles:
    - name: Run
      type: TEXT
      data: |
",
    );
    let mut script = vec![
        "set -eu".to_owned(),
        "PROGRAM='{{Param.Program}}'".to_owned(),
        "FOLDER='{{Param.Folder}}'".to_owned(),
        "JOB='{{Param.Job}}'".to_owned(),
    ];
    for i in 1..=job.inputs.len() {
        script.push(format!("INPUT{i}='{{{{Param.Input{i}}}}}'"));
    }
    match step.parts {
        Some(parts) => {
            script.push("PART={{Task.Param.Part}}".to_owned());
            script.push(format!("echo \"openjd_status: {}, part $PART of {parts}\"", step.name));
        }
        None => script.push(format!("echo \"openjd_status: {}\"", step.name)),
    }
    script.extend(step.lines.iter().cloned());
    for line in script {
        writeln!(text, "        {line}").unwrap_or_default();
    }
    text.truncate(text.trim_end().len());
    text
}

/// A name of a job has at most 128 characters.
fn short(name: &str) -> String {
    name.chars().take(128).collect()
}

/// A text as YAML takes it: JSON's strings are YAML's, too.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}
