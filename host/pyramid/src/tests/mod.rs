//! From files to a pyramid and back.

mod remaking;

use crate::{Cut, CutView, IndexOptions, NodeLook, Nodes, Pyramid, PyramidError, index};
use glam::DVec3;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;
use surfelshop_api::{Camera, Projection, SurfaceSettings, View};
use surfelshop_cloud::{Buffer, Cloud, Column, ReadOptions, Transform, WriteOptions, read, write};

/// Numbers in [0, 1).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A bumpy ground of so many points with colours and classes, in a PLY file.
fn ground(folder: &Path, name: &str, n: usize, x: f64) -> PathBuf {
    let mut random = Random(n as u64);
    let (mut positions, mut colors, mut classes) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..n {
        let (u, v) = (x + random.next(), random.next());
        let height = 0.05 * (9.0 * u).sin() * (7.0 * v).cos();
        positions.extend([u as f32, height as f32, v as f32]);
        colors.extend([(255.0 * u.fract()) as u8, 90, (255.0 * v) as u8]);
        classes.push((i % 3) as u8);
    }
    let columns = vec![
        Column::new("position", 3, Buffer::F32(positions)),
        Column::new("color", 3, Buffer::U8(colors)),
        Column::new("classification", 1, Buffer::U8(classes)),
    ];
    let path = folder.join(name);
    write(&path, &Cloud::new(DVec3::ZERO, columns).unwrap(), &WriteOptions::default()).unwrap();
    path
}

fn options(memory: u64) -> IndexOptions<'static> {
    IndexOptions { read: ReadOptions::default(), memory }
}

/// Enough for chunks of 65 536 points.
const SMALL: u64 = 1;

/// Positions and classes of all leaves, sorted.
fn leaves(pyramid: &Pyramid) -> Vec<([u32; 3], u8)> {
    let mut all = Vec::new();
    for (number, _) in (0..).zip(pyramid.nodes()).filter(|(_, node)| node.is_leaf()) {
        all.extend(surfels(&pyramid.read(number).unwrap()));
    }
    all.sort_unstable();
    all
}

fn surfels(cloud: &Cloud) -> Vec<([u32; 3], u8)> {
    let Some(Buffer::U8(classes)) = cloud.column("classification").map(Column::values) else {
        panic!("classes are missing");
    };
    let places = (0..cloud.len()).map(|i| cloud.world_position(i).unwrap());
    places
        .zip(classes)
        .map(|(p, class)| (p.as_vec3().to_array().map(f32::to_bits), *class))
        .collect()
}

#[test]
fn leaves_are_the_points_and_nodes_above_stand_for_them() {
    // 0.7 s.
    let folder = tempfile::tempdir().unwrap();
    let inputs =
        [ground(folder.path(), "a.ply", 90_000, 0.0), ground(folder.path(), "b.ply", 60_000, 1.0)];
    let output = folder.path().join("both.surfels");
    let summary = index(&inputs, &output, &options(SMALL)).unwrap();
    assert_eq!((summary.n_read, summary.n_surfels), (150_000, 150_000));
    assert!(summary.n_chunks > 2, "{summary:?}");
    assert!(!folder.path().join("both.surfels.index").exists());
    let pyramid = Pyramid::open(&output).unwrap();
    assert_eq!(summary.bytes, output.metadata().unwrap().len());
    let mut expected: Vec<_> = inputs
        .iter()
        .flat_map(|file| surfels(&read(file, &ReadOptions::default()).unwrap().cloud))
        .collect();
    expected.sort_unstable();
    assert!(leaves(&pyramid) == expected, "every point is in one leaf, bit by bit");
    let nodes = pyramid.nodes();
    assert_eq!(nodes[0].n_beneath, 150_000);
    assert!(nodes.iter().all(|node| node.n_surfels <= 1 << 15));
    // A root covers as much as its leaves do, within what overlaps.
    let root = pyramid.read(0).unwrap();
    let area: f32 = root.radii().iter().map(|radius| radius * radius).sum();
    assert!((0.5..3.0).contains(&area), "{area}");
    assert!(root.radii().iter().all(|&radius| radius < 0.1), "no plates");
    assert!(root.column("color").is_some() && root.column("classification").is_some());
    for (number, node) in (0..).zip(nodes).filter(|(_, node)| !node.is_leaf()) {
        let [first, count] = node.children;
        for child in &nodes[first as usize..(first + count) as usize] {
            assert!(node.grain >= child.grain && node.apart >= child.apart, "{number}");
            let away = (child.middle - node.middle).length();
            assert!(away <= f64::from(node.spread) + 1e-6, "{number}");
        }
    }
    assert_eq!(pyramid.overview(1), [0]);
    assert_eq!(pyramid.overview(u64::MAX).len(), nodes.iter().filter(|n| n.is_leaf()).count());
}

