//! An open pyramid.

use crate::codec;
use crate::error::PyramidError;
use crate::in_place::{NodeReader, PointFile};
use crate::layout::{self, Directory, HEADER, Header, NodeRecord, damaged};
use glam::DVec3;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use surfelshop_api::ObjectFrame;
use surfelshop_api::columns::{Element, POSITION};
use surfelshop_api::format::{FileColumn, FileHost as _};
use surfelshop_cloud::{Buffer, Cloud, CloudError, Column, Source, SystemFile, files, memory};

/// Where the surfels of nodes come from.
enum Store {
    /// A pyramid's file.
    File(SystemFile),
    /// A file of points in an octree, which is read in place.
    Points(Box<PointFile>),
}

/// An open pyramid: its directory and its nodes' records in memory, their surfels in the file.
pub struct Pyramid {
    path: PathBuf,
    store: Store,
    directory: Directory,
    nodes: Vec<NodeRecord>,
    source: Source,
    /// Of each node the one above it; of the root itself.
    parents: Vec<u32>,
}

impl Pyramid {
    /// Opens a pyramid. Of its nodes the records are read and checked, and none of their surfels.
    ///
    /// # Errors
    /// One line where it is no pyramid, of another version, or damaged.
    pub fn open(path: &Path) -> Result<Self, PyramidError> {
        let (file, header, directory) = head(path)?;
        let fault = |line: String| PyramidError::file(path, line);
        let (offset, length, crc) = header.nodes;
        let n_columns = directory.columns.len();
        if length != layout::table_bytes(header.n_nodes, n_columns) {
            return Err(fault(damaged("its table of nodes has another length than it announces")));
        }
        let table = read(&file, path, (offset, length, crc), "its table of nodes")?;
        let nodes =
            layout::nodes(&table, header.n_nodes, n_columns, file.length()).map_err(fault)?;
        Ok(Self::of(path, Store::File(file), directory, nodes))
    }

    /// Opens a file whose points lie in an octree, such as COPC, as a pyramid: nodes are read from it, and what they
    /// lack is estimated, each by itself. Nothing where the file has no octree.
    ///
    /// # Errors
    /// One line that names the file, what was expected and what was found.
    pub fn in_place(path: &Path, read: Arc<dyn NodeReader>) -> Result<Option<Self>, PyramidError> {
        let Some((points, directory, nodes)) = PointFile::open(path, read)? else {
            return Ok(None);
        };
        Ok(Some(Self::of(path, Store::Points(Box::new(points)), directory, nodes)))
    }

    fn of(path: &Path, store: Store, directory: Directory, nodes: Vec<NodeRecord>) -> Self {
        let source = directory.source.of_cloud();
        let mut parents = vec![0; nodes.len()];
        for (number, node) in (0..).zip(&nodes) {
            let [first, count] = node.children;
            parents[first as usize..(first + count) as usize].fill(number);
        }
        Self { path: path.to_owned(), store, directory, nodes, source, parents }
    }

    /// Whether it is a file of points that is read in place.
    #[must_use]
    pub fn is_in_place(&self) -> bool {
        matches!(self.store, Store::Points(_))
    }

