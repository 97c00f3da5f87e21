//! From files to a pyramid and back.

use crate::{
    Cut, CutView, IndexOptions, Nodes, Pyramid, PyramidError, RemakeOptions, RemakeSummary, Rule,
    index, remake,
};
use glam::DVec3;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;
use surfelshop_api::columns::{CONTEXT, Element};
use surfelshop_api::tool::{ColumnHeader, EditHeader};
use surfelshop_api::{Camera, Projection, Scope, SurfaceSettings, View};
use surfelshop_cloud::{
    Buffer, Cloud, Column, EditedCloud, ReadOptions, StagedEdits, ToolRun, Transform, WriteOptions,
    read, silent, write,
};

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
    let (mut n, mut normals_off, mut radii_off) = (0, 0, 0);
    for (number, _) in (0..).zip(pyramid.nodes()).filter(|(_, node)| node.is_leaf()) {
        let leaf = pyramid.read(number).unwrap();
        for i in 0..leaf.len() {
            let (normal, radius) = known[&key(&leaf, i)];
            n += 1;
            // A degree, and a tenth.
            normals_off += usize::from(leaf.normals()[i].dot(normal).abs() < 0.999_85);
            radii_off += usize::from((leaf.radii()[i] / radius - 1.0).abs() > 0.1);
        }
    }
    assert_eq!(n, 120_000);
    // Trees of neighbours are divided elsewhere, which a few rough points notice.
    assert!(normals_off < 12, "{normals_off} normals differ");
    assert!(radii_off < 120, "{radii_off} radii differ");
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
    assert!(same.warnings.is_empty() && same.n_chunks > 1, "{same:?}");
    assert!(matches!(stop(60), PyramidError::Cancelled(_)));
    ground(folder.path(), "a.ply", 80_000, 0.0);
    let other = index(&inputs, &output, &options(SMALL)).unwrap();
    assert!(other.warnings.iter().any(|line| line.contains("begun anew")), "{other:?}");
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
    let cut = Cut::of(pyramid.nodes(), &view, u64::MAX, |_| true);
    assert!(cut.nodes.len() > 3 && cut.missing.is_empty());
    let large = Nodes::new(Arc::clone(&pyramid), u64::MAX, Box::new(Ok));
    let first = large.get(&cut.nodes).unwrap();
    let again = large.get(&cut.nodes).unwrap();
    assert!(first.iter().zip(&again).all(|(a, b)| Arc::ptr_eq(a, b)));
    assert_eq!(large.in_memory().nodes_read, cut.nodes.len() as u64);
    // Wishes are read by another thread, the first first, and what fails is said once.
    let wished = Nodes::new(Arc::clone(&pyramid), u64::MAX, Box::new(Ok));
    wished.wish(&[], cut.nodes.clone());
    while wished.is_loading() {
        wished.wait(Duration::from_secs(60)).unwrap();
    }
    assert_eq!(wished.in_memory().nodes, cut.nodes.len() as u64);
    assert!(wished.wait(Duration::ZERO).is_ok());
    let again = wished.get(&cut.nodes).unwrap();
    assert_eq!(again.len(), cut.nodes.len());
    assert_eq!(wished.in_memory().nodes_read, cut.nodes.len() as u64, "none is read twice");
    let failing =
        Nodes::new(Arc::clone(&pyramid), u64::MAX, Box::new(|_| Err("it is not shown".to_owned())));
    failing.wish(&[], cut.nodes.clone());
    let fault = failing.wait(Duration::from_secs(60)).unwrap_err();
    assert!(fault.to_string().contains("it is not shown"), "{fault}");
    while failing.is_loading() {
        failing.wait(Duration::from_secs(60)).unwrap();
    }
    let small = Nodes::new(pyramid, 1, Box::new(Ok));
    small.get(&cut.nodes).unwrap();
    small.get(&cut.nodes[..1]).unwrap();
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

/// A pyramid of several parts.
fn parted(folder: &Path) -> Pyramid {
    let input = ground(folder, "a.ply", 150_000, 0.0);
    let output = folder.join("a.surfels");
    index(&[input], &output, &options(SMALL)).unwrap();
    Pyramid::open(&output).unwrap()
}

fn remaking(scope: Scope) -> RemakeOptions<'static> {
    let rule = Rule::Merged;
    RemakeOptions { scope, what: "test", depends: &[], memory: SMALL, rule, progress: &silent }
}

