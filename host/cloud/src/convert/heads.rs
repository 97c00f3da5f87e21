//! The heads of files as their clouds are handed over.

use crate::assemble::TrainedSplats;
use crate::error::ReadError;
use crate::inspect::heads;
use crate::options::ReadOptions;
use std::path::{Path, PathBuf};
use surfelshop_api::columns::SPLAT_SCALE;
use surfelshop_api::format::CloudHeader;
use surfelshop_geometry::silent;

/// The heads of files.
pub(super) struct Heads {
    /// Those of all clouds.
    pub(super) headers: Vec<CloudHeader>,
    /// For each file the number of its first cloud.
    pub(super) first: Vec<usize>,
    /// For each file whether columns are made of others, so that all are read.
    pub(super) whole: Vec<bool>,
    /// Splats stay as their trainer wrote them.
    pub(super) trained_splats: bool,
}

impl Heads {
    /// Reads the heads. Splats become what the host has for them; they stay as they are `for_trainers`, which other
    /// programs read, unless clouds come together of which one is not so.
    pub(super) fn of(
        inputs: &[PathBuf],
        read: &ReadOptions<'_>,
        for_trainers: bool,
    ) -> Result<Self, ReadError> {
        let (mut headers, mut first) = (Vec::<CloudHeader>::new(), Vec::new());
        for input in inputs {
            first.push(headers.len());
            headers.extend(heads(input, &ReadOptions { progress: &silent, ..*read })?);
        }
        // What is odd is told where the points are read.
        let splats = |header| TrainedSplats::of(header, &mut Vec::new());
        let splats: Vec<Option<TrainedSplats>> = headers.iter().map(splats).collect();
        let any = |are_raw: bool| splats.iter().flatten().any(|found| found.are_raw() == are_raw);
        let any_ready = any(false) || headers.iter().any(|head| head.column(SPLAT_SCALE).is_some());
        let trained_splats = for_trainers && !(any(true) && any_ready);
        let mut whole = vec![false; inputs.len()];
        if !trained_splats {
            for (i, (header, splats)) in headers.iter_mut().zip(splats).enumerate() {
                let Some(splats) = splats else { continue };
                header.clone_from(splats.header());
                if let Some(whole) = whole.get_mut(file_of(&first, i)) {
                    *whole = true;
                }
            }
        }
        Ok(Self { headers, first, whole, trained_splats })
    }

    /// The file of each cloud.
    pub(super) fn files<'a>(&self, inputs: &'a [PathBuf]) -> Vec<&'a Path> {
        let file = |i| inputs.get(file_of(&self.first, i)).map_or(Path::new(""), PathBuf::as_path);
        (0..self.headers.len()).map(file).collect()
    }
}

/// The number of the file whose cloud has this number.
fn file_of(first: &[usize], cloud: usize) -> usize {
    first.partition_point(|first| *first <= cloud).saturating_sub(1)
}
