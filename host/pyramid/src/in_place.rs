//! Files whose points lie in an octree, such as COPC, as pyramids without a file of their own.
//!
//! A node of such a file has more points of its cell, and not other ones: to see the cell as fine as the node takes
//! those of all nodes above it, too. So what is drawn of a node are its own points and those of the nodes above that
//! lie in its cell. A node with children has all eight of them: those that the file does not have are cells in which
//! the points of the nodes above are all that there are.

use crate::error::PyramidError;
use crate::layout::{Directory, NodeRecord};
use glam::{DVec3, UVec3};
use std::collections::{HashMap, HashSet};
use std::path::Path;
use std::sync::Arc;
use surfelshop_api::columns::{Element, NORMAL, POSITION, RADIUS};
use surfelshop_api::format::{CloudHeader, FileColumn, PointNode, PointTree};
use surfelshop_cloud::convert::{ConvertError, assembled, nodes_of, tree_of};
use surfelshop_cloud::{Buffer, Cloud, Column, ReadOptions, Source, memory};

/// Who reads files in place: any thread asks, at any time.
pub trait NodeReader: Send + Sync {
    /// Calls `read` with how files are read and what they lack is estimated.
    fn with_options(&self, read: &mut dyn FnMut(&ReadOptions<'_>));
}

/// The most cells, which stay in memory at some 200 bytes each: ten thousand million points have a million.
const MOST_NODES: usize = 1 << 21;

/// Most halvings of the cube.
const DEEPEST: u32 = 30;

/// A cell: level and place.
type Key = (u32, UVec3);

/// A node of the tree that is drawn.
struct Drawn {
    key: Key,
    /// The cell above it, of the root itself.
    parent: u32,
    /// The file's node of this cell, where it has one.
    own: Option<u32>,
}

/// An open file of points.
pub(crate) struct PointFile {
    read: Arc<dyn NodeReader>,
    tree: PointTree,
    drawn: Vec<Drawn>,
    header: CloudHeader,
    source: Source,
}

fn read_with<T>(
    reader: &dyn NodeReader,
    read: impl Fn(&ReadOptions<'_>) -> Result<T, ConvertError>,
) -> Result<T, PyramidError> {
    let mut found = None;
    reader.with_options(&mut |options| found = Some(read(options)));
    let silent = || PyramidError::Points("nobody reads the file".to_owned());
    Ok(found.ok_or_else(silent)??)
}

impl PointFile {
    /// The file with what stands for its directory and its records; nothing where it has no octree.
    pub(crate) fn open(
        path: &Path,
        reader: Arc<dyn NodeReader>,
    ) -> Result<Option<(Self, Directory, Vec<NodeRecord>)>, PyramidError> {
        let Some((mut header, source)) = read_with(&*reader, |read| tree_of(path, read))? else {
            return Ok(None);
        };
        let Some(tree) = header.tree.take() else { return Ok(None) };
        let is_length = |x: f64| x.is_finite() && x > 0.0;
        if !tree.low.is_finite() || !is_length(tree.side) || !is_length(tree.spacing) {
            let line = "expected an octree over a cube with a side and a spacing above 0; write the file again";
            return Err(PyramidError::file(path, line));
        }
        let (drawn, children) = drawn(&tree).map_err(|line| PyramidError::file(path, line))?;
        let records = records(&tree, &drawn, &children);
        let is_box = |bounds: &[DVec3; 2]| bounds.iter().all(|corner| corner.is_finite());
        let [low, high] = header.bounds.filter(is_box).unwrap_or([tree.low, tree.low + tree.side]);
        let mut columns = header.columns.clone();
        for column in columns.iter_mut().filter(|column| column.name == POSITION) {
            column.element = Element::F32;
        }
        for (name, n) in [(NORMAL, 3), (RADIUS, 1)] {
            if header.column(name).is_none() {
                columns.push(FileColumn::new(name, n, Element::F32));
            }
        }
        let directory = Directory {
            generator: header.format.clone(),
            columns,
            n_surfels: sum(&tree.nodes),
            n_leaves: records.iter().filter(|record| record.is_leaf()).count() as u64,
            n_nodes: records.len() as u64,
            bounds: [low, high],
            largest_radius: tree.spacing as f32,
            source: (&source).into(),
            notes: vec!["read in place: what is missing is estimated node by node".to_owned()],
        };
        Ok(Some((Self { read: reader, tree, drawn, header, source }, directory, records)))
    }

    /// The surfels of a node.
    pub(crate) fn read(&self, path: &Path, node: u32) -> Result<Cloud, PyramidError> {
        let Some(Drawn { key, .. }) = self.drawn.get(node as usize) else {
            return Err(PyramidError::file(path, format!("expected a node, found {node}")));
        };
        let mut wanted: Vec<PointNode> =
            points_of(&self.drawn, node).map(|node| self.tree.nodes[node as usize]).collect();
        // From the root down.
        wanted.reverse();
        let bytes: u64 = self.header.columns.iter().map(|column| column.point_bytes() as u64).sum();
        let points = sum(&wanted);
        let fault = |line: String| PyramidError::file(path, line);
        // Read, gathered, and with what is estimated.
        memory::ask(points.saturating_mul(3 * bytes)).map_err(|out| fault(out.to_string()))?;
        let (header, columns) = read_with(&*self.read, |read| nodes_of(path, &wanted, read))?;
        let place = header.column(POSITION).map(|(place, _)| place);
        let positions = place.and_then(|place| columns.get(place));
        let n = positions.map_or(0, |positions| positions.len() / 3);
        if n as u64 != points {
            return Err(fault(format!(
                "expected {points} points in the cells above {}, found {n}: the file is damaged; `surfelshop index` \
                 takes what can be read",
                key.1
            )));
        }
        // Its own are those of the cell whatever rounding does at its border.
        let own =
            self.drawn[node as usize].own.map_or(0, |own| self.tree.nodes[own as usize].points);
        let first_own = points - own;
        let is_inside = |row: &u32| {
            if u64::from(*row) >= first_own {
                return true;
            }
            let at = |axis: usize| positions?.get_f64(3 * *row as usize + axis);
            let place = [at(0), at(1), at(2)].map(|x| x.unwrap_or(f64::NAN));
            cell(&self.tree, DVec3::from_array(place), key.0) == Some(key.1)
        };
        let rows: Vec<u32> = (0..n as u32).filter(is_inside).collect();
        if rows.is_empty() {
            return self.empty(path);
        }
        let gathered = header.columns.iter().zip(&columns);
        let gathered = gathered.map(|(column, values)| {
            values.gather(column.components as usize, &rows).map_err(|out| fault(out.to_string()))
        });
        let gathered = gathered.collect::<Result<Vec<Buffer>, _>>()?;
        drop(columns);
        let header = CloudHeader { rows: None, bounds: None, tree: None, ..header };
        let (mut made, mut gathered) = (None, Some(gathered));
        self.read.with_options(&mut |read| {
            if let Some(columns) = gathered.take() {
                made = Some(assembled(&header, columns, self.source.clone(), None, read));
            }
        });
        match made {
            Some(Ok(loaded)) => Ok(loaded.cloud),
            Some(Err(error)) => Err(fault(error.to_string())),
            None => self.empty(path),
        }
    }

    /// A cell without points.
    fn empty(&self, path: &Path) -> Result<Cloud, PyramidError> {
        let column = |(name, n)| Column::new(name, n, Buffer::F32(Vec::new()));
        let columns = [(POSITION, 3), (NORMAL, 3), (RADIUS, 1)].map(column).to_vec();
        let cloud = Cloud::new(self.tree.low, columns);
        let cloud = cloud.map_err(|error| PyramidError::file(path, error.to_string()))?;
        Ok(cloud.with_source(self.source.clone()))
    }
}

/// Points of several nodes; as many as can be counted where a file says that there are more.
fn sum(nodes: &[PointNode]) -> u64 {
    nodes.iter().map(|node| node.points).fold(0, u64::saturating_add)
}

/// The cell of a level that a place lies in; that at the border where it lies beyond, and none where it is no place.
fn cell(tree: &PointTree, place: DVec3, level: u32) -> Option<UVec3> {
    let n = f64::from(1u32 << level);
    let steps = (place - tree.low) / tree.side * n;
    steps.is_finite().then(|| steps.floor().clamp(DVec3::ZERO, DVec3::splat(n - 1.0)).as_uvec3())
}

/// The nodes that are drawn, level by level from the root, with first and number of the children of each.
fn drawn(tree: &PointTree) -> Result<(Vec<Drawn>, Vec<[u32; 2]>), String> {
    let mut known: HashMap<Key, u32> = HashMap::new();
    let mut inner: HashSet<Key> = HashSet::new();
    for (number, node) in (0u32..).zip(&tree.nodes) {
        let cell = UVec3::from_array(node.cell);
        if node.level > DEEPEST || cell.max_element() >> node.level > 0 {
            return Err(format!(
                "expected cells of at most {DEEPEST} halvings, found {cell} of level {}",
                node.level
            ));
        }
        if known.insert((node.level, cell), number).is_some() {
            return Err(format!(
                "expected each node of the octree once, found {cell} of level {} twice; write the file again",
                node.level
            ));
        }
        // Above a node that is there all are.
        for up in 1..=node.level {
            if !inner.insert((node.level - up, cell >> up)) {
                break;
            }
        }
        if inner.len() > MOST_NODES {
            break;
        }
    }
    let own = |key: &Key| known.get(key).copied();
    let key = (0, UVec3::ZERO);
    let mut drawn = vec![Drawn { key, parent: 0, own: own(&key) }];
    let mut children = Vec::new();
    while let Some(&Drawn { key, .. }) = drawn.get(children.len()) {
        if !inner.contains(&key) {
            children.push([0, 0]);
            continue;
        }
        if drawn.len() > MOST_NODES {
            return Err(format!(
                "expected an octree of at most {MOST_NODES} cells, found more; `surfelshop index` makes a pyramid"
            ));
        }
        let (level, cell) = key;
        let parent = children.len() as u32;
        children.push([drawn.len() as u32, 8]);
        for eighth in 0..8u32 {
            let key = (level + 1, cell * 2 + UVec3::new(eighth & 1, eighth >> 1 & 1, eighth >> 2));
            drawn.push(Drawn { key, parent, own: own(&key) });
        }
    }
    Ok((drawn, children))
}

/// The file's nodes whose points are in a cell: its own, and those above it up to the root.
fn points_of(drawn: &[Drawn], cell: u32) -> impl Iterator<Item = u32> + '_ {
    let above = move |&cell: &u32| {
        let parent = drawn.get(cell as usize)?.parent;
        (parent != cell).then_some(parent)
    };
    std::iter::successors(Some(cell), above).filter_map(|cell| drawn.get(cell as usize)?.own)
}

/// What is said of each node. Numbers of points are estimates: of those of nodes above a cell has a quarter a level,
/// as surfaces do.
fn records(tree: &PointTree, drawn: &[Drawn], children: &[[u32; 2]]) -> Vec<NodeRecord> {
    let mut records: Vec<NodeRecord> = Vec::with_capacity(drawn.len());
    for ((number, node), &children) in (0..).zip(drawn).zip(children) {
        let (level, at) = node.key;
        let side = tree.side / f64::from(1u32 << level);
        let spacing = (tree.spacing / f64::from(1u32 << level)) as f32;
        let share = |above: u32| {
            let above = &tree.nodes[above as usize];
            above.points as f64 * 0.25f64.powi((level - above.level) as i32)
        };
        let n = points_of(drawn, number).map(share).sum::<f64>().ceil() as u32;
        let is_leaf = children[1] == 0;
        records.push(NodeRecord {
            children,
            n_surfels: n,
            level,
            origin: tree.low,
            middle: tree.low + (at.as_dvec3() + 0.5) * side,
            spread: (0.5 * side * 3f64.sqrt()) as f32,
            // Discs reach the corners of their cells, and gaps are up to a few spacings wide.
            reach: 4.0 * spacing,
            grain: if is_leaf { 0.0 } else { spacing },
            apart: if is_leaf { 0.0 } else { spacing },
            axis: glam::Vec3::Z,
            cosine: -1.0,
            n_beneath: u64::from(n),
            columns: Vec::new(),
        });
    }
    for i in (0..records.len()).rev() {
        let [first, count] = records[i].children;
        if count > 0 {
            let beneath = &records[first as usize..(first + count) as usize];
            records[i].n_beneath = beneath.iter().map(|child| child.n_beneath).sum();
        }
    }
    records
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tree(keys: &[(u32, [u32; 3])]) -> PointTree {
        let node = |&(level, cell): &(u32, [u32; 3])| PointNode {
            level,
            cell,
            points: 100,
            place: [0; 2],
        };
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
        let mut found = Vec::new();
        for (number, _) in (0..).zip(pyramid.nodes()).filter(|(_, node)| node.is_leaf()) {
            let leaf = pyramid.read(number).unwrap();
            assert_eq!(leaf.normals().len(), leaf.len());
            found.extend((0..leaf.len()).map(|i| {
                leaf.world_position(i).unwrap().to_array().map(|x| (x * 1e4).round() as u64)
            }));
        }
        found.sort_unstable();
        expected.sort_unstable();
        assert!(found == expected, "{} points in leaves", found.len());
        let root = pyramid.read(0).unwrap();
        assert_eq!(root.len(), 256);
        let area = |cloud: &Cloud| cloud.radii().iter().map(|r| r * r).sum::<f32>();
        assert!((10.0..80.0).contains(&area(&root)), "it covers 8 by 8: {}", area(&root));
        let whole = pyramid.overview_cloud(u64::MAX).unwrap();
        assert_eq!(whole.len(), 4096);
    }
}
