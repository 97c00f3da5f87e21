//! Writing a cloud as LAS or LAZ.

mod encode;
mod extra_fields;
mod head;
mod output;
mod plan;
mod scale;
mod values;

use crate::settings::{Settings, Version};
use encode::{Counts, Encoder};
use head::Head;
use output::Output;
use plan::{Plan, Put};
use scale::Steps;
use surfelshop_api::columns::POSITION;
use surfelshop_api::format::{CloudHeader, CloudSource, FileSink};
use surfelshop_api::{CloudView, Error, Job, Result};
use values::{Value as _, each_type};

/// Writes a cloud; returns what cannot be held, for people.
///
/// # Errors
/// Where there is not one cloud, its coordinates do not fit, the system refuses, or the user asked to stop.
pub(crate) fn write(
    clouds: &mut CloudSource<'_>,
    settings: &Settings,
    file: &FileSink,
    job: &Job<'_>,
) -> Result<Vec<String>> {
    let header = clouds.next_cloud()?;
    let header = header.ok_or_else(|| Error::new("expected a cloud to write, found none"))?;
    let mut next = clouds.next_batch()?;
    let mut plan = Plan::new(&header, next.as_ref(), minor(settings.version, &header))?;
    let mut lines = std::mem::take(&mut plan.lines);
    let first = next.as_ref().map(positions).unwrap_or_default();
    let steps = Steps::choose(&header, &first, settings.scale, &mut lines)?;
    let vlr =
        if is_compressed(file.name(), &mut lines) { Some(output::laszip(&plan)?) } else { None };
    let head = Head::new(&header, &plan, steps, vlr.as_ref(), &mut lines)?;
    let mut output = Output::new(file, job, head.points_at(), &plan, vlr);
    let mut encoder = Encoder::new(&plan, steps);
    let (mut n_done, rows) = (0, header.rows.unwrap_or(0).max(1) as f64);
    let share = |n: u64| (n as f64 / rows).min(0.99);
    while let Some(batch) = next {
        let before = n_done;
        n_done += batch.len as u64;
        encoder.add(&batch, &mut output.records)?;
        if plan.minor < 4 && encoder.counts.n_points > u64::from(u32::MAX) {
            return Err(Error::new(
                "LAS 1.2 holds at most 4294967295 points; choose `version` 1.4",
            ));
        }
        output.flush(share(before)..share(n_done))?;
        job.progress(share(n_done), "");
        next = clouds.next_batch()?;
    }
    let counts = encoder.counts;
    output.finish()?;
    lines.extend(changed(&header, &plan, &counts, steps));
    file.write_at(0, &head.bytes(&counts, steps))?;
    if clouds.next_cloud()?.is_some() {
        return Err(Error::new("expected one cloud to write, found several; LAS files hold one"));
    }
    Ok(lines)
}

/// The minor version of the file. The lowest that holds what may come: the fields of 1.2 for classes, returns and angles
/// are narrower than those of 1.4, and later batches may need these.
fn minor(version: Version, header: &CloudHeader) -> u8 {
    let is_older = ["LAS 1.", "LAZ 1."].iter().any(|format| {
        let rest = header.format.strip_prefix(format);
        rest.is_some_and(|rest| rest.starts_with(['0', '1', '2', '3']))
    });
    match version {
        Version::Older => 2,
        Version::Auto if is_older || plan::fits_older(header) => 2,
        Version::Auto | Version::Newer => 4,
    }
}

/// Whether a file of this name is compressed.
fn is_compressed(name: &str, lines: &mut Vec<String>) -> bool {
    let name = name.to_ascii_lowercase();
    if name.ends_with(".copc.laz") {
        lines.push("the file is a LAZ file without the hierarchy of COPC".to_owned());
    }
    name.ends_with(".laz")
}

/// The positions of a batch.
fn positions(batch: &CloudView<'_>) -> Vec<f64> {
    let origin = batch.origin.to_array();
    let Some(column) = batch.column(POSITION) else { return Vec::new() };
    each_type!(&column.values, slice => {
        slice.iter().zip(origin.iter().cycle()).map(|(value, origin)| value.number() + origin).collect()
    })
}

/// What was changed, for people.
fn changed(header: &CloudHeader, plan: &Plan, counts: &Counts, steps: Steps) -> Vec<String> {
    let mut lines = Vec::new();
    if counts.n_placeless > 0 {
        lines
            .push(format!("{} points without finite coordinates are left out", counts.n_placeless));
    }
    for (field, &n) in plan.fields.iter().zip(&counts.misfits).filter(|(_, n)| **n > 0) {
        let name = &field.name;
        lines.push(match field.put {
            Put::Whole { most, .. } => format!(
                "`{name}`: {n} values are no whole numbers from 0 to {most} and are rounded or clamped"
            ),
            Put::Angle { step, .. } => {
                format!("`{name}`: {n} values are rounded to steps of {step} degrees")
            }
            _ => format!("`{name}`: {n} values are not from 0 to 1 and are clamped"),
        });
    }
    // What a coarser scale takes away was said when it was chosen.
    let Some(step) = header.step else { return lines };
    for axis in 0..3 {
        let (off, one) = (counts.rounding[axis], steps.scale[axis]);
        if one <= step[axis] * (1.0 + 1e-9) && off > step[axis] * 0.5001 {
            lines.push(format!(
                "{} is rounded by up to {off}, more than half the cloud's step of {}",
                ["x", "y", "z"][axis],
                step[axis]
            ));
        }
    }
    lines
}