#[test]
fn estimates_at_seams_are_those_of_the_whole() {
    // 0.6 s.
    let folder = tempfile::tempdir().unwrap();
    let input = ground(folder.path(), "a.ply", 120_000, 0.0);
    let output = folder.path().join("a.surfels");
    index(std::slice::from_ref(&input), &output, &options(SMALL)).unwrap();
    let pyramid = Pyramid::open(&output).unwrap();
    let whole = read(&input, &ReadOptions::default()).unwrap().cloud;
    let key = |cloud: &Cloud, i: usize| {
        cloud.world_position(i).unwrap().as_vec3().to_array().map(f32::to_bits)
    };
    let known: std::collections::HashMap<_, _> = (0..whole.len())
        .map(|i| (key(&whole, i), (whole.normals()[i], whole.radii()[i])))
        .collect();
    let (mut n, mut normals_off, mut radii_off, mut turned) = (0, 0, 0, 0);
    for (number, _) in (0..).zip(pyramid.nodes()).filter(|(_, node)| node.is_leaf()) {
        let leaf = pyramid.read(number).unwrap();
        for i in 0..leaf.len() {
            let (normal, radius) = known[&key(&leaf, i)];
            n += 1;
            // A degree, and a tenth.
            normals_off += usize::from(leaf.normals()[i].dot(normal).abs() < 0.999_85);
            turned += usize::from(leaf.normals()[i].dot(normal) < 0.0);
            radii_off += usize::from((leaf.radii()[i] / radius - 1.0).abs() > 0.1);
        }
    }
    assert_eq!(n, 120_000);
    // Trees of neighbours are divided elsewhere, which a few rough points notice.
    assert!(normals_off < 12, "{normals_off} normals differ");
    assert!(radii_off < 120, "{radii_off} radii differ");
    // One side of the whole, which nothing tells of two, but no seams.
    assert!(turned == 0 || turned == n, "{turned} face the other side");
}

#[test]
fn work_that_was_stopped_goes_on_to_the_same_bytes() {
    // 1.5 s.
    let folder = tempfile::tempdir().unwrap();
    let inputs =
        [ground(folder.path(), "a.ply", 90_000, 0.0), ground(folder.path(), "b.ply", 60_000, 1.0)];
    let (at_once, in_parts) = (folder.path().join("x.surfels"), folder.path().join("y.surfels"));
    index(&inputs, &at_once, &options(SMALL)).unwrap();
    let mut n_stops = 0;
    for after in [1u32, 4, 40, 90, 150, 260, 400] {
        let calls = AtomicU32::new(0);
        let progress = |_: f64| match calls.fetch_add(1, Ordering::Relaxed) >= after {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        };
        let read = ReadOptions { progress: &progress, ..ReadOptions::default() };
        match index(&inputs, &in_parts, &IndexOptions { read, memory: SMALL }) {
            Err(PyramidError::Cancelled(_)) => n_stops += 1,
            Err(error) => panic!("{error}"),
            Ok(_) => break,
        }
        assert!(!in_parts.exists());
    }
    assert!(n_stops >= 3, "{n_stops}");
    index(&inputs, &in_parts, &options(SMALL)).unwrap();
    let bytes = |path: &Path| std::fs::read(path).unwrap();
    assert!(bytes(&at_once) == bytes(&in_parts));
}

