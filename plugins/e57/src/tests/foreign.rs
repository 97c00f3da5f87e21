//! Files of other programs: spherical coordinates, invalid states, unusual types.

use super::*;
use e57::{
    ColorLimits, E57Writer, Quaternion, Record, RecordDataType, RecordName as N, RecordValue,
    Transform, Translation,
};
use std::f64::consts::FRAC_PI_2;

const STATE: RecordDataType = RecordDataType::Integer { min: 0, max: 2 };
const FLAG: RecordDataType = RecordDataType::Integer { min: 0, max: 1 };

/// A file of one scan with these fields and the values of its points, one after the other.
fn file(fields: &[(N, RecordDataType)], points: &[&[f64]], limits: Option<ColorLimits>) -> Vec<u8> {
    let mut file = io::Cursor::new(Vec::new());
    let mut writer = E57Writer::new(&mut file, "file").unwrap();
    let record = |(name, data_type): &(N, RecordDataType)| Record {
        name: name.clone(),
        data_type: data_type.clone(),
    };
    let mut scan = writer.add_pointcloud("scan", fields.iter().map(record).collect()).unwrap();
    for point in points {
        let value = |(value, (_, data_type)): (&f64, &(N, RecordDataType))| match data_type {
            RecordDataType::Single { .. } => RecordValue::Single(*value as f32),
            RecordDataType::Double { .. } => RecordValue::Double(*value),
            RecordDataType::ScaledInteger { .. } => RecordValue::ScaledInteger(*value as i64),
            RecordDataType::Integer { .. } => RecordValue::Integer(*value as i64),
        };
        scan.add_point(point.iter().zip(fields).map(value).collect()).unwrap();
    }
    if limits.is_some() {
        scan.set_color_limits(limits);
    }
    scan.finalize().unwrap();
    writer.finalize().unwrap();
    drop(writer);
    file.into_inner()
}

fn spherical(data_type: RecordDataType) -> Vec<(N, RecordDataType)> {
    let names = [N::SphericalRange, N::SphericalAzimuth, N::SphericalElevation];
    names.map(|name| (name, data_type.clone())).to_vec()
}

fn cartesian(data_type: RecordDataType) -> Vec<(N, RecordDataType)> {
    [N::CartesianX, N::CartesianY, N::CartesianZ].map(|name| (name, data_type.clone())).to_vec()
}

