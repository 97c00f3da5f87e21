use super::pulses::MOST;
use super::*;
use crate::assemble::sides::{Scanners, face_scanners};
use crate::cloud::buffer::Buffer;
use crate::cloud::source::Source;
use crate::options::ReadOptions;
use crate::summary::Summary;
use crate::table::Field;
use glam::Vec3;
use surfelshop_api::format::{N_RETURNS, POINT_SOURCE, RETURN_NUMBER};

/// Pulses of a laser at 1000 Hz.
const RATE: f64 = 1000.0;
const FLIGHT: DVec3 = DVec3::new(50.0, 10.0, -2.0);
const ABOVE: DVec3 = DVec3::new(-150.0, 400.0, 900.0);

/// A number in [0, 1) that follows from another: the fractional parts of multiples of the golden ratio.
fn unit(number: usize, of: usize) -> f64 {
    ((number * 7 + of * 31) as f64 * 0.618_033_988_749_895).fract()
}

/// What a scanner sees that flies over trees on a plane: rows of (device, time, number, count, place), to the
/// centimetre.
fn flown(device: u16, seconds: f64, back: bool) -> Vec<(u16, f64, u8, u8, DVec3)> {
    let mut rows = Vec::new();
    for i in 0..(seconds * RATE) as usize {
        let time = i as f64 / RATE;
        let sense = if back { -1.0 } else { 1.0 };
        let eye = ABOVE * DVec3::new(sense, 1.0, 1.0) + FLIGHT * DVec3::new(sense, 1.0, 1.0) * time;
        let sweep = 0.3 * (time * 60.0).sin();
        let ray = DVec3::new(0.05 * (time * 97.0).sin(), sweep - 0.2, -1.0);
        let rounded = |place: DVec3| (place * 100.0).round() / 100.0;
        let hit = |height: f64| rounded(eye + ray * (eye.z - height));
        let high = 3.0 + 17.0 * unit(i, 1);
        match unit(i, 0) {
            few if few < 0.1 => {
                rows.push((device, 300_000.0 + time, 1, 2, hit(high)));
                rows.push((device, 300_000.0 + time, 2, 2, hit(0.0)));
            }
            _ => rows.push((device, 300_000.0 + time, 1, 1, hit(0.0))),
        }
    }
    rows
}

fn table(rows: &[(u16, f64, u8, u8, DVec3)]) -> (Table, Positions) {
    let field = |name: &str, values| Field { names: vec![name.to_owned()], values };
    let fields = vec![
        field(POINT_SOURCE, Buffer::U16(rows.iter().map(|row| row.0).collect())),
        field(GPS_TIME, Buffer::F64(rows.iter().map(|row| row.1).collect())),
        field(RETURN_NUMBER, Buffer::U8(rows.iter().map(|row| row.2).collect())),
        field(N_RETURNS, Buffer::U8(rows.iter().map(|row| row.3).collect())),
    ];
    let positions: Vec<Vec3> = rows.iter().map(|row| row.4.as_vec3()).collect();
    let table = Table { n_rows: rows.len(), fields, ..Table::default() };
    (table, Positions { origin: DVec3::ZERO, positions, bounds: None })
}

/// Costs 40 ms.
#[test]
fn the_path_of_a_scanner_follows_from_returns() {
    // Two flights, one after the other in the file and at the same time, and their points in no order.
    let mut rows = flown(7, 10.0, false);
    rows.extend(flown(9, 10.0, true));
    let n = rows.len();
    let shuffled: Vec<_> = (0..n).map(|i| rows[i * 7919 % n]).collect();
    assert!(!n.is_multiple_of(7919));
    let (table, placed) = table(&shuffled);
    let trajectory = Trajectory::of(&table, &placed).unwrap();
    assert!((1900..2100).contains(&trajectory.facts.n_pulses), "{:?}", trajectory.facts);
    assert!((6..=20).contains(&trajectory.facts.n_pieces), "{:?}", trajectory.facts);
    let mut worst = 0.0f64;
    for (row, place) in shuffled.iter().zip(trajectory.places(&table)) {
        let sense = DVec3::new(if row.0 == 7 { 1.0 } else { -1.0 }, 1.0, 1.0);
        let truth = (ABOVE + FLIGHT * (row.1 - 300_000.0)) * sense;
        worst = worst.max(place.unwrap().distance(truth));
    }
    // Centimetres over 10 m are a metre over 900 m; of the two hundred rays of a piece a tenth of that is left
    // across them, and along them that over the tangent of half their sweep, 0.3.
    assert!(worst < 2.0, "{worst}");
}

