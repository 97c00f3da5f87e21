//! Files in place that are made up.

use super::*;

fn tree(keys: &[(u32, [u32; 3])]) -> PointTree {
    let node =
        |&(level, cell): &(u32, [u32; 3])| PointNode { level, cell, points: 100, place: [0; 2] };
    let nodes = keys.iter().map(node).collect();
    PointTree { low: DVec3::ONE, side: 8.0, spacing: 0.5, nodes }
}

#[test]
fn every_cell_beneath_a_node_is_there_with_the_points_above_it() {
    let tree = tree(&[(0, [0; 3]), (1, [1, 0, 0]), (2, [2, 1, 0])]);
    let (drawn, children) = drawn(&tree).unwrap();
    assert_eq!(drawn.len(), 17);
    assert_eq!(children[0], [1, 8]);
    let refined: Vec<usize> = (1..17).filter(|&i| children[i][1] > 0).collect();
    assert_eq!(refined, [2], "cell 1, 0, 0 is the second of eight");
    let points = |cell: u32| points_of(&drawn, cell).collect::<Vec<_>>();
    assert_eq!(points(1), [0], "nothing is finer there");
    assert_eq!(points(2), [1, 0]);
    let finest = drawn.iter().position(|node| node.key == (2, UVec3::new(2, 1, 0))).unwrap();
    assert_eq!(points(finest as u32), [2, 1, 0]);
    let records = records(&tree, &drawn, &children);
    assert_eq!(records[2].n_surfels, 125);
    assert!(records[2].grain > 0.0 && records[9].grain == 0.0);
    assert_eq!(records[0].middle, DVec3::splat(5.0));
    // Each place is in one cell, beyond the cube in that at the border.
    assert_eq!(cell(&tree, DVec3::splat(8.9), 1), Some(UVec3::ONE));
    assert_eq!(cell(&tree, DVec3::new(-7.0, 99.0, 5.0), 1), Some(UVec3::new(0, 1, 1)));
    assert_eq!(cell(&tree, DVec3::new(f64::NAN, 0.0, 0.0), 1), None);
}

#[test]
fn a_tree_without_a_root_or_with_a_node_twice_is_one_or_a_line() {
    let (drawn, _) = drawn(&tree(&[(1, [0, 0, 1])])).unwrap();
    assert_eq!(drawn.len(), 9);
    assert!(drawn[0].own.is_none());
    let twice = super::drawn(&tree(&[(0, [0; 3]), (0, [0; 3])]));
    assert!(twice.err().is_some_and(|line| line.contains("twice")));
}

/// A file whose points are made up: a root and two levels over a wavy sheet, each point in one node.
struct Sheet {
    tree: PointTree,
    points: Vec<Vec<f64>>,
}

impl Sheet {
    fn new() -> Self {
        let mut tree = tree(&[]);
        let mut points: Vec<Vec<f64>> = Vec::new();
        let mut node_of: HashMap<Key, usize> = HashMap::new();
        for i in 0..64u32 * 64 {
            let (u, v) = (i % 64, i / 64);
            let at = DVec3::new(f64::from(u), f64::from(v), 0.0) / 8.0;
            let at = DVec3::new(1.06, 1.06, 4.0 + 0.3 * at.x.sin()) + at;
            // Every fourth point of a level is the level's above; the far corner has no finest level.
            let level = match (u % 4, v % 4, u > 40 && v > 40) {
                (0, 0, _) => 0,
                (0 | 2, 0 | 2, _) | (.., true) => 1,
                _ => 2,
            };
            let key = (level, cell(&tree, at, level).unwrap());
            let node = *node_of.entry(key).or_insert_with(|| {
                points.push(Vec::new());
                let place = [points.len() as u64 - 1, 0];
                tree.nodes.push(PointNode { level, cell: key.1.to_array(), points: 0, place });
                points.len() - 1
            });
            points[node].extend(at.to_array());
            tree.nodes[node].points += 1;
        }
        Self { tree, points }
    }
}