/// What a tool would have staged.
fn edited(cloud: &Cloud, header: &EditHeader, values: &[&[u8]]) -> Option<EditedCloud> {
    let mut staged = StagedEdits::new(cloud.clone());
    staged.stage(header, values).unwrap();
    let run = ToolRun::new(
        "test".to_owned(),
        String::new(),
        &surfelshop_api::params::Values::new(),
        std::time::SystemTime::UNIX_EPOCH,
    );
    staged.commit(run)
}

fn is_own(cloud: &Cloud) -> Vec<bool> {
    let Some(Buffer::U8(context)) = cloud.column(CONTEXT).map(Column::values) else {
        panic!("no context");
    };
    context.iter().map(|&context| context == 0).collect()
}

fn made(
    pyramid: &Pyramid,
    scope: Scope,
    change: &mut dyn FnMut(&Cloud) -> Option<EditedCloud>,
) -> (Pyramid, RemakeSummary) {
    let output = pyramid.path().with_extension("made.surfels");
    let summary =
        remake(pyramid, &output, &remaking(scope), &mut |cloud, _| Ok(change(cloud))).unwrap();
    assert!(!output.with_extension("surfels.index").exists());
    (Pyramid::open(&output).unwrap(), summary)
}

#[test]
fn a_pyramid_that_nothing_changes_comes_back_node_by_node() {
    // 0.7 s.
    let folder = tempfile::tempdir().unwrap();
    let pyramid = parted(folder.path());
    let (mut n_own, mut n_parts) = (0, 0);
    let (again, summary) = made(&pyramid, Scope::Surfel, &mut |cloud| {
        assert!(is_own(cloud).iter().all(|&own| own), "nothing is around where nobody asks");
        (n_own, n_parts) = (n_own + cloud.len(), n_parts + 1);
        None
    });
    assert_eq!((n_own, summary.n_surfels, n_parts), (150_000, 150_000, summary.n_parts));
    assert!(n_parts > 2);
    assert_eq!(again.nodes().len(), pyramid.nodes().len());
    for number in 0..pyramid.nodes().len() as u32 {
        let [a, b] = [&pyramid, &again].map(|pyramid| pyramid.read(number).unwrap());
        assert_eq!(a.origin(), b.origin(), "{number}");
        let columns = |cloud: &Cloud| -> Vec<(String, String)> {
            let text = |c: &Column| (c.name().to_owned(), format!("{:?}", c.values()));
            cloud.columns().iter().map(text).collect()
        };
        assert!(columns(&a) == columns(&b), "{number}");
    }
}

#[test]
fn new_values_go_to_the_surfels_of_the_part_alone() {
    // 0.8 s.
    let folder = tempfile::tempdir().unwrap();
    let pyramid = parted(folder.path());
    let (mut own, mut around) = (0, 0);
    let (made, _) = made(&pyramid, Scope::Neighbours, &mut |cloud| {
        let mask = is_own(cloud);
        let n = mask.iter().filter(|&&own| own).count();
        assert!(mask[..n].iter().all(|&own| own), "the part comes first");
        own += n;
        around += cloud.len() - n;
        // What is around counts nothing, but may say so.
        let xs = cloud.positions().iter().map(|p| (cloud.origin().x + f64::from(p.x)) as f32);
        let values: Vec<u8> = xs.flat_map(f32::to_le_bytes).collect();
        let name = "x".to_owned();
        let header = ColumnHeader { name, components: 1, element: Element::F32 };
        edited(cloud, &EditHeader::Columns(vec![header]), &[&values])
    });
    assert_eq!(own, 150_000);
    assert!(around > 10_000 && around < own, "{around}");
    assert!(leaves(&made) == leaves(&pyramid), "positions and classes stay, bit by bit");
    for (number, node) in (0..).zip(made.nodes()) {
        let cloud = made.read(number).unwrap();
        assert!(cloud.column(CONTEXT).is_none());
        let xs = cloud.floats("x", 1);
        assert_eq!(xs.len(), cloud.len());
        for (i, &x) in xs.iter().enumerate() {
            let away = (f64::from(x) - cloud.world_position(i).unwrap().x).abs();
            assert!(away <= f64::from(node.grain.max(1e-6)), "{number}: {away}");
        }
    }
}

