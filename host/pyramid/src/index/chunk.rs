//! A chunk: its points with those around, what they lack estimated, as leaves and the nodes above them.

use super::around::Around;
use super::cells::{Cell, Cube, LEVELS};
use super::merged::{self, NODE};
use super::nodes::{Coarse, Made, Node, NodeFile};
use super::plan::Plan;
use super::spool::{SpoolReader, buffers};
use crate::error::PyramidError;
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;
use std::path::{Path, PathBuf};
use surfelshop_api::columns::Element;
use surfelshop_api::format::{CloudHeader, FileColumn};
use surfelshop_cloud::convert::{Collection, assembled};
use surfelshop_cloud::{Buffer, Cloud, Column, Progress, ReadOptions, Summary, files};
use surfelshop_geometry::{Bounds, part};

/// Spacings of a surface that estimates look beyond a chunk: normals of rough points are fitted to up to 1024 of those
/// around, a patch of 18 spacings to all sides.
const HALO: f64 = 18.0;

/// Points from which on the spacing can be told from their number; of fewer all around are looked at.
const FEW: usize = 1000;

/// Points around are at most one for so many of the chunk's own.
const MOST_AROUND: usize = 2;

/// The column that says which points are of the chunk.
const OWN: &str = "surfelshop own";

/// What is known of all chunks.
pub(super) struct Chunks<'a> {
    pub(super) plan: &'a Plan,
    pub(super) collection: &'a Collection,
    pub(super) cube: Cube,
    pub(super) folder: &'a Path,
    pub(super) read: ReadOptions<'a>,
}

/// What was done to the points of a chunk.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Counts {
    pub(super) n_surfels: u64,
    pub(super) normals_estimated: u64,
    pub(super) radii_estimated: u64,
    pub(super) scattered: u64,
    pub(super) of_unsure_side: u64,
    pub(super) largest_radius: f32,
    pub(super) warnings: Vec<String>,
}

