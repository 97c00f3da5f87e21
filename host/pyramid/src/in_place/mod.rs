//! Files whose points lie in an octree, such as COPC, as pyramids without a file of their own.
//!
//! A node of such a file has more points of its cell, and not other ones: to see the cell as fine as the node takes
//! those of all nodes above it, too. So what is drawn of a node are its own points and those of the nodes above that
//! lie in its cell. A node with children has all eight of them: those that the file does not have are cells in which
//! the points of the nodes above are all that there are.

mod colors;

use crate::error::PyramidError;
use crate::layout::{Directory, NodeRecord};
use glam::{DVec3, UVec3};
use std::collections::{HashMap, HashSet};
use std::path::Path;
use std::sync::{Arc, OnceLock};
use surfelshop_api::columns::{COLOR, Element, NORMAL, POSITION, RADIUS};
use surfelshop_api::format::{CloudHeader, FileColumn, PointNode, PointTree};
use surfelshop_cloud::convert::{
    ConvertError, SideGuide, assembled, narrow_colors, narrowed, nodes_of, tree_of,
};
use surfelshop_cloud::{Buffer, Cloud, Column, ReadOptions, Source, memory};
use surfelshop_geometry::hashing::scattered;

/// Who reads files in place: any thread asks, at any time.
pub trait NodeReader: Send + Sync {
    /// Calls `read` with how files are read and what they lack is estimated.
    fn with_options(&self, read: &mut dyn FnMut(&ReadOptions<'_>));
}

/// The most cells, which stay in memory at some 200 bytes each: ten thousand million points have a million.
const MOST_NODES: usize = 1 << 21;

/// Points that the sides of normals are found by, about: those of the coarsest nodes, so few that the first picture does
/// not wait long.
const GUIDING: u64 = 40_000;

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
    /// Whether colours of 16 bits hold values of 8.
    has_narrow_colors: bool,
    /// The sides of normals that are estimated, found when the first node is read.
    guide: OnceLock<Option<SideGuide>>,
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
        let has_narrow_colors = colors::are_narrow(path, &*reader, &header, &tree);
        let mut notes = vec!["read in place: what is missing is estimated node by node".to_owned()];
        let mut drawn_header = header.clone();
        if has_narrow_colors {
            narrow_colors(&mut drawn_header);
            notes.push("the 16-bit colours hold 8-bit values and are drawn as such".to_owned());
        }
        let mut columns = drawn_header.columns;
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
            notes,
        };
        let guide = OnceLock::new();
        let file = Self { read: reader, tree, drawn, header, source, has_narrow_colors, guide };
        Ok(Some((file, directory, records)))
    }

    /// What says the sides of normals, which a node alone does not show; `None` where the file says them itself, or
    /// nothing can be said.
    fn guide(&self, path: &Path) -> Option<&SideGuide> {
        let is_needed = self.header.column(NORMAL).is_none() && SideGuide::is_needed(&self.source);
        let made = || is_needed.then(|| self.seen(path)).flatten();
        self.guide.get_or_init(made).as_ref()
    }

    /// The sides that can be seen, by the coarsest nodes; `None` where they cannot be read, which the nodes say themselves.
    fn seen(&self, path: &Path) -> Option<SideGuide> {
        let wanted = coarsest(&self.tree, GUIDING);
        let (header, columns) =
            read_with(&*self.read, |read| nodes_of(path, &wanted, read)).ok()?;
        let positions = columns.get(header.column(POSITION)?.0)?;
        let n = positions.len() as u64 / 3;
        let every = n.div_ceil(GUIDING).max(1);
        let chosen = (0..n / every).map(|block| block * every + scattered(block) % every);
        let place = |row: u64| {
            let at = |axis: usize| positions.get_f64(3 * row as usize + axis);
            Some(DVec3::new(at(0)?, at(1)?, at(2)?))
        };
        let places: Option<Vec<DVec3>> = chosen.map(place).collect();
        let (mut made, places) = (None, places?);
        self.read.with_options(&mut |read| {
            made = SideGuide::of(&places, &self.source, read).ok().flatten();
        });
        made
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
            let values = values.gather(column.components as usize, &rows);
            let values = values.map_err(|out| fault(out.to_string()))?;
            match values {
                Buffer::U16(wide) if self.has_narrow_colors && column.name == COLOR => {
                    Ok(Buffer::U8(narrowed(&wide)))
                }
                values => Ok(values),
            }
        });
        let gathered = gathered.collect::<Result<Vec<Buffer>, PyramidError>>()?;
        drop(columns);
        let mut header = CloudHeader { rows: None, bounds: None, tree: None, ..header };
        if self.has_narrow_colors {
            narrow_colors(&mut header);
        }
        let (mut made, mut gathered, guide) = (None, Some(gathered), self.guide(path));
        self.read.with_options(&mut |read| {
            if let Some(columns) = gathered.take() {
                made = Some(assembled(&header, columns, self.source.clone(), guide, read));
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

/// The coarsest nodes, which have so many points together, or a node's more.
fn coarsest(tree: &PointTree, most: u64) -> Vec<PointNode> {
    let mut nodes = tree.nodes.clone();
    nodes.sort_by_key(|node| node.level);
    let mut points = 0u64;
    nodes.retain(|node| {
        let is_wanted = points < most;
        points = points.saturating_add(node.points);
        is_wanted
    });
    nodes
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
mod tests;
