//! Columns that are written come back: names, types and values, or a line says which do not. Costs 2 s.

use crate::formats::stage::{Files, places, values};
use glam::DVec3;
use surfelshop_api::columns::{AO, COLOR, NORMAL, POSITION, RADIUS, TANGENT_U, TANGENT_V};
use surfelshop_api::format::{
    CLASSIFICATION, GPS_TIME, INTENSITY, N_RETURNS, POINT_SOURCE, RETURN_NUMBER, SCAN_ANGLE,
};
use surfelshop_cloud::{Buffer, Cloud, Column, Written};

/// Points of the clouds: more than one batch, and no whole number of them.
const POINTS: usize = (1 << 16) + 1000;

/// A name for every format of this project that is written.
const NAMES: [&str; 10] =
    ["a.ply", "a.las", "a.laz", "a.e57", "a.pcd", "a.xyz", "a.csv", "a.pts", "a.ptx", "a.sfl"];

fn floats(components: usize, value: impl Fn(usize) -> f32) -> Buffer {
    Buffer::F32((0..components * POINTS).map(value).collect())
}

/// A wavy sheet far from zero, whose coordinates have few digits in decimal and binary, with normals and
/// radii, so that nothing is estimated.
fn sheet() -> Cloud {
    let place = |i: usize| {
        let (x, y) = ((i % 256) as f32, (i / 256) as f32);
        [0.25 * x, 0.25 * y, ((i * 13) % 64) as f32 / 64.0]
    };
    let positions = Buffer::F32((0..POINTS).flat_map(place).collect());
    let normals = [[0.6, 0.0, 0.8], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]];
    let normals = Buffer::F32((0..POINTS).flat_map(|i| normals[i % 3]).collect());
    let columns = vec![
        Column::new(POSITION, 3, positions),
        Column::new(NORMAL, 3, normals),
        Column::new(RADIUS, 1, floats(1, |i| 0.125 + (i % 4) as f32 / 64.0)),
    ];
    Cloud::new(DVec3::new(1000.0, -2000.0, 64.0), columns).unwrap()
}

/// The columns that formats know, in the types that scanners have.
fn known_columns() -> Vec<Column> {
    let of = |name: &str, values| Column::new(name, 1, values);
    vec![
        Column::new(COLOR, 3, Buffer::U8((0..3 * POINTS).map(|i| (i * 7 % 251) as u8).collect())),
        of(INTENSITY, Buffer::U16((0..POINTS).map(|i| (i * 61 % 4096) as u16).collect())),
        of(CLASSIFICATION, Buffer::U8((0..POINTS).map(|i| (i % 32) as u8).collect())),
        of(RETURN_NUMBER, Buffer::U8((0..POINTS).map(|i| 1 + (i % 3) as u8).collect())),
        of(N_RETURNS, Buffer::U8(vec![3; POINTS])),
        of(SCAN_ANGLE, floats(1, |i| (i % 61) as f32 - 30.0)),
        of(GPS_TIME, Buffer::F64((0..POINTS).map(|i| 3e5 + i as f64 / 1024.0).collect())),
        of(POINT_SOURCE, Buffer::U16((0..POINTS).map(|i| (i % 5) as u16).collect())),
    ]
}

/// A column of every type, of names that no format knows, and one of several components.
fn foreign_columns() -> Vec<Column> {
    let (i, u) = (|i: usize| i as i64 % 200 - 100, |i: usize| i as u64 * 7919 % 4_000_000_000);
    let n = 0..POINTS;
    vec![
        Column::new("a_i8", 1, Buffer::I8(n.clone().map(|k| i(k) as i8).collect())),
        Column::new("a_u8", 1, Buffer::U8(n.clone().map(|k| u(k) as u8).collect())),
        Column::new("a_i16", 1, Buffer::I16(n.clone().map(|k| (300 * i(k)) as i16).collect())),
        Column::new("a_u16", 1, Buffer::U16(n.clone().map(|k| u(k) as u16).collect())),
        Column::new("a_i32", 1, Buffer::I32(n.clone().map(|k| (i(k) << 20) as i32).collect())),
        Column::new("a_u32", 1, Buffer::U32(n.clone().map(|k| u(k) as u32).collect())),
        Column::new("a_f32", 1, floats(1, |k| (k as f32).sqrt())),
        Column::new("a_f64", 1, Buffer::F64(n.map(|k| (k as f64).sqrt() * 1e10).collect())),
        Column::new("several", 3, floats(3, |k| k as f32 * 0.5)),
    ]
}