impl Chunks<'_> {
    fn path(&self, number: usize) -> PathBuf {
        self.folder.join(format!("chunk-{number}.bin"))
    }

    /// The nodes of a chunk; those of an earlier run, where it made them.
    pub(super) fn made(
        &self,
        number: usize,
        progress: Progress<'_>,
    ) -> Result<(Option<Made>, Counts), PyramidError> {
        let path = self.path(number);
        let list = path.with_extension("json");
        if let Ok(text) = std::fs::read(&list)
            && let Ok((known, counts)) = serde_json::from_slice::<(Option<Made>, Counts)>(&text)
            && path.metadata().is_ok_and(|found| Some(found.len()) == stored(known.as_ref()))
        {
            return Ok((known, counts));
        }
        let made = self.make(number, &path, progress)?;
        let text =
            serde_json::to_vec(&made).map_err(|error| PyramidError::Points(error.to_string()))?;
        files::write_whole(&list, &text).map_err(PyramidError::io(&list))?;
        Ok(made)
    }

    fn make(
        &self,
        number: usize,
        path: &Path,
        progress: Progress<'_>,
    ) -> Result<(Option<Made>, Counts), PyramidError> {
        let (cell, _) = self.plan.chunks[number];
        let (header, columns) = self.points(number)?;
        let options = ReadOptions { progress: &part(progress, 0.05..0.85), ..self.read };
        let loaded = assembled(&header, columns, self.collection.source.clone(), &options);
        let loaded = match loaded {
            Ok(loaded) => loaded,
            Err(surfelshop_cloud::ReadFault::Cancelled) => {
                return Err(PyramidError::Cancelled(self.folder.to_owned()));
            }
            Err(fault) => return Err(PyramidError::Points(fault.to_string())),
        };
        let counts = counts(&loaded.summary);
        let cloud = own(&loaded.cloud)?;
        drop(loaded);
        let counts = Counts {
            n_surfels: cloud.len() as u64,
            largest_radius: cloud.radii().iter().copied().fold(0.0, f32::max),
            ..counts
        };
        if cloud.is_empty() {
            NodeFile::create(path)?.finish()?;
            return Ok((None, counts));
        }
        let codes = self.ordered(&cloud, cell);
        let mut file = NodeFile::create(path)?;
        let keys: Vec<u64> = codes.iter().map(|(code, _)| *code).collect();
        let rows: Vec<u32> = codes.into_iter().map(|(_, row)| row).collect();
        let mut tree = Tree { cloud: &cloud, keys: &keys, rows: &rows, file: &mut file };
        let node = tree.node(cell, 0..keys.len())?;
        file.finish()?;
        Ok((Some(node.made), counts))
    }

    /// The surfels along the curve.
    fn ordered(&self, cloud: &Cloud, cell: Cell) -> Vec<(u64, u32)> {
        let (origin, cube) = (cloud.origin(), self.cube);
        let code = |(row, position): (usize, &glam::Vec3)| {
            (cube.code_in(origin + position.as_dvec3(), cell), row as u32)
        };
        let mut codes: Vec<(u64, u32)> =
            cloud.positions().par_iter().enumerate().map(code).collect();
        codes.par_sort_unstable();
        codes
    }

    /// The points of a chunk and, behind them, those around that estimates look at; a column says which is which.
    fn points(&self, number: usize) -> Result<(CloudHeader, Vec<Buffer>), PyramidError> {
        let (_, range) = self.plan.chunks[number].clone();
        let header = &self.collection.header;
        let mut bytes = vec![Vec::new(); header.columns.len()];
        let mut bounds: Option<Bounds> = None;
        let mut n_own = 0;
        let mut reader = SpoolReader::new(header);
        for (file, segment) in self.plan.cells[range.clone()].iter().flat_map(|c| &c.segments) {
            let rows = reader.read(&self.plan.spools[*file].path, segment)?;
            for (all, bytes) in bytes.iter_mut().zip(&rows.columns) {
                all.extend_from_slice(bytes);
            }
            let [min, max] = segment.bounds;
            let known = bounds.get_or_insert(Bounds { min, max });
            *known = Bounds { min: known.min.min(min), max: known.max.max(max) };
            n_own += rows.positions.len();
        }
        let n_around = match bounds {
            Some(bounds) => self.around(number, (bounds, n_own), &mut reader, &mut bytes)?,
            None => 0,
        };
        let mut columns = buffers(header, &bytes);
        let mut header = CloudHeader { rows: None, bounds: None, ..header.clone() };
        header.columns.push(FileColumn::new(OWN, 1, Element::U8));
        let mut is_own = vec![1u8; n_own];
        is_own.resize(n_own + n_around, 0);
        columns.push(Buffer::U8(is_own));
        Ok((header, columns))
    }

    /// Appends the nearest points around a chunk; how many they are.
    fn around(
        &self,
        number: usize,
        (bounds, n_own): (Bounds, usize),
        reader: &mut SpoolReader<'_>,
        bytes: &mut [Vec<u8>],
    ) -> Result<usize, PyramidError> {
        if self.lacks_nothing() {
            return Ok(0);
        }
        let (cell, range) = self.plan.chunks[number].clone();
        let side = (bounds.max - bounds.min).max_element();
        let reach = match n_own {
            0..FEW => cell.bounds(&self.cube).extent().max(side),
            n => (HALO * side / (n as f64).sqrt()).min(side),
        };
        let sizes: Vec<usize> =
            self.collection.header.columns.iter().map(FileColumn::point_bytes).collect();
        let mut around = Around::new(bounds, reach, FEW.max(n_own / MOST_AROUND), &sizes);
        for (number, points) in self.plan.cells.iter().enumerate() {
            if range.contains(&number) {
                continue;
            }
            for (file, segment) in &points.segments {
                if around.may_take(segment.bounds) {
                    around.take(&reader.read(&self.plan.spools[*file].path, segment)?);
                }
            }
        }
        Ok(around.append_to(bytes))
    }

    /// Whether nothing has to be estimated.
    fn lacks_nothing(&self) -> bool {
        let has = |name: &str| self.collection.all_have(name);
        let has_radius = has(surfelshop_api::columns::RADIUS) || self.read.radius.is_some();
        has(surfelshop_api::columns::NORMAL) && has_radius
    }
}

/// Bytes of a chunk's file.
fn stored(made: Option<&Made>) -> Option<u64> {
    let Some(made) = made else { return Some(0) };
    let beneath = made.children.iter().map(|child| stored(Some(child)));
    beneath.sum::<Option<u64>>()?.checked_add(made.record.stored_bytes())
}

