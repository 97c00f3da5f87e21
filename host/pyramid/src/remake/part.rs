//! A part of a pyramid: its surfels with those around it, and what they are changed to as nodes.

use super::context;
use super::{Counts, Known, Remaking};
use crate::error::PyramidError;
use crate::index::cells::{Cell, Cube};
use crate::index::merged::NODE;
use crate::index::nodes::{Coarse, Made, Node, NodeFile, Rule};
use crate::index::tree::{joined, tree};
use crate::pyramid::{Missing, Pyramid, together};
use glam::DVec3;
use std::ops::Range;
use std::path::Path;
use surfelshop_api::Scope;
use surfelshop_api::columns::{CONTEXT, POSITION};
use surfelshop_cloud::{Buffer, Cloud, CloudError, Column, EditedCloud, How, Progress};
use surfelshop_geometry::{Bounds, part as share};

/// A node with all that is beneath it.
pub(super) struct Part<'a> {
    pub(super) pyramid: &'a Pyramid,
    pub(super) node: u32,
    pub(super) scope: Scope,
    pub(super) rule: Rule,
}

/// A cell of a level: where nodes keep their places, the rest of it is not looked at.
pub(super) fn cell(level: u32) -> Cell {
    Cell { level, ..Cell::ROOT }
}

/// What a node becomes before it is known whether it is one of its own.
enum Beneath {
    Leaf(Cell, Box<Cloud>),
    Node(Box<Node>),
}

fn fault(error: CloudError) -> PyramidError {
    PyramidError::Points(error.to_string())
}

