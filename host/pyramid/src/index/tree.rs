//! Nodes over surfels in the order of a space-filling curve.

use super::cells::{Cell, Cube, LEVELS};
use super::merged::{self, NODE};
use super::nodes::{Coarse, Made, Node, NodeFile, Rule};
use crate::error::PyramidError;
use crate::pyramid::{Missing, together};
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;
use surfelshop_api::columns::RADIUS;
use surfelshop_cloud::{Buffer, Cloud, CloudError, Column, silent};
use surfelshop_geometry::{Cancelled, thinning};

/// Divides the surfels of a cell into leaves, and merges those above them; the highest node.
pub(crate) fn tree(
    cloud: &Cloud,
    cube: &Cube,
    cell: Cell,
    file: &mut NodeFile,
) -> Result<Node, PyramidError> {
    let origin = cloud.origin();
    let code = |(row, position): (usize, &glam::Vec3)| {
        (cube.code_in(origin + position.as_dvec3(), cell), row as u32)
    };
    let mut codes: Vec<(u64, u32)> = cloud.positions().par_iter().enumerate().map(code).collect();
    codes.par_sort_unstable();
    let keys: Vec<u64> = codes.iter().map(|(code, _)| *code).collect();
    let rows: Vec<u32> = codes.into_iter().map(|(_, row)| row).collect();
    Tree { cloud, keys: &keys, rows: &rows, file }.node(cell, 0..keys.len())
}

/// The tree of a part.
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
pub(crate) fn joined(
    cell: Cell,
    nodes: Vec<Node>,
    file: &mut NodeFile,
) -> Result<Node, PyramidError> {
    let (made, clouds): (Vec<Made>, Vec<Cloud>) =
        nodes.into_iter().map(|node| (node.made, node.cloud)).unzip();
    let apart: Vec<f32> = made.iter().map(|made| made.record.apart).collect();
    let origin = clouds.first().map_or(DVec3::ZERO, Cloud::origin);
    let merged = merged::merged(&clouds, &apart, origin);
    let fault = |error: CloudError| PyramidError::Points(error.to_string());
    let merged = merged.map_err(fault)?;
    let coarse = Coarse { grain: merged.grain, apart: merged.apart };
    let cloud = match file.rule {
        Rule::Merged => merged.cloud,
        Rule::Sampled => sampled(&clouds, merged.cloud.len(), origin).map_err(fault)?,
    };
    drop(clouds);
    file.put(cell, cloud, coarse, made)
}

/// About so many surfels of several clouds, one of each cell of a grid, as large as they have to be to cover the same.
fn sampled(clouds: &[Cloud], n: usize, origin: DVec3) -> Result<Cloud, CloudError> {
    let all: Vec<&Cloud> = clouds.iter().collect();
    let whole = together(&all, origin, Missing::Zero)?;
    let stopped = |_stopped: Cancelled| CloudError::Edit {
        expected: "an end".to_owned(),
        found: "a wish to stop".to_owned(),
    };
    let edge = thinning::edge_for(whole.positions(), n, &silent).map_err(stopped)?;
    let mask = thinning::one_per_cube(whole.positions(), edge, &silent).map_err(stopped)?;
    let kept = whole.keep(&mask)?;
    let factor = (whole.len() as f64 / kept.len().max(1) as f64).sqrt() as f32;
    let radii = kept.radii().iter().map(|radius| radius * factor).collect();
    kept.with_columns(vec![Column::new(RADIUS, 1, Buffer::F32(radii))])
}
