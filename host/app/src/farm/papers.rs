//! The papers as a job: parts make entries in one folder, and the last task writes the pages of what is there.

use super::arguments::FarmJob;
use super::job::{Job, JobOrder};
use anyhow::{Context as _, ensure};
use surfelshop_papers::PapersArguments;

/// The job; `words` are those that were typed behind `farm papers`.
pub(super) fn job(given: &FarmJob<PapersArguments>, words: Vec<String>) -> anyhow::Result<Job> {
    let (work, n) = (&given.work, given.parts);
    super::without_part(work.part)?;
    ensure!(
        !work.list && work.gallery.is_none(),
        "a job of the papers makes pages; leave out --list and --gallery"
    );
    let place = work.out.as_deref().context("expected -o and the folder of the job")?;
    let order = JobOrder { command: "papers", words, files: &[], place, parts: n };
    let out = "-o \"$JOB/result\"";
    order.job(&[
        ("Parts", Some(n), format!("{out} --part $PART/{n}")),
        ("Pages", None, out.to_owned()),
    ])
}
