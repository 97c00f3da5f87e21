//! A cloud in memory, or several, as formats write them: batch by batch, in world coordinates.

use crate::cloud::Cloud;
use crate::cloud::buffer::Buffer;
use crate::cloud::column::Column;
use crate::cloud::roles::{Misfit, Motion};
use crate::formats::stream::slice;
use surfelshop_api::columns::{
    ColumnView, Element, NORMAL, POSITION, TANGENT_U, TANGENT_V, Values,
};
use surfelshop_api::format::{BATCH, CloudHeader, CloudSourceHost, FileColumn, Pose, SCAN};
use surfelshop_api::glam::{DQuat, DVec3};
use surfelshop_api::{CloudView, Error, Result};

/// A part of a cloud that is written as one cloud: the surfels of a scan, or all.
struct Part {
    header: CloudHeader,
    /// The surfels of it; all where there is no list.
    indices: Option<Vec<u32>>,
}

/// Hands a cloud over in batches.
pub(crate) struct CloudBatches {
    cloud: Cloud,
    parts: std::vec::IntoIter<Part>,
    current: Option<Part>,
    n_done: usize,
    /// What the batch that was handed over last borrows from.
    positions: Vec<f64>,
    gathered: Vec<(usize, Buffer)>,
}

impl CloudBatches {
    /// A cloud as one; or, for a format that takes several, each scan by itself in its own axes.
    pub(crate) fn new(cloud: &Cloud, several: bool) -> Self {
        let scans = scans(cloud).filter(|_| several);
        let parts = match scans {
            Some(scans) => scans
                .into_iter()
                .enumerate()
                .map(|(number, indices)| part(cloud, Some((number, indices))))
                .collect(),
            None => vec![part(cloud, None)],
        };
        Self {
            cloud: cloud.clone(),
            parts: parts.into_iter(),
            current: None,
            n_done: 0,
            positions: Vec::new(),
            gathered: Vec::new(),
        }
    }
}

/// The surfels of each scan; `None` where the cloud has not several.
fn scans(cloud: &Cloud) -> Option<Vec<Vec<u32>>> {
    let known = &cloud.source().scans;
    let column = cloud.column(SCAN).filter(|column| column.components() == 1)?;
    if known.len() < 2 {
        return None;
    }
    let mut scans = vec![Vec::new(); known.len()];
    for (surfel, number) in column.values().iter_f64().enumerate() {
        // A number beyond the scans that are known is of nobody: the first takes it.
        let number =
            if number >= 0.0 && (number as usize) < known.len() { number as usize } else { 0 };
        scans[number].push(u32::try_from(surfel).ok()?);
    }
    Some(scans)
}

fn part(cloud: &Cloud, scan: Option<(usize, Vec<u32>)>) -> Part {
    let source = cloud.source();
    let whole = scan.is_none();
    let columns = cloud.columns().iter().filter(|column| whole || column.name() != SCAN);
    let columns = columns.map(|column| {
        let element =
            if column.name() == POSITION { Element::F64 } else { column.values().element() };
        FileColumn::new(column.name(), column.components(), element).with_role(column.role())
    });
    let (number, indices) = scan.map_or((None, None), |(number, list)| (Some(number), Some(list)));
    let facts = match (number, source.scans.as_slice()) {
        (Some(number), scans) => scans.get(number),
        (None, [only]) => Some(only),
        _ => None,
    };
    let pose = if number.is_some() { facts.map(|scan| scan.pose) } else { None };
    let pose = pose.unwrap_or_default();
    let bounds = match &indices {
        None if !cloud.is_empty() => {
            let facts = cloud.facts();
            Some([facts.bounds_min, facts.bounds_max])
        }
        _ => None,
    };
    let rows = indices.as_ref().map_or(cloud.len(), Vec::len) as u64;
    let header = CloudHeader {
        name: facts.map(|scan| scan.name.clone()).unwrap_or_default(),
        rows: Some(rows),
        columns: columns.collect(),
        bounds,
        step: source.step,
        pose,
        scanner: facts.and_then(|scan| scan.scanner).map(|place| pose.back(place)),
        up: source.up_to_write(),
        metres_per_unit: source.metres_per_unit,
        coordinate_system: source.coordinate_system.clone(),
        time: source.time.clone(),
        grid: source.grid.filter(|[w, h]| u64::from(*w) * u64::from(*h) == rows),
        has_faces: number.is_none() && !cloud.faces().is_empty(),
        comments: source.comments.clone(),
        ..CloudHeader::default()
    };
    Part { header, indices }
}