impl Part<'_> {
    /// The part as `change` makes it, its nodes written to a file.
    pub(super) fn changed(
        &self,
        path: &Path,
        progress: Progress<'_>,
        known: &Known,
        remaking: &mut Remaking<'_>,
    ) -> Result<(Option<Made>, Counts), PyramidError> {
        let leaves = self.leaves();
        let leaves = leaves.into_iter().map(|leaf| self.pyramid.read(leaf));
        let change = match remaking {
            Remaking::Parts(change) => change,
            Remaking::Leaves(change) => {
                let change = |leaf: Result<Cloud, _>| change(leaf?).map_err(PyramidError::Points);
                return self.changed_leaves(path, leaves.map(change));
            }
        };
        let leaves = leaves.collect::<Result<Vec<_>, _>>()?;
        let (given, n_own, bounds) = self.given(&leaves)?;
        let edited = change(&given, &share(progress, 0.05..0.85)).map_err(PyramidError::Points)?;
        drop(given);
        let mut file = NodeFile::create(path)?;
        file.rule = self.rule;
        let (mut columns, mut at_border, mut largest_radius) = (Vec::new(), Vec::new(), 0f32);
        let mut largest = |cloud: &Cloud| {
            largest_radius = cloud.radii().iter().copied().fold(largest_radius, f32::max);
        };
        let top = match edited {
            None => {
                leaves.iter().for_each(largest);
                self.rebuilt(leaves, &mut file)?
            }
            Some(edited) => {
                columns.clone_from(&edited.columns);
                let is_moved = columns.iter().any(|name| name == POSITION);
                if matches!(edited.whole, Some(How::Derived | How::Enlarged)) || is_moved {
                    drop(leaves);
                    let cloud = of_part(&edited, n_own, bounds, known)?;
                    at_border = over_border(&cloud, bounds);
                    largest(&cloud);
                    self.anew(&cloud, &mut file)?
                } else {
                    let leaves = in_leaves(&leaves, &edited).map_err(fault)?;
                    drop(edited);
                    leaves.iter().for_each(largest);
                    self.rebuilt(leaves, &mut file)?
                }
            }
        };
        file.finish()?;
        columns.retain(|name| name != CONTEXT);
        let made = top.map(|node| node.made);
        let n_surfels = made.as_ref().map_or(0, |made| made.record.n_beneath);
        Ok((made, Counts { at_border, n_surfels, largest_radius, columns }))
    }

    /// The part with other leaves, its nodes written to a file.
    fn changed_leaves(
        &self,
        path: &Path,
        leaves: impl Iterator<Item = Result<Cloud, PyramidError>>,
    ) -> Result<(Option<Made>, Counts), PyramidError> {
        let leaves = leaves.collect::<Result<Vec<_>, _>>()?;
        let radii = leaves.iter().flat_map(|leaf| leaf.radii());
        let largest_radius = radii.copied().fold(0.0, f32::max);
        let mut file = NodeFile::create(path)?;
        file.rule = self.rule;
        let top = self.rebuilt(leaves, &mut file)?;
        file.finish()?;
        let made = top.map(|node| node.made);
        let n_surfels = made.as_ref().map_or(0, |made| made.record.n_beneath);
        Ok((made, Counts { n_surfels, largest_radius, ..Counts::default() }))
    }

    /// The leaves beneath, in their order.
    fn leaves(&self) -> Vec<u32> {
        let (mut leaves, mut open) = (Vec::new(), vec![self.node]);
        while let Some(node) = open.pop() {
            let [first, count] = self.pyramid.nodes()[node as usize].children;
            open.extend((first..first + count).rev());
            if count == 0 {
                leaves.push(node);
            }
        }
        leaves
    }

    /// What is changed: the part's own surfels, how many they are, and those around them; and the box of the former.
    fn given(&self, leaves: &[Cloud]) -> Result<(Cloud, usize, Bounds), PyramidError> {
        let origin = leaves.first().map_or_else(|| self.pyramid.origin(), Cloud::origin);
        let n_own: usize = leaves.iter().map(Cloud::len).sum();
        let boxes = leaves.iter().filter_map(|leaf| {
            let own = Bounds::of_positions(leaf.positions())?;
            Some(Bounds { min: leaf.origin() + own.min, max: leaf.origin() + own.max })
        });
        let both = |a: Bounds, b: Bounds| Bounds { min: a.min.min(b.min), max: a.max.max(b.max) };
        let bounds = boxes.reduce(both);
        let bounds = bounds.unwrap_or(Bounds { min: origin, max: origin });
        let around = context::around(self.pyramid, self.node, (bounds, n_own), self.scope)?;
        let all: Vec<&Cloud> = leaves.iter().chain(&around).collect();
        let cloud = together(&all, origin, Missing::Zero).map_err(fault)?;
        let mut is_context = vec![0u8; n_own];
        is_context.resize(cloud.len(), 1);
        let context = Column::new(CONTEXT, 1, Buffer::U8(is_context));
        let cloud = cloud.with_columns(vec![context]).map_err(fault)?;
        let source = self.pyramid.directory().source.of_cloud();
        Ok((cloud.with_source(source).with_object(self.pyramid.object()), n_own, bounds))
    }

    /// The same nodes with other leaves; those that have become small enough are one.
    fn rebuilt(
        &self,
        leaves: Vec<Cloud>,
        file: &mut NodeFile,
    ) -> Result<Option<Node>, PyramidError> {
        let mut leaves = leaves.into_iter();
        match self.beneath(self.node, &mut leaves, file)? {
            None => Ok(None),
            Some(beneath) => stored(beneath, file).map(Some),
        }
    }

    fn beneath(
        &self,
        node: u32,
        leaves: &mut std::vec::IntoIter<Cloud>,
        file: &mut NodeFile,
    ) -> Result<Option<Beneath>, PyramidError> {
        let record = &self.pyramid.nodes()[node as usize];
        let cell = cell(record.level);
        if record.is_leaf() {
            let leaf = leaves.next().filter(|leaf| !leaf.is_empty());
            return Ok(leaf.map(|leaf| Beneath::Leaf(cell, Box::new(leaf))));
        }
        let [first, count] = record.children;
        let mut children = Vec::new();
        for child in first..first + count {
            children.extend(self.beneath(child, leaves, file)?);
        }
        if children.len() < 2 {
            return Ok(children.pop());
        }
        let small = children.iter().map(|child| match child {
            Beneath::Leaf(_, leaf) => Some(&**leaf),
            Beneath::Node(_) => None,
        });
        if let Some(small) = small.collect::<Option<Vec<&Cloud>>>()
            && small.iter().map(|leaf| leaf.len()).sum::<usize>() <= NODE
        {
            let origin = small.first().map_or(self.pyramid.origin(), |leaf| leaf.origin());
            let one = together(&small, origin, Missing::Zero).map_err(fault)?;
            return Ok(Some(Beneath::Leaf(cell, Box::new(one))));
        }
        let nodes = children.into_iter().map(|child| stored(child, file));
        let nodes = nodes.collect::<Result<Vec<_>, _>>()?;
        Ok(Some(Beneath::Node(Box::new(joined(cell, nodes, file)?))))
    }

    /// Nodes of other surfels.
    fn anew(&self, cloud: &Cloud, file: &mut NodeFile) -> Result<Option<Node>, PyramidError> {
        let Some(own) = Bounds::of_positions(cloud.positions()) else { return Ok(None) };
        let (low, high) = (cloud.origin() + own.min, cloud.origin() + own.max);
        let cube = Cube::around([low, high]);
        let mut node = tree(cloud, &cube, Cell::ROOT, file)?;
        lowered(&mut node.made, self.pyramid.nodes()[self.node as usize].level);
        Ok(Some(node))
    }
}