fn counts(summary: &Summary) -> Counts {
    Counts {
        normals_estimated: summary.normals.estimated,
        radii_estimated: summary.radii.estimated,
        scattered: summary.normals.scattered,
        of_unsure_side: summary.normals.of_unsure_side,
        warnings: summary.warnings.clone(),
        ..Counts::default()
    }
}

/// The surfels of the chunk itself.
fn own(cloud: &Cloud) -> Result<Cloud, PyramidError> {
    let Some(Buffer::U8(own)) = cloud.column(OWN).map(Column::values) else {
        return Err(PyramidError::Points("the points of a part cannot be told apart".to_owned()));
    };
    let mask: Vec<bool> = own.iter().map(|&own| own != 0).collect();
    let kept = cloud.without_column(OWN);
    kept.keep(&mask).map_err(|error| PyramidError::Points(error.to_string()))
}

/// The tree of a chunk.
struct Tree<'a> {
    cloud: &'a Cloud,
    keys: &'a [u64],
    rows: &'a [u32],
    file: &'a mut NodeFile,
}

impl Tree<'_> {
    /// The node of a cell and all beneath it.
    fn node(&mut self, cell: Cell, range: Range<usize>) -> Result<Node, PyramidError> {
        if range.len() <= NODE {
            return self.leaf(cell, &self.rows[range]);
        }
        if cell.level >= LEVELS {
            return self.halved(cell, self.rows[range].to_vec());
        }
        let mut parts = Vec::new();
        let mut start = range.start;
        for child in cell.children() {
            let n = self.keys[start..range.end].partition_point(|&key| key < child.end());
            if n > 0 {
                parts.push((child, start..start + n));
            }
            start += n;
        }
        if let [(child, range)] = parts.as_slice() {
            return self.node(*child, range.clone());
        }
        let mut nodes = Vec::with_capacity(parts.len());
        for (child, range) in parts {
            nodes.push(self.node(child, range)?);
        }
        joined(cell, nodes, self.file)
    }

    /// More surfels than a node has in one of the smallest cells: halves across the longest side.
    fn halved(&mut self, cell: Cell, mut rows: Vec<u32>) -> Result<Node, PyramidError> {
        if rows.len() <= NODE {
            return self.leaf(cell, &rows);
        }
        let positions = self.cloud.positions();
        let at = |row: u32| positions[row as usize];
        let none = (glam::Vec3::INFINITY, glam::Vec3::NEG_INFINITY);
        let (low, high) =
            rows.iter().fold(none, |(low, high), &row| (low.min(at(row)), high.max(at(row))));
        let axis = (high - low).max_position();
        let middle = rows.len() / 2;
        rows.select_nth_unstable_by(middle, |&a, &b| {
            at(a)[axis].total_cmp(&at(b)[axis]).then(a.cmp(&b))
        });
        let upper = rows.split_off(middle);
        let nodes = vec![self.halved(cell, rows)?, self.halved(cell, upper)?];
        joined(cell, nodes, self.file)
    }

    fn leaf(&mut self, cell: Cell, rows: &[u32]) -> Result<Node, PyramidError> {
        let mut columns = Vec::new();
        for column in self.cloud.columns() {
            let values = column.values().gather(column.components() as usize, rows);
            let values = values.map_err(|out| PyramidError::Points(out.to_string()))?;
            columns.push(Column::new(column.name(), column.components(), values));
        }
        let cloud = Cloud::new(self.cloud.origin(), columns);
        let cloud = cloud.map_err(|error| PyramidError::Points(error.to_string()))?;
        self.file.put(cell, cloud, Coarse::default(), Vec::new())
    }
}

/// The node above several.
pub(super) fn joined(
    cell: Cell,
    nodes: Vec<Node>,
    file: &mut NodeFile,
) -> Result<Node, PyramidError> {
    let (made, clouds): (Vec<Made>, Vec<Cloud>) =
        nodes.into_iter().map(|node| (node.made, node.cloud)).unzip();
    let apart: Vec<f32> = made.iter().map(|made| made.record.apart).collect();
    let origin = clouds.first().map_or(DVec3::ZERO, Cloud::origin);
    let merged = merged::merged(&clouds, &apart, origin);
    let merged = merged.map_err(|error| PyramidError::Points(error.to_string()))?;
    drop(clouds);
    let coarse = Coarse { grain: merged.grain, apart: merged.apart };
    file.put(cell, merged.cloud, coarse, made)
}
