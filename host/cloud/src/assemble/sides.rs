//! Which side normals face that were estimated: the device that took the scan, where the file says where it stood.

use super::position::Positions;
use crate::cloud::source::Source;
use crate::summary::Summary;
use crate::table::Table;
use glam::{DVec3, Vec3};
use surfelshop_api::format::SCAN;

/// Turns normals towards the device that saw their point; points of scans without one stay as they are.
pub(super) fn face_scanners(
    table: &Table,
    placed: &Positions,
    source: &Source,
    normals: &mut [Vec3],
    summary: &mut Summary,
) {
    let Some(scanners) = source.scanners() else { return };
    let offsets: Vec<Option<DVec3>> =
        scanners.iter().map(|place| place.map(|place| place - placed.origin)).collect();
    let mut numbers = table.woven(&[SCAN]).map(|numbers| numbers.iter_f64());
    let counts = &mut summary.normals;
    for (position, normal) in placed.positions.iter().zip(normals) {
        // Without a column of numbers there is one scan.
        let number = numbers.as_mut().map_or(Some(0.0), Iterator::next).unwrap_or(0.0);
        let scanner = offsets.get(number.max(0.0) as usize).copied().flatten();
        let Some(scanner) = scanner else { continue };
        let to_scanner = scanner - position.as_dvec3();
        counts.towards_scanner += 1;
        if normal.as_dvec3().dot(to_scanner) < 0.0 {
            *normal = -*normal;
            counts.turned += 1;
        }
    }
}
