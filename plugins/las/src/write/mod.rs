//! Writing a cloud as LAS or LAZ.

mod ahead;
mod encode;
mod extra_fields;
mod head;
mod output;
mod plan;
mod scale;
mod values;

use crate::layout::ANGLE_STEP;
use crate::projection::is_wkt;
use crate::settings::{Settings, Version};
use ahead::{Ahead, Outcome};
use encode::{Counts, Encoder};
use head::Head;
use output::Output;
use plan::{Plan, Put};
use scale::Steps;
use surfelshop_api::columns::POSITION;
use surfelshop_api::format::{CloudHeader, CloudSource, FileSink, SCAN_ANGLE};
use surfelshop_api::glam::DVec3;
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
    let mut ahead = Ahead::default();
    let (minor, doubt) = minor(settings.version, &header, &mut ahead, clouds, job)?;
    if ahead.is_empty() {
        ahead.take_one(clouds)?;
    }
    let first = ahead.first();
    let mut plan = Plan::new(&header, first.as_ref(), minor)?;
    let mut lines = std::mem::take(&mut plan.lines);
    lines.extend(doubt);
    let first = first.as_ref().map(positions).unwrap_or_default();
    let steps = Steps::choose(&header, &first, settings.scale)?;
    let vlr =
        if is_compressed(file.name(), &mut lines) { Some(output::laszip(&plan)?) } else { None };
    let head = Head::new(&header, &plan, steps, vlr.as_ref(), &mut lines)?;
    let mut output = Output::new(file, job, head.points_at(), &plan, vlr);
    let mut encoder = Encoder::new(&plan, steps);
    let (mut n_done, rows) = (0, header.rows.unwrap_or(0).max(1) as f64);
    let share = |n: u64| (n as f64 / rows).min(0.99);
    ahead.each(clouds, |batch| {
        let before = n_done;
        n_done += batch.len as u64;
        encoder.add(batch, &mut output.records)?;
        if plan.minor < 4 && encoder.counts.n_points > u64::from(u32::MAX) {
            return Err(Error::new(
                "LAS 1.2 holds at most 4294967295 points; choose `version` 1.4",
            ));
        }
        output.flush(share(before)..share(n_done))?;
        job.progress(share(n_done), "");
        Ok(())
    })?;
    let counts = encoder.counts;
    output.finish()?;
    lines.extend(changed(&header, &plan, &counts, steps));
    file.write_at(0, &head.bytes(&counts, steps))?;
    if clouds.next_cloud()?.is_some() {
        return Err(Error::new("expected one cloud to write, found several; LAS files hold one"));
    }
    Ok(lines)
}

/// The minor version of the file: the lowest that holds the values of the cloud as they are, as far as `ahead` can
/// look; 1.4 where it cannot, and a line that says so.
fn minor(
    version: Version,
    header: &CloudHeader,
    ahead: &mut Ahead,
    clouds: &mut CloudSource<'_>,
    job: &Job<'_>,
) -> Result<(u8, Option<String>)> {
    let is_older = ["LAS 1.", "LAZ 1."].iter().any(|format| {
        let rest = header.format.strip_prefix(format);
        rest.is_some_and(|rest| rest.starts_with(['0', '1', '2', '3']))
    });
    let narrow = match version {
        Version::Older => return Ok((2, None)),
        Version::Newer => return Ok((4, None)),
        Version::Auto if is_older => return Ok((2, None)),
        Version::Auto => plan::narrow(header),
    };
    Ok(match narrow {
        None => (4, for_wkt(header)),
        Some(narrow) if narrow.is_empty() => (2, None),
        Some(narrow) => match ahead.look(clouds, &narrow, job)? {
            Outcome::Fits => (2, None),
            Outcome::Exceeds => (4, None),
            Outcome::Unknown => (4, Some(TOO_LARGE.to_owned())),
        },
    })
}

/// What is said where 1.4 is written for its coordinate system, and angles of whole degrees change by it.
fn for_wkt(header: &CloudHeader) -> Option<String> {
    let is_wkt = is_wkt(&header.coordinate_system) && header.column(SCAN_ANGLE).is_some();
    is_wkt.then(|| {
        format!(
            "LAS 1.4 is written, since the coordinate system is WKT: its scan angles are steps of {ANGLE_STEP} degrees"
        )
    })
}

/// What is said where the version had to be chosen before all values were seen.
const TOO_LARGE: &str = "LAS 1.4 is written, since the cloud is too large to look at all its classes, returns and \
    angles first: set `version` to 1.2 where these fit, such as angles of whole degrees";

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
    for (i, (field, &n)) in plan.fields.iter().zip(&counts.misfits).enumerate() {
        let name = &field.name;
        let none = counts.n_nan[i];
        if none > 0 {
            lines.push(format!("{none} points have no `{name}`: 0 is written"));
        }
        if n == none {
            continue;
        }
        let n = n - none;
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
    lines.extend(moved(header, counts, steps));
    lines
}

/// Says how far points were moved, where coordinates are no whole steps.
fn moved(header: &CloudHeader, counts: &Counts, steps: Steps) -> Option<String> {
    // What is less is double precision's own.
    let reach = header
        .bounds
        .map_or(f64::INFINITY, |bounds| bounds[0].abs().max(bounds[1].abs()).max_element());
    let is_moved = counts.rounding.cmpgt(steps.scale * 1e-2).any()
        || counts.rounding.max_element() > 1e-9 * reach;
    let alike = |vector: DVec3| match vector.cmpeq(DVec3::splat(vector.x)).all() {
        true => format!("{}", vector.x),
        false => format!("{}, {} and {}", vector.x, vector.y, vector.z),
    };
    let own = header.step.filter(|own| *own != steps.scale).map(alike);
    let own = own.map_or_else(String::new, |own| format!(" (the cloud has steps of {own})"));
    let (step, most) = (alike(steps.scale), short(counts.rounding.max_element()));
    is_moved.then(|| {
        format!(
            "positions are rounded to whole steps of {step}{own}: by at most {most} along an axis"
        )
    })
}

/// A number in two digits, rounded up.
fn short(number: f64) -> String {
    let digits = (1.0 - number.log10().floor()).clamp(0.0, 20.0);
    let unit = 10f64.powf(digits);
    // What is just above for want of precision is not.
    let number = (number * unit - 1e-6).ceil() / unit;
    // At most 20.
    let digits = digits as usize;
    let text = format!("{number:.digits$}");
    let is_fraction = text.contains('.');
    if is_fraction { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}