#[test]
fn spherical_coordinates_become_places_around_the_scanner() {
    let mut fields = spherical(RecordDataType::F64);
    fields.push((N::SphericalInvalidState, STATE));
    let points: [&[f64]; 5] = [
        &[2.0, 0.0, 0.0, 0.0],
        &[3.0, FRAC_PI_2, 0.0, 0.0],
        &[4.0, 1.0, FRAC_PI_2, 0.0],
        &[0.0, 1.0, 1.0, 1.0],
        &[0.0, 0.0, 0.0, 2.0],
    ];
    let found = read(file(&fields, &points, None)).unwrap();
    let expected = [2.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 4.0];
    let places = column(&found, 0, "position");
    assert_eq!(places.len(), 9);
    assert!(places.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{places:?}");
    assert!(found.clouds[0].header.scanner.is_some() && found.clouds[0].header.rows == Some(5));
    assert_eq!(
        found.warnings,
        ["2 points that the file marks as invalid are left out, 1 of them with a direction alone"]
    );
}

#[test]
fn places_that_are_invalid_are_taken_from_the_other_coordinates() {
    let mut fields = cartesian(RecordDataType::F32);
    fields.extend(spherical(RecordDataType::F32));
    fields.extend([(N::CartesianInvalidState, STATE), (N::SphericalInvalidState, STATE)]);
    fields.push((N::Intensity, RecordDataType::U16));
    let points: [&[f64]; 4] = [
        &[1.0, 2.0, 3.0, 9.0, 0.0, 0.0, 0.0, 0.0, 10.0],
        &[1.0, 2.0, 3.0, 5.0, 0.0, 0.0, 2.0, 0.0, 11.0],
        &[1.0, 2.0, 3.0, 5.0, 0.0, 0.0, 1.0, 2.0, 12.0],
        &[4.0, 5.0, 6.0, 5.0, 0.0, 0.0, 0.0, 2.0, 13.0],
    ];
    let found = read(file(&fields, &points, None)).unwrap();
    assert_eq!(column(&found, 0, "position"), [1.0, 2.0, 3.0, 5.0, 0.0, 0.0, 4.0, 5.0, 6.0]);
    assert_eq!(column(&found, 0, "intensity"), [10.0, 11.0, 13.0]);
    // States that some programs store as floats.
    let mut fields = cartesian(RecordDataType::F32);
    fields.push((N::ReturnIndex, RecordDataType::U8));
    fields.push((N::ReturnCount, RecordDataType::U8));
    let found = read(file(&fields, &[&[1.0, 2.0, 3.0, 255.0, 4.0]], None)).unwrap();
    assert_eq!(column(&found, 0, "return_number"), [256.0]);
    assert_eq!(found.clouds[0].header.columns[1].element.name(), "u16");
}

#[test]
fn colours_are_scaled_and_invalid_values_replaced() {
    let twelve = RecordDataType::Integer { min: 0, max: 4095 };
    let mut fields = cartesian(RecordDataType::F64);
    fields.extend([N::ColorRed, N::ColorGreen, N::ColorBlue].map(|name| (name, twelve.clone())));
    fields.push((N::IsColorInvalid, FLAG));
    fields.extend([(N::Intensity, RecordDataType::F32), (N::IsIntensityInvalid, FLAG)]);
    fields.extend([(N::TimeStamp, RecordDataType::F64), (N::IsTimeStampInvalid, FLAG)]);
    let points: [&[f64]; 2] = [
        &[1.0, 2.0, 3.0, 0.0, 4095.0, 2048.0, 0.0, 0.5, 1.0, 7.5, 0.0],
        &[1.0, 2.0, 3.0, 0.0, 4095.0, 2048.0, 1.0, 0.5, 0.0, 7.5, 1.0],
    ];
    let found = read(file(&fields, &points, None)).unwrap();
    let grey = 48192.0;
    assert_eq!(column(&found, 0, "color"), [0.0, 65535.0, 32776.0, grey, grey, grey]);
    assert_eq!(column(&found, 0, "intensity"), [0.0, 0.5]);
    assert_eq!(column(&found, 0, "time_stamp"), [7.5, 0.0]);
    assert_eq!(found.warnings.len(), 2, "{:?}", found.warnings);
    assert!(
        found.warnings[0].starts_with("1 colours") && found.warnings[1].starts_with("2 values")
    );
}

#[test]
fn limits_of_the_file_say_what_white_is() {
    let mut fields = cartesian(RecordDataType::F64);
    let names = [N::ColorRed, N::ColorGreen, N::ColorBlue];
    fields.extend(names.map(|name| (name, RecordDataType::U16)));
    let limit = |value| Some(RecordValue::Integer(value));
    let limits = |max| ColorLimits {
        red_min: limit(0),
        red_max: limit(max),
        green_min: limit(0),
        green_max: limit(max),
        blue_min: limit(0),
        blue_max: limit(max),
    };
    let point: [&[f64]; 1] = [&[1.0, 2.0, 3.0, 0.0, 100.0, 255.0]];
    let found = read(file(&fields, &point, Some(limits(255)))).unwrap();
    assert_eq!(column(&found, 0, "color"), [0.0, 100.0, 255.0]);
    assert_eq!(found.clouds[0].header.columns[1].element.name(), "u8");
    let found = read(file(&fields, &point, Some(limits(1023)))).unwrap();
    assert_eq!(column(&found, 0, "color"), [0.0, 6406.0, 16336.0]);
}

#[test]
fn numbers_without_bounds_are_read() {
    // The crate cannot write all of what it reads.
    let wide = RecordDataType::Integer { min: -(1 << 62), max: 1 << 62 };
    let steps = RecordDataType::ScaledInteger { min: -5000, max: 5000, scale: 0.25, offset: 1e6 };
    let mut fields = cartesian(steps);
    fields.extend([(N::RowIndex, wide.clone()), (N::ColumnIndex, wide.clone())]);
    fields.push((N::Intensity, wide));
    let points: [&[f64]; 2] =
        [&[-5000.0, 0.0, 5000.0, 3.0, -1.0, 1e15], &[1.0, 2.0, 3.0, 4.0, 5e9, -7.0]];
    let found = read(file(&fields, &points, None)).unwrap();
    let places = column(&found, 0, "position");
    assert_eq!(places[..3], [998_750.0, 1e6, 1_001_250.0]);
    assert_eq!(column(&found, 0, "row_index"), [3.0, 4.0]);
    assert_eq!(column(&found, 0, "column_index"), [0.0, f64::from(u32::MAX)]);
    assert_eq!(column(&found, 0, "intensity"), [1e15, -7.0]);
    assert!(found.warnings[0].starts_with("2 whole numbers"), "{:?}", found.warnings);
    assert_eq!(found.clouds[0].header.step.unwrap().x, 0.25);
}

#[test]
fn scans_of_a_file_have_their_own_poses_and_names() {
    let mut file = io::Cursor::new(Vec::new());
    let mut writer = E57Writer::new(&mut file, "file").unwrap();
    for number in 1..=3 {
        let xyz = [Record::CARTESIAN_X_F32, Record::CARTESIAN_Y_F32, Record::CARTESIAN_Z_F32];
        let mut scan = writer.add_pointcloud("scan", xyz.to_vec()).unwrap();
        let half = 0.5f64.sqrt();
        scan.set_transform(Some(Transform {
            rotation: Quaternion { w: half, x: 0.0, y: 0.0, z: half },
            translation: Translation { x: f64::from(number), y: 0.0, z: 0.0 },
        }));
        scan.set_name(Some(format!("scan {number}")));
        scan.set_sensor_serial(Some("0815".to_owned()));
        for i in 0..200_000 {
            let value = RecordValue::Single(i as f32);
            scan.add_point(vec![value.clone(), value.clone(), value]).unwrap();
        }
        scan.finalize().unwrap();
    }
    writer.finalize().unwrap();
    drop(writer);
    let found = read(file.into_inner()).unwrap();
    assert_eq!(found.clouds.len(), 3);
    for (cloud, number) in found.clouds.iter().zip(1..) {
        assert_eq!(cloud.header.name, format!("scan {number}"));
        // A quarter turn about z.
        let moved = cloud.header.pose.rotation * surfelshop_api::glam::DVec3::X;
        assert!((moved.y - 1.0).abs() < 1e-12);
        assert_eq!(cloud.header.pose.translation.x, f64::from(number));
        assert_eq!(cloud.columns[0].len(), 600_000);
        let places = cloud.columns[0].chunks(3).enumerate();
        assert!(places.into_iter().all(|(i, place)| place == [i as f64; 3]));
        assert!(cloud.header.comments.contains(&"sensor serial number: 0815".to_owned()));
    }
}
