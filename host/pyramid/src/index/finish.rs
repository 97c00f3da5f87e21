//! The nodes above the chunks, and the file.

use super::cells::Cell;
use super::chunk::Counts;
use super::nodes::{Made, Node, NodeFile};
use super::spool::OpenFiles;
use super::tree::joined;
use crate::codec;
use crate::error::PyramidError;
use crate::layout::{self, Directory, HEADER, Header, NodeRecord, Stored};
use std::collections::{BTreeMap, VecDeque};
use std::io::Write;
use std::path::Path;
use surfelshop_api::format::FileColumn;
use surfelshop_cloud::convert::Collection;
use surfelshop_cloud::{Cloud, Column, Progress, files};

/// Merges what is above the chunks and writes the file; number of nodes, of leaves, and of bytes.
pub(super) fn finish(
    chunks: Vec<Made>,
    (collection, counts): (&Collection, &Counts),
    output: &Path,
    folder: &Path,
    progress: Progress<'_>,
) -> Result<(u64, u64, u64), PyramidError> {
    let Some(root) = root(chunks, folder, progress)? else {
        return Err(PyramidError::Points(
            "expected points with finite coordinates, found none".to_owned(),
        ));
    };
    let directory = Directory {
        n_surfels: counts.n_surfels,
        largest_radius: counts.largest_radius,
        source: (&collection.source).into(),
        notes: notes(counts),
        ..Directory::default()
    };
    write(&root, directory, output)
}

/// Writes the file of a tree of nodes; `directory` says what does not follow from these. Number of nodes, of leaves,
/// and of bytes.
pub(crate) fn write(
    root: &Made,
    directory: Directory,
    output: &Path,
) -> Result<(u64, u64, u64), PyramidError> {
    let mut order: VecDeque<&Made> = VecDeque::from([root]);
    let mut nodes: Vec<&Made> = Vec::new();
    while let Some(node) = order.pop_front() {
        nodes.push(node);
        order.extend(&node.children);
    }
    let columns = all_columns(&nodes);
    let records = placed(&nodes, &columns);
    let n_leaves = nodes.iter().filter(|node| node.children.is_empty()).count() as u64;
    let directory = Directory {
        generator: format!("surfelshop {}", env!("CARGO_PKG_VERSION")),
        columns,
        n_leaves,
        n_nodes: nodes.len() as u64,
        bounds: [root.low, root.high],
        ..directory
    };
    let bytes = written(&nodes, &records, &directory, output)?;
    Ok((nodes.len() as u64, n_leaves, bytes))
}

/// What was done, in sentences.
fn notes(counts: &Counts) -> Vec<String> {
    let Counts { normals_estimated, radii_estimated, scattered, of_unsure_side, .. } = counts;
    let mut notes = Vec::new();
    if *normals_estimated > 0 {
        let share = |n: &u64| 100.0 * *n as f64 / *normals_estimated as f64;
        notes.push(format!(
            "normals were estimated; {:.1} % of them are of no surface, {:.1} % of uncertain side",
            share(scattered),
            share(of_unsure_side)
        ));
    }
    if *radii_estimated > 0 {
        notes.push("radii were estimated".to_owned());
    }
    notes.extend(counts.warnings.iter().cloned());
    notes
}

/// The root above all chunks.
fn root(
    chunks: Vec<Made>,
    folder: &Path,
    progress: Progress<'_>,
) -> Result<Option<Made>, PyramidError> {
    let path = folder.join("top.bin");
    let (mut file, mut files) = (NodeFile::create(&path)?, OpenFiles::default());
    let mut by_level: BTreeMap<u32, Vec<Made>> = BTreeMap::new();
    for made in chunks {
        // Chunks whose points lie in one of their eighths begin further down; what counts is where they hang.
        by_level.entry(made.cell.level).or_default().push(made);
    }
    while let Some((level, nodes)) = by_level.pop_last() {
        if level == 0 || (by_level.is_empty() && nodes.len() == 1) {
            file.finish()?;
            return Ok(nodes.into_iter().next());
        }
        if progress(0.0).is_break() {
            return Err(PyramidError::Cancelled(folder.to_owned()));
        }
        let mut families: BTreeMap<Cell, Vec<Made>> = BTreeMap::new();
        for node in nodes {
            families.entry(Cell::of(node.cell.first, level - 1)).or_default().push(node);
        }
        let above = by_level.entry(level - 1).or_default();
        for (cell, mut family) in families {
            family.sort_by_key(|node| node.cell);
            let node = match family.len() {
                // One alone stands for its parent.
                1 => family.pop().map(|only| Made { cell, ..only }),
                _ => {
                    let nodes = family.into_iter().map(|made| read_back(made, &mut files));
                    let nodes = nodes.collect::<Result<Vec<_>, _>>()?;
                    Some(joined(cell, nodes, &mut file)?.made)
                }
            };
            above.extend(node);
        }
    }
    file.finish()?;
    Ok(None)
}