impl surfelshop_cloud::Formats for Sheet {
    fn by_bytes(&self, head: &[u8]) -> Option<String> {
        head.starts_with(b"sheet").then(|| "sheet".to_owned())
    }

    fn by_name(&self, _name: &str, _written: bool) -> Option<String> {
        None
    }

    fn takes_several(&self, _id: &str) -> bool {
        false
    }

    fn endings(&self, _written: bool) -> Vec<String> {
        Vec::new()
    }

    fn read(
        &self,
        _id: &str,
        _file: Arc<dyn surfelshop_api::format::FileHost>,
        call: surfelshop_cloud::FormatCall<'_>,
        sink: surfelshop_cloud::SharedSink,
        _progress: surfelshop_cloud::Progress<'_>,
    ) -> Result<(), surfelshop_cloud::ReadFault> {
        let mut sink = sink.lock().unwrap();
        let columns = vec![FileColumn::new(POSITION, 3, Element::F64)];
        let wanted = call.nodes.unwrap();
        let tree = Some(self.tree.clone());
        if sink.begin(&CloudHeader { columns, tree, ..CloudHeader::default() }).unwrap() {
            for node in wanted {
                let points = &self.points[node.place[0] as usize];
                sink.batch(&[surfelshop_api::columns::Values::F64(points)]).unwrap();
            }
        }
        Ok(())
    }

    fn write(
        &self,
        _id: &str,
        _clouds: Box<dyn surfelshop_api::format::CloudSourceHost + Send>,
        _file: Arc<dyn surfelshop_api::format::FileHost>,
        _call: surfelshop_cloud::FormatCall<'_>,
        _progress: surfelshop_cloud::Progress<'_>,
    ) -> Result<Vec<String>, surfelshop_cloud::WriteFault> {
        Err(surfelshop_cloud::WriteFault::Line("only read".to_owned()))
    }
}

impl NodeReader for Sheet {
    fn with_options(&self, read: &mut dyn FnMut(&ReadOptions<'_>)) {
        read(&ReadOptions { formats: self, ..ReadOptions::default() });
    }
}

#[test]
fn leaves_have_every_point_once_and_nodes_above_stand_for_them() {
    // 0.1 s.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.sheet");
    std::fs::write(&path, "sheet").unwrap();
    let sheet = Sheet::new();
    let mut expected: Vec<[u64; 3]> = sheet
        .points
        .iter()
        .flat_map(|points| points.as_chunks::<3>().0)
        .map(|at| at.map(|x| (x * 1e4).round() as u64))
        .collect();
    let pyramid = crate::Pyramid::in_place(&path, Arc::new(sheet)).unwrap().unwrap();
    assert!(pyramid.is_in_place());
    assert_eq!(pyramid.directory().n_surfels, 4096);
    let (mut found, mut faces_up) = (Vec::new(), Vec::new());
    for (number, _) in (0..).zip(pyramid.nodes()).filter(|(_, node)| node.is_leaf()) {
        let leaf = pyramid.read(number).unwrap();
        faces_up.extend(leaf.normals().iter().map(|normal| normal.z > 0.0));
        found.extend(
            (0..leaf.len()).map(|i| {
                leaf.world_position(i).unwrap().to_array().map(|x| (x * 1e4).round() as u64)
            }),
        );
    }
    found.sort_unstable();
    expected.sort_unstable();
    assert!(found == expected, "{} points in leaves", found.len());
    assert_eq!(faces_up.len(), 4096);
    assert!(faces_up.iter().all(|up| *up == faces_up[0]), "no leaf faces the other side");
    let root = pyramid.read(0).unwrap();
    assert_eq!(root.len(), 256);
    let area = |cloud: &Cloud| cloud.radii().iter().map(|r| r * r).sum::<f32>();
    assert!((10.0..80.0).contains(&area(&root)), "it covers 8 by 8: {}", area(&root));
    let whole = pyramid.overview_cloud(u64::MAX).unwrap();
    assert_eq!(whole.len(), 4096);
}
