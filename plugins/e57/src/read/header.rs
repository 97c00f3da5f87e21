//! What a file says of its scans, as headers of clouds.

use crate::read::fields::Kind;
use crate::read::layout::Layout;
use crate::read::scanner;
use crate::time::date;
use e57::{E57Reader, PointCloud};
use std::io::{Read, Seek};
use surfelshop_api::format::{CloudHeader, Pose, UpAxis};
use surfelshop_api::glam::{DQuat, DVec3};

/// Most bytes of a text that are kept; coordinate systems have a few thousand.
const LONGEST: usize = 1 << 16;

/// What a comment that has a field of its own in files begins with.
pub(crate) const VENDOR: &str = "sensor vendor";
/// As [`VENDOR`].
pub(crate) const MODEL: &str = "sensor model";
/// As [`VENDOR`].
pub(crate) const SERIAL: &str = "sensor serial number";
/// Comments that say of the file what is said anew when it is written.
pub(crate) const OF_THE_FILE: [&str; 5] =
    ["guid", "file guid", "library", "images", "original guid"];
/// Description of a scan.
pub(crate) const DESCRIPTION: &str = "description";
/// The line of a description by which this program says that a scanner stood at the zero of a scan's axes.
pub(crate) const SCANNED: &str = "surfelshop scanner 0 0 0";

/// What a file says of all its scans.
pub(crate) struct FileFacts {
    n_scans: usize,
    n_images: usize,
    guid: String,
    library: String,
    coordinate_system: String,
    n_poses: usize,
}

impl FileFacts {
    pub(crate) fn new<T: Read + Seek>(document: &E57Reader<T>, scans: &[PointCloud]) -> Self {
        Self {
            n_scans: scans.len(),
            n_images: document.images().len(),
            guid: text(Some(document.guid())),
            library: text(document.library_version()),
            coordinate_system: text(document.coordinate_metadata()),
            n_poses: scans.iter().filter(|scan| scanner::has_pose(scan)).count(),
        }
    }

    /// The header of a scan, and a line where its pose is none.
    pub(crate) fn header(
        &self,
        scan: &PointCloud,
        layout: &Layout,
    ) -> (CloudHeader, Option<String>) {
        let (pose, doubt) = pose(scan);
        let n_scans = self.n_scans;
        let plural = if n_scans == 1 { "" } else { "s" };
        let others_have_poses = self.n_poses > usize::from(scanner::has_pose(scan));
        let header = CloudHeader {
            format: format!("E57 1.0, {n_scans} scan{plural}"),
            name: text(scan.name.as_deref()),
            rows: Some(scan.records),
            columns: layout.file_columns(),
            bounds: scanner::bounds(scan),
            step: step(layout),
            pose,
            scanner: said_scanner(scan).or_else(|| scanner::place(scan, others_have_poses)),
            up: UpAxis::Z,
            metres_per_unit: 1.0,
            coordinate_system: self.coordinate_system.clone(),
            time: scan
                .acquisition_start
                .as_ref()
                .and_then(|time| date(time.gps_time))
                .unwrap_or_default(),
            comments: self.comments(scan),
            ..CloudHeader::default()
        };
        (header, doubt)
    }

    fn comments(&self, scan: &PointCloud) -> Vec<String> {
        let guids = scan.original_guids.iter().flatten().take(100);
        let mut named = vec![
            ("guid", text(scan.guid.as_deref())),
            (VENDOR, text(scan.sensor_vendor.as_deref())),
            (MODEL, text(scan.sensor_model.as_deref())),
            (SERIAL, text(scan.sensor_serial.as_deref())),
            ("sensor hardware version", text(scan.sensor_hw_version.as_deref())),
            ("sensor software version", text(scan.sensor_sw_version.as_deref())),
            ("sensor firmware version", text(scan.sensor_fw_version.as_deref())),
            ("file guid", self.guid.clone()),
            ("library", self.library.clone()),
        ];
        named.extend(guids.map(|guid| ("original guid", text(Some(guid)))));
        if self.n_images > 0 {
            named.push(("images", self.n_images.to_string()));
        }
        let description = text(scan.description.as_deref());
        let lines = description.lines().map(str::trim).filter(|line| *line != SCANNED);
        named.extend(lines.map(|line| (DESCRIPTION, line.to_owned())));
        let there = named.into_iter().filter(|(_, text)| !text.is_empty());
        there.map(|(name, text)| format!("{name}: {text}")).collect()
    }
}

/// A text of the file without blanks around it, cut where it is very long.
fn text(text: Option<&str>) -> String {
    let text = text.unwrap_or_default().trim();
    let end = (0..=LONGEST.min(text.len())).rev().find(|&end| text.is_char_boundary(end));
    text[..end.unwrap_or(0)].to_owned()
}

/// The step of coordinates that are whole numbers of it.
fn step(layout: &Layout) -> Option<DVec3> {
    let step = |i: usize| match layout.fields[i].kind {
        Kind::Steps { step, .. } if step.is_finite() && step > 0.0 => Some(step),
        _ => None,
    };
    let [x, y, z] = layout.places.cartesian?;
    Some(DVec3::new(step(x)?, step(y)?, step(z)?))
}

/// A scan's pose; the identity, with a line, where the file's is none.
fn pose(scan: &PointCloud) -> (Pose, Option<String>) {
    let Some(pose) = &scan.transform else { return (Pose::default(), None) };
    let (turn, by) = (&pose.rotation, &pose.translation);
    let (turn, by) =
        (DQuat::from_xyzw(turn.x, turn.y, turn.z, turn.w), DVec3::new(by.x, by.y, by.z));
    let length = turn.length();
    if by.is_finite() && length.is_finite() && length > 1e-6 {
        return (Pose { rotation: turn.normalize(), translation: by }, None);
    }
    let doubt =
        format!("a scan's pose is none (rotation {turn}, translation {by}); it is left out");
    (Pose::default(), Some(doubt))
}

/// The scanner's place where the description says it.
fn said_scanner(scan: &PointCloud) -> Option<DVec3> {
    let mut lines = scan.description.as_deref()?.lines();
    lines.any(|line| line.trim() == SCANNED).then_some(DVec3::ZERO)
}

#[cfg(test)]
mod tests {
    use super::*;
    use e57::{Quaternion, Transform, Translation};

    #[test]
    fn poses_are_made_unit_and_those_that_are_none_left_out() {
        let mut scan = PointCloud::default();
        let with = |w: f64, x: f64, at: f64| {
            let rotation = Quaternion { w, x, y: 0.0, z: 0.0 };
            Transform { rotation, translation: Translation { x: at, y: 2.0, z: 3.0 } }
        };
        scan.transform = Some(with(0.0, 2.0, 1.0));
        let (found, doubt) = pose(&scan);
        assert_eq!((found.rotation, doubt), (DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0), None));
        assert_eq!(found.translation, DVec3::new(1.0, 2.0, 3.0));
        for wrong in [with(0.0, 0.0, 1.0), with(f64::NAN, 0.0, 1.0), with(1.0, 0.0, f64::INFINITY)]
        {
            scan.transform = Some(wrong);
            let (found, doubt) = pose(&scan);
            assert_eq!(found, Pose::default());
            assert!(doubt.unwrap().contains("left out"));
        }
    }

    #[test]
    fn long_texts_are_cut_between_letters() {
        let long = "ä".repeat(LONGEST);
        assert_eq!(text(Some(&long)).len(), LONGEST);
        let cut = text(Some(&format!("a{long}")));
        assert_eq!((cut.len(), text(Some("  b \n"))), (LONGEST - 1, "b".to_owned()));
    }
}
