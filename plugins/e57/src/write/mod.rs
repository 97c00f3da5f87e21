//! Writing: a scan for each cloud, through the crate `e57`.

mod held;
mod outgoing;
mod tail;
mod xml_text;

use crate::read::header::{DESCRIPTION, MODEL, OF_THE_FILE, SCANNED, SERIAL, VENDOR};
use crate::read::layout::{NORMALS, ROW_INDEX};
use crate::refused;
use crate::time::gps_seconds;
use crate::write::held::{Held, Points};
use crate::write::outgoing::{COLUMNS, Outgoing};
use crate::write::tail::Tail;
use crate::write::xml_text::{guid, text};
use e57::{DateTime, E57Writer, Extension, PointCloudWriter, Quaternion, Transform, Translation};
use std::io::{Read, Seek, Write};
use surfelshop_api::format::{CloudHeader, CloudSource, FileSink, HeaderSupport, Pose, UpSupport};
use surfelshop_api::glam::DVec3;
use surfelshop_api::{Job, Result};

/// Extensions and what names them for good.
const EXTENSIONS: [(&str, &str); 2] = [
    (NORMALS, "http://www.libe57.org/E57_NOR_surface_normals.txt"),
    (COLUMNS, "urn:surfelshop:e57:columns"),
];

/// Writes clouds as the scans of a file; returns what it cannot hold.
///
/// # Errors
/// Where the clouds cannot be had or written.
pub(crate) fn write(
    clouds: &mut CloudSource<'_>,
    file: &FileSink,
    job: &Job<'_>,
) -> Result<Vec<String>> {
    let writer = E57Writer::new(Tail::new(file.stream()), &guid());
    let writer = writer.map_err(|error| refused(&error))?;
    let mut writing = Writing { writer, lines: Vec::new(), extensions: Vec::new(), job, most: 0.0 };
    let mut coordinate_system = None;
    while let Some(header) = clouds.next_cloud()? {
        // A system is in its own unit.
        let system =
            if metres(&header) == 1.0 { header.coordinate_system.clone() } else { String::new() };
        let first = coordinate_system.get_or_insert_with(|| system.clone());
        if *first != system {
            writing.lines.push(
                "the scans have several coordinate systems: the first one is written".to_owned(),
            );
        }
        writing.cloud(&header, clouds)?;
    }
    let Writing { mut writer, mut lines, .. } = writing;
    writer.set_coordinate_metadata(coordinate_system.and_then(|system| text(&system)));
    writer.finalize().map_err(|error| refused(&error))?;
    let mut said = std::collections::HashSet::new();
    lines.retain(|line| said.insert(line.clone()));
    Ok(lines)
}

/// Writing a file.
struct Writing<'a, T: Read + Write + Seek> {
    writer: E57Writer<T>,
    lines: Vec<String>,
    extensions: Vec<&'static str>,
    job: &'a Job<'a>,
    /// The progress that was told: nobody knows how many clouds follow.
    most: f64,
}

impl<T: Read + Write + Seek> Writing<'_, T> {
    fn cloud(&mut self, header: &CloudHeader, clouds: &mut CloudSource<'_>) -> Result<()> {
        let (header, shift) = &at_scanner(header);
        let components: Vec<u32> = header.columns.iter().map(|column| column.components).collect();
        let metres = metres(header);
        let mut held = Held::new(header.step.map(|step| step * metres));
        let mut complete = false;
        loop {
            self.job.check()?;
            let Some(mut batch) = clouds.next_batch()? else {
                complete = true;
                break;
            };
            batch.origin -= *shift;
            if !held.add(&Points::new(&batch, &components, metres)?) {
                break;
            }
        }
        let mut outgoing = Outgoing::new(header, held.storage(complete), metres, &mut self.lines);
        self.register(&outgoing)?;
        let scan = self.writer.add_pointcloud(&guid(), outgoing.prototype());
        let mut scan = scan.map_err(|error| refused(&error))?;
        describe(&mut scan, header, &mut self.lines);
        let mut n_points = 0;
        for points in held.points() {
            outgoing.add(&mut scan, &points)?;
            n_points += points.len;
            self.job.check()?;
        }
        drop(held);
        while let Some(mut batch) = if complete { None } else { clouds.next_batch()? } {
            batch.origin -= *shift;
            outgoing.add(&mut scan, &Points::new(&batch, &components, metres)?)?;
            n_points += batch.len;
            if let Some(rows) = header.rows.filter(|&rows| rows > 0) {
                self.most = self.most.max((n_points as f64 / rows as f64).min(1.0));
                self.job.progress(self.most, "");
            }
            self.job.check()?;
        }
        if let Some(limits) = outgoing.intensity_limits() {
            scan.set_intensity_limits(Some(limits));
        }
        scan.finalize().map_err(|error| refused(&error))?;
        self.lines.extend(outgoing.lines());
        Ok(())
    }

    /// Names the extensions that fields are of.
    fn register(&mut self, outgoing: &Outgoing) -> Result<()> {
        for (name, url) in EXTENSIONS {
            if outgoing.uses(name) && !self.extensions.contains(&name) {
                let registered = self.writer.register_extension(Extension::new(name, url));
                registered.map_err(|error| refused(&error))?;
                self.extensions.push(name);
            }
        }
        Ok(())
    }
}