/// Values of some surfels.
fn gathered(column: &Column, surfels: &[u32]) -> Buffer {
    let components = column.components() as usize;
    macro_rules! gather {
        ($($variant:ident),*) => {
            match column.values() {
                $(Buffer::$variant(vec) => Buffer::$variant(
                    surfels
                        .iter()
                        .flat_map(|&i| vec[i as usize * components..][..components].iter().copied())
                        .collect(),
                ),)*
            }
        };
    }
    gather!(I8, U8, I16, U16, I32, U32, F32, F64)
}

/// Directions in the axes of a scan.
fn turned_back(values: Buffer, rotation: DQuat) -> Buffer {
    match values {
        Buffer::F32(mut values) if rotation != DQuat::IDENTITY => {
            let back = rotation.inverse();
            for direction in values.as_chunks_mut::<3>().0 {
                let turned = back * DVec3::from_array(direction.map(f64::from));
                *direction = turned.as_vec3().to_array();
            }
            Buffer::F32(values)
        }
        other => other,
    }
}

/// Values turned as the role of their column says.
fn by_role(column: &Column, values: Buffer, motion: &Motion) -> Result<Buffer> {
    let what = (column.name(), column.role(), column.components());
    match motion.moved(what, &values) {
        Ok(turned) => Ok(turned.unwrap_or(values)),
        Err(Misfit { expected, found }) => {
            Err(Error::new(format!("expected {expected}, found {found}")))
        }
    }
}

impl CloudSourceHost for CloudBatches {
    fn next_cloud(&mut self) -> Result<Option<CloudHeader>> {
        self.current = self.parts.next();
        self.n_done = 0;
        Ok(self.current.as_ref().map(|part| part.header.clone()))
    }

    fn next_batch(&mut self) -> Result<Option<CloudView<'_>>> {
        let Some(part) = &self.current else { return Ok(None) };
        let n_rows = part.indices.as_ref().map_or(self.cloud.len(), Vec::len);
        if self.n_done >= n_rows {
            return Ok(None);
        }
        let range = self.n_done..(self.n_done + BATCH).min(n_rows);
        self.n_done = range.end;
        let (origin, all) = (self.cloud.origin(), self.cloud.positions());
        self.positions.clear();
        self.gathered.clear();
        let surfels = part.indices.as_ref().map(|indices| &indices[range.clone()]);
        let pose: Pose = part.header.pose;
        let world = |i: usize| origin + all[i].as_dvec3();
        match surfels {
            None => self.positions.extend(range.clone().flat_map(|i| world(i).to_array())),
            Some(list) => self
                .positions
                .extend(list.iter().flat_map(|&i| pose.back(world(i as usize)).to_array())),
        }
        if let Some(list) = surfels {
            let back = Motion::new(pose.rotation.inverse(), 1.0);
            for (place, column) in self.cloud.columns().iter().enumerate() {
                let values = match column.name() {
                    POSITION | SCAN => continue,
                    NORMAL | TANGENT_U | TANGENT_V => {
                        turned_back(gathered(column, list), pose.rotation)
                    }
                    _ => by_role(column, gathered(column, list), &back)?,
                };
                self.gathered.push((place, values));
            }
        }
        let mut columns = Vec::with_capacity(part.header.columns.len());
        for (place, column) in self.cloud.columns().iter().enumerate() {
            let components = column.components() as usize;
            let values = match (column.name(), surfels) {
                (POSITION, _) => Values::F64(&self.positions),
                (SCAN, Some(_)) => continue,
                (_, None) => {
                    slice(column.values(), range.start * components..range.end * components)
                }
                (_, Some(_)) => match self.gathered.iter().find(|(other, _)| *other == place) {
                    Some((_, values)) => values.as_values(),
                    None => continue,
                },
            };
            let (name, components, generation) =
                (column.name(), column.components(), column.generation());
            columns.push(ColumnView { name, components, generation, values });
        }
        let is_last = range.end == n_rows && part.header.has_faces;
        let faces = if is_last { self.cloud.faces() } else { &[] };
        let len = range.len();
        Ok(Some(CloudView { len, columns, faces, ..CloudView::default() }))
    }
}