#[test]
fn surfels_that_go_leave_their_nodes_and_new_ones_get_others() {
    // 1 s.
    let folder = tempfile::tempdir().unwrap();
    let pyramid = parted(folder.path());
    let is_kept = |cloud: &Cloud, i: usize| cloud.world_position(i).unwrap().x < 0.3;
    let (made_of_some, summary) = made(&pyramid, Scope::Surfel, &mut |cloud| {
        let mask: Vec<u8> = (0..cloud.len()).map(|i| u8::from(is_kept(cloud, i))).collect();
        edited(cloud, &EditHeader::Keep, &[&mask])
    });
    let mut expected = leaves(&pyramid);
    expected.retain(|([x, ..], _)| f32::from_bits(*x) < 0.3);
    assert_eq!(expected.len() as u64, summary.n_surfels);
    assert!(leaves(&made_of_some) == expected);
    let lone = |node: &&crate::NodeRecord| node.is_leaf() && node.n_surfels < 500;
    assert_eq!(made_of_some.nodes().iter().filter(lone).count(), 0, "small leaves are joined");
    drop(made_of_some);
    // A new cloud of the same surfels: those at seams come from both sides.
    let (made_anew, summary) = made(&pyramid, Scope::Neighbours, &mut |cloud| {
        let columns = ["position", "normal", "radius"].map(|name| cloud.column(name).unwrap());
        let headers = columns.map(|column| ColumnHeader {
            name: column.name().to_owned(),
            components: column.components(),
            element: Element::F32,
        });
        let bytes = columns.map(|column| match column.values() {
            Buffer::F32(values) => values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>(),
            _ => panic!(),
        });
        let header = EditHeader::NewCloud { origin: cloud.origin(), columns: headers.to_vec() };
        edited(cloud, &header, &bytes.each_ref().map(Vec::as_slice))
    });
    let n = summary.n_surfels;
    assert!((150_000..156_000).contains(&n), "{n}");
    assert_eq!(made_anew.directory().n_surfels, n);
    let none = remake(
        &pyramid,
        &folder.path().join("none.surfels"),
        &remaking(Scope::Surfel),
        &mut |cloud, _| Ok(edited(cloud, &EditHeader::Keep, &[&vec![0; cloud.len()]])),
    );
    assert!(none.unwrap_err().to_string().contains("found none left"));
    assert!(!folder.path().join("none.surfels").exists());
}

#[test]
fn all_of_the_scene_is_around_a_part_and_what_is_far_is_merged() {
    // 0.8 s.
    let folder = tempfile::tempdir().unwrap();
    let pyramid = parted(folder.path());
    let area = |cloud: &Cloud, counts: &dyn Fn(usize) -> bool| -> f64 {
        let radii = cloud.radii().iter().enumerate().filter(|(i, _)| counts(*i));
        radii.map(|(_, &radius)| f64::from(radius).powi(2)).sum()
    };
    let all: f64 = (0..)
        .zip(pyramid.nodes())
        .filter(|(_, node)| node.is_leaf())
        .map(|(number, _)| area(&pyramid.read(number).unwrap(), &|_| true))
        .sum();
    let (_, summary) = made(&pyramid, Scope::Scene, &mut |cloud| {
        let own = is_own(cloud);
        let n = own.iter().filter(|&&own| own).count();
        assert!(cloud.len() <= 3 * n, "{} around {n}", cloud.len() - n);
        let seen = area(cloud, &|_| true);
        assert!((0.6..1.2).contains(&(seen / all)), "{seen} of {all}");
        assert!(cloud.len() < 140_000, "{}: what is far is merged", cloud.len());
        None
    });
    assert!(summary.n_parts > 2);
}

#[test]
fn a_remake_that_is_ended_goes_on_and_one_that_is_stopped_says_so() {
    // 0.8 s.
    let folder = tempfile::tempdir().unwrap();
    let pyramid = parted(folder.path());
    let output = folder.path().join("b.surfels");
    let mut n = 0;
    let failed = remake(&pyramid, &output, &remaking(Scope::Surfel), &mut |_, _| {
        n += 1;
        if n == 2 { Err("the tool fell".to_owned()) } else { Ok(None) }
    });
    assert_eq!(failed.unwrap_err().to_string(), "the tool fell");
    assert!(!output.exists());
    let stopped = RemakeOptions {
        progress: &|at| if at > 0.6 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) },
        ..remaking(Scope::Surfel)
    };
    let cancelled = remake(&pyramid, &output, &stopped, &mut |_, _| Ok(None)).unwrap_err();
    assert!(matches!(cancelled, PyramidError::Cancelled(_)), "{cancelled}");
    let mut left = 0;
    let summary = remake(&pyramid, &output, &remaking(Scope::Surfel), &mut |_, _| {
        left += 1;
        Ok(None)
    })
    .unwrap();
    assert!(left < summary.n_parts, "{left} of {}", summary.n_parts);
    assert!(leaves(&Pyramid::open(&output).unwrap()) == leaves(&pyramid));
}
