//! `boolean`, against shapes whose seams are known.

use super::shapes::{TemporaryFile, cuboid, ply_text};
use super::*;
use crate::boolean::{Boolean, Operation, Settings};
use std::sync::atomic::{AtomicUsize, Ordering};

/// A surfel of a result.
struct Piece {
    place: DVec3,
    normal: DVec3,
    axes: [DVec3; 2],
    lines: Vec<f64>,
}

impl Piece {
    /// Whether a place in its plane, in units of the half axes, is there.
    fn covers(&self, u: f64, v: f64) -> bool {
        let side =
            |at: usize| self.lines[at] * u + self.lines[at + 1] * v + self.lines[at + 2] >= 0.0;
        u * u + v * v <= 1.0
            && match self.lines[6].round() as i32 {
                0 => true,
                1 => side(0) && side(3),
                _ => side(0) || side(3),
            }
    }

    fn at(&self, u: f64, v: f64) -> DVec3 {
        self.place + u * self.axes[0] + v * self.axes[1]
    }

    /// Distance at which a ray meets it.
    fn meets(&self, from: DVec3, along: DVec3) -> Option<f64> {
        let far = self.normal.dot(self.place - from) / self.normal.dot(along);
        let offset = from + far * along - self.place;
        let [u, v] = self.axes.map(|axis| offset.dot(axis) / axis.length_squared());
        (far > 0.0 && self.covers(u, v)).then_some(far)
    }
}

fn pieces(ran: &ToolOutput) -> Vec<Piece> {
    let (us, vs) = (ran.vectors("tangent_u"), ran.vectors("tangent_v"));
    let lines = ran.floats("clip");
    let places = ran.vectors(POSITION).into_iter().zip(ran.vectors(NORMAL)).enumerate();
    places
        .map(|(i, (place, normal))| Piece {
            place: place.as_dvec3(),
            normal: normal.as_dvec3(),
            axes: [us[i].as_dvec3(), vs[i].as_dvec3()],
            lines: lines[7 * i..7 * i + 7].iter().map(|&line| f64::from(line)).collect(),
        })
        .collect()
}

/// A unit sphere and the box from (0, -0.6, -0.6) to (2, 0.6, 0.6).
const MIN: DVec3 = DVec3::new(0.0, -0.6, -0.6);
const MAX: DVec3 = DVec3::new(2.0, 0.6, 0.6);
const STEP: f32 = 0.04;

fn operated(operation: Operation) -> (ToolOutput, Vec<Piece>) {
    let block = cuboid(MIN.as_vec3(), MAX.as_vec3(), STEP);
    let file =
        TemporaryFile::new(&format!("{operation:?}.ply"), ply_text(&block, false).as_bytes());
    let params = Settings { with: file.path(), operation };
    let ran = run::<Boolean>(&ball(8000), &params).unwrap();
    let pieces = pieces(&ran);
    (ran, pieces)
}

/// Distance to the box's surface, below 0 inside.
fn to_box(p: DVec3) -> f64 {
    let q = (p - 0.5 * (MIN + MAX)).abs() - 0.5 * (MAX - MIN);
    q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
}

fn to_ball(p: DVec3) -> f64 {
    p.length() - 1.0
}

/// Distance to the result's surface, as of sums of solids, exact near the surface but for corners.
fn to_result(operation: Operation, p: DVec3) -> f64 {
    match operation {
        Operation::Union => to_ball(p).min(to_box(p)),
        Operation::Intersection => to_ball(p).max(to_box(p)),
        Operation::Difference => to_ball(p).max(-to_box(p)),
    }
}

const ALL: [Operation; 3] = [Operation::Union, Operation::Intersection, Operation::Difference];

