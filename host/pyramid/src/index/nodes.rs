//! Nodes on their way into the file: their columns are written at once, what is said of them stays in memory.

use super::cells::Cell;
use crate::codec;
use crate::error::PyramidError;
use crate::layout::{NodeRecord, Stored};
use glam::{DVec3, Vec3};
use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use surfelshop_api::columns::PLANARITY;
use surfelshop_api::format::FileColumn;
use surfelshop_cloud::{Cloud, Column};
use surfelshop_geometry::Bounds;
use surfelshop_geometry::radii::PLANAR;

/// A node that was written.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct Made {
    pub(crate) cell: Cell,
    pub(crate) record: NodeRecord,
    /// Box around all centres beneath, in the world.
    pub(crate) low: DVec3,
    /// See there.
    pub(crate) high: DVec3,
    /// Names of its columns, in the order of the record's.
    pub(crate) columns: Vec<FileColumn>,
    pub(crate) children: Vec<Self>,
    /// The file that its columns are in.
    pub(crate) file: PathBuf,
}

/// A node and its surfels, until they are merged.
pub(crate) struct Node {
    pub(crate) made: Made,
    pub(crate) cloud: Cloud,
}

/// What stands for the surfels beneath a node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rule {
    /// Merged surfels.
    #[default]
    Merged,
    /// As many of them as there would be merged ones, enlarged by as much as there are fewer: to compare with.
    Sampled,
}

/// A file of columns.
pub(crate) struct NodeFile {
    pub(crate) rule: Rule,
    path: PathBuf,
    file: File,
    written: u64,
}

/// How coarse a node is.
#[derive(Clone, Copy, Default)]
pub(crate) struct Coarse {
    pub(crate) grain: f32,
    pub(crate) apart: f32,
}

impl NodeFile {
    pub(crate) fn create(path: &Path) -> Result<Self, PyramidError> {
        let file = File::create(path).map_err(PyramidError::io(path))?;
        Ok(Self { rule: Rule::Merged, path: path.to_owned(), file, written: 0 })
    }

    /// Writes a node's columns.
    pub(crate) fn put(
        &mut self,
        cell: Cell,
        cloud: Cloud,
        coarse: Coarse,
        children: Vec<Made>,
    ) -> Result<Node, PyramidError> {
        use rayon::prelude::*;
        let encoded: Vec<(u32, Vec<u8>)> = cloud
            .columns()
            .par_iter()
            .map(|column| codec::encode(&column.values().as_values()))
            .collect();
        let mut columns = Vec::with_capacity(encoded.len());
        for (encoding, bytes) in encoded {
            let length = u32::try_from(bytes.len()).map_err(|_too_many| {
                PyramidError::Points("a node takes more than 4 GiB".to_owned())
            })?;
            let crc = crc32fast::hash(&bytes);
            columns.push(Stored { offset: self.written, length, encoding, crc });
            self.file.write_all(&bytes).map_err(PyramidError::io(&self.path))?;
            self.written += bytes.len() as u64;
        }
        let mut made = Made {
            cell,
            record: record(&cloud, cell, coarse, &children),
            low: DVec3::INFINITY,
            high: DVec3::NEG_INFINITY,
            columns: cloud.columns().iter().map(file_column).collect(),
            children,
            file: self.path.clone(),
        };
        made.record.columns = columns;
        if let (true, Some(own)) =
            (made.children.is_empty(), Bounds::of_positions(cloud.positions()))
        {
            (made.low, made.high) = (cloud.origin() + own.min, cloud.origin() + own.max);
        }
        for child in &made.children {
            (made.low, made.high) = (made.low.min(child.low), made.high.max(child.high));
        }
        let half = 0.5 * (made.high - made.low);
        made.record.middle = made.low + half;
        made.record.spread = (half.length() * (1.0 + 1e-6)) as f32;
        Ok(Node { made, cloud })
    }

    pub(crate) fn finish(self) -> Result<(), PyramidError> {
        self.file.sync_data().map_err(PyramidError::io(&self.path))
    }
}

fn file_column(column: &Column) -> FileColumn {
    FileColumn::new(column.name(), column.components(), column.values().element())
}

/// What is said of a node, but for where it is.
fn record(cloud: &Cloud, cell: Cell, coarse: Coarse, children: &[Made]) -> NodeRecord {
    let most = |of: fn(&NodeRecord) -> f32| {
        children.iter().map(|child| of(&child.record)).fold(0.0, f32::max)
    };
    let own = cloud.radii().iter().copied().fold(0.0, f32::max);
    let longest = [surfelshop_api::columns::TANGENT_U, surfelshop_api::columns::TANGENT_V]
        .map(|name| cloud.vectors(name).iter().map(|v| v.length()).fold(0.0, f32::max));
    // An ellipse's longer half axis is at most the root of the sum of both squares.
    let ellipse = longest[0].hypot(longest[1]);
    let (axis, cosine) = if children.is_empty() { cone(cloud) } else { cones(children) };
    let n_beneath = children.iter().map(|child| child.record.n_beneath).sum::<u64>();
    NodeRecord {
        children: [0, children.len() as u32],
        n_surfels: cloud.len() as u32,
        level: cell.level,
        origin: cloud.origin(),
        reach: most(|record| record.reach).max(own.max(ellipse)),
        // Never finer than its children, so that what is chosen grows coarser with the distance.
        grain: most(|record| record.grain).max(coarse.grain),
        apart: most(|record| record.apart).max(coarse.apart),
        axis,
        cosine,
        n_beneath: if children.is_empty() { cloud.len() as u64 } else { n_beneath },
        ..NodeRecord::default()
    }
}

const NO_CONE: (Vec3, f32) = (Vec3::Z, -1.0);

/// The cone of a leaf's normals; none where there are round splats, which face every eye.
fn cone(cloud: &Cloud) -> (Vec3, f32) {
    let normals = cloud.normals();
    let is_round = |&planarity: &f32| planarity < PLANAR;
    if cloud.floats(PLANARITY, 1).iter().any(is_round) {
        return NO_CONE;
    }
    let sum: DVec3 = normals.iter().map(|normal| normal.as_dvec3()).sum();
    let Some(axis) = sum.try_normalize().filter(|_| sum.length() > 1e-3 * normals.len() as f64)
    else {
        return NO_CONE;
    };
    let axis = axis.as_vec3();
    let least = normals.iter().map(|normal| normal.dot(axis)).fold(1.0, f32::min);
    // What rounding does to a cosine is a few units in the last place.
    (axis, (least - 1e-5).max(-1.0))
}

/// The cone around those of nodes.
fn cones(children: &[Made]) -> (Vec3, f32) {
    let records = || children.iter().map(|child| &child.record);
    let sum: Vec3 = records().map(|record| record.axis).sum();
    let Some(axis) = sum.try_normalize().filter(|_| records().all(|record| record.cosine > -1.0))
    else {
        return NO_CONE;
    };
    let angle = |record: &NodeRecord| {
        record.axis.dot(axis).clamp(-1.0, 1.0).acos() + record.cosine.clamp(-1.0, 1.0).acos()
    };
    let widest = records().map(angle).fold(0.0, f32::max);
    if widest < std::f32::consts::PI { (axis, (widest.cos() - 1e-5).max(-1.0)) } else { NO_CONE }
}