/// The columns of surfels.
fn surfel_columns() -> Vec<Column> {
    let tangents = |axis: usize| floats(3, move |i| if i % 3 == axis { 0.125 } else { 0.0 });
    vec![
        Column::new(COLOR, 4, Buffer::U8((0..4 * POINTS).map(|i| (i % 256) as u8).collect())),
        Column::new(TANGENT_U, 3, tangents(0)),
        Column::new(TANGENT_V, 3, tangents(1)),
        Column::new(AO, 1, floats(1, |i| (i % 129) as f32 / 128.0)),
    ]
}

/// What of a column did not come back; nothing where it is the same.
fn difference(column: &Column, again: &Cloud) -> Option<String> {
    let Some(found) = again.column(column.name()) else { return Some("is missing".to_owned()) };
    let shape = |c: &Column| format!("{} x {}", c.components(), c.values().element().name());
    if shape(found) != shape(column) {
        return Some(format!("was {}, is {}", shape(column), shape(found)));
    }
    let (a, b) = (column.values().as_values(), found.values().as_values());
    let bits = |value: f64| value.to_bits();
    let other = a.iter_f64().zip(b.iter_f64()).position(|(a, b)| bits(a) != bits(b));
    other.map(|place| format!("value {place} differs"))
}

/// Writes and reads a cloud, and expects of every column to be the same or to be named in a line. Returns the
/// names of those that are not the same.
#[track_caller]
fn assert_comes_back(name: &str, cloud: &Cloud) -> Vec<String> {
    let files = Files::new();
    let Written { lost } = files.write(name, cloud);
    let loaded = files.read(name);
    let again = &loaded.cloud;
    assert_eq!(again.len(), cloud.len(), "{name}");
    let pairs = places(cloud).into_iter().zip(places(again));
    let off = pairs.map(|(a, b)| a.distance(b)).fold(0.0, f64::max);
    // Coordinates are multiples of a 64th.
    assert!(
        off == 0.0 || off < 1e-3 && says(&lost, POSITION),
        "{name}: places off by {off}: {lost:?}"
    );
    let (mut changed, mut unsaid) = (Vec::new(), Vec::new());
    for column in cloud.columns().iter().filter(|column| column.name() != POSITION) {
        let Some(what) = difference(column, again) else { continue };
        let column = column.name();
        if !says(&lost, column) {
            unsaid.push(format!("`{column}` {what}"));
        }
        changed.push(column.to_owned());
    }
    assert!(unsaid.is_empty(), "{name}: {unsaid:#?}, and no line says so: {lost:#?}");
    changed
}

/// Whether a line names a column.
fn says(lost: &[String], column: &str) -> bool {
    lost.iter().any(|line| line.contains(column))
}

/// Invariant: a column that is written comes back with its name, type and values, or a line names it
#[test]
fn columns_come_back_or_a_line_names_them() {
    let sets = [known_columns(), foreign_columns(), surfel_columns()];
    let clouds = sets.map(|columns| sheet().with_columns(columns).unwrap());
    for name in NAMES {
        let changed = clouds.each_ref().map(|cloud| assert_comes_back(name, cloud));
        println!("{name}: changed {changed:?}");
        // What each format is there for.
        let keeps: &[&str] = match name {
            "a.ply" | "a.pcd" => {
                &[NORMAL, RADIUS, COLOR, INTENSITY, GPS_TIME, "a_i16", "a_f64", "several"]
            }
            // Colours of LAS have 16 bits.
            "a.las" | "a.laz" => {
                &[NORMAL, RADIUS, INTENSITY, GPS_TIME, "a_i16", "a_f64", "several"]
            }
            "a.e57" => &[NORMAL, RADIUS, COLOR, INTENSITY, "a_f64"],
            "a.sfl" => &[RADIUS, COLOR, TANGENT_U, TANGENT_V],
            _ => &[COLOR],
        };
        // Neither has a place for the opacity of the surfels' colours.
        let n = if ["a.pts", "a.ptx"].contains(&name) { 2 } else { 3 };
        for column in keeps {
            assert!(
                !changed[..n].iter().flatten().any(|c| c == column),
                "{name} changes `{column}`"
            );
        }
    }
}

#[test]
fn clouds_of_no_point_and_of_one_come_back() {
    let all = sheet().with_columns(known_columns()).unwrap();
    for n in [0, 1] {
        let mask: Vec<bool> = (0..POINTS).map(|i| i < n).collect();
        let few = all.keep(&mask).unwrap();
        for name in NAMES {
            let files = Files::new();
            files.write(name, &few);
            let again = files.read(name).cloud;
            assert_eq!(again.len(), n, "{name}");
            if n == 1 {
                // Colours of LAS have 16 bits.
                match name {
                    "a.las" | "a.laz" => assert_eq!(again.linear_colors(), few.linear_colors()),
                    _ => assert_eq!(values(&again, COLOR), values(&few, COLOR), "{name}"),
                }
            }
        }
    }
}