/// Puts a leaf into the file.
fn stored(beneath: Beneath, file: &mut NodeFile) -> Result<Node, PyramidError> {
    match beneath {
        Beneath::Node(node) => Ok(*node),
        Beneath::Leaf(cell, cloud) => file.put(cell, *cloud, Coarse::default(), Vec::new()),
    }
}

/// Nodes so many levels further down.
fn lowered(made: &mut Made, levels: u32) {
    made.record.level += levels;
    made.children.iter_mut().for_each(|child| lowered(child, levels));
}

/// Centres of surfels that reach over the border of a part.
fn over_border(cloud: &Cloud, bounds: Bounds) -> Vec<DVec3> {
    let reaches_over = |(i, &radius): (usize, &f32)| {
        let (place, radius) = (cloud.world_position(i)?, f64::from(radius));
        let inner = Bounds { min: bounds.min + radius, max: bounds.max - radius };
        (context::away(&inner, place) > 0.0).then_some(place)
    };
    cloud.radii().iter().enumerate().filter_map(reaches_over).collect()
}

/// The surfels of the part: of new ones those that reach into its box and that no part before has, since what a
/// neighbouring part covers of the surface it need not cover in the same way.
fn of_part(
    edited: &EditedCloud,
    n_own: usize,
    bounds: Bounds,
    known: &Known,
) -> Result<Cloud, PyramidError> {
    let cloud = &edited.cloud;
    let mask: Vec<bool> = match (edited.whole, &edited.kept) {
        (Some(How::Derived), _) => {
            let radii = cloud.radii();
            let reaches = |i: usize| {
                let radius = f64::from(radii.get(i).copied().unwrap_or_default());
                let is_new = |at| context::away(&bounds, at) <= radius && !known.has(at);
                cloud.world_position(i).is_some_and(is_new)
            };
            (0..cloud.len()).map(reaches).collect()
        }
        // Those that were added lie behind the context.
        (Some(How::Enlarged), _) => {
            let first_new = cloud.len() - edited.n_added.min(cloud.len());
            (0..cloud.len()).map(|i| i < n_own || i >= first_new).collect()
        }
        (_, kept) => {
            let n_own = kept.as_ref().map_or(n_own, |kept| count(kept, 0..n_own));
            (0..cloud.len()).map(|i| i < n_own).collect()
        }
    };
    cloud.without_column(CONTEXT).keep(&mask).map_err(fault)
}

fn count(kept: &[bool], range: Range<usize>) -> usize {
    kept[range].iter().filter(|&&kept| kept).count()
}

/// The leaves with the columns that were made, and without the surfels that are gone: positions and all that did not
/// change have the same bits.
fn in_leaves(leaves: &[Cloud], edited: &EditedCloud) -> Result<Vec<Cloud>, CloudError> {
    let (mut before, mut after) = (0, 0);
    let mut changed = Vec::with_capacity(leaves.len());
    for leaf in leaves {
        let rows = before..before + leaf.len();
        before = rows.end;
        let kept = edited.kept.as_deref().map(|kept| &kept[rows.clone()]);
        let leaf = match kept {
            Some(kept) => leaf.keep(kept)?,
            None => leaf.clone(),
        };
        let rows: Vec<u32> = (after..after + leaf.len() as u32).collect();
        after += leaf.len() as u32;
        let mut columns = Vec::new();
        for name in edited.columns.iter().filter(|name| *name != CONTEXT) {
            let Some(column) = edited.cloud.column(name) else { continue };
            let values = column.values().gather(column.components() as usize, &rows);
            let values = values.map_err(|out| CloudError::Edit {
                expected: "memory for the columns of a part".to_owned(),
                found: out.to_string(),
            })?;
            columns.push(Column::new(name.as_str(), column.components(), values));
        }
        changed.push(leaf.with_columns(columns)?);
    }
    Ok(changed)
}