#[test]
fn strays_and_copies_are_indexed() {
    let folder = tempfile::tempdir().unwrap();
    let mut positions = vec![1.0f32; 3 * 70_000];
    positions.extend([1e6, 2.0, 3.0, 0.5, 0.5, 0.5, 0.5, 0.75, 0.5]);
    let n = positions.len() / 3;
    let columns = vec![Column::new("position", 3, Buffer::F32(positions))];
    let path = folder.path().join("odd.ply");
    write(&path, &Cloud::new(DVec3::ZERO, columns).unwrap(), &WriteOptions::default()).unwrap();
    let output = folder.path().join("odd.surfels");
    let summary = index(&[path], &output, &options(SMALL)).unwrap();
    assert_eq!(summary.n_surfels, n as u64);
    let pyramid = Pyramid::open(&output).unwrap();
    let all: usize =
        pyramid.overview(u64::MAX).iter().map(|&leaf| pyramid.read(leaf).unwrap().len()).sum();
    assert_eq!(all, n);
    assert!(pyramid.nodes().iter().all(|node| node.n_surfels <= 1 << 15), "no node has too many");
}

#[test]
fn points_are_divided_however_far_away_a_stray_lies() {
    let folder = tempfile::tempdir().unwrap();
    let input = ground(folder.path(), "a.ply", 120_000, 0.0);
    let mut cloud = read(&input, &ReadOptions::default()).unwrap().cloud;
    let n = cloud.len();
    let Some(Buffer::F32(positions)) = cloud.column("position").map(Column::values) else {
        panic!()
    };
    let mut positions = positions.clone();
    positions[..3].copy_from_slice(&[1e12, -1e12, 1e12]);
    cloud =
        Cloud::new(DVec3::ZERO, vec![Column::new("position", 3, Buffer::F32(positions))]).unwrap();
    write(&input, &cloud, &WriteOptions::default()).unwrap();
    let output = folder.path().join("a.surfels");
    let summary = index(&[input], &output, &options(SMALL)).unwrap();
    assert_eq!(summary.n_surfels, n as u64);
    assert!(summary.n_chunks > 2 && summary.n_nodes >= 5, "{summary:?}");
    let pyramid = Pyramid::open(&output).unwrap();
    assert!(pyramid.nodes().iter().all(|node| node.n_surfels <= 1 << 15));
}

#[test]
fn two_at_a_time_are_refused_and_other_work_is_begun_anew() {
    let folder = tempfile::tempdir().unwrap();
    let inputs = [ground(folder.path(), "a.ply", 90_000, 0.0)];
    let output = folder.path().join("a.surfels");
    let stop = |after: u32| {
        let calls = AtomicU32::new(0);
        let progress = move |_: f64| match calls.fetch_add(1, Ordering::Relaxed) >= after {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        };
        let read = ReadOptions { progress: &progress, ..ReadOptions::default() };
        index(&inputs, &output, &IndexOptions { read, memory: SMALL }).unwrap_err()
    };
    assert!(matches!(stop(60), PyramidError::Cancelled(_)));
    let lock = std::fs::File::open(folder.path().join("a.surfels.index/lock")).unwrap();
    lock.lock().unwrap();
    let error = index(&inputs, &output, &options(SMALL)).unwrap_err().to_string();
    assert!(error.contains("another index or bake works on this output"), "{error}");
    drop(lock);
    // With other memory the same work goes on; of another file it is begun anew, and says so.
    let same = index(&inputs, &output, &options(1 << 33)).unwrap();
    let is_anew = |line: &String| line.contains("begun anew");
    assert!(!same.warnings.iter().any(is_anew) && same.n_chunks > 1, "{same:?}");
    assert!(matches!(stop(60), PyramidError::Cancelled(_)));
    ground(folder.path(), "a.ply", 80_000, 0.0);
    let other = index(&inputs, &output, &options(SMALL)).unwrap();
    assert!(other.warnings.iter().any(is_anew), "{other:?}");
    assert_eq!(other.n_surfels, 80_000);
}