/// A node with its surfels.
pub(crate) fn read_back(made: Made, files: &mut OpenFiles) -> Result<Node, PyramidError> {
    let mut columns = Vec::with_capacity(made.columns.len());
    for (column, stored) in made.columns.iter().zip(&made.record.columns) {
        let mut bytes = vec![0; stored.length as usize];
        files.read(&made.file, stored.offset, &mut bytes)?;
        let n = made.record.n_surfels as usize * column.components as usize;
        let values = codec::decode(&bytes, stored.encoding, column.element, n)
            .filter(|_| crc32fast::hash(&bytes) == stored.crc)
            .ok_or_else(|| damaged(&made.file))?;
        columns.push(Column::new(column.name.as_str(), column.components, values));
    }
    let cloud = Cloud::new(made.record.origin, columns);
    let cloud = cloud.map_err(|error| PyramidError::Points(error.to_string()))?;
    Ok(Node { made, cloud })
}

/// The columns of all nodes; leaves come with all of theirs first.
fn all_columns(nodes: &[&Made]) -> Vec<FileColumn> {
    let mut all: Vec<FileColumn> = Vec::new();
    for column in nodes.iter().rev().flat_map(|node| &node.columns) {
        if !all.iter().any(|known| is_same(known, column)) {
            all.push(column.clone());
        }
    }
    all
}

fn is_same(a: &FileColumn, b: &FileColumn) -> bool {
    a.name == b.name && a.components == b.components && a.element == b.element
}

/// The records as they are in the file, where each node's columns follow each other.
fn placed(nodes: &[&Made], columns: &[FileColumn]) -> Vec<NodeRecord> {
    let mut offset = HEADER as u64;
    let mut next_child = 1;
    let mut records = Vec::with_capacity(nodes.len());
    for node in nodes {
        let mut record = node.record.clone();
        record.children[0] = if node.children.is_empty() { 0 } else { next_child };
        next_child += node.children.len() as u32;
        record.columns = vec![Stored::default(); columns.len()];
        for (column, stored) in node.columns.iter().zip(&node.record.columns) {
            if let Some(place) = columns.iter().position(|known| is_same(known, column)) {
                record.columns[place] = Stored { offset, ..*stored };
            }
            offset += u64::from(stored.length);
        }
        records.push(record);
    }
    records
}

/// Says that the work so far cannot be gone on with.
fn damaged(file: &Path) -> PyramidError {
    PyramidError::file(file, "the work so far is damaged; remove its folder and start again")
}

/// Makes sure that what is written can be opened.
fn check(
    records: &[NodeRecord],
    directory: &[u8],
    nodes: &[&Made],
    end: u64,
) -> Result<(), PyramidError> {
    let n_nodes = nodes.len() as u32;
    let fault = (0..).zip(records).find_map(|(number, record)| record.fault(number, n_nodes, end));
    let found = match fault {
        Some(fault) => Some(format!("a node with {fault}")),
        None => layout::header_fault(n_nodes, directory.len() as u64).map(str::to_owned),
    };
    match found {
        Some(found) => Err(PyramidError::Points(format!(
            "expected points that a pyramid can hold, found {found}"
        ))),
        None => Ok(()),
    }
}

/// Writes the file; its length.
fn written(
    nodes: &[&Made],
    records: &[NodeRecord],
    directory: &Directory,
    output: &Path,
) -> Result<u64, PyramidError> {
    let stored: u64 = records.iter().map(NodeRecord::stored_bytes).sum();
    let directory =
        serde_json::to_vec(directory).map_err(|error| PyramidError::Points(error.to_string()))?;
    let mut table = Vec::new();
    records.iter().for_each(|record| record.put(&mut table));
    let part = |offset: u64, bytes: &[u8]| (offset, bytes.len() as u64, crc32fast::hash(bytes));
    let at = HEADER as u64 + stored;
    let n_nodes = u32::try_from(nodes.len())
        .map_err(|_too_many| PyramidError::Points("there are more than 2^32 nodes".to_owned()))?;
    let header = Header {
        n_nodes,
        directory: part(at, &directory),
        nodes: part(at + directory.len() as u64, &table),
    };
    check(records, &directory, nodes, at + directory.len() as u64)?;
    let failed = PyramidError::io(output);
    let write = |out: &mut dyn Write| -> Result<(), PyramidError> {
        out.write_all(&header.bytes()).map_err(&failed)?;
        let (mut files, mut bytes) = (OpenFiles::default(), Vec::new());
        for node in nodes {
            let first = node.record.columns.first().map_or(0, |stored| stored.offset);
            bytes.resize(node.record.stored_bytes() as usize, 0);
            files.read(&node.file, first, &mut bytes)?;
            for stored in &node.record.columns {
                let start = (stored.offset - first) as usize;
                let column = bytes.get(start..start + stored.length as usize);
                if column.map(crc32fast::hash) != Some(stored.crc) {
                    return Err(damaged(&node.file));
                }
            }
            out.write_all(&bytes).map_err(&failed)?;
        }
        out.write_all(&directory).map_err(&failed)?;
        out.write_all(&table).map_err(&failed)
    };
    files::replace(output, write, &failed)?;
    Ok(layout::table_bytes(n_nodes, records.first().map_or(0, |record| record.columns.len()))
        + at
        + directory.len() as u64)
}