    /// The nodes above a node, up to the root.
    pub(crate) fn above(&self, node: u32) -> impl Iterator<Item = u32> + '_ {
        let parent = move |&node: &u32| {
            let parent = self.parents.get(node as usize).copied()?;
            (parent != node).then_some(parent)
        };
        std::iter::successors(Some(node), parent).skip(1)
    }

    /// Bytes of a surfel's columns.
    #[must_use]
    pub fn surfel_bytes(&self) -> u64 {
        self.directory.columns.iter().map(|column| column.point_bytes() as u64).sum()
    }

    /// The directory of a pyramid, which says all but where its nodes are.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn directory_of(path: &Path) -> Result<Directory, PyramidError> {
        head(path).map(|(_, _, directory)| directory)
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What the file says of the whole.
    #[must_use]
    pub fn directory(&self) -> &Directory {
        &self.directory
    }

    /// The nodes; the first is the root.
    #[must_use]
    pub fn nodes(&self) -> &[NodeRecord] {
        &self.nodes
    }

    /// Reads the surfels of a node, and checks them.
    ///
    /// # Errors
    /// One line where there is no such node, the file is damaged, the system refuses, or memory runs out.
    pub fn read(&self, node: u32) -> Result<Cloud, PyramidError> {
        let fault = |line: String| PyramidError::file(&self.path, line);
        let Some(record) = self.nodes.get(node as usize) else {
            return Err(fault(format!("expected a node below {}, found {node}", self.nodes.len())));
        };
        let file = match &self.store {
            Store::File(file) => file,
            Store::Points(points) => return points.read(&self.path, node),
        };
        let mut columns = Vec::with_capacity(record.columns.len());
        for (column, stored) in self.directory.columns.iter().zip(&record.columns) {
            if stored.length == 0 {
                continue;
            }
            let name = &column.name;
            let part = (stored.offset, u64::from(stored.length), stored.crc);
            let what = || format!("column `{name}` of node {node}");
            let bytes = read(file, &self.path, part, &what())?;
            let n_values = record.n_surfels as usize * column.components as usize;
            memory::ask((n_values * column.element.size()) as u64)
                .map_err(|out| fault(format!("{}: {out}", what())))?;
            let values = codec::decode(&bytes, stored.encoding, column.element, n_values);
            let values = values.ok_or_else(|| {
                fault(damaged(&format!("{} does not hold what it announces", what())))
            })?;
            columns.push(Column::new(name.as_str(), column.components, values));
        }
        // Only where others say that there are as many.
        let is_known = !columns.is_empty();
        let stored = self.directory.columns.iter().zip(&record.columns);
        let absent = stored.filter(|(_, stored)| is_known && stored.length == 0);
        columns.extend(absent.filter_map(|(column, _)| missing(column, record.n_surfels)));
        let cloud = Cloud::new(record.origin, columns)
            .map_err(|error| fault(damaged(&format!("node {node}: {error}"))))?;
        Ok(cloud.with_source(self.source.clone()))
    }

    /// The finest nodes that cover the whole with at most so many surfels, and at least the root.
    #[must_use]
    pub fn overview(&self, at_most: u64) -> Vec<u32> {
        let n = |node: &u32| u64::from(self.nodes[*node as usize].n_surfels);
        let mut cut = vec![0];
        loop {
            let finer: Vec<u32> = cut
                .iter()
                .flat_map(|&node| {
                    let record = &self.nodes[node as usize];
                    let [first, count] = record.children;
                    if record.is_leaf() { node..node + 1 } else { first..first + count }
                })
                .collect();
            if finer == cut || finer.iter().map(n).sum::<u64>() > at_most {
                return cut;
            }
            cut = finer;
        }
    }

    /// The whole as one cloud of at most so many merged surfels, and at least those of the root: columns that some of
    /// its nodes lack are left out.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn overview_cloud(&self, at_most: u64) -> Result<Cloud, PyramidError> {
        let clouds = self.overview(at_most).into_iter().map(|node| self.read(node));
        let clouds = clouds.collect::<Result<Vec<_>, _>>()?;
        // Cells that turn out to be empty have no columns either.
        let clouds: Vec<&Cloud> = clouds.iter().filter(|cloud| !cloud.is_empty()).collect();
        let cloud = together(&clouds, self.origin(), Missing::LeftOut)
            .map_err(|error| PyramidError::file(&self.path, error.to_string()))?;
        let camera_frame = surfelshop_cloud::camera_frame(&cloud, &self.source);
        let is_on_map = surfelshop_cloud::lies_on_map(&cloud, &self.source);
        let source = Source { camera_frame, is_on_map, ..self.source.clone() };
        Ok(cloud.with_source(source).with_object(self.object()))
    }

    /// The nodes that cover what `concerns` says yes of, as fine as they can be with at most so many surfels: the coarsest
    /// are refined first. Ascending; none where the root is not concerned.
    #[must_use]
    pub fn cut_of(&self, concerns: impl Fn(u32) -> bool, at_most: u64) -> Vec<u32> {
        let n = |node: u32| u64::from(self.nodes[node as usize].n_surfels);
        let coarse = |node: u32| (self.nodes[node as usize].grain.to_bits(), Reverse(node));
        let mut open: BinaryHeap<_> =
            [0].into_iter().filter(|&root| concerns(root)).map(coarse).collect();
        let mut n_surfels: u64 = open.iter().map(|(_, Reverse(node))| n(*node)).sum();
        let mut cut = Vec::new();
        while let Some((_, Reverse(node))) = open.pop() {
            let [first, count] = self.nodes[node as usize].children;
            let finer: Vec<u32> = (first..first + count).filter(|&child| concerns(child)).collect();
            let refined = n_surfels - n(node) + finer.iter().map(|&child| n(child)).sum::<u64>();
            if count == 0 || refined > at_most.max(n_surfels) {
                cut.push(node);
                continue;
            }
            n_surfels = refined;
            open.extend(finer.into_iter().map(coarse));
        }
        cut.sort_unstable();
        cut
    }

    /// The whole with something done to it, as one cloud: as fine as it needs to have `at_least` surfels, of nodes with at
    /// most `at_most` before. Nodes of which `is_there` says that nothing is left are not read. Nothing where no surfel is
    /// found.
    ///
    /// # Errors
    /// As [`read`](Self::read), and what `change` says.
    pub fn changed_overview(
        &self,
        (at_least, at_most): (u64, u64),
        is_there: impl Fn(u32) -> bool,
        change: impl Fn(u32, Cloud) -> Result<Cloud, String>,
    ) -> Result<Option<Cloud>, PyramidError> {
        let mut cut: Vec<u32> = [0].into_iter().filter(|&root| is_there(root)).collect();
        loop {
            let changed = |&node: &u32| {
                change(node, self.read(node)?).map_err(|line| PyramidError::file(&self.path, line))
            };
            let clouds = cut.iter().map(changed).collect::<Result<Vec<_>, _>>()?;
            let n: u64 = clouds.iter().map(|cloud| cloud.len() as u64).sum();
            let finer = cut.iter().flat_map(|&node| {
                let record = &self.nodes[node as usize];
                let [first, count] = record.children;
                if record.is_leaf() { node..node + 1 } else { first..first + count }
            });
            let finer: Vec<u32> = finer.filter(|&node| is_there(node)).collect();
            let more: u64 =
                finer.iter().map(|&node| u64::from(self.nodes[node as usize].n_surfels)).sum();
            if n < at_least && finer != cut && more <= at_most {
                cut = finer;
                continue;
            }
            let clouds: Vec<&Cloud> = clouds.iter().filter(|cloud| !cloud.is_empty()).collect();
            if clouds.is_empty() {
                return Ok(None);
            }
            let cloud = together(&clouds, self.origin(), Missing::LeftOut)
                .map_err(|error| PyramidError::file(&self.path, error.to_string()))?;
            return Ok(Some(cloud.with_object(self.object())));
        }
    }

    /// The box that textures are fastened to: that of the same cloud in memory.
    #[must_use]
    pub fn object(&self) -> ObjectFrame {
        let [low, high] = self.directory.bounds;
        ObjectFrame::around(low, high, 2.0 * f64::from(self.directory.largest_radius))
    }

    /// The world position that the surfels of the root are relative to.
    #[must_use]
    pub fn origin(&self) -> DVec3 {
        self.nodes.first().map_or(DVec3::ZERO, |root| root.origin)
    }
}