#[test]
fn colours_and_classes_of_different_types_mean_what_they_meant() {
    let folder = tempfile::tempdir().unwrap();
    let made = |name: &str, color: Buffer, class: Buffer, x: f32| {
        let path = folder.path().join(name);
        let columns = vec![
            Column::new("position", 3, Buffer::F32(vec![x, 0.0, 0.0, x, 1.0, 0.0, x, 0.0, 1.0])),
            Column::new("color", 3, color),
            Column::new("class", 1, class),
        ];
        let cloud = Cloud::new(DVec3::ZERO, columns).unwrap();
        write(&path, &cloud, &WriteOptions::default()).unwrap();
        path
    };
    let inputs = [
        made("8.ply", Buffer::U8(vec![200; 9]), Buffer::U8(vec![3; 3]), 0.0),
        made("16.ply", Buffer::U16(vec![200 * 257; 9]), Buffer::I32(vec![70_000; 3]), 5.0),
    ];
    let output = folder.path().join("a.surfels");
    index(&inputs, &output, &options(SMALL)).unwrap();
    let pyramid = Pyramid::open(&output).unwrap();
    let cloud = pyramid.read(0).unwrap();
    assert_eq!(cloud.column("color").unwrap().values(), &Buffer::U16(vec![200 * 257; 18]));
    let Buffer::I32(classes) = cloud.column("class").unwrap().values() else { panic!() };
    assert_eq!(classes.iter().filter(|&&class| class == 3).count(), 3);
    assert_eq!(classes.iter().filter(|&&class| class == 70_000).count(), 3);
}