/// The header of a cloud in the axes whose zero is the scanner, which E57 has there, and how far points move.
fn at_scanner(header: &CloudHeader) -> (CloudHeader, DVec3) {
    let mut header = header.clone();
    let far = |place: &DVec3| place.is_finite() && place.length() > 1e-9;
    let Some(place) = header.scanner.filter(far) else { return (header, DVec3::ZERO) };
    header.pose.translation = header.pose.place(place);
    header.scanner = Some(DVec3::ZERO);
    (header, place)
}

/// Writes what a header says of a cloud.
fn describe<T: Read + Write + Seek>(
    scan: &mut PointCloudWriter<'_, T>,
    header: &CloudHeader,
    lines: &mut Vec<String>,
) {
    scan.set_name(text(&header.name));
    // A pose that moves nothing says that the points were seen from zero.
    let seen = header.scanner.filter(|place| place.is_finite());
    if header.pose != Pose::default() || seen.is_some() {
        scan.set_transform(Some(transform(&header.pose, metres(header))));
    }
    let held = HeaderSupport {
        up: UpSupport::TakenAsZ,
        name: true,
        unit: true,
        coordinate_system: true,
        scanner: true,
        time: true,
        // Said below: files have a place, which is not filled.
        grid: true,
        comments: true,
        faces: false,
    };
    lines.extend(header.left_out("E57", held));
    if header.grid.is_some() && header.column(ROW_INDEX).is_none() {
        lines.push("the rows and columns of the grid are left out".to_owned());
    }
    let metres = metres(header);
    if metres != 1.0 && !header.coordinate_system.is_empty() {
        lines.push(
            "the coordinate reference system, which is in the former unit, is left out".to_owned(),
        );
    }
    if metres != 1.0 {
        lines.push(format!(
            "units of {metres} m become metres, as E57 has them: coordinates and lengths are multiplied by that"
        ));
    }
    match gps_seconds(&header.time) {
        Some(gps_time) => {
            scan.set_acquisition_start(Some(DateTime { gps_time, atomic_reference: false }));
        }
        None if header.time.is_empty() => {}
        None => lines.push(format!("the time `{}` is not written: it is no date", header.time)),
    }
    let comments: Vec<(&str, &str)> = header
        .comments
        .iter()
        .map(|comment| comment.split_once(": ").unwrap_or(("", comment)))
        .collect();
    // A cloud of several scans may have the sensors of all of them.
    let only = |name: &str| {
        let mut values =
            comments.iter().filter(|(found, _)| *found == name).map(|(_, value)| value);
        let first = values.next()?;
        values.all(|value| value == first).then(|| text(first))?
    };
    scan.set_sensor_vendor(only(VENDOR));
    scan.set_sensor_model(only(MODEL));
    scan.set_sensor_serial(only(SERIAL));
    let mut description = Vec::new();
    // Far from all points it would not be believed.
    description.extend(seen.map(|_| SCANNED));
    for (comment, (name, value)) in header.comments.iter().zip(&comments) {
        match *name {
            VENDOR | MODEL | SERIAL => {}
            DESCRIPTION => description.push(*value),
            name if OF_THE_FILE.contains(&name) => {}
            _ => description.push(comment),
        }
    }
    scan.set_description(text(&description.join("\n")));
}

/// Metres of a unit; 1 where nobody knows.
fn metres(header: &CloudHeader) -> f64 {
    let metres = header.metres_per_unit;
    // What differs less is how a unit was rounded.
    if metres.is_finite() && metres > 0.0 && (metres - 1.0).abs() > 1e-9 { metres } else { 1.0 }
}

fn transform(pose: &Pose, metres: f64) -> Transform {
    // The standard wants no negative real part; both quaternions are the same rotation.
    let turn = if pose.rotation.w < 0.0 { -pose.rotation } else { pose.rotation };
    let by = pose.translation * metres;
    Transform {
        rotation: Quaternion { w: turn.w, x: turn.x, y: turn.y, z: turn.z },
        translation: Translation { x: by.x, y: by.y, z: by.z },
    }
}