/// What becomes of columns that some of several clouds lack.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Missing {
    /// They are left out.
    LeftOut,
    /// Those of the first cloud stay, with zeros where others lack them.
    Zero,
}

/// Several clouds as one around an origin.
pub(crate) fn together(
    clouds: &[&Cloud],
    origin: DVec3,
    missing: Missing,
) -> Result<Cloud, CloudError> {
    let mut columns = Vec::new();
    for column in clouds.first().into_iter().flat_map(|first| first.columns()) {
        let (name, n, element) = (column.name(), column.components(), column.values().element());
        let rows = clouds.iter().map(|cloud| cloud.len()).sum::<usize>();
        let mut values = Buffer::with_capacity(element, rows * n as usize);
        let mut is_whole = true;
        for cloud in clouds {
            let found = cloud
                .column(name)
                .filter(|found| found.components() == n && found.values().element() == element);
            match found {
                Some(_) if name == POSITION && cloud.origin() != origin => {
                    let offset = cloud.origin() - origin;
                    let moved = cloud.positions().iter().map(|p| offset + p.as_dvec3());
                    moved.flat_map(|p| p.to_array()).for_each(|x| {
                        values.push(x);
                    });
                }
                // They are of one type, so what can fail is memory.
                Some(found) => values.append(&found.values().as_values()).map_err(|error| {
                    CloudError::Edit {
                        expected: "memory for several clouds as one".to_owned(),
                        found: error.to_string(),
                    }
                })?,
                None => {
                    is_whole = false;
                    (0..cloud.len() * n as usize).for_each(|_| {
                        values.push(0.0);
                    });
                }
            }
        }
        if is_whole || missing == Missing::Zero {
            columns.push(Column::new(name, n, values));
        }
    }
    Cloud::new(origin, columns)
}

