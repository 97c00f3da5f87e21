//! The sides that normals face, found once for all chunks from a sample of the points: a chunk alone does not show what
//! can be seen.

use super::plan::Plan;
use super::spool::SpoolReader;
use super::work::Work;
use crate::error::PyramidError;
use glam::DVec3;
use surfelshop_cloud::convert::{Collection, SideGuide};
use surfelshop_cloud::{Progress, ReadFault, ReadOptions, files};
use surfelshop_geometry::hashing::scattered;

/// The sample is one in so many points, but for small clouds.
const ONE_IN: u64 = 16;
/// Sample points at least, where there are so many.
const FEWEST: u64 = 200_000;
/// Sample points at most: sides of so many take about seven seconds of a processor.
const MOST: u64 = 1 << 20;

/// The guide that an earlier run or another process made, or a new one; `None` where no normals are estimated, or the files
/// say all sides.
pub(super) fn kept_or_made(
    plan: &Plan,
    collection: &Collection,
    work: &Work,
    read: &ReadOptions<'_>,
    progress: Progress<'_>,
) -> Result<Option<SideGuide>, PyramidError> {
    let has_normals = collection.all_have(surfelshop_api::columns::NORMAL);
    if has_normals || collection.are_splats() || !SideGuide::is_needed(&collection.source) {
        return Ok(None);
    }
    let path = work.folder.join("sides.bin");
    // No bytes say that there was no guide.
    if let Ok(bytes) = std::fs::read(&path)
        && let Some(known) = known(&bytes)
    {
        return Ok(known);
    }
    let points = sample(plan, collection, work)?;
    let options = ReadOptions { progress, ..*read };
    let guide = match SideGuide::of(&points, &collection.source, &options) {
        Ok(guide) => guide,
        Err(ReadFault::Cancelled) => return Err(PyramidError::Cancelled(work.folder.clone())),
        Err(fault) => return Err(PyramidError::Points(fault.to_string())),
    };
    let bytes = guide.as_ref().map(SideGuide::to_bytes).unwrap_or_default();
    files::write_whole(&path, &bytes).map_err(PyramidError::io(&path))?;
    Ok(guide)
}

fn known(bytes: &[u8]) -> Option<Option<SideGuide>> {
    if bytes.is_empty() { Some(None) } else { SideGuide::from_bytes(bytes).map(Some) }
}

/// One point, by chance, of each few that follow each other in the order of all: at even distances they would be those of
/// some lines of an organised scan.
fn sample(plan: &Plan, collection: &Collection, work: &Work) -> Result<Vec<DVec3>, PyramidError> {
    let all: u64 = plan.cells.iter().map(|cell| cell.rows).sum();
    let wanted = (all / ONE_IN).clamp(FEWEST, MOST).min(work.most);
    let every = all.div_ceil(wanted.max(1)).max(1);
    let mut reader = SpoolReader::new(&collection.header);
    let mut points = Vec::new();
    points
        .try_reserve((all / every) as usize + 1)
        .map_err(|error| PyramidError::Points(error.to_string()))?;
    let (mut block, mut before) = (0, 0);
    for (file, segment) in plan.cells.iter().flat_map(|cell| &cell.segments) {
        let rows = u64::from(segment.rows);
        let chosen = |block: u64| block * every + scattered(block) % every;
        if chosen(block) < before + rows {
            let positions = reader.positions(&plan.spools[*file].path, segment)?;
            while let Some(position) = positions.get(chosen(block).saturating_sub(before) as usize)
            {
                points.push(DVec3::from_array(*position));
                block += 1;
            }
        }
        before += rows;
    }
    Ok(points)
}