#[test]
fn rays_that_do_not_meet_tell_no_path() {
    let rows = flown(7, 4.0, false);
    // Each pulse has its second return somewhere else.
    let n = rows.len();
    let mut torn = rows.clone();
    for (i, row) in torn.iter_mut().enumerate() {
        if row.2 == 2 {
            row.4 = DVec3::new(300.0 * unit(i, 3), 300.0 * unit(i, 4), -20.0 * unit(i, 5));
        }
    }
    let (of_torn, placed) = table(&torn);
    assert!(Trajectory::of(&of_torn, &placed).is_none());
    // One return a pulse.
    let single: Vec<_> = rows.iter().copied().filter(|row| row.2 == 1).collect();
    let (of_single, placed) = table(&single);
    assert!(Trajectory::of(&of_single, &placed).is_none());
    // Rays that are parallel meet nowhere.
    let mut parallel = rows.clone();
    for i in 1..n {
        if parallel[i].2 == 2 {
            parallel[i].4 = parallel[i - 1].4 - DVec3::Z * 10.0;
        }
    }
    let (of_parallel, placed) = table(&parallel);
    assert!(Trajectory::of(&of_parallel, &placed).is_none());
    // Times that are no numbers, and none at all.
    let timeless: Vec<_> = rows.iter().map(|row| (row.0, f64::NAN, row.2, row.3, row.4)).collect();
    let (of_timeless, placed) = table(&timeless);
    assert!(Trajectory::of(&of_timeless, &placed).is_none());
    // Numbers that are none.
    let (mut numberless, placed) = table(&rows);
    for field in &mut numberless.fields {
        let numbers = (0..n).map(|i| if i % 3 == 0 { f64::NAN } else { (i % 5) as f64 }).collect();
        field.values = Buffer::F64(numbers);
    }
    assert!(Trajectory::of(&numberless, &placed).is_none());
    // More points of one time than are looked at.
    let many: Vec<_> =
        (0..MOST + 100_000).map(|i| (7, 0.0, i as u8 % 2 + 1, 2, rows[i % n].4)).collect();
    let (of_many, placed) = table(&many);
    assert!(Trajectory::of(&of_many, &placed).is_none());
    let (empty, placed) = table(&[]);
    assert!(Trajectory::of(&empty, &placed).is_none());
}

#[test]
fn a_path_ends_where_its_pulses_end() {
    let rows = flown(7, 3.0, false);
    let (of_rows, placed) = table(&rows);
    let trajectory = Trajectory::of(&of_rows, &placed).unwrap();
    let device = devices(&of_rows).next().unwrap();
    assert!(trajectory.at(device, 300_003.5).is_some());
    assert!(trajectory.at(device, 300_005.0).is_none());
    assert!(trajectory.at(device, 299_990.0).is_none());
    assert!(trajectory.at(device, f64::NAN).is_none());
    let (of_others, _) = table(&flown(8, 0.01, false));
    let other = devices(&of_others).next().unwrap();
    assert!(trajectory.at(other, 300_001.0).is_none());
}

/// Costs 0.3 s.
#[test]
fn surfaces_face_the_path_of_their_scanner() {
    let rows = flown(7, 6.0, false);
    let (mut table, _) = table(&rows);
    let coordinates = rows.iter().flat_map(|row| row.4.to_array()).collect();
    let names = ["x", "y", "z"].map(str::to_owned).to_vec();
    table.fields.push(Field { names, values: Buffer::F64(coordinates) });
    let loaded = crate::assemble::cloud(table, Source::default(), &ReadOptions::default()).unwrap();
    let summary = &loaded.summary;
    assert!(summary.trajectory.is_some());
    let counts = &summary.normals;
    let sides = counts.towards_scanner + counts.towards_free_space + counts.of_unsure_side;
    assert_eq!(sides, rows.len() as u64);
    assert!(counts.towards_scanner > 9 * sides / 10, "{counts:?}");
    let grounds = loaded.cloud.normals().iter().zip(&rows).filter(|(_, row)| row.4.z == 0.0);
    assert!(grounds.into_iter().all(|(normal, _)| normal.z > 0.0));
}

#[test]
fn what_is_no_surface_keeps_its_side() {
    let rows = flown(7, 3.0, false);
    let (table, placed) = table(&rows);
    let scanners = Scanners::Moving(Trajectory::of(&table, &placed).unwrap());
    let mut normals = vec![Vec3::NEG_Z; rows.len()];
    let planarity: Vec<f32> = (0..rows.len()).map(|i| (i % 2) as f32).collect();
    // All were of unsure side.
    let seen = vec![0.0; rows.len()];
    let mut summary = Summary::default();
    summary.normals.of_unsure_side = rows.len() as u64;
    face_scanners(&table, &placed, &scanners, &planarity, &seen, &mut normals, &mut summary);
    for (i, normal) in normals.iter().enumerate() {
        assert_eq!(normal.z > 0.0, i % 2 == 1);
    }
    let counts = summary.normals;
    assert_eq!(counts.towards_scanner, rows.len() as u64 / 2);
    assert_eq!(counts.turned, counts.towards_scanner);
    assert_eq!(counts.of_unsure_side + counts.towards_scanner, rows.len() as u64);
}