#[test]
fn nodes_within_a_budget_are_kept_and_read_once() {
    let folder = tempfile::tempdir().unwrap();
    let input = ground(folder.path(), "a.ply", 120_000, 0.0);
    let output = folder.path().join("a.surfels");
    index(&[input], &output, &options(SMALL)).unwrap();
    let pyramid = Arc::new(Pyramid::open(&output).unwrap());
    let projection = Projection::Perspective { fov_y: 1.0 };
    let eye = DVec3::new(0.5, 1.0, 1.4);
    let camera = Camera { eye, target: DVec3::new(0.5, 0.0, 0.5), up: DVec3::Y, projection };
    let view = View { camera, size_px: [400, 400], near: 0.01, far: 10.0 };
    let settings = SurfaceSettings::default();
    let view = CutView::new(&view, &settings, &Transform::default(), 0.0);
    let cut = Cut::of(pyramid.nodes(), &view, u64::MAX, (|_| true, |_| true));
    assert!(cut.nodes.len() > 3 && cut.missing.is_empty());
    let plain = Arc::new(NodeLook::default());
    let large = Nodes::new(Arc::clone(&pyramid), u64::MAX);
    let first = large.get(&cut.nodes, &plain).unwrap();
    let again = large.get(&cut.nodes, &plain).unwrap();
    assert!(first.iter().zip(&again).all(|(a, b)| Arc::ptr_eq(a, b)));
    assert_eq!(large.in_memory().nodes_read, cut.nodes.len() as u64);
    // Wishes are read by another thread, the first first, and what fails is said once.
    let wished = Nodes::new(Arc::clone(&pyramid), u64::MAX);
    wished.wish(&[], cut.nodes.clone(), &plain);
    while wished.is_loading() {
        wished.wait(Duration::from_secs(60)).unwrap();
    }
    assert_eq!(wished.in_memory().nodes, cut.nodes.len() as u64);
    assert!(wished.wait(Duration::ZERO).is_ok());
    let again = wished.get(&cut.nodes, &plain).unwrap();
    assert_eq!(again.len(), cut.nodes.len());
    assert_eq!(wished.in_memory().nodes_read, cut.nodes.len() as u64, "none is read twice");
    let failing = Nodes::new(Arc::clone(&pyramid), u64::MAX);
    let refused = NodeLook {
        prepare: Box::new(|_, _| Err("it is not shown".to_owned())),
        ..NodeLook::default()
    };
    failing.wish(&[], cut.nodes.clone(), &Arc::new(refused));
    let fault = failing.wait(Duration::from_secs(60)).unwrap_err();
    assert!(fault.to_string().contains("it is not shown"), "{fault}");
    while failing.is_loading() {
        failing.wait(Duration::from_secs(60)).unwrap();
    }
    // Another look is read anew where its number for a node is another one, and so is the one before.
    let other = cut.nodes[1];
    let half = NodeLook {
        prepare: Box::new(|_, cloud| {
            let mask: Vec<bool> = (0..cloud.len()).map(|i| i % 2 == 0).collect();
            cloud.keep(&mask).map_err(|error| error.to_string())
        }),
        version: Box::new(move |node| u64::from(node == other)),
    };
    let changed = large.get(&cut.nodes, &half).unwrap();
    let is_same = |i: usize| Arc::ptr_eq(&first[i], &changed[i]);
    assert!((0..first.len()).all(|i| is_same(i) == (i != 1)));
    assert_eq!(changed[1].len(), first[1].len().div_ceil(2));
    assert_eq!(large.get(&cut.nodes, &plain).unwrap()[1].len(), first[1].len());
    assert_eq!(large.in_memory().nodes_read, cut.nodes.len() as u64 + 2);
    let small = Nodes::new(pyramid, 1);
    small.get(&cut.nodes, &plain).unwrap();
    small.get(&cut.nodes[..1], &plain).unwrap();
    assert_eq!(small.in_memory().nodes, 1, "what is not in use goes");
}

#[test]
fn damage_is_one_line_and_no_wrong_surfel() {
    let folder = tempfile::tempdir().unwrap();
    let input = ground(folder.path(), "a.ply", 3_000, 0.0);
    let output = folder.path().join("a.surfels");
    index(&[input], &output, &options(SMALL)).unwrap();
    let whole = std::fs::read(&output).unwrap();
    let damaged = folder.path().join("damaged.surfels");
    let fails = |bytes: &[u8]| {
        std::fs::write(&damaged, bytes).unwrap();
        let found = Pyramid::open(&damaged).and_then(|pyramid| pyramid.read(0));
        let line = found.err().map(|error| error.to_string());
        line.is_some_and(|line| line.contains("damaged.surfels") && !line.contains('\n'))
    };
    for at in (0..whole.len()).step_by(whole.len() / 400) {
        let mut changed = whole.clone();
        changed[at] ^= 1 << (at % 8);
        // Zeros behind the offsets of the header are read by nobody.
        assert!(fails(&changed) || (36..40).contains(&at), "byte {at}");
    }
    for at in [0, 1, 63, 64, whole.len() / 2, whole.len() - 1] {
        assert!(fails(&whole[..at]), "{at} bytes");
    }
    assert!(!fails(&whole));
}

#[test]
fn folders_of_others_stay() {
    let folder = tempfile::tempdir().unwrap();
    let input = ground(folder.path(), "a.ply", 100, 0.0);
    let own = folder.path().join("a.surfels.index");
    std::fs::create_dir(&own).unwrap();
    std::fs::write(own.join("mine.txt"), "hands off").unwrap();
    let error = index(&[input], &folder.path().join("a.surfels"), &options(SMALL)).unwrap_err();
    assert!(error.to_string().contains("expected no folder of this name"), "{error}");
    assert!(own.join("mine.txt").exists());
}
