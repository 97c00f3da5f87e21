//! Reading: what there is, then the points node by node.

use crate::attributes::Layout;
use crate::decode::{MOST_BYTES, Points};
use crate::hierarchy;
use crate::metadata::{Encoding, INSTEAD, Metadata};
use std::sync::{Mutex, PoisonError};
use surfelshop_api::columns::POSITION;
use surfelshop_api::format::{CloudHeader, CloudSink, FileSource, PointNode, PointTree, UpAxis};
use surfelshop_api::glam::DVec3;
use surfelshop_api::{Error, Job, Result};

/// The file of the points.
pub(crate) const OCTREE: &str = "octree.bin";
/// Bytes that nodes take at once, stored and as columns.
const MEMORY: u64 = 1 << 28;
/// Most nodes that are decoded at once.
const MOST_PARTS: usize = 64;

/// Reads the cloud of an octree.
///
/// # Errors
/// Where a file is missing or damaged, the host or the system refuses, or the user asked to stop.
pub(crate) fn read(file: &FileSource, clouds: &mut CloudSink<'_>, job: &Job<'_>) -> Result<()> {
    let metadata = Metadata::read(file)?;
    let mut warnings = Vec::new();
    let layout = Layout::new(&metadata, |column| clouds.wants(column), &mut warnings)?;
    let octree = file.beside(OCTREE)?;
    let asked = clouds.nodes().map(<[PointNode]>::to_vec);
    let mut header = header(&metadata, &layout);
    if asked.is_some() {
        let (low, side, spacing) = (metadata.low(), metadata.side(), metadata.spacing);
        header.tree = Some(PointTree { low, side, spacing, nodes: Vec::new() });
    }
    let nodes = match asked {
        Some(nodes) if !nodes.is_empty() => nodes,
        _ => {
            let nodes = file.beside(hierarchy::NAME)?;
            let mut nodes =
                hierarchy::nodes(&nodes, metadata.hierarchy.first_chunk_size, octree.length())?;
            // As they lie in the file, whose order is that of the points.
            nodes.sort_by_key(|node| node.place);
            let rows = nodes.iter().map(|node| node.points).fold(0, u64::saturating_add);
            if rows != metadata.points {
                warnings.push(format!(
                    "metadata.json announces {} points, and the octree has {rows}",
                    metadata.points
                ));
            }
            match &mut header.tree {
                // Its nodes say how many points there are, which no command has all of at once.
                Some(tree) => tree.nodes.clone_from(&nodes),
                None => header.rows = Some(rows),
            }
            nodes
        }
    };
    for warning in &warnings {
        clouds.warn(warning);
    }
    if !clouds.begin(&header)? {
        return Ok(());
    }
    points(&octree, &layout, &nodes, clouds, job)
}

/// The header as the host takes it, without the number of points.
fn header(metadata: &Metadata, layout: &Layout) -> CloudHeader {
    let position = metadata.attributes.iter().find(|attribute| attribute.name == POSITION);
    let corner = |values: &[f64]| match *values {
        [x, y, z] => Some(DVec3::new(x, y, z)).filter(|corner| corner.is_finite()),
        _ => None,
    };
    // Of the points; the root's cube reaches further.
    let bounds =
        position.and_then(|position| Some([corner(&position.min)?, corner(&position.max)?]));
    let comments = [&metadata.description].into_iter().filter(|text| !text.is_empty());
    let version: String = metadata.version.chars().filter(|c| !c.is_control()).take(10).collect();
    let encoding = match layout.encoding {
        Encoding::Plain => "",
        Encoding::Brotli => ", compressed",
    };
    CloudHeader {
        format: format!("Potree {version}{encoding}"),
        name: metadata.name.clone(),
        columns: layout.columns.iter().map(|column| column.file.clone()).collect(),
        bounds,
        step: Some(DVec3::from_array(metadata.scale).abs()),
        up: UpAxis::Z,
        coordinate_system: metadata.projection.clone(),
        comments: comments.cloned().collect(),
        ..CloudHeader::default()
    }
}

/// Hands over the points of nodes, which are decoded beside each other.
fn points(
    octree: &FileSource,
    layout: &Layout,
    nodes: &[PointNode],
    clouds: &mut CloudSink<'_>,
    job: &Job<'_>,
) -> Result<()> {
    let bytes = (layout.point_bytes + layout.column_bytes()) as u64;
    let all = nodes.iter().map(|node| node.points).fold(0, u64::saturating_add).max(1) as f64;
    let (mut rest, mut n_read) = (nodes, 0);
    while !rest.is_empty() {
        // At least one, and as many as memory is for.
        let mut n_points = 0u64;
        let fits = |node: &&PointNode| {
            n_points = n_points.saturating_add(node.points);
            n_points.saturating_mul(bytes) <= MEMORY
        };
        let n = rest.iter().take(MOST_PARTS).take_while(fits).count().max(1);
        let (now, later) = rest.split_at(n);
        let n_now: u64 = now.iter().map(|node| node.points).sum();
        let share = n_read as f64 / all..(n_read + n_now) as f64 / all;
        let decoded: Vec<Mutex<Option<Result<Points>>>> =
            now.iter().map(|_| Mutex::new(None)).collect();
        job.each_piece(n, share, |i| {
            let points = node_points(octree, layout, &now[i]);
            *decoded[i].lock().unwrap_or_else(PoisonError::into_inner) = Some(points);
        })?;
        for points in decoded {
            job.check()?;
            let points = points.into_inner().unwrap_or_else(PoisonError::into_inner);
            let missing = || Error::new("the points of a node were not decoded");
            points.ok_or_else(missing)??.hand_over(clouds)?;
        }
        n_read += n_now;
        rest = later;
    }
    Ok(())
}

/// Whether a node of so many points can have so many bytes, before they are read.
fn check_length(layout: &Layout, n: usize, len: u64) -> Result<()> {
    let point_bytes = layout.point_bytes;
    let expected = n.checked_mul(point_bytes).filter(|bytes| *bytes <= MOST_BYTES);
    let fits = expected.is_some_and(|expected| match layout.encoding {
        Encoding::Plain => len == expected as u64,
        // What does not become smaller is stored, with a few bytes for each block of it.
        Encoding::Brotli => len <= (expected + expected / 1024 + 1024) as u64,
    });
    let line = || {
        Error::new(format!(
            "expected {point_bytes} bytes a point, {MOST_BYTES} at most, found {len} in all"
        ))
    };
    if fits { Ok(()) } else { Err(line()) }
}

/// The points of a node.
fn node_points(octree: &FileSource, layout: &Layout, node: &PointNode) -> Result<Points> {
    let [at, len] = node.place;
    let decoded = || {
        let n = usize::try_from(node.points)?;
        check_length(layout, n, len)?;
        Points::decode(layout, &octree.bytes_at(at, len)?, n)
    };
    decoded().map_err(|error| {
        let PointNode { level, cell, points, .. } = node;
        Error::new(format!(
            "{OCTREE}: the node of level {level}, cell {cell:?} with {points} points in {len} bytes at {at} is damaged: \
             {error}; {INSTEAD}"
        ))
    })
}
