//! Which points are worked on together: cells of an octree with no more than fit into memory.

use super::cells::{Cell, Cube, LEVELS};
use super::spool::{Segment, Spool, SpoolReader, Spooler};
use crate::error::PyramidError;
use std::path::Path;
use surfelshop_api::format::CloudHeader;

/// Points of a cell, in segments of several files.
pub(super) struct CellPoints {
    pub(super) cell: Cell,
    pub(super) rows: u64,
    /// Number of the file, and the segment.
    pub(super) segments: Vec<(usize, Segment)>,
}

/// All points, and how they are divided.
pub(super) struct Plan {
    pub(super) spools: Vec<Spool>,
    /// Along the curve; no two share points.
    pub(super) cells: Vec<CellPoints>,
    /// Cells to be worked on, with the range of `cells` in them.
    pub(super) chunks: Vec<(Cell, std::ops::Range<usize>)>,
}

/// Finer levels that a cell with too many points is divided into at a time.
const FINER: u32 = 4;

impl Plan {
    /// Divides points; no chunk has more than `most`, but where more lie in one of the smallest cells.
    pub(super) fn of(
        spools: Vec<Spool>,
        (header, cube): (&CloudHeader, Cube),
        folder: &Path,
        most: u64,
        budget: usize,
    ) -> Result<Self, PyramidError> {
        let mut plan = Self { cells: cells(&spools, 0), spools, chunks: Vec::new() };
        // Cells that hold too many points are divided first, since the others do not change by it.
        while let Some(at) =
            plan.cells.iter().position(|cell| cell.rows > most && cell.cell.level < LEVELS)
        {
            let large = plan.cells.remove(at);
            let finer = plan.divided(&large, (header, cube), folder, budget)?;
            let number = plan.spools.len();
            plan.spools.push(finer);
            plan.cells.splice(at..at, cells(&plan.spools[number..], number));
        }
        plan.divide(Cell::ROOT, 0..plan.cells.len(), most);
        Ok(plan)
    }

    /// The points of a cell in finer ones.
    fn divided(
        &self,
        large: &CellPoints,
        (header, cube): (&CloudHeader, Cube),
        folder: &Path,
        budget: usize,
    ) -> Result<Spool, PyramidError> {
        let Cell { first, level } = large.cell;
        let path = folder.join(format!("finer-{level}-{first:x}.bin"));
        if let Some((spool, ())) = Spool::sealed(&path) {
            return Ok(spool);
        }
        let level = (level + FINER).min(LEVELS);
        let mut spooler = Spooler::new(header, cube, level, &path, budget)?;
        let mut reader = SpoolReader::new(header);
        for (file, segment) in &large.segments {
            let rows = reader.read(&self.spools[*file].path, segment)?;
            spooler.rows(&rows.positions, &rows.columns)?;
        }
        let spool = spooler.finish()?;
        spool.seal(&())?;
        Ok(spool)
    }

    fn divide(&mut self, cell: Cell, range: std::ops::Range<usize>, most: u64) {
        let rows: u64 = self.cells[range.clone()].iter().map(|cell| cell.rows).sum();
        if rows == 0 {
            return;
        }
        let is_whole = range.len() == 1 && self.cells[range.start].cell.level <= cell.level;
        if rows <= most || is_whole {
            self.chunks.push((cell, range));
            return;
        }
        let mut start = range.start;
        for child in cell.children() {
            let inside = &self.cells[start..range.end];
            let n = inside.partition_point(|known| known.cell.first < child.end());
            self.divide(child, start..start + n, most);
            start += n;
        }
    }
}

/// The cells of files, along the curve.
fn cells(spools: &[Spool], first: usize) -> Vec<CellPoints> {
    let mut all: Vec<(usize, Segment)> = Vec::new();
    for (i, spool) in spools.iter().enumerate() {
        all.extend(spool.segments.iter().map(|segment| (first + i, segment.clone())));
    }
    // Within a cell the points stay in the order of the files.
    all.sort_by_key(|(file, segment)| (segment.cell, *file, segment.offset));
    let mut cells: Vec<CellPoints> = Vec::new();
    for (file, segment) in all {
        let rows = u64::from(segment.rows);
        match cells.last_mut().filter(|last| last.cell == segment.cell) {
            Some(last) => {
                last.rows += rows;
                last.segments.push((file, segment));
            }
            None => {
                cells.push(CellPoints { cell: segment.cell, rows, segments: vec![(file, segment)] })
            }
        }
    }
    cells
}
