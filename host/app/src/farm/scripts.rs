//! A job as scripts: one that runs a task, for hands and for Slurm, and one that submits all to Slurm.

use super::job::{Job, in_quotes};

/// Runs a task: `task.sh STEP [PART]`.
pub(super) fn task(job: &Job, program: &std::path::Path) -> anyhow::Result<String> {
    let mut text = format!(
        "#!/bin/bash
# Runs a task of a job: {}
# Type: bash task.sh STEP [PART]; of an array of Slurm, PART is the task's number.
set -eu
PROGRAM={}
FOLDER={}
JOB={}
",
        job.name,
        in_quotes(program)?,
        in_quotes(&job.folder)?,
        in_quotes(&job.place)?,
    );
    for (i, input) in job.inputs.iter().enumerate() {
        text.push_str(&format!("INPUT{}={}\n", i + 1, in_quotes(input)?));
    }
    text.push_str("PART=${2:-${SLURM_ARRAY_TASK_ID:-}}\ncase \"${1:-}\" in\n");
    for step in &job.steps {
        text.push_str(&format!("{})\n", step.name));
        if let Some(parts) = step.parts {
            let (name, expected) = (&step.name, format!("expected a part from 1 to {parts}"));
            text.push_str(&format!("  : \"${{PART:?{name}: {expected}}}\"\n"));
        }
        for line in &step.lines {
            text.push_str(&format!("  {line}\n"));
        }
        text.push_str("  ;;\n");
    }
    let names: Vec<&str> = job.steps.iter().map(|step| step.name.as_str()).collect();
    text.push_str(&format!(
        "*)\n  echo \"expected a step: {}\" >&2\n  exit 2\n  ;;\nesac\n",
        names.join(", ")
    ));
    Ok(text)
}

/// Submits all steps to Slurm, each after the one before.
pub(super) fn slurm(job: &Job) -> anyhow::Result<String> {
    let mut text = format!(
        "#!/bin/sh
# Submits a job to Slurm: {}
# Type: sh slurm.sh [OPTIONS OF SBATCH], such as --partition=cpu --time=1:00:00 --cpus-per-task=8.
# All nodes have to see the same folders. Tasks whose node is lost start again; where one fails, what follows is
# cancelled: submit again, and what is done is not done again.
set -eu
JOB={}
mkdir -p \"$JOB/log\"
submit() {{
  sbatch --parsable --requeue --kill-on-invalid-dep=yes --output=\"$JOB/log/%x-%A-%a.txt\" \"$@\"
}}
",
        job.name,
        in_quotes(&job.place)?,
    );
    let mut before = false;
    for step in &job.steps {
        let name = &step.name;
        let after = if before { " --dependency=afterok:\"$last\"" } else { "" };
        let array = step.parts.map(|parts| format!(" --array=1-{parts}")).unwrap_or_default();
        text.push_str(&format!(
            "last=$(submit \"$@\"{after}{array} --job-name={name} \"$JOB/task.sh\" {name})\n"
        ));
        before = true;
    }
    text.push_str("echo \"the last step is job $last\"\n");
    Ok(text)
}