#[test]
fn what_stays_lies_on_the_surface_of_the_result() {
    for operation in ALL {
        let (ran, pieces) = operated(operation);
        let mut worst: f64 = 0.0;
        for piece in &pieces {
            for i in 0..400 {
                let (u, v) = (f64::from(i % 20) / 9.5 - 1.0, f64::from(i / 20) / 9.5 - 1.0);
                if piece.covers(u, v) {
                    worst = worst.max(to_result(operation, piece.at(u, v)).abs());
                }
            }
        }
        // Flat discs leave the sphere by the square of their radius, cut or not; whole discs at edges of
        // the box stand out as they did before.
        let own = 0.75 * f64::from(STEP);
        assert!(worst < 1.05 * own, "{operation:?}: {worst}, {}", ran.message);
        // Away from the box's own edges nothing stands out.
        let mut seam: f64 = 0.0;
        let (low, high) = (MIN + 0.05, MAX - 0.05);
        for piece in pieces.iter().filter(|piece| piece.lines[6] > 0.5) {
            let p = piece.place;
            let inner = |axis: usize| p[axis] > low[axis] && p[axis] < high[axis];
            if [0, 1, 2].iter().filter(|&&axis| inner(axis)).count() < 2 {
                continue;
            }
            for i in 0..400 {
                let (u, v) = (f64::from(i % 20) / 9.5 - 1.0, f64::from(i / 20) / 9.5 - 1.0);
                if piece.covers(u, v) {
                    seam = seam.max(to_result(operation, piece.at(u, v)).abs());
                }
            }
        }
        assert!(seam < 0.05 * f64::from(STEP), "{operation:?}: {seam} off at the seam");
    }
}

#[test]
fn rays_find_no_hole_and_nothing_inside() {
    for operation in ALL {
        let (_, pieces) = operated(operation);
        // A place inside each result, from where all of its surface can be seen.
        let from = match operation {
            Operation::Union => DVec3::new(0.4, 0.01, 0.02),
            Operation::Intersection => DVec3::new(0.5, 0.01, 0.02),
            Operation::Difference => DVec3::new(-0.5, 0.01, 0.02),
        };
        for direction in sphere(1500) {
            let along = direction.as_dvec3();
            let hits: Vec<f64> =
                pieces.iter().filter_map(|piece| piece.meets(from, along)).collect();
            let nearest = hits.iter().copied().fold(f64::INFINITY, f64::min);
            assert!(nearest.is_finite(), "{operation:?}: a hole towards {along}");
            let off = to_result(operation, from + nearest * along);
            assert!(off > -0.03, "{operation:?}: something inside towards {along}, {off}");
        }
    }
}

/// The volume by the mean cubed distance of what rays from inside meet first.
fn volume(pieces: &[Piece], from: DVec3) -> f64 {
    let directions = sphere(4000);
    let far = |along: DVec3| {
        pieces.iter().filter_map(|piece| piece.meets(from, along)).fold(f64::INFINITY, f64::min)
    };
    let cubes: f64 = directions.iter().map(|d| far(d.as_dvec3()).powi(3)).sum();
    4.0 / 3.0 * std::f64::consts::PI * cubes / 4000.0
}

#[test]
fn volumes_are_those_of_the_shapes() {
    // The part of the ball in the half space x > 0 and the bar |y|, |z| < 0.6, by slices.
    let n = 400;
    let mut common = 0.0;
    for i in 0..n * n {
        let side = |i: usize| 0.6 * ((2 * i + 1) as f64 / n as f64 - 1.0);
        let (y, z) = (side(i % n), side(i / n));
        common += (1.0 - y * y - z * z).max(0.0).sqrt() * (1.2 / n as f64).powi(2);
    }
    let (ball, block) = (4.0 / 3.0 * std::f64::consts::PI, 2.0 * 1.2 * 1.2);
    for (operation, from, expected) in [
        (Operation::Union, DVec3::new(0.4, 0.01, 0.02), ball + block - common),
        (Operation::Intersection, DVec3::new(0.5, 0.01, 0.02), common),
    ] {
        let (_, pieces) = operated(operation);
        let share = volume(&pieces, from) / expected - 1.0;
        assert!(share.abs() < 0.01, "{operation:?}: the volume is off by {share}");
    }
}

