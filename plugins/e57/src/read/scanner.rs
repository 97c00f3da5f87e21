//! Whether a scanner stood where a scan's coordinates are zero.

use e57::{CartesianBounds, PointCloud, RecordName, Transform};
use surfelshop_api::glam::DVec3;

/// Diagonals of the box that a scanner may be away from it, where the file says that a device took the scan.
const FAR: f64 = 10.0;
/// The same where that is only likely: within the box or beside it.
const NEAR: f64 = 0.5;

/// The scanner's place in the scan's own axes, zero, unless points seem to be no scan from one place.
///
/// Spherical coordinates are those of a device. Rows and columns, or a pose that is rotated, are nearly so. A pose
/// that only moves may be there to keep numbers small, and a named sensor, a pose that moves nothing or poses of
/// other scans in the file say little: there the points must lie around or beside zero. Points without any of
/// that are taken for a merged cloud, which no one place sees.
pub(crate) fn place(scan: &PointCloud, others_have_poses: bool) -> Option<DVec3> {
    if scan.has_spherical() {
        return Some(DVec3::ZERO);
    }
    let has = |name: RecordName| scan.prototype.iter().any(|record| record.name == name);
    let distance = bounds(scan).map(diagonals_from_zero);
    if has(RecordName::RowIndex) || has(RecordName::ColumnIndex) || is_turned(scan) {
        return distance.is_none_or(|distance| distance <= FAR).then_some(DVec3::ZERO);
    }
    let sensor = [&scan.sensor_vendor, &scan.sensor_model, &scan.sensor_serial];
    let named = sensor.into_iter().flatten().any(|text| !text.trim().is_empty());
    let likely = named || others_have_poses || scan.transform.is_some();
    (likely && distance.is_some_and(|distance| distance <= NEAR)).then_some(DVec3::ZERO)
}

/// Whether a pose turns or moves a scan.
pub(crate) fn has_pose(scan: &PointCloud) -> bool {
    let moves = |pose: &Transform| {
        let moved = &pose.translation;
        moved.x != 0.0 || moved.y != 0.0 || moved.z != 0.0
    };
    is_turned(scan) || scan.transform.as_ref().is_some_and(moves)
}

fn is_turned(scan: &PointCloud) -> bool {
    scan.transform.as_ref().is_some_and(|pose| {
        let turn = &pose.rotation;
        turn.x != 0.0 || turn.y != 0.0 || turn.z != 0.0
    })
}

/// The box that the file announces, where it is one.
pub(crate) fn bounds(scan: &PointCloud) -> Option<[DVec3; 2]> {
    let CartesianBounds { x_min, x_max, y_min, y_max, z_min, z_max } =
        scan.cartesian_bounds.clone()?;
    let [low, high] = [DVec3::new(x_min?, y_min?, z_min?), DVec3::new(x_max?, y_max?, z_max?)];
    // Scans without points have the largest numbers there are in some files.
    let sane = |end: DVec3| end.abs().max_element() < 1e100;
    (sane(low) && sane(high) && low.cmple(high).all()).then_some([low, high])
}

/// How far a box is from zero, in its diagonals.
fn diagonals_from_zero([low, high]: [DVec3; 2]) -> f64 {
    let distance = DVec3::ZERO.clamp(low, high).length();
    if distance == 0.0 { 0.0 } else { distance / low.distance(high) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use e57::{Quaternion, Record, RecordDataType, Translation};

    fn scan(names: &[RecordName], bounds: Option<[f64; 2]>) -> PointCloud {
        let mut scan = PointCloud::default();
        for name in names {
            scan.prototype.push(Record { name: name.clone(), data_type: RecordDataType::F32 });
        }
        scan.cartesian_bounds = bounds.map(|[low, high]| CartesianBounds {
            x_min: Some(low),
            x_max: Some(high),
            y_min: Some(low),
            y_max: Some(high),
            z_min: Some(low),
            z_max: Some(high),
        });
        scan
    }

    #[test]
    fn devices_stand_at_zero_and_merged_clouds_have_none() {
        use RecordName as N;
        let around = Some([-3.0, 5.0]);
        let far = Some([4e6, 4e6 + 9.0]);
        let stands = |scan: &PointCloud| place(scan, false).is_some();
        assert!(stands(&scan(
            &[N::SphericalRange, N::SphericalAzimuth, N::SphericalElevation],
            None
        )));
        assert!(!stands(&scan(&[N::CartesianX], around)) && !stands(&scan(&[N::CartesianX], None)));
        assert!(place(&scan(&[N::CartesianX], around), true).is_some());
        assert!(stands(&scan(&[N::RowIndex], around)) && stands(&scan(&[N::RowIndex], None)));
        assert!(
            stands(&scan(&[N::RowIndex], Some([8.0, 9.0]))) && !stands(&scan(&[N::RowIndex], far))
        );

        let mut named = scan(&[N::CartesianX], around);
        named.sensor_model = Some("X9".to_owned());
        assert!(stands(&named));
        named.cartesian_bounds = scan(&[], Some([8.0, 9.0])).cartesian_bounds;
        assert!(!stands(&named));

        let mut moved = scan(&[N::CartesianX], around);
        moved.transform = Some(Transform::default());
        assert!(stands(&moved) && !has_pose(&moved));
        let translation = Translation { x: 1.0, ..Translation::default() };
        moved.transform = Some(Transform { translation, ..Transform::default() });
        moved.cartesian_bounds = None;
        assert!(!stands(&moved) && has_pose(&moved));
        let rotation = Quaternion { x: 1.0, ..Quaternion::default() };
        moved.transform = Some(Transform { rotation, ..Transform::default() });
        assert!(stands(&moved) && has_pose(&moved));
    }
}
