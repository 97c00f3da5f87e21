//! What is in a cloud's file, as its head says it, for `surfelshop info`.

use glam::{DQuat, DVec3};
use serde_json::{Value, json};
use std::fmt::{Error, Write as _};
use surfelshop_api::format::{CloudHeader, Pose, UpAxis};
use surfelshop_cloud::{CloudContents, Contents, Source};

/// Scans that are listed by name.
const LISTED: usize = 12;

/// Letters of a coordinate system that are shown: WKT takes thousands.
const SHOWN: usize = 100;

/// All that is known, for programs: an object for each cloud of the file.
pub(crate) fn objects(contents: &Contents) -> Vec<Value> {
    let object = |cloud: &CloudContents| {
        json!({
            "file": contents.file,
            "header": cloud.header,
            "n_points": cloud.n_points,
            "n_not_finite": cloud.n_not_finite,
            "bounds": cloud.bounds,
            "points_read": contents.points_read,
            "warnings": contents.warnings,
            "seconds": contents.seconds,
        })
    };
    contents.clouds.iter().map(object).collect()
}

/// A row for each thing to know.
pub(crate) fn text(contents: &Contents) -> Result<String, Error> {
    let mut text = contents.file.clone();
    let mut row = |name: &str, value: String| write!(text, "\n  {name:<9} {value}");
    let clouds = &contents.clouds;
    let Some(first) = clouds.first() else {
        row("points", "none".to_owned())?;
        return Ok(text);
    };
    row("format", first.header.format.clone())?;
    let n_points: u64 = clouds.iter().map(|cloud| cloud.n_points).sum();
    let n_not_finite: u64 = clouds.iter().map(|cloud| cloud.n_not_finite).sum();
    let not_finite = match n_not_finite {
        0 => String::new(),
        n => format!("; {n} without finite coordinates"),
    };
    let in_scans =
        if clouds.len() > 1 { format!(" in {} scans", clouds.len()) } else { String::new() };
    row("points", format!("{n_points}{in_scans}{not_finite}"))?;
    if clouds.len() > 1 {
        for (number, cloud) in clouds.iter().enumerate().take(LISTED) {
            row(&format!("scan {number}"), scan(cloud))?;
        }
        if clouds.len() > LISTED {
            row("", format!("and {} more", clouds.len() - LISTED))?;
        }
    }
    if clouds.iter().any(|cloud| cloud.header.has_faces) {
        row("triangles", "yes".to_owned())?;
    }
    let boxes = clouds.iter().filter_map(|cloud| cloud.bounds);
    let whole = boxes.reduce(|[a, b], [low, high]| [a.min(low), b.max(high)]);
    if let Some([low, high]) = whole {
        // A head has the box of a scan's own axes, and a box is larger once it is turned.
        let is_turned = |cloud: &CloudContents| cloud.header.pose.rotation != DQuat::IDENTITY;
        let is_moved = |cloud: &CloudContents| cloud.header.pose != Pose::default();
        let most = match (contents.points_read, clouds.iter().any(is_turned)) {
            (false, true) => ", at most: boxes of turned scans; --full takes the points'",
            (false, false) if clouds.iter().any(is_moved) => {
                ", by the boxes in their heads; --full takes the points'"
            }
            _ => "",
        };
        row("bounds", bounds(low, high) + most)?;
    }
    if let [only] = &clouds[..]
        && let Some(place) = only.header.scanner
    {
        let place = only.header.pose.place(place);
        row("scanner", numbers(place, place.abs().max_element()))?;
    }
    if let Some([width, height]) = first.header.grid.filter(|_| clouds.len() == 1) {
        row("grid", format!("{width} x {height}"))?;
    }
    row("columns", columns(&first.header))?;
    source_rows(&source(clouds), &mut row)?;
    for comment in first.header.comments.iter().filter(|line| !line.starts_with("surfelshop ")) {
        row("comment", cut(comment))?;
    }
    let how = if contents.points_read { "" } else { ", heads only" };
    row("read in", format!("{:.2} s{how}", contents.seconds))?;
    for warning in &contents.warnings {
        row("warning", warning.clone())?;
    }
    Ok(text)
}

fn scan(cloud: &CloudContents) -> String {
    let name = &cloud.header.name;
    let name = if name.is_empty() { String::new() } else { format!("`{}`, ", cut(name)) };
    let place = match cloud.header.scanner.map(|place| cloud.header.pose.place(place)) {
        Some(place) => format!(", scanner at {}", numbers(place, place.abs().max_element())),
        None => String::new(),
    };
    format!("{name}{} points{place}", cloud.n_points)
}

pub(crate) fn columns(header: &CloudHeader) -> String {
    let column = |column: &surfelshop_api::format::FileColumn| {
        format!("{} {} x {}", column.name, column.components, column.element.name())
    };
    header.columns.iter().map(column).collect::<Vec<_>>().join(", ")
}

fn numbers(point: DVec3, size: f64) -> String {
    point.to_array().map(|number| shortened(number, size)).join(" ")
}

pub(crate) fn bounds(low: DVec3, high: DVec3) -> String {
    let size = high - low;
    let [low, high, size] = [low, high, size].map(|point| numbers(point, size.max_element()));
    format!("{low} to {high}, size {size}")
}

fn cut(text: &str) -> String {
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    match line.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}…", &line[..end]),
        None => line,
    }
}

/// The facts of all clouds of a file, as a load would have them.
fn source(clouds: &[CloudContents]) -> Source {
    let headers = || clouds.iter().map(|cloud| &cloud.header);
    let text = |text: fn(&CloudHeader) -> &String| {
        headers().map(text).find(|text| !text.is_empty()).cloned().unwrap_or_default()
    };
    Source {
        up: headers().map(|header| header.up).find(|&up| up != UpAxis::Unknown).unwrap_or_default(),
        metres_per_unit: headers().map(|header| header.metres_per_unit).fold(0.0, f64::max),
        coordinate_system: text(|header| &header.coordinate_system),
        time: text(|header| &header.time),
        step: headers().find_map(|header| header.step),
        ..Source::default()
    }
}

/// Rows of what a file says besides its points.
pub(crate) fn source_rows(
    source: &Source,
    row: &mut impl FnMut(&str, String) -> Result<(), Error>,
) -> Result<(), Error> {
    if let Some(up) = source.said_up() {
        row("up", up.name().to_owned())?;
    } else if let Some(frame) = source.camera_frame {
        let seen = if frame.is_one_view { ", which saw all of them" } else { "" };
        let up = frame.up.name();
        row("up", format!("{up}, by how the points lie before a depth camera{seen}"))?;
    } else if source.is_on_map {
        row("up", "z, by coordinates that are places on a map".to_owned())?;
    }
    if source.metres_per_unit > 0.0 {
        row("unit", format!("{} m", source.metres_per_unit))?;
    }
    if !source.coordinate_system.is_empty() {
        row("system", cut(&source.coordinate_system))?;
    }
    if !source.time.is_empty() {
        row("taken", source.time.clone())?;
    }
    if let Some(step) = source.step {
        row("step", format!("{} {} {}", step.x, step.y, step.z))?;
    }
    Ok(())
}

/// A coordinate with as many decimals as matter for something of this size: seven digits, about
/// what f32 offsets hold.
pub(crate) fn shortened(number: f64, size: f64) -> String {
    let decimals = 7.0 - size.log10().ceil();
    let decimals = if decimals.is_finite() { decimals.clamp(0.0, 15.0) as usize } else { 6 };
    let text = format!("{number:.decimals$}");
    let text =
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}