/// What stands for a column that a node does not have, where something must.
fn missing(column: &FileColumn, n_surfels: u32) -> Option<Column> {
    let is_planarity = column.name == surfelshop_api::columns::PLANARITY
        && column.element == Element::F32
        && column.components == 1;
    let ones = || Buffer::F32(vec![1.0; n_surfels as usize]);
    is_planarity.then(|| Column::new(column.name.as_str(), 1, ones()))
}

/// Opens a pyramid as far as its directory.
fn head(path: &Path) -> Result<(SystemFile, Header, Directory), PyramidError> {
    let fault = |line: String| PyramidError::file(path, line);
    let (file, metadata) = files::open(path).map_err(|found| fault(found.to_string()))?;
    let length = metadata.len();
    let file = SystemFile::new(file, length);
    let mut bytes = [0; HEADER];
    if length < HEADER as u64 {
        return Err(fault(format!(
            "expected a pyramid of at least {HEADER} bytes, found {length}"
        )));
    }
    read_into(&file, path, 0, &mut bytes)?;
    let header = Header::of(&bytes, length).map_err(fault)?;
    let directory = read(&file, path, header.directory, "its directory")?;
    let directory = layout::directory(&directory).map_err(fault)?;
    Ok((file, header, directory))
}

/// Reads a part of the file that has a checksum.
fn read(
    file: &SystemFile,
    path: &Path,
    (offset, length, crc): (u64, u64, u32),
    what: &str,
) -> Result<Vec<u8>, PyramidError> {
    let length = usize::try_from(length).unwrap_or(usize::MAX);
    let mut bytes: Vec<u8> = memory::with_room(length)
        .map_err(|out| PyramidError::file(path, format!("{what}: {out}")))?;
    bytes.resize(length, 0);
    read_into(file, path, offset, &mut bytes)?;
    if crc32fast::hash(&bytes) != crc {
        let line = damaged(&format!("{what} does not have its checksum"));
        return Err(PyramidError::file(path, line));
    }
    Ok(bytes)
}

fn read_into(
    file: &SystemFile,
    path: &Path,
    offset: u64,
    mut bytes: &mut [u8],
) -> Result<(), PyramidError> {
    let mut at = offset;
    while !bytes.is_empty() {
        let n =
            file.read_at(at, bytes).map_err(|error| PyramidError::file(path, error.to_string()))?;
        if n == 0 {
            let line = format!("expected more bytes at {at}, found the file's end; copy it again");
            return Err(PyramidError::file(path, line));
        }
        at += n as u64;
        bytes = bytes.get_mut(n..).unwrap_or_default();
    }
    Ok(())
}
