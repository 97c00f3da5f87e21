//! A chunk: its points with those around, what they lack estimated, as leaves and the nodes above them.

use super::around::Around;
use super::cells::Cube;
use super::nodes::{Made, NodeFile};
use super::plan::Plan;
use super::spool::{SpoolReader, buffers};
use super::tree::tree;
use crate::error::PyramidError;
use std::path::{Path, PathBuf};
use surfelshop_api::columns::Element;
use surfelshop_api::format::{CloudHeader, FileColumn};
use surfelshop_cloud::convert::{Collection, SideGuide, assembled};
use surfelshop_cloud::{Buffer, Cloud, Column, Progress, ReadOptions, Summary, files};
use surfelshop_geometry::{Bounds, part};

/// Spacings of a surface that estimates look beyond a chunk: normals of rough points are fitted to up to 1024 of those
/// around, a patch of 18 spacings to all sides.
pub(crate) const HALO: f64 = 18.0;

/// Points from which on the spacing can be told from their number; of fewer all around are looked at.
pub(crate) const FEW: usize = 1000;

/// Points around are at most one for so many of the chunk's own.
pub(crate) const MOST_AROUND: usize = 2;

/// The column that says which points are of the chunk.
const OWN: &str = "surfelshop own";

/// What is known of all chunks.
pub(super) struct Chunks<'a> {
    pub(super) plan: &'a Plan,
    pub(super) collection: &'a Collection,
    pub(super) cube: Cube,
    pub(super) folder: &'a Path,
    /// The sides of normals, where files do not say them.
    pub(super) guide: Option<SideGuide>,
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
        kept_or_made(&self.path(number), |path| self.make(number, path, progress))
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
        let (source, guide) = (self.collection.source.clone(), self.guide.as_ref());
        let loaded = assembled(&header, columns, source, guide, &options);
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
        let mut file = NodeFile::create(path)?;
        let node = tree(&cloud, &self.cube, cell, &mut file)?;
        file.finish()?;
        Ok((Some(node.made), counts))
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
        (has(surfelshop_api::columns::NORMAL) && has_radius) || self.collection.are_splats()
    }
}

/// The nodes of a part with what is said of them: those of an earlier run, where it made them.
pub(crate) fn kept_or_made<T: serde::Serialize + serde::de::DeserializeOwned>(
    path: &Path,
    make: impl FnOnce(&Path) -> Result<(Option<Made>, T), PyramidError>,
) -> Result<(Option<Made>, T), PyramidError> {
    let list = path.with_extension("json");
    if let Ok(text) = std::fs::read(&list)
        && let Ok((known, said)) = serde_json::from_slice::<(Option<Made>, T)>(&text)
        && path.metadata().is_ok_and(|found| Some(found.len()) == stored(known.as_ref()))
    {
        return Ok((known, said));
    }
    let made = make(path)?;
    let text =
        serde_json::to_vec(&made).map_err(|error| PyramidError::Points(error.to_string()))?;
    files::write_whole(&list, &text).map_err(PyramidError::io(&list))?;
    Ok(made)
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