#[test]
fn a_shared_face_stays_once() {
    // Two boxes whose tops are in one plane.
    let first = cuboid(Vec3::ZERO, Vec3::ONE, 0.1);
    let second = cuboid(Vec3::new(0.45, 0.25, 0.0), Vec3::new(1.5, 0.75, 1.0), 0.1);
    let file = TemporaryFile::new("shared.ply", ply_text(&second, false).as_bytes());
    let params = Settings { with: file.path(), operation: Operation::Union };
    let joined = pieces(&run::<Boolean>(&first, &params).unwrap());
    for i in 0..900 {
        let (x, y) = (0.06 + 0.9 * f64::from(i % 30) / 30.0, 0.06 + 0.9 * f64::from(i / 30) / 30.0);
        let top = |piece: &&Piece| piece.normal.z > 0.5 && (piece.place.z - 1.0).abs() < 1e-6;
        let from = DVec3::new(x, y, 2.0);
        let of_first = joined.iter().filter(top).any(|p| p.meets(from, -DVec3::Z).is_some());
        assert!(of_first, "a hole at {x} {y}");
    }
    let inside = joined.iter().filter(|piece| {
        let p = piece.place;
        (p.x - 0.5).abs() < 0.4 && (p.y - 0.5).abs() < 0.4 && (p.z - 0.5).abs() < 0.4
    });
    assert_eq!(inside.count(), 0);
    // The one less the other has a notch, lined by faces that look into it.
    let params = Settings { with: file.path(), operation: Operation::Difference };
    let ran = run::<Boolean>(&first, &params).unwrap();
    let lining = pieces(&ran);
    assert!(lining.iter().any(|p| (p.place.x - 0.45).abs() < 1e-6 && p.normal.x > 0.99));
    // What of discs beyond the edges of the box is outside both stays; their middles go.
    let inside = |piece: &&Piece| {
        let p = piece.place;
        p.x > 0.56 && p.y > 0.36 && p.y < 0.64 && piece.covers(0.0, 0.0)
    };
    let left: Vec<DVec3> = lining.iter().filter(inside).map(|piece| piece.place).collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn columns_come_from_both_and_missing_ones_are_told() {
    let mut first = ball(2000);
    first.colors = vec![200; 6000];
    first.others.push(("height", 1, vec![3.0; 2000]));
    first.origin = DVec3::new(1e6, 2e6, -3e5);
    let mut second = ball(2000);
    second.origin = first.origin + DVec3::new(0.7, 0.0, 0.0);
    second.colors = vec![10; 6000];
    let file = TemporaryFile::new("columns.ply", ply_text(&second, true).as_bytes());
    let params = Settings { with: file.path(), operation: Operation::Union };
    let ran = run::<Boolean>(&first, &params).unwrap();
    let names =
        ["position", "normal", "radius", "color", "height", "tangent_u", "tangent_v", "clip"];
    assert_eq!(ran.names(), names);
    assert!(ran.message.ends_with("cut at the seam; the second has no height"), "{}", ran.message);
    let (colors, places) = (ran.bytes("color"), ran.vectors(POSITION));
    for (place, color) in places.iter().zip(colors.chunks_exact(3)) {
        let is_first = color == [200; 3];
        assert!(is_first || color == [10; 3]);
        let middle = if is_first { 0.0 } else { 0.7 };
        assert!(((*place - Vec3::new(middle, 0.0, 0.0)).length() - 1.0).abs() < 1e-5);
    }
    let plain = TemporaryFile::new("plain.ply", ply_text(&second, false).as_bytes());
    let ran = run::<Boolean>(&first, &Settings { with: plain.path(), ..params }).unwrap();
    assert!(ran.message.ends_with("the second has no color, height"), "{}", ran.message);
    assert_eq!(ran.bytes("color").last(), Some(&188));
}

#[test]
fn apart_clouds_are_joined_whole_and_what_makes_no_sense_is_refused() {
    let mut far = ball(500);
    far.origin = DVec3::splat(10.0);
    let file = TemporaryFile::new("far.ply", ply_text(&far, false).as_bytes());
    let with = |operation| Settings { with: file.path(), operation };
    let ran = run::<Boolean>(&ball(400), &with(Operation::Union)).unwrap();
    assert_eq!(ran.names(), ["position", "normal", "radius"]);
    assert_eq!(ran.floats(RADIUS).len(), 900);
    let line = refusal::<Boolean>(&ball(400), &with(Operation::Intersection));
    assert!(line.contains("found nothing in both"), "{line}");
    let ran = run::<Boolean>(&ball(400), &with(Operation::Difference)).unwrap();
    assert_eq!(ran.floats(RADIUS).len(), 400);
    assert!(refusal::<Boolean>(&ball(400), &Settings::default()).contains("found no file"));
    // Half a ball is not closed.
    let mut half = ball(400);
    half.positions.truncate(600);
    half.normals.truncate(600);
    half.radii.truncate(200);
    let line = refusal::<Boolean>(&half, &with(Operation::Union));
    assert!(line.starts_with("the first cloud: expected a closed cloud"), "{line}");
    let open = TemporaryFile::new("open.ply", ply_text(&half, false).as_bytes());
    let params = Settings { with: open.path(), operation: Operation::Union };
    let line = refusal::<Boolean>(&ball(400), &params);
    assert!(line.contains("open.ply: expected a closed cloud"), "{line}");
    stops_everywhere::<Boolean>(&ball(100), &with(Operation::Union));
}

/// An ellipsoid, of which each half axis is that of `size`, scene units.
fn ellipsoid(n: u32, size: Vec3) -> TestCloud {
    let directions = sphere(n);
    let positions: Vec<Vec3> = directions.iter().map(|d| *d * size).collect();
    let normals: Vec<Vec3> = directions.iter().map(|d| (*d / size).normalize_or_zero()).collect();
    let area = 4.0 * std::f32::consts::PI * (size.x * size.y * size.z).powf(2.0 / 3.0);
    TestCloud::new(&positions, &normals, (area / n as f32).sqrt())
}

/// A torus around z with radii of 1 and 0.4, on a lattice.
fn torus(n: u32) -> TestCloud {
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    for i in 0..n {
        let round = std::f64::consts::TAU;
        let (u, v) = (round * golden * f64::from(i), round * (f64::from(i) + 0.5) / f64::from(n));
        let outward = DVec3::new(u.cos(), u.sin(), 0.0);
        let normal = v.cos() * outward + v.sin() * DVec3::Z;
        positions.push((outward + 0.4 * normal).as_vec3());
        normals.push(normal.as_vec3());
    }
    let area = std::f32::consts::TAU.powi(2) * 0.4;
    TestCloud::new(&positions, &normals, (area / n as f32).sqrt())
}

/// Surfels of the first cloud and of the second that each operation leaves, and how many are cut.
fn counts(first: &TestCloud, second: &TestCloud) -> [[usize; 3]; 3] {
    // Tests run side by side.
    static USED: AtomicUsize = AtomicUsize::new(0);
    let name = format!("counts-{}.ply", USED.fetch_add(1, Ordering::Relaxed));
    let file = TemporaryFile::new(&name, ply_text(second, false).as_bytes());
    ALL.map(|operation| match run::<Boolean>(first, &Settings { with: file.path(), operation }) {
        Ok(ran) => {
            let words = ran.message.split(' ').filter_map(|word| word.parse().ok());
            let numbers: Vec<usize> = words.collect();
            [numbers[1], numbers[2], numbers[3]]
        }
        Err(error) => {
            let said = error.to_string();
            assert!(said.contains("found the first cloud inside the second"), "{said}");
            [0; 3]
        }
    })
}

const SIZE: Vec3 = Vec3::new(1.0, 0.7, 0.4);

/// About 1 s.
#[test]
fn a_cloud_with_itself_stays_once_and_less_itself_is_nothing() {
    // Also a plate as thin as a surfel, and few surfels across each bend.
    let plate = cuboid(Vec3::ZERO, Vec3::new(1.0, 1.0, 0.05), 0.05);
    let cube = cuboid(Vec3::ZERO, Vec3::ONE, 0.04);
    for cloud in [cube, plate, ellipsoid(500, SIZE), torus(600)] {
        for (origin, scale) in [(0.0, 1.0), (1e6, 1.0), (0.0, 1e-6)] {
            let mut cloud = cloud.clone();
            cloud.origin = DVec3::splat(origin);
            cloud.positions.iter_mut().chain(&mut cloud.radii).for_each(|number| *number *= scale);
            let n = cloud.radii.len();
            assert_eq!(counts(&cloud, &cloud), [[n, 0, 0], [n, 0, 0], [0; 3]], "{origin} {scale}");
            // A copy whose places are off by a few roundings of `f32`.
            let mut copy = cloud.clone();
            copy.positions.iter_mut().for_each(|x| *x *= 1.000_000_5);
            assert_eq!(counts(&cloud, &copy), [[n, 0, 0], [n, 0, 0], [0; 3]], "{origin} {scale}");
        }
    }
}

/// About 1.9 s.
#[test]
fn two_samplings_of_a_surface_are_one() {
    let cube = |step| cuboid(Vec3::ZERO, Vec3::ONE, step);
    let ellipsoid = |n| ellipsoid(n, SIZE);
    for (name, dense, sparse) in [
        ("box", cube(0.1), cube(0.14)),
        ("box", cube(0.1), cube(0.23)),
        ("ellipsoid", ellipsoid(700), ellipsoid(500)),
        ("ellipsoid", ellipsoid(1600), ellipsoid(400)),
        ("torus", torus(1000), torus(900)),
    ] {
        for (first, second) in [(&dense, &sparse), (&sparse, &dense)] {
            let (n, n_second) = (first.radii.len(), second.radii.len());
            let [union, intersection, difference] = counts(first, second);
            let said = format!("{name} {n} {n_second}: {union:?} {intersection:?} {difference:?}");
            let few = |n: usize| n / 100;
            for [of_first, of_second, n_cut] in [union, intersection] {
                assert!(of_first >= n - few(n) && of_second <= few(n_second), "{said}");
                assert!(n_cut <= few(n + n_second), "{said}");
            }
            assert!(difference[0] <= few(n) && difference[1] <= few(n_second), "{said}");
        }
    }
}

/// A thinned cloud has some of the surfels, with wider discs.
#[test]
fn a_thinned_copy_is_the_same_surface() {
    let noisy = |mut cloud: TestCloud| {
        // Normals as of scans, which no fit agrees with.
        for (i, x) in cloud.normals.iter_mut().enumerate() {
            *x += 0.1 * noise(i as u64) as f32;
        }
        cloud
    };
    let cloud = noisy(torus(3000));
    let mut thin = TestCloud::default();
    for i in (0..3000).filter(|i| scattered(*i as u64).is_multiple_of(3)) {
        thin.positions.extend(&cloud.positions[3 * i..3 * i + 3]);
        thin.normals.extend(&cloud.normals[3 * i..3 * i + 3]);
        thin.radii.push(1.8 * cloud.radii[i]);
    }
    let n = thin.radii.len();
    let [union, intersection, difference] = counts(&cloud, &thin);
    let said = format!("{n}: {union:?} {intersection:?} {difference:?}");
    assert!(union[0] >= 2970 && intersection[0] >= 2970 && difference[0] <= 30, "{said}");
    assert_eq!([union[1], intersection[1], difference[1]], [0; 3], "{said}");
}

/// About 1.5 s.
#[test]
fn surfaces_that_are_a_third_of_a_spacing_apart_are_told_apart() {
    // The outer of two shells is all of what is in either.
    for cloud in [ellipsoid(3000, SIZE), torus(3000)] {
        let mut outer = cloud.clone();
        for (x, n) in outer.positions.iter_mut().zip(&cloud.normals) {
            *x += 0.3 * cloud.radii[0] * n;
        }
        let n = cloud.radii.len();
        assert_eq!(counts(&cloud, &outer), [[0, n, 0], [n, 0, 0], [0; 3]]);
        assert_eq!(counts(&outer, &cloud), [[n, 0, 0], [0, n, 0], [n, n, 0]]);
    }
    // Of a copy that is moved along x the halves that are farther out stay, without holes.
    let cloud = torus(3000);
    let by = 0.3 * cloud.radii[0];
    let mut moved = cloud.clone();
    moved.positions.iter_mut().step_by(3).for_each(|x| *x += by);
    let file = TemporaryFile::new("moved.ply", ply_text(&moved, false).as_bytes());
    let params = Settings { with: file.path(), operation: Operation::Union };
    let joined = pieces(&run::<Boolean>(&cloud, &params).unwrap());
    let to_torus = |p: DVec3| (p.truncate().length() - 1.0).hypot(p.z) - 0.4;
    // All rays from amid its tube that do not leave it through the hole in the middle.
    for along in sphere(1500).iter().map(|d| d.as_dvec3()).filter(|d| d.x > 0.0) {
        let hits = joined.iter().filter_map(|piece| piece.meets(DVec3::X, along));
        let nearest = DVec3::X + hits.fold(f64::INFINITY, f64::min) * along;
        assert!(nearest.is_finite(), "a hole towards {along}");
        let off = to_torus(nearest).min(to_torus(nearest - f64::from(by) * DVec3::X));
        assert!(off.abs() < 0.1 * f64::from(cloud.radii[0]), "{off} off towards {along}");
    }
}
